// Rectangles as a line has them.
#ifndef TESSERA_BASE_GEOMETRY_TEXT_H_
#define TESSERA_BASE_GEOMETRY_TEXT_H_

#include <string>

#include "tessera/roi.h"

namespace tessera::base {

// "64x32+10-5": the sides and the corner.
inline std::string GeometryText(const Roi& r) {
  return std::to_string(r.width()) + "x" + std::to_string(r.height()) + (r.x0 < 0 ? "" : "+") +
         std::to_string(r.x0) + (r.y0 < 0 ? "" : "+") + std::to_string(r.y0);
}

}  // namespace tessera::base

#endif  // TESSERA_BASE_GEOMETRY_TEXT_H_
