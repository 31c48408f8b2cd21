// Contests: one group of contestants each, measured when its first one is asked for.
#include "contest.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <exception>
#include <map>
#include <memory>

#include "call.h"
#include "copy.h"
#include "tessera/ops/generate.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#include "workers.h"

namespace tessera::bench {
namespace {

constexpr char kCopy[] = "copy streaming";

std::string WayName(const std::string& target, const std::string& way) {
  return "tessera " + target + (way.empty() ? "" : " " + way);
}

// Copies half of the bytes moved, shared by all threads.
class SharedCopy {
 public:
  SharedCopy(double bytes_moved, int threads)
      : from_(static_cast<size_t>(bytes_moved / 2), std::byte{1}), to_(from_.size()), workers_(threads) {}
  void Run() {
    workers_.Run([this](int k) {
      const size_t count = static_cast<size_t>(workers_.count()), part = from_.size() / count / 64 * 64,
                   begin = part * static_cast<size_t>(k);
      CopyStreaming(from_.data() + begin, to_.data() + begin,
                    k + 1 == workers_.count() ? from_.size() - begin : part);
    });
  }

 private:
  std::vector<std::byte> from_, to_;
  Workers workers_;
};

struct Group {
  ContestNames names;
  Options options;
  std::function<Contest()> make;
  bool done = false;
  std::string failure = "has no call for this task";
  std::vector<Measured> results;
  std::map<std::string, double> paper;                    // contestant -> frames per second
  double pixels = 0, copy_seconds = 0, peer_seconds = 0;  // of the fastest peer; 0: there is none

  void MeasureOnce() {
    if (done) return;
    done = true;
    const Contest c = make();
    const ImageView out = c.output.view();
    pixels = static_cast<double>(out.roi.pixels());
    const double written = pixels * out.channels * static_cast<double>(PixelBytes(out.type));
    SharedCopy copy(c.bytes_moved > 0 ? c.bytes_moved : 2 * written, names.threads);
    std::vector<std::unique_ptr<Contestant>> contestants;
    contestants.push_back(std::make_unique<Call>(
        kCopy, [&copy] { copy.Run(); }, "", true));
    const RenderOptions render{.threads = names.threads};
    for (const std::string& target : options.targets) {
      for (const Contest::Way& way : c.ways) {
        const std::string name = WayName(target, way.name);
        paper[name] = way.paper_frames_per_second;
        contestants.push_back(std::make_unique<Call>(
            name, [&way, out, render] { RenderInto(way.node, out, render); }, target));
      }
    }
    for (const Contest::Peer& peer : c.peers) {
      contestants.push_back(std::make_unique<Call>(peer.name, peer.run));
    }
    std::map<std::string, Errors> judged;
    if (c.judge) {
      for (const auto& contestant : contestants) {
        contestant->Prepare();
        contestant->Run();
        judged[contestant->Name()] = c.judge();
      }
    }
    Frame frame;
    frame.width = out.roi.width(), frame.height = out.roi.height(), frame.type = out.type;
    frame.output = c.output;
    const Node truth = c.judge ? Constant(c.output.spec()) : c.truth ? c.truth : c.ways[0].node;
    results = Measure(std::move(contestants), frame, Oracle(truth, c.oracle_bands, c.oracle_rows),
                      options.repetitions, options.seconds);
    for (Measured& m : results) {
      if (c.judge) m.errors = judged[m.name];
      const double seconds = Median(m.seconds);
      if (m.is_copy) copy_seconds = seconds;
      const bool is_peer =
          std::any_of(c.peers.begin(), c.peers.end(), [&](const auto& p) { return p.name == m.name; });
      if (is_peer && (peer_seconds == 0 || seconds < peer_seconds)) peer_seconds = seconds;
    }
    SetSimdTarget("auto");
  }
};

void Report(benchmark::State& state, Group& group, const std::string& contestant) {
  try {
    group.MeasureOnce();
  } catch (const std::exception& error) {
    group.failure = error.what();
  }
  const auto found = std::find_if(group.results.begin(), group.results.end(),
                                  [&](const Measured& m) { return m.name == contestant; });
  if (found == group.results.end()) {
    state.SkipWithError(group.failure.c_str());
    return;
  }
  const Measured& m = *found;
  const double seconds = Median(m.seconds), ns = 1e9 / group.pixels;
  for (auto _ : state) state.SetIterationTime(seconds);
  state.counters["ns_per_pixel"] = seconds * ns;
  state.counters["ns_per_pixel_min"] = *std::min_element(m.seconds.begin(), m.seconds.end()) * ns;
  state.counters["times_copy"] = seconds / group.copy_seconds;
  state.counters["repetitions"] = static_cast<double>(m.seconds.size());
  if (m.is_copy) return;
  state.counters["frames_per_second"] = 1 / seconds;
  if (group.paper[contestant] > 0) state.counters["paper_frames_per_second"] = group.paper[contestant];
  state.counters["copy_share"] = group.copy_seconds / seconds;
  if (group.peer_seconds > 0) state.counters["times_peer"] = group.peer_seconds / seconds;
  state.counters["max_error"] = m.errors.max;
  state.counters["rms_error"] = m.errors.rms;
  state.counters["values_checked"] = static_cast<double>(m.errors.values);
  if (group.names.pixels == "uint8" || group.names.pixels == "uint16") {
    state.counters["wrong_codes"] = static_cast<double>(m.errors.wrong_codes);
    state.counters["max_code_error"] = m.errors.max_code_error;
  }
}

}  // namespace

void RegisterContest(const ContestNames& names, const Options& options, std::function<Contest()> make) {
  auto group = std::make_shared<Group>();
  group->names = names, group->options = options, group->make = std::move(make);
  std::vector<std::string> contestants = {kCopy};
  for (const std::string& target : options.targets) {
    for (const std::string& way : names.ways) contestants.push_back(WayName(target, way));
  }
  contestants.insert(contestants.end(), names.peers.begin(), names.peers.end());
  const std::string prefix = names.suite + "/" + names.task + "/" + names.pixels + "/" +
                             std::to_string(names.width) + "x" + std::to_string(names.height) +
                             "/threads:" + std::to_string(names.threads) + "/";
  for (const std::string& name : contestants) {
    benchmark::RegisterBenchmark((prefix + name).c_str(),
                                 [group, name](benchmark::State& state) { Report(state, *group, name); })
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
}

}  // namespace tessera::bench
