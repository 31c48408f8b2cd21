// The separable resampling of pixels of any number of channels: sixteen result rows at a time become columns,
// so that the pass along the row has the same weight in every lane whatever the channels are.
#if defined(TESSERA_OPS_GEOMETRY_RESAMPLE_ROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_GEOMETRY_RESAMPLE_ROWS_INL_H_
#undef TESSERA_OPS_GEOMETRY_RESAMPLE_ROWS_INL_H_
#else
#define TESSERA_OPS_GEOMETRY_RESAMPLE_ROWS_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>

#include "ops/geometry/resample_kernel.h"
#include "ops/geometry/resample_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kRows = 16;
// Samples of a row that are summed side by side: eight vectors hide the latency of the additions.
constexpr int kBlock = std::clamp(8 * D16::kLanesOf, 16, 32);
// What is left is read this many at a time, up to 64 bytes beyond the end of the row.
constexpr int kTail = 16;
// Source rows that are worth keeping as doubles: more would leave the nearest cache.
constexpr int kStripRows = 128;

// The result rows of a block: what they take down the columns.
struct RowTaps {
  int height;
  int first_row, rows;  // source rows that any of them reads
  bool shared;          // most source rows serve several results: they are made doubles once
  int first[kRows], count[kRows];
  const double* weights[kRows];

  // The first of those rows at column x.
  const float* Source(const ConstImageView& in, int x) const {
    return rows == 0 ? nullptr : reinterpret_cast<const float*>(in.At(x, first_row));
  }
  // Of them, the first that result row r reads.
  ptrdiff_t Row(int r) const { return count[r] == 0 ? 0 : first[r] - first_row; }
};

HWY_INLINE RowTaps TapsOfRows(const AxisTaps& y, int y0, int height) {
  RowTaps t;
  t.height = height;
  int end;
  y.Range(y0, y0 + height, &t.first_row, &end);
  t.rows = end - t.first_row;
  int64_t taps = 0;
  for (int r = 0; r < height; ++r) {
    t.first[r] = y.First(y0 + r);
    t.count[r] = y.Count(y0 + r);
    t.weights[r] = y.Weights(y0 + r);
    taps += t.count[r];
  }
  t.shared = t.rows <= kStripRows && 2 * taps >= 3 * int64_t{t.rows};
  return t;
}

// The samples after those: rows lie far apart, and too little of each is read at once for the processor to
// see where it goes on.
template <int N>
HWY_INLINE void PrefetchNext(const RowTaps& taps, const float* source, ptrdiff_t stride) {
  for (int k = 0; k < taps.rows; ++k) {
    // Where they begin amid a cache line it is there already.
    const float* const next = source + k * stride + N;
    for (int i = 15; i < N; i += 16) hwy::Prefetch(next + i);
  }
}

// Down the columns: N samples of every result row, of rows that have source rows in common.
template <int N, class Use>
HWY_INLINE void SharedSums(const RowTaps& taps, const float* source, ptrdiff_t stride, double* strip,
                           Use use) {
  PrefetchNext<N>(taps, source, stride);
  for (int k = 0; k < taps.rows; ++k) Doubles<N>::Load(source + k * stride).Store(strip + N * k);
  for (int r = 0; r < taps.height; ++r) {
    const double* const first = strip + N * taps.Row(r);
    use(r, WeightedSum<Doubles<N>>(first, N, taps.weights[r], taps.count[r]));
  }
}

// The same of one row.
template <int N>
HWY_INLINE Doubles<N> SumDown(const RowTaps& taps, int r, const float* source, ptrdiff_t stride) {
  return WeightedSum<Doubles<N>>(source + taps.Row(r) * stride, stride, taps.weights[r], taps.count[r]);
}

// N doubles of kRows rows become N columns of kRows.
template <int N>
HWY_INLINE void TransposeRows(const double* HWY_RESTRICT rows, ptrdiff_t stride,
                              double* HWY_RESTRICT columns) {
  using Tag = hn::CappedTag<double, 4>;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(Tag()));
  [[maybe_unused]] const Tag d;
  for (int i = 0; i < N; i += kLanes) {
    for (int r = 0; r < kRows; r += kLanes) {
      const double* const from = rows + stride * r + i;
      double* const to = columns + kRows * i + r;
      const auto a = hn::Load(d, from), b = hn::Load(d, from + stride);
      if constexpr (kLanes == 2) {
        hn::Store(hn::InterleaveLower(d, a, b), d, to);
        hn::Store(hn::InterleaveUpper(d, a, b), d, to + kRows);
      } else {
        const auto e = hn::Load(d, from + 2 * stride), f = hn::Load(d, from + 3 * stride);
        const auto ab0 = hn::InterleaveLower(d, a, b), ab1 = hn::InterleaveUpper(d, a, b);
        const auto ef0 = hn::InterleaveLower(d, e, f), ef1 = hn::InterleaveUpper(d, e, f);
        hn::Store(hn::ConcatLowerLower(d, ef0, ab0), d, to);
        hn::Store(hn::ConcatLowerLower(d, ef1, ab1), d, to + kRows);
        hn::Store(hn::ConcatUpperUpper(d, ef0, ab0), d, to + 2 * kRows);
        hn::Store(hn::ConcatUpperUpper(d, ef1, ab1), d, to + 3 * kRows);
      }
    }
  }
}

// Four samples of sixteen rows, as columns, to the rows' lines.
HWY_INLINE void StoreLines(const float* HWY_RESTRICT columns, float* HWY_RESTRICT lines, ptrdiff_t stride) {
  const hn::Full128<float> f;
  const hn::Full128<double> d;
  for (int r = 0; r < kRows; r += 4) {
    const auto a = hn::Load(f, columns + r), b = hn::Load(f, columns + kRows + r);
    const auto x = hn::Load(f, columns + 2 * kRows + r), y = hn::Load(f, columns + 3 * kRows + r);
    const auto ab0 = hn::BitCast(d, hn::InterleaveLower(f, a, b)),
               ab1 = hn::BitCast(d, hn::InterleaveUpper(f, a, b)),
               xy0 = hn::BitCast(d, hn::InterleaveLower(f, x, y)),
               xy1 = hn::BitCast(d, hn::InterleaveUpper(f, x, y));
    float* const to = lines + r * stride;
    hn::Store(hn::BitCast(f, hn::InterleaveLower(d, ab0, xy0)), f, to);
    hn::Store(hn::BitCast(f, hn::InterleaveUpper(d, ab0, xy0)), f, to + stride);
    hn::Store(hn::BitCast(f, hn::InterleaveLower(d, ab1, xy1)), f, to + 2 * stride);
    hn::Store(hn::BitCast(f, hn::InterleaveUpper(d, ab1, xy1)), f, to + 3 * stride);
  }
}

// Results [x0, x1) of kRows rows from their columns, of which the first is source column c0.
template <int kChannels>  // 0: as many as job.out has
HWY_INLINE void SumsAlong(const ResampleJob& job, const double* columns, int c0, int x0, int x1, float* lines,
                          ptrdiff_t stride) {
  // As many channels as leave registers for the sums.
  constexpr int kTogether = D16::kLanesOf < 4 ? 1 : kChannels == 4 ? 2 : std::max(1, kChannels);
  const int channels = kChannels > 0 ? kChannels : job.out.channels;
  const ptrdiff_t pixel = ptrdiff_t{kRows} * channels;
  HWY_ALIGN float rounded[kRows * 4];
  int filled = 0;
  for (int x = x0; x < x1; ++x) {
    const double* const first = columns + pixel * (job.x.First(x) - c0);
    const double* const weights = job.x.Weights(x);
    const int count = job.x.Count(x);
    for (int c = 0; c < channels; c += kTogether) {
      const auto sum = WeightedSum<Doubles<kRows * kTogether>>(first + kRows * c, pixel, weights, count);
      for (int k = 0; k < kTogether; ++k) {
        Rounded(sum.template Part<kRows>(k)).Store(rounded + kRows * filled);
        if (++filled < 4) continue;
        StoreLines(rounded, lines, stride);
        lines += 4;
        filled = 0;
      }
    }
  }
  if (filled > 0) StoreLines(rounded, lines, stride);
}

// How many results of a row are made at a time: their columns stay in the nearest caches, and what neighbours
// both read is little of it.
HWY_INLINE int ResultsAtATime(const ResampleJob& job, int columns) {
  constexpr int64_t kSamples = 320, kUnit = 16;
  const int64_t samples = std::max<int64_t>(1, int64_t{columns} * job.out.channels);
  return static_cast<int>(
      std::clamp(kSamples * job.out.roi.width() / samples / kUnit * kUnit, 2 * kUnit, 32 * kUnit));
}

// What Columns works with.
struct Buffers {
  double* strip;  // source rows
  double* sums;   // of kRows rows; those of rows that are not there are not looked at
  ptrdiff_t stride;
};

template <int N>
HWY_INLINE void SharedColumns(const RowTaps& taps, const float* source, ptrdiff_t stride,
                              const Buffers& buffers, double* columns) {
  double* const sums = buffers.sums;
  SharedSums<N>(taps, source, stride, buffers.strip,
                [&](int r, const Doubles<N>& sum) HWY_ATTR { sum.Store(sums + N * r); });
  TransposeRows<N>(sums, N, columns);
}

// The columns of samples from `source` on.
HWY_INLINE void Columns(const RowTaps& taps, const float* source, ptrdiff_t stride, int samples,
                        const Buffers& buffers, double* columns) {
  const int blocks = samples / kBlock * kBlock;
  if (taps.shared) {
    for (int i = 0; i < blocks; i += kBlock) {
      SharedColumns<kBlock>(taps, source + i, stride, buffers, columns + ptrdiff_t{kRows} * i);
    }
    for (int i = blocks; i < samples; i += kTail) {
      SharedColumns<kTail>(taps, source + i, stride, buffers, columns + ptrdiff_t{kRows} * i);
    }
    return;
  }
  // Every source row is read along its length before the next ones.
  for (int r = 0; r < taps.height; ++r) {
    double* const sums = buffers.sums + buffers.stride * r;
    for (int i = 0; i < blocks; i += kBlock) SumDown<kBlock>(taps, r, source + i, stride).Store(sums + i);
    for (int i = blocks; i < samples; i += kTail) SumDown<kTail>(taps, r, source + i, stride).Store(sums + i);
  }
  for (int i = 0; i < samples; i += kTail) {
    TransposeRows<kTail>(buffers.sums + i, buffers.stride, columns + ptrdiff_t{kRows} * i);
  }
}

template <int kChannels>  // 0: as many as job.out has
inline void ResampleRows(const ResampleJob& job) {
  const Roi& roi = job.out.roi;
  const int channels = job.out.channels;
  int c0, c1;
  job.x.Range(roi.x0, roi.x1, &c0, &c1);
  const int step = ResultsAtATime(job, c1 - c0);
  const int parts = (roi.width() + step - 1) / step;
  int* const begins = job.scratch.Allocate<int>(2 * static_cast<size_t>(parts));
  int* const ends = begins + parts;
  int widest = 0;
  for (int k = 0; k < parts; ++k) {
    const int x = roi.x0 + k * step;
    job.x.Range(x, std::min(x + step, roi.x1), &begins[k], &ends[k]);
    widest = std::max(widest, ends[k] - begins[k]);
  }
  // Rows of sums begin at whole vectors, and at different sets of the nearest cache.
  const size_t room = (static_cast<size_t>(widest) * static_cast<size_t>(channels) / kTail + 2) * kTail +
                      base::kAlignment / 8;
  double* const columns = job.scratch.Allocate<double>(kRows * room);
  const Buffers buffers{job.scratch.Allocate<double>(size_t{kBlock} * kStripRows),
                        job.scratch.Allocate<double>(kRows * room), static_cast<ptrdiff_t>(room)};
  if (roi.height() < kRows) std::fill_n(buffers.sums, kRows * room, 0.0);
  const ptrdiff_t line = ptrdiff_t{step} * channels + 16;
  float* const lines = job.scratch.Allocate<float>(static_cast<size_t>(line) * kRows);
  const ptrdiff_t stride = job.in.row_stride / 4;
  for (int y = roi.y0; y < roi.y1; y += kRows) {
    const RowTaps taps = TapsOfRows(job.y, y, std::min(kRows, roi.y1 - y));
    for (int k = 0; k < parts; ++k) {
      const int x = roi.x0 + k * step, end = std::min(x + step, roi.x1);
      c0 = begins[k];
      const int samples = (ends[k] - c0) * channels;
      if (samples > 0) Columns(taps, taps.Source(job.in, c0), stride, samples, buffers, columns);
      SumsAlong<kChannels>(job, columns, c0, x, end, lines, line);
      for (int r = 0; r < taps.height; ++r) {
        StoreLine(lines + line * r, (end - x) * channels, reinterpret_cast<float*>(job.out.At(x, y + r)),
                  job.stream);
      }
    }
  }
}

// N sums to a row of results, of which `count` are left.
template <int N>
HWY_INLINE void StoreSums(const Doubles<N>& sum, float* to, int count, bool stream) {
  for (int k = 0; k < N / 16; ++k) {
    const F16 values = Rounded(sum.template Part<16>(k));
    if (count >= N) {
      StoreSixteen(values, to + 16 * k, stream);
    } else {
      float tail[16];
      values.Store(tail);
      std::copy_n(tail, std::clamp(count - 16 * k, 0, 16), to + 16 * k);
    }
  }
}

template <int N>
HWY_INLINE void StoreDown(const ResampleJob& job, const RowTaps& taps, int y, const float* source, int from,
                          int to, double* strip) {
  const ptrdiff_t stride = job.in.row_stride / 4;
  const auto row = [&](int r) { return reinterpret_cast<float*>(job.out.At(job.out.roi.x0, y + r)); };
  if (taps.shared) {
    for (int i = from; i < to; i += N) {
      SharedSums<N>(taps, source + i, stride, strip, [&](int r, const Doubles<N>& sum) HWY_ATTR {
        StoreSums(sum, row(r) + i, to - i, job.stream);
      });
    }
    return;
  }
  for (int r = 0; r < taps.height; ++r) {
    for (int i = from; i < to; i += N) {
      StoreSums(SumDown<N>(taps, r, source + i, stride), row(r) + i, to - i, job.stream);
    }
  }
}

// Where every result along the row is a pixel as it is: what comes down the columns is rounded and stored.
inline void ResampleDown(const ResampleJob& job) {
  const Roi& roi = job.out.roi;
  double* const strip = job.scratch.Allocate<double>(size_t{kBlock} * kStripRows);
  const int samples = roi.width() * job.out.channels, blocks = samples / kBlock * kBlock;
  for (int y = roi.y0; y < roi.y1; y += kRows) {
    const RowTaps taps = TapsOfRows(job.y, y, std::min(kRows, roi.y1 - y));
    const float* const source = taps.Source(job.in, roi.x0 + job.x.shift);
    StoreDown<kBlock>(job, taps, y, source, 0, blocks, strip);
    StoreDown<kTail>(job, taps, y, source, blocks, samples, strip);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
