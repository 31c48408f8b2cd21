// Runs of bytes: 0 to 127, so many and one more of the byte that follows; negative, so many bytes as they
// are.
#include "io/rla_repair.h"

#include <bit>
#include <cstdint>
#include <fstream>
#include <vector>

namespace tessera::io {
namespace {

constexpr std::streamoff kHeader = 740;  // the offsets of the rows follow, the lowest row's first

// Big-endian.
uint32_t Number(std::span<const unsigned char> bytes) {
  uint32_t value = 0;
  for (const unsigned char b : bytes) value = value << 8 | b;
  return value;
}

// Where the last run of one byte's plane holds a single byte, its place; `at` goes behind the plane. False
// where it does not fit.
bool FindLast(std::span<const unsigned char> runs, size_t width, size_t& at, size_t& last) {
  last = 0;
  for (size_t x = 0; x < width;) {
    if (at + 1 >= runs.size()) return false;
    const int count = static_cast<signed char>(runs[at]);
    const size_t length = static_cast<size_t>(count < 0 ? -count : count + 1);
    last = count == 0 ? at + 1 : 0;
    at += count < 0 ? length + 1 : 2;
    x += length;
    if (x > width || at > runs.size()) return false;
  }
  return true;
}

}  // namespace

bool RepairRla(const std::string& file, int width, int rows, int channels, size_t bytes,
               std::span<const std::byte> last_column) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  std::vector<unsigned char> offsets(4 * static_cast<size_t>(rows)), runs;
  stream.seekg(kHeader);
  stream.read(reinterpret_cast<char*>(offsets.data()), static_cast<std::streamsize>(offsets.size()));
  for (size_t y = 0; stream && y < static_cast<size_t>(rows); ++y) {
    auto place = static_cast<std::streamoff>(
        Number(std::span(offsets).subspan(4 * (static_cast<size_t>(rows) - 1 - y), 4)));
    for (int c = 0; c < channels; ++c) {
      unsigned char length[2] = {};
      stream.seekg(place);
      stream.read(reinterpret_cast<char*>(length), sizeof length);
      runs.resize(Number(length));
      stream.read(reinterpret_cast<char*>(runs.data()), static_cast<std::streamsize>(runs.size()));
      if (!stream) return false;
      place += sizeof length;
      size_t at = 0, last = 0;
      for (size_t plane = 0; plane < bytes; ++plane) {  // of the highest bytes first
        if (!FindLast(runs, static_cast<size_t>(width), at, last)) return false;
        const size_t own = std::endian::native == std::endian::little ? bytes - 1 - plane : plane;
        const auto right = static_cast<unsigned char>(
            last_column[(y * static_cast<size_t>(channels) + static_cast<size_t>(c)) * bytes + own]);
        if (last == 0 || runs[last] == right) continue;
        stream.seekp(place + static_cast<std::streamoff>(last));
        stream.put(static_cast<char>(right));
      }
      place += static_cast<std::streamoff>(runs.size());
    }
  }
  stream.close();
  return stream.good();
}

}  // namespace tessera::io
