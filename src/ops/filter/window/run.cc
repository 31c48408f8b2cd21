// Runs a prepared kernel on tiles and whole images, and puts edges and bias right.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "base/tile.h"
#include "graph/border.h"
#include "ops/filter/window/window.h"

namespace tessera::ops {
namespace {

const float* FloatAt(const ConstImageView& v, int x, int y) {
  return reinterpret_cast<const float*>(v.At(x, y));
}
float* FloatAt(const ImageView& v, int x, int y) { return reinterpret_cast<float*>(v.At(x, y)); }

}  // namespace

bool Window::SumsCodes(PixelType type) const {
  if (options_.bias != 0 || TreatsEdges()) return false;
  // Of bytes few float results are near a tie.
  constexpr double kMostTapsOfBytes = 81;
  return type == PixelType::kUint16 || (type == PixelType::kUint8 && (method_ == FilterMethod::kSeparable ||
                                                                      width_ * height_ <= kMostTapsOfBytes));
}

WindowFunctions ChooseWindowFunctions() {
  return {{ChooseDirect(), ChooseSeparable()}, ChooseCodes(), ChooseBytes(), ChooseFft()};
}

void Window::RunPlane(const WindowFunctions& functions, const Plane& plane, const FirTile& tile,
                      base::Arena& scratch, int largest) const {
  const FloatSums sum{functions.fir, plane.direct, plane.separable, scratch};
  if (largest == 0) return sum(tile);
  constexpr int kByte = 255;
  if (largest == kByte ? plane.bytes.usable : plane.bytes.divisor_of_words != 0) {
    RunBytes(functions.bytes, plane.bytes, plane.codes, largest, tile, sum);
  } else {
    RunCodes(functions.codes, plane.codes, largest, tile, sum);
  }
}

void Window::RunBlocks(const WindowFunctions& functions, const graph::TileArgs& args,
                       const Roi& window) const {
  const FftKernel& shape = planes_[0].fft;
  const Roi blocks = WholeBlocks(args.out.roi, window);
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
      extended.roi = Footprint(block);
      graph::FillWithBorder(args.in[0], window, EngineBorder(options_.border), extended);
      const ptrdiff_t stride = extended.row_stride / 4;
      for (int first = 0; first < results; first += kMost) {
        FftResults together{.channels = std::min(kMost, results - first),
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
          const Plane& of = planes_[planes_.size() == 1 ? 0 : static_cast<size_t>(channel)];
          const float* const in = FloatAt(extended, extended.roi.x0, extended.roi.y0) + at;
          float* const to = planes + plane * static_cast<size_t>(i);
          together.plane[i] = to;
          if (functions.fft.channel(of.fft, {in, stride, channels}, together.y0, together.y1, to, scratch))
            continue;
          // Something is not finite: every result gets the sum over its own neighbours.
          const ptrdiff_t padded = size + 16;
          for (int row = 0; row < size; ++row) {
            for (int n = 0; n < size; ++n)
              scratch[row * padded + n] = in[row * stride + ptrdiff_t{n} * channels];
          }
          functions.fir.direct(of.direct, {.in = scratch + together.y0 * padded,
                                           .in_stride = padded,
                                           .out = to + ptrdiff_t{together.y0} * size,
                                           .out_stride = size,
                                           .floats = shape.step_x(),
                                           .rows = together.y1 - together.y0});
        }
        functions.fft.interleave(together, size);
      }
    }
  }
}

// One kernel per channel, or channels that the result does not have: each channel is taken out, filtered, put
// back.
void Window::RunPlanes(const WindowFunctions& functions, const graph::TileArgs& args,
                       const ConstImageView& in, const ImageView& out, int largest) const {
  const Roi needed = Footprint(out.roi);
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
    const FirTile tile{plane_in, stride, plane_out, stride, out.roi.width(), out.roi.height(), 1, false};
    RunPlane(functions, planes_[planes_.size() == 1 ? 0 : static_cast<size_t>(channel)], tile, args.scratch,
             largest);
    for (int y = out.roi.y0; y < out.roi.y1; ++y) {
      float* p = FloatAt(out, out.roi.x0, y) + i;
      const float* result = plane_out + (y - out.roi.y0) * stride;
      for (int x = 0; x < out.roi.width(); ++x) p[static_cast<ptrdiff_t>(x) * out.channels] = result[x];
    }
  }
}

template <class T>
CodeTile<T> Window::TileOfCodes(const graph::TileArgs& args, const ConstImageView& in,
                                const Roi& part) const {
  const Roi needed = Footprint(part);
  constexpr ptrdiff_t kBytes = sizeof(T);
  return {reinterpret_cast<const T*>(in.At(needed.x0, needed.y0)),
          in.row_stride / kBytes,
          reinterpret_cast<T*>(args.out.At(part.x0, part.y0)),
          args.out.row_stride / kBytes,
          part.width() * in.channels,
          part.height(),
          in.channels};
}

// `in` covers the part's whole footprint.
void Window::RunPart(const WindowFunctions& functions, const graph::TileArgs& args, const ConstImageView& in,
                     const Roi& part, int largest) const {
  const BytesWindow& bytes = planes_[0].bytes;
  if (args.out.type == PixelType::kUint8) {
    return RunBytes(functions.bytes, bytes, planes_[0].codes, TileOfCodes<uint8_t>(args, in, part),
                    {functions.fir, planes_[0].direct, planes_[0].separable, args.scratch});
  }
  if (args.out.type == PixelType::kUint16)
    return RunProducts(functions.bytes.products, bytes.product, TileOfCodes<uint16_t>(args, in, part),
                       args.scratch);
  const ImageView out = args.out.Sub(part);
  if (planes_.size() != 1 || in.channels != out.channels) return RunPlanes(functions, args, in, out, largest);
  const Roi needed = Footprint(part);
  const FirTile tile{FloatAt(in, needed.x0, needed.y0),
                     in.row_stride / 4,
                     FloatAt(out, part.x0, part.y0),
                     out.row_stride / 4,
                     part.width() * out.channels,
                     part.height(),
                     out.channels,
                     args.stream && options_.bias == 0};
  RunPlane(functions, planes_[0], tile, args.scratch, largest);
}

void Window::Run(const WindowFunctions& functions, const graph::TileArgs& args, const Roi& window,
                 int largest) const {
  const Roi& o = args.out.roi;
  if (o.empty()) return;
  const ConstImageView& in = args.in[0];
  if (method_ == FilterMethod::kFft && largest == 0) {
    RunBlocks(functions, args, window);
    return Finish(args, window);
  }
  Roi inner = Intersection(o, {window.x0 + anchor_x_, window.y0 + anchor_y_,
                               window.x1 - (width_ - 1 - anchor_x_), window.y1 - (height_ - 1 - anchor_y_)});
  if (inner.empty()) {
    inner = {o.x0, o.y1, o.x0, o.y1};
  } else {
    RunPart(functions, args, in, inner, largest);
  }
  // Above, below, left, right of what needs no border.
  for (const Roi& part : {Roi{o.x0, o.y0, o.x1, inner.y0}, Roi{o.x0, inner.y1, o.x1, o.y1},
                          Roi{o.x0, inner.y0, inner.x0, inner.y1}, Roi{inner.x1, inner.y0, o.x1, inner.y1}}) {
    if (part.empty()) continue;
    const ImageView extended = base::NewTile(args.scratch, Footprint(part), in.channels, args.out.type);
    graph::FillWithBorder(in, window, EngineBorder(options_.border), extended);
    RunPart(functions, args, extended, part, largest);
  }
  Finish(args, window);
}

double Window::WeightInside(const Plane& plane, const Roi& window, int x, int y) const {
  const auto at = [&](int i, int j) {
    return plane.sums.empty()
               ? plane.row_sums[static_cast<size_t>(i)] * plane.column_sums[static_cast<size_t>(j)]
               : plane.sums[static_cast<size_t>(j) * (static_cast<size_t>(width_) + 1) +
                            static_cast<size_t>(i)];
  };
  const int x0 = std::clamp(window.x0 - (x - anchor_x_), 0, width_),
            x1 = std::clamp(window.x1 - (x - anchor_x_), x0, width_);
  const int y0 = std::clamp(window.y0 - (y - anchor_y_), 0, height_),
            y1 = std::clamp(window.y1 - (y - anchor_y_), y0, height_);
  return at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0);
}

void Window::RunWhole(const WindowFunctions& functions, const ConstImageView& in, const ImageView& out,
                      const graph::Workers& workers) const {
  constexpr int kWidth = 960, kHeight = 32;
  const Roi& r = out.roi;
  if (r.empty()) return;
  std::vector<int> channels(static_cast<size_t>(out.channels));
  std::iota(channels.begin(), channels.end(), 0);
  const std::vector<std::span<const int>> in_channels = {channels};
  const int64_t columns = (r.width() + kWidth - 1) / kWidth, rows = (r.height() + kHeight - 1) / kHeight;
  std::vector<base::Arena> arenas(static_cast<size_t>(workers.count()));
  workers.For(columns * rows, [&](int64_t i, int worker) {
    base::Arena& arena = arenas[static_cast<size_t>(worker)];
    arena.Reset();
    const int x = r.x0 + static_cast<int>(i % columns) * kWidth,
              y = r.y0 + static_cast<int>(i / columns) * kHeight;
    const Roi part = Intersection(r, {x, y, x + kWidth, y + kHeight});
    ConstImageView source[] = {in};
    const Roi needed = InputRoi(part, in.roi);
    if (needed.y1 == in.roi.y1) {
      // Beyond the image's last row there is no memory that may be read.
      const ImageView copy = base::NewTile(arena, needed, in.channels);
      graph::FillWithBorder(in, in.roi, graph::Border::kBlack, copy);
      source[0] = copy;
    }
    Run(functions, {source, out.Sub(part), false, arena, channels, in_channels}, in.roi);
  });
}

void Window::Finish(const graph::TileArgs& args, const Roi& window) const {
  const Roi& o = args.out.roi;
  const int channels = args.out.channels;
  if (TreatsEdges() && !window.Contains(Footprint(o))) {
    for (int y = o.y0; y < o.y1; ++y) {
      for (int x = o.x0; x < o.x1; ++x) {
        if (window.Contains(Footprint({x, y, x + 1, y + 1}))) continue;
        float* p = FloatAt(args.out, x, y);
        for (int c = 0; c < channels; ++c) {
          const Plane& plane =
              planes_[planes_.size() == 1 ? 0 : static_cast<size_t>(args.channels[static_cast<size_t>(c)])];
          const double inside = WeightInside(plane, window, x, y);
          const double total =
              plane.sums.empty() ? plane.row_sums.back() * plane.column_sums.back() : plane.sums.back();
          if (options_.border == BorderMode::kRenormalize) {
            if (inside != 0) p[c] = static_cast<float>(p[c] * (total / inside));
          } else {
            p[c] = static_cast<float>(p[c] + (total - inside) * options_.border_value);
          }
        }
      }
    }
  }
  if (options_.bias == 0) return;
  const ConstImageView& in = args.in[0];
  const auto alpha = std::find(args.in_channels[0].begin(), args.in_channels[0].end(), options_.alpha);
  const bool with_alpha = options_.alpha >= 0 && alpha != args.in_channels[0].end();
  const auto bias = static_cast<float>(options_.bias);
  for (int y = o.y0; y < o.y1; ++y) {
    float* p = FloatAt(args.out, o.x0, y);
    for (int x = o.x0; x < o.x1; ++x, p += channels) {
      const float a = with_alpha ? FloatAt(in, x, y)[alpha - args.in_channels[0].begin()] : 1;
      for (int c = 0; c < channels; ++c) p[c] += bias * a;
    }
  }
}

}  // namespace tessera::ops
