// GL's blend equations with any factors, chosen at run time: memory is slower than the choice.
#include <algorithm>
#include <memory>

#include "ops/composite/blend_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/composite/gl_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/composite/planes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
using s::Pixels;
using s::V;

class Gl {
 public:
  Gl(const GlBlend& blend, const BlendPlanes& planes, const float (&constant)[4], float constant_alpha)
      : blend_(blend), constant_alpha_(constant_alpha) {
    std::copy_n(constant, 4, constant_);
    std::copy_n(planes.roles, 4, roles_);
  }

  HWY_INLINE Pixels operator()(const Pixels& a, const Pixels& b) const {
    return {Plane(0, a.r, b.r, a.a, b.a), Plane(1, a.g, b.g, a.a, b.a), Plane(2, a.b, b.b, a.a, b.a),
            Plane(3, a.a, b.a, a.a, b.a)};
  }
  HWY_INLINE Pixels operator()(const Pixels& a, const Pixels& b, const Pixels& alpha_a,
                               const Pixels& alpha_b) const {
    return {Plane(0, a.r, b.r, alpha_a.r, alpha_b.r), Plane(1, a.g, b.g, alpha_a.g, alpha_b.g),
            Plane(2, a.b, b.b, alpha_a.b, alpha_b.b), Plane(3, a.a, b.a, alpha_a.a, alpha_b.a)};
  }

 private:
  static HWY_INLINE V Set(float v) { return hn::Set(s::D(), v); }

  HWY_INLINE V Plane(int i, V a, V b, V alpha_a, V alpha_b) const {
    const bool alpha = roles_[i] == ChannelRole::kAlpha;
    if (roles_[i] == ChannelRole::kDepth) return FrontDepth(a, b, alpha_a);
    if (alpha) a = alpha_a, b = alpha_b;  // an image without alpha is opaque, whatever it has in that place
    if (blend_.equation == GlBlend::Equation::kMin) return s::MinNumber(a, b);
    if (blend_.equation == GlBlend::Equation::kMax) return s::MaxNumber(a, b);
    const auto times = [&](V v, BlendFactor factor)
                           HWY_ATTR { return Times(v, factor, i, a, b, alpha_a, alpha_b, alpha); };
    const V x = times(a, alpha ? blend_.source_alpha : blend_.source);
    const V y = times(b, alpha ? blend_.destination_alpha : blend_.destination);
    if (blend_.equation == GlBlend::Equation::kAdd) return hn::Add(x, y);
    return blend_.equation == GlBlend::Equation::kSubtract ? hn::Sub(x, y) : hn::Sub(y, x);
  }

  // A factor of zero gives zero whatever the sample is, as if the image were not there.
  HWY_INLINE V Times(V v, BlendFactor factor, int i, V a, V b, V alpha_a, V alpha_b, bool alpha) const {
    const V one = Set(1);
    switch (factor) {
      case BlendFactor::kZero:
        return hn::Zero(s::D());
      case BlendFactor::kSourceColor:
        return hn::Mul(v, a);
      case BlendFactor::kOneMinusSourceColor:
        return hn::Mul(v, hn::Sub(one, a));
      case BlendFactor::kDestinationColor:
        return hn::Mul(v, b);
      case BlendFactor::kOneMinusDestinationColor:
        return hn::Mul(v, hn::Sub(one, b));
      case BlendFactor::kSourceAlpha:
        return hn::Mul(v, alpha_a);
      case BlendFactor::kOneMinusSourceAlpha:
        return hn::Mul(v, hn::Sub(one, alpha_a));
      case BlendFactor::kDestinationAlpha:
        return hn::Mul(v, alpha_b);
      case BlendFactor::kOneMinusDestinationAlpha:
        return hn::Mul(v, hn::Sub(one, alpha_b));
      case BlendFactor::kSourceAlphaSaturate:
        return alpha ? v : hn::Mul(v, s::MinNumber(alpha_a, hn::Sub(one, alpha_b)));
      case BlendFactor::kConstantColor:
        return hn::Mul(v, Set(constant_[i]));
      case BlendFactor::kOneMinusConstantColor:
        return hn::Mul(v, hn::Sub(one, Set(constant_[i])));
      case BlendFactor::kConstantAlpha:
        return hn::Mul(v, Set(constant_alpha_));
      case BlendFactor::kOneMinusConstantAlpha:
        return hn::Mul(v, hn::Sub(one, Set(constant_alpha_)));
      default:
        return v;
    }
  }

  GlBlend blend_;
  float constant_[4], constant_alpha_;
  ChannelRole roles_[4];
};

std::unique_ptr<graph::PointStage> NewGlStage(const GlBlend& blend, const BlendPlanes& planes,
                                              const float (&constant)[4], float constant_alpha) {
  const Gl kernel(blend, planes, constant, constant_alpha);
  if (planes.form == BlendPlanes::Form::kRgba) return s::MakePairStage(kernel);
  return s::MakeStage<4>(kernel);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewGlStage);

std::unique_ptr<graph::PointStage> MakeGlStage(const GlBlend& blend, const BlendPlanes& planes,
                                               const float (&constant)[4], float constant_alpha) {
  return HWY_DYNAMIC_DISPATCH(NewGlStage)(blend, planes, constant, constant_alpha);
}

}  // namespace tessera::ops
#endif
