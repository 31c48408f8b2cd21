// The table of methods.
#include "ops/filter/window/methods.h"

#include <algorithm>
#include <cmath>

namespace tessera::ops {
namespace {

using Shape = WindowShape;

bool Never(const Shape&) { return false; }
double None(const Shape&) { return 0; }

// Small squares without holes are loops without ends.
double DirectCost(const Shape& s) {
  const bool unrolled =
      s.width == s.height && s.width % 2 == 1 && s.width <= 9 && s.taps == s.width * s.height;
  return 4 + (unrolled ? 1 : 1.6) * s.taps;
}
// Columns and rows are moved through L1 once more.
double ProductCost(const Shape& s) { return 4 + 1.2 * s.products * (s.width + s.height + 4); }

// A weight is rounded to the second nearest float at most, a product where there is no fused one, a
// difference where those are summed, and every addition but the first. Columns are added in four groups, one
// tap after the other, and the groups then.
int Groups(const Shape& s) { return (s.width + 3) / 4; }
double DirectRoundings(const Shape& s) {
  return 3.0 + double{1} * Groups(s) * s.height + std::min(3, s.width - 1);
}
// Of both weights; pairs that share a weight are added first, and products come one after the other.
double ProductRoundings(const Shape& s) { return 8.0 + s.height + Groups(s) + s.products; }
// Adds in a tree; what a block's other samples bring in is not among them.
double TreeRoundings(const Shape& s) { return 2 + std::log2(double{1} * s.width * s.height); }

constexpr int kLargestSummedBox = 9;
// Sums of all weights cost more than a recursion beyond this; its poles are fitted to a continuous Gaussian,
// of which smaller ones have too few samples.
constexpr double kLargestSummedSigma = 3, kLeastRecursiveSigma = 2, kLeastDecimatedSigma = 16;

constexpr MethodRow kMethods[] = {
    {FilterMethod::kAuto, "auto", "", Never, None, None, nullptr},
    {FilterMethod::kDirect, "direct", "direct", [](const Shape& s) { return s.of == Shape::kKernel; },
     DirectCost, DirectRoundings, nullptr},
    {FilterMethod::kSeparable, "separable", "summed",
     [](const Shape& s) { return s.of != Shape::kKernel || (s.met && s.products == 1); },
     [](const Shape& s) {
       return s.of == Shape::kKernel ? ProductCost(s)
              : s.of == Shape::kBox  ? std::max(s.width, s.height)
                                     : s.sigma;
     },
     ProductRoundings, "1e-6"},
    {FilterMethod::kLowRank, "lowrank", "summed",
     [](const Shape& s) { return s.of == Shape::kKernel && s.met && s.products > 1; }, ProductCost,
     ProductRoundings, nullptr},
    {FilterMethod::kFft, "fft", "by transforms", [](const Shape& s) { return s.of == Shape::kKernel; },
     [](const Shape& s) { return 110 * (1 + std::max(s.width, s.height) / 90.0); }, TreeRoundings, nullptr},
    {FilterMethod::kRecursive, "recursive", "recursive",
     [](const Shape& s) {
       return s.of == Shape::kBox || (s.of == Shape::kGaussian && s.least_sigma >= kLeastRecursiveSigma);
     },
     [](const Shape& s) { return s.of == Shape::kBox ? double{kLargestSummedBox} : kLargestSummedSigma; },
     None, "2e-5"},
    {FilterMethod::kDecimated, "decimated", "at a quarter of the resolution",
     [](const Shape& s) {
       return s.of == Shape::kGaussian && s.both_axes && s.least_sigma >= kLeastDecimatedSigma &&
              !s.renormalizes;
     },
     [](const Shape&) { return kLargestSummedSigma / 3; }, None, "1e-4"},
};

}  // namespace

std::span<const MethodRow> Methods() { return kMethods; }

const MethodRow& MethodOf(FilterMethod method) {
  return *std::find_if(std::begin(kMethods), std::end(kMethods),
                       [&](const MethodRow& row) { return row.method == method; });
}

FilterMethod CheapestMethod(const WindowShape& shape) {
  const MethodRow* best = nullptr;
  for (const MethodRow& row : kMethods) {
    if (row.suits(shape) && (best == nullptr || row.cost(shape) < best->cost(shape))) best = &row;
  }
  return best->method;
}

}  // namespace tessera::ops
