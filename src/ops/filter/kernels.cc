// Kernels by name: the papers' tables, and the continuous filters that oiiotool's --kernel samples.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "base/number_text.h"
#include "ops/filter/filter_ops.h"
#include "ops/geometry/filters.h"
#include "ops/registry.h"
#include "tessera/error.h"
#include "tessera/ops/filter.h"

namespace tessera {
namespace {

struct TableKernel {
  const char* name;
  int size;
  double divisor;
  std::array<double, 25> weights;
};
constexpr TableKernel kTable[] = {
    {"line_horizontal", 3, 1, {-1, -1, -1, 2, 2, 2, -1, -1, -1}},
    {"line_vertical", 3, 1, {-1, 2, -1, -1, 2, -1, -1, 2, -1}},
    {"line_left", 3, 1, {2, -1, -1, -1, 2, -1, -1, -1, 2}},
    {"line_right", 3, 1, {-1, -1, 2, -1, 2, -1, 2, -1, -1}},
    {"emboss_n", 3, 1, {-1, -2, -1, 0, 0, 0, 1, 2, 1}},
    {"emboss_s", 3, 1, {1, 2, 1, 0, 0, 0, -1, -2, -1}},
    {"emboss_w", 3, 1, {-1, 0, 1, -2, 0, 2, -1, 0, 1}},
    {"emboss_e", 3, 1, {1, 0, -1, 2, 0, -2, 1, 0, -1}},
    {"emboss_ne", 3, 1, {0, -1, -2, 1, 0, -1, 2, 1, 0}},
    {"emboss_nw", 3, 1, {-2, -1, 0, -1, 0, 1, 0, 1, 2}},
    {"emboss_se", 3, 1, {2, 1, 0, 1, 0, -1, 0, -1, -2}},
    {"emboss_sw", 3, 1, {0, 1, 2, -1, 0, 1, -2, -1, 0}},
    {"mean3", 3, 9, {1, 1, 1, 1, 1, 1, 1, 1, 1}},
    {"smooth3", 3, 16, {1, 2, 1, 2, 4, 2, 1, 2, 1}},
    {"smooth5", 5, 256, {1, 4, 6, 4, 1, 4, 16, 24, 16, 4, 6, 24, 36, 24, 6, 4, 16, 24, 16, 4, 1, 4, 6, 4, 1}},
    {"smooth5_course", 5, 60, {1, 1, 1, 1, 1, 1, 4, 4, 4, 1, 1, 4, 12, 4, 1, 1, 4, 4, 4, 1, 1, 1, 1, 1, 1}},
    {"highpass3", 3, 1, {-1, -1, -1, -1, 9, -1, -1, -1, -1}},
    // The scan's signs give a sum of -7; with the four edge midpoints turned the sum is 1.
    {"highpass5", 5, 1, {0,  -1, 1,  -1, 0,  -1, 2,  -4, 2,  -1, 1,  -4, 13,
                         -4, 1,  -1, 2,  -4, 2,  -1, 0,  -1, 1,  -1, 0}},
    {"highpass5_course", 5, 1, {0,  -1, -1, -1, 0,  -1, 2,  -4, 2,  -1, -1, -4, 13,
                                -4, -1, -1, 2,  -4, 2,  -1, 0,  -1, -1, -1, 0}},
    {"laplacian3", 3, 1, {0, -1, 0, -1, 4, -1, 0, -1, 0}},
    {"laplacian5", 5, 1, {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, 24,
                          -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1}},
    {"sobel_x", 3, 1, {-1, 0, 1, -2, 0, 2, -1, 0, 1}},
    {"sobel_y", 3, 1, {-1, -2, -1, 0, 0, 0, 1, 2, 1}},
    {"prewitt_x", 3, 1, {-1, 0, 1, -1, 0, 1, -1, 0, 1}},
    {"prewitt_y", 3, 1, {-1, -1, -1, 0, 0, 0, 1, 1, 1}},
    {"scharr_x", 3, 1, {-3, 0, 3, -10, 0, 10, -3, 0, 3}},
    {"scharr_y", 3, 1, {-3, -10, -3, 0, 0, 0, 3, 10, 3}},
};

// A reconstruction filter stretched to `width` pixels; the windowed sinc is cut off there instead, as
// oiiotool does.
double Stretched(const ops::FilterKernel& f, double x, double width) {
  if (std::string_view(f.name) != "sinc") return f.value(x * f.width / width);
  const double t = std::numbers::pi * x;
  // Its zeros are zeros, not what sin makes of a rounded pi: a border may renormalize by what it shows.
  if (std::fabs(x) > width / 2 || (x != 0 && x == std::floor(x))) return 0;
  return std::fabs(x) < 1e-4 ? 1 : std::sin(t) / t;
}

std::vector<double> Binomial(int count) {
  std::vector<double> row(static_cast<size_t>(count), 1);
  for (int i = 1; i < count; ++i)
    row[static_cast<size_t>(i)] = row[static_cast<size_t>(i) - 1] * (count - i) / i;
  return row;
}

int OddSize(double size) { return std::max(1, static_cast<int>(std::ceil(size))) | 1; }

Kernel Normalized(Kernel kernel) {
  double sum = 0;
  for (const double w : kernel.weights) sum += w;
  if (sum != 0) {
    for (double& w : kernel.weights) w /= sum;
  }
  return kernel;
}

// A kernel of odd size whose weights are f(x, y) at whole pixels from its centre.
template <class F>
Kernel Sampled(double width, double height, F f) {
  Kernel kernel;
  kernel.width = OddSize(width), kernel.height = OddSize(height);
  kernel.anchor_x = kernel.width / 2, kernel.anchor_y = kernel.height / 2;
  kernel.weights.clear();
  for (int y = 0; y < kernel.height; ++y) {
    for (int x = 0; x < kernel.width; ++x)
      kernel.weights.push_back(f(x - kernel.anchor_x, y - kernel.anchor_y));
  }
  return Normalized(std::move(kernel));
}

}  // namespace

std::vector<std::string> KernelNames() {
  std::vector<std::string> names;
  for (const TableKernel& k : kTable) names.push_back(k.name);
  for (const std::string& name : ops::FilterNames()) names.push_back(name);
  for (const char* name : {"binomial", "laplacian"}) names.emplace_back(name);
  return names;
}

Kernel NamedKernel(const std::string& name, double width, double height) {
  if (!(width > 0 && width <= 65535 && height > 0 && height <= 65535)) {
    throw Error("kernel " + name, "found a size of " + base::NumberText(width) + "x" +
                                      base::NumberText(height) + ", expected above 0 and up to 65535");
  }
  for (const TableKernel& k : kTable) {
    if (name != k.name) continue;
    Kernel kernel{k.size, k.size, k.size / 2, k.size / 2, 1, {}};
    for (int i = 0; i < k.size * k.size; ++i)
      kernel.weights.push_back(k.weights[static_cast<size_t>(i)] / k.divisor);
    return kernel;
  }
  if (OddSize(width) > 255 || OddSize(height) > 255) {
    throw Error("kernel " + name, "found a size of " + std::to_string(OddSize(width)) + "x" +
                                      std::to_string(OddSize(height)) + ", expected up to 255x255");
  }
  const std::vector<std::string> filters = ops::FilterNames();
  if (std::find(filters.begin(), filters.end(), name) != filters.end()) {
    const ops::FilterKernel& f = ops::FindFilter("kernel", name);
    return Sampled(width, height, [&](int x, int y) {
      if (f.separable) return Stretched(f, x, width) * Stretched(f, y, height);
      return f.value(f.width * std::hypot(x / width, y / height));
    });
  }
  if (name == "binomial") {
    const int w = OddSize(width), h = OddSize(height);
    const std::vector<double> row = Binomial(w), column = Binomial(h);
    return Sampled(w, h, [&](int x, int y) {
      return row[static_cast<size_t>(x + w / 2)] * column[static_cast<size_t>(y + h / 2)];
    });
  }
  if (name == "laplacian") {
    if (OddSize(width) != 3 || OddSize(height) != 3) {
      throw Error("kernel laplacian", "found a size other than 3x3, expected 3x3");
    }
    return {3, 3, 1, 1, 1, {0, 1, 0, 1, -4, 1, 0, 1, 0}};
  }
  const std::string nearest = ops::Nearest(name, KernelNames());
  throw Error("kernel", "found the unknown name '" + name + "', expected one of its names" +
                            (nearest.empty() ? std::string() : " (is '" + nearest + "' meant?)"));
}

Kernel NamedKernel(const std::string& name, const std::string& size) {
  const auto [width, height] = ops::ParseSize("kernel " + name, size);
  return NamedKernel(name, width, height);
}

}  // namespace tessera
