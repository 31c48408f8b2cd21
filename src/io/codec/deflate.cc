// libdeflate has no flush: a segment's last block is found and told that it is not the last.
#include "io/codec/deflate.h"

#include <libdeflate.h>

#include <utility>

#include "io/codec/deflate_tail.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::io {

Deflater::Deflater(int level) : packer_(libdeflate_alloc_compressor(level)) {
  if (packer_ == nullptr) throw SystemError("memory", "refused by the system");
}
Deflater::~Deflater() { libdeflate_free_compressor(packer_); }
Deflater::Deflater(Deflater&& other) noexcept : packer_(std::exchange(other.packer_, nullptr)) {}

void Deflater::Zlib(std::span<const uint8_t> bytes, base::Bytes& out) {
  const size_t before = out.size(), bound = libdeflate_zlib_compress_bound(packer_, bytes.size());
  out.resize(before + bound);
  out.resize(before +
             libdeflate_zlib_compress(packer_, bytes.data(), bytes.size(), out.data() + before, bound));
}

void Deflater::Segment(std::span<const uint8_t> bytes, bool last, base::Bytes& out) {
  const size_t before = out.size(), bound = libdeflate_deflate_compress_bound(packer_, bytes.size());
  out.resize(before + bound);
  const size_t size =
      libdeflate_deflate_compress(packer_, bytes.data(), bytes.size(), out.data() + before, bound);
  out.resize(before + size);
  if (last) return;
  const std::span<uint8_t> own(out.data() + before, size);
  const auto tail = FindDeflateTail(own);
  if (!tail) throw Error("libdeflate", "found a stream that cannot be continued");  // a fault of the program
  own[tail->last_block / 8] &= static_cast<uint8_t>(~(1u << tail->last_block % 8));
  // An empty stored block: three bits of zero, the rest of their byte, no length and its complement.
  if (tail->end % 8 == 0 || tail->end % 8 > 5) out.push_back(0);
  out.insert(out.end(), {0, 0, 0xFF, 0xFF});
}

Inflater::Inflater() : unpacker_(libdeflate_alloc_decompressor()) {
  if (unpacker_ == nullptr) throw SystemError("memory", "refused by the system");
}
Inflater::~Inflater() { libdeflate_free_decompressor(unpacker_); }
Inflater::Inflater(Inflater&& other) noexcept : unpacker_(std::exchange(other.unpacker_, nullptr)) {}

bool Inflater::Zlib(std::span<const uint8_t> bytes, std::span<uint8_t> out) {
  return libdeflate_zlib_decompress(unpacker_, bytes.data(), bytes.size(), out.data(), out.size(), nullptr) ==
         LIBDEFLATE_SUCCESS;
}

Inflater::Unpacked Inflater::ZlibWithin(std::span<const uint8_t> bytes, std::span<uint8_t> out) {
  Unpacked found{};
  const libdeflate_result result =
      libdeflate_zlib_decompress(unpacker_, bytes.data(), bytes.size(), out.data(), out.size(), &found.bytes);
  found.fits = result != LIBDEFLATE_INSUFFICIENT_SPACE, found.whole = result == LIBDEFLATE_SUCCESS;
  return found;
}

uint32_t Adler32(uint32_t before, std::span<const uint8_t> bytes) {
  return libdeflate_adler32(before, bytes.data(), bytes.size());
}

uint32_t JoinedAdler32(uint32_t first, uint32_t second, size_t second_bytes) {
  constexpr uint64_t kBase = 65521;
  const uint64_t a1 = first & 0xFFFF, b1 = first >> 16, a2 = second & 0xFFFF, b2 = second >> 16;
  const uint64_t length = second_bytes % kBase;
  // Each sum of the second part began with 1 where it continues from a1.
  const uint64_t a = (a1 + a2 + kBase - 1) % kBase;
  const uint64_t b = (b1 + b2 + length * ((a1 + kBase - 1) % kBase)) % kBase;
  return static_cast<uint32_t>(b << 16 | a);
}

uint32_t Crc32(uint32_t before, std::span<const uint8_t> bytes) {
  return libdeflate_crc32(before, bytes.data(), bytes.size());
}

}  // namespace tessera::io
