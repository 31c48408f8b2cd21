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
#elif HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
// 256 bytes in sixteen rows of sixteen: each row gives the entry of a code's lower half, and the bits of the
// upper half choose among the rows. That is half the instructions of a load for each code.
using DCodes = hn::Repartition<uint8_t, s::D>;
using Codes = hn::Vec<DCodes>;
// A choice by a bit of each code: on these targets it is the highest bit of a byte that decides.
template <int shift>
HWY_INLINE auto BitOf(Codes codes) {
  const hn::Repartition<uint16_t, s::D> d16;
  return hn::MaskFromVec(hn::BitCast(DCodes(), hn::ShiftLeft<shift>(hn::BitCast(d16, codes))));
}
// The entries in the 2^levels rows from `row` on.
template <int levels>
HWY_INLINE Codes MapRows(const uint8_t* row, Codes low, Codes codes) {
  if constexpr (levels == 0) {
    return hn::TableLookupBytes(hn::LoadDup128(DCodes(), row), low);
  } else {
    const Codes no = MapRows<levels - 1>(row, low, codes);
    const Codes yes = MapRows<levels - 1>(row + (16 << (levels - 1)), low, codes);
    return hn::IfThenElse(BitOf<4 - levels>(codes), yes, no);
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
  for (int k = 0; k < 4; ++k) w[k] = hn::BitCast(s::D(), hn::TableLookupBytes(v[k], order));
  s::Transpose4(w[0], w[1], w[2], w[3]);
  for (int k = 0; k < 4; ++k) v[k] = hn::BitCast(DCodes(), w[k]);
}
HWY_INLINE void JoinChannels(Codes* v) {
  const Codes order = hn::LoadDup128(DCodes(), kByChannel);
  V w[4];
  for (int k = 0; k < 4; ++k) w[k] = hn::BitCast(s::D(), v[k]);
  s::Transpose4(w[0], w[1], w[2], w[3]);
  for (int k = 0; k < 4; ++k) v[k] = hn::TableLookupBytes(hn::BitCast(DCodes(), w[k]), order);
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
      linear_inside_ = linear_inside_ && (grid == nullptr || (grid->ends_inside() && grid->finite()));
    // Floats hold the places in any table of fewer entries.
    colors_ = linear_inside_ && grids_[3] == nullptr;
    for (int p = 0; p < 3; ++p)
      colors_ = colors_ && grids_[p] != nullptr && grids_[p]->axis(0).last < 1 << 23;
    MapCodes();
  }

  bool CanFuse(bool, PixelType) const override { return true; }
  bool AnyLength() const override { return true; }

  void Run(const graph::PointArgs& args) const override {
    if (args.source.read != nullptr && args.source.type == PixelType::kUint8 && args.sink.write != nullptr &&
        args.sink.type == PixelType::kUint8) {
      return RunCodes(reinterpret_cast<const uint8_t*>(args.source.read),
                      reinterpret_cast<uint8_t*>(args.sink.write), args.count,
                      args.sink.stream && s::CanStream(args.sink.write));
    }
    if (linear_inside_) return RunLinear(args);
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
  // What the passes over a chunk leave for the next: samples, then distances, then results, in the same
  // place; first entries.
  struct Cells {
    alignas(64) int32_t entry[kChunk];
    alignas(64) float plane[4][kChunk];
  };
  // Linear through a finite table whose last cell is chosen at its own end, in place. Both passes are loops
  // over one plane: its table's numbers stay in registers.
  static HWY_INLINE void MapPlane(const Grid& grid, int32_t* entry, float* plane, int count) {
    const s::D d;
    const GridAxis& axis = grid.axis(0);
    const float* const data = grid.data();
    const V scale = hn::Set(d, axis.scale), last = hn::Set(d, static_cast<float>(axis.last));
    for (int i = 0; i < count; i += s::kLanes) {
      V f;
      const V cell = CellInside<false, Want::kNearer>(Unit(hn::Load(d, plane + i)), scale, last, f);
      hn::Store(SmallInteger(cell), s::DI(), entry + i);
      hn::Store(f, d, plane + i);
    }
    for (int i = 0; i < count; i += s::kLanes) {
      V a, b;
      s::LoadPairs([&](int k) HWY_ATTR { return data + static_cast<uint32_t>(entry[i + k]); }, a, b);
      hn::Store(s::LerpFromNearer(a, b, hn::Load(d, plane + i)), d, plane + i);
    }
  }
  // The same for tables of the three colours, both passes from vectors of pixels to vectors of pixels.
  struct ColorCells {
    alignas(64) int32_t entry[3][kChunk];
    alignas(64) float plane[4][kChunk];  // distances, alpha
  };
  struct ColorAxes {
    V scale[3], last[3];
    HWY_INLINE explicit ColorAxes(const std::shared_ptr<const Grid> (&grids)[4]) {
      for (int p = 0; p < 3; ++p) {
        const GridAxis& axis = grids[p]->axis(0);
        scale[p] = hn::Set(s::D(), axis.scale), last[p] = hn::Set(s::D(), static_cast<float>(axis.last));
      }
    }
  };
  template <class Load, class Store>
  HWY_INLINE void MapColors(ColorCells& cells, int count, const Load& load, const Store& store) const {
    const s::D d;
    const ColorAxes axes(grids_);
    const EntriesByPlace<1> entries[3] = {EntriesByPlace<1>(grids_[0]->data()),
                                          EntriesByPlace<1>(grids_[1]->data()),
                                          EntriesByPlace<1>(grids_[2]->data())};
    for (int i = 0; i < count; i += s::kLanes) {
      const s::Pixels q = load(i);
      const V x[3] = {q.r, q.g, q.b};
      for (int p = 0; p < 3; ++p) {
        V f;
        const V cell = CellInside<false, Want::kNearer>(Unit(x[p]), axes.scale[p], axes.last[p], f);
        hn::Store(hn::BitCast(s::DI(), hn::Add(cell, hn::Set(d, kFirstPlace))), s::DI(), cells.entry[p] + i);
        hn::Store(f, d, cells.plane[p] + i);
      }
      hn::Store(q.a, d, cells.plane[3] + i);
    }
    for (int i = 0; i < count; i += s::kLanes) {
      const auto value = [&](int p) HWY_ATTR {
        V a, b;
        s::LoadPairs([&](int k) HWY_ATTR { return entries[p](cells.entry[p][i + k]); }, a, b);
        return s::LerpFromNearer(a, b, hn::Load(d, cells.plane[p] + i));
      };
      store(i, s::Pixels{value(0), value(1), value(2), hn::Load(d, cells.plane[3] + i)});
    }
  }
  // load(i) -> Pixels, store(i, Pixels).
  template <class Load, class Store>
  HWY_INLINE void MapLinear(Cells& cells, int count, const Load& load, const Store& store) const {
    float* const planes[4] = {cells.plane[0], cells.plane[1], cells.plane[2], cells.plane[3]};
    for (int i = 0; i < count; i += s::kLanes) s::StorePlanes(load(i), planes, i);
    for (int p = 0; p < 4; ++p) {
      if (grids_[p] != nullptr) MapPlane(*grids_[p], cells.entry, planes[p], count);
    }
    for (int i = 0; i < count; i += s::kLanes) store(i, s::LoadPlanes(planes, i));
  }
  // Planes and float pixels are read and written where they are, others by way of a copy.
  void RunLinear(const graph::PointArgs& args) const {
    const bool planes = args.source.read == nullptr, to_planes = args.sink.write == nullptr;
    const bool from_floats = !planes && args.source.type == PixelType::kFloat;
    const bool to_floats = !to_planes && args.sink.type == PixelType::kFloat;
    const bool stream = args.sink.stream && s::CanStream(args.sink.write);
    float* const out[4] = {args.out[0], args.out[1], args.out[2], args.out[3]};
    Cells cells;
    ColorCells color_cells;
    alignas(64) float copy[4][kChunk];
    float* const copied[4] = {copy[0], copy[1], copy[2], copy[3]};
    for (int first = 0; first < args.count; first += kChunk) {
      const int count = std::min(kChunk, args.count - first);
      const auto* const from = reinterpret_cast<const float*>(args.source.read) + 4 * ptrdiff_t{first};
      auto* const to = reinterpret_cast<float*>(args.sink.write) + 4 * ptrdiff_t{first};
      if (!planes && !from_floats) s::LoadChunk(args, first, count, copied);
      const auto load = [&](int i) HWY_ATTR {
        return from_floats ? s::LoadRgbaCodes<PixelType::kFloat>(from + 4 * i)
               : planes    ? s::LoadPlanes(args.in[0], first + i)
                           : s::LoadPlanes(copied, i);
      };
      const auto store = [&](int i, const s::Pixels& q) HWY_ATTR {
        for (int k = 0; from_floats && k < 4 * s::kLanes; k += 16)
          hwy::Prefetch(from + 4 * i + 16 * kChunk + k);
        if (to_floats) {
          s::StoreRgba<PixelType::kFloat, true>(q, to + 4 * i, stream);
        } else if (to_planes) {
          s::StorePlanes(q, out, first + i);
        } else {
          s::StorePlanes(q, copied, i);
        }
      };
      if (colors_) {
        MapColors(color_cells, count, load, store);
      } else {
        MapLinear(cells, count, load, store);
      }
      if (!to_floats && !to_planes)
        s::StoreChunk(args, first, count, [&](int i) HWY_ATTR { return s::LoadPlanes(copied, i); });
    }
  }
  // One plane through its table, in place.
  void Map(const Grid& grid, float* plane, int count, Chunk& chunk) const {
    const s::D d;
    if (linear_inside_) return MapPlane(grid, chunk.base, plane, count);
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
#elif HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4
    const DCodes d;
    constexpr int kBytes = static_cast<int>(hn::MaxLanes(d));
    for (; i + 4 * kBytes <= 4 * count; i += 4 * kBytes) {
      Codes v[4];
      for (int k = 0; k < 4; ++k) v[k] = hn::LoadU(d, from + i + k * kBytes);
      if (!one_map_) SplitChannels(v);
      for (int k = 0; k < 4; ++k) v[k] = MapCodesOf(map_[k], v[k]);
      if (!one_map_) JoinChannels(v);
      for (int k = 0; k < 4; ++k) s::StoreOrStream(v[k], d, to + i + k * kBytes, stream);
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
  bool linear_inside_ =
      false;              // every table takes the short way: linear, finite, its last cell chosen at its end
  bool colors_ = false;   // that, and there is one for every colour, none for alpha
  bool one_map_ = false;  // all four maps are equal
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
