// References of fog and environment maps against numerical and closed integrals.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "support/oracle.h"

namespace tessera {
namespace {

using testing::Command;
using testing::ReferenceOf;
using testing::Row;

// The integral of f from a to b by Simpson's rule, halved where it does not agree with its halves.
double Integral(const std::function<double(double)>& f, double a, double b, double within, int depth = 40) {
  const double m = 0.5 * (a + b), h = b - a;
  const double whole = h / 6 * (f(a) + 4 * f(m) + f(b));
  const double halves = h / 12 * (f(a) + 4 * f(0.5 * (a + m)) + 2 * f(m) + 4 * f(0.5 * (m + b)) + f(b));
  if (depth == 0 || (depth < 34 && std::fabs(whole - halves) < 15 * within)) return halves;
  return Integral(f, a, m, 0.5 * within, depth - 1) + Integral(f, m, b, 0.5 * within, depth - 1);
}

// White in black fog is exp(-integral of the density along the ray): by quadrature of the density as it is
// defined.
TEST(ShadeOracle, LayeredFogIsTheIntegralOfItsDensity) {
  struct Profile {
    const char* words;
    std::function<double(double)> density;
  };
  const Profile profiles[] = {{"layers=-0.5,0.2,0.1,0.9,0.6,0.3,1.2,0.05",
                               [](double y) {
                                 return y < -0.5 ? 0 : y < 0.1 ? 0.2 : y < 0.6 ? 0.9 : y < 1.2 ? 0.3 : 0.05;
                               }},
                              {"layers=-0.5,0.2,0.1,0.9,0.6,0.3 profile=linear",
                               [](double y) {
                                 if (y <= -0.5) return 0.2;
                                 if (y <= 0.1) return 0.2 + (y + 0.5) / 0.6 * 0.7;
                                 return y <= 0.6 ? 0.9 - (y - 0.1) / 0.5 * 0.6 : 0.3;
                               }},
                              {"layers=-0.25,0.4,0.75,0.5,0.1,2.5 profile=exp", [](double y) {
                                 return 0.4 * std::exp(-(y + 0.25) / 0.75) + 0.1 * std::exp(-(y - 0.5) / 2.5);
                               }}};
  const double eye[3] = {0.125, 0.375, -0.25};
  const std::vector<std::vector<float>> points = {
      {0.5f, 0.375f, 2},      {0.5f, 0.37500003f, 2}, {1, 1.5f, 3},        {-2, -1, 0.5f},
      {0.125f, 2.5f, -0.25f}, {4, 0.0625f, -3},       {0.125f, 0.375f, 1}, {0.125f, 0.375f, -0.25f}};
  const Node white = Row(std::vector<std::vector<float>>(points.size(), {1, 1, 1}));
  for (const Profile& profile : profiles) {
    const std::string words = std::string(profile.words) + " eye=0.125,0.375,-0.25 color=0,0,0";
    const reference::ImageD found = ReferenceOf(Command("layerfog", words, {white, Row(points)}));
    for (size_t i = 0; i < points.size(); ++i) {
      double square = 0;
      for (size_t a = 0; a < 3; ++a) square += (points[i][a] - eye[a]) * (points[i][a] - eye[a]);
      const double rise = points[i][1] - eye[1];
      const double mean = Integral([&](double t) { return profile.density(eye[1] + t * rise); }, 0, 1, 1e-11);
      EXPECT_NEAR(found.at(static_cast<int>(i), 0, 0), std::exp(-std::sqrt(square) * mean), 1e-9)
          << profile.words << ", point " << i;
    }
  }
}

// Light 1 + d.y from all directions d: the irradiance of a surface over pi is 1 + 2/3 n.y.
TEST(ShadeOracle, IrradianceOfALinearSky) {
  constexpr int kWidth = 128, kHeight = 64;
  ImageSpec spec(kWidth, kHeight, 3);
  spec.type = PixelType::kFloat;
  const Image sky(spec);
  for (int y = 0; y < kHeight; ++y) {
    const double up = std::cos(std::numbers::pi * (y + 0.5) / kHeight);
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) sky.at<float>(x, y, c) = static_cast<float>(1 + up);
    }
  }
  const std::vector<std::vector<float>> normals = {
      {0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {0, 0.6f, 0.8f}, {-0.8f, -0.6f, 0}};
  const reference::ImageD found =
      ReferenceOf(Command("envmap", "diffuse=1 table=-1", {Row(normals), FromImage(sky)}));
  for (size_t i = 0; i < normals.size(); ++i) {
    EXPECT_NEAR(found.at(static_cast<int>(i), 0, 0), 1 + 2.0 / 3 * normals[i][1], 1e-3) << i;
  }
}

}  // namespace
}  // namespace tessera
