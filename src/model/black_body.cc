// Light of black bodies.
#include "model/black_body.h"

#include <algorithm>
#include <cmath>

namespace tessera::model {
namespace {

// A bell whose sides are of different widths, nanometres.
double Bell(double at, double middle, double below, double above) {
  const double t = (at - middle) / (at < middle ? below : above);
  return std::exp(-0.5 * t * t);
}

}  // namespace

std::array<double, 2> BlackBodyUv(double t) {
  return {(0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t) /
              (1 + 8.42420235e-4 * t + 7.08145163e-7 * t * t),
          (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t) /
              (1 - 2.89741816e-5 * t + 1.61456053e-7 * t * t)};
}

double BlackBodyLuminance(double kelvin) {
  constexpr double kSecond = 1.438776877e7;  // the second radiation constant, nanometres times kelvin
  double sum = 0;
  for (int nanometres = 360; nanometres <= 830; nanometres += 5) {
    const double l = nanometres;
    const double efficiency = 0.821 * Bell(l, 568.8, 46.9, 40.5) + 0.286 * Bell(l, 530.9, 16.3, 31.1);
    sum += efficiency / (std::pow(l / 560, 5) * std::expm1(kSecond / (l * kelvin)));
  }
  return sum;
}

std::array<double, 3> BlackBodyColor(double kelvin) {
  const auto [u, v] = BlackBodyUv(kelvin);
  const double below = 2 * u - 8 * v + 4, x = 3 * u / below, y = 2 * v / below;
  const double xyz[3] = {x / y, 1, (1 - x - y) / y};
  // XYZ to R, G, B of BT.709 2015, white D65.
  constexpr double kRows[3][3] = {{3.2409699419045226, -1.5373831775700940, -0.4986107602930034},
                                  {-0.9692436362808796, 1.8759675015077202, 0.0415550574071756},
                                  {0.0556300796969936, -0.2039769588889765, 1.0569715142428786}};
  std::array<double, 3> rgb;
  for (size_t c = 0; c < 3; ++c)
    rgb[c] = std::max(0.0, kRows[c][0] * xyz[0] + kRows[c][1] * xyz[1] + kRows[c][2] * xyz[2]);
  return rgb;
}

}  // namespace tessera::model
