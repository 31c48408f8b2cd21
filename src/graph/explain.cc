// The plan in words.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "graph/executor.h"
#include "graph/optimize.h"
#include "graph/plan.h"
#include "graph/topology.h"
#include "graph/whole.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using namespace graph;  // NOLINT: this file is about nothing else

// Nothing is computed for a plan that is only printed.
class NoPrepass final : public Prepass, public Workers {
 public:
  double Statistic(const Node&, const StatisticRequest&) override {
    return std::numeric_limits<double>::quiet_NaN();
  }
  ConstImageView Whole(const Node& input) override {
    ImageSpec spec = input.spec();
    spec.type = PixelType::kFloat;
    images_.emplace_back(std::move(spec));
    return images_.back().view();
  }
  const Workers& workers() const override { return *this; }
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

void DescribeRun(const Plan& plan, const PointRun& run, bool last, std::string& text) {
  text += "  point run, blocks of " + std::to_string(kBlockPixels) + " pixels, " +
          std::to_string(run.planes) + " planes\n";
  for (const PointRun::Item& item : run.items) {
    if (item.is_load) {
      const PlaneLoad& load = run.loads[static_cast<size_t>(item.index)];
      text += "    load " +
              (load.from_tile ? "tile " + std::to_string(load.index)
                              : plan.sources[static_cast<size_t>(load.index)].source->Describe()) +
              "\n";
    } else {
      const PointStep& step = run.steps[static_cast<size_t>(item.index)];
      text += "    " + step.label;
      if (step.fused_load[0] >= 0) text += "  [with the load]";
      if (step.fused_store) text += "  [with the store]";
      if (run.samples) text += "  [sample by sample where pixels are dense]";
      text += "\n";
    }
  }
  text += last ? "    store result" : "    store tile";
  if (!run.moved.empty()) text += "  [bytes moved where pixels are dense and of one type]";
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
    ImageSpec spec = n.spec();
    spec.type = PixelType::kFloat;
    return Image(std::move(spec));
  };
  NoPrepass none;
  const Plan plan =
      MakePlan(ResolveWhole(options.optimize ? Optimize(node) : node, pretend), operations, none);
  const Roi& roi = plan.spec.data_window;
  std::string text;
  for (size_t k = 0; k < plan.sources.size(); ++k) {
    const PlannedSource& s = plan.sources[k];
    const ImageSpec& spec = s.source->spec();
    text += "source " + std::to_string(k) + ": " + s.source->Describe() + ", " +
            std::to_string(spec.width()) + "x" + std::to_string(spec.height()) + " " +
            PixelTypeName(spec.type) + ", reads " + ChannelNames(spec, s.needed) + "\n";
  }
  int pass = 1;
  passes.insert(passes.end(), plan.prepasses.begin(), plan.prepasses.end());
  for (const std::string& before : passes) text += "pass " + std::to_string(pass++) + ": " + before + "\n";
  text += "pass " + std::to_string(pass) + ": " + std::to_string(plan.operations) +
          (plan.operations == 1 ? " operation, target " : " operations, target ") + SimdTarget() + "\n";
  for (size_t i = 0; i < plan.buffers.size(); ++i) {
    const Buffer& b = plan.buffers[i];
    if (b.run) {
      DescribeRun(plan, *b.run, i + 1 == plan.buffers.size(), text);
    } else {
      text += "  window step " + b.tile->label + " -> tile " + std::to_string(i) + "\n";
    }
  }
  const TileShape tile = ChooseTileShape(plan, roi, type, options);
  const int64_t bytes = BytesMoved(plan, roi, type);
  char line[160];
  std::snprintf(line, sizeof line, "tiles of %dx%d, result %dx%d %s, %.1f MB moved (%.1f bytes/pixel)\n",
                tile.width, tile.height, roi.width(), roi.height(), PixelTypeName(type),
                static_cast<double>(bytes) / 1e6,
                static_cast<double>(bytes) / static_cast<double>(std::max<int64_t>(1, roi.pixels())));
  return text + line;
}

}  // namespace tessera
