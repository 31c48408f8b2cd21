// Raw samples of a volume: sizes, types, headers against bytes.
#include "fuzz/fuzz.h"
#include "tessera/volume.h"

using namespace tessera;

namespace {

// What stands before the samples.
struct Shape {
  int32_t size[3];
  int64_t header;
  uint8_t type, order, sign;
  float spacing[3];
};

std::string SeedOf(const Shape& shape, size_t bytes) {
  std::string seed;
  const auto put = [&seed](const auto& value) {
    seed.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(shape.size[0]), put(shape.size[1]), put(shape.size[2]), put(shape.header);
  put(shape.type), put(shape.order), put(shape.sign);
  put(shape.spacing[0]), put(shape.spacing[1]), put(shape.spacing[2]);
  for (size_t i = 0; i < bytes; ++i) seed += static_cast<char>(i * 41);
  return seed;
}

}  // namespace

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  return {SeedOf({{4, 3, 2}, 0, 0, 0, 0, {1, 1, 1}}, 24), SeedOf({{4, 3, 2}, 5, 1, 1, 1, {1, 2, 1}}, 53),
          SeedOf({{2, 2, 2}, 0, 2, 0, 0, {1, 1, 0.5f}}, 16), SeedOf({{2, 2, 2}, 1, 3, 1, 0, {1, 1, 1}}, 33)};
}
std::vector<std::string> Words() { return {std::string("\0\0\xc0\x7f", 4), std::string("\0\0\x80\x7f", 4)}; }
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static fuzz::File file("volume.raw");
  fuzz::Input in(data, size);
  VolumeFileParams params;
  for (int& side : params.raw.size) side = in.Take<int32_t>();
  params.raw.header = in.Take<int64_t>();
  params.raw.type = static_cast<PixelType>(in.Below(4));
  params.raw.big_endian = in.Below(2) == 1;
  params.raw.is_signed = in.Below(2) == 1;
  for (double& side : params.spacing) side = in.Take<float>();
  if (params.raw.size[0] == 0 && params.raw.size[1] == 0 && params.raw.size[2] == 0)
    return 0;  // another reader's
  const std::string& name = file.Put(in.Rest());
  fuzz::Try([&] {
    const Volume volume = ReadVolume(name, params);
    const auto range = volume.Range();
    fuzz::Require(range[0] <= range[1], "a range that is none");
    volume.Sample(1e9, -1e9, 0.5);
    volume.Gradient(0.5, 0.5, 0.5);
  });
  return 0;
}
