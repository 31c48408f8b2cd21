// TIFF by our decoder beside OpenImageIO's.
#include "fuzz/codecs.h"
#include "fuzz/pictures.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  const auto one = [](const char* name) {
    return Attribute{name, "int", {std::byte{1}, std::byte{0}, std::byte{0}, std::byte{0}}, {}};
  };
  for (const char* packing : {"none", "zip", "lzw"}) {
    for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kFloat})
      seeds.push_back(PictureFile(".tif", packing, type, 4));
    seeds.push_back(PictureFile(".tif", packing, PixelType::kUint8, 3, 13, 19, {one("tiff:bigtiff")}));
    seeds.push_back(PictureFile(".tif", packing, PixelType::kUint16, 3, 13, 19, {one("tiff:RowsPerStrip")}));
  }
  return seeds;
}
std::vector<std::string> Words() {
  return {std::string("II*\0", 4),
          std::string("MM\0*", 4),
          std::string("II+\0", 4),
          std::string("\3\1\3\0\1\0\0\0\1", 9),
          std::string("\3\1\3\0\1\0\0\0\x08", 9),
          std::string("\x1c\1\3\0\1\0\0\0\2", 9),
          std::string("\x3d\1\3\0\1\0\0\0\2", 9),
          std::string("\x15\1\3\0\1\0\0\0", 8),
          "x\x9c"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static fuzz::File file("codec.tif");
  fuzz::CompareCodecs(file.Put({reinterpret_cast<const char*>(data), size}), true);
  return 0;
}
