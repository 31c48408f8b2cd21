// What is told about a run: the progress bar, --runstats.
#ifndef TESSERA_CLI_REPORT_H_
#define TESSERA_CLI_REPORT_H_

#include <chrono>
#include <functional>
#include <mutex>
#include <string>

#include "tessera/render.h"

namespace tessera::cli {

// How far a run has come, over its frames and their outputs: one line on stderr, redrawn at most ten times a
// second, no wider than the terminal (80 columns where there is none).
class Progress {
 public:
  Progress(size_t frames, size_t outputs, bool shown);
  // Leaves a line that says what was done, or a clean one when the work ended early.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // The next output of the frame that is worked on; its pixels are for the rate.
  void Begin(const std::string& name, double pixels);
  // For RenderOptions::progress; empty when nothing is shown. `this` must outlive the evaluation.
  std::function<bool(double)> Callback();
  // The output is done; the line is cleared for what others print.
  void End();
  void EndFrame();

 private:
  void Draw(double share);
  void Clear();
  double Seconds() const;
  // Of all frames and outputs, from 0 to 1.
  double Share(double of_output) const;
  std::string Line(double share) const;

  size_t frames_, outputs_;
  bool shown_, drawn_ = false;
  size_t frame_ = 0, output_ = 0;
  std::string name_;
  double pixels_ = 0, done_pixels_ = 0, share_ = 0;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point start_, last_{};
};

// "0.7 s", "0:12", "12:34", "3:02:01".
std::string Duration(double seconds);

// Time per pass, Mpixel/s, GB/s, and the peak memory of the process, on stdout.
void PrintRunStats(const std::string& output, const RunStats& stats);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_REPORT_H_
