// What a benchmark program is made of: flags, the measurement of contestants against each other, tasks.
#ifndef TESSERA_BENCH_HARNESS_H_
#define TESSERA_BENCH_HARNESS_H_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "contestant.h"
#include "oracle.h"

namespace tessera::bench {

// What the flags --sizes --types --threads --targets --repetitions --seconds --alone chose; see kUsage in
// flags.cc.
struct Options {
  struct Size {
    int width = 0, height = 0;  // 0 x 0: ten times the last-level cache, whatever the pixel type
  };
  std::vector<Size> sizes = {{3840, 2160}};
  std::vector<PixelType> types = {PixelType::kFloat, PixelType::kHalf, PixelType::kUint8};
  std::vector<int> threads = {1, 2};
  std::vector<std::string> targets;  // empty: every one this processor can run
  int repetitions = 15;
  double seconds = 0;  // a contestant that has run this long stops after kFewestRepetitions; 0: never
  bool alone = false;  // no peers, and nothing is judged: for bench/turns, which compares two builds
};

struct Measured {
  std::string name;
  std::vector<double> seconds;  // of a run, one per round, in the order they were made
  Errors errors;
  bool is_copy = false;
};

// Warms every contestant up, checks its pixels against the oracle (unless null), then makes `repetitions`
// rounds in which each contestant has one turn, in an order shuffled anew for each round. A turn is one run,
// or the mean of as many as fill four milliseconds. With `seconds` slow contestants leave early, which quick
// looks need; the protocol's figures are made without.
inline constexpr int kFewestRepetitions = 5;
std::vector<Measured> Measure(std::vector<std::unique_ptr<Contestant>> contestants, const Frame& frame,
                              const Oracle* oracle, int repetitions, double seconds = 0);

double Median(std::vector<double> values);

// Registers the benchmarks SUITE/TASK/TYPE/WxH/threads:N/CONTESTANT for every choice of the options. A
// group's contestants are measured together when the first of them is asked for.
void RegisterTask(const std::string& suite, const Task& task, const Options& options, bool with_unfolded);

// A benchmark's main: takes the flags, lets `register_all` register, runs. An error is printed behind the
// program's name and gives exit code 2.
int RunSuite(int argc, char** argv, const std::function<void(Options)>& register_all);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_HARNESS_H_
