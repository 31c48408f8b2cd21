// Light on blocks of positions: samples of area lights, spots and slides, in double.
#include "ops/shade/light_kernel.h"

#include <memory>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/shade/light_kernel.cc"
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
using s::kParts;
using s::LengthOf;
using s::Part;
using s::RowTimes;
using s::SetD;
using s::V;
using s::VD;
namespace {

HWY_INLINE VD DotD(VD x, VD y, VD z, const double* v) {
  return hn::MulAdd(z, SetD(v[2]), hn::MulAdd(y, SetD(v[1]), hn::Mul(x, SetD(v[0]))));
}

// (area / pi) cos cos' / max(r^2, area); a NaN position or normal gives 0.
struct DiffuseKernel {
  LightSample light;
  double direction[3];
  bool all_sides;

  HWY_INLINE s::Pixels operator()(const s::Pixels& p, const s::Pixels& n) const {
    VD sum[kParts];
    EachPart([&]<int kPart>() HWY_ATTR {
      const VD zero = hn::Zero(DD());
      const VD x = hn::Sub(SetD(light.position[0]), Part<kPart>(p.r)),
               y = hn::Sub(SetD(light.position[1]), Part<kPart>(p.g)),
               z = hn::Sub(SetD(light.position[2]), Part<kPart>(p.b));
      const VD square = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
      const VD receiver =
          hn::MulAdd(z, Part<kPart>(n.b), hn::MulAdd(y, Part<kPart>(n.g), hn::Mul(x, Part<kPart>(n.r))));
      const VD limited = hn::Max(square, SetD(light.area));
      VD value = hn::Mul(SetD(light.area * std::numbers::inv_pi), hn::Max(receiver, zero));
      if (all_sides) {  // cos / r = receiver / r^2
        value = hn::Div(value, hn::Mul(hn::Sqrt(square), limited));
      } else {
        const VD sender = hn::Neg(DotD(x, y, z, direction));
        value = hn::Div(hn::Mul(value, hn::Max(sender, zero)), hn::Mul(square, limited));
      }
      // At the light itself, and where something is not a number: nothing.
      const auto lit = hn::And(hn::Gt(receiver, zero), hn::Eq(value, value));
      sum[kPart] = hn::IfThenElse(hn::And(lit, hn::Gt(square, zero)), value, zero);
    });
    const V v = Join(sum);
    return {v, v, v, v};
  }
};

// Input 0: positions; input 1, with a slide: its colours at them.
struct SpotlightKernel {
  SpotlightPlan plan;

  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    const V one = hn::Set(s::D(), 1.0f);
    return (*this)(p, {one, one, one, one});
  }
  HWY_INLINE s::Pixels operator()(const s::Pixels& p, const s::Pixels& slide) const {
    VD parts[3][kParts];
    EachPart([&]<int kPart>() HWY_ATTR {
      const VD zero = hn::Zero(DD()), one = SetD(1);
      const VD px = Part<kPart>(p.r), py = Part<kPart>(p.g), pz = Part<kPart>(p.b);
      const VD x = hn::Sub(px, SetD(plan.eye[0])), y = hn::Sub(py, SetD(plan.eye[1])),
               z = hn::Sub(pz, SetD(plan.eye[2]));
      const VD depth = DotD(x, y, z, plan.forward), w = RowTimes(plan.w, px, py, pz);
      const auto inside = hn::And(hn::Le(hn::Abs(RowTimes(plan.x, px, py, pz)), w),
                                  hn::Le(hn::Abs(RowTimes(plan.y, px, py, pz)), w));
      const auto lit = hn::And(hn::And(hn::Gt(depth, zero), hn::Ge(w, SetD(1e-20))), inside);
      VD distance = depth, cosine = one;
      if (plan.perspective) {
        distance = LengthOf(x, y, z);
        cosine = hn::Min(hn::Div(depth, distance), one);
      }
      const VD falloff =
          hn::MulAdd(hn::MulAdd(SetD(plan.attenuation[2]), distance, SetD(plan.attenuation[1])), distance,
                     SetD(plan.attenuation[0]));
      VD value = hn::Div(one, hn::Max(falloff, SetD(1e-20)));
      if (plan.exponent != 0) {
        const VD safe = hn::IfThenElse(lit, hn::Max(cosine, SetD(1e-300)), one);
        const VD power = hn::Mul(s::Log2OfDouble<s::Precision::kDouble>(safe), SetD(plan.exponent));
        value = hn::Mul(value, s::Exp2OfDouble(hn::Max(power, SetD(-1000))));
      }
      if (plan.cos_width > 0) {
        const VD t = hn::Min(
            hn::Max(hn::Mul(hn::Sub(cosine, SetD(plan.cos_outer)), SetD(1 / plan.cos_width)), zero), one);
        value = hn::Mul(value, hn::Mul(hn::Mul(t, t), hn::NegMulAdd(t, SetD(2), SetD(3))));
      }
      value = hn::IfThenElse(hn::And(lit, hn::Eq(value, value)), value, zero);
      parts[0][kPart] = hn::Mul(hn::Mul(value, SetD(plan.color[0])), Part<kPart>(slide.r));
      parts[1][kPart] = hn::Mul(hn::Mul(value, SetD(plan.color[1])), Part<kPart>(slide.g));
      parts[2][kPart] = hn::Mul(hn::Mul(value, SetD(plan.color[2])), Part<kPart>(slide.b));
    });
    return {Join(parts[0]), Join(parts[1]), Join(parts[2]), p.a};
  }
};

std::unique_ptr<graph::PointStage> MakeDiffuse(const LightSample& light) {
  const Vector3 d = Normalized(light.direction);
  return s::MakeStage<2>(DiffuseKernel{light, {d[0], d[1], d[2]}, Dot(d, d) == 0});
}
std::unique_ptr<graph::PointStage> MakeSpotlight(const SpotlightPlan& plan) {
  if (plan.slide) return s::MakeStage<2>(SpotlightKernel{plan});
  return s::MakeStage<1>(SpotlightKernel{plan});
}

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MakeDiffuse);
HWY_EXPORT(MakeSpotlight);
std::unique_ptr<graph::PointStage> MakeDiffuseLightStage(const LightSample& light) {
  return HWY_DYNAMIC_DISPATCH(MakeDiffuse)(light);
}
std::unique_ptr<graph::PointStage> MakeSpotlightStage(const SpotlightPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(MakeSpotlight)(plan);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
