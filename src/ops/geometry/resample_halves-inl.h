// Halving both sides by a box: bandwidth is all there is to it.
#if defined(TESSERA_OPS_GEOMETRY_RESAMPLE_HALVES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_GEOMETRY_RESAMPLE_HALVES_INL_H_
#undef TESSERA_OPS_GEOMETRY_RESAMPLE_HALVES_INL_H_
#else
#define TESSERA_OPS_GEOMETRY_RESAMPLE_HALVES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "ops/geometry/resample_kernel.h"
#include "ops/geometry/resample_sums-inl.h"
#include "simd/shuffle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Thirty-two floats in order: the even ones to `first`, the odd ones to `second`.
HWY_INLINE void PairSamples(F16& first, F16& second) {
  const F16 a = first, b = second;
  const F16::Tag t;
  if constexpr (F16::kVectors == 1) {
    first.v[0] = hn::ConcatEven(t, b.v[0], a.v[0]);
    second.v[0] = hn::ConcatOdd(t, b.v[0], a.v[0]);
  } else {
    constexpr int kHalf = F16::kVectors / 2;
    for (int i = 0; i < kHalf; ++i) {
      first.v[i] = hn::ConcatEven(t, a.v[2 * i + 1], a.v[2 * i]);
      first.v[i + kHalf] = hn::ConcatEven(t, b.v[2 * i + 1], b.v[2 * i]);
      second.v[i] = hn::ConcatOdd(t, a.v[2 * i + 1], a.v[2 * i]);
      second.v[i + kHalf] = hn::ConcatOdd(t, b.v[2 * i + 1], b.v[2 * i]);
    }
  }
}

// A mean of four samples that is one of four codes half way between two codes, beside it on the side of the
// even one: a sink then rounds it so. Others stay: they lie a quarter of a code from there at least, and four
// codes as floats sum to no more than four parts in 2^24 beside.
template <int N>
HWY_INLINE s::Floats<N> Settled(s::Floats<N> mean, int largest) {
  if (largest == 0) return mean;
  using Tag = typename s::Floats<N>::Tag;
  const Tag d;
  const auto all = hn::Set(d, static_cast<float>(largest)), half = hn::Set(d, 0.5f);
  for (auto& v : mean.v) {
    const auto four = hn::Mul(v, hn::Set(d, static_cast<float>(4 * largest))), sum = hn::Round(four);
    const auto code = hn::Mul(sum, hn::Set(d, 0.25f)), even = hn::Round(code), rest = hn::Sub(code, even);
    const auto tie = hn::And(hn::Eq(hn::Abs(rest), half),
                             hn::Le(hn::Abs(hn::Sub(four, sum)), hn::Mul(sum, hn::Set(d, 0x1.8p-22f))));
    const auto aside = hn::NegMulAdd(hn::Add(even, half), hn::Set(d, 0x1.8p-23f), half);
    v = hn::IfThenElse(tie, hn::Div(hn::Add(even, hn::CopySign(aside, rest)), all), v);
  }
  return mean;
}

// A quarter of what `sum` makes of the samples that it loads by its argument, marked where it is not finite.
// Such rows are taken again, carefully: there it is the sum of the samples' quarters, which overflows only
// where the mean does, but is not exact for the smallest samples.
template <bool kCareful, class F, class Sum>
HWY_INLINE F MeanOfFour(const Sum& sum, F& marks) {
  const F mean = sum([](const float* p) HWY_ATTR { return F::Load(p); }) * 0.25f;
  if constexpr (kCareful)
    return mean.FiniteOr(sum([](const float* p) HWY_ATTR { return F::Scaled(p, 0.25f); })).OneNaN();
  marks.MarkUnlessFinite(mean);
  return mean.OneNaN();
}

// The same of four samples.
inline float MeanOfFour(float a, float b, float c, float d) {
  const float sum = (a + b) + (c + d);
  if (std::isfinite(sum)) return sum * 0.25f;
  return (a * 0.25f + b * 0.25f) + (c * 0.25f + d * 0.25f);
}

// The sums of pixels side by side, of eight.
HWY_INLINE F16 PairSums(const F16& first, const F16& second) {
  if constexpr (F16::kVectors == 1) {
    F16 sum;
    sum.v[0] = hn::Add(s::EvenBlocks(first.v[0], second.v[0]), s::OddBlocks(first.v[0], second.v[0]));
    return sum;
  }
  F16 even = first, odd = second;
  s::PairPixels(even, odd);
  return even + odd;
}

// The means of two by two RGBA pixels, of the rows at a and b, in floats: three roundings. Whether all are
// finite.
template <bool kCareful>
HWY_INLINE bool HalveRgbaRow(const ResampleJob& job, const float* a, const float* b, float* out) {
  const int width = job.out.roi.width(), largest = job.largest;
  F16 marks = F16::Zero();
  const auto mean = [&](int x) HWY_ATTR {
    const auto sum = [=](const auto& load) HWY_ATTR {
      const F16 first = load(a + 8 * x) + load(b + 8 * x);
      const F16 second = load(a + 8 * x + 16) + load(b + 8 * x + 16);
      return PairSums(first, second);
    };
    return MeanOfFour<kCareful>(sum, marks);
  };
  int x = 0;
  if (largest == 0 && job.stream && reinterpret_cast<uintptr_t>(out) % 64 == 0) {
    for (; x + 4 <= width; x += 4) mean(x).Stream(out + ptrdiff_t{4} * x);
  } else {
    for (; x + 4 <= width; x += 4)
      StoreSixteen(Settled(mean(x), largest), out + ptrdiff_t{4} * x, job.stream);
  }
  for (; x < width; ++x) {
    const float *const p = a + 8 * x, *const q = b + 8 * x;
    float rest[4];
    for (int c = 0; c < 4; ++c) rest[c] = MeanOfFour(p[c], q[c], p[c + 4], q[c + 4]);
    Settled(s::Floats<4>::Load(rest).OneNaN(), largest).Store(out + ptrdiff_t{4} * x);
  }
  return marks.Unmarked();
}

// The same of one channel.
template <bool kCareful>
HWY_INLINE bool HalveGreyRow(const ResampleJob& job, const float* a, const float* b, float* out) {
  const int width = job.out.roi.width();
  F16 marks = F16::Zero();
  int x = 0;
  for (; x + 16 <= width; x += 16) {
    const auto sum = [=](const auto& load) HWY_ATTR {
      F16 first = load(a + 2 * x) + load(b + 2 * x), second = load(a + 2 * x + 16) + load(b + 2 * x + 16);
      PairSamples(first, second);
      return first + second;
    };
    StoreSixteen(Settled(MeanOfFour<kCareful>(sum, marks), job.largest), out + x, job.stream);
  }
  for (; x < width; ++x) {
    const float sum[4] = {MeanOfFour(a[2 * x], b[2 * x], a[2 * x + 1], b[2 * x + 1])};
    float mean[4];
    Settled(s::Floats<4>::Load(sum).OneNaN(), job.largest).Store(mean);
    out[x] = mean[0];
  }
  return marks.Unmarked();
}

// The same of any number of channels: four lanes at a time, of which the next pixel overwrites what is too
// much.
template <bool kCareful>
HWY_INLINE bool HalveAnyRow(const ResampleJob& job, const float* a, const float* b, float* out, float* line,
                            int pixels) {
  const int width = job.out.roi.width(), channels = job.out.channels;
  using F4 = s::Floats<4>;
  F4 marks = F4::Zero();
  for (int x = 0; x < width; x += pixels) {
    const int count = channels * std::min(pixels, width - x);
    for (int i = 0; i < count; i += channels) {
      const ptrdiff_t from = 2 * (ptrdiff_t{x} * channels + i);
      for (int c = 0; c < channels; c += 4) {
        const float *const p = a + from + c, *const q = b + from + c;
        const auto sum = [=](const auto& load) HWY_ATTR {
          return (load(p) + load(q)) + (load(p + channels) + load(q + channels));
        };
        Settled(MeanOfFour<kCareful>(sum, marks), job.largest).Store(line + i + c);
      }
    }
    StoreLine(line, count, out + ptrdiff_t{x} * channels, job.stream);
  }
  return marks.Unmarked();
}

// Every row of the result by row(careful, a, b, out), from the two of the source.
template <class Row>
HWY_INLINE void HalveRows(const ResampleJob& job, const Row& row) {
  const Roi& roi = job.out.roi;
  for (int y = roi.y0; y < roi.y1; ++y) {
    const auto* const a =
        reinterpret_cast<const float*>(job.in.At(2 * roi.x0 + job.x.shift, 2 * y + job.y.shift));
    const float* const b = a + job.in.row_stride / 4;
    auto* const out = reinterpret_cast<float*>(job.out.At(roi.x0, y));
    if (!row(std::false_type(), a, b, out)) row(std::true_type(), a, b, out);
  }
}

inline void HalveRgba(const ResampleJob& job) {
  HalveRows(job, [&](auto careful, const float* a, const float* b, float* out)
                     HWY_ATTR { return HalveRgbaRow<careful()>(job, a, b, out); });
}

inline void HalveGrey(const ResampleJob& job) {
  HalveRows(job, [&](auto careful, const float* a, const float* b, float* out)
                     HWY_ATTR { return HalveGreyRow<careful()>(job, a, b, out); });
}

inline void HalveAny(const ResampleJob& job) {
  constexpr int kPixels = 64;
  float* const line = job.scratch.Allocate<float>(static_cast<size_t>(kPixels) * job.out.channels + 4);
  HalveRows(job, [&](auto careful, const float* a, const float* b, float* out)
                     HWY_ATTR { return HalveAnyRow<careful()>(job, a, b, out, line, kPixels); });
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
