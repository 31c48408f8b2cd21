// Decimation and interpolation by 4 around a small recursive Gaussian.
#include "ops/filter/gauss/decimated.h"

#include <algorithm>
#include <cmath>
#include <cstring>
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

std::shared_ptr<std::byte> Floats(Context& context, int64_t count) {
  return base::AllocateAligned(context, static_cast<size_t>(count) * 4);
}
float* AsFloats(const std::shared_ptr<std::byte>& p) { return reinterpret_cast<float*>(p.get()); }

}  // namespace

DecimatedFunctions ChooseDecimated() {
  DecimatedFunctions functions = HWY_DYNAMIC_DISPATCH(DecimatedOfTarget)();
  functions.tracks = ChooseGaussianTracks();
  return functions;
}

namespace {

// An image at a quarter of its resolution: made row by row, blurred, and made large again row by row.
class SmallImage {
 public:
  SmallImage(const DecimatedFunctions& functions, double sigma_x, double sigma_y, int width, int height,
             int channels, Wrap wrap, double border_value, Context& context)
      : functions_(functions),
        gx_(MakeRecursiveGaussian(SmallSigma(sigma_x))),
        gy_(MakeRecursiveGaussian(SmallSigma(sigma_y))),
        border_x_(wrap, border_value, width),
        border_y_(wrap, border_value, height),
        x_axis_(MakeAxis(width, border_x_, gx_.warm_up)),
        y_axis_(MakeAxis(height, border_y_, gy_.warm_up)),
        width_(width),
        height_(height),
        channels_(channels),
        stride_((static_cast<ptrdiff_t>(x_axis_.count) * channels + kMargin + 15) / 16 * 16),
        memory_(Floats(context, stride_ * y_axis_.count + kMargin)),
        outside_(static_cast<size_t>(width * channels) + kMargin, static_cast<float>(border_y_.value)) {
    std::fill_n(AsFloats(memory_), stride_ * y_axis_.count + kMargin, 0.0f);
  }

  int rows() const { return y_axis_.count; }
  // Row y of the large image is the last that row m of the small one is made from.
  int LastRowOf(int m) const { return std::clamp(4 * (m - y_axis_.before) + 6, 0, height_ - 1); }
  // Floats of scratch memory for the two below.
  int64_t LineFloats() const { return static_cast<int64_t>(Extended()) * channels_ + 2 * kMargin; }

  // `row(y)`: a row of the large image, 0 <= y < height.
  template <typename Row>
  void Decimate(int m, const Row& row, float* line) const {
    const float* rows[13];
    for (int k = 0; k < 13; ++k) rows[k] = RowAt(4 * (m - y_axis_.before) - 6 + k, row);
    // The image's own columns, then those beyond its ends.
    const int first_x = -4 * x_axis_.before - 6, floats = width_ * channels_;
    float* const own = line + static_cast<ptrdiff_t>(-first_x) * channels_;
    const int whole = floats / kMargin * kMargin;
    functions_.decimate_rows(rows, whole, own);
    if (whole < floats) {
      // The last samples through copies: beyond the image's end nothing may be read.
      float ends[13][kMargin] = {};
      const float* tails[13];
      float sums[kMargin];
      for (int k = 0; k < 13; ++k) {
        std::copy_n(rows[k] + whole, floats - whole, ends[k]);
        tails[k] = ends[k];
      }
      functions_.decimate_rows(tails, kMargin, sums);
      std::copy_n(sums, floats - whole, own + whole);
    }
    for (int e = 0; e < Extended(); ++e) {
      const int x = first_x + e;
      if (x >= 0 && x < width_) {
        e += width_ - 1;
        continue;
      }
      float* const to = line + static_cast<ptrdiff_t>(e) * channels_;
      const int source = border_x_.Shown(x);
      if (source < 0) {
        std::fill_n(to, channels_, border_x_.value);
      } else {
        std::copy_n(own + static_cast<ptrdiff_t>(source) * channels_, channels_, to);
      }
    }
    functions_.decimate_pixels(line, channels_, x_axis_.count, AsFloats(memory_) + m * stride_);
  }

  void Blur(const graph::Workers& workers) const {
    const ImageView view(memory_.get(), {0, 0, x_axis_.count, y_axis_.count}, channels_, PixelType::kFloat, 4,
                         4 * channels_, stride_ * 4);
    RunRecursive(functions_.tracks, &gx_, &gy_, view, view, Wrap::kClamp, 0, workers);
  }

  bool IsFinite() const {
    const float* const floats = AsFloats(memory_);
    return std::all_of(floats, floats + stride_ * y_axis_.count, [](float f) { return std::isfinite(f); });
  }

  // Row y of the result.
  void Interpolate(int y, float* line, float* out, bool stream) const {
    const int m = y / 4 + y_axis_.before;
    const float* rows[4];
    for (int k = 0; k < 4; ++k)
      rows[k] = AsFloats(memory_) + (m - 1 + k) * stride_ + (x_axis_.before - 1) * channels_;
    functions_.interpolate_rows(rows, y % 4, ((width_ + 3) / 4 + 3) * channels_, line);
    functions_.interpolate_pixels(line, channels_, width_, out, stream);
  }

 private:
  // Columns of a decimated row: 13 taps around 4 (m - before), which the border rule maps into the image.
  int Extended() const { return 4 * (x_axis_.count - 1) + 13; }

  template <typename Row>
  const float* RowAt(int y, const Row& row) const {
    const int shown = border_y_.Shown(y);
    return shown < 0 ? outside_.data() : row(shown);
  }

  const DecimatedFunctions functions_;
  const RecursiveGaussian gx_, gy_;
  const AxisBorder border_x_, border_y_;
  const SmallAxis x_axis_, y_axis_;
  const int width_, height_, channels_;
  const ptrdiff_t stride_;
  const std::shared_ptr<std::byte> memory_;
  const std::vector<float> outside_;
};

// The same with rows as they come. Of the large image the last thirteen are held.
class DecimatedRows final : public graph::RowsStage {
 public:
  DecimatedRows(const Roi& window, int channels, double sigma_x, double sigma_y, Wrap wrap, double value,
                Context& context)
      : window_(window),
        context_(context),
        floats_(static_cast<size_t>(window.width() * channels)),
        small_(ChooseDecimated(), sigma_x, sigma_y, window.width(), window.height(), channels, wrap, value,
               context),
        line_(Floats(context, small_.LineFloats())),
        held_(floats_ * kHeld) {}

  void Take(const ConstImageView& rows) override {
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      const int at = y - window_.y0;
      std::memcpy(Held(at), rows.At(rows.roi.x0, y), floats_ * sizeof(float));
      for (; next_ < small_.rows() && small_.LastRowOf(next_) <= at; ++next_)
        small_.Decimate(
            next_, [this](int row) { return Held(row); }, AsFloats(line_));
    }
  }
  bool End(const graph::Workers& workers) override {
    small_.Blur(workers);
    return small_.IsFinite();
  }
  void Give(const ImageView& rows) const override {
    const std::shared_ptr<std::byte> line = Floats(context_, small_.LineFloats());
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y)
      small_.Interpolate(y - window_.y0, AsFloats(line), reinterpret_cast<float*>(rows.At(rows.roi.x0, y)),
                         false);
  }

 private:
  static constexpr int kHeld = 16;
  float* Held(int row) { return held_.data() + floats_ * static_cast<size_t>(row % kHeld); }

  const Roi window_;
  Context& context_;
  const size_t floats_;
  SmallImage small_;
  const std::shared_ptr<std::byte> line_;
  std::vector<float> held_;
  int next_ = 0;  // row of the small image
};

}  // namespace

std::unique_ptr<graph::RowsStage> MakeDecimatedRows(double sigma_x, double sigma_y, const ImageSpec& image,
                                                    Wrap wrap, double border_value, Context& context) {
  const Roi& window = image.data_window;
  if (window.empty() || AxisBorder(wrap, border_value, 1).rule == AxisBorder::kMapped) return nullptr;
  return std::make_unique<DecimatedRows>(window, image.channel_count(), sigma_x, sigma_y, wrap, border_value,
                                         context);
}

void RunDecimated(const DecimatedFunctions& functions, double sigma_x, double sigma_y,
                  const ConstImageView& in, const ImageView& out, Wrap wrap, double border_value,
                  const graph::Workers& workers) {
  const Roi& r = out.roi;
  if (r.empty()) return;
  const SmallImage small(functions, sigma_x, sigma_y, r.width(), r.height(), out.channels, wrap, border_value,
                         workers.context());
  std::vector<std::shared_ptr<std::byte>> scratch(static_cast<size_t>(workers.count()));
  const auto line_of = [&](int worker) {
    auto& memory = scratch[static_cast<size_t>(worker)];
    if (!memory) memory = Floats(workers.context(), small.LineFloats());
    return AsFloats(memory);
  };
  workers.For(small.rows(), [&](int64_t m, int worker) {
    const auto row = [&in](int y) { return reinterpret_cast<const float*>(in.data + y * in.row_stride); };
    small.Decimate(static_cast<int>(m), row, line_of(worker));
  });
  small.Blur(workers);
  const bool stream = r.pixels() * out.channels > (1 << 21);
  workers.For((r.height() + 3) / 4, [&](int64_t i, int worker) {
    const int first = 4 * static_cast<int>(i);
    for (int y = first; y < std::min(first + 4, r.height()); ++y)
      small.Interpolate(y, line_of(worker), reinterpret_cast<float*>(out.data + y * out.row_stride), stream);
  });
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
