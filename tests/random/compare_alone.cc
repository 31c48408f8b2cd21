// A graph taken apart: every operation alone, on the floats that those before it have given.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <unordered_map>

#include "graph/op.h"
#include "graph/topology.h"
#include "random/compare.h"
#include "random/samples.h"
#include "tessera/error.h"
#include "tessera/render.h"
#include "verify/evaluate.h"

namespace tessera::random {
namespace {

using graph::NodeData;
using graph::OpKind;

// What the reference of one operation may look at.
constexpr double kMostWork = 40000, kMostProducts = 1e6;
const RenderOptions kPlain{.threads = 1, .optimize = false};

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
    const double channels = node.spec().channel_count();
    const Roi one{roi.x0, roi.y0, roi.x0 + 1, roi.y0 + 1};
    if (verify::ReferenceEngine::Work(node, roi) * channels <= kMostWork &&
        verify::ReferenceEngine::Work(node, one) * channels * static_cast<double>(roi.pixels()) <=
            kMostProducts) {
      return roi;
    }
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

// How far the values that are decided are off, in words.
std::optional<std::string> BeyondBound(const Node& alone, const Image& got, Tally& tally) {
  const Roi roi = Affordable(alone);
  if (roi.empty()) return std::nullopt;
  verify::ReferenceEngine engine(BoundOf);
  engine.SetDeadline(std::chrono::steady_clock::now() + std::chrono::milliseconds(300));
  verify::Evaluated want;
  try {
    want = engine.Evaluate(alone, roi);
  } catch (const verify::ReferenceEngine::OutOfTime&) {
    return std::nullopt;
  }
  double worst = 0;
  std::string words;
  int64_t count = 0, undecided = 0;
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      for (int c = 0; c < got.spec().channel_count(); ++c) {
        const double reference = want.value.at(x, y, c), value = got.at<float>(x, y, c);
        const double tolerance = (want.tolerance.at(x, y, c) + want.JumpAt(x, y, c)) * (1 + 1e-6) +
                                 1e-14 * std::fabs(reference) + 0x1p-149;
        if (want.Undecided(x, y, c)) {
          ++undecided;
          continue;
        }
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
  if (undecided > 0) tally.Add(kUndecided, alone.data()->op->Name(), undecided);
  if (count == 0) return std::nullopt;
  return words + " (" + NumberWords(worst) + " times the bound; " + std::to_string(count) + " samples)";
}

// Calls use(node) for every operation on the floats that the ones before it gave, first to last, until it
// returns words; the result of the last one goes to `result`.
template <typename Use>
std::optional<std::string> Apart(const Built& built, Image* result, const Use& use) {
  std::unordered_map<const NodeData*, Node> apart;
  for (const Node& node : graph::TopologicalOrder(built.result())) {
    const NodeData& d = *node.data();
    if (d.op->Kind() == OpKind::kSource) {
      apart[&d] = node;
      continue;
    }
    std::vector<Node> inputs;
    for (const Node& input : d.inputs) inputs.push_back(apart.at(input.data()));
    const Node alone = graph::MakeNode(d.op, inputs);
    const Image image = Render(alone, PixelType::kFloat, kPlain);
    const std::optional<std::string> words = use(alone, image);
    if (words) return words;
    // Codes that are only moved stay codes: operations that follow may have been made for them.
    const bool moved = d.op->Kind() == OpKind::kCrop || d.op->Kind() == OpKind::kShuffle;
    const PixelType type = alone.spec().type;
    const bool codes = moved && (type == PixelType::kUint8 || type == PixelType::kUint16);
    apart[&d] = FromImage(codes ? Render(alone, type, kPlain) : image);
    if (result != nullptr) *result = image;
  }
  return std::nullopt;
}

}  // namespace

OffFunction Tolerances(const Node& node) {
  // The engine is kept for what it finds of whole images, which the first sample has time for. Samples that
  // there is no time for are not judged.
  constexpr double kUnjudged = std::numeric_limits<double>::infinity();
  const auto engine = std::make_shared<verify::ReferenceEngine>(BoundOf);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(4);
  return [node, engine, end](int x, int y, int channel) -> double {
    if (std::chrono::steady_clock::now() > end) return kUnjudged;
    engine->SetDeadline(end);
    try {
      const verify::Evaluated at = engine->Evaluate(node, {x, y, x + 1, y + 1});
      const double off = at.tolerance.at(x, y, channel) + at.JumpAt(x, y, channel);
      return std::isfinite(off) ? off : 0;
    } catch (const verify::ReferenceEngine::OutOfTime&) {
      return kUnjudged;
    } catch (const Error&) {  // an operation without reference
      return 0;
    }
  };
}

std::optional<std::string> DifferEager(const Built& built) {
  Image eager;
  Apart(built, &eager, [](const Node&, const Image&) { return std::optional<std::string>(); });
  if (eager.view().data == nullptr) return std::nullopt;  // no operation was left
  const Image lazy = Render(built.result(), PixelType::kFloat, kPlain);
  const auto words = Differ(lazy.view(), eager.view());
  return words ? std::optional<std::string>("at once against operation by operation: " + *words)
               : std::nullopt;
}

std::optional<std::string> BeyondReference(const Built& built, Tally& tally) {
  return Apart(built, nullptr, [&](const Node& alone, const Image& image) -> std::optional<std::string> {
    const NodeData& d = *alone.data();
    // The bound is the operation's own: its inputs are exact, and ordinary numbers.
    std::vector<Node> exact;
    for (const Node& input : d.inputs) {
      const Image floats = Render(input, PixelType::kFloat, kPlain);
      if (!AllOrdinary(floats.view())) return std::nullopt;
      exact.push_back(FromImage(floats));
    }
    tally.Add(kReferenced, d.op->Name());
    const auto words = BeyondBound(graph::MakeNode(d.op, exact), image, tally);
    return words ? std::optional<std::string>(d.op->Name() + " alone: " + *words) : std::nullopt;
  });
}

}  // namespace tessera::random
