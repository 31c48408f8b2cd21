// Environment maps made of formulas, and what is seen of them in given directions.
#ifndef TESSERA_TESTS_SUPPORT_ENVIRONMENTS_H_
#define TESSERA_TESTS_SUPPORT_ENVIRONMENTS_H_

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "tessera/ops/environment.h"
#include "tessera/render.h"

namespace tessera::test {

using Map = EnvironmentMap;
inline constexpr Map kMaps[] = {Map::kSphere,  Map::kParabolic, Map::kDualParabolic,
                                Map::kLatLong, Map::kCube,      Map::kOctahedral};

inline Image Vectors(const std::vector<Vector3>& v) {
  const Image image(ImageSpec(static_cast<int>(v.size()), 1, 3));
  for (size_t i = 0; i < v.size(); ++i) {
    for (int c = 0; c < 3; ++c)
      image.at<float>(static_cast<int>(i), 0, c) = static_cast<float>(v[i][static_cast<size_t>(c)]);
  }
  return image;
}
inline std::vector<Vector3> RandomDirections(int count, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Vector3> v;
  for (int i = 0; i < count; ++i) v.push_back({normal(random), normal(random), normal(random)});
  return v;
}
// A map whose texel at a direction is f(direction).
inline Image MapOf(Map map, int width, int height, int channels,
                   const std::function<double(const Vector3&, int)>& f) {
  const Image image(ImageSpec(width, height, channels));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Vector3 d;
      if (!DirectionOf(map, width, height, x + 0.5, y + 0.5, &d)) continue;
      for (int c = 0; c < channels; ++c) image.at<float>(x, y, c) = static_cast<float>(f(d, c));
    }
  }
  return image;
}
inline Image NoiseMap(int width, int height, uint32_t seed) {
  const Image image(ImageSpec(width, height, 1));
  std::mt19937 random(seed);
  for (int64_t i = 0; i < int64_t{width} * height; ++i) {
    reinterpret_cast<float*>(image.view().data)[i] = static_cast<float>(random() >> 8) * 0x1p-24f;
  }
  return image;
}
inline EnvironmentParams Along(Map map, double lobe = 0) {
  EnvironmentParams p;
  p.map = map;
  p.direction = EnvironmentDirection::kNormal;
  p.lobe = lobe;
  return p;
}
// What a map shows in the directions, channel 0.
inline std::vector<float> Seen(const Image& map, const std::vector<Vector3>& directions,
                               const EnvironmentParams& p) {
  const Image got = Render(Environment(FromImage(Vectors(directions)), FromImage(map), p));
  std::vector<float> values;
  for (size_t i = 0; i < directions.size(); ++i) values.push_back(got.at<float>(static_cast<int>(i), 0));
  return values;
}
inline void SizeOf(Map map, int n, int* w, int* h) {
  *w = map == Map::kDualParabolic || map == Map::kLatLong ? 2 * n : map == Map::kCube ? 6 * n : n;
  *h = n;
}

}  // namespace tessera::test

#endif  // TESSERA_TESTS_SUPPORT_ENVIRONMENTS_H_
