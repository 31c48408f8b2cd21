// Short runs of adjacent floats (a texel of four samples, a pair, a row of four texels) on every target, and
// pairs of neighbours from scattered places to planes.
#if defined(TESSERA_SIMD_TEXELS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_TEXELS_INL_H_
#undef TESSERA_SIMD_TEXELS_INL_H_
#else
#define TESSERA_SIMD_TEXELS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// a b + c with one rounding, also where the processor has no such instruction.
template <class D, class Vec>
HWY_INLINE Vec Fused(D d, Vec a, Vec b, Vec c) {
#if HWY_TARGET <= HWY_AVX2
  (void)d;
  return hn::MulAdd(a, b, c);
#else
  constexpr size_t n = hn::MaxLanes(D());
  alignas(64) float x[n], y[n], z[n];
  hn::Store(a, d, x), hn::Store(b, d, y), hn::Store(c, d, z);
  for (size_t i = 0; i < n; ++i) x[i] = static_cast<float>(double{x[i]} * y[i] + z[i]);
  return hn::Load(d, x);
#endif
}
HWY_INLINE V Fused(V a, V b, V c) { return Fused(D(), a, b, c); }

// yes where the sign bit is set, of -0 too, else no.
template <class D, class Vec>
HWY_INLINE Vec IfSignThenElse(D d, Vec sign, Vec yes, Vec no) {
#if HWY_TARGET == HWY_SCALAR
  const hn::RebindToSigned<D> di;
  return hn::IfThenElse(hn::RebindMask(d, hn::Lt(hn::BitCast(di, sign), hn::Zero(di))), yes, no);
#else
  (void)d;
  return hn::IfNegativeThenElse(sign, yes, no);
#endif
}

// n adjacent floats in as few registers as the target allows.
template <int n>
struct Floats {
  using Tag = hn::CappedTag<float, n>;
  using Vec = hn::Vec<Tag>;
  static constexpr int kLanesOf = static_cast<int>(hn::MaxLanes(Tag()));
  static constexpr int kRegs = n / kLanesOf;
  Vec reg[kRegs];

  static HWY_INLINE Floats Load(const float* p) {
    Floats f;
    for (int k = 0; k < kRegs; ++k) f.reg[k] = hn::LoadU(Tag(), p + k * kLanesOf);
    return f;
  }
  static HWY_INLINE Floats Set(float v) {
    Floats f;
    for (int k = 0; k < kRegs; ++k) f.reg[k] = hn::Set(Tag(), v);
    return f;
  }
  HWY_INLINE void Store(float* p) const {
    for (int k = 0; k < kRegs; ++k) hn::StoreU(reg[k], Tag(), p + k * kLanesOf);
  }
};
using Quad = Floats<4>;
using Pair = Floats<8>;  // two adjacent texels
using Row = Floats<16>;  // four adjacent texels

// a + b, a b, a b + c, c - a b.
template <int n>
HWY_INLINE Floats<n> Add(Floats<n> a, const Floats<n>& b) {
  for (int k = 0; k < Floats<n>::kRegs; ++k) a.reg[k] = hn::Add(a.reg[k], b.reg[k]);
  return a;
}
template <int n>
HWY_INLINE Floats<n> Mul(Floats<n> a, const Floats<n>& b) {
  for (int k = 0; k < Floats<n>::kRegs; ++k) a.reg[k] = hn::Mul(a.reg[k], b.reg[k]);
  return a;
}
template <int n>
HWY_INLINE Floats<n> MulAdd(Floats<n> a, const Floats<n>& b, const Floats<n>& c) {
  for (int k = 0; k < Floats<n>::kRegs; ++k) a.reg[k] = hn::MulAdd(a.reg[k], b.reg[k], c.reg[k]);
  return a;
}
template <int n>
HWY_INLINE Floats<n> NegMulAdd(Floats<n> a, const Floats<n>& b, const Floats<n>& c) {
  for (int k = 0; k < Floats<n>::kRegs; ++k) a.reg[k] = hn::NegMulAdd(a.reg[k], b.reg[k], c.reg[k]);
  return a;
}
// (1 - f) a + f b: no overflow between values of opposite signs, and b itself at f = 1.
template <int n>
HWY_INLINE Floats<n> Lerp(const Floats<n>& a, const Floats<n>& b, const Floats<n>& f) {
  return MulAdd(f, b, NegMulAdd(f, a, a));
}
HWY_INLINE V Lerp(V a, V b, V f) { return hn::MulAdd(f, b, hn::NegMulAdd(f, a, a)); }

// a b + c with one rounding on every target.
template <int n>
HWY_INLINE Floats<n> Fused(Floats<n> a, const Floats<n>& b, const Floats<n>& c) {
  for (int k = 0; k < Floats<n>::kRegs; ++k)
    a.reg[k] = Fused(typename Floats<n>::Tag(), a.reg[k], b.reg[k], c.reg[k]);
  return a;
}
// near + h (far - near), h in [0, 1/2]: within one unit roundoff of the larger end, which the other forms are
// not. Differences must be finite.
template <int n>
HWY_INLINE Floats<n> LerpFrom(const Floats<n>& near, const Floats<n>& far, const Floats<n>& h) {
  Floats<n> difference;
  for (int k = 0; k < Floats<n>::kRegs; ++k) difference.reg[k] = hn::Sub(far.reg[k], near.reg[k]);
  return Fused(h, difference, near);
}
// The same between a and b: g is the distance from the nearer one, in [-1/2, 1/2], its sign bit set where
// that is b.
HWY_INLINE V LerpFromNearer(V a, V b, V g) { return Fused(g, hn::Sub(b, a), IfSignThenElse(D(), g, b, a)); }
template <int n>
HWY_INLINE Floats<n> LerpFromNearer(const Floats<n>& a, const Floats<n>& b, const Floats<n>& g) {
  Floats<n> difference, near;
  for (int k = 0; k < Floats<n>::kRegs; ++k) {
    difference.reg[k] = hn::Sub(b.reg[k], a.reg[k]);
    near.reg[k] = IfSignThenElse(typename Floats<n>::Tag(), g.reg[k], b.reg[k], a.reg[k]);
  }
  return Fused(g, difference, near);
}

// Lower and upper half.
template <int n>
HWY_INLINE Floats<n / 2> Lower(const Floats<n>& v) {
  Floats<n / 2> h;
  if constexpr (Floats<n>::kRegs == 1) {
    h.reg[0] = hn::LowerHalf(v.reg[0]);
  } else {
    for (int k = 0; k < Floats<n / 2>::kRegs; ++k) h.reg[k] = v.reg[k];
  }
  return h;
}
template <int n>
HWY_INLINE Floats<n / 2> Upper(const Floats<n>& v) {
  Floats<n / 2> h;
#if HWY_TARGET != HWY_SCALAR
  if constexpr (Floats<n>::kRegs == 1) {
    h.reg[0] = hn::UpperHalf(typename Floats<n / 2>::Tag(), v.reg[0]);
    return h;
  }
#endif
  if constexpr (Floats<n>::kRegs > 1) {
    for (int k = 0; k < Floats<n / 2>::kRegs; ++k) h.reg[k] = v.reg[k + Floats<n / 2>::kRegs];
  }
  return h;
}

// Quads side by side: quad(first), quad(first + 4), ... fill a vector (one lane: the first).
template <class Q>
HWY_INLINE V VectorOfQuads(const Q& quad, int first) {
#if HWY_TARGET == HWY_SCALAR
  return quad(first);
#else
  if constexpr (kLanes == 4) {
    return quad(first);
  } else {
    const hn::CappedTag<float, 8> d8;
    const auto a = hn::Combine(d8, quad(first + 4), quad(first));
    if constexpr (kLanes == 8) {
      return a;
    } else {
      return hn::Combine(D(), hn::Combine(d8, quad(first + 12), quad(first + 8)), a);
    }
  }
#endif
}
// The same from memory, quad k at p(k).
template <class P>
HWY_INLINE V LoadQuads(const P& p, int first) {
#if HWY_TARGET == HWY_SCALAR
  return hn::LoadU(D(), p(first));
#else
  return VectorOfQuads([&](int k) HWY_ATTR { return hn::LoadU(hn::CappedTag<float, 4>(), p(k)); }, first);
#endif
}

// Pairs of kQuarter pixels: their first texels side by side, and their second ones.
template <class P>
HWY_INLINE void SplitPairs(const P* pairs, V& first, V& second) {
  const D d;
  (void)d;
#if HWY_TARGET != HWY_SCALAR
  if constexpr (kLanes == 16) {
    const V even = hn::Combine(d, pairs[2].reg[0], pairs[0].reg[0]),
            odd = hn::Combine(d, pairs[3].reg[0], pairs[1].reg[0]);
    first = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(odd), even);
    second = hn::OddEvenBlocks(odd, hn::SwapAdjacentBlocks(even));
    return;
  } else if constexpr (kLanes == 8) {
    first = hn::ConcatLowerLower(d, pairs[1].reg[0], pairs[0].reg[0]);
    second = hn::ConcatUpperUpper(d, pairs[1].reg[0], pairs[0].reg[0]);
    return;
  }
#endif
  if constexpr (kLanes <= 4) first = Lower(pairs[0]).reg[0], second = Upper(pairs[0]).reg[0];
}

#if HWY_TARGET != HWY_SCALAR
// Two adjacent floats from each of two places, side by side.
HWY_INLINE hn::Vec<hn::CappedTag<float, 4>> JoinPairs(const float* first, const float* second) {
  const hn::CappedTag<float, 2> d2;
#if HWY_ARCH_X86
  // One instruction loads and joins the second pair.
  return hn::Vec<hn::CappedTag<float, 4>>{
      _mm_loadh_pi(hn::LoadU(d2, first).raw, reinterpret_cast<const __m64*>(second))};
#else
  return hn::Combine(hn::CappedTag<float, 4>(), hn::LoadU(d2, second), hn::LoadU(d2, first));
#endif
}
#endif

// Two adjacent floats from kLanes places: a has the first, b the second, in the order of the places.
template <class P>
HWY_INLINE void LoadPairs(const P& p, V& a, V& b) {
#if HWY_TARGET == HWY_SCALAR
  a = hn::LoadU(D(), p(0));
  b = hn::LoadU(D(), p(0) + 1);
#else
  // Places first, first + 2 of each four.
  const auto two = [&](int first) HWY_ATTR { return JoinPairs(p(first), p(first + 2)); };
  V even, odd;
  if constexpr (kLanes == 4) {
    even = two(0), odd = two(1);
  } else {
    const hn::CappedTag<float, 8> d8;
    const auto four = [&](int first) HWY_ATTR { return hn::Combine(d8, two(first + 4), two(first)); };
    if constexpr (kLanes == 8) {
      even = four(0), odd = four(1);
    } else {
      even = hn::Combine(D(), four(8), four(0)), odd = hn::Combine(D(), four(9), four(1));
    }
  }
  a = hn::OddEven(hn::DupEven(odd), even);
  b = hn::OddEven(odd, hn::DupOdd(even));
#endif
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
