// Columns, then rows: the column sums of a few rows of a strip stay in the first cache. Codes are converted
// as often as they are seen: to keep them as floats takes longer.
#include "ops/filter/codes/products.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "ops/filter/codes/codes.h"
#include "ops/filter/codes/found.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/codes/products.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/codes/codes-inl.h"
#include "simd/rows-inl.h"

#ifndef TESSERA_OPS_FILTER_CODES_PRODUCTS_CC_
#define TESSERA_OPS_FILTER_CODES_PRODUCTS_CC_
namespace tessera::ops {

constexpr int kProductRows = 4;  // rows of results that share their loads

// Part of a tile, and scratch memory for it.
template <class T, class F>
struct ProductStrip {
  SampleTile<T> tile;
  F* sums = nullptr;  // down columns, of kProductRows rows
  ptrdiff_t stride = 0;
  const T** lines = nullptr;  // what windows of those rows see
  Found* found = nullptr;     // with room for a row
};

}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_CODES_PRODUCTS_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

template <class F>
using DP = std::conditional_t<sizeof(F) == 4, DB, DD>;
template <class F>
using VP = hn::Vec<DP<F>>;
template <class F>
constexpr int kProductLanes = static_cast<int>(hn::MaxLanes(DP<F>()));
// Vectors side by side, which share their weights and do not wait for each other.
constexpr int kAbreast = 4;

template <class F, class T>
HWY_INLINE VP<F> LoadCodes(const T* p) {
  const DP<F> d;
  const hn::Rebind<int32_t, DP<F>> i32;
  const auto codes = hn::PromoteTo(i32, hn::LoadU(hn::Rebind<T, DP<F>>(), p));
  if constexpr (sizeof(F) == 4) {
    return hn::ConvertTo(d, codes);
  } else {
    return hn::PromoteTo(d, codes);
  }
}

// kR rows of column sums of one vector: the samples that all rows read above and below their middle move
// through registers. kHalf: of the weights before the middle, or 0 for any number.
template <int kHalf, int kR, class T, class F>
HWY_INLINE void SumDown(const F* HWY_RESTRICT weights, int any_half, const T* const* lines, ptrdiff_t x,
                        F* HWY_RESTRICT out, ptrdiff_t out_stride) {
  const DP<F> d;
  const int half = kHalf == 0 ? any_half : kHalf;
  VP<F> above[kR], below[kR], sum[kR];
  HWY_UNROLL(4)
  for (int r = 0; r < kR; ++r) {
    above[r] = LoadCodes<F>(lines[r] + x), below[r] = LoadCodes<F>(lines[2 * half + r] + x);
    sum[r] = hn::Zero(d);
  }
#pragma GCC unroll 8
  for (int t = 0; t < half; ++t) {
    const VP<F> w = hn::Set(d, weights[t]);
    HWY_UNROLL(4)
    for (int r = 0; r < kR; ++r) {
      const VP<F> pair = hn::Add(above[r], below[r]);
      sum[r] = kHalf != 0 && t == 0 ? hn::Mul(pair, w) : hn::MulAdd(pair, w, sum[r]);
    }
    HWY_UNROLL(4)
    for (int r = 0; r + 1 < kR; ++r) above[r] = above[r + 1];
    above[kR - 1] = LoadCodes<F>(lines[kR + t] + x);
    if (t + 1 == half) break;
    HWY_UNROLL(4)
    for (int r = kR - 1; r > 0; --r) below[r] = below[r - 1];
    below[0] = LoadCodes<F>(lines[2 * half - 1 - t] + x);
  }
  const VP<F> w = hn::Set(d, weights[half]);
  HWY_UNROLL(4)
  for (int r = 0; r < kR; ++r) hn::StoreU(hn::MulAdd(above[r], w, sum[r]), d, out + r * out_stride);
}

// The row sums of kJ vectors side by side.
template <int kHalf, int kJ, class F>
HWY_INLINE void SumAlong(const F* HWY_RESTRICT weights, int any_half, const F* in, ptrdiff_t channels,
                         VP<F> (&sum)[kJ]) {
  constexpr int kN = kProductLanes<F>;
  const DP<F> d;
  const int half = kHalf == 0 ? any_half : kHalf;
  const F* low = in;
  const F* high = in + 2 * half * channels;
  VP<F> acc[kJ];
  for (VP<F>& v : acc) v = hn::Zero(d);
#pragma GCC unroll 8
  for (int t = 0; t < half; ++t, low += channels, high -= channels) {
    const VP<F> w = hn::Set(d, weights[t]);
    for (int j = 0; j < kJ; ++j) {
      const VP<F> pair = hn::Add(hn::LoadU(d, low + j * kN), hn::LoadU(d, high + j * kN));
      acc[j] = kHalf != 0 && t == 0 ? hn::Mul(pair, w) : hn::MulAdd(pair, w, acc[j]);
    }
  }
  const VP<F> w = hn::Set(d, weights[half]);
  for (int j = 0; j < kJ; ++j) sum[j] = hn::MulAdd(hn::LoadU(d, low + j * kN), w, acc[j]);
}

// The nearest whole numbers, half to even; how far from them sums are at most.
template <class F, int kJ>
HWY_INLINE VP<F> RoundSums(const VP<F> (&sum)[kJ], VP<F> (&code)[kJ]) {
  VP<F> farthest = hn::Zero(DP<F>());
  for (int j = 0; j < kJ; ++j) {
    code[j] = hn::Round(sum[j]);
    farthest = hn::Max(farthest, hn::Abs(hn::Sub(sum[j], code[j])));
  }
  return farthest;
}

// Limits whole numbers to codes.
template <class T, class F, int kJ>
HWY_INLINE void StoreCodes(const VP<F> (&code)[kJ], T* out) {
  const hn::Rebind<T, DP<F>> narrow;
  const hn::Rebind<int32_t, DP<F>> i32;
  if constexpr (sizeof(T) == 1 && sizeof(F) == 4 && kJ == 4)
    return simd::HWY_NAMESPACE::StoreBytes(code[0], code[1], code[2], code[3], out);
  for (int j = 0; j < kJ; ++j) {
    auto* const to = out + j * kProductLanes<F>;
    if constexpr (sizeof(F) == 4) {
      hn::StoreU(hn::DemoteTo(narrow, hn::ConvertTo(i32, code[j])), narrow, to);
    } else {
      hn::StoreU(hn::DemoteTo(narrow, hn::DemoteTo(i32, code[j])), narrow, to);
    }
  }
}

// Appends those of the samples from x on, whose sums these are, that are `near` or farther from whole
// numbers.
template <class F>
HWY_NOINLINE void AppendNear(const F* sums, F near, int x, int count, Found& found) {
  for (int k = 0; k < count; ++k) {
    if (std::fabs(sums[k] - std::nearbyint(sums[k])) >= near) found.Add(x + k);
  }
}

// Sums in double that are ties but for their own roundings go to the even code.
template <class T>
HWY_NOINLINE void SettleTies(const double* sums, int count, T* out) {
  constexpr double kLargest = std::numeric_limits<T>::max();
  for (int k = 0; k < count; ++k) {
    const double up = std::clamp(sums[k], 0.0, kLargest) + 0.5;
    if (std::fabs(up - std::nearbyint(up)) < kTieOfCodes)
      out[k] = static_cast<T>(2 * std::floor((up + kTieOfCodes) / 2));
  }
}

// The sum in double whose first sample this is.
template <class T>
double ExactSum(const ProductWindow& w, const T* in, ptrdiff_t stride, ptrdiff_t channels) {
  double sum = 0;
  const int half_width = w.width / 2, half_height = w.height / 2;
  for (int dy = 0; dy <= half_height; ++dy) {
    const T* const above = in + dy * stride;
    const T* const below = in + (w.height - 1 - dy) * stride;
    const int mirrored = dy == half_height ? 0 : 1;
    double across = 0;
    for (int dx = 0; dx < half_width; ++dx) {
      const ptrdiff_t low = dx * channels, high = (w.width - 1 - dx) * channels;
      const int four = above[low] + above[high] + mirrored * (below[low] + below[high]);
      across += w.row[static_cast<size_t>(dx)] * four;
    }
    const ptrdiff_t middle = half_width * channels;
    across += w.row[static_cast<size_t>(half_width)] * (above[middle] + mirrored * below[middle]);
    sum += w.column[static_cast<size_t>(dy)] * across;
  }
  return sum;
}

// Results from column sums on: kJ vectors from x on.
template <int kHalf, int kJ, class T, class F>
HWY_INLINE void FinishBlock(const F* row, int half, const F* sums, ptrdiff_t channels, F near, int x,
                            int count, T* out, Found& found) {
  constexpr int kSamples = kJ * kProductLanes<F>;
  VP<F> sum[kJ], code[kJ];
  SumAlong<kHalf, kJ>(row, half, sums + x, channels, sum);
  const auto farthest = RoundSums<F>(sum, code);
  const int samples = std::min(kSamples, count - x);
  if (samples == kSamples) {
    StoreCodes<T, F>(code, out + x);
  } else {
    HWY_ALIGN T tail[kSamples];
    StoreCodes<T, F>(code, tail);
    std::copy_n(tail, samples, out + x);
  }
  if (HWY_LIKELY(hn::AllFalse(DP<F>(), hn::Ge(farthest, hn::Set(DP<F>(), near))))) return;
  HWY_ALIGN F sums_of[kSamples];
  for (int j = 0; j < kJ; ++j) hn::Store(sum[j], DP<F>(), sums_of + j * kProductLanes<F>);
  if constexpr (sizeof(F) == 4) {
    AppendNear(sums_of, near, x, samples, found);
  } else {
    SettleTies(sums_of, samples, out + x);
  }
}

template <int kHalf, class T, class F>
void FinishRow(const F* row, int half, const F* sums, ptrdiff_t channels, F near, int count, T* out,
               Found& found) {
  constexpr int kN = kProductLanes<F>;
  int x = 0;
  for (; x + kAbreast * kN <= count; x += kAbreast * kN)
    FinishBlock<kHalf, kAbreast>(row, half, sums, channels, near, x, count, out, found);
  for (; x < count; x += kN) FinishBlock<kHalf, 1>(row, half, sums, channels, near, x, count, out, found);
}

// `lines`: of all rows that windows of `rows` rows of results see.
template <int kHalf, class T, class F>
void SumRowsDown(const F* column, int half, const T* const* lines, int rows, int count, F* sums,
                 ptrdiff_t stride) {
  constexpr int kN = kProductLanes<F>;
  if (rows == kProductRows) {
    for (int x = 0; x < count; x += kN)
      SumDown<kHalf, kProductRows>(column, half, lines, x, sums + x, stride);
    return;
  }
  for (int x = 0; x < count; x += kN) SumDown<kHalf, 1>(column, half, lines, x, sums + x, stride);
}

// f with the number as a constant, or with 0 where it is not a small one.
template <class F>
HWY_INLINE void WithConstant(int n, const F& f) {
  switch (n) {
    case 1:
      return f.template operator()<1>();
    case 2:
      return f.template operator()<2>();
    case 3:
      return f.template operator()<3>();
    case 4:
      return f.template operator()<4>();
    case 5:
      return f.template operator()<5>();
    case 6:
      return f.template operator()<6>();
    case 7:
      return f.template operator()<7>();
    default:
      return f.template operator()<0>();
  }
}

template <class T, class F>
void RunStrip(const ProductWindow& w, const F* column, const F* row, F near, const ProductStrip<T, F>& s) {
  const SampleTile<T>& t = s.tile;
  const int half_width = w.width / 2, half_height = w.height / 2;
  const int seen = t.samples + (w.width - 1) * t.channels;
  Found& found = *s.found;
  for (int y = 0; y < t.rows;) {
    const int rows = t.rows - y >= kProductRows ? kProductRows : 1;
    for (int i = 0; i < rows + w.height - 1; ++i) s.lines[i] = t.in + (y + i) * t.in_stride;
    WithConstant(half_height, [&]<int kHalf>() {
      SumRowsDown<kHalf>(column, half_height, s.lines, rows, seen, s.sums, s.stride);
    });
    for (int r = 0; r < rows; ++r, ++y) {
      T* const out = t.out + y * t.out_stride;
      WithConstant(half_width, [&]<int kHalf>() {
        FinishRow<kHalf>(row, half_width, s.sums + r * s.stride, t.channels, near, t.samples, out, found);
      });
      for (const int i : found) {
        const double exact = ExactSum(w, t.in + y * t.in_stride + i, t.in_stride, t.channels);
        constexpr float kLargest = std::numeric_limits<T>::max();
        out[i] = static_cast<T>(std::clamp(std::nearbyint(ops::SettledSample(exact, 1)), 0.0f, kLargest));
      }
      found.Clear();
    }
  }
}

void BytesInFloats(const ProductWindow& w, const ProductStrip<uint8_t, float>& s) {
  RunStrip(w, w.float_column.data(), w.float_row.data(), 0.5f - w.band, s);
}
void BytesInDoubles(const ProductWindow& w, const ProductStrip<uint8_t, double>& s) {
  RunStrip(w, w.column.data(), w.row.data(), 0.5 - kTieOfCodes, s);
}
void WordsInDoubles(const ProductWindow& w, const ProductStrip<uint16_t, double>& s) {
  RunStrip(w, w.column.data(), w.row.data(), 0.5 - kTieOfCodes, s);
}
ProductFunctions ProductsOfTarget() { return {BytesInFloats, BytesInDoubles, WordsInDoubles}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(ProductsOfTarget);

// Makes weights that differ by roundings alone the same from both ends; whether they do.
bool MakeSymmetric(std::vector<double>& weights, double most) {
  for (size_t i = 0; i < weights.size() / 2; ++i) {
    double &low = weights[i], &high = weights[weights.size() - 1 - i];
    if (std::fabs(low - high) > most) return false;
    low = high = low / 2 + high / 2;
  }
  return true;
}

// What sums under symmetric weights in floats are off by at most, in 2^-24 of the largest sample: each step
// is rounded as far as the sum has grown, from the ends of the weights to their middle.
double RoundingsOf(const std::vector<double>& weights) {
  double sum = 0, roundings = 0;
  for (size_t i = 0; i <= weights.size() / 2; ++i) {
    sum += (i == weights.size() / 2 ? 1 : 2) * std::fabs(weights[i]);
    roundings += sum;
  }
  return roundings + 2 * sum;  // weights too and, without fused products, those
}

template <class T, class F, class R>
void RunTile(const ProductWindow& window, const SampleTile<T>& tile, base::Arena& scratch, R* run) {
  constexpr int kCacheBytes = 24 << 10;  // of sums
  const int lines = window.height - 1 + kProductRows, margin = (window.width - 1) * tile.channels;
  constexpr int kSums = kCacheBytes / (kProductRows * sizeof(F));
  const int wanted = std::max(4 * margin, kSums - margin) / 64 * 64;
  const int pieces = (tile.samples + wanted - 1) / wanted;
  const int strip = ((tile.samples + pieces - 1) / pieces + 63) / 64 * 64;
  ProductStrip<T, F> s{.tile = tile};
  s.stride = (ptrdiff_t{strip} + margin + 79) / 16 * 16 | 16;
  s.sums = scratch.Allocate<F>(static_cast<size_t>(s.stride) * kProductRows + 64);
  s.lines = scratch.Allocate<const T*>(static_cast<size_t>(lines));
  Found found(scratch, strip);
  s.found = &found;
  std::fill_n(s.sums, s.stride * kProductRows + 64, F{0});
  for (int x = 0; x < tile.samples; x += strip) {
    s.tile.in = tile.in + x, s.tile.out = tile.out + x;
    s.tile.samples = std::min(strip, tile.samples - x);
    run(window, s);
  }
}

}  // namespace

ProductWindow MakeProductWindow(int width, int height, const std::vector<double>& weights) {
  constexpr double kHalfUlp = 0x1p-24, kLargestByte = 255, kLargestWord = 65535;
  ProductWindow w;
  w.width = width, w.height = height;
  if (width % 2 == 0 || height % 2 == 0 || width * height == 1) return w;
  const auto magnitude = [](double a, double b) { return std::fabs(a) < std::fabs(b); };
  const auto largest = std::max_element(weights.begin(), weights.end(), magnitude) - weights.begin();
  const double most = std::fabs(weights[static_cast<size_t>(largest)]);
  if (!(most > 0x1p-100 && most < 0x1p100)) return w;
  const auto at = [&](ptrdiff_t x, ptrdiff_t y) { return weights[static_cast<size_t>(y * width + x)]; };
  const ptrdiff_t x0 = largest % width, y0 = largest / width;
  for (ptrdiff_t x = 0; x < width; ++x) w.row.push_back(at(x, y0) / at(x0, y0));
  for (ptrdiff_t y = 0; y < height; ++y) w.column.push_back(at(x0, y));
  constexpr double kSame = 1e-13;
  if (!MakeSymmetric(w.row, kSame) || !MakeSymmetric(w.column, kSame * most)) return w;
  double residual = 0, row_sum = 0, column_sum = 0;
  for (ptrdiff_t y = 0; y < height; ++y) {
    const double c = w.column[static_cast<size_t>(y)];
    for (ptrdiff_t x = 0; x < width; ++x) residual += std::fabs(at(x, y) - c * w.row[static_cast<size_t>(x)]);
    column_sum += std::fabs(c);
  }
  for (const double r : w.row) row_sum += std::fabs(r);
  // Far less than what makes a tie.
  if (kLargestWord * (residual + row_sum * column_sum * (width + height) * 0x1p-53) > kTieOfCodes / 4)
    return w;
  constexpr double kMostWeight = 1000;
  if (row_sum * column_sum > kMostWeight) return w;
  w.usable = true;
  // Pairs of bytes add up to whole numbers, pairs of their sums are rounded.
  const double off = row_sum * RoundingsOf(w.column) + column_sum * (RoundingsOf(w.row) + row_sum);
  const double band = kLargestByte * (1.001 * off * kHalfUlp + residual) + kHalfUlp;
  // Products that are summed anew, per result: more take longer than sums in double.
  constexpr double kMostAnew = 1;
  if (2 * band * width * height > kMostAnew) return w;
  w.band = static_cast<float>(band);
  w.float_column.assign(w.column.begin(), w.column.end());
  w.float_row.assign(w.row.begin(), w.row.end());
  return w;
}

ProductFunctions ChooseProducts() { return HWY_DYNAMIC_DISPATCH(ProductsOfTarget)(); }

void RunProducts(const ProductFunctions& functions, const ProductWindow& window, const ByteTile& tile,
                 base::Arena& scratch) {
  if (window.band > 0) {
    RunTile<uint8_t, float>(window, tile, scratch, functions.bytes_in_floats);
  } else {
    RunTile<uint8_t, double>(window, tile, scratch, functions.bytes_in_doubles);
  }
}

void RunProducts(const ProductFunctions& functions, const ProductWindow& window, const WordTile& tile,
                 base::Arena& scratch) {
  RunTile<uint16_t, double>(window, tile, scratch, functions.words_in_doubles);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
