// Tables from images, slices and functions, and the inverse of a monotone table.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "base/half.h"
#include "base/number_text.h"
#include "model/table_axis.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/table.h"

namespace tessera {
namespace model {

std::vector<int> TableSizes(const Roi& window, int channels, const TableLayout& layout) {
  const auto given = static_cast<int>(layout.slices.size());
  const int dims = layout.dims != 0 ? layout.dims : given > 0 ? 2 + given : window.height() == 1 ? 1 : 2;
  const std::string size = std::to_string(window.width()) + "x" + std::to_string(window.height());
  if (dims < 1 || dims > 4)
    throw Error("table", "found " + std::to_string(dims) + " dimensions, expected 1 to 4");
  if (window.empty()) throw DataError("table", "found an empty image, expected at least one pixel");
  if (channels < 1 || channels > 4) {
    throw DataError("table", "found " + std::to_string(channels) + " channels, expected 1 to 4");
  }
  if (given != std::max(dims - 2, 0)) {
    throw Error("table", "found " + std::to_string(given) + " numbers of slices, expected " +
                             std::to_string(std::max(dims - 2, 0)) + " for " + std::to_string(dims) +
                             " dimensions");
  }
  std::vector<int> sizes = {window.width()};
  if (dims == 1) {
    if (window.height() != 1)
      throw DataError("table", "found an image of " + size + ", expected one row for 1 dimension");
    return sizes;
  }
  int64_t slices = 1;
  for (const int n : layout.slices) {
    if (n < 1) throw Error("table", "found " + std::to_string(n) + " slices, expected at least 1");
    slices *= n;
    if (slices > window.height()) break;
  }
  if (window.height() % slices != 0) {
    throw DataError("table", "found an image of " + size + ", expected a height that is a multiple of " +
                                 std::to_string(slices) + " slices");
  }
  sizes.push_back(static_cast<int>(window.height() / slices));
  sizes.insert(sizes.end(), layout.slices.begin(), layout.slices.end());
  return sizes;
}

}  // namespace model

namespace {

float Sample(const std::byte* at, PixelType type) {
  uint16_t code;
  float value;
  switch (type) {
    case PixelType::kUint8:
      return static_cast<float>(std::to_integer<int>(*at) / 255.0);
    case PixelType::kUint16:
      std::memcpy(&code, at, sizeof code);
      return static_cast<float>(code / 65535.0);
    case PixelType::kHalf:
      std::memcpy(&code, at, sizeof code);
      return base::FloatFromHalf(code);
    case PixelType::kFloat:
      break;
  }
  std::memcpy(&value, at, sizeof value);
  return value;
}

void AppendPixels(const ConstImageView& image, std::vector<float>& samples) {
  for (int y = image.roi.y0; y < image.roi.y1; ++y) {
    for (int x = image.roi.x0; x < image.roi.x1; ++x) {
      for (int c = 0; c < image.channels; ++c) samples.push_back(Sample(image.At(x, y, c), image.type));
    }
  }
}

// Point n of the R-sequence, which fills the unit cube evenly in any dimension (Roberts 2018).
double Probe(int64_t n, int axis, int dims) {
  // The only real root above 1 of x^(dims + 1) = x + 1.
  static constexpr double kRoot[] = {1.6180339887498949, 1.3247179572447461, 1.2207440846057596,
                                     1.1673039782614187};
  const double step = std::pow(kRoot[dims - 1], -(axis + 1));
  const double v = 0.5 + static_cast<double>(n) * step;
  return v - std::floor(v);
}

}  // namespace

Table TableFromImage(const ConstImageView& image, const TableLayout& layout) {
  std::vector<int> sizes = model::TableSizes(image.roi, image.channels, layout);
  std::vector<float> samples;
  samples.reserve(static_cast<size_t>(image.roi.pixels()) * static_cast<size_t>(image.channels));
  AppendPixels(image, samples);
  return Table(std::move(sizes), image.channels, samples, layout.align, image.type);
}

Table TableFromSlices(std::span<const Image> slices, TableAlign align) {
  if (slices.empty()) throw Error("table", "found no slices, expected at least one image");
  const ImageSpec& first = slices.front().spec();
  std::vector<float> samples;
  for (const Image& slice : slices) {
    const ImageSpec& spec = slice.spec();
    const auto shape = [](const ImageSpec& s) {
      return std::to_string(s.width()) + "x" + std::to_string(s.height()) + " with " +
             std::to_string(s.channel_count()) + " channels";
    };
    if (spec.width() != first.width() || spec.height() != first.height() ||
        spec.channel_count() != first.channel_count()) {
      throw DataError("table",
                      "found slices of " + shape(first) + " and " + shape(spec) + ", expected equal ones");
    }
    AppendPixels(slice.view(), samples);
  }
  return Table({first.width(), first.height(), static_cast<int>(slices.size())}, first.channel_count(),
               samples, align, first.type);
}

FunctionTable TableFromFunction(const TableFunction& f, const FunctionTableParams& params) {
  const auto dims = params.sizes.size();
  // Refuses bad shapes before anything is computed.
  int64_t count = 1;
  for (const int n : params.sizes) count *= std::clamp(n, 0, 1 << 20);
  if (dims < 1 || dims > 4 || params.channels < 1 || params.channels > 4 || count < 1 ||
      count > std::numeric_limits<int32_t>::max()) {
    static_cast<void>(Table(params.sizes, params.channels, {}, params.align, params.storage));
  }
  std::vector<float> samples(static_cast<size_t>(count) * static_cast<size_t>(params.channels));
  double at[4] = {}, exact[4] = {}, got[4] = {};
  for (int64_t i = 0; i < count; ++i) {
    int64_t rest = i;
    for (size_t a = 0; a < dims; ++a) {
      const int n = params.sizes[a];
      const auto k = static_cast<double>(rest % n);
      rest /= n;
      at[a] = params.align == TableAlign::kCentres ? (k + 0.5) / n : n > 1 ? k / (n - 1) : 0;
    }
    f(at, exact);
    for (int c = 0; c < params.channels; ++c) {
      samples[static_cast<size_t>(i * params.channels + c)] = static_cast<float>(exact[c]);
    }
  }
  FunctionTable result;
  result.table = Table(params.sizes, params.channels, samples, params.align, params.storage);

  double sum = 0;
  int64_t probes = 0;
  const auto probe = [&] {
    // Lookups take float coordinates; so does the function they are compared with.
    for (size_t a = 0; a < dims; ++a) at[a] = static_cast<float>(at[a]);
    f(at, exact);
    SampleTable(result.table, params.lookup, at, got);
    for (int c = 0; c < params.channels; ++c) {
      const double error = std::fabs(got[c] - exact[c]);
      sum += error * error;
      if (error > result.max_error || std::isnan(error)) {
        result.max_error = error;
        std::copy_n(at, 4, result.worst.begin());
      }
    }
    ++probes;
  };
  for (int n = 0; n < params.probes; ++n) {
    for (size_t a = 0; a < dims; ++a) at[a] = Probe(n, static_cast<int>(a), static_cast<int>(dims));
    probe();
  }
  // The first and last cells of each axis, where functions are often steepest, others halfway.
  for (size_t a = 0; a < dims; ++a) {
    const double half = 0.5 / std::max(params.sizes[a] - 1, 1);
    for (const double v : {half, 1 - half}) {
      std::fill_n(at, 4, 0.5);
      at[a] = v;
      probe();
    }
  }
  result.rms_error = std::sqrt(sum / (static_cast<double>(probes) * params.channels));
  return result;
}

Table InverseTable(const Table& table, int size) {
  if (table.dims() != 1 || table.channels() != 1) {
    throw Error("inverse", "found a table of " + std::to_string(table.dims()) + " dimensions and " +
                               std::to_string(table.channels()) + " channels, expected one of each");
  }
  const int n = table.size(0);
  if (n < 2 || size < 2) throw DataError("inverse", "found a table of 1 entry, expected at least 2");
  std::vector<double> y(static_cast<size_t>(n));
  for (int i = 0; i < n; ++i) y[static_cast<size_t>(i)] = table.At(i, 0);
  const bool falling = y.back() < y.front();
  for (size_t i = 1; i < y.size(); ++i) {
    if (falling ? y[i] < y[i - 1] : y[i] > y[i - 1]) continue;
    throw DataError("inverse", "entry " + std::to_string(i) + ": found " + base::NumberText(y[i]) +
                                   " after " + base::NumberText(y[i - 1]) + ", expected entries that " +
                                   (falling ? "decrease" : "increase") + " strictly");
  }
  if (falling) std::reverse(y.begin(), y.end());
  std::vector<float> inverse(static_cast<size_t>(size));
  for (int j = 0; j < size; ++j) {
    const double wanted = j / (size - 1.0);
    // The first entry above; the coordinate lies between it and the one before.
    const auto above = std::upper_bound(y.begin(), y.end(), wanted);
    double position;
    if (above == y.begin()) {
      position = 0;
    } else if (above == y.end()) {
      position = n - 1;
    } else {
      const double low = *(above - 1);
      position = static_cast<double>(above - 1 - y.begin()) + (wanted - low) / (*above - low);
    }
    if (falling) position = n - 1 - position;
    const double s = table.align() == TableAlign::kEnds ? position / (n - 1) : (position + 0.5) / n;
    inverse[static_cast<size_t>(j)] = static_cast<float>(s);
  }
  return Table({size}, 1, inverse, TableAlign::kEnds);
}

}  // namespace tessera
