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

#include "simd/floats-inl.h"
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
  (void)d;
  return hn::IfNegativeThenElse(sign, yes, no);
}

using Quad = Floats<4>;
using Pair = Floats<8>;  // two adjacent texels
using Row = Floats<16>;  // four adjacent texels

// a + b, a b, a b + c, c - a b.
template <int n>
HWY_INLINE Floats<n> Add(Floats<n> a, const Floats<n>& b) {
  for (int k = 0; k < Floats<n>::kVectors; ++k) a.v[k] = hn::Add(a.v[k], b.v[k]);
  return a;
}
template <int n>
HWY_INLINE Floats<n> Mul(Floats<n> a, const Floats<n>& b) {
  for (int k = 0; k < Floats<n>::kVectors; ++k) a.v[k] = hn::Mul(a.v[k], b.v[k]);
  return a;
}
template <int n>
HWY_INLINE Floats<n> MulAdd(Floats<n> a, const Floats<n>& b, const Floats<n>& c) {
  for (int k = 0; k < Floats<n>::kVectors; ++k) a.v[k] = hn::MulAdd(a.v[k], b.v[k], c.v[k]);
  return a;
}
template <int n>
HWY_INLINE Floats<n> NegMulAdd(Floats<n> a, const Floats<n>& b, const Floats<n>& c) {
  for (int k = 0; k < Floats<n>::kVectors; ++k) a.v[k] = hn::NegMulAdd(a.v[k], b.v[k], c.v[k]);
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
  for (int k = 0; k < Floats<n>::kVectors; ++k)
    a.v[k] = Fused(typename Floats<n>::Tag(), a.v[k], b.v[k], c.v[k]);
  return a;
}
// near + h (far - near), h in [0, 1/2]: within one unit roundoff of the larger end, which the other forms are
// not. Differences must be finite.
template <int n>
HWY_INLINE Floats<n> LerpFrom(const Floats<n>& near, const Floats<n>& far, const Floats<n>& h) {
  Floats<n> difference;
  for (int k = 0; k < Floats<n>::kVectors; ++k) difference.v[k] = hn::Sub(far.v[k], near.v[k]);
  return Fused(h, difference, near);
}
// The same between a and b: g is the distance from the nearer one, in [-1/2, 1/2], its sign bit set where
// that is b.
HWY_INLINE V LerpFromNearer(V a, V b, V g) { return Fused(g, hn::Sub(b, a), IfSignThenElse(D(), g, b, a)); }
template <int n>
HWY_INLINE Floats<n> LerpFromNearer(const Floats<n>& a, const Floats<n>& b, const Floats<n>& g) {
  Floats<n> difference, near;
  for (int k = 0; k < Floats<n>::kVectors; ++k) {
    difference.v[k] = hn::Sub(b.v[k], a.v[k]);
    near.v[k] = IfSignThenElse(typename Floats<n>::Tag(), g.v[k], b.v[k], a.v[k]);
  }
  return Fused(g, difference, near);
}

// Lower and upper half.
template <int n>
HWY_INLINE Floats<n / 2> Lower(const Floats<n>& v) {
  Floats<n / 2> h;
  if constexpr (Floats<n>::kVectors == 1) {
    h.v[0] = hn::LowerHalf(v.v[0]);
  } else {
    for (int k = 0; k < Floats<n / 2>::kVectors; ++k) h.v[k] = v.v[k];
  }
  return h;
}
template <int n>
HWY_INLINE Floats<n / 2> Upper(const Floats<n>& v) {
  Floats<n / 2> h;
  if constexpr (Floats<n>::kVectors == 1) {
    h.v[0] = hn::UpperHalf(typename Floats<n / 2>::Tag(), v.v[0]);
    return h;
  }
  if constexpr (Floats<n>::kVectors > 1) {
    for (int k = 0; k < Floats<n / 2>::kVectors; ++k) h.v[k] = v.v[k + Floats<n / 2>::kVectors];
  }
  return h;
}

// Quads side by side: quad(first), quad(first + 4), ... fill a vector.
template <class Q>
HWY_INLINE V VectorOfQuads(const Q& quad, int first) {
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
}
// The same from memory, quad k at p(k).
template <class P>
HWY_INLINE V LoadQuads(const P& p, int first) {
  return VectorOfQuads([&](int k) HWY_ATTR { return hn::LoadU(hn::CappedTag<float, 4>(), p(k)); }, first);
}

// Pairs of kQuarter pixels: their first texels side by side, and their second ones.
template <class P>
HWY_INLINE void SplitPairs(const P* pairs, V& first, V& second) {
  const D d;
  (void)d;
  if constexpr (kLanes == 16) {
    const V even = hn::Combine(d, pairs[2].v[0], pairs[0].v[0]),
            odd = hn::Combine(d, pairs[3].v[0], pairs[1].v[0]);
    first = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(odd), even);
    second = hn::OddEvenBlocks(odd, hn::SwapAdjacentBlocks(even));
    return;
  } else if constexpr (kLanes == 8) {
    first = hn::ConcatLowerLower(d, pairs[1].v[0], pairs[0].v[0]);
    second = hn::ConcatUpperUpper(d, pairs[1].v[0], pairs[0].v[0]);
    return;
  }
  if constexpr (kLanes <= 4) first = Lower(pairs[0]).v[0], second = Upper(pairs[0]).v[0];
}

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

// Two adjacent floats from kLanes places: a has the first, b the second, in the order of the places.
template <class P>
HWY_INLINE void LoadPairs(const P& p, V& a, V& b) {
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
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
