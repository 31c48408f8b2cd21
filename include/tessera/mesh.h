/// Triangle meshes and their distance fields. @file
#ifndef TESSERA_MESH_H_
#define TESSERA_MESH_H_

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "tessera/camera.h"
#include "tessera/export.h"
#include "tessera/volume.h"

TESSERA_API_BEGIN
namespace tessera {

/// Corners of triangles, as numbers of points counted from 0. A distance field needs a closed surface; which
/// way round the corners go does not matter.
struct Mesh {
  std::vector<Vector3> points;                ///< corners
  std::vector<std::array<int, 3>> triangles;  ///< numbers of three points each
};

/// A Wavefront OBJ file: lines `v x y z` and `f a b c ...` (numbers from 1, below 0 counted from the end,
/// a/texture/normal allowed, polygons cut into fans from their first corner); all other lines are skipped.
/// Throws Error naming the file and the line.
Mesh ReadMesh(const std::string& file);
/// Moved and scaled, so that its box is centred at 0 and the box's longest side has this length.
void FitMesh(Mesh& mesh, double longest);

/// Edges that an odd number of triangles share, points at the same place taken for one: none where the
/// surface is closed, those around its holes where it is not.
size_t OpenEdges(const Mesh& mesh);

/// Signed distance to a closed mesh, negative inside, world units. Within three voxels of the surface the
/// exact distance to the nearest triangle, by OpenVDB's converter (openvdb::tools::meshToVolume), off by
/// float rounding; farther away the Euclidean transform of that band (DistanceFieldParams: off by less than
/// half a voxel). Where a surface has holes wider than a voxel nothing is inside. `range` as for solids.
/// Throws Error: nothing inside anywhere (a surface with holes is named so), spacing not the same along all
/// axes, corners that are no points, a program without the component tessera::volume. Cost: triangles, plus
/// O(voxels).
Volume DistanceField(const Mesh& mesh, const VolumeSpec& spec, double range = 0);
/// Whether the program has the component tessera::volume, which is built where OpenVDB is installed.
bool HasMeshConverter();

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_MESH_H_
