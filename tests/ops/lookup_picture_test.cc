// Lookups in pictures that the nearer caches do not hold, on every target: the same results as small ones
// give.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "support/lookups.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Random, testing::Samples, testing::Values;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

class LookupPictureTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(EveryTarget, LookupPictureTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

TEST_P(LookupPictureTest, LargePicturesAreReadInBlocksAndMendedPixelByPixel) {
  // In no cache, so that blocks have several rows; so narrow that a cubic filter meets both edges.
  const Image image(ImageSpec(4, 1 << 21, 1)), near(ImageSpec(96, 40, 2)), far(ImageSpec(96, 40, 2));
  const Samples values = Random(4 * 64, 0, 1, 16), at = Random(2 * 96 * 40, -0.3f, 0.9f, 17);
  std::memset(image.view().data, 0, size_t{16} << 21);
  std::memcpy(image.view().data, values.data(), 4 * values.size());
  image.at<float>(2, 9) = kInf;
  for (size_t i = 0; i < at.size(); ++i) {
    const float v = i % 97 == 5 ? kNaN : at[i];
    reinterpret_cast<float*>(near.view().data)[i] = v;
    reinterpret_cast<float*>(far.view().data)[i] = i % 2 == 1 ? v * 0x1p-15f : v;
  }
  for (const TableFilter filter : {TableFilter::kLinear, TableFilter::kCubic}) {
    const LookupParams p{.filter = filter, .border = {0.5}};
    const Samples a = Values(Lookup(FromImage(far), FromImage(image), {}, p)),
                  b = Values(Lookup(FromImage(near), TableFromImage(image.view().Sub({0, 0, 4, 64})), p));
    for (size_t i = 0; i < a.size(); ++i)
      ASSERT_TRUE(std::fabs(a[i] - b[i]) <= 3e-7f || a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i])));
  }
}

TEST_P(LookupPictureTest, ScatteredPlacesAreThoseOfFewerPixels) {
  // So many pixels far apart, in a picture of that size, are worth a copy of it; a strip's are not.
  constexpr int kWidth = 1031, kHeight = 800, kRows = 50;
  Image image(ImageSpec(1000, 701, 1)), at(ImageSpec(kWidth, kHeight, 2));
  Samples values = Random(1000 * 701, -1, 1, 18), places = Random(2 * kWidth * kHeight, -0.1f, 1.1f, 19);
  for (size_t i = 0; i < values.size(); i += 9973) values[i] = i % 2 == 0 ? kNaN : kInf;
  for (size_t i = 0; i < places.size(); ++i) {
    if (i / (2 * kWidth) % 7 == 3) places[i] = static_cast<float>(i) / static_cast<float>(places.size());
    if (i % 4999 == 1) places[i] = i % 2 == 0 ? kNaN : -kInf;
  }
  std::memcpy(image.view().data, values.data(), sizeof(float) * values.size());
  std::memcpy(at.view().data, places.data(), sizeof(float) * places.size());
  for (const TableFilter filter : {TableFilter::kLinear, TableFilter::kCubic}) {
    for (const Wrap wrap : {Wrap::kClamp, Wrap::kBlack, Wrap::kRepeat}) {
      const LookupParams p{.filter = filter, .wrap = {wrap}, .border = {0.5}};
      RenderOptions options;
      options.shuffle_tiles = true;
      const Image whole = Render(Lookup(FromImage(at), FromImage(image), {}, p), PixelType::kFloat, options);
      for (int y = 0; y < kHeight; y += kRows) {
        ConstImageView rows = at.view().Sub({0, y, kWidth, y + kRows});
        rows.roi = {0, 0, kWidth, kRows};
        const Samples strip =
            Values(Lookup(FromView(rows, ImageSpec(kWidth, kRows, 2)), FromImage(image), {}, p));
        const float* const row = &whole.at<float>(0, y);
        for (size_t i = 0; i < strip.size(); ++i)
          ASSERT_TRUE(row[i] == strip[i] || (std::isnan(row[i]) && std::isnan(strip[i]))) << y << " " << i;
      }
    }
  }
}

}  // namespace
}  // namespace tessera
