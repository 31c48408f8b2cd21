// A graph taken apart: every operation alone, on the floats that those before it have given.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <unordered_map>

#include "graph/op.h"
#include "graph/topology.h"
#include "random/compare.h"
#include "random/samples.h"
#include "tessera/error.h"
#include "tessera/targets.h"
#include "verify/evaluate.h"

namespace tessera::random {
namespace {

using graph::NodeData;
using graph::OpKind;

// What the reference of one operation may look at.
constexpr double kMostWork = 60000;

double BoundOf(const std::string& name) {
  const ops::OpInfo* const op = ops::FindOp(name);
  return op != nullptr ? op->bound_u : 2.0;
}

std::string NumberWords(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", v);
  return text;
}

// A part of the result that the reference can afford, or an empty one.
Roi Affordable(const Node& node) {
  Roi roi = node.spec().data_window;
  while (!roi.empty()) {
    if (verify::ReferenceEngine::Work(node, roi) * node.spec().channel_count() <= kMostWork) return roi;
    const int w = roi.width(), h = roi.height();
    if (w == 1 && h == 1) return {};
    if (w >= h) {
      roi.x0 += w / 4, roi.x1 = roi.x0 + w / 2;
    } else {
      roi.y0 += h / 4, roi.y1 = roi.y0 + h / 2;
    }
  }
  return {};
}

std::optional<std::string> BeyondBound(const Node& alone, const Image& got) {
  const Roi roi = Affordable(alone);
  if (roi.empty()) return std::nullopt;
  const verify::Evaluated want = verify::ReferenceEngine(BoundOf).Evaluate(alone, roi);
  double worst = 0;
  std::string words;
  int64_t count = 0;
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      for (int c = 0; c < got.spec().channel_count(); ++c) {
        const double reference = want.value.at(x, y, c), value = got.at<float>(x, y, c);
        const double tolerance =
            want.tolerance.at(x, y, c) * (1 + 1e-6) + 1e-14 * std::fabs(reference) + 0x1p-149;
        if (std::fabs(value - reference) <= tolerance || (std::isnan(value) && std::isnan(reference)) ||
            value == reference) {
          continue;
        }
        if (std::isinf(value) && std::fabs(reference) > std::numeric_limits<float>::max()) continue;
        ++count;
        const double excess = std::isfinite(value) && std::isfinite(reference) && tolerance > 0
                                  ? std::fabs(value - reference) / tolerance
                                  : std::numeric_limits<double>::infinity();
        if (excess <= worst) continue;
        worst = excess;
        words = "at x=" + std::to_string(x) + " y=" + std::to_string(y) + " channel " + std::to_string(c) +
                ": " + NumberWords(value) + ", reference " + NumberWords(reference) + ", bound " +
                NumberWords(tolerance);
      }
    }
  }
  if (count == 0) return std::nullopt;
  return words + " (" + NumberWords(worst) + " times the bound; " + std::to_string(count) + " samples)";
}

}  // namespace

std::optional<std::string> DifferEager(const Built& built, bool bits, bool reference, Tally& tally) {
  const RenderOptions options{.threads = 1, .optimize = false};
  std::unordered_map<const NodeData*, Node> apart;
  for (const Node& node : graph::TopologicalOrder(built.result())) {
    const NodeData& d = *node.data();
    if (d.op->Kind() == OpKind::kSource) {
      apart[&d] = node;
      continue;
    }
    std::vector<Node> inputs;
    bool ordinary = true;
    for (const Node& input : d.inputs) inputs.push_back(apart.at(input.data()));
    const Node alone = graph::MakeNode(d.op, inputs);
    if (alone.spec().data_window.empty()) throw Error(d.op->Name(), "has an empty result");
    const Image result = Render(alone, PixelType::kFloat, options);
    if (reference) {
      std::vector<Node> exact;
      for (const Node& input : inputs) {
        const Image floats = Render(input, PixelType::kFloat, options);
        ordinary = ordinary && AllOrdinary(floats.view());
        exact.push_back(FromImage(floats));
      }
      if (ordinary) {
        ++tally.referenced[d.op->Name()];
        const auto words = BeyondBound(graph::MakeNode(d.op, exact), result);
        if (words) return d.op->Name() + " alone: " + *words;
      }
    }
    apart[&d] = FromImage(result);
  }
  if (!bits) return std::nullopt;
  const Image lazy = Render(built.result(), PixelType::kFloat, options);
  const Image eager = Render(apart.at(built.result().data()), PixelType::kFloat, options);
  const auto words = Differ(lazy.view(), eager.view());
  return words ? std::optional<std::string>("at once against operation by operation: " + *words) : std::nullopt;
}

}  // namespace tessera::random
