// Chunks of four planes from and to where a point stage's pixels are: planes, or interleaved RGBA of any
// type.
#if defined(TESSERA_SIMD_FUSED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_FUSED_INL_H_
#undef TESSERA_SIMD_FUSED_INL_H_
#else
#define TESSERA_SIMD_FUSED_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// f(std::integral_constant<PixelType, type>).
template <class F>
HWY_INLINE void WithType(PixelType type, const F& f) {
  switch (type) {
    case PixelType::kUint8:
      return f(std::integral_constant<PixelType, PixelType::kUint8>());
    case PixelType::kUint16:
      return f(std::integral_constant<PixelType, PixelType::kUint16>());
    case PixelType::kHalf:
      return f(std::integral_constant<PixelType, PixelType::kHalf>());
    case PixelType::kFloat:
      return f(std::integral_constant<PixelType, PixelType::kFloat>());
  }
}

// Asks for the cache line of samples that a loop over blocks will need.
template <class T>
HWY_INLINE void PrefetchVectors(const T* p, int samples) {
  for (int k = 0; k < samples; k += static_cast<int>(64 / sizeof(T))) hwy::Prefetch(p + k);
}

// Pixels [first, first + count) of input 0 as values into planes (64-byte aligned, at index 0), in plane
// order; count is a multiple of kLanes.
HWY_INLINE void LoadChunk(const graph::PointArgs& args, int first, int count, float* const plane[4]) {
  const D d;
  const auto store = [&](const Pixels& p, int i) HWY_ATTR {
    hn::Store(p.r, d, plane[0] + i), hn::Store(p.g, d, plane[1] + i);
    hn::Store(p.b, d, plane[2] + i), hn::Store(p.a, d, plane[3] + i);
  };
  if (args.source.read == nullptr) {
    for (int i = 0; i < count; i += kLanes) store(LoadPlanes(args.in[0], first + i), i);
    return;
  }
  WithType(args.source.type, [&](auto tag) HWY_ATTR {
    constexpr PixelType type = decltype(tag)::value;
    const auto* const from = reinterpret_cast<const typename Samples<type>::T*>(args.source.read) + 4 * first;
    // While a chunk is worked on the processor's own prefetching sleeps: asking four chunks ahead saves a
    // quarter.
    for (int i = 0; i < 4 * count; i += static_cast<int>(64 / sizeof(*from)))
      hwy::Prefetch(from + 16 * count + i);
    for (int i = 0; i < count; i += kLanes) store(ValuesOf<type>(LoadRgbaCodes<type>(from + 4 * i)), i);
  });
}

// load(i) -> Pixels at index i, as values, to the result's pixels [first, first + count).
template <class Load>
HWY_INLINE void StoreChunk(const graph::PointArgs& args, int first, int count, const Load& load) {
  if (args.sink.write == nullptr) {
    for (int i = 0; i < count; i += kLanes) StorePlanes(load(i), args.out, first + i);
    return;
  }
  WithType(args.sink.type, [&](auto tag) HWY_ATTR {
    constexpr PixelType type = decltype(tag)::value;
    auto* const to = reinterpret_cast<typename Samples<type>::T*>(args.sink.write) + 4 * first;
    const bool stream = args.sink.stream && CanStream(to);
    for (int i = 0; i < count; i += kLanes) StoreRgba<type, true>(load(i), to + 4 * i, stream);
  });
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
