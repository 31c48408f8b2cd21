// Where directions lie on environment maps: faces, texels, the way there and back, in double.
#ifndef TESSERA_OPS_ENVIRONMENT_PROJECTION_H_
#define TESSERA_OPS_ENVIRONMENT_PROJECTION_H_

#include <string>
#include <vector>

#include "tessera/ops/environment.h"

namespace tessera::ops {

// One face of a map: where its upper left texel lies in the picture, and whether it is turned by half.
struct MapFace {
  int x = 0, y = 0;
  bool turned = false;
};

// A map of width x height texels as faces of equal size.
struct MapLayout {
  EnvironmentMap map = EnvironmentMap::kLatLong;
  int width = 0, height = 0;   // of a face, in texels
  std::vector<MapFace> faces;  // one; front and back; +x -x +y -y +z -z
  int picture_width = 0, picture_height = 0;
};

// Throws Error(subject, ...) for a shape that no cube has. An empty picture has no faces.
MapLayout LayoutOf(const std::string& subject, EnvironmentMap map, int width, int height);

// A place on a face, in texels from its upper left corner.
struct Place {
  int face = 0;
  double u = 0, v = 0;
};
// False for what is behind a single parabolic map. The direction has any length but 0.
bool PlaceOnFace(const MapLayout& layout, const Vector3& direction, Place* place);
// The direction (not of unit length) at a place, which may lie outside of the face; for a sphere map outside
// of its disc the rim's.
Vector3 DirectionAt(const MapLayout& layout, const Place& place);
// The texel (column, row) of a face in the picture.
inline void PictureTexel(const MapLayout& l, int face, int i, int j, int* x, int* y) {
  const MapFace& f = l.faces[static_cast<size_t>(face)];
  *x = f.x + (f.turned ? l.width - 1 - i : i);
  *y = f.y + (f.turned ? l.height - 1 - j : j);
}
// Solid angle of a texel of a face in steradian, exact for parabolic, sphere (0 outside the disc), lat-long
// and cube maps but for the disc's edge.
double TexelSolidAngle(const MapLayout& layout, int i, int j);

const char* MapName(EnvironmentMap map);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_PROJECTION_H_
