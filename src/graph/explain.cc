// The plan in words.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "graph/executor.h"
#include "graph/optimize.h"
#include "graph/plan.h"
#include "graph/rules.h"
#include "graph/topology.h"
#include "graph/whole.h"
#include "tessera/context.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using namespace graph;  // NOLINT: this file is about nothing else

// Nothing is computed for a plan that is only printed.
class NoPrepass final : public Prepass, public Workers {
 public:
  ConstImageView Whole(const Node& input) override {
    images_.emplace_back(AsFloats(input.spec()));
    return images_.back().view();
  }
  const Workers& workers() const override { return *this; }
  Context& context() const override { return Context::Default(); }
  int count() const override { return 1; }
  void For(int64_t n, const std::function<void(int64_t, int)>& task) const override {
    for (int64_t i = 0; i < n; ++i) task(i, 0);
  }

 private:
  std::vector<Image> images_;
};

std::string ChannelNames(const ImageSpec& spec, const std::vector<bool>& wanted) {
  std::string s;
  for (size_t c = 0; c < spec.channels.size(); ++c) {
    if (wanted[c]) s += (s.empty() ? "" : ",") + spec.channels[c];
  }
  return s.empty() ? "no channels" : s;
}

std::string PixelsName(const Program& program, BufferId id) {
  if (id == program.result()) return "result";
  const auto& sources = program.plan().sources;
  if (program.IsSource(id)) return sources[Z(id)].source->Describe();
  return "tile " + std::to_string(Z(id) - sources.size());
}

void DescribePoints(const Program& program, const Points& points, std::string& text) {
  text += points.whole_rows ? "  point run, whole rows\n"
                            : "  point run, blocks of " + std::to_string(kBlockPixels) + " pixels, " +
                                  std::to_string(points.planes) + " planes\n";
  for (const BlockOp& op : points.ops) {
    if (const auto* const load = std::get_if<LoadOp>(&op)) {
      text += "    load " + PixelsName(program, load->from) + "\n";
      continue;
    }
    const auto& compute = std::get<ComputeOp>(op);
    text += "    " + compute.label;
    for (size_t k = 0; k < compute.in.size(); ++k) {
      if (compute.IsDirect(k)) text += "  [loads " + PixelsName(program, compute.direct[k]) + "]";
    }
    if (compute.to_result) text += "  [stores]";
    text += "\n";
  }
}

void DescribeStep(const Program& program, const Step& step, std::string& text) {
  const std::string to = PixelsName(program, step.to);
  if (const auto* const points = std::get_if<Points>(&step.how)) {
    DescribePoints(program, *points, text);
    text += "    store " + to;
  } else if (const auto* const samples = std::get_if<Samples>(&step.how)) {
    text += "  samples in rows: " + samples->label + " -> " + to;
  } else if (const auto* const moves = std::get_if<ByteMoves>(&step.how)) {
    text += std::string("  ") + (moves->same ? "copy" : "bytes moved") + " -> " + to;
  } else {
    const auto& window = std::get<Window>(step.how);
    text += "  window step " + window.planned->label + " on " + PixelTypeName(window.type);
    for (const Window::Input& in : window.in) {
      text += ", " + (in.pixels < 0 ? "a whole image" : PixelsName(program, in.pixels));
    }
    text += " -> " + to;
  }
  for (const std::string& rule : step.rules) text += "  {" + rule + "}";
  text += "\n";
}

}  // namespace

std::string Explain(const Node& node, PixelType type, const RenderOptions& options) {
  static_cast<void>(node.spec());  // throws for an empty node
  std::vector<std::string> passes;
  int operations = 0;
  for (const Node& n : TopologicalOrder(node)) operations += n.data()->op->Kind() != OpKind::kSource;
  const auto pretend = [&passes](const Node& n) {
    passes.push_back(n.data()->op->Describe() + " on the whole image");
    return FromImage(Image(AsFloats(n.spec())));
  };
  NoPrepass none;
  bool short_of_memory = false;
  const Node root =
      WithinBudget(options.optimize ? Optimize(node) : node, options.memory_budget, short_of_memory);
  const Plan plan = MakePlan(ResolveWhole(root, true, pretend), operations, none);
  const Roi& roi = plan.spec.data_window;
  std::string text;
  for (size_t k = 0; k < plan.sources.size(); ++k) {
    const PlannedSource& s = plan.sources[k];
    const ImageSpec& spec = s.source->spec();
    text += "source " + std::to_string(k) + ": " + s.source->Describe() + ", " +
            std::to_string(spec.width()) + "x" + std::to_string(spec.height()) + " " +
            PixelTypeName(spec.type) + ", reads " + ChannelNames(spec, s.needed) +
            (s.source->Decoder().empty() ? "" : ", decoded by " + s.source->Decoder()) + "\n";
  }
  int pass = 1;
  passes.insert(passes.end(), plan.prepasses.begin(), plan.prepasses.end());
  for (const std::string& before : passes) text += "pass " + std::to_string(pass++) + ": " + before + "\n";
  text += "pass " + std::to_string(pass) + ": " + std::to_string(plan.operations) +
          (plan.operations == 1 ? " operation, target " : " operations, target ") + SimdTarget() + "\n";
  const Program program(plan, SourceLayouts(plan), Layout::Packed(type, plan.spec.channel_count()),
                        RuleSet(options.rules_off));
  for (const Step& step : program.steps) DescribeStep(program, step, text);
  const TileShape tile = ChooseTileShape(program, roi, options);
  const int64_t bytes = BytesMoved(plan, roi, type);
  char line[160];
  std::snprintf(line, sizeof line, "tiles of %dx%d, result %dx%d %s, %.1f MB moved (%.1f bytes/pixel)\n",
                tile.width, tile.height, roi.width(), roi.height(), PixelTypeName(type),
                static_cast<double>(bytes) / 1e6,
                static_cast<double>(bytes) / static_cast<double>(std::max<int64_t>(1, roi.pixels())));
  return text + line;
}

}  // namespace tessera
