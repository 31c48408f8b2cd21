// Tile grids over resident pixels.
#include "graph/executor.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <vector>

#include "base/paged_memory.h"
#include "graph/run.h"
#include "sched/scheduler.h"
#include "tessera/context.h"

namespace tessera::graph {

Context& ContextOf(const RenderOptions& options) {
  return options.context != nullptr ? *options.context : Context::Default();
}

namespace {

// A part of so many pixels in the middle of a region, where most is read for it.
Roi Middle(const Roi& roi, const TileShape& shape) {
  const int x0 = roi.x0 + (roi.width() - shape.width) / 2, y0 = roi.y0 + (roi.height() - shape.height) / 2;
  return {x0, y0, x0 + shape.width, y0 + shape.height};
}

// Where a pixel is made of many (a picture a hundredth as large), tiles between steps are larger than the
// result's by far: smaller ones, until a worker's share of the memory holds them, or most of what they read
// is read for their neighbours too.
void KeepWithinMemory(const Program& program, const Roi& roi, size_t most, TileShape& t) {
  for (size_t bytes = TileMemory(program, Middle(roi, t)); bytes > most;) {
    TileShape half = t;
    int& side = t.width >= t.height ? half.width : half.height;
    side = (side + 1) / 2;
    const size_t fewer = TileMemory(program, Middle(roi, half));
    if (fewer > bytes / 4 * 3) return;
    bytes = fewer, t = half;
  }
}

}  // namespace

TileShape ChooseTileShape(const Program& program, const Roi& roi, const RenderOptions& options) {
  const Plan& plan = program.plan();
  TileShape t{options.tile_width, options.tile_height};
  int channels = 0;    // of the tiles between steps; none for a plan of point operations
  TileSize preferred;  // the largest that any stage asks for
  const bool alone = program.IsOneWindow();
  for (size_t i = 0; i + 1 < plan.buffers.size(); ++i) {
    channels += static_cast<int>(plan.buffers[i].channels.size());
    if (!plan.buffers[i].tile) continue;
    const TileStage& stage = *plan.buffers[i].tile->stage;
    const TileSize size = alone ? stage.PreferredAlone() : stage.Preferred();
    preferred.width = std::max(preferred.width, size.width);
    preferred.height = std::max(preferred.height, size.height);
  }
  if (t.width <= 0) t.width = preferred.width;
  if (t.height <= 0) t.height = preferred.height;
  if (channels == 0) {
    // Wide rows: blocks go from source to sink, so that only the prefetcher sees the tile's shape.
    // Large results have larger tiles, which cost less each, and still enough of them.
    const auto pixels = static_cast<int>(std::clamp<int64_t>(roi.pixels() / 64, 1 << 15, 1 << 17));
    if (t.width <= 0) t.width = std::max(1, roi.width());
    if (t.height <= 0) t.height = std::max(1, pixels / t.width);
  } else {
    // Fat strips whose tiles stay within half of a 1 MB L2; halos are a small share of them.
    constexpr int64_t kFloats = (1 << 19) / 4;
    constexpr int64_t kStep = 128;
    if (t.height <= 0) t.height = 64;
    if (t.width <= 0) {
      t.width = static_cast<int>(std::max<int64_t>(kStep, kFloats / channels / t.height / kStep * kStep));
    }
  }
  t.width = std::min(t.width, std::max(1, roi.width()));
  t.height = std::min(t.height, std::max(1, roi.height()));
  if (channels > 0 && options.tile_width <= 0 && options.tile_height <= 0 && !roi.empty()) {
    constexpr size_t kLeast = size_t{4} << 20;
    const auto threads = static_cast<size_t>(sched::ThreadCount(options.threads));
    KeepWithinMemory(program, roi, std::max(kLeast, options.memory_budget / 2 / threads), t);
  }
  return t;
}

std::vector<Roi> Tiles(const Roi& roi, const TileShape& shape) {
  std::vector<Roi> tiles;
  for (int y = roi.y0; y < roi.y1; y += shape.height) {
    for (int x = roi.x0; x < roi.x1; x += shape.width)
      tiles.push_back({x, y, std::min(x + shape.width, roi.x1), std::min(y + shape.height, roi.y1)});
  }
  return tiles;
}

int64_t BytesMoved(const Plan& plan, const Roi& roi, PixelType type) {
  const std::vector<Roi> regions = RequiredRegions(plan, roi);
  int64_t bytes = roi.pixels() * plan.spec.channel_count() * static_cast<int64_t>(PixelBytes(type));
  for (size_t k = 0; k < plan.sources.size(); ++k) {
    const PlannedSource& s = plan.sources[k];
    bytes += regions[k].pixels() * std::count(s.needed.begin(), s.needed.end(), true) *
             static_cast<int64_t>(PixelBytes(s.source->spec().type));
  }
  return bytes;
}

std::vector<Layout> SourceLayouts(const Plan& plan) {
  std::vector<Layout> layouts;
  for (const PlannedSource& s : plan.sources) {
    const auto view = s.source->View();
    layouts.push_back(view ? Layout::Of(*view) : Layout::Packed(s.source->spec().type, s.last - s.first));
  }
  return layouts;
}

void RunResident(const Program& program, const ImageView& out, const RenderOptions& options,
                 sched::Progress& progress) {
  if (out.roi.empty()) return;
  std::vector<SourceView> sources;
  for (const PlannedSource& s : program.plan().sources) {
    sources.push_back({*s.source->View(), s.source->ReadMargin()});
  }
  const std::vector<Roi> tiles = Tiles(out.roi, ChooseTileShape(program, out.roi, options));
  const auto count = static_cast<int64_t>(tiles.size());
  const int threads = options.shuffle_tiles
                          ? 1
                          : static_cast<int>(std::min<int64_t>(sched::ThreadCount(options.threads), count));
  std::deque<TileWorker> workers;
  for (int i = 0; i < threads; ++i) workers.emplace_back(program, ContextOf(options), progress.cancelled());
  progress.Begin(count);
  // A result that does not fit in the last-level cache goes around it: no reads for ownership.
  constexpr int64_t kStreamBytes = int64_t{8} << 20;
  const bool stream =
      out.roi.pixels() * out.channels * static_cast<int64_t>(PixelBytes(out.type)) > kStreamBytes;

  base::PagedPool& paged = ContextOf(options).paged();
  const auto task = [&](int64_t i, int worker) {
    workers[static_cast<size_t>(worker)].Run(sources, out.Sub(tiles[static_cast<size_t>(i)]), stream);
    paged.Trim();
    progress.Step();
  };
  if (options.shuffle_tiles) {
    sched::ShuffledFor(count, 1, task);
  } else {
    sched::ParallelFor(count, threads, task);
  }
  progress.End();
}

}  // namespace tessera::graph
