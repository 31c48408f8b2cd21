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

// Whether it is a picture through a lens, which need not show all directions.
constexpr bool IsLens(EnvironmentMap map) { return map >= EnvironmentMap::kPerspective; }

// A map of width x height texels as faces of equal size.
struct MapLayout {
  EnvironmentMap map = EnvironmentMap::kLatLong;
  double focal = 0;            // of a lens: texels per unit of its projection's plane
  bool whole_turn = false;     // a cylinder whose ends meet
  int width = 0, height = 0;   // of a face, in texels
  std::vector<MapFace> faces;  // one; front and back; +x -x +y -y +z -z
  int picture_width = 0, picture_height = 0;
};

// Throws Error(subject, ...) for a shape that no cube has. An empty picture has no faces. Degrees across, of
// a lens; 0: the projection's own.
MapLayout LayoutOf(const std::string& subject, EnvironmentMap map, int width, int height,
                   double field_of_view = 0);
// Throws Error(subject, ...) for an angle that the projection has no picture of; `name` is the argument's.
void RequireFieldOfView(const std::string& subject, const char* name, EnvironmentMap map,
                        double field_of_view);

// A place on a face, in texels from its upper left corner.
struct Place {
  int face = 0;
  double u = 0, v = 0;
};
// False for what is behind a single parabolic map, and beyond a lens's reach. The direction has any length
// but 0. What a lens has beyond its picture's edges lies there.
bool PlaceOnFace(const MapLayout& layout, const Vector3& direction, Place* place);
// Whether a place of a lens is on its picture, or a hair beyond its edge, where roundings may put what is on
// it.
inline bool IsInside(const MapLayout& l, const Place& p) {
  constexpr double kHair = 1e-9;
  return p.u >= -kHair * l.width && p.u <= l.width * (1 + kHair) && p.v >= -kHair * l.height &&
         p.v <= l.height * (1 + kHair);
}
// The direction (not of unit length) at a place, which may lie outside of the face; for a sphere map outside
// of its disc the rim's; 0 where a lens has none.
Vector3 DirectionAt(const MapLayout& layout, const Place& place);
// The texel (column, row) of a face in the picture.
inline void PictureTexel(const MapLayout& l, int face, int i, int j, int* x, int* y) {
  const MapFace& f = l.faces[static_cast<size_t>(face)];
  *x = f.x + (f.turned ? l.width - 1 - i : i);
  *y = f.y + (f.turned ? l.height - 1 - j : j);
}
// Solid angle of a texel of a face in steradian: exact for lat-long, sphere and cube maps (0 outside of a
// disc, but for its edge), of others the density at the texel's centre; 0 where a lens has no direction.
double TexelSolidAngle(const MapLayout& layout, int i, int j);

const char* MapName(EnvironmentMap map);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_PROJECTION_H_
