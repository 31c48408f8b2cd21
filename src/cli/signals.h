// What ends the program from outside: unfinished files go, the exit code is 128 + N.
#ifndef TESSERA_CLI_SIGNALS_H_
#define TESSERA_CLI_SIGNALS_H_

namespace tessera::cli {

// From here on. Signals that whoever started the program had ignored (nohup) stay so.
void CatchSignals();

// A signal that comes while one of these lives takes effect at its end.
class SignalsWait {
 public:
  SignalsWait();
  ~SignalsWait();
  SignalsWait(const SignalsWait&) = delete;
  SignalsWait& operator=(const SignalsWait&) = delete;
};

}  // namespace tessera::cli

#endif  // TESSERA_CLI_SIGNALS_H_
