// Samples of integer images as codes in double, and exact results as floats that round to the right code.
#if defined(TESSERA_OPS_FILTER_CODES_CODES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_CODES_CODES_INL_H_
#undef TESSERA_OPS_FILTER_CODES_CODES_INL_H_
#else
#define TESSERA_OPS_FILTER_CODES_CODES_INL_H_
#endif

#include <hwy/highway.h>

#include "ops/filter/codes/codes.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using DD = hn::CappedTag<double, 8>;
using DF = hn::Rebind<float, DD>;
using VD = hn::Vec<DD>;
constexpr int kDoubles = static_cast<int>(hn::MaxLanes(DD()));

// An exact result in codes, moved from a tie to the side of the code that it rounds to, half to even, by more
// than a float's rounding: no more than its last two bits.
template <class D>
HWY_INLINE hn::Vec<D> Settled(D d, hn::Vec<D> exact) {
  const auto half = hn::Set(d, 0.5);
  const auto up = hn::Add(exact, half);
  const auto even = hn::Mul(hn::Floor(hn::Mul(hn::Add(up, hn::Set(d, kTieOfCodes)), half)), hn::Set(d, 2.0));
  const auto tie = hn::Lt(hn::Abs(hn::Sub(up, hn::Round(up))), hn::Set(d, kTieOfCodes));
  const auto code = hn::IfThenElse(tie, even, hn::Floor(up));
  const auto reach = hn::Sub(half, hn::Mul(hn::Add(hn::Abs(code), half), hn::Set(d, 0x1.2p-24)));
  return hn::Min(hn::Max(exact, hn::Sub(code, reach)), hn::Add(code, reach));
}

// ---- Bytes, and words under small weights, in floats ----

using DB = hn::CappedTag<float, 16>;
using VB = hn::Vec<DB>;
constexpr int kByteLanes = static_cast<int>(hn::MaxLanes(DB()));

// The mean of a sum of codes times whole weights over a whole divisor, settled, as a sample. The sum and the
// divisor together are at most 2^24, so that all products are exact.
HWY_INLINE VB SettledSample(VB sum, VB divisor, float largest = 255) {
  const DB d;
  // Moved so far from a tie, relatively, a result divided by the largest code and multiplied by it again
  // stays on its side.
  const auto aside = hn::Set(d, 0x1.8p-23f), half = hn::Set(d, 0.5f);
  const VB mean = hn::Div(sum, divisor), nearest = hn::Round(mean);
  const VB rest = hn::NegMulAdd(nearest, divisor, sum), twice = hn::Add(hn::Abs(rest), hn::Abs(rest));
  const VB halved = hn::Mul(nearest, half);
  const auto odd = hn::Ne(halved, hn::Round(halved));
  const auto off = hn::Or(hn::Gt(twice, divisor), hn::And(hn::Eq(twice, divisor), odd));
  const VB code = hn::IfThenElse(off, hn::Add(nearest, hn::CopySign(hn::Set(d, 1.0f), rest)), nearest);
  const VB reach = hn::NegMulAdd(hn::Add(hn::Abs(code), half), aside, half);
  return hn::Div(hn::Min(hn::Max(mean, hn::Sub(code, reach)), hn::Add(code, reach)), hn::Set(d, largest));
}

// As floats; every NaN as the same one.
template <class D>
HWY_INLINE hn::Vec<hn::Rebind<float, D>> ToFloats(D, hn::Vec<D> v) {
  const hn::Rebind<float, D> f;
  const auto narrow = hn::DemoteTo(f, v);
  return hn::IfThenElse(hn::IsNaN(narrow), hn::NaN(f), narrow);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
