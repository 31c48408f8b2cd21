// The noise that is convolved when there is no image: codes of 8 bits from a hash of place and seed.
#ifndef TESSERA_OPS_FLOW_NOISE_H_
#define TESSERA_OPS_FLOW_NOISE_H_

#include <cstdint>

namespace tessera::ops::flow {

// An integer hash with good avalanche (C. Wellons, "lowbias32").
inline constexpr uint32_t kMixFirst = 0x7feb352du, kMixSecond = 0x846ca68bu, kMixPlace = 0x9e3779b1u;
inline uint32_t Mix(uint32_t h) {
  h = (h ^ (h >> 16)) * kMixFirst;
  h = (h ^ (h >> 15)) * kMixSecond;
  return h ^ (h >> 16);
}

// White noise of cell x of a row, 0 to 255.
inline uint32_t WhiteCode(int x, uint32_t row_key) {
  return Mix(static_cast<uint32_t>(x) * kMixPlace ^ row_key) >> 24;
}
// What all cells of a row share.
inline uint32_t RowKey(int y, uint32_t seed) {
  return Mix(static_cast<uint32_t>(y) * 0x85ebca77u ^ Mix(seed + 0x632be5abu));
}

}  // namespace tessera::ops::flow

#endif  // TESSERA_OPS_FLOW_NOISE_H_
