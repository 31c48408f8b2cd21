// Volumes from image files: slices one above the other, one file each, OpenVDB.
#include "fuzz/fuzz.h"
#include "fuzz/pictures.h"
#include "tessera/volume.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  const std::string extensions[] = {".png", ".tif", ".exr"};
  for (int i = 0; i < 3; ++i) {
    for (const char* head : {"\2\0", "\0\0", "\1\1"}) {
      seeds.push_back(static_cast<char>(i) + std::string(head, 2) +
                      PictureFile(extensions[i], "", i == 2 ? PixelType::kHalf : PixelType::kUint8, 3, 6, 8));
    }
  }
  seeds.push_back(std::string("\3\0\0 BDV\0\0\0\0\xe0\0\0\0", 15));
  return seeds;
}
std::vector<std::string> Words() {
  return {" BDV", "Tree_float_5_4_3", "file_bbox_min", "vec3i", "name", "string"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static fuzz::File files[] = {fuzz::File("slice_1.png"), fuzz::File("slice_1.tif"),
                               fuzz::File("slice_1.exr"), fuzz::File("grid.vdb")};
  fuzz::Input in(data, size);
  const size_t kind = in.Below(4);
  VolumeFileParams params;
  params.slices = static_cast<int>(in.Below(8));
  const size_t more = in.Below(16);
  params.channel = static_cast<int>(more & 3);
  if ((more & 4) != 0) params.part = "1";
  std::string name = files[kind].Put(in.Rest());
  if ((more & 8) != 0 && kind < 3) name.replace(name.rfind('1'), 1, "#");
  fuzz::Try([&] {
    const Volume volume = ReadVolume(name, params);
    volume.Sample(0.5, 1e30, -3);
    volume.Range();
  });
  return 0;
}
