// Random numbers of lattice points on plain integers: what simd/lattice-inl.h makes in vectors.
#ifndef TESSERA_SIMD_LATTICE_H_
#define TESSERA_SIMD_LATTICE_H_

#include <cstdint>

namespace tessera::simd {

inline constexpr uint32_t kAxis[4] = {0x9e3779b1u, 0x85ebca77u, 0xc2b2ae3du, 0x27d4eb2fu};
inline constexpr uint32_t kMix1 = 0x2c1b3c6du, kMix2 = 0x297a2d39u, kNext = 0x9e3779b9u;

inline uint32_t LatticeMix(uint32_t h) {
  h *= kMix1;
  return (h ^ (h >> 15)) * kMix2;
}
// The k-th further number of a lattice point (k from 1).
inline uint32_t LatticeNext(uint32_t h, uint32_t k) { return LatticeMix((h ^ (h >> 16)) + k * kNext); }

}  // namespace tessera::simd

#endif  // TESSERA_SIMD_LATTICE_H_
