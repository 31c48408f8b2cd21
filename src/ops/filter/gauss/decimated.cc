// Decimation and interpolation by 4 around a small recursive Gaussian.
#include "ops/filter/gauss/decimated.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "base/arena.h"
#include "ops/filter/gauss/recursive.h"
#include "ops/filter/lines/extend.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/gauss/decimated.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::V;

constexpr int kLanes = s::kLanes;
// Four boxes of four, convolved; times 1/256.
constexpr float kTaps[13] = {1, 4, 10, 20, 31, 40, 44, 40, 31, 20, 10, 4, 1};

// Sum of kTaps / 256 times 13 rows, whole vectors.
void DecimateRows(const float* const* rows, int floats, float* out) {
  const D d;
  for (int i = 0; i < floats; i += 2 * kLanes) {
    V a = hn::Zero(d), b = a;
    HWY_UNROLL(13)
    for (int k = 0; k < 13; ++k) {
      const V w = hn::Set(d, kTaps[k] / 256);
      a = hn::MulAdd(hn::LoadU(d, rows[k] + i), w, a);
      b = hn::MulAdd(hn::LoadU(d, rows[k] + i + kLanes), w, b);
    }
    hn::StoreU(a, d, out + i);
    hn::StoreU(b, d, out + i + kLanes);
  }
}

// `count` pixels of the decimated row; the first one's taps begin at `in`.
void DecimatePixels(const float* in, int channels, int count, float* out) {
  if (channels == 4) {
    const hn::CappedTag<float, 4> d;
    for (int m = 0; m < count; ++m, in += 16, out += 4) {
      auto sum = hn::Zero(d);
      HWY_UNROLL(13)
      for (int k = 0; k < 13; ++k)
        sum = hn::MulAdd(hn::LoadU(d, in + 4 * k), hn::Set(d, kTaps[k] / 256), sum);
      hn::StoreU(sum, d, out);
    }
    return;
  }
  for (int m = 0; m < count; ++m, in += 4 * channels, out += channels) {
    for (int c = 0; c < channels; ++c) {
      float sum = 0;
      for (int k = 0; k < 13; ++k) sum += in[k * channels + c] * (kTaps[k] / 256);
      out[c] = sum;
    }
  }
}

// Weight of the decimated sample m at position n, both counted from the same origin.
constexpr float Weight(int n, int m) {
  const int at = n - 4 * m + 6;
  return at < 0 || at > 12 ? 0.0f : kTaps[at] / 64;
}

// One row between decimated rows: position `phase` after row[1].
void InterpolateRows(const float* const* rows, int phase, int floats, float* out) {
  const D d;
  const V w0 = hn::Set(d, Weight(phase, -1)), w1 = hn::Set(d, Weight(phase, 0)),
          w2 = hn::Set(d, Weight(phase, 1)), w3 = hn::Set(d, Weight(phase, 2));
  for (int i = 0; i < floats; i += kLanes) {
    V sum = hn::Mul(hn::LoadU(d, rows[0] + i), w0);
    sum = hn::MulAdd(hn::LoadU(d, rows[1] + i), w1, sum);
    sum = hn::MulAdd(hn::LoadU(d, rows[2] + i), w2, sum);
    hn::StoreU(hn::MulAdd(hn::LoadU(d, rows[3] + i), w3, sum), d, out + i);
  }
}

// `width` pixels; in[0] is the decimated sample before the one at the first pixel.
void InterpolatePixels(const float* in, int channels, int width, float* out, bool stream) {
  int x = 0;
  if (channels == 4) {
    const D d;
    constexpr int kPixels = s::kQuarter;
    HWY_ALIGN float weights[4][16];
    for (int m = 0; m < 4; ++m) {
      for (int i = 0; i < 16; ++i) weights[m][i] = Weight(i / 4, m - 1);
    }
    for (; x + 4 <= width; x += 4, in += 4) {
      for (int p = 0; p < 4; p += kPixels) {
        V sum = hn::Mul(hn::LoadDup128(d, in), hn::Load(d, weights[0] + 4 * p));
        for (int m = 1; m < 4; ++m)
          sum = hn::MulAdd(hn::LoadDup128(d, in + 4 * m), hn::Load(d, weights[m] + 4 * p), sum);
        float* to = out + (x + p) * 4;
        s::StoreOrStream(sum, d, to, stream && reinterpret_cast<uintptr_t>(to) % (4 * kLanes) == 0);
      }
    }
  }
  for (; x < width; ++x) {
    for (int c = 0; c < channels; ++c) {
      float sum = in[c] * Weight(x % 4, -1);
      for (int m = 1; m < 4; ++m) sum += in[m * channels + c] * Weight(x % 4, m - 1);
      out[x * channels + c] = sum;
    }
    if (x % 4 == 3) in += channels;
  }
}

DecimatedFunctions DecimatedOfTarget() {
  return {DecimateRows, DecimatePixels, InterpolateRows, InterpolatePixels, nullptr};
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(DecimatedOfTarget);

constexpr int kMargin = 32;  // floats behind a row that vectors may touch

// An axis of the small image: sample m lies at 4 (m - before) of the large one.
struct SmallAxis {
  int before, count;
};
SmallAxis MakeAxis(int length, const AxisBorder& border, int warm_up) {
  // Constant borders are constant two samples beyond the edge; others are carried as far as the blur sees.
  const int margin = border.rule == AxisBorder::kMapped ? warm_up : 3;
  return {margin, (length + 2) / 4 + 1 + 2 * margin};
}

double SmallSigma(double sigma) { return std::sqrt((sigma * sigma - 10) / 16); }

std::shared_ptr<std::byte> Floats(int64_t count) {
  return base::AllocateAligned(static_cast<size_t>(count) * 4);
}
float* AsFloats(const std::shared_ptr<std::byte>& p) { return reinterpret_cast<float*>(p.get()); }

}  // namespace

DecimatedFunctions ChooseDecimated() {
  DecimatedFunctions functions = HWY_DYNAMIC_DISPATCH(DecimatedOfTarget)();
  functions.tracks = ChooseGaussianTracks();
  return functions;
}

void RunDecimated(const DecimatedFunctions& functions, double sigma_x, double sigma_y,
                  const ConstImageView& in, const ImageView& out, BorderMode border, double border_value,
                  const graph::Workers& workers) {
  const Roi& r = out.roi;
  if (r.empty()) return;
  const int channels = out.channels, width = r.width(), height = r.height();
  const RecursiveGaussian gx = MakeRecursiveGaussian(SmallSigma(sigma_x)),
                          gy = MakeRecursiveGaussian(SmallSigma(sigma_y));
  const AxisBorder border_x(border, border_value, width), border_y(border, border_value, height);
  const SmallAxis x_axis = MakeAxis(width, border_x, gx.warm_up),
                  y_axis = MakeAxis(height, border_y, gy.warm_up);
  const ptrdiff_t small_stride = (static_cast<ptrdiff_t>(x_axis.count) * channels + kMargin + 15) / 16 * 16;
  const std::shared_ptr<std::byte> small_memory = Floats(small_stride * y_axis.count + kMargin);
  float* const small = AsFloats(small_memory);
  std::fill_n(small, small_stride * y_axis.count + kMargin, 0.0f);

  // Columns of a decimated row: 13 taps around 4 (m - before), which the border rule maps into the image.
  const int extended = 4 * (x_axis.count - 1) + 13, first_x = -4 * x_axis.before - 6;
  const int floats = width * channels;
  const auto value = static_cast<float>(border_y.value);
  std::vector<float> outside(static_cast<size_t>(floats) + kMargin, value);
  std::vector<std::shared_ptr<std::byte>> scratch(static_cast<size_t>(workers.count()));
  const auto row_at = [&](int y) -> const float* {
    const int shown = border_y.Shown(y);
    return shown < 0 ? outside.data() : reinterpret_cast<const float*>(in.data + shown * in.row_stride);
  };
  workers.For(y_axis.count, [&](int64_t i, int worker) {
    auto& memory = scratch[static_cast<size_t>(worker)];
    if (!memory) memory = Floats(static_cast<int64_t>(extended) * channels + 2 * kMargin);
    float* const line = AsFloats(memory);
    const int m = static_cast<int>(i);
    const float* rows[13];
    for (int k = 0; k < 13; ++k) rows[k] = row_at(4 * (m - y_axis.before) - 6 + k);
    // The image's own columns, then those beyond its ends.
    float* const own = line + static_cast<ptrdiff_t>(-first_x) * channels;
    const int whole = floats / kMargin * kMargin;
    functions.decimate_rows(rows, whole, own);
    if (whole < floats) {
      // The last samples through copies: beyond the image's end nothing may be read.
      float ends[13][kMargin] = {};
      const float* tails[13];
      float sums[kMargin];
      for (int k = 0; k < 13; ++k) {
        std::copy_n(rows[k] + whole, floats - whole, ends[k]);
        tails[k] = ends[k];
      }
      functions.decimate_rows(tails, kMargin, sums);
      std::copy_n(sums, floats - whole, own + whole);
    }
    for (int e = 0; e < extended; ++e) {
      const int x = first_x + e;
      if (x >= 0 && x < width) {
        e += width - 1;
        continue;
      }
      float* const to = line + static_cast<ptrdiff_t>(e) * channels;
      const int source = border_x.Shown(x);
      if (source < 0) {
        std::fill_n(to, channels, border_x.value);
      } else {
        std::copy_n(own + static_cast<ptrdiff_t>(source) * channels, channels, to);
      }
    }
    functions.decimate_pixels(line, channels, x_axis.count, small + m * small_stride);
  });

  const Roi small_roi{0, 0, x_axis.count, y_axis.count};
  const ImageView small_view(reinterpret_cast<std::byte*>(small), small_roi, channels, PixelType::kFloat, 4,
                             4 * channels, small_stride * 4);
  RunRecursive(functions.tracks, &gx, &gy, small_view, small_view, BorderMode::kClamp, 0, workers);

  const int needed = ((width + 3) / 4 + 3) * channels;
  for (auto& memory : scratch) memory.reset();
  const bool stream = r.pixels() * channels > (1 << 21);
  workers.For((height + 3) / 4, [&](int64_t i, int worker) {
    auto& memory = scratch[static_cast<size_t>(worker)];
    if (!memory) memory = Floats(needed + kMargin);
    float* const line = AsFloats(memory);
    const int m = static_cast<int>(i) + y_axis.before;
    const float* rows[4];
    for (int k = 0; k < 4; ++k) rows[k] = small + (m - 1 + k) * small_stride + (x_axis.before - 1) * channels;
    for (int phase = 0; phase < 4 && 4 * i + phase < height; ++phase) {
      functions.interpolate_rows(rows, phase, needed, line);
      functions.interpolate_pixels(line, channels, width,
                                   reinterpret_cast<float*>(out.data + (4 * i + phase) * out.row_stride),
                                   stream);
    }
  });
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
