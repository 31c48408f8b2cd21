// Sums over a sliding window of samples that are whole multiples of a power of two: in double every sum
// below 2^53 of them is exact, so that what leaves the window can be subtracted and leaves no trace.
#if defined(TESSERA_OPS_FILTER_BOX_GRID_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_BOX_GRID_INL_H_
#undef TESSERA_OPS_FILTER_BOX_GRID_INL_H_
#else
#define TESSERA_OPS_FILTER_BOX_GRID_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "base/prefetch.h"
#include "ops/filter/codes/codes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// The magnitudes among samples, as the bits of floats.
struct Magnitudes {
  uint32_t largest = 0;           // of any sample; beyond those of infinity for a NaN
  uint32_t least = ~uint32_t{0};  // of a sample that is not 0, less 1
  float lowest = 0;               // the least sample, or 0

  void Add(const Magnitudes& m) {
    largest = std::max(largest, m.largest);
    least = std::min(least, m.least);
    lowest = std::min(lowest, m.lowest);
  }
};

// `count`: a multiple of 16; `ahead`: where the floats lie that are fetched meanwhile.
inline Magnitudes Measure(const float* HWY_RESTRICT p, ptrdiff_t count, ptrdiff_t ahead) {
  const hn::CappedTag<float, 16> f;
  const hn::RebindToUnsigned<decltype(f)> u;
  auto largest = hn::Zero(u), least = hn::Set(u, ~uint32_t{0});
  auto lowest = hn::Zero(f);
  const auto magnitude = hn::Set(u, 0x7fffffffu), one = hn::Set(u, 1u);
  for (ptrdiff_t x = 0; x < count; x += 16) {
    base::PrefetchSecond(p + ahead + x);
    for (ptrdiff_t i = x; i < x + 16; i += static_cast<ptrdiff_t>(hn::Lanes(f))) {
      const auto v = hn::LoadU(f, p + i);
      const auto bits = hn::And(hn::BitCast(u, v), magnitude);
      largest = hn::Max(largest, bits);
      least = hn::Min(least, hn::Sub(bits, one));  // zeros turn into the largest number
      lowest = hn::Min(lowest, v);
    }
  }
  return {hn::GetLane(hn::MaxOfLanes(u, largest)), hn::GetLane(hn::MinOfLanes(u, least)),
          hn::GetLane(hn::MinOfLanes(f, lowest))};
}

// Multiples of 2^exponent whose sums over `samples` of them stay exact, for samples of the given magnitudes.
struct Grid {
  bool exists = false;
  int exponent = 0;
  // Added to a sample, it leaves a whole number of grid steps beyond its own: 1.5 * 2^52 of them.
  double offset = 0;

  Grid() = default;
  Grid(const Magnitudes& m, int64_t samples) {
    constexpr uint32_t kInfinity = 0x7f800000u;
    if (m.largest >= kInfinity) return;
    exists = true;
    // Above all samples, also once rounded; subnormal ones are below the least exponent.
    const int above = static_cast<int>(m.largest >> 23) - 127 + 1;
    exponent = above + static_cast<int>(std::bit_width(static_cast<uint64_t>(samples - 1))) - 53;
    offset = std::ldexp(1.5, exponent + 52);
  }
  // Means of at least this are right within 3/4 of a last place: samples are off by half a step at most, a
  // quarter of the place. As the bits of a float.
  uint32_t LeastMean() const {
    return exponent + 24 < -126 ? 0x00800000u
                                : std::bit_cast<uint32_t>(static_cast<float>(std::ldexp(1.0, exponent + 24)));
  }
  // Whether a mean of 0 says that all samples are.
  bool ZerosAreZeros(const Magnitudes& m) const {
    if (m.lowest < 0) return false;
    return m.least == ~uint32_t{0} || double{std::bit_cast<float>(m.least + 1)} >= std::ldexp(1.0, exponent);
  }
};

// A sample as a multiple of the grid's step, plus the offset; codes are whole numbers as they are.
template <bool kCodes>
HWY_INLINE VD OnGrid(const float* p, [[maybe_unused]] float largest, [[maybe_unused]] VD offset) {
  const DF f;
  const auto v = hn::LoadU(f, p);
  if constexpr (kCodes) {
    return hn::PromoteTo(DD(), hn::Round(hn::Mul(v, hn::Set(f, largest))));
  } else {
    return hn::Add(hn::PromoteTo(DD(), v), offset);
  }
}

// sums += a row.
template <bool kCodes>
void AddRow(const float* HWY_RESTRICT row, float largest, double offset, double* HWY_RESTRICT sums,
            ptrdiff_t stride) {
  const DD d;
  const auto o = hn::Set(d, kCodes ? 0.0 : offset);
  for (ptrdiff_t x = 0; x < stride; x += kDoubles) {
    hn::Store(hn::Add(hn::Load(d, sums + x), hn::Sub(OnGrid<kCodes>(row + x, largest, o), o)), d, sums + x);
  }
}

// columns[r] = sums, then sums += row r that enters less row r that leaves.
template <int kR, bool kCodes, class Rows>
void MoveColumns(const Rows& leave, const Rows& enter, float largest, double offset,
                 double* HWY_RESTRICT sums, double* HWY_RESTRICT columns, ptrdiff_t stride) {
  const DD d;
  const auto o = hn::Set(d, offset);
  const float *out[kR], *in[kR];
  for (int r = 0; r < kR; ++r) {
    out[r] = leave[static_cast<size_t>(r)], in[r] = enter[static_cast<size_t>(r)];
  }
  for (ptrdiff_t x = 0; x < stride; x += kDoubles) {
    auto sum = hn::Load(d, sums + x);
    HWY_UNROLL(4)
    for (int r = 0; r < kR; ++r) {
      hn::Store(sum, d, columns + r * stride + x);
      sum = hn::Add(sum,
                    hn::Sub(OnGrid<kCodes>(in[r] + x, largest, o), OnGrid<kCodes>(out[r] + x, largest, o)));
    }
    hn::Store(sum, d, sums + x);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
