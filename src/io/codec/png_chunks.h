// PNG's chunks (PNG specification, section 5): a length, a name, bytes, a checksum of the latter two.
#ifndef TESSERA_IO_CODEC_PNG_CHUNKS_H_
#define TESSERA_IO_CODEC_PNG_CHUNKS_H_

#include <cstddef>
#include <cstdint>
#include <istream>
#include <optional>
#include <span>
#include <string_view>

namespace tessera::io {

constexpr uint8_t kPngSignature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr size_t kPngChunkFrame = 12;  // bytes of a chunk beside its own

inline uint32_t BigEndian32(const uint8_t* bytes) {
  return static_cast<uint32_t>(bytes[0]) << 24 | static_cast<uint32_t>(bytes[1]) << 16 |
         static_cast<uint32_t>(bytes[2]) << 8 | bytes[3];
}
inline void SetBigEndian32(uint8_t* bytes, uint32_t value) {
  for (int i = 0; i < 4; ++i) bytes[i] = static_cast<uint8_t>(value >> (24 - 8 * i));
}

struct PngChunk {
  std::string_view name;
  std::span<const uint8_t> whole, bytes;
};

// The chunk at `at`, its checksum not looked at; empty where the file ends before it does.
inline std::optional<PngChunk> PngChunkAt(std::span<const uint8_t> file, size_t at) {
  if (at > file.size() || file.size() - at < kPngChunkFrame) return std::nullopt;
  const size_t length = BigEndian32(file.data() + at);
  if (length > file.size() - at - kPngChunkFrame) return std::nullopt;
  return PngChunk{{reinterpret_cast<const char*>(file.data()) + at + 4, 4},
                  file.subspan(at, length + kPngChunkFrame),
                  file.subspan(at + 8, length)};
}

// f(name, length, where its bytes begin) for the chunks of a file as far as IEND, the last one perhaps longer
// than what is left.
template <class F>
void ForPngChunks(std::istream& file, int64_t size, const F& f) {
  constexpr auto kFrame = static_cast<int64_t>(kPngChunkFrame);
  for (int64_t at = sizeof kPngSignature; size - at >= kFrame;) {
    uint8_t head[8];
    file.seekg(at);
    if (!file.read(reinterpret_cast<char*>(head), sizeof head)) return;
    const int64_t length = BigEndian32(head);
    const std::string_view name(reinterpret_cast<const char*>(head) + 4, 4);
    if (name == "IEND") return;
    f(name, length, at + 8);
    at += kFrame + length;
  }
}

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_PNG_CHUNKS_H_
