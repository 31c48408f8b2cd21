// Whole images: what they take, and how graphs do with less.
#include "graph/whole.h"

#include <cstring>
#include <unordered_set>
#include <utility>

#include "base/arena.h"
#include "graph/optimize.h"
#include "graph/topology.h"

namespace tessera::graph {
namespace {

// Of floats that stay in memory while the graph is computed.
size_t WholeBytes(const Node& root) {
  std::unordered_set<const NodeData*> held;
  for (const Node& node : TopologicalOrder(root)) {
    const NodeData& d = *node.data();
    const bool is_whole = d.op->Kind() == OpKind::kWhole && !PrefersRows(*d.op);
    if (is_whole) held.insert(&d);
    for (size_t k = 0; k < d.inputs.size(); ++k) {
      if (is_whole || d.op->NeedsWhole(static_cast<int>(k))) held.insert(d.inputs[k].data());
    }
  }
  size_t bytes = 0;
  for (const NodeData* d : held) {
    const bool is_there = d->op->Kind() == OpKind::kSource && d->spec.type == PixelType::kFloat &&
                          static_cast<const SourceOp&>(*d->op).source().View().has_value();
    if (!is_there) bytes += static_cast<size_t>(d->spec.data_window.pixels()) * 4 * d->spec.channels.size();
  }
  return bytes;
}

class RowsSource final : public PixelSource {
 public:
  RowsSource(std::shared_ptr<const RowsStage> stage, ImageSpec spec, Context& context)
      : stage_(std::move(stage)), spec_(std::move(spec)), context_(context) {}
  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return "rows"; }
  std::unique_ptr<RowReader> Open(int first, int last) const override {
    return std::make_unique<Reader>(*this, first, last);
  }

 private:
  class Reader final : public RowReader {
   public:
    Reader(const RowsSource& source, int first, int last) : source_(source), first_(first), last_(last) {}
    void Read(const ImageView& out) override {
      const int channels = source_.spec_.channel_count();
      if (last_ - first_ == channels) return source_.stage_->Give(out);
      const Roi& r = out.roi;
      base::Arena arena(source_.context_);
      auto* const floats =
          arena.Allocate<float>(static_cast<size_t>(r.pixels()) * static_cast<size_t>(channels));
      const ImageView all(reinterpret_cast<std::byte*>(floats), r, channels, PixelType::kFloat);
      source_.stage_->Give(all);
      for (int y = r.y0; y < r.y1; ++y) {
        for (int x = r.x0; x < r.x1; ++x)
          std::memcpy(out.At(x, y), all.At(x, y, first_), static_cast<size_t>(out.pixel_stride));
      }
    }

   private:
    const RowsSource& source_;
    const int first_, last_;
  };

  std::shared_ptr<const RowsStage> stage_;
  ImageSpec spec_;
  Context& context_;
};

}  // namespace

Node ResolveWhole(const Node& root, bool with_root, const std::function<Node(const Node&)>& compute) {
  return Rewrite(root, [&](const Node& node, const Node& before) {
    const bool is_whole =
        node.data()->op->Kind() == OpKind::kWhole && (with_root || before.data() != root.data());
    return is_whole ? compute(node) : node;
  });
}

Node WithinBudget(const Node& root, size_t budget, bool& short_of_memory) {
  // Who keeps the default has stated no budget.
  short_of_memory = budget != RenderOptions().memory_budget && WholeBytes(root) > budget;
  if (!short_of_memory) return root;
  return Rewrite(root, [](const Node& node, const Node&) {
    const LittleMemory* const op = AsLittleMemory(*node.data()->op);
    std::shared_ptr<const Op> other = op != nullptr ? op->InLittleMemory() : nullptr;
    return other != nullptr ? MakeNode(std::move(other), node.data()->inputs) : node;
  });
}

bool HasSameMethods(const Node& node, const RenderOptions& options, size_t other_budget) {
  const Node root = options.optimize ? Optimize(node) : node;
  bool is_short = false, is_short_with_other = false;
  WithinBudget(root, options.memory_budget, is_short);
  WithinBudget(root, other_budget, is_short_with_other);
  return is_short == is_short_with_other;
}

Node SourceOfRows(std::shared_ptr<const RowsStage> stage, const ImageSpec& spec, Context& context) {
  return MakeSource(std::make_shared<const RowsSource>(std::move(stage), AsFloats(spec), context));
}

ImageSpec AsFloats(ImageSpec spec) {
  spec.type = PixelType::kFloat;
  return spec;
}

}  // namespace tessera::graph
