// What ends the program from outside: unfinished files go, the exit code is 128 + N.
#ifndef TESSERA_CLI_SIGNALS_H_
#define TESSERA_CLI_SIGNALS_H_

#include "base/file_names.h"

namespace tessera::cli {

// From here on. Signals that whoever started the program had ignored (nohup) stay so.
void CatchSignals();

// A signal that comes while one of these lives takes effect at its end.
class SignalsWait {
 public:
  SignalsWait();

 private:
  base::FileNames::Step step_;
};

// For a handler that ends the process: whether it is to, see base::FileNames::MayEnd. What is kept is raised
// again.
bool MayEnd(int signal);

// Removes unfinished outputs for good: whatever other threads are at, no file is made after it.
void EndOutputs();

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
