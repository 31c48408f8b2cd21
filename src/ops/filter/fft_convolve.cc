// Blocks through the transform: mean out, columns, transpose, columns, spectrum, and back.
#include "ops/filter/fft_convolve.h"

#include <algorithm>
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

// Rows of a block are padded so that a column's samples fall into different cache sets.
ptrdiff_t Stride(int size) { return size + 16; }

void TransformColumns(float* re, float* im, int size, bool inverse, const float* twiddles) {
  for (int x = 0; x < size; x += kLanes) {
    const s::Columns columns{re + x, im + x, Stride(size)};
    if (inverse) {
      s::InverseColumns(columns, size, twiddles);
    } else {
      s::ForwardColumns(columns, size, twiddles);
    }
  }
}

// The spectrum of re + i im, transposed, in `re2`, `im2`.
void Forward(float* re, float* im, float* re2, float* im2, int size, const float* twiddles) {
  TransformColumns(re, im, size, false, twiddles);
  s::TransposeSquare(re, re2, size, Stride(size));
  s::TransposeSquare(im, im2, size, Stride(size));
  TransformColumns(re2, im2, size, false, twiddles);
}

void Multiply(const FftKernel& k, float* re, float* im) {
  for (int y = 0; y < k.size; ++y) {
    for (int x = 0; x < k.size; x += kLanes) {
      const ptrdiff_t at = y * Stride(k.size) + x;
      const s::Complex v{hn::LoadU(D(), re + at), hn::LoadU(D(), im + at)};
      const ptrdiff_t of = static_cast<ptrdiff_t>(y) * k.size + x;
      const s::Complex r =
          s::Turn<false>(v, hn::LoadU(D(), k.re.data() + of), hn::LoadU(D(), k.im.data() + of));
      hn::StoreU(r.re, D(), re + at);
      hn::StoreU(r.im, D(), im + at);
    }
  }
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

void Block(const FftKernel& k, const FftBlock& b, float* scratch) {
  const int size = k.size;
  const ptrdiff_t stride = Stride(size), plane = stride * size;
  float* const re = scratch;
  float* const im = re + plane;
  float* const re2 = im + plane;
  float* const im2 = re2 + plane;
  float* const results = im2 + plane;  // two planes kept until the other two are there
  for (int c = 0; c < b.channels; c += 2) {
    const bool pair = c + 1 < b.channels;
    // Any number near the mean serves: what is transformed is small, and so is its rounding error.
    constexpr int kSparse = 8;
    double mean[2] = {0, 0};
    for (int y = 0; y < size; y += kSparse) {
      const float* p = b.in + y * b.in_stride + c;
      for (int x = 0; x < size; x += kSparse) {
        mean[0] += p[x * b.channels];
        if (pair) mean[1] += p[x * b.channels + 1];
      }
    }
    const double samples = double{1} * size / kSparse * size / kSparse;
    const float m[2] = {static_cast<float>(mean[0] / samples), static_cast<float>(mean[1] / samples)};
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
    Forward(re, im, re2, im2, size, k.twiddles.data());
    Multiply(k, re2, im2);
    TransformColumns(re2, im2, size, true, k.twiddles.data());
    s::TransposeSquare(re2, re, size, stride);
    s::TransposeSquare(im2, im, size, stride);
    TransformColumns(re, im, size, true, k.twiddles.data());
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

void Spectrum(const FftKernel& k, float* re, float* im, float* re2, float* im2) {
  Forward(re, im, re2, im2, k.size, k.twiddles.data());
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(Block);
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
    k.twiddles.push_back(static_cast<float>(std::cos(2 * std::numbers::pi * j / size)));
    k.twiddles.push_back(static_cast<float>(-std::sin(2 * std::numbers::pi * j / size)));
  }
  const ptrdiff_t stride = size + 16, plane = stride * size;
  std::vector<float> work(static_cast<size_t>(4 * plane), 0.0f);
  // A correlation multiplies by the spectrum of the kernel turned round, cyclically.
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double w = weights[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
      work[static_cast<size_t>((size - y) % size * stride + (size - x) % size)] =
          static_cast<float>(w / size / size);
      k.sum += w;
    }
  }
  float* const p = work.data();
  HWY_DYNAMIC_DISPATCH(Spectrum)(k, p, p + plane, p + 2 * plane, p + 3 * plane);
  for (int y = 0; y < size; ++y) {
    const float* row = p + 2 * plane + y * stride;
    k.re.insert(k.re.end(), row, row + size);
    k.im.insert(k.im.end(), row + plane, row + plane + size);
  }
  return k;
}

size_t FftScratchFloats(const FftKernel& k) { return static_cast<size_t>(6 * (k.size + 16) * k.size) + 64; }

void RunFft(const FftKernel& kernel, const FftBlock& block, float* scratch) {
  HWY_DYNAMIC_DISPATCH(Block)(kernel, block, scratch);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
