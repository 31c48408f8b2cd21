// 8-bit RGBA pixels through a table of 256 bytes for each channel.
#if defined(TESSERA_SIMD_CODE_MAPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_CODE_MAPS_INL_H_
#undef TESSERA_SIMD_CODE_MAPS_INL_H_
#else
#define TESSERA_SIMD_CODE_MAPS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

#include "base/prefetch.h"
#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

using DCodes = hn::Repartition<uint8_t, D>;
using Codes = hn::Vec<DCodes>;

#if HWY_TARGET == HWY_AVX3
// 256 bytes in registers, as 128 words of two entries each: half the instructions of the form below.
struct CodeMap {
  __m512i words[4];

  HWY_INLINE explicit CodeMap(const uint8_t* map) {
    for (int k = 0; k < 4; ++k) words[k] = _mm512_loadu_si512(map + 64 * k);
  }
  // The word that holds the entry of each code in 0..255.
  HWY_INLINE __m512i Word(__m512i code) const {
    const __m512i index = _mm512_srli_epi16(code, 1);
    return _mm512_mask_blend_epi16(_mm512_test_epi16_mask(code, _mm512_set1_epi16(0x80)),
                                   _mm512_permutex2var_epi16(words[0], index, words[1]),
                                   _mm512_permutex2var_epi16(words[2], index, words[3]));
  }
};
// The half of each word that its code's lowest bit says.
HWY_INLINE __m512i HalfOfWord(__m512i word, __m512i code) {
  const __m512i shift = _mm512_slli_epi16(_mm512_and_si512(code, _mm512_set1_epi16(1)), 3);
  return _mm512_and_si512(_mm512_srlv_epi16(word, shift), _mm512_set1_epi16(0xFF));
}
// Sixteen RGBA pixels.
template <bool kOne>
HWY_INLINE __m512i MapPixels(const CodeMap* maps, __m512i codes) {
  const __m512i even = _mm512_and_si512(codes, _mm512_set1_epi16(0xFF)), odd = _mm512_srli_epi16(codes, 8);
  __m512i even_word = maps[0].Word(even), odd_word = maps[kOne ? 0 : 1].Word(odd);
  if constexpr (!kOne) {
    even_word = _mm512_mask_blend_epi16(0xAAAAAAAAu, even_word, maps[2].Word(even));
    odd_word = _mm512_mask_blend_epi16(0xAAAAAAAAu, odd_word, maps[3].Word(odd));
  }
  return _mm512_or_si512(HalfOfWord(even_word, even), _mm512_slli_epi16(HalfOfWord(odd_word, odd), 8));
}
#else
// 256 bytes in sixteen rows of sixteen: each row gives the entry of a code's lower half, and the bits of the
// upper half choose among the rows. That is half the instructions of a load for each code.

// `yes` where the bit of a code that is shifted to its highest place is set, else `no`.
template <int shift>
HWY_INLINE Codes Choose(Codes codes, Codes yes, Codes no) {
  const hn::Repartition<uint16_t, D> d16;
  const hn::Repartition<int8_t, D> d8;
  const auto sign = hn::BitCast(d8, hn::ShiftLeft<shift>(hn::BitCast(d16, codes)));
  return hn::BitCast(DCodes(), hn::IfNegativeThenElse(sign, hn::BitCast(d8, yes), hn::BitCast(d8, no)));
}
// The entries in the 2^levels rows from `row` on.
template <int levels>
HWY_INLINE Codes MapRows(const uint8_t* row, Codes low, Codes codes) {
  if constexpr (levels == 0) {
    return hn::TableLookupBytes(hn::LoadDup128(DCodes(), row), low);
  } else {
    const Codes no = MapRows<levels - 1>(row, low, codes);
    const Codes yes = MapRows<levels - 1>(row + (16 << (levels - 1)), low, codes);
    return Choose<4 - levels>(codes, yes, no);
  }
}
HWY_INLINE Codes MapCodesOf(const uint8_t* map, Codes codes) {
  return MapRows<4>(map, hn::And(codes, hn::Set(DCodes(), 15)), codes);
}
// Within 128 bits the four samples of a channel side by side, and back.
alignas(16) inline constexpr uint8_t kByChannel[16] = {0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15};
// Four vectors of RGBA pixels to vectors of one channel each, and back.
HWY_INLINE void SplitChannels(Codes* v) {
  const Codes order = hn::LoadDup128(DCodes(), kByChannel);
  V w[4];
  for (int k = 0; k < 4; ++k) w[k] = hn::BitCast(D(), hn::TableLookupBytes(v[k], order));
  Transpose4(w[0], w[1], w[2], w[3]);
  for (int k = 0; k < 4; ++k) v[k] = hn::BitCast(DCodes(), w[k]);
}
HWY_INLINE void JoinChannels(Codes* v) {
  const Codes order = hn::LoadDup128(DCodes(), kByChannel);
  V w[4];
  for (int k = 0; k < 4; ++k) w[k] = hn::BitCast(D(), v[k]);
  Transpose4(w[0], w[1], w[2], w[3]);
  for (int k = 0; k < 4; ++k) v[k] = hn::TableLookupBytes(hn::BitCast(DCodes(), w[k]), order);
}
#endif

// One table of 256 bytes per channel.
class CodeMaps {
 public:
  static constexpr int kCodes = 256;

  explicit CodeMaps(const uint8_t (&maps)[4][kCodes]) {
    std::memcpy(map_, maps, sizeof map_);
    one_map_ = true;
    for (int k = 1; k < 4; ++k) one_map_ = one_map_ && std::memcmp(map_[0], map_[k], kCodes) == 0;
  }

  // `count` pixels; `stream`: around the cache, which CanStream(to) has to allow.
  void Run(const uint8_t* from, uint8_t* to, int count, bool stream) const {
    int i = 0;
#if HWY_TARGET == HWY_AVX3
    const CodeMap maps[4] = {CodeMap(map_[0]), CodeMap(map_[1]), CodeMap(map_[2]), CodeMap(map_[3])};
    const auto store = [&](__m512i v)
                           HWY_ATTR { StoreOrStream(hn::Vec<DCodes>{v}, DCodes(), to + i, stream); };
    const auto next = [&]() HWY_ATTR {
      base::PrefetchAhead(from + i, 64);
      return _mm512_loadu_si512(from + i);
    };
    if (one_map_) {
      for (; i + 64 <= 4 * count; i += 64) store(MapPixels<true>(maps, next()));
    } else {
      for (; i + 64 <= 4 * count; i += 64) store(MapPixels<false>(maps, next()));
    }
#else
    const DCodes d;
    constexpr int kBytes = static_cast<int>(hn::MaxLanes(d));
    for (; i + 4 * kBytes <= 4 * count; i += 4 * kBytes) {
      base::PrefetchAhead(from + i, 4 * kBytes);
      Codes v[4];
      for (int k = 0; k < 4; ++k) v[k] = hn::LoadU(d, from + i + k * kBytes);
      if (!one_map_) SplitChannels(v);
      for (int k = 0; k < 4; ++k) v[k] = MapCodesOf(map_[k], v[k]);
      if (!one_map_) JoinChannels(v);
      for (int k = 0; k < 4; ++k) StoreOrStream(v[k], d, to + i + k * kBytes, stream);
    }
#endif
    for (; i < 4 * count; ++i) to[i] = map_[i % 4][from[i]];
  }

 private:
  alignas(64) uint8_t map_[4][kCodes];
  bool one_map_;
};

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
