// Evaluation: what needs whole images first, then the plan over tiles or bands.
#include "graph/render.h"

#include <algorithm>
#include <chrono>
#include <unordered_map>
#include <utility>

#include "graph/executor.h"
#include "graph/optimize.h"
#include "graph/plan.h"
#include "graph/rules.h"
#include "graph/statistics.h"
#include "graph/topology.h"
#include "graph/whole.h"
#include "sched/scheduler.h"

namespace tessera {
namespace graph {
namespace {

class PassTimer {
 public:
  PassTimer(RunStats* stats, std::string name) : stats_(stats), name_(std::move(name)) {}
  void Stop(int64_t pixels, int64_t bytes) {
    if (stats_ == nullptr) return;
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start_;
    stats_->passes.push_back({name_, took.count(), pixels, bytes});
  }

 private:
  RunStats* stats_;
  std::string name_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

bool AllResident(const Plan& plan) {
  for (const PlannedSource& s : plan.sources) {
    if (!s.source->View()) return false;
  }
  return true;
}

class SchedulerWorkers final : public Workers {
 public:
  explicit SchedulerWorkers(const RenderOptions& options)
      : shuffle_(options.shuffle_tiles), threads_(shuffle_ ? 1 : sched::ThreadCount(options.threads)) {}
  int count() const override { return threads_; }
  void For(int64_t n, const std::function<void(int64_t, int)>& task) const override {
    if (shuffle_) {
      sched::ShuffledFor(n, 1, task);
    } else {
      sched::ParallelFor(n, threads_, task);
    }
  }

 private:
  bool shuffle_;
  int threads_;
};

// One evaluation: what must be known or computed beforehand, then the plan.
class Evaluation final : public Prepass {
 public:
  Evaluation(const RenderOptions& options, RunStats* stats)
      : options_(options), rules_(options.rules_off), quiet_(options), stats_(stats), workers_(options) {
    quiet_.progress = nullptr;
  }

  // One of `out` and `sink`.
  void Run(const Node& node, const Roi& roi, PixelType type, const ImageView* out, RowSink* sink) {
    int operations = 0;
    for (const Node& n : TopologicalOrder(node)) operations += n.data()->op->Kind() != OpKind::kSource;
    Node root = options_.optimize ? Optimize(node) : node;
    const auto compute = [this](const Node& n) {
      ImageSpec spec = n.spec();
      spec.type = PixelType::kFloat;
      const Image image = Image::Uninitialized(std::move(spec));
      RunWhole(n, image.view());
      return image;
    };
    if (root.data()->op->Kind() == OpKind::kWhole && rules_.IsOn(kWholeInResult) && out != nullptr &&
        IsDenseFloat(*out) && out->roi == root.spec().data_window) {
      NoteRule(kWholeInResult);
      RunWhole(ResolveInputs(root, compute), *out);
      return;
    }
    root = ResolveWhole(root, compute);
    const Plan plan = MakePlan(root, operations, *this);
    const Layout result = out != nullptr ? Layout::Of(*out) : Layout::Packed(type, plan.spec.channel_count());
    const Program program(plan, SourceLayouts(plan), result, rules_);
    for (const std::string& name : program.AppliedRules()) NoteRule(name);
    PassTimer timer(stats_, sink != nullptr ? "stream" : "render");
    if (out != nullptr && AllResident(plan)) {
      RunResident(program, *out, options_);
    } else {
      RunBands(program, roi, type, out, sink, options_);
    }
    timer.Stop(roi.pixels(), BytesMoved(plan, roi, type));
  }

  double Statistic(const Node& input, const StatisticRequest& request) override {
    PassTimer timer(stats_, "mean");
    MeanSink mean(request.weights);
    const Node color = ColorOf(input);
    Evaluation(quiet_, nullptr).Run(color, color.spec().data_window, PixelType::kFloat, nullptr, &mean);
    timer.Stop(input.spec().data_window.pixels(), input.spec().data_window.pixels() * 12);
    return mean.Mean();
  }

  ConstImageView Whole(const Node& input) override {
    if (input.data()->op->Kind() == OpKind::kSource && rules_.IsOn(kSourceAsWhole)) {
      const auto view = static_cast<const SourceOp&>(*input.data()->op).source().View();
      if (view && IsDenseFloat(*view)) {
        NoteRule(kSourceAsWhole);
        return *view;
      }
    }
    const auto [it, fresh] = whole_.try_emplace(input.data());
    if (fresh) {
      ImageSpec spec = input.spec();
      spec.type = PixelType::kFloat;
      const Image image = Image::Uninitialized(std::move(spec));
      const ImageView view = image.view();
      Evaluation(quiet_, stats_).Run(input, view.roi, PixelType::kFloat, &view, nullptr);
      it->second = {input, image};
    }
    return it->second.second.view();
  }
  const Workers& workers() const override { return workers_; }

 private:
  void RunWhole(const Node& node, const ImageView& out) {
    if (out.roi.empty()) return;
    const NodeData& d = *node.data();
    const ContextOf context(d, *this);
    const StageContext& c = context.For({-1, -1, -1, -1});
    PassTimer timer(stats_, d.op->Name());
    d.op->MakeWholeStage(c)->Run(c.whole, out, workers_);
    int64_t bytes = out.roi.pixels() * out.pixel_stride;
    for (const ConstImageView& in : c.whole) bytes += in.roi.pixels() * in.pixel_stride;
    timer.Stop(out.roi.pixels(), bytes);
  }

  void NoteRule(const std::string& name) {
    if (stats_ == nullptr) return;
    std::vector<std::string>& names = stats_->rules;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }

  const RenderOptions& options_;
  const RuleSet rules_;
  RenderOptions quiet_;
  RunStats* stats_;
  SchedulerWorkers workers_;
  std::unordered_map<const NodeData*, std::pair<Node, Image>> whole_;  // the node keeps its address taken
};

}  // namespace

void RenderToSink(const Node& node, PixelType type, RowSink& sink, const RenderOptions& options,
                  RunStats* stats) {
  Evaluation(options, stats).Run(node, node.spec().data_window, type, nullptr, &sink);
}

}  // namespace graph

Image Render(const Node& node, PixelType type, const RenderOptions& options, RunStats* stats) {
  ImageSpec spec = node.spec();
  spec.type = type;
  Image image = Image::Uninitialized(std::move(spec));
  RenderInto(node, image.view(), options, stats);
  return image;
}

void RenderInto(const Node& node, const ImageView& out, const RenderOptions& options, RunStats* stats) {
  const ImageSpec& spec = node.spec();
  if (!spec.data_window.Contains(out.roi))
    throw Error("render", "the region reaches outside the image's data window");
  if (out.data == nullptr && !out.roi.empty())
    throw Error("render", "found an output without pixels, expected an address");
  if (out.channels != spec.channel_count()) {
    throw Error("render", "the output has " + std::to_string(out.channels) + " channels, expected " +
                              std::to_string(spec.channel_count()));
  }
  graph::Evaluation(options, stats).Run(node, out.roi, out.type, &out, nullptr);
}

}  // namespace tessera
