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
#include "simd/pixels-inl.h"
#include "simd/texels-inl.h"

#if TESSERA_DOUBLE_FLOAT
HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

#if HWY_TARGET == HWY_AVX3
// The coefficients of each lane's piece, from columns of 32 floats in two registers each.
class PieceTables {
 public:
  HWY_INLINE explicit PieceTables(const CurvePieces& t) {
    const s::D d;
#pragma GCC unroll 16
    for (int k = 0; k < CurvePieces::kTerms; ++k) {
      low_[k] = hn::Load(d, t.column[k]), high_[k] = hn::Load(d, t.column[k] + 16);
    }
  }
  class Chosen {
   public:
    HWY_INLINE Chosen(const PieceTables& t, s::VI piece) : t_(t), piece_(piece) {}
    HWY_INLINE s::V operator()(int term) const {
      return s::V{_mm512_permutex2var_ps(t_.low_[term].raw, piece_.raw, t_.high_[term].raw)};
    }

   private:
    const PieceTables& t_;
    s::VI piece_;
  };

 private:
  s::V low_[CurvePieces::kTerms], high_[CurvePieces::kTerms];
};
#else
// The same from rows in memory, four terms of each lane's piece at a time: looking up half of a column in a
// register takes longer.
class PieceTables {
 public:
  HWY_INLINE explicit PieceTables(const CurvePieces& t) : t_(t) {}
  class Chosen {
   public:
    HWY_INLINE Chosen(const PieceTables& t, s::VI piece) {
      alignas(64) uint32_t at[s::kLanes];  // in floats
      const hn::RebindToUnsigned<s::DI> du;
      static_assert(CurvePieces::kPaddedTerms == 16);
      const s::VI row = hn::And(piece, hn::Set(s::DI(), CurvePieces::kCount - 1));
      hn::Store(hn::BitCast(du, hn::ShiftLeft<4>(row)), du, at);
      const float* const rows = t.t_.row[0];
#pragma GCC unroll 4
      for (int k = 0; k < kTerms; k += 4) {
#pragma GCC unroll 4
        for (int j = 0; j < 4; ++j) {
          term_[k + j] = s::LoadQuads([&](int lane) HWY_ATTR { return rows + at[lane] + k; }, j);
        }
        s::Transpose4(term_[k], term_[k + 1], term_[k + 2], term_[k + 3]);
      }
    }
    HWY_INLINE s::V operator()(int term) const { return term_[term]; }

   private:
    static constexpr int kTerms = CurvePieces::kPaddedTerms;
    s::V term_[kTerms];
  };

 private:
  const CurvePieces& t_;
};
#endif

// A formula's tables, loaded.
class Pieces {
 public:
  HWY_INLINE explicit Pieces(const CurvePieces& t) : t_(t), tables_(t) {}

  // The curve at x; `able` marks the samples that have a piece, the others are anything.
  template <bool kByBits>
  HWY_INLINE s::V At(s::V x, hn::Mask<s::D>& able) const {
    const s::DI di;
    s::V v = hn::MulAdd(x, s::SetF(t_.place_scale), s::SetF(t_.place_offset));
    if constexpr (kByBits) {
      v = hn::MulAdd(hn::ConvertTo(s::D(), hn::BitCast(di, x)), s::SetF(t_.place_bits), v);
    }
    able = hn::And(hn::Ge(v, s::SetF(t_.low)), hn::Lt(v, s::SetF(t_.high)));
    using T = CurvePieces;
    const PieceTables::Chosen of(tables_, hn::ShiftRightSame(hn::BitCast(di, v), t_.shift));
    const s::V u = hn::MulAdd(x, of(T::kScale), of(T::kCentre));
    // Two chains, which take half as long as one.
    const s::V square = hn::Mul(u, u);
    s::V even = of(T::kTerms - 1), odd = of(T::kTerms - 2);
#pragma GCC unroll 16
    for (int k = T::kTerms - 3; k >= T::kC2; k -= 2) even = hn::MulAdd(square, even, of(k));
#pragma GCC unroll 16
    for (int k = T::kTerms - 4; k > T::kC2; k -= 2) odd = hn::MulAdd(square, odd, of(k));
    const s::V line = hn::MulAdd(u, of(T::kRest1), of(T::kRest0));
    const s::V t = hn::MulAdd(square, hn::MulAdd(u, odd, even), line);
    const s::V c0 = of(T::kC0), c1 = of(T::kC1);
    const s::V sum = hn::MulAdd(u, c1, c0);
    const s::V lost = hn::MulAdd(u, c1, hn::Sub(c0, sum));
    return hn::Add(sum, hn::Add(lost, t));
  }

 private:
  const CurvePieces& t_;
  PieceTables tables_;
};

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // TESSERA_DOUBLE_FLOAT

#endif  // per-target guard
