// What is told about a run: the progress bar, --runstats.
#include "cli/report.h"

#include <OpenImageIO/strutil.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "cli/messages.h"

namespace tessera::cli {

ProgressBar::~ProgressBar() {
  if (drawn_) std::fputs("\r\033[K", Messages());
}

std::function<bool(double)> ProgressBar::Callback() {
  if (!shown_) return {};
  return [this](double share) {
    Draw(share);
    return true;
  };
}

void ProgressBar::Draw(double share) {
  constexpr auto kInterval = std::chrono::milliseconds(100);
  constexpr int kCells = 30;
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (drawn_ && (share <= share_ || (share < 1 && now - last_ < kInterval))) return;
  share_ = share;
  last_ = now;
  drawn_ = true;
  const int full = static_cast<int>(std::clamp(share, 0.0, 1.0) * kCells);
  std::fprintf(Messages(), "\r[%s%s] %3.0f%% %s", std::string(full, '#').c_str(),
               std::string(kCells - full, '.').c_str(), 100 * share, label_.c_str());
  std::fflush(Messages());
}

void ProgressBar::Finish() {
  if (!shown_) return;
  Draw(1);
  std::fputs("\n", Messages());
  drawn_ = false;
}

namespace {

void PrintPhases(const std::string& output, const RunPhases& p) {
  using OIIO::Strutil::sprintf;
  const double all = p.threads * p.seconds;
  if (!(all > 0)) return;
  std::cout << sprintf("  %d %s for %.4f s:\n", p.threads, p.threads == 1 ? "thread" : "threads", p.seconds);
  const auto print = [&](const char* phase, double busy, const std::string& file) {
    std::cout << sprintf("    %-8s %9.4f s %5.1f %%", phase, busy, 100 * busy / all)
              << (file.empty() ? "" : "  " + file) << '\n';
  };
  print("prepare", p.prepare, "");
  for (const RunPhases::Decode& d : p.decode) print("decode", d.busy, d.file);
  print("compute", p.compute, "");
  print("encode", p.encode, output);
  print("wait", p.wait, "");
  const std::string limit = p.Limit();
  std::cout << "    limit: " << limit << (limit == "encode" ? " " + output : "") << '\n';
}

}  // namespace

void PrintRunStats(const std::string& output, const RunStats& stats) {
  using OIIO::Strutil::sprintf;
  std::cout << "runstats " << output << ":\n";
  double total = 0;
  for (const RunStats::Pass& pass : stats.passes) {
    total += pass.seconds;
    const double seconds = std::max(pass.seconds, 1e-9);
    std::cout << sprintf("  %-28s %9.4f s %10.1f Mpixel/s %8.2f GB/s\n", pass.name, pass.seconds,
                         pass.pixels / seconds * 1e-6, pass.bytes / seconds * 1e-9);
  }
  PrintPhases(output, stats.phases);
  for (const std::string& file : stats.files) std::cout << "  " << file << '\n';
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::cout << sprintf("  total %.4f s, peak memory %.1f MB\n", total, usage.ru_maxrss / 1024.0);
}

}  // namespace tessera::cli
