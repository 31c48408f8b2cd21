// Batched complex Fourier transforms: each lane is a column, so that no butterfly crosses lanes.
//
// A forward transform leaves its results in an order of its own (digits of the index reversed), which the
// inverse takes back: enough for convolution, where spectra are only multiplied. Radix 4 with one step of
// radix 2 where the length is no power of 4. Unnormalised both ways: together they multiply by the length. T
// is float or double.
#if defined(TESSERA_SIMD_FFT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_FFT_INL_H_
#undef TESSERA_SIMD_FFT_INL_H_
#else
#define TESSERA_SIMD_FFT_INL_H_
#endif

#include <hwy/highway.h>

#include <type_traits>

#include "simd/math-inl.h"
#include "simd/pixels-inl.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

template <class T>
using FftTag = std::conditional_t<std::is_same_v<T, float>, D, DD>;

template <class Vec>
struct Complex {
  Vec re, im;
};
template <class Vec>
HWY_INLINE Complex<Vec> operator+(const Complex<Vec>& a, const Complex<Vec>& b) {
  return {hn::Add(a.re, b.re), hn::Add(a.im, b.im)};
}
template <class Vec>
HWY_INLINE Complex<Vec> operator-(const Complex<Vec>& a, const Complex<Vec>& b) {
  return {hn::Sub(a.re, b.re), hn::Sub(a.im, b.im)};
}
// a times (c + i s), or times its conjugate.
template <bool kConjugate, class Vec>
HWY_INLINE Complex<Vec> Twiddle(const Complex<Vec>& a, Vec c, Vec s) {
  if (kConjugate) return {hn::MulAdd(a.im, s, hn::Mul(a.re, c)), hn::NegMulAdd(a.re, s, hn::Mul(a.im, c))};
  return {hn::NegMulAdd(a.im, s, hn::Mul(a.re, c)), hn::MulAdd(a.re, s, hn::Mul(a.im, c))};
}

// One vector of columns of `length` rows, in place. `twiddles` holds cos and sin of -2 pi j / length for j <
// length.
template <class T>
struct Columns {
  using Value = Complex<hn::Vec<FftTag<T>>>;
  T* re;
  T* im;
  ptrdiff_t stride;
  HWY_INLINE Value Get(int n) const {
    const FftTag<T> d;
    return {hn::LoadU(d, re + n * stride), hn::LoadU(d, im + n * stride)};
  }
  HWY_INLINE void Put(int n, const Value& v) const {
    const FftTag<T> d;
    hn::StoreU(v.re, d, re + n * stride);
    hn::StoreU(v.im, d, im + n * stride);
  }
};

// The four points at j, j + q, j + 2q, j + 3q of a block of 4q, forward or back.
template <bool kInverse, class T>
HWY_INLINE void Butterfly4(const Columns<T>& x, int base, int q, const T* w, int step) {
  using Value = typename Columns<T>::Value;
  const FftTag<T> d;
  for (int j = 0; j < q; ++j) {
    const int n = base + j;
    Value a = x.Get(n), b = x.Get(n + q), c = x.Get(n + 2 * q), e = x.Get(n + 3 * q);
    const auto twiddled = [&](const Value& v, int k) HWY_ATTR {
      if (j == 0) return v;
      const T* t = w + 2 * (k * j * step);
      return Twiddle<kInverse>(v, hn::Set(d, t[0]), hn::Set(d, t[1]));
    };
    if constexpr (kInverse) b = twiddled(b, 1), c = twiddled(c, 2), e = twiddled(e, 3);
    if constexpr (kInverse) {
      // Blocks hold the residues 0, 1, 2, 3 of the frequency.
      const Value t0 = a + c, t1 = a - c, t2 = b + e, t3 = b - e;
      const Value i{hn::Neg(t3.im), t3.re};
      x.Put(n, t0 + t2), x.Put(n + q, t1 + i), x.Put(n + 2 * q, t0 - t2), x.Put(n + 3 * q, t1 - i);
    } else {
      const Value t0 = a + c, t1 = a - c, t2 = b + e, t3 = b - e;
      const Value i{t3.im, hn::Neg(t3.re)};
      x.Put(n, t0 + t2), x.Put(n + q, twiddled(t1 + i, 1)), x.Put(n + 2 * q, twiddled(t0 - t2, 2));
      x.Put(n + 3 * q, twiddled(t1 - i, 3));
    }
  }
}

template <class T>
HWY_INLINE void Butterflies2(const Columns<T>& x, int length) {
  for (int n = 0; n < length; n += 2) {
    const auto a = x.Get(n), b = x.Get(n + 1);
    x.Put(n, a + b), x.Put(n + 1, a - b);
  }
}

template <class T>
HWY_INLINE void ForwardColumns(const Columns<T>& x, int length, const T* twiddles) {
  int block = length;
  for (; block >= 4; block /= 4) {
    for (int base = 0; base < length; base += block)
      Butterfly4<false>(x, base, block / 4, twiddles, length / block);
  }
  if (block == 2) Butterflies2(x, length);
}

template <class T>
HWY_INLINE void InverseColumns(const Columns<T>& x, int length, const T* twiddles) {
  int block = length;
  while (block >= 4) block /= 4;
  if (block == 2) Butterflies2(x, length);
  for (block *= 4; block <= length; block *= 4) {
    for (int base = 0; base < length; base += block)
      Butterfly4<true>(x, base, block / 4, twiddles, length / block);
  }
}

// Where a forward transform leaves a frequency.
constexpr int RowOfFrequency(int frequency, int length) {
  if (length <= 2) return frequency;
  return frequency % 4 * (length / 4) + RowOfFrequency(frequency / 4, length / 4);
}

// to(x, y) = from(y, x) for `rows` by `columns` (multiples of 4) of `from`.
HWY_INLINE void Transpose(const float* from, ptrdiff_t from_stride, float* to, ptrdiff_t to_stride, int rows,
                          int columns) {
  const hn::CappedTag<float, 4> d;
  const hn::Repartition<double, decltype(d)> dd;
  for (int y = 0; y < rows; y += 4) {
    for (int x = 0; x < columns; x += 4) {
      const float* p = from + y * from_stride + x;
      const auto a = hn::LoadU(d, p), b = hn::LoadU(d, p + from_stride),
                 c = hn::LoadU(d, p + 2 * from_stride), e = hn::LoadU(d, p + 3 * from_stride);
      const auto ab = hn::BitCast(dd, hn::InterleaveLower(d, a, b)),
                 ab2 = hn::BitCast(dd, hn::InterleaveUpper(d, a, b));
      const auto ce = hn::BitCast(dd, hn::InterleaveLower(d, c, e)),
                 ce2 = hn::BitCast(dd, hn::InterleaveUpper(d, c, e));
      float* q = to + x * to_stride + y;
      hn::StoreU(hn::BitCast(d, hn::InterleaveLower(dd, ab, ce)), d, q);
      hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(dd, ab, ce)), d, q + to_stride);
      hn::StoreU(hn::BitCast(d, hn::InterleaveLower(dd, ab2, ce2)), d, q + 2 * to_stride);
      hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(dd, ab2, ce2)), d, q + 3 * to_stride);
    }
  }
}

// The same of doubles, which are few: no blocks that fit registers.
inline void Transpose(const double* from, ptrdiff_t from_stride, double* to, ptrdiff_t to_stride, int rows,
                      int columns) {
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) to[x * to_stride + y] = from[y * from_stride + x];
  }
}

// A vector of every fourth float, one channel of RGBA pixels; up to the last pixel's fourth are read. Half
// the shuffles of a transpose where but one channel is wanted.
HWY_INLINE V LoadEveryFourth(const float* p) {
  const D d;
  const V low = hn::ConcatEven(d, hn::LoadU(d, p + kLanes), hn::LoadU(d, p));
  const V high = hn::ConcatEven(d, hn::LoadU(d, p + 3 * kLanes), hn::LoadU(d, p + 2 * kLanes));
  return hn::ConcatEven(d, high, low);
}

// Vectors of the four channels of as many pixels, one after the other, to RGBA pixels.
HWY_INLINE void StoreInterleaved(const Pixels& q, float* p) {
  StoreRgba<PixelType::kFloat, true>(
      {ToPlaneOrder(q.r), ToPlaneOrder(q.g), ToPlaneOrder(q.b), ToPlaneOrder(q.a)}, p, false);
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
