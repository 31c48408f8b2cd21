// What is told about a run: the progress bar, --runstats.
#include "cli/report.h"

#include <OpenImageIO/strutil.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>

#include "cli/layout.h"
#include "cli/messages.h"

namespace tessera::cli {

Progress::Progress(size_t frames, size_t outputs, bool shown)
    : frames_(frames),
      outputs_(std::max<size_t>(outputs, 1)),
      shown_(shown),
      stream_(Messages()),
      start_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  Clear();
  if (!shown_ || done_ < frames_ || name_.empty()) return;
  const double seconds = Seconds();
  const bool several = frames_ != 1;
  std::string line = several ? std::to_string(done_) + " frames" : Printable(name_);
  line += " in " + Duration(seconds);
  if (several)
    line += OIIO::Strutil::sprintf(", %.3g frames/s", static_cast<double>(done_) / std::max(seconds, 1e-9));
  line += OIIO::Strutil::sprintf(", %.3g Mpixel/s", pixels_ / std::max(seconds, 1e-9) * 1e-6);
  std::fprintf(stream_, "[%s] 100%% %s\n", std::string(10, '#').c_str(), line.c_str());
}

double Progress::Seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void Progress::Frame::Begin(const std::string& name, double pixels) {
  const std::lock_guard lock(all_.mutex_);
  all_.name_ = name_ = name, pixels_ = pixels, share_ = 0;
}

std::function<bool(double)> Progress::Frame::Callback() {
  if (!all_.shown_) return {};
  return [this](double share) {
    all_.Draw(*this, share);
    return true;
  };
}

double Progress::FrameShare(const Frame& frame, double of_output) const {
  return std::min((static_cast<double>(frame.output_) + of_output) / static_cast<double>(outputs_), 1.0);
}

std::string Progress::Line() const {
  using OIIO::Strutil::sprintf;
  const size_t terminal = TerminalColumns(MessagesDescriptor());
  const size_t columns = std::max<size_t>(terminal == 0 ? 80 : terminal, 20) - 1;
  const double frames = static_cast<double>(done_) + under_way_, seconds = Seconds();
  if (frames_ == 0) {
    std::string line = sprintf("frame %d", done_ + 1);
    if (seconds > 0.5)
      line += sprintf(", %.3g frames/s, %.3g Mpixel/s", frames / seconds, pixels_ / seconds * 1e-6);
    return line.substr(0, columns);
  }
  const double all = std::clamp(frames / static_cast<double>(frames_), 0.0, 1.0);
  std::string facts;
  if (frames_ > 1) facts += sprintf(" frame %d/%d", std::min(done_ + 1, frames_), frames_);
  // A rate and a guess are worth something once there was time to measure.
  if (seconds > 0.5 && all > 0.01) {
    facts += sprintf(", %.3g Mpixel/s", pixels_ / seconds * 1e-6);
    if (frames_ > 1) facts += sprintf(", %.3g frames/s", frames / seconds);
    facts += ", " + Duration(seconds * (1 - all) / all) + " left";
  }
  const std::string percent = sprintf(" %3.0f%%", 100 * all);
  std::string name = " " + Printable(name_);
  constexpr size_t kMostCells = 30, kFewestCells = 8;
  // The name gives way first, then the facts, then the bar.
  const auto room = [&] { return columns - std::min(columns, 2 + percent.size() + facts.size()); };
  if (room() < kFewestCells) facts.clear();
  const size_t cells =
      std::clamp(room() > ColumnsOf(name) ? room() - ColumnsOf(name) : 0, kFewestCells, kMostCells);
  const size_t left = room() - std::min(room(), cells);
  if (ColumnsOf(name) > left)
    name = left < 8 ? "" : " ..." + name.substr(name.size() - std::min(name.size(), left - 4));
  const auto full = static_cast<size_t>(std::lround(all * static_cast<double>(cells)));
  return "[" + std::string(full, '#') + std::string(cells - full, '.') + "]" + percent + name +
         (facts.starts_with(",") ? facts.substr(1) : facts);
}

void Progress::Draw(Frame& frame, double share) {
  constexpr auto kInterval = std::chrono::milliseconds(100);
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  share = std::min(share, 1.0);
  if (share < frame.share_ || (drawn_ && (share == frame.share_ || now - last_ < kInterval))) return;
  under_way_ += FrameShare(frame, share) - FrameShare(frame, frame.share_);
  pixels_ += (share - frame.share_) * frame.pixels_;
  frame.share_ = share;
  last_ = now;
  drawn_ = true;
  name_ = frame.name_;
  std::fprintf(stream_, "\r%s\033[K", Line().c_str());
  std::fflush(stream_);
}

void Progress::Clear() {
  if (drawn_) std::fputs("\r\033[K", stream_);
  drawn_ = false;
}

void Progress::MakeWay() {
  const std::lock_guard lock(mutex_);
  Clear();
}

void Progress::Frame::End() {
  const std::lock_guard lock(all_.mutex_);
  all_.under_way_ += all_.FrameShare(*this, 1) - all_.FrameShare(*this, share_);
  all_.pixels_ += (1 - share_) * pixels_;
  ++output_;
  share_ = pixels_ = 0;
  all_.Clear();
}

void Progress::Frame::Done() {
  const std::lock_guard lock(all_.mutex_);
  all_.under_way_ -= all_.FrameShare(*this, share_);
  ++all_.done_;
  output_ = 0, share_ = 0;
}

std::string Duration(double seconds) {
  const auto all = static_cast<long>(std::lround(std::clamp(seconds, 0.0, 1e7)));
  if (all < 60 && seconds < 10) return OIIO::Strutil::sprintf("%.1f s", std::max(seconds, 0.0));
  if (all < 3600) return OIIO::Strutil::sprintf("%d:%02d", all / 60, all % 60);
  return OIIO::Strutil::sprintf("%d:%02d:%02d", all / 3600, all / 60 % 60, all % 60);
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
