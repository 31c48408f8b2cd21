// Border rules per axis: coordinates outside the window mapped to coordinates inside.
#include "graph/border.h"

#include <algorithm>
#include <cstring>
#include <vector>

namespace tessera::graph {
namespace {

// The coordinate of the window that is shown at v; `black` when there is none.
int MapCoordinate(int v, int lo, int hi, Border border, bool& black) {
  black = false;
  if (v >= lo && v < hi) return v;
  const int64_t n = int64_t{hi} - lo;
  int64_t k = int64_t{v} - lo;
  switch (border) {
    case Border::kBlack:
      black = true;
      return lo;
    case Border::kClamp:
      return v < lo ? lo : hi - 1;
    case Border::kRepeat:
      k = ((k % n) + n) % n;
      return static_cast<int>(lo + k);
    case Border::kMirror: {  // edge pixel shown twice
      const int64_t period = 2 * n;
      k = ((k % period) + period) % period;
      return static_cast<int>(lo + (k < n ? k : period - 1 - k));
    }
  }
  return lo;
}

// Range of window coordinates that [a, b) maps to.
void SourceRange(int a, int b, int lo, int hi, Border border, int& out_lo, int& out_hi) {
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
    const int m = MapCoordinate(v, lo, hi, border, black);
    if (black) return;
    out_lo = std::min(out_lo, m);
    out_hi = std::max(out_hi, m + 1);
  };
  if (border == Border::kBlack || border == Border::kClamp) {
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

Roi BorderSource(const Roi& wanted, const Roi& window, Border border) {
  if (wanted.empty() || window.empty()) return {};
  Roi r;
  SourceRange(wanted.x0, wanted.x1, window.x0, window.x1, border, r.x0, r.x1);
  SourceRange(wanted.y0, wanted.y1, window.y0, window.y1, border, r.y0, r.y1);
  return r.empty() ? Roi{} : r;
}

void FillWithBorder(const base::Tile& in, const Roi& window, Border border, base::Tile& out) {
  const Roi& o = out.roi();
  std::vector<int> column(static_cast<size_t>(o.width()));
  std::vector<char> black_column(column.size());
  for (int x = o.x0; x < o.x1 && !window.empty(); ++x) {
    bool black;
    const auto i = static_cast<size_t>(x - o.x0);
    column[i] = MapCoordinate(x, window.x0, window.x1, border, black) - in.roi().x0;
    black_column[i] = black;
  }
  for (int c = 0; c < out.channels(); ++c) {
    for (int y = o.y0; y < o.y1; ++y) {
      float* to = out.Row(c, y);
      bool black = window.empty();
      const int source_y = black ? 0 : MapCoordinate(y, window.y0, window.y1, border, black);
      if (black) {
        std::memset(to, 0, column.size() * sizeof(float));
        continue;
      }
      const float* from = in.Row(c, source_y);
      for (size_t i = 0; i < column.size(); ++i) to[i] = black_column[i] ? 0.0f : from[column[i]];
    }
  }
}

}  // namespace tessera::graph
