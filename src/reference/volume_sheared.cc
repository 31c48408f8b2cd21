// The picture that shear-warp defines: rays of the base slice's lattice, and their bilinear mean.
#include "reference/volume_sheared.h"

#include <algorithm>
#include <cmath>

namespace tessera::reference {

size_t AxisOfSlices(const ops::volume::VolumeDraw& draw) {
  const Vector3 forward = draw.params.camera.forward(), spacing = draw.volume.spec().spacing;
  size_t axis = 0;
  double most = -1;
  for (size_t a = 0; a < 3; ++a) {
    const double along = std::fabs(forward[a]) / spacing[a];
    if (along > most * (1 + 1e-9)) most = along, axis = a;
  }
  return axis;
}

ShearedPicture::ShearedPicture(const ops::volume::VolumeDraw& draw, const Substance& substance)
    : p_(draw.params), v_(draw.volume.spec()), substance_(substance), deep_(AxisOfSlices(draw)) {
  right_ = deep_ == 0 ? 1 : 0;
  down_ = deep_ == 2 ? 1 : 2;
  slices_ = v_.size[deep_];
}

std::array<double, 5> ShearedPicture::Draw(const Vector3& origin, const Vector3& direction) const {
  Vector3 eye, along;
  for (size_t a = 0; a < 3; ++a) {
    eye[a] = substance_.Voxels(origin[a], a);
    along[a] = direction[a] / v_.spacing[a];
  }
  const double base = p_.camera.perspective() && along[deep_] < 0 ? slices_ - 1 : 0;
  const double t = (base - eye[deep_]) / along[deep_];
  const double u = eye[right_] + t * along[right_], v = eye[down_] + t * along[down_];
  const double i = std::floor(u), j = std::floor(v), fu = u - i, fv = v - j;
  std::array<double, 5> sum = {0, 0, 0, 0, 0};
  for (int corner = 0; corner < 4; ++corner) {
    const int a = corner & 1, b = corner >> 1;
    const double weight = (a ? fu : 1 - fu) * (b ? fv : 1 - fv);
    const std::array<double, 4> ray = Through(i + a, j + b, eye, along);
    for (size_t c = 0; c < 4; ++c) sum[c] += weight * ray[c];
    if (p_.termination > 0)
      sum[4] += weight * std::clamp(ray[3] - (1 - p_.termination) + 1e-5, 0.0, p_.termination);
  }
  return sum;
}

std::array<double, 4> ShearedPicture::Through(double right, double down, const Vector3& eye,
                                              const Vector3& pixel) const {
  const bool perspective = p_.camera.perspective(), backward = pixel[deep_] < 0;
  const double base = perspective && backward ? slices_ - 1 : 0;
  // The ray's way from slice to slice.
  Vector3 along = pixel;
  if (perspective) {
    along[deep_] = base - eye[deep_], along[right_] = right - eye[right_], along[down_] = down - eye[down_];
  }
  const double size = std::fabs(along[deep_]);
  Vector3 world;
  for (size_t a = 0; a < 3; ++a) along[a] /= size, world[a] = along[a] * v_.spacing[a];
  const double length = Length(world), sign = backward ? -1 : 1;
  std::array<double, 4> sum = {0, 0, 0, 0};
  for (int n = 0; n < slices_; ++n) {
    const int k = backward ? slices_ - 1 - n : n;
    const double way = (k - base) * sign;
    Vector3 p;
    p[deep_] = k, p[right_] = right + way * along[right_], p[down_] = down + way * along[down_];
    // Half a voxel beyond the outermost centres belongs to the volume.
    if (p[right_] < -0.5 || p[right_] > v_.size[right_] - 0.5) continue;
    if (p[down_] < -0.5 || p[down_] > v_.size[down_] - 0.5) continue;
    const Substance::Class c = substance_.Classify(substance_.FieldAtVoxels(p));
    const double weight = (1 - sum[3]) * -std::expm1(-c.extinction * length);
    for (size_t q = 0; q < 3; ++q) sum[q] += weight * c.color[q];
    sum[3] += weight;
  }
  return sum;
}

}  // namespace tessera::reference
