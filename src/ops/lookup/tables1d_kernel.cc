// Channels through 1-D tables of their own; 8-bit pixels code by code.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <type_traits>

#include "base/prefetch.h"
#include "ops/lookup/point_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/lookup/tables1d_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/lookup/gather-inl.h"
#include "simd/code_maps-inl.h"
#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

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
      return code_maps_->Run(reinterpret_cast<const uint8_t*>(args.source.read),
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
        if (from_floats) base::PrefetchAhead(from + 4 * i, 4 * s::kLanes);
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
    uint8_t maps[4][s::CodeMaps::kCodes];
    for (int p = 0; p < 4; ++p) {
      Chunk chunk;
      alignas(64) float plane[kChunk];
      for (int first = 0; first < s::CodeMaps::kCodes; first += kChunk) {
        for (int i = 0; i < kChunk; i += s::kLanes) {
          const V code = hn::Add(hn::Set(d, static_cast<float>(first + i)), hn::Iota(d, 0));
          hn::Store(s::FromUnorm8(code), d, plane + i);
        }
        if (grids_[p] != nullptr) Map(*grids_[p], plane, kChunk, chunk);
        alignas(64) int32_t codes[kChunk];
        for (int i = 0; i < kChunk; i += s::kLanes) {
          hn::Store(s::ToUnorm<256>(hn::Load(d, plane + i)), s::DI(), codes + i);
        }
        for (int i = 0; i < kChunk; ++i) maps[p][first + i] = static_cast<uint8_t>(codes[i]);
      }
    }
    code_maps_.emplace(maps);
  }

  std::shared_ptr<const Grid> grids_[4];
  LookupFunction lookup_ = nullptr;
  bool linear_inside_ =
      false;             // every table takes the short way: linear, finite, its last cell chosen at its end
  bool colors_ = false;  // that, and there is one for every colour, none for alpha
  std::optional<s::CodeMaps> code_maps_;
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
