// Distance fields of meshes through OpenVDB's converter.
#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "model/volume_makers.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/export.h"
#include "tessera/mesh.h"

namespace tessera {
namespace {

constexpr float kBand = 3;  // voxels on both sides of the surface that the converter fills in

// The adapter that OpenVDB's library holds compiled for its own float grids; points are in voxels.
using Triangles = openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I>;

openvdb::FloatGrid::Ptr Convert(const Mesh& mesh, const VolumeSpec& spec) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  points.reserve(mesh.points.size()), triangles.reserve(mesh.triangles.size());
  for (const Vector3& p : mesh.points) {
    const auto at = [&](size_t a) { return static_cast<float>((p[a] - spec.origin[a]) / spec.spacing[a]); };
    points.emplace_back(at(0), at(1), at(2));
  }
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](size_t i) { return static_cast<uint32_t>(t[i]); };
    triangles.emplace_back(corner(0), corner(1), corner(2));
  }
  openvdb::util::NullInterrupter never;
  const auto transform = openvdb::math::Transform::createLinearTransform(spec.spacing[0]);
  return openvdb::tools::meshToVolume<openvdb::FloatGrid>(never, Triangles(points, triangles), *transform,
                                                          kBand, kBand);
}

Volume FieldOfMesh(const Mesh& mesh, const VolumeSpec& spec, double range) {
  const double voxel = spec.spacing[0];
  for (double s : spec.spacing) {
    if (std::fabs(s - voxel) > 1e-9 * std::fabs(voxel)) {
      throw Error("mesh", "found a spacing of " + std::to_string(spec.spacing[0]) + "," +
                              std::to_string(spec.spacing[1]) + "," + std::to_string(spec.spacing[2]) +
                              ", expected the same along all axes");
    }
  }
  for (const auto& triangle : mesh.triangles) {
    for (int corner : triangle) {
      if (corner < 0 || static_cast<size_t>(corner) >= mesh.points.size()) {
        throw DataError(
            "mesh", "found point " + std::to_string(corner) + " of " + std::to_string(mesh.points.size()));
      }
    }
  }
  openvdb::initialize();
  const auto grid = Convert(mesh, spec);
  const auto voxel_of = [&](const Vector3& p) {
    const auto at = [&](size_t a) {
      return static_cast<int>(std::lrint((p[a] - spec.origin[a]) / spec.spacing[a]));
    };
    return openvdb::Coord(at(0), at(1), at(2));
  };
  // Voxels without a triangle near hold the band's width, with the sign of their side.
  VolumeSpec band_spec = spec;
  band_spec.type = PixelType::kFloat, band_spec.scale = 1, band_spec.bias = 0;
  const auto values = grid->getConstAccessor();
  const Volume band(band_spec,
                    [&](const Vector3& p) { return static_cast<double>(values.getValue(voxel_of(p))); });
  // Around a hole the converter leaves half a voxel of inside along the surface's rim.
  const double deepest = -band.Range()[0];
  const size_t open = deepest < 0.75 * voxel ? OpenEdges(mesh) : 0;
  if (open > 0) {
    throw DataError("mesh", "found a surface with holes (" + std::to_string(open) +
                                " edges of one triangle only), which has no inside, expected a closed one");
  }
  if (!(deepest > 0))
    throw DataError("mesh", "found nothing inside, expected a closed surface thicker than a voxel");
  const Volume far = DistanceField(band, {.iso = 0, .inside_below = true, .type = spec.type, .range = range});
  return Volume(far.spec(), [&](const Vector3& p) {
    const openvdb::Coord at = voxel_of(p);
    const double near = values.getValue(at);
    return std::fabs(near) < (kBand - 0.5) * voxel ? near : far.At(at.x(), at.y(), at.z());
  });
}

}  // namespace
}  // namespace tessera

// Asked for by name by whoever links this component (cmake/component.cmake).
extern "C" {
TESSERA_API bool tessera_component_volume =
    (tessera::model::TheVolumeMakers().from_mesh = &tessera::FieldOfMesh, true);
}
