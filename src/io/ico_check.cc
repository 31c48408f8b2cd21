// The bytes of an ICO: a directory of one entry, a header, rows from the bottom as blue, green, red and
// alpha.
#include "io/ico_check.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>
#include <vector>

namespace tessera::io {
namespace {

constexpr size_t kDirectory = 6, kEntry = 16, kHeader = 40;
constexpr std::string_view kPngBegin = "\x89PNG\r\n\x1a\n", kPngEnd = "IEND\xae\x42\x60\x82";

}  // namespace

bool IcoHolds(const std::string& file, int width, int height, int channels, const base::Digest& digest) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  const size_t first = kDirectory + kEntry;
  if (bytes.size() < first + kHeader ||
      std::string_view(bytes).substr(0, kDirectory) != std::string_view("\0\0\1\0\1\0", 6))
    return false;
  if (bytes.compare(first, kPngBegin.size(), kPngBegin) == 0) return bytes.ends_with(kPngEnd);
  const auto columns = static_cast<size_t>(width), rows = static_cast<size_t>(height),
             kept = static_cast<size_t>(channels);
  const size_t pixel = kept % 2 == 0 ? 4 : 3, row = (columns * pixel + 3) / 4 * 4;
  if (bytes.size() < first + kHeader + row * rows) return false;
  base::Digest found{};
  std::vector<std::byte> samples(columns * kept);
  for (size_t y = 0; y < rows; ++y) {
    const char* from = bytes.data() + first + kHeader + (rows - 1 - y) * row;
    for (size_t x = 0; x < columns; ++x, from += pixel) {
      for (size_t c = 0; c < kept; ++c) {
        // Of grey pictures blue, green and red are the same.
        const size_t at = kept % 2 == 0 && c + 1 == kept ? 3 : kept < 3 ? 0 : 2 - c;
        samples[x * kept + c] = static_cast<std::byte>(from[at]);
      }
    }
    base::AddToDigest(found, samples);
  }
  return found == digest;
}

}  // namespace tessera::io
