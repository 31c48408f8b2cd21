// Costs by trial: small parts of a graph are computed on rows of its own files, and whole images on their
// middle.
#include "tessera/cost.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <map>
#include <memory>
#include <unordered_map>
#include <utility>

#include "graph/executor.h"
#include "graph/optimize.h"
#include "graph/plan.h"
#include "graph/topology.h"
#include "graph/whole.h"
#include "sched/scheduler.h"
#include "tessera/error.h"
#include "tessera/prepared_graph.h"

namespace tessera {
namespace {

using namespace graph;  // NOLINT: this file is about nothing else

// Seconds of the clock and of all threads of this process.
struct Times {
  double elapsed = 0, busy = 0;
  Times operator-(const Times& o) const { return {elapsed - o.elapsed, busy - o.busy}; }
  Times operator*(double f) const { return {elapsed * f, busy * f}; }
  Times operator+(const Times& o) const { return {elapsed + o.elapsed, busy + o.busy}; }
};
Times Now() {
  timespec cpu{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
  const std::chrono::duration<double> clock = std::chrono::steady_clock::now().time_since_epoch();
  return {clock.count(), static_cast<double>(cpu.tv_sec) + 1e-9 * static_cast<double>(cpu.tv_nsec)};
}
template <typename Work>
Times TimesOf(const Work& work) {
  const Times start = Now();
  work();
  return Now() - start;
}
// The mean of two: a run meets cold caches, fresh pages and others on the machine, too.
template <typename Work>
Times MeanOfTwo(const Work& work) {
  const Times a = TimesOf(work), b = TimesOf(work);
  return (a + b) * 0.5;
}

// In place of a file or of a whole image: its kind and size, the pixels of a sample over and over.
class StandIn final : public PixelSource {
 public:
  StandIn(ImageSpec spec, Image sample, std::string words)
      : spec_(std::move(spec)), sample_(std::move(sample)), words_(std::move(words)) {}
  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return words_; }
  std::unique_ptr<RowReader> Open(int first, int last) const override {
    return std::make_unique<Reader>(*this, first, last);
  }
  // Pixels [x0, x1) of a row. The sample comes again and again, shifted along it down the picture and down it
  // across the picture: a coder must not find what it has just seen.
  void Copy(int y, int x0, int x1, int first, int last, std::byte* out) const {
    const ConstImageView from = sample_.view();
    const Roi& r = from.roi;
    const int all = spec_.channel_count();
    const size_t sample = PixelBytes(spec_.type), pixel = sample * static_cast<size_t>(last - first);
    const int shift = Shift(Turns(y, r.y0, r.height()), r.width());
    for (int x = x0; x < x1;) {
      const int across = Turns(x + int64_t{shift}, r.x0, r.width());
      const int row = Wrapped(y + int64_t{Shift(across, r.height())}, r.y0, r.height());
      const int at = Wrapped(x + int64_t{shift}, r.x0, r.width()), run = std::min(x1 - x, r.x1 - at);
      const std::byte* p = from.At(at, row, first);
      if (last - first == all) {
        std::memcpy(out, p, pixel * static_cast<size_t>(run));
        out += pixel * static_cast<size_t>(run);
      } else {
        for (int i = 0; i < run; ++i, p += from.pixel_stride, out += pixel) std::memcpy(out, p, pixel);
      }
      x += run;
    }
  }

 private:
  static int Turns(int64_t v, int low, int n) {
    return static_cast<int>((v - low - (v < low ? n - 1 : 0)) / n);
  }
  static int Wrapped(int64_t v, int low, int n) {
    return static_cast<int>(v - int64_t{Turns(v, low, n)} * n);
  }
  // By the golden section, so that shifts of few turns are far from each other.
  static int Shift(int turn, int n) {
    const double part = 0.618034 * turn;
    return static_cast<int>((part - std::floor(part)) * n);
  }
  class Reader final : public RowReader {
   public:
    Reader(const StandIn& source, int first, int last) : source_(source), first_(first), last_(last) {}
    void Read(const ImageView& out) override {
      for (int y = out.roi.y0; y < out.roi.y1; ++y)
        source_.Copy(y, out.roi.x0, out.roi.x1, first_, last_, out.At(out.roi.x0, y));
    }

   private:
    const StandIn& source_;
    const int first_, last_;
  };

  ImageSpec spec_;
  Image sample_;
  std::string words_;
};

bool IsResident(const Node& node) {
  const NodeData& d = *node.data();
  return d.op->Kind() == OpKind::kSource && static_cast<const SourceOp&>(*d.op).source().View().has_value();
}
Roi Middle(const Roi& r, int side) {
  const int w = std::min(side, r.width()), h = std::min(side, r.height());
  const int x = r.x0 + (r.width() - w) / 2, y = r.y0 + (r.height() - h) / 2;
  return {x, y, x + w, y + h};
}

class Trial {
 public:
  Trial(PixelType type, const RenderOptions& options) : options_(options), type_(type) {
    options_.progress = nullptr;
    estimate_.threads = sched::ThreadCount(options.threads);
  }

  CostEstimate Of(const Node& node) {
    bool is_short = false;
    const Node root =
        WithinBudget(options_.optimize ? Optimize(node) : node, options_.memory_budget, is_short);
    const Node tried = Rewrite(root, [&](const Node& now, const Node&) { return InItsPlace(now); });
    Stream(tried, type_, "compute");
    Bytes(tried);
    return std::move(estimate_);
  }

 private:
  void Add(const std::string& name, const Times& t) {
    const double most = t.elapsed * estimate_.threads;
    estimate_.parts.push_back({name, t.elapsed, std::clamp(t.busy, 0.0, most), pass_});
  }

  Node InItsPlace(const Node& node) {
    const NodeData& d = *node.data();
    if (d.op->Kind() == OpKind::kSource) return IsResident(node) ? node : OfFile(node);
    if (d.op->Kind() == OpKind::kWhole) return Whole(node);
    std::vector<Node> inputs = d.inputs;
    bool changed = false;
    for (size_t k = 0; k < inputs.size(); ++k) {
      if (!d.op->NeedsWhole(static_cast<int>(k))) continue;
      inputs[k] = Held(inputs[k]);
      changed |= inputs[k].data() != d.inputs[k].data();
    }
    return changed ? MakeNode(d.op, std::move(inputs)) : node;
  }

  // The first rows as they are read, the time that all take.
  Node OfFile(const Node& node) {
    const PixelSource& source = static_cast<const SourceOp&>(*node.data()->op).source();
    const ImageSpec& spec = source.spec();
    const Roi& w = spec.data_window;
    ImageSpec part = spec;
    const int grain = std::max(1, source.RowGranularity());
    const int64_t wished = std::max<int64_t>((int64_t{1} << 19) / std::max(1, w.width()), 32);
    const int rows = static_cast<int>(std::min<int64_t>((wished + grain - 1) / grain * grain, w.height()));
    part.data_window.y1 = std::min(w.y1, w.y0 + 2 * rows);
    Image sample(part);
    Times decoding;
    if (!w.empty()) {
      std::unique_ptr<RowReader> reader;
      const auto read = [&](int y0, int y1) { reader->Read(sample.view().Sub({w.x0, y0, w.x1, y1})); };
      const Times opened = TimesOf([&] {
        reader = source.Open(0, spec.channel_count());
        reader->Limit(estimate_.threads, options_.memory_budget / 4);
        read(w.y0, w.y0 + rows);
      });
      const int more = part.data_window.y1 - w.y0 - rows;
      Times all = opened;
      if (more > 0) {
        const Times second = TimesOf([&] { read(w.y0 + rows, part.data_window.y1); });
        all = opened + second * (static_cast<double>(w.height() - rows) / more);
      }
      decoding = all;
    }
    Node file = MakeSource(std::make_shared<const StandIn>(spec, std::move(sample), source.Describe()));
    files_.emplace(file.data()->op.get(), std::pair(file, decoding));
    return file;
  }

  // All of its pixels in memory, as floats.
  Node Held(const Node& node) {
    if (IsResident(node)) return node;
    const auto found = held_.find(node.data());
    if (found != held_.end()) return found->second.second;
    Stream(node, PixelType::kFloat, "all of " + node.data()->op->Name());
    const ImageSpec spec = AsFloats(node.spec());
    const Image all = Image(spec);
    const StandIn pixels(spec, estimate_.band, "");
    for (int y = spec.data_window.y0; y < spec.data_window.y1 && !estimate_.band.spec().data_window.empty();
         ++y)
      pixels.Copy(y, spec.data_window.x0, spec.data_window.x1, 0, spec.channel_count(),
                  all.view().At(spec.data_window.x0, y));
    estimate_.memory += BytesOf(spec);
    return held_.emplace(node.data(), std::pair(node, FromImage(all))).first->second.second;
  }

  static size_t BytesOf(const ImageSpec& spec) {
    return static_cast<size_t>(spec.data_window.pixels()) * 4 * spec.channels.size();
  }

  // An operation on the middle of its images.
  Node Whole(const Node& node) {
    const NodeData& d = *node.data();
    int64_t all = node.spec().data_window.pixels();
    for (const Node& input : d.inputs) {
      all += input.spec().data_window.pixels();
      if (IsResident(input) || counted_.count(input.data()) > 0) continue;
      counted_.emplace(input.data(), input);
      if (!PrefersRows(*d.op)) estimate_.memory += BytesOf(input.spec());
      Stream(input, PixelType::kFloat, "all of " + input.data()->op->Name());
    }
    estimate_.memory += BytesOf(node.spec());
    Times took;
    Image result;
    int64_t tried = 0;
    for (int side = 512; side <= 1024; side *= 2) {
      const Node small = Small(d, side, &tried);
      const Times t = MeanOfTwo([&] { result = Render(small, PixelType::kFloat, options_); });
      tried += small.spec().data_window.pixels();
      took = t * (static_cast<double>(all) / static_cast<double>(std::max<int64_t>(1, tried)));
      if (t.elapsed > 0.05 || tried >= all) break;
    }
    Add(d.op->Name(), took);
    ++pass_;
    return MakeSource(
        std::make_shared<const StandIn>(AsFloats(node.spec()), std::move(result), d.op->Name()));
  }

  // The operation on the middles of its images.
  Node Small(const NodeData& d, int side, int64_t* pixels) {
    std::vector<Node> inputs;
    *pixels = 0;
    for (const Node& input : d.inputs) {
      ImageSpec spec = AsFloats(input.spec());
      spec.data_window = spec.display_window = Middle(spec.data_window, side);
      const Image part = Image::Uninitialized(spec, ContextOf(options_));
      RenderInto(input, part.view(), options_);
      inputs.push_back(FromImage(part));
      *pixels += spec.data_window.pixels();
    }
    return MakeNode(d.op, std::move(inputs));
  }

  void Decoding(const Node& file) {
    Add("decode " + file.data()->op->Describe(), files_.at(file.data()->op.get()).second);
  }
  // A pass over the pixels from sources to a result.
  void Stream(const Node& node, PixelType type, const std::string& name) {
    const ImageSpec& spec = node.spec();
    const Roi& w = spec.data_window;
    ImageSpec part = spec;
    part.type = type;
    std::unique_ptr<PreparedGraph> prepared;
    const Times prepare = TimesOf([&] { prepared = std::make_unique<PreparedGraph>(node, options_); });
    const auto rows = [&](int n) {
      const int y = w.y0 + (w.height() - n) / 2;
      part.data_window = {w.x0, y, w.x1, y + n};
      estimate_.band = Image(part);
      return MeanOfTwo([&] { prepared->RenderInto(estimate_.band.view()); });
    };
    Times all;
    if (!w.empty()) {
      int n = static_cast<int>(std::clamp<int64_t>((int64_t{1} << 18) / w.width(), 1, w.height()));
      Times before = rows(n);
      all = before * (static_cast<double>(w.height()) / n);
      // Until it is long enough to be measured; what every call takes is not taken as often as there are
      // rows.
      for (int first = n; before.elapsed < 0.04 && n < w.height() && int64_t{n} * w.width() < 1 << 23;) {
        const int more = std::min(2 * n, w.height());
        const Times now = rows(more);
        all = now + (now - before) * (static_cast<double>(w.height() - more) / (more - n));
        if (now.elapsed <= before.elapsed) all = now * (static_cast<double>(w.height()) / more);
        before = now, n = more;
        if (n > 64 * first) break;
      }
    }
    Add("prepare", prepare);
    ++pass_;
    // A file whose rows are all needed for a few of the result is unpacked before anything is computed.
    std::vector<Node> beside;
    bool before = false;
    for (const Node& n : TopologicalOrder(node)) {
      if (files_.count(n.data()->op.get()) == 0) continue;
      const int height = n.spec().height(), few = std::max(1, w.height() / 8);
      const Roi rows_of_all = {w.x0, w.y0 + (w.height() - few) / 2, w.x1,
                               w.y0 + (w.height() - few) / 2 + few};
      const bool first = !w.empty() && prepared->RequiredRegion(n, rows_of_all).height() > height / 2;
      if (first) Decoding(n);
      if (!first) beside.push_back(n);
      before |= first;
    }
    if (before) ++pass_;
    for (const Node& n : beside) Decoding(n);
    Add(name, all);
    ++pass_;
  }
  // What the last pass moves, and the rows that are on their way at a time.
  void Bytes(const Node& node) {
    const Roi& w = node.spec().data_window;
    estimate_.pixels = w.pixels();
    estimate_.bytes = w.pixels() * node.spec().channel_count() * static_cast<int64_t>(PixelBytes(type_));
    for (const Node& n : TopologicalOrder(node)) {
      if (n.data()->op->Kind() != OpKind::kSource) continue;
      const ImageSpec& s = n.spec();
      estimate_.bytes +=
          s.data_window.pixels() * s.channel_count() * static_cast<int64_t>(PixelBytes(s.type));
    }
    constexpr size_t kBand = size_t{24} << 20;
    const size_t bands = static_cast<size_t>(estimate_.threads) + 3;
    estimate_.memory +=
        std::min(static_cast<size_t>(estimate_.bytes), std::min(kBand * bands, options_.memory_budget));
  }

  RenderOptions options_;
  PixelType type_;
  CostEstimate estimate_;
  int pass_ = 0;
  std::unordered_map<const Op*, std::pair<Node, Times>> files_;      // stand-ins, and what decoding takes
  std::unordered_map<const NodeData*, std::pair<Node, Node>> held_;  // the first keeps its address taken
  std::unordered_map<const NodeData*, Node> counted_;
};

}  // namespace

double CostEstimate::Seconds() const {
  struct Pass {
    double longest = 0, all = 0, busy = 0;
  };
  std::map<int, Pass> passes;
  for (const Part& p : parts) {
    Pass& pass = passes[p.pass];
    pass.longest = std::max(pass.longest, p.elapsed), pass.all += p.elapsed, pass.busy += p.busy;
  }
  const int n = std::max(1, threads);
  double seconds = 0;
  for (const auto& [number, p] : passes) {
    // Of so many bands the first is decoded and the last encoded by itself; one thread does it all by turns.
    const double overlapped = std::max(p.longest, p.busy / n) + (p.all - p.longest) / (4 * n);
    seconds += n == 1 ? p.all : std::min(p.all, overlapped);
  }
  return seconds;
}

std::string CostEstimate::Limit() const {
  const auto longest = std::max_element(parts.begin(), parts.end(),
                                        [](const Part& a, const Part& b) { return a.elapsed < b.elapsed; });
  return longest == parts.end() ? "" : longest->name;
}

CostEstimate EstimateCost(const Node& node, PixelType type, const RenderOptions& options) {
  static_cast<void>(node.spec());  // throws for an empty node
  return Trial(type, options).Of(node);
}

}  // namespace tessera
