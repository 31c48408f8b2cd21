// Where directions lie on environment maps.
#include "ops/environment/projection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/number_text.h"
#include "base/turn.h"
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

// Where a lens's plane is unrolled, in degrees from the axis to the edge of the widest picture.
double WidestView(EnvironmentMap map) {
  switch (map) {
    case EnvironmentMap::kPerspective:
    case EnvironmentMap::kOrthographic:
      return 180;
    default:
      return 360;
  }
}
double UsualView(EnvironmentMap map) {
  switch (map) {
    case EnvironmentMap::kPerspective:
      return 90;
    case EnvironmentMap::kCylinder:
      return 360;
    default:
      return 180;
  }
}
// How far from the middle an angle from the axis lies, in focal lengths.
double PlaneRadius(EnvironmentMap map, double angle) {
  switch (map) {
    case EnvironmentMap::kPerspective:
      return std::tan(angle);
    case EnvironmentMap::kEquisolid:
      return 2 * std::sin(angle / 2);
    case EnvironmentMap::kStereographic:
      return 2 * std::tan(angle / 2);
    case EnvironmentMap::kOrthographic:
      return std::sin(angle);
    default:
      return angle;  // equidistant, and along a cylinder
  }
}

// To the right and up on a lens's plane, in focal lengths; false beyond its reach.
bool LensPlace(EnvironmentMap map, const Vector3& d, double* right, double* up) {
  const double x = -d[0], y = d[1], z = d[2], planar = x * x + y * y, length = std::sqrt(planar + z * z);
  // length + z without cancellation.
  const double sum = z < 0 ? planar / (length - z) : length + z;
  double scale = 0;
  switch (map) {
    case EnvironmentMap::kPerspective:
      if (!(z > 0)) return false;
      scale = 1 / z;
      break;
    case EnvironmentMap::kEquidistant:
    case EnvironmentMap::kEquisolid: {
      const bool rear = z < 0 && planar == 0;  // anywhere on the rim: at its right
      if (rear) return *right = PlaneRadius(map, kPi), *up = 0, true;
      const double radius = std::sqrt(planar);
      scale = map == EnvironmentMap::kEquisolid ? std::sqrt(2 / (length * sum))
              : radius > 0                      ? std::atan2(radius, z) / radius
                                                : 1 / z;
      break;
    }
    case EnvironmentMap::kStereographic:
      if (!(sum > 0)) return false;
      scale = 2 / sum;
      break;
    case EnvironmentMap::kOrthographic:
      if (z < 0) return false;
      scale = 1 / length;
      break;
    default: {  // a cylinder
      const double across = std::sqrt(x * x + z * z);
      if (!(across > 0)) return false;
      return *right = std::atan2(x, z), *up = y / across, true;
    }
  }
  *right = x * scale, *up = y * scale;
  return std::isfinite(*right) && std::isfinite(*up);
}

// The inverse; 0 beyond a projection's reach, but for a hair that roundings may have added.
Vector3 LensDirection(EnvironmentMap map, double right, double up) {
  constexpr double kHair = 1 + 1e-12;
  const double square = right * right + up * up;
  switch (map) {
    case EnvironmentMap::kPerspective:
      return {-right, up, 1};
    case EnvironmentMap::kEquidistant: {
      const double radius = std::sqrt(square);
      if (radius > kPi * kHair) return {};
      const double scale = radius > 0 ? std::sin(radius) / radius : 1;
      return {-right * scale, up * scale, std::cos(radius)};
    }
    case EnvironmentMap::kEquisolid: {
      if (square > 4 * kHair) return {};
      const double scale = std::sqrt(std::max(0.0, 1 - square / 4));
      return {-right * scale, up * scale, 1 - square / 2};
    }
    case EnvironmentMap::kStereographic:
      return {-right, up, 1 - square / 4};
    case EnvironmentMap::kOrthographic:
      if (square > kHair) return {};
      return {-right, up, std::sqrt(std::max(0.0, 1 - square))};
    default:  // a cylinder
      if (std::fabs(right) > kPi * kHair) return {};
      return {-std::sin(right), up, std::cos(right)};
  }
}

// Steradian per square focal length at a place of a lens's plane.
double LensDensity(EnvironmentMap map, double right, double up) {
  const double square = right * right + up * up;
  switch (map) {
    case EnvironmentMap::kPerspective:
      return std::pow(1 + square, -1.5);
    case EnvironmentMap::kEquidistant:
      if (square > kPi * kPi) return 0;
      return square > 0 ? std::sin(std::sqrt(square)) / std::sqrt(square) : 1;
    case EnvironmentMap::kEquisolid:
      return square > 4 ? 0 : 1;
    case EnvironmentMap::kStereographic:
      return 1 / ((1 + square / 4) * (1 + square / 4));
    case EnvironmentMap::kOrthographic:
      return square < 1 ? 1 / std::sqrt(1 - square) : 0;
    default:  // a cylinder
      return std::fabs(right) > kPi ? 0 : std::pow(1 + up * up, -1.5);
  }
}

double SignOf(double v) { return v < 0 ? -1 : 1; }

// (x + y) / (1 + x y)-free form of the solid angle of a cube face from its centre to (x, y).
double CornerAngle(double x, double y) { return std::atan2(x * y, std::sqrt(x * x + y * y + 1)); }

}  // namespace

void RequireFieldOfView(const std::string& subject, const char* name, EnvironmentMap map,
                        double field_of_view) {
  if (field_of_view == 0) return;
  const std::string found = "found " + std::string(name) + "=" + base::NumberText(field_of_view);
  if (!IsLens(map)) {
    throw Error(subject, found + " with " + MapName(map) + ", which shows all directions; expected none");
  }
  // What is at the widest angle lies infinitely far away on two of them.
  const double widest = WidestView(map);
  const bool open = map == EnvironmentMap::kPerspective || map == EnvironmentMap::kStereographic;
  if (field_of_view > 0 && (open ? field_of_view <= widest - 0.01 : field_of_view <= widest)) return;
  throw Error(subject, found + ", expected more than 0, up to " +
                           base::NumberText(open ? widest - 0.01 : widest) + " degrees of " + MapName(map));
}

MapLayout LayoutOf(const std::string& subject, EnvironmentMap map, int width, int height,
                   double field_of_view) {
  MapLayout l;
  l.map = map;
  l.width = l.picture_width = width;
  l.height = l.picture_height = height;
  if (width <= 0 || height <= 0) return l;
  switch (map) {
    case EnvironmentMap::kSphere:
    case EnvironmentMap::kParabolic:
    case EnvironmentMap::kLatLong:
    case EnvironmentMap::kOctahedral:
      l.faces = {{0, 0}};
      return l;
    case EnvironmentMap::kPerspective:
    case EnvironmentMap::kEquidistant:
    case EnvironmentMap::kEquisolid:
    case EnvironmentMap::kStereographic:
    case EnvironmentMap::kOrthographic:
    case EnvironmentMap::kCylinder: {
      const double degrees = field_of_view > 0 ? field_of_view : UsualView(map);
      l.faces = {{0, 0}};
      l.focal = width / (2 * PlaneRadius(map, degrees / 360 * kPi));
      l.whole_turn = map == EnvironmentMap::kCylinder && degrees == 360;
      return l;
    }
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
    case EnvironmentMap::kOctahedral: {
      const double sum = std::fabs(x) + std::fabs(y) + std::fabs(z);
      double p = x / sum, q = y / sum;
      if (z < 0) {
        const double folded = (1 - std::fabs(q)) * SignOf(p);
        q = (1 - std::fabs(p)) * SignOf(q), p = folded;
      }
      *place = {0, w * (p + 1) / 2, h * (1 - q) / 2};
      return true;
    }
    default:
      break;
  }
  double right, up;
  if (!LensPlace(l.map, d, &right, &up)) return false;
  *place = {0, w / 2 + l.focal * right, h / 2 - l.focal * up};
  return true;
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
    case EnvironmentMap::kOctahedral: {
      const double z = 1 - std::fabs(s) - std::fabs(t);
      if (z >= 0) return {s, t, z};
      return {(1 - std::fabs(t)) * SignOf(s), (1 - std::fabs(s)) * SignOf(t), z};
    }
    default:
      return LensDirection(l.map, (p.u - 0.5 * l.width) / l.focal, (0.5 * l.height - p.v) / l.focal);
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
    case EnvironmentMap::kOctahedral: {
      // Per area of the octahedron's face, seen from above, 1 / |(x, y, z)|^3.
      const Vector3 d = DirectionAt(l, {0, i + 0.5, j + 0.5});
      return w * h * std::pow(Dot(d, d), -1.5);
    }
    default:
      return LensDensity(l.map, 0.5 * s * l.width / l.focal, 0.5 * t * l.height / l.focal) /
             (l.focal * l.focal);
  }
  const double s0 = s - w / 2, s1 = s + w / 2, t0 = t - h / 2, t1 = t + h / 2;
  return CornerAngle(s1, t1) - CornerAngle(s0, t1) - CornerAngle(s1, t0) + CornerAngle(s0, t0);
}

const char* MapName(EnvironmentMap map) {
  constexpr const char* kNames[] = {"sphere",    "parabolic",     "dualparabolic", "latlong",
                                    "cube",      "octahedral",    "perspective",   "equidistant",
                                    "equisolid", "stereographic", "orthographic",  "cylinder"};
  return kNames[static_cast<int>(map)];
}

}  // namespace tessera::ops

namespace tessera {

bool PlaceOf(EnvironmentMap map, int width, int height, const Vector3& direction, double* x, double* y,
             double field_of_view) {
  ops::RequireFieldOfView("environment", "field_of_view", map, field_of_view);
  const ops::MapLayout layout = ops::LayoutOf("environment", map, width, height, field_of_view);
  ops::Place place;
  if (layout.faces.empty() || !(Dot(direction, direction) > 0) ||
      !ops::PlaceOnFace(layout, direction, &place) || (ops::IsLens(map) && !ops::IsInside(layout, place))) {
    return false;
  }
  const ops::MapFace& face = layout.faces[static_cast<size_t>(place.face)];
  *x = face.x + (face.turned ? layout.width - place.u : place.u);
  *y = face.y + (face.turned ? layout.height - place.v : place.v);
  return true;
}

bool DirectionOf(EnvironmentMap map, int width, int height, double x, double y, Vector3* direction,
                 double field_of_view) {
  ops::RequireFieldOfView("environment", "field_of_view", map, field_of_view);
  const ops::MapLayout layout = ops::LayoutOf("environment", map, width, height, field_of_view);
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
    return Dot(*direction, *direction) > 0;
  }
  return false;
}

Matrix4 ViewRotation(const YawPitchRoll& degrees) {
  const auto cosine = [&](size_t k) { return base::TurnOf(degrees[k]).cosine; };
  const auto sine = [&](size_t k) { return base::TurnOf(degrees[k]).sine; };
  const Matrix4 yaw = {cosine(0), 0, -sine(0), 0, 0, 1, 0, 0, sine(0), 0, cosine(0), 0, 0, 0, 0, 1};
  const Matrix4 pitch = {1, 0, 0, 0, 0, cosine(1), sine(1), 0, 0, -sine(1), cosine(1), 0, 0, 0, 0, 1};
  const Matrix4 roll = {cosine(2), -sine(2), 0, 0, sine(2), cosine(2), 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  return Product(yaw, Product(pitch, roll));
}

}  // namespace tessera
