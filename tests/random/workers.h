// Cases on several processes: what crashes or hangs one of them is a finding like any other.
#ifndef TESSERA_TESTS_RANDOM_WORKERS_H_
#define TESSERA_TESTS_RANDOM_WORKERS_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "random/compare.h"

namespace tessera::random {

struct Run {
  uint64_t seed = 0, from = 0;
  int64_t count = -1;              // cases; -1: as many as there is time for
  double seconds = 60;             // without a count
  int workers = 1, failures = 10;  // the run ends after so many of these
  std::vector<const ops::OpInfo*> rows;
  const ops::OpInfo* only = nullptr;
  bool progress = false, shrink = true;
  bool shake = false;  // threads are held up at random moments
};

struct Report {
  int64_t cases = 0;
  double seconds = 0;
  std::vector<std::string> failures;                    // shrunk, in words
  std::vector<std::pair<double, std::string>> slowest;  // the ten, in seconds, with their lines
  Tally tally;
};

// Runs in child processes; this one computes nothing itself.
Report RunCases(const Run& run);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_WORKERS_H_
