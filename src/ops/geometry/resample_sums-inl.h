// Sums in double with one rounding: what the kernels of resampling are made of.
#if defined(TESSERA_OPS_GEOMETRY_RESAMPLE_SUMS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_GEOMETRY_RESAMPLE_SUMS_INL_H_
#undef TESSERA_OPS_GEOMETRY_RESAMPLE_SUMS_INL_H_
#else
#define TESSERA_OPS_GEOMETRY_RESAMPLE_SUMS_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

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
  static HWY_INLINE hn::Vec<Tag> LoadVector(const float* p) {
    return hn::PromoteTo(Tag(), hn::LoadU(FloatTag(), p));
  }
  static HWY_INLINE hn::Vec<Tag> LoadVector(const double* p) { return hn::LoadU(Tag(), p); }
  template <class T>
  static HWY_INLINE Doubles Load(const T* p) {
    Doubles r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = LoadVector(p + i * kLanesOf);
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
  template <class T>
  HWY_INLINE void AddScaled(const T* p, double w) {
    for (int i = 0; i < kVectors; ++i) {
      v[i] = hn::MulAdd(LoadVector(p + i * kLanesOf), hn::Set(Tag(), w), v[i]);
    }
  }
  // Values k M to (k + 1) M - 1.
  template <int M>
  HWY_INLINE Doubles<M> Part(int k) const {
    Doubles<M> r;
    for (int i = 0; i < r.kVectors; ++i) r.v[i] = v[k * r.kVectors + i];
    return r;
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
  for (int k = 1; k < count; ++k) sum.AddScaled(p + k * stride, w[k]);
  return sum;
}

// Sixteen doubles rounded once; every NaN becomes the same one.
HWY_INLINE F16 Rounded(const D16& x) {
  F16 r;
  const D16::FloatTag f;
  for (int i = 0; i < F16::kVectors; ++i) {
    r.v[i] = hn::Combine(F16::Tag(), hn::DemoteTo(f, x.v[2 * i + 1]), hn::DemoteTo(f, x.v[2 * i]));
  }
  return r.OneNaN();
}

// Around the cache where that is wanted and whole lines are written.
HWY_INLINE void StoreSixteen(const F16& values, float* to, bool stream) {
  if (stream && reinterpret_cast<uintptr_t>(to) % 64 == 0) {
    values.Stream(to);
  } else {
    values.Store(to);
  }
}

// `count` floats of a row of results.
HWY_INLINE void StoreLine(const float* HWY_RESTRICT line, int count, float* HWY_RESTRICT to, bool stream) {
  int i = 0;
  for (; i + 16 <= count; i += 16) StoreSixteen(F16::Load(line + i), to + i, stream);
  std::copy_n(line + i, count - i, to + i);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
