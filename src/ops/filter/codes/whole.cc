// Sums of bytes in vectors of 16 bits, twice as many samples as floats and no conversions.
#include "ops/filter/codes/whole.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/codes/whole.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/rows-inl.h"

#ifndef TESSERA_OPS_FILTER_CODES_WHOLE_CC_
#define TESSERA_OPS_FILTER_CODES_WHOLE_CC_
namespace tessera::ops {

constexpr int kWholeRows = 4;  // rows of results that share their loads
constexpr int kWholeUnit = 32;

// Part of a row of results and the rows next to it. `sums` and `columns`: of kWholeRows rows.
struct WholeStrip {
  const uint8_t* in;
  ptrdiff_t in_stride;
  uint16_t *sums, *columns;
  ptrdiff_t stride;  // of both
  int samples, rows, channels;
};

}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_CODES_WHOLE_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

using DW = hn::CappedTag<uint16_t, kWholeUnit>;
using VW = hn::Vec<DW>;
constexpr int kWholeLanes = static_cast<int>(hn::MaxLanes(DW()));

HWY_INLINE VW LoadBytes(const uint8_t* p) {
  return hn::PromoteTo(DW(), hn::LoadU(hn::Rebind<uint8_t, DW>(), p));
}

// sums[r] += the products of a column of weights with kR rows of samples from `in` on. kHeight: of the
// column, or 0 for any.
template <int kHeight, int kR>
HWY_INLINE void AddColumn(VW (&sum)[kR], const uint16_t* HWY_RESTRICT weights, const uint8_t* in,
                          ptrdiff_t stride, int any_height) {
  const int height = kHeight == 0 ? any_height : kHeight;
  HWY_UNROLL(8)
  for (int i = 0; i < height + kR - 1; ++i, in += stride) {
    const VW v = LoadBytes(in);
    HWY_UNROLL(4)
    for (int r = 0; r < kR; ++r) {
      if (i < r || i - r >= height) continue;
      sum[r] = hn::Add(sum[r], hn::Mul(v, hn::Set(DW(), weights[i - r])));
    }
  }
}

// The columns' sums of kR rows, or all sums where there is no row of weights.
template <int kHeight, int kR>
void SumDown(const WholeWindow& w, const WholeStrip& s) {
  const DW d;
  const bool product = !w.row.empty();
  uint16_t* const down = product ? s.columns : s.sums;
  const int wide = product ? s.samples + (w.width - 1) * s.channels : s.samples;
  for (int x = 0; x < wide; x += kWholeLanes) {
    VW sum[kR];
    for (VW& v : sum) v = hn::Zero(d);
    const uint16_t* weights = w.columns.data();
    for (int dx = 0; dx < (product ? 1 : w.width); ++dx, weights += w.height) {
      AddColumn<kHeight>(sum, weights, s.in + x + ptrdiff_t{dx} * s.channels, s.in_stride, w.height);
    }
    for (int r = 0; r < kR; ++r) hn::StoreU(sum[r], d, down + r * s.stride + x);
  }
}

// One vector of a row's sums. kWidth: of the row of weights, or 0 for any.
template <int kWidth>
HWY_INLINE VW SumAlong(const WholeWindow& w, const uint16_t* columns, int channels) {
  const DW d;
  const int width = kWidth == 0 ? w.width : kWidth;
  const uint16_t* const weights = w.row.data();
  VW sum = hn::Mul(hn::LoadU(d, columns), hn::Set(d, weights[0]));
  HWY_UNROLL(8)
  for (int dx = 1; dx < width; ++dx) {
    sum = hn::Add(sum, hn::Mul(hn::LoadU(d, columns + ptrdiff_t{dx} * channels), hn::Set(d, weights[dx])));
  }
  return sum;
}

// Sums, sum(i), of numbers of type T over 2^shift.
template <class T, class F>
HWY_INLINE void BytesOfShifted(int shift, int count, uint8_t* out, const F& sum) {
  const hn::Repartition<T, DW> d;
  const hn::Rebind<uint8_t, DW> bytes;
  const hn::Repartition<int16_t, DW> wide;
  const auto demote = [&](auto v) HWY_ATTR {
    if constexpr (std::is_unsigned_v<T>) v = hn::Min(v, hn::Set(d, T{255}));
    return hn::DemoteTo(bytes, hn::BitCast(wide, v));
  };
  if (shift == 0) {
    return s::StoreRow(bytes, count, out, [&](int i) HWY_ATTR { return demote(hn::BitCast(d, sum(i))); });
  }
  const auto below = hn::Set(d, static_cast<T>((1 << (shift - 1)) - 1)), one = hn::Set(d, T{1});
  s::StoreRow(bytes, count, out, [&](int i) HWY_ATTR {
    const auto v = hn::BitCast(d, sum(i));
    const auto odd = hn::And(hn::ShiftRightSame(v, shift), one);
    return demote(hn::ShiftRightSame(hn::Add(hn::Add(v, below), odd), shift));
  });
}

// The same of rows of sums over any divisor.
template <class T>
void BytesOfDivided(const WholeWindow& w, const uint16_t* sums, int count, uint8_t* out) {
  const hn::CappedTag<float, kWholeUnit / 2> f;
  const hn::RebindToSigned<decltype(f)> i32;
  const hn::Rebind<T, decltype(f)> d;
  const hn::Rebind<uint8_t, decltype(f)> bytes;
  const auto by = hn::Set(f, w.multiplied ? w.inverse : static_cast<float>(w.divisor));
  const auto bytes_of = [&](const auto& quotient) HWY_ATTR {
    s::StoreRow(bytes, count, out, [&](int i) HWY_ATTR {
      const auto sum = hn::LoadU(d, reinterpret_cast<const T*>(sums) + i);
      return hn::DemoteTo(bytes, hn::NearestInt(quotient(hn::ConvertTo(f, hn::PromoteTo(i32, sum)))));
    });
  };
  if (w.multiplied) {
    bytes_of([&](auto sum) HWY_ATTR { return hn::Mul(sum, by); });
  } else {
    bytes_of([&](auto sum) HWY_ATTR { return hn::Div(sum, by); });
  }
}

template <class T, int kWidth>
void FinishRow(const WholeWindow& w, const WholeStrip& s, int r, uint8_t* out) {
  const DW d;
  const uint16_t* const columns = s.columns + r * s.stride;
  uint16_t* const sums = s.sums + r * s.stride;
  if (w.row.empty()) {
    if (w.shift < 0) return BytesOfDivided<T>(w, sums, s.samples, out);
    return BytesOfShifted<T>(w.shift, s.samples, out, [&](int i) HWY_ATTR { return hn::LoadU(d, sums + i); });
  }
  const auto sum = [&](int i) HWY_ATTR { return SumAlong<kWidth>(w, columns + i, s.channels); };
  if (w.shift >= 0) return BytesOfShifted<T>(w.shift, s.samples, out, sum);
  for (int i = 0; i < s.samples; i += kWholeLanes) hn::StoreU(sum(i), d, sums + i);
  BytesOfDivided<T>(w, sums, s.samples, out);
}

template <class T>
void FinishRows(const WholeWindow& w, const WholeStrip& s, uint8_t* out, ptrdiff_t out_stride) {
  for (int r = 0; r < s.rows; ++r, out += out_stride) {
    w.width == 3   ? FinishRow<T, 3>(w, s, r, out)
    : w.width == 5 ? FinishRow<T, 5>(w, s, r, out)
                   : FinishRow<T, 0>(w, s, r, out);
  }
}

// Results of kWholeRows rows or of one.
void WholeRows(const WholeWindow& w, const WholeStrip& s, uint8_t* out, ptrdiff_t out_stride) {
  const auto sum = [&]<int kR>() {
    switch (w.height) {
      case 3:
        return SumDown<3, kR>(w, s);
      case 5:
        return SumDown<5, kR>(w, s);
      default:
        return SumDown<0, kR>(w, s);
    }
  };
  s.rows == kWholeRows ? sum.template operator()<kWholeRows>() : sum.template operator()<1>();
  w.negative ? FinishRows<int16_t>(w, s, out, out_stride) : FinishRows<uint16_t>(w, s, out, out_stride);
}
WholeFunction WholeOfTarget() { return WholeRows; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(WholeOfTarget);

// Whether a float product rounds as the quotient does: both rise with the sum, so that the sums beside the
// middles between two codes are all that need be looked at.
bool MayMultiply(int divisor, float inverse) {
  for (int k = 0; k < 255; ++k) {
    const int twice = (2 * k + 1) * divisor, below = (twice - 1) / 2;
    const auto code = [&](int sum) { return std::nearbyint(static_cast<float>(sum) * inverse); };
    if (code(below) != k || code(twice / 2 + 1) != k + 1) return false;
    if (twice % 2 == 0 && code(twice / 2) != k + k % 2) return false;
  }
  return true;
}

}  // namespace

WholeWindow MakeWholeWindow(int width, int height, const std::vector<double>& weights, int divisor) {
  constexpr int kMostTaps = 49;
  WholeWindow w;
  w.width = width, w.height = height, w.divisor = divisor;
  double above = 0, below = 0;
  for (const double v : weights) (v < 0 ? below : above) += v;
  w.negative = below < 0;
  // What is added for rounding fits too.
  const double room = divisor / 2.0 + 1;
  if (255 * above + room > (w.negative ? 32767 : 65535) || 255 * below < -32768 || above == 0) return w;
  const auto at = [&](int x, int y) {
    return static_cast<int>(
        weights[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)]);
  };
  // A column times a row: the row is any that is not 0, without common factors.
  int first = 0, common = 0;
  while (std::all_of(weights.begin() + ptrdiff_t{first} * width,
                     weights.begin() + ptrdiff_t{first + 1} * width, [](double v) { return v == 0; })) {
    ++first;
  }
  for (int x = 0; x < width; ++x) common = std::gcd(common, std::abs(at(x, first)));
  int place = 0;
  while (at(place, first) == 0) ++place;
  std::vector<int> row, column;
  for (int x = 0; x < width; ++x) row.push_back(at(x, first) / common);
  bool product = width > 1 && height > 1;
  for (int y = 0; y < height; ++y) {
    column.push_back(at(place, y) / row[static_cast<size_t>(place)]);
    for (int x = 0; x < width; ++x) {
      product = product && at(x, y) == column.back() * row[static_cast<size_t>(x)];
    }
  }
  if (product) {
    w.columns.assign(column.begin(), column.end());
    w.row.assign(row.begin(), row.end());
  } else {
    for (int x = 0; x < width; ++x) {
      for (int y = 0; y < height; ++y) w.columns.push_back(static_cast<uint16_t>(at(x, y)));
    }
  }
  w.usable = product || width * height <= kMostTaps;
  if (std::has_single_bit(static_cast<unsigned>(divisor)))
    w.shift = std::countr_zero(static_cast<unsigned>(divisor));
  w.inverse = 1 / static_cast<float>(divisor);
  w.multiplied = MayMultiply(divisor, w.inverse);
  return w;
}

WholeFunction ChooseWhole() { return HWY_DYNAMIC_DISPATCH(WholeOfTarget)(); }

void RunWhole(WholeFunction run, const WholeWindow& window, const ByteTile& tile, base::Arena& scratch) {
  constexpr int kStrip = 1024, kLineBytes = 64;
  const int strip = std::min(kStrip, tile.samples), margin = (window.width - 1) * tile.channels;
  const ptrdiff_t stride = (ptrdiff_t{strip} + margin + 2 * kWholeUnit) / kWholeUnit * kWholeUnit;
  auto* const sums = scratch.Allocate<uint16_t>(static_cast<size_t>(stride) * kWholeRows);
  auto* const columns = scratch.Allocate<uint16_t>(static_cast<size_t>(stride) * kWholeRows);
  std::fill_n(columns, stride * kWholeRows, uint16_t{0});
  std::fill_n(sums, stride * kWholeRows, uint16_t{0});
  for (int x = 0; x < tile.samples; x += strip) {
    WholeStrip s{tile.in + x, tile.in_stride, sums, columns, stride, std::min(strip, tile.samples - x),
                 kWholeRows,  tile.channels};
    for (int y = 0; y < tile.rows; y += s.rows) {
      s.rows = tile.rows - y >= kWholeRows ? kWholeRows : 1;
      s.in = tile.in + y * tile.in_stride + x;
      // The next rows: a strip of them is too short for the processor to foresee.
      const int last = std::min(s.rows + kWholeRows, tile.rows - y) + window.height - 1;
      for (int row = s.rows + window.height - 1; row < last; ++row) {
        const uint8_t* const next = s.in + row * tile.in_stride;
        for (int i = 0; i < s.samples + margin; i += kLineBytes) hwy::Prefetch(next + i);
      }
      run(window, s, tile.out + y * tile.out_stride + x, tile.out_stride);
    }
  }
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
