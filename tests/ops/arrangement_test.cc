// Rearrangements, windows, pastes and mosaics: bits of hard values, windows off the origin, what leads too
// far.
#include "tessera/ops/arrangement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <climits>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "support/pictures.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::Content;
using testing::Picture;

constexpr Roi kWindow{5, -7, 68, 36};
constexpr PixelType kTypes[] = {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat};

Image Source(int channels, PixelType type, const Roi& display) {
  const Image pixels = Picture(kWindow, channels, type, 23, Content::kSpecial);
  ImageSpec spec = pixels.spec();
  spec.display_window = display;
  const Image image(spec);
  std::memcpy(image.view().data, pixels.view().data,
              static_cast<size_t>(kWindow.pixels()) * static_cast<size_t>(image.view().pixel_stride));
  return image;
}

using Place = std::function<std::pair<int, int>(int, int)>;

// Every pixel of the result is the image's at `from`, bit for bit.
void ExpectPlaces(const Node& result, const Image& image, const Roi& window, const Roi& display,
                  const Place& from) {
  EXPECT_EQ(result.spec().data_window, window);
  EXPECT_EQ(result.spec().display_window, display);
  const Image out = Render(result, image.spec().type);
  const auto bytes = static_cast<size_t>(image.view().pixel_stride);
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const auto [sx, sy] = from(x, y);
      ASSERT_EQ(std::memcmp(out.view().At(x, y), image.view().At(sx, sy), bytes), 0) << x << "," << y;
    }
  }
}

TEST(ArrangementTest, EveryPixelOfEveryTypeIsWhereItBelongs) {
  const Roi d{-3, 10, 97, 70};  // 100 x 60, off the origin
  const Roi& w = kWindow;
  for (const PixelType type : kTypes) {
    for (const int channels : {1, 2, 3, 4, 5, 7}) {
      SCOPED_TRACE(std::string(PixelTypeName(type)) + " of " + std::to_string(channels));
      const Image image = Source(channels, type, d);
      const Node node = FromImage(image);
      ExpectPlaces(Flip(node), image, {w.x0, 80 - w.y1, w.x1, 80 - w.y0}, d,
                   [](int x, int y) { return std::pair(x, 79 - y); });
      ExpectPlaces(Flop(node), image, {94 - w.x1, w.y0, 94 - w.x0, w.y1}, d,
                   [](int x, int y) { return std::pair(93 - x, y); });
      ExpectPlaces(Rotate180(node), image, {94 - w.x1, 80 - w.y1, 94 - w.x0, 80 - w.y0}, d,
                   [](int x, int y) { return std::pair(93 - x, 79 - y); });
      ExpectPlaces(Transpose(node), image, {w.y0, w.x0, w.y1, w.x1}, {10, -3, 70, 97},
                   [](int x, int y) { return std::pair(y, x); });
      // The corner (-3, 10) stays; 60 wide and 100 high.
      const Roi turned{-3, 10, 57, 110};
      ExpectPlaces(Rotate90(node), image, {67 - w.y1, w.x0 + 13, 67 - w.y0, w.x1 + 13}, turned,
                   [](int x, int y) { return std::pair(y - 13, 66 - x); });
      ExpectPlaces(Rotate270(node), image, {w.y0 - 13, 107 - w.x1, w.y1 - 13, 107 - w.x0}, turned,
                   [](int x, int y) { return std::pair(106 - y, x + 13); });
      ExpectPlaces(Move(node, {100, -300}), image, {105, -307, 168, -264}, d,
                   [](int x, int y) { return std::pair(x - 100, y + 300); });
      ExpectPlaces(WithOrigin(node, {-1, 2}), image, {-1, 2, 62, 45}, d,
                   [](int x, int y) { return std::pair(x + 6, y - 9); });
      ExpectPlaces(CircularShift(node, {70, -50}), image, w, d, [&](int x, int y) {
        return std::pair(w.x0 + ((x - w.x0 - 70) % 63 + 63) % 63, w.y0 + ((y - w.y0 + 50) % 43 + 43) % 43);
      });
    }
  }
}

TEST(ArrangementTest, TurnsOfLargePicturesAreRight) {
  const Image image = Picture({0, 0, 1031, 517}, 4, PixelType::kUint8, 3);
  const Node node = FromImage(image);
  for (const auto& [there, back] : {std::pair(Rearrangement::kRotate90, Rearrangement::kRotate270),
                                    std::pair(Rearrangement::kTranspose, Rearrangement::kTranspose),
                                    std::pair(Rearrangement::kRotate180, Rearrangement::kRotate180)}) {
    const Image again = Render(Rearrange(Rearrange(node, there), back), PixelType::kUint8);
    ASSERT_EQ(std::memcmp(again.view().data, image.view().data, size_t{4} * 1031 * 517), 0);
  }
}

TEST(ArrangementTest, OrientationIsCarriedOutOnce) {
  const Image image = Source(3, PixelType::kUint8, {0, 0, 80, 50});
  EXPECT_EQ(OrientationOf(image.spec()), 1);
  const Node held = WithOrientation(FromImage(image), 6);
  EXPECT_EQ(OrientationOf(held.spec()), 6);
  const Node up = Reorient(held);
  EXPECT_EQ(OrientationOf(up.spec()), 1);
  EXPECT_EQ(up.spec().display_window, (Roi{0, 0, 50, 80}));
  EXPECT_EQ(Reorient(up).data(), up.data());
  EXPECT_THROW(WithOrientation(FromImage(image), 9), Error);
}

TEST(ArrangementTest, WindowsThatLeadTooFarAreRefused) {
  const Node far = WithOrigin(FromImage(Source(3, PixelType::kUint8, {0, 0, 80, 50})), {INT_MAX - 100, 0});
  EXPECT_THROW(Move(far, {200, 0}), Error);
  EXPECT_THROW(Rotate180(WithOrigin(far, {-INT_MAX + 1000, 0})), Error);
  EXPECT_THROW(WithOrigin(far, {-INT_MAX, 0}), Error);
}

TEST(ArrangementTest, TrimFindsWhatIsNotZero) {
  const Image image(ImageSpec(300, 200, 3));
  const Node node = FromImage(image);
  EXPECT_EQ(NonZeroWindow(node, {}), (Roi{0, 0, 1, 1}));
  image.at<float>(17, 150, 2) = -1e-40f;
  EXPECT_EQ(NonZeroWindow(node, {}), (Roi{17, 150, 18, 151}));
  image.at<float>(250, 20, 0) = std::numeric_limits<float>::quiet_NaN();
  const Node trimmed = Trim(node, {});
  EXPECT_EQ(trimmed.spec().data_window, (Roi{17, 20, 251, 151}));
  EXPECT_EQ(trimmed.spec().display_window, image.spec().display_window);
}

TEST(ArrangementTest, APasteKeepsWhatTheFrontDoesNotHave) {
  const Image back = Picture({0, 0, 20, 10}, 4, PixelType::kUint8, 5),
              front = Picture({2, 3, 9, 8}, 3, PixelType::kUint8, 6);
  const Image out = Render(Paste(FromImage(front), FromImage(back), {{4, -5}, false}), PixelType::kUint8);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 20; ++x) {
      const bool inside = x >= 6 && x < 13 && y < 3;
      for (int c = 0; c < 4; ++c) {
        const uint8_t want = inside && c < 3 ? front.at<uint8_t>(x - 4, y + 5, c) : back.at<uint8_t>(x, y, c);
        ASSERT_EQ(out.at<uint8_t>(x, y, c), want) << x << "," << y << "," << c;
      }
    }
  }
}

TEST(ArrangementTest, AMosaicOfManyIsOneStep) {
  std::vector<Node> images;
  for (uint32_t i = 0; i < 37; ++i)
    images.push_back(FromImage(Picture({0, 0, 9, 7}, 3, PixelType::kHalf, i)));
  for (Node& image : images) image = WithDisplayWindow(image, {0, 0, 9, 7});
  MosaicParams params;
  params.columns = 6, params.pad = 2;
  const Node mosaic = Mosaic(images, params);
  EXPECT_EQ(mosaic.spec().data_window, (Roi{0, 0, 6 * 9 + 5 * 2, 7 * 7 + 6 * 2}));
  const Image out = Render(mosaic, PixelType::kHalf);
  const Image one = Render(images[20], PixelType::kHalf);  // row 3, column 2
  for (int y = 0; y < 7; ++y)
    EXPECT_EQ(std::memcmp(out.view().At(22, 27 + y), one.view().At(0, y), size_t{9} * 6), 0);
  EXPECT_EQ(out.at<uint16_t>(9, 0, 0), 0);    // between fields
  EXPECT_EQ(out.at<uint16_t>(20, 60, 1), 0);  // a field that nobody fills
  EXPECT_THROW(Mosaic({}, params), Error);
}

}  // namespace
}  // namespace tessera
