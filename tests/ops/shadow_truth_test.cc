// Shadows of curved bodies with the bias worked out from the map, against rays cast to the light: sphere,
// torus, terrain.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "support/noise_values.h"
#include "tessera/ops/shade.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Values;

Vector3 Along(const Vector3& from, const Vector3& direction, double t) {
  return {from[0] + t * direction[0], from[1] + t * direction[1], from[2] + t * direction[2]};
}

// Bodies as distances that are never too long, negative inside.
using Body = std::function<double(const Vector3&)>;
struct Scene {
  std::string name;
  std::vector<Body> bodies;
  Vector3 to_light;
  double distance(const Vector3& p) const {
    double least = bodies[0](p);
    for (const Body& body : bodies) least = std::min(least, body(p));
    return least;
  }
};

constexpr double kFar = 40;

// Where a ray first meets the body, from `t` on; kFar: nowhere.
double Cast(const Scene& scene, const Vector3& from, const Vector3& direction, double t) {
  for (int k = 0; k < 4000 && t < kFar; ++k) {
    const double d = scene.distance(Along(from, direction, t));
    if (d < 1e-9) return t;
    t += std::max(d, 1e-7);
  }
  return kFar;
}
bool Lit(const Scene& scene, const Vector3& at) { return Cast(scene, at, scene.to_light, 1e-5) == kFar; }

// The light's picture of the scene: parallel, `kSize` texels over kExtent units.
constexpr int kSize = 256;
constexpr double kExtent = 6, kDeep = 20, kTexel = kExtent / kSize;
struct Light {
  Vector3 right, up, back;  // back: towards the light
  explicit Light(const Vector3& to_light) {
    back = to_light;
    const Vector3 world_up = {0, 1, 0};
    right = Normalized(Cross(world_up, back));
    up = Cross(back, right);
  }
  Vector3 Place(double x, double y, double depth) const {  // in units; depth from the light's plane
    Vector3 p;
    for (size_t k = 0; k < 3; ++k) p[k] = right[k] * x + up[k] * y + back[k] * (kDeep / 2 - depth);
    return p;
  }
  Matrix4 Matrix() const {
    Matrix4 m = kIdentity4;
    for (size_t k = 0; k < 3; ++k) {
      m[k] = right[k] * 2 / kExtent, m[4 + k] = up[k] * 2 / kExtent;
      m[8 + k] = -back[k] * 2 / kDeep;
    }
    return m;
  }
};

Node MapOf(const Scene& scene, const Light& light) {
  const Image map(ImageSpec(kSize, kSize, 1));
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const Vector3 from = light.Place((x + 0.5) * kTexel - kExtent / 2, kExtent / 2 - (y + 0.5) * kTexel, 0);
      const double t = Cast(scene, from, {-light.back[0], -light.back[1], -light.back[2]}, 0);
      map.at<float>(x, y) = t < kDeep ? static_cast<float>(t / kDeep) : 1.0f;
    }
  }
  return FromImage(map);
}

// Whether all of the surface around a place, up to `texels` of the map away, is lit as the place is.
bool IsInside(const Scene& scene, const Light& light, const Vector3& at, bool lit, double texels) {
  const Body* own = &scene.bodies[0];
  for (const Body& body : scene.bodies) {
    if (std::fabs(body(at)) < std::fabs((*own)(at))) own = &body;
  }
  const Body& body = *own;
  for (const double share : {1.0, 0.5}) {
    for (int k = 0; k < 16; ++k) {
      const double angle = 2 * std::numbers::pi * k / 16, radius = share * texels * kTexel;
      Vector3 aside;
      for (size_t i = 0; i < 3; ++i) {
        aside[i] = at[i] + radius * (std::cos(angle) * light.right[i] + std::sin(angle) * light.up[i]);
      }
      // The same surface's place there: along the light's direction to where the distance changes its sign.
      const bool outside = body(aside) > 0;
      double found = kFar;
      for (double t = 0; t < 1.5 && found == kFar; t += 0.25 * kTexel) {
        for (const double way : {t, -t}) {
          if ((body(Along(aside, light.back, way)) > 0) != outside) {
            found = way;
            break;
          }
        }
      }
      if (found == kFar) return false;  // beyond the body's edge
      double near = found > 0 ? found - 0.25 * kTexel : found + 0.25 * kTexel;
      for (int step = 0; step < 40; ++step) {
        const double middle = (near + found) / 2;
        ((body(Along(aside, light.back, middle)) > 0) == outside ? near : found) = middle;
      }
      // A hair outside.
      const double a = body(Along(aside, light.back, near)) > 0 ? near : found;
      if (Lit(scene, Along(aside, light.back, a)) != lit) return false;
    }
  }
  return true;
}

std::vector<Scene> Scenes() {
  const Vector3 high = Normalized({0.5, 0.9, 0.4}), low = Normalized({0.8, 0.45, 0.3});
  const auto floor = [](double y) { return [y](const Vector3& p) { return p[1] - y; }; };
  const auto sphere = [](const Vector3& p) { return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1; };
  const auto torus = [](const Vector3& p) {
    // Tilted, so that it shadows itself.
    const double y = 0.8 * p[1] - 0.6 * p[2], z = 0.6 * p[1] + 0.8 * p[2];
    return std::hypot(std::hypot(p[0], y) - 1, z) - 0.35;
  };
  const auto terrain = [](const Vector3& p) {
    double height = 0;
    for (int k = 0; k < 5; ++k) {
      const double f = 1.1 * std::exp2(k), a = 0.22 * std::exp2(-k);
      height +=
          a * std::sin(f * p[0] + 0.7 * k + 0.4 * std::sin(0.7 * f * p[2])) * std::cos(0.9 * f * p[2] + k);
    }
    return 0.45 * (p[1] - height);
  };
  return {{"sphere", {sphere, floor(-1.2)}, high},
          {"torus", {torus, floor(-1.5)}, high},
          {"terrain", {terrain}, high},
          {"low light on terrain", {terrain}, low}};
}

TEST(ShadowTruth, CurvedBodiesNeitherSpeckleNorLeak) {
  constexpr int kWidth = 200, kHeight = 150;
  const Camera eye = Camera::Perspective({0.6, 2.2, 4.2}, {0, -0.3, 0}, {0, 1, 0}, 45, 4.0 / 3, 0.1, 100);
  for (const Scene& scene : Scenes()) {
    const Light light(scene.to_light);
    const Node map = MapOf(scene, light);
    const Image positions(ImageSpec(kWidth, kHeight, 3));
    std::vector<Vector3> places;
    std::vector<char> lit, seen;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Camera::Ray ray = eye.PixelRay({0, 0, kWidth, kHeight}, x, y);
        const Vector3 direction = Normalized(ray.direction);
        const double t = Cast(scene, ray.origin, direction, 0);
        const Vector3 at = Along(ray.origin, direction, t - 1e-6);
        places.push_back(at);
        const double u = Dot(at, light.right), v = Dot(at, light.up), edge = kExtent / 2 - 12 * kTexel;
        seen.push_back(t < kFar && std::fabs(u) < edge && std::fabs(v) < edge);
        lit.push_back(seen.back() && Lit(scene, at));
        for (int c = 0; c < 3; ++c)
          positions.at<float>(x, y, c) = static_cast<float>(at[static_cast<size_t>(c)]);
      }
    }
    for (const int size : {0, 1, 2, 3, 5, 7}) {  // 0: bilinear
      ShadowParams p;
      p.light = light.Matrix();
      p.size = std::max(size, 1);
      if (size == 0) p.filter = ShadowFilter::kBilinear;
      const std::vector<float> v = Values(Shadow(FromImage(positions), map, p));
      int count = 0, dark = 0, leaks = 0;
      const double reach =
          1.5 + std::numbers::sqrt2 * (size == 0 ? 1 : (size - 1) / 2.0);  // a square's corner
      for (size_t i = 0; i < v.size(); ++i) {
        if (seen[i] == 0) continue;
        ++count;
        if (v[i] == static_cast<float>(lit[i]) || !IsInside(scene, light, places[i], lit[i] != 0, reach))
          continue;
        ++(lit[i] != 0 ? dark : leaks);
      }
      const std::string what = scene.name + ", size " + std::to_string(size) + ": of " +
                               std::to_string(count) + " places " + std::to_string(dark) + " too dark, " +
                               std::to_string(leaks) + " too light";
      EXPECT_GT(count, 10000) << what;
      EXPECT_LE(dark + leaks, 0.0005 * count) << what;
      RecordProperty(scene.name + " " + std::to_string(size), what);
    }
  }
}

}  // namespace
}  // namespace tessera
