// Samples of any type to exact doubles and back, in plain C++.
#include "verify/pixels.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

namespace tessera::verify {

double HalfToDouble(uint16_t bits) {
  const int exponent = (bits >> 10) & 31, fraction = bits & 1023;
  double v;
  if (exponent == 31) {
    v = fraction != 0 ? std::numeric_limits<double>::quiet_NaN() : std::numeric_limits<double>::infinity();
  } else if (exponent == 0) {
    v = std::ldexp(fraction, -24);
  } else {
    v = std::ldexp(1024 + fraction, exponent - 25);
  }
  return (bits & 0x8000) != 0 ? -v : v;
}

double HalfStep(double value) {
  if (!std::isfinite(value)) return 0;
  int exponent = 0;
  std::frexp(value, &exponent);  // |value| in [2^(exponent-1), 2^exponent)
  return std::ldexp(1.0, std::max(exponent - 11, -24));
}

double NearestHalf(double value) {
  if (!std::isfinite(value) || value == 0) return value;
  if (std::fabs(value) >= 65520) return std::copysign(std::numeric_limits<double>::infinity(), value);
  const double step = HalfStep(value);
  return std::nearbyint(value / step) * step;
}

double SampleOf(const ConstImageView& view, int x, int y, int c) {
  const std::byte* p = view.At(x, y, c);
  uint16_t word = 0;
  float real = 0;
  switch (view.type) {
    case PixelType::kUint8:
      return std::to_integer<int>(*p) / 255.0;
    case PixelType::kUint16:
      std::memcpy(&word, p, 2);
      return word / 65535.0;
    case PixelType::kHalf:
      std::memcpy(&word, p, 2);
      return HalfToDouble(word);
    case PixelType::kFloat:
      std::memcpy(&real, p, 4);
      return real;
  }
  return 0;
}

void ReadExact(const graph::PixelSource& source, reference::ImageD& out) {
  if (out.roi.empty()) return;
  ConstImageView view;
  std::vector<std::byte> rows;
  if (const auto resident = source.View()) {
    view = *resident;
  } else {
    const ImageSpec& spec = source.spec();
    const Roi roi{spec.data_window.x0, out.roi.y0, spec.data_window.x1, out.roi.y1};
    rows.resize(static_cast<size_t>(roi.pixels()) * spec.channels.size() * PixelBytes(spec.type));
    const ImageView all(rows.data(), roi, spec.channel_count(), spec.type);
    source.Open(0, spec.channel_count())->Read(all);
    view = all;
  }
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    for (int x = out.roi.x0; x < out.roi.x1; ++x) {
      for (int c = 0; c < out.channels; ++c) out.at(x, y, c) = SampleOf(view, x, y, c);
    }
  }
}

int CodeOf(double value, int max_code) {
  if (!(value > 0)) return 0;  // NaN too
  if (value >= 1) return max_code;
  return static_cast<int>(std::nearbyint(value * max_code));
}

}  // namespace tessera::verify
