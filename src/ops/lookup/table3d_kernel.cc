// Colours through a 3-D table.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <type_traits>

#include "base/prefetch.h"
#include "ops/lookup/point_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/lookup/table3d_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/lookup/colors-inl.h"
#include "ops/lookup/gather-inl.h"
#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

class Table3DStage final : public graph::PointStage {
 public:
  explicit Table3DStage(std::shared_ptr<const Grid> grid) : grid_(std::move(grid)) {
    const TableFilter filter = grid_->params().filter;
    lookup_ = MethodOf<4, 3, true>(filter);
    if constexpr (s::kLanes > 1) {
      if (!grid_->finite() || !grid_->ends_inside() || Places(*grid_) > kMostPlaces) return;
      if (filter == TableFilter::kTetrahedral)
        loop_ = grid_->exact() ? &Table3DStage::RunFast<true, true> : &Table3DStage::RunFast<true, false>;
      if (filter == TableFilter::kLinear)
        loop_ = grid_->exact() ? &Table3DStage::RunFast<false, true> : &Table3DStage::RunFast<false, false>;
    }
  }

  bool CanFuse(bool, PixelType) const override { return true; }
  bool AnyLength() const override { return true; }

  void Run(const graph::PointArgs& args) const override { (this->*loop_)(args); }

 private:
  static int64_t Places(const Grid& grid) {
    return int64_t{kPlacesPerEntry} * grid.axis(2).stride * (grid.axis(2).last + 2);
  }

  // Any filter, entries that are not finite.
  void RunAny(const graph::PointArgs& args) const {
    Chunk chunk;
    float* const planes[4] = {chunk.coord[0], chunk.coord[1], chunk.coord[2], chunk.coord[3]};
    for (int first = 0; first < args.count; first += kChunk) {
      const int count = std::min(kChunk, args.count - first);
      s::LoadChunk(args, first, count, planes);
      lookup_(*grid_, chunk, count);
      if (!grid_->finite() && AnyNotFinite(chunk.result, 4 * count)) Mend(count, chunk);
      s::StoreChunk(args, first, count, [&](int i) HWY_ATTR { return Result(chunk, chunk.coord[3], i); });
    }
  }

  // Planes and float pixels are read and written where they are, others by way of the chunk.
  template <bool kSimplex, bool kExact>
  void RunFast(const graph::PointArgs& args) const {
    const s::D d;
    const bool planes = args.source.read == nullptr;
    const bool from_floats = !planes && args.source.type == PixelType::kFloat;
    const bool to_floats = args.sink.write != nullptr && args.sink.type == PixelType::kFloat;
    if (from_floats && to_floats) return RunFloats<kSimplex, kExact>(args);
    // Without fused multiply-adds rounding to codes is so long that it had better be a loop of its own.
    if constexpr (HWY_NATIVE_FMA) {
      const bool from_bytes = !planes && args.source.type == PixelType::kUint8;
      const bool to_bytes = args.sink.write != nullptr && args.sink.type == PixelType::kUint8;
      if (from_bytes && to_bytes) return RunBytes<kSimplex, kExact>(args);
    }
    const bool stream = args.sink.stream && s::CanStream(args.sink.write);
    Cells cells;
    Chunk chunk;
    float* const copied[4] = {chunk.coord[0], chunk.coord[1], chunk.coord[2], chunk.coord[3]};
    for (int first = 0; first < args.count; first += kChunk) {
      const int count = std::min(kChunk, args.count - first);
      const auto* const from = reinterpret_cast<const float*>(args.source.read) + 4 * ptrdiff_t{first};
      auto* const to = reinterpret_cast<float*>(args.sink.write) + 4 * ptrdiff_t{first};
      if (!planes && !from_floats) s::LoadChunk(args, first, count, copied);
      const auto load = [&](int i) HWY_ATTR {
        const s::Pixels p = from_floats ? s::LoadRgbaCodes<PixelType::kFloat>(from + 4 * i)
                            : planes    ? s::LoadPlanes(args.in[0], first + i)
                                        : s::LoadPlanes(copied, i);
        if (from_floats) hn::Store(p.a, d, chunk.coord[3] + i);
        return Inside(p);
      };
      const float* const alphas = planes ? args.in[0][3] + first : chunk.coord[3];
      if (!to_floats) {
        LookupColors<kSimplex, kExact>(*grid_, cells, count, load, [&](int i, auto j, V v) HWY_ATTR {
          hn::Store(v, d, chunk.result + 4 * i + j * s::kLanes);
        });
        s::StoreChunk(args, first, count, [&](int i) HWY_ATTR { return Result(chunk, alphas, i); });
        continue;
      }
      LookupColors<kSimplex, kExact>(*grid_, cells, count, load, [&](int i, auto j, V v) HWY_ATTR {
        // Lane j of four has the alpha of the pixel that lies there.
        const V alpha = hn::Broadcast<decltype(j)::value>(hn::Load(d, alphas + i));
        s::StoreOrStream(WithAlpha(v, alpha), d, to + 4 * i + j * s::kLanes, stream);
      });
    }
  }
  // Pixels of floats, the alphas from where they lie.
  template <bool kSimplex, bool kExact>
  void RunFloats(const graph::PointArgs& args) const {
    const s::D d;
    const bool stream = args.sink.stream && s::CanStream(args.sink.write);
    const auto* from = reinterpret_cast<const float*>(args.source.read);
    auto* to = reinterpret_cast<float*>(args.sink.write);
    Cells cells;
    for (int first = 0; first < args.count; first += kChunk, from += 4 * kChunk, to += 4 * kChunk) {
      const auto load = [&](int i)
                            HWY_ATTR { return Inside(s::LoadRgbaCodes<PixelType::kFloat>(from + 4 * i)); };
      const auto store = [&](int i, auto j, V v) HWY_ATTR {
        const int at = 4 * i + j * s::kLanes;
        // Look-ups keep the processor from prefetching the source by itself; asked for at once, its lines
        // would stand in the way of the table's.
        if constexpr (j * s::kLanes % 16 == 0) base::PrefetchAhead(from + at, s::kLanes);
        s::StoreOrStream(WithAlpha(v, hn::LoadU(d, from + at)), d, to + at, stream);
      };
      LookupColors<kSimplex, kExact>(*grid_, cells, std::min(kChunk, args.count - first), load, store);
    }
  }

  // Bytes, which need no order of planes: quarters become the bytes of every lane, whose transpose within 128
  // bits is the pixels as they were read.
  template <bool kSimplex, bool kExact>
  void RunBytes(const graph::PointArgs& args) const {
    const s::DU du;
    const bool stream = args.sink.stream && s::CanStream(args.sink.write);
    const auto* from = reinterpret_cast<const uint32_t*>(args.source.read);
    auto* to = reinterpret_cast<uint32_t*>(args.sink.write);
    Cells cells;
    for (int first = 0; first < args.count; first += kChunk, from += kChunk, to += kChunk) {
      const auto load = [&](int i) HWY_ATTR {
        return s::ValuesOf<PixelType::kUint8>(s::UnpackRgba8(hn::LoadU(du, from + i)));
      };
      s::VU codes[4];
      const auto store = [&](int i, auto j, V v) HWY_ATTR {
        codes[j] = s::ToUnormBits<256>(v);
        if constexpr (j == 3) {
          if (i % 16 == 0) base::PrefetchAhead(from + i, s::kLanes);
          const s::VU colors = ColorsOfBytes(s::PackRgba8(codes[0], codes[1], codes[2], codes[3]));
          const s::VU pixels = hn::OrAnd(colors, hn::LoadU(du, from + i), hn::Set(du, 0xFF000000u));
          s::StoreOrStream(pixels, du, to + i, stream);
        }
      };
      LookupColors<kSimplex, kExact>(*grid_, cells, std::min(kChunk, args.count - first), load, store);
    }
  }
  // The transpose of the first three of 4x4 bytes within each 128 bits, zeros for the fourth.
  static HWY_INLINE s::VU ColorsOfBytes(s::VU v) {
    const hn::Repartition<uint8_t, s::D> d8;
    alignas(16) static constexpr uint8_t kFrom[16] = {0, 4, 8,  128, 1, 5, 9,  128,
                                                      2, 6, 10, 128, 3, 7, 11, 128};
    return hn::BitCast(s::DU(), hn::TableLookupBytesOr0(hn::BitCast(d8, v), hn::LoadDup128(d8, kFrom)));
  }

  static HWY_INLINE V WithAlpha(V v, V alpha) {
    const s::DI di;
    const VI three = hn::Set(di, 3);
    return hn::IfThenElse(hn::RebindMask(s::D(), hn::Ne(hn::And(hn::Iota(di, 0), three), three)), v, alpha);
  }
  // Planes of the results, alpha as it came.
  static HWY_INLINE s::Pixels Result(const Chunk& chunk, const float* alphas, int i) {
    s::Pixels p = s::LoadRgbaCodes<PixelType::kFloat>(chunk.result + 4 * i);
    p.a = hn::Load(s::D(), alphas + i);
    return p;
  }
  // Entries that are not finite count only where they have weight.
  void Mend(int count, Chunk& chunk) const {
    for (int i = 0; i < count; ++i) {
      float* const result = ResultOf<true>(chunk, i);
      if (std::isfinite(result[0]) && std::isfinite(result[1]) && std::isfinite(result[2])) continue;
      float at[4] = {};
      for (int a = 0; a < 3; ++a) at[a] = chunk.coord[a][i] > 0 ? chunk.coord[a][i] : 0.0f;
      grid_->SampleOne(at, result);
    }
  }

  using Loop = void (Table3DStage::*)(const graph::PointArgs&) const;

  std::shared_ptr<const Grid> grid_;
  LookupFunction lookup_;
  Loop loop_ = &Table3DStage::RunAny;
};

std::unique_ptr<graph::PointStage> NewTable3DStage(const std::shared_ptr<const Grid>& grid) {
  return std::make_unique<Table3DStage>(grid);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewTable3DStage);

std::unique_ptr<graph::PointStage> MakeTable3DStage(std::shared_ptr<const Grid> grid) {
  return HWY_DYNAMIC_DISPATCH(NewTable3DStage)(grid);
}

}  // namespace tessera::ops
#endif
