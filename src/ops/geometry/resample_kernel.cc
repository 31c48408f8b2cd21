// Separable resampling with sums in double and one rounding: four result rows at a time become columns of
// four RGBA pixels, so that the pass along the row has the same weight in every lane.
#include "ops/geometry/resample_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/geometry/resample_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/floats-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using F16 = s::Floats<16>;

// N doubles in as many vectors as the target needs; N is a multiple of 4.
template <int N>
struct Doubles {
  using Tag = hn::CappedTag<double, 8>;
  using FloatTag = hn::Rebind<float, Tag>;
  static constexpr int kLanesOf = static_cast<int>(hn::MaxLanes(Tag()));
  static constexpr int kVectors = (N + kLanesOf - 1) / kLanesOf;
  hn::Vec<Tag> v[kVectors];

  static HWY_INLINE Doubles Zero() {
    Doubles r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::Zero(Tag());
    return r;
  }
  static HWY_INLINE Doubles Load(const float* p) {
    Doubles r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::PromoteTo(Tag(), hn::LoadU(FloatTag(), p + i * kLanesOf));
    return r;
  }
  static HWY_INLINE Doubles Load(const double* p) {
    Doubles r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::LoadU(Tag(), p + i * kLanesOf);
    return r;
  }
  HWY_INLINE Doubles operator*(double w) const {
    Doubles r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::Mul(v[i], hn::Set(Tag(), w));
    return r;
  }
  HWY_INLINE void AddScaled(const Doubles& x, double w) {
    for (int i = 0; i < kVectors; ++i) v[i] = hn::MulAdd(x.v[i], hn::Set(Tag(), w), v[i]);
  }
  HWY_INLINE void Store(double* p) const {
    for (int i = 0; i < kVectors; ++i) hn::StoreU(v[i], Tag(), p + i * kLanesOf);
  }
};
using D8 = Doubles<8>;
using D16 = Doubles<16>;

// Sum of w[k] * p[k * stride]; 0 without taps. One tap of weight 1 is the value's own bits.
template <class Values, class T>
HWY_INLINE Values WeightedSum(const T* p, ptrdiff_t stride, const double* w, int count) {
  if (count == 0) return Values::Zero();
  Values sum = Values::Load(p) * w[0];
  for (int k = 1; k < count; ++k) sum.AddScaled(Values::Load(p + k * stride), w[k]);
  return sum;
}

// Sixteen doubles rounded once; every NaN becomes the same one.
HWY_INLINE F16 Rounded(const D16& x) {
  F16 r;
  const D16::FloatTag f;
  for (int i = 0; i < F16::kVectors; ++i) {
#if HWY_TARGET == HWY_SCALAR
    r.v[i] = hn::Set(f, static_cast<float>(hn::GetLane(x.v[i])));  // DemoteTo would make infinity finite
#else
    r.v[i] = hn::Combine(F16::Tag(), hn::DemoteTo(f, x.v[2 * i + 1]), hn::DemoteTo(f, x.v[2 * i]));
#endif
  }
  return r.OneNaN();
}

// Two pixels of row r into the columns, which hold four rows of a pixel each.
HWY_INLINE void StoreColumns(const D8& x, int r, double* columns) {
  if constexpr (D8::kLanesOf == 8) {
#if HWY_TARGET != HWY_SCALAR
    const hn::Half<D8::Tag> half;
    hn::StoreU(hn::LowerHalf(half, x.v[0]), half, columns + 4 * r);
    hn::StoreU(hn::UpperHalf(half, x.v[0]), half, columns + 16 + 4 * r);
#endif
  } else {
    for (int i = 0; i < D8::kVectors; ++i) {
      const int at = i * D8::kLanesOf;
      hn::StoreU(x.v[i], D8::Tag(), columns + at / 4 * 16 + 4 * r + at % 4);
    }
  }
}

// Along the columns, up to four result rows at a time; what rows are not there leave is not looked at.
struct Rows {
  const float* first[4];  // of the first tap, at the first column
  const double* weights[4];
  int count[4];
};

HWY_INLINE void ColumnsOfRgba(const Rows& rows, int height, ptrdiff_t stride, int pixels, double* columns) {
  // Two cache lines of a source row at a time: rows often lie whole pages apart and compete for the same sets
  // of L1, so that what is not used at once has to come again.
  constexpr int kPairs = 4;
  int done = 0;
  for (; done + 2 * kPairs <= pixels; done += 2 * kPairs) {
    for (int r = 0; r < height; ++r) {
      if (rows.count[r] == 0) {
        for (int i = 0; i < kPairs; ++i)
          StoreColumns(D8::Zero(), r, columns + ptrdiff_t{16} * (done + 2 * i));
        continue;
      }
      const float* p = rows.first[r] + ptrdiff_t{4} * done;
      D8 sum[kPairs];
      for (int i = 0; i < kPairs; ++i) sum[i] = D8::Load(p + 8 * i) * rows.weights[r][0];
      for (int k = 1; k < rows.count[r]; ++k) {
        p += stride;
        for (int i = 0; i < kPairs; ++i) sum[i].AddScaled(D8::Load(p + 8 * i), rows.weights[r][k]);
      }
      for (int i = 0; i < kPairs; ++i) StoreColumns(sum[i], r, columns + ptrdiff_t{16} * (done + 2 * i));
    }
  }
  for (int begin = done; begin < pixels; begin += 2) {
    const int x =
        pixels < 2 ? 0 : std::min(begin, pixels - 2);  // the last pair overlaps: nothing is read beyond
    for (int r = 0; r < height; ++r) {
      const D8 sum =
          WeightedSum<D8>(rows.first[r] + ptrdiff_t{4} * x, stride, rows.weights[r], rows.count[r]);
      StoreColumns(sum, r, columns + ptrdiff_t{16} * x);
    }
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

HWY_INLINE void StoreRow(const F16& pixels, float* to, bool stream) {
  if (stream && reinterpret_cast<uintptr_t>(to) % 64 == 0) {
    pixels.Stream(to);
  } else {
    pixels.Store(to);
  }
}

void ResampleRgba(const ResampleJob& job) {
  const Roi& roi = job.out.roi;
  int c0, c1;
  job.x.Range(roi.x0, roi.x1, &c0, &c1);
  c0 = std::max(std::min(c0, c1 - 2), job.in.roi.x0);
  const auto columns_size = static_cast<size_t>(c1 - c0 + 2) * 16;
  double* const columns = job.scratch.Allocate<double>(columns_size);
  if (roi.height() < 4) std::fill_n(columns, columns_size, 0.0);
  const ptrdiff_t stride = job.in.row_stride / 4;
  for (int y = roi.y0; y < roi.y1; y += 4) {
    const int height = std::min(4, roi.y1 - y);
    Rows rows;
    for (int r = 0; r < height; ++r) {
      const int at = y + r;
      rows.count[r] = job.y.Count(at);
      rows.weights[r] = job.y.Weights(at);
      rows.first[r] =
          rows.count[r] == 0 ? nullptr : reinterpret_cast<const float*>(job.in.At(c0, job.y.First(at)));
    }
    ColumnsOfRgba(rows, height, stride, c1 - c0, columns);
    for (int x = roi.x0; x < roi.x1; x += 4) {
      const int width = std::min(4, roi.x1 - x);
      F16 sum[4];
      FourPixels(job, columns, c0, x, width, sum);
      for (int r = 0; r < height; ++r) {
        auto* const to = reinterpret_cast<float*>(job.out.At(x, y + r));
        if (width == 4) {
          StoreRow(sum[r], to, job.stream);
        } else {
          float tail[16];
          sum[r].Store(tail);
          std::copy_n(tail, 4 * width, to);
        }
      }
    }
  }
}

// The mean of two by two RGBA pixels: bandwidth is all there is to it. In floats; three roundings.
void HalveRgba(const ResampleJob& job) {
  const Roi& roi = job.out.roi;
  using F8 = s::Floats<8>;
  for (int y = roi.y0; y < roi.y1; ++y) {
    const auto* const a =
        reinterpret_cast<const float*>(job.in.At(2 * roi.x0 + job.x.shift, 2 * y + job.y.shift));
    const float* const b = a + job.in.row_stride / 4;
    auto* const out = reinterpret_cast<float*>(job.out.At(roi.x0, y));
    int x = 0;
    for (; x + 4 <= roi.width(); x += 4) {
      F16 first = F16::Load(a + 8 * x) + F16::Load(b + 8 * x);
      F16 second = F16::Load(a + 8 * x + 16) + F16::Load(b + 8 * x + 16);
      s::PairPixels(first, second);
      StoreRow(((first + second) * 0.25f).OneNaN(), out + ptrdiff_t{4} * x, job.stream);
    }
    for (; x < roi.width(); ++x) {
      const F8 sum = F8::Load(a + 8 * x) + F8::Load(b + 8 * x);
      float pair[8];
      sum.Store(pair);
      for (int c = 0; c < 4; ++c) pair[c] = (pair[c] + pair[c + 4]) * 0.25f;
      s::Floats<4>::Load(pair).OneNaN().Store(out + ptrdiff_t{4} * x);
    }
  }
}

// Any number of channels: four of them at a time are packed as RGBA between the two passes.
void ResampleAny(const ResampleJob& job) {
  const Roi& roi = job.out.roi;
  const int channels = job.out.channels;
  int c0, c1;
  job.x.Range(roi.x0, roi.x1, &c0, &c1);
  c0 = std::max(std::min(c0, c1 - 8), job.in.roi.x0);
  const int floats = (c1 - c0) * channels;
  double* const row = job.scratch.Allocate<double>(static_cast<size_t>(floats) + 8);
  double* const columns = job.scratch.Allocate<double>(static_cast<size_t>(c1 - c0) * 16);
  std::fill_n(columns, static_cast<size_t>(c1 - c0) * 16, 0.0);
  const ptrdiff_t stride = job.in.row_stride / 4;
  for (int y = roi.y0; y < roi.y1; ++y) {
    const int count = job.y.Count(y);
    const auto* const first =
        count == 0 ? nullptr : reinterpret_cast<const float*>(job.in.At(c0, job.y.First(y)));
    for (int begin = 0; begin < floats; begin += 8) {
      const int i = floats < 8 ? 0 : std::min(begin, floats - 8);
      WeightedSum<D8>(first + i, stride, job.y.Weights(y), count).Store(row + i);
    }
    for (int c = 0; c < channels; c += 4) {
      const int width = std::min(4, channels - c);
      for (int x = 0; x < c1 - c0; ++x) {
        std::copy_n(row + ptrdiff_t{x} * channels + c, width, columns + ptrdiff_t{16} * x);
      }
      for (int x = roi.x0; x < roi.x1; ++x) {
        float pixel[16];
        const double* const from = columns + ptrdiff_t{16} * (job.x.First(x) - c0);
        Rounded(WeightedSum<D16>(from, 16, job.x.Weights(x), job.x.Count(x))).Store(pixel);
        std::copy_n(pixel, width, reinterpret_cast<float*>(job.out.At(x, y, c)));
      }
    }
  }
}

void Resample(const ResampleJob& job) {
  if (job.out.roi.empty()) return;
  if (job.out.channels != 4) {
    ResampleAny(job);
  } else if (job.x.halves && job.y.halves) {
    HalveRgba(job);
  } else {
    ResampleRgba(job);
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
