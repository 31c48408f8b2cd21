// A kernel's method and weights, and the region that it needs.
#include "ops/filter/window/window.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <span>
#include <utility>

#include "base/border.h"
#include "ops/filter/codes/code_sums.h"
#include "ops/filter/fir/fir.h"
#include "ops/filter/window/methods.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

constexpr int kLargest = 255;
constexpr int kMostTerms = 8;  // that are looked for where nobody asked for products

// The weight that differences are taken from: the nearest to the anchor.
void Centre(const Kernel& k, const std::vector<double>& weights, DirectWindow& window) {
  window.centered = true;
  int nearest = 1 << 30;
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x) {
      const int distance = (x - k.anchor_x) * (x - k.anchor_x) + (y - k.anchor_y) * (y - k.anchor_y);
      if (weights[static_cast<size_t>(y * k.width + x)] == 0 || distance >= nearest) continue;
      nearest = distance;
      window.center_x = x, window.center_y = y;
    }
  }
}

}  // namespace

Roi OutputWindow(const Roi& window, const Kernel& k, Wrap wrap) {
  if (wrap != Wrap::kValid) return window;
  const Roi inside{window.x0 + k.anchor_x, window.y0 + k.anchor_y, window.x1 - (k.width - 1 - k.anchor_x),
                   window.y1 - (k.height - 1 - k.anchor_y)};
  return inside.empty() ? Roi{} : inside;
}

Kernel Reversed(const Kernel& kernel) {
  Kernel reversed = kernel;
  const auto area = static_cast<ptrdiff_t>(kernel.width) * kernel.height;
  for (int p = 0; p < kernel.planes; ++p) {
    std::reverse(reversed.weights.begin() + p * area, reversed.weights.begin() + (p + 1) * area);
  }
  reversed.anchor_x = kernel.width - 1 - kernel.anchor_x;
  reversed.anchor_y = kernel.height - 1 - kernel.anchor_y;
  return reversed;
}

void RequireKernel(const std::string& op, const Kernel& k) {
  const std::string size = std::to_string(k.width) + "x" + std::to_string(k.height);
  if (k.width < 1 || k.height < 1 || k.width > kLargest || k.height > kLargest) {
    throw Error(op, "found a kernel of " + size + ", expected 1x1 to 255x255");
  }
  if (k.planes < 1 || k.weights.size() != static_cast<size_t>(k.planes) * k.width * k.height) {
    throw Error(op, "found " + std::to_string(k.weights.size()) + " weights, expected " + size + " times " +
                        std::to_string(k.planes));
  }
  if (k.anchor_x < 0 || k.anchor_y < 0 || k.anchor_x >= k.width || k.anchor_y >= k.height) {
    throw Error(op, "found the anchor " + std::to_string(k.anchor_x) + "," + std::to_string(k.anchor_y) +
                        ", expected it inside the kernel of " + size);
  }
  for (const double w : k.weights) {
    if (!std::isfinite(w) || std::fabs(w) > 3e38) {
      throw Error(op, "found a weight that is not a finite float, expected finite weights");
    }
  }
}

Window::Window(const std::string& op, const Kernel& kernel, const WindowOptions& options)
    : options_(options),
      kernel_(kernel),
      width_(kernel.width),
      height_(kernel.height),
      anchor_x_(kernel.anchor_x),
      anchor_y_(kernel.anchor_y) {
  RequireKernel(op, kernel);
  Choose(op);
}

Window::Window(const std::vector<double>& row, int left, const std::vector<double>& column, int top,
               const WindowOptions& options)
    : options_(options),
      method_(FilterMethod::kSeparable),
      width_(static_cast<int>(row.size())),
      height_(static_cast<int>(column.size())),
      anchor_x_(left),
      anchor_y_(top),
      terms_(1) {
  const auto summed = [](const std::vector<double>& weights) {
    std::vector<double> sums(1, 0);
    for (const double w : weights) sums.push_back(sums.back() + w);
    return sums;
  };
  Plane plane;
  plane.products = {{column, row}};
  plane.row_sums = summed(row), plane.column_sums = summed(column);
  kernel_.weights.clear();
  if (width_ <= kLargest && height_ <= kLargest) {
    kernel_ = {width_, height_, left, top, 1, {}};
    for (const double c : column) {
      for (const double r : row) kernel_.weights.push_back(c * r);
    }
    plane.weights = kernel_.weights;
  }
  planes_.push_back(std::move(plane));
}

void Window::Choose(const std::string& op) {
  const FilterMethod wanted = options_.method;
  if (wanted == FilterMethod::kRecursive || wanted == FilterMethod::kDecimated) {
    throw Error(op, "found method=" + std::string(MethodOf(wanted).name) +
                        ", expected auto, direct, separable, lowrank or fft: blurs by a Gaussian or a box "
                        "(--blur) have further ones");
  }
  const auto nonzero =
      std::count_if(kernel_.weights.begin(), kernel_.weights.end(), [](double w) { return w != 0; });
  // Products cover whole rectangles: where a weight is 0 they would let a NaN through.
  WindowShape shape{.width = width_, .height = height_, .met = nonzero == std::ssize(kernel_.weights)};
  shape.taps = static_cast<double>(nonzero) / kernel_.planes;
  bool factored = true;
  const auto area = static_cast<ptrdiff_t>(width_) * height_;
  for (int p = 0; p < kernel_.planes; ++p) {
    const int most = wanted == FilterMethod::kSeparable ? 1
                     : wanted == FilterMethod::kLowRank ? std::min(width_, height_)
                                                        : kMostTerms;
    Factors f = Factorize(kernel_, p, most);
    factored = factored && !f.terms.empty();
    shape.met = shape.met && f.elementwise;
    shape.products = std::max(shape.products, static_cast<int>(f.terms.size()));
    truncation_ = std::max(truncation_, f.residual);
    const auto first = kernel_.weights.begin() + p * area;
    Plane plane;
    plane.weights.assign(first, first + area), plane.products = std::move(f.terms);
    planes_.push_back(std::move(plane));
  }
  shape.met = shape.met && factored;
  method_ = wanted == FilterMethod::kAuto ? CheapestMethod(shape) : wanted;
  // A kernel image's pixels are not there yet where --explain sees it: all are zeros.
  if ((wanted == FilterMethod::kSeparable && nonzero == 0) || (wanted == FilterMethod::kLowRank && !factored))
    method_ = FilterMethod::kDirect;
  if (method_ == FilterMethod::kSeparable && !MethodOf(method_).suits(shape)) {
    throw Error(op,
                "found method=separable with a kernel that is no product of a column and a row without "
                "zeros, expected one, or method=lowrank or direct");
  }
  const bool products = method_ == FilterMethod::kSeparable || method_ == FilterMethod::kLowRank;
  terms_ = products ? shape.products : 0;
  if (!products) truncation_ = 0;
  for (Plane& plane : planes_) {
    if (!products) plane.products.clear();
    if (method_ == FilterMethod::kFft) plane.fft = MakeFftKernel(width_, height_, plane.weights);
    if (!TreatsEdges()) continue;
    const auto w = static_cast<size_t>(width_) + 1;
    plane.sums.assign(w * (static_cast<size_t>(height_) + 1), 0);
    for (size_t y = 0; y < static_cast<size_t>(height_); ++y) {
      for (size_t x = 0; x < w - 1; ++x) {
        plane.sums[(y + 1) * w + x + 1] = plane.weights[y * (w - 1) + x] + plane.sums[y * w + x + 1] +
                                          plane.sums[(y + 1) * w + x] - plane.sums[y * w + x];
      }
    }
  }
}

std::unique_ptr<const WindowSums> Window::MakeFloatSums(const Plane& plane) const {
  if (plane.products.empty()) {
    DirectWindow window = MakeDirectWindow(width_, height_, RoundWeights(plane.weights));
    double sum = 0, magnitude = 0;
    for (const double w : plane.weights) sum += w, magnitude += std::fabs(w);
    // A small zero-sum kernel answers to differences only: flat images give exactly 0.
    if (magnitude > 0 && std::fabs(sum) < 1e-12 * magnitude && plane.weights.size() <= 25)
      Centre(kernel_, plane.weights, window);
    return MakeDirectSums(window);
  }
  SeparableWindow window{width_, height_, {}};
  for (const Product& p : plane.products)
    window.terms.push_back({RoundWeights(p.column), RoundWeights(p.row)});
  return MakeSeparableSums(window);
}

bool Window::SumsCodes(PixelType type) const {
  if (options_.bias != 0 || TreatsEdges()) return false;
  // Of bytes few float results are near a tie.
  constexpr double kMostTapsOfBytes = 81;
  return type == PixelType::kUint16 || (type == PixelType::kUint8 && (method_ == FilterMethod::kSeparable ||
                                                                      width_ * height_ <= kMostTapsOfBytes));
}

std::unique_ptr<const WindowSums> Window::MakeSums(int plane, PixelType type) const {
  const Plane& p = planes_[static_cast<size_t>(plane)];
  if (!SumsCodes(type)) return MakeFloatSums(p);
  CodeKernel kernel;
  kernel.width = width_, kernel.height = height_, kernel.weights = p.weights;
  kernel.by_columns = !p.products.empty(), kernel.error = ErrorBound();
  if (method_ == FilterMethod::kSeparable)
    kernel.column = p.products[0].column, kernel.row = p.products[0].row;
  return MakeCodeSums(type, kernel, MakeFloatSums(p));
}

double Window::ErrorBound() const {
  const WindowShape shape{.width = width_, .height = height_, .products = terms_};
  const double roundings = MethodOf(method_).roundings(shape),
               largest = std::max(1.0, std::fabs(options_.border_value));
  const auto size_of = [](const std::vector<double>& weights) {
    return std::accumulate(weights.begin(), weights.end(), 0.0,
                           [](double s, double w) { return s + std::fabs(w); });
  };
  double error = 0;
  for (const Plane& plane : planes_) {
    double size = plane.products.empty() ? size_of(plane.weights) : 0;
    for (const Product& p : plane.products) size += size_of(p.column) * size_of(p.row);
    const double squares =
        std::inner_product(plane.weights.begin(), plane.weights.end(), plane.weights.begin(), 0.0);
    // Deviations from a block's mean are at most half the range.
    error = std::max(error, roundings * size + plane.fft.size * 8.0 * std::sqrt(squares));
  }
  return (error * 0x1p-24 + truncation_) * largest;
}

Roi Window::WholeBlocks(const Roi& out, const Roi& data_window) const {
  const FftKernel& fft = planes_[0].fft;
  const auto down = [](int v, int origin, int step) { return origin + (v - origin) / step * step; };
  const auto up = [&](int v, int origin, int step) { return down(v + step - 1, origin, step); };
  return {down(out.x0, data_window.x0, fft.step_x()), down(out.y0, data_window.y0, fft.step_y()),
          up(out.x1, data_window.x0, fft.step_x()), up(out.y1, data_window.y0, fft.step_y())};
}

graph::TileSize Window::PreferredTile(bool alone) const {
  if (method_ == FilterMethod::kFft) {
    const FftKernel& fft = planes_[0].fft;
    return {std::max(1, 512 / fft.size) * fft.step_x(), fft.step_y()};
  }
  // Long rows suit the prefetcher; borders are extended here and not by the engine, so edges cost little.
  // Of a product, taller ones bring fewer rows twice. Small windows wait for memory, and there whole rows are
  // fastest; five of them fit a second cache of 512 KB.
  constexpr int kSmall = 3, kWideRow = 4096;
  if (alone && method_ == FilterMethod::kDirect && std::max(width_, height_) <= kSmall) return {kWideRow, 32};
  return {960, method_ == FilterMethod::kSeparable ? 64 : 32};
}

Roi Window::InputRoi(const Roi& out, const Roi& data_window) const {
  const Roi region = method_ == FilterMethod::kFft && !out.empty() ? WholeBlocks(out, data_window) : out;
  return base::BorderSource(Footprint(region), data_window, options_.wrap);
}

Roi Window::Footprint(const Roi& out) const {
  return {out.x0 - anchor_x_, out.y0 - anchor_y_, out.x1 + (width_ - 1 - anchor_x_),
          out.y1 + (height_ - 1 - anchor_y_)};
}

Roi Window::Inner(const Roi& out, const Roi& data_window) const {
  const Roi inner = Intersection(
      out, {data_window.x0 + anchor_x_, data_window.y0 + anchor_y_, data_window.x1 - (width_ - 1 - anchor_x_),
            data_window.y1 - (height_ - 1 - anchor_y_)});
  return inner.empty() ? Roi{out.x0, out.y1, out.x0, out.y1} : inner;
}

double Window::SumTo(const Plane& plane, int x, int y) const {
  const auto i = static_cast<size_t>(x), j = static_cast<size_t>(y);
  if (plane.sums.empty()) return plane.row_sums[i] * plane.column_sums[j];
  return plane.sums[j * (static_cast<size_t>(width_) + 1) + i];
}
double Window::WeightOf(int plane) const {
  return SumTo(planes_[static_cast<size_t>(plane)], width_, height_);
}
double Window::WeightInside(int plane, const Roi& window, int x, int y) const {
  const Plane& p = planes_[static_cast<size_t>(plane)];
  const int x0 = std::clamp(window.x0 - (x - anchor_x_), 0, width_),
            x1 = std::clamp(window.x1 - (x - anchor_x_), x0, width_);
  const int y0 = std::clamp(window.y0 - (y - anchor_y_), 0, height_),
            y1 = std::clamp(window.y1 - (y - anchor_y_), y0, height_);
  return SumTo(p, x1, y1) - SumTo(p, x0, y1) - SumTo(p, x1, y0) + SumTo(p, x0, y0);
}

std::string Window::Describe() const {
  const std::string size = std::to_string(width_) + "x" + std::to_string(height_);
  switch (method_) {
    case FilterMethod::kLowRank: {
      char bound[32];
      std::snprintf(bound, sizeof bound, "%.1e", truncation_);
      return size + " as " + std::to_string(terms_) + " separable terms, truncated by at most " + bound +
             " of the largest sample";
    }
    case FilterMethod::kFft:
      return size + " by transforms of " + std::to_string(planes_[0].fft.size) + "x" +
             std::to_string(planes_[0].fft.size);
    default:
      return size + " " + MethodOf(method_).name;
  }
}

}  // namespace tessera::ops
