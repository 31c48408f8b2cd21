// Which windows and sizes a geometry of --resize leads to: shared with --resample.
#ifndef TESSERA_OPS_GEOMETRY_RESIZE_WINDOW_H_
#define TESSERA_OPS_GEOMETRY_RESIZE_WINDOW_H_

#include <string>

#include "tessera/ops/geometry.h"

namespace tessera::ops {

// Of one axis.
struct WindowSide {
  int begin, size;
};

// A display window of a stated corner and size. Throws Error about `what` where sides are not 1 to 2^24.
struct DisplaySize {
  int x, y, width, height;
};
Roi ResizedDisplay(const char* what, const DisplaySize& size);
// The data window when `full` becomes `display`, as oiiotool in float: the origin is rounded down, the size
// up.
Roi ScaledWindow(const char* what, const Roi& data, const Roi& full, const Roi& display);
// WxH with 0 for "keep the aspect", percentages, and an origin: as oiiotool's --resize.
ResizeParams ParseResize(const std::string& text, const Roi& from);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_RESIZE_WINDOW_H_
