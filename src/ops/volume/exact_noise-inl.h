// Turbulence by the noise itself, for sixteen rays at once.
#if defined(TESSERA_OPS_VOLUME_EXACT_NOISE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_VOLUME_EXACT_NOISE_INL_H_
#undef TESSERA_OPS_VOLUME_EXACT_NOISE_INL_H_
#else
#define TESSERA_OPS_VOLUME_EXACT_NOISE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "ops/volume/sample-inl.h"
#include "simd/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

// Gradient noise at position p of the block, each coordinate in [0, 1]; repeats after a block.
HWY_INLINE V ExactNoise(const ExactOctave& octave, const Vec3& p) {
  const DI di;
  const s::DU du;
  const V one = Set(1);
  const VI period = hn::Set(di, static_cast<int32_t>(octave.cells));
  s::VU side[3][2];
  V offset[3][2], fade[3];
  const V coordinates[3] = {p.x, p.y, p.z};
#pragma GCC unroll 3
  for (int a = 0; a < 3; ++a) {
    const V at = hn::MulAdd(coordinates[a], Set(octave.times), Set(octave.shift[a]));
    const V u = hn::Mul(hn::Sub(at, hn::Floor(at)), Set(octave.cells));
    const V floor = hn::Floor(u);
    offset[a][0] = hn::Sub(u, floor);
    offset[a][1] = hn::Sub(offset[a][0], one);
    fade[a] = s::FadeWeight(offset[a][0], 0);
    VI cell = hn::ConvertTo(di, floor);
    for (int c = 0; c < 2; ++c) {
      cell = hn::Sub(cell, hn::IfThenElseZero(hn::Not(hn::Gt(period, cell)), period));
      side[a][c] = hn::Mul(hn::BitCast(du, cell), hn::Set(du, s::kAxis[a]));
      cell = hn::Add(cell, hn::Set(di, 1));
    }
  }
  for (s::VU& x : side[0]) x = hn::Xor(x, hn::Set(du, octave.seed));
  V corner[8];
#pragma GCC unroll 8
  for (int c = 0; c < 8; ++c) {
    const s::VU h = hn::Xor(hn::Xor(side[0][c & 1], side[1][c >> 1 & 1]), side[2][c >> 2]);
    const V from[3] = {offset[0][c & 1], offset[1][c >> 1 & 1], offset[2][c >> 2]};
    corner[c] = s::LatticeProjection<3>(s::LatticeMix(h), from);
  }
  const V near = Lerp(Lerp(corner[0], corner[1], fade[0]), Lerp(corner[2], corner[3], fade[0]), fade[1]);
  const V far = Lerp(Lerp(corner[4], corner[5], fade[0]), Lerp(corner[6], corner[7], fade[0]), fade[1]);
  return Lerp(near, far, fade[2]);
}
// The sum of the octaves' absolute values at position p (voxels).
template <size_t kOctaves>
HWY_INLINE V ExactTurbulence(const NoiseView& n, const ExactOctave (&octaves)[kOctaves], const Vec3& p) {
  const auto axis = [&](int a, V v) HWY_ATTR {
    const V u = hn::MulAdd(v, Set(n.times[a]), Set(n.plus[a]));
    const V inside = hn::Sub(u, hn::Floor(u));
    return hn::IfThenElseZero(hn::Lt(inside, Set(2)), inside);  // lanes that are nowhere
  };
  const Vec3 place = {axis(0, p.x), axis(1, p.y), axis(2, p.z)};
  V sum = hn::Zero(D());
  for (const ExactOctave& o : octaves) {
    sum = hn::MulAdd(hn::Abs(ExactNoise(o, place)), Set(o.weight), sum);
  }
  return sum;
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
