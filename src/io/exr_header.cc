// The attributes of an EXR file's headers: OpenEXR takes memory for as many bytes as one declares before it
// looks whether the file has them.
#include "io/exr_header.h"

#include <array>
#include <cstdint>
#include <string>

#include "base/input_file.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

constexpr uint32_t kMagic = 20000630, kSeveralParts = 0x1000;
constexpr int kMostParts = 1 << 16;

uint32_t TakeWord(std::istream& stream) {
  std::array<unsigned char, 4> b{};
  stream.read(reinterpret_cast<char*>(b.data()), b.size());
  return b[0] | uint32_t{b[1]} << 8 | uint32_t{b[2]} << 16 | uint32_t{b[3]} << 24;
}

// Up to a byte of 0; what is longer than a name may be is the library's to refuse.
std::string TakeName(std::istream& stream) {
  constexpr size_t kLongest = 256;
  std::string name;
  for (int c = stream.get(); c > 0 && name.size() <= kLongest; c = stream.get()) name += static_cast<char>(c);
  return name;
}

}  // namespace

void CheckExrHeader(const std::string& file) {
  base::InputFile stream(file, "an image file");
  if (TakeWord(stream) != kMagic) return;
  const bool several = (TakeWord(stream) & kSeveralParts) != 0;
  for (int part = 0; part < kMostParts; ++part) {
    bool empty = true;
    for (std::string name = TakeName(stream); !name.empty(); name = TakeName(stream), empty = false) {
      TakeName(stream);  // its type
      const int64_t size = TakeWord(stream), here = stream.tellg();
      if (!stream) return;
      if (size > stream.size() - here) {
        throw DataError(file, "found an attribute \"" + base::Shown(name) + "\" of " + std::to_string(size) +
                                  " bytes declared in a file of " + std::to_string(stream.size()) +
                                  " bytes, expected one that the file holds");
      }
      stream.seekg(here + size);
    }
    if (!stream || !several || empty) return;
  }
}

}  // namespace tessera::io
