// Halving both sides of an image of codes by a box: means of four whole numbers, rounded half to even.
#if defined(TESSERA_OPS_GEOMETRY_RESAMPLE_CODES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_GEOMETRY_RESAMPLE_CODES_INL_H_
#undef TESSERA_OPS_GEOMETRY_RESAMPLE_CODES_INL_H_
#else
#define TESSERA_OPS_GEOMETRY_RESAMPLE_CODES_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>
#include <type_traits>

#include "ops/geometry/resample_kernel.h"
#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

// Results [from, to) of a row, counted in samples.
template <class T>
HWY_INLINE void HalveSamples(const T* a, const T* b, int channels, int from, int to, T* out) {
  for (int i = from; i < to; ++i) {
    const ptrdiff_t first = ptrdiff_t{i} + i / channels * channels;
    const uint32_t sum = uint32_t{a[first]} + a[first + channels] + b[first] + b[first + channels];
    out[i] = static_cast<T>((sum + 1 + ((sum >> 2) & 1)) >> 2);
  }
}

// Vectors of codes and of their sums.
template <class T>
using DHalve = hn::CappedTag<uint8_t, 32>;
template <class T>
using DSums = hn::Repartition<std::conditional_t<sizeof(T) == 1, uint16_t, uint32_t>, DHalve<T>>;

// The order of bytes within 16 that brings every sample beside that of the pixel to its right; of three
// channels one or two pairs of pixels, and samples that nobody looks at.
template <class T, int kChannels>
struct PairOrder {
  alignas(16) uint8_t at[16];
  constexpr PairOrder() : at() {
    constexpr int kBytes = static_cast<int>(sizeof(T));
    for (int i = 0; i < 16; ++i) {
      const int byte = i % kBytes, result = i / kBytes / 2, second = i / kBytes % 2;
      const int from = result / kChannels * 2 * kChannels + result % kChannels + second * kChannels;
      at[i] = static_cast<uint8_t>((from * kBytes + byte) % 16);
    }
  }
};

// Sixteen bytes of every 128 bits, which lie `step` bytes apart.
HWY_INLINE hn::Vec<DHalve<uint8_t>> LoadBlocks(const uint8_t* p, [[maybe_unused]] int step) {
  const DHalve<uint8_t> d;
  if constexpr (hn::MaxLanes(d) == 16) {
    return hn::LoadU(d, p);
  } else {
    const hn::Half<decltype(d)> half;
    return hn::Combine(d, hn::LoadU(half, p + step), hn::LoadU(half, p));
  }
}

// Means of the pairs of pixels in vectors of both rows.
template <class T, int kChannels>
HWY_INLINE hn::Vec<DSums<T>> HalvePairs(const T* a, const T* b) {
  const DHalve<T> d8;
  const DSums<T> d;
  // Three channels: whole pairs of pixels only.
  constexpr int kStep = kChannels == 3 ? 12 : 16;
  static constexpr PairOrder<T, kChannels> kOrder;
  const auto row = [&](const T* p) HWY_ATTR {
    auto v = LoadBlocks(reinterpret_cast<const uint8_t*>(p), kStep);
    if constexpr (kChannels != 1) v = hn::TableLookupBytes(v, hn::LoadDup128(d8, kOrder.at));
    return hn::BitCast(d, v);
  };
  constexpr int kBits = 8 * static_cast<int>(sizeof(T));
  const auto low = hn::Set(d, static_cast<hn::TFromD<DSums<T>>>((1u << kBits) - 1));
  const auto one = hn::Set(d, hn::TFromD<DSums<T>>{1});
  const auto u = row(a), v = row(b);
  const auto sum = hn::Add(hn::Add(hn::And(u, low), hn::ShiftRight<kBits>(u)),
                           hn::Add(hn::And(v, low), hn::ShiftRight<kBits>(v)));
  const auto odd = hn::And(hn::ShiftRight<2>(sum), one);
  return hn::ShiftRight<2>(hn::Add(hn::Add(sum, one), odd));
}

template <class T, int kChannels>
void HalveRow(const T* a, const T* b, int count, T* out, bool stream) {
  using DN = hn::Rebind<T, DSums<T>>;  // half a vector of codes
  const DN narrow;
  const hn::RebindToSigned<DSums<T>> wide;
  const auto codes = [&](hn::Vec<DSums<T>> mean)
                         HWY_ATTR { return hn::DemoteTo(narrow, hn::BitCast(wide, mean)); };
  constexpr int kLanesOf = static_cast<int>(hn::MaxLanes(DN()));
  constexpr bool kWhole = kChannels != 3;
  constexpr int kBlocks = kLanesOf * static_cast<int>(sizeof(T)) / 8;
  // Results of a vector: of three channels six bytes or three words of every 128 bits.
  constexpr int kStep = kWhole ? kLanesOf : kBlocks * (sizeof(T) == 1 ? 6 : 3);
  int i = 0;
  if constexpr (kWhole) {
    const hn::Twice<DN> full;
    const bool around = stream && reinterpret_cast<uintptr_t>(out) % (2 * kLanesOf * sizeof(T)) == 0;
    for (; i + 2 * kStep <= count; i += 2 * kStep) {
      const auto first = HalvePairs<T, kChannels>(a + 2 * i, b + 2 * i),
                 second = HalvePairs<T, kChannels>(a + 2 * (i + kStep), b + 2 * (i + kStep));
      s::StoreOrStream(hn::Combine(full, codes(second), codes(first)), full, out + i, around);
    }
  } else {
    for (; i + kLanesOf <= count; i += kStep) {
      auto v = codes(HalvePairs<T, kChannels>(a + 2 * i, b + 2 * i));
      if constexpr (kBlocks == 2) {
        // Six bytes of each eight.
        alignas(16) static constexpr uint8_t kClose[16] = {0,  1,  2,  3,  4, 5, 8,  9,
                                                           10, 11, 12, 13, 6, 7, 14, 15};
        const hn::Repartition<uint8_t, DN> bytes;
        v = hn::BitCast(narrow, hn::TableLookupBytes(hn::BitCast(bytes, v), hn::LoadU(bytes, kClose)));
      }
      hn::StoreU(v, narrow, out + i);
    }
  }
  HalveSamples(a, b, kChannels, i, count, out);
}

template <class T>
inline void HalveCodes(const ResampleJob& job) {
  const Roi& roi = job.out.roi;
  const int channels = job.out.channels, count = roi.width() * channels;
  for (int y = roi.y0; y < roi.y1; ++y) {
    const auto* const a =
        reinterpret_cast<const T*>(job.in.At(2 * roi.x0 + job.x.shift, 2 * y + job.y.shift));
    const T* const b = a + job.in.row_stride / static_cast<ptrdiff_t>(sizeof(T));
    auto* const out = reinterpret_cast<T*>(job.out.At(roi.x0, y));
    switch (channels) {
      case 1:
        HalveRow<T, 1>(a, b, count, out, job.stream);
        break;
      case 2:
        HalveRow<T, 2>(a, b, count, out, job.stream);
        break;
      case 3:
        HalveRow<T, 3>(a, b, count, out, job.stream);
        break;
      case 4:
        HalveRow<T, 4>(a, b, count, out, job.stream);
        break;
      default:
        HalveSamples(a, b, channels, 0, count, out);
    }
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
