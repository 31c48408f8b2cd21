// Curves as 32 polynomials on float vectors: the scheme that curve_pieces.h describes.
#if defined(TESSERA_OPS_CURVE_CURVE_PIECES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_CURVE_CURVE_PIECES_INL_H_
#undef TESSERA_OPS_CURVE_CURVE_PIECES_INL_H_
#else
#define TESSERA_OPS_CURVE_CURVE_PIECES_INL_H_
#endif

#include <hwy/highway.h>

#include "ops/curve/curve_pieces.h"
#include "simd/double_float-inl.h"

#if TESSERA_DOUBLE_FLOAT
HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

#if HWY_TARGET == HWY_AVX3
// 32 floats in two registers.
struct Table32 {
  s::V low, high;
};
HWY_INLINE Table32 Load32(const float* t) { return {hn::Load(s::D(), t), hn::Load(s::D(), t + 16)}; }
// Entries that the lowest five bits of each lane choose.
class Chosen {
 public:
  HWY_INLINE explicit Chosen(s::VI index) : index_(index) {}
  HWY_INLINE s::V operator()(const Table32& t) const {
    return s::V{_mm512_permutex2var_ps(t.low.raw, index_.raw, t.high.raw)};
  }

 private:
  s::VI index_;
};
#else
// 32 floats in memory, half of which are looked up at a time.
struct Table32 {
  const float* low;
};
HWY_INLINE Table32 Load32(const float* t) { return {t}; }
class Chosen {
 public:
  HWY_INLINE explicit Chosen(s::VI index)
      : index_(hn::And(index, hn::Set(s::DI(), 15))),
        upper_(hn::RebindMask(s::D(), hn::Ne(hn::And(index, hn::Set(s::DI(), 16)), hn::Zero(s::DI())))) {}
  HWY_INLINE s::V operator()(const Table32& t) const {
    return hn::IfThenElse(upper_, s::Of16(t.low + 16, index_), s::Of16(t.low, index_));
  }

 private:
  s::VI index_;
  hn::Mask<s::D> upper_;
};
#endif

// A formula's tables, loaded.
class Pieces {
 public:
  HWY_INLINE explicit Pieces(const CurvePieces& t)
      : t_(t),
        scale_(Load32(t.scale)),
        centre_(Load32(t.centre)),
        c0_(Load32(t.c0)),
        c1_(Load32(t.c1)),
        c0_rest_(Load32(t.c0_rest)),
        c1_rest_(Load32(t.c1_rest)) {
    for (int k = 0; k < kMore; ++k) c_[k] = Load32(t.c[k]);
  }

  // The curve at x; `able` marks the samples that have a piece, the others are anything.
  template <bool kByBits>
  HWY_INLINE s::V At(s::V x, hn::Mask<s::D>& able) const {
    const s::DI di;
    s::V v = hn::MulAdd(x, s::SetF(t_.place_scale), s::SetF(t_.place_offset));
    if constexpr (kByBits) {
      v = hn::MulAdd(hn::ConvertTo(s::D(), hn::BitCast(di, x)), s::SetF(t_.place_bits), v);
    }
    able = hn::And(hn::Ge(v, s::SetF(t_.low)), hn::Lt(v, s::SetF(t_.high)));
    const Chosen of(hn::ShiftRightSame(hn::BitCast(di, v), t_.shift));
    const s::V u = hn::MulAdd(x, of(scale_), of(centre_));
    s::V t = of(c_[kMore - 1]);
    for (int k = kMore - 2; k >= 0; --k) t = hn::MulAdd(u, t, of(c_[k]));
    t = hn::MulAdd(u, t, of(c1_rest_));
    t = hn::MulAdd(u, t, of(c0_rest_));
    const s::V c0 = of(c0_), c1 = of(c1_);
    const s::V sum = hn::MulAdd(u, c1, c0);
    const s::V lost = hn::MulAdd(u, c1, hn::Sub(c0, sum));
    return hn::Add(sum, hn::Add(lost, t));
  }

 private:
  static constexpr int kMore = CurvePieces::kDegree - 1;
  const CurvePieces& t_;
  Table32 scale_, centre_, c0_, c1_, c0_rest_, c1_rest_, c_[kMore];
};

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // TESSERA_DOUBLE_FLOAT

#endif  // per-target guard
