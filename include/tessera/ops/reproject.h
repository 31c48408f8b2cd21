/// Pictures with depth as other cameras see them. @file
#ifndef TESSERA_OPS_REPROJECT_H_
#define TESSERA_OPS_REPROJECT_H_

#include "tessera/camera.h"
#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// The camera moved by so many world units along its own axes, seeing in the same direction.
Camera Moved(const Camera& camera, const Vector3& right_up_forward);

/// A picture with depth as another camera sees it. Every pixel is a quadrilateral in space, whose corners are
/// means of 1/depth (of a parallel camera: of depth) over the pixels that hang together there; two that are
/// side by side do if their depths differ by no more than `tear` of the nearer one. A result pixel is the
/// mean over a grid of places; at each the nearest quadrilateral is seen that faces both cameras, coloured
/// linearly between pixels of its surface. Places that see none are 0. Depths that are NaN, infinite or, of a
/// perspective camera, not positive have no quadrilateral, nor have those that reach behind the new eye.
struct ReprojectParams {
  Camera from;        ///< the picture's, across its display window
  Camera to;          ///< the result's, across its display window
  int width = 0;      ///< of the result, pixels; 0 for both: the picture's display window
  int height = 0;     ///< of the result, pixels
  double tear = 0.1;  ///< part of the nearer depth; neighbours farther apart are not joined
  int samples = 2;    ///< places along a pixel's side, 1 to 8
};
/// `depth`: planar, from params.from, in the first channel; of color's data window. The result has color's
/// channels and, where there is no alpha, the coverage as one ("A"), and params.to in its metadata.
/// |error| <= 2 u times the largest value interpolated. Cost: some 0.4 us per pixel of the picture and
/// thread, and 0.1 us per place.
Node Reproject(const Node& color, const Node& depth, const ReprojectParams& params);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_REPROJECT_H_
