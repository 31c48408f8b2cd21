// Contrast as oiiotool means it: [black, white] to [min, max], by a line, a sigmoid or, where black is white,
// a threshold.
#include "ops/color/contrast_remap.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "ops/arithmetic/operands.h"
#include "ops/color/affine.h"
#include "ops/color/color_ops.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/color.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/color/contrast_remap.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"
#include "simd/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

struct RemapKernel {
  PlaneRemap plane[4];

  static HWY_INLINE s::V Through(const PlaneRemap& p, s::V x) {
    const s::D d;
    if (p.kind == PlaneRemap::Kind::kThreshold) {  // NaN is not below
      return hn::IfThenElse(hn::Lt(x, hn::Set(d, p.threshold)), hn::Set(d, p.low), hn::Set(d, p.high));
    }
    const s::DD dd;
    const bool sigmoid = p.kind == PlaneRemap::Kind::kSigmoid;
    const s::V v = s::InDouble(
        [&](s::VD t) HWY_ATTR {
          s::VD u = hn::MulAdd(t, hn::Set(dd, p.scale), hn::Set(dd, p.bias));
          if (sigmoid) {
            const s::VD one = hn::Set(dd, 1.0);
            const s::VD e = s::Exp2OfDouble<s::Precision::kDouble>(s::ClampExponent(u));
            u = hn::Sub(hn::Div(one, hn::Add(one, e)), hn::Set(dd, p.black));
          }
          return hn::MulAdd(u, hn::Set(dd, p.gain), hn::Set(dd, p.offset));
        },
        x);
    return hn::IfThenElse(hn::IsNaN(x), hn::NaN(d), v);
  }
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    return {Through(plane[0], p.r), Through(plane[1], p.g), Through(plane[2], p.b), Through(plane[3], p.a)};
  }
};
std::unique_ptr<graph::PointStage> MakeRemap(const PlaneRemap* planes) {
  return s::MakeFusedStage<1>(RemapKernel{{planes[0], planes[1], planes[2], planes[3]}});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {
namespace ops {
namespace {

HWY_EXPORT(MakeRemap);

// The value of a channel: a list that is too short goes on with its last entry, as oiiotool's.
double ValueAt(const std::vector<double>& values, int channel) {
  return values[std::min(static_cast<size_t>(channel), values.size() - 1)];
}
bool AllAre(const std::vector<double>& values, double v) {
  return std::all_of(values.begin(), values.end(), [v](double x) { return x == v; });
}

PlaneRemap RemapOf(const ContrastRemapParams& p, int channel) {
  const double black = ValueAt(p.black, channel), white = ValueAt(p.white, channel),
               low = ValueAt(p.min, channel), high = ValueAt(p.max, channel),
               slope = ValueAt(p.scontrast, channel), middle = ValueAt(p.sthresh, channel);
  PlaneRemap plane;
  plane.low = static_cast<float>(low), plane.high = static_cast<float>(high);
  plane.threshold = static_cast<float>(black);
  if (black == white) {
    plane.kind = PlaneRemap::Kind::kThreshold;
    return plane;
  }
  const double inverse = 1 / (white - black);
  plane.offset = low;
  if (slope == 0 || AllAre(p.scontrast, 1)) {
    plane.scale = inverse, plane.bias = -black * inverse, plane.gain = high - low;
    return plane;
  }
  // 1 / (1 + exp(slope (middle - r))), in powers of two.
  constexpr double kLog2E = 1.4426950408889634074;
  plane.kind = PlaneRemap::Kind::kSigmoid;
  plane.scale = -slope * inverse * kLog2E, plane.bias = slope * (middle + black * inverse) * kLog2E;
  plane.black = 1 / (1 + std::exp(slope * middle));
  // The sigmoid's rise from black to white, as a product: the difference of the two cancels where it is flat.
  const double rise =
      std::sinh(slope / 2) / (2 * std::cosh(slope * middle / 2) * std::cosh(slope * (1 - middle) / 2));
  plane.gain = (high - low) / rise;
  return plane;
}

class RemapOp final : public graph::OpWith<ContrastRemapParams> {
 public:
  explicit RemapOp(ContrastRemapParams params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "contrast"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    PlaneRemap planes[4];
    for (int i = 0; i < 4; ++i) {
      if (context.channels[i] >= 0) planes[i] = RemapOf(params(), context.channels[i]);
    }
    return HWY_DYNAMIC_DISPATCH(MakeRemap)(planes);
  }
};

bool IsLine(const ContrastRemapParams& p) {
  const size_t longest =
      std::max({p.black.size(), p.white.size(), p.min.size(), p.max.size(), p.scontrast.size()});
  for (int c = 0; c < static_cast<int>(longest); ++c) {
    if (RemapOf(p, c).kind != PlaneRemap::Kind::kLine) return false;
  }
  return true;
}

// A line folds with its neighbours.
std::shared_ptr<const graph::Op> MakeLine(const ImageSpec& spec, const ContrastRemapParams& p) {
  AffineParams affine;
  affine.channels = spec.channel_count(), affine.alpha = spec.alpha;
  for (int c = 0; c < affine.channels; ++c) {
    const PlaneRemap plane = RemapOf(p, c);
    affine.scale.push_back(plane.scale * plane.gain);
    affine.bias.push_back(plane.bias * plane.gain + plane.offset);
  }
  return MakeAffine("contrast", std::move(affine), p);
}

void RequireUsable(const ContrastRemapParams& p) {
  const std::pair<const char*, const std::vector<double>*> lists[] = {
      {"black", &p.black}, {"white", &p.white},         {"min", &p.min},
      {"max", &p.max},     {"scontrast", &p.scontrast}, {"sthresh", &p.sthresh}};
  size_t longest = 1;
  for (const auto& [name, values] : lists) {
    RequireConstants(std::string("contrast:") + name, *values);
    longest = std::max(longest, values->size());
  }
  for (int c = 0; c < static_cast<int>(longest); ++c) {
    const PlaneRemap plane = RemapOf(p, c);
    for (const double v : {plane.scale, plane.bias, plane.gain}) {
      if (std::fabs(v) <= 1e30) continue;
      throw Error("contrast", "found scontrast=" + base::NumberText(ValueAt(p.scontrast, c)) +
                                  " sthresh=" + base::NumberText(ValueAt(p.sthresh, c)) +
                                  " between black=" + base::NumberText(ValueAt(p.black, c)) +
                                  " and white=" + base::NumberText(ValueAt(p.white, c)) +
                                  ", expected a curve that rises from the one to the other");
    }
    if (p.clamp && ValueAt(p.min, c) > ValueAt(p.max, c)) {
      throw Error("contrast", "found clamp=1 with min=" + base::NumberText(ValueAt(p.min, c)) +
                                  " above max=" + base::NumberText(ValueAt(p.max, c)) +
                                  ", expected min <= max");
    }
  }
}

}  // namespace
}  // namespace ops

Node ContrastRemap(const Node& image, const ContrastRemapParams& params) {
  ops::RequireUsable(params);
  const Node remapped = graph::MakeNode(ops::IsLine(params) ? ops::MakeLine(image.spec(), params)
                                                            : std::make_shared<const ops::RemapOp>(params),
                                        {image});
  if (!params.clamp) return remapped;
  ClampParams limits;
  for (int c = 0; c < image.spec().channel_count(); ++c) {
    limits.min.push_back(ops::ValueAt(params.min, c));
    limits.max.push_back(ops::ValueAt(params.max, c));
  }
  return Clamp(remapped, limits);
}

}  // namespace tessera
#endif  // HWY_ONCE
