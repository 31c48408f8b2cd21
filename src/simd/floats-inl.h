// A fixed number of floats in as many vectors as the target needs: sums in the same order on every target.
#if defined(TESSERA_SIMD_FLOATS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_FLOATS_INL_H_
#undef TESSERA_SIMD_FLOATS_INL_H_
#else
#define TESSERA_SIMD_FLOATS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <utility>

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// N is a multiple of 4: whole RGBA pixels.
template <int N>
struct Floats {
  using Tag = hn::CappedTag<float, N>;
  using Vector = hn::Vec<Tag>;
  static constexpr int kLanesOf = static_cast<int>(hn::MaxLanes(Tag()));
  static constexpr int kVectors = N / kLanesOf;
  Vector v[kVectors];

  static HWY_INLINE Floats Load(const float* p) {
    Floats r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::LoadU(Tag(), p + i * kLanesOf);
    return r;
  }
  static HWY_INLINE Floats Set(float value) {
    Floats r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::Set(Tag(), value);
    return r;
  }
  static HWY_INLINE Floats Zero() { return Set(0); }
  // w * x.
  static HWY_INLINE Floats Scaled(const float* p, float w) {
    Floats r;
    for (int i = 0; i < kVectors; ++i)
      r.v[i] = hn::Mul(hn::LoadU(Tag(), p + i * kLanesOf), hn::Set(Tag(), w));
    return r;
  }
  HWY_INLINE Floats operator*(float w) const {
    Floats r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::Mul(v[i], hn::Set(Tag(), w));
    return r;
  }
  // this += w * x, one rounding on targets with fused multiply-add.
  HWY_INLINE void AddScaled(const float* p, float w) {
    for (int i = 0; i < kVectors; ++i)
      v[i] = hn::MulAdd(hn::LoadU(Tag(), p + i * kLanesOf), hn::Set(Tag(), w), v[i]);
  }
  HWY_INLINE void AddScaled(const Floats& x, float w) {
    for (int i = 0; i < kVectors; ++i) v[i] = hn::MulAdd(x.v[i], hn::Set(Tag(), w), v[i]);
  }
  HWY_INLINE Floats operator+(const Floats& x) const {
    Floats r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::Add(v[i], x.v[i]);
    return r;
  }
  // 0 where `bits`, all set or none, are none.
  HWY_INLINE Floats Masked(uint32_t bits) const {
    Floats r;
    const auto mask = hn::BitCast(Tag(), hn::Set(hn::RebindToUnsigned<Tag>(), bits));
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::And(v[i], mask);
    return r;
  }
  // Every NaN as the same one: which of several a sum passes on depends on the compiler.
  HWY_INLINE Floats OneNaN() const {
    Floats r;
    const Tag d;
    for (int i = 0; i < kVectors; ++i) {
      r.v[i] = hn::IfThenElse(hn::IsNaN(v[i]),
                              hn::BitCast(d, hn::Set(hn::RebindToUnsigned<Tag>(), 0x7FC00000u)), v[i]);
    }
    return r;
  }
  // NaN stays where `x` was ever infinite or NaN: begins with zeros, ends with Unmarked.
  HWY_INLINE void MarkUnlessFinite(const Floats& x) {
    for (int i = 0; i < kVectors; ++i) v[i] = hn::Or(v[i], hn::Sub(x.v[i], x.v[i]));
  }
  HWY_INLINE bool Unmarked() const {
    auto all = v[0];
    for (int i = 1; i < kVectors; ++i) all = hn::Or(all, v[i]);
    return hn::AllTrue(Tag(), hn::Eq(all, all));
  }
  // Those of `other` in place of infinities and NaN.
  HWY_INLINE Floats FiniteOr(const Floats& other) const {
    Floats r;
    for (int i = 0; i < kVectors; ++i) r.v[i] = hn::IfThenElse(hn::IsFinite(v[i]), v[i], other.v[i]);
    return r;
  }
  HWY_INLINE void Store(float* p) const {
    for (int i = 0; i < kVectors; ++i) hn::StoreU(v[i], Tag(), p + i * kLanesOf);
  }
  // Around the cache; p is aligned to N floats.
  HWY_INLINE void Stream(float* p) const {
    for (int i = 0; i < kVectors; ++i) hn::Stream(v[i], Tag(), p + i * kLanesOf);
  }
};

// Four times four pixels: pixel j of row i becomes pixel i of row j.
HWY_INLINE void TransposePixels(Floats<16>& a, Floats<16>& b, Floats<16>& c, Floats<16>& d) {
  using F = Floats<16>;
  const F::Tag t;
  (void)t;
  if constexpr (F::kVectors == 1) {
    const auto ac_lo = hn::ConcatLowerLower(t, c.v[0], a.v[0]),
               bd_lo = hn::ConcatLowerLower(t, d.v[0], b.v[0]);
    const auto ac_hi = hn::ConcatUpperUpper(t, c.v[0], a.v[0]),
               bd_hi = hn::ConcatUpperUpper(t, d.v[0], b.v[0]);
    a.v[0] = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(bd_lo), ac_lo);
    b.v[0] = hn::OddEvenBlocks(bd_lo, hn::SwapAdjacentBlocks(ac_lo));
    c.v[0] = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(bd_hi), ac_hi);
    d.v[0] = hn::OddEvenBlocks(bd_hi, hn::SwapAdjacentBlocks(ac_hi));
    return;
  } else if constexpr (F::kVectors == 2) {
    const F w = a, x = b, y = c, z = d;
    a.v[0] = hn::ConcatLowerLower(t, x.v[0], w.v[0]), a.v[1] = hn::ConcatLowerLower(t, z.v[0], y.v[0]);
    b.v[0] = hn::ConcatUpperUpper(t, x.v[0], w.v[0]), b.v[1] = hn::ConcatUpperUpper(t, z.v[0], y.v[0]);
    c.v[0] = hn::ConcatLowerLower(t, x.v[1], w.v[1]), c.v[1] = hn::ConcatLowerLower(t, z.v[1], y.v[1]);
    d.v[0] = hn::ConcatUpperUpper(t, x.v[1], w.v[1]), d.v[1] = hn::ConcatUpperUpper(t, z.v[1], y.v[1]);
    return;
  }
  // Whole vectors change places.
  constexpr int kEach = F::kVectors / 4;
  F* const rows[4] = {&a, &b, &c, &d};
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) {
      for (int k = 0; k < kEach; ++k) std::swap(rows[i]->v[j * kEach + k], rows[j]->v[i * kEach + k]);
    }
  }
}

// Eight pixels in order: the even ones to `first`, the odd ones to `second`.
HWY_INLINE void PairPixels(Floats<16>& first, Floats<16>& second) {
  using F = Floats<16>;
  const F a = first, b = second;
  const F::Tag t;
  if constexpr (F::kVectors == 1) {
    const auto low = hn::ConcatLowerLower(t, b.v[0], a.v[0]), high = hn::ConcatUpperUpper(t, b.v[0], a.v[0]);
    first.v[0] = hn::OddEvenBlocks(hn::SwapAdjacentBlocks(high), low);
    second.v[0] = hn::OddEvenBlocks(high, hn::SwapAdjacentBlocks(low));
    return;
  } else if constexpr (F::kVectors == 2) {
    first.v[0] = hn::ConcatLowerLower(t, a.v[1], a.v[0]),
    first.v[1] = hn::ConcatLowerLower(t, b.v[1], b.v[0]);
    second.v[0] = hn::ConcatUpperUpper(t, a.v[1], a.v[0]),
    second.v[1] = hn::ConcatUpperUpper(t, b.v[1], b.v[0]);
    return;
  }
  constexpr int kEach = F::kVectors / 4 > 0 ? F::kVectors / 4 : 1;  // vectors of a pixel
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < kEach; ++k) {
      if constexpr (F::kVectors >= 4) {
        first.v[i * kEach + k] = a.v[2 * i * kEach + k],
                            first.v[(i + 2) * kEach + k] = b.v[2 * i * kEach + k];
        second.v[i * kEach + k] = a.v[(2 * i + 1) * kEach + k];
        second.v[(i + 2) * kEach + k] = b.v[(2 * i + 1) * kEach + k];
      }
    }
  }
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
