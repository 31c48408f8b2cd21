// Bytes are whole numbers below 2^8: floats hold their sums exactly where weights are small whole numbers,
// and come near to a tie so rarely elsewhere that doubles are wanted for one result in thousands.
#include "ops/filter/fir_bytes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/fir_bytes.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/codes-inl.h"

#ifndef TESSERA_OPS_FILTER_FIR_BYTES_CC_
#define TESSERA_OPS_FILTER_FIR_BYTES_CC_
namespace tessera::ops {
constexpr float kLargestByte = 255;
}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_FIR_BYTES_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// The codes of `count` samples, what is none as 0, and zeros up to `padded`, a multiple of 16; whether all
// are codes. Null: none are kept.
bool ToBytes(const float* HWY_RESTRICT samples, int count, int padded, float* HWY_RESTRICT codes) {
  const DB d;
  const auto largest = hn::Set(d, kLargestByte), zero = hn::Zero(d);
  auto all = hn::Eq(zero, zero);
  const auto code_of = [&](auto sample, auto& whole) HWY_ATTR {
    const auto code = hn::Mul(sample, largest), nearest = hn::Round(code);
    whole = hn::And(hn::Lt(hn::Abs(hn::Sub(code, nearest)), hn::Set(d, static_cast<float>(kWholeCode))),
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
  if (kByteLanes > 1) std::copy(samples + i, samples + count, tail);
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
  int i = 0;
  for (; i + kByteLanes <= count; i += kByteLanes) hn::StoreU(f(hn::LoadU(d, row + i), i), d, row + i);
  if (kByteLanes == 1 || i == count) return;
  HWY_ALIGN float tail[kByteLanes] = {};
  std::copy(row + i, row + count, tail);
  hn::Store(f(hn::Load(d, tail), i), d, tail);
  std::copy_n(tail, count - i, row + i);
}

// Exact sums, whole numbers, over the divisor.
void SettleWhole(float divisor, float* row, int count) {
  const auto over = hn::Set(DB(), divisor);
  ForVectors(row, count, [&](VB sum, int) HWY_ATTR { return SettledSample(sum, over); });
}

// Sums off by less than the band: appends those near a tie, whose samples stay sums.
void SettleSums(float band, float* row, int count, std::vector<int>& found) {
  const DB d;
  const auto near = hn::Set(d, 0.5f - band);
  ForVectors(row, count, [&](auto sum, int i) HWY_ATTR {
    const auto nearest = hn::Round(sum);
    const auto close = hn::Ge(hn::Abs(hn::Sub(sum, nearest)), near);
    if (HWY_UNLIKELY(!hn::AllFalse(d, close))) {
      HWY_ALIGN float marks[kByteLanes];
      hn::Store(hn::IfThenElseZero(close, hn::Set(d, 1.0f)), d, marks);
      for (int k = 0; k < kByteLanes && i + k < count; ++k) {
        if (marks[k] != 0) found.push_back(i + k);
      }
    }
    return hn::Div(sum, hn::Set(d, kLargestByte));
  });
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(ToBytes);
HWY_EXPORT(SettleWhole);
HWY_EXPORT(SettleSums);

// The sum in double whose first sample this is.
double ExactSum(const CodesWindow& w, const float* in, ptrdiff_t stride, int channels) {
  const bool separable = !w.row.empty();
  double sum = 0;
  for (int dx = 0; dx < w.width; ++dx, in += channels) {
    const double* const column = separable ? w.column(0) : w.column(dx);
    double down = 0;
    for (int dy = 0; dy < w.height; ++dy) down += column[dy] * in[dy * stride];
    sum += separable ? down * w.row[static_cast<size_t>(dx)] : down;
  }
  return sum;
}

}  // namespace

BytesWindow MakeBytesWindow(int width, int height, const std::vector<double>& weights, double error) {
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
    w.divisor = static_cast<float>(divisor);
    w.whole = MakeDirectWindow(width, height, std::move(whole));
    break;
  }
  return w;
}

bool AreBytes(const float* samples, int count) {
  return HWY_DYNAMIC_DISPATCH(ToBytes)(samples, count, count, nullptr);
}

void RunBytes(const BytesWindow& window, const CodesWindow& exact, const FirTile& tile, base::Arena& scratch,
              const std::function<void(const FirTile&)>& sum) {
  const int rows = tile.rows + exact.height - 1;
  const int floats = tile.floats + (exact.width - 1) * tile.channels;
  const int stride = (floats + 31) / 16 * 16;  // a vector beyond the last tap may be read
  FirTile codes = tile;
  auto* const held = scratch.Allocate<float>(static_cast<size_t>(stride) * static_cast<size_t>(rows) + 16);
  codes.in = held, codes.in_stride = stride, codes.stream = false;
  bool all = true;
  auto* const convert = &HWY_DYNAMIC_DISPATCH(ToBytes);
  for (int y = 0; y < rows; ++y) {
    all = convert(tile.in + y * tile.in_stride, floats, stride, held + ptrdiff_t{y} * stride) && all;
  }
  std::fill_n(held + ptrdiff_t{rows} * stride, 16, 0.0f);
  if (!all) {
    sum(tile);
    codes.out = scratch.Allocate<float>(static_cast<size_t>(tile.floats) * static_cast<size_t>(tile.rows));
    codes.out_stride = tile.floats;
  }
  if (window.divisor != 0) {
    RunDirect(window.whole, codes);
    auto* const settle = &HWY_DYNAMIC_DISPATCH(SettleWhole);
    for (int y = 0; y < tile.rows; ++y) settle(window.divisor, codes.out + y * codes.out_stride, tile.floats);
  } else {
    sum(codes);
    auto* const settle = &HWY_DYNAMIC_DISPATCH(SettleSums);
    std::vector<int> found;
    for (int y = 0; y < tile.rows; ++y) {
      float* const row = codes.out + y * codes.out_stride;
      found.clear();
      settle(window.band, row, tile.floats, found);
      for (const int i : found)
        row[i] = SettledSample(ExactSum(exact, held + ptrdiff_t{y} * stride + i, stride, tile.channels), 255);
    }
  }
  if (!all) KeepWithoutStrangers(exact, 255, 2 * kWholeCode, tile, codes);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
