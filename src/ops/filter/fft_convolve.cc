// Blocks through the transform: mean out, columns, transpose, columns, spectrum, and back.
#include "ops/filter/fft_convolve.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/fft_convolve.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fft-inl.h"
#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::V;

constexpr int kLanes = s::kLanes;
// The largest deviation, in mean magnitudes, of what is transformed in floats.
constexpr double kWidest = 16;

// Rows of a block are padded so that a column's samples fall into different cache sets.
ptrdiff_t Stride(int size) { return size + 16; }

template <class T>
void TransformColumns(T* re, T* im, int size, bool inverse, const T* twiddles) {
  const auto lanes = static_cast<int>(hn::Lanes(s::FftTag<T>()));
  for (int x = 0; x < size; x += lanes) {
    const s::Columns<T> columns{re + x, im + x, Stride(size)};
    if (inverse) {
      s::InverseColumns(columns, size, twiddles);
    } else {
      s::ForwardColumns(columns, size, twiddles);
    }
  }
}

// The spectrum of re + i im, transposed, in `re2`, `im2`.
template <class T>
void Forward(T* re, T* im, T* re2, T* im2, int size, const T* twiddles) {
  TransformColumns(re, im, size, false, twiddles);
  s::TransposeSquare(re, re2, size, Stride(size));
  s::TransposeSquare(im, im2, size, Stride(size));
  TransformColumns(re2, im2, size, false, twiddles);
}

template <class T>
void Multiply(const FftKernel::Spectrum<T>& spectrum, int size, T* re, T* im) {
  const s::FftTag<T> d;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; x += static_cast<int>(hn::Lanes(d))) {
      const ptrdiff_t at = y * Stride(size) + x;
      const typename s::Columns<T>::Value v{hn::LoadU(d, re + at), hn::LoadU(d, im + at)};
      const ptrdiff_t of = static_cast<ptrdiff_t>(y) * size + x;
      const auto r =
          s::Turn<false>(v, hn::LoadU(d, spectrum.re.data() + of), hn::LoadU(d, spectrum.im.data() + of));
      hn::StoreU(r.re, d, re + at);
      hn::StoreU(r.im, d, im + at);
    }
  }
}

// re + i im filtered, in place; the other two planes are scratch.
template <class T>
void Filter(const FftKernel::Spectrum<T>& spectrum, int size, T* re, T* im, T* re2, T* im2) {
  const T* const twiddles = spectrum.twiddles.data();
  Forward(re, im, re2, im2, size, twiddles);
  Multiply(spectrum, size, re2, im2);
  TransformColumns(re2, im2, size, true, twiddles);
  s::TransposeSquare(re2, re, size, Stride(size));
  s::TransposeSquare(im2, im, size, Stride(size));
  TransformColumns(re, im, size, true, twiddles);
}

// The same through doubles in `scratch`, four planes.
HWY_NOINLINE void FilterInDouble(const FftKernel& k, float* re, float* im, double* scratch) {
  const ptrdiff_t plane = Stride(k.size) * k.size;
  double* const p[4] = {scratch, scratch + plane, scratch + 2 * plane, scratch + 3 * plane};
  std::copy_n(re, plane, p[0]);
  std::copy_n(im, plane, p[1]);
  Filter(k.precise, k.size, p[0], p[1], p[2], p[3]);
  std::transform(p[0], p[0] + plane, re, [](double v) { return static_cast<float>(v); });
  std::transform(p[1], p[1] + plane, im, [](double v) { return static_cast<float>(v); });
}

// The largest |v| of a plane's block, NaN where there is one: as bits these are in order.
float Largest(const float* plane, int size) {
  const s::DI di;
  auto largest = hn::Zero(di);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; x += kLanes) {
      largest = hn::Max(largest, hn::BitCast(di, hn::Abs(hn::LoadU(D(), plane + y * Stride(size) + x))));
    }
  }
  return std::bit_cast<float>(hn::GetLane(hn::MaxOfLanes(di, largest)));
}

// A vector of every channel of RGBA pixels.
HWY_INLINE s::Pixels LoadPixels(const float* p) {
  if constexpr (kLanes == 1) {
    return {hn::Set(D(), p[0]), hn::Set(D(), p[1]), hn::Set(D(), p[2]), hn::Set(D(), p[3])};
  } else {
    s::Pixels v = s::LoadRgbaCodes<PixelType::kFloat>(p);
    return {s::ToPixelOrder(v.r), s::ToPixelOrder(v.g), s::ToPixelOrder(v.b), s::ToPixelOrder(v.a)};
  }
}

// Channels c and c + 1 of a block, less their means.
void Load(const FftBlock& b, int size, int c, const float (&m)[2], float* re, float* im) {
  const ptrdiff_t stride = Stride(size);
  const bool pair = c + 1 < b.channels;
  for (int y = 0; y < size; ++y) {
    const float* p = b.in + y * b.in_stride;
    float* to_re = re + y * stride;
    float* to_im = im + y * stride;
    if (b.channels == 4) {
      const V m0 = hn::Set(D(), m[0]), m1 = hn::Set(D(), m[1]);
      for (int x = 0; x < size; x += kLanes) {
        const s::Pixels v = LoadPixels(p + 4 * x);
        hn::StoreU(hn::Sub(c == 0 ? v.r : v.b, m0), D(), to_re + x);
        hn::StoreU(hn::Sub(c == 0 ? v.g : v.a, m1), D(), to_im + x);
      }
    } else {
      for (int x = 0; x < size; ++x) {
        to_re[x] = p[x * b.channels + c] - m[0];
        to_im[x] = pair ? p[x * b.channels + c + 1] - m[1] : 0.0f;
      }
    }
  }
}

void Block(const FftKernel& k, const FftBlock& b, float* scratch) {
  const int size = k.size;
  const ptrdiff_t stride = Stride(size), plane = stride * size;
  float* const re = scratch;
  float* const im = re + plane;
  float* const re2 = im + plane;
  float* const im2 = re2 + plane;
  float* const results = im2 + plane;  // two planes kept until the other two are there
  auto* const precise = reinterpret_cast<double*>(results + 2 * plane);
  for (int c = 0; c < b.channels; c += 2) {
    const bool pair = c + 1 < b.channels;
    // Any number near the mean serves: what is transformed is small, and so is its rounding error.
    constexpr int kSparse = 8;
    double mean[2] = {0, 0}, magnitude[2] = {0, 0};
    for (int y = 0; y < size; y += kSparse) {
      const float* p = b.in + y * b.in_stride + c;
      for (int x = 0; x < size; x += kSparse) {
        for (int i = 0; i < (pair ? 2 : 1); ++i) {
          mean[i] += p[x * b.channels + i];
          magnitude[i] += std::fabs(p[x * b.channels + i]);
        }
      }
    }
    const double samples = double{1} * size / kSparse * size / kSparse;
    float m[2] = {static_cast<float>(mean[0] / samples), static_cast<float>(mean[1] / samples)};
    Load(b, size, c, m, re, im);
    const float largest[2] = {Largest(re, size), Largest(im, size)};
    // What is the same everywhere is its mean alone, and the other's transform must not leak into it.
    const bool flat[2] = {largest[0] == 0, largest[1] == 0};
    const double most = std::max(largest[0], largest[1]);
    const auto hides = [&](int i) { return !flat[i] && most > kWidest * magnitude[i] / samples; };
    if (hides(0) || hides(1)) {
      // Not even the mean is taken out: in floats that would round the dark away.
      for (int i = 0; i < 2; ++i) m[i] = flat[i] ? m[i] : 0.0f;
      Load(b, size, c, m, re, im);
      FilterInDouble(k, re, im, precise);
    } else if (!flat[0] || !flat[1]) {
      Filter(k.single, size, re, im, re2, im2);
    }
    if (flat[0]) std::fill_n(re, plane, 0.0f);
    if (flat[1]) std::fill_n(im, plane, 0.0f);
    const float back[2] = {static_cast<float>(m[0] * k.sum), static_cast<float>(m[1] * k.sum)};
    if (b.channels == 4 && c == 0) {
      // Kept until blue and alpha can be written with them.
      for (int y = b.y0; y < b.y1; ++y) {
        for (int x = 0; x < size; x += kLanes) {
          const ptrdiff_t at = y * stride + x;
          hn::StoreU(hn::Add(hn::LoadU(D(), re + at), hn::Set(D(), back[0])), D(), results + at);
          hn::StoreU(hn::Add(hn::LoadU(D(), im + at), hn::Set(D(), back[1])), D(), results + plane + at);
        }
      }
      continue;
    }
    for (int y = b.y0; y < b.y1; ++y) {
      float* to = b.out + (y - b.y0) * b.out_stride;
      const ptrdiff_t row = y * stride;
      if (b.channels == 4) {
        int x = b.x0;
        for (; x + kLanes <= b.x1; x += kLanes, to += 4 * kLanes) {
          const s::Pixels v{hn::LoadU(D(), results + row + x), hn::LoadU(D(), results + plane + row + x),
                            hn::Add(hn::LoadU(D(), re + row + x), hn::Set(D(), back[0])),
                            hn::Add(hn::LoadU(D(), im + row + x), hn::Set(D(), back[1]))};
          if constexpr (kLanes == 1) {
            const V planes[4] = {v.r, v.g, v.b, v.a};
            for (int i = 0; i < 4; ++i) hn::StoreU(planes[i], D(), to + i);
          } else {
            s::StoreRgba<PixelType::kFloat, true>(
                {s::ToPlaneOrder(v.r), s::ToPlaneOrder(v.g), s::ToPlaneOrder(v.b), s::ToPlaneOrder(v.a)}, to,
                false);
          }
        }
        for (; x < b.x1; ++x, to += 4) {
          to[0] = results[row + x], to[1] = results[plane + row + x];
          to[2] = re[row + x] + back[0], to[3] = im[row + x] + back[1];
        }
      } else {
        for (int x = b.x0; x < b.x1; ++x, to += b.channels) {
          to[c] = re[row + x] + back[0];
          if (pair) to[c + 1] = im[row + x] + back[1];
        }
      }
    }
  }
}

FftFunction BlockOfTarget() { return Block; }

void Spectrum(const FftKernel& k, double* p) {
  const ptrdiff_t plane = Stride(k.size) * k.size;
  Forward(p, p + plane, p + 2 * plane, p + 3 * plane, k.size, k.precise.twiddles.data());
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(BlockOfTarget);
HWY_EXPORT(Spectrum);

// The block with the least work per result.
int BlockSize(int largest) {
  int best = 64;
  double least = 1e30;
  for (const int size : {64, 128, 256, 512}) {
    if (size < 2 * largest) continue;
    // Beyond 128 the block leaves the fast half of the second cache.
    const double results = double{1} * (size - largest + 1) * (size - largest + 1);
    const double cost = double{1} * size * size * std::log2(size) * (size > 128 ? 1.4 : 1) / results;
    if (cost < least) least = cost, best = size;
  }
  return best;
}

}  // namespace

FftKernel MakeFftKernel(int width, int height, const std::vector<double>& weights) {
  FftKernel k;
  k.width = width, k.height = height, k.size = BlockSize(std::max(width, height));
  const int size = k.size;
  for (int j = 0; j < size; ++j) {
    k.precise.twiddles.push_back(std::cos(2 * std::numbers::pi * j / size));
    k.precise.twiddles.push_back(-std::sin(2 * std::numbers::pi * j / size));
  }
  const ptrdiff_t stride = size + 16, plane = stride * size;
  std::vector<double> work(static_cast<size_t>(4 * plane), 0.0);
  // A correlation multiplies by the spectrum of the kernel turned round, cyclically.
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double w = weights[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
      work[static_cast<size_t>((size - y) % size * stride + (size - x) % size)] = w / size / size;
      k.sum += w;
    }
  }
  HWY_DYNAMIC_DISPATCH(Spectrum)(k, work.data());
  for (int y = 0; y < size; ++y) {
    const double* row = work.data() + 2 * plane + y * stride;
    k.precise.re.insert(k.precise.re.end(), row, row + size);
    k.precise.im.insert(k.precise.im.end(), row + plane, row + plane + size);
  }
  k.single.twiddles.assign(k.precise.twiddles.begin(), k.precise.twiddles.end());
  k.single.re.assign(k.precise.re.begin(), k.precise.re.end());
  k.single.im.assign(k.precise.im.begin(), k.precise.im.end());
  return k;
}

// Six planes of floats, four of doubles.
size_t FftScratchFloats(const FftKernel& k) { return static_cast<size_t>(14 * (k.size + 16) * k.size) + 64; }

FftFunction ChooseFft() { return HWY_DYNAMIC_DISPATCH(BlockOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
