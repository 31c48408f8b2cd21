// Blocks of noise for hypertexture, made by the noise operations.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>
#include <span>
#include <string>

#include "base/arena.h"
#include "model/volume_settings.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/ops/noise.h"
#include "tessera/render.h"

namespace tessera {
namespace {

constexpr int kBefore = 1, kBorder = 3;

// size^3 samples of a periodic noise, slice after slice; channel 0, or the first `channels` of it. `shift`:
// cells.
std::vector<float> Samples(NoiseParams params, int cells, int size, int channels, int period = 0,
                           const Vector3& shift = {0, 0, 0}) {
  if (period == 0) period = cells;
  params.dims = 3;
  params.frequency = cells;
  params.period = {period, period, period, 0};
  params.slices = size;
  for (size_t a = 0; a < 3; ++a) params.offset[a] = shift[a];
  params.offset[2] += 0.5 * cells / size;
  ImageSpec spec(size, size * size, channels);
  const Image image = Render(Noise(spec, params));
  const auto* p = reinterpret_cast<const float*>(image.view().data);
  return {p, p + static_cast<ptrdiff_t>(channels) * size * size * size};
}

// Octave k of one noise, as lookups at 2^k times the frequency find it.
std::vector<float> OctaveSamples(const NoiseParams& noise, int cells, int k, int size) {
  Vector3 shift;
  for (size_t a = 0; a < 3; ++a) shift[a] = double{ops::volume::kOctaveShifts[k & 7][a]} * cells;
  return Samples(noise, cells << k, size, 1, cells, shift);
}

std::vector<float> Content(NoiseContent content, int cells, int octaves, uint32_t seed, int size) {
  NoiseParams noise;
  noise.seed = seed;
  switch (content) {
    case NoiseContent::kNoise:
      return Samples(noise, cells, size, 1);
    case NoiseContent::kTurbulence: {
      std::vector<float> sum(static_cast<size_t>(size) * static_cast<size_t>(size) *
                             static_cast<size_t>(size));
      for (int k = 0; k < octaves; ++k) {
        const std::vector<float> one = OctaveSamples(noise, cells, k, size);
        const float weight = std::ldexp(1.0f, -k);
        for (size_t i = 0; i < sum.size(); ++i) sum[i] += weight * std::fabs(one[i]);
      }
      return sum;
    }
    case NoiseContent::kFbm:
      noise.octaves = octaves;
      noise.sum = NoiseSum::kFbm;
      return Samples(noise, cells, size, 1);
    case NoiseContent::kWood: {
      noise.octaves = octaves;
      noise.sum = NoiseSum::kFbm;
      std::vector<float> v = Samples(noise, cells, size, 1);
      for (size_t i = 0; i < v.size(); ++i) {
        const double x = (static_cast<double>(i % static_cast<size_t>(size)) + 0.5) / size;
        const double ring = 6 * x + 0.35 * v[i], share = ring - std::floor(ring);
        v[i] = static_cast<float>(share < 0.875 ? share / 0.875 : (1 - share) / 0.125);
      }
      return v;
    }
    case NoiseContent::kMarble: {
      noise.octaves = octaves;
      noise.sum = NoiseSum::kTurbulence;
      std::vector<float> v = Samples(noise, cells, size, 1);
      for (size_t i = 0; i < v.size(); ++i) {
        const double x = (static_cast<double>(i % static_cast<size_t>(size)) + 0.5) / size;
        v[i] = static_cast<float>(0.5 + 0.5 * std::sin(2 * std::numbers::pi * (2 * x + 0.8 * v[i])));
      }
      return v;
    }
    case NoiseContent::kGradient: {
      noise.output = NoiseOutput::kGradient;
      std::vector<float> v = Samples(noise, cells, size, 4);
      for (size_t i = 0; i < v.size(); i += 4) {
        const float value = v[i], length = std::hypot(v[i + 1], v[i + 2], v[i + 3]);
        for (size_t c = 0; c < 3; ++c) v[i + c] = length > 0 ? v[i + c + 1] / length : 0;
        v[i + 3] = value;
      }
      return v;
    }
    default: {
      const bool octave = content == NoiseContent::kFourOctaves;
      std::vector<float> v(static_cast<size_t>(4) * size * size * size);
      for (int c = 0; c < 4; ++c) {
        noise.seed = seed + static_cast<uint32_t>(octave ? 0 : 101 * c);
        const std::vector<float> one =
            octave ? OctaveSamples(noise, cells, c, size) : Samples(noise, cells, size, 1);
        for (size_t i = 0; i < one.size(); ++i) v[4 * i + static_cast<size_t>(c)] = one[i];
      }
      return v;
    }
  }
}

void Require(bool valid, const char* what, int found, const char* expected) {
  if (!valid)
    throw Error("noise block",
                std::string("found ") + what + " " + std::to_string(found) + ", expected " + expected);
}

// Zeros; samples of a march lie anywhere in them.
std::shared_ptr<uint16_t[]> Codes(size_t count) {
  const std::shared_ptr<std::byte> memory =
      base::AllocateAligned(count * sizeof(uint16_t), base::Access::kScattered);
  std::memset(memory.get(), 0, count * sizeof(uint16_t));
  return {memory, reinterpret_cast<uint16_t*>(memory.get())};
}

}  // namespace

// As the march reads samples.
NoiseBlock::NoiseBlock(std::span<const float> values, int size, int channel_count) {
  Require(size >= 4 && size <= 256, "size", size, "4 to 256");
  Require(channel_count == 1 || channel_count == 4, "channels", channel_count, "1 or 4");
  const auto expected = static_cast<size_t>(channel_count) * static_cast<size_t>(size * size * size);
  if (values.size() != expected) {
    throw Error("noise block",
                "found " + std::to_string(values.size()) + " samples, expected " + std::to_string(expected));
  }
  if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); }))
    throw Error("noise block", "found samples that are not finite, expected numbers");
  auto data = std::make_shared<Data>();
  Data& d = *data;
  d.size = size;
  d.channels = channel_count;
  d.row = size + kBorder;
  d.slice = d.row * d.row;
  const auto channels = static_cast<size_t>(d.channels);
  const size_t texels = static_cast<size_t>(d.slice) * static_cast<size_t>(d.row);
  d.samples = Codes(texels * channels + 16);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double range = std::max<double>(*high - *low, 1e-30);
  d.scale = static_cast<float>(range / 65535);
  d.bias = *low;
  const auto wrapped = [&](int i) { return static_cast<size_t>((i + size) % size); };
  const auto value = [&](int x, int y, int z, size_t c) {
    return values[((wrapped(z) * size + wrapped(y)) * size + wrapped(x)) * channels + c];
  };
  size_t at = 0;
  for (int z = -kBefore; z < size + 2; ++z) {
    for (int y = -kBefore; y < size + 2; ++y) {
      for (int x = -kBefore; x < size + 2; ++x) {
        for (size_t c = 0; c < channels; ++c) {
          d.samples[at++] = static_cast<uint16_t>(std::lrint((value(x, y, z, c) - *low) / range * 65535));
        }
      }
    }
  }
  if (channels == 1) {
    const auto up = static_cast<size_t>(d.row), deep = static_cast<size_t>(d.slice);
    d.cells = Codes(4 * texels + 8);
    const auto sample = [&](size_t i) { return d.samples[std::min(i, texels - 1)]; };
    for (size_t i = 0; i < texels; ++i) {
      const uint16_t corners[4] = {sample(i), sample(i + up), sample(i + deep), sample(i + deep + up)};
      std::copy_n(corners, 4, &d.cells[4 * i]);
    }
  }
  d.low = d.high = values[0];
  for (int z = 0; z < size; ++z) {
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double v = value(x, y, z, 0);
        d.low = std::min(d.low, v);
        d.high = std::max(d.high, v);
        d.mean += v;
        const double slopes[3] = {value(x + 1, y, z, 0) - v, value(x, y + 1, z, 0) - v,
                                  value(x, y, z + 1, 0) - v};
        for (int a = 0; a < 3; ++a) d.slopes[a] = std::max(d.slopes[a], std::fabs(slopes[a]) * size);
      }
    }
  }
  d.mean /= static_cast<double>(size) * size * size;
  data_ = std::move(data);
}

NoiseBlock::NoiseBlock(NoiseContent content, int cells, int octaves, uint32_t seed, int size) {
  Require(size >= 4 && size <= 256, "size", size, "4 to 256");
  Require(cells >= 1 && cells <= size, "cells", cells, "1 to the size");
  Require(octaves >= 1 && octaves <= 16, "octaves", octaves, "1 to 16");
  const int channels = content >= NoiseContent::kFourOctaves ? 4 : 1;
  std::string key = "noise block";
  for (const int64_t n :
       {int64_t{static_cast<int>(content)}, int64_t{cells}, int64_t{octaves}, int64_t{seed}, int64_t{size}})
    key += " " + std::to_string(n);
  const auto texels = static_cast<size_t>(size + kBorder) * static_cast<size_t>(size + kBorder) *
                      static_cast<size_t>(size + kBorder);
  *this = *Context::Default().Cached<NoiseBlock>(key, (channels == 1 ? 10 : 8) * texels, [&] {
    return std::make_shared<const NoiseBlock>(Content(content, cells, octaves, seed, size), size, channels);
  });
}

int NoiseBlock::size() const { return empty() ? 0 : data_->size; }
int NoiseBlock::channels() const { return empty() ? 0 : data_->channels; }
double NoiseBlock::slope() const {
  return empty() ? 0 : std::hypot(data_->slopes[0], data_->slopes[1], data_->slopes[2]);
}
double NoiseBlock::low() const { return empty() ? 0 : data_->low; }
double NoiseBlock::high() const { return empty() ? 0 : data_->high; }

void NoiseBlock::Sample(const Vector3& p, double* values) const {
  const Data& d = *data_;
  int cell[3];
  double f[3];
  for (size_t a = 0; a < 3; ++a) {
    const double u = (p[a] - std::floor(p[a])) * d.size - 0.5, whole = std::floor(u);
    cell[a] = static_cast<int>(whole);
    f[a] = u - whole;
  }
  for (int c = 0; c < d.channels; ++c) values[c] = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    const double w = (i ? f[0] : 1 - f[0]) * (j ? f[1] : 1 - f[1]) * (k ? f[2] : 1 - f[2]);
    const auto at =
        static_cast<size_t>((cell[2] + k + 1) * d.slice + (cell[1] + j + 1) * d.row + cell[0] + i + 1);
    for (int c = 0; c < d.channels; ++c) {
      values[c] +=
          w * (static_cast<double>(d.scale) * d.samples[at * static_cast<size_t>(d.channels) + c] + d.bias);
    }
  }
}

}  // namespace tessera
