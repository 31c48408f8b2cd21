// Fog on blocks of pixels: distance, optical depth and transmittance in double, the mix in float.
#include "ops/shade/fog_kernel.h"

#include <algorithm>
#include <memory>
#include <utility>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/shade/fog_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/doubles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::DD;
using s::EachPart;
using s::Join;
using s::JoinIntegers;
using s::kParts;
using s::Part;
using s::SetD;
using s::V;
using s::VD;
namespace {

constexpr double kLog2E = 1.4426950408889634074;

// What passes through and 1 minus that, without cancellation.
struct Attenuation {
  V through, rest;
};

// e^-x of optical depths x >= 0, given in double: 2^k (1 + p) with k whole and p = 2^f - 1. The double
// carries the depth's digits to f; from there floats do. |relative error| of either result is below 1.5 ULP.
// NaN stays.
HWY_INLINE Attenuation Attenuate(const VD (&x)[kParts]) {
  const s::D d;
  const s::DI di;
  VD whole[kParts], fraction[kParts];
  EachPart([&]<int kPart>() HWY_ATTR {
    const VD given = hn::Mul(x[kPart], SetD(-kLog2E)), least = SetD(-160);
    const VD t = hn::IfThenElse(hn::Lt(given, least), least, given);  // NaN stays
    whole[kPart] = hn::Round(t);
    fraction[kPart] = hn::Sub(t, whole[kPart]);
  });
  const V f = Join(fraction), one = hn::Set(d, 1.0f);
  V q = hn::Set(d, 1.5252734e-5f);
  for (const float c :
       {1.5403530e-4f, 1.3333558e-3f, 9.6181291e-3f, 5.5504109e-2f, 2.4022651e-1f, 6.9314718e-1f}) {
    q = hn::MulAdd(q, f, hn::Set(d, c));
  }
  const V p = hn::Mul(f, q);
  // 2^k as a product, so that subnormal powers are right.
  const s::VI k = JoinIntegers(whole), half = hn::ShiftRight<1>(k), bias = hn::Set(di, 127);
  const V scale = hn::Mul(hn::BitCast(d, hn::ShiftLeft<23>(hn::Add(half, bias))),
                          hn::BitCast(d, hn::ShiftLeft<23>(hn::Add(hn::Sub(k, half), bias))));
  return {hn::MulAdd(scale, p, scale), hn::NegMulAdd(scale, p, hn::Sub(one, scale))};
}

// Laws of fog: of a distance d >= 0 or NaN, a height y and a density factor f > 0, in double, the optical
// depth; or, where kDirect, what does not pass.
struct ExpLaw {
  static constexpr bool kDirect = false;
  double density;
  bool squared;
  HWY_INLINE VD operator()(VD d, VD, VD f) const {
    const VD x = hn::Mul(hn::Mul(d, SetD(density)), f);
    return squared ? hn::Mul(x, x) : x;
  }
};
struct LinearLaw {
  static constexpr bool kDirect = true;
  double start, end;
  HWY_INLINE VD operator()(VD d, VD, VD f) const {
    const VD zero = hn::Zero(DD()), one = SetD(1);
    VD fogged;
    if (start == end) {
      fogged = hn::IfThenElse(hn::Lt(d, SetD(start)), zero, one);
    } else {
      fogged = hn::Mul(hn::Sub(d, SetD(start)), SetD(1 / (end - start)));
    }
    fogged = hn::Min(hn::Mul(hn::Min(hn::Max(fogged, zero), one), f), one);
    return hn::IfThenElse(hn::Eq(d, d), fogged, d);
  }
};
struct GivenLaw {  // the "distance" is the transmittance
  static constexpr bool kDirect = true;
  HWY_INLINE VD operator()(VD t, VD, VD f) const {
    const VD one = SetD(1), kept = hn::Min(hn::Max(t, hn::Zero(DD())), one);
    const VD rest = hn::Min(hn::Mul(hn::Sub(one, kept), f), one);
    return hn::IfThenElse(hn::Eq(t, t), rest, t);
  }
};

// Mean density between the eye's height and y, times the distance. A mean of 0 leaves an infinite ray clear.
HWY_INLINE VD DepthOf(VD d, VD mean, VD f) {
  const VD zero = hn::Zero(DD());
  const VD x = hn::Mul(hn::Mul(d, mean), f);
  return hn::IfThenElse(hn::And(hn::Eq(mean, zero), hn::Eq(d, d)), zero, x);
}
constexpr double kFarHeight = 1e60;  // stands for infinite heights

struct LayerLaw {
  static constexpr bool kDirect = false;
  const FogSegment* segments;
  size_t count;
  double eye, density_at_eye;
  HWY_INLINE VD operator()(VD d, VD y, VD f) const {
    const VD zero = hn::Zero(DD()), at_eye = SetD(eye);
    const VD limited = hn::Min(hn::Max(y, SetD(-kFarHeight)), SetD(kFarHeight));
    const VD low = hn::Min(limited, at_eye), high = hn::Max(limited, at_eye);
    VD sum = zero;
    for (size_t k = 0; k < count; ++k) {
      const FogSegment& g = segments[k];
      const VD bottom = hn::Max(low, SetD(g.bottom)), top = hn::Min(high, SetD(g.top));
      const VD overlap = hn::Max(hn::Sub(top, bottom), zero);
      if (g.slope == 0) {
        sum = hn::MulAdd(SetD(g.base), overlap, sum);
      } else {  // the density at the overlap's middle is its mean
        const VD middle = hn::MulAdd(hn::Add(bottom, top), SetD(0.5), SetD(-g.bottom));
        sum = hn::MulAdd(hn::MulAdd(SetD(g.slope), middle, SetD(g.base)), overlap, sum);
      }
    }
    const VD mean = hn::IfThenElse(hn::Eq(low, high), SetD(density_at_eye), hn::Div(sum, hn::Sub(high, low)));
    return DepthOf(d, mean, f);
  }
};

struct ExponentialLaw {
  static constexpr bool kDirect = false;
  const ExponentialLayer* layers;
  size_t count;
  double eye;
  HWY_INLINE VD operator()(VD d, VD y, VD f) const {
    const VD one = SetD(1), at_eye = SetD(eye);
    const VD limited = hn::Min(hn::Max(y, SetD(-kFarHeight)), SetD(kFarHeight));
    const VD low = hn::Min(limited, at_eye), span = hn::Abs(hn::Sub(limited, at_eye));
    VD mean = hn::Zero(DD());
    for (size_t k = 0; k < count; ++k) {
      const ExponentialLayer& g = layers[k];
      // From the lower of the two points, so that nothing overflows: sigma(low) (1 - e^-x) / x.
      const VD turns = hn::Mul(hn::Sub(low, SetD(g.height)), SetD(-kLog2E / g.falloff));
      const VD sigma =
          hn::Mul(SetD(g.density), s::Exp2OfDouble(hn::Min(hn::Max(turns, SetD(-1000)), SetD(1000))));
      const VD x = hn::Mul(span, SetD(1 / g.falloff));
      const VD series = hn::MulAdd(
          x,
          hn::MulAdd(x, hn::MulAdd(x, hn::MulAdd(x, SetD(1.0 / 120), SetD(-1.0 / 24)), SetD(1.0 / 6)),
                     SetD(-0.5)),
          one);
      const VD far = hn::Div(hn::Sub(one, s::Exp2OfDouble(s::ClampExponent(hn::Mul(x, SetD(-kLog2E))))), x);
      mean = hn::MulAdd(sigma, hn::IfThenElse(hn::Lt(x, SetD(0x1p-6)), series, far), mean);
    }
    return DepthOf(d, mean, f);
  }
};

template <class Law>
class FogStage final : public graph::PointStage {
 public:
  FogStage(FogPlan plan, Law law) : plan_(std::move(plan)), law_(law) {
    // The plan's lists have moved with it, and the law points into them.
    if constexpr (std::is_same_v<Law, LayerLaw>) law_.segments = plan_.segments.data();
    if constexpr (std::is_same_v<Law, ExponentialLaw>) law_.layers = plan_.exponential.data();
  }

  void Run(const graph::PointArgs& args) const override {
    const int step = static_cast<int>(hn::Lanes(s::D()));
    const s::D d;
    const V one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    const V constant[3] = {hn::Set(d, plan_.color[0]), hn::Set(d, plan_.color[1]),
                           hn::Set(d, plan_.color[2])};
    float* const out[4] = {args.out[0], args.out[1], args.out[2], args.out[3]};
    for (int i = 0; i < args.count; i += step) {
      const s::Pixels c = s::LoadPlanes(args.in[0], i), p = s::LoadPlanes(args.in[1], i);
      V factor = one;
      if (plan_.mask_input >= 0) factor = hn::LoadU(d, args.in[plan_.mask_input][0] + i);
      const auto [through, rest] = Evaluate(p, factor);
      // Nothing changes where the position is NaN, the mask is not positive, or the fog adds nothing.
      auto keep = hn::Or(hn::IsNaN(through), hn::Eq(rest, zero));
      if (plan_.mask_input >= 0) keep = hn::Or(keep, hn::Not(hn::Gt(factor, zero)));
      const auto hidden = hn::Eq(through, zero);
      const V from[3] = {c.r, c.g, c.b};
      V fogged[3];
      for (int k = 0; k < 3; ++k) {
        const V fog = plan_.color_input >= 0 ? hn::LoadU(d, args.in[plan_.color_input][k] + i) : constant[k];
        const V target = hn::Mul(c.a, fog);
        V mixed = hn::MulAdd(through, from[k], hn::Mul(rest, target));
        // Roundings do not leave the interval between both colours; NaN stays.
        const V low = hn::Min(from[k], target), high = hn::Max(from[k], target);
        mixed = hn::IfThenElse(hn::Lt(mixed, low), low, mixed);
        mixed = hn::IfThenElse(hn::Gt(mixed, high), high, mixed);
        fogged[k] = hn::IfThenElse(keep, from[k], hn::IfThenElse(hidden, target, mixed));
      }
      s::StorePlanes({fogged[0], fogged[1], fogged[2], c.a}, out, i);
    }
  }

 private:
  HWY_INLINE Attenuation Evaluate(const s::Pixels& p, V factor) const {
    VD distance[kParts], x[kParts];
    if (plan_.distance) {
      EachPart([&]<int kPart>() HWY_ATTR {
        const VD given = Part<kPart>(p.r);
        distance[kPart] = hn::IfThenElse(hn::Lt(given, hn::Zero(DD())), hn::Zero(DD()), given);
      });
    } else {
      Distances(p, distance);
    }
    EachPart([&]<int kPart>()
                 HWY_ATTR { x[kPart] = law_(distance[kPart], Part<kPart>(p.g), Part<kPart>(factor)); });
    if constexpr (!Law::kDirect) return Attenuate(x);
    VD through[kParts];
    for (int k = 0; k < kParts; ++k) through[k] = hn::Sub(SetD(1), x[k]);
    return {Join(through), Join(x)};
  }

  // |p - eye|: the root of floats, improved once, where floats hold the square; else the root of doubles.
  HWY_INLINE void Distances(const s::Pixels& p, VD (&distance)[kParts]) const {
    const s::D d;
    VD square[kParts];
    EachPart([&]<int kPart>() HWY_ATTR {
      const VD x = hn::Sub(Part<kPart>(p.r), SetD(plan_.eye[0])),
               y = hn::Sub(Part<kPart>(p.g), SetD(plan_.eye[1])),
               z = hn::Sub(Part<kPart>(p.b), SetD(plan_.eye[2]));
      square[kPart] = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
    });
    const V s = Join(square), root = hn::Sqrt(s), half = hn::Div(hn::Set(d, 0.5f), root);
    const V low = hn::Set(d, 1e-30f), high = hn::Set(d, 1e30f);
    const bool ordinary = hn::AllTrue(d, hn::And(hn::Gt(s, low), hn::Lt(s, high)));
    EachPart([&]<int kPart>() HWY_ATTR {
      const VD r = Part<kPart>(root);
      distance[kPart] = hn::MulAdd(hn::NegMulAdd(r, r, square[kPart]), Part<kPart>(half), r);
      if (HWY_UNLIKELY(!ordinary)) {
        const VD rounded = Part<kPart>(s);
        const auto inside = hn::And(hn::Gt(rounded, SetD(1e-30f)), hn::Lt(rounded, SetD(1e30f)));
        distance[kPart] = hn::IfThenElse(inside, distance[kPart], hn::Sqrt(square[kPart]));
      }
    });
  }

  FogPlan plan_;
  Law law_;
};

std::unique_ptr<graph::PointStage> MakeFog(const FogPlan& plan) {
  if (plan.layered) {
    if (!plan.exponential.empty()) {
      return std::make_unique<FogStage<ExponentialLaw>>(
          plan, ExponentialLaw{nullptr, plan.exponential.size(), plan.eye[1]});
    }
    return std::make_unique<FogStage<LayerLaw>>(
        plan, LayerLaw{nullptr, plan.segments.size(), plan.eye[1], plan.density_at_eye});
  }
  switch (plan.mode) {
    case FogMode::kLinear:
      return std::make_unique<FogStage<LinearLaw>>(plan, LinearLaw{plan.start, plan.end});
    case FogMode::kTransmittance:
      return std::make_unique<FogStage<GivenLaw>>(plan, GivenLaw{});
    default:
      return std::make_unique<FogStage<ExpLaw>>(plan, ExpLaw{plan.density, plan.mode == FogMode::kExp2});
  }
}

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MakeFog);
std::unique_ptr<graph::PointStage> MakeFogStage(const FogPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(MakeFog)(plan);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
