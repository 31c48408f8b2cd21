// The rows of the lens family, and what its operations share. They are made of other operations.
#ifndef TESSERA_OPS_LENS_LENS_OPS_H_
#define TESSERA_OPS_LENS_LENS_OPS_H_

#include "ops/registry.h"
#include "tessera/ops/lens.h"
#include "tessera/roi.h"

namespace tessera::ops {

OpInfo LensInfo();
OpInfo AberrationInfo();
OpInfo VignetteInfo();
OpInfo GrainInfo();

// Where radii are counted from, in pixels, and what a radius of 1 is.
struct LensFrame {
  double x = 0, y = 0, unit = 1;
  Roi window;  // the display window, or else the data window
};
LensFrame FrameOf(const ImageSpec& image, const std::array<double, 2>& centre);
// Two channels: places in units of the radius, from the centre.
Node PlacesOf(const ImageSpec& image, const LensFrame& frame);
// One channel: the squares of radii.
Node SquaresOf(const Node& places);

// centre=x,y and its value.
ParamInfo CentreModifier();
std::array<double, 2> CentreOf(const Arguments& arguments);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_LENS_LENS_OPS_H_
