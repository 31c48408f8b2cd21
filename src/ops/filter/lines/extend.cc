// Loops of line filters over whole images.
#include "ops/filter/lines/extend.h"

#include <algorithm>
#include <cstring>
#include <memory>

#include "base/arena.h"

namespace tessera::ops {
namespace {

const float* FloatRow(const ConstImageView& v, int y) {
  return reinterpret_cast<const float*>(v.data + (y - v.roi.y0) * v.row_stride);
}
float* FloatRow(const ImageView& v, int y) {
  return reinterpret_cast<float*>(v.data + (y - v.roi.y0) * v.row_stride);
}

// A worker's memory: results of the first direction, and packed tracks with their results.
struct Scratch {
  std::shared_ptr<std::byte> forward, packed;
  void Prepare(int length, Context& context) {
    const size_t bytes = static_cast<size_t>(length) * kTrackCount * sizeof(float);
    if (forward) return;
    forward = base::AllocateAligned(context, bytes);
    packed = base::AllocateAligned(context, bytes);
  }
};

// Tracks that do not lie side by side in memory: gathered, filtered in place, scattered. `in(t)` and `out(t)`
// give the first sample of track t, or null where there is none.
template <class In, class Out>
void Packed(Scratch& scratch, int length, ptrdiff_t in_step, ptrdiff_t out_step, In in, Out out, int axis,
            const LineFilter& filter, const float* scale) {
  float* packed = reinterpret_cast<float*>(scratch.packed.get());
  for (int t = 0; t < kTrackCount; ++t) {
    const float* p = in(t);
    for (int n = 0; n < length; ++n) packed[n * kTrackCount + t] = p != nullptr ? p[n * in_step] : 0.0f;
  }
  filter(axis, {packed, packed, kTrackCount, kTrackCount, length}, false, scale,
         reinterpret_cast<float*>(scratch.forward.get()));
  for (int t = 0; t < kTrackCount; ++t) {
    float* p = out(t);
    for (int n = 0; n < length && p != nullptr; ++n) p[n * out_step] = packed[n * kTrackCount + t];
  }
}

}  // namespace

AxisBorder::AxisBorder(Wrap wrap, double border_value, int line_length) : mode_(wrap), length_(line_length) {
  switch (wrap) {
    case Wrap::kRepeat:
    case Wrap::kMirror:
    case Wrap::kMirror101:
      rule = kMapped;
      break;
    case Wrap::kBlack:
    case Wrap::kRenormalize:
      rule = kValue;
      value = wrap == Wrap::kBlack ? static_cast<float>(border_value) : 0;
      break;
    default:
      rule = kEdge;
  }
}

int AxisBorder::Shown(int n) const {
  if (n >= 0 && n < length_) return n;
  if (rule == kValue) return -1;
  if (rule == kEdge) return std::clamp(n, 0, length_ - 1);
  const int period = mode_ == Wrap::kRepeat   ? length_
                     : mode_ == Wrap::kMirror ? 2 * length_
                                              : std::max(1, 2 * (length_ - 1));
  int k = n % period;
  if (k < 0) k += period;
  if (k < length_) return k;
  return mode_ == Wrap::kMirror ? period - 1 - k : period - k;
}

void FilterLines(bool rows, bool columns, const ConstImageView& in, const ImageView& out,
                 const graph::Workers& workers, const LineFilter& filter,
                 const std::function<std::vector<float>(int axis, int length)>& scale_of) {
  const Roi& r = out.roi;
  if (r.empty()) return;
  const int channels = out.channels, width = r.width(), height = r.height();
  std::vector<Scratch> scratch(static_cast<size_t>(workers.count()));
  if (rows) {
    const std::vector<float> scales = scale_of(0, width);
    const float* scale = scales.empty() ? nullptr : scales.data();
    constexpr int kRgbaRows = kTrackCount / 4;
    // Tracks of a channel and a row each; RGBA rows are taken as they lie, eight at a time.
    const int64_t whole = channels == 4 ? height / kRgbaRows : 0;
    const int64_t left = (int64_t{height} - whole * kRgbaRows) * channels;
    const int64_t packed = (left + kTrackCount - 1) / kTrackCount;
    workers.For(whole + packed, [&](int64_t i, int worker) {
      Scratch& s = scratch[static_cast<size_t>(worker)];
      s.Prepare(std::max(width, height), workers.context());
      if (i < whole) {
        const int y = r.y0 + static_cast<int>(i) * kRgbaRows;
        filter(0, {FloatRow(in, y), FloatRow(out, y), in.row_stride / 4, out.row_stride / 4, width}, true,
               scale, reinterpret_cast<float*>(s.forward.get()));
        return;
      }
      const int64_t first = (i - whole) * kTrackCount;
      const auto place = [&](const auto& view, int t) {
        const int64_t track = first + t;
        const int y = r.y0 + static_cast<int>(whole) * kRgbaRows + static_cast<int>(track / channels);
        return track < left ? FloatRow(view, y) + track % channels : nullptr;
      };
      Packed(
          s, width, channels, channels, [&](int t) { return place(in, t); },
          [&](int t) { return place(out, t); }, 0, filter, scale);
    });
  }
  if (!columns) return;
  const ConstImageView from = rows ? ConstImageView(out) : in;
  const std::vector<float> scales = scale_of(1, height);
  const float* scale = scales.empty() ? nullptr : scales.data();
  const int floats = width * channels, strips = (floats + kTrackCount - 1) / kTrackCount;
  workers.For(strips, [&](int64_t i, int worker) {
    Scratch& s = scratch[static_cast<size_t>(worker)];
    s.Prepare(std::max(width, height), workers.context());
    const int x = static_cast<int>(i) * kTrackCount, count = std::min(kTrackCount, floats - x);
    if (count == kTrackCount) {
      filter(1,
             {FloatRow(from, r.y0) + x, FloatRow(out, r.y0) + x, from.row_stride / 4, out.row_stride / 4,
              height},
             false, scale, reinterpret_cast<float*>(s.forward.get()));
      return;
    }
    Packed(
        s, height, from.row_stride / 4, out.row_stride / 4,
        [&](int t) { return t < count ? FloatRow(from, r.y0) + x + t : nullptr; },
        [&](int t) { return t < count ? FloatRow(out, r.y0) + x + t : nullptr; }, 1, filter, scale);
  });
}

}  // namespace tessera::ops
