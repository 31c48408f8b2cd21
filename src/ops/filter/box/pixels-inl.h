// Means on a grid of whole pixels of four channels, four rows at a time, two pixels in a vector. Columns'
// sums lie in a ring of one window's columns, which the first cache holds, from when they enter until they
// leave.
#if defined(TESSERA_OPS_FILTER_BOX_PIXELS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_BOX_PIXELS_INL_H_
#undef TESSERA_OPS_FILTER_BOX_PIXELS_INL_H_
#else
#define TESSERA_OPS_FILTER_BOX_PIXELS_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>

#include "base/prefetch.h"
#include "ops/filter/box/grid-inl.h"
#include "ops/filter/box/sums-inl.h"
#include "simd/shuffle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Rows in and out, and what moves along them.
struct PixelRows {
  SourceRows leave{}, enter{};
  SourceRows next{};  // those that enter then are fetched meanwhile
  std::array<float*, kBoxRows> out{};
  double offset = 0, factor = 0;
  double* sums = nullptr;  // of columns
  double* ring = nullptr;  // scratch memory: `width` pixels of kBoxRows rows
  int width = 1, count = 0;
  uint32_t less = 0;  // subtracted from results' magnitudes
};

#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
constexpr bool kMeansOfPixels = true;

constexpr int kLine = 4;  // pixels of a cache line
// Floats between what is used and what is fetched from the second cache: the hardware follows fewer streams.
constexpr ptrdiff_t kAhead = 192;
constexpr ptrdiff_t kRingPixel = 4 * kBoxRows;  // doubles
using DLine = hn::CappedTag<float, 4 * kLine>;
using ULine = hn::RebindToUnsigned<DLine>;

struct PixelState {
  VD sum[kBoxRows / 2];  // of a window: a pixel of two rows each
  double* slot;          // of the ring: the column that leaves next
  // Samples that entered as their bits: the largest as a signed and as an unsigned number tell positive and
  // negative ones apart; the least less 1, so that zeros are large.
  hn::Vec<hn::RebindToSigned<DLine>> positive;
  hn::Vec<ULine> any, least;
  hn::Vec<ULine> least_mean;

  HWY_INLINE void Measure(const float* p) {
    const ULine u;
    const hn::RebindToSigned<DLine> s;
    const auto bits = hn::BitCast(u, hn::LoadU(DLine(), p));
    positive = hn::Max(positive, hn::BitCast(s, bits));
    any = hn::Max(any, bits);
    least = hn::Min(least, hn::Sub(bits, hn::Set(u, 1u)));
  }
  Magnitudes Measured() const {
    const ULine u;
    constexpr uint32_t kSign = 0x80000000u, kInfinity = 0x7f800000u;
    const uint32_t all = hn::GetLane(hn::MaxOfLanes(u, any)), low = hn::GetLane(hn::MinOfLanes(u, least));
    const int32_t high = hn::GetLane(hn::MaxOfLanes(hn::RebindToSigned<DLine>(), positive));
    Magnitudes m;
    m.largest = static_cast<uint32_t>(std::max(high, 0));
    if (all > kSign) m.largest = std::max(m.largest, all - kSign), m.lowest = std::bit_cast<float>(all);
    if (low < kInfinity) m.least = low;  // of use only where nothing is negative
    return m;
  }
};

// A column's sums in two rows enter the window and the ring, those of the column a window before leave.
HWY_INLINE void EnterPair(VD pair, VD& sum, double* at) {
  const DD d;
  sum = hn::Add(sum, hn::Sub(pair, hn::Load(d, at)));
  hn::Store(pair, d, at);
}
HWY_INLINE void NextSlot(const PixelRows& rows, PixelState& s) {
  s.slot += kRingPixel;
  if (s.slot == rows.ring + rows.width * kRingPixel) s.slot = rows.ring;
}

// Column c alone.
HWY_INLINE void EnterColumn(const PixelRows& rows, int c, PixelState& s) {
  const hn::Half<DD> d;
  const DD whole;
  const hn::Rebind<float, decltype(d)> f;
  const auto o = hn::Set(d, rows.offset);
  const auto sample = [&](const float* row)
                          HWY_ATTR { return hn::Add(hn::PromoteTo(d, hn::LoadU(f, row + 4 * c)), o); };
  hn::Vec<decltype(d)> column[kBoxRows + 1];
  column[0] = hn::LoadU(d, rows.sums + 4 * c);
  for (size_t r = 0; r < kBoxRows; ++r) {
    column[r + 1] = hn::Add(column[r], hn::Sub(sample(rows.enter[r]), sample(rows.leave[r])));
  }
  hn::StoreU(column[kBoxRows], d, rows.sums + 4 * c);
  for (int p = 0; p < kBoxRows / 2; ++p) {
    EnterPair(hn::Combine(whole, column[2 * p + 1], column[2 * p]), s.sum[p], s.slot + 8 * p);
  }
  NextSlot(rows, s);
}

// Columns c to c + 3; with means, those of the windows that end there.
template <bool kMeans>
HWY_INLINE void EnterLine(const PixelRows& rows, int c, PixelState& s, hn::Vec<DLine>* means) {
  const DD d;
  const DF f;
  // Multiplied and added, so that not all work goes to the ports of additions: the same sums.
  const auto o = hn::Set(d, rows.offset), one = hn::Set(d, 1.0), factor = hn::Set(d, rows.factor);
  const auto sample = [&](const float* row)
                          HWY_ATTR { return hn::MulAdd(hn::PromoteTo(d, hn::LoadU(f, row)), one, o); };
  VD column[2][kBoxRows];
  HWY_UNROLL(2)
  for (int q = 0; q < 2; ++q) {
    const ptrdiff_t x = 4 * ptrdiff_t{c} + 8 * q;
    VD sum = hn::LoadU(d, rows.sums + x);
    HWY_UNROLL(4)
    for (size_t r = 0; r < kBoxRows; ++r) {
      column[q][r] = sum;
      sum = hn::Add(sum, hn::Sub(sample(rows.enter[r] + x), sample(rows.leave[r] + x)));
    }
    hn::StoreU(sum, d, rows.sums + x);
  }
  HWY_UNROLL(4)
  for (size_t r = 0; r < kBoxRows; ++r) {
    base::PrefetchSecond(rows.next[r] + 4 * c);
    hwy::Prefetch(rows.leave[r] + 4 * c + kAhead);
    hwy::Prefetch(rows.enter[r] + 4 * c + kAhead);
    s.Measure(rows.enter[r] + 4 * c);
  }
  hn::Vec<DF> mean[kBoxRows / 2][kLine];
  HWY_UNROLL(4)
  for (int j = 0; j < kLine; ++j) {
    HWY_UNROLL(2)
    for (int p = 0; p < kBoxRows / 2; ++p) {
      const VD a = column[j / 2][2 * p], b = column[j / 2][2 * p + 1];
      EnterPair(j % 2 == 0 ? hn::ConcatLowerLower(d, b, a) : hn::ConcatUpperUpper(d, b, a), s.sum[p],
                s.slot + 8 * p);
      if constexpr (kMeans) mean[p][j] = hn::DemoteTo(f, hn::Mul(s.sum[p], factor));
    }
    NextSlot(rows, s);
  }
  if constexpr (kMeans) {
    const DLine line;
    HWY_UNROLL(2)
    for (int p = 0; p < kBoxRows / 2; ++p) {
      const auto left = hn::Combine(line, mean[p][1], mean[p][0]),
                 right = hn::Combine(line, mean[p][3], mean[p][2]);
      means[2 * p] = simd::HWY_NAMESPACE::EvenBlocks(left, right);
      means[2 * p + 1] = simd::HWY_NAMESPACE::OddBlocks(left, right);
    }
  }
}

// Moves the sums on by kBoxRows rows, as MoveColumns, and leaves the rows' means and what entered. Returns
// the least result in magnitude.
template <bool kStream>
uint32_t MeansOfPixels(const PixelRows& all, Magnitudes& entered) {
  const PixelRows rows = all;  // no store can change it
  const DLine line;
  const ULine u;
  const auto magnitude = hn::Set(u, 0x7fffffffu), less = hn::Set(u, rows.less);
  PixelState s{.sum = {hn::Zero(DD()), hn::Zero(DD())},
               .slot = rows.ring,
               .positive = hn::Zero(hn::RebindToSigned<DLine>()),
               .any = hn::Zero(u),
               .least = hn::Set(u, ~uint32_t{0}),
               .least_mean = hn::Set(u, ~uint32_t{0})};
  std::fill_n(rows.ring, rows.width * kRingPixel, 0.0);
  for (const float* row : rows.enter) s.Measure(row);
  // The columns before a line's last: those that make no line go alone.
  int c = 0;
  for (; c < (rows.width - 1) % kLine; ++c) EnterColumn(rows, c, s);
  for (; c < rows.width - 1; c += kLine) EnterLine<false>(rows, c, s, nullptr);
  int x = 0;
  for (; x + kLine <= rows.count; x += kLine) {
    hn::Vec<DLine> means[kBoxRows];
    EnterLine<true>(rows, c + x, s, means);
    HWY_UNROLL(4)
    for (size_t r = 0; r < kBoxRows; ++r) {
      s.least_mean = hn::Min(s.least_mean, hn::Sub(hn::And(hn::BitCast(u, means[r]), magnitude), less));
      float* const to = rows.out[r] + 4 * x;
      kStream ? hn::Stream(means[r], line, to) : hn::StoreU(means[r], line, to);
    }
  }
  if (x < rows.count) {
    hn::Vec<DLine> means[kBoxRows];
    EnterLine<true>(rows, c + x, s, means);
    const auto floats = static_cast<size_t>(rows.count - x) * 4;
    const auto mask = hn::FirstN(line, floats);
    for (size_t r = 0; r < kBoxRows; ++r) {
      const auto least = hn::Sub(hn::And(hn::BitCast(u, means[r]), magnitude), less);
      s.least_mean = hn::Min(s.least_mean, hn::IfThenElse(hn::RebindMask(u, mask), least, s.least_mean));
      alignas(64) float last[4 * kLine];
      hn::Store(means[r], line, last);
      std::copy_n(last, floats, rows.out[r] + 4 * x);
    }
  }
  entered = s.Measured();
  return hn::GetLane(hn::MinOfLanes(u, s.least_mean));
}

#else
constexpr bool kMeansOfPixels = false;
template <bool kStream>
uint32_t MeansOfPixels(const PixelRows&, Magnitudes&) {
  return 0;
}
#endif

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
