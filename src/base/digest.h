// What tells pictures apart without keeping them: 128 bits of all samples.
#ifndef TESSERA_BASE_DIGEST_H_
#define TESSERA_BASE_DIGEST_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

#include "tessera/image.h"

namespace tessera::base {

using Digest = std::array<uint64_t, 2>;

// Goes on with the digest of bytes that came in pieces; each piece is begun anew.
inline void AddToDigest(Digest& digest, std::span<const std::byte> bytes) {
  for (size_t at = 0; at < bytes.size(); at += sizeof(uint64_t)) {
    uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min(sizeof word, bytes.size() - at));
    digest[0] = (digest[0] ^ word) * 0xff51afd7ed558ccdu;
    digest[0] ^= digest[0] >> 32;
    digest[1] = (digest[1] + word) * 0xc4ceb9fe1a85ec53u;
    digest[1] ^= digest[1] >> 29;
  }
}

// Pictures of the same type, window and channels whose digests agree are the same one.
inline std::array<uint64_t, 2> DigestOf(const ConstImageView& picture) {
  std::array<uint64_t, 2> digest = {0x9e3779b97f4a7c15u, 0xc2b2ae3d27d4eb4fu};
  const size_t bytes = PixelBytes(picture.type);
  for (int y = picture.roi.y0; y < picture.roi.y1; ++y) {
    for (int x = picture.roi.x0; x < picture.roi.x1; ++x) {
      const std::byte* const pixel = picture.At(x, y);
      for (int c = 0; c < picture.channels; ++c) {
        uint64_t word = 0;
        std::memcpy(&word, pixel + c * picture.channel_stride, bytes);
        digest[0] = (digest[0] ^ word) * 0xff51afd7ed558ccdu;
        digest[0] ^= digest[0] >> 32;
        digest[1] = (digest[1] + word) * 0xc4ceb9fe1a85ec53u;
        digest[1] ^= digest[1] >> 29;
      }
    }
  }
  return digest;
}

// As part of a key: type, size, channels, samples.
inline std::string DigestText(const ConstImageView& picture) {
  const std::array<uint64_t, 2> digest = DigestOf(picture);
  std::string text;
  for (const int n :
       {static_cast<int>(picture.type), picture.roi.width(), picture.roi.height(), picture.channels})
    text += std::to_string(n) + ' ';
  return text + std::to_string(digest[0]) + ' ' + std::to_string(digest[1]) + ' ';
}

}  // namespace tessera::base

#endif  // TESSERA_BASE_DIGEST_H_
