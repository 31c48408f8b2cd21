// What files say of their colours: ICC profiles, names, chromaticities, CICP.
#include <cstddef>

#include "fuzz/fuzz.h"
#include "io/color_state.h"
#include "tessera/io.h"

using namespace tessera;

namespace {

std::string BigEndian(uint32_t v) {
  return {static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8),
          static_cast<char>(v)};
}

// A profile of one tag.
std::string Profile(const std::string& tag) {
  std::string profile(128, '\0');
  profile.replace(36, 4, "acsp");
  return profile + BigEndian(1) + "desc" + BigEndian(144) + BigEndian(static_cast<uint32_t>(tag.size())) +
         tag;
}

}  // namespace

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::string wide;
  for (const char c : std::string("Display P3")) wide += '\0', wide += c;
  return {"p" + Profile("desc" + BigEndian(0) + BigEndian(5) + std::string("sRGB\0", 5)),
          "p" + Profile("mluc" + BigEndian(0) + BigEndian(1) + BigEndian(12) + "enUS" +
                        BigEndian(static_cast<uint32_t>(wide.size())) + BigEndian(28) + wide),
          "colorInteropID\nlin_ap1_scene",
          "coiio:ColorSpace\nLinear",
          "noiio:Gamma\n2.2",
          std::string("x\x01\0\0\0\x0d\0\0\0", 9),
          std::string("y\x3d\x0a\x17\x3f\x8f\xc2\xf5\x3e", 9)};
}
std::vector<std::string> Words() {
  return {"acsp",
          "desc",
          "mluc",
          "sRGB",
          "Linear",
          "ACEScg",
          "oiio:ColorSpace",
          "colorInteropID",
          "ICCProfile",
          "CICP",
          "chromaticities",
          BigEndian(0xFFFFFFFF),
          BigEndian(0xFFFFFFF4),
          BigEndian(28)};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  const char kind = in.Take<char>();
  if (kind == 'p') {
    const std::string_view text = in.Rest();
    const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
    const std::vector<std::byte> profile(bytes, bytes + text.size());
    io::SpaceOfIccProfile(profile);
    static const Node kPixel = FromImage(Image(ImageSpec(1, 1, 3)));
    fuzz::Try([&] {
      fuzz::Require(IccProfileOf(WithIccProfile(kPixel, profile).spec()) == profile, "another profile");
    });
    return 0;
  }
  OIIO::ImageSpec spec(1, 1, 3, OIIO::TypeDesc::HALF);
  const bool floats = kind == 'y';
  if (kind == 'x' || floats) {
    float xy[8];
    int codes[4];
    for (float& v : xy) v = in.Take<float>();
    for (int& v : codes) v = static_cast<int>(in.Take<int32_t>());
    floats ? spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), xy)
           : spec.attribute("CICP", OIIO::TypeDesc(OIIO::TypeDesc::INT, 4), codes);
  } else {
    const std::string name(in.Until('\n'));
    spec.attribute(name, std::string(in.Rest()));
  }
  const ColorState state = io::ColorStateOf(spec);
  io::SetColorSpace(spec, state);
  io::SetExrColorState(spec, state);
  return 0;
}
