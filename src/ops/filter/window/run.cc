// Runs a prepared kernel on tiles and whole images, and puts edges and bias right.
#include "ops/filter/window/run.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "base/border.h"
#include "base/tile.h"
#include "base/worker_arenas.h"

namespace tessera::ops {
namespace {

const float* FloatAt(const ConstImageView& v, int x, int y) {
  return reinterpret_cast<const float*>(v.At(x, y));
}
float* FloatAt(const ImageView& v, int x, int y) { return reinterpret_cast<float*>(v.At(x, y)); }

}  // namespace

WindowRun::WindowRun(std::shared_ptr<const Window> window, PixelType type)
    : window_(std::move(window)), type_(type) {
  for (int p = 0; p < window_->planes(); ++p) sums_.push_back(window_->MakeSums(p, type));
  if (!IntegerSums::Applies(type) || window_->SumsCodes(type) || window_->kernel().weights.empty()) return;
  integers_.emplace(type, window_->kernel(), window_->options(), window_->ErrorBound());
}

bool WindowRun::Accepts(PixelType type) const {
  return type == PixelType::kFloat || (sums_.size() == 1 && sums_[0]->Accepts(type));
}

void WindowRun::RunBlocks(const graph::TileArgs& args, const Roi& window) const {
  const FftKernel& shape = window_->fft(0);
  const Roi blocks = window_->WholeBlocks(args.out.roi, window);
  const auto& held = args.in_channels[0];
  const int size = shape.size, channels = args.in[0].channels, results = args.out.channels;
  constexpr int kMost = 4;  // channels that are put together at once
  const size_t plane = static_cast<size_t>(size) * static_cast<size_t>(shape.step_y()) + 16;
  float* const scratch = args.scratch.Allocate<float>(FftScratchFloats(shape));
  float* const planes = args.scratch.Allocate<float>(plane * kMost);
  ImageView extended = base::NewTile(args.scratch, {0, 0, size, size}, channels);
  for (int y = blocks.y0; y < blocks.y1; y += shape.step_y()) {
    for (int x = blocks.x0; x < blocks.x1; x += shape.step_x()) {
      const Roi block{x, y, x + shape.step_x(), y + shape.step_y()};
      const Roi part = Intersection(args.out.roi, block);
      extended.roi = window_->Footprint(block);
      base::FillWithBorder(args.in[0], window, window_->options().wrap, extended);
      const ptrdiff_t stride = extended.row_stride / 4;
      for (int first = 0; first < results; first += kMost) {
        FftResults together{.plane = {},
                            .channels = std::min(kMost, results - first),
                            .x0 = part.x0 - x,
                            .y0 = part.y0 - y,
                            .x1 = part.x1 - x,
                            .y1 = part.y1 - y,
                            .out = FloatAt(args.out, part.x0, part.y0) + first,
                            .out_stride = args.out.row_stride / 4,
                            .step = results};
        for (int i = 0; i < together.channels; ++i) {
          const int channel = args.channels[static_cast<size_t>(first + i)];
          const auto at = std::find(held.begin(), held.end(), channel) - held.begin();
          const float* const in = FloatAt(extended, extended.roi.x0, extended.roi.y0) + at;
          float* const to = planes + plane * static_cast<size_t>(i);
          together.plane[i] = to;
          if (fft_.channel(window_->fft(PlaneOf(channel)), {in, stride, channels}, together.y0, together.y1,
                           to, scratch))
            continue;
          // Something is not finite: every result gets the sum over its own neighbours.
          const ptrdiff_t padded = size + 16;
          for (int row = 0; row < size; ++row) {
            for (int n = 0; n < size; ++n)
              scratch[row * padded + n] = in[row * stride + ptrdiff_t{n} * channels];
          }
          SumsOf(channel).Run({.in = scratch + together.y0 * padded,
                               .in_stride = padded,
                               .out = to + ptrdiff_t{together.y0} * size,
                               .out_stride = size,
                               .samples = shape.step_x(),
                               .rows = together.y1 - together.y0},
                              args.scratch);
        }
        fft_.interleave(together, size);
      }
    }
  }
}

// One kernel per channel, or channels that the result does not have: each channel is taken out, filtered, put
// back.
void WindowRun::RunPlanes(const graph::TileArgs& args, const ConstImageView& in, const ImageView& out) const {
  const Roi needed = window_->Footprint(out.roi);
  const ptrdiff_t stride = (needed.width() + 31) / 16 * 16;
  float* plane_in =
      args.scratch.Allocate<float>(static_cast<size_t>(stride) * static_cast<size_t>(needed.height()));
  float* plane_out =
      args.scratch.Allocate<float>(static_cast<size_t>(stride) * static_cast<size_t>(out.roi.height()));
  for (int i = 0; i < out.channels; ++i) {
    const int channel = args.channels[static_cast<size_t>(i)];
    const auto& held = args.in_channels[0];
    const auto from = std::find(held.begin(), held.end(), channel) - held.begin();
    for (int y = needed.y0; y < needed.y1; ++y) {
      const float* p = FloatAt(in, needed.x0, y) + from;
      float* to = plane_in + (y - needed.y0) * stride;
      for (int x = 0; x < needed.width(); ++x) to[x] = p[static_cast<ptrdiff_t>(x) * in.channels];
    }
    const FloatTile tile{plane_in, stride, plane_out, stride, out.roi.width(), out.roi.height(), 1, false};
    SumsOf(channel).Run(tile, args.scratch);
    for (int y = out.roi.y0; y < out.roi.y1; ++y) {
      float* p = FloatAt(out, out.roi.x0, y) + i;
      const float* result = plane_out + (y - out.roi.y0) * stride;
      for (int x = 0; x < out.roi.width(); ++x) p[static_cast<ptrdiff_t>(x) * out.channels] = result[x];
    }
  }
}

// `in` covers the part's whole footprint.
void WindowRun::RunPart(const graph::TileArgs& args, const ConstImageView& in, const Roi& part) const {
  const auto sum = [&]<class T>(T) {
    const Roi needed = window_->Footprint(part);
    constexpr ptrdiff_t kBytes = sizeof(T);
    const SampleTile<T> tile{reinterpret_cast<const T*>(in.At(needed.x0, needed.y0)),
                             in.row_stride / kBytes,
                             reinterpret_cast<T*>(args.out.At(part.x0, part.y0)),
                             args.out.row_stride / kBytes,
                             part.width() * in.channels,
                             part.height(),
                             in.channels,
                             args.stream && window_->options().bias == 0};
    sums_[0]->Run(tile, args.scratch);
  };
  if (args.out.type == PixelType::kUint8) return sum(uint8_t{});
  if (args.out.type == PixelType::kUint16) return sum(uint16_t{});
  if (sums_.size() != 1 || in.channels != args.out.channels) return RunPlanes(args, in, args.out.Sub(part));
  sum(0.0f);
}

void WindowRun::Run(const graph::TileArgs& args, const Roi& window) const {
  const Roi& o = args.out.roi;
  if (o.empty()) return;
  const ConstImageView& in = args.in[0];
  if (window_->method() == FilterMethod::kFft && !window_->SumsCodes(type_)) {
    RunBlocks(args, window);
  } else {
    const Roi inner = window_->Inner(o, window);
    if (!inner.empty()) RunPart(args, in, inner);
    // Above, below, left, right of what needs no border.
    for (const Roi& part :
         {Roi{o.x0, o.y0, o.x1, inner.y0}, Roi{o.x0, inner.y1, o.x1, o.y1},
          Roi{o.x0, inner.y0, inner.x0, inner.y1}, Roi{inner.x1, inner.y0, o.x1, inner.y1}}) {
      if (part.empty()) continue;
      const ImageView extended =
          base::NewTile(args.scratch, window_->Footprint(part), in.channels, args.out.type);
      base::FillWithBorder(in, window, window_->options().wrap, extended);
      RunPart(args, extended, part);
    }
  }
  if (window_->TreatsEdges() && !window.Contains(window_->Footprint(o))) MendEdges(args, window);
  if (window_->options().bias != 0) AddBias(args);
  if (integers_) {
    integers_->Settle(in, args.in_channels[0], args.out, args.channels, window, args.scratch);
  }
}

void WindowRun::RunWhole(const ConstImageView& in, const ImageView& out,
                         const graph::Workers& workers) const {
  constexpr int kWidth = 960, kHeight = 32;
  const Roi& r = out.roi;
  if (r.empty()) return;
  std::vector<int> channels(static_cast<size_t>(out.channels));
  std::iota(channels.begin(), channels.end(), 0);
  const std::vector<std::span<const int>> in_channels = {channels};
  const int64_t columns = (r.width() + kWidth - 1) / kWidth, rows = (r.height() + kHeight - 1) / kHeight;
  base::WorkerArenas arenas(workers);
  workers.For(columns * rows, [&](int64_t i, int worker) {
    base::Arena& arena = arenas[worker];
    arena.Reset();
    const int x = r.x0 + static_cast<int>(i % columns) * kWidth,
              y = r.y0 + static_cast<int>(i / columns) * kHeight;
    const Roi part = Intersection(r, {x, y, x + kWidth, y + kHeight});
    ConstImageView source[] = {in};
    const Roi needed = window_->InputRoi(part, in.roi);
    if (needed.y1 == in.roi.y1) {
      // Beyond the image's last row there is no memory that may be read.
      const ImageView copy = base::NewTile(arena, needed, in.channels);
      base::FillWithBorder(in, in.roi, Wrap::kBlack, copy);
      source[0] = copy;
    }
    Run({source, out.Sub(part), false, arena, channels, in_channels}, in.roi);
  });
}

void WindowRun::MendEdges(const graph::TileArgs& args, const Roi& window) const {
  const Roi& o = args.out.roi;
  const WindowOptions& options = window_->options();
  for (int y = o.y0; y < o.y1; ++y) {
    for (int x = o.x0; x < o.x1; ++x) {
      if (window.Contains(window_->Footprint({x, y, x + 1, y + 1}))) continue;
      float* p = FloatAt(args.out, x, y);
      for (int c = 0; c < args.out.channels; ++c) {
        const int plane = PlaneOf(args.channels[static_cast<size_t>(c)]);
        const double inside = window_->WeightInside(plane, window, x, y), total = window_->WeightOf(plane);
        if (options.wrap == Wrap::kRenormalize) {
          if (inside != 0) p[c] = static_cast<float>(p[c] * (total / inside));
        } else {
          p[c] = static_cast<float>(p[c] + (total - inside) * options.border_value);
        }
      }
    }
  }
}

void WindowRun::AddBias(const graph::TileArgs& args) const {
  const Roi& o = args.out.roi;
  const ConstImageView& in = args.in[0];
  const auto& held = args.in_channels[0];
  const int channels = args.out.channels, of = window_->options().alpha;
  const auto alpha = std::find(held.begin(), held.end(), of);
  const bool with_alpha = of >= 0 && alpha != held.end();
  const auto bias = static_cast<float>(window_->options().bias);
  for (int y = o.y0; y < o.y1; ++y) {
    float* p = FloatAt(args.out, o.x0, y);
    for (int x = o.x0; x < o.x1; ++x, p += channels) {
      const float a = with_alpha ? FloatAt(in, x, y)[alpha - held.begin()] : 1;
      for (int c = 0; c < channels; ++c) p[c] += bias * a;
    }
  }
}

}  // namespace tessera::ops
