// Results too large for the last cache are written around it: the same pixels as in pieces that are not.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "support/apply.h"
#include "support/pictures.h"
#include "tessera/ops/channels.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Apply;
using testing::Content;
using testing::Picture;
using testing::Words;

using T = PixelType;

// Pixels of one small picture again and again: a large one takes long to paint.
Image Repeated(int width, int height, int channels, T type) {
  const Roi part{0, 0, 251, 16};
  const Image from = Picture(part, channels, type, 11, Content::kOrdinary);
  ImageSpec spec(width, height, channels, type);
  const Image image(spec);
  const auto pixel = static_cast<size_t>(from.view().pixel_stride);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; x += part.width()) {
      const int count = std::min(part.width(), width - x);
      std::memcpy(image.view().At(x, y), from.view().At(0, y % part.height()),
                  pixel * static_cast<size_t>(count));
    }
  }
  return image;
}

// The width is no multiple of any vector, so that rows begin anywhere.
void ExpectAsInPieces(const Node& node, T type, const std::string& what) {
  const Image whole = Render(node, type);
  const Roi window = node.spec().data_window;
  const size_t pixel = static_cast<size_t>(whole.view().pixel_stride);
  ASSERT_GT(static_cast<size_t>(window.pixels()) * pixel, size_t{8} << 20) << "is not large";
  for (int y = window.y0; y < window.y1; y += 64) {
    const Roi rows{window.x0, y, window.x1, std::min(y + 64, window.y1)};
    ImageSpec spec = node.spec();
    spec.type = type, spec.data_window = rows;
    const Image piece(spec);
    RenderInto(node, piece.view());
    for (int row = rows.y0; row < rows.y1; ++row) {
      ASSERT_EQ(std::memcmp(whole.view().At(window.x0, row), piece.view().At(window.x0, row),
                            pixel * static_cast<size_t>(window.width())),
                0)
          << what << " to " << PixelTypeName(type) << ", row " << row;
    }
  }
}

// A width that makes a little more than 8 MB of 701 rows.
int WidthOf(int channels, T type) {
  return static_cast<int>((size_t{9} << 20) / (701 * PixelBytes(type) * static_cast<size_t>(channels))) | 1;
}

TEST(AroundTheCache, EveryWayToStoreGivesTheSamePixels) {
  for (const std::string& target : SimdTargets()) {
    SetSimdTarget(target);
    for (const T type : {T::kUint8, T::kUint16, T::kHalf, T::kFloat}) {
      for (const int channels : {1, 3, 4}) {
        const Node source = FromImage(Repeated(WidthOf(channels, type), 701, channels, type));
        const std::string what = std::to_string(channels) + " channels on " + target;
        ExpectAsInPieces(source, type, what + ", copied");
        ExpectAsInPieces(Apply({"mulc", "0.5"}, {source}), type, what + ", mulc");
        if (channels == 4) ExpectAsInPieces(Apply({"hue", "30"}, {source}), type, what + ", hue");
        if (channels == 4)
          ExpectAsInPieces(Apply({"blend", "over"}, {source, source}), type, what + ", over");
        if (channels == 3) ExpectAsInPieces(Apply({"ch", "B,G,R"}, {source}), type, what + ", ch B,G,R");
        if (channels == 3)
          ExpectAsInPieces(Apply({"ch", "R,G,B,A=0.5"}, {source}), type, what + ", ch with alpha");
      }
    }
  }
  SetSimdTarget("auto");
}

TEST(AroundTheCache, WindowsToo) {
  for (const T type : {T::kUint8, T::kFloat}) {
    const Node source = FromImage(Repeated(WidthOf(4, type), 701, 4, type));
    for (const Words& words :
         {Words{"blur", "3x3"}, Words{"blur", "15x9"}, Words{"blur", "21x15 kernel=box"},
          Words{"median", "3x3"}, Words{"convolve", "kernel=smooth3"}, Words{"dilate", "5x5"}}) {
      ExpectAsInPieces(Apply(words, {source}), type, words.op);
    }
  }
}

}  // namespace
}  // namespace tessera
