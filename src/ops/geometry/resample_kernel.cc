// Separable resampling with sums in double and one rounding: four result rows at a time become columns of
// four RGBA pixels, so that the pass along the row has the same weight in every lane.
#include "ops/geometry/resample_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/geometry/resample_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/geometry/resample_codes-inl.h"
#include "ops/geometry/resample_halves-inl.h"
#include "ops/geometry/resample_rows-inl.h"
#include "ops/geometry/resample_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Two pixels of row r into the columns, which hold four rows of a pixel each.
HWY_INLINE void StoreColumns(const D8& x, int r, double* columns) {
  if constexpr (D8::kLanesOf == 8) {
    const hn::Half<D8::Tag> half;
    hn::StoreU(hn::LowerHalf(half, x.v[0]), half, columns + 4 * r);
    hn::StoreU(hn::UpperHalf(half, x.v[0]), half, columns + 16 + 4 * r);
  } else {
    for (int i = 0; i < D8::kVectors; ++i) {
      const int at = i * D8::kLanesOf;
      hn::StoreU(x.v[i], D8::Tag(), columns + at / 4 * 16 + 4 * r + at % 4);
    }
  }
}

// Along the columns, up to four result rows at a time; what rows are not there leave is not looked at.
struct Rows {
  const float* source;  // the first source row that any of them reads, at the first column
  int sources;          // as many from there on
  int first[4];         // of those rows, the first that a result reads
  int count[4];
  const double* weights[4];
};

HWY_INLINE Rows RowsOf(const ResampleJob& job, int y, int height, int c0) {
  Rows rows;
  int begin, end;
  job.y.Range(y, y + height, &begin, &end);
  rows.sources = end - begin;
  rows.source = rows.sources == 0 ? nullptr : reinterpret_cast<const float*>(job.in.At(c0, begin));
  for (int r = 0; r < height; ++r) {
    rows.count[r] = job.y.Count(y + r);
    rows.weights[r] = job.y.Weights(y + r);
    rows.first[r] = rows.count[r] == 0 ? 0 : job.y.First(y + r) - begin;
  }
  return rows;
}

// kTogether rows from r0 on, of 2 kPairs pixels from sample x on. Sources that several of them read become
// doubles once.
template <int kTogether, int kPairs>
HWY_INLINE void SumsOfRows(const Rows& rows, int r0, ptrdiff_t stride, ptrdiff_t x, double* columns) {
  D8 sum[kTogether][kPairs];
  for (auto& row : sum) {
    for (D8& v : row) v = D8::Zero();
  }
  const int begin = kTogether == 1 ? rows.first[r0] : 0;
  const int end = kTogether == 1 ? begin + rows.count[r0] : rows.sources;
  const float* p = rows.sources == 0 ? nullptr : rows.source + begin * stride + x;
  for (int k = begin; k < end; ++k, p += stride) {
    D8 value[kPairs];
    for (int i = 0; i < kPairs; ++i) value[i] = D8::Load(p + 8 * i);
    for (int r = 0; r < kTogether; ++r) {
      const int tap = k - rows.first[r0 + r];
      if (tap < 0 || tap >= rows.count[r0 + r]) continue;
      const double w = rows.weights[r0 + r][tap];
      if (tap == 0) {
        for (int i = 0; i < kPairs; ++i) sum[r][i] = value[i] * w;
      } else {
        for (int i = 0; i < kPairs; ++i) sum[r][i].AddScaled(value[i], w);
      }
    }
  }
  for (int r = 0; r < kTogether; ++r) {
    for (int i = 0; i < kPairs; ++i) StoreColumns(sum[r][i], r0 + r, columns + 4 * x + ptrdiff_t{32} * i);
  }
}

HWY_INLINE void ColumnsOfRgba(const Rows& rows, int height, ptrdiff_t stride, int pixels, double* columns) {
  // Two cache lines of a source row at a time: rows often lie whole pages apart and compete for the same sets
  // of L1, so that what is not used at once has to come again. As many result rows as there are registers
  // for.
  constexpr int kPairs = 4, kTogether = D8::kLanesOf == 8 ? 4 : 1;
  int done = 0;
  for (; done + 2 * kPairs <= pixels; done += 2 * kPairs) {
    const ptrdiff_t x = ptrdiff_t{4} * done;
    int r = 0;
    for (; r + kTogether <= height; r += kTogether) {
      SumsOfRows<kTogether, kPairs>(rows, r, stride, x, columns);
    }
    for (; r < height; ++r) SumsOfRows<1, kPairs>(rows, r, stride, x, columns);
  }
  for (int begin = done; begin < pixels; begin += 2) {
    // The last pair overlaps: nothing is read beyond.
    const ptrdiff_t x = pixels < 2 ? 0 : ptrdiff_t{4} * std::min(begin, pixels - 2);
    for (int r = 0; r < height; ++r) SumsOfRows<1, 1>(rows, r, stride, x, columns);
  }
}

// Four result pixels of four rows.
HWY_INLINE void FourPixels(const ResampleJob& job, const double* columns, int column0, int x, int count,
                           F16 (&sum)[4]) {
  for (int i = 0; i < 4; ++i) {
    const int at = x + std::min(i, count - 1);
    const double* const first = columns + ptrdiff_t{16} * (job.x.First(at) - column0);
    sum[i] = Rounded(WeightedSum<D16>(first, 16, job.x.Weights(at), job.x.Count(at)));
  }
  s::TransposePixels(sum[0], sum[1], sum[2], sum[3]);
}

void ResampleRgba(const ResampleJob& job) {
  const Roi& roi = job.out.roi;
  int c0, c1;
  job.x.Range(roi.x0, roi.x1, &c0, &c1);
  // Beyond a black border there are no rows or no columns to read, and the input is any region.
  if (c0 < c1) c0 = std::max(std::min(c0, c1 - 2), std::min(c0, job.in.roi.x0));
  const auto columns_size = static_cast<size_t>(c1 - c0 + 2) * 16;
  double* const columns = job.scratch.Allocate<double>(columns_size);
  if (roi.height() < 4) std::fill_n(columns, columns_size, 0.0);
  const ptrdiff_t stride = job.in.row_stride / 4;
  for (int y = roi.y0; y < roi.y1; y += 4) {
    const int height = std::min(4, roi.y1 - y);
    const Rows rows = RowsOf(job, y, height, c0);
    ColumnsOfRgba(rows, height, stride, c1 - c0, columns);
    for (int x = roi.x0; x < roi.x1; x += 4) {
      const int width = std::min(4, roi.x1 - x);
      F16 sum[4];
      FourPixels(job, columns, c0, x, width, sum);
      for (int r = 0; r < height; ++r) {
        auto* const to = reinterpret_cast<float*>(job.out.At(x, y + r));
        if (width == 4) {
          StoreSixteen(sum[r], to, job.stream);
        } else {
          float tail[16];
          sum[r].Store(tail);
          std::copy_n(tail, 4 * width, to);
        }
      }
    }
  }
}

void Resample(const ResampleJob& job) {
  if (job.out.roi.empty()) return;
  const int channels = job.out.channels;
  if (job.out.type == PixelType::kUint8) {
    HalveCodes<uint8_t>(job);
  } else if (job.out.type == PixelType::kUint16) {
    HalveCodes<uint16_t>(job);
  } else if (job.x.halves && job.y.halves) {
    (channels == 4 ? HalveRgba : channels == 1 ? HalveGrey : HalveAny)(job);
  } else if (job.x.moves) {
    ResampleDown(job);
  } else {
    switch (channels) {
      case 1:
        return ResampleRows<1>(job);
      case 2:
        return ResampleRows<2>(job);
      case 3:
        return ResampleRows<3>(job);
      case 4:
        return ResampleRgba(job);
      default:
        return ResampleRows<0>(job);
    }
  }
}

ResampleFunction ResampleOfTarget() { return &Resample; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(ResampleOfTarget);

ResampleFunction ChooseResample() { return HWY_DYNAMIC_DISPATCH(ResampleOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
