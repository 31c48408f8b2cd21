// What is told about a run: the progress bar, --runstats.
#ifndef TESSERA_CLI_REPORT_H_
#define TESSERA_CLI_REPORT_H_

#include <chrono>
#include <functional>
#include <mutex>
#include <string>

#include "tessera/render.h"

namespace tessera::cli {

// A bar on stderr, redrawn at most ten times a second.
class ProgressBar {
 public:
  ProgressBar(std::string label, bool shown) : label_(std::move(label)), shown_(shown) {}
  // Leaves a clean line behind when the work ended early.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // For RenderOptions::progress; empty when nothing is shown. The bar must outlive the evaluation.
  std::function<bool(double)> Callback();
  void Finish();

 private:
  void Draw(double share);

  std::string label_;
  bool shown_, drawn_ = false;
  double share_ = 0;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point last_{};
};

// Time per pass, Mpixel/s, GB/s, and the peak memory of the process, on stdout.
void PrintRunStats(const std::string& output, const RunStats& stats);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_REPORT_H_
