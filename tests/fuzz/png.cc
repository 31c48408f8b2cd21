// PNG by our decoder beside OpenImageIO's; checksums are mended so that damage gets past them.
#include <libdeflate.h>

#include "fuzz/codecs.h"
#include "fuzz/pictures.h"

using namespace tessera;

namespace {

// The checksum of every chunk.
void MendChunks(std::string& file) {
  for (size_t at = 8; at + 12 <= file.size();) {
    const auto byte = [&](size_t i) {
      return static_cast<uint32_t>(static_cast<unsigned char>(file[at + i]));
    };
    const size_t length = byte(0) << 24 | byte(1) << 16 | byte(2) << 8 | byte(3);
    if (length > file.size() - at - 12) return;
    const uint32_t sum = libdeflate_crc32(0, file.data() + at + 4, length + 4);
    for (size_t i = 0; i < 4; ++i) file[at + 8 + length + i] = static_cast<char>(sum >> (24 - 8 * i));
    at += 12 + length;
  }
}

}  // namespace

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  for (const int channels : {1, 2, 3, 4}) {
    for (const PixelType type : {PixelType::kUint8, PixelType::kUint16})
      seeds.push_back('m' + PictureFile(".png", "", type, channels));
  }
  seeds.push_back('m' + PictureFile(".png", "", PixelType::kUint8, 3, 400, 90));
  return seeds;
}
std::vector<std::string> Words() {
  return {"IHDR", "IDAT", "PLTE", "tRNS", "gAMA", "iCCP",  "sRGB",
          "IEND", "cHRM", "zTXt", "eXIf", "sBIT", "x\x9c", "x\x01"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static fuzz::File file("codec.png");
  fuzz::Input in(data, size);
  const bool mended = in.Take<char>() == 'm';
  std::string bytes(in.Rest());
  if (mended) MendChunks(bytes);
  fuzz::CompareCodecs(file.Put(bytes), true);
  return 0;
}
