// Porter-Duff operators on premultiplied samples: floats, and 8-bit codes with one rounding.
#include <memory>

#include "ops/composite/blend_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/composite/porter_duff_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/composite/planes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
using s::V;
using M = hn::Mask<s::D>;

HWY_INLINE V One() { return hn::Set(s::D(), 1.0f); }
HWY_INLINE V OneMinus(V v) { return hn::Sub(One(), v); }

struct Over {
  HWY_INLINE V operator()(V a, V b, V alpha_a, V, M) const { return hn::MulAdd(OneMinus(alpha_a), b, a); }
  // The foreground is whole codes: rounding the product rounds the sum.
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) {
    const s::Words k = s::Complement(s::AlphaWords(a));
    const s::Bytes rest = s::FromEvenOdd(s::Div255(hn::Mul(k, s::Even(b))), s::Div255(hn::Mul(k, s::Odd(b))));
    return hn::SaturatedAdd(a, rest);
  }
};
// An alpha beyond [0, 1] counts as the limit, NaN as 0; codes have no other.
struct OverClamped : Over {
  HWY_INLINE V operator()(V a, V b, V alpha_a, V, M) const {
    const V alpha = s::ClampHigh(s::ClampLow(alpha_a, hn::Zero(s::D())), One());
    return hn::MulAdd(OneMinus(alpha), b, a);
  }
};
struct In {
  HWY_INLINE V operator()(V a, V, V, V alpha_b, M) const { return hn::Mul(a, alpha_b); }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) {
    const s::Words k = s::AlphaWords(b);
    return s::FromEvenOdd(s::Div255(hn::Mul(k, s::Even(a))), s::Div255(hn::Mul(k, s::Odd(a))));
  }
};
struct Out {
  HWY_INLINE V operator()(V a, V, V, V alpha_b, M) const { return hn::Mul(a, OneMinus(alpha_b)); }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) {
    const s::Words k = s::Complement(s::AlphaWords(b));
    return s::FromEvenOdd(s::Div255(hn::Mul(k, s::Even(a))), s::Div255(hn::Mul(k, s::Odd(a))));
  }
};
// (ka * a + kb * b) / 255, rounded once.
HWY_INLINE s::Bytes TwoProducts(s::Words ka, s::Bytes a, s::Words kb, s::Bytes b) {
  return s::FromEvenOdd(s::SumDiv255(hn::Mul(ka, s::Even(a)), hn::Mul(kb, s::Even(b))),
                        s::SumDiv255(hn::Mul(ka, s::Odd(a)), hn::Mul(kb, s::Odd(b))));
}
struct Atop {
  HWY_INLINE V operator()(V a, V b, V alpha_a, V alpha_b, M) const {
    return hn::MulAdd(OneMinus(alpha_a), b, hn::Mul(a, alpha_b));
  }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) {
    return TwoProducts(s::AlphaWords(b), a, s::Complement(s::AlphaWords(a)), b);
  }
};
struct Xor {
  HWY_INLINE V operator()(V a, V b, V alpha_a, V alpha_b, M) const {
    return hn::Add(hn::Mul(OneMinus(alpha_b), a), hn::Mul(OneMinus(alpha_a), b));  // symmetric to the bit
  }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) {
    return TwoProducts(s::Complement(s::AlphaWords(b)), a, s::Complement(s::AlphaWords(a)), b);
  }
};
struct Plus {
  HWY_INLINE V operator()(V a, V b, V, V, M) const { return hn::Add(a, b); }
  static HWY_INLINE s::Bytes Codes(s::Bytes a, s::Bytes b) { return hn::SaturatedAdd(a, b); }
};

std::unique_ptr<graph::PointStage> NewPorterDuffStage(PorterDuff op, const BlendPlanes& planes) {
  switch (op) {
    case PorterDuff::kOver:
      return MakeBlendStage(Over(), planes);
    case PorterDuff::kOverClamped:
      return MakeBlendStage(OverClamped(), planes);
    case PorterDuff::kIn:
      return MakeBlendStage(In(), planes);
    case PorterDuff::kOut:
      return MakeBlendStage(Out(), planes);
    case PorterDuff::kAtop:
      return MakeBlendStage(Atop(), planes);
    case PorterDuff::kXor:
      return MakeBlendStage(Xor(), planes);
    case PorterDuff::kPlus:
      break;
  }
  return MakeBlendStage(Plus(), planes);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewPorterDuffStage);

std::unique_ptr<graph::PointStage> MakePorterDuffStage(PorterDuff op, const BlendPlanes& planes) {
  return HWY_DYNAMIC_DISPATCH(NewPorterDuffStage)(op, planes);
}

}  // namespace tessera::ops
#endif
