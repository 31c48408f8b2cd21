// The cells around positions, hashed: for noise from points in cells.
#if defined(TESSERA_OPS_NOISE_NEIGHBOUR_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_NOISE_NEIGHBOUR_INL_H_
#undef TESSERA_OPS_NOISE_NEIGHBOUR_INL_H_
#else
#define TESSERA_OPS_NOISE_NEIGHBOUR_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "ops/noise/kernels.h"
#include "simd/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VU;

// A cell's neighbour at -1, 0 or 1 along an axis, hashed.
HWY_INLINE VU Neighbour(VU cell, int step, uint32_t period, int axis) {
  const s::DU du;
  VU c = hn::Add(cell, hn::Set(du, static_cast<uint32_t>(step)));
  if (period != 0 && step < 0) c = hn::IfThenElse(hn::Eq(cell, hn::Zero(du)), hn::Set(du, period - 1), c);
  if (period != 0 && step > 0) c = hn::IfThenZeroElse(hn::Eq(c, hn::Set(du, period)), c);
  return hn::Mul(c, hn::Set(du, s::kAxis[axis]));
}

constexpr int Power3(int n) { return n == 0 ? 1 : 3 * Power3(n - 1); }

// Calls visit(hash, offset) for each of the 3^kDims cells around a position; offset: the cell's corner from
// the position.
template <int kDims, class Visit>
HWY_INLINE void ForNeighbours(const NoiseBatch& b, int i, const Visit& visit) {
  const s::D d;
  const s::DU du;
  VU side[kDims][3];
  V corner[kDims][3];
#pragma GCC unroll 16
  for (int a = 0; a < kDims; ++a) {
    const VU cell = hn::LoadU(du, b.cell[a] + i);
    const V f = hn::LoadU(d, b.fraction[a] + i);
    for (int k = 0; k < 3; ++k) {
      side[a][k] = Neighbour(cell, k - 1, b.period[a], a);
      corner[a][k] = hn::Sub(hn::Set(d, static_cast<float>(k - 1)), f);
    }
  }
  for (int n = 0; n < Power3(kDims); ++n) {
    VU h = hn::Set(du, b.seed);
    V offset[kDims];
    for (int a = 0, rest = n; a < kDims; ++a, rest /= 3) {
      h = hn::Xor(h, side[a][rest % 3]);
      offset[a] = corner[a][rest % 3];
    }
    visit(s::LatticeMix(h), offset);
  }
}

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
