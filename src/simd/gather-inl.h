// Four bytes from each place of a vector.
#if defined(TESSERA_SIMD_GATHER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_GATHER_INL_H_
#undef TESSERA_SIMD_GATHER_INL_H_
#else
#define TESSERA_SIMD_GATHER_INL_H_
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "simd/shuffle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

#if HWY_TARGET == HWY_AVX2
// Processors whose best target this is take longer for the instruction than for eight loads.
template <int kStep>
HWY_INLINE hn::Vec<hn::Half<DI>> LoadFour(const uint8_t* from, hn::Vec<hn::Half<DI>> at) {
  const auto pairs = hn::BitCast(hn::Full128<int64_t>(), at);
  const int64_t low = hn::GetLane(pairs), high = hn::ExtractLane(pairs, 1);
  const auto load = [&](int64_t index) HWY_ATTR {
    int32_t v;
    std::memcpy(&v, from + kStep * index, 4);
    return v;
  };
  return hn::Vec<hn::Half<DI>>{_mm_set_epi32(load(high >> 32), load(static_cast<int32_t>(high)),
                                             load(low >> 32), load(static_cast<int32_t>(low)))};
}
#endif

// kStep: bytes that one place is from the next, 1 or 4.
template <int kStep>
HWY_INLINE VI GatherWords(const void* from, VI at) {
  const DI di;
#if HWY_TARGET == HWY_AVX2
  const hn::Half<DI> half;
  const auto* const bytes = static_cast<const uint8_t*>(from);
  return hn::Combine(di, LoadFour<kStep>(bytes, hn::UpperHalf(half, at)),
                     LoadFour<kStep>(bytes, hn::LowerHalf(half, at)));
#else
  const auto* const words = static_cast<const int32_t*>(from);
  if constexpr (kStep == 4) {
    return hn::GatherIndex(di, words, at);
  } else {
    return hn::GatherOffset(di, words, at);
  }
#endif
}
HWY_INLINE V GatherFloats(const float* from, VI at) { return hn::BitCast(D(), GatherWords<4>(from, at)); }

// Four bytes from each index in units of `Unit` (1 or 4 bytes). On AVX2 none may be negative.
template <class Unit>
HWY_INLINE VU LoadWords(const Unit* from, VU index) {
#if HWY_TARGET == HWY_AVX2
  // As above, where one register holds two indices and no sign has to be spread.
  const LaneList at(index);
  const auto word = [&](int i) HWY_ATTR {
    int32_t v;
    std::memcpy(&v, from + at[i], 4);
    return v;
  };
  const auto four = [&](int i) HWY_ATTR {
    const __m128i two = _mm_insert_epi32(_mm_cvtsi32_si128(word(i)), word(i + 1), 1);
    return _mm_insert_epi32(_mm_insert_epi32(two, word(i + 2), 2), word(i + 3), 3);
  };
  return VU{_mm256_inserti128_si256(_mm256_castsi128_si256(four(0)), four(4), 1)};
#else
  if constexpr (hn::MaxLanes(D()) >= 8 || sizeof(Unit) == 4) {
    return hn::BitCast(DU(), GatherWords<sizeof(Unit)>(from, hn::BitCast(DI(), index)));
  } else {
    alignas(16) uint32_t four[kLanes];
    const LaneList at(index);
    for (int i = 0; i < kLanes; ++i) std::memcpy(four + i, from + static_cast<int32_t>(at[i]), 4);
    return hn::Load(DU(), four);
  }
#endif
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
