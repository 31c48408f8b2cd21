// Words from each place of a vector: places in memory, and what is read there.
#if defined(TESSERA_OPS_VOLUME_PLACES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_VOLUME_PLACES_INL_H_
#undef TESSERA_OPS_VOLUME_PLACES_INL_H_
#else
#define TESSERA_OPS_VOLUME_PLACES_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "simd/gather-inl.h"
#include "simd/point-inl.h"
#include "simd/texels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::DI;
using s::V;
using s::VI;
using M = hn::Mask<D>;

inline constexpr int kLanes = static_cast<int>(hn::MaxLanes(D()));
using D4 = hn::FixedTag<float, 4>;

struct Words {
  V a, b, c, e;
};
struct WordPair {
  V a, b;
};
// Indices in memory, as addresses need them.
struct Places {
  HWY_ALIGN int32_t at[kLanes];
  HWY_INLINE explicit Places(VI index) { hn::Store(index, DI(), at); }
  HWY_INLINE VI Index() const { return hn::Load(DI(), at); }
};
// Indices of a volume's samples, of which there may be more than 2^31.
using D64 = hn::Repartition<int64_t, D>;
struct FarPlaces {
  HWY_ALIGN int64_t at[kLanes];
  FarPlaces() = default;
  HWY_INLINE explicit FarPlaces(VI index) {
    hn::Store(Low(index), D64(), at);
    hn::Store(High(index), D64(), at + kLanes / 2);
  }
  static HWY_INLINE hn::Vec<D64> Low(VI v) { return hn::PromoteTo(D64(), hn::LowerHalf(hn::Half<DI>(), v)); }
  static HWY_INLINE hn::Vec<D64> High(VI v) { return hn::PromoteTo(D64(), hn::UpperHalf(hn::Half<DI>(), v)); }
};
// Asks for what is at base + stride * index bytes: loads that miss the caches hold up all that comes behind
// them, this does not.
HWY_INLINE void PrefetchPlaces(const void* base, const Places& places, ptrdiff_t stride) {
  for (const int32_t at : places.at) hwy::Prefetch(static_cast<const char*>(base) + stride * at);
}
// At base + stride * index bytes.
// Put together in registers: through memory the wide load would wait for the narrow stores. The blocks of 128
// bits of a register hold lanes four apart, so that shuffles within blocks leave them in order.
template <class Index>
HWY_INLINE V RowOfWords(const char* base, ptrdiff_t stride, const Index* at) {
  const auto one = [&](int lane) __attribute__((always_inline)) {
    return hn::LoadU(D4(), reinterpret_cast<const float*>(base + stride * at[lane]));
  };
  return s::VectorOfQuads(one, 0);
}
// 8 bytes for every second lane, as pairs of words.
template <class Index>
HWY_INLINE V RowOfWordPairs(const char* base, ptrdiff_t stride, const Index* at) {
  const auto two = [&](int lane) __attribute__((always_inline)) {
    const hn::FixedTag<float, 2> d2;
    const auto one = [&](int l) __attribute__((always_inline)) {
      return hn::LoadU(d2, reinterpret_cast<const float*>(base + stride * at[l]));
    };
    return hn::Combine(D4(), one(lane + 2), one(lane));
  };
  return s::VectorOfQuads(two, 0);
}
template <class P>
HWY_INLINE WordPair WordPairAt(const void* base, const P& places, ptrdiff_t stride) {
  const D d;
  const hn::Repartition<uint64_t, D> pairs;
  const auto* const p = static_cast<const char*>(base);
  const V even = RowOfWordPairs(p, stride, places.at), odd = RowOfWordPairs(p, stride, places.at + 1);
  return {hn::OddEven(hn::BitCast(d, hn::ShiftLeft<32>(hn::BitCast(pairs, odd))), even),
          hn::OddEven(odd, hn::BitCast(d, hn::ShiftRight<32>(hn::BitCast(pairs, even))))};
}
// 4 bytes for every lane; 4 before and 4 behind may be read too.
template <class P>
HWY_INLINE VI WordAt(const void* base, const P& places, ptrdiff_t stride) {
  const auto* const p = static_cast<const char*>(base);
  const V even = RowOfWordPairs(p, stride, places.at), odd = RowOfWordPairs(p - 4, stride, places.at + 1);
  return hn::BitCast(DI(), hn::OddEven(odd, even));
}
template <class P>
HWY_INLINE Words WordsAt(const void* base, const P& places, ptrdiff_t stride = 16) {
  const D d;
  const hn::Repartition<double, D> wide;
  const auto* const at = places.at;
  const auto* const p = static_cast<const char*>(base);
  const V r0 = RowOfWords(p, stride, at), r1 = RowOfWords(p, stride, at + 1);
  const V r2 = RowOfWords(p, stride, at + 2), r3 = RowOfWords(p, stride, at + 3);
  const auto low0 = hn::BitCast(wide, hn::InterleaveLower(d, r0, r1)),
             low1 = hn::BitCast(wide, hn::InterleaveLower(d, r2, r3)),
             high0 = hn::BitCast(wide, hn::InterleaveUpper(d, r0, r1)),
             high1 = hn::BitCast(wide, hn::InterleaveUpper(d, r2, r3));
  return {hn::BitCast(d, hn::InterleaveLower(wide, low0, low1)),
          hn::BitCast(d, hn::InterleaveUpper(wide, low0, low1)),
          hn::BitCast(d, hn::InterleaveLower(wide, high0, high1)),
          hn::BitCast(d, hn::InterleaveUpper(wide, high0, high1))};
}

// Four bytes for every lane; 4 more behind may be read.
HWY_INLINE VI BytesAt(const uint8_t* base, const Places& places) {
  return s::GatherWords<1>(base, places.Index());
}
HWY_INLINE VI BytesAt(const uint8_t* base, const FarPlaces& places) {
  return hn::BitCast(DI(), WordPairAt(base, places, 1).a);
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
