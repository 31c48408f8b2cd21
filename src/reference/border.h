// What lies beyond an image, coordinate by coordinate, for references of neighbourhoods.
#ifndef TESSERA_REFERENCE_BORDER_H_
#define TESSERA_REFERENCE_BORDER_H_

#include <cstdint>

#include "tessera/roi.h"
#include "tessera/wrap.h"

namespace tessera::reference {

// Everything: borders that show far pixels may ask for any of them.
inline constexpr Roi kEverywhere{-(1 << 30), -(1 << 30), 1 << 30, 1 << 30};

inline bool ShowsFarPixels(Wrap wrap) {
  return wrap == Wrap::kRepeat || wrap == Wrap::kMirror || wrap == Wrap::kMirror101;
}

// Pixels `left`, `top`, `right`, `bottom` around a region: where it leaves the image, the clamped edge is
// among them.
inline Roi Around(const Roi& out, int left, int top, int right, int bottom, Wrap wrap) {
  if (ShowsFarPixels(wrap)) return kEverywhere;
  return {out.x0 - left, out.y0 - top, out.x1 + right, out.y1 + bottom};
}

// The coordinate shown at v on [lo, hi); false when nothing is.
template <class Integer>
bool Shown(Integer& v, Integer lo, Integer hi, Wrap wrap) {
  const int64_t n = int64_t{hi} - lo, k = int64_t{v} - lo;
  if (n <= 0) return false;
  if (k >= 0 && k < n) return true;
  const auto phase = [k](int64_t period) { return (k % period + period) % period; };
  int64_t at = 0;
  switch (wrap) {
    case Wrap::kClamp:
      at = k < 0 ? 0 : n - 1;
      break;
    case Wrap::kRepeat:
      at = phase(n);
      break;
    case Wrap::kMirror:
      at = phase(2 * n) < n ? phase(2 * n) : 2 * n - 1 - phase(2 * n);
      break;
    case Wrap::kMirror101:
      if (n > 1) at = phase(2 * n - 2) < n ? phase(2 * n - 2) : 2 * n - 2 - phase(2 * n - 2);
      break;
    default:
      return false;
  }
  v = static_cast<Integer>(lo + at);
  return true;
}

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_BORDER_H_
