// A small analytic scene and a caster of rays into it, in double: terrain, spheres, boxes, a torus under a
// sky. A source of G-buffers and light depths for samples and tests; it is no renderer.
#ifndef TESSERA_SAMPLES_RAY_CASTER_H_
#define TESSERA_SAMPLES_RAY_CASTER_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "tessera/camera.h"

namespace ray_caster {

using tessera::Vector3;

inline Vector3 Plus(const Vector3& a, const Vector3& b, double t = 1) {
  return {a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]};
}

struct Hit {
  double t = std::numeric_limits<double>::infinity();
  Vector3 normal = {0, 0, 0};
  Vector3 albedo = {0, 0, 0};
  int id = 0;  // 0: nothing
};

// Hills: sums of sines, so that height and slope are exact. Slope at most kSteepest.
struct Terrain {
  static constexpr double kHighest = 3.4, kLowest = -3.4, kSteepest = 0.95;
  static double Height(double x, double z, double* dx = nullptr, double* dz = nullptr) {
    static constexpr double kWaves[][4] = {// along x, along z, phase, height
                                           {0.11, 0.07, 0.4, 1.6},   {-0.06, 0.13, 2.1, 1.0},
                                           {0.31, -0.21, 4.0, 0.45}, {0.47, 0.53, 1.3, 0.22},
                                           {1.1, -0.9, 0.2, 0.09},   {-1.7, 1.9, 3.3, 0.04}};
    double y = 0, sx = 0, sz = 0;
    for (const auto& w : kWaves) {
      const double a = w[0] * x + w[1] * z + w[2];
      y += w[3] * std::sin(a);
      sx += w[3] * w[0] * std::cos(a), sz += w[3] * w[1] * std::cos(a);
    }
    if (dx != nullptr) *dx = sx, *dz = sz;
    return y;
  }
};

class Scene {
 public:
  struct Sphere {
    Vector3 centre;
    double radius;
    Vector3 albedo;
  };
  struct Box {
    Vector3 low, high, albedo;
  };
  struct Torus {
    Vector3 centre;
    double radius, tube;  // axis z
    Vector3 albedo;
  };
  bool terrain = true;
  std::vector<Sphere> spheres;
  std::vector<Box> boxes;
  std::vector<Torus> tori;

  // The scene of the samples: hills with a colonnade, two balls and a ring.
  static Scene Default() {
    Scene s;
    const auto ground = [](double x, double z) { return Terrain::Height(x, z); };
    for (int k = 0; k < 7; ++k) {
      const double x = -7.5 + 2.5 * k, z = -6 - 1.1 * k, y = ground(x, z);
      s.boxes.push_back({{x - 0.4, y - 1, z - 0.4}, {x + 0.4, y + 3.2, z + 0.4}, {0.72, 0.66, 0.56}});
    }
    const double y = ground(1.5, 1.5);
    s.spheres.push_back({{-3.2, ground(-3.2, 0.5) + 1.1, 0.5}, 1.15, {0.75, 0.24, 0.16}});
    s.spheres.push_back({{3.4, ground(3.4, 2.6) + 0.6, 2.6}, 0.65, {0.2, 0.36, 0.62}});
    s.tori.push_back({{1.2, y + 1.5, -0.4}, 1.25, 0.34, {0.78, 0.6, 0.2}});
    return s;
  }

  Hit Cast(const Vector3& from, const Vector3& direction, double near, double far) const {
    Hit hit;
    hit.t = far;
    const Vector3 d = tessera::Normalized(direction);
    const double scale = std::sqrt(tessera::Dot(direction, direction));
    // Everything below works in world units along the unit direction.
    hit.t = far * scale;
    const double start = near * scale;
    int id = 1;
    if (terrain) CastTerrain(from, d, start, id, hit);
    for (const Sphere& s : spheres) CastSphere(s, from, d, start, ++id, hit);
    for (const Box& b : boxes) CastBox(b, from, d, start, ++id, hit);
    for (const Torus& t : tori) CastTorus(t, from, d, start, ++id, hit);
    hit.t = hit.id == 0 ? std::numeric_limits<double>::infinity() : hit.t / scale;
    return hit;
  }

 private:
  static void CastTerrain(const Vector3& from, const Vector3& d, double start, int id, Hit& hit) {
    // Only the slab between the lowest and the highest point.
    double t = start, end = hit.t;
    if (d[1] != 0) {
      const double a = (Terrain::kHighest - from[1]) / d[1], b = (Terrain::kLowest - from[1]) / d[1];
      t = std::max(t, std::min(a, b)), end = std::min(end, std::max(a, b));
    } else if (from[1] > Terrain::kHighest) {
      return;
    }
    const auto above = [&](double at) {
      return from[1] + at * d[1] - Terrain::Height(from[0] + at * d[0], from[2] + at * d[2]);
    };
    // How fast the height above ground can fall along this ray.
    const double fastest = std::max(1e-6, Terrain::kSteepest * std::hypot(d[0], d[2]) - d[1]);
    double last = t, height = t < end ? above(t) : 0;
    if (t >= end || height < 0) return;
    while (t < end) {
      last = t;
      t += std::max(height / fastest, 2e-3 * (1 + 0.1 * t));
      height = above(std::min(t, end));
      if (height < 0) break;
    }
    if (height >= 0) return;
    // Newton's steps inside the bracket, halving it where one leaves it.
    double low = last, high = std::min(t, end), at = 0.5 * (low + high);
    for (int k = 0; k < 40 && high - low > 1e-13 * high; ++k) {
      double sx = 0, sz = 0;
      const double over =
          from[1] + at * d[1] - Terrain::Height(from[0] + at * d[0], from[2] + at * d[2], &sx, &sz);
      (over < 0 ? high : low) = at;
      const double next = at - over / (d[1] - sx * d[0] - sz * d[2]);
      if (std::fabs(next - at) < 1e-12 * at) break;
      at = next > low && next < high ? next : 0.5 * (low + high);
    }
    double dx = 0, dz = 0;
    const Vector3 p = Plus(from, d, at);
    Terrain::Height(p[0], p[2], &dx, &dz);
    const double steep = std::clamp(std::hypot(dx, dz) * 1.6, 0.0, 1.0);
    Vector3 albedo;
    for (size_t k = 0; k < 3; ++k) {
      const double grass[] = {0.24, 0.34, 0.12}, rock[] = {0.42, 0.36, 0.3};
      albedo[k] = grass[k] + steep * (rock[k] - grass[k]);
    }
    hit = {at, tessera::Normalized({-dx, 1, -dz}), albedo, id};
  }

  static void CastSphere(const Sphere& s, const Vector3& from, const Vector3& d, double start, int id,
                         Hit& hit) {
    const Vector3 c = Plus(from, s.centre, -1);
    const double b = tessera::Dot(c, d), e = tessera::Dot(c, c) - s.radius * s.radius, root = b * b - e;
    if (root < 0) return;
    for (const double t : {-b - std::sqrt(root), -b + std::sqrt(root)}) {
      if (t <= start || t >= hit.t) continue;
      hit = {t, tessera::Normalized(Plus(Plus(from, d, t), s.centre, -1)), s.albedo, id};
      return;
    }
  }

  static void CastBox(const Box& b, const Vector3& from, const Vector3& d, double start, int id, Hit& hit) {
    double enter = start, leave = hit.t;
    int axis = -1;
    for (size_t k = 0; k < 3; ++k) {
      if (d[k] == 0) {
        if (from[k] < b.low[k] || from[k] > b.high[k]) return;
        continue;
      }
      const double low = (b.low[k] - from[k]) / d[k], high = (b.high[k] - from[k]) / d[k];
      if (std::min(low, high) > enter) enter = std::min(low, high), axis = static_cast<int>(k);
      leave = std::min(leave, std::max(low, high));
    }
    if (enter >= leave || axis < 0) return;
    Vector3 normal = {0, 0, 0};
    normal[static_cast<size_t>(axis)] = d[static_cast<size_t>(axis)] > 0 ? -1 : 1;
    hit = {enter, normal, b.albedo, id};
  }

  static void CastTorus(const Torus& s, const Vector3& from, const Vector3& d, double start, int id,
                        Hit& hit) {
    const auto distance = [&](const Vector3& p) {
      const double ring = std::hypot(p[0] - s.centre[0], p[1] - s.centre[1]) - s.radius;
      return std::hypot(ring, p[2] - s.centre[2]) - s.tube;
    };
    // Inside the sphere around it, by steps of the distance.
    const Vector3 c = Plus(from, s.centre, -1);
    const double size = s.radius + s.tube + 0.01, b = tessera::Dot(c, d);
    const double root = b * b - tessera::Dot(c, c) + size * size;
    if (root < 0) return;
    double t = std::max(start, -b - std::sqrt(root));
    const double end = std::min(hit.t, -b + std::sqrt(root));
    for (int k = 0; k < 400 && t < end; ++k) {
      const Vector3 p = Plus(from, d, t);
      const double step = distance(p);
      if (step < 1e-10) {
        const double x = p[0] - s.centre[0], y = p[1] - s.centre[1], around = std::hypot(x, y);
        const double ring = (around - s.radius) / around;
        hit = {t, tessera::Normalized({x * ring, y * ring, p[2] - s.centre[2]}), s.albedo, id};
        return;
      }
      t += step;
    }
  }
};

}  // namespace ray_caster

#endif  // TESSERA_SAMPLES_RAY_CASTER_H_
