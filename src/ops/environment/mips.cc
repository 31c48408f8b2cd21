// Chains of cube maps from environment maps.
#include "ops/environment/mips.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tessera/image.h"

namespace tessera::ops {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMostSamples = 16;

// As many as the whole sphere would have.
double TexelsOf(const MapLayout& l) {
  const double face = double{1} * l.width * l.height;
  switch (l.map) {
    case EnvironmentMap::kCube:
      return 6 * face;
    case EnvironmentMap::kSphere:
      return face * kPi / 4;
    case EnvironmentMap::kParabolic:
    case EnvironmentMap::kDualParabolic:
      return 2 * face * kPi / 4;
    case EnvironmentMap::kLatLong:
    case EnvironmentMap::kOctahedral:
      return face;
    default:
      break;
  }
  return 4 * kPi * l.focal * l.focal;  // of a lens: of the size of the texel in its middle
}

// One texel of a cube: the mean of samples x samples lookups in the map.
void AverageMap(const EnvironmentAtlas& map, const MapLayout& cube, int face, int i, int j, int samples,
                float* rgba) {
  const auto lookup = ChooseEnvironmentKernels().lookup;
  Directions run;
  alignas(64) float texels[4 * kDirectionRun];
  double sum[4] = {};
  const int count = samples * samples;
  for (int first = 0; first < count; first += kDirectionRun) {
    const int held = std::min(kDirectionRun, count - first);
    for (int k = 0; k < kDirectionRun; ++k) {
      const int at = std::min(first + k, count - 1);
      const Vector3 d =
          DirectionAt(cube, {face, i + (at % samples + 0.5) / samples, j + (at / samples + 0.5) / samples});
      run.x[k] = d[0], run.y[k] = d[1], run.z[k] = d[2];
    }
    lookup(map, run, held, texels);
    for (int k = 0; k < 4 * held; ++k) sum[k % 4] += texels[k];
  }
  for (int c = 0; c < 4; ++c) rgba[c] = static_cast<float>(sum[c] / count);
}
// The mean of the four texels of a cube of twice the edge.
void AverageFour(const EnvironmentAtlas& finer, int face, int i, int j, float* rgba) {
  double sum[4] = {}, weight = 0;
  for (int k = 0; k < 4; ++k) {
    const int x = 2 * i + k % 2, y = 2 * j + k / 2;
    const double w = TexelSolidAngle(finer.layout(), x, y);
    for (int c = 0; c < 4; ++c) sum[c] += w * finer.At(face, x, y)[c];
    weight += w;
  }
  for (int c = 0; c < 4; ++c) rgba[c] = static_cast<float>(sum[c] / weight);
}

}  // namespace

EnvironmentMips::EnvironmentMips(const EnvironmentAtlas& map, const graph::Workers& workers)
    : finite_(map.finite()) {
  const double texels = TexelsOf(map.layout()), angle = std::sqrt(4 * kPi / texels);
  int n = 1;
  while (2 * n * std::numbers::sqrt2 <= std::sqrt(texels / 6)) n *= 2;
  const int samples = std::clamp(static_cast<int>(std::ceil(2 / (n * angle))), 1, kMostSamples);
  map_angle_ = std::log2(angle);
  first_angle_ = std::log2(std::sqrt(4 * kPi / 6) / n);
  for (; n >= 1; n /= 2) {
    const MapLayout layout = LayoutOf("envmap", EnvironmentMap::kCube, 6 * n, n);
    const Image picture = Image::Uninitialized(ImageSpec(6 * n, n, 4), workers.context());
    workers.For(int64_t{6} * n, [&](int64_t line, int) {
      const int face = static_cast<int>(line / n), j = static_cast<int>(line % n);
      for (int i = 0; i < n; ++i) {
        auto* const rgba = reinterpret_cast<float*>(picture.view().At(face * n + i, j));
        if (cubes_.empty()) {
          AverageMap(map, layout, face, i, j, samples, rgba);
        } else {
          AverageFour(*cubes_.back(), face, i, j, rgba);
        }
      }
    });
    cubes_.push_back(std::make_unique<const EnvironmentAtlas>(picture.view(), 0, layout, workers));
  }
}

}  // namespace tessera::ops
