// An outside program: renders something through the installed library and checks the pixels; a component that
// registers itself must be there though nothing in the program asks for it by name.
#include <tessera/tessera.h>

#include <cmath>
#include <cstdio>

namespace {

// A cube of side 1 from tessera::volume; true without that component.
bool MeshesHaveDistances() {
  if (!tessera::HasMeshConverter()) return !TESSERA_HAS_VOLUME;
  tessera::Mesh cube;
  for (int i = 0; i < 8; ++i) cube.points.push_back({(i & 1) - 0.5, (i >> 1 & 1) - 0.5, (i >> 2 & 1) - 0.5});
  cube.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const tessera::Volume field = tessera::DistanceField(cube, tessera::VolumeSpec::Centred({21, 21, 21}));
  return std::abs(field.At(10, 10, 10) + 0.5) < 0.1;
}

}  // namespace

int main() {
  try {
    if (!MeshesHaveDistances()) {
      std::printf("no distance field of a cube\n");
      return 1;
    }
    const tessera::Node ramp = tessera::Ramp(tessera::ImageSpec(64, 48, 3));
    const tessera::Node scaled = tessera::AddConstant(tessera::MulConstant(ramp, {2.0}), {0.25});
    const tessera::Image image = tessera::Render(tessera::Saturate(scaled, 0.0));
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const double r = 2 * (x + 0.5) / 64 + 0.25, g = 2 * (y + 0.5) / 48 + 0.25, b = 0.25;
        const double luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        for (int c = 0; c < 3; ++c) {
          const float found = image.at<float>(x, y, c);
          if (!(std::abs(found - luminance) < 1e-5)) {
            std::printf("pixel %d,%d channel %d: found %g, expected %g\n", x, y, c, found, luminance);
            return 1;
          }
        }
      }
    }
    const tessera::VerifyReport report = tessera::Verify(scaled);
    if (!report.within_bound) std::printf("verify: %s\n", report.Summary().c_str());
    return report.within_bound ? 0 : 1;
  } catch (const tessera::Error& error) {
    std::printf("%s\n", error.what());
    return 1;
  }
}
