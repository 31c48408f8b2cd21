// Random numbers of lattice points in vectors: Tessera's hash, its gradients, and the fades between points.
//
// hash(c, seed) = Mix(c0 * kAxis[0] ^ c1 * kAxis[1] ^ ... ^ seed), Mix(h) = ((h * m1) ^ ((h * m1) >> 15)) *
// m2, on 32-bit unsigned integers; the upper bits are the good ones.
#if defined(TESSERA_SIMD_LATTICE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_LATTICE_INL_H_
#undef TESSERA_SIMD_LATTICE_INL_H_
#else
#define TESSERA_SIMD_LATTICE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "simd/lattice.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

using simd::kAxis;

// What is left of the product a b after its whole part, rounded once: on targets without fused multiply-add
// from the halves of both (Dekker 1971), where these are no larger than a float.
HWY_INLINE V RestOfProduct(V a, V b, V whole) {
#if HWY_NATIVE_FMA
  return hn::MulSub(a, b, whole);
#else
  const D d;
  const auto upper = [&d](V v) HWY_ATTR {
    const V big = hn::Mul(v, hn::Set(d, 4097.0f));
    return hn::Sub(big, hn::Sub(big, v));
  };
  const V product = hn::Mul(a, b), a0 = upper(a), b0 = upper(b), a1 = hn::Sub(a, a0), b1 = hn::Sub(b, b0);
  V error = hn::Sub(hn::Mul(a0, b0), product);
  error = hn::Add(hn::Add(error, hn::Mul(a0, b1)), hn::Mul(a1, b0));
  error = hn::Add(error, hn::Mul(a1, b1));
  const V rest = hn::Sub(product, whole);
  const auto moderate =
      hn::Lt(hn::Max(hn::Abs(product), hn::Max(hn::Abs(a), hn::Abs(b))), hn::Set(d, 0x1p100f));
  return hn::IfThenElse(moderate, hn::Add(rest, error), rest);
#endif
}

HWY_INLINE VU LatticeMix(VU h) {
  const DU du;
  h = hn::Mul(h, hn::Set(du, kMix1));
  h = hn::Xor(h, hn::ShiftRight<15>(h));
  return hn::Mul(h, hn::Set(du, kMix2));
}
// The k-th further number of a lattice point (k from 1).
HWY_INLINE VU LatticeNext(VU h, int k) {
  const DU du;
  h = hn::Add(hn::Xor(h, hn::ShiftRight<16>(h)), hn::Set(du, static_cast<uint32_t>(k) * kNext));
  return LatticeMix(h);
}
// Uniform in [-1, 1] from all bits, and in [0, 1) from the upper 24.
HWY_INLINE V SignedUnit(VU h) {
  const D d;
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(DI(), h)), hn::Set(d, 0x1p-31f));
}
HWY_INLINE V Unit(VU h) {
  const D d;
  return hn::Mul(hn::ConvertTo(d, hn::BitCast(DI(), hn::ShiftRight<8>(h))), hn::Set(d, 0x1p-24f));
}
// 1 with the sign of bit `kBit`.
template <int kBit>
HWY_INLINE V SignOfBit(VU h) {
  const D d;
  const DU du;
  const VU sign = hn::And(hn::ShiftLeft<31 - kBit>(h), hn::Set(du, 0x80000000u));
  return hn::BitCast(d, hn::Or(sign, hn::BitCast(du, hn::Set(d, 1.0f))));
}

// One of 12 by the upper 16 bits of a lattice point's number, in the upper 16 bits.
HWY_INLINE VU UpperLatticeEdge(VU h) {
  const DU du;
  const hn::Repartition<uint16_t, DU> du16;
  return hn::BitCast(du, hn::MulHigh(hn::BitCast(du16, h), hn::BitCast(du16, hn::Set(du, 12u << 16))));
}
HWY_INLINE VU LatticeEdge(VU h) { return hn::ShiftRight<16>(UpperLatticeEdge(h)); }

#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
// The gradient that UpperLatticeEdge() chose: coordinate e / 4 is 0, bits 0 and 1 of e the other two's signs.
HWY_INLINE void EdgeGradient(VU edge, V* g) {
  // Of 1.0f and -1.0f the lower half is 0: words are looked up, by the edges where they are, in the upper
  // ones.
  alignas(64) static constexpr uint16_t kX[32] = {0,      0,      0,      0,      0x3f80, 0xbf80,
                                                  0x3f80, 0xbf80, 0x3f80, 0xbf80, 0x3f80, 0xbf80};
  alignas(64) static constexpr uint16_t kY[32] = {0x3f80, 0xbf80, 0x3f80, 0xbf80, 0,      0,
                                                  0,      0,      0x3f80, 0x3f80, 0xbf80, 0xbf80};
  alignas(64) static constexpr uint16_t kZ[32] = {0x3f80, 0x3f80, 0xbf80, 0xbf80, 0x3f80, 0x3f80,
                                                  0xbf80, 0xbf80, 0,      0,      0,      0};
  const auto of = [&](const uint16_t* table) HWY_ATTR {
    return V{
        _mm512_castsi512_ps(_mm512_maskz_permutexvar_epi16(0xaaaaaaaau, edge.raw, _mm512_load_si512(table)))};
  };
  g[0] = of(kX);
  g[1] = of(kY);
  g[2] = of(kZ);
}
#endif

// Gradient of a lattice point. 1-D: slope in [-1,1]. 2-D: unit vector of any direction. 3-D: one of the 12
// edges of the cube, length sqrt 2. 4-D: one of the 32 edges of the hypercube's kind (one coordinate 0, the
// others +-1).
template <int kDims>
HWY_INLINE void LatticeGradient(VU h, V* g) {
  const D d;
  const DU du;
  if constexpr (kDims == 1) {
    g[0] = SignedUnit(h);
  } else if constexpr (kDims == 2) {
    // The upper two bits choose a quarter turn, the others an angle within +-45 degrees of it.
    const V r =
        hn::Mul(hn::ConvertTo(d, hn::BitCast(DI(), hn::ShiftLeft<2>(h))), hn::Set(d, 0x1.921fb6p-32f));
    const V r2 = hn::Mul(r, r);
    V sine = hn::MulAdd(r2, hn::Set(d, 2.7557319e-6f), hn::Set(d, -1.9841270e-4f));
    sine = hn::MulAdd(r2, sine, hn::Set(d, 8.3333333e-3f));
    sine = hn::MulAdd(r2, sine, hn::Set(d, -1.6666667e-1f));
    sine = hn::MulAdd(hn::Mul(r, r2), sine, r);
    V cosine = hn::MulAdd(r2, hn::Set(d, 2.4801587e-5f), hn::Set(d, -1.3888889e-3f));
    cosine = hn::MulAdd(r2, cosine, hn::Set(d, 4.1666667e-2f));
    cosine = hn::MulAdd(r2, cosine, hn::Set(d, -0.5f));
    cosine = hn::MulAdd(r2, cosine, hn::Set(d, 1.0f));
    const auto odd =
        hn::MaskFromVec(hn::BitCast(d, hn::BroadcastSignBit(hn::BitCast(DI(), hn::ShiftLeft<1>(h)))));
    const VU top = hn::Set(du, 0x80000000u);
    const VU upper = hn::And(h, top), lower = hn::And(hn::ShiftLeft<1>(h), top);
    const V x = hn::IfThenElse(odd, sine, cosine), y = hn::IfThenElse(odd, cosine, sine);
    // Quarters 0..3: (c, s), (-s, c), (-c, -s), (s, -c).
    g[0] = hn::Xor(x, hn::BitCast(d, hn::Xor(upper, lower)));
    g[1] = hn::Xor(y, hn::BitCast(d, upper));
  } else if constexpr (kDims == 3) {
    // Edge e in 0..11: coordinate e / 4 is 0, bits 0 and 1 are the other two's signs.
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
    EdgeGradient(UpperLatticeEdge(h), g);
#else
    const VU edge = LatticeEdge(h);
    const V s1 = SignOfBit<0>(edge), s2 = SignOfBit<1>(edge);
    const DI di;
    const VI e = hn::BitCast(di, edge);
    const auto first = hn::RebindMask(d, hn::Gt(hn::Set(di, 4), e));
    const auto last = hn::RebindMask(d, hn::Gt(e, hn::Set(di, 7)));
    g[0] = hn::IfThenZeroElse(first, s1);
    g[1] = hn::IfThenElse(first, s1, hn::IfThenElseZero(last, s2));
    g[2] = hn::IfThenZeroElse(last, s2);
#endif
  } else {
    const VU zero = hn::ShiftRight<30>(h);
    const auto at = [&](uint32_t i) HWY_ATTR { return hn::RebindMask(d, hn::Eq(zero, hn::Set(du, i))); };
    g[0] = hn::IfThenZeroElse(at(0), SignOfBit<29>(h));
    g[1] = hn::IfThenZeroElse(at(1), SignOfBit<28>(h));
    g[2] = hn::IfThenZeroElse(at(2), SignOfBit<27>(h));
    g[3] = hn::IfThenZeroElse(at(3), SignOfBit<26>(h));
  }
}

// A gradient times the offset from its point.
template <int kDims>
HWY_INLINE V Projection(const V* gradient, const V* offset) {
  V dot = hn::Mul(gradient[kDims - 1], offset[kDims - 1]);
#pragma GCC unroll 16
  for (int k = kDims - 2; k >= 0; --k) dot = hn::MulAdd(gradient[k], offset[k], dot);
  return dot;
}
// The same of a lattice point; the sign of a zero is anything.
template <int kDims>
HWY_INLINE V LatticeProjection(VU h, const V* offset) {
#if HWY_TARGET > HWY_AVX3 || !HWY_ARCH_X86
  if constexpr (kDims == 3) {
    // Without look-ups in registers it is cheaper to choose two of the offsets, and turn them, than to make
    // ones and zeros to multiply all three by. The sum is rounded once either way.
    const D d;
    const DU du;
    const DI di;
    const VU edge = UpperLatticeEdge(h), top = hn::Set(du, 0x80000000u);
    const VI e = hn::BitCast(di, edge);
    const auto first = hn::RebindMask(d, hn::Gt(hn::Set(di, 4 << 16), e));
    const auto last = hn::RebindMask(d, hn::Gt(e, hn::Set(di, 7 << 16)));
    const V a = hn::IfThenElse(first, offset[1], offset[0]), b = hn::IfThenElse(last, offset[1], offset[2]);
    return hn::Add(hn::Xor(a, hn::BitCast(d, hn::ShiftLeft<15>(edge))),
                   hn::Xor(b, hn::BitCast(d, hn::And(hn::ShiftLeft<14>(edge), top))));
  }
#endif
  V g[kDims];
  LatticeGradient<kDims>(h, g);
  return Projection<kDims>(g, offset);
}

// The weight of the upper neighbour at fraction f, and its derivative. kind: 0 quintic, 1 cubic, 2 linear.
HWY_INLINE V FadeWeight(V f, int kind) {
  const D d;
  if (kind == 2) return f;
  // Odd polynomials around the middle: no cancellation near 1, exact at 0, 1/2 and 1.
  const V half = hn::Set(d, 0.5f), c = hn::Sub(f, half), c2 = hn::Mul(c, c);
  if (kind == 1) return hn::MulAdd(c, hn::MulAdd(c2, hn::Set(d, -2.0f), hn::Set(d, 1.5f)), half);
  const V p = hn::MulAdd(c2, hn::MulAdd(c2, hn::Set(d, 6.0f), hn::Set(d, -5.0f)), hn::Set(d, 1.875f));
  return hn::MulAdd(c, p, half);
}
HWY_INLINE V FadeSlope(V f, int kind) {
  const D d;
  if (kind == 2) return hn::Set(d, 1.0f);
  const V g = hn::Mul(f, hn::Sub(hn::Set(d, 1.0f), f));
  if (kind == 1) return hn::Mul(hn::Set(d, 6.0f), g);
  return hn::Mul(hn::Set(d, 30.0f), hn::Mul(g, g));
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
