// Attributes one behind the other (OpenEXR, "OpenEXR File Layout").
#include "io/codec/exr_header.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <iterator>

namespace tessera::io {

bool ParseExrHeader(std::span<const unsigned char> file, ExrHeader& header) {
  constexpr size_t kFlags = 4, kFirst = 8;
  constexpr unsigned char kMagic[4] = {0x76, 0x2F, 0x31, 0x01};
  constexpr unsigned kLongNames = 4;
  if (file.size() < kFirst || !std::equal(std::begin(kMagic), std::end(kMagic), file.begin()) ||
      (file[kFlags + 1] & ~kLongNames) != 0) {
    return false;
  }
  size_t at = kFirst;
  const auto text = [&] {
    const auto end =
        std::find(file.begin() + static_cast<ptrdiff_t>(std::min(at, file.size())), file.end(), 0);
    std::string result(file.begin() + static_cast<ptrdiff_t>(std::min(at, file.size())), end);
    at = static_cast<size_t>(end - file.begin()) + 1;
    return result;
  };
  for (;;) {
    const std::string name = text();
    if (at > file.size()) return false;
    if (name.empty()) break;
    text();  // the type
    uint32_t size = 0;
    if (at + sizeof size > file.size()) return false;
    std::memcpy(&size, file.data() + at, sizeof size);
    at += sizeof size;
    if (size > file.size() - at) return false;
    const size_t next = at + size;
    if (name == "lineOrder") header.increasing = size == 1 && file[at] == 0;
    if (name == "channels") {
      constexpr size_t kChannelBytes = 16;  // type, linearity, samplings
      for (std::string channel = text(); !channel.empty() && at < next; channel = text()) {
        header.channels.push_back(channel);
        at += kChannelBytes;
      }
    }
    at = next;
  }
  header.end = at;
  return true;
}

}  // namespace tessera::io
