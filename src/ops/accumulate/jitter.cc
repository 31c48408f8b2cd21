// Sample positions within a pixel: the course notes' sets, and lattices for every other count.
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "tessera/error.h"
#include "tessera/ops/accumulate.h"

namespace tessera {
namespace {

constexpr int kMost = 65536;

// Advanced Graphics Programming Techniques Using OpenGL, table 2.
const std::vector<JitterPoint>* CourseSet(int count) {
  static const std::vector<JitterPoint> kSets[] = {
      {{.25, .75}, {.75, .25}},
      {{.5033922635, .8317967229}, {.7806016275, .2504380877}, {.2261828938, .4131553612}},
      {{.375, .25}, {.125, .75}, {.875, .25}, {.625, .75}},
      {{.5, .5}, {.3, .1}, {.7, .9}, {.9, .3}, {.1, .7}},
      {{.4646464646, .4646464646},
       {.1313131313, .7979797979},
       {.5353535353, .8686868686},
       {.8686868686, .5353535353},
       {.7979797979, .1313131313},
       {.2020202020, .2020202020}},
      {{.5625, .4375},
       {.0625, .9375},
       {.3125, .6875},
       {.6875, .8125},
       {.8125, .1875},
       {.9375, .5625},
       {.4375, .0625},
       {.1875, .3125}},
      {{.5, .5},
       {1. / 6, 17. / 18},
       {.5, 1. / 6},
       {.5, 5. / 6},
       {1. / 6, 5. / 18},
       {5. / 6, 7. / 18},
       {1. / 6, 11. / 18},
       {5. / 6, 13. / 18},
       {5. / 6, 1. / 18}},
      {{5. / 12, .625},
       {11. / 12, .875},
       {.25, .375},
       {5. / 12, .125},
       {.75, .125},
       {1. / 12, .125},
       {.75, .625},
       {.25, .875},
       {7. / 12, .375},
       {11. / 12, .375},
       {1. / 12, .625},
       {7. / 12, .875}},
      {{.375, .4375},
       {.625, .0625},
       {.875, .1875},
       {.125, .0625},
       {.375, .6875},
       {.875, .4375},
       {.625, .5625},
       {.375, .9375},
       {.625, .3125},
       {.125, .5625},
       {.125, .8125},
       {.375, .1875},
       {.875, .9375},
       {.875, .6875},
       {.125, .3125},
       {.625, .8125}},
  };
  for (const std::vector<JitterPoint>& set : kSets) {
    if (static_cast<int>(set.size()) == count) return &set;
  }
  return nullptr;
}

// The squared smallest distance on the torus between points (i, i g mod n), in units of 1/n. The shortest
// vector of the lattice, found by Gauss' reduction of the basis (1, g), (0, n).
int64_t SmallestDistance(int64_t g, int64_t n) {
  std::array<int64_t, 2> a = {1, g}, b = {0, n};
  const auto dot = [](const auto& p, const auto& q) { return p[0] * q[0] + p[1] * q[1]; };
  for (;;) {
    if (dot(a, a) > dot(b, b)) std::swap(a, b);
    const auto m =
        static_cast<int64_t>(std::llround(static_cast<double>(dot(a, b)) / static_cast<double>(dot(a, a))));
    const std::array<int64_t, 2> shorter = {b[0] - m * a[0], b[1] - m * a[1]};
    if (dot(shorter, shorter) >= dot(b, b)) return dot(a, a);
    b = shorter;
  }
}

}  // namespace

std::vector<JitterPoint> JitterSet(int count) {
  if (count < 1 || count > kMost) {
    throw Error("jitter",
                "found a count of " + std::to_string(count) + ", expected 1 to " + std::to_string(kMost));
  }
  if (const std::vector<JitterPoint>* const set = CourseSet(count)) return *set;
  int64_t best = 1, widest = -1;
  for (int64_t g = 1; g <= count / 2 + 1; ++g) {
    if (std::gcd(g, static_cast<int64_t>(count)) != 1) continue;
    const int64_t distance = SmallestDistance(g, count);
    if (distance > widest) widest = distance, best = g;
  }
  std::vector<JitterPoint> points;
  for (int64_t i = 0; i < count; ++i) {
    points.push_back(
        {(static_cast<double>(i) + 0.5) / count, (static_cast<double>(i * best % count) + 0.5) / count});
  }
  return points;
}

}  // namespace tessera
