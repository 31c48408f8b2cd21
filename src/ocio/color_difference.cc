// CIEDE2000, as Sharma, Wu and Dalal write it.
#include "ocio/color_difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera::ocio {
namespace {

double LightOfSrgb(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }
double CubeRootOrLine(double t) {
  constexpr double kDelta = 6.0 / 29;
  return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
}
double Radians(double degrees) { return degrees * std::numbers::pi / 180; }
// In degrees, [0, 360); 0 of nothing.
double HueOf(double b, double a) {
  if (a == 0 && b == 0) return 0;
  const double h = std::atan2(b, a) * 180 / std::numbers::pi;
  return h < 0 ? h + 360 : h;
}
double Pow7Share(double c) {
  const double c7 = std::pow(c, 7);
  return std::sqrt(c7 / (c7 + std::pow(25.0, 7)));
}

}  // namespace

std::array<double, 3> LabOfSrgb(const float* rgb) {
  double light[3];
  for (int c = 0; c < 3; ++c) light[c] = LightOfSrgb(std::fmin(std::fmax(double{rgb[c]}, 0), 1));
  const double x = 0.4124564 * light[0] + 0.3575761 * light[1] + 0.1804375 * light[2];
  const double y = 0.2126729 * light[0] + 0.7151522 * light[1] + 0.0721750 * light[2];
  const double z = 0.0193339 * light[0] + 0.1191920 * light[1] + 0.9503041 * light[2];
  const double fx = CubeRootOrLine(x / 0.95047), fy = CubeRootOrLine(y), fz = CubeRootOrLine(z / 1.08883);
  return {116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)};
}

double Ciede2000(const std::array<double, 3>& lab1, const std::array<double, 3>& lab2) {
  const auto [l1, a1, b1] = lab1;
  const auto [l2, a2, b2] = lab2;
  const double g = 0.5 * (1 - Pow7Share((std::hypot(a1, b1) + std::hypot(a2, b2)) / 2));
  const double a1p = (1 + g) * a1, a2p = (1 + g) * a2;
  const double c1 = std::hypot(a1p, b1), c2 = std::hypot(a2p, b2);
  const double h1 = HueOf(b1, a1p), h2 = HueOf(b2, a2p);

  double turn = 0, mean_hue = h1 + h2;
  if (c1 * c2 != 0) {
    turn = h2 - h1;
    if (turn > 180) turn -= 360;
    if (turn < -180) turn += 360;
    if (std::fabs(h1 - h2) <= 180) {
      mean_hue = (h1 + h2) / 2;
    } else {
      mean_hue = h1 + h2 < 360 ? (h1 + h2 + 360) / 2 : (h1 + h2 - 360) / 2;
    }
  }
  const double dl = l2 - l1, dc = c2 - c1, dh = 2 * std::sqrt(c1 * c2) * std::sin(Radians(turn) / 2);
  const double mean_l = (l1 + l2) / 2, mean_c = (c1 + c2) / 2;
  const double t = 1 - 0.17 * std::cos(Radians(mean_hue - 30)) + 0.24 * std::cos(Radians(2 * mean_hue)) +
                   0.32 * std::cos(Radians(3 * mean_hue + 6)) - 0.20 * std::cos(Radians(4 * mean_hue - 63));
  const double rotation = 30 * std::exp(-std::pow((mean_hue - 275) / 25, 2));
  const double from_middle = (mean_l - 50) * (mean_l - 50);
  const double sl = 1 + 0.015 * from_middle / std::sqrt(20 + from_middle);
  const double sc = 1 + 0.045 * mean_c, sh = 1 + 0.015 * mean_c * t;
  const double rt = -std::sin(Radians(2 * rotation)) * 2 * Pow7Share(mean_c);
  const double kl = dl / sl, kc = dc / sc, kh = dh / sh;
  return std::sqrt(std::max(0.0, kl * kl + kc * kc + kh * kh + rt * kc * kh));
}

}  // namespace tessera::ocio
