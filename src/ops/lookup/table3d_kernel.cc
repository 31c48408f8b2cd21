// Colours through a 3-D table.
#include <algorithm>
#include <cmath>
#include <memory>
#include <type_traits>

#include "ops/lookup/point_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/lookup/table3d_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/lookup/gather-inl.h"
#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

class Table3DStage final : public graph::PointStage {
 public:
  explicit Table3DStage(std::shared_ptr<const Grid> grid)
      : grid_(std::move(grid)), lookup_(MethodOf<4, 3, true>(grid_->params().filter)) {}

  bool CanFuse(bool, PixelType) const override { return true; }

  void Run(const graph::PointArgs& args) const override {
    Chunk chunk;
    float* const planes[4] = {chunk.coord[0], chunk.coord[1], chunk.coord[2], chunk.coord[3]};
    for (int first = 0; first < args.count; first += kChunk) {
      const int count = std::min(kChunk, args.count - first);
      s::LoadChunk(args, first, count, planes);
      lookup_(*grid_, chunk, count);
      if (!grid_->finite() && AnyNotFinite(chunk.result, 4 * count)) Mend(count, chunk);
      if (args.source.read != nullptr && args.source.type == PixelType::kFloat &&
          args.sink.write != nullptr && args.sink.type == PixelType::kFloat) {
        StoreFloats(args, first, count, chunk);
        continue;
      }
      s::StoreChunk(args, first, count, [&](int i) HWY_ATTR { return Result(chunk, i); });
    }
  }

 private:
  // Planes of the results, alpha as it came.
  static HWY_INLINE s::Pixels Result(const Chunk& chunk, int i) {
    s::Pixels p = s::LoadRgbaCodes<PixelType::kFloat>(chunk.result + 4 * i);
    p.a = hn::Load(s::D(), chunk.coord[3] + i);
    return p;
  }
  // Float pixels to float pixels: the fourth of four samples is the source's.
  static HWY_INLINE void StoreFloats(const graph::PointArgs& args, int first, int count, const Chunk& chunk) {
    const s::D d;
    const auto* const from = reinterpret_cast<const float*>(args.source.read) + 4 * first;
    auto* const to = reinterpret_cast<float*>(args.sink.write) + 4 * first;
    const bool stream = args.sink.stream && s::CanStream(to);
    const s::DI di;
    const auto color = hn::RebindMask(d, hn::Ne(hn::And(hn::Iota(di, 0), hn::Set(di, 3)), hn::Set(di, 3)));
    for (int i = 0; i < 4 * count; i += s::kLanes) {
      if constexpr (s::kLanes == 1) {
        to[i] = i % 4 == 3 ? from[i] : chunk.result[i];
      } else {
        s::StoreOrStream(hn::IfThenElse(color, hn::Load(d, chunk.result + i), hn::LoadU(d, from + i)), d,
                         to + i, stream);
      }
    }
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

  std::shared_ptr<const Grid> grid_;
  LookupFunction lookup_;
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
