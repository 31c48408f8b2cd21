// Files into rows: every pixel type, tiles, windows, parts, channel ranges and metadata, against
// OpenImageIO's writer.
#include "files.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using namespace testing_io;
using OIIO::TypeDesc;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Format {
  const char* file;
  TypeDesc::BASETYPE base;
  int channels;
  int tile = 0;
  int x = 0, y = 0;
  const char* compression = "";
};
void PrintTo(const Format& f, std::ostream* out) {
  *out << f.file << " " << TypeDesc(f.base).c_str() << " " << f.channels << " tile " << f.tile << " at "
       << f.x << "," << f.y << " " << f.compression;
}

class ReadFormat : public FileTest, public ::testing::WithParamInterface<Format> {};

TEST_P(ReadFormat, GivesTheBitsOfTheFile) {
  const Format f = GetParam();
  OIIO::ImageSpec spec(67, 45, f.channels, f.base);
  spec.x = f.x;
  spec.y = f.y;
  if (f.x != 0 || f.y != 0)
    spec.full_x = -20, spec.full_y = -30, spec.full_width = 200, spec.full_height = 150;
  if (f.tile > 0) spec.tile_width = spec.tile_height = f.tile;
  if (*f.compression) spec.attribute("compression", f.compression);
  // Alpha multiplies colour in files that store it unassociated; names that are no alpha keep the bits.
  spec.alpha_channel = -1;
  const std::string file = Path(f.file);
  WritePattern(file, {spec});
  if (HasFatalFailure()) return;

  const Node node = Read(file);
  EXPECT_EQ(node.spec().data_window, (Roi{f.x, f.y, f.x + 67, f.y + 45}));
  EXPECT_EQ(node.spec().type, io::PixelTypeOf(f.base));
  ASSERT_EQ(node.spec().channel_count(), f.channels);
  EXPECT_EQ(SourceOf(node).Describe(), file);
  EXPECT_FALSE(SourceOf(node).View());
  if (f.tile > 0) {
    EXPECT_EQ(SourceOf(node).RowGranularity(), f.tile);
  }
  for (const int rows : {1, 7, 16, 45}) {
    for (int first = 0; first < f.channels; ++first) {
      for (int last = first + 1; last <= f.channels; ++last) {
        ConstImageView view;
        const auto keep = ReadRows(node, first, last, rows, &view);
        EXPECT_EQ(Wrong(view, first), 0) << rows << " rows, channels " << first << " to " << last;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Formats, ReadFormat,
    ::testing::Values(Format{"a.exr", TypeDesc::HALF, 3}, Format{"a.exr", TypeDesc::FLOAT, 4},
                      Format{"a.exr", TypeDesc::FLOAT, 1, 0, 0, 0, "piz"},
                      Format{"a.exr", TypeDesc::HALF, 3, 0, 0, 0, "none"},
                      Format{"a.exr", TypeDesc::FLOAT, 5, 0, -11, -23},
                      Format{"a.exr", TypeDesc::HALF, 3, 0, 13, 40}, Format{"a.exr", TypeDesc::HALF, 3, 16},
                      Format{"a.exr", TypeDesc::FLOAT, 2, 32, -11, -23},
                      Format{"a.exr", TypeDesc::HALF, 3, 64}, Format{"a.tif", TypeDesc::UINT8, 3},
                      Format{"a.tif", TypeDesc::UINT16, 3}, Format{"a.tif", TypeDesc::FLOAT, 3},
                      Format{"a.tif", TypeDesc::UINT16, 3, 16}, Format{"a.tif", TypeDesc::FLOAT, 5, 32},
                      Format{"a.tif", TypeDesc::UINT8, 1, 16}, Format{"a.png", TypeDesc::UINT8, 3},
                      Format{"a.png", TypeDesc::UINT16, 3}, Format{"a.png", TypeDesc::UINT8, 1},
                      Format{"a.tga", TypeDesc::UINT8, 3}, Format{"a.bmp", TypeDesc::UINT8, 3},
                      Format{"a.dpx", TypeDesc::UINT16, 3}, Format{"a.sgi", TypeDesc::UINT8, 3},
                      Format{"a.ppm", TypeDesc::UINT8, 3}));

class ReadTest : public FileTest {};

TEST_F(ReadTest, GranularityIsTheCompressionChunk) {
  for (const auto& [compression, rows] :
       {std::pair{"none", 1}, {"zips", 1}, {"zip", 16}, {"piz", 32}, {"dwab", 256}}) {
    OIIO::ImageSpec spec(20, 20, 3, TypeDesc::HALF);
    spec.attribute("compression", compression);
    WritePattern(Path("a.exr"), {spec});
    EXPECT_EQ(SourceOf(Read(Path("a.exr"))).RowGranularity(), rows) << compression;
  }
}

TEST_F(ReadTest, PartsAreChosenByIndexAndByName) {
  OIIO::ImageSpec beauty(40, 30, 3, TypeDesc::HALF), depth(50, 20, 1, TypeDesc::FLOAT);
  beauty.attribute("oiio:subimagename", "beauty");
  depth.attribute("oiio:subimagename", "P");
  depth.channelnames = {"Z"};
  beauty.full_width = depth.full_width = 64;  // EXR wants one frame for all parts
  beauty.full_height = depth.full_height = 48;
  WritePattern(Path("a.exr"), {beauty, depth});
  EXPECT_THAT(Subimages(Path("a.exr")), ElementsAre("beauty", "P"));

  ConstImageView view;
  for (const ReadOptions& options : {ReadOptions{.subimage = 1}, ReadOptions{.part = "P"}}) {
    const Node node = Read(Path("a.exr"), options);
    EXPECT_EQ(node.spec().width(), 50);
    EXPECT_THAT(node.spec().channels, ElementsAre("Z"));
    const auto keep = ReadRows(node, 0, 1, 20, &view);
    EXPECT_EQ(Wrong(view, 100), 0);
  }
  const Node first = Read(Path("a.exr"), {.part = "beauty"});
  const auto keep = ReadRows(first, 0, 3, 16, &view);
  EXPECT_EQ(Wrong(view, 0), 0);

  EXPECT_EQ(ErrorOf([&] { Read(Path("a.exr"), {.part = "N"}); }),
            Path("a.exr") + ": no part named \"N\"; parts found: 0 (beauty), 1 (P)");
  EXPECT_EQ(ErrorOf([&] { Read(Path("a.exr"), {.subimage = 2}); }),
            Path("a.exr") + ": no part 2; parts found: 0 (beauty), 1 (P)");
  EXPECT_THAT(ErrorOf([&] { Read(Path("a.exr"), {.subimage = -1}); }), HasSubstr("no part -1"));
}

TEST_F(ReadTest, ChannelsOfDifferentTypesBecomeFloat) {
  OIIO::ImageSpec spec(9, 5, 2, TypeDesc::FLOAT);
  spec.channelnames = {"R", "Z"};
  spec.channelformats = {TypeDesc::HALF, TypeDesc::FLOAT};
  const std::vector<float> pixels(90, 0.5f);
  auto output = OIIO::ImageOutput::create(Path("a.exr"));
  ASSERT_TRUE(output->open(Path("a.exr"), spec) && output->write_image(TypeDesc::FLOAT, pixels.data()) &&
              output->close());
  const Node node = Read(Path("a.exr"));
  ASSERT_EQ(node.spec().type, PixelType::kFloat);
  ConstImageView view;
  const auto keep = ReadRows(node, 0, 2, 2, &view);
  EXPECT_EQ(std::memcmp(view.At(8, 4), pixels.data(), 8), 0);
}

TEST_F(ReadTest, OtherTypesBecomeFloat) {
  OIIO::ImageSpec spec(5, 4, 1, TypeDesc::DOUBLE);
  const std::vector<double> pixels(20, 0.3);
  auto output = OIIO::ImageOutput::create(Path("a.tif"));
  ASSERT_TRUE(output->open(Path("a.tif"), spec) && output->write_image(TypeDesc::DOUBLE, pixels.data()) &&
              output->close());
  const Node node = Read(Path("a.tif"));
  ASSERT_EQ(node.spec().type, PixelType::kFloat);
  ConstImageView view;
  const auto keep = ReadRows(node, 0, 1, 4, &view);
  float value;
  std::memcpy(&value, view.At(4, 3), 4);
  EXPECT_EQ(value, 0.3f);
}

TEST_F(ReadTest, UnassociatedAlphaIsMultipliedInForAnyChannelRange) {
  OIIO::ImageSpec spec(2, 1, 4, TypeDesc::UINT8);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  const uint8_t pixels[] = {200, 100, 50, 128, 200, 100, 50, 0};
  auto output = OIIO::ImageOutput::create(Path("a.png"));
  ASSERT_TRUE(output->open(Path("a.png"), spec) && output->write_image(TypeDesc::UINT8, pixels) &&
              output->close());
  const Node node = Read(Path("a.png"));
  EXPECT_EQ(node.spec().alpha, 3);
  ConstImageView view;
  const auto keep = ReadRows(node, 0, 3, 1, &view);
  EXPECT_NEAR(static_cast<int>(*view.At(0, 0, 0)), 100, 1);
  EXPECT_EQ(static_cast<int>(*view.At(1, 0, 0)), 0);
}

TEST_F(ReadTest, HeaderGivesWindowsNamesAlphaAndMetadata) {
  OIIO::ImageSpec spec(30, 20, 5, TypeDesc::HALF);
  spec.x = -3, spec.y = 4, spec.full_x = -5, spec.full_y = 2, spec.full_width = 64, spec.full_height = 48;
  spec.channelnames = {"R", "G", "B", "A", "Z"};
  spec.attribute("worldToCamera", TypeDesc(TypeDesc::FLOAT, TypeDesc::MATRIX44),
                 std::vector<float>(16, 2.f).data());
  spec.attribute("Artist", "someone");
  WritePattern(Path("a.exr"), {spec});
  const ImageSpec found = Read(Path("a.exr")).spec();
  EXPECT_EQ(found.data_window, (Roi{-3, 4, 27, 24}));
  EXPECT_EQ(found.display_window, (Roi{-5, 2, 59, 50}));
  EXPECT_THAT(found.channels, ElementsAre("R", "G", "B", "A", "Z"));
  EXPECT_EQ(found.alpha, 3);
  ASSERT_TRUE(found.metadata);
  int seen = 0;
  for (const Attribute& a : *found.metadata) {
    if (a.name == "worldToCamera") {
      EXPECT_EQ(a.type, "matrix");
      EXPECT_EQ(a.bytes.size(), 64u);
      ++seen;
    }
    if (a.name == "Artist") {
      EXPECT_THAT(a.strings, ElementsAre("someone"));
      ++seen;
    }
  }
  EXPECT_EQ(seen, 2);
}

TEST_F(ReadTest, SlicesOfAVolumeFileLieOneAboveTheOther) {
  // A DirectDraw surface of 3 x 2 x 4 texels, b, g, r, a.
  std::string file = "DDS ";
  const auto put = [&](std::vector<uint32_t> words) {
    for (const uint32_t w : words) {
      for (int shift = 0; shift < 32; shift += 8) file += static_cast<char>(w >> shift & 255);
    }
  };
  put({124, 0x80100F, 2, 3, 12, 4, 0});
  put(std::vector<uint32_t>(11));
  put({32, 0x41, 0, 32, 0xFF0000, 0xFF00, 0xFF, 0xFF000000, 0x1008, 0x200000, 0, 0, 0});
  for (uint32_t z = 0; z < 4; ++z) {
    for (uint32_t y = 0; y < 2; ++y) {
      for (uint32_t x = 0; x < 3; ++x) put({0xFF000000 + (x << 16) + (y << 8) + z});
    }
  }
  SetContents(Path("a.dds"), file);
  const Node stack = Read(Path("a.dds"), {.formats = Formats::kAll});
  ASSERT_EQ(stack.spec().data_window, (Roi{0, 0, 3, 8}));
  const Image image = Render(stack, PixelType::kUint8);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 3; ++x) {
      const auto* const texel = &image.at<uint8_t>(x, y);
      ASSERT_THAT(std::vector<int>(texel, texel + 3), ElementsAre(x, y % 2, y / 2));
    }
  }
  // As a table of three axes: (s, t, r) in the middle of texel (1, 0, 2).
  Image coords(ImageSpec(1, 1, 3));
  coords.at<float>(0, 0, 0) = 0.5f, coords.at<float>(0, 0, 1) = 0.25f, coords.at<float>(0, 0, 2) = 0.625f;
  const Image found = Render(Lookup(FromImage(coords), stack, {.slices = {4}}), PixelType::kUint8);
  EXPECT_EQ(found.at<uint8_t>(0, 0, 0), 1);
  EXPECT_EQ(found.at<uint8_t>(0, 0, 1), 0);
  EXPECT_EQ(found.at<uint8_t>(0, 0, 2), 2);
}

TEST_F(ReadTest, AFileThatChangedSinceItsHeaderWasReadIsRefused) {
  WritePattern(Path("a.exr"), {OIIO::ImageSpec(30, 20, 3, TypeDesc::HALF)});
  const Node node = Read(Path("a.exr"));
  WritePattern(Path("a.exr"), {OIIO::ImageSpec(31, 20, 3, TypeDesc::HALF)});
  EXPECT_THAT(ErrorOf([&] { SourceOf(node).Open(0, 3); }), HasSubstr("changed"));
}

}  // namespace
}  // namespace tessera
