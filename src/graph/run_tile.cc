// One tile through the plan: point runs block by block in L1, window steps on whole tiles.
#include "graph/run_tile.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <tuple>

#include "base/tile.h"
#include "graph/border.h"
#include "graph/run_moves.h"

namespace tessera::graph {
namespace {

constexpr int kPlaneFloats = kBlockPixels;

bool IsInterleavedRgba(ptrdiff_t channel_stride, ptrdiff_t pixel_stride, PixelType type) {
  const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
  return channel_stride == bytes && pixel_stride == 4 * bytes;
}

// Whether a tile stage may be given the source's own pixels: dense ones with the margin that it may read.
bool CanServe(const SourceView& source, const Roi& region, PixelType type) {
  const ConstImageView& v = source.view;
  if (region.empty() || source.first != 0 || !IsDense(v, type) ||
      v.row_stride < v.pixel_stride * v.roi.width()) {
    return false;
  }
  const std::byte* const end = v.At(v.roi.x1 - 1, v.roi.y1 - 1) + v.pixel_stride + source.margin;
  return v.At(region.x1 - 1, region.y1 - 1) + v.pixel_stride + base::kReadMargin <= end;
}

// A load of one run with its pixels found.
struct BoundLoad {
  simd::LoadArgs args;  // pixels and count are set per block
  ConstImageView view;
  bool skipped = false;  // a fused step reads the pixels itself
};

constexpr size_t kMostFused = std::tuple_size_v<decltype(PointStep::fused_load)>;

struct BoundStep {
  const PointStage* stage = nullptr;
  PointArgs args;
  const BoundLoad* source[kMostFused] = {};  // of the inputs that are read directly
  bool sink = false;
};

// A tail shorter than a group goes through here; four floats a pixel is the widest fused format.
struct Tail {
  alignas(base::kAlignment) std::byte pixels[kGroupPixels * 16] = {};
};

// The pixels of a block, or a copy of a tail with room for a whole group.
const std::byte* BlockPixels(const BoundLoad& load, int x, int y, int count, Tail& tail) {
  const std::byte* const pixels = load.view.At(x, y);
  if (count >= kGroupPixels) return pixels;
  std::memcpy(tail.pixels, pixels, static_cast<size_t>(count) * 4 * PixelBytes(load.view.type));
  return tail.pixels;
}

// The length of the next block: whole blocks, then whole groups, then a tail shorter than a group.
int BlockLength(int left, int block) {
  if (left >= block) return block;
  return left >= kGroupPixels ? left / kGroupPixels * kGroupPixels : left;
}

// Whether a step that treats samples alike may read and write these pixels, and the pixels of its inputs.
bool FindSamples(const PointRun& run, std::span<const SourceView> sources,
                 std::span<const ConstImageView> tiles, const ImageView& out,
                 std::array<ConstImageView, kMostFused>& from) {
  if (!run.samples) return false;
  const auto dense = [&](const ConstImageView& v) {
    return IsDense(v, out.type) && v.channels == out.channels;
  };
  const size_t inputs = run.sample_loads.size();
  if (!dense(out)) return false;
  for (size_t k = 0; k < inputs; ++k) {
    const PlaneLoad& load = run.loads[static_cast<size_t>(run.sample_loads[k])];
    const auto i = static_cast<size_t>(load.index);
    if (!load.from_tile && sources[i].first != 0) return false;
    from[k] = load.from_tile ? tiles[i] : sources[i].view;
    if (!dense(from[k])) return false;
  }
  return inputs == 1 ? run.samples->CanFuse(true, out.type) && run.samples->CanFuse(false, out.type)
                     : run.samples->CanFuseAll(out.type);
}

// Rows as samples, four of which are a pixel.
void RunSamples(const PointRun& run, const std::array<ConstImageView, kMostFused>& from, const ImageView& out,
                bool stream) {
  const size_t inputs = run.sample_loads.size(), pixel = 4 * PixelBytes(out.type);
  const size_t row = static_cast<size_t>(out.roi.width()) * static_cast<size_t>(out.pixel_stride);
  const int whole = static_cast<int>(row / pixel) / kGroupPixels * kGroupPixels;
  const size_t done = static_cast<size_t>(whole) * pixel;
  PointArgs args;
  for (DirectPixels* direct : {&args.source, &args.others[0], &args.others[1], &args.sink}) {
    direct->type = out.type;
  }
  const auto input = [&](size_t k) -> DirectPixels& { return k == 0 ? args.source : args.others[k - 1]; };
  Tail tail_in[kMostFused], tail_out;
  args.sink.stream = stream;
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    std::byte* const to = out.At(out.roi.x0, y);
    const auto at = [&](size_t k) { return from[k].At(out.roi.x0, y); };
    args.y = y;
    if (whole > 0) {
      args.count = whole;
      for (size_t k = 0; k < inputs; ++k) input(k).read = at(k);
      args.sink.write = to;
      run.samples->Run(args);
    }
    if (done == row) continue;
    args.count = kGroupPixels;
    for (size_t k = 0; k < inputs; ++k) {
      std::memcpy(tail_in[k].pixels, at(k) + done, row - done);
      input(k).read = tail_in[k].pixels;
    }
    args.sink.write = tail_out.pixels;
    run.samples->Run(args);
    std::memcpy(to + done, tail_out.pixels, row - done);
  }
}

}  // namespace

void TileRunner::RunPoints(const PointRun& run, std::span<const SourceView> sources,
                           std::span<const ConstImageView> tiles, const ImageView& out, bool stream,
                           base::Arena& arena) const {
  if (RunMoves(run, sources, tiles, out, stream, pixels_)) return;
  if (std::array<ConstImageView, kMostFused> from; FindSamples(run, sources, tiles, out, from)) {
    return RunSamples(run, from, out, stream);
  }
  const auto plane_count = static_cast<size_t>(run.planes);
  float* memory = arena.Allocate<float>(plane_count * kPlaneFloats);
  std::fill_n(memory, plane_count * kPlaneFloats, 0.0f);
  const auto plane = [&](PlaneId p) { return memory + static_cast<ptrdiff_t>(p) * kPlaneFloats; };
  std::fill_n(plane(kOnePlane), kPlaneFloats, 1.0f);

  std::vector<BoundLoad> loads(run.loads.size());
  for (size_t l = 0; l < loads.size(); ++l) {
    const PlaneLoad& planned = run.loads[l];
    BoundLoad& load = loads[l];
    const auto k = static_cast<size_t>(planned.index);
    load.view = planned.from_tile ? tiles[k] : sources[k].view;
    const int first = planned.from_tile ? 0 : sources[k].first;
    load.args.type = load.view.type;
    load.args.pixel_stride = load.view.pixel_stride;
    for (int p = 0; p < 4; ++p) {
      if (planned.channel[p] < 0) continue;
      load.args.channel[p] = (planned.channel[p] - first) * load.view.channel_stride;
      load.args.plane[p] = plane(planned.plane[p]);
    }
  }

  size_t pointer_count = 0;
  for (const PointStep& step : run.steps) pointer_count += step.in.size();
  const float*(*inputs)[4] =
      reinterpret_cast<const float*(*)[4]>(arena.Allocate<const float*>(4 * pointer_count));
  std::vector<BoundStep> steps(run.steps.size());
  bool stored = false;
  for (size_t s = 0; s < steps.size(); ++s) {
    const PointStep& planned = run.steps[s];
    BoundStep& step = steps[s];
    step.stage = planned.stage.get();
    step.args.order = pixels_.order;
    step.args.in = inputs;
    for (const auto& in : planned.in) {
      for (size_t p = 0; p < 4; ++p) (*inputs)[p] = plane(in[p]);
      ++inputs;
    }
    for (size_t p = 0; p < 4; ++p) step.args.out[p] = plane(planned.out[p]);
    const auto fusable = [&](int l) {
      if (l < 0) return false;
      const ConstImageView& view = loads[static_cast<size_t>(l)].view;
      return IsInterleavedRgba(view.channel_stride, view.pixel_stride, view.type);
    };
    const auto take = [&](int l, DirectPixels& direct) {
      BoundLoad& load = loads[static_cast<size_t>(l)];
      load.skipped = true;
      direct.type = load.view.type;
      return &load;
    };
    const auto type_of = [&](int l) { return loads[static_cast<size_t>(l)].view.type; };
    const std::array<int, kMostFused>& fused = planned.fused_load;
    const size_t inputs_of = planned.in.size();
    const bool sink =
        planned.fused_store && IsInterleavedRgba(out.channel_stride, out.pixel_stride, out.type);
    const bool all = inputs_of >= 2 && inputs_of <= kMostFused && sink && step.stage->CanFuseAll(out.type) &&
                     std::all_of(fused.begin(), fused.begin() + static_cast<ptrdiff_t>(inputs_of),
                                 [&](int l) { return fusable(l) && type_of(l) == out.type; });
    if (all || (fusable(fused[0]) && step.stage->CanFuse(true, type_of(fused[0])))) {
      step.source[0] = take(fused[0], step.args.source);
    }
    for (size_t k = 1; k < inputs_of && all; ++k) step.source[k] = take(fused[k], step.args.others[k - 1]);
    if (all || (sink && step.stage->CanFuse(false, out.type))) {
      step.sink = stored = true;
      step.args.sink.type = out.type;
      step.args.sink.stream = stream;
    }
  }

  std::vector<simd::StoreArgs> stores;
  for (int c = 0; c < out.channels && !stored; c += 4) {
    simd::StoreArgs store;
    store.type = out.type;
    store.pixel_stride = out.pixel_stride;
    store.stream = stream;
    for (int p = 0; p < 4 && c + p < out.channels; ++p) {
      store.channel[p] = (c + p) * out.channel_stride;
      store.plane[p] = plane(run.result[static_cast<size_t>(c + p)]);
    }
    stores.push_back(store);
  }

  // One step from source to sink touches no plane, so its blocks may be as long as the row: coefficients are
  // set up once.
  const bool no_planes =
      steps.size() == 1 && stored && !loads.empty() &&
      std::all_of(loads.begin(), loads.end(), [](const BoundLoad& l) { return l.skipped; });
  const int block =
      no_planes ? std::max(kBlockPixels, out.roi.width() / kGroupPixels * kGroupPixels) : kBlockPixels;

  Tail tail_in[kMostFused], tail_out;
  const size_t sink_pixel = 4 * PixelBytes(out.type);
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    for (int x = out.roi.x0; x < out.roi.x1;) {
      const int count = BlockLength(out.roi.x1 - x, block);
      const bool tail = count < kGroupPixels;
      for (const PointRun::Item& item : run.items) {
        const auto i = static_cast<size_t>(item.index);
        if (item.is_load) {
          BoundLoad& load = loads[i];
          if (load.skipped) continue;
          load.args.pixels = load.view.At(x, y);
          load.args.count = count;
          pixels_.load(load.args);
          continue;
        }
        BoundStep& step = steps[i];
        step.args.x = x;
        step.args.y = y;
        step.args.count = tail ? kGroupPixels : count;
        for (size_t k = 0; k < kMostFused; ++k) {
          if (step.source[k] == nullptr) continue;
          DirectPixels& direct = k == 0 ? step.args.source : step.args.others[k - 1];
          direct.read = BlockPixels(*step.source[k], x, y, count, tail_in[k]);
        }
        if (step.sink) step.args.sink.write = tail ? tail_out.pixels : out.At(x, y);
        step.stage->Run(step.args);
        if (step.sink && tail)
          std::memcpy(out.At(x, y), tail_out.pixels, static_cast<size_t>(count) * sink_pixel);
      }
      for (simd::StoreArgs& store : stores) {
        store.pixels = out.At(x, y);
        store.count = count;
        pixels_.store(store);
      }
      x += count;
    }
  }
}

void TileRunner::RunTile(const TileStep& step, std::span<const ConstImageView> tiles, const ImageView& out,
                         bool stream, base::Arena& arena) const {
  std::vector<ConstImageView> in;
  std::vector<std::span<const int>> in_channels;
  for (size_t k = 0; k < step.in.size(); ++k) {
    const TileStep::Input& input = step.in[k];
    in_channels.emplace_back(input.channels);
    if (input.buffer < 0) {
      in.push_back(input.whole);
      continue;
    }
    const ConstImageView& tile = tiles[static_cast<size_t>(input.buffer)];
    const Roi wanted = step.stage->InputRoi(static_cast<int>(k), out.roi);
    if (input.window.Contains(wanted)) {
      in.push_back(tile);
      continue;
    }
    const ImageView extended = base::NewTile(arena, wanted, tile.channels);
    FillWithBorder(tile, input.window, step.stage->InputBorder(static_cast<int>(k)), extended);
    in.push_back(extended);
  }
  step.stage->Run({in, out, stream, arena, step.channels, in_channels});
}

bool TileRunner::RunTyped(const Regions& regions, std::span<const SourceView> sources, const ImageView& out,
                          bool stream, base::Arena& arena) const {
  const int made = plan_.buffers.back().same_as_buffer;
  if (made < 0 || out.type == PixelType::kFloat || !IsDense(out, out.type)) return false;
  const Buffer& buffer = plan_.buffers[static_cast<size_t>(made)];
  if (!buffer.tile->stage->Accepts(out.type) || regions.buffers[static_cast<size_t>(made)] != out.roi) {
    return false;
  }
  std::vector<ConstImageView> tiles(plan_.buffers.size());
  for (size_t k = 0; k < buffer.tile->in.size(); ++k) {
    const TileStep::Input& input = buffer.tile->in[k];
    if (input.buffer < 0) return false;
    const auto i = static_cast<size_t>(input.buffer);
    const int from = plan_.buffers[i].same_as_source;
    if (from < 0) return false;
    const SourceView& source = sources[static_cast<size_t>(from)];
    const Roi& region = regions.buffers[i];
    if (!CanServe(source, region, out.type) ||
        !input.window.Contains(buffer.tile->stage->InputRoi(static_cast<int>(k), out.roi))) {
      return false;
    }
    tiles[i] = source.view.Sub(region);
  }
  RunTile(*buffer.tile, tiles, out, stream, arena);
  if (stream) simd::FlushStreams();
  return true;
}

void TileRunner::Run(const Regions& regions, std::span<const SourceView> sources, const ImageView& out,
                     bool stream, base::Arena& arena) const {
  arena.Reset();
  if (RunTyped(regions, sources, out, stream, arena)) return;
  const size_t count = plan_.buffers.size();
  const Buffer& last = plan_.buffers.back();
  const bool direct = last.same_as_buffer >= 0 && IsDenseFloat(out);
  std::vector<ConstImageView> tiles(count);
  for (size_t i = 0; i + 1 < count; ++i) {
    const Buffer& buffer = plan_.buffers[i];
    const Roi& region = regions.buffers[i];
    const int channels = static_cast<int>(buffer.channels.size());
    if (buffer.same_as_source >= 0) {
      const SourceView& source = sources[static_cast<size_t>(buffer.same_as_source)];
      if (CanServe(source, region, PixelType::kFloat)) {
        tiles[i] = source.view.Sub(region);
        continue;
      }
    }
    const bool here = direct && last.same_as_buffer == static_cast<int>(i) && region == out.roi;
    // An empty tile still says how many channels it has: a border may be all that its reader sees.
    const ImageView tile = here ? out : base::NewTile(arena, region, channels);
    tiles[i] = tile;
    if (region.empty()) continue;
    if (buffer.run) {
      RunPoints(*buffer.run, sources, tiles, tile, false, arena);
    } else {
      RunTile(*buffer.tile, tiles, tile, here && stream, arena);
    }
    if (here) {
      if (stream) simd::FlushStreams();
      return;
    }
  }
  RunPoints(*last.run, sources, tiles, out, stream, arena);
  if (stream) simd::FlushStreams();
}

}  // namespace tessera::graph
