// The plan in words.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "graph/executor.h"
#include "graph/plan.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using namespace graph;  // NOLINT: this file is about nothing else

std::string ChannelNames(const ImageSpec& spec, const std::vector<bool>& wanted) {
  std::string s;
  for (size_t c = 0; c < spec.channels.size(); ++c) {
    if (wanted[c]) s += (s.empty() ? "" : ",") + spec.channels[c];
  }
  return s.empty() ? "no channels" : s;
}

void DescribeRun(const Plan& plan, const PointRun& run, bool last, std::string& text) {
  text += "  point run, blocks of " + std::to_string(kBlockPixels) + " pixels, " + std::to_string(run.planes) + " planes\n";
  for (const PointRun::Item& item : run.items) {
    if (item.is_load) {
      const PlaneLoad& load = run.loads[static_cast<size_t>(item.index)];
      text += "    load " + (load.from_tile ? "tile " + std::to_string(load.index)
                                            : plan.sources[static_cast<size_t>(load.index)].source->Describe()) + "\n";
    } else {
      const PointStep& step = run.steps[static_cast<size_t>(item.index)];
      text += "    " + step.label;
      if (step.fused_load >= 0) text += "  [with the load]";
      if (step.fused_store) text += "  [with the store]";
      text += "\n";
    }
  }
  text += last ? "    store result\n" : "    store tile\n";
}

}  // namespace

std::string Explain(const Node& node, PixelType type, const RenderOptions& options) {
  // Statistics are not computed for a plan that is only printed.
  const Plan plan = MakePlan(node, options.optimize, [](const Node&, const StatisticRequest&) {
    return std::numeric_limits<double>::quiet_NaN();
  });
  const Roi& roi = plan.spec.data_window;
  std::string text;
  for (size_t k = 0; k < plan.sources.size(); ++k) {
    const PlannedSource& s = plan.sources[k];
    const ImageSpec& spec = s.source->spec();
    text += "source " + std::to_string(k) + ": " + s.source->Describe() + ", " + std::to_string(spec.width()) + "x" +
            std::to_string(spec.height()) + " " + PixelTypeName(spec.type) + ", reads " + ChannelNames(spec, s.needed) +
            "\n";
  }
  int pass = 1;
  for (const std::string& statistic : plan.statistics) {
    text += "pass " + std::to_string(pass++) + ": " + statistic + "\n";
  }
  text += "pass " + std::to_string(pass) + ": " + std::to_string(plan.operations) + " operations, target " + SimdTarget() + "\n";
  for (size_t i = 0; i < plan.buffers.size(); ++i) {
    const Buffer& b = plan.buffers[i];
    if (b.run) {
      DescribeRun(plan, *b.run, i + 1 == plan.buffers.size(), text);
    } else {
      text += "  window step " + b.tile->label + " -> tile " + std::to_string(i) + "\n";
    }
  }
  const TileShape tile = ChooseTileShape(plan, roi, options);
  const int64_t bytes = BytesMoved(plan, roi, type);
  char line[160];
  std::snprintf(line, sizeof line, "tiles of %dx%d, result %dx%d %s, %.1f MB moved (%.1f bytes/pixel)\n", tile.width, tile.height,
                roi.width(), roi.height(), PixelTypeName(type), static_cast<double>(bytes) / 1e6,
                static_cast<double>(bytes) / static_cast<double>(std::max<int64_t>(1, roi.pixels())));
  return text + line;
}

}  // namespace tessera
