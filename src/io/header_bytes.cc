// The attributes of an EXR file's headers, the user data of a DPX file's.
#include "io/header_bytes.h"

#include <array>
#include <cstdint>
#include <string>

#include "base/input_file.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

constexpr uint32_t kExrMagic = 20000630, kSeveralParts = 0x1000;
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

[[noreturn]] void Refuse(const std::string& file, const std::string& what, int64_t size, int64_t file_size) {
  throw DataError(file, "found " + what + " of " + std::to_string(size) + " bytes declared in a file of " +
                            std::to_string(file_size) + " bytes, expected what the file holds");
}

void CheckExr(const std::string& file) {
  base::InputFile stream(file, "an image file");
  if (TakeWord(stream) != kExrMagic) return;
  const bool several = (TakeWord(stream) & kSeveralParts) != 0;
  for (int part = 0; part < kMostParts; ++part) {
    bool empty = true;
    for (std::string name = TakeName(stream); !name.empty(); name = TakeName(stream), empty = false) {
      TakeName(stream);  // its type
      const int64_t size = TakeWord(stream), here = stream.tellg();
      if (!stream) return;
      if (size > stream.size() - here) {
        Refuse(file, "an attribute \"" + base::Shown(name) + "\"", size, stream.size());
      }
      stream.seekg(here + size);
    }
    if (!stream || !several || empty) return;
  }
}

void CheckDpx(const std::string& file) {
  constexpr uint32_t kBackward = 0x58504453, kForward = 0x53445058, kNone = 0xFFFFFFFF;
  constexpr int kUserSize = 32;
  base::InputFile stream(file, "an image file");
  const uint32_t magic = TakeWord(stream);
  if (magic != kBackward && magic != kForward) return;
  stream.seekg(kUserSize);
  uint32_t size = TakeWord(stream);
  if (magic == kBackward) size = __builtin_bswap32(size);
  if (stream && size != kNone && size > stream.size()) Refuse(file, "user data", size, stream.size());
}

}  // namespace

void CheckHeaderBytes(const std::string& file, const std::string& format) {
  if (format == "openexr") CheckExr(file);
  if (format == "dpx") CheckDpx(file);
}

}  // namespace tessera::io
