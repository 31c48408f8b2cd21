// EXR by our decoder beside OpenImageIO's.
#include "fuzz/codecs.h"
#include "fuzz/pictures.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  for (const char* packing : {"none", "zip", "zips", "piz", "rle", "pxr24", "b44", "b44a", "dwaa"}) {
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat})
      seeds.push_back(PictureFile(".exr", packing, type, packing[0] == 'z' ? 3 : 1));
  }
  return seeds;
}
std::vector<std::string> Words() {
  return {"channels",
          "chlist",
          "compression",
          "dataWindow",
          "box2i",
          "displayWindow",
          "lineOrder",
          "pixelAspectRatio",
          "screenWindowCenter",
          "tiles",
          "tiledesc",
          "type",
          "scanlineimage",
          "tiledimage",
          "deepscanline",
          "chunkCount",
          "name",
          "multiView",
          "preview",
          "x\x9c",
          std::string("\0\0\0\x80", 4)};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static fuzz::File file("codec.exr");
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  // What is packed with a checksum; rubbish of the others may be rubbish of another kind.
  fuzz::CompareCodecs(file.Put(bytes), false);
  return 0;
}
