// Sums of a strip's pixels in blocks of two to the n, in double, and what levels make of them.
#include "ops/geometry/mip_boxes_kernel.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "base/prefetch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/geometry/mip_boxes_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/geometry/resample_halves-inl.h"
#include "ops/geometry/resample_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// The sums of neighbours, pixels of one or four samples: of two rows of sixteen samples.
template <int kChannels>
HWY_INLINE D16 NeighboursOf(const D16& a, const D16& b) {
  const D16::Tag d;
  const auto part = [&](int k) HWY_ATTR { return k < D16::kVectors ? a.v[k] : b.v[k - D16::kVectors]; };
  D16 sum;
  for (int k = 0; k < D16::kVectors; ++k) {
    if constexpr (kChannels == 1 && D16::kLanesOf > 1) {
      const auto x = part(2 * k), y = part(2 * k + 1);
      sum.v[k] = hn::Add(hn::ConcatEven(d, y, x), hn::ConcatOdd(d, y, x));
    } else if constexpr (D16::kLanesOf == 8) {
      const auto x = part(2 * k), y = part(2 * k + 1);
      sum.v[k] = hn::Add(hn::ConcatLowerLower(d, y, x), hn::ConcatUpperUpper(d, y, x));
    } else {
      constexpr int kPixel = std::max(1, kChannels / D16::kLanesOf);  // vectors
      const int at = k / kPixel * 2 * kPixel + k % kPixel;
      sum.v[k] = hn::Add(part(at), part(at + kPixel));
    }
  }
  return sum;
}

// Sums of two pixels each: `count` of them.
template <int kChannels, class T>  // 0: any number
HWY_INLINE void SumPairs(const T* from, int count, int channels, double* to) {
  int i = 0;
  if constexpr (kChannels > 0) {
    constexpr int kPixels = 16 / kChannels;
    for (; i + kPixels <= count; i += kPixels) {
      const T* const first = from + ptrdiff_t{2} * kChannels * i;
      NeighboursOf<kChannels>(D16::Load(first), D16::Load(first + 16)).Store(to + ptrdiff_t{kChannels} * i);
    }
  }
  for (; i < count; ++i) {
    const T* const pair = from + ptrdiff_t{2} * channels * i;
    for (int c = 0; c < channels; ++c) {
      to[ptrdiff_t{channels} * i + c] = double{pair[c]} + double{pair[channels + c]};
    }
  }
}

template <int kChannels>
HWY_INLINE void SumAllBlocks(const double* row, int pixels, int channels, double* blocks) {
  SumPairs<kChannels>(row, pixels / 2, channels, blocks);
  for (int size = 2; pixels >> size > 0; ++size) {
    SumPairs<kChannels>(blocks + ptrdiff_t{channels} * BlockOffset(size - 1), pixels >> size, channels,
                        blocks + ptrdiff_t{channels} * BlockOffset(size));
  }
}

void SumBlocks(const double* row, int pixels, int channels, double* blocks) {
  (channels == 4   ? SumAllBlocks<4>
   : channels == 1 ? SumAllBlocks<1>
                   : SumAllBlocks<0>)(row, pixels, channels, blocks);
}

// `count` sums of two by two pixels of rows a and b.
template <int kChannels, class T>  // 0: any number
HWY_INLINE void SumSquares(const T* a, const T* b, int count, int channels, double* to) {
  int i = 0;
  if constexpr (kChannels > 0) {
    constexpr int kPixels = 16 / kChannels;
    for (; i + kPixels <= count; i += kPixels) {
      const ptrdiff_t from = ptrdiff_t{2} * kChannels * i;
      if constexpr (sizeof(T) == sizeof(float))
        base::PrefetchAhead(a + from, 32), base::PrefetchAhead(b + from, 32);
      D16 first = D16::Load(a + from), second = D16::Load(a + from + 16);
      first.AddScaled(b + from, 1);
      second.AddScaled(b + from + 16, 1);
      NeighboursOf<kChannels>(first, second).Store(to + ptrdiff_t{kChannels} * i);
    }
  }
  for (; i < count; ++i) {
    const ptrdiff_t from = ptrdiff_t{2} * channels * i;
    for (int c = 0; c < channels; ++c) {
      to[ptrdiff_t{channels} * i + c] = (double{a[from + c]} + double{b[from + c]}) +
                                        (double{a[from + channels + c]} + double{b[from + channels + c]});
    }
  }
}

template <class T>
HWY_INLINE void SumSquares(const T* a, const T* b, int count, int channels, double* to) {
  (channels == 4   ? SumSquares<4, T>
   : channels == 1 ? SumSquares<1, T>
                   : SumSquares<0, T>)(a, b, count, channels, to);
}

void Halve(const float* a, const float* b, int count, int channels, float* copy_a, float* copy_b,
           double* sums) {
  SumSquares(a, b, count, channels, sums);
  StoreLine(a, 2 * count * channels, copy_a, true);
  StoreLine(b, 2 * count * channels, copy_b, true);
}

void HalveSums(const double* a, const double* b, int count, int channels, double* sums) {
  SumSquares(a, b, count, channels, sums);
}

void Accumulate(const float* row, int count, bool set, double* sums, float* copy) {
  int i = 0;
  for (; i + 16 <= count; i += 16) {
    D16 sum = D16::Load(row + i);
    if (!set) sum.AddScaled(sums + i, 1);
    sum.Store(sums + i);
  }
  for (; i < count; ++i) sums[i] = set ? double{row[i]} : sums[i] + double{row[i]};
  if (copy != nullptr) StoreLine(row, count, copy, true);
}

HWY_INLINE void AddLine(const double* from, int count, bool set, double* sums) {
  if (set) {
    std::copy_n(from, count, sums);
    return;
  }
  int i = 0;
  for (; i + 16 <= count; i += 16) {
    D16 sum = D16::Load(sums + i);
    sum.AddScaled(from + i, 1);
    sum.Store(sums + i);
  }
  for (; i < count; ++i) sums[i] += from[i];
}

void Add(const StripWindows& windows, const double* row, const double* blocks, int channels, bool set,
         double* sums) {
  if (windows.place >= 0) {
    AddLine(blocks + ptrdiff_t{channels} * windows.place, windows.count * channels, set, sums);
    return;
  }
  for (int i = 0; i < windows.count; ++i, sums += channels) {
    const int* const begin = windows.blocks.data() + windows.begin[static_cast<size_t>(i)];
    const int* const end = windows.blocks.data() + windows.begin[static_cast<size_t>(i) + 1];
    if (set) std::fill_n(sums, channels, 0.0);
    for (const int* b = begin; b != end; ++b) {
      if (*b >= 0) {
        const double* const block = blocks + ptrdiff_t{channels} * *b;
        for (int c = 0; c < channels; ++c) sums[c] += block[c];
      } else {
        const double* const pixel = row + ptrdiff_t{channels} * ~*b;
        for (int c = 0; c < channels; ++c) sums[c] += pixel[c];
      }
    }
  }
}

void Round(const double* sums, const double* weights, double weight, int pixels, int channels, int largest,
           float* out) {
  const int count = pixels * channels;
  const auto sixteen = [=](const D16& mean) HWY_ATTR { return Settled(Rounded(mean), largest); };
  int i = 0;
  if (weights == nullptr) {
    for (; i + 16 <= count; i += 16) StoreSixteen(sixteen(D16::Load(sums + i) * weight), out + i, true);
  }
  for (; i < count; i += 16) {
    const int n = std::min(16, count - i);
    double means[16] = {};
    float rounded[16];
    for (int k = 0; k < n; ++k) {
      means[k] = sums[i + k] * (weights == nullptr ? weight : weight * weights[(i + k) / channels]);
    }
    sixteen(D16::Load(means)).Store(rounded);
    std::copy_n(rounded, n, out + i);
  }
}

MipBoxFunctions MipBoxesOfTarget() { return {&Halve, &HalveSums, &Accumulate, &SumBlocks, &Add, &Round}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MipBoxesOfTarget);

MipBoxFunctions ChooseMipBoxes() { return HWY_DYNAMIC_DISPATCH(MipBoxesOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
