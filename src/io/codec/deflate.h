// Deflate by libdeflate: whole buffers, and segments of one stream that are packed independently of each
// other.
#ifndef TESSERA_IO_CODEC_DEFLATE_H_
#define TESSERA_IO_CODEC_DEFLATE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "base/bytes.h"

struct libdeflate_compressor;
struct libdeflate_decompressor;

namespace tessera::io {

// A zlib stream's first two bytes, which say how hard the packer tried, and its checksum of nothing.
constexpr uint8_t kZlibHeader[2] = {0x78, 0x9C};
constexpr uint32_t kAdlerOfNothing = 1;

// Packs; one thread at a time.
class Deflater {
 public:
  // 1 to 12, fastest to smallest. Throws Error when memory is refused.
  explicit Deflater(int level);
  ~Deflater();
  Deflater(Deflater&&) noexcept;

  // Appends a whole zlib stream.
  void Zlib(std::span<const uint8_t> bytes, base::Bytes& out);
  // Appends a part of a deflate stream that ends at a whole byte, so that the next part may follow; nothing
  // in it refers to parts before it.
  void Segment(std::span<const uint8_t> bytes, bool last, base::Bytes& out);

 private:
  libdeflate_compressor* packer_;
};

// Unpacks; one thread at a time.
class Inflater {
 public:
  // Throws Error when memory is refused.
  Inflater();
  ~Inflater();
  Inflater(Inflater&&) noexcept;

  // Fills `out` from a whole zlib stream; false where it is damaged or holds more or less than that.
  bool Zlib(std::span<const uint8_t> bytes, std::span<uint8_t> out);

  struct Unpacked {
    bool fits, whole;  // what was unpacked has room; nothing is damaged
    size_t bytes;
  };
  // Unpacks a whole zlib stream of any length into the front of `out`.
  Unpacked ZlibWithin(std::span<const uint8_t> bytes, std::span<uint8_t> out);

 private:
  libdeflate_decompressor* unpacker_;
};

uint32_t Adler32(uint32_t before, std::span<const uint8_t> bytes);
// The checksum of two parts from theirs, and from the length of the second.
uint32_t JoinedAdler32(uint32_t first, uint32_t second, size_t second_bytes);
uint32_t Crc32(uint32_t before, std::span<const uint8_t> bytes);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_DEFLATE_H_
