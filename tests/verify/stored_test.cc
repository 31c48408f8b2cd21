// What was stored is what is judged: every way to spoil it is found, and what is right passes.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "reference/reference.h"
#include "support/run_command.h"
#include "support/test_ops.h"
#include "tessera/io.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/generate.h"
#include "tessera/verify.h"
#include "verify/pixels.h"

namespace tessera {
namespace {

using testing::RandomImage;
using testing::SlowAffine;
using testing::SlowAffineOf;

void AffineReference(const reference::Call& call) {
  const auto& p = std::any_cast<const SlowAffine&>(call.parameters);
  for (size_t i = 0; i < call.out.samples.size(); ++i) {
    const double v = static_cast<double>(p.factor) * call.in[0].samples[i];
    call.out.samples[i] = v + p.offset;
    if (call.scale != nullptr) call.scale->samples[i] = std::fabs(v) + std::fabs(p.offset);
  }
}

VerifyOptions Everything() {
  VerifyOptions options;
  options.samples = 40, options.tile_size = 64, options.seconds = 60;
  return options;
}

class StoredTest : public ::testing::Test {
 protected:
  void SetUp() override { reference::Register({"test-affine", AffineReference, nullptr}); }

  Node node_ = SlowAffineOf(FromImage(RandomImage({3, -2, 93, 58}, 4, 1)), {0.4f, 0.3f});
  testing::TemporaryDirectory directory_;
};

// Reads the file as it is, changes samples, and writes them to the same name in the same format and type.
template <typename T, typename Change>
void Spoil(const std::string& file, const Change& change) {
  const auto input = OIIO::ImageInput::open(file);
  ASSERT_TRUE(input) << OIIO::geterror();
  const OIIO::ImageSpec spec = input->spec();
  std::vector<T> samples(spec.image_pixels() * static_cast<size_t>(spec.nchannels));
  ASSERT_TRUE(input->read_image(0, 0, 0, spec.nchannels, spec.format, samples.data()));
  input->close();
  change(samples, spec);
  const auto output = OIIO::ImageOutput::create(file);
  ASSERT_TRUE(output->open(file, spec)) << output->geterror();
  ASSERT_TRUE(output->write_image(spec.format, samples.data())) << output->geterror();
  ASSERT_TRUE(output->close());
}

// The name of the file beside `name` that is not renamed yet.
std::string Unfinished(const testing::TemporaryDirectory& directory) {
  for (const std::string& name : directory.Names()) {
    if (name.find(".tessera-") != std::string::npos) return (directory.path() / name).string();
  }
  return "";
}

TEST_F(StoredTest, FilesOfEveryTypeAndLayoutPass) {
  const struct {
    const char* name;
    PixelType type;
    int tile;
  } files[] = {
      {"a.tif", PixelType::kUint8, 0},  {"a.tif", PixelType::kUint16, 0}, {"a.tif", PixelType::kHalf, 0},
      {"a.tif", PixelType::kFloat, 16}, {"a.exr", PixelType::kHalf, 0},   {"a.exr", PixelType::kFloat, 16},
      {"a.png", PixelType::kUint8, 0},  {"a.png", PixelType::kUint16, 0}, {"a.tga", PixelType::kUint8, 0},
      {"a.dpx", PixelType::kUint16, 0}, {"a.sgi", PixelType::kUint8, 0},  {"a.bmp", PixelType::kUint8, 0}};
  for (const auto& f : files) {
    SCOPED_TRACE(std::string(f.name) + " " + PixelTypeName(f.type));
    WriteOptions options;
    options.type = f.type;
    for (const char* side : {"tile_width", "tile_height"}) {
      Attribute tile{side, "int", std::vector<std::byte>(sizeof f.tile), {}};
      std::memcpy(tile.bytes.data(), &f.tile, sizeof f.tile);
      options.attributes.push_back(tile);
    }
    const PendingOutput output(node_, (directory_.path() / f.name).string(), options);
    const VerifyReport report = VerifyStored(node_, output.ReadBack(), Everything());
    EXPECT_TRUE(report.within_bound) << report.Summary();
    EXPECT_GT(report.share, 0.9);
    EXPECT_EQ(report.undecided, 0);
  }
}

TEST_F(StoredTest, OneCodeInAFileIsFound) {
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16}) {
    const PendingOutput output(node_, (directory_.path() / "a.tif").string(), {.type = type});
    const auto flip = [](auto& samples, const OIIO::ImageSpec& spec) {
      auto& sample = samples[static_cast<size_t>(((spec.height / 2) * spec.width + spec.width / 2) * 4 + 1)];
      sample = static_cast<std::decay_t<decltype(sample)>>(sample < 100 ? sample + 1 : sample - 1);
    };
    if (type == PixelType::kUint8) {
      Spoil<uint8_t>(Unfinished(directory_), flip);
    } else {
      Spoil<uint16_t>(Unfinished(directory_), flip);
    }
    const VerifyReport report = VerifyStored(node_, output.ReadBack(), Everything());
    EXPECT_FALSE(report.within_bound) << report.Summary();
    EXPECT_EQ(report.codes_wrong, 1);
    EXPECT_EQ(report.max_code_error, 1);
    EXPECT_EQ(report.out_of_bound, 1);
    EXPECT_EQ(report.worst_x, 3 + 45);
    EXPECT_EQ(report.worst_y, -2 + 30);
    EXPECT_EQ(report.worst_channel, 1);
  }
}

TEST_F(StoredTest, OneBitOfAFloatAndOfAHalfInAFileIsFound) {
  for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
    const PendingOutput output(node_, (directory_.path() / "a.exr").string(), {.type = type});
    if (type == PixelType::kHalf) {
      Spoil<uint16_t>(Unfinished(directory_), [](auto& samples, const auto&) { samples[4321] ^= 1; });
    } else {
      Spoil<uint32_t>(Unfinished(directory_), [](auto& samples, const auto&) { samples[4321] ^= 1u << 4; });
    }
    const VerifyReport report = VerifyStored(node_, output.ReadBack(), Everything());
    EXPECT_FALSE(report.within_bound) << PixelTypeName(type) << report.Summary();
    EXPECT_EQ(report.out_of_bound, 1);
  }
}

TEST_F(StoredTest, ChannelsInAnotherOrderAreFound) {
  for (const char* name : {"a.tif", "a.exr"}) {
    const PendingOutput output(node_, (directory_.path() / name).string(), {.type = PixelType::kFloat});
    EXPECT_TRUE(VerifyStored(node_, output.ReadBack(), Everything()).within_bound);
    Spoil<float>(Unfinished(directory_), [](auto& samples, const auto&) {
      for (size_t i = 0; i < samples.size(); i += 4) std::swap(samples[i], samples[i + 2]);
    });
    EXPECT_FALSE(VerifyStored(node_, output.ReadBack(), Everything()).within_bound) << name;
  }
}

// Rows that hold planes where pixels should be: what a store that mistakes its layout writes.
TEST_F(StoredTest, PlanesInPlaceOfPixelsAreFound) {
  const Node node =
      BoxBlur(Checker(ImageSpec(512, 16, 4),
                      {.color1 = {0.8, 0.6, 0.4, 1}, .color2 = {0.2, 0.3, 0.5, 1}, .width = 7, .height = 7}),
              {.width = 3, .height = 3});
  const Image right = Render(node, PixelType::kUint8);
  EXPECT_TRUE(VerifyStored(node, right.view(), Everything()).within_bound);
  const Image wrong = Render(node, PixelType::kUint8);
  for (int x = 0; x < 256; ++x) {
    for (int c = 0; c < 4; ++c) {
      const int at = 4 * x + c;
      wrong.at<uint8_t>(at % 256 + 256, 5, at / 256) = right.at<uint8_t>(x + 256, 5, c);
    }
  }
  EXPECT_FALSE(VerifyStored(node, wrong.view(), Everything()).within_bound);
}

TEST_F(StoredTest, PixelsOfTheCallerAreJudged) {
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    SCOPED_TRACE(PixelTypeName(type));
    const Image image = Render(node_, type);
    const VerifyReport good = VerifyStored(node_, image.view(), Everything());
    EXPECT_TRUE(good.within_bound) << good.Summary();
    // A part of it is a part of it.
    EXPECT_TRUE(VerifyStored(node_, image.view().Sub({20, 10, 70, 40}), Everything()).within_bound);
    // One tile is that of its neighbour.
    for (int y = 20; y < 36; ++y) {
      std::memcpy(image.view().At(40, y), image.view().At(56, y), 16 * 4 * PixelBytes(type));
    }
    const VerifyReport bad = VerifyStored(node_, image.view(), Everything());
    EXPECT_FALSE(bad.within_bound);
    EXPECT_GT(bad.out_of_bound, 16 * 16 * 3);
    EXPECT_LE(bad.out_of_bound, 16 * 16 * 4);
  }
  const Image other = RandomImage({0, 0, 5, 5}, 3, 1);
  EXPECT_THROW(VerifyStored(node_, other.view()), Error);
}

// A conversion that truncates, rounds ties up, or divides by 256.
TEST_F(StoredTest, WrongConversionsAreFound) {
  const Image exact = Render(node_);
  const auto converted = [&](auto code) {
    ImageSpec spec = node_.spec();
    spec.type = PixelType::kUint8;
    Image image(spec);
    for (int y = -2; y < 58; ++y) {
      for (int x = 3; x < 93; ++x) {
        for (int c = 0; c < 4; ++c) {
          const float v = std::fmin(std::fmax(exact.at<float>(x, y, c), 0.0f), 1.0f);
          image.at<uint8_t>(x, y, c) = static_cast<uint8_t>(code(v));
        }
      }
    }
    return VerifyStored(node_, image.view(), Everything());
  };
  EXPECT_TRUE(converted([](float v) { return std::nearbyint(v * 255); }).within_bound);
  EXPECT_FALSE(converted([](float v) { return std::floor(v * 255); }).within_bound);
  EXPECT_FALSE(converted([](float v) { return std::fmin(255.0f, v * 256); }).within_bound);
  EXPECT_FALSE(converted([](float v) { return std::nearbyint(v * 254.9f); }).within_bound);
}

// A value whose bound reaches the tie between two codes may be either, and is counted apart.
TEST_F(StoredTest, CodesAtATieMayBeEither) {
  ImageSpec spec(8, 8, 1);
  const Image half_codes(spec);
  for (int i = 0; i < 64; ++i) half_codes.at<float>(i % 8, i / 8) = static_cast<float>((i + 0.5) / 255);
  const Node node = SlowAffineOf(FromImage(half_codes), {1.0f, 0.0f});
  spec.type = PixelType::kUint8;
  const Image up(spec), down(spec), far(spec);
  for (int i = 0; i < 64; ++i) {
    up.at<uint8_t>(i % 8, i / 8) = static_cast<uint8_t>(i + 1);
    down.at<uint8_t>(i % 8, i / 8) = static_cast<uint8_t>(i);
    far.at<uint8_t>(i % 8, i / 8) = static_cast<uint8_t>(i + 2);
  }
  const VerifyReport above = VerifyStored(node, up.view()), below = VerifyStored(node, down.view());
  EXPECT_TRUE(above.within_bound) << above.Summary();
  EXPECT_TRUE(below.within_bound) << below.Summary();
  EXPECT_EQ(above.codes_at_tie + below.codes_at_tie, 64);
  EXPECT_EQ(above.codes_wrong + below.codes_wrong, 0);
  EXPECT_NE((above.Summary() + below.Summary()).find("at a tie"), std::string::npos) << above.Summary();
  const VerifyReport wrong = VerifyStored(node, far.view());
  EXPECT_EQ(wrong.codes_wrong, 64);
  EXPECT_FALSE(wrong.within_bound);
}

TEST_F(StoredTest, LossyFormatsAreLookedAtAsTheyWereHandedOver) {
  for (const char* name : {"a.jpg", "a.webp"}) {
    const PendingOutput output(node_, (directory_.path() / name).string(), {.type = PixelType::kUint8});
    const VerifyReport report = VerifyStored(node_, output.ReadBack(), Everything());
    EXPECT_TRUE(report.within_bound) << report.Summary();
    EXPECT_NE(report.Summary().find("handed to the encoder"), std::string::npos) << report.Summary();
  }
}

TEST_F(StoredTest, FewerBitsAreComparedAtTheirPrecision) {
  Attribute bits{"oiio:BitsPerSample", "int", std::vector<std::byte>(sizeof(int)), {}};
  const int ten = 10;
  std::memcpy(bits.bytes.data(), &ten, sizeof ten);
  const Node color = SelectChannels(node_, "R,G,B");
  const PendingOutput output(color, (directory_.path() / "a.dpx").string(),
                             {.type = PixelType::kUint16, .attributes = {bits}});
  const StoredPixels stored = output.ReadBack();
  EXPECT_EQ(stored.bits, 10);
  const VerifyReport report = VerifyStored(color, stored, Everything());
  EXPECT_TRUE(report.within_bound) << report.Summary();
  EXPECT_GT(report.max_error, 1.0 / 4096);
  EXPECT_NE(report.Summary().find("10 bits"), std::string::npos) << report.Summary();
}

}  // namespace
}  // namespace tessera
