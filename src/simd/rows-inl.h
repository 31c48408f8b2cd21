// What kernels that go along rows of samples share: parts of vectors at a row's end, vectors that begin
// between two others.
#if defined(TESSERA_SIMD_ROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_ROWS_INL_H_
#undef TESSERA_SIMD_ROWS_INL_H_
#else
#define TESSERA_SIMD_ROWS_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// The vector at `from`, of whose lanes only the first `count` may be read; the others are 0.
template <class DT>
HWY_INLINE hn::Vec<DT> LoadPart(DT d, const hn::TFromD<DT>* from, int count) {
  if (count >= static_cast<int>(hn::MaxLanes(d))) return hn::LoadU(d, from);
  HWY_ALIGN hn::TFromD<DT> lanes[hn::MaxLanes(DT())] = {};
  std::copy_n(from, count, lanes);
  return hn::Load(d, lanes);
}

// f(i), i = 0, N, 2 N, ...: vectors of N lanes to the `count` samples at `to`, the last one in part.
template <class DT, class F>
HWY_INLINE void StoreRow(DT d, int count, hn::TFromD<DT>* to, const F& f) {
  constexpr int kN = static_cast<int>(hn::MaxLanes(DT()));
  int i = 0;
  for (; i + kN <= count; i += kN) hn::StoreU(f(i), d, to + i);
  if (i == count) return;
  HWY_ALIGN hn::TFromD<DT> lanes[kN];
  hn::Store(f(i), d, lanes);
  std::copy_n(lanes, count - i, to + i);
}

// The vector that begins kBlocks blocks of 128 bits into `low`, which `high` follows. One instruction of 512
// bits; through memory a load waits for two stores.
template <int kBlocks>
HWY_INLINE V ShiftBlocks(V low, V high) {
  static_assert(kBlocks > 0 && 4 * kBlocks < kLanes);
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return V{_mm512_castsi512_ps(
      _mm512_alignr_epi32(_mm512_castps_si512(high.raw), _mm512_castps_si512(low.raw), 4 * kBlocks))};
#else
  HWY_ALIGN float lanes[2 * kLanes];
  hn::Store(low, D(), lanes);
  hn::Store(high, D(), lanes + kLanes);
  return hn::LoadU(D(), lanes + 4 * kBlocks);
#endif
}

// Keeps a value in its register, where the compiler would rather load it again for every use.
HWY_INLINE V Held(V v) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_EMU128
  asm("" : "+v"(v.raw));
#endif
  return v;
}

// Four vectors of whole numbers to bytes, limited to 0 to 255. On AVX2 half the instructions: Highway's way
// narrows each vector by itself.
HWY_INLINE void StoreBytes(V a, V b, V c, V e, uint8_t* to) {
#if HWY_TARGET == HWY_AVX2
  const __m256i low = _mm256_packs_epi32(_mm256_cvtps_epi32(a.raw), _mm256_cvtps_epi32(b.raw)),
                high = _mm256_packs_epi32(_mm256_cvtps_epi32(c.raw), _mm256_cvtps_epi32(e.raw));
  const __m256i order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                      _mm256_permutevar8x32_epi32(_mm256_packus_epi16(low, high), order));
#else
  const hn::Rebind<uint8_t, D> bytes;
  const DI di;
  hn::StoreU(hn::DemoteTo(bytes, hn::ConvertTo(di, a)), bytes, to);
  hn::StoreU(hn::DemoteTo(bytes, hn::ConvertTo(di, b)), bytes, to + kLanes);
  hn::StoreU(hn::DemoteTo(bytes, hn::ConvertTo(di, c)), bytes, to + 2 * kLanes);
  hn::StoreU(hn::DemoteTo(bytes, hn::ConvertTo(di, e)), bytes, to + 3 * kLanes);
#endif
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
