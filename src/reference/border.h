// What lies beyond an image, coordinate by coordinate, for references of neighbourhoods.
#ifndef TESSERA_REFERENCE_BORDER_H_
#define TESSERA_REFERENCE_BORDER_H_

#include "tessera/ops/filter.h"
#include "tessera/roi.h"

namespace tessera::reference {

// Everything: borders that show far pixels may ask for any of them.
inline constexpr Roi kEverywhere{-(1 << 30), -(1 << 30), 1 << 30, 1 << 30};

inline bool ShowsFarPixels(BorderMode border) {
  return border == BorderMode::kRepeat || border == BorderMode::kMirror || border == BorderMode::kMirror101;
}

// Pixels `left`, `top`, `right`, `bottom` around a region: where it leaves the image, the clamped edge is
// among them.
inline Roi Around(const Roi& out, int left, int top, int right, int bottom, BorderMode border) {
  if (ShowsFarPixels(border)) return kEverywhere;
  return {out.x0 - left, out.y0 - top, out.x1 + right, out.y1 + bottom};
}

// The coordinate shown at v on [lo, hi); false when nothing is.
inline bool Shown(int& v, int lo, int hi, BorderMode border) {
  const int n = hi - lo;
  if (n <= 0) return false;
  while (v < lo || v >= hi) {
    switch (border) {
      case BorderMode::kClamp:
        v = v < lo ? lo : hi - 1;
        break;
      case BorderMode::kRepeat:
        v += v < lo ? n : -n;
        break;
      case BorderMode::kMirror:
        v = v < lo ? 2 * lo - 1 - v : 2 * hi - 1 - v;
        break;
      case BorderMode::kMirror101:
        if (n == 1) {
          v = lo;
        } else {
          v = v < lo ? 2 * lo - v : 2 * (hi - 1) - v;
        }
        break;
      default:
        return false;
    }
  }
  return true;
}

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_BORDER_H_
