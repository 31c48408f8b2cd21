// One tile: memory for its buffers, then step after step.
#include "graph/run.h"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "base/border.h"
#include "base/tile.h"

namespace tessera::graph {
namespace {

// Between the tiles of one region: as strips of rows they fill whole pages, and streams whose addresses end
// alike would compete for the same sets of the cache, loads wait for stores of others.
constexpr size_t kApart = 68 * base::kAlignment;

// Whether `margin` bytes more than the region's may be read: behind the view's last pixel there are some.
bool HasMargin(const ConstImageView& view, ptrdiff_t margin, const Roi& region) {
  if (region.empty()) return true;
  const std::byte* const end = view.At(view.roi.x1 - 1, view.roi.y1 - 1) + margin;
  return view.At(region.x1 - 1, region.y1 - 1) + base::kReadMargin <= end;
}

// By place, the largest of the tiles that take turns in it.
void FindPlaceBytes(const Program& program, const std::vector<int>& places, const std::vector<Roi>& regions,
                    std::vector<size_t>& bytes) {
  bytes.assign(Z(*std::max_element(places.begin(), places.end()) + 1), 0);
  for (int i = 0; i < program.result(); ++i) {
    if (places[Z(i)] < 0) continue;
    size_t& most = bytes[Z(places[Z(i)])];
    most = std::max(most, base::TileBytes(regions[Z(i)], program.layout(i).channels));
  }
}

}  // namespace

size_t TileMemory(const Program& program, const Roi& region) {
  std::vector<size_t> bytes;
  FindPlaceBytes(program, program.TilePlaces(), RequiredRegions(program.plan(), region), bytes);
  return std::accumulate(bytes.begin(), bytes.end(), size_t{0});
}

TileWorker::TileWorker(const Program& program, Context& context, const std::atomic<bool>& cancelled)
    : program_(program), cancelled_(cancelled), moves_(simd::CurrentMoveFunctions()), arena_(context) {
  places_ = program.TilePlaces();
  memory_.resize(static_cast<size_t>(*std::max_element(places_.begin(), places_.end()) + 1));
  made_.resize(places_.size());
  views_.resize(places_.size());
  margins_.assign(views_.size(), base::kReadMargin);
  for (const Step& step : program.steps) {
    const auto* const points = std::get_if<Points>(&step.how);
    runners_.emplace_back(points != nullptr ? PointsRunner(program, *points, step.to, context)
                                            : PointsRunner());
    Inputs& inputs = inputs_.emplace_back();
    if (const auto* const window = std::get_if<Window>(&step.how)) {
      inputs.views.resize(window->in.size());
      for (const TileStep::Input& in : window->planned->in) inputs.channels.emplace_back(in.channels);
    }
  }
}

void TileWorker::Run(std::span<const SourceView> sources, const ImageView& out, bool stream) {
  arena_.Reset();
  FindRequiredRegions(program_.plan(), out.roi, regions_);
  const BufferId result = program_.result();
  FindPlaceBytes(program_, places_, regions_, place_bytes_);
  for (size_t p = 0; p < memory_.size(); ++p)
    memory_[p] = arena_.Allocate<std::byte>(place_bytes_[p] + kApart);
  for (int i = 0; i < result; ++i) {
    if (places_[Z(i)] < 0) continue;
    // An empty tile still says how many channels it has: a border may be all that its reader sees.
    made_[Z(i)] = base::TileAt(memory_[Z(places_[Z(i)])], regions_[Z(i)], program_.layout(i).channels);
    views_[Z(i)] = made_[Z(i)];
  }
  const base::Arena::Mark tiles = arena_.Here();
  made_[Z(result)] = out;
  for (size_t k = 0; k < sources.size(); ++k) {
    views_[k] = sources[k].view;
    margins_[k] = sources[k].margin;
  }
  for (size_t s = 0; s < program_.steps.size(); ++s) {
    if (cancelled_.load(std::memory_order_relaxed)) return;
    const Step& step = program_.steps[s];
    if (regions_[Z(step.made)].empty()) continue;
    arena_.BackTo(tiles);  // what the step before used
    const bool around = stream && step.to == result;
    if (std::holds_alternative<Points>(step.how)) {
      runners_[s].Run(views_, made_[Z(step.to)], around);
    } else if (const auto* const window = std::get_if<Window>(&step.how)) {
      Inputs& inputs = inputs_[s];
      const ImageView& to = made_[Z(step.to)];
      for (size_t k = 0; k < window->in.size(); ++k) inputs.views[k] = Fetch(*window, k, to.roi);
      const TileStep& planned = *window->planned;
      planned.stage->Run({inputs.views, to, around, arena_, planned.channels, inputs.channels});
    } else if (const auto* const samples = std::get_if<Samples>(&step.how)) {
      RunSamples(*samples, made_[Z(step.to)], around);
    } else {
      RunMoves(std::get<ByteMoves>(step.how), made_[Z(step.to)], around);
    }
  }
  if (stream) simd::FlushStreams();
}

// An input of a tile stage: pixels as they lie, or, beyond the image's edge and where no margin may be read,
// a copy with what the border shows.
ConstImageView TileWorker::Fetch(const Window& window, size_t input, const Roi& out) {
  const TileStep::Input& planned = window.planned->in[input];
  const Window::Input& in = window.in[input];
  if (in.pixels < 0) return planned.whole;
  const ConstImageView& pixels = views_[Z(in.pixels)];
  const Roi& region = regions_[Z(in.tile)];
  const TileStage& stage = *window.planned->stage;
  const Roi wanted = stage.InputRoi(static_cast<int>(input), out);
  if (planned.window.Contains(wanted) && HasMargin(pixels, margins_[Z(in.pixels)], region)) {
    return pixels.Sub(region);
  }
  // Of the layout, since rows of a file that are not needed at all have no view.
  const Layout& layout = program_.layout(in.pixels);
  const ImageView extended = base::NewTile(arena_, wanted, layout.channels, layout.type);
  base::FillWithBorder(pixels, planned.window, stage.InputBorder(static_cast<int>(input)), extended);
  return extended;
}

void TileWorker::RunMoves(const ByteMoves& step, const ImageView& out, bool stream) {
  const int width = out.roi.width();
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    std::byte* const to = out.At(out.roi.x0, y);
    const std::byte* from[simd::kMostMovedInputs] = {};
    for (size_t k = 0; k < step.in.size(); ++k) from[k] = views_[Z(step.in[k])].At(out.roi.x0, y);
    if (!step.same) {
      moves_.move(step.moves, from, width, to, stream);
    } else if (from[0] != to) {  // else in place
      moves_.copy(from[0], Z(width) * static_cast<size_t>(out.pixel_stride), to, stream);
    }
  }
}

void TileWorker::RunSamples(const Samples& step, const ImageView& out, bool stream) {
  const size_t inputs = step.in.size(), pixel = 4 * PixelBytes(out.type);
  const size_t row = Z(out.roi.width()) * static_cast<size_t>(out.pixel_stride);
  const int whole = static_cast<int>(row / pixel) / kGroupPixels * kGroupPixels;
  const size_t done = Z(whole) * pixel;
  PointArgs args;
  for (DirectPixels* direct : {&args.source, &args.others[0], &args.others[1], &args.sink}) {
    direct->type = out.type;
  }
  args.codes = step.codes;
  args.sink.stream = stream;
  const auto input = [&](size_t k) -> DirectPixels& { return k == 0 ? args.source : args.others[k - 1]; };
  PixelGroup tail_in[ComputeOp::kMostDirect], tail_out;
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    std::byte* const to = out.At(out.roi.x0, y);
    const auto at = [&](size_t k) { return views_[Z(step.in[k])].At(out.roi.x0, y); };
    args.y = y;
    if (whole > 0) {
      args.count = whole;
      for (size_t k = 0; k < inputs; ++k) input(k).read = at(k);
      args.sink.write = to;
      step.stage->Run(args);
    }
    if (done == row) continue;
    args.count = kGroupPixels;
    for (size_t k = 0; k < inputs; ++k) {
      std::memcpy(tail_in[k].pixels, at(k) + done, row - done);
      input(k).read = tail_in[k].pixels;
    }
    args.sink.write = tail_out.pixels;
    step.stage->Run(args);
    std::memcpy(to + done, tail_out.pixels, row - done);
  }
}

}  // namespace tessera::graph
