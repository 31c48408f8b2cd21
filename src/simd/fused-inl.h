// Point stages that work straight from and to interleaved RGBA of any type, and chunks of four planes from
// and to where a stage's pixels are: planes, or such pixels.
#if defined(TESSERA_SIMD_FUSED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_FUSED_INL_H_
#undef TESSERA_SIMD_FUSED_INL_H_
#else
#define TESSERA_SIMD_FUSED_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <concepts>
#include <memory>
#include <type_traits>
#include <utility>

#include "base/prefetch.h"
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
    base::PrefetchAhead(from, 4 * count);
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

// f of samples (V...) or pixels (Pixels...). A functor of samples may have a cheaper form OfFinite for those
// that come from integers, with the same results.
template <int kInputs, class F>
struct Fusing {
  template <class T, size_t... k>
  static constexpr bool Takes(std::index_sequence<k...>) {
    return std::is_invocable_v<const F&, decltype((void)k, std::declval<const T&>())...>;
  }
  using Inputs = std::make_index_sequence<kInputs>;
  static constexpr bool kSamples = Takes<V>(Inputs());

  template <PixelType type>
  struct OfType {
    const F& f;
    template <class... T>
    HWY_INLINE V operator()(T... v) const {
      constexpr bool kInteger = type == PixelType::kUint8 || type == PixelType::kUint16;
      if constexpr (kInteger && requires { f.OfFinite(v...); }) {
        return f.OfFinite(v...);
      } else {
        return f(v...);
      }
    }
  };

  template <class G, class... P>
  static HWY_INLINE Pixels Apply(const G& f, const P&... p) {
    if constexpr (kSamples) {
      return {f(p.r...), f(p.g...), f(p.b...), f(p.a...)};
    } else {
      return f(p...);
    }
  }

  // From all inputs' pixels to the result's, all of one type. Samples stay interleaved: nothing is
  // transposed.
  template <PixelType type, size_t... k>
  static HWY_INLINE void Direct(const graph::PointArgs& args, const F& f, std::index_sequence<k...>) {
    using S = Samples<type>;
    using T = typename S::T;
    const T* const from[] = {reinterpret_cast<const T*>((k == 0 ? args.source : args.others[k - 1]).read)...};
    T* const to = reinterpret_cast<T*>(args.sink.write);
    // In place the line is in the cache already.
    const bool stream = args.sink.stream && CanStream(to) && ((to != from[k]) && ...);
    const int count = 4 * args.count;
    if constexpr (kSamples && type == PixelType::kUint8) {
      // Every fourth byte to a vector: packing four vectors at once costs less than each alone, and which
      // samples share a vector does not matter.
      for (int i = 0; i < count; i += 4 * kLanes) {
        const auto read = [i](const T* p) HWY_ATTR {
          base::PrefetchAhead(p + i, 4 * kLanes);
          return ValuesOf<type>(UnpackRgba8(hn::LoadU(DU(), reinterpret_cast<const uint32_t*>(p + i))));
        };
        const Pixels q = Apply(OfType<type>{f}, read(from[k])...);
        StoreOrStream(PackRgba8(ToUnormBits<256>(q.r), ToUnormBits<256>(q.g), ToUnormBits<256>(q.b),
                                ToUnormBits<256>(q.a)),
                      DU(), reinterpret_cast<uint32_t*>(to + i), stream);
      }
    } else if constexpr (kSamples) {
      for (int i = 0; i < count; i += kLanes) {
        (base::PrefetchAhead(from[k] + i, kLanes), ...);
        S::StoreValues(OfType<type>{f}(S::Value(S::LoadCodes(from[k] + i))...), to + i, stream);
      }
    } else {
      for (int i = 0; i < count; i += 4 * kLanes) {
        (base::PrefetchAhead(from[k] + i, 4 * kLanes), ...);
        StoreRgba<type, true>(f(ValuesOf<type>(LoadRgbaCodes<type>(from[k] + i))...), to + i, stream);
      }
    }
  }
};

// A stage that runs a functor on the samples of kInputs images, all alike, or on their pixels, straight from
// memory to memory where it may. Positions, and an alpha that samples need, are for MakeStage and
// MakePairStage.
template <int kInputs, class F>
class FusedStage final : public graph::PointStage {
 public:
  static_assert(kInputs >= 1 && kInputs <= 3);
  explicit FusedStage(F f) : f_(std::move(f)) {}
  bool CanFuse(bool, PixelType) const override { return kInputs == 1; }
  bool CanFuseAll(PixelType) const override { return kInputs > 1; }
  bool AnyLength() const override { return true; }
  std::unique_ptr<graph::PointStage> OfSamples(int) const override {
    if constexpr (Kernel::kSamples) return std::make_unique<FusedStage>(f_);
    return nullptr;
  }

  void Run(const graph::PointArgs& args) const override {
    const F f(f_);
    const bool whole = args.sink.write != nullptr && args.source.read != nullptr;
    if (whole && (kInputs > 1 || args.source.type == args.sink.type)) {
      return WithType(args.sink.type, [&](auto tag) HWY_ATTR {
        Kernel::template Direct<decltype(tag)::value>(args, f, typename Kernel::Inputs());
      });
    }
    if constexpr (kInputs == 1) {
      if (args.sink.write != nullptr || args.source.read != nullptr) return InChunks(args, f);
    }
    RunPoint<kInputs>(
        args, [&f](const std::same_as<Pixels> auto&... p) HWY_ATTR { return Kernel::Apply(f, p...); });
  }

 private:
  using Kernel = Fusing<kInputs, F>;

  static void InChunks(const graph::PointArgs& args, const F& f) {
    constexpr int kChunk = 64;
    alignas(64) float samples[4 * kChunk];
    float* const plane[4] = {samples, samples + kChunk, samples + 2 * kChunk, samples + 3 * kChunk};
    for (int first = 0; first < args.count; first += kChunk) {
      const int count = std::min(kChunk, args.count - first);
      LoadChunk(args, first, count, plane);
      StoreChunk(args, first, count, [&](int i) HWY_ATTR { return Kernel::Apply(f, LoadPlanes(plane, i)); });
    }
  }

  F f_;
};

template <int kInputs, class F>
std::unique_ptr<graph::PointStage> MakeFusedStage(F f) {
  return std::make_unique<FusedStage<kInputs, F>>(std::move(f));
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
