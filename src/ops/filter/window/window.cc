// Chooses a kernel's method by cost and prepares its weights.
#include "ops/filter/window/window.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <span>
#include <utility>

#include "graph/border.h"
#include "ops/filter/window/factor.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

constexpr int kLargest = 255;
// Cost in multiply-adds per sample, measured on RGBA: columns and rows are moved through L1 once more, and
// long sums of products soon cost as much as a transform.
double DirectCost(double taps, int width, int height) {
  const bool unrolled = width == height && width % 2 == 1 && width <= 9 && taps == width * height;
  return 4 + (unrolled ? 1 : 1.6) * taps;
}
double FftCost(int width, int height) { return 110 * (1 + std::max(width, height) / 90.0); }
double SeparableCost(int width, int height, int terms) { return 4 + 1.2 * terms * (width + height + 4); }
constexpr int kMostTerms = 8;  // that are looked for where nobody asked for products

bool HasZero(const std::vector<double>& v) { return std::find(v.begin(), v.end(), 0.0) != v.end(); }

}  // namespace

graph::Border EngineBorder(BorderMode border) {
  switch (border) {
    case BorderMode::kClamp:
      return graph::Border::kClamp;
    case BorderMode::kRepeat:
      return graph::Border::kRepeat;
    case BorderMode::kMirror:
      return graph::Border::kMirror;
    case BorderMode::kMirror101:
      return graph::Border::kMirror101;
    default:
      return graph::Border::kBlack;
  }
}

Roi OutputWindow(const Roi& window, const Kernel& k, BorderMode border) {
  if (border != BorderMode::kValid) return window;
  const Roi inside{window.x0 + k.anchor_x, window.y0 + k.anchor_y, window.x1 - (k.width - 1 - k.anchor_x),
                   window.y1 - (k.height - 1 - k.anchor_y)};
  return inside.empty() ? Roi{} : inside;
}

Kernel Turned(const Kernel& kernel) {
  Kernel turned = kernel;
  const auto area = static_cast<ptrdiff_t>(kernel.width) * kernel.height;
  for (int p = 0; p < kernel.planes; ++p) {
    std::reverse(turned.weights.begin() + p * area, turned.weights.begin() + (p + 1) * area);
  }
  turned.anchor_x = kernel.width - 1 - kernel.anchor_x;
  turned.anchor_y = kernel.height - 1 - kernel.anchor_y;
  return turned;
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
  Choose(op, kernel);
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
  Plane plane;
  plane.separable = {width_, height_, {{RoundWeights(column), RoundWeights(row)}}};
  plane.codes = MakeCodesWindow(column, row);
  const auto summed = [](const std::vector<double>& weights) {
    std::vector<double> sums(1, 0);
    for (const double w : weights) sums.push_back(sums.back() + w);
    return sums;
  };
  plane.row_sums = summed(row), plane.column_sums = summed(column);
  planes_.push_back(std::move(plane));
  kernel_.weights.clear();
  if (width_ > kLargest || height_ > kLargest) return;
  kernel_ = {width_, height_, left, top, 1, {}};
  for (const double c : column) {
    for (const double r : row) kernel_.weights.push_back(c * r);
  }
  planes_[0].bytes = MakeBytesWindow(width_, height_, kernel_.weights, /*separable=*/true, ErrorBound());
}

void Window::Choose(const std::string& op, const Kernel& kernel) {
  const FilterMethod wanted = options_.method;
  if (wanted == FilterMethod::kRecursive || wanted == FilterMethod::kDecimated) {
    const std::string found = wanted == FilterMethod::kRecursive ? "recursive" : "decimated";
    throw Error(op, "found method=" + found +
                        ", expected auto, direct, separable, lowrank or fft: blurs by a Gaussian or a box "
                        "(--blur) have further ones");
  }
  double taps = 0;
  bool factored = true, exact = true;
  std::vector<Factors> factors;
  // Products cover whole rectangles: where a weight is 0 they would let a NaN through.
  const bool full = !HasZero(kernel.weights);
  // As --explain sees a kernel image, whose pixels are not there yet.
  const bool zeros =
      std::all_of(kernel.weights.begin(), kernel.weights.end(), [](double w) { return w == 0; });
  for (int p = 0; p < kernel.planes; ++p) {
    const int most = wanted == FilterMethod::kSeparable ? 1
                     : wanted == FilterMethod::kLowRank ? std::min(width_, height_)
                                                        : kMostTerms;
    Factors f = Factorize(kernel, p, most);
    factored = factored && !f.terms.empty();
    exact = exact && f.elementwise;
    terms_ = std::max(terms_, static_cast<int>(f.terms.size()));
    truncation_ = std::max(truncation_, f.residual);
    factors.push_back(std::move(f));
  }
  const size_t area = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  taps = static_cast<double>(
             std::count_if(kernel.weights.begin(), kernel.weights.end(), [](double w) { return w != 0; })) /
         kernel.planes;
  switch (wanted) {
    case FilterMethod::kAuto: {
      method_ = FilterMethod::kDirect;
      double least = DirectCost(taps, width_, height_);
      if (const double cost = SeparableCost(width_, height_, terms_);
          full && factored && exact && cost < least) {
        least = cost;
        method_ = terms_ == 1 ? FilterMethod::kSeparable : FilterMethod::kLowRank;
      }
      if (FftCost(width_, height_) < least) method_ = FilterMethod::kFft;
      break;
    }
    case FilterMethod::kSeparable:
      if (zeros) break;
      if (!full || !factored || !exact) {
        throw Error(op,
                    "found method=separable with a kernel that is no product of a column and a row without "
                    "zeros, expected one, or method=lowrank or direct");
      }
      method_ = wanted;
      break;
    case FilterMethod::kLowRank:
      if (factored) method_ = wanted;  // else a plane has nothing but zeros
      break;
    default:
      method_ = wanted;
  }
  const bool products = method_ == FilterMethod::kSeparable || method_ == FilterMethod::kLowRank;
  if (!products) terms_ = 0, truncation_ = 0;
  const bool edges = TreatsEdges();
  for (int p = 0; p < kernel.planes; ++p) {
    Plane plane;
    const auto first = kernel.weights.begin() + static_cast<ptrdiff_t>(static_cast<size_t>(p) * area);
    const std::vector<double> weights(first, first + static_cast<ptrdiff_t>(area));
    if (method_ == FilterMethod::kFft) plane.fft = MakeFftKernel(width_, height_, weights);
    if (!products) {
      plane.direct = MakeDirectWindow(width_, height_, RoundWeights(weights));
      double sum = 0, magnitude = 0;
      for (const double w : weights) sum += w, magnitude += std::fabs(w);
      // A small zero-sum kernel answers to differences only: flat images give exactly 0.
      const auto tap = [&](int x, int y) {
        return weights[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)];
      };
      if (magnitude > 0 && std::fabs(sum) < 1e-12 * magnitude && area <= 25) {
        plane.direct.centered = true;
        int nearest = 1 << 30;
        for (int y = 0; y < height_; ++y) {
          for (int x = 0; x < width_; ++x) {
            const int distance = (x - anchor_x_) * (x - anchor_x_) + (y - anchor_y_) * (y - anchor_y_);
            if (tap(x, y) == 0 || distance >= nearest) continue;
            nearest = distance;
            plane.direct.center_x = x, plane.direct.center_y = y;
          }
        }
      }
    } else {
      plane.separable.width = width_, plane.separable.height = height_;
      for (const Product& t : factors[static_cast<size_t>(p)].terms) {
        plane.separable.terms.push_back({RoundWeights(t.column), RoundWeights(t.row)});
      }
    }
    if (method_ == FilterMethod::kSeparable) {
      const Product& t = factors[static_cast<size_t>(p)].terms[0];
      plane.codes = MakeCodesWindow(t.column, t.row);
    } else {
      plane.codes = MakeCodesWindow(width_, height_, weights);
    }
    if (edges) {
      const auto w = static_cast<size_t>(width_) + 1;
      plane.sums.assign(w * (static_cast<size_t>(height_) + 1), 0);
      for (size_t y = 0; y < static_cast<size_t>(height_); ++y) {
        for (size_t x = 0; x < w - 1; ++x) {
          plane.sums[(y + 1) * w + x + 1] = weights[y * (w - 1) + x] + plane.sums[y * w + x + 1] +
                                            plane.sums[(y + 1) * w + x] - plane.sums[y * w + x];
        }
      }
    }
    planes_.push_back(std::move(plane));
  }
  for (Plane& plane : planes_) {
    const auto first = kernel.weights.begin() + (&plane - planes_.data()) * static_cast<ptrdiff_t>(area);
    plane.bytes = MakeBytesWindow(width_, height_, {first, first + static_cast<ptrdiff_t>(area)}, products,
                                  ErrorBound());
  }
}

double Window::ErrorBound() const {
  const double largest = std::max(1.0, std::fabs(options_.border_value));
  double error = 0;
  const size_t area = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  for (size_t first = 0; first < kernel_.weights.size(); first += area) {
    double sum = 0, squares = 0;
    for (size_t i = first; i < first + area; ++i) {
      sum += std::fabs(kernel_.weights[i]), squares += kernel_.weights[i] * kernel_.weights[i];
    }
    // Deviations from a block's mean are at most half the range.
    const double block = method_ == FilterMethod::kFft ? planes_[0].fft.size * 8.0 : 0;
    error = std::max(error, (2 + std::log2(static_cast<double>(area))) * sum + block * std::sqrt(squares));
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
  return graph::BorderSource(Footprint(region), data_window, EngineBorder(options_.border));
}

Roi Window::Footprint(const Roi& out) const {
  return {out.x0 - anchor_x_, out.y0 - anchor_y_, out.x1 + (width_ - 1 - anchor_x_),
          out.y1 + (height_ - 1 - anchor_y_)};
}

std::string Window::Describe() const {
  const std::string size = std::to_string(width_) + "x" + std::to_string(height_);
  switch (method_) {
    case FilterMethod::kSeparable:
      return size + " separable";
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
      return size + " direct";
  }
}

}  // namespace tessera::ops
