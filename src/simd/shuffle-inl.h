// Shuffles that Highway 1.0.3 has no verb for, or only a dearer one. Each has a portable form and says what
// the special one saves.
#if defined(TESSERA_SIMD_SHUFFLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_SHUFFLE_INL_H_
#undef TESSERA_SIMD_SHUFFLE_INL_H_
#else
#define TESSERA_SIMD_SHUFFLE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// The even and the odd lanes of two vectors, block of 128 bits by block: the two of low's first block, the
// two of high's first block, then those of the second blocks. One instruction each; ConcatEven and ConcatOdd,
// which keep the lanes' order, take three from 256 bits on.
HWY_INLINE V EvenInBlocks(V low, V high) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return V{_mm512_shuffle_ps(low.raw, high.raw, 0x88)};
#elif HWY_ARCH_X86 && HWY_TARGET == HWY_AVX2
  return V{_mm256_shuffle_ps(low.raw, high.raw, 0x88)};
#else
  static_assert(kLanes == 4);
  return hn::ConcatEven(D(), high, low);
#endif
}
HWY_INLINE V OddInBlocks(V low, V high) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return V{_mm512_shuffle_ps(low.raw, high.raw, 0xDD)};
#elif HWY_ARCH_X86 && HWY_TARGET == HWY_AVX2
  return V{_mm256_shuffle_ps(low.raw, high.raw, 0xDD)};
#else
  static_assert(kLanes == 4);
  return hn::ConcatOdd(D(), high, low);
#endif
}
HWY_INLINE void SplitInBlocks(V low, V high, V& even, V& odd) {
  even = EvenInBlocks(low, high), odd = OddInBlocks(low, high);
}
// From the order of those to that of the lanes.
template <class Vec>
HWY_INLINE Vec LanesOfBlocks(Vec v) {
  if constexpr (kLanes == 4) {
    return v;
  } else {
    alignas(64) static constexpr int32_t kFrom[2][16] = {
        {0, 1, 4, 5, 2, 3, 6, 7}, {0, 1, 4, 5, 8, 9, 12, 13, 2, 3, 6, 7, 10, 11, 14, 15}};
    return hn::TableLookupLanes(v, hn::SetTableIndices(hn::DFromV<Vec>(), kFrom[kLanes == 16]));
  }
}

// The even and the odd blocks of 128 bits of two vectors, in order. Of 512 bits in one instruction, for which
// Highway's halves take two.
template <class Vec>
HWY_INLINE Vec EvenBlocks(Vec a, Vec b) {
  const hn::DFromV<Vec> d;
  static_assert(sizeof(hn::TFromD<decltype(d)>) == 4 && hn::MaxLanes(d) <= 16);
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  if constexpr (hn::MaxLanes(d) == 16) return Vec{_mm512_shuffle_f32x4(a.raw, b.raw, 0x88)};
#endif
  if constexpr (hn::MaxLanes(d) == 8) return hn::ConcatLowerLower(d, b, a);
  static_cast<void>(b);
  return a;
}
template <class Vec>
HWY_INLINE Vec OddBlocks(Vec a, Vec b) {
  const hn::DFromV<Vec> d;
  static_assert(sizeof(hn::TFromD<decltype(d)>) == 4 && hn::MaxLanes(d) <= 16);
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  if constexpr (hn::MaxLanes(d) == 16) return Vec{_mm512_shuffle_f32x4(a.raw, b.raw, 0xDD)};
#endif
  if constexpr (hn::MaxLanes(d) == 8) return hn::ConcatUpperUpper(d, b, a);
  static_cast<void>(a);
  return b;
}

// Lane lane[i] of a, or of b from kLanes on; `lane` is aligned to a vector. One instruction for three.
HWY_INLINE V OfBoth(V a, V b, const int32_t* lane) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return V{_mm512_permutex2var_ps(a.raw, _mm512_load_si512(lane), b.raw)};
#else
  const DI di;
  const VI number = hn::Load(di, lane);
  const auto index = hn::IndicesFromVec(D(), hn::And(number, hn::Set(di, kLanes - 1)));
  return hn::IfThenElse(hn::RebindMask(D(), hn::Lt(number, hn::Set(di, kLanes))),
                        hn::TableLookupLanes(a, index), hn::TableLookupLanes(b, index));
#endif
}

// Lanes 1 and on of a, then lane 0 of b: neighbours on the right. Of 512 bits in one instruction, for which
// Highway's verbs take three.
HWY_INLINE V OneOn(V a, V b) {
  const D d;
  if constexpr (kLanes == 16) {
    alignas(64) static constexpr int32_t kNext[16] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
    return OfBoth(a, b, kNext);
  } else if constexpr (kLanes == 8) {
    return hn::CombineShiftRightBytes<4>(d, hn::ConcatLowerUpper(d, b, a), a);
  } else {
    return hn::CombineShiftRightBytes<4>(d, b, a);
  }
}

// table[index % kLanes]: where the instruction looks at those bits alone, nothing has to be cut off.
HWY_INLINE V OneOfLanes(V table, VU index) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return V{_mm512_permutexvar_ps(index.raw, table.raw)};
#else
  const VI number = hn::BitCast(DI(), hn::And(index, hn::Set(DU(), kLanes - 1)));
  return hn::TableLookupLanes(table, hn::IndicesFromVec(D(), number));
#endif
}
// The one of the four lanes of its block of 128 bits that a lane's index says, modulo 4; all blocks of `four`
// are alike.
HWY_INLINE V OneOfFour(V four, VU index) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return V{_mm512_permutevar_ps(four.raw, index.raw)};
#elif HWY_ARCH_X86 && HWY_TARGET == HWY_AVX2
  return V{_mm256_permutevar_ps(four.raw, index.raw)};
#else
  const VI number = hn::BitCast(DI(), hn::And(index, hn::Set(DU(), 3u)));
  return hn::TableLookupLanes(four, hn::IndicesFromVec(D(), number));
#endif
}

// Both halves of each lane looked up in a table of kTableWords words of 16 bits: table[word % kTableWords].
inline constexpr int kTableWords = 32;
HWY_INLINE VU LookUpWords(const uint16_t* table, VU words) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return VU{_mm512_permutexvar_epi16(words.raw, _mm512_loadu_si512(table))};
#else
  alignas(64) uint16_t word[2 * kLanes];
  hn::Store(words, DU(), reinterpret_cast<uint32_t*>(word));
  for (uint16_t& w : word) w = table[w % kTableWords];
  return hn::Load(DU(), reinterpret_cast<const uint32_t*>(word));
#endif
}

// yes in lanes where `sign` is negative (-0 or NaN: either), else no. On AVX2 the instruction looks at the
// sign alone; compilers that see through an intrinsic compare with 0 first.
HWY_INLINE V IfNegative(V sign, V yes, V no) {
#if HWY_TARGET == HWY_AVX2
  V r;
  asm("vblendvps %3, %2, %1, %0" : "=x"(r.raw) : "x"(no.raw), "x"(yes.raw), "x"(sign.raw));
  return r;
#else
  return hn::IfThenElse(hn::Lt(sign, hn::Zero(D())), yes, no);
#endif
}

// The lanes of a vector, one by one, as offsets for loads.
#if HWY_TARGET == HWY_AVX2
// Two at a time are moved to where they are an address. Through memory takes longer, since few loads a cycle
// can be served by a store that has not ended.
class LaneList {
 public:
  explicit HWY_INLINE LaneList(VU v) {
    const __m128i low = _mm256_castsi256_si128(v.raw), high = _mm256_extracti128_si256(v.raw, 1);
    pairs_[0] = static_cast<uint64_t>(_mm_cvtsi128_si64(low));
    pairs_[1] = static_cast<uint64_t>(_mm_extract_epi64(low, 1));
    pairs_[2] = static_cast<uint64_t>(_mm_cvtsi128_si64(high));
    pairs_[3] = static_cast<uint64_t>(_mm_extract_epi64(high, 1));
  }
  HWY_INLINE uint64_t operator[](int lane) const {
    const uint64_t pair = pairs_[lane / 2];
    return lane % 2 == 0 ? static_cast<uint32_t>(pair) : pair >> 32;
  }

 private:
  uint64_t pairs_[4];
};
#else
// Through memory: where each is an address that takes fewer instructions than to move them out one by one,
// which compilers would do were the memory not volatile.
class LaneList {
 public:
  explicit HWY_INLINE LaneList(VU v) { hn::Store(v, DU(), lanes_); }
  HWY_INLINE uint32_t operator[](int lane) const {
    return static_cast<const volatile uint32_t*>(lanes_)[lane];
  }

 private:
  alignas(64) uint32_t lanes_[kLanes];
};
#endif

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
