// The picture that shear-warp defines, in double.
#ifndef TESSERA_REFERENCE_VOLUME_SHEARED_H_
#define TESSERA_REFERENCE_VOLUME_SHEARED_H_

#include <array>

#include "model/volume_settings.h"
#include "reference/volume_substance.h"

namespace tessera::reference {

// Lacroute and Levoy 1994: rays pass through the whole places of a base slice (the nearest one for
// perspective cameras, else the first), meet every slice of the volume at one place each, which is read
// bilinearly, and are composited over the way from slice to slice; a pixel is the bilinear mean of the four
// rays around the place where its own ray meets the base slice. Nothing here is resampled along rays. The
// axis that slices lie across: the one that the view is nearest to, x before y before z.
size_t AxisOfSlices(const ops::volume::VolumeDraw& draw);

class ShearedPicture {
 public:
  ShearedPicture(const ops::volume::VolumeDraw& draw, const Substance& substance);

  // R, G, B, A of the pixel whose ray this is, world coordinates, and how much of its alpha rays that end
  // early leave out.
  std::array<double, 5> Draw(const Vector3& origin, const Vector3& direction) const;

 private:
  // Of the ray through place (right, down) of the base slice. `eye`, `along`: voxels.
  std::array<double, 4> Through(double right, double down, const Vector3& eye, const Vector3& along) const;

  const VolumeParams& p_;
  const VolumeSpec& v_;
  const Substance& substance_;
  size_t deep_ = 0, right_ = 1, down_ = 2;
  int slices_ = 1;
};

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_VOLUME_SHEARED_H_
