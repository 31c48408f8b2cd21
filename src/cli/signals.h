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

// Whether one lives.
bool SignalsAreWaiting();

// While one lives, a signal ends the line that runs, where it asks, and the process at this one's end; a
// second signal ends the process at once. A file that has become too large (SIGXFSZ) is the line's failure.
class SignalsEndJob {
 public:
  SignalsEndJob();
  ~SignalsEndJob();
  SignalsEndJob(const SignalsEndJob&) = delete;
  SignalsEndJob& operator=(const SignalsEndJob&) = delete;

  static bool Alive();
  // The signal that came; 0 for none.
  static int Asked();
};

// As if it had come.
[[noreturn]] void EndBySignal(int signal);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_SIGNALS_H_
