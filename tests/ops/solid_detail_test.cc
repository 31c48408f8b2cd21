// Solid textures with level of detail against the mean of 256 places in every pixel: a floor towards the
// horizon, every procedure at three frequencies.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "support/noise_values.h"
#include "tessera/ops/shade.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Values;
constexpr int kWidth = 160, kHeight = 48, kFine = 16;

using Place = std::function<std::array<double, 3>(double x, double y)>;

// One unit below the eye, seen straight ahead, 90 degrees wide; the horizon is the picture's upper edge.
std::array<double, 3> Floor(double x, double y) {
  const double distance = 0.5 * kWidth / y;
  return {0.5 + (x - 0.5 * kWidth) / (0.5 * kWidth) * distance / 8, 0.37, 0.5 + distance / 8};
}
// A wall on the right, towards its vanishing point at the left edge.
std::array<double, 3> Wall(double x, double y) {
  const double distance = 0.5 * kWidth / x;
  return {0.37, 0.5 + (y - 0.5 * kHeight) / (0.5 * kWidth) * distance / 8, 0.5 + distance / 8};
}

// The picture `fine` times as large each way.
Node Picture(int fine, int channels, const std::function<float(double, double, int)>& value) {
  const Image image(ImageSpec(kWidth * fine, kHeight * fine, channels));
  for (int y = 0; y < kHeight * fine; ++y) {
    for (int x = 0; x < kWidth * fine; ++x) {
      for (int c = 0; c < channels; ++c)
        image.at<float>(x, y, c) = value((x + 0.5) / fine, (y + 0.5) / fine, c);
    }
  }
  return FromImage(image);
}
Node Positions(const Place& place, int fine) {
  return Picture(fine, 3, [&](double x, double y, int c) {
    return static_cast<float>(place(x, y)[static_cast<size_t>(c)]);
  });
}
Node Grey(int fine) {
  return Picture(fine, 3, [](double, double, int) { return 0.4f; });
}

struct Case {
  std::string name;
  SolidParams params;
};
std::vector<Case> Procedures(double frequency) {
  const auto make = [&](SolidKind kind) {
    SolidParams p;
    p.kind = kind, p.frequency = frequency, p.blend = SolidBlend::kReplace;
    return p;
  };
  std::vector<Case> cases;
  const auto add = [&](const std::string& name, const SolidParams& p) { cases.push_back({name, p}); };
  SolidParams p = make(SolidKind::kMarble);
  add("marble", p);
  p.strength = 0;
  add("marble, straight bands", p);
  p.strength = 4, p.octaves = 6;
  add("marble, strong turbulence", p);
  p = make(SolidKind::kWood);
  add("wood", p);
  p.strength = 0;
  add("wood, round rings", p);
  p = make(SolidKind::kNoise);
  add("noise", p);
  p.octaves = 1;
  add("noise, one octave", p);
  p = make(SolidKind::kContours);
  p.plane = {0, 0, 1};
  add("contours across", p);
  p.plane = {1, 0.3, 0.7}, p.width = 0.5;
  add("contours askew", p);
  p.plane = {1, 0, 0}, p.width = 0.1;
  add("contours towards the horizon", p);
  p.plane = {0, 1, 0}, p.width = 0.2;
  add("contours along the floor", p);
  add("halftone", make(SolidKind::kHalftone));
  return cases;
}

struct Errors {
  double plain, filtered;
};
Errors Measure(const Case& c, const Node& positions, const Node& fine) {
  SolidParams p = c.params;
  const std::vector<float> supersampled = Values(SolidTexture(Grey(kFine), fine, p));
  const std::vector<float> plain = Values(SolidTexture(Grey(1), positions, p));
  p.level_of_detail = true;
  const std::vector<float> filtered = Values(SolidTexture(Grey(1), positions, p));
  double squares[2] = {};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double sum = 0;
      for (int j = 0; j < kFine; ++j) {
        const size_t row = static_cast<size_t>(y * kFine + j) * kWidth * kFine;
        for (int i = 0; i < kFine; ++i) sum += supersampled[3 * (row + static_cast<size_t>(x * kFine + i))];
      }
      const double truth = sum / (kFine * kFine);
      const size_t at = 3 * static_cast<size_t>(y * kWidth + x);
      squares[0] += (plain[at] - truth) * (plain[at] - truth);
      squares[1] += (filtered[at] - truth) * (filtered[at] - truth);
    }
  }
  return {std::sqrt(squares[0] / (kWidth * kHeight)), std::sqrt(squares[1] / (kWidth * kHeight))};
}

void IsNeverWorse(const Place& place) {
  const Node positions = Positions(place, 1), fine = Positions(place, kFine);
  for (const double frequency : {4.0, 12.0, 40.0}) {
    for (const Case& c : Procedures(frequency)) {
      const Errors e = Measure(c, positions, fine);
      const std::string what = c.name + ", " + std::to_string(frequency) + ": " + std::to_string(e.plain) +
                               " without, " + std::to_string(e.filtered) + " with";
      EXPECT_LE(e.filtered, e.plain + 1e-6) << what;
      // What is left without a filter is aliasing, but for the noise of 256 places.
      if (e.plain > 0.02) EXPECT_LE(e.filtered, 0.5 * e.plain) << what;
      ::testing::Test::RecordProperty(c.name + " " + std::to_string(static_cast<int>(frequency)), what);
    }
  }
}

TEST(SolidDetail, OnAFloorTowardsTheHorizonIsNeverWorseAndTwiceAsGoodWhereItAliases) { IsNeverWorse(Floor); }
TEST(SolidDetail, OnAWallTowardsItsVanishingPoint) { IsNeverWorse(Wall); }

}  // namespace
}  // namespace tessera
