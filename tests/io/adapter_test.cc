// OpenImageIO's images as ours and back without a copy; statistics and differences in oiiotool's words.
#include <OpenImageIO/imagebufalgo.h>

#include "files.h"
#include "tessera/oiio_adapter.h"

namespace tessera {
namespace {

using namespace testing_io;
using ::testing::HasSubstr;

TEST(AdapterTest, AnImageBufIsBorrowed) {
  OIIO::ImageSpec spec(13, 7, 4, OIIO::TypeDesc::HALF);
  spec.x = -3, spec.y = 5;
  OIIO::ImageBuf buffer(spec);
  const Node node = FromImageBuf(buffer);
  EXPECT_EQ(node.spec().data_window, (Roi{-3, 5, 10, 12}));
  EXPECT_EQ(node.spec().type, PixelType::kHalf);
  const auto view = SourceOf(node).View();
  ASSERT_TRUE(view);
  EXPECT_EQ(view->data, buffer.localpixels());
  EXPECT_EQ(static_cast<const void*>(view->At(4, 9, 2)),
            static_cast<const std::byte*>(buffer.pixeladdr(4, 9)) + 2 * 2);
}

TEST(AdapterTest, AnImageBufWithStridesOfItsOwnIsBorrowed) {
  std::vector<float> pixels(1000);
  const OIIO::ImageBuf buffer(OIIO::ImageSpec(5, 4, 2, OIIO::TypeDesc::FLOAT), pixels.data(), 12, 80);
  const ConstImageView view = ViewOf(buffer);
  EXPECT_EQ(view.data, reinterpret_cast<std::byte*>(pixels.data()));
  EXPECT_EQ(view.pixel_stride, 12);
  EXPECT_EQ(view.row_stride, 80);
}

TEST(AdapterTest, WhatCannotBeBorrowedIsRefused) {
  EXPECT_THAT(ErrorOf([] { FromImageBuf(OIIO::ImageBuf()); }), HasSubstr("without an image"));
  const OIIO::ImageBuf doubles(OIIO::ImageSpec(2, 2, 1, OIIO::TypeDesc::DOUBLE));
  EXPECT_THAT(ErrorOf([&] { FromImageBuf(doubles); }), HasSubstr("found pixels of type double"));
}

TEST(AdapterTest, AnImageIsWrappedAndKeptAlive) {
  std::shared_ptr<OIIO::ImageBuf> buffer;
  const void* pixels;
  {
    ImageSpec spec(9, 6, 3, PixelType::kUint16);
    spec.data_window = {2, -4, 11, 2};
    spec.display_window = {0, 0, 20, 20};
    const Image image = Pattern(spec);
    pixels = image.view().data;
    buffer = ToImageBuf(image);
  }
  EXPECT_EQ(buffer->localpixels(), pixels);
  EXPECT_EQ(buffer->roi(), OIIO::ROI(2, 11, -4, 2, 0, 1, 0, 3));
  EXPECT_EQ(buffer->roi_full().xend, 20);
  EXPECT_EQ(Wrong(ViewOf(*buffer)), 0);
}

TEST(InspectTest, StatisticsAreOiiotoolsWords) {
  const Image image(ImageSpec(4, 1, 1, PixelType::kUint8));
  for (int x = 0; x < 4; ++x) image.at<uint8_t>(x, 0) = static_cast<uint8_t>(x * 51);
  const std::string expected =
      "    Stats Min: 0 (of 255)\n    Stats Max: 153 (of 255)\n    Stats Avg: 76.50 (of 255)\n"
      "    Stats StdDev: 57.02 (of 255)\n    Stats NanCount: 0 \n    Stats InfCount: 0 \n"
      "    Stats FiniteCount: 4 \n    Constant: No\n    Monochrome: Yes\n";
  EXPECT_EQ(StatsText(image), expected);
  EXPECT_EQ(StatsText(FromImage(image)), expected);

  const Image grey(ImageSpec(2, 2, 3, PixelType::kFloat));
  for (int i = 0; i < 12; ++i) grey.at<float>(i / 3 % 2, i / 6, i % 3) = 0.5f;
  EXPECT_THAT(StatsText(grey), HasSubstr("    Stats Max: 0.500000 0.500000 0.500000 (float)\n"));
  EXPECT_THAT(StatsText(grey),
              HasSubstr("    Constant: Yes\n    Constant Color: 0.500000 0.500000 0.500000 (float)\n"));
}

TEST(InspectTest, DifferencesAreCountedAndJudged) {
  const Image a(ImageSpec(10, 10, 3, PixelType::kFloat)), b(ImageSpec(10, 10, 3, PixelType::kFloat));
  EXPECT_EQ(Compare(a, b).verdict, DiffVerdict::kPass);
  EXPECT_EQ(Compare(a, b).text, "PASS\n");
  b.at<float>(7, 3, 1) = 0.25f;
  const DiffReport found = Compare(a, b);
  EXPECT_EQ(found.verdict, DiffVerdict::kFailure);
  EXPECT_EQ(found.failed, 1);
  EXPECT_EQ(found.max_error, 0.25);
  EXPECT_EQ(found.max_x, 7);
  EXPECT_EQ(found.max_y, 3);
  EXPECT_EQ(found.max_channel, 1);
  EXPECT_THAT(found.text, HasSubstr("  Max error  = 0.25 @ (7, 3, G)  values are 0, 0, 0 vs 0, 0.25, 0\n"
                                    "  1 pixels (1%) over 1e-06\n  1 pixels (1%) over 1e-06\nFAILURE\n"));
  EXPECT_EQ(Compare(a, b, {.fail = 0.5}).verdict, DiffVerdict::kWarning);
  EXPECT_EQ(Compare(a, b, {.fail_percent = 1, .warn_percent = 1}).verdict, DiffVerdict::kPass);
  EXPECT_EQ(Compare(a, b, {.fail_percent = 1, .hard_fail = 0.2}).verdict, DiffVerdict::kFailure);
}

}  // namespace
}  // namespace tessera
