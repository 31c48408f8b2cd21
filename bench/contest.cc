// Contests: their copies, ways and peers as a group.
#include "contest.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>

#include "call.h"
#include "copy.h"
#include "group.h"
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

Outcome Run(const ContestNames& names, const Options& options, const Contest& c) {
  const ImageView out = c.output.view();
  const double pixels = static_cast<double>(out.roi.pixels());
  const double written = pixels * out.channels * static_cast<double>(PixelBytes(out.type));
  SharedCopy copy(c.bytes_moved > 0 ? c.bytes_moved : 2 * written, names.threads);
  std::vector<std::unique_ptr<Contestant>> contestants;
  contestants.push_back(std::make_unique<Call>(
      kCopy, [&copy] { copy.Run(); }, "", true));
  const RenderOptions render{.threads = names.threads};
  std::map<std::string, double> paper;  // contestant -> frames per second
  for (const std::string& target : options.targets) {
    for (const Contest::Way& way : c.ways) {
      const std::string name = WayName(target, way.name);
      paper[name] = way.paper_frames_per_second;
      contestants.push_back(std::make_unique<Call>(
          name, [&way, out, render] { RenderInto(way.node, out, render); }, target));
    }
  }
  for (const Contest::Peer& peer : c.peers) {
    if (options.alone) break;
    contestants.push_back(std::make_unique<Call>(peer.name, peer.run));
  }
  std::map<std::string, Errors> judged;
  if (c.judge && !options.alone) {
    for (const auto& contestant : contestants) {
      contestant->Prepare();
      contestant->Run();
      contestant->Finish();
      judged[contestant->Name()] = c.judge();
    }
  }
  Frame frame;
  frame.width = out.roi.width(), frame.height = out.roi.height(), frame.type = out.type;
  frame.output = c.output;
  std::optional<Oracle> oracle;
  if (!options.alone) {
    const Node truth = c.judge ? Constant(c.output.spec()) : c.truth ? c.truth : c.ways[0].node;
    oracle.emplace(truth, c.oracle_bands, c.oracle_rows);
  }
  Outcome outcome;
  outcome.results = Measure(std::move(contestants), frame, oracle ? &*oracle : nullptr, options.repetitions,
                            options.seconds);
  outcome.type = out.type;
  outcome.pixels = pixels;
  double peer_seconds = 0;  // of the fastest peer; 0: there is none
  for (Measured& m : outcome.results) {
    if (c.judge && !options.alone) m.errors = judged[m.name];
    const auto peer =
        std::find_if(c.peers.begin(), c.peers.end(), [&](const auto& p) { return p.name == m.name; });
    const bool is_peer = peer != c.peers.end();
    if (is_peer && !peer->judged) m.errors = {};
    if (is_peer && (peer_seconds == 0 || Median(m.seconds) < peer_seconds)) peer_seconds = Median(m.seconds);
  }
  for (const Measured& m : outcome.results) {
    auto& counters = outcome.counters[m.name];
    counters["frames_per_second"] = 1 / Median(m.seconds);
    if (paper[m.name] > 0) counters["paper_frames_per_second"] = paper[m.name];
    if (peer_seconds > 0) counters["times_peer"] = peer_seconds / Median(m.seconds);
  }
  SetSimdTarget("auto");
  return outcome;
}

}  // namespace

void RegisterContest(const ContestNames& names, const Options& options, std::function<Contest()> make) {
  std::vector<std::string> contestants = {kCopy};
  for (const std::string& target : options.targets) {
    for (const std::string& way : names.ways) contestants.push_back(WayName(target, way));
  }
  if (!options.alone) contestants.insert(contestants.end(), names.peers.begin(), names.peers.end());
  const std::string prefix = names.suite + "/" + names.task + "/" + names.pixels + "/" +
                             std::to_string(names.width) + "x" + std::to_string(names.height) +
                             "/threads:" + std::to_string(names.threads);
  RegisterGroup(prefix, contestants, [names, options, make] { return Run(names, options, make()); });
}

}  // namespace tessera::bench
