// Bands of rows in file order: read, compute and write overlap, memory stays bounded.
#include <algorithm>
#include <chrono>
#include <cstring>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "base/paged_memory.h"
#include "base/pool.h"
#include "graph/executor.h"
#include "graph/run.h"
#include "sched/phase_clock.h"
#include "sched/scheduler.h"
#include "tessera/context.h"

namespace tessera::graph {
namespace {

// Rows of one file source: every row is read once, rows that the next band needs again are kept.
class RowWindow {
 public:
  RowWindow(const PlannedSource& planned, const RenderOptions& options)
      : planned_(planned),
        context_(ContextOf(options)),
        reader_(planned.source->Open(planned.first, planned.last)) {
    reader_->Limit(sched::ThreadCount(options.threads), options.memory_budget / 4);
  }

  // The rows [y0, y1); y0 never falls. The memory lives as long as `keep`.
  SourceView Rows(int y0, int y1, std::shared_ptr<std::byte>& keep) {
    const ImageSpec& spec = planned_.source->spec();
    const int channels = planned_.last - planned_.first;
    const size_t row =
        static_cast<size_t>(spec.width()) * static_cast<size_t>(channels) * PixelBytes(spec.type);
    if (y1 <= y0) return {};
    const Roi window = spec.data_window;
    if (y0 != y0_ || y1 != y1_) {  // a turned image needs the same rows for every band
      std::shared_ptr<std::byte> memory = base::AllocateWhole(context_, row * static_cast<size_t>(y1 - y0));
      const int kept = std::clamp(y1_, y0, y1);
      if (kept > y0) {
        std::memcpy(memory.get(), memory_.get() + row * static_cast<size_t>(y0 - y0_),
                    row * static_cast<size_t>(kept - y0));
      }
      // At once, unless it is not to be resident at once.
      int most = y1 - kept;
      if (context_.paged().IsPaged(row * static_cast<size_t>(y1 - y0))) {
        constexpr size_t kPiece = size_t{32} << 20;
        const int tiles = planned_.source->RowGranularity();
        const auto rows = static_cast<int>(std::min<size_t>(kPiece / row, INT32_MAX / 2));
        most = std::max(rows / tiles, 1) * tiles;
      }
      for (int y = kept; y < y1; y += std::min(most, y1 - y)) {
        reader_->Read(ImageView(memory.get() + row * static_cast<size_t>(y - y0),
                                {window.x0, y, window.x1, std::min(y1, y + most)}, channels, spec.type));
        context_.paged().Trim();
      }
      memory_ = std::move(memory);
      y0_ = y0;
      y1_ = y1;
    }
    keep = memory_;
    return {ConstImageView(memory_.get(), {window.x0, y0, window.x1, y1}, channels, spec.type),
            base::kReadMargin};
  }

 private:
  const PlannedSource& planned_;
  Context& context_;
  std::unique_ptr<RowReader> reader_;
  std::shared_ptr<std::byte> memory_;
  int y0_ = INT32_MIN, y1_ = INT32_MIN;
};

// Of what is read of a file.
int64_t RowBytes(const PlannedSource& s) {
  return int64_t{s.source->spec().width()} * (s.last - s.first) *
         static_cast<int64_t>(PixelBytes(s.source->spec().type));
}

struct Band {
  std::vector<SourceView> sources;
  std::vector<std::shared_ptr<std::byte>> memory;  // keeps the views alive
  ImageView out;
};

// Sources that are not asked for in row order (a flip, a warp) are read whole beforehand.
std::vector<bool> OutOfOrder(const Plan& plan, const std::vector<Roi>& bands) {
  std::vector<bool> result(plan.sources.size(), false);
  std::vector<int> last_y0(plan.sources.size(), INT32_MIN), last_y1(plan.sources.size(), INT32_MIN);
  for (const Roi& band : bands) {
    const std::vector<Roi> regions = RequiredRegions(plan, band);
    for (size_t k = 0; k < plan.sources.size(); ++k) {
      const Roi& r = regions[k];
      if (r.empty()) continue;
      if (r.y0 < last_y0[k] || r.y1 < last_y1[k]) result[k] = true;
      last_y0[k] = std::max(last_y0[k], r.y0);
      last_y1[k] = std::max(last_y1[k], r.y1);
    }
  }
  return result;
}

// Bytes of the rows of files and of the result that a band in the middle, where most is read, takes.
int64_t BandBytes(const Plan& plan, const Roi& roi, int64_t row_bytes, int rows) {
  const int y0 = roi.y0 + (roi.height() - rows) / 2;
  const std::vector<Roi> regions = RequiredRegions(plan, {roi.x0, y0, roi.x1, y0 + rows});
  int64_t bytes = row_bytes * rows;
  for (size_t k = 0; k < plan.sources.size(); ++k) {
    if (!plan.sources[k].source->View()) bytes += RowBytes(plan.sources[k]) * regions[k].height();
  }
  return bytes;
}

// Where a row is made of many, a band reads more rows than it has: fewer rows, until `most` bytes hold them
// or most of what is read is read for the next band too, and then fewer bands at once.
void KeepWithinMemory(const Plan& plan, const Roi& roi, int64_t row_bytes, int64_t most, BandShape& shape) {
  int64_t bytes = BandBytes(plan, roi, row_bytes, shape.rows);
  while (bytes > most && shape.rows > 1) {
    const int rows = (shape.rows + 1) / 2;
    const int64_t fewer = BandBytes(plan, roi, row_bytes, rows);
    if (fewer > bytes / 4 * 3) break;
    bytes = fewer, shape.rows = rows;
  }
  if (bytes <= most) return;
  shape.tokens =
      static_cast<int>(std::clamp<int64_t>(most * (shape.tokens + 1) / bytes - 1, 1, shape.tokens));
}

}  // namespace

BandShape ChooseBandShape(const Plan& plan, const Roi& roi, int64_t row_bytes, int granularity,
                          const RenderOptions& options) {
  const int threads = sched::ThreadCount(options.threads);
  int64_t bytes = row_bytes;
  for (const PlannedSource& s : plan.sources) {
    if (s.source->View()) continue;
    bytes += RowBytes(s);
    granularity = std::max(granularity, s.source->RowGranularity());
  }
  BandShape shape;
  shape.tokens = threads > 1 ? threads + 2 : 1;
  // Big enough that hand-over and halos cost little, small enough that a laptop's cache and budget hold them
  // all.
  constexpr int64_t kBandBytes = int64_t{24} << 20;
  // Half of a budget that somebody stated is for arenas, and for what whole operations keep between rows.
  const size_t half = options.memory_budget == RenderOptions().memory_budget ? 1 : 2;
  const int64_t budget =
      std::max<int64_t>(1, static_cast<int64_t>(options.memory_budget / half) / (shape.tokens + 1));
  int64_t rows = std::max<int64_t>(1, std::min(kBandBytes, budget) / std::max<int64_t>(1, bytes));
  if (rows > granularity) rows = rows / granularity * granularity;
  // Enough bands for every thread to have work.
  const int64_t fair = (int64_t{roi.height()} + 4 * threads - 1) / (4 * threads);
  rows = std::min(rows, std::max<int64_t>(fair, std::max(16, granularity)));
  if (options.tile_height > 0) rows = options.tile_height;
  if (rows > granularity) rows = rows / granularity * granularity;
  shape.rows = static_cast<int>(std::clamp<int64_t>(rows, 1, std::max(1, roi.height())));
  if (options.tile_height <= 0 && !roi.empty()) KeepWithinMemory(plan, roi, row_bytes, budget, shape);
  return shape;
}

namespace {

// The phases of a run in bands: what it computes and encodes, then a source's decoding each.
constexpr size_t kCompute = 0, kEncode = 1, kDecode = 2;

// Tells `phases` at its end where the time went.
class BandTimes {
 public:
  BandTimes(RunPhases* phases, const Plan& plan, int threads)
      : phases_(phases), plan_(plan), threads_(threads) {
    if (phases_ != nullptr) clock_.emplace(kDecode + plan.sources.size());
  }
  sched::PhaseClock* clock() { return clock_ ? &*clock_ : nullptr; }

  void End() {
    if (phases_ == nullptr) return;
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start_;
    RunPhases own;
    own.compute = clock_->Busy(kCompute);
    own.encode = clock_->Busy(kEncode);
    own.encode_elapsed = clock_->Elapsed(kEncode);
    double busy = own.compute + own.encode;
    for (size_t k = 0; k < plan_.sources.size(); ++k) {
      const double spent = clock_->Busy(kDecode + k);
      if (spent == 0) continue;
      busy += spent;
      RunPhases decoding;  // a file may be several sources
      decoding.decode = {{plan_.sources[k].source->Describe(), spent, clock_->Elapsed(kDecode + k)}};
      own.Add(decoding);
    }
    own.wait = threads_ * took.count() - busy;
    own.seconds = took.count();
    phases_->Add(own);
  }

 private:
  RunPhases* const phases_;
  const Plan& plan_;
  const int threads_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::optional<sched::PhaseClock> clock_;
};

// Where a pass reads: pixels that are there, and files, whole or a window of rows.
class BandSources {
 public:
  BandSources(const Plan& plan, const Roi& roi, const std::vector<Roi>& bands, const RenderOptions& options,
              sched::PhaseClock* clock)
      : plan_(plan), clock_(clock), resident_(plan.sources.size()), windows_(plan.sources.size()) {
    const std::vector<bool> out_of_order = OutOfOrder(plan, bands);
    const std::vector<Roi> all = RequiredRegions(plan, roi);
    for (size_t k = 0; k < plan.sources.size(); ++k) {
      const PlannedSource& s = plan.sources[k];
      if (const auto view = s.source->View()) {
        resident_[k] = {*view, s.source->ReadMargin()};
      } else if (s.last > s.first) {
        const sched::InPhase decoding(clock_, kDecode + k);
        windows_[k] = std::make_unique<RowWindow>(s, options);
        if (!out_of_order[k]) continue;
        resident_[k] = windows_[k]->Rows(all[k].y0, all[k].y1, whole_.emplace_back());
        windows_[k].reset();
      }
    }
  }

  // What a band needs; bands are asked for from the top. `memory` keeps it alive.
  std::vector<SourceView> Rows(const Roi& band, std::vector<std::shared_ptr<std::byte>>& memory) {
    const std::vector<Roi> regions = RequiredRegions(plan_, band);
    std::vector<SourceView> views = resident_;
    for (size_t k = 0; k < windows_.size(); ++k) {
      if (windows_[k] == nullptr) continue;
      const sched::InPhase decoding(clock_, kDecode + k);
      views[k] = windows_[k]->Rows(regions[k].y0, regions[k].y1, memory.emplace_back());
    }
    return views;
  }

 private:
  const Plan& plan_;
  sched::PhaseClock* const clock_;
  std::vector<SourceView> resident_;
  std::vector<std::shared_ptr<std::byte>> whole_;
  std::vector<std::unique_ptr<RowWindow>> windows_;
};

}  // namespace

void RunBands(const Program& program, const Roi& roi, PixelType type, const ImageView* out, RowSink* sink,
              const RenderOptions& options, sched::Progress& progress, RunPhases* phases) {
  if (roi.empty()) return;
  const Plan& plan = program.plan();
  const int threads = sched::ThreadCount(options.threads);
  BandTimes times(phases, plan, threads);
  sched::PhaseClock* const clock = times.clock();
  const int channels = plan.spec.channel_count();
  const int64_t row_bytes = int64_t{roi.width()} * channels * static_cast<int64_t>(PixelBytes(type));
  const BandShape shape = ChooseBandShape(plan, roi, sink != nullptr ? row_bytes : 0,
                                          sink != nullptr ? sink->RowGranularity() : 1, options);
  const std::vector<Roi> bands = Tiles(roi, {roi.width(), shape.rows});
  base::Pool& pool = ContextOf(options).pool();
  base::PagedPool& paged = ContextOf(options).paged();
  BandSources sources(plan, roi, bands, options, clock);
  RenderOptions inner = options;
  inner.tile_height = 0;
  if (paged.IsUsed()) {  // a scattered read may bring in 64 KB, and pages are given back between tiles
    inner.tile_width = std::min(64, roi.width());
    inner.tile_height = 16;
  }
  const TileShape tile = ChooseTileShape(program, bands[bands.size() / 2], inner);

  std::deque<TileWorker> workers;
  for (int i = 0; i < threads; ++i) workers.emplace_back(program, ContextOf(options), progress.cancelled());
  progress.Begin(static_cast<int64_t>(bands.size()));
  size_t next = 0;
  sched::PipelineSteps steps;
  steps.read = [&]() -> std::shared_ptr<void> {
    progress.Check();
    if (next == bands.size()) return nullptr;
    auto band = std::make_shared<Band>();
    const Roi& own = bands[next++];
    band->sources = sources.Rows(own, band->memory);
    if (sink != nullptr) {
      band->memory.push_back(
          pool.Allocate(static_cast<size_t>(row_bytes) * static_cast<size_t>(own.height())));
      band->out = ImageView(band->memory.back().get(), own, channels, type);
    } else {
      band->out = out->Sub(own);
    }
    return band;
  };
  steps.work = [&](void* item, int worker) {
    const sched::InPhase computing(clock, kCompute);
    const Band& band = *static_cast<Band*>(item);
    for (const Roi& part : Tiles(band.out.roi, tile)) {
      workers[static_cast<size_t>(worker)].Run(band.sources, band.out.Sub(part), false);
      paged.Trim();
      progress.Check();
    }
  };
  steps.write = [&](void* item) {
    if (sink != nullptr) {
      const sched::InPhase encoding(clock, kEncode);
      sink->Write(static_cast<Band*>(item)->out);
    }
    progress.Step();
  };
  sched::Pipeline(threads, shape.tokens, steps);
  times.End();
  progress.End();
}

}  // namespace tessera::graph
