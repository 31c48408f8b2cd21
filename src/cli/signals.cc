// The handler and what it waits for.
#include "cli/signals.h"

#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>

#include "cli/messages.h"
#include "tessera/context.h"
#include "tessera/io.h"

namespace tessera::cli {
namespace {

std::atomic<bool> in_job = false;
std::atomic<int> asked = 0;

[[noreturn]] void Leave(int signal) {
  EndOutputs();
  _exit(128 + signal);
}

extern "C" void OnSignal(int signal) {
  if (in_job.load() && signal != SIGPIPE) {
    if (signal == SIGXFSZ || asked.exchange(signal) == 0) return;
  }
  if (MayEnd(signal)) Leave(signal);
}

std::atomic<bool> refused = false;  // memory, to whoever asked with new

// What a library cannot tell is thrown away, and ends the process.
void OnRefused() {
  refused.store(true);
  throw std::bad_alloc();
}

[[noreturn]] void EndForMemory() {
  constexpr char kMessage[] = "tessera: error: memory: refused by the system\n";
  if (write(MessagesDescriptor(), kMessage, sizeof kMessage - 1) >= 0) _exit(1);
  _exit(1);
}

// A fault of the program or of a library: the files go, the signal does what it does.
extern "C" void OnFault(int signal) {
  RemoveUnfinishedOutputs();
  if (signal == SIGABRT && refused.load()) EndForMemory();
  ::signal(signal, SIG_DFL);
  raise(signal);
}

// Memory that was refused where nobody could be told of it: inside a destructor, a library's callback.
[[noreturn]] void OnTerminate() {
  RemoveUnfinishedOutputs();
  try {
    if (std::current_exception()) std::rethrow_exception(std::current_exception());
  } catch (const std::bad_alloc&) {
    EndForMemory();
  } catch (...) {
  }
  std::abort();
}

}  // namespace

void CatchSignals() {
  std::set_terminate(OnTerminate);
  std::set_new_handler(OnRefused);
  Context::Default().files().OnKept([](int signal) { raise(signal); });
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ, SIGXCPU, SIGQUIT}) {
    struct sigaction before {};
    if (sigaction(signal, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) continue;
    sigaction(signal, &action, nullptr);
  }
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  action.sa_handler = OnFault;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) sigaction(signal, &action, nullptr);
#endif
}

bool MayEnd(int signal) { return Context::Default().files().MayEnd(signal); }

void EndOutputs() {
  // What another thread's library opens from here on, by the name of a file that is no more, it cannot make.
  const rlimit none{};
  setrlimit(RLIMIT_NOFILE, &none);
  RemoveUnfinishedOutputs();
}

SignalsWait::SignalsWait() : step_(Context::Default().files()) {}

SignalsEndJob::SignalsEndJob() { in_job.store(true); }

SignalsEndJob::~SignalsEndJob() {
  in_job.store(false);
  if (const int signal = asked.load(); signal != 0) Leave(signal);
}

bool SignalsEndJob::Alive() { return in_job.load(); }

int SignalsEndJob::Asked() { return asked.load(); }

void EndBySignal(int signal) {
  while (!MayEnd(signal)) pause();
  Leave(signal);
}

}  // namespace tessera::cli
