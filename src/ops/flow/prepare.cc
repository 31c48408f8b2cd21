// Fields, masks, noise and weights for the streamline kernels.
#include "ops/flow/prepare.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "base/arena.h"
#include "ops/flow/noise.h"
#include "ops/flow/row_kernel.h"

namespace tessera::ops::flow {
namespace {

constexpr int kRows = 16;  // of a task
constexpr double kSmoothShare = 1.2;
constexpr uint32_t kSparseShare = 24;  // one cell of so many is bright

struct Vector {
  float u = 0, v = 0;
  bool known = false;
};

// The field as it was given, at its own pixels or between them.
class Field {
 public:
  Field(const LicParams& params, const ConstImageView& field, int alpha, const Roi& window)
      : params_(params),
        field_(field),
        alpha_(alpha),
        window_(window),
        same_size_(field.roi.width() == window.width() && field.roi.height() == window.height()) {
    x_ = params.scale_x, y_ = params.y_up ? -params.scale_y : params.scale_y;
    const double per_x = static_cast<double>(window.width()) / std::max(1, field.roi.width());
    const double per_y = static_cast<double>(window.height()) / std::max(1, field.roi.height());
    switch (params.units) {
      case LicUnits::kPixels:
        x_ *= per_x, y_ *= per_y;
        break;
      case LicUnits::kNormalized:
        x_ *= window.width(), y_ *= window.height();
        break;
      case LicUnits::kLatLong:  // degrees: 360 across, 180 down, north up
        x_ *= window.width() / 360.0, y_ *= -window.height() / 180.0;
        break;
    }
    plain_ = x_ == 1 && y_ == 1 && params.units != LicUnits::kLatLong;
  }

  // The vectors of a row where they are the picture's own as they stand; else null.
  const float* Row(int y) const {
    const bool pairs = field_.channels == 2 && field_.pixel_stride == 8 && field_.channel_stride == 4;
    if (!same_size_ || !plain_ || alpha_ >= 0 || !pairs) return nullptr;
    return reinterpret_cast<const float*>(field_.At(field_.roi.x0, field_.roi.y0 + y));
  }
  // Pixel (x, y) of the picture, counted from its first one.
  Vector At(int x, int y) const {
    if (same_size_) return plain_ ? Stored(x, y) : Scaled(Stored(x, y), y);
    return Scaled(Between(x, y), y);
  }

 private:
  Vector Stored(int x, int y) const {
    const auto* p = reinterpret_cast<const float*>(field_.At(field_.roi.x0 + x, field_.roi.y0 + y));
    const bool known = std::isfinite(p[0]) && std::isfinite(p[1]) && (alpha_ < 0 || p[alpha_] > 0);
    return known ? Vector{p[0], p[1], true} : Vector{};
  }
  Vector Scaled(const Vector& f, int y) const {
    double u = f.u * x_;
    if (params_.units == LicUnits::kLatLong) {
      const double latitude = std::numbers::pi * (0.5 - (y + 0.5) / window_.height());
      u /= std::max(std::cos(latitude), 1e-6);
    }
    const Vector s{static_cast<float>(u), static_cast<float>(f.v * y_), f.known};
    return std::isfinite(s.u) && std::isfinite(s.v) ? s : Vector{};
  }
  // Catmull-Rom or linear weights of the neighbours from `first` on.
  static int Weights(bool cubic, double at, double* w) {
    const double base = std::floor(at), t = at - base;
    if (!cubic) {
      w[0] = 1 - t, w[1] = t;
      return static_cast<int>(base);
    }
    w[0] = 0.5 * t * (-1 + t * (2 - t)), w[1] = 1 + 0.5 * t * t * (3 * t - 5);
    w[2] = 0.5 * t * (1 + t * (4 - 3 * t)), w[3] = 0.5 * t * t * (t - 1);
    return static_cast<int>(base) - 1;
  }
  int Index(int i, int size, bool x) const {
    const bool turns = params_.wrap == Wrap::kRepeat || (x && params_.units == LicUnits::kLatLong);
    return turns ? (i % size + size) % size : std::clamp(i, 0, size - 1);
  }
  Vector Between(int x, int y) const {
    const int width = field_.roi.width(), height = field_.roi.height();
    const double at_x = (x + 0.5) * width / window_.width() - 0.5,
                 at_y = (y + 0.5) * height / window_.height() - 0.5;
    // What the nearest pixel does not know is masked; other unknown neighbours do not count.
    const Vector nearest = Stored(Index(static_cast<int>(std::floor(at_x + 0.5)), width, true),
                                  Index(static_cast<int>(std::floor(at_y + 0.5)), height, false));
    if (!nearest.known) return {};
    double wx[4], wy[4], u = 0, v = 0, sum = 0;
    const int taps = params_.bicubic ? 4 : 2;
    const int x0 = Weights(params_.bicubic, at_x, wx), y0 = Weights(params_.bicubic, at_y, wy);
    for (int j = 0; j < taps; ++j) {
      for (int i = 0; i < taps; ++i) {
        const Vector f = Stored(Index(x0 + i, width, true), Index(y0 + j, height, false));
        if (!f.known) continue;
        const double w = wx[i] * wy[j];
        u += w * f.u, v += w * f.v, sum += w;
      }
    }
    if (!(sum > 1e-3)) return nearest;
    return {static_cast<float>(u / sum), static_cast<float>(v / sum), true};
  }

  const LicParams& params_;
  const ConstImageView& field_;
  int alpha_;
  Roi window_;
  bool same_size_, plain_ = true;
  double x_ = 1, y_ = 1;
};

template <typename T>
std::shared_ptr<std::byte> Memory(const graph::Workers& workers, int64_t count, T** first) {
  std::shared_ptr<std::byte> memory = base::AllocateAligned(
      workers.context(), static_cast<size_t>(count) * sizeof(T) + 64, base::Access::kScattered);
  *first = reinterpret_cast<T*>(memory.get());
  return memory;
}

// Elements from row to row, at least `least`: neighbouring rows are to differ in the lines of a
// set-associative cache that they take.
ptrdiff_t RowStride(ptrdiff_t least) {
  constexpr ptrdiff_t kLine = 16;
  const ptrdiff_t lines = (least + kLine - 1) / kLine;
  return ((lines + 6) / 8 * 8 + 1) * kLine;
}

// task(y0, y1) on bands of rows.
template <class F>
void ForRows(int height, const graph::Workers& workers, const F& task) {
  workers.For((height + kRows - 1) / kRows, [&](int64_t i, int) {
    const int y0 = static_cast<int>(i) * kRows;
    task(y0, std::min(y0 + kRows, height));
  });
}

// What lies left and right of a row of vectors.
void Frame(const Lines& lines, float* row) {
  const bool turns = lines.around_x;
  const ptrdiff_t last = 2 * (ptrdiff_t{lines.width} - 1);
  for (int i = 0; i < 2; ++i) {
    row[i - 2] = row[turns ? last + i : i];
    row[last + 2 + i] = row[turns ? i : last + i];
  }
}

// Above the first row of vectors and below the last.
void FrameRows(const Lines& lines, float* uv) {
  const bool turns = lines.around_y;
  const auto copy = [&](int from, int to) {
    std::copy_n(uv + from * lines.uv_row - 2, lines.uv_row, uv + to * lines.uv_row - 2);
  };
  copy(turns ? lines.height - 1 : 0, -1);
  copy(turns ? 0 : lines.height - 1, lines.height);
}

void Join(const RowFound& one, RowFound& all) {
  all.largest = std::max(all.largest, one.largest), all.squared = std::max(all.squared, one.squared);
  all.masked |= one.masked;
}

// Vectors to framed rows at `uv`; where that is null they are only looked at.
RowFound CopyVectors(const Field& field, const Lines& lines, const graph::Workers& workers, float* uv) {
  const RowKernels kernels = FindRowKernels();
  std::vector<RowFound> found(static_cast<size_t>((lines.height + kRows - 1) / kRows));
  ForRows(lines.height, workers, [&](int y0, int y1) {
    RowFound f;
    for (int y = y0; y < y1; ++y) {
      float* const to = uv != nullptr ? uv + y * lines.uv_row : nullptr;
      const float* const from = field.Row(y);
      if (from != nullptr) Join(kernels.copy_vectors(from, lines.width, to), f);
      for (int x = 0; from == nullptr && x < lines.width; ++x) {
        const Vector v = field.At(x, y);
        to[2 * x] = v.u, to[2 * x + 1] = v.v;
        Join({std::max(std::fabs(v.u), std::fabs(v.v)), v.u * v.u + v.v * v.v, !v.known}, f);
      }
      if (to != nullptr) Frame(lines, to);
    }
    found[static_cast<size_t>(y0 / kRows)] = f;
  });
  RowFound all;
  for (const RowFound& f : found) Join(f, all);
  return all;
}

void FillMask(const Field& field, const graph::Workers& workers, Prepared& out) {
  const int width = out.lines.width, height = out.lines.height;
  uint32_t* mask = nullptr;
  out.mask = Memory(workers, int64_t{width} * height, &mask);
  out.lines.mask = mask;
  ForRows(height, workers, [&](int y0, int y1) {
    for (int y = y0; y < y1; ++y) {
      for (int x = 0; x < width; ++x) mask[ptrdiff_t{y} * width + x] = field.At(x, y).known ? 0 : 1;
    }
  });
}

// Vectors times 2^-exponent. Returns the square of the longest of them.
double Scale(const Lines& lines, int exponent, const graph::Workers& workers, float* uv) {
  std::vector<double> longest(static_cast<size_t>((lines.height + kRows - 1) / kRows));
  ForRows(lines.height, workers, [&](int y0, int y1) {
    double& here = longest[static_cast<size_t>(y0 / kRows)];
    for (int y = y0; y < y1; ++y) {
      float* const row = uv + y * lines.uv_row;
      for (int i = 0; i < 2 * lines.width; i += 2) {
        if (exponent != 0)
          row[i] = std::ldexp(row[i], -exponent), row[i + 1] = std::ldexp(row[i + 1], -exponent);
        here = std::max(here, double{row[i]} * row[i] + double{row[i + 1]} * row[i + 1]);
      }
      Frame(lines, row);
    }
  });
  return *std::max_element(longest.begin(), longest.end());
}

// On a map of latitude and longitude: by how much each row's u is shorter on the sphere, and the longest
// vector there.
void ShrinkByLatitude(const Lines& lines, const float* uv, Prepared& out) {
  double shown = 0;
  for (int y = 0; y < lines.height; ++y) {
    out.shrink.push_back(static_cast<float>(std::sin(std::numbers::pi * (y + 0.5) / lines.height)));
    for (int x = 0; x < lines.width; ++x) {
      const double u = double{uv[y * lines.uv_row + 2 * x]} * out.shrink.back(),
                   v = uv[y * lines.uv_row + 2 * x + 1];
      shown = std::max(shown, u * u + v * v);
    }
  }
  out.longest_shown = static_cast<float>(std::sqrt(shown));
}

// Vectors, their frame, and the mask where there is one. Without `keep` the vectors are only looked at, if
// they can be read again as they stand.
void PrepareField(const LicParams& params, const Field& field, bool keep, const graph::Workers& workers,
                  Prepared& out) {
  Lines& lines = out.lines;
  float* uv = nullptr;
  if (keep) {
    lines.uv_row = RowStride(2 * (ptrdiff_t{lines.width} + 2 + kRowSlack));
    out.uv = Memory(workers, lines.uv_row * (lines.height + 2), &uv);
    uv += lines.uv_row + 2;
    lines.uv = uv;
  }
  const RowFound all = CopyVectors(field, lines, workers, uv);
  // Squares must neither overflow nor vanish; a power of two changes no digit.
  const int exponent = all.largest > 0 ? std::ilogb(all.largest) : 0;
  const bool extreme = exponent < -20 || exponent > 20;
  if (!keep && extreme) return PrepareField(params, field, true, workers, out);

  if (all.masked) FillMask(field, workers, out);
  if (!keep) {
    out.longest = out.longest_shown = std::sqrt(all.squared);
  } else {
    const double most =
        extreme ? Scale(lines, params.speed ? 0 : exponent, workers, uv) : double{all.squared};
    out.longest = out.longest_shown = static_cast<float>(std::sqrt(most));
    if (params.units == LicUnits::kLatLong) ShrinkByLatitude(lines, uv, out);
    FrameRows(lines, uv);
  }
  lines.smallest = std::max(static_cast<float>(params.smallest * out.longest), 1e-18f);
}

// Codes of a row of noise.
class NoiseRow {
 public:
  NoiseRow(const LicParams& params, const Prepared& prepared) : params_(params), prepared_(prepared) {}
  void Fill(int y, uint32_t* to) const {
    const int width = prepared_.lines.width;
    if (params_.noise == LicNoise::kWhite && params_.spot == 1 && params_.magnitude != LicMagnitude::kNoise) {
      return kernels_.white_codes(RowKey(y, params_.seed), width, to);
    }
    for (int x = 0; x < width; ++x) to[x] = At(x, y);
  }

 private:
  uint32_t At(int x, int y) const {
    uint32_t seed = params_.seed;
    int spot = params_.spot;
    if (params_.magnitude == LicMagnitude::kNoise) {
      const int level = prepared_.SpotLevelAt(x, y);
      spot <<= level, seed += static_cast<uint32_t>(level);
    }
    x /= spot, y /= spot;
    switch (params_.noise) {
      case LicNoise::kWhite:
        break;
      case LicNoise::kSparse:
        return Mix(static_cast<uint32_t>(x) * kMixPlace ^ RowKey(y, seed)) < 0xffffffffu / kSparseShare ? 255
                                                                                                        : 0;
      case LicNoise::kFiltered: {
        double sum = 0;
        for (int j = -1; j <= 1; ++j) {
          const uint32_t key = RowKey(y + j, seed);
          for (int i = -1; i <= 1; ++i)
            sum += (2 - std::abs(i)) * (2 - std::abs(j)) * double(WhiteCode(x + i, key));
        }
        // The 1 2 1 weights leave 3/8 of the deviation; most of it is put back.
        return static_cast<uint32_t>(std::lround(std::clamp(127.5 + 2 * (sum / 16 - 127.5), 0.0, 255.0)));
      }
    }
    return WhiteCode(x, RowKey(y, seed));
  }

  const LicParams& params_;
  const Prepared& prepared_;
  const RowKernels kernels_ = FindRowKernels();
};

void PrepareTexture(const LicParams& params, const Field& field, const graph::Workers& workers,
                    Prepared& out) {
  Lines& lines = out.lines;
  const int width = lines.width;
  const bool cells = lines.integrator == LicIntegrator::kCell, noise = lines.texture == nullptr;
  uint32_t* cell = nullptr;
  uint8_t* codes = nullptr;
  if (cells) {
    lines.cell_row = RowStride(ptrdiff_t{width} + 2 + kRowSlack);
    out.cells = Memory(workers, lines.cell_row * (lines.height + 2), &cell);
    std::fill_n(cell, lines.cell_row, kCellEnd);
    std::fill_n(cell + lines.cell_row * (lines.height + 1), lines.cell_row, kCellEnd);
    cell += lines.cell_row + 1;
  }
  lines.cells = cell;
  if (noise) {
    lines.texture_in_cells = cells, lines.unit = cells ? 1.0f / static_cast<float>(kCellNoise) : 1.0f / 255;
    lines.texture_step = params.method == LicMethod::kShared && params.linear ? 2 : 1;
    lines.texture_row = (ptrdiff_t{width} * lines.texture_step + 2 * kCodeFrame + 127) / 128 * 128 + 64;
    if (!cells) {
      // The kernels read, but do not use, a few rows and columns beyond.
      out.texture = Memory(workers, lines.texture_row * (lines.height + 2 * kCodeFrame), &codes);
      codes += lines.texture_row * kCodeFrame + kCodeFrame;
    }
    lines.codes = codes;
    if (params.noise == LicNoise::kSparse) out.mean = 1.0 / kSparseShare;
  }
  const NoiseRow row_of(params, out);
  const RowKernels kernels = FindRowKernels();
  ForRows(lines.height, workers, [&](int y0, int y1) {
    std::vector<uint32_t> row(static_cast<size_t>(width) + kRowSlack), below(row.size());
    const bool pairs = codes != nullptr && lines.texture_step == 2;
    for (int y = y0; y < y1; ++y) {
      if (noise && (!pairs || y == y0)) row_of.Fill(y, row.data());
      if (codes != nullptr) {
        uint8_t* const to = codes + y * lines.texture_row;
        if (pairs) {
          if (y + 1 < lines.height) row_of.Fill(y + 1, below.data());
          for (int x = 0; x < width; ++x) {
            to[2 * x] = static_cast<uint8_t>(row[static_cast<size_t>(x)]);
            to[2 * x + 1] = static_cast<uint8_t>(below[static_cast<size_t>(x)]);
          }
          row.swap(below);
        } else {
          std::transform(row.begin(), row.begin() + width, to,
                         [](uint32_t c) { return static_cast<uint8_t>(c); });
        }
      }
      if (!cells) continue;
      uint32_t* const to = cell + y * lines.cell_row;
      const float* const vectors = lines.uv == nullptr ? field.Row(y) : lines.uv + y * lines.uv_row;
      kernels.cell_codes(vectors, row.data(), width, lines.smallest, to);
      to[-1] = to[width] = kCellEnd;
      for (int x = 0; lines.mask != nullptr && x < width; ++x) {
        if (lines.mask[ptrdiff_t{y} * width + x] != 0) to[x] = kCellEnd;
      }
    }
  });
}

// Whether second differences between neighbours, along some of the rows and columns, are not larger than
// first ones over two pixels: of white noise their squares are three times as large.
bool IsSmooth(const Lines& lines) {
  const auto at = [&](int x, int y) {
    const ptrdiff_t i = y * lines.texture_row + ptrdiff_t{x} * lines.texture_step;
    return lines.codes != nullptr ? lines.codes[i] / 255.0 : double{lines.texture[i]};
  };
  double slopes = 0, bends = 0;
  const auto look = [&](double before, double here, double after) {
    slopes += (after - before) * (after - before);
    bends += (before + after - 2 * here) * (before + after - 2 * here);
  };
  for (int y = 0; y < lines.height; y += 1 + lines.height / 16) {
    for (int x = 1; x + 1 < lines.width; ++x) look(at(x - 1, y), at(x, y), at(x + 1, y));
  }
  for (int x = 0; x < lines.width; x += 1 + lines.width / 16) {
    for (int y = 1; y + 1 < lines.height; ++y) look(at(x, y - 1), at(x, y), at(x, y + 1));
  }
  return bends < kSmoothShare * slopes;
}

}  // namespace

float Prepared::SizeAt(int x, int y) const {
  const float* v = lines.uv + y * lines.uv_row + 2 * ptrdiff_t{x};
  const float u = shrink.empty() ? v[0] : v[0] * shrink[static_cast<size_t>(y)];
  return longest_shown > 0 ? std::min(1.0f, std::sqrt(u * u + v[1] * v[1]) / longest_shown) : 0;
}

int Prepared::SpotLevelAt(int x, int y) const { return std::min(3, static_cast<int>(4 * SizeAt(x, y))); }

bool Prepared::IsStill(int x, int y) const {
  if (lines.uv == nullptr) {
    constexpr uint32_t kDirection = (1u << kCellNoiseShift) - 1;
    return (lines.cells[y * lines.cell_row + x] & kDirection) == kCellStill;
  }
  const float* v = lines.uv + y * lines.uv_row + 2 * ptrdiff_t{x};
  return v[0] * v[0] + v[1] * v[1] < lines.smallest * lines.smallest;
}

Prepared Prepare(const LicParams& params, const ConstImageView& field, int alpha, const ConstImageView& image,
                 const Roi& window, const graph::Workers& workers) {
  Prepared out;
  Lines& lines = out.lines;
  lines.width = window.width(), lines.height = window.height();
  if (window.empty() || field.roi.empty()) return out;
  lines.wrap = params.wrap, lines.integrator = params.integrator;
  lines.around_y = params.wrap == Wrap::kRepeat;
  lines.around_x = lines.around_y || params.units == LicUnits::kLatLong;
  lines.speed = params.speed, lines.linear = params.linear;
  lines.taps = TapsOf(params);
  lines.step = params.integrator == LicIntegrator::kCell ? 1.0f : static_cast<float>(params.step);

  const LicWeights weights = WeightsOf(params);
  lines.forward.assign(weights.forward.begin(), weights.forward.end());
  lines.backward.assign(weights.backward.begin(), weights.backward.end());
  lines.centre = static_cast<float>(weights.centre);
  // Added as the kernels add the weights of lines that end early.
  float ahead = 0, back = 0;
  for (const float w : lines.forward) ahead += w;
  for (const float w : lines.backward) back += w;
  lines.sum = ahead + back + lines.centre;
  const auto one = [](float w) { return w == 1; };
  lines.box = lines.centre == 1 && std::all_of(lines.forward.begin(), lines.forward.end(), one) &&
              std::all_of(lines.backward.begin(), lines.backward.end(), one);

  const Field vectors(params, field, alpha, window);
  const bool keep = params.integrator != LicIntegrator::kCell || params.magnitude != LicMagnitude::kNone ||
                    vectors.Row(0) == nullptr;
  PrepareField(params, vectors, keep, workers, out);
  // The error of a step grows with the fourth power of its turn: longer lines, shorter steps.
  // Lines that are shared pass beside the pixels' centres anyway: they take the steps of short ones.
  const bool shared = params.method == LicMethod::kShared;
  const double whole = lines.taps * params.step,
               reach = std::max(1.0, shared ? std::min(whole, 20.0) : whole);
  lines.turn = static_cast<float>(std::min(0.3, 0.15 * std::pow(20 / reach, 0.25)));
  // Errors of steps add up along the line, those of the bends between pixels first.
  const double longest_step = reach > 64 ? 2 : reach > 32 ? 4 : 10;
  // Lines that go far pass by saddles, which take what they are off by further apart, and go around centres.
  if (lines.integrator == LicIntegrator::kAdaptive && reach > 64)
    lines.error = static_cast<float>(std::clamp(0.3 / (reach * reach), 1e-5, 1e-3));
  const auto most_taps = [&](double pixels) {
    return std::clamp(static_cast<int>(pixels / params.step), 1, 40);
  };
  lines.taps_at_once = most_taps(longest_step);
  lines.taps_if_even = most_taps(reach > 32 ? longest_step : 2 * longest_step);
  if (lines.integrator == LicIntegrator::kAdaptive) lines.parts = static_cast<int>(std::ceil(params.step));
  double fastest = 1;
  if (params.speed) {
    fastest = out.longest;
    const double pixels = std::ceil(fastest * params.step);
    if (lines.integrator == LicIntegrator::kAdaptive) lines.integrator = LicIntegrator::kRk4;
    lines.error = 0;
    lines.parts = static_cast<int>(std::clamp(pixels, 1.0, 64.0));
  }
  lines.farthest =
      static_cast<float>(std::min(1e9, std::ceil(lines.taps * params.step * std::max(1.0, fastest))));

  if (image.data != nullptr) {
    lines.texture = reinterpret_cast<const float*>(image.data);
    lines.texture_row = image.row_stride / 4;
    lines.texture_step = image.channels, lines.channels = image.channels;
  }
  PrepareTexture(params, vectors, workers, out);
  if (params.method == LicMethod::kShared && params.linear) lines.smooth = IsSmooth(lines);
  if (params.magnitude == LicMagnitude::kLength) {
    float* reaches = nullptr;
    out.reach = Memory(workers, int64_t{lines.width} * lines.height, &reaches);
    lines.reach = reaches;
    ForRows(lines.height, workers, [&](int y0, int y1) {
      for (int y = y0; y < y1; ++y) {
        for (int x = 0; x < lines.width; ++x) {
          reaches[ptrdiff_t{y} * lines.width + x] = static_cast<float>(lines.taps) * out.SizeAt(x, y);
        }
      }
    });
  }
  return out;
}

}  // namespace tessera::ops::flow
