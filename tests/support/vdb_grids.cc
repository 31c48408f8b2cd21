// vdb_grids FOLDER: writes a.vdb there, grids of floats; of each its voxels as NAME.raw, x fastest, behind
// three sides (int32); and whole.vdb, a grid of whole numbers. A program of its own: OpenVDB's
// static members do not bear being in a test and in the library at once.
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

namespace {

void Dump(const openvdb::FloatGrid& grid, const std::string& file) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  const int32_t sides[3] = {box.dim().x(), box.dim().y(), box.dim().z()};
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(sides), sizeof sides);
  const auto voxels = grid.getConstAccessor();
  std::vector<float> row(static_cast<size_t>(sides[0]));
  for (int k = 0; k < sides[2]; ++k) {
    for (int j = 0; j < sides[1]; ++j) {
      for (int i = 0; i < sides[0]; ++i)
        row[static_cast<size_t>(i)] = voxels.getValue(box.min().offsetBy(i, j, k));
      stream.write(reinterpret_cast<const char*>(row.data()),
                   static_cast<std::streamsize>(row.size() * sizeof(float)));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  openvdb::initialize();
  const std::string folder = std::string(argv[1]) + "/";
  // Some 50 MB; its leaves begin before its voxels.
  const auto sphere =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(115, openvdb::Vec3f(13, -5, 2), 1, 3);
  sphere->setName("surface");
  const auto ramp = openvdb::FloatGrid::create(0.25f);
  ramp->setName("ramp");
  for (int i = 0; i < 20; ++i) ramp->getAccessor().setValue({i + 3, 2 * i, -i}, static_cast<float>(i));
  openvdb::io::File(folder + "a.vdb").write(openvdb::GridPtrVec{sphere, ramp});
  Dump(*sphere, folder + "surface.raw");
  Dump(*ramp, folder + "ramp.raw");
  const auto whole = openvdb::Int32Grid::create(0);
  whole->getAccessor().setValue({1, 2, 3}, 4);
  openvdb::io::File(folder + "whole.vdb").write(openvdb::GridPtrVec{whole});
  return 0;
}
