// Where the last block of a deflate stream begins, which is what joining streams needs to know.
#ifndef TESSERA_IO_CODEC_DEFLATE_TAIL_H_
#define TESSERA_IO_CODEC_DEFLATE_TAIL_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tessera::io {

// Bits are counted from the lowest one of the first byte, as deflate does (RFC 1951).
struct DeflateTail {
  size_t last_block = 0;  // the bit that says "last block"
  size_t end = 0;         // the bit after the last block
};

// Walks over a whole stream without unpacking it, at several times the speed of unpacking; empty for bytes
// that are not one.
std::optional<DeflateTail> FindDeflateTail(std::span<const uint8_t> stream);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_DEFLATE_TAIL_H_
