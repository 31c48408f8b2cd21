// Wavefront OBJ files: read, fitted, turned into distances.
#include <cmath>

#include "fuzz/fuzz.h"
#include "tessera/mesh.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  return {
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
      "# a\no b\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nvn 0 0 1\n"
      "f 1 2 3 4\nf 8/1/1 7/1/1 6/1/1 5/1/1\nf 1//1 5//1 6//1 2//1\nf -6 -2 -1 -5\nf 3 7 8 4\nf 5 8 4 1\n"};
}
std::vector<std::string> Words() {
  return {"v ",
          "f ",
          "vt ",
          "vn ",
          "\n",
          "/",
          "//",
          "-1",
          "1e308",
          "-1e308",
          "1e-320",
          "nan",
          "inf",
          "2147483648",
          "\r\n",
          "#",
          "-9223372036854775808"};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static fuzz::File file("mesh.obj");
  const std::string& name = file.Put({reinterpret_cast<const char*>(data), size});
  fuzz::Try([&] {
    Mesh mesh = ReadMesh(name);
    OpenEdges(mesh);
    FitMesh(mesh, 1.5);
    for (const Vector3& p : mesh.points) {
      for (const double c : p)
        fuzz::Require(std::fabs(c) < 0.751, "a fitted mesh that is larger than asked for");
    }
    if (!HasMeshConverter()) return;
    const Volume field = DistanceField(mesh, VolumeSpec::Centred({6, 6, 6}));
    for (int i = 0; i < 6; ++i)
      fuzz::Require(std::isfinite(field.At(i, i, 5 - i)), "a distance that is none");
  });
  return 0;
}
