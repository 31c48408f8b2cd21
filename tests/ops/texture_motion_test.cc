// Textures in motion: loops close without a seam, and curls, sparks and heights do what they are for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/noise_values.h"
#include "tessera/error.h"
#include "tessera/ops/texture.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using tessera::testing::Values;

constexpr TextureKind kLooped[] = {TextureKind::kClouds, TextureKind::kMarble, TextureKind::kWood,
                                   TextureKind::kFire,   TextureKind::kSmoke,  TextureKind::kGardner};
const ImageSpec kSmall(96, 54, 4);

std::vector<float> Frame(TextureParams p, double time) {
  p.time = time;
  return Values(Texture(kSmall, p));
}
double MeanChange(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::fabs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}
double LargestChange(const std::vector<float>& a, const std::vector<float>& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max<double>(most, std::fabs(a[i] - b[i]));
  return most;
}

TEST(TextureMotionTest, LoopsComeBack) {
  for (const TextureKind kind : kLooped) {
    SCOPED_TRACE(static_cast<int>(kind));
    const TextureParams p{.kind = kind, .loop = 3, .wind = 0.3};
    EXPECT_LT(LargestChange(Frame(p, 0.7), Frame(p, 3.7)), 1e-4);
    EXPECT_LT(LargestChange(Frame(p, 0), Frame(p, 3e5)), 1e-4);
    EXPECT_GT(MeanChange(Frame(p, 0.7), Frame(p, 2.2)), 1e-3);
  }
}

// The step from the last frame to the first is one like the others.
TEST(TextureMotionTest, LoopsHaveNoSeam) {
  constexpr int kFrames = 48;
  for (const TextureKind kind : kLooped) {
    SCOPED_TRACE(static_cast<int>(kind));
    const TextureParams p{.kind = kind, .loop = 2};
    double mean = 0, seam = 0, largest = 0;
    std::vector<float> before = Frame(p, 0);
    for (int i = 1; i <= kFrames; ++i) {
      std::vector<float> now = Frame(p, i * p.loop / kFrames * (1 - 1e-9));
      const double change = MeanChange(before, now);
      if (i < kFrames) largest = std::max(largest, change), mean += change / (kFrames - 1);
      if (i == kFrames) seam = change;
      before = std::move(now);
    }
    EXPECT_LT(MeanChange(before, Frame(p, 0)), 1e-5);
    EXPECT_LT(seam, 1.1 * largest);
    EXPECT_LT(largest, 2 * mean);
  }
}

// Without curls bands are level lines of a sum; with them a picture keeps its mean, as its parts move about
// without being piled up.
TEST(TextureMotionTest, CurlsMoveWhatIsThere) {
  for (const TextureKind kind : {TextureKind::kFire, TextureKind::kSmoke, TextureKind::kMarble}) {
    SCOPED_TRACE(static_cast<int>(kind));
    double still = 0, curled = 0, apart = 0;
    for (uint32_t seed = 0; seed < 12; ++seed) {
      const std::vector<float> a = Frame({.kind = kind, .seed = seed, .curl = 0}, 0);
      const std::vector<float> b = Frame({.kind = kind, .seed = seed}, 0);
      for (size_t i = 0; i < a.size(); i += 4) still += a[i], curled += b[i];
      apart += MeanChange(a, b) * static_cast<double>(a.size() / 4);
    }
    EXPECT_NEAR(curled, still, 0.2 * still);
    EXPECT_GT(apart, 0.05 * still);
  }
}

TEST(TextureMotionTest, FiresHeightAndSparks) {
  const auto light = [](const TextureParams& p) {
    double sum = 0;
    const std::vector<float> values = Frame(p, 1);
    for (size_t i = 0; i < values.size(); i += 4) sum += values[i];
    return sum;
  };
  const TextureParams fire{.kind = TextureKind::kFire, .embers = 0};
  TextureParams low = fire, high = fire, sparks = fire;
  low.height = 0.4, high.height = 2, sparks.embers = 1;
  EXPECT_LT(1.3 * light(low), light(fire));
  EXPECT_LT(1.3 * light(fire), light(high));
  const std::vector<float> without = Frame(fire, 1), with = Frame(sparks, 1);
  int brighter = 0;
  for (size_t i = 0; i < with.size(); ++i) {
    EXPECT_GE(with[i], without[i]);
    brighter += with[i] > without[i] + 0.1f ? 1 : 0;
  }
  EXPECT_GT(brighter, 5);
  EXPECT_LT(brighter, static_cast<int>(with.size() / 20));
}

TEST(TextureMotionTest, RefusesWhatItCannotDo) {
  const auto refused = [](const TextureParams& p, const std::string& named) {
    try {
      Texture(kSmall, p);
      ADD_FAILURE() << named << " was taken";
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(named), std::string::npos) << e.what();
    }
  };
  refused({.kind = TextureKind::kFire, .loop = -1}, "loop");
  refused({.kind = TextureKind::kFire, .curl = 5}, "curl");
  refused({.kind = TextureKind::kFire, .height = 0}, "height");
  refused({.kind = TextureKind::kFire, .embers = -1}, "embers");
}

}  // namespace
}  // namespace tessera
