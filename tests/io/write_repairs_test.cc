// What OpenImageIO's writers get wrong is right in our files, and none of its readers is asked that could not
// be.
#include <utility>

#include "files.h"

namespace tessera {
namespace {

using namespace testing_io;

class WriteRepairsTest : public FileTest {};

// OpenImageIO's writer would take the halves' bits for integers.
TEST_F(WriteRepairsTest, HalvesAreFloatsInFormatsWithoutThem) {
  const Node picture = FromImage(Pattern(ImageSpec(67, 45, 3, PixelType::kHalf)));
  for (const char* const name : {"a.rla", "a.fits"})
    EXPECT_EQ(StoredType(picture, Path(name)), PixelType::kFloat) << name;
  Write(picture, Path("a.rla"));
  Write(picture, Path("a.exr"));
  const Image written = Render(Read(Path("a.rla"))), right = Render(Read(Path("a.exr")));
  int wrong = 0;
  const Roi window = right.spec().data_window;
  ASSERT_EQ(written.spec().data_window.width(), window.width());
  for (int y = 0; y < window.height(); ++y) {
    for (int x = 0; x < window.width(); ++x) {
      for (int c = 0; c < right.spec().channel_count(); ++c) {
        const Roi own = written.spec().data_window;
        wrong += std::memcmp(written.view().At(own.x0 + x, own.y0 + y, c),
                             right.view().At(window.x0 + x, window.y0 + y, c), sizeof(float)) != 0;
      }
    }
  }
  EXPECT_EQ(wrong, 0);
}

// OpenImageIO's writer repeats the one before the last sample of a row where that is a run of its own.
TEST_F(WriteRepairsTest, TheLastColumnOfAnRlaIsRight) {
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16}) {
    for (const int width : {1, 2, 4, 127, 128, 129, 255}) {
      const Image image(ImageSpec(width, 5, 3, type));
      Fill(image.view());
      // Equal ones, and another at the end.
      for (int y = 1; y < 4; ++y) {
        for (int x = 0; x + 1 < width; ++x) std::memset(image.view().At(x, y), y, 3 * PixelBytes(type));
      }
      Write(FromImage(image), Path("a.rla"));
      const Image written = Render(Read(Path("a.rla")), type);
      const auto bytes = static_cast<size_t>(width) * 3 * PixelBytes(type);
      for (int y = 0; y < 5; ++y)
        EXPECT_EQ(std::memcmp(written.view().At(0, y), image.view().At(0, y), bytes), 0) << width << " " << y;
    }
  }
}

// The writer would read behind a date without a time.
TEST_F(WriteRepairsTest, TimesOfFitsAreWhole) {
  const Node picture = FromImage(Pattern(ImageSpec(7, 5, 1, PixelType::kFloat)));
  for (const auto& [given, date] : {std::pair{"2020:02:03", "2020-02-03T00:00:00"},
                                    {"2020:02:03 04:05", "2020-02-03T04:05:00"},
                                    {"2020:02:03 04:05:06", "2020-02-03T04:05:06"},
                                    {"", "0000-01-01T00:00:00"}}) {
    WriteOptions options;
    options.attributes = {{"DateTime", "string", {}, {given}}};
    Write(picture, Path("a.fits"), options);
    EXPECT_THAT(Contents(Path("a.fits")), ::testing::HasSubstr(date)) << given;
  }
}

// Its reader would write beyond the rows of any width that is no multiple of eight; the file is looked at
// without.
TEST_F(WriteRepairsTest, IconsOfAnyWidth) {
  for (const int width : {1, 31, 33, 48, 255, 256}) {
    for (const int channels : {1, 2, 3, 4}) {
      const Node picture = FromImage(Pattern(ImageSpec(width, 33, channels, PixelType::kUint8)));
      EXPECT_NO_THROW(Write(picture, Path("a.ico"))) << width << " " << channels;
    }
  }
}

}  // namespace
}  // namespace tessera
