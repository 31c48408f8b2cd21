// Curves as cubic polynomials on float vectors: the scheme that curve_pieces.h describes.
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

// A formula's table, ready for use.
class Pieces {
 public:
  HWY_INLINE explicit Pieces(const CurvePieces& t) : t_(t), rows_(&t.rows->front().centre) {}

  // Where the rows of the samples' pieces are, in floats.
  template <bool kByBits>
  HWY_INLINE void Locate(s::V x, uint32_t* at) const {
    const hn::RebindToUnsigned<s::DI> du;
    // What is below the first piece, negative or NaN comes out beyond the last one.
    const auto beyond = hn::Sub(hn::BitCast(du, Place<kByBits>(x)), hn::Set(du, t_.first));
    const auto piece = hn::ShiftRightSame(hn::Min(beyond, hn::Set(du, t_.span)), t_.shift);
    hn::Store(hn::ShiftLeft<2>(piece), du, at);
  }
  // The curve at x by these rows; NaN where it has no piece.
  template <bool kByBits>
  HWY_INLINE s::V At(s::V x, const uint32_t* at) const {
    s::V row[4];
#pragma GCC unroll 4
    for (int j = 0; j < 4; ++j) {
      row[j] = s::LoadQuads([&](int lane) HWY_ATTR { return rows_ + at[lane]; }, j);
    }
    s::Transpose4(row[0], row[1], row[2], row[3]);
    const s::V u = hn::Sub(x, row[0]);
    const s::V z = hn::Mul(u, row[3]);
    s::V k = s::SetF(t_.cubic);
    if constexpr (kByBits) k = hn::MulAdd(Place<kByBits>(x), s::SetF(t_.cubic_slope), k);
    const s::V bend = hn::Mul(z, hn::MulAdd(z, k, s::SetF(1)));
    return hn::MulAdd(u, hn::MulAdd(row[2], bend, row[2]), row[1]);
  }

 private:
  template <bool kByBits>
  HWY_INLINE s::V Place(s::V x) const {
    const s::V v = hn::MulAdd(x, s::SetF(t_.place_scale), s::SetF(t_.place_offset));
    if constexpr (!kByBits) return v;
    return hn::MulAdd(hn::ConvertTo(s::D(), hn::BitCast(s::DI(), x)), s::SetF(t_.place_bits), v);
  }

  const CurvePieces& t_;
  const float* const rows_;
};

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // TESSERA_DOUBLE_FLOAT

#endif  // per-target guard
