// Separable blend modes of Compositing and Blending Level 1, written on premultiplied samples:
// result = T + s (1 - ad) + d (1 - as), T = as ad B(d / ad, s / as), 0 unless both alphas are positive.
#include <memory>

#include "ops/composite/blend_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/composite/separable_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/composite/planes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
using s::V;
using s::Words;
using M = hn::Mask<s::D>;

HWY_INLINE V Constant(float v) { return hn::Set(s::D(), v); }

template <class B>
inline constexpr bool kDivides = requires {
  B::kDivides;
};
template <class B>
inline constexpr bool kSums = requires(Words v) {
  B::Sum(v, v, v, v, v);
};

// B gives T for positive alphas: term(s, d, as, ad, as ad). kAlphaApart: B does not make 1 of two ones.
// kDivides: it does, exactly, and by divisions that alpha can do without.
//
// Of codes the result is a sum of products by 255. B may give that sum, of codes and alphas of any kind and
// limited to 2^16 - 1, from it without T.
template <class B, bool kAlphaApart = false>
struct Separable {
  HWY_INLINE V operator()(V a, V b, V alpha_a, V alpha_b, M is_alpha) const {
    const V zero = hn::Zero(s::D()), one = Constant(1);
    const V both = hn::Mul(alpha_a, alpha_b);
    V term = B::Term(a, b, alpha_a, alpha_b, both);
    if constexpr (kAlphaApart) term = hn::IfThenElse(is_alpha, both, term);
    term = hn::IfThenElseZero(hn::And(hn::Gt(alpha_a, zero), hn::Gt(alpha_b, zero)), term);
    return hn::MulAdd(hn::Sub(one, alpha_a), b, hn::MulAdd(hn::Sub(one, alpha_b), a, term));
  }

  HWY_INLINE V Alpha(V alpha_a, V alpha_b) const requires kDivides<B> {
    const V one = Constant(1), both = hn::Mul(alpha_a, alpha_b);
    return hn::MulAdd(hn::Sub(one, alpha_a), alpha_b, hn::MulAdd(hn::Sub(one, alpha_b), alpha_a, both));
  }

  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) requires kSums<B> {
    const s::DWords d;
    const Words alpha_a = s::AlphaWords(a), alpha_b = s::AlphaWords(b);
    const Words rest_a = s::Complement(alpha_a), rest_b = s::Complement(alpha_b);
    const auto clear = hn::Eq(hn::Min(alpha_a, alpha_b), hn::Zero(d));
    const auto alphas = hn::Eq(hn::And(hn::Iota(d, 0), hn::Set(d, 1)), hn::Set(d, 1));  // of the odd samples
    const auto half = [&](Words ca, Words cb, bool odd) HWY_ATTR {
      const Words apart = hn::SaturatedAdd(hn::Mul(rest_a, cb), hn::Mul(rest_b, ca));
      Words sum = B::Sum(ca, cb, alpha_a, alpha_b, apart);
      if (kAlphaApart && odd)
        sum = hn::IfThenElse(alphas, hn::SaturatedAdd(apart, hn::Mul(alpha_a, alpha_b)), sum);
      return s::SumDiv255(hn::IfThenElse(clear, apart, sum), hn::Zero(d));
    };
    return s::FromEvenOdd(half(s::Even(a), s::Even(b), false), half(s::Odd(a), s::Odd(b), true));
  }
};

struct MultiplyTerm {
  static HWY_INLINE V Term(V a, V b, V, V, V) { return hn::Mul(a, b); }
  static HWY_INLINE Words Sum(Words a, Words b, Words, Words, Words apart) {
    return hn::SaturatedAdd(apart, hn::Mul(a, b));
  }
};
struct ScreenTerm {
  static HWY_INLINE V Term(V a, V b, V alpha_a, V alpha_b, V) {
    return hn::NegMulAdd(a, b, hn::MulAdd(a, alpha_b, hn::Mul(b, alpha_a)));
  }
  static HWY_INLINE Words Sum(Words a, Words b, Words, Words, Words) {
    return hn::Add(hn::Mul(a, hn::Set(s::DWords(), 255)), hn::Mul(b, s::Complement(a)));
  }
};
struct DarkenTerm {
  static HWY_INLINE V Term(V a, V b, V alpha_a, V alpha_b, V) {
    return s::MinNumber(hn::Mul(a, alpha_b), hn::Mul(b, alpha_a));
  }
  static HWY_INLINE Words Sum(Words a, Words b, Words alpha_a, Words alpha_b, Words apart) {
    return hn::SaturatedAdd(apart, hn::Min(hn::Mul(a, alpha_b), hn::Mul(b, alpha_a)));
  }
};
struct LightenTerm {
  static HWY_INLINE V Term(V a, V b, V alpha_a, V alpha_b, V) {
    return s::MaxNumber(hn::Mul(a, alpha_b), hn::Mul(b, alpha_a));
  }
  static HWY_INLINE Words Sum(Words a, Words b, Words alpha_a, Words alpha_b, Words apart) {
    return hn::SaturatedAdd(apart, hn::Max(hn::Mul(a, alpha_b), hn::Mul(b, alpha_a)));
  }
};
struct DodgeTerm {
  static constexpr bool kDivides = true;
  static HWY_INLINE V Term(V a, V b, V alpha_a, V, V both) {
    const V zero = hn::Zero(s::D());
    const V quotient = hn::Mul(hn::Mul(b, alpha_a), hn::Div(alpha_a, hn::Sub(alpha_a, a)));
    const V t = hn::IfThenElse(hn::Ge(a, alpha_a), both, s::ClampHigh(quotient, both));
    return hn::IfThenZeroElse(hn::Le(b, zero), t);
  }
};
struct BurnTerm {
  static constexpr bool kDivides = true;
  static HWY_INLINE V Term(V a, V b, V alpha_a, V alpha_b, V both) {
    const V zero = hn::Zero(s::D());
    const V quotient = hn::Mul(hn::Mul(hn::Sub(alpha_b, b), alpha_a), hn::Div(alpha_a, a));
    const V t = hn::IfThenZeroElse(hn::Le(a, zero), hn::Sub(both, s::ClampHigh(quotient, both)));
    return hn::IfThenElse(hn::Ge(b, alpha_b), both, t);
  }
};
struct HardLightTerm {
  static HWY_INLINE V Term(V a, V b, V alpha_a, V alpha_b, V both) {
    const V dark = hn::Mul(hn::Add(a, a), b);
    const V rest = hn::Mul(hn::Sub(alpha_b, b), hn::Sub(alpha_a, a));
    const V light = hn::NegMulAdd(Constant(2), rest, both);
    return hn::IfThenElse(hn::Le(hn::Add(a, a), alpha_a), dark, light);
  }
};
struct SoftLightTerm {
  static constexpr bool kDivides = true;
  static HWY_INLINE V Term(V a, V b, V alpha_a, V alpha_b, V) {
    const V m = hn::Div(b, alpha_b), twice = hn::Add(a, a), base = hn::Mul(b, alpha_a);
    const V dark = hn::NegMulAdd(hn::Mul(hn::Sub(alpha_a, twice), b), hn::Sub(Constant(1), m), base);
    // ((16 m - 12) m + 4) m - m up to a quarter, the square root less m beyond.
    const V poly = hn::Mul(m, hn::MulAdd(m, hn::MulAdd(Constant(16), m, Constant(-12)), Constant(3)));
    const V gain = hn::IfThenElse(hn::Le(m, Constant(0.25f)), poly, hn::Sub(hn::Sqrt(m), m));
    const V light = hn::MulAdd(hn::Mul(hn::Sub(twice, alpha_a), alpha_b), gain, base);
    return hn::IfThenElse(hn::Le(twice, alpha_a), dark, light);
  }
};
struct DifferenceTerm {
  static HWY_INLINE V Term(V a, V b, V alpha_a, V alpha_b, V) {
    return hn::Abs(hn::Sub(hn::Mul(b, alpha_a), hn::Mul(a, alpha_b)));
  }
  static HWY_INLINE Words Sum(Words a, Words b, Words alpha_a, Words alpha_b, Words apart) {
    const Words x = hn::Mul(b, alpha_a), y = hn::Mul(a, alpha_b);
    return hn::SaturatedAdd(apart, hn::Or(hn::SaturatedSub(x, y), hn::SaturatedSub(y, x)));
  }
};
struct ExclusionTerm {
  static HWY_INLINE V Term(V a, V b, V alpha_a, V alpha_b, V) {
    return hn::NegMulAdd(hn::Mul(Constant(2), a), b, hn::MulAdd(a, alpha_b, hn::Mul(b, alpha_a)));
  }
  static HWY_INLINE Words Sum(Words a, Words b, Words, Words, Words) {
    return hn::SaturatedAdd(hn::Mul(a, s::Complement(b)), hn::Mul(b, s::Complement(a)));
  }
};
// Not of this form: the sum, limited to 1.
struct PlusLighter {
  HWY_INLINE V operator()(V a, V b, V, V, M) const { return s::ClampHigh(hn::Add(a, b), Constant(1)); }
};

std::unique_ptr<graph::PointStage> NewSeparableStage(BlendMode mode, const BlendPlanes& planes) {
  switch (mode) {
    case BlendMode::kMultiply:
      return MakeBlendStage(Separable<MultiplyTerm>(), planes);
    case BlendMode::kScreen:
      return MakeBlendStage(Separable<ScreenTerm>(), planes);
    case BlendMode::kDarken:
      return MakeBlendStage(Separable<DarkenTerm>(), planes);
    case BlendMode::kLighten:
      return MakeBlendStage(Separable<LightenTerm>(), planes);
    case BlendMode::kColorDodge:
      return MakeBlendStage(Separable<DodgeTerm>(), planes);
    case BlendMode::kColorBurn:
      return MakeBlendStage(Separable<BurnTerm>(), planes);
    case BlendMode::kHardLight:
      return MakeBlendStage(Separable<HardLightTerm>(), planes);
    case BlendMode::kSoftLight:
      return MakeBlendStage(Separable<SoftLightTerm>(), planes);
    case BlendMode::kDifference:
      return MakeBlendStage(Separable<DifferenceTerm, true>(), planes);
    case BlendMode::kExclusion:
      return MakeBlendStage(Separable<ExclusionTerm, true>(), planes);
    default:
      return MakeBlendStage(PlusLighter(), planes);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewSeparableStage);

std::unique_ptr<graph::PointStage> MakeSeparableStage(BlendMode mode, const BlendPlanes& planes) {
  return HWY_DYNAMIC_DISPATCH(NewSeparableStage)(mode, planes);
}

}  // namespace tessera::ops
#endif
