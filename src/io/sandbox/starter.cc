// The starter's loop, and the program's side of it.
#include "io/sandbox/starter.h"

#include <OpenImageIO/imageio.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <functional>
#include <limits>
#include <mutex>
#include <set>
#include <utility>

#ifdef __linux__
#include <sys/prctl.h>
#endif

#include "io/sandbox/message.h"
#include "tessera/error_kind.h"
#include "tessera/sandbox.h"

namespace tessera {
namespace io::sandbox {
namespace {

constexpr double kForEver = std::numeric_limits<double>::infinity();

struct Order {
  int end = 0;          // the process to be ended; 0: start one
  bool answer = false;  // with its number, or with how it ended
  ChildLimits limits;
};

// The program's side.
std::mutex g_mutex;  // of the rest
std::unique_ptr<Channel> g_starter;
int g_pid = 0;
std::string g_why_not = "it was not started (StartSandbox)";
std::function<void()> g_load;
bool g_in_child = false;

int Start(const ChildLimits& limits, std::vector<Descriptor>& descriptors) {
  const int pid = descriptors.size() == 2 ? ::fork() : -1;
  if (pid != 0) return pid;
  g_in_child = true;
  RunChild(descriptors[0].Release(), descriptors[1].Release(), limits);
}

int End(int pid) {
  ::kill(pid, SIGKILL);  // nothing where it has ended; nobody else has the number until it is waited for
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) continue;
  return status;
}

[[noreturn]] void Run(Channel channel) {
#ifdef __linux__
  ::prctl(PR_SET_NAME, "tessera starter");
#endif
  // Out of the terminal's reach: the program decides what a key ends.
  ::setpgid(0, 0);
  OIIO::ImageInput::create("png");  // finds its plug-ins, once for all readers
  std::set<int> alive;
  std::string bytes;
  std::vector<Descriptor> descriptors;
  while (channel.Receive(bytes, kForEver, &descriptors) == Channel::Received::kMessage) {
    const auto order = MessageReader(bytes).Get<Order>();
    if (order.end == 0) {
      const int pid = Start(order.limits, descriptors);
      if (pid > 0) alive.insert(pid);
      channel.Send(MessageWriter().Put(pid).bytes());
    } else {
      const int status = alive.erase(order.end) > 0 ? End(order.end) : 0;
      if (order.answer) channel.Send(MessageWriter().Put(status).bytes());
    }
    descriptors.clear();
  }
  for (const int pid : alive) End(pid);
  ::_exit(0);
}

// What the starter answers, 0 where that is not wanted; -1 where it is gone.
int Tell(const Order& order, const std::vector<int>& descriptors) {
  const std::lock_guard lock(g_mutex);
  std::string answer;
  if (!g_starter || !g_starter->Send(MessageWriter().Put(order).bytes(), descriptors)) return -1;
  if (!order.answer) return 0;
  if (g_starter->Receive(answer, kForEver) != Channel::Received::kMessage) return -1;
  return MessageReader(answer).Get<int>();
}

}  // namespace

std::unique_ptr<Child> StartChild(const std::string& file, int input, const ChildLimits& limits) {
  std::string why;
  {
    const std::lock_guard lock(g_mutex);
    why = g_why_not;
  }
  auto [ours, theirs] = MakeSockets();
  int pid = -1;
  if (why.empty()) {
    if (theirs.number() >= 0) pid = Tell({0, true, limits}, {theirs.number(), input});
    if (pid < 0) why = "it starts no process";
  }
  if (!why.empty()) {
    throw SystemError(file, "is to be read in a sandbox, and " + why +
                                "; --no-sandbox (Policy::sandbox) has it read by the program itself");
  }
  return std::make_unique<Child>(pid, Channel(std::move(ours)));
}

Child::~Child() {
  if (pid_ != 0) Tell({pid_, false, {}}, {});
}

std::string Child::End() {
  const int status = pid_ == 0 ? 0 : Tell({std::exchange(pid_, 0), true, {}}, {});
  if (WIFEXITED(status) && WEXITSTATUS(status) == kSandboxWantsLibraries && g_load) g_load();
  if (WIFEXITED(status)) return "ended by itself (" + std::to_string(WEXITSTATUS(status)) + ")";
  const int signal = WTERMSIG(status);
  const std::string name = "signal " + std::to_string(signal) + ", " + ::strsignal(signal);
  switch (signal) {
    case SIGSYS:
      return "asked the system for something that readers may not do, and was ended";
    case SIGXCPU:
      return "took more of the processors' time than it is allowed";
    case SIGKILL:
      return "was killed (" + name + ")";
    default:
      return "crashed (" + name + ")";
  }
}

}  // namespace io::sandbox

using namespace io::sandbox;  // NOLINT: the public face of it

void StartSandbox(std::function<void()> load) {
  EndSandbox();
  const std::lock_guard lock(g_mutex);
  if (g_why_not = WhyNotConfined(); !g_why_not.empty()) return;
  auto [ours, theirs] = MakeSockets();
  const int pid = ours.number() < 0 ? -1 : ::fork();
  if (pid == 0) {
    { const Descriptor program = std::move(ours); }
    Run(Channel(std::move(theirs)));
  }
  if (pid < 0) {
    g_why_not = "the system starts no process";
    return;
  }
  g_starter = std::make_unique<Channel>(std::move(ours));
  g_pid = pid;
  g_load = std::move(load);
}

void EndSandbox() {
  const std::lock_guard lock(g_mutex);
  if (!g_starter) return;
  g_starter.reset();
  while (::waitpid(g_pid, nullptr, 0) < 0 && errno == EINTR) continue;
  g_why_not = "it was ended (EndSandbox)";
}

bool InSandbox() { return g_in_child; }

}  // namespace tessera
