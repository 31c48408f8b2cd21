/// A half-open rectangle of pixels, nothing else. @file
#ifndef TESSERA_ROI_H_
#define TESSERA_ROI_H_

#include <algorithm>
#include <cstdint>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera {

/// Pixels (x, y) with x0 <= x < x1 and y0 <= y < y1; x right, y down. Empty when either side is <= 0.
struct Roi {
  int x0 = 0;  ///< first column
  int y0 = 0;  ///< first row
  int x1 = 0;  ///< column behind the last
  int y1 = 0;  ///< row behind the last

  /// Columns; 0 when empty.
  constexpr int width() const { return x1 > x0 ? x1 - x0 : 0; }
  /// Rows; 0 when empty.
  constexpr int height() const { return y1 > y0 ? y1 - y0 : 0; }
  /// Columns times rows.
  constexpr int64_t pixels() const { return int64_t{width()} * height(); }
  /// Whether there is no pixel.
  constexpr bool empty() const { return x1 <= x0 || y1 <= y0; }
  /// Whether all of r is inside; an empty r always is.
  constexpr bool Contains(const Roi& r) const {
    return r.empty() || (r.x0 >= x0 && r.y0 >= y0 && r.x1 <= x1 && r.y1 <= y1);
  }
  /// The same four numbers.
  friend constexpr bool operator==(const Roi&, const Roi&) = default;
};

/// What both have; empty rectangles are {0, 0, 0, 0}.
constexpr Roi Intersection(const Roi& a, const Roi& b) {
  Roi r{std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
  return r.empty() ? Roi{} : r;
}

/// The smallest rectangle holding both; an empty rectangle adds nothing.
constexpr Roi Union(const Roi& a, const Roi& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

/// Grown by dx to the left and right, by dy above and below.
constexpr Roi Inflate(const Roi& r, int dx, int dy) { return {r.x0 - dx, r.y0 - dy, r.x1 + dx, r.y1 + dy}; }

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_ROI_H_
