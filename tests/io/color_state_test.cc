// The colour state of images in files: what each tag says, what is written, what a conversion leaves of it.
#include "io/color_state.h"

#include <fstream>

#include "files.h"
#include "tessera/color_state.h"
#include "tessera/ops/arithmetic.h"

namespace tessera {
namespace {

using namespace testing_io;
using OIIO::TypeDesc;

// A profile that holds its description alone: ASCII as version 2 has it, UTF-16 as version 4.
std::vector<std::byte> Profile(const std::string& name, bool version4 = false) {
  std::string tag =
      version4 ? std::string("mluc\0\0\0\0\0\0\0\1\0\0\0\14enUS", 20) : std::string("desc\0\0\0\0", 8);
  const auto number = [](size_t v) {
    return std::string{static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8),
                       static_cast<char>(v)};
  };
  if (version4) {
    tag += number(2 * name.size()) + number(28);
    for (const char c : name) tag += std::string(1, '\0') + c;
  } else {
    tag += number(name.size() + 1) + name + std::string(79, '\0');
  }
  std::string bytes(128, '\0');  // a display of RGB through XYZ under D50
  bytes.replace(0, 4, number(144 + tag.size())).replace(8, 1, version4 ? "\4" : "\2");
  bytes.replace(12, 12, "mntrRGB XYZ ").replace(36, 4, "acsp");
  bytes.replace(68, 12, number(63190) + number(65536) + number(54061));
  bytes += number(1) + "desc" + number(144) + number(tag.size()) + tag;
  const auto* const begin = reinterpret_cast<const std::byte*>(bytes.data());
  return {begin, begin + bytes.size()};
}

OIIO::ImageSpec Tagged(const std::string& space) {
  OIIO::ImageSpec spec(2, 2, 4, TypeDesc::UINT8);
  if (!space.empty()) spec.attribute("oiio:ColorSpace", space);
  return spec;
}
std::string Space(const OIIO::ImageSpec& spec) { return io::ColorStateOf(spec).space; }

TEST(ColorStateTest, EachTag) {
  EXPECT_EQ(Space(Tagged("")), "");
  EXPECT_EQ(Space(Tagged("sRGB")), "sRGB");
  EXPECT_EQ(Space(Tagged("srgb_tx")), "sRGB");
  EXPECT_EQ(Space(Tagged("Linear")), "scene_linear");
  EXPECT_EQ(Space(Tagged("a facility's own")), "a facility's own");
  OIIO::ImageSpec spec = Tagged("Linear");
  spec.attribute("oiio:Gamma", 1.0f);
  EXPECT_EQ(Space(spec), "lin_rec709");

  // Each is surer than those before it.
  const float ap1[8] = {0.713f, 0.293f, 0.165f, 0.83f, 0.128f, 0.044f, 0.32168f, 0.33767f};
  const float ap0[8] = {0.7347f, 0.2653f, 0, 1, 0.0001f, -0.077f, 0.32168f, 0.33767f};
  const float none[8] = {0.7f, 0.3f, 0.2f, 0.7f, 0.1f, 0.1f, 0.3f, 0.3f};
  const TypeDesc eight(TypeDesc::FLOAT, 8);
  spec.attribute("chromaticities", eight, ap0);
  EXPECT_EQ(Space(spec), "ACES2065-1");
  spec.attribute("chromaticities", eight, none);
  EXPECT_EQ(Space(spec), "");
  spec.attribute("chromaticities", eight, ap1);
  EXPECT_EQ(Space(spec), "ACEScg");
  const int p3[4] = {12, 13, 0, 1};
  spec.attribute("CICP", TypeDesc(TypeDesc::INT, 4), p3);
  EXPECT_EQ(Space(spec), "Display P3");
  for (const bool version4 : {false, true}) {
    for (const auto& [name, space] : std::vector<std::pair<std::string, std::string>>{
             {"sRGB IEC61966-2.1", "sRGB"}, {"Display P3", "Display P3"}, {"Some monitor", ""}}) {
      const std::vector<std::byte> profile = Profile(name, version4);
      spec.attribute("ICCProfile", TypeDesc(TypeDesc::UINT8, static_cast<int>(profile.size())),
                     profile.data());
      EXPECT_EQ(Space(spec), space) << name;
    }
  }
  spec.attribute("colorInteropID", "lin_ap0_scene");
  EXPECT_EQ(Space(spec), "ACES2065-1");
  EXPECT_TRUE(io::ColorStateOf(spec).premultiplied);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  EXPECT_FALSE(io::ColorStateOf(spec).premultiplied);
}

// Of a profile cut off anywhere, or with any byte changed, something is said or nothing; never a read beyond
// it.
TEST(ColorStateTest, BrokenProfiles) {
  for (const bool version4 : {false, true}) {
    const std::vector<std::byte> whole = Profile("sRGB IEC61966-2.1", version4);
    for (size_t size = 0; size < whole.size(); ++size) {
      io::SpaceOfIccProfile({whole.begin(), whole.begin() + static_cast<ptrdiff_t>(size)});
    }
    for (size_t at = 128; at < whole.size(); ++at) {
      std::vector<std::byte> broken = whole;
      broken[at] = std::byte{255};
      io::SpaceOfIccProfile(broken);
    }
  }
  EXPECT_THROW(WithIccProfile(FromImage(Image(ImageSpec(2, 2, 3))), {}), Error);
  EXPECT_THROW(WithIccProfile(FromImage(Image(ImageSpec(2, 2, 3))), std::vector<std::byte>(500)), Error);
}

using ColorFileTest = FileTest;

// Written and read again: the space, and that there is one truth of it in the file.
TEST_F(ColorFileTest, StatesComeBack) {
  const Node image = FromImage(Image(ImageSpec(4, 3, 4, PixelType::kHalf)));
  for (const std::string space :
       {"ACES2065-1", "ACEScg", "lin_rec709", "lin_p3d65", "lin_rec2020", "sRGB", "sRGB Display",
        "Rec.1886 Rec.709 Display", "Display P3", "raw", "a facility's own", "scene_linear"}) {
    SCOPED_TRACE(space);
    Write(WithColorState(image, {space}), Path("a.exr"));
    EXPECT_EQ(ColorStateOf(Read(Path("a.exr")).spec()).space, space);
  }
  Write(image, Path("a.exr"));
  EXPECT_EQ(ColorStateOf(Read(Path("a.exr")).spec()).space,
            "scene_linear");  // what OpenImageIO takes an EXR for
  for (const auto& [space, again] :
       std::vector<std::pair<std::string, std::string>>{{"sRGB Display", "sRGB"},
                                                        {"Display P3", "Display P3"},
                                                        {"Rec.2100-PQ Display", "Rec.2100-PQ Display"},
                                                        {"lin_p3d65", "lin_p3d65"},
                                                        {"sRGB", "sRGB"},
                                                        {"lin_rec709", "lin_rec709"},
                                                        {"g22_rec709", "g22_rec709"}}) {
    Write(WithColorState(image, {space}), Path("a.png"), {.type = PixelType::kUint8});
    EXPECT_EQ(ColorStateOf(Read(Path("a.png")).spec()).space, again) << space;
  }
}

// PNG's chunks are what viewers look at.
TEST_F(ColorFileTest, ChunksOfPng) {
  const Node image = FromImage(Image(ImageSpec(4, 3, 3, PixelType::kUint8)));
  const auto chunks = [&](const std::string& space) {
    Write(WithColorState(image, {space}), Path("a.png"));
    const std::string bytes = Contents(Path("a.png"));
    const size_t gamma = bytes.find("gAMA");
    return std::pair{bytes.find("sRGB") != std::string::npos,
                     gamma == std::string::npos ? std::string() : bytes.substr(gamma + 4, 4)};
  };
  const std::string one("\0\1\x86\xa0", 4);  // 100000
  EXPECT_TRUE(chunks("sRGB Display").first);
  EXPECT_NE(chunks("sRGB Display").second, one);
  EXPECT_FALSE(chunks("lin_rec709").first);
  EXPECT_EQ(chunks("lin_rec709").second, one);
  EXPECT_FALSE(chunks("Display P3").first);
  EXPECT_EQ(chunks("Display P3").second, "");
  // Behind the header chunk: Display P3's primaries, sRGB's curve, RGB, full range; none where H.273 has no
  // codes.
  const std::string codes("\0\0\0\4cICP\14\15\0\1", 12);
  EXPECT_EQ(Contents(Path("a.png")).substr(33, 12), codes);
  const std::string whole = Contents(Path("a.png"));
  for (size_t at = 33; at < 33 + 16; ++at) {  // a chunk that is not whole says nothing
    std::string broken = whole;
    broken[at] = static_cast<char>(broken[at] ^ 1);
    std::ofstream(Path("b.png"), std::ios::binary) << broken;
    try {
      EXPECT_NE(ColorStateOf(Read(Path("b.png")).spec()).space, "Display P3") << at;
    } catch (const Error&) {
      continue;
    }
  }
  chunks("g22_rec709");
  EXPECT_EQ(Contents(Path("a.png")).find("cICP"), std::string::npos);
  Write(WithIccProfile(image, Profile("sRGB IEC61966-2.1")), Path("a.png"));
  const std::string bytes = Contents(Path("a.png"));
  EXPECT_NE(bytes.find("iCCP"), std::string::npos);
  EXPECT_EQ(bytes.find("cICP"), std::string::npos);
  EXPECT_EQ(bytes.find("gAMA"), std::string::npos);
  EXPECT_EQ(ColorStateOf(Read(Path("a.png")).spec()).space, "sRGB");
}

// What told of the old space goes with it; operations that are no conversions keep it.
TEST_F(ColorFileTest, StaleTagsAreDropped) {
  Node image = WithIccProfile(FromImage(Image(ImageSpec(4, 3, 3, PixelType::kUint8))), Profile("Display P3"));
  EXPECT_EQ(ColorStateOf(image.spec()).space, "Display P3");
  image = MulConstant(image, {0.5});
  EXPECT_EQ(ColorStateOf(image.spec()).space, "Display P3");
  EXPECT_EQ(IccProfileOf(image.spec()), Profile("Display P3"));
  Write(image, Path("a.tif"));
  EXPECT_EQ(ColorStateOf(Read(Path("a.tif")).spec()).space, "Display P3");
  EXPECT_EQ(IccProfileOf(Read(Path("a.tif")).spec()), Profile("Display P3"));
  const Node converted = WithColorState(Read(Path("a.tif")), {"ACEScg"});
  EXPECT_TRUE(IccProfileOf(converted.spec()).empty());
  Write(converted, Path("b.tif"));
  EXPECT_TRUE(IccProfileOf(Read(Path("b.tif")).spec()).empty());
  Write(WithColorState(FromImage(Image(ImageSpec(4, 3, 3, PixelType::kHalf))), {"ACES2065-1"}),
        Path("a.exr"));
  Write(WithColorState(Read(Path("a.exr")), {"ACEScg"}), Path("b.exr"));
  EXPECT_EQ(ColorStateOf(Read(Path("b.exr")).spec()).space, "ACEScg");
  Write(WithColorState(Read(Path("a.exr")), {""}), Path("c.exr"));
  EXPECT_EQ(ColorStateOf(Read(Path("c.exr")).spec()).space, "scene_linear");
}

}  // namespace
}  // namespace tessera
