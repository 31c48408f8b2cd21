// Bands of rows in file order: read, compute and write overlap, memory stays bounded.
#include <algorithm>
#include <cstring>
#include <deque>
#include <mutex>
#include <utility>
#include <vector>

#include "graph/executor.h"
#include "graph/run.h"
#include "sched/scheduler.h"

namespace tessera::graph {
namespace {

// Band memory is handed round instead of being returned to the system, whose fresh pages cost more than the
// work.
class BufferPool {
 public:
  std::shared_ptr<std::byte> Take(size_t bytes) {
    {
      const std::lock_guard lock(state_->mutex);
      auto& free = state_->free;
      const auto it =
          std::find_if(free.begin(), free.end(), [&](const auto& b) { return b.second >= bytes; });
      if (it != free.end()) {
        auto kept = std::move(*it);
        free.erase(it);
        return Wrap(std::move(kept));
      }
      free.clear();  // too small for this picture's bands
    }
    return Wrap({base::AllocateAligned(bytes), bytes});
  }

 private:
  using Buffer = std::pair<std::shared_ptr<std::byte>, size_t>;
  struct State {
    std::mutex mutex;
    std::vector<Buffer> free;
  };
  std::shared_ptr<std::byte> Wrap(Buffer buffer) {
    std::byte* p = buffer.first.get();
    return {p, [state = state_, kept = std::move(buffer)](std::byte*) mutable {
              const std::lock_guard lock(state->mutex);
              state->free.push_back(std::move(kept));
            }};
  }
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

// Rows of one file source: every row is read once, rows that the next band needs again are kept.
class RowWindow {
 public:
  RowWindow(const PlannedSource& planned, BufferPool& pool)
      : planned_(planned), pool_(pool), reader_(planned.source->Open(planned.first, planned.last)) {}

  // The rows [y0, y1); y0 never falls. The memory lives as long as `keep`.
  SourceView Rows(int y0, int y1, std::shared_ptr<std::byte>& keep) {
    const ImageSpec& spec = planned_.source->spec();
    const int channels = planned_.last - planned_.first;
    const size_t row =
        static_cast<size_t>(spec.width()) * static_cast<size_t>(channels) * PixelBytes(spec.type);
    if (y1 <= y0) return {};
    std::shared_ptr<std::byte> memory = pool_.Take(row * static_cast<size_t>(y1 - y0));
    const int kept = std::clamp(y1_, y0, y1);
    if (kept > y0) {
      std::memcpy(memory.get(), memory_.get() + row * static_cast<size_t>(y0 - y0_),
                  row * static_cast<size_t>(kept - y0));
    }
    const Roi window = spec.data_window;
    if (kept < y1) {
      reader_->Read(ImageView(memory.get() + row * static_cast<size_t>(kept - y0),
                              {window.x0, kept, window.x1, y1}, channels, spec.type));
    }
    memory_ = keep = memory;
    y0_ = y0;
    y1_ = y1;
    return {ConstImageView(memory.get(), {window.x0, y0, window.x1, y1}, channels, spec.type),
            base::kReadMargin};
  }

 private:
  const PlannedSource& planned_;
  BufferPool& pool_;
  std::unique_ptr<RowReader> reader_;
  std::shared_ptr<std::byte> memory_;
  int y0_ = INT32_MIN, y1_ = INT32_MIN;
};

struct Band {
  Roi roi;
  std::vector<SourceView> sources;
  std::vector<std::shared_ptr<std::byte>> memory;  // keeps the views alive
  ImageView out;
};

// Sources that are not asked for in row order (a flip, a warp) are read whole beforehand.
std::vector<bool> OutOfOrder(const Plan& plan, const std::vector<Roi>& bands) {
  std::vector<bool> result(plan.sources.size(), false);
  std::vector<int> last_y0(plan.sources.size(), INT32_MIN), last_y1(plan.sources.size(), INT32_MIN);
  for (const Roi& band : bands) {
    const Regions regions = RequiredRegions(plan, band);
    for (size_t k = 0; k < plan.sources.size(); ++k) {
      const Roi& r = regions.sources[k];
      if (r.empty()) continue;
      if (r.y0 < last_y0[k] || r.y1 < last_y1[k]) result[k] = true;
      last_y0[k] = std::max(last_y0[k], r.y0);
      last_y1[k] = std::max(last_y1[k], r.y1);
    }
  }
  return result;
}

}  // namespace

BandShape ChooseBandShape(const Plan& plan, const Roi& roi, int64_t row_bytes, int granularity,
                          const RenderOptions& options) {
  const int threads = sched::ThreadCount(options.threads);
  int64_t bytes = row_bytes;
  for (const PlannedSource& s : plan.sources) {
    if (s.source->View()) continue;
    bytes += int64_t{s.source->spec().width()} * (s.last - s.first) *
             static_cast<int64_t>(PixelBytes(s.source->spec().type));
    granularity = std::max(granularity, s.source->RowGranularity());
  }
  BandShape shape;
  shape.tokens = threads > 1 ? threads + 2 : 1;
  // Big enough that hand-over and halos cost little, small enough that a laptop's cache and budget hold them
  // all.
  constexpr int64_t kBandBytes = int64_t{24} << 20;
  const int64_t budget =
      std::max<int64_t>(1, static_cast<int64_t>(options.memory_budget) / (shape.tokens + 1));
  int64_t rows = std::max<int64_t>(1, std::min(kBandBytes, budget) / std::max<int64_t>(1, bytes));
  if (rows > granularity) rows = rows / granularity * granularity;
  // Enough bands for every thread to have work.
  const int64_t fair = (int64_t{roi.height()} + 4 * threads - 1) / (4 * threads);
  rows = std::min(rows, std::max<int64_t>(fair, std::max(16, granularity)));
  if (options.tile_height > 0) rows = options.tile_height;
  if (rows > granularity) rows = rows / granularity * granularity;
  shape.rows = static_cast<int>(std::clamp<int64_t>(rows, 1, std::max(1, roi.height())));
  return shape;
}

void RunBands(const Program& program, const Roi& roi, PixelType type, const ImageView* out, RowSink* sink,
              const RenderOptions& options, Progress& progress) {
  if (roi.empty()) return;
  const Plan& plan = program.plan();
  const int channels = plan.spec.channel_count();
  const int64_t row_bytes = int64_t{roi.width()} * channels * static_cast<int64_t>(PixelBytes(type));
  const BandShape shape = ChooseBandShape(plan, roi, sink != nullptr ? row_bytes : 0,
                                          sink != nullptr ? sink->RowGranularity() : 1, options);
  std::vector<Roi> bands;
  for (int y = roi.y0; y < roi.y1; y += shape.rows) {
    bands.push_back({roi.x0, y, roi.x1, std::min(y + shape.rows, roi.y1)});
  }

  BufferPool pool;
  const std::vector<bool> out_of_order = OutOfOrder(plan, bands);
  std::vector<SourceView> resident(plan.sources.size());
  std::vector<std::shared_ptr<std::byte>> whole(plan.sources.size());
  std::vector<std::unique_ptr<RowWindow>> windows(plan.sources.size());
  const Regions all = RequiredRegions(plan, roi);
  for (size_t k = 0; k < plan.sources.size(); ++k) {
    const PlannedSource& s = plan.sources[k];
    if (const auto view = s.source->View()) {
      resident[k] = {*view, s.source->ReadMargin()};
    } else if (s.last > s.first) {
      windows[k] = std::make_unique<RowWindow>(s, pool);
      if (out_of_order[k]) {
        resident[k] = windows[k]->Rows(all.sources[k].y0, all.sources[k].y1, whole[k]);
        windows[k].reset();
      }
    }
  }

  const int threads = sched::ThreadCount(options.threads);
  std::deque<TileWorker> workers;
  for (int i = 0; i < threads; ++i) workers.emplace_back(program, progress.cancelled());
  progress.Begin(static_cast<int64_t>(bands.size()));
  size_t next = 0;
  sched::PipelineSteps steps;
  steps.read = [&]() -> std::shared_ptr<void> {
    progress.Check();
    if (next == bands.size()) return nullptr;
    auto band = std::make_shared<Band>();
    band->roi = bands[next++];
    const Regions regions = RequiredRegions(plan, band->roi);
    band->sources = resident;
    for (size_t k = 0; k < windows.size(); ++k) {
      if (windows[k] == nullptr) continue;
      const Roi& r = regions.sources[k];
      band->sources[k] = windows[k]->Rows(r.y0, r.y1, band->memory.emplace_back());
    }
    if (sink != nullptr) {
      band->memory.push_back(
          pool.Take(static_cast<size_t>(row_bytes) * static_cast<size_t>(band->roi.height())));
      band->out = ImageView(band->memory.back().get(), band->roi, channels, type);
    } else {
      band->out = out->Sub(band->roi);
    }
    return band;
  };
  steps.work = [&](void* item, int worker) {
    Band& band = *static_cast<Band*>(item);
    RenderOptions inner = options;
    inner.tile_height = 0;
    const TileShape tile = ChooseTileShape(program, band.roi, inner);
    for (int y = band.roi.y0; y < band.roi.y1; y += tile.height) {
      for (int x = band.roi.x0; x < band.roi.x1; x += tile.width) {
        const Roi r{x, y, std::min(x + tile.width, band.roi.x1), std::min(y + tile.height, band.roi.y1)};
        workers[static_cast<size_t>(worker)].Run(band.sources, band.out.Sub(r), false);
        progress.Check();
      }
    }
  };
  steps.write = [&](void* item) {
    if (sink != nullptr) sink->Write(static_cast<Band*>(item)->out);
    progress.Step();
  };
  sched::Pipeline(threads, shape.tokens, steps);
  progress.End();
}

}  // namespace tessera::graph
