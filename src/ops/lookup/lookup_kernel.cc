// The stage of a lookup through a coordinate image: rows of pixels in chunks, whatever the table.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>

#include "ops/lookup/footprints.h"
#include "ops/lookup/lookup_stage.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/lookup/lookup_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/lookup/gather-inl.h"
#include "ops/lookup/pictures-inl.h"
#include "ops/lookup/row_pairs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

template <int kTexel>
LookupFunction MethodOfTable(int dims, TableFilter filter) {
  switch (dims) {
    case 1:
      return MethodOf<kTexel, 1, false>(filter);
    case 2:
      return MethodOf<kTexel, 2, false>(filter);
    case 3:
      return MethodOf<kTexel, 3, false>(filter);
    default:
      return MethodOf<kTexel, 4, false>(filter);
  }
}

class LookupStage final : public graph::TileStage {
 public:
  explicit LookupStage(LookupPlan plan) : plan_(std::move(plan)) {
    for (const auto& levels : plan_.groups) {
      const Grid& grid = *levels.front();
      methods_.push_back(grid.texel() == 1 ? MethodOfTable<1>(grid.dims(), plan_.params.filter)
                                           : MethodOfTable<4>(grid.dims(), plan_.params.filter));
    }
    const bool plain = !footprints() && plan_.groups.size() == 1 && plan_.groups[0].size() == 1 &&
                       plan_.params.mask < 0 && !plan_.params.projective && plan_.coordinate_channels >= 2 &&
                       plan_.coordinate_channels <= 4;
    if (plain) picture_ = PictureMethodOf(*plan_.groups[0][0]);
    if (picture_.gather != nullptr) pairs_ = RowPairs::Of(*plan_.groups[0][0], plan_.window.pixels());
  }

  Roi InputRoi(int, const Roi& out) const override {
    return mipmap() || footprints() ? Inflate(out, 1, 1) : out;
  }

  // Squares, whose texels lie close together wherever the coordinates are smooth, once a table is larger than
  // the nearer caches. Single samples of a picture that no cache holds, or that needs little of one, are so
  // few bytes that the rows of coordinates count for more: they are asked for farther ahead in wider tiles.
  graph::TileSize Preferred() const override {
    int64_t bytes = 0;
    for (const auto& levels : plan_.groups) bytes += levels.front()->bytes();
    if (bytes <= int64_t{1} << 19) return {};
    const bool single = picture_.gather != nullptr && plan_.groups[0][0]->texel() == 1;
    return {single && (bytes <= kMidBytes || bytes >= kCacheBytes) ? 256 : 64, 64};
  }

  void Run(const graph::TileArgs& args) const override {
    const Roi& r = args.out.roi;
    if (picture_.gather != nullptr) return RunPicture(args);
    Chunk* const chunk = args.scratch.Allocate<Chunk>(1);
    Probing probing;
    if (footprints()) {
      probing = {args.scratch.Allocate<PixelProbes>(kChunk), args.scratch.Allocate<Chunk>(1)};
    }
    for (int y = r.y0; y < r.y1; ++y) {
      for (int x = r.x0; x < r.x1; x += kChunk)
        RunChunk(args, x, y, std::min(kChunk, r.x1 - x), *chunk, probing);
    }
  }

 private:
  static constexpr int kAhead = 3;  // blocks

  bool footprints() const { return IsFootprintFilter(plan_.params.filter); }
  bool mipmap() const { return plan_.params.filter == TableFilter::kMipmap; }

  // What is between the passes over a block of pixels: `count` of a row, or all of several rows.
  struct Block {
    Taps taps;
    int x = 0, y = 0, count = 0;
    bool lost = false;             // some coordinate may be no number
    const float* pairs = nullptr;  // when they are better than the picture
  };

  // What all blocks of a tile have in common. What is asked once a block costs as much as some pixels.
  struct Blocks {
    int log_width, rows;
    BlockCoordinates coords;
    BlockResults results;
    bool direct;   // full blocks are written where they belong
    float* aside;  // a block's coordinates or results else
  };

  // Blocks from coordinates to results. In a picture that no cache holds they are squarish, so that texels
  // lie close together, and located well ahead of the second pass, while texels are on their way.
  void RunPicture(const graph::TileArgs& args) const {
    const Roi& r = args.out.roi;
    const Grid& grid = *plan_.groups[0][0];
    const bool large = grid.bytes() >= kCacheBytes;
    const int log_width = large && r.width() % 16 == 0 && r.height() % 4 == 0 ? 4 : 6, width = 1 << log_width;
    const int across = (r.width() + width - 1) / width, height = kChunk >> log_width;
    const int count = across * (r.height() / height), ahead = large ? kAhead : 0;
    Blocks blocks{log_width,
                  height,
                  {nullptr,
                   {log_width, args.in[0].row_stride / 4},
                   args.in[0].channels,
                   {plan_.axes[0], plan_.axes[1]}},
                  {nullptr,
                   {log_width, args.out.row_stride / 4},
                   args.stream && (height == 1 || args.out.row_stride % 64 == 0)},
                  args.out.channels == grid.texel() && InOrder(args.channels),
                  args.scratch.Allocate<float>(4 * kChunk)};
    auto* const ring = args.scratch.Allocate<Block>(static_cast<size_t>(ahead) + 1);
    Block *located = ring, *gathered = ring, *const end = ring + ahead + 1;
    int x = r.x0, y = r.y0;
    for (int k = 0; k < count + ahead; ++k) {
      if (k < count) {
        located->x = x, located->y = y, located->count = std::min(width, r.x1 - x);
        LocateBlock(args, blocks, *located);
        if (++located == end) located = ring;
        if ((x += width) >= r.x1) x = r.x0, y += height;
      }
      if (k >= ahead) {
        GatherBlock(args, blocks, *gathered);
        if (++gathered == end) gathered = ring;
      }
    }
  }
  static const float* CoordinatesAt(const graph::TileArgs& args, int x, int y) {
    return reinterpret_cast<const float*>(args.in[0].At(x, y));
  }
  HWY_INLINE void LocateBlock(const graph::TileArgs& args, const Blocks& blocks, Block& block) const {
    BlockCoordinates coords = blocks.coords;
    coords.from = CoordinatesAt(args, block.x, block.y);
    const int rounded = RoundedCount(blocks, block);
    if (blocks.rows == 1 && block.count != rounded) {
      std::fill(std::copy_n(coords.from, block.count * coords.channels, blocks.aside),
                blocks.aside + rounded * coords.channels, 0.0f);
      coords.from = blocks.aside;
    }
    PrefetchCoordinates(args.in[0], block.x, block.y, block.count, blocks.rows);
    block.pairs = pairs_ != nullptr ? pairs_->For(coords, rounded) : nullptr;
    block.lost = picture_.locate(*plan_.groups[0][0], coords, rounded, block.taps);
  }
  HWY_INLINE void GatherBlock(const graph::TileArgs& args, const Blocks& blocks, const Block& block) const {
    const Grid& grid = *plan_.groups[0][0];
    const int rounded = RoundedCount(blocks, block);
    BlockResults results = blocks.results;
    const bool direct = blocks.direct && (blocks.rows > 1 || block.count == rounded);
    if (direct) {
      results.to = reinterpret_cast<float*>(args.out.At(block.x, block.y));
      results.stream = results.stream && s::CanStream(results.to);
    } else {
      results = {blocks.aside, {blocks.log_width, grid.texel() << blocks.log_width}, false};
    }
    const bool suspicious = block.pairs != nullptr ? pairs_->Gather(block.pairs, block.taps, rounded, results)
                                                   : picture_.gather(grid, block.taps, rounded, results);
    const bool careful = suspicious || block.lost;
    if (careful || !direct) Finish(args, block, results, blocks.rows, careful, direct);
  }
  HWY_NOINLINE void Finish(const graph::TileArgs& args, const Block& block, const BlockResults& results,
                           int rows, bool careful, bool direct) const {
    for (int row = 0; row < rows; ++row) {
      float* const here = results.to + row * results.rows.stride;
      const int y = block.y + row;
      if (careful) {
        MendRow(*plan_.groups[0][0], CoordinatesAt(args, block.x, y), args.in[0].channels, block.count, here);
      }
      if (!direct) Write(args, 0, block.x, y, block.count, here);
    }
  }
  // The processor does not foresee the rows of a narrow tile. Inlined in any case, as PrefetchEach.
  static HWY_INLINE void PrefetchCoordinates(const ConstImageView& in, int x, int y, int count, int rows) {
    const int ahead = std::max(4, rows);
    for (int row = y + ahead; row < std::min(y + ahead + rows, in.roi.y1); ++row) {
      const auto* const p = reinterpret_cast<const float*>(in.At(x, row));
      for (int i = 0; i < count * in.channels; i += 16) hwy::Prefetch(p + i);
    }
  }
  static int RoundedCount(const Blocks& blocks, const Block& block) {
    return blocks.rows > 1 ? kChunk : Rounded(block.count);
  }
  static int Rounded(int count) { return (count + s::kLanes - 1) / s::kLanes * s::kLanes; }

  void MendRow(const Grid& grid, const float* from, int channels, int count, float* results) const {
    for (int i = 0; i < count; ++i, from += channels, results += grid.texel()) {
      const float at[2] = {from[plan_.axes[0]], from[plan_.axes[1]]};
      if (std::isnan(at[0]) || std::isnan(at[1])) {
        SetLost(grid, plan_.params.propagate_nan, results);
      } else if (!std::all_of(results, results + grid.channels(), [](float v) { return std::isfinite(v); })) {
        grid.SampleOne(at, results);
      }
    }
  }
  static void SetLost(const Grid& grid, bool propagate, float* result) {
    for (int c = 0; c < grid.channels(); ++c) {
      result[c] = propagate ? std::numeric_limits<float>::quiet_NaN() : grid.border(c);
    }
  }

  // What lookups over footprints need beside a chunk.
  struct Probing {
    PixelProbes* probes = nullptr;
    Chunk* chunk = nullptr;
  };

  void RunChunk(const graph::TileArgs& args, int x, int y, int count, Chunk& chunk,
                const Probing& probing) const {
    const ConstImageView& coords = args.in[0];
    const int rounded = Rounded(count);
    LoadCoordinates(reinterpret_cast<const float*>(coords.At(x, y)), coords.channels, count, chunk);
    if (plan_.params.projective) Divide(rounded, chunk);
    float level[kChunk];
    if (mipmap()) {
      for (int i = 0; i < count; ++i) level[i] = Level(coords, x + i, y);
    }
    if (footprints()) footprints_.Find(coords, x, y, count, probing.probes);
    for (size_t g = 0; g < plan_.groups.size(); ++g) {
      const auto& levels = plan_.groups[g];
      const Grid& grid = *levels.front();
      bool flagged;
      if (mipmap()) {
        flagged = BlendLevels(g, level, count, rounded, chunk);
      } else {
        flagged = methods_[g](grid, chunk, rounded);
      }
      if (flagged || !grid.finite()) Mend(grid, count, flagged, chunk);
      if (footprints()) GatherFootprints(g, probing.probes, count, *probing.chunk, chunk.result);
      Write(args, g, x, y, count, chunk.result);
    }
    if (plan_.params.mask >= 0) KeepBackground(args, x, y, count);
  }

  // Means over what pixels cover, where that is more than an entry.
  void GatherFootprints(size_t g, const PixelProbes* probes, int count, Chunk& chunk, float* result) const {
    const auto look = [&](int level, int held) {
      const Grid& grid = *plan_.groups[g][static_cast<size_t>(level)];
      const int rounded = Rounded(held);
      for (int a = 0; a < plan_.dims; ++a) std::fill(chunk.coord[a] + held, chunk.coord[a] + rounded, 0.0f);
      const bool flagged = methods_[g](grid, chunk, rounded);
      if (flagged || !grid.finite()) Mend(grid, held, flagged, chunk);
    };
    if (plan_.groups[g].front()->texel() == 1) {
      footprints_.Gather<1>(probes, count, chunk, result, look);
    } else {
      footprints_.Gather<4>(probes, count, chunk, result, look);
    }
  }

  // The coordinate channels of `count` pixels to planes, zeros up to the next vector.
  void LoadCoordinates(const float* from, int channels, int count, Chunk& chunk) const {
    const s::D d;
    const auto planes = plan_.axes.size();
    int i = 0;
    if (channels <= 4) {
      for (; i + s::kLanes <= count; i += s::kLanes) {
        const float* const p = from + i * channels;
        V v[4];
        if (channels == 1) {
          v[0] = hn::LoadU(d, p);
        } else if (channels == 2) {
          hn::LoadInterleaved2(d, p, v[0], v[1]);
        } else if (channels == 3) {
          hn::LoadInterleaved3(d, p, v[0], v[1], v[2]);
        } else {
          hn::LoadInterleaved4(d, p, v[0], v[1], v[2], v[3]);
        }
        for (size_t a = 0; a < planes; ++a) hn::Store(v[plan_.axes[a]], d, Plane(chunk, a) + i);
      }
    }
    for (size_t a = 0; a < planes; ++a) {
      float* const plane = Plane(chunk, a);
      for (int k = i; k < count; ++k) plane[k] = from[k * channels + plan_.axes[a]];
      for (int k = count; k % s::kLanes != 0; ++k) plane[k] = 0;
    }
  }
  // The divisor q of a 4-D table is a fifth plane; it waits where weights come later.
  static float* Plane(Chunk& chunk, size_t a) { return a < 4 ? chunk.coord[a] : chunk.weight[15]; }

  void Divide(int count, Chunk& chunk) const {
    const s::D d;
    const float* const divisor = Plane(chunk, static_cast<size_t>(plan_.dims));
    for (int i = 0; i < count; i += s::kLanes) {
      const V q = hn::Load(d, divisor + i);
      const auto ahead = hn::Ge(q, hn::Set(d, std::numeric_limits<float>::min()));
      for (int a = 0; a < plan_.dims; ++a) {
        const V v = hn::Div(hn::Load(d, chunk.coord[a] + i), q);
        hn::Store(hn::IfThenElse(ahead, v, hn::NaN(d)), d, chunk.coord[a] + i);
      }
    }
  }

  // Pixels whose taps are not all in memory, whose coordinates are no numbers, or into which an entry that is
  // not finite may have leaked with weight 0.
  void Mend(const Grid& grid, int count, bool flagged, Chunk& chunk) const {
    const int texel = grid.texel();
    const bool suspect = !grid.finite() && AnyNotFinite(chunk.result, count * texel);
    if (!flagged && !suspect) return;
    for (int i = 0; i < count; ++i) {
      float* const result = chunk.result + i * texel;
      const int32_t flag = flagged ? chunk.flag[i] : 0;
      if (flag & kNotANumber) {
        SetLost(grid, plan_.params.propagate_nan && !plan_.params.projective, result);
        continue;
      }
      bool careful = flag != 0;
      if (suspect) {
        for (int c = 0; c < grid.channels(); ++c) careful |= !std::isfinite(result[c]);
      }
      if (!careful || mipmap()) continue;
      float at[4];
      for (int a = 0; a < grid.dims(); ++a) at[a] = chunk.coord[a][i];
      grid.SampleOne(at, result);
    }
  }

  // log2 of the entries of level 0 that a step to a neighbour passes, of the longer of both directions; in
  // each the shorter of the two steps, so that the far side of an edge does not count.
  float Level(const ConstImageView& coords, int x, int y) const {
    const Grid& grid = *plan_.groups.front().front();
    float rho = 0;
    for (int direction = 0; direction < 2; ++direction) {
      float shortest = std::numeric_limits<float>::infinity();
      for (const int step : {-1, 1}) {
        const int nx = x + (direction == 0 ? step : 0), ny = y + (direction == 1 ? step : 0);
        if (!plan_.window.Contains({nx, ny, nx + 1, ny + 1})) continue;
        float sum = 0;
        for (int a = 0; a < plan_.dims; ++a) {
          const float d = (CoordinateAt(plan_, coords, nx, ny, a) - CoordinateAt(plan_, coords, x, y, a)) *
                          grid.axis(a).per_unit;
          sum += d * d;
        }
        if (std::isfinite(sum)) shortest = std::min(shortest, std::sqrt(sum));
      }
      if (std::isfinite(shortest)) rho = std::max(rho, shortest);
    }
    const float top = static_cast<float>(plan_.groups.front().size() - 1);
    return rho > 1 ? std::min(std::log2(rho), top) : 0.0f;
  }
  bool BlendLevels(size_t g, const float* level, int count, int rounded, Chunk& chunk) const {
    const auto& levels = plan_.groups[g];
    const int texel = levels.front()->texel(), top = static_cast<int>(levels.size()) - 1;
    float blended[4 * kChunk], lower[4 * kChunk];
    bool flagged = false, done[32] = {};
    for (int first = 0; first < count; ++first) {
      const int l = static_cast<int>(level[first]);
      if (done[l]) continue;
      done[l] = true;
      flagged |= methods_[g](*levels[static_cast<size_t>(l)], chunk, rounded);
      std::memcpy(lower, chunk.result, sizeof lower);
      if (l < top) flagged |= methods_[g](*levels[static_cast<size_t>(l) + 1], chunk, rounded);
      for (int i = first; i < count; ++i) {
        if (static_cast<int>(level[i]) != l) continue;
        const float t = level[i] - static_cast<float>(l);
        for (int c = 0; c < texel; ++c) {
          const float a = lower[i * texel + c], b = chunk.result[i * texel + c];
          blended[i * texel + c] = t == 0 ? a : (1 - t) * a + t * b;
        }
      }
    }
    std::memcpy(chunk.result, blended, sizeof(float) * static_cast<size_t>(count * texel));
    return flagged;
  }

  void Write(const graph::TileArgs& args, size_t group, int x, int y, int count, const float* result) const {
    const int texel = plan_.groups[group].front()->texel(), channels = args.out.channels;
    auto* const to = reinterpret_cast<float*>(args.out.At(x, y));
    const bool all = plan_.groups.size() == 1 && channels == texel && InOrder(args.channels);
    if (all) {
      const s::D d;
      const bool stream = args.stream && s::CanStream(to);
      const int floats = count * texel;
      int i = 0;
      for (; i + s::kLanes <= floats; i += s::kLanes) {
        s::StoreOrStream(hn::Load(d, result + i), d, to + i, stream);
      }
      for (; i < floats; ++i) to[i] = result[i];
      return;
    }
    for (int c = 0; c < channels; ++c) {
      const int channel = args.channels.empty() ? c : args.channels[static_cast<size_t>(c)];
      if (channel / 4 != static_cast<int>(group)) continue;
      const float* const from = result + channel % 4;
      for (int i = 0; i < count; ++i) to[i * channels + c] = from[i * texel];
    }
  }
  static bool InOrder(std::span<const int> channels) {
    for (size_t c = 0; c < channels.size(); ++c) {
      if (channels[c] != static_cast<int>(c)) return false;
    }
    return true;
  }

  void KeepBackground(const graph::TileArgs& args, int x, int y, int count) const {
    const ConstImageView& coords = args.in[0];
    for (int i = 0; i < count; ++i) {
      const auto* const from = reinterpret_cast<const float*>(coords.At(x + i, y));
      const float mask = from[plan_.params.mask];
      if (mask != 0 && !std::isnan(mask)) continue;
      auto* const to = reinterpret_cast<float*>(args.out.At(x + i, y));
      for (int c = 0; c < args.out.channels; ++c) {
        const int channel = args.channels.empty() ? c : args.channels[static_cast<size_t>(c)];
        to[c] = channel < coords.channels ? from[channel] : 0.0f;
      }
    }
  }

  LookupPlan plan_;
  LookupFootprints footprints_{plan_};
  std::vector<LookupFunction> methods_;
  PictureMethod picture_;
  std::unique_ptr<RowPairs> pairs_;
};

std::unique_ptr<graph::TileStage> NewLookupStage(const LookupPlan& plan) {
  return std::make_unique<LookupStage>(plan);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewLookupStage);

std::unique_ptr<graph::TileStage> MakeLookupStage(const LookupPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(NewLookupStage)(plan);
}

}  // namespace tessera::ops
#endif
