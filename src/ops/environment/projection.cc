// Where directions lie on environment maps.
#include "ops/environment/projection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::ops {
namespace {

constexpr double kPi = std::numbers::pi;

// OpenGL's table: of each face the major axis with its sign, and the axes of s (right) and t (down) with
// theirs.
struct CubeFace {
  int major, s, t;
  double major_sign, s_sign, t_sign;
};
constexpr CubeFace kCubeFaces[6] = {{0, 2, 1, 1, -1, -1}, {0, 2, 1, -1, 1, -1}, {1, 0, 2, 1, 1, 1},
                                    {1, 0, 2, -1, 1, -1}, {2, 0, 1, 1, 1, -1},  {2, 0, 1, -1, -1, -1}};

Place CubePlace(const MapLayout& l, const Vector3& d) {
  const double x = std::fabs(d[0]), y = std::fabs(d[1]), z = std::fabs(d[2]);
  const int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  const int face = 2 * axis + (d[static_cast<size_t>(axis)] < 0 ? 1 : 0);
  const CubeFace& f = kCubeFaces[face];
  const double ma = std::fabs(d[static_cast<size_t>(axis)]);
  return {face, l.width * (f.s_sign * d[static_cast<size_t>(f.s)] / ma + 1) / 2,
          l.height * (f.t_sign * d[static_cast<size_t>(f.t)] / ma + 1) / 2};
}

// (x + y) / (1 + x y)-free form of the solid angle of a cube face from its centre to (x, y).
double CornerAngle(double x, double y) { return std::atan2(x * y, std::sqrt(x * x + y * y + 1)); }

}  // namespace

MapLayout LayoutOf(const std::string& subject, EnvironmentMap map, int width, int height) {
  MapLayout l;
  l.map = map;
  l.width = l.picture_width = width;
  l.height = l.picture_height = height;
  if (width <= 0 || height <= 0) return l;
  switch (map) {
    case EnvironmentMap::kSphere:
    case EnvironmentMap::kParabolic:
    case EnvironmentMap::kLatLong:
      l.faces = {{0, 0}};
      return l;
    case EnvironmentMap::kDualParabolic:
      l.width = std::max(1, width / 2);
      l.faces = {{0, 0}, {width - l.width, 0}};
      return l;
    case EnvironmentMap::kCube:
      break;
  }
  if (width == int64_t{6} * height) {
    l.width = height;
    for (int f = 0; f < 6; ++f) l.faces.push_back({f * height, 0});
  } else if (height == int64_t{6} * width) {
    l.height = width;
    for (int f = 0; f < 6; ++f) l.faces.push_back({0, f * width});
  } else if (int64_t{3} * width == int64_t{4} * height && width % 4 == 0) {
    const int n = l.width = l.height = width / 4;
    l.faces = {{2 * n, n}, {0, n}, {n, 0}, {n, 2 * n}, {n, n}, {3 * n, n}};
  } else if (int64_t{4} * width == int64_t{3} * height && width % 3 == 0) {
    const int n = l.width = l.height = width / 3;
    l.faces = {{2 * n, n}, {0, n}, {n, 0}, {n, 2 * n}, {n, n}, {n, 3 * n, true}};
  } else {
    throw DataError(subject, "found a map of " + std::to_string(width) + "x" + std::to_string(height) +
                                 ", expected a cube's shape: 6:1, 1:6, 4:3 or 3:4");
  }
  return l;
}

bool PlaceOnFace(const MapLayout& l, const Vector3& d, Place* place) {
  const double x = d[0], y = d[1], z = d[2], planar = x * x + y * y, length = std::sqrt(planar + z * z);
  const double w = l.width, h = l.height;
  switch (l.map) {
    case EnvironmentMap::kLatLong:
      *place = {0, w * (0.5 - std::atan2(x, z) / (2 * kPi)),
                h * (0.5 - std::atan2(y, std::sqrt(x * x + z * z)) / kPi)};
      return true;
    case EnvironmentMap::kSphere: {
      const double k = z < 0 ? planar / (length - z) : length + z;  // without cancellation
      const double m = std::sqrt(planar + k * k);
      *place = {0, w * (m > 0 ? (x / m + 1) / 2 : 1), h * (m > 0 ? (1 - y / m) / 2 : 0.5)};
      return true;
    }
    case EnvironmentMap::kParabolic:
    case EnvironmentMap::kDualParabolic: {
      const bool front = z >= 0;
      if (!front && l.faces.size() == 1) return false;
      const double k = length + std::fabs(z);
      *place = {front ? 0 : 1, w * (x / k + 1) / 2, h * (1 - y / k) / 2};
      return true;
    }
    case EnvironmentMap::kCube:
      *place = CubePlace(l, d);
      return true;
  }
  return false;
}

Vector3 DirectionAt(const MapLayout& l, const Place& p) {
  const double s = 2 * p.u / l.width - 1, t = 1 - 2 * p.v / l.height;
  switch (l.map) {
    case EnvironmentMap::kLatLong: {
      const double longitude = -kPi * s, latitude = kPi / 2 * t;
      return {std::sin(longitude) * std::cos(latitude), std::sin(latitude),
              std::cos(longitude) * std::cos(latitude)};
    }
    case EnvironmentMap::kSphere: {
      const double planar = s * s + t * t;
      if (planar >= 1) return {0, 0, -1};
      const double z = std::sqrt(1 - planar);
      return {2 * s * z, 2 * t * z, 1 - 2 * planar};
    }
    case EnvironmentMap::kParabolic:
    case EnvironmentMap::kDualParabolic: {
      const double z = 1 - s * s - t * t;
      return {2 * s, 2 * t, p.face == 0 ? z : -z};
    }
    case EnvironmentMap::kCube:
      break;
  }
  const CubeFace& f = kCubeFaces[p.face];
  Vector3 d{};
  d[static_cast<size_t>(f.major)] = f.major_sign;
  d[static_cast<size_t>(f.s)] = f.s_sign * s;
  d[static_cast<size_t>(f.t)] = -f.t_sign * t;
  return d;
}

double TexelSolidAngle(const MapLayout& l, int i, int j) {
  const double w = 2.0 / l.width, h = 2.0 / l.height;
  const double s = w * (i + 0.5) - 1, t = h * (j + 0.5) - 1, square = s * s + t * t;
  switch (l.map) {
    case EnvironmentMap::kLatLong:
      return 2 * kPi / l.width * (std::sin(kPi / 2 * (t + h / 2)) - std::sin(kPi / 2 * (t - h / 2)));
    case EnvironmentMap::kSphere:
      return square <= 1 ? 4 * w * h : 0;
    case EnvironmentMap::kParabolic:
    case EnvironmentMap::kDualParabolic:
      return square <= 1 ? 4 * w * h / ((1 + square) * (1 + square)) : 0;
    case EnvironmentMap::kCube:
      break;
  }
  const double s0 = s - w / 2, s1 = s + w / 2, t0 = t - h / 2, t1 = t + h / 2;
  return CornerAngle(s1, t1) - CornerAngle(s0, t1) - CornerAngle(s1, t0) + CornerAngle(s0, t0);
}

const char* MapName(EnvironmentMap map) {
  constexpr const char* kNames[] = {"sphere", "parabolic", "dualparabolic", "latlong", "cube"};
  return kNames[static_cast<int>(map)];
}

}  // namespace tessera::ops

namespace tessera {

bool PlaceOf(EnvironmentMap map, int width, int height, const Vector3& direction, double* x, double* y) {
  const ops::MapLayout layout = ops::LayoutOf("environment", map, width, height);
  ops::Place place;
  if (layout.faces.empty() || !(Dot(direction, direction) > 0) ||
      !ops::PlaceOnFace(layout, direction, &place)) {
    return false;
  }
  const ops::MapFace& face = layout.faces[static_cast<size_t>(place.face)];
  *x = face.x + (face.turned ? layout.width - place.u : place.u);
  *y = face.y + (face.turned ? layout.height - place.v : place.v);
  return true;
}

bool DirectionOf(EnvironmentMap map, int width, int height, double x, double y, Vector3* direction) {
  const ops::MapLayout layout = ops::LayoutOf("environment", map, width, height);
  for (size_t f = 0; f < layout.faces.size(); ++f) {
    const ops::MapFace& face = layout.faces[f];
    const double u = x - face.x, v = y - face.y;
    if (!(u >= 0 && u <= layout.width && v >= 0 && v <= layout.height)) continue;
    const ops::Place place = {static_cast<int>(f), face.turned ? layout.width - u : u,
                              face.turned ? layout.height - v : v};
    const double s = 2 * place.u / layout.width - 1, t = 2 * place.v / layout.height - 1;
    const bool disc = map == EnvironmentMap::kSphere || map == EnvironmentMap::kParabolic ||
                      map == EnvironmentMap::kDualParabolic;
    if (disc && s * s + t * t > 1) return false;
    *direction = Normalized(ops::DirectionAt(layout, place));
    return true;
  }
  return false;
}

}  // namespace tessera
