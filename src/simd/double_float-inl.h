// Logarithms and powers of two in double-float arithmetic: a number as the unevaluated sum of two floats, so
// that the lanes of a float vector keep their width. Needs fused multiply-add; gives the same bits on every
// target that has it. Errors of what is rounded to float in the end: 0.53 ULP.
#if defined(TESSERA_SIMD_DOUBLE_FLOAT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_DOUBLE_FLOAT_INL_H_
#undef TESSERA_SIMD_DOUBLE_FLOAT_INL_H_
#else
#define TESSERA_SIMD_DOUBLE_FLOAT_INL_H_
#endif

#include <hwy/highway.h>

#include <bit>
#include <cstdint>

#include "simd/point-inl.h"

// Whether this target has it: fused multiply-add, and vectors that hold half a table of sixteen floats.
#undef TESSERA_DOUBLE_FLOAT
#if HWY_NATIVE_FMA && HWY_MAX_BYTES >= 32
#define TESSERA_DOUBLE_FLOAT 1
#else
#define TESSERA_DOUBLE_FLOAT 0
#endif

#if TESSERA_DOUBLE_FLOAT
HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// hi + lo. Sums and products leave |lo| at about an ULP of hi; logarithms and powers up to 2^-5 of it.
struct DoubleFloat {
  V hi, lo;
};
// A constant, split.
struct SplitDouble {
  float hi = 0, lo = 0;
  SplitDouble() = default;
  explicit SplitDouble(double v) : hi(static_cast<float>(v)), lo(static_cast<float>(v - hi)) {}
};

HWY_INLINE V SetF(float v) { return hn::Set(D(), v); }

// a + b exactly, Knuth; and where |a| >= |b| or a = 0, Dekker.
HWY_INLINE DoubleFloat TwoSum(V a, V b) {
  const V s = hn::Add(a, b), bb = hn::Sub(s, a);
  return {s, hn::Add(hn::Sub(a, hn::Sub(s, bb)), hn::Sub(b, bb))};
}
HWY_INLINE DoubleFloat FastTwoSum(V a, V b) {
  const V s = hn::Add(a, b);
  return {s, hn::Sub(b, hn::Sub(s, a))};
}
// x * c.
HWY_INLINE DoubleFloat Times(V x, const SplitDouble& c) {
  const V p = hn::Mul(x, SetF(c.hi));
  return {p, hn::MulAdd(x, SetF(c.lo), hn::MulSub(x, SetF(c.hi), p))};
}
HWY_INLINE DoubleFloat Times(const DoubleFloat& x, const SplitDouble& c) {
  const V p = hn::Mul(x.hi, SetF(c.hi));
  const V rest = hn::MulAdd(x.hi, SetF(c.lo), hn::MulSub(x.hi, SetF(c.hi), p));
  return {p, hn::MulAdd(x.lo, SetF(c.hi), rest)};
}
// x + c.
HWY_INLINE DoubleFloat Plus(const DoubleFloat& x, const SplitDouble& c) {
  const DoubleFloat s = TwoSum(x.hi, SetF(c.hi));
  return {s.hi, hn::Add(s.lo, hn::Add(x.lo, SetF(c.lo)))};
}
HWY_INLINE V ToFloat(const DoubleFloat& x) { return hn::Add(x.hi, x.lo); }

// Entry `index` (0 to 15) of a table of sixteen.
template <class T>
HWY_INLINE hn::Vec<hn::Rebind<T, D>> Of16(const T* table, VI index) {
  const hn::Rebind<T, D> d;
  if constexpr (hn::MaxLanes(D()) == 16) {
    return hn::TableLookupLanes(hn::Load(d, table), hn::IndicesFromVec(d, index));
  } else {
    const DI di;
    const auto within = hn::IndicesFromVec(d, hn::And(index, hn::Set(di, 7)));
    const auto upper = hn::RebindMask(d, hn::Gt(index, hn::Set(di, 7)));
    return hn::IfThenElse(upper, hn::TableLookupLanes(hn::Load(d, table + 8), within),
                          hn::TableLookupLanes(hn::Load(d, table), within));
  }
}

constexpr double kLog2OfE = 1.4426950408889634074;

// Sixteenths of an octave beginning at 1 - 1/64: near 1 / middle, and -log2 of that as a multiple of 2^-15
// and the rest.
// clang-format off
alignas(64) inline constexpr float kNearInverse[16] = {
    0x1p+0f, 0x1.e1e1ep-1f, 0x1.c71c8p-1f, 0x1.af286p-1f, 0x1.9999ap-1f, 0x1.86186p-1f, 0x1.745d2p-1f, 0x1.642c8p-1f,
    0x1.55556p-1f, 0x1.47ae2p-1f, 0x1.3b13cp-1f, 0x1.2f684p-1f, 0x1.24924p-1f, 0x1.1a7bap-1f, 0x1.11112p-1f, 0x1.0842p-1f};
alignas(64) inline constexpr float kLogHigh[16] = {
    0, 0x1.664p-4f, 0x1.5cp-3f, 0x1.fbcp-3f, 0x1.49a8p-2f, 0x1.91b8p-2f, 0x1.d678p-2f, 0x1.0c1p-1f,
    0x1.2b8p-1f, 0x1.49a8p-1f, 0x1.66ap-1f, 0x1.828p-1f, 0x1.9d5cp-1f, 0x1.b748p-1f, 0x1.d054p-1f, 0x1.e88cp-1f};
alignas(64) inline constexpr float kLogLow[16] = {
    0, -4.5166459e-07f, 2.43851196e-06f, 3.31069555e-06f, -2.18071841e-06f, 1.40419734e-05f,
    -1.10359824e-05f, 2.72970988e-06f, 8.75290709e-07f, -4.44742818e-06f, -7.66879452e-07f, 5.54957705e-06f,
    1.30806911e-05f, 9.02979991e-06f, -1.47741014e-06f, 4.57101441e-06f};
// clang-format on

// log2 of x; x is normal, positive, finite. Absolute error 2^-35, relative 2^-29.
HWY_INLINE DoubleFloat Log2Of(V x) {
  const D d;
  const DI di;
  const VI t = hn::Sub(hn::BitCast(di, x), hn::Set(di, 0x3f800000 - (1 << 18)));
  const VI k = hn::ShiftRight<23>(t);
  const VI exponent = hn::ShiftLeft<23>(k);
  const VI j = hn::And(hn::ShiftRight<19>(t), hn::Set(di, 15));
  const V m = hn::BitCast(d, hn::Sub(hn::BitCast(di, x), exponent));
  const V c = Of16(kNearInverse, j);
  // m c - 1 = r + rest, r exactly.
  const V p = hn::Mul(m, c);
  const V r = hn::Sub(p, SetF(1));
  const V rest = hn::MulSub(m, c, p);
  const V base = hn::Add(hn::ConvertTo(d, k), Of16(kLogHigh, j));  // exact
  V q = hn::MulAdd(r, SetF(-0.239710685f), SetF(0.288774065f));
  q = hn::MulAdd(r, q, SetF(-0.360674363f));
  q = hn::MulAdd(r, q, SetF(0.480898293f));
  q = hn::MulAdd(r, q, SetF(-0.72134752f));
  V tail = hn::MulAdd(hn::Mul(r, r), q, Of16(kLogLow, j));
  constexpr float kHigh = static_cast<float>(kLog2OfE), kRest = static_cast<float>(kLog2OfE - kHigh);
  const V line = hn::Mul(r, SetF(kHigh));
  const V line_rest = hn::MulAdd(r, SetF(kRest), hn::MulSub(r, SetF(kHigh), line));
  const V slope = hn::NegMulAdd(r, SetF(kHigh), SetF(kHigh));  // of the logarithm at r
  tail = hn::Add(hn::MulAdd(rest, slope, line_rest), tail);
  const DoubleFloat sum = FastTwoSum(base, line);
  return {sum.hi, hn::Add(sum.lo, tail)};
}

// scale 2^(j/16): its bits less j in the exponent's place, and what float lacks, relatively.
struct Exp2Table {
  alignas(64) int32_t bits[16];
  alignas(64) float rest[16];
  explicit Exp2Table(double scale = 1) {
    constexpr double kPowers[16] = {1.0,
                                    1.0442737824274138,
                                    1.0905077326652577,
                                    1.1387886347566916,
                                    1.189207115002721,
                                    1.241857812073484,
                                    1.2968395546510096,
                                    1.3542555469368927,
                                    1.4142135623730951,
                                    1.4768261459394993,
                                    1.5422108254079407,
                                    1.6104903319492543,
                                    1.681792830507429,
                                    1.7562521603732995,
                                    1.8340080864093424,
                                    1.9152065613971474};
    for (int j = 0; j < 16; ++j) {
      const double exact = scale * kPowers[j];
      const auto rounded = static_cast<float>(exact);
      bits[j] = std::bit_cast<int32_t>(rounded) - (j << 19);
      rest[j] = static_cast<float>((exact - rounded) / rounded);
    }
  }
};

// scale 2^t as hi (1 + lo), for results that are normal.
HWY_INLINE DoubleFloat Exp2Of(const DoubleFloat& t, const Exp2Table& table) {
  const D d;
  const DI di;
  const V magic = SetF(0x1.8p19f);  // adding it rounds to sixteenths, held in the lowest bits
  const V shifted = hn::Add(t.hi, magic);
  const V f = hn::Add(hn::Sub(t.hi, hn::Sub(shifted, magic)), t.lo);
  const VI n = hn::BitCast(di, shifted);
  const VI j = hn::And(n, hn::Set(di, 15));
  const V size = hn::BitCast(d, hn::Add(Of16(table.bits, j), hn::ShiftLeft<19>(n)));
  V g = hn::MulAdd(f, SetF(0.00961827953f), SetF(0.0555054108f));
  g = hn::MulAdd(f, g, SetF(0.240226507f));
  g = hn::MulAdd(f, g, SetF(0.693147182f));
  return {size, hn::MulAdd(f, g, Of16(table.rest, j))};
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // TESSERA_DOUBLE_FLOAT

#endif  // per-target guard
