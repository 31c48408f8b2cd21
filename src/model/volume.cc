// Volumes in memory: allocation, conversion, voxels one by one.
#include "tessera/volume.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/arena.h"
#include "base/half.h"
#include "base/number_text.h"
#include "model/brick_places.h"
#include "model/volume_data.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera {
namespace {

constexpr char kSubject[] = "volume";

double MostOf(PixelType type) {
  return type == PixelType::kUint8 ? 255 : type == PixelType::kUint16 ? 65535 : 1;
}

double ReadCode(const std::byte* p, PixelType type) {
  switch (type) {
    case PixelType::kUint8:
      return std::to_integer<int>(*p);
    case PixelType::kUint16: {
      uint16_t v;
      std::memcpy(&v, p, 2);
      return v;
    }
    case PixelType::kHalf: {
      uint16_t v;
      std::memcpy(&v, p, 2);
      return base::FloatFromHalf(v);
    }
    default: {
      float v;
      std::memcpy(&v, p, 4);
      return v;
    }
  }
}

void WriteCode(std::byte* p, PixelType type, double code) {
  switch (type) {
    case PixelType::kUint8:
      *p = static_cast<std::byte>(std::lrint(std::clamp(code, 0.0, 255.0)));
      return;
    case PixelType::kUint16: {
      const auto v = static_cast<uint16_t>(std::lrint(std::clamp(code, 0.0, 65535.0)));
      std::memcpy(p, &v, 2);
      return;
    }
    case PixelType::kHalf: {
      const uint16_t v = base::HalfFromFloat(static_cast<float>(code));
      std::memcpy(p, &v, 2);
      return;
    }
    default: {
      const auto v = static_cast<float>(code);
      std::memcpy(p, &v, 4);
    }
  }
}

void Check(const VolumeSpec& s) {
  const auto size = [&] {
    return std::to_string(s.size[0]) + "x" + std::to_string(s.size[1]) + "x" + std::to_string(s.size[2]);
  };
  double voxels = 1;
  for (int n : s.size) {
    if (n < 1)
      throw Error(kSubject, "found a size of " + size() + ", expected at least 1 voxel along every axis");
    voxels *= std::ceil(n / static_cast<double>(model::kBrickEdge)) * model::kBrickEdge;
  }
  if (voxels >= 0x1p38) throw Error(kSubject, "found " + size() + " voxels, expected fewer than 2^38");
  for (size_t a = 0; a < 3; ++a) {
    if (!(s.spacing[a] > 0) || !std::isfinite(s.spacing[a])) {
      throw Error(kSubject,
                  "found a spacing of " + base::NumberText(s.spacing[a]) + ", expected positive numbers");
    }
    if (!std::isfinite(s.origin[a])) {
      throw Error(kSubject,
                  "found an origin of " + base::NumberText(s.origin[a]) + ", expected finite numbers");
    }
  }
  if (!std::isfinite(s.scale) || !std::isfinite(s.bias)) {
    throw Error(kSubject, "found a scale or bias that is not finite");
  }
}

}  // namespace

namespace model {

VolumeData::VolumeData(const VolumeSpec& s) : spec(s) {
  Check(s);
  Allocate();
  code_scale = spec.scale / MostOf(spec.type);
  code_bias = spec.bias;
}

double VolumeData::Code(int i, int j, int k) const {
  return ReadCode(samples + IndexOf(i, j, k) * static_cast<int64_t>(PixelBytes(spec.type)), spec.type);
}

void VolumeData::SetCode(int i, int j, int k, double code) {
  if (std::isnan(code)) ++nan_samples, code = 0;
  const auto pixel = static_cast<int64_t>(PixelBytes(spec.type));
  if (pages == nullptr) return WriteCode(samples + IndexOf(i, j, k) * pixel, spec.type, code);
  std::byte sample[sizeof(float)];
  WriteCode(sample, spec.type, code);
  const BrickPlaces across(i, spec.size[0]), down(j, spec.size[1]), deep(k, spec.size[2]);
  for (const BrickPlace& z : deep) {
    for (const BrickPlace& y : down) {
      for (const BrickPlace& x : across) {
        const int64_t index = (z.brick * bricks[1] + y.brick * bricks[0] + x.brick) * kBrickSamples +
                              z.local * slice + y.local * row + x.local;
        std::memcpy(samples + index * pixel, sample, static_cast<size_t>(pixel));
      }
    }
  }
}

void VolumeData::SetCodes(int i0, int count, int j, int k, const double* codes) {
  if (pages != nullptr || spec.type == PixelType::kHalf) {
    for (int i = 0; i < count; ++i) SetCode(i0 + i, j, k, codes[i]);
    return;
  }
  for (int i = 0; i < count; ++i) nan_samples += std::isnan(codes[i]) ? 1 : 0;
  std::byte* const to = samples + IndexOf(i0, j, k) * static_cast<int64_t>(PixelBytes(spec.type));
  const auto write = [&](auto type, const auto& round) {
    using T = decltype(type);
    T* const p = reinterpret_cast<T*>(to);
    for (int i = 0; i < count; ++i) p[i] = static_cast<T>(round(std::isnan(codes[i]) ? 0 : codes[i]));
  };
  // rint, as it becomes an instruction, lrint a call.
  if (spec.type == PixelType::kUint8) {
    write(uint8_t{}, [](double c) { return static_cast<int>(std::rint(std::clamp(c, 0.0, 255.0))); });
  } else if (spec.type == PixelType::kUint16) {
    write(uint16_t{}, [](double c) { return static_cast<int>(std::rint(std::clamp(c, 0.0, 65535.0))); });
  } else {
    write(float{}, [](double c) { return c; });
  }
}

void VolumeData::FillBorder() {
  if (pages != nullptr) return;
  const auto pixel = static_cast<int64_t>(PixelBytes(spec.type));
  const int nx = spec.size[0], ny = spec.size[1], nz = spec.size[2];
  for (int k = 0; k < nz; ++k) {
    std::byte* const plane = samples + k * slice * pixel;
    for (int j = 0; j < ny; ++j) {
      std::byte* const line = plane + j * row * pixel;
      std::memcpy(line - pixel, line, static_cast<size_t>(pixel));
      for (int i = 0; i < kVolumeBehind; ++i) {
        std::memcpy(line + (nx + i) * pixel, line + (nx - 1) * pixel, static_cast<size_t>(pixel));
      }
    }
    std::byte* const first = plane - pixel;
    const auto bytes = static_cast<size_t>(row * pixel);
    std::memcpy(first - row * pixel, first, bytes);
    for (int j = 0; j < kVolumeBehind; ++j) {
      std::memcpy(first + (ny + j) * row * pixel, first + (ny - 1) * row * pixel, bytes);
    }
  }
  std::byte* const first = samples - (row + 1) * pixel;
  const auto bytes = static_cast<size_t>(slice * pixel);
  std::memcpy(first - slice * pixel, first, bytes);
  for (int k = 0; k < kVolumeBehind; ++k) {
    std::memcpy(first + (nz + k) * slice * pixel, first + (nz - 1) * slice * pixel, bytes);
  }
}

}  // namespace model

VolumeSpec VolumeSpec::Centred(const std::array<int, 3>& size, PixelType type, const Vector3& proportions) {
  VolumeSpec s;
  s.size = size;
  s.type = type;
  double longest = 0;
  for (size_t a = 0; a < 3; ++a) longest = std::max(longest, size[a] * proportions[a]);
  if (!(longest > 0)) longest = 1;
  for (size_t a = 0; a < 3; ++a) {
    s.spacing[a] = proportions[a] * 2 / longest;
    s.origin[a] = -0.5 * (size[a] - 1.0) * s.spacing[a];
  }
  return s;
}

Volume::Volume(const VolumeSpec& spec) : data_(std::make_shared<model::VolumeData>(spec)) {}

Volume::Volume(const VolumeSpec& spec, const std::function<double(const Vector3&)>& f) : Volume(spec) {
  if (!f) throw Error(kSubject, "found no function, expected one");
  const bool zero = data_->code_scale == 0;
  for (int k = 0; k < spec.size[2]; ++k) {
    for (int j = 0; j < spec.size[1]; ++j) {
      for (int i = 0; i < spec.size[0]; ++i) {
        const double value = f(spec.Position(i, j, k));
        data_->SetCode(i, j, k, zero ? 0 : (value - data_->code_bias) / data_->code_scale);
      }
      data_->Trim();
    }
  }
  data_->FillBorder();
}

Volume::Volume(const VolumeSpec& spec, const void* samples, PixelType type) : Volume(spec) {
  if (samples == nullptr) throw Error(kSubject, "found no samples, expected those of all voxels");
  const double factor = MostOf(spec.type) / MostOf(type);
  const auto* p = static_cast<const std::byte*>(samples);
  const bool same = type == spec.type;
  const auto row = static_cast<size_t>(spec.size[0]) * PixelBytes(type);
  for (int k = 0; k < spec.size[2]; ++k) {
    for (int j = 0; j < spec.size[1]; ++j, p += row) {
      if (same) {
        data_->SetRow(j, k, p);
        continue;
      }
      for (int i = 0; i < spec.size[0]; ++i) {
        data_->SetCode(i, j, k, ReadCode(p + static_cast<size_t>(i) * PixelBytes(type), type) * factor);
      }
      data_->Trim();
    }
  }
  data_->FillBorder();
}

Volume Volume::FromImage(const ConstImageView& stack, int slices, int channel, const Vector3& proportions,
                         size_t memory) {
  const int height = stack.roi.height();
  if (slices < 1 || height % std::max(slices, 1) != 0 || height == 0) {
    throw DataError(kSubject, "found " + std::to_string(slices) + " slices in an image of " +
                                  std::to_string(height) + " rows, expected a divisor");
  }
  if (channel < 0 || channel >= stack.channels) {
    throw Error(kSubject,
                "found channel " + std::to_string(channel) + " of " + std::to_string(stack.channels));
  }
  const int rows = height / slices;
  VolumeSpec spec = VolumeSpec::Centred({stack.roi.width(), rows, slices}, stack.type, proportions);
  spec.memory = memory;
  Volume v(spec);
  for (int k = 0; k < slices; ++k) {
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < stack.roi.width(); ++i) {
        const int y = stack.roi.y0 + k * rows + (rows - 1 - j);
        v.data_->SetCode(i, j, k, ReadCode(stack.At(stack.roi.x0 + i, y, channel), stack.type));
      }
      v.data_->Trim();
    }
  }
  v.data_->FillBorder();
  return v;
}

const VolumeSpec& Volume::spec() const {
  if (empty()) throw Error(kSubject, "found an empty volume");
  return data_->spec;
}

double Volume::At(int i, int j, int k) const {
  const auto& n = spec().size;
  const auto in = [&](int v, size_t a) { return std::clamp(v, 0, n[a] - 1); };
  return data_->code_scale * data_->Code(in(i, 0), in(j, 1), in(k, 2)) + data_->code_bias;
}

namespace {
struct Cell {
  int i;
  double f;
};
Cell CellOf(double x, int n) {
  x = std::isnan(x) ? 0 : std::clamp(x, 0.0, n - 1.0);
  const double i = std::floor(x);
  return {static_cast<int>(i), x - i};
}
}  // namespace

double Volume::Sample(double i, double j, double k) const {
  const auto& n = spec().size;
  const Cell x = CellOf(i, n[0]), y = CellOf(j, n[1]), z = CellOf(k, n[2]);
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
    sum += (a ? x.f : 1 - x.f) * (b ? y.f : 1 - y.f) * (c ? z.f : 1 - z.f) *
           data_->Code(x.i + a, y.i + b, z.i + c);
  }
  return data_->code_scale * sum + data_->code_bias;
}

Vector3 Volume::Gradient(double i, double j, double k) const {
  const auto& n = spec().size;
  const Cell x = CellOf(i, n[0]), y = CellOf(j, n[1]), z = CellOf(k, n[2]);
  Vector3 g = {0, 0, 0};
  for (int corner = 0; corner < 8; ++corner) {
    const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
    const double w =
        0.5 * data_->code_scale * (a ? x.f : 1 - x.f) * (b ? y.f : 1 - y.f) * (c ? z.f : 1 - z.f);
    const int u = x.i + a, v = y.i + b, s = z.i + c;
    g[0] += w * (data_->Code(u + 1, v, s) - data_->Code(u - 1, v, s));
    g[1] += w * (data_->Code(u, v + 1, s) - data_->Code(u, v - 1, s));
    g[2] += w * (data_->Code(u, v, s + 1) - data_->Code(u, v, s - 1));
  }
  return g;
}

std::array<double, 2> Volume::Range() const {
  spec();
  const auto codes = data_->CodeRange([](int64_t count, const std::function<void(int64_t)>& task) {
    for (int64_t i = 0; i < count; ++i) task(i);
  });
  const double a = data_->code_scale * codes[0] + data_->code_bias,
               b = data_->code_scale * codes[1] + data_->code_bias;
  return {std::min(a, b), std::max(a, b)};
}

int64_t Volume::nan_samples() const { return empty() ? 0 : data_->nan_samples; }

size_t Volume::bytes() const {
  if (empty()) return 0;
  if (data_->pages != nullptr)
    return std::min(data_->pages->bytes(), data_->pages->budget()) + data_->extra_bytes();
  return static_cast<size_t>(data_->slice * (data_->spec.size[2] + model::kVolumeBorder)) *
             PixelBytes(data_->spec.type) +
         data_->extra_bytes();
}

}  // namespace tessera
