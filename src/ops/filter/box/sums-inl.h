// Sums over a sliding window as the end of one block plus the begin of the next, and means along rows.
#if defined(TESSERA_OPS_FILTER_BOX_SUMS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_BOX_SUMS_INL_H_
#undef TESSERA_OPS_FILTER_BOX_SUMS_INL_H_
#else
#define TESSERA_OPS_FILTER_BOX_SUMS_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <array>

#include "ops/filter/box/strips.h"
#include "ops/filter/codes/codes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

using SourceRows = std::array<const float*, kBoxRows>;

HWY_INLINE VD Sample(const float* p) { return hn::PromoteTo(DD(), hn::LoadU(DF(), p)); }

// ends[r] = the sum of rows r to the block's last one, for kR rows; `more`: ends[kR] is there.
template <int kR>
void SumEnds(const SourceRows& rows, bool more, double* HWY_RESTRICT ends, ptrdiff_t stride) {
  const DD d;
  const float* from[kR];
  for (int r = 0; r < kR; ++r) from[r] = rows[static_cast<size_t>(r)];
  for (ptrdiff_t x = 0; x < stride; x += kDoubles) {
    VD sum = more ? hn::Load(d, ends + kR * stride + x) : hn::Zero(d);
    HWY_UNROLL(4)
    for (int r = kR - 1; r >= 0; --r) {
      sum = hn::Add(sum, Sample(from[r] + x));
      hn::Store(sum, d, ends + r * stride + x);
    }
  }
}

// columns[r] = ends[r] + begin, then begin += row r of the next block.
template <int kR>
void SumColumns(const SourceRows& rows, const double* HWY_RESTRICT ends, double* HWY_RESTRICT begin,
                double* HWY_RESTRICT columns, ptrdiff_t stride) {
  const DD d;
  const float* from[kR];
  for (int r = 0; r < kR; ++r) from[r] = rows[static_cast<size_t>(r)];
  for (ptrdiff_t x = 0; x < stride; x += kDoubles) {
    VD sum = hn::Load(d, begin + x);
    HWY_UNROLL(4)
    for (int r = 0; r < kR; ++r) {
      hn::Store(hn::Add(hn::Load(d, ends + r * stride + x), sum), d, columns + r * stride + x);
      sum = hn::Add(sum, Sample(from[r] + x));
    }
    hn::Store(sum, d, begin + x);
  }
}

// What becomes of a sum: the mean of floats, anything, or for bytes the sum itself, which a float holds.
enum class Means { kFloats, kAny, kSums };
// Whether a strip's results are settled from sums.
inline bool KeepsSums(const BoxStrip& s) { return s.largest == 255 && s.row_factors == nullptr; }

// A mean as floats, from its sum; `scale` is the factor where it differs from pixel to pixel.
template <Means kMeans, class D>
HWY_INLINE hn::Vec<hn::Rebind<float, D>> MeanOf(D d, const BoxStrip& s, hn::Vec<D> sum, hn::Vec<D> factor,
                                                [[maybe_unused]] double scale) {
  if constexpr (kMeans == Means::kAny) {
    auto mean = hn::Mul(sum, s.column_factors == nullptr ? factor : hn::Set(d, scale));
    if (s.largest != 0) mean = hn::Mul(Settled(d, mean), hn::Set(d, 1.0 / double{s.largest}));
    return ToFloats(d, mean);
  } else if constexpr (kMeans == Means::kSums) {
    return hn::DemoteTo(hn::Rebind<float, D>(), sum);
  } else {
    return ToFloats(d, hn::Mul(sum, factor));
  }
}

// Rows of results, their factors where they have their own, and sums of columns.
struct MeanRows {
  const double* columns = nullptr;
  double* ends = nullptr;  // scratch memory
  std::array<float*, kBoxRows> out{};
  std::array<double, kBoxRows> factors{};
};

// Means of kR rows and the channels that lie in one vector of D.
template <class D, Means kMeans, int kR>
void BlockMeans(D d, const BoxStrip& s, const MeanRows& rows, int channel) {
  const hn::Rebind<float, D> f;
  constexpr ptrdiff_t kStep = static_cast<ptrdiff_t>(hn::MaxLanes(D()));
  const ptrdiff_t stride = s.stride(), pixel = s.in.channels;
  const auto factor = hn::Set(d, s.factor);
  const int width = s.width, count = s.count;
  const double* const columns = rows.columns + channel;
  for (int x0 = 0; x0 < count; x0 += width) {
    hn::Vec<D> sum[kR];
    const double* p = columns + (x0 + width - 1) * pixel;
    double* end = rows.ends + (width - 1) * kR * kStep;
    for (auto& v : sum) v = hn::Zero(d);
    for (int i = width; i > 0; --i, p -= pixel, end -= kR * kStep) {
      HWY_UNROLL(4)
      for (int r = 0; r < kR; ++r) {
        sum[r] = hn::Add(sum[r], hn::LoadU(d, p + r * stride));
        hn::Store(sum[r], d, end + r * kStep);
      }
    }
    for (auto& v : sum) v = hn::Zero(d);
    p = columns + (x0 + width) * pixel;
    end = rows.ends;
    const int last = std::min(width, count - x0);
    for (int i = 0; i < last; ++i, p += pixel, end += kR * kStep) {
      const double scale =
          kMeans == Means::kAny && s.column_factors != nullptr ? s.column_factors[s.first + x0 + i] : 1.0;
      HWY_UNROLL(4)
      for (int r = 0; r < kR; ++r) {
        const auto whole = hn::Add(hn::Load(d, end + r * kStep), sum[r]);
        sum[r] = hn::Add(sum[r], hn::LoadU(d, p + r * stride));
        const auto at = static_cast<size_t>(r);
        hn::StoreU(MeanOf<kMeans>(d, s, whole, factor, scale * rows.factors[at]), f,
                   rows.out[at] + (x0 + i) * pixel + channel);
      }
    }
  }
}

// The same where sums are exact.
template <class D, Means kMeans, int kR>
void RunningMeans(D d, const BoxStrip& s, const MeanRows& rows, int channel) {
  const hn::Rebind<float, D> f;
  const ptrdiff_t stride = s.stride(), pixel = s.in.channels, window = s.width * pixel;
  const auto factor = hn::Set(d, s.factor);
  const double* p = rows.columns + channel;
  float* to[kR];
  hn::Vec<D> sum[kR];
  for (int r = 0; r < kR; ++r) {
    to[r] = rows.out[static_cast<size_t>(r)] + channel;
    sum[r] = hn::Zero(d);
  }
  for (ptrdiff_t x = 0; x < window; x += pixel) {
    HWY_UNROLL(4)
    for (int r = 0; r < kR; ++r) sum[r] = hn::Add(sum[r], hn::LoadU(d, p + r * stride + x));
  }
  for (int x = 0; x < s.count; ++x, p += pixel) {
    const double scale =
        kMeans == Means::kAny && s.column_factors != nullptr ? s.column_factors[s.first + x] : 1.0;
    HWY_UNROLL(4)
    for (int r = 0; r < kR; ++r) {
      if constexpr (kMeans == Means::kFloats) {
        hn::StoreU(hn::DemoteTo(f, hn::Mul(sum[r], factor)), f, to[r] + x * pixel);  // no NaN is on a grid
      } else {
        hn::StoreU(MeanOf<kMeans>(d, s, sum[r], factor, scale * rows.factors[static_cast<size_t>(r)]), f,
                   to[r] + x * pixel);
      }
      const double* const column = p + r * stride;
      sum[r] = hn::Add(sum[r], hn::Sub(hn::LoadU(d, column + window), hn::LoadU(d, column)));
    }
  }
}

// Means of one row or kBoxRows rows.
template <bool kRunning>
void MeansOf(const BoxStrip& s, const MeanRows& rows, int count) {
  const auto run = [&]<class D, Means kMeans>(D d) {
    for (int c = 0; c < s.in.channels; c += static_cast<int>(hn::Lanes(d))) {
      if constexpr (kRunning) {
        count == kBoxRows ? RunningMeans<D, kMeans, kBoxRows>(d, s, rows, c)
                          : RunningMeans<D, kMeans, 1>(d, s, rows, c);
      } else {
        count == kBoxRows ? BlockMeans<D, kMeans, kBoxRows>(d, s, rows, c)
                          : BlockMeans<D, kMeans, 1>(d, s, rows, c);
      }
    }
  };
  // Four channels lie in one vector, or as many as there are lanes.
  const hn::CappedTag<double, 4> d4;
  const hn::CappedTag<double, 1> d1;
  const bool any = s.row_factors != nullptr || s.largest != 0;
  const auto all = [&]<class D>(D d) {
    if (kRunning && KeepsSums(s)) {
      run.template operator()<D, Means::kSums>(d);
    } else if (any) {
      run.template operator()<D, Means::kAny>(d);
    } else {
      run.template operator()<D, Means::kFloats>(d);
    }
  };
  // Sums that are exact may be taken with some of the next pixel's, which come after them and are the same.
  const int lanes = static_cast<int>(hn::Lanes(d4));
  if (s.in.channels % lanes == 0 || (kRunning && s.in.channels > 1 && s.in.channels < lanes)) {
    all(d4);
  } else {
    all(d1);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
