// Border rules per axis: coordinates outside the window mapped to coordinates inside.
#include "base/border.h"

#include <algorithm>
#include <cstring>
#include <vector>

namespace tessera::base {
namespace {

// The coordinate of the window that is shown at v; `black` when there is none.
int MapCoordinate(int v, int lo, int hi, Wrap wrap, bool& black) {
  black = false;
  if (v >= lo && v < hi) return v;
  const int64_t n = int64_t{hi} - lo;
  int64_t k = int64_t{v} - lo;
  switch (wrap) {
    case Wrap::kClamp:
      return v < lo ? lo : hi - 1;
    case Wrap::kRepeat:
      k = ((k % n) + n) % n;
      return static_cast<int>(lo + k);
    case Wrap::kMirror: {  // edge pixel shown twice
      const int64_t period = 2 * n;
      k = ((k % period) + period) % period;
      return static_cast<int>(lo + (k < n ? k : period - 1 - k));
    }
    case Wrap::kMirror101: {  // edge pixel shown once
      if (n == 1) return lo;
      const int64_t period = 2 * (n - 1);
      k = ((k % period) + period) % period;
      return static_cast<int>(lo + (k < n ? k : period - k));
    }
    default:
      black = true;
      return lo;
  }
}

// Range of window coordinates that [a, b) maps to.
void SourceRange(int a, int b, int lo, int hi, Wrap wrap, int& out_lo, int& out_hi) {
  if (a >= lo && b <= hi) {
    out_lo = a;
    out_hi = b;
    return;
  }
  out_lo = hi;
  out_hi = lo;
  // A span as long as two periods shows everything.
  const int64_t span = std::min<int64_t>(int64_t{b} - a, 2 * (int64_t{hi} - lo));
  const auto take = [&](int v) {
    bool black;
    const int m = MapCoordinate(v, lo, hi, wrap, black);
    if (black) return;
    out_lo = std::min(out_lo, m);
    out_hi = std::max(out_hi, m + 1);
  };
  if (wrap != Wrap::kRepeat && wrap != Wrap::kMirror && wrap != Wrap::kMirror101) {
    take(a);
    take(b - 1);
    if (a < hi && b > lo) {  // the inside part itself
      out_lo = std::min(out_lo, std::max(a, lo));
      out_hi = std::max(out_hi, std::min(b, hi));
    }
  } else {
    for (int64_t i = 0; i < span; ++i) take(static_cast<int>(a + i));
  }
}

}  // namespace

Roi BorderSource(const Roi& wanted, const Roi& window, Wrap wrap) {
  if (wanted.empty() || window.empty()) return {};
  Roi r;
  SourceRange(wanted.x0, wanted.x1, window.x0, window.x1, wrap, r.x0, r.x1);
  SourceRange(wanted.y0, wanted.y1, window.y0, window.y1, wrap, r.y0, r.y1);
  return r.empty() ? Roi{} : r;
}

void FillWithBorder(const ConstImageView& in, const Roi& window, Wrap wrap, const ImageView& out) {
  const Roi& o = out.roi;
  const auto row_of = [](const auto& view, int y) { return view.data + (y - view.roi.y0) * view.row_stride; };
  const size_t pixel = static_cast<size_t>(out.pixel_stride);
  // The part of a row that lies inside the window is copied at once; the columns beside it one by one.
  const int inside0 = std::clamp(window.x0, o.x0, o.x1), inside1 = std::clamp(window.x1, inside0, o.x1);
  const auto columns = [&](int x0, int x1, const std::byte* from, std::byte* to) {
    for (int x = x0; x < x1; ++x) {
      bool black;
      const int source = MapCoordinate(x, window.x0, window.x1, wrap, black);
      std::byte* at = to + (x - o.x0) * out.pixel_stride;
      if (black) {
        std::memset(at, 0, pixel);
      } else {
        std::memcpy(at, from + (source - in.roi.x0) * in.pixel_stride, pixel);
      }
    }
  };
  for (int y = o.y0; y < o.y1; ++y) {
    std::byte* to = row_of(out, y);
    bool black = window.empty();
    const int source_y = black ? 0 : MapCoordinate(y, window.y0, window.y1, wrap, black);
    if (black) {
      std::memset(to, 0, pixel * static_cast<size_t>(o.width()));
      continue;
    }
    const std::byte* from = row_of(in, source_y);
    columns(o.x0, inside0, from, to);
    if (inside1 > inside0) {
      std::memcpy(to + (inside0 - o.x0) * out.pixel_stride, from + (inside0 - in.roi.x0) * in.pixel_stride,
                  pixel * static_cast<size_t>(inside1 - inside0));
    }
    columns(inside1, o.x1, from, to);
  }
}

}  // namespace tessera::base
