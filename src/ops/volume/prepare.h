// From parameters to what the kernels of volume pictures are given.
#ifndef TESSERA_OPS_VOLUME_PREPARE_H_
#define TESSERA_OPS_VOLUME_PREPARE_H_

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include "base/stage.h"
#include "model/volume_settings.h"
#include "ops/volume/march.h"

namespace tessera::ops::volume {

bool IsSurface(VolumeMode mode);
bool IsHyper(VolumeMode mode);  // distance fields through density modulation
// The axis that the view is nearest to, x before y before z.
int StackAxis(const Camera& camera, const VolumeSpec& volume);
// Checks, fills in. Throws Error.
VolumeDraw Complete(const ImageSpec& spec, const Volume& volume, const VolumeParams& params);

// The same for a volume of a scene, seen by the scene's camera.
VolumeDraw CompletePlaced(const ImageSpec& spec, const PlacedVolume& placed, const Camera& camera);

inline double Smallest(const Vector3& v) { return std::min({v[0], v[1], v[2]}); }

// What a stage holds; the arguments point into it.
struct Prepared {
  SurfaceArgs surface;
  MediumArgs medium;
  std::shared_ptr<const model::LeapGrid> leaps, own;
  std::vector<std::shared_ptr<std::byte>> opacity;
};
// Depths are counted from `middle`.
void Prepare(const VolumeDraw& draw, double middle, const graph::Workers& workers, Prepared& out);
// Fills in the opacity volumes of a medium whose other arguments are complete.
void PrepareOpacity(const VolumeDraw& draw, const graph::Workers& workers, Prepared& out);
// The planar depth of a volume's centre.
double MiddleDepth(const VolumeDraw& draw);

}  // namespace tessera::ops::volume

#endif  // TESSERA_OPS_VOLUME_PREPARE_H_
