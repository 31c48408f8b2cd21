// The filters of resampling by their formulas, and how far they reach.
#ifndef TESSERA_REFERENCE_RESAMPLE_FILTERS_H_
#define TESSERA_REFERENCE_RESAMPLE_FILTERS_H_

#include <cmath>
#include <string>

namespace tessera::reference::filters {

inline constexpr double kPi = 3.14159265358979323846;

struct Kernel {
  double radius = 0;
  bool radial = false;
};

inline Kernel KernelOf(const std::string& name) {
  if (name == "box") return {0.5};
  if (name == "disk") return {0.5, true};
  if (name == "triangle" || name == "linear" || name == "sharp-gaussian") return {1};
  if (name == "gaussian" || name == "blackman-harris") return {1.5};
  if (name == "lanczos3" || name == "lanczos") return {3};
  if (name == "radial-lanczos3") return {3, true};
  return {2};
}

inline double SineOver(double x) {
  if (x == 0) return 1;
  if (x == std::floor(x)) return 0;
  return std::sin(kPi * x) / (kPi * x);
}

inline double Polynomial(double x, double a3, double a2, double a1, double a0) {
  return a3 * x * x * x + a2 * x * x + a1 * x + a0;
}

// Reconstruction Filters in Computer Graphics, Mitchell and Netravali 1988, equation 8.
inline double TwoParameterCubic(double x, double b, double c) {
  if (x < 1) return Polynomial(x, 12 - 9 * b - 6 * c, -18 + 12 * b + 6 * c, 0, 6 - 2 * b) / 6;
  return Polynomial(x, -b - 6 * c, 6 * b + 30 * c, -12 * b - 48 * c, 8 * b + 24 * c) / 6;
}

// Keys' cubic convolution with the slope a.
inline double KeysCubic(double x, double a) {
  if (x < 1) return Polynomial(x, a + 2, -(a + 3), 0, 1);
  return Polynomial(x, a, -5 * a, 8 * a, -4 * a);
}

inline double Value(const std::string& name, double distance) {
  const double x = std::fabs(distance), radius = KernelOf(name).radius;
  // At the very edge of its support, however the distance was rounded, a pixel counts for a box and for
  // Blackman-Harris, which is 6e-5 there, and for no other filter that ends abruptly.
  constexpr double kEdge = 0x1p-40;
  if (name == "box") return x <= 0.5 * (1 + kEdge) ? 1 : 0;
  const bool abrupt = name == "gaussian" || name == "sharp-gaussian" || name == "disk";
  if (x >= radius * (abrupt ? 1 - kEdge : 1) && !(name == "blackman-harris" && x < radius + 1e-9)) return 0;
  if (name == "disk") return 1;
  if (name == "triangle" || name == "linear") return 1 - x;
  if (name == "gaussian") return std::exp(-2 * (x / 1.5) * (x / 1.5));
  if (name == "sharp-gaussian") return std::exp(-4 * x * x);
  if (name == "blackman-harris") {
    const double t = (x / 1.5 + 1) / 2;
    return 0.35875 - 0.48829 * std::cos(2 * kPi * t) + 0.14128 * std::cos(4 * kPi * t) -
           0.01168 * std::cos(6 * kPi * t);
  }
  if (name == "sinc") return SineOver(x);
  if (name == "lanczos3" || name == "lanczos" || name == "radial-lanczos3")
    return SineOver(x) * SineOver(x / 3);
  if (name == "mitchell") return TwoParameterCubic(x, 1.0 / 3, 1.0 / 3);
  if (name == "bspline" || name == "b-spline") return TwoParameterCubic(x, 1, 0);
  if (name == "cubic") return KeysCubic(x, 0);
  if (name == "simon") return KeysCubic(x, -0.75);
  if (name == "rifman") return KeysCubic(x, -1);
  return KeysCubic(x, -0.5);  // keys, catmull-rom
}

}  // namespace tessera::reference::filters

#endif  // TESSERA_REFERENCE_RESAMPLE_FILTERS_H_
