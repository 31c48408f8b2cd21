// Filter formulas, and weights of an axis.
#include "ops/geometry/filters.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ops/registry.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

constexpr double kPi = std::numbers::pi;

// Exactly 0 at whole distances, so that whole shifts keep bits.
double Sinc(double x) {
  if (std::fabs(x) < 1e-9) return 1;
  return x == std::round(x) ? 0 : std::sin(kPi * x) / (kPi * x);
}

// Filters that end abruptly: a pixel at their very edge counts or does not, however its distance was rounded.
constexpr double kIncluded = 1 + FilterKernel::kEdge, kExcluded = 1 - FilterKernel::kEdge;

double Box(double x) { return std::fabs(x) <= 0.5 * kIncluded ? 1 : 0; }
double Triangle(double x) { return std::max(0.0, 1 - std::fabs(x)); }
double Gaussian(double x) { return std::fabs(x) < 1.5 * kExcluded ? std::exp(-2 * x * x / 2.25) : 0; }
double SharpGaussian(double x) { return std::fabs(x) < kExcluded ? std::exp(-4 * x * x) : 0; }
// 6e-5 at its very edge, not 0: a pixel there counts, however its distance was rounded.
double BlackmanHarris(double x) {
  if (std::fabs(x) > 1.5 + 1e-9) return 0;
  const double c = std::cos(2 * kPi * x / 3), c2 = 2 * c * c - 1, c3 = c * (2 * c2 - 1);
  return 0.35875 + 0.48829 * c + 0.14128 * c2 + 0.01168 * c3;
}
double Sinc2(double x) { return std::fabs(x) <= 2 ? Sinc(x) : 0; }
double Lanczos3(double x) { return std::fabs(x) < 3 ? Sinc(x) * Sinc(x / 3) : 0; }

// The two-parameter cubic of Mitchell and Netravali.
template <int b3, int c6>  // B = b3 / 3, C = c6 / 6
double MitchellNetravali(double x) {
  constexpr double kB = b3 / 3.0, kC = c6 / 6.0;
  const double a = std::fabs(x);
  if (a >= 2) return 0;
  if (a >= 1)
    return (((-kB - 6 * kC) * a + 6 * kB + 30 * kC) * a - 12 * kB - 48 * kC) * a / 6 + (8 * kB + 24 * kC) / 6;
  return ((12 - 9 * kB - 6 * kC) * a - 18 + 12 * kB + 6 * kC) * a * a / 6 + (6 - 2 * kB) / 6;
}
// The interpolating cubic with slope -slope4 / 4 at distance 1.
template <int slope4>
double InterpolatingCubic(double x) {
  constexpr double kA = -slope4 / 4.0;
  const double a = std::fabs(x);
  if (a >= 2) return 0;
  if (a >= 1) return kA * (((a - 5) * a + 8) * a - 4);
  return ((kA + 2) * a - kA - 3) * a * a + 1;
}
double Disk(double radius) { return radius < 0.5 * kExcluded ? 1 : 0; }

constexpr FilterKernel kFilters[] = {
    {"box", 1, Box},
    {"triangle", 2, Triangle},
    {"linear", 2, Triangle},
    {"gaussian", 3, Gaussian},
    {"sharp-gaussian", 2, SharpGaussian},
    {"catmull-rom", 4, InterpolatingCubic<2>},
    {"catrom", 4, InterpolatingCubic<2>},
    {"blackman-harris", 3, BlackmanHarris},
    {"sinc", 4, Sinc2},
    {"lanczos3", 6, Lanczos3},
    {"lanczos", 6, Lanczos3},
    {"radial-lanczos3", 6, Lanczos3, false},
    {"mitchell", 4, MitchellNetravali<1, 2>},
    {"bspline", 4, MitchellNetravali<3, 0>},
    {"b-spline", 4, MitchellNetravali<3, 0>},
    {"disk", 1, Disk, false},
    {"cubic", 4, InterpolatingCubic<0>},
    {"keys", 4, InterpolatingCubic<2>},
    {"simon", 4, InterpolatingCubic<3>},
    {"rifman", 4, InterpolatingCubic<4>},
};

// Whether result k takes `count` pixels with equal weights from the first one's + k * count on.
bool AreMeans(const AxisTaps& taps, int count) {
  for (size_t k = 0; k < taps.first.size(); ++k) {
    const double* const w = taps.weights.data() + taps.offset[k];
    if (taps.count[k] != count || taps.first[k] != taps.first[0] + count * static_cast<int>(k) ||
        !std::all_of(w, w + count, [&](double v) { return v == 1.0 / count; })) {
      return false;
    }
  }
  return !taps.first.empty();
}

}  // namespace

const FilterKernel& FindFilter(const std::string& subject, const std::string& name) {
  for (const FilterKernel& f : kFilters) {
    if (f.name == name) return f;
  }
  const std::string near = Nearest(name, FilterNames());
  std::string known;
  for (const FilterKernel& f : kFilters) known += std::string(known.empty() ? "" : ", ") + f.name;
  throw Error(subject, "found the filter \"" + name + "\", expected " +
                           (near.empty() ? "one of " + known : "one like " + near));
}

std::vector<std::string> FilterNames() {
  std::vector<std::string> names;
  for (const FilterKernel& f : kFilters) names.emplace_back(f.name);
  return names;
}

void AxisTaps::Range(int i0, int i1, int* s0, int* s1) const {
  if ((halves || moves) && i0 < i1) {
    const int each = halves ? 2 : 1;
    *s0 = each * i0 + shift, *s1 = each * i1 + shift;
    return;
  }
  *s0 = INT32_MAX, *s1 = INT32_MIN;
  for (int i = i0; i < i1; ++i) {
    if (Count(i) == 0) continue;
    *s0 = std::min(*s0, First(i));
    *s1 = std::max(*s1, First(i) + Count(i));
  }
  if (*s1 < *s0) *s0 = *s1 = 0;
}

AxisTaps MakeAxisTaps(const AxisMap& map, const FilterKernel& filter, Wrap wrap) {
  AxisTaps taps;
  taps.begin = map.out0;
  const double radius = filter.width / 2 / map.scale;
  const int size = map.source1 - map.source0;
  std::vector<double> w;
  for (int i = map.out0; i < map.out1; ++i) {
    double centre = map.origin + (i + 0.5) * map.step - 0.5;  // in source indices
    // A millionth of a pixel off a centre or an edge is there: whole shifts keep their bits.
    if (const double near = std::round(2 * centre) / 2; std::fabs(centre - near) < 0x1p-20) centre = near;
    int first = static_cast<int>(std::clamp(std::ceil(centre - radius - 1e-9), -2147483000.0, 2147483000.0));
    const int last =
        static_cast<int>(std::clamp(std::floor(centre + radius + 1e-9), -2147483000.0, 2147483000.0));
    w.clear();
    double sum = 0;
    for (int64_t j = first; j <= last; ++j) {
      w.push_back(filter.value((static_cast<double>(j) - centre) * map.scale));
      sum += w.back();
    }
    if (sum == 0) w.clear();
    for (double& v : w) v /= sum;
    if ((wrap == Wrap::kClamp || wrap == Wrap::kBlack) && size > 0 && !w.empty()) {
      const int64_t lo = std::clamp<int64_t>(first, map.source0, map.source1 - 1);
      const int64_t hi =
          std::clamp<int64_t>(first + static_cast<int64_t>(w.size()) - 1, map.source0, map.source1 - 1);
      std::vector<double> inside(static_cast<size_t>(hi - lo + 1));
      for (size_t k = 0; k < w.size(); ++k) {
        const int64_t j = first + static_cast<int64_t>(k),
                      at = std::clamp<int64_t>(j, map.source0, map.source1 - 1);
        if (j == at || wrap == Wrap::kClamp) inside[static_cast<size_t>(at - lo)] += w[k];
      }
      w = std::move(inside);
      first = static_cast<int>(lo);
    }
    size_t skip = 0;
    while (skip < w.size() && w[skip] == 0) ++skip;
    w.erase(w.begin(), w.begin() + static_cast<ptrdiff_t>(skip));
    while (!w.empty() && w.back() == 0) w.pop_back();
    taps.first.push_back(w.empty() ? map.source0 : first + static_cast<int>(skip));
    taps.count.push_back(static_cast<int>(w.size()));
    taps.offset.push_back(static_cast<int64_t>(taps.weights.size()));
    taps.weights.insert(taps.weights.end(), w.begin(), w.end());
  }
  taps.halves = AreMeans(taps, 2);
  taps.moves = AreMeans(taps, 1);
  if (taps.halves || taps.moves) taps.shift = taps.first[0] - (taps.halves ? 2 : 1) * taps.begin;
  return taps;
}

}  // namespace tessera::ops
