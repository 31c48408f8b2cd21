// Limits into policies, the system's own, progress that ends an evaluation, and an alarm where nothing asks.
#include "cli/limits.h"

#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "cli/arguments.h"
#include "cli/messages.h"
#include "cli/signals.h"
#include "tessera/context.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

using Clock = std::chrono::steady_clock;

// A library that reads a file does not ask whether it is time; it has so much longer.
constexpr double kGrace = 2;

std::optional<Clock::time_point> g_end;
std::string g_over, g_memory;  // what messages say, of the latest line
// What is being done, null: the line. A handler, which may come at any time, takes it away; threads replace
// and read it one after the other.
std::atomic<char*> g_at_hand{nullptr};
std::mutex g_at_hand_mutex;

void SetAtHand(char* words) {
  const std::lock_guard lock(g_at_hand_mutex);
  std::free(g_at_hand.exchange(words));
}
std::string AtHand() {
  const std::lock_guard lock(g_at_hand_mutex);
  const char* const words = g_at_hand.load();
  return words != nullptr ? words : "line";
}

bool InTime() { return !g_end || Clock::now() < *g_end; }

extern "C" void OnAlarm(int signal) {
  if (!MayEnd(signal)) return;
  EndOutputs();
  const int messages = MessagesDescriptor();
  const char* const at_hand = g_at_hand.exchange(nullptr);
  const char* const parts[] = {"tessera: error: ", at_hand != nullptr ? at_hand : "line", ": ",
                               g_over.c_str(), "\n"};
  for (const char* const part : parts) {
    if (write(messages, part, std::strlen(part)) < 0) break;
  }
  _exit(1);
}

std::string NumberText(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// Of two limits.
std::optional<double> Given(const std::optional<double>& own, const Options& options,
                            const std::optional<double>& safe) {
  return own || !options.safe ? own : safe;
}

}  // namespace

void AddLimits(const std::string& text, Limits& limits) {
  struct Key {
    const char* name;
    std::optional<double>& value;
    bool whole;
  };
  const Key keys[] = {{"pixels", limits.pixels, true},
                      {"channels", limits.channels, true},
                      {"frames", limits.frames, true},
                      {"memory", limits.memory, true},
                      {"seconds", limits.seconds, false}};
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size()), equals = text.find('=', begin);
    const std::string name = text.substr(begin, std::min(equals, end) - begin);
    const auto key =
        std::find_if(std::begin(keys), std::end(keys), [&](const Key& k) { return name == k.name; });
    if (key == std::end(keys) || equals >= end) {
      throw UsageError("--limit", "found \"" + text.substr(begin, end - begin) +
                                      "\", expected pixels=, channels=, frames=, memory= or seconds=");
    }
    double value = 0;
    // The program with its libraries and threads takes some of it.
    const double least = name == "memory" ? 128 : name == "seconds" ? 1e-3 : 1;
    const char* const last = text.data() + end;
    const auto [next, error] = std::from_chars(text.data() + equals + 1, last, value);
    if (error != std::errc() || next != last || !(value >= least) || !(value <= 1e15) ||
        (key->whole && value != std::floor(value))) {
      throw UsageError("--limit", "found \"" + text.substr(begin, end - begin) + "\", expected a " +
                                      (key->whole ? "whole " : "") + "number of at least " +
                                      NumberText(least));
    }
    key->value = std::min(value, key->value.value_or(value));
    begin = end + 1;
  }
}

void Limit(Options& options) {
  Limits& l = options.limits;
  l = {.pixels = Given(l.pixels, options, kSafeLimits.pixels),
       .channels = Given(l.channels, options, kSafeLimits.channels),
       .frames = Given(l.frames, options, kSafeLimits.frames),
       .memory = Given(l.memory, options, kSafeLimits.memory),
       .seconds = Given(l.seconds, options, kSafeLimits.seconds)};
  if (l.memory) {
    // Libraries and threads take their share.
    const auto most = static_cast<size_t>(*l.memory * (1 << 20) / 4);
    options.render.memory_budget = std::min(options.render.memory_budget, std::max(most, size_t{1} << 20));
  }
  if (l.seconds) options.render.progress = [](double) { return InTime(); };
}

ProcessLimits::ProcessLimits(const Options& options) {
  g_memory.clear();
  SetAtHand(nullptr);  // not what the last job of --batch was at
  const Limits& l = options.limits;
  Policy policy = options.safe ? SafePolicy() : Policy{};
  if (l.pixels) policy.pixels = static_cast<int64_t>(*l.pixels);
  if (l.channels) policy.channels = static_cast<int64_t>(*l.channels);
  if (!options.safe) policy.sandbox = Sandbox::kUnlisted;
  if (!options.sandbox) policy.sandbox = Sandbox::kOff;
  if (l.memory) policy.reader_memory = static_cast<int64_t>(*l.memory * (1 << 20));
  if (l.seconds) policy.reader_seconds = *l.seconds;
  Context::Default().SetPolicy(policy);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  // Sanitizers' shadows are counted too.
  if (l.memory) {
    rlimit limit{};
    getrlimit(RLIMIT_DATA, &limit);
    memory_ = limit.rlim_cur;
    limit.rlim_cur = std::min(limit.rlim_max, static_cast<rlim_t>(*l.memory * (1 << 20)));
    if (setrlimit(RLIMIT_DATA, &limit) != 0) throw SystemError("--limit memory", "refused by the system");
    g_memory = ", over the limit memory=" + NumberText(*l.memory);
  }
#endif
  if (!l.seconds) return;
  g_end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(*l.seconds));
  g_over = "found more than " + NumberText(*l.seconds) +
           " s of work, over the limit seconds=" + NumberText(*l.seconds);
  struct sigaction action {};
  action.sa_handler = OnAlarm;
  action.sa_flags = SA_RESTART;
  sigaction(SIGALRM, &action, nullptr);
  const double until = std::min(*l.seconds + kGrace, 1e8);
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(until);
  timer.it_value.tv_usec = static_cast<suseconds_t>((until - std::floor(until)) * 1e6);
  setitimer(ITIMER_REAL, &timer, nullptr);
}

ProcessLimits::~ProcessLimits() {
  const itimerval none{};
  if (g_end) setitimer(ITIMER_REAL, &none, nullptr);
  g_end.reset();
  Context::Default().SetPolicy({});
  if (!memory_) return;
  rlimit limit{};
  getrlimit(RLIMIT_DATA, &limit);
  limit.rlim_cur = *memory_;
  setrlimit(RLIMIT_DATA, &limit);
}

void RequireTime(const std::string& words) {
  if (!g_end) return;
  if (!words.empty()) {
    if (char* const copy = strdup(Printable(words).c_str())) SetAtHand(copy);
  }
  if (!InTime()) throw SystemError(AtHand(), g_over);
  // What is left is left to readers, too.
  Policy policy = Context::Default().policy();
  policy.reader_seconds = std::chrono::duration<double>(*g_end - Clock::now()).count();
  Context::Default().SetPolicy(policy);
}

void RequireFrames(const Options& options, const std::string& name, size_t frames) {
  const auto& most = options.limits.frames;
  if (!most || static_cast<double>(frames) <= *most) return;
  throw DataError(name,
                  "found " + std::to_string(frames) + " frames, over the limit frames=" + NumberText(*most));
}

std::string MemoryReason(const std::string& reason) { return reason + g_memory; }

}  // namespace tessera::cli
