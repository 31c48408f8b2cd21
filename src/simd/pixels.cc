// The two loops that have a tail: pixels of any type and stride to float planes and back, for every target.
#include "simd/pixels.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <type_traits>

#include "base/block.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/pixels.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// What the strides of a call amount to. kPart: three or four channels side by side within wider pixels.
struct Layout {
  enum Kind { kRgba, kRgb, kPart, kPlanar, kOther } kind = kOther;
  // kRgba, kRgb: which plane holds the sample at each place of a pixel; but for kPlanar and kOther the offset
  // of the first place.
  int plane_of[4] = {0, 1, 2, 3};
  ptrdiff_t first = 0;
  int present = 0;  // channels
};

template <class Args>
Layout Classify(const Args& args) {
  Layout layout;
  const ptrdiff_t bytes = static_cast<ptrdiff_t>(PixelBytes(args.type));
  ptrdiff_t low = PTRDIFF_MAX;
  int& present = layout.present;
  for (ptrdiff_t c : args.channel) {
    if (c != kNoChannel) ++present, low = std::min(low, c);
  }
  layout.first = low;
  if (args.pixel_stride == bytes) {
    layout.kind = Layout::kPlanar;
  } else if (present == 4 || present == 3) {
    int seen = 0;
    for (int i = 0; i < 4; ++i) {
      if (args.channel[i] == kNoChannel) continue;
      const ptrdiff_t offset = args.channel[i] - low;
      if (offset % bytes != 0 || offset / bytes >= present) return layout;
      layout.plane_of[offset / bytes] = i;
      seen |= 1 << (offset / bytes);
    }
    if (seen != (1 << present) - 1) return layout;
    layout.kind = args.pixel_stride != present * bytes ? Layout::kPart
                  : present == 4                       ? Layout::kRgba
                                                       : Layout::kRgb;
  }
  return layout;
}

// Runs body(pixels, first, groups * kGroupPixels) on the whole groups, then on a zeroed copy of the rest.
template <class T, class Body>
HWY_INLINE void LoadGroups(const T* pixels, int samples_per_pixel, int count, const Body& body) {
  const int whole = count / kGroupPixels * kGroupPixels;
  body(pixels, 0, whole);
  if (whole == count) return;
  alignas(64) T rest[4 * kGroupPixels] = {};
  std::memcpy(rest, pixels + static_cast<ptrdiff_t>(whole) * samples_per_pixel,
              sizeof(T) * (count - whole) * samples_per_pixel);
  body(rest, whole, kGroupPixels);
}
template <class T, class Body>
HWY_INLINE void StoreGroups(T* pixels, int samples_per_pixel, int count, bool stream, const Body& body) {
  const int whole = count / kGroupPixels * kGroupPixels;
  body(pixels, 0, whole, stream && CanStream(pixels));
  if (whole == count) return;
  alignas(64) T rest[4 * kGroupPixels];
  body(rest, whole, kGroupPixels, false);
  std::memcpy(pixels + static_cast<ptrdiff_t>(whole) * samples_per_pixel, rest,
              sizeof(T) * (count - whole) * samples_per_pixel);
}

template <PixelType type>
void LoadPlane(const typename Samples<type>::T* samples, int count, float* plane) {
  using S = Samples<type>;
  LoadGroups(samples, 1, count, [=](const typename S::T* p, int first, int n) HWY_ATTR {
    for (int i = 0; i < n; i += kLanes) {
      hn::StoreU(ToPlaneOrder(S::Value(S::LoadCodes(p + i))), D(), plane + first + i);
    }
  });
}
template <PixelType type>
void StorePlane(const float* plane, int count, bool stream, typename Samples<type>::T* samples) {
  using S = Samples<type>;
  StoreGroups(samples, 1, count, stream, [=](typename S::T* p, int first, int n, bool around) HWY_ATTR {
    for (int i = 0; i < n; i += kLanes) {
      S::StoreValues(ToPixelOrder(hn::LoadU(D(), plane + first + i)), p + i, around);
    }
  });
}

// Asks for samples [first, first + count) after p, which need not exist.
template <class T>
HWY_INLINE void PrefetchRow(const T* p, int first, int count) {
  const auto at = reinterpret_cast<uintptr_t>(p) + static_cast<size_t>(first) * sizeof(T);
  for (size_t k = 0; k < static_cast<size_t>(count) * sizeof(T); k += 64) {
    __builtin_prefetch(reinterpret_cast<const void*>(at + k), 0, 2);
  }
}

// Bytes with eight lanes: as RGBA of which A is not there, since shuffles of whole pixels cost half of
// Highway's three-way ones on so few bytes.
#if HWY_TARGET == HWY_AVX2
HWY_INLINE void LoadRgbBytes(const uint8_t* p, V& x, V& y, V& z) {
  const hn::FixedTag<uint8_t, 16> half;
  const hn::Repartition<uint8_t, D> d8;
  // Four pixels each; the second half is read from four bytes before, since there may be nothing behind.
  alignas(32) static constexpr uint8_t kSpread[32] = {0,   1,   2,  128, 3,   4,   5,  128, 6,   7,  8,
                                                      128, 9,   10, 11,  128, 4,   5,  6,   128, 7,  8,
                                                      9,   128, 10, 11,  12,  128, 13, 14,  15,  128};
  const auto bytes = hn::Combine(d8, hn::LoadU(half, p + 8), hn::LoadU(half, p));
  const auto pixels = hn::TableLookupBytesOr0(bytes, hn::Load(d8, kSpread));
  const Pixels codes = UnpackRgba8(ToPlaneOrder(hn::BitCast(DU(), pixels)));
  x = FromUnorm8(codes.r), y = FromUnorm8(codes.g), z = FromUnorm8(codes.b);
}
HWY_INLINE void StoreRgbBytes(V x, V y, V z, uint8_t* p) {
  const hn::FixedTag<uint8_t, 16> half;
  const hn::FixedTag<uint8_t, 8> quarter;
  const hn::Repartition<uint8_t, D> d8;
  alignas(16) static constexpr uint8_t kTake[16] = {0,  1,  2,  4,  5,   6,   8,   9,
                                                    10, 12, 13, 14, 128, 128, 128, 128};
  alignas(32) static constexpr int32_t kTogether[8] = {0, 1, 2, 4, 5, 6, 3, 7};
  const VU packed =
      PackRgba8(ToUnormBits<256>(x), ToUnormBits<256>(y), ToUnormBits<256>(z), hn::Set(DU(), kCodeBits));
  const auto taken =
      hn::TableLookupBytesOr0(hn::BitCast(d8, ToPixelOrder(packed)), hn::LoadDup128(d8, kTake));
  const auto all =
      hn::BitCast(d8, hn::TableLookupLanes(hn::BitCast(DU(), taken), hn::SetTableIndices(DU(), kTogether)));
  hn::StoreU(hn::LowerHalf(half, all), half, p);
  hn::StoreU(hn::LowerHalf(quarter, hn::UpperHalf(half, all)), quarter, p + 16);
}
#endif

// Three interleaved samples per pixel: Highway's three-way loads on the narrow type, then as planes.
template <PixelType type>
HWY_INLINE void LoadRgbVector(const typename Samples<type>::T* p, V& x, V& y, V& z) {
  using S = Samples<type>;
#if HWY_TARGET == HWY_AVX2
  if constexpr (type == PixelType::kUint8) return LoadRgbBytes(p, x, y, z);
#endif
  const hn::Rebind<typename S::T, D> d;
  hn::Vec<decltype(d)> a, b, c;
  hn::LoadInterleaved3(d, p, a, b, c);
  const auto value = [](hn::Vec<decltype(d)> v) HWY_ATTR {
    if constexpr (type == PixelType::kFloat) {
      return v;
    } else if constexpr (type == PixelType::kHalf) {
      return FloatFromHalf(v);
    } else {
      return S::Value(hn::ConvertTo(D(), hn::PromoteTo(DI(), v)));
    }
  };
  x = ToPlaneOrder(value(a)), y = ToPlaneOrder(value(b)), z = ToPlaneOrder(value(c));
}
template <PixelType type>
HWY_INLINE void StoreRgbVector(V x, V y, V z, typename Samples<type>::T* p) {
  using S = Samples<type>;
#if HWY_TARGET == HWY_AVX2
  if constexpr (type == PixelType::kUint8) return StoreRgbBytes(x, y, z, p);
#endif
  const hn::Rebind<typename S::T, D> d;
  const auto sample = [&](V v) HWY_ATTR {
    v = ToPixelOrder(v);
    if constexpr (type == PixelType::kFloat) {
      return v;
    } else if constexpr (type == PixelType::kHalf) {
      return HalfFromFloat(v);
    } else if constexpr (type == PixelType::kUint8) {
      return hn::DemoteTo(d, ToUnorm<256>(v));
    } else {
      return hn::DemoteTo(d, ToUnorm<65536>(v));
    }
  };
  hn::StoreInterleaved3(sample(x), sample(y), sample(z), d, p);
}

// A copy of the channels that lie side by side, as pixels of their own, to be loaded or stored in one go:
// half of the time that one channel after the other takes.
template <PixelType type>
struct Compact {
  using T = typename Samples<type>::T;
  alignas(64) T samples[4 * kBlockPixels];

  // The call that means this copy.
  template <class Args>
  Args Of(const Args& args, const Layout& layout) {
    Args here = args;
    here.pixels = reinterpret_cast<decltype(here.pixels)>(samples);
    here.pixel_stride = layout.present * static_cast<ptrdiff_t>(sizeof(T));
    for (ptrdiff_t& c : here.channel) {
      if (c != kNoChannel) c -= layout.first;
    }
    return here;
  }
  // copy(pixel, here, bytes) for every pixel, with a number of bytes that the compiler knows.
  template <class P, class Copy>
  HWY_INLINE void ForPixels(P* pixels, const Layout& layout, ptrdiff_t stride, int count, const Copy& copy) {
    const auto run = [&](auto present) HWY_ATTR {
      constexpr int n = decltype(present)::value;
      for (int i = 0; i < count; ++i)
        copy(pixels + layout.first + i * stride, samples + n * i, n * sizeof(T));
    };
    layout.present == 4 ? run(std::integral_constant<int, 4>()) : run(std::integral_constant<int, 3>());
  }
};

template <PixelType type>
void LoadTyped(const LoadArgs& args) {
  using S = Samples<type>;
  using T = typename S::T;
  const Layout layout = Classify(args);
  // Samples that are not aligned to their size go through the copy below.
  const bool aligned = layout.first == PTRDIFF_MAX ||
                       reinterpret_cast<uintptr_t>(args.pixels + layout.first) % alignof(T) == 0;
  const T* const pixels =
      reinterpret_cast<const T*>(args.pixels + (layout.first == PTRDIFF_MAX ? 0 : layout.first));
  if (layout.kind == Layout::kRgba && aligned) {
    float* const plane[4] = {args.plane[layout.plane_of[0]], args.plane[layout.plane_of[1]],
                             args.plane[layout.plane_of[2]], args.plane[layout.plane_of[3]]};
    LoadGroups(pixels, 4, args.count, [&](const T* p, int first, int n) HWY_ATTR {
      for (int i = 0; i < n; i += kLanes) {
        // The next block's pixels: the processor's own prefetching sleeps while this one is worked on, and
        // ends at the page. With two or more images half of the time goes there.
        PrefetchRow<T>(p, 4 * (i + kBlockPixels), 4 * kLanes);
        StorePlanes(ValuesOf<type>(LoadRgbaCodes<type>(p + 4 * i)), plane, first + i);
      }
    });
  } else if (layout.kind == Layout::kRgb && aligned) {
    float* const plane[3] = {args.plane[layout.plane_of[0]], args.plane[layout.plane_of[1]],
                             args.plane[layout.plane_of[2]]};
    LoadGroups(pixels, 3, args.count, [&](const T* p, int first, int n) HWY_ATTR {
      for (int i = 0; i < n; i += kLanes) {
        PrefetchRow<T>(p, 3 * (i + kBlockPixels), 3 * kLanes);
        V x, y, z;
        LoadRgbVector<type>(p + 3 * i, x, y, z);
        hn::StoreU(x, D(), plane[0] + first + i);
        hn::StoreU(y, D(), plane[1] + first + i);
        hn::StoreU(z, D(), plane[2] + first + i);
      }
    });
  } else if (layout.kind == Layout::kPart) {
    Compact<type> compact;
    compact.ForPixels(args.pixels, layout, args.pixel_stride, args.count,
                      [](const std::byte* pixel, T* here, size_t bytes)
                          HWY_ATTR { std::memcpy(here, pixel, bytes); });
    LoadTyped<type>(compact.Of(args, layout));
  } else {
    for (int c = 0; c < 4; ++c) {
      if (args.channel[c] == kNoChannel) continue;
      const std::byte* const from = args.pixels + args.channel[c];
      if (layout.kind == Layout::kPlanar && reinterpret_cast<uintptr_t>(from) % alignof(T) == 0) {
        LoadPlane<type>(reinterpret_cast<const T*>(from), args.count, args.plane[c]);
        continue;
      }
      alignas(64) T samples[kBlockPixels];
      for (int i = 0; i < args.count; ++i) std::memcpy(&samples[i], from + i * args.pixel_stride, sizeof(T));
      LoadPlane<type>(samples, args.count, args.plane[c]);
    }
  }
}

template <PixelType type>
void StoreTyped(const StoreArgs& args) {
  using S = Samples<type>;
  using T = typename S::T;
  const Layout layout = Classify(args);
  const bool aligned = layout.first == PTRDIFF_MAX ||
                       reinterpret_cast<uintptr_t>(args.pixels + layout.first) % alignof(T) == 0;
  T* const pixels = reinterpret_cast<T*>(args.pixels + (layout.first == PTRDIFF_MAX ? 0 : layout.first));
  if (layout.kind == Layout::kRgba && aligned) {
    const float* const plane[4] = {args.plane[layout.plane_of[0]], args.plane[layout.plane_of[1]],
                                   args.plane[layout.plane_of[2]], args.plane[layout.plane_of[3]]};
    StoreGroups(pixels, 4, args.count, args.stream, [&](T* p, int first, int n, bool around) HWY_ATTR {
      for (int i = 0; i < n; i += kLanes)
        StoreRgba<type, true>(LoadPlanes(plane, first + i), p + 4 * i, around);
    });
  } else if (layout.kind == Layout::kRgb && aligned) {
    const float* const plane[3] = {args.plane[layout.plane_of[0]], args.plane[layout.plane_of[1]],
                                   args.plane[layout.plane_of[2]]};
    StoreGroups(pixels, 3, args.count, false, [&](T* p, int first, int n, bool) HWY_ATTR {
      for (int i = 0; i < n; i += kLanes) {
        StoreRgbVector<type>(hn::LoadU(D(), plane[0] + first + i), hn::LoadU(D(), plane[1] + first + i),
                             hn::LoadU(D(), plane[2] + first + i), p + 3 * i);
      }
    });
  } else if (layout.kind == Layout::kPart) {
    Compact<type> compact;
    StoreArgs here = compact.Of(args, layout);
    here.stream = false;
    StoreTyped<type>(here);
    compact.ForPixels(args.pixels, layout, args.pixel_stride, args.count,
                      [](std::byte* pixel, const T* from, size_t bytes)
                          HWY_ATTR { std::memcpy(pixel, from, bytes); });
  } else {
    for (int c = 0; c < 4; ++c) {
      if (args.channel[c] == kNoChannel) continue;
      std::byte* const to = args.pixels + args.channel[c];
      if (layout.kind == Layout::kPlanar && reinterpret_cast<uintptr_t>(to) % alignof(T) == 0) {
        StorePlane<type>(args.plane[c], args.count, args.stream, reinterpret_cast<T*>(to));
        continue;
      }
      alignas(64) T samples[kBlockPixels];
      StorePlane<type>(args.plane[c], args.count, false, samples);
      for (int i = 0; i < args.count; ++i) std::memcpy(to + i * args.pixel_stride, &samples[i], sizeof(T));
    }
  }
}

void LoadBlock(const LoadArgs& args) {
  switch (args.type) {
    case PixelType::kUint8:
      return LoadTyped<PixelType::kUint8>(args);
    case PixelType::kUint16:
      return LoadTyped<PixelType::kUint16>(args);
    case PixelType::kHalf:
      return LoadTyped<PixelType::kHalf>(args);
    case PixelType::kFloat:
      return LoadTyped<PixelType::kFloat>(args);
  }
}
void StoreBlock(const StoreArgs& args) {
  switch (args.type) {
    case PixelType::kUint8:
      return StoreTyped<PixelType::kUint8>(args);
    case PixelType::kUint16:
      return StoreTyped<PixelType::kUint16>(args);
    case PixelType::kHalf:
      return StoreTyped<PixelType::kHalf>(args);
    case PixelType::kFloat:
      return StoreTyped<PixelType::kFloat>(args);
  }
}

constexpr std::array<int32_t, kBlockPixels> MakeOrder() {
  std::array<int32_t, kBlockPixels> order{};
  for (int i = 0; i < kBlockPixels; ++i) order[i] = i / kLanes * kLanes + PixelOfLane(i % kLanes);
  return order;
}
constexpr std::array<int32_t, kBlockPixels> kOrder = MakeOrder();

PixelFunctions Functions() { return {LoadBlock, StoreBlock, kOrder.data()}; }

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::simd {

HWY_EXPORT(Functions);

PixelFunctions CurrentPixelFunctions() { return HWY_DYNAMIC_DISPATCH(Functions)(); }
void FlushStreams() { hwy::FlushStream(); }

}  // namespace tessera::simd
#endif
