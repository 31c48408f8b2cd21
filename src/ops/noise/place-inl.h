// Positions from rows of interleaved coordinates, and their places on the lattice: cells and fractions.
#if defined(TESSERA_OPS_NOISE_PLACE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_NOISE_PLACE_INL_H_
#undef TESSERA_OPS_NOISE_PLACE_INL_H_
#else
#define TESSERA_OPS_NOISE_PLACE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "ops/noise/kernels.h"
#include "simd/lattice-inl.h"
#include "simd/shuffle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;

// A position in cells.
template <int kDims>
struct Place {
  V whole[kDims], fraction[kDims];
};

HWY_INLINE void LoadTriples(const float* in, V* p) {
  const s::D d;
  if constexpr (s::kLanes < 16) return hn::LoadInterleaved3(d, in, p[0], p[1], p[2]);
  // Two look-ups in two registers for a coordinate; the third of the vectors' lanes come last.
  alignas(64) static constexpr int32_t kFirst[3][16] = {
      {0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 0, 0, 0, 0, 0},
      {1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0},
      {2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0}};
  alignas(64) static constexpr int32_t kSecond[3][16] = {
      {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29},
      {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30},
      {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31}};
  const V a = hn::LoadU(d, in), b = hn::LoadU(d, in + 16), c = hn::LoadU(d, in + 32);
#pragma GCC unroll 3
  for (int k = 0; k < 3; ++k) {
    p[k] = s::OfBoth(s::OfBoth(a, b, kFirst[k]), c, kSecond[k]);
  }
}

template <int kDims>
HWY_INLINE void LoadCoordinates(const float* in, int channels, V* p) {
  const s::D d;
  V rest;
  if (channels == 3) {
    if constexpr (kDims == 3) {
      LoadTriples(in, p);
    } else {
      hn::LoadInterleaved3(d, in, p[0], p[1], rest);
    }
  } else if (channels == 4) {
    V third;
    hn::LoadInterleaved4(d, in, p[0], p[1], third, rest);
    if constexpr (kDims == 3) p[2] = third;
  } else if constexpr (kDims == 2) {
    hn::LoadInterleaved2(d, in, p[0], p[1]);
  }
}

// Quintic noise of one octave at positions that are cells already is what most rows are: kPlain.
template <int kDims, bool kPlain>
HWY_INLINE Place<kDims> PlaceOf(const PointRow& a, const V* p) {
  const s::D d;
  Place<kDims> place;
#pragma GCC unroll 16
  for (int k = 0; k < kDims; ++k) {
    const V frequency = hn::Set(d, a.frequency[k][0]);
    place.whole[k] = hn::Floor(hn::Mul(p[k], frequency));
    place.fraction[k] = s::RestOfProduct(p[k], frequency, place.whole[k]);
    if (kPlain) continue;
    const V rest =
        hn::Add(hn::MulAdd(p[k], hn::Set(d, a.frequency[k][1]), place.fraction[k]), hn::Set(d, a.offset[k]));
    const V carry = hn::Floor(rest);
    place.whole[k] = hn::Add(place.whole[k], carry);
    place.fraction[k] = hn::Sub(rest, carry);
  }
  return place;
}
// Whether plain positions are cells as they are: PlaceOfCells() then makes the bits of PlaceOf().
template <int kDims>
HWY_INLINE bool AreCells(const PointRow& a) {
  bool cells = true;
  for (int k = 0; k < kDims; ++k) cells &= a.frequency[k][0] == 1;
  return cells;
}
template <int kDims>
HWY_INLINE Place<kDims> PlaceOfCells(const V* p) {
  Place<kDims> place;
#pragma GCC unroll 16
  for (int k = 0; k < kDims; ++k) {
    place.whole[k] = hn::Floor(p[k]);
    place.fraction[k] = hn::Sub(p[k], place.whole[k]);
  }
  return place;
}
template <int kDims>
HWY_INLINE Place<kDims> InOctave(const PointOctave& o, const Place<kDims>& base) {
  const s::D d;
  const V s0 = hn::Set(d, o.scale[0]), s1 = hn::Set(d, o.scale[1]);
  Place<kDims> place;
#pragma GCC unroll 16
  for (int k = 0; k < kDims; ++k) {
    const V whole = hn::Floor(hn::Mul(base.whole[k], s0));
    V rest = hn::MulAdd(base.whole[k], s1, s::RestOfProduct(base.whole[k], s0, whole));
    rest = hn::Add(hn::MulAdd(base.fraction[k], s0, rest), hn::Set(d, o.shift[k]));
    const V carry = hn::Floor(rest);
    place.whole[k] = hn::Add(whole, carry);
    place.fraction[k] = hn::Sub(rest, carry);
  }
  return place;
}

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
