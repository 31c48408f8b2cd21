// Dissolves by threshold patterns, and revealing through a mask.
#include <limits>
#include <memory>

#include "ops/composite/composite_ops.h"
#include "ops/composite/pick_kernels.h"
#include "ops/generate/generators.h"
#include "ops/modifiers.h"
#include "tessera/ops/generate.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/composite/dissolve.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/lattice-inl.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

// The Bayer matrix by its bits: those of x ^ y and y, least significant first, are the rank's from the top.
struct Ordered {
  HWY_INLINE s::Pixels operator()(s::Position at) const {
    const s::DU d;
    const s::VU y = hn::Set(d, static_cast<uint32_t>(at.y())), one = hn::Set(d, 1u);
    const s::VU mixed = hn::Xor(hn::BitCast(d, at.X()), y);
    s::VU rank = hn::Zero(d);
    const auto add = [&](s::VU m, s::VU v) HWY_ATTR {
      rank = hn::Add(hn::ShiftLeft<2>(rank), hn::Or(hn::ShiftLeft<1>(hn::And(m, one)), hn::And(v, one)));
    };
    add(mixed, y);
    add(hn::ShiftRight<1>(mixed), hn::ShiftRight<1>(y));
    add(hn::ShiftRight<2>(mixed), hn::ShiftRight<2>(y));
    add(hn::ShiftRight<3>(mixed), hn::ShiftRight<3>(y));
    const s::V h = hn::Mul(hn::ConvertTo(s::D(), hn::BitCast(s::DI(), rank)), hn::Set(s::D(), 1.0f / 256));
    return {h, h, h, h};
  }
};
// The hash of the noise lattices at (x, y).
struct Scattered {
  uint32_t seed;
  HWY_INLINE s::Pixels operator()(s::Position at) const {
    const s::DU d;
    const uint32_t row = static_cast<uint32_t>(at.y()) * s::kAxis[1] ^ seed * s::kAxis[2];
    const s::VU column = hn::Mul(hn::BitCast(d, at.X()), hn::Set(d, s::kAxis[0]));
    const s::V h = s::Unit(s::LatticeMix(hn::Xor(column, hn::Set(d, row))));
    return {h, h, h, h};
  }
};
std::unique_ptr<graph::PointStage> NewThresholds(const ThresholdsParams& p) {
  if (p.ordered) return s::MakeStage<0>(Ordered());
  return s::MakeStage<0>(Scattered{p.seed});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {
namespace ops {
namespace {

HWY_EXPORT(NewThresholds);

const std::vector<std::string>& PatternNames() {
  static const std::vector<std::string> kNames = {"noise", "ordered", "right", "down", "image"};
  return kNames;
}

class ThresholdsOp final : public GeneratorOp<ThresholdsParams> {
 public:
  using GeneratorOp::GeneratorOp;
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return HWY_DYNAMIC_DISPATCH(NewThresholds)(params());
  }
};

ImageSpec GreySpec(ImageSpec spec) {
  spec.channels = {"Y"};
  spec.alpha = -1;
  spec.metadata = nullptr;
  return spec;
}

Node PatternOf(const DissolveParams& p, const ImageSpec& result) {
  const ImageSpec spec = GreySpec(result);
  switch (p.pattern) {
    case DissolvePattern::kNoise:
    case DissolvePattern::kOrdered:
      return Thresholds(spec, {p.pattern == DissolvePattern::kOrdered, p.seed});
    default: {
      ImageSpec ramp = spec;
      ramp.channels = {"s", "t"};
      return ChannelOf(Ramp(ramp), p.pattern == DissolvePattern::kRight ? 0 : 1);
    }
  }
}

}  // namespace

OpInfo DissolveInfo() {
  OpInfo info;
  info.name = "dissolve";
  info.family = "composite";
  info.inputs = 2;
  info.operands = [](const Arguments& a) { return a.Text("pattern") == "image" ? 3 : 2; };
  info.summary = "From one image to another, pixel by pixel by a threshold pattern";
  info.help =
      "A B --dissolve T: B where the pattern h is below T, else A, so that T=0 is A and T=1 is B to the bit, "
      "and pixels that have turned stay so as T grows. pattern=noise: a hash of the pixel (seed=); ordered: "
      "the 16x16 Bayer matrix; right, down: a wipe towards that side; image: A B PATTERN --dissolve, h the "
      "first channel of PATTERN, in [0,1), NaN keeps A. The share of B is T where h is spread evenly; an "
      "8-bit pattern has 256 steps. For a cross-fade see --interp. Source: McReynolds et "
      "al. 1997, 14.1.";
  info.bound = "exact";
  info.arguments = {NumberModifier("T", "", 0, 1, "how far, 0 to 1")};
  info.modifiers = {ChoiceModifier("pattern", PatternNames(), "where pixels turn first"),
                    OnlyWith("pattern=noise", NumberModifier("seed", "0", 0, 4294967295.0, "of the noise"))};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const DissolveParams p{static_cast<float>(a.Number("T")),
                           ChoiceOf<DissolvePattern>(PatternNames(), a.Text("pattern")),
                           static_cast<uint32_t>(a.Number("seed"))};
    return Dissolve(in[0], in[1], p, in.size() > 2 ? in[2] : Node());
  };
  info.identity = "0.4";
  info.examples = {
      "0.4", "0.4 pattern=ordered", "0.37 pattern=right", "0.37 pattern=down", "0.5 pattern=image", "0", "1"};
  return info;
}

OpInfo ThresholdsInfo() {
  OpInfo info = GeneratorRow("thresholds", "Threshold patterns of dissolves: noise, or the Bayer matrix");
  info.family = "composite";
  info.help =
      "Every channel holds the pixel's threshold in [0,1). pattern=noise: a hash of the position and seed=, "
      "k / 2^24; ordered: k / 256, k from 0 to 255 in the order of Bayer's 16x16 matrix, repeated over the "
      "plane from pixel (0, 0). For --dissolve, screen doors and halftones. Exact.";
  info.bound = "exact";
  info.modifiers = {ChoiceModifier("pattern", {"noise", "ordered"}, "which pixels come first"),
                    OnlyWith("pattern=noise", NumberModifier("seed", "0", 0, 4294967295.0, "of the noise"))};
  info.make = [](std::span<const Node>, const Arguments& a, const ImageSpec* output) {
    return Thresholds(*output, {a.Text("pattern") == "ordered", static_cast<uint32_t>(a.Number("seed"))});
  };
  info.examples = {"", "pattern=ordered", "seed=12345"};
  return info;
}

OpInfo RevealInfo() {
  OpInfo info;
  info.name = "reveal";
  info.family = "composite";
  info.inputs = 3;
  info.summary = "Reveal a painted image through a mask";
  info.help =
      "IMAGE PAINTED MASK --reveal: IMAGE + m (PAINTED - IMAGE), m the first channel of MASK: brush strokes "
      "that show the painted version. m = 0 is IMAGE, 1 is PAINTED to the bit; m may leave [0,1]. Masks of "
      "strokes: --pattern airbrush.";
  info.bound = "3 u (|IMAGE| + |m| (|PAINTED| + |IMAGE|))";
  info.bound_u = 3;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) {
    return Reveal(in[0], in[1], in[2]);
  };
  info.examples = {""};
  return info;
}

}  // namespace ops

Node Thresholds(const ImageSpec& spec, const ThresholdsParams& params) {
  return graph::MakeNode(std::make_shared<const ops::ThresholdsOp>("thresholds", spec, params), {});
}

Node Dissolve(const Node& a, const Node& b, const DissolveParams& params, const Node& pattern) {
  const ops::Layers layers = ops::MakeLayers("dissolve", {a, b});
  Node threshold;
  if (params.pattern == DissolvePattern::kImage) {
    if (!pattern) throw Error("dissolve", "found no pattern, expected an image of thresholds");
    const ImageSpec specs[] = {layers.spec, pattern.spec()};
    graph::RequireSameWindow("dissolve", specs);
    threshold = ops::ChannelOf(pattern, 0);
  } else {
    threshold = ops::PatternOf(params, layers.spec);
  }
  // Whatever a pattern holds, 1 turns every pixel that has a threshold, 0 none.
  constexpr float kAll = std::numeric_limits<float>::infinity();
  const float t = params.t >= 1 ? kAll : params.t > 0 ? params.t : -kAll;
  DissolveParams resolved = params;
  resolved.t = t;
  ops::CompositeOp::Traits traits{.name = "dissolve",
                                  .description = {},
                                  .parameters = resolved,
                                  .spec = layers.spec,
                                  .rgba = false,
                                  .make = {}};
  traits.make = [t](const graph::StageContext&) { return ops::MakeThresholdStage(t); };
  return ops::MakeCompositeNode(std::move(traits), {layers.images[0], layers.images[1], threshold});
}

Node Reveal(const Node& image, const Node& painted, const Node& mask) {
  const ops::Layers layers = ops::MakeLayers("reveal", {image, painted});
  const ImageSpec specs[] = {layers.spec, mask.spec()};
  graph::RequireSameWindow("reveal", specs);
  ops::CompositeOp::Traits t{.name = "reveal",
                             .description = {},
                             .parameters = std::any(0),
                             .spec = layers.spec,
                             .rgba = false,
                             .make = {}};
  t.make = [](const graph::StageContext&) { return ops::MakeRevealStage(); };
  return ops::MakeCompositeNode(std::move(t), {layers.images[0], layers.images[1], ops::ChannelOf(mask, 0)});
}

}  // namespace tessera
#endif  // HWY_ONCE
