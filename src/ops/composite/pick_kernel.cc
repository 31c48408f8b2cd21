// Kernels that choose between two pixels by a comparison: depth, alpha and stencil tests, thresholds, masks.
#include <limits>
#include <memory>

#include "ops/composite/pick_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/composite/pick_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/composite/planes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
using s::Pixels;
using s::V;
using M = hn::Mask<s::D>;

HWY_INLINE V Set(float v) { return hn::Set(s::D(), v); }
HWY_INLINE V Zero() { return hn::Zero(s::D()); }
// a OP b in 0 and 1 bits; the choice is the same for a whole run and costs nothing.
HWY_INLINE M Compare(Comparison test, V a, V b) {
  switch (test) {
    case Comparison::kNever:
      return hn::Lt(a, a);
    case Comparison::kLess:
      return hn::Lt(a, b);
    case Comparison::kEqual:
      return hn::Eq(a, b);
    case Comparison::kLessOrEqual:
      return hn::Le(a, b);
    case Comparison::kGreater:
      return hn::Gt(a, b);
    case Comparison::kNotEqual:
      return hn::Not(hn::Eq(a, b));  // true for NaN
    case Comparison::kGreaterOrEqual:
      return hn::Ge(a, b);
    case Comparison::kAlways:
      break;
  }
  return hn::Not(hn::Lt(a, a));
}

struct ZOver {
  ChannelRole roles[4];
  bool zero_is_infinite;

  HWY_INLINE Pixels operator()(const Pixels& a, const Pixels& b, const Pixels& alpha_a, const Pixels& alpha_b,
                               const Pixels& depth_a, const Pixels& depth_b) const {
    V za = depth_a.r, zb = depth_b.r;
    if (zero_is_infinite) {
      const V far = Set(std::numeric_limits<float>::max());
      za = hn::IfThenElse(hn::Eq(za, Zero()), far, za);
      zb = hn::IfThenElse(hn::Eq(zb, Zero()), far, zb);
    }
    const auto nearer = hn::Le(za, zb);
    const V front = hn::IfThenElse(nearer, alpha_a.r, alpha_b.r);
    const V alpha = s::ClampHigh(s::ClampLow(front, Zero()), Set(1)), rest = hn::Sub(Set(1), alpha);
    const auto over = [&](int i, V va, V vb) HWY_ATTR {
      const V f = hn::IfThenElse(nearer, va, vb), g = hn::IfThenElse(nearer, vb, va);
      return roles[i] == ChannelRole::kDepth ? FrontDepth(f, g, front) : hn::MulAdd(rest, g, f);
    };
    return {over(0, a.r, b.r), over(1, a.g, b.g), over(2, a.b, b.b), over(3, a.a, b.a)};
  }
};

struct AlphaTest {
  AlphaTestParams p;
  HWY_INLINE Pixels operator()(const Pixels& a, const Pixels& alpha) const {
    const auto keep = Compare(p.test, alpha.r, Set(p.reference));
    return s::Map(a, [&](V v) HWY_ATTR { return hn::IfThenElseZero(keep, v); });
  }
};

struct DepthTest {
  ChannelRole roles[4];
  Comparison test;
  float scale, bias;
  bool squeezed;

  HWY_INLINE Pixels operator()(const Pixels& a, const Pixels& b, const Pixels& depth_a,
                               const Pixels& depth_b) const {
    V z = depth_a.r;
    if (squeezed) z = hn::Add(hn::Mul(z, Set(scale)), Set(bias));
    const auto pass = hn::Or(Compare(test, z, depth_b.r), hn::AndNot(hn::IsNaN(z), hn::IsNaN(depth_b.r)));
    const auto pick = [&](int i, V va, V vb) HWY_ATTR {
      return hn::IfThenElse(pass, roles[i] == ChannelRole::kDepth ? z : va, vb);
    };
    return {pick(0, a.r, b.r), pick(1, a.g, b.g), pick(2, a.b, b.b), pick(3, a.a, b.a)};
  }
};

// A stencil's byte from its sample; the nearest, NaN to 0.
HWY_INLINE s::VI StencilCode(V v) { return s::ToUnorm<256>(v); }
HWY_INLINE M StencilPass(const StencilParams& p, s::VI code) {
  const V stored = hn::ConvertTo(s::D(), hn::And(code, hn::Set(s::DI(), p.mask)));
  return Compare(p.test, Set(static_cast<float>(p.reference & p.mask)), stored);
}

struct StencilSelect {
  StencilParams p;
  HWY_INLINE Pixels operator()(const Pixels& a, const Pixels& b, const Pixels& stencil) const {
    const M pass = StencilPass(p, StencilCode(stencil.r));
    return s::Map(a, b, [&](V va, V vb) HWY_ATTR { return hn::IfThenElse(pass, va, vb); });
  }
};

struct StencilUpdate {
  StencilParams p;
  HWY_INLINE Pixels operator()(const Pixels& stencil) const {
    return s::Map(stencil, [&](V v) HWY_ATTR {
      const s::DI d;
      const s::VI code = StencilCode(v);
      const s::VI next =
          hn::IfThenElse(hn::RebindMask(d, StencilPass(p, code)), Act(p.on_pass, code), Act(p.on_fail, code));
      const s::VI writable = hn::Set(d, p.write_mask & 255);
      const s::VI kept = hn::Or(hn::AndNot(writable, code), hn::And(writable, next));
      return s::FromUnorm8(hn::ConvertTo(s::D(), kept));
    });
  }

 private:
  HWY_INLINE s::VI Act(StencilAction action, s::VI code) const {
    const s::DI d;
    const s::VI one = hn::Set(d, 1), all = hn::Set(d, 255), zero = hn::Zero(d);
    switch (action) {
      case StencilAction::kZero:
        return zero;
      case StencilAction::kReplace:
        return hn::Set(d, p.reference);
      case StencilAction::kIncrement:
        return hn::Min(hn::Add(code, one), all);
      case StencilAction::kDecrement:
        return hn::Max(hn::Sub(code, one), zero);
      case StencilAction::kInvert:
        return hn::Xor(code, all);
      case StencilAction::kIncrementWrap:
        return hn::And(hn::Add(code, one), all);
      case StencilAction::kDecrementWrap:
        return hn::And(hn::Sub(code, one), all);
      default:
        return code;
    }
  }
};

struct Threshold {
  float threshold;
  HWY_INLINE Pixels operator()(const Pixels& a, const Pixels& b, const Pixels& pattern) const {
    const auto turned = hn::Lt(pattern.r, Set(threshold));
    return s::Map(a, b, [&](V va, V vb) HWY_ATTR { return hn::IfThenElse(turned, vb, va); });
  }
};

struct Reveal {
  HWY_INLINE Pixels operator()(const Pixels& a, const Pixels& b, const Pixels& mask) const {
    const V m = mask.r;
    const auto none = hn::Eq(m, Zero()), all = hn::Eq(m, Set(1));
    return s::Map(a, b, [&](V va, V vb) HWY_ATTR {
      const V v = hn::MulAdd(m, hn::Sub(vb, va), va);
      return hn::IfThenElse(none, va, hn::IfThenElse(all, vb, v));
    });
  }
};

template <int kInputs, class F>
std::unique_ptr<graph::PointStage> New(F f) {
  return s::MakeStage<kInputs>(std::move(f));
}
std::unique_ptr<graph::PointStage> NewZOver(const ChannelRole (&r)[4], bool zero_is_infinite) {
  return New<6>(ZOver{{r[0], r[1], r[2], r[3]}, zero_is_infinite});
}
std::unique_ptr<graph::PointStage> NewAlphaTest(const AlphaTestParams& p) { return New<2>(AlphaTest{p}); }
std::unique_ptr<graph::PointStage> NewDepthTest(const ChannelRole (&r)[4], const DepthTestParams& p) {
  return New<4>(DepthTest{{r[0], r[1], r[2], r[3]}, p.test, p.scale, p.bias, p.scale != 1 || p.bias != 0});
}
std::unique_ptr<graph::PointStage> NewStencilSelect(const StencilParams& p) {
  return New<3>(StencilSelect{p});
}
std::unique_ptr<graph::PointStage> NewStencilUpdate(const StencilParams& p) {
  return New<1>(StencilUpdate{p});
}
std::unique_ptr<graph::PointStage> NewThreshold(float threshold) { return New<3>(Threshold{threshold}); }
std::unique_ptr<graph::PointStage> NewReveal() { return New<3>(Reveal{}); }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewZOver);
HWY_EXPORT(NewAlphaTest);
HWY_EXPORT(NewDepthTest);
HWY_EXPORT(NewStencilSelect);
HWY_EXPORT(NewStencilUpdate);
HWY_EXPORT(NewThreshold);
HWY_EXPORT(NewReveal);

std::unique_ptr<graph::PointStage> MakeZOverStage(const ChannelRole (&roles)[4], bool zero_is_infinite) {
  return HWY_DYNAMIC_DISPATCH(NewZOver)(roles, zero_is_infinite);
}
std::unique_ptr<graph::PointStage> MakeAlphaTestStage(const AlphaTestParams& p) {
  return HWY_DYNAMIC_DISPATCH(NewAlphaTest)(p);
}
std::unique_ptr<graph::PointStage> MakeDepthTestStage(const ChannelRole (&roles)[4],
                                                      const DepthTestParams& p) {
  return HWY_DYNAMIC_DISPATCH(NewDepthTest)(roles, p);
}
std::unique_ptr<graph::PointStage> MakeStencilSelectStage(const StencilParams& p) {
  return HWY_DYNAMIC_DISPATCH(NewStencilSelect)(p);
}
std::unique_ptr<graph::PointStage> MakeStencilUpdateStage(const StencilParams& p) {
  return HWY_DYNAMIC_DISPATCH(NewStencilUpdate)(p);
}
std::unique_ptr<graph::PointStage> MakeThresholdStage(float threshold) {
  return HWY_DYNAMIC_DISPATCH(NewThreshold)(threshold);
}
std::unique_ptr<graph::PointStage> MakeRevealStage() { return HWY_DYNAMIC_DISPATCH(NewReveal)(); }

}  // namespace tessera::ops
#endif
