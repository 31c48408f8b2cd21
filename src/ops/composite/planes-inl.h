// Blending functions made into stages: on RGBA pixels, or on planes of any channels with the alphas beside
// them.
#if defined(TESSERA_OPS_COMPOSITE_PLANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_COMPOSITE_PLANES_INL_H_
#undef TESSERA_OPS_COMPOSITE_PLANES_INL_H_
#else
#define TESSERA_OPS_COMPOSITE_PLANES_INL_H_
#endif

#include <hwy/highway.h>

#include "ops/composite/blend_kernels.h"
#include "simd/pair-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

// Depth is not mixed: the front image's where that has alpha.
HWY_INLINE s::V FrontDepth(s::V a, s::V b, s::V alpha_a) {
  return hn::IfThenElse(hn::Le(alpha_a, hn::Zero(s::D())), b, a);
}

// f(s, d, alpha of s, alpha of d, mask of alpha samples) on planes: inputs are both images and both alphas.
template <class F>
struct OnPlanes {
  F f;
  ChannelRole roles[4];

  HWY_INLINE s::Pixels operator()(const s::Pixels& a, const s::Pixels& b, const s::Pixels& alpha_a,
                                  const s::Pixels& alpha_b) const {
    return {Plane(0, a.r, b.r, alpha_a.r, alpha_b.r), Plane(1, a.g, b.g, alpha_a.g, alpha_b.g),
            Plane(2, a.b, b.b, alpha_a.b, alpha_b.b), Plane(3, a.a, b.a, alpha_a.a, alpha_b.a)};
  }

 private:
  HWY_INLINE s::V Plane(int i, s::V a, s::V b, s::V alpha_a, s::V alpha_b) const {
    if (roles[i] == ChannelRole::kDepth) return FrontDepth(a, b, alpha_a);
    // An image without alpha is opaque, whatever it has in that place.
    if (roles[i] == ChannelRole::kAlpha) a = alpha_a, b = alpha_b;
    const s::V role = hn::Set(s::D(), roles[i] == ChannelRole::kAlpha ? 1.0f : 0.0f);
    return f(a, b, alpha_a, alpha_b, hn::Ne(role, hn::Zero(s::D())));
  }
};

template <class F>
std::unique_ptr<graph::PointStage> MakeBlendStage(const F& f, const BlendPlanes& planes) {
  if (planes.form == BlendPlanes::Form::kRgba) return s::MakePairStage(f);
  return s::MakeStage<4>(
      OnPlanes<F>{f, {planes.roles[0], planes.roles[1], planes.roles[2], planes.roles[3]}});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
