// Evaluation: what needs whole images first, then the plan over tiles or bands.
#include "graph/render.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <set>
#include <unordered_map>
#include <utility>

#include "graph/executor.h"
#include "graph/optimize.h"
#include "graph/parts.h"
#include "graph/plan.h"
#include "graph/rules.h"
#include "graph/topology.h"
#include "graph/whole.h"
#include "sched/cancellable_workers.h"
#include "sched/progress.h"
#include "sched/scheduler.h"
#include "tessera/prepared_graph.h"

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

// Something that computes and does not tell who has nothing to do.
class AllThreads {
 public:
  AllThreads(RunPhases* phases, int threads) : phases_(phases), threads_(threads) {
    if (phases_ != nullptr) start_ = std::chrono::steady_clock::now();
  }
  ~AllThreads() {
    if (phases_ == nullptr) return;
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start_;
    phases_->compute += sched::ThreadCount(threads_) * took.count();
    phases_->seconds += took.count();
  }
  AllThreads(const AllThreads&) = delete;
  AllThreads& operator=(const AllThreads&) = delete;

 private:
  RunPhases* const phases_;
  const int threads_;
  std::chrono::steady_clock::time_point start_;
};

bool AllResident(const Plan& plan) {
  return std::all_of(plan.sources.begin(), plan.sources.end(),
                     [](const PlannedSource& s) { return s.source->View().has_value(); });
}

// Passes over pixels that a graph takes.
int CountPasses(const Node& root) {
  int passes = 1;
  for (const Node& node : TopologicalOrder(root)) {
    const NodeData& d = *node.data();
    passes += d.op->Kind() == OpKind::kWhole;
    for (size_t k = 0; k < d.inputs.size(); ++k) passes += d.op->NeedsWhole(static_cast<int>(k));
  }
  return passes;
}

// One graph: what must be known or computed beforehand, then the plan.
class Evaluation final : public Prepass {
 public:
  // `outer`: the evaluation that this one is a part of.
  Evaluation(const RenderOptions& options, RunStats* stats, sched::Progress& progress,
             const Evaluation* outer = nullptr)
      : options_(options),
        rules_(options.rules_off),
        stats_(stats),
        progress_(progress),
        workers_(options.threads, ContextOf(options), options.shuffle_tiles, progress),
        short_of_memory_(outer != nullptr && outer->short_of_memory_) {}

  // One of `out` and `sink`.
  void Run(const Node& node, const Roi& roi, PixelType type, const ImageView* out, RowSink* sink) {
    const Node root = Planned(node);
    if (root.data()->op->Kind() == OpKind::kWhole && !PrefersRows(*root.data()->op) &&
        rules_.IsOn(kWholeInResult) && out != nullptr && IsDenseFloat(*out) &&
        out->roi == root.spec().data_window && !short_of_memory_) {
      NoteRule(kWholeInResult);
      RunWhole(ResolveWhole(root, false, [this](const Node& n) { return Computed(n); }), *out);
      return;
    }
    const Plan plan = PlanOf(node, root);
    const Layout result = out != nullptr ? Layout::Of(*out) : Layout::Packed(type, plan.spec.channel_count());
    Execute(Program(plan, SourceLayouts(plan), result, rules_), roi, type, out, sink);
  }

  Plan Prepare(const Node& node) { return PlanOf(node, Planned(node)); }

  // `root`: the node as it is planned.
  Plan PlanOf(const Node& node, const Node& root) {
    int operations = 0;
    for (const Node& n : TopologicalOrder(node)) operations += n.data()->op->Kind() != OpKind::kSource;
    return MakePlan(ResolveWhole(root, true, [this](const Node& n) { return Computed(n); }), operations,
                    *this);
  }

  void Execute(const Program& program, const Roi& roi, PixelType type, const ImageView* out, RowSink* sink) {
    RequireParts(program.plan(), roi);
    for (const std::string& name : program.AppliedRules()) NoteRule(name);
    PassTimer timer(stats_, sink != nullptr ? "stream" : "render");
    if (out != nullptr && AllResident(program.plan())) {
      const AllThreads computing(phases(), options_.threads);
      RunResident(program, *out, options_, progress_);
    } else {
      RunBands(program, roi, type, out, sink, options_, progress_, phases());
    }
    timer.Stop(roi.pixels(), BytesMoved(program.plan(), roi, type));
    NoteFiles(program.plan());
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
      const Image image = Image::Uninitialized(AsFloats(input.spec()), workers_.context());
      const ImageView view = image.view();
      Evaluation(options_, stats_, progress_, this).Run(input, view.roi, PixelType::kFloat, &view, nullptr);
      it->second = {input, image};
    }
    return it->second.second.view();
  }
  const Workers& workers() const override { return workers_; }

 private:
  // The node as it is computed.
  Node Planned(const Node& node) {
    Node root = options_.optimize ? Optimize(node) : node;
    if (!short_of_memory_) root = WithinBudget(root, options_.memory_budget, short_of_memory_);
    RequireNoWholeOfPart(root);
    return root;
  }

  // A source of a whole operation's result.
  Node Computed(const Node& node) {
    if (PrefersRows(*node.data()->op)) {
      const Image image = Image::Uninitialized(AsFloats(node.spec()), workers_.context());
      TakeRows(node)->Give(image.view());
      return FromImage(image);
    }
    if (short_of_memory_) {
      if (const auto stage = TakeRows(node)) return SourceOfRows(stage, node.spec(), workers_.context());
    }
    const Image image = Image::Uninitialized(AsFloats(node.spec()), workers_.context());
    RunWhole(node, image.view());
    if (short_of_memory_) whole_.clear();
    return FromImage(image);
  }

  // Has seen all of the input. Null where the operation has no such stage, or these pixels have to be seen
  // whole.
  std::shared_ptr<const RowsStage> TakeRows(const Node& node) {
    const NodeData& d = *node.data();
    const LittleMemory* const op = AsLittleMemory(*d.op);
    if (op == nullptr || d.inputs.size() != 1) return nullptr;
    const Node& input = d.inputs[0];
    const std::shared_ptr<RowsStage> stage = op->MakeRowsStage(input.spec(), workers_.context());
    if (stage == nullptr) return nullptr;
    PassTimer timer(stats_, d.op->Name());
    RowsSink sink(*stage);
    const Roi& window = input.spec().data_window;
    InOwnPass([&](RunStats* stats) {
      Evaluation(options_, stats, progress_, this).Run(input, window, PixelType::kFloat, nullptr, &sink);
    });
    if (!stage->End(workers_)) return nullptr;
    timer.Stop(window.pixels(), window.pixels() * 4 * input.spec().channel_count());
    return stage;
  }

  void RunWhole(const Node& node, const ImageView& out) {
    if (out.roi.empty()) return;
    const NodeData& d = *node.data();
    const StageContexts context(d, *this);
    const StageContext& c = context.For({-1, -1, -1, -1});
    PassTimer timer(stats_, d.op->Name());
    const AllThreads computing(phases(), options_.threads);
    progress_.Begin(1);
    d.op->MakeWholeStage(c)->Run(c.whole, out, workers_);
    progress_.End();
    progress_.Check();
    int64_t bytes = out.roi.pixels() * out.pixel_stride;
    for (const ConstImageView& in : c.whole) bytes += in.roi.pixels() * in.pixel_stride;
    timer.Stop(out.roi.pixels(), bytes);
  }

  RunPhases* phases() const { return stats_ != nullptr ? &stats_->phases : nullptr; }

  // An evaluation that is told as one pass of this one's: of what it did, where its time went is kept.
  template <typename Work>
  void InOwnPass(const Work& work) {
    RunStats own;
    work(stats_ != nullptr ? &own : nullptr);
    if (stats_ != nullptr) stats_->phases.Add(own.phases);
  }

  void NoteRule(const std::string& name) {
    if (stats_ == nullptr) return;
    std::vector<std::string>& names = stats_->rules;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }

  void NoteFiles(const Plan& plan) {
    if (stats_ == nullptr) return;
    for (const PlannedSource& s : plan.sources) {
      if (s.last <= s.first || s.source->Decoder().empty()) continue;
      const std::string text = s.source->Describe() + " decoded by " + s.source->Decoder();
      std::vector<std::string>& files = stats_->files;
      if (std::find(files.begin(), files.end(), text) == files.end()) files.push_back(text);
    }
  }

  const RenderOptions& options_;
  const RuleSet rules_;
  RunStats* const stats_;
  sched::Progress& progress_;
  const sched::CancellableWorkers workers_;
  bool short_of_memory_;  // whole images do not fit into the budget
  std::unordered_map<const NodeData*, std::pair<Node, Image>> whole_;  // the node keeps its address taken
};

void Evaluate(const Node& node, const Roi& roi, PixelType type, const ImageView* out, RowSink* sink,
              const RenderOptions& options, RunStats* stats) {
  if (stats != nullptr) stats->phases.threads = sched::ThreadCount(options.threads);
  sched::Progress progress(options.progress);
  if (options.progress) progress.Expect(CountPasses(node));
  Evaluation(options, stats, progress).Run(node, roi, type, out, sink);
  progress.Finish();
  progress.Check();
}

void RequireFit(const ImageSpec& spec, const ImageView& out) {
  if (!spec.data_window.Contains(out.roi))
    throw Error("render", "the region reaches outside the image's data window");
  if (out.data == nullptr && !out.roi.empty())
    throw Error("render", "found an output without pixels, expected an address");
  if (out.channels != spec.channel_count()) {
    throw Error("render", "the output has " + std::to_string(out.channels) + " channels, expected " +
                              std::to_string(spec.channel_count()));
  }
}

}  // namespace

void RenderToSink(const Node& node, PixelType type, RowSink& sink, const RenderOptions& options,
                  RunStats* stats) {
  Evaluate(node, node.spec().data_window, type, nullptr, &sink, options, stats);
}

}  // namespace graph

Image Render(const Node& node, PixelType type, const RenderOptions& options, RunStats* stats) {
  ImageSpec spec = node.spec();
  spec.type = type;
  Image image = Image::Uninitialized(std::move(spec), graph::ContextOf(options));
  RenderInto(node, image.view(), options, stats);
  return image;
}

void RenderInto(const Node& node, const ImageView& out, const RenderOptions& options, RunStats* stats) {
  graph::RequireFit(node.spec(), out);
  graph::Evaluate(node, out.roi, out.type, &out, nullptr, options, stats);
}

struct PreparedGraph::Kept {
  Kept(const Node& node, const RenderOptions& wanted, RunStats* stats)
      : given(node),
        options(wanted),
        rules(options.rules_off),
        progress(options.progress),
        evaluation(options, stats, progress) {
    static_cast<void>(node.spec());  // throws for an empty node
    progress.Expect(graph::CountPasses(node));
    for (const Node& n : graph::TopologicalOrder(node)) {
      if (n.data()->op->Kind() == graph::OpKind::kSource) sources.insert(n.data()->op.get());
    }
    plan = evaluation.Prepare(node);
    progress.Finish();
    progress.Check();
    options.progress = nullptr;
  }

  const graph::Program& ProgramFor(const graph::Layout& result) {
    const std::lock_guard lock(mutex);
    for (const auto& [layout, program] : programs) {
      if (layout == result) return *program;
    }
    programs.emplace_back(
        result, std::make_unique<const graph::Program>(plan, graph::SourceLayouts(plan), result, rules));
    return *programs.back().second;
  }

  Node given;  // the graph
  RenderOptions options;
  const graph::RuleSet rules;
  sched::Progress progress;      // of the preparation
  graph::Evaluation evaluation;  // has the whole images
  graph::Plan plan;
  std::set<const graph::Op*> sources;  // of that graph, those that the plan has no use for, too
  std::mutex mutex;
  std::vector<std::pair<graph::Layout, std::unique_ptr<const graph::Program>>> programs;
};

PreparedGraph::PreparedGraph(const Node& node, const RenderOptions& options, RunStats* stats)
    : kept_(std::make_unique<Kept>(node, options, stats)) {}
PreparedGraph::~PreparedGraph() = default;

const ImageSpec& PreparedGraph::spec() const { return kept_->plan.spec; }

Roi PreparedGraph::RequiredRegion(const Node& source, const Roi& out) const {
  if (!spec().data_window.Contains(out))
    throw Error("region", "reaches outside the image's data window, expected a part of it");
  const graph::Plan& plan = kept_->plan;
  const std::vector<Roi> regions = graph::RequiredRegions(plan, out);
  // Names that were given to a source make other nodes of the same operation.
  const graph::Op* const op = source ? source.data()->op.get() : nullptr;
  if (kept_->sources.count(op) == 0)
    throw Error("source", "is none of the graph's, expected one that it reads");
  Roi region;
  for (size_t k = 0; k < plan.sources.size(); ++k) {
    if (plan.sources[k].node.data()->op.get() != op) continue;
    region = Union(region, regions[k]);
  }
  return region;
}

void PreparedGraph::RenderInto(const ImageView& out, const std::function<bool(double)>& callback) const {
  graph::RequireFit(spec(), out);
  sched::Progress progress(callback);
  graph::Evaluation(kept_->options, nullptr, progress)
      .Execute(kept_->ProgramFor(graph::Layout::Of(out)), out.roi, out.type, &out, nullptr);
  progress.Finish();
  progress.Check();
}

}  // namespace tessera
