// Image files of strangers through our opener: formats by what they begin with, headers, pixels.
#include "fuzz/fuzz.h"
#include "fuzz/operations.h"
#include "fuzz/pictures.h"

using namespace tessera;

namespace {

const std::vector<std::string> kExtensions = {".exr", ".png",  ".tif", ".jpg", ".dpx", ".hdr", ".gif",
                                              ".bmp", ".webp", ".jp2", ".sgi", ".ppm", ".tga", ".rla",
                                              ".cin", ".heic", ".npy", ".vdb", ""};

}  // namespace

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  for (size_t i = 0; i < kExtensions.size(); ++i) {
    for (const int channels : {3, 4}) {
      const std::string file = kExtensions[i].empty() || kExtensions[i] == ".vdb"
                                   ? ""
                                   : PictureFile(kExtensions[i], "", PixelType::kUint8, channels, 9, 7);
      if (!file.empty()) seeds.push_back(static_cast<char>(i) + file);
    }
  }
  for (const char* packing : {"none", "lzw", "packbits", "zip"})
    seeds.push_back('\2' + PictureFile(".tif", packing, PixelType::kUint16, 3, 9, 7));
  return seeds;
}
std::vector<std::string> Words() {
  return {"SDPX",
          "XPDS",
          "#?RADIANCE",
          "GIF89a",
          "BM",
          "WEBP",
          "VP8L",
          "ftypheic",
          " BDV",
          "P6\n",
          "P3\n",
          "Pf\n",
          "TRUEVISION-XFILE.",
          "\x80\x2a\x5f\xd7",
          "\x01\xda",
          "\xff\x4f\xff\x51",
          "\x93NUMPY",
          "'fortran_order': True",
          "'shape': (2, 3, 4), ",
          "compression",
          "tiles",
          "IHDR"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static std::vector<std::unique_ptr<fuzz::File>> files;
  if (files.empty()) {
    for (const std::string& extension : kExtensions)
      files.push_back(std::make_unique<fuzz::File>("picture" + extension));
  }
  fuzz::Input in(data, size);
  const size_t kind = in.Below(kExtensions.size());
  const std::string& name = files[kind]->Put(in.Rest());
  fuzz::Try([&] { fuzz::RenderSmall(Read(name)); });
  fuzz::Try([&] { Subimages(name); });
  return 0;
}
