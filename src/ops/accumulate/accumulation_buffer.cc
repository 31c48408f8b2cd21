// The accumulation buffer: GL's operators on double accumulators, in the precision of the format.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/geometry_text.h"
#include "ops/accumulate/sum_kernel.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/accumulate.h"
#include "tessera/render.h"

namespace tessera {
namespace {

void RequireShape(const ConstImageView& image, const Roi& window, int channels) {
  if (image.roi == window && image.channels == channels) return;
  const auto shape = [](const Roi& r, int n) {
    return base::GeometryText(r) + " of " + std::to_string(n) + " channels";
  };
  throw DataError("accumulation", "found an image of " + shape(image.roi, image.channels) + ", expected " +
                                      shape(window, channels));
}

ImageSpec SpecOf(const Roi& window, int channels, PixelType type) {
  ImageSpec spec(window.width(), window.height(), channels, type);
  spec.data_window = spec.display_window = window;
  return spec;
}

// f(sample as stored) of every sample, row after row.
template <class T, class F>
void Convert(const ConstImageView& image, float* out, F f) {
  for (int y = image.roi.y0; y < image.roi.y1; ++y) {
    for (int x = image.roi.x0; x < image.roi.x1; ++x) {
      for (int c = 0; c < image.channels; ++c) *out++ = f(*reinterpret_cast<const T*>(image.At(x, y, c)));
    }
  }
}

// The samples as floats, interleaved.
Image AsFloats(const ConstImageView& image) {
  if (image.type == PixelType::kHalf) {
    return Render(FromView(image, SpecOf(image.roi, image.channels, image.type)), PixelType::kFloat,
                  {.threads = 1});
  }
  const Image floats(SpecOf(image.roi, image.channels, PixelType::kFloat));
  auto* const out = reinterpret_cast<float*>(floats.view().data);
  if (image.type == PixelType::kUint8) {
    Convert<uint8_t>(image, out, [](uint8_t v) { return static_cast<float>(v / 255.0); });
  } else if (image.type == PixelType::kUint16) {
    Convert<uint16_t>(image, out, [](uint16_t v) { return static_cast<float>(v / 65535.0); });
  } else {
    Convert<float>(image, out, [](float v) { return v; });
  }
  return floats;
}

}  // namespace

AccumulationBuffer::AccumulationBuffer(const Roi& window, int channels, const AccumulationFormat& format)
    : window_(window), channels_(channels), format_(format) {
  if (window.empty() || channels < 1) {
    throw Error("accumulation", "found " + std::to_string(window.pixels()) + " pixels of " +
                                    std::to_string(channels) + " channels, expected at least one of each");
  }
  if (format.store == AccumulationFormat::Store::kFixed && (format.bits < 8 || format.bits > 32)) {
    throw Error("accumulation", "found " + std::to_string(format.bits) + " bits, expected 8 to 32");
  }
  samples_.resize(static_cast<size_t>(window.pixels()) * static_cast<size_t>(channels));
}

double AccumulationBuffer::Stored(double value) const {
  switch (format_.store) {
    case AccumulationFormat::Store::kFloat:
      return static_cast<float>(value);
    case AccumulationFormat::Store::kFixed:
      return ops::FixedPoint(value, format_.bits);
    default:
      return value;
  }
}

template <class F>
void AccumulationBuffer::ForEachRow(const ConstImageView& image, F f) {
  RequireShape(image, window_, channels_);
  const Image floats = AsFloats(image);
  const auto* const in = reinterpret_cast<const float*>(floats.view().data);
  for (size_t i = 0; i < samples_.size(); ++i)
    samples_[i] = Stored(f(samples_[i], static_cast<double>(in[i])));
}

void AccumulationBuffer::Clear(double value) { std::fill(samples_.begin(), samples_.end(), Stored(value)); }

void AccumulationBuffer::Load(const ConstImageView& image, double weight) {
  ForEachRow(image, [weight](double, double v) { return weight * v; });
}

void AccumulationBuffer::Accumulate(const ConstImageView& image, double weight) {
  ForEachRow(image, [weight](double a, double v) { return a + weight * v; });
}

void AccumulationBuffer::Add(double value) {
  for (double& a : samples_) a = Stored(a + value);
}

void AccumulationBuffer::Multiply(double factor) {
  for (double& a : samples_) a = Stored(a * factor);
}

void AccumulationBuffer::Return(const ImageView& image, double factor, bool clamp) const {
  RequireShape(image, window_, channels_);
  const Image floats(SpecOf(window_, channels_, PixelType::kFloat));
  auto* const out = reinterpret_cast<float*>(floats.view().data);
  for (size_t i = 0; i < samples_.size(); ++i) {
    const double v = factor * samples_[i];
    out[i] = static_cast<float>(clamp ? std::fmin(std::fmax(v, 0.0), 1.0) : v);
  }
  RenderInto(FromImage(floats), image, {.threads = 1});
}

double AccumulationBuffer::at(int x, int y, int channel) const {
  const auto row = static_cast<size_t>(y - window_.y0), column = static_cast<size_t>(x - window_.x0);
  return samples_.at((row * static_cast<size_t>(window_.width()) + column) * static_cast<size_t>(channels_) +
                     static_cast<size_t>(channel));
}

RunningTotal::RunningTotal(const Roi& window, int channels, int length)
    : window_(window), channels_(channels), length_(static_cast<size_t>(std::max(length, 0))) {
  if (window.empty() || channels < 1 || length < 1) {
    throw Error("running total", "found " + std::to_string(length) + " images of " +
                                     std::to_string(window.pixels()) + " pixels and " +
                                     std::to_string(channels) + " channels, expected at least one of each");
  }
  total_.resize(static_cast<size_t>(window.pixels()) * static_cast<size_t>(channels));
}

void RunningTotal::Resum(size_t sample) {
  double sum = 0;
  for (const Image& image : ring_) sum += reinterpret_cast<const float*>(image.view().data)[sample];
  total_[sample] = sum;
}

void RunningTotal::Push(const ConstImageView& image) {
  RequireShape(image, window_, channels_);
  Image taken = AsFloats(image);
  const auto* const in = reinterpret_cast<const float*>(taken.view().data);
  if (ring_.size() < length_) {
    for (size_t i = 0; i < total_.size(); ++i) total_[i] += static_cast<double>(in[i]);
    ring_.push_back(std::move(taken));
    ++pushed_;
    return;
  }
  const size_t oldest = static_cast<size_t>(pushed_) % length_;
  const Image left = std::exchange(ring_[oldest], taken);
  const auto* const out = reinterpret_cast<const float*>(left.view().data);
  // A total that a much larger sample leaves has lost its low bits; one in `length` is renewed in any case.
  constexpr double kLost = 0x1p20;
  for (size_t i = 0; i < total_.size(); ++i) {
    const double leaving = static_cast<double>(out[i]);
    total_[i] += static_cast<double>(in[i]) - leaving;
    if (!(std::fabs(leaving) <= kLost * std::fabs(total_[i])) && leaving != 0) Resum(i);
  }
  for (size_t i = oldest; i < total_.size(); i += length_) Resum(i);
  ++pushed_;
}

void RunningTotal::Mean(const ImageView& out) const {
  RequireShape(out, window_, channels_);
  if (ring_.empty()) throw Error("running total", "found no image yet, expected at least one");
  const Image floats(SpecOf(window_, channels_, PixelType::kFloat));
  auto* const to = reinterpret_cast<float*>(floats.view().data);
  const auto count = static_cast<double>(ring_.size());
  for (size_t i = 0; i < total_.size(); ++i) to[i] = static_cast<float>(total_[i] / count);
  RenderInto(FromImage(floats), out, {.threads = 1});
}

}  // namespace tessera
