// Bytes are whole numbers below 2^8: floats hold their sums exactly where weights are small whole numbers (of
// 16-bit codes where they are very small), and come near to a tie so rarely elsewhere that doubles are wanted
// for one result in thousands.
#include "ops/filter/codes/bytes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/codes/bytes.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/codes/codes-inl.h"
#include "simd/rows-inl.h"

#ifndef TESSERA_OPS_FILTER_CODES_BYTES_CC_
#define TESSERA_OPS_FILTER_CODES_BYTES_CC_
namespace tessera::ops {
constexpr float kLargestByte = 255, kLargestWord = 65535;
}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_CODES_BYTES_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;

// The codes of `count` samples, what is none, to within `near`, as 0, and zeros up to `padded`, a multiple of
// 16; whether all are codes. Null: none are kept.
bool ToCodes(float largest_code, float near, const float* HWY_RESTRICT samples, int count, int padded,
             float* HWY_RESTRICT codes) {
  const DB d;
  const auto largest = hn::Set(d, largest_code), zero = hn::Zero(d);
  auto all = hn::Eq(zero, zero);
  const auto code_of = [&](auto sample, auto& whole) HWY_ATTR {
    const auto code = hn::Mul(sample, largest), nearest = hn::Round(code);
    whole = hn::And(hn::Lt(hn::Abs(hn::Sub(code, nearest)), hn::Set(d, near)),
                    hn::And(hn::Ge(nearest, zero), hn::Le(nearest, largest)));
    return hn::IfThenElseZero(whole, nearest);
  };
  int i = 0;
  for (; i + kByteLanes <= count; i += kByteLanes) {
    auto whole = all;
    const auto code = code_of(hn::LoadU(d, samples + i), whole);
    if (codes != nullptr) hn::StoreU(code, d, codes + i);
    all = hn::And(all, whole);
  }
  HWY_ALIGN float tail[kByteLanes] = {};
  std::copy(samples + i, samples + count, tail);
  for (bool last = true; i < padded; i += kByteLanes, last = false) {
    auto whole = all;
    const auto code = last ? code_of(hn::Load(d, tail), whole) : zero;
    if (codes != nullptr) hn::StoreU(code, d, codes + i);
    if (last) all = hn::And(all, whole);
  }
  return hn::AllTrue(d, all);
}

template <class F>
HWY_INLINE void ForVectors(float* row, int count, const F& f) {
  const DB d;
  s::StoreRow(d, count, row, [&](int i) HWY_ATTR { return f(s::LoadPart(d, row + i, count - i), i); });
}

// Exact sums, whole numbers, over the divisor.
void SettleWhole(float divisor, float largest, float* row, int count) {
  const auto over = hn::Set(DB(), divisor);
  ForVectors(row, count, [&](VB sum, int) HWY_ATTR { return SettledSample(sum, over, largest); });
}

// Indices of a row whose lanes of the vector at i are marked.
HWY_NOINLINE void AppendMarked(hn::Mask<DB> marked, int i, int count, Found& found) {
  HWY_ALIGN float marks[kByteLanes];
  hn::Store(hn::IfThenElseZero(marked, hn::Set(DB(), 1.0f)), DB(), marks);
  for (int k = 0; k < kByteLanes && i + k < count; ++k) {
    if (marks[k] != 0) found.Add(i + k);
  }
}

// Sums off by less than the band: appends those near a tie, whose samples stay sums.
void SettleSums(float band, float* row, int count, Found& found) {
  const DB d;
  const auto near = hn::Set(d, 0.5f - band);
  ForVectors(row, count, [&](auto sum, int i) HWY_ATTR {
    const auto nearest = hn::Round(sum);
    const auto close = hn::Ge(hn::Abs(hn::Sub(sum, nearest)), near);
    if (HWY_UNLIKELY(!hn::AllFalse(d, close))) AppendMarked(close, i, count, found);
    return hn::Div(sum, hn::Set(d, kLargestByte));
  });
}

// ---- From bytes to bytes ----

using DC = hn::Rebind<uint8_t, DB>;
using DI = hn::Rebind<int32_t, DB>;

// A vector beyond the last sample may be read, and there is room for it.
void CodesOfBytes(const uint8_t* HWY_RESTRICT bytes, int count, float* HWY_RESTRICT codes) {
  for (int i = 0; i < count; i += kByteLanes) {
    hn::StoreU(hn::ConvertTo(DB(), hn::PromoteTo(DI(), hn::LoadU(DC(), bytes + i))), DB(), codes + i);
  }
}

// Rounded half to even, where all of the range is: floats from 2^23 on are the whole numbers.
HWY_INLINE hn::Vec<DC> ToByte(VB code) {
  const DB d;
  const VB clamped = hn::Min(hn::Max(code, hn::Zero(d)), hn::Set(d, kLargestByte));
  const auto bits = hn::BitCast(DI(), hn::Add(clamped, hn::Set(d, 0x1p23f)));
  return hn::DemoteTo(DC(), hn::And(bits, hn::Set(DI(), 255)));
}

// f(vector, i) of a row of sums to bytes.
template <class F>
HWY_INLINE void ForBytes(const float* sums, int count, uint8_t* out, const F& f) {
  s::StoreRow(DC(), count, out,
              [&](int i) HWY_ATTR { return ToByte(f(s::LoadPart(DB(), sums + i, count - i), i)); });
}

// Exact sums over the divisor: a quotient of such numbers is rounded to no tie, so that one rounding to a
// whole number follows.
void BytesOfWhole(float divisor, const float* HWY_RESTRICT sums, int count, uint8_t* HWY_RESTRICT out) {
  const auto over = hn::Set(DB(), divisor);
  int exponent = 0;
  if (std::frexp(divisor, &exponent) == 0.5f) {
    const auto factor = hn::Set(DB(), 1 / divisor);
    ForBytes(sums, count, out, [&](VB sum, int) HWY_ATTR { return hn::Mul(sum, factor); });
  } else {
    ForBytes(sums, count, out, [&](VB sum, int) HWY_ATTR { return hn::Div(sum, over); });
  }
}

// Sums off by less than the band: appends those near a tie.
void BytesOfSums(float band, const float* HWY_RESTRICT sums, int count, uint8_t* HWY_RESTRICT out,
                 Found& found) {
  const DB d;
  const auto near = hn::Set(d, 0.5f - band);
  ForBytes(sums, count, out, [&](VB sum, int i) HWY_ATTR {
    const auto close = hn::Ge(hn::Abs(hn::Sub(sum, hn::Round(sum))), near);
    if (HWY_UNLIKELY(!hn::AllFalse(d, close))) AppendMarked(close, i, count, found);
    return sum;
  });
}

BytesFunctions BytesOfTarget() {
  return {ToCodes, SettleWhole, SettleSums, CodesOfBytes, BytesOfWhole, BytesOfSums};
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(BytesOfTarget);

}  // namespace

BytesWindow MakeBytesWindow(int width, int height, const std::vector<double>& weights, bool separable,
                            double error) {
  constexpr int kMostTaps = 2500;
  BytesWindow w;
  w.usable = width * height <= kMostTaps;
  w.band = static_cast<float>(std::min(0.5, (error + 0x1p-21) * kLargestByte));
  double least = 0, divisor = 0;
  for (const double v : weights) {
    if (v != 0 && (least == 0 || std::fabs(v) < least)) least = std::fabs(v);
  }
  // The least weight may be any of the first whole numbers.
  constexpr int kFirst = 16;
  constexpr double kSame = 1e-9, kLargestDivisor = 65536;
  std::vector<float> whole(weights.size());
  for (int k = 1; k <= kFirst && least > 0; ++k) {
    divisor = std::round(k / least);
    if (!(divisor >= 1 && divisor <= kLargestDivisor)) continue;
    double sum = 0;
    const bool all = std::all_of(weights.begin(), weights.end(), [&](double v) {
      sum += std::fabs(v * divisor);
      return std::fabs(v * divisor - std::round(v * divisor)) < kSame * std::max(1.0, std::fabs(v * divisor));
    });
    if (!all || kLargestByte * sum + divisor >= 0x1p24) continue;
    std::transform(weights.begin(), weights.end(), whole.begin(),
                   [&](double v) { return static_cast<float>(std::round(v * divisor)); });
    w.words = MakeWholeWindow(width, height, std::vector<double>(whole.begin(), whole.end()),
                              static_cast<int>(divisor));
    constexpr int kMostTapsOfWords = 25;  // sums in double by columns and rows are faster beyond
    if (width * height <= kMostTapsOfWords && kLargestWord * sum + divisor <= 0x1p24)
      w.divisor_of_words = static_cast<float>(divisor);
    if (!separable) w.divisor = static_cast<float>(divisor);
    if (w.divisor != 0 || w.divisor_of_words != 0)
      w.whole = MakeDirectWindow(width, height, std::move(whole));
    break;
  }
  return w;
}

BytesFunctions ChooseBytes() { return HWY_DYNAMIC_DISPATCH(BytesOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
