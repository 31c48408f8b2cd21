// Channels through 1-D tables of their own; 8-bit pixels code by code.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <type_traits>

#include "ops/lookup/point_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/lookup/tables1d_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/lookup/gather-inl.h"
#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

#if HWY_TARGET == HWY_AVX3
// 256 bytes in registers, as 128 words of two entries each.
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
#endif

class Tables1DStage final : public graph::PointStage {
 public:
  explicit Tables1DStage(const std::shared_ptr<const Grid> (&grids)[4]) {
    std::copy(std::begin(grids), std::end(grids), std::begin(grids_));
    for (const auto& grid : grids_) {
      if (grid == nullptr) continue;
      lookup_ = MethodOf<1, 1, true>(grid->params().filter);
      linear_inside_ = grid->params().filter == TableFilter::kLinear;
    }
    for (const auto& grid : grids_)
      linear_inside_ = linear_inside_ && (grid == nullptr || grid->ends_inside());
    MapCodes();
  }

  bool CanFuse(bool, PixelType) const override { return true; }

  void Run(const graph::PointArgs& args) const override {
    if (args.source.read != nullptr && args.source.type == PixelType::kUint8 && args.sink.write != nullptr &&
        args.sink.type == PixelType::kUint8) {
      return RunCodes(reinterpret_cast<const uint8_t*>(args.source.read),
                      reinterpret_cast<uint8_t*>(args.sink.write), args.count,
                      args.sink.stream && s::CanStream(args.sink.write));
    }
    Chunk chunk;
    alignas(64) float plane[4][kChunk];
    float* const planes[4] = {plane[0], plane[1], plane[2], plane[3]};
    const s::D d;
    for (int first = 0; first < args.count; first += kChunk) {
      const int count = std::min(kChunk, args.count - first);
      s::LoadChunk(args, first, count, planes);
      for (int p = 0; p < 4; ++p) {
        if (grids_[p] != nullptr) Map(*grids_[p], plane[p], count, chunk);
      }
      s::StoreChunk(args, first, count, [&](int i) HWY_ATTR {
        return s::Pixels{hn::Load(d, plane[0] + i), hn::Load(d, plane[1] + i), hn::Load(d, plane[2] + i),
                         hn::Load(d, plane[3] + i)};
      });
    }
  }

 private:
  // Linear through a table whose last cell is chosen at its own end: indices and fractions first, then pairs.
  static HWY_INLINE void MapLinear(const Grid& grid, float* plane, int count, Chunk& chunk) {
    const s::D d;
    const GridAxis& axis = grid.axis(0);
    const V scale = hn::Set(d, axis.scale), last = hn::Set(d, static_cast<float>(axis.last));
    for (int i = 0; i < count; i += s::kLanes) {
      V fraction;
      const V cell = CellInside<false>(Unit(hn::Load(d, plane + i)), scale, last, fraction);
      hn::Store(hn::ConvertTo(s::DI(), cell), s::DI(), chunk.base + i);
      hn::Store(fraction, d, chunk.weight[0] + i);
    }
    const float* const data = grid.data();
    for (int i = 0; i < count; i += s::kLanes) {
      V a, b;
      s::LoadPairs([&](int k) HWY_ATTR { return data + chunk.base[i + k]; }, a, b);
      hn::Store(s::Lerp(a, b, hn::Load(d, chunk.weight[0] + i)), d, plane + i);
    }
  }
  // One plane through its table, in place.
  void Map(const Grid& grid, float* plane, int count, Chunk& chunk) const {
    const s::D d;
    if (linear_inside_ && grid.finite()) return MapLinear(grid, plane, count, chunk);
    for (int i = 0; i < count; i += s::kLanes) hn::Store(hn::Load(d, plane + i), d, chunk.coord[0] + i);
    lookup_(grid, chunk, count);
    if (!grid.finite() && AnyNotFinite(chunk.result, count)) {
      for (int i = 0; i < count; ++i) {
        const float at = plane[i] > 0 ? plane[i] : 0.0f;
        if (!std::isfinite(chunk.result[i])) grid.SampleOne(&at, chunk.result + i);
      }
    }
    for (int i = 0; i < count; i += s::kLanes) hn::Store(hn::Load(d, chunk.result + i), d, plane + i);
  }

  // What every 8-bit code becomes: the float path and its one rounding, so that both give equal pixels.
  void MapCodes() {
    const s::D d;
    constexpr int kCodes = 256;
    for (int p = 0; p < 4; ++p) {
      Chunk chunk;
      alignas(64) float plane[kChunk];
      for (int first = 0; first < kCodes; first += kChunk) {
        for (int i = 0; i < kChunk; i += s::kLanes) {
          const V code = hn::Add(hn::Set(d, static_cast<float>(first + i)), hn::Iota(d, 0));
          hn::Store(s::FromUnorm8(code), d, plane + i);
        }
        if (grids_[p] != nullptr) Map(*grids_[p], plane, kChunk, chunk);
        alignas(64) int32_t codes[kChunk];
        for (int i = 0; i < kChunk; i += s::kLanes) {
          hn::Store(s::ToUnorm<256>(hn::Load(d, plane + i)), s::DI(), codes + i);
        }
        for (int i = 0; i < kChunk; ++i) map_[p][first + i] = static_cast<uint8_t>(codes[i]);
      }
    }
    one_map_ = std::memcmp(map_[0], map_[1], kCodes) == 0 && std::memcmp(map_[0], map_[2], kCodes) == 0 &&
               std::memcmp(map_[0], map_[3], kCodes) == 0;
  }
  void RunCodes(const uint8_t* from, uint8_t* to, int count, bool stream) const {
    int i = 0;
#if HWY_TARGET == HWY_AVX3
    const CodeMap maps[4] = {CodeMap(map_[0]), CodeMap(map_[1]), CodeMap(map_[2]), CodeMap(map_[3])};
    const auto store = [&](__m512i v) HWY_ATTR {
      if (stream) {
        _mm512_stream_si512(reinterpret_cast<__m512i*>(to + i), v);
      } else {
        _mm512_storeu_si512(to + i, v);
      }
    };
    if (one_map_) {
      for (; i + 64 <= 4 * count; i += 64) store(MapPixels<true>(maps, _mm512_loadu_si512(from + i)));
    } else {
      for (; i + 64 <= 4 * count; i += 64) store(MapPixels<false>(maps, _mm512_loadu_si512(from + i)));
    }
#else
    (void)stream;
#endif
    for (; i < 4 * count; i += 4) {
      to[i] = map_[0][from[i]];
      to[i + 1] = map_[1][from[i + 1]];
      to[i + 2] = map_[2][from[i + 2]];
      to[i + 3] = map_[3][from[i + 3]];
    }
  }

  std::shared_ptr<const Grid> grids_[4];
  LookupFunction lookup_ = nullptr;
  bool linear_inside_ = false;  // every table takes the short way of MapLinear
  bool one_map_ = false;        // all four maps are equal
  alignas(64) uint8_t map_[4][256];
};

std::unique_ptr<graph::PointStage> NewTables1DStage(const std::shared_ptr<const Grid> (&grids)[4]) {
  return std::make_unique<Tables1DStage>(grids);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewTables1DStage);

std::unique_ptr<graph::PointStage> MakeTables1DStage(const std::shared_ptr<const Grid> (&grids)[4]) {
  return HWY_DYNAMIC_DISPATCH(NewTables1DStage)(grids);
}

}  // namespace tessera::ops
#endif
