// The handler and what it waits for.
#include "cli/signals.h"

#include <signal.h>
#include <unistd.h>

#include <atomic>

#include "tessera/io.h"

namespace tessera::cli {
namespace {

std::atomic<bool> waiting = false;
std::atomic<int> waited = 0;

void Leave(int signal) {
  RemoveUnfinishedOutputs();
  _exit(128 + signal);
}

extern "C" void OnSignal(int signal) {
  if (waiting.load()) {
    waited.store(signal);
  } else {
    Leave(signal);
  }
}

}  // namespace

void CatchSignals() {
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ, SIGXCPU, SIGQUIT}) {
    struct sigaction before {};
    if (sigaction(signal, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) continue;
    sigaction(signal, &action, nullptr);
  }
}

SignalsWait::SignalsWait() { waiting.store(true); }

SignalsWait::~SignalsWait() {
  waiting.store(false);
  if (const int signal = waited.load(); signal != 0) Leave(signal);
}

}  // namespace tessera::cli
