// binary16 and float, one at a time, with the bits of simd/convert-inl.h and of the hardware: to nearest
// even, infinities kept, NaN made quiet with the upper bits of its payload, subnormals exact.
#ifndef TESSERA_BASE_HALF_H_
#define TESSERA_BASE_HALF_H_

#include <bit>
#include <cstdint>

namespace tessera::base {

inline float FloatFromHalf(uint16_t half) {
  const uint32_t sign = (half & 0x8000u) << 16, magnitude = half & 0x7FFFu;
  uint32_t bits = magnitude << 13;
  if (magnitude < 0x400) {  // zero and the subnormals, whose last bit is 2^-24
    bits = std::bit_cast<uint32_t>(static_cast<float>(magnitude) * 0x1p-24f);
  } else if (magnitude < 0x7C00) {
    bits += (127u - 15u) << 23;
  } else {
    bits |= magnitude == 0x7C00 ? 0x7F800000u : 0x7FC00000u;
  }
  return std::bit_cast<float>(bits | sign);
}

inline uint16_t HalfFromFloat(float value) {
  const uint32_t all = std::bit_cast<uint32_t>(value), sign = (all & 0x80000000u) >> 16,
                 bits = all & 0x7FFFFFFFu;
  uint32_t half;
  if (bits > 0x7F800000u) {
    half = 0x7E00u | ((bits >> 13) & 0x3FFu);
  } else if (bits >= 143u << 23) {  // 2^16
    half = 0x7C00u;
  } else if (bits < 113u << 23) {
    // Below 2^-14: a sum with 0.5 rounds to multiples of 2^-24 and has them at its end.
    half = std::bit_cast<uint32_t>(std::bit_cast<float>(bits) + 0.5f) - std::bit_cast<uint32_t>(0.5f);
  } else {  // a carry out of the mantissa raises the exponent, to infinity from 65520 on
    half = (bits - (112u << 23) + 0xFFFu + ((bits >> 13) & 1u)) >> 13;
  }
  return static_cast<uint16_t>(half | sign);
}

}  // namespace tessera::base

#endif  // TESSERA_BASE_HALF_H_
