// The interleaved loop: every contestant has one turn a round.
#include "harness.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <numeric>
#include <random>

namespace tessera::bench {
namespace {

constexpr int kWarmUps = 2;
constexpr std::chrono::milliseconds kLeastTurn(4);

// Seconds of a run, the mean of as many as a turn has room for. A single short one would mostly tell what its
// predecessor left in the caches.
double Turn(Contestant& contestant) {
  using Seconds = std::chrono::duration<double>;
  contestant.Prepare();
  const auto start = std::chrono::steady_clock::now();
  for (int runs = 1;; ++runs) {
    contestant.Run();
    const Seconds spent = std::chrono::steady_clock::now() - start;
    if (spent >= kLeastTurn) return spent.count() / runs;
  }
}

}  // namespace

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return n % 2 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

std::vector<Measured> Measure(std::vector<std::unique_ptr<Contestant>> contestants, const Frame& frame,
                              const Oracle* oracle, int repetitions, double seconds) {
  std::vector<Measured> results(contestants.size());
  const ImageView out = frame.output.view();
  const size_t bytes = static_cast<size_t>(out.row_stride) * out.roi.height();
  for (size_t i = 0; i < contestants.size(); ++i) {
    results[i].name = contestants[i]->Name();
    results[i].is_copy = contestants[i]->IsCopy();
    // A contestant that writes nothing must not be judged by its predecessor's pixels.
    std::memset(out.data, 0x5a, bytes);
    for (int k = 0; k < kWarmUps; ++k) {
      contestants[i]->Prepare();
      contestants[i]->Run();
    }
    contestants[i]->Finish();
    if (!results[i].is_copy && oracle != nullptr) results[i].errors = oracle->Compare(out);
  }
  std::vector<size_t> order(contestants.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::mt19937 random(20240607);
  for (int k = 0; k < repetitions; ++k) {
    std::shuffle(order.begin(), order.end(), random);
    for (size_t i : order) {
      const std::vector<double>& spent = results[i].seconds;
      if (seconds > 0 && k >= kFewestRepetitions &&
          std::accumulate(spent.begin(), spent.end(), 0.0) > seconds)
        continue;
      results[i].seconds.push_back(Turn(*contestants[i]));
    }
  }
  return results;
}

}  // namespace tessera::bench
