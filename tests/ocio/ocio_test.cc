// Colour management against OpenColorIO itself: every LUT format it reads, configs, displays, looks; bad
// files and names; baking and its report.
#include "tessera/ocio.h"

#include <OpenColorIO/OpenColorIO.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "config_text.h"
#include "lut_files.h"
#include "ocio/color_difference.h"
#include "tessera/error.h"
#include "tessera/ops/color.h"
#include "tessera/ops/curve.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

namespace lib = OCIO_NAMESPACE;
using testing::Folder;
using ::testing::HasSubstr;

// Colours beyond both ends of [0,1], alpha in (0,1]; the corners and greys first.
Image Colors(float low = -0.2f, float high = 1.3f) {
  const Image image(ImageSpec(61, 37, 4));
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(low, high), alpha(0.1f, 1.0f);
  int n = 0;
  for (int y = 0; y < 37; ++y) {
    for (int x = 0; x < 61; ++x, ++n) {
      float* const p = &image.at<float>(x, y);
      for (int c = 0; c < 3; ++c) p[c] = n < 8 ? static_cast<float>(n >> c & 1) : value(random);
      if (n >= 8 && n < 40) p[1] = p[2] = p[0];
      p[3] = alpha(random);
    }
  }
  return image;
}

// What OpenColorIO makes of it without optimisations that lose accuracy.
Image ByOpenColorIO(const Image& image, const lib::ConstProcessorRcPtr& processor, PixelType type,
                    lib::OptimizationFlags flags = lib::OPTIMIZATION_LOSSLESS) {
  const lib::BitDepth depth = type == PixelType::kFloat ? lib::BIT_DEPTH_F32 : lib::BIT_DEPTH_UINT16;
  ImageSpec spec = image.spec();
  spec.type = type;
  const Image result(spec);
  const auto cpu = processor->getOptimizedCPUProcessor(lib::BIT_DEPTH_F32, depth, flags);
  const lib::PackedImageDesc from(image.view().data, 61, 37, lib::CHANNEL_ORDERING_RGBA, lib::BIT_DEPTH_F32,
                                  4, 16, 16 * 61);
  const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
  lib::PackedImageDesc to(result.view().data, 61, 37, lib::CHANNEL_ORDERING_RGBA, depth, bytes, 4 * bytes,
                          4 * bytes * 61);
  cpu->apply(from, to);
  return result;
}

using Samples3 = std::array<float, 3>;
Samples3 Middle(const Node& node) {
  const Image image = Render(node);
  return {image.at<float>(30, 20, 0), image.at<float>(30, 20, 1), image.at<float>(30, 20, 2)};
}

// How far two results are apart: floats relative to the pixel's largest sample or 1, and uint16 codes.
struct Distance {
  double error = 0;
  int codes = 0;
};

// Returns the largest distance on any target.
Distance ExpectClose(const Node& node, const Image& image, const lib::ConstProcessorRcPtr& processor) {
  Distance largest;
  const Image want = ByOpenColorIO(image, processor, PixelType::kFloat);
  const Image want16 = ByOpenColorIO(image, processor, PixelType::kUint16);
  for (const std::string& target : SimdTargets()) {
    SCOPED_TRACE(target);
    SetSimdTarget(target);
    const Image got = Render(node), got16 = Render(node, PixelType::kUint16);
    int wrong = 0;
    for (int y = 0; y < 37 && wrong < 3; ++y) {
      for (int x = 0; x < 61 && wrong < 3; ++x) {
        double size = 1;
        for (int c = 0; c < 4; ++c) size = std::max(size, std::fabs(double{want.at<float>(x, y, c)}));
        for (int c = 0; c < 4; ++c) {
          const double error = std::fabs(double{got.at<float>(x, y, c)} - want.at<float>(x, y, c));
          const int codes = std::abs(got16.at<uint16_t>(x, y, c) - want16.at<uint16_t>(x, y, c));
          if (!(error <= largest.error * size)) largest.error = error / size;
          largest.codes = std::max(largest.codes, codes);
          if (error <= 1e-5 * size && codes <= 1) continue;
          ++wrong;
          ADD_FAILURE() << x << "," << y << " channel " << c << " of " << image.at<float>(x, y, c) << ": "
                        << got.at<float>(x, y, c) << ", OpenColorIO " << want.at<float>(x, y, c)
                        << ", codes apart " << codes;
        }
      }
    }
  }
  SetSimdTarget("auto");
  return largest;
}

lib::ConstProcessorRcPtr FileProcessor(const std::string& file, bool inverse,
                                       lib::Interpolation interpolation = lib::INTERP_BEST) {
  const lib::FileTransformRcPtr transform = lib::FileTransform::Create();
  transform->setSrc(file.c_str());
  transform->setInterpolation(interpolation);
  transform->setCCCId("0");
  return lib::Config::CreateRaw()->getProcessor(
      transform, inverse ? lib::TRANSFORM_DIR_INVERSE : lib::TRANSFORM_DIR_FORWARD);
}

// OpenColorIO's own evaluation, unoptimised, against its lossless one.
double OwnDistance(const Image& image, const lib::ConstProcessorRcPtr& processor) {
  const Image a = ByOpenColorIO(image, processor, PixelType::kFloat, lib::OPTIMIZATION_NONE),
              b = ByOpenColorIO(image, processor, PixelType::kFloat);
  double largest = 0;
  for (int y = 0; y < 37; ++y) {
    for (int x = 0; x < 61; ++x) {
      double size = 1, error = 0;
      for (int c = 0; c < 4; ++c) {
        size = std::max(size, std::fabs(double{b.at<float>(x, y, c)}));
        error = std::max(error, std::fabs(double{a.at<float>(x, y, c)} - b.at<float>(x, y, c)));
      }
      largest = std::max(largest, error / size);
    }
  }
  return largest;
}

// Prints the table of errors.
TEST(LutTest, EveryFormatOpenColorIOReads) {
  const Folder folder;
  std::vector<std::string> formats;
  const Image image = Colors();
  std::printf("%-42s%-14s%-14s%-18s%-14s\n", "reader", "file", "tetrahedral", "linear",
              "OpenColorIO's two ways");
  for (const testing::LutFile& file : testing::AllLutFiles()) {
    SCOPED_TRACE(file.format);
    formats.push_back(file.format);
    const std::string path = folder.Write(file.name, file.bytes);
    const lib::ConstProcessorRcPtr best = FileProcessor(path, false),
                                   linear = FileProcessor(path, false, lib::INTERP_LINEAR);
    const Distance a = ExpectClose(ApplyLut(FromImage(image), path), image, best);
    const Distance b =
        ExpectClose(ApplyLut(FromImage(image), path, {.filter = TableFilter::kLinear}), image, linear);
    std::printf("%-42s%-14s%.1e, %d    %.1e, %d        %.1e\n", file.format.c_str(), file.name.c_str(),
                a.error, a.codes, b.error, b.codes,
                std::max(OwnDistance(image, best), OwnDistance(image, linear)));
  }
  // The list is complete: a format that a newer OpenColorIO brings must be added.
  for (int i = 0; i < lib::FileTransform::GetNumFormats(); ++i) {
    EXPECT_THAT(formats, ::testing::Contains(std::string(lib::FileTransform::GetFormatNameByIndex(i))));
  }
}

TEST(LutTest, InverseAndOtherFilters) {
  const Folder folder;
  const Image image = Colors(0, 1);
  for (const testing::LutFile& file : testing::AllLutFiles()) {
    if (file.name != "a.spi1d" && file.name != "a.cc" && file.name != "a.spimtx" && file.name != "a.spi3d")
      continue;
    SCOPED_TRACE(file.format);
    const std::string path = folder.Write(file.name, file.bytes);
    ExpectClose(ApplyLut(FromImage(image), path, {.inverse = true}), image, FileProcessor(path, true));
    Render(ApplyLut(FromImage(image), path, {.filter = TableFilter::kNearest}));
    Render(ApplyLut(FromImage(image), path, {.filter = TableFilter::kCubic}));
  }
}

// Diagonal transforms keep infinities and NaN in their channel: CDLs, ranges, matrices.
TEST(LutTest, InfinitiesStayInTheirChannel) {
  const Folder folder;
  const std::string cdl = folder.Write(
      "slope.cc",
      "<ColorCorrection id=\"a\"><SOPNode><Slope>1.1 1.1 1.1</Slope><Offset>0 0 0</Offset><Power>1 1 1</Power>"
      "</SOPNode><SatNode><Saturation>1</Saturation></SatNode></ColorCorrection>\n");
  const float inf = std::numeric_limits<float>::infinity();
  ImageSpec spec(2, 1, 3);
  const Image image(spec);
  const float values[6] = {inf, 0.5f, 0.2f, inf, inf, inf};
  std::memcpy(image.view().data, values, sizeof values);
  const Image got = Render(ApplyLut(FromImage(image), cdl));
  EXPECT_TRUE(got.at<float>(0, 0, 0) >= 1) << got.at<float>(0, 0, 0);
  EXPECT_NEAR(got.at<float>(0, 0, 1), 0.55f, 1e-6);
  EXPECT_NEAR(got.at<float>(0, 0, 2), 0.22f, 1e-6);
  for (int c = 0; c < 3; ++c) EXPECT_TRUE(got.at<float>(1, 0, c) >= 1) << c;
}

// A CLF's own interpolation stands unless the user gives another; one that says none is read by tetrahedra.
TEST(LutTest, OwnInterpolation) {
  const Folder folder;
  std::string entries;
  for (int i = 0; i < 8; ++i) {
    const int r = i >> 2, g = i >> 1 & 1, b = i & 1;
    entries += std::to_string(r * g) + " " + std::to_string(0.7 * std::max({r, g, b})) + " " +
               std::to_string(0.9 * std::abs(r - b)) + "\n";
  }
  const Image image = Colors(0, 1);
  for (const std::string own : {"", "trilinear", "tetrahedral"}) {
    SCOPED_TRACE(own);
    const std::string path = folder.Write(
        own + "own.clf",
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<ProcessList id=\"a\" compCLFversion=\"3.0\"><LUT3D "
        "id=\"b\" " +
            (own.empty() ? own : "interpolation=\"" + own + "\" ") +
            "inBitDepth=\"32f\" outBitDepth=\"32f\"><Array dim=\"2 2 2 3\">\n" + entries +
            "</Array></LUT3D></ProcessList>\n");
    ExpectClose(ApplyLut(FromImage(image), path), image, FileProcessor(path, false));
    const Samples3 linear = Middle(ApplyLut(FromImage(image), path, {.filter = TableFilter::kLinear}));
    const Samples3 tetrahedral =
        Middle(ApplyLut(FromImage(image), path, {.filter = TableFilter::kTetrahedral}));
    EXPECT_NE(linear, tetrahedral);
    EXPECT_EQ(Middle(ApplyLut(FromImage(image), path)), own == "trilinear" ? linear : tetrahedral);
  }
}

TEST(LutTest, ByteOrderMarkAndCarriageReturnsAreAccepted) {
  const Folder folder;
  std::string rows = "LUT_3D_SIZE 2\r\n";
  for (int i = 0; i < 8; ++i) {
    rows += std::to_string(1 - (i & 1)) + " " + std::to_string(i >> 1 & 1) + " " + std::to_string(i >> 2) +
            "\r\n";
  }
  const Image image = Colors(0, 1);
  for (const std::string start : {"", "\xef\xbb\xbf"}) {
    const Image got = Render(ApplyLut(FromImage(image), folder.Write("a.cube", start + rows)));
    EXPECT_NEAR(got.at<float>(30, 20, 0), 1 - image.at<float>(30, 20, 0), 1e-6);
    EXPECT_NEAR(got.at<float>(30, 20, 1), image.at<float>(30, 20, 1), 1e-6);
  }
}

std::string Refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& e) {
    EXPECT_THAT(std::string(e.what()), ::testing::Not(HasSubstr("\n")));
    return e.what();
  }
  return "accepted";
}

TEST(LutTest, BadFilesAreRefusedByName) {
  const Folder folder;
  const Node image = FromImage(Colors());
  const std::string good = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\n0 1 1\n1 1 1\n";
  const auto refusal = [&](const std::string& name, const std::string& text) {
    const std::string path = folder.Write(name, text);
    const std::string what = Refusal([&] { ApplyLut(image, path); });
    EXPECT_THAT(what, HasSubstr(path));
    return what;
  };
  for (const char* size : {"0", "1", "-1", "2147483648", "2000", "2.5", "x", "nan"}) {
    EXPECT_THAT(refusal("size.cube", std::string("LUT_3D_SIZE ") + size + "\n" + good),
                HasSubstr("expected a size from 2 to 129"))
        << size;
    EXPECT_THAT(refusal("size.itx", std::string("LUT_3D_SIZE ") + size + "\n\n" + good),
                HasSubstr("expected a size from 2 to 129"))
        << size;
    EXPECT_THAT(refusal("size.vf", std::string("grid_size 2 2 ") + size + "\ndata\n" + good),
                HasSubstr("expected a size from 2 to 129"))
        << size;
  }
  EXPECT_THAT(refusal("few.cube", "LUT_3D_SIZE 2\n0 0 0\n"), HasSubstr("Found 1, expected 8"));
  EXPECT_THAT(refusal("many.cube", "LUT_3D_SIZE 2\n" + good + "0 0 0\n"), HasSubstr("Found 9, expected 8"));
  EXPECT_THAT(refusal("two.cube", "LUT_3D_SIZE 2\n0 0\n" + good), HasSubstr("line (2)"));
  EXPECT_THAT(refusal("nan.cube", "LUT_3D_SIZE 2\nnan 0 0\n" + good), HasSubstr("found nan in line 2"));
  EXPECT_THAT(refusal("domain.cube", "LUT_3D_SIZE 2\nDOMAIN_MIN 1 1 1\nDOMAIN_MAX 0 0 0\n" + good),
              HasSubstr("found a domain from 1 to 0"));
  EXPECT_THAT(refusal("flat.cube", "LUT_3D_SIZE 2\nDOMAIN_MAX 0 0 0\n" + good),
              HasSubstr("expected it to increase"));
  EXPECT_THAT(refusal("empty.cube", ""), HasSubstr("is empty"));
  EXPECT_THAT(refusal("text.cube", "hello\n"), HasSubstr("line (1)"));
  EXPECT_THAT(refusal("a.xyz", "hello\n"), HasSubstr("a.xyz"));
  EXPECT_THAT(refusal("few.spi1d", "Version 1\nFrom 0 1\nLength 3\nComponents 1\n{\n0\n1\n}\n"),
              HasSubstr("Not enough entries"));
  EXPECT_THAT(refusal("back.spi1d", "Version 1\nFrom 1 0\nLength 2\nComponents 1\n{\n0\n1\n}\n"),
              HasSubstr("expected a range that increases"));
  const std::string head = "SPILUT 1.0\n3 3\n2 2 2\n", one = "0 0 0 0 0 0\n";
  EXPECT_THAT(refusal("few.spi3d", head + one), HasSubstr("Not enough entries"));
  EXPECT_THAT(refusal("twice.spi3d", head + one + one), HasSubstr("found the entry 0 0 0 twice"));
  EXPECT_THAT(refusal("twice00.spi3d", head + one + "00 0 0 0 0 0\n"),
              HasSubstr("twice in line 5 and in line 4"));
  EXPECT_THAT(refusal("comma.spi3d", head + "0 0 0 0,5 0 0\n"), HasSubstr("found \"0,5\" in line 4"));
  EXPECT_THAT(refusal("comma.cube", "LUT_3D_SIZE 2\n0,5 0 0\n" + good), HasSubstr("found \"0,5\" in line 2"));
  EXPECT_THAT(refusal("hex.cube", "LUT_3D_SIZE 2\n0x1p3 0 0\n" + good),
              HasSubstr("found \"0x1p3\" in line 2"));
  EXPECT_THAT(refusal("hex.spi1d", "Version 1\nFrom 0 1\nLength 2\nComponents 1\n{\n0\n0x1p3\n}\n"),
              HasSubstr("found \"0x1p3\" in line 7"));
  EXPECT_THAT(refusal("open.spi1d", "Version 1\nFrom 0 1\nLength 2\nComponents 1\n{\n0\n1\n"),
              HasSubstr("found { in line 5 and the end of the file"));
  const std::string curve = "2\n0 1\n0 1\n", cube = "2 2 2\n" + good;
  EXPECT_THAT(refusal("falls.csp", "CSPLUTV100\n3D\n\n2\n1 0\n0 1\n" + curve + curve + "\n" + cube),
              HasSubstr("expected them to increase"));
  EXPECT_EQ(Refusal([&] {
              ApplyLut(image,
                       folder.Write("ok.csp", "CSPLUTV100\n3D\n\n" + curve + curve + curve + "\n" + cube));
            }),
            "accepted");
  EXPECT_THAT(Refusal([&] { ApplyLut(image, folder.path()); }), HasSubstr("found a directory"));
  EXPECT_THAT(Refusal([&] { ApplyLut(image, "/nowhere/a.cube"); }),
              HasSubstr("/nowhere/a.cube: no such file"));
  EXPECT_THAT(Refusal([&] {
                ApplyLut(FromImage(Image(ImageSpec(2, 2, 1))),
                         folder.Write("ok.cube", "LUT_3D_SIZE 2\n" + good));
              }),
              "accepted");
}

class ConfigTest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const testing::LutFile& file : testing::AllLutFiles()) {
      if (file.name == "a.spi1d" || file.name == "a.spi3d") folder_.Write(file.name, file.bytes);
      if (file.name == "a.spi3d") folder_.Write("b.spi3d", file.bytes);
    }
    params_.config = folder_.Write("config.ocio", testing::ConfigText(folder_.path()));
    config_ = lib::Config::CreateFromFile(params_.config.c_str());
  }
  Folder folder_;
  OcioParams params_;
  lib::ConstConfigRcPtr config_;
};

TEST_F(ConfigTest, EverySpaceBothWays) {
  const Image image = Colors(-0.1f, 1.1f);
  for (int i = 0; i < config_->getNumColorSpaces(); ++i) {
    const std::string name = config_->getColorSpaceNameByIndex(i);
    if (name == "raw") continue;
    SCOPED_TRACE(name);
    ExpectClose(ColorConvert(FromImage(image), name, "lin", params_), image,
                config_->getProcessor(name.c_str(), "lin"));
    ExpectClose(ColorConvert(FromImage(image), "linear", name, params_), image,
                config_->getProcessor("lin", name.c_str()));
  }
}

TEST_F(ConfigTest, DisplaysAndLooks) {
  const Image image = Colors(0, 1);
  for (const auto& [display, view] : std::vector<std::pair<std::string, std::string>>{
           {"monitor", "film"}, {"monitor", "plain"}, {"cinema", "film"}}) {
    SCOPED_TRACE(display + " " + view);
    ExpectClose(OcioDisplay(FromImage(image), display, view, {.from = "logc"}, params_), image,
                config_->getProcessor("logc", display.c_str(), view.c_str(), lib::TRANSFORM_DIR_FORWARD));
  }
  ExpectClose(OcioDisplay(FromImage(image), "", "", {.from = "logc"}, params_), image,
              config_->getProcessor("logc", "monitor", "film", lib::TRANSFORM_DIR_FORWARD));
  for (const std::string looks : {"warm", "clipped", "warm, -clipped", "shot"}) {
    for (const bool inverse : {false, true}) {
      if (inverse && looks == "shot") continue;
      SCOPED_TRACE(looks);
      const lib::LookTransformRcPtr look = lib::LookTransform::Create();
      look->setLooks(looks.c_str()), look->setSrc(inverse ? "video" : "lin");
      look->setDst(inverse ? "lin" : "video");  // OpenColorIO's inverse goes back
      ExpectClose(
          OcioLook(FromImage(image), looks, {.from = "lin", .to = "video", .inverse = inverse}, params_),
          image,
          config_->getProcessor(look, inverse ? lib::TRANSFORM_DIR_INVERSE : lib::TRANSFORM_DIR_FORWARD));
    }
  }
  // The context decides which file a look reads; the search path finds it.
  OcioParams other = params_;
  other.context = {{"SHOT", "b"}};
  Render(OcioLook(FromImage(image), "shot", {.from = "lin"}, other));
  other.context = {{"SHOT", "missing"}};
  EXPECT_THAT(Refusal([&] { OcioLook(FromImage(image), "shot", {.from = "lin"}, other); }),
              HasSubstr("missing"));
  ExpectClose(OcioFileTransform(FromImage(image), "a.spi3d", {}, params_), image,
              FileProcessor(folder_.path() + "/a.spi3d", false));
}

// Light where alpha is 0 is converted as it stands and stays, as oiiotool has it.
TEST_F(ConfigTest, AlphaIsDividedOutWhereAsked) {
  const Image image = Colors(0, 1);
  for (int x = 0; x < 61; ++x) image.at<float>(x, 1, 3) = 0;
  OcioParams divided = params_;
  divided.unpremult = true;
  const Image got = Render(ColorConvert(FromImage(image), "lin", "video", divided));
  const Image plain = Render(ColorConvert(FromImage(image), "lin", "video", params_));
  EXPECT_EQ(std::memcmp(got.view().At(0, 1), plain.view().At(0, 1), 61 * 16), 0);
  const Image want =
      Render(Repremultiply(ColorConvert(Unpremultiply(FromImage(image)), "lin", "video", params_)));
  EXPECT_EQ(std::memcmp(got.view().data, want.view().data, 61 * 37 * 16), 0);
}

TEST_F(ConfigTest, UnknownNamesGetTheNearest) {
  const Node image = FromImage(Colors());
  EXPECT_THAT(Refusal([&] { ColorConvert(image, "lni", "video", params_); }),
              AllOf(HasSubstr(params_.config), HasSubstr("no colour space \"lni\""),
                    HasSubstr("did you mean \"lin\"?")));
  EXPECT_THAT(Refusal([&] { ColorConvert(image, "lin", "vidoe", params_); }), HasSubstr("\"video\"?"));
  EXPECT_THAT(Refusal([&] { OcioDisplay(image, "montor", "film", {}, params_); }), HasSubstr("\"monitor\"?"));
  EXPECT_THAT(Refusal([&] { OcioDisplay(image, "monitor", "flim", {}, params_); }), HasSubstr("\"film\"?"));
  EXPECT_THAT(Refusal([&] { OcioLook(image, "wram", {}, params_); }), HasSubstr("\"warm\"?"));
  OcioParams bad;
  bad.config = "/nowhere/config.ocio";
  EXPECT_THAT(Refusal([&] { ColorConvert(image, "a", "b", bad); }),
              HasSubstr("/nowhere/config.ocio: no such file"));
  for (const std::string text :
       {"", "hello", "ocio_profile_version: 2\ncolorspaces: 5\n", "ocio_profile_version: 99\n"}) {
    bad.config = folder_.Write("bad.ocio", text);
    EXPECT_THAT(Refusal([&] { ColorConvert(image, "a", "b", bad); }), HasSubstr(bad.config)) << text;
  }
}

TEST(BuiltInConfigTest, EverySpaceAndView) {
  const OcioParams params{.config = kBuiltInConfig};
  const Image image = Colors(0, 1);
  for (const std::string space :
       {"ACES2065-1", "ACEScg", "ACEScct", "ACEScc", "ADX10", "sRGB", "Rec709", "ARRI LogC3", "Canon Log2",
        "Canon Log3", "Panasonic V-Log", "RED Log3G10", "Sony S-Log3", "Sony S-Log3 Cine"}) {
    Render(ColorConvert(FromImage(image), space, "linear", params));
    Render(ColorConvert(FromImage(image), "linear", space, params));
  }
  for (const auto& [display, view] :
       std::vector<std::pair<std::string, std::string>>{{"sRGB", "ACES 1.0 SDR"},
                                                        {"Rec.1886 Rec.709", "Un-tone-mapped"},
                                                        {"P3-D65", "ACES 1.1 SDR P3"},
                                                        {"Rec.2100-PQ", "ACES 1.1 HDR 1000 nit"},
                                                        {"sRGB", "Raw"}}) {
    Render(OcioDisplay(FromImage(image), display, view, {.from = "ACEScg"}, params));
  }
  // ACES' output transform: matrices, fixed functions and curves of OpenColorIO, on their own and through the
  // pipeline.
  const lib::GroupTransformRcPtr aces = lib::GroupTransform::Create();
  for (const char* style : {"ACEScg_to_ACES2065-1", "ACES-OUTPUT - ACES2065-1_to_CIE-XYZ-D65 - SDR-VIDEO_1.0",
                            "DISPLAY - CIE-XYZ-D65_to_sRGB"}) {
    const lib::BuiltinTransformRcPtr step = lib::BuiltinTransform::Create();
    step->setStyle(style);
    aces->appendTransform(step);
  }
  ExpectClose(OcioDisplay(FromImage(image), "sRGB", "ACES 1.0 SDR", {.from = "ACEScg"}, params), image,
              lib::Config::CreateRaw()->getProcessor(aces));
}

TEST(BakeTest, ReportsTheErrorOfTheTable) {
  const Image image = Colors(-0.5f, 20);
  const auto transform = [](const Node& n) {
    return ColorConvert(n, "linear", "ACEScct", {.config = kBuiltInConfig});
  };
  BakeReport coarse, fine;
  Bake(FromImage(image), transform, {.size = 9}, &coarse);
  const Node baked = Bake(FromImage(image), transform, {.size = 65}, &fine);
  EXPECT_EQ(fine.pixels, 61 * 37);
  EXPECT_TRUE(fine.shaped);
  EXPECT_FLOAT_EQ(static_cast<float>(fine.low), -0.5f + (static_cast<float>(fine.low) + 0.5f));
  EXPECT_LT(fine.max_error, coarse.max_error);
  EXPECT_LT(fine.rms_error, fine.max_error);
  // The report is true: the error again, by hand.
  const Image want = Render(transform(FromImage(image))), got = Render(baked);
  double worst = 0;
  for (int y = 0; y < 37; ++y) {
    for (int x = 0; x < 61; ++x) {
      for (int c = 0; c < 3; ++c) {
        worst = std::max(worst, std::fabs(double{got.at<float>(x, y, c)} - want.at<float>(x, y, c)));
      }
    }
  }
  EXPECT_DOUBLE_EQ(worst, fine.max_error);
  EXPECT_THAT(fine.Summary(), HasSubstr("largest CIEDE2000"));
  // An identity within [0,1] is exact, and alpha keeps its bits.
  BakeReport identity;
  const Image unit = Colors(0, 1);
  const Image same = Render(Bake(
      FromImage(unit), [](const Node& n) { return n; }, {.size = 5}, &identity));
  EXPECT_LT(identity.max_error, 2e-7);
  EXPECT_FALSE(identity.shaped);
  EXPECT_EQ(same.at<float>(5, 5, 3), unit.at<float>(5, 5, 3));
  EXPECT_THROW(Bake(FromImage(unit), transform, {.size = 1}), Error);
}

// Pairs of Sharma, Wu and Dalal, table 1.
TEST(ColorDifferenceTest, PublishedPairs) {
  const struct {
    std::array<double, 3> a, b;
    double want;
  } kPairs[] = {{{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
                {{50, 3.1571, -77.2803}, {50, 0, -82.7485}, 2.8615},
                {{50, 2.8361, -74.0200}, {50, 0, -82.7485}, 3.4412},
                {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
                {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0009}, 7.1792},
                {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0011}, 7.2195},
                {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
                {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
                {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082}};
  for (const auto& pair : kPairs) EXPECT_NEAR(ocio::Ciede2000(pair.a, pair.b), pair.want, 5e-5);
}

}  // namespace
}  // namespace tessera
