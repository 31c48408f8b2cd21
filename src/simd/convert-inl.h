// Exact conversions between float vectors and stored samples: unorm8, unorm16, half. Same bits on every
// target.
#if defined(TESSERA_SIMD_CONVERT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_CONVERT_INL_H_
#undef TESSERA_SIMD_CONVERT_INL_H_
#else
#define TESSERA_SIMD_CONVERT_INL_H_
#endif

#include <hwy/highway.h>

#include "simd/point-inl.h"

// Targets whose processors convert half in hardware (F16C); the others use integer code with the same
// results.
#undef TESSERA_NATIVE_F16
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2 && !defined(HWY_DISABLE_F16C)
#define TESSERA_NATIVE_F16 1
#else
#define TESSERA_NATIVE_F16 0
#endif

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// Lanes of D, stored narrower.
using DU8 = hn::Rebind<uint8_t, D>;
using DU16 = hn::Rebind<uint16_t, D>;
using DF16 = hn::Rebind<hwy::float16_t, D>;
using VU16 = hn::Vec<DU16>;

// code / 255 and code / 65535, correctly rounded: 1/255 = 2^-8 + 2^-16 + 2^-24 + ..., of which the second
// product holds enough to decide ties (powers of two are one at 2^-24). The first product is exact, so a
// fused and a separate multiply-add give equal bits.
HWY_INLINE V FromUnorm8(V code) {
  const D d;
  return hn::MulAdd(code, hn::Set(d, 0x1.01p-8f), hn::Mul(code, hn::Set(d, 0x1.0101p-24f)));
}
HWY_INLINE V FromUnorm16(V code) {
  const D d;
  return hn::MulAdd(code, hn::Set(d, 0x1p-16f), hn::Mul(code, hn::Set(d, 0x1.0001p-32f)));
}

// The integer nearest to a float in [0, 65535], ties to even, in the low half of each lane: adding 2^23
// leaves it there, below the bits kCodeBits. Cheaper than Highway's conversions, which mend overflows that
// cannot happen here.
inline constexpr uint32_t kCodeBits = 0x4B000000u;
HWY_INLINE VU NearestCodeBits(V v) { return hn::BitCast(DU(), hn::Add(v, hn::Set(D(), 0x1p23f))); }
HWY_INLINE VI CodeOfBits(VU bits) { return hn::BitCast(DI(), hn::And(bits, hn::Set(DU(), 0xFFFFu))); }

// The integer nearest to v * (kScale - 1), ties to even of the exact product, for v clamped to [0, 1], NaN to
// 0. kScale is 256 or 65536. A fused multiply-add to 2^23 rounds that product once, to the integer; without
// one kScale * v - v is computed with its rounding error, which decides apparent ties.
template <int kScale>
HWY_INLINE VU ToUnormBits(V v) {
  const D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  v = ClampHigh(ClampLow(v, zero), one);
#if HWY_NATIVE_FMA
  return hn::BitCast(DU(), hn::MulAdd(v, hn::Set(d, static_cast<float>(kScale - 1)), hn::Set(d, 0x1p23f)));
#else
  const V half = hn::Set(d, 0.5f);
  const V big = hn::Mul(v, hn::Set(d, static_cast<float>(kScale)));
  const V product = hn::Sub(big, v);
  const V error = hn::Sub(hn::Sub(big, product), v);  // product + error == (kScale - 1) * v exactly
  const V shift = hn::Set(d, 0x1p23f);
  const V nearest = hn::Sub(hn::Add(product, shift), shift);
  const V rest = hn::Sub(product, nearest);
  const auto up = hn::And(hn::Eq(rest, half), hn::Gt(error, zero));
  const auto down = hn::And(hn::Eq(rest, hn::Neg(half)), hn::Lt(error, zero));
  V code = hn::Add(nearest, hn::IfThenElseZero(up, one));
  code = hn::Sub(code, hn::IfThenElseZero(down, one));
  return NearestCodeBits(code);
#endif
}
template <int kScale>
HWY_INLINE VI ToUnorm(V v) {
  return CodeOfBits(ToUnormBits<kScale>(v));
}

// Rounds a value already scaled to codes (clamped to [0, max], NaN to 0), ties to even.
HWY_INLINE VU ToCodeBits(V v, float max) {
  const D d;
  return NearestCodeBits(ClampHigh(ClampLow(v, hn::Zero(d)), hn::Set(d, max)));
}
HWY_INLINE VI ToCode(V v, float max) { return CodeOfBits(ToCodeBits(v, max)); }

// binary16 bits to float and back, as the hardware does: round to nearest even, infinities kept, signalling
// NaN made quiet, the payload's upper bits kept, subnormals exact.
HWY_INLINE V FloatFromHalf(VU16 bits) {
#if TESSERA_NATIVE_F16
  return hn::PromoteTo(D(), hn::BitCast(DF16(), bits));
#else
  const D d;
  const DU du;
  const VU h = hn::PromoteTo(du, bits);
  const VU exponent = hn::Set(du, 0x7C00u << 13);
  VU o = hn::ShiftLeft<13>(hn::And(h, hn::Set(du, 0x7FFFu)));
  const VU e = hn::And(o, exponent);
  const auto special = hn::Eq(e, exponent), tiny = hn::Eq(e, hn::Zero(du));
  const auto nan = hn::And(special, hn::Ne(o, exponent));
  o = hn::Add(o, hn::Set(du, (127u - 15u) << 23));
  o = hn::Add(o, hn::IfThenElseZero(special, hn::Set(du, (128u - 16u) << 23)));
  o = hn::Or(o, hn::IfThenElseZero(nan, hn::Set(du, 0x00400000u)));
  const V subnormal = hn::Sub(hn::BitCast(d, hn::Add(o, hn::Set(du, 1u << 23))), hn::Set(d, 0x1p-14f));
  const VU sign = hn::ShiftLeft<16>(hn::And(h, hn::Set(du, 0x8000u)));
  return hn::BitCast(d, hn::Or(hn::IfThenElse(tiny, hn::BitCast(du, subnormal), o), sign));
#endif
}
HWY_INLINE VU16 HalfFromFloat(V v) {
#if TESSERA_NATIVE_F16
  return hn::BitCast(DU16(), hn::DemoteTo(DF16(), v));
#else
  const D d;
  const DU du;
  const DI di;
  const VU bits = hn::BitCast(du, v);
  const VU sign = hn::And(bits, hn::Set(du, 0x80000000u));
  const VU u = hn::Xor(bits, sign);
  // Non-negative as signed integers, so signed comparisons serve.
  const VI s = hn::BitCast(di, u);
  const auto nan = hn::RebindMask(du, hn::Gt(s, hn::Set(di, 0x7F800000)));
  const auto infinite = hn::RebindMask(du, hn::Gt(s, hn::Set(di, (143 << 23) - 1)));
  const auto tiny = hn::RebindMask(du, hn::Lt(s, hn::Set(di, 113 << 23)));
  const VU nan_bits = hn::Or(hn::Set(du, 0x7E00u), hn::And(hn::ShiftRight<13>(u), hn::Set(du, 0x3FFu)));
  // Adding 0.5 aligns the ten bits of a subnormal half at the bottom of the float, rounded to nearest even.
  const V magic = hn::Set(d, 0.5f);
  const VU subnormal = hn::Sub(hn::BitCast(du, hn::Add(hn::BitCast(d, u), magic)), hn::BitCast(du, magic));
  const VU odd = hn::And(hn::ShiftRight<13>(u), hn::Set(du, 1u));
  VU o = hn::ShiftRight<13>(hn::Add(hn::Sub(u, hn::Set(du, (112u << 23) - 0xFFFu)), odd));
  o = hn::IfThenElse(tiny, subnormal, o);
  o = hn::IfThenElse(infinite, hn::Set(du, 0x7C00u), o);
  o = hn::IfThenElse(nan, nan_bits, o);
  o = hn::Or(o, hn::ShiftRight<16>(sign));
  return hn::DemoteTo(DU16(), hn::BitCast(di, o));
#endif
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
