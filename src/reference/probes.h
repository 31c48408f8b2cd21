// What a pixel covers of the space that its coordinates are in, and the look-ups whose mean that is, by their
// definition (doc/maths/lookup.md, "Footprints").
#ifndef TESSERA_REFERENCE_PROBES_H_
#define TESSERA_REFERENCE_PROBES_H_

#include <optional>
#include <vector>

#include "tessera/camera.h"

namespace tessera::reference {

// The steps to the pixels on both sides, in the same direction; of what is no number nothing comes.
Vector3 MeanStep(std::optional<Vector3> before, std::optional<Vector3> after);

struct Ellipse {
  Vector3 major, minor;  // half axes
  double longer = 0, shorter = 0;
};
Ellipse EllipseOf(const Vector3& across, const Vector3& down);

struct Probe {
  Vector3 off;
  double weight;  // 1 together
};
struct Probes {
  std::vector<Probe> all;
  double width = 0;       // of each
  bool doubtful = false;  // one more or one fewer along the longer axis, for all that rounding knows
};
// `more`: so many more along the longer axis than there are.
Probes ProbesOver(const Ellipse& ellipse, bool ewa, double anisotropy, double texel, double widest,
                  int more = 0);

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_PROBES_H_
