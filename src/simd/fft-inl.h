// Batched complex Fourier transforms: each lane is a column, so that no butterfly crosses lanes.
//
// A forward transform leaves its results in an order of its own (digits of the index reversed), which the
// inverse takes back: enough for convolution, where spectra are only multiplied. Radix 4 with one step of
// radix 2 where the length is no power of 4. Unnormalised both ways: together they multiply by the length.
#if defined(TESSERA_SIMD_FFT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_FFT_INL_H_
#undef TESSERA_SIMD_FFT_INL_H_
#else
#define TESSERA_SIMD_FFT_INL_H_
#endif

#include <hwy/highway.h>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

struct Complex {
  V re, im;
};
HWY_INLINE Complex operator+(const Complex& a, const Complex& b) {
  return {hn::Add(a.re, b.re), hn::Add(a.im, b.im)};
}
HWY_INLINE Complex operator-(const Complex& a, const Complex& b) {
  return {hn::Sub(a.re, b.re), hn::Sub(a.im, b.im)};
}
// a times (c + i s), or times its conjugate.
template <bool kConjugate>
HWY_INLINE Complex Turn(const Complex& a, V c, V s) {
  if (kConjugate) return {hn::MulAdd(a.im, s, hn::Mul(a.re, c)), hn::NegMulAdd(a.re, s, hn::Mul(a.im, c))};
  return {hn::NegMulAdd(a.im, s, hn::Mul(a.re, c)), hn::MulAdd(a.re, s, hn::Mul(a.im, c))};
}

// One vector of columns of `length` rows, in place. `twiddles` holds cos and sin of -2 pi j / length for j <
// length.
struct Columns {
  float* re;
  float* im;
  ptrdiff_t stride;
  HWY_INLINE Complex Get(int n) const {
    return {hn::LoadU(D(), re + n * stride), hn::LoadU(D(), im + n * stride)};
  }
  HWY_INLINE void Put(int n, const Complex& v) const {
    hn::StoreU(v.re, D(), re + n * stride);
    hn::StoreU(v.im, D(), im + n * stride);
  }
};

// The four points at j, j + q, j + 2q, j + 3q of a block of 4q, forward or back.
template <bool kInverse>
HWY_INLINE void Butterfly4(const Columns& x, int base, int q, const float* w, int step) {
  const D d;
  for (int j = 0; j < q; ++j) {
    const int n = base + j;
    Complex a = x.Get(n), b = x.Get(n + q), c = x.Get(n + 2 * q), e = x.Get(n + 3 * q);
    const auto turned = [&](const Complex& v, int k) HWY_ATTR {
      if (j == 0) return v;
      const float* t = w + 2 * (k * j * step);
      return Turn<kInverse>(v, hn::Set(d, t[0]), hn::Set(d, t[1]));
    };
    if constexpr (kInverse) b = turned(b, 1), c = turned(c, 2), e = turned(e, 3);
    if constexpr (kInverse) {
      // Blocks hold the residues 0, 1, 2, 3 of the frequency.
      const Complex t0 = a + c, t1 = a - c, t2 = b + e, t3 = b - e;
      const Complex i{hn::Neg(t3.im), t3.re};
      x.Put(n, t0 + t2), x.Put(n + q, t1 + i), x.Put(n + 2 * q, t0 - t2), x.Put(n + 3 * q, t1 - i);
    } else {
      const Complex t0 = a + c, t1 = a - c, t2 = b + e, t3 = b - e;
      const Complex i{t3.im, hn::Neg(t3.re)};
      x.Put(n, t0 + t2), x.Put(n + q, turned(t1 + i, 1)), x.Put(n + 2 * q, turned(t0 - t2, 2));
      x.Put(n + 3 * q, turned(t1 - i, 3));
    }
  }
}

HWY_INLINE void Butterflies2(const Columns& x, int length) {
  for (int n = 0; n < length; n += 2) {
    const Complex a = x.Get(n), b = x.Get(n + 1);
    x.Put(n, a + b), x.Put(n + 1, a - b);
  }
}

HWY_INLINE void ForwardColumns(const Columns& x, int length, const float* twiddles) {
  int block = length;
  for (; block >= 4; block /= 4) {
    for (int base = 0; base < length; base += block)
      Butterfly4<false>(x, base, block / 4, twiddles, length / block);
  }
  if (block == 2) Butterflies2(x, length);
}

HWY_INLINE void InverseColumns(const Columns& x, int length, const float* twiddles) {
  int block = length;
  while (block >= 4) block /= 4;
  if (block == 2) Butterflies2(x, length);
  for (block *= 4; block <= length; block *= 4) {
    for (int base = 0; base < length; base += block)
      Butterfly4<true>(x, base, block / 4, twiddles, length / block);
  }
}

// to(x, y) = from(y, x) of a square of `size` (a multiple of 4).
HWY_INLINE void TransposeSquare(const float* from, float* to, int size, ptrdiff_t stride) {
#if HWY_TARGET == HWY_SCALAR
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) to[x * stride + y] = from[y * stride + x];
  }
#else
  const hn::CappedTag<float, 4> d;
  const hn::Repartition<double, decltype(d)> dd;
  for (int y = 0; y < size; y += 4) {
    for (int x = 0; x < size; x += 4) {
      const float* p = from + y * stride + x;
      const auto a = hn::LoadU(d, p), b = hn::LoadU(d, p + stride), c = hn::LoadU(d, p + 2 * stride),
                 e = hn::LoadU(d, p + 3 * stride);
      const auto ab = hn::BitCast(dd, hn::InterleaveLower(d, a, b)),
                 ab2 = hn::BitCast(dd, hn::InterleaveUpper(d, a, b));
      const auto ce = hn::BitCast(dd, hn::InterleaveLower(d, c, e)),
                 ce2 = hn::BitCast(dd, hn::InterleaveUpper(d, c, e));
      float* q = to + x * stride + y;
      hn::StoreU(hn::BitCast(d, hn::InterleaveLower(dd, ab, ce)), d, q);
      hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(dd, ab, ce)), d, q + stride);
      hn::StoreU(hn::BitCast(d, hn::InterleaveLower(dd, ab2, ce2)), d, q + 2 * stride);
      hn::StoreU(hn::BitCast(d, hn::InterleaveUpper(dd, ab2, ce2)), d, q + 3 * stride);
    }
  }
#endif
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
