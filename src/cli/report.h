// What is told about a run: the progress bar, --runstats.
#ifndef TESSERA_CLI_REPORT_H_
#define TESSERA_CLI_REPORT_H_

#include <chrono>
#include <cstdio>
#include <functional>
#include <mutex>
#include <string>

#include "tessera/render.h"

namespace tessera::cli {

// How far a run has come, over its frames, several of which may be under way, and their outputs: one line on
// stderr, redrawn at most ten times a second, no wider than the terminal (80 columns where there is none).
class Progress {
 public:
  // No frames: nobody knows how many will come.
  Progress(size_t frames, size_t outputs, bool shown);
  // Leaves a line that says what was done, or a clean one when the work ended early.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // Clears the line for what others print.
  void MakeWay();

  // A frame that is worked on. `all` must outlive it.
  class Frame {
   public:
    explicit Frame(Progress& all) : all_(all) {}
    // The next output; its pixels are for the rate.
    void Begin(const std::string& name, double pixels);
    // For RenderOptions::progress; empty when nothing is shown. `this` must outlive the evaluation.
    std::function<bool(double)> Callback();
    // The output is done.
    void End();
    // The frame is.
    void Done();

   private:
    friend class Progress;
    Progress& all_;
    size_t output_ = 0;
    std::string name_;
    double pixels_ = 0, share_ = 0;  // of the output
  };

 private:
  void Draw(Frame& frame, double share);
  void Clear();
  double Seconds() const;
  // What an output's share adds to the frames that are done.
  double FrameShare(const Frame& frame, double of_output) const;
  std::string Line() const;

  size_t frames_, outputs_;
  bool shown_, drawn_ = false;
  std::FILE* stream_;  // of who made it, whatever is kept of a thread's own messages
  size_t done_ = 0;    // frames
  std::string name_;   // of the latest output
  double under_way_ = 0, pixels_ = 0;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point start_, last_{};
};

// "0.7 s", "0:12", "12:34", "3:02:01".
std::string Duration(double seconds);

// Time per pass, Mpixel/s, GB/s, and the peak memory of the process, on stdout.
void PrintRunStats(const std::string& output, const RunStats& stats);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_REPORT_H_
