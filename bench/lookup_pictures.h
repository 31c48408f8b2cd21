// What the lookups are measured on: pictures, coordinates, and the functions that tables are made of.
#ifndef TESSERA_BENCH_LOOKUP_PICTURES_H_
#define TESSERA_BENCH_LOOKUP_PICTURES_H_

#include <algorithm>
#include <cmath>
#include <random>

#include "photograph.h"
#include "tessera/image.h"

namespace tessera::bench {

inline void Put(const ImageView& view, int x, int y, int c, double v) {
  if (view.type == PixelType::kUint8) {
    *reinterpret_cast<uint8_t*>(view.At(x, y, c)) =
        static_cast<uint8_t>(std::lround(std::clamp(v, 0.0, 1.0) * 255));
  } else {
    *reinterpret_cast<float*>(view.At(x, y, c)) = static_cast<float>(v);
  }
}

// The photograph's colours, alpha one.
inline Image Photo(int width, int height, PixelType type) {
  const Image image(ImageSpec(width, height, 4, type));
  std::minstd_rand random(11);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c)
        Put(image.view(), x, y, c, Photograph(x, y, c, static_cast<float>(random() & 0xffff) / 0x10000));
      Put(image.view(), x, y, 3, 1);
    }
  }
  return image;
}

// Coordinates of a swirl, or white noise.
inline Image Coordinates(int width, int height, bool smooth) {
  const Image image(ImageSpec(width, height, 2));
  std::mt19937 random(5);
  std::uniform_real_distribution<float> anywhere(0, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = (x + 0.5) / width - 0.5, v = (y + 0.5) / height - 0.5,
                   turn = 2 * std::exp(-4 * (u * u + v * v));
      const double s = 0.5 + 0.7 * (u * std::cos(turn) - v * std::sin(turn));
      const double t = 0.5 + 0.7 * (u * std::sin(turn) + v * std::cos(turn));
      image.at<float>(x, y, 0) = smooth ? static_cast<float>(s) : anywhere(random);
      image.at<float>(x, y, 1) = smooth ? static_cast<float>(t) : anywhere(random);
    }
  }
  return image;
}

inline Image Noise(int width, int height, int channels) {
  const Image image(ImageSpec(width, height, channels));
  std::mt19937 random(6);
  auto* const samples = reinterpret_cast<float*>(image.view().data);
  const auto count = static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(channels);
  for (size_t i = 0; i < count; ++i) samples[i] = static_cast<float>(random() >> 8) * 0x1p-24f;
  return image;
}

inline double Film(double v) { return v * (2.51 * v + 0.03) / (v * (2.43 * v + 0.59) + 0.14); }
inline void FilmColor(const double* c, double* out) {
  out[0] = Film(0.9 * c[0] + 0.08 * c[1] + 0.02 * c[2]);
  out[1] = Film(0.05 * c[0] + 0.9 * c[1] + 0.05 * c[2]);
  out[2] = Film(0.02 * c[0] + 0.1 * c[1] + 0.88 * c[2]);
}
// The three functions of the speed-against-error figures.
inline void DisplayTransform(const double* c, double* out) {
  double linear[3];
  FilmColor(c, linear);
  for (int i = 0; i < 3; ++i) {
    out[i] = linear[i] <= 0.0031308 ? 12.92 * linear[i] : 1.055 * std::pow(linear[i], 1 / 2.4) - 0.055;
  }
}
inline void Knee(const double* c, double* out) {
  for (int i = 0; i < 3; ++i) {
    const double v = 0.8 * c[i] + 0.1 * (c[0] + c[1]);
    out[i] = v < 0.6 ? v : 0.6 + 0.4 * (1 - std::exp(-(v - 0.6) * 4));
  }
}
// Distance, height and density to transmittances of three colours.
inline void Fog(const double* c, double* out) {
  for (int i = 0; i < 3; ++i) out[i] = std::exp(-(3.0 + i) * c[0] * c[2] * std::exp(-2 * c[1]));
}
// Four inks on paper, Neugebauer-like.
inline void Inks(const double* c, double* out) {
  const double absorb[3][3] = {{0.95, 0.15, 0.02}, {0.35, 0.9, 0.12}, {0.1, 0.3, 0.85}};
  for (int i = 0; i < 3; ++i) {
    double v = 1 - 0.97 * c[3];
    for (int k = 0; k < 3; ++k) v *= 1 - absorb[i][k] * c[k];
    out[i] = std::pow(v, 0.8);
  }
}

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_LOOKUP_PICTURES_H_
