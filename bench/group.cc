// The bridge from a group to Google Benchmark's registration, counters and JSON.
#include "group.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <exception>
#include <limits>
#include <memory>
#include <optional>

namespace tessera::bench {
namespace {

struct Group {
  std::function<Outcome()> measure;
  std::optional<Outcome> outcome;
  std::string failure = "has no call for this task";
  double copy_seconds = std::numeric_limits<double>::infinity();  // of the fastest copy

  void MeasureOnce() {
    if (outcome) return;
    outcome.emplace();
    try {
      *outcome = measure();
    } catch (const std::exception& error) {
      failure = error.what();
    }
    for (const Measured& m : outcome->results) {
      if (m.is_copy) copy_seconds = std::min(copy_seconds, Median(m.seconds));
    }
  }
};

void Report(benchmark::State& state, Group& group, const std::string& contestant) {
  group.MeasureOnce();
  const Outcome& outcome = *group.outcome;
  const auto found = std::find_if(outcome.results.begin(), outcome.results.end(),
                                  [&](const Measured& m) { return m.name == contestant; });
  if (found == outcome.results.end()) {
    state.SkipWithError(group.failure.c_str());
    return;
  }
  const Measured& m = *found;
  const double seconds = Median(m.seconds), ns = 1e9 / outcome.pixels;
  for (auto _ : state) state.SetIterationTime(seconds);
  state.counters["ns_per_pixel"] = seconds * ns;
  state.counters["ns_per_pixel_min"] = *std::min_element(m.seconds.begin(), m.seconds.end()) * ns;
  state.counters["ns_per_pixel_max"] = *std::max_element(m.seconds.begin(), m.seconds.end()) * ns;
  state.counters["times_copy"] = seconds / group.copy_seconds;
  state.counters["repetitions"] = static_cast<double>(m.seconds.size());
  if (m.is_copy) return;
  state.counters["copy_share"] = outcome.bytes_moved / outcome.copy_bytes * group.copy_seconds / seconds;
  if (const auto own = outcome.counters.find(contestant); own != outcome.counters.end()) {
    for (const auto& [name, value] : own->second) state.counters[name] = value;
  }
  if (m.errors.values == 0) return;  // nobody judged it
  state.counters["max_error"] = m.errors.max;
  state.counters["rms_error"] = m.errors.rms;
  state.counters["values_checked"] = static_cast<double>(m.errors.values);
  state.counters["not_finite"] = static_cast<double>(m.errors.not_finite);
  if (outcome.type == PixelType::kUint8 || outcome.type == PixelType::kUint16) {
    state.counters["wrong_codes"] = static_cast<double>(m.errors.wrong_codes);
    state.counters["max_code_error"] = m.errors.max_code_error;
  }
}

}  // namespace

void RegisterGroup(const std::string& prefix, const std::vector<std::string>& contestants,
                   std::function<Outcome()> measure) {
  auto group = std::make_shared<Group>();
  group->measure = std::move(measure);
  for (const std::string& name : contestants) {
    benchmark::RegisterBenchmark((prefix + "/" + name).c_str(),
                                 [group, name](benchmark::State& state) { Report(state, *group, name); })
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
}

}  // namespace tessera::bench
