// Reference of the filters: plain sums over the window, borders pixel by pixel.
#include "tessera/ops/filter.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "reference/border.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

using Sample = std::pair<double, double>;  // value, scale of its bound
constexpr double kUnit = 0x1p-24;

// An input with its border.
struct Bordered {
  const ImageD& image;
  const Roi& window;
  Wrap wrap;
  double value;
  // The sample at (x, y), anywhere; `inside` tells whether a pixel is shown there.
  double at(int x, int y, int c, bool* inside) const {
    *inside = Shown(x, window.x0, window.x1, wrap) && Shown(y, window.y0, window.y1, wrap);
    return *inside ? image.at(x, y, c) : value;
  }
};

// Sum of weights(i, j) * sample(x - ax + i, y - ay + j), and the sum of magnitudes; zero weights take no
// part.
template <class Weight>
Sample WindowSum(const Bordered& in, int x, int y, int c, int width, int height, int ax, int ay,
                 Weight weight) {
  double sum = 0, magnitude = 0, weight_inside = 0, weight_all = 0, weight_sizes = 0;
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const double w = weight(i, j);
      weight_all += w;
      if (w == 0) continue;
      weight_sizes += std::fabs(w);
      bool inside = false;
      const double v = in.at(x - ax + i, y - ay + j, c, &inside);
      if (inside) weight_inside += w;
      if (!inside && in.wrap == Wrap::kRenormalize) continue;
      sum += w * v;
      magnitude += std::fabs(w * v);
    }
  }
  if (in.wrap == Wrap::kRenormalize && weight_inside != 0 && weight_inside != weight_all) {
    const double factor = weight_all / weight_inside;
    sum *= factor, magnitude *= std::fabs(factor);
    // Weights that cancel leave what doubles make of them.
    const double rounded = width * height * 0x1p-53 * weight_sizes / std::fabs(weight_inside);
    magnitude += std::fabs(sum) * rounded * 0x1p24;
  }
  return {sum, magnitude};
}

// The largest sample under a window whose weight is not 0.
template <class Weight>
double LargestUnder(const Bordered& in, int x, int y, int c, int width, int height, int ax, int ay,
                    Weight weight) {
  double largest = 0;
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      bool inside = false;
      if (weight(i, j) != 0)
        largest = std::max(largest, std::fabs(in.at(x - ax + i, y - ay + j, c, &inside)));
    }
  }
  return largest;
}

// Whether blocks of the image may be transformed: they reach farther than the window does.
bool IsTransformed(const Convolution& p) {
  return p.params.method == FilterMethod::kFft ||
         (p.params.method == FilterMethod::kAuto && p.kernel.width * p.kernel.height > 81);
}

// How often what one sample adds to a result is rounded, at most, with its weight, which may be the second
// nearest float; nothing is left to chance, since of equal samples every addition may be rounded the same
// way. kAuto: of whichever method a kernel image's pixels turn out to suit.
double Roundings(FilterMethod method, int width, int height, int taps) {
  // Columns are summed in four groups, tap by tap; the groups are added then.
  const double group = (width + 3) / 4;
  const double direct = 3 + group * height + std::min(3, width - 1);
  // Two weights, pairs that share one, down the column, along the row, and the products one by one.
  const double product = 9 + height + group;
  // Products may be larger than the weights that they add up to.
  const double products = 2 * product + std::min(width, height);
  switch (method) {
    case FilterMethod::kDirect:
      return direct;
    case FilterMethod::kSeparable:
      return product;
    case FilterMethod::kLowRank:
      return products;
    case FilterMethod::kFft:  // a tree
      return 2 + std::log2(std::max(1, taps));
    default:
      return std::max(direct, products);
  }
}
bool ReachesOverBlocks(const std::any& parameters, int input) {
  return input == 0 && IsTransformed(std::any_cast<const Convolution&>(parameters));
}

void EvaluateConvolve(const Call& call) {
  const auto& p = std::any_cast<const Convolution&>(call.parameters);
  const ConvolveParams& q = p.params;
  const Kernel& k = p.kernel;
  const double divisor = q.divisor == 0 ? 1 : q.divisor;
  std::vector<double> sums(static_cast<size_t>(call.out.channels), 1);
  const int planes = p.kernel_image ? call.in[1].channels : k.planes;
  // Weight at column i, row j of the kernel as it was given.
  const auto given = [&](int i, int j, int plane) {
    return p.kernel_image ? call.in[1].at(i - k.anchor_x, j - k.anchor_y, plane) : k.at(i, j, plane);
  };
  int taps = 0;
  for (int plane = 0; plane < planes; ++plane) {
    double sum = 0;
    int count = 0;
    for (int j = 0; j < k.height; ++j) {
      for (int i = 0; i < k.width; ++i) sum += given(i, j, plane), count += given(i, j, plane) != 0;
    }
    taps = std::max(taps, count);
    if (p.kernel_image && p.normalize && sum != 0) sums[static_cast<size_t>(plane)] = sum;
  }
  const Bordered in{call.in[0], call.in_specs[0].data_window, q.wrap,
                    q.wrap == Wrap::kBlack ? q.border_value : 0};
  // Small kernels whose sum is 0 are sums of differences from one sample: it counts with every weight.
  double total = 0, balance = 0;
  for (int j = 0; j < k.height; ++j) {
    for (int i = 0; i < k.width; ++i) {
      const double w = given(i, j, 0) / (sums[0] * divisor);
      total += std::fabs(w), balance += w;
    }
  }
  const bool differences = k.width * k.height <= 25 && std::fabs(balance) < 1e-12 * total;
  // Large kernels may be transformed in blocks: the errors of all samples together are spread over the block
  // as by chance. Five of their deviations.
  double transform = 0;
  if (IsTransformed(p)) {
    double largest = std::fabs(in.value), weights = 0;
    if (!call.largest.empty()) largest = std::max(largest, call.largest[0]);
    for (const double v : call.in[0].samples) largest = std::max(largest, std::fabs(v));
    for (int plane = 0; plane < planes; ++plane) {
      double squares = 0;
      for (int j = 0; j < k.height; ++j) {
        for (int i = 0; i < k.width; ++i)
          squares += std::pow(given(i, j, plane) / sums[static_cast<size_t>(plane)], 2);
      }
      weights = std::max(weights, squares);
    }
    transform = largest * 32 * std::sqrt(weights) / std::fabs(divisor);
  }
  // What borders change in a sum is rounded twice, and with a bias the sum is once more.
  const double steps = Roundings(q.method, k.width, k.height, taps) + 2 + (q.bias != 0 ? 1 : 0);
  const int alpha = call.in_specs[0].alpha;
  ForEachSample(call, [&](int x, int y, int c) {
    const int plane = planes == 1 ? 0 : c;
    const auto weight = [&](int i, int j) {
      if (!q.correlate) i = k.width - 1 - i, j = k.height - 1 - j;
      return given(i, j, plane) / (sums[static_cast<size_t>(plane)] * divisor);
    };
    const int ax = q.correlate ? k.anchor_x : k.width - 1 - k.anchor_x;
    const int ay = q.correlate ? k.anchor_y : k.height - 1 - k.anchor_y;
    auto [sum, magnitude] = WindowSum(in, x, y, c, k.width, k.height, ax, ay, weight);
    if (differences) {
      magnitude += LargestUnder(in, x, y, c, k.width, k.height, ax, ay, weight) * total;
    }
    if (q.method == FilterMethod::kLowRank) {  // products have weights where their sum has none
      const auto everywhere = [](int, int) { return 1; };
      magnitude =
          std::max(magnitude, LargestUnder(in, x, y, c, k.width, k.height, ax, ay, everywhere) * total);
    }
    if (transform > 0) magnitude = std::max(magnitude, transform);
    const double bias = q.bias * (alpha >= 0 && q.bias != 0 ? call.in[0].at(x, y, alpha) : 1);
    return Sample(sum + bias, steps * magnitude + 2 * std::fabs(bias) + kSmallestScale);
  });
}
Roi ConvolveInput(const std::any& parameters, int input, const Roi& out) {
  const auto& p = std::any_cast<const Convolution&>(parameters);
  const Kernel& k = p.kernel;
  if (input == 1) return {-k.anchor_x, -k.anchor_y, k.width - k.anchor_x, k.height - k.anchor_y};
  return Around(out, k.width, k.height, k.width, k.height, p.params.wrap);
}

// ---- Gaussian and box: one axis after the other, in double ----

// The weights along one axis, `before` of them before the pixel. Samples that are not finite take part up to
// `reach` pixels away.
struct AxisWeights {
  std::vector<double> weights;
  int before = 0, reach = 1 << 30;
};

// The result along one axis of `in`, over out's region.
ImageD Along(bool rows, const ImageD& in, const Roi& out, const Roi& window, Wrap wrap, double value,
             const AxisWeights& axis) {
  const std::vector<double>& weights = axis.weights;
  ImageD result(out, in.channels);
  for (int y = out.y0; y < out.y1; ++y) {
    for (int x = out.x0; x < out.x1; ++x) {
      for (int c = 0; c < in.channels; ++c) {
        double sum = 0, inside_weight = 0;
        for (size_t i = 0; i < weights.size(); ++i) {
          const int away = static_cast<int>(i) - axis.before;
          int v = (rows ? x : y) + away;
          const bool inside =
              rows ? Shown(v, window.x0, window.x1, wrap) : Shown(v, window.y0, window.y1, wrap);
          if (inside) inside_weight += weights[i];
          if (inside) {
            const double sample = rows ? in.at(v, y, c) : in.at(x, v, c);
            if (std::abs(away) <= axis.reach || std::isfinite(sample)) sum += weights[i] * sample;
          } else if (wrap == Wrap::kBlack) {
            sum += weights[i] * value;
          }
        }
        result.at(x, y, c) = wrap == Wrap::kRenormalize ? sum / inside_weight : sum;
      }
    }
  }
  return result;
}

void EvaluateSeparable(const Call& call, Wrap wrap, double value, const AxisWeights& row,
                       const AxisWeights& column, double l1, double roundings) {
  const Roi& window = call.in_specs[0].data_window;
  const Roi& o = call.out.roi;
  if (o.empty()) return;
  const ImageD& in = call.in[0];
  // Columns first: few rows are wanted.
  const ImageD half = Along(false, in, {in.roi.x0, o.y0, in.roi.x1, o.y1}, window, wrap, value, column);
  ImageD magnitudes = in;
  double largest = std::fabs(value);
  for (double& v : magnitudes.samples) {
    v = std::fabs(v);
    if (std::isfinite(v)) largest = std::max(largest, v);
  }
  if (!call.largest.empty()) largest = std::max(largest, call.largest[0]);
  const ImageD sums = Along(true, half, o, window, wrap, value, row);
  if (call.scale == nullptr) {
    call.out.samples = sums.samples;
    return;
  }
  const ImageD half_magnitude = Along(false, magnitudes, half.roi, window, wrap, std::fabs(value), column);
  const ImageD scales = Along(true, half_magnitude, o, window, wrap, std::fabs(value), row);
  ForEachSample(call, [&](int x, int y, int c) {
    return Sample(sums.at(x, y, c), roundings * scales.at(x, y, c) + l1 / kUnit * largest + kSmallestScale);
  });
}

// All that a double tells apart from 0. What is not finite is seen as far as sums of floats go: 5.1 sigma,
// rounded up, and nowhere where the weight is below 1e-30.
AxisWeights GaussianWeights(double sigma) {
  const int radius = static_cast<int>(std::ceil(7 * sigma));
  AxisWeights axis{.weights = {}, .before = radius, .reach = static_cast<int>(std::ceil(5.1 * sigma))};
  std::vector<double>& weights = axis.weights;
  double sum = 0;
  for (int n = -radius; n <= radius; ++n) {
    weights.push_back(sigma == 0 ? 1 : std::exp(-0.5 * n * n / (sigma * sigma)));
    sum += weights.back();
  }
  for (double& w : weights) w /= sum;
  while (axis.reach > 0 && weights[static_cast<size_t>(radius - axis.reach)] < 1e-30) --axis.reach;
  return axis;
}

// Whether a Gaussian is summed over a window, and not run along whole lines.
bool IsSummed(const GaussianParams& p) {
  return p.method == FilterMethod::kDirect || p.method == FilterMethod::kSeparable ||
         (p.method == FilterMethod::kAuto && std::max(p.sigma_x, p.sigma_y) <= 3);
}
bool RunsAlongLines(const std::any& parameters, int) {
  const auto* p = std::any_cast<GaussianParams>(&parameters);
  return p != nullptr && !IsSummed(*p);
}

void EvaluateBlur(const Call& call) {
  if (const auto* box = std::any_cast<BoxParams>(&call.parameters)) {
    const auto axis = [](int size) {
      return AxisWeights{std::vector<double>(static_cast<size_t>(size), 1.0 / size), (size - 1) / 2};
    };
    // Small boxes are sums of columns and rows, an addition rounded at a time; large ones are sums in double.
    const bool small = std::max(box->width, box->height) <= 9;
    const bool summed = box->method == FilterMethod::kDirect || box->method == FilterMethod::kSeparable ||
                        (box->method == FilterMethod::kAuto && small);
    const double steps =
        summed ? 1 + box->width + box->height : std::log2(double{1} * box->width * box->height);
    return EvaluateSeparable(call, box->wrap, box->border_value, axis(box->width), axis(box->height), 0,
                             2 + steps);
  }
  const auto& p = std::any_cast<const GaussianParams&>(call.parameters);
  const bool summed = IsSummed(p);
  const bool decimated = p.method == FilterMethod::kDecimated ||
                         (p.method == FilterMethod::kAuto && std::min(p.sigma_x, p.sigma_y) >= 16 &&
                          p.wrap != Wrap::kRenormalize);
  EvaluateSeparable(call, p.wrap, p.border_value, GaussianWeights(p.sigma_x), GaussianWeights(p.sigma_y),
                    summed      ? 1e-6
                    : decimated ? 1e-4
                                : 2e-5,
                    12);
}
Roi BlurInput(const std::any& parameters, int, const Roi& out) {
  if (const auto* box = std::any_cast<BoxParams>(&parameters)) {
    return Around(out, box->width, box->height, box->width, box->height, box->wrap);
  }
  const auto& p = std::any_cast<const GaussianParams&>(parameters);
  const int x = static_cast<int>(std::ceil(7 * p.sigma_x)), y = static_cast<int>(std::ceil(7 * p.sigma_y));
  return Around(out, x, y, x, y, p.wrap);
}

// ---- Gradients ----

void EvaluateSobel(const Call& call) {
  const auto& p = std::any_cast<const SobelParams&>(call.parameters);
  const Bordered in{call.in[0], call.in_specs[0].data_window, p.wrap, 0};
  ForEachSample(call, [&](int x, int y, int result) {
    const int c = p.output == SobelOutput::kXY ? result / 2 : result;
    const auto at = [&](int dx, int dy) {
      bool inside = false;
      return in.at(x + dx, y + dy, c, &inside);
    };
    double gx = 0, gy = 0, sx = 0, sy = 0;
    for (int k = -1; k <= 1 && !p.by_parts(); ++k) {
      const double w = k == 0 ? 2 : 1;
      gx += w * (at(1, k) - at(-1, k)), sx += w * std::fabs(at(1, k) - at(-1, k));
      gy += w * (at(k, 1) - at(k, -1)), sy += w * std::fabs(at(k, 1) - at(k, -1));
    }
    if (p.by_parts()) {
      // The inputs are the components.
      gx = call.in[0].at(x, y, c), gy = call.in[1].at(x, y, c);
      sx = std::fabs(gx), sy = std::fabs(gy);
    }
    // hypot's infinity beside a NaN is not the root of a sum of squares, which is a NaN.
    const double magnitude =
        std::isnan(gx) || std::isnan(gy) ? std::numeric_limits<double>::quiet_NaN() : std::hypot(gx, gy);
    switch (p.output) {
      case SobelOutput::kXY:
        return result % 2 == 0 ? Sample(gx, sx + kSmallestScale) : Sample(gy, sy + kSmallestScale);
      case SobelOutput::kDirection:
        // Either side of the negative x axis, and any side of a gradient that differences cancel to nothing.
        if (const double reach = 4 * kUnit * (sx + sy);
            reach > 0 && (magnitude <= reach || (gx < 0 && std::fabs(gy) <= reach))) {
          call.Undecided(x, y, result, kUnknownJump);
        }
        // Of no gradient it is exactly 0, whatever the signs of zeros.
        return Sample(std::atan2(gy + 0.0, gx + 0.0), magnitude > 0 ? 1 + (sx + sy) / magnitude : 0);
      default:
        return Sample(magnitude, sx + sy + kSmallestScale);
    }
  });
}
Roi SobelInput(const std::any& parameters, int, const Roi& out) {
  const auto& p = std::any_cast<const SobelParams&>(parameters);
  return p.by_parts() ? out : Around(out, 1, 1, 1, 1, p.wrap);
}

void EvaluateUnsharp(const Call& call) {
  const auto& p = std::any_cast<const UnsharpParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    const double v = call.in[0].at(x, y, c), blurred = call.in[1].at(x, y, c);
    const double threshold = static_cast<float>(p.threshold), apart = std::fabs(v - blurred);
    const double difference = apart < threshold ? 0 : v - blurred;
    // The difference of floats is one itself.
    const double off = call.Tolerance(0, x, y, c) + call.Tolerance(1, x, y, c) + kUnit * apart;
    if (threshold > 0 && std::fabs(apart - threshold) <= off) {
      call.Undecided(x, y, c, std::fabs(p.contrast) * (apart + off));
    }
    return Sample(v + p.contrast * difference,
                  std::fabs(v) + std::fabs(p.contrast) * (std::fabs(v) + std::fabs(blurred)));
  });
}

// ---- Order statistics ----

// choose(sorted samples, numbers only where there are any) of the pixels of the window that exist.
template <class Choose>
void EvaluateRank(const Call& call, bool numbers_only, Choose choose) {
  const auto& p = std::any_cast<const RankParams&>(call.parameters);
  const Roi& window = call.in_specs[0].data_window;
  std::vector<double> samples;
  ForEachSample(call, [&](int x, int y, int c) {
    samples.clear();
    int not_numbers = 0;
    const Roi box = Intersection(
        window, {x - p.width / 2, y - p.height / 2, x - p.width / 2 + p.width, y - p.height / 2 + p.height});
    for (int j = box.y0; j < box.y1; ++j) {
      for (int i = box.x0; i < box.x1; ++i) {
        const double v = call.in[0].at(i, j, c);
        if (std::isnan(v)) {
          ++not_numbers;
        } else {
          samples.push_back(v);
        }
      }
    }
    std::sort(samples.begin(), samples.end());
    if (!numbers_only || samples.empty()) {
      samples.insert(samples.end(), static_cast<size_t>(not_numbers),
                     std::numeric_limits<double>::quiet_NaN());
    }
    return Sample(choose(samples), 0.0);
  });
}
void EvaluateMedian(const Call& call) {
  EvaluateRank(call, false, [](const std::vector<double>& v) { return v[v.size() / 2]; });
}
void EvaluateDilate(const Call& call) {
  EvaluateRank(call, true, [](const std::vector<double>& v) { return v.back(); });
}
void EvaluateErode(const Call& call) {
  EvaluateRank(call, true, [](const std::vector<double>& v) { return v.front(); });
}
Roi RankInput(const std::any& parameters, int, const Roi& out) {
  const auto& p = std::any_cast<const RankParams&>(parameters);
  return {out.x0 - p.width, out.y0 - p.height, out.x1 + p.width, out.y1 + p.height};
}

}  // namespace

std::vector<Entry> FilterEntries() {
  Entry blur{"blur", EvaluateBlur, BlurInput, 1};
  blur.wants_largest = RunsAlongLines;
  Entry convolve{"convolve", EvaluateConvolve, ConvolveInput, 1};
  convolve.wants_largest = ReachesOverBlocks;
  // The first three are convolutions with one kernel each.
  return {
      {"emboss", EvaluateConvolve, ConvolveInput},
      {"laplacian", EvaluateConvolve, ConvolveInput},
      {"highpass", EvaluateConvolve, ConvolveInput},
      convolve,
      blur,
      {"sobel", EvaluateSobel, SobelInput},
      {"unsharp", EvaluateUnsharp, nullptr},
      {"median", EvaluateMedian, RankInput},
      {"dilate", EvaluateDilate, RankInput},
      {"erode", EvaluateErode, RankInput},
  };
}

}  // namespace tessera::reference
