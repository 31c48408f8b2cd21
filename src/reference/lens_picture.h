// Pictures through a lens for the reference: angles from the axis and about it, by each projection's
// definition.
#ifndef TESSERA_REFERENCE_LENS_PICTURE_H_
#define TESSERA_REFERENCE_LENS_PICTURE_H_

#include <cmath>
#include <numbers>

#include "tessera/ops/environment.h"

namespace tessera::reference {

class LensPicture {
 public:
  static bool Is(EnvironmentMap kind) { return kind >= EnvironmentMap::kPerspective; }

  LensPicture() = default;
  LensPicture(EnvironmentMap kind, double field_of_view) : kind_(kind) {
    const double usual = kind == EnvironmentMap::kPerspective ? 90 : Cylinder() ? 360 : 180;
    const double degrees = field_of_view > 0 ? field_of_view : usual;
    edge_ = Radius(degrees / 2 * std::numbers::pi / 180);
    whole_turn_ = Cylinder() && degrees == 360;
  }
  bool whole_turn() const { return whole_turn_; }
  // From the middle to the right edge, in focal lengths.
  double edge() const { return edge_; }

  // To the right and up, in focal lengths; false for what the projection cannot show.
  bool Project(const Vector3& d, double* right, double* up) const {
    const double across = std::hypot(d[0], d[1]);
    if (Cylinder()) {
      *right = std::atan2(-d[0], d[2]), *up = d[1] / std::hypot(d[0], d[2]);
      return std::isfinite(*up);
    }
    const double angle = std::atan2(across, d[2]);
    const bool half = kind_ == EnvironmentMap::kPerspective || kind_ == EnvironmentMap::kOrthographic;
    if (half && (d[2] < 0 || (d[2] == 0 && kind_ == EnvironmentMap::kPerspective))) return false;
    if (kind_ == EnvironmentMap::kStereographic && angle == std::numbers::pi) return false;
    const double radius = Radius(angle);
    *right = across > 0 ? -d[0] / across * radius : radius;
    *up = across > 0 ? d[1] / across * radius : 0;
    return true;
  }
  // 0 where there is none.
  Vector3 Direction(double right, double up) const {
    if (Cylinder()) {
      const double limit = std::numbers::pi * (1 + 1e-12);
      if (std::fabs(right) > limit) return {};
      return {-std::sin(right), up, std::cos(right)};
    }
    const double radius = std::hypot(right, up), angle = Angle(radius);
    if (!(angle >= 0)) return {};
    if (radius == 0) return {0, 0, 1};
    return {-std::sin(angle) * right / radius, std::sin(angle) * up / radius, std::cos(angle)};
  }
  // Steradian per square focal length: sin a da / (r dr).
  double Density(double right, double up) const {
    if (Cylinder()) return std::fabs(right) > std::numbers::pi ? 0 : std::pow(1 + up * up, -1.5);
    const double radius = std::hypot(right, up), a = Angle(radius);
    if (!(a >= 0)) return 0;
    if (radius == 0) return 1;
    double slope = 1;  // dr/da
    if (kind_ == EnvironmentMap::kPerspective) slope = 1 / (std::cos(a) * std::cos(a));
    if (kind_ == EnvironmentMap::kEquisolid) slope = std::cos(a / 2);
    if (kind_ == EnvironmentMap::kStereographic) slope = 1 / (std::cos(a / 2) * std::cos(a / 2));
    if (kind_ == EnvironmentMap::kOrthographic) slope = std::cos(a);
    return std::sin(a) / (radius * slope);
  }

 private:
  bool Cylinder() const { return kind_ == EnvironmentMap::kCylinder; }
  double Radius(double angle) const {
    switch (kind_) {
      case EnvironmentMap::kPerspective:
        return std::tan(angle);
      case EnvironmentMap::kEquisolid:
        return 2 * std::sin(angle / 2);
      case EnvironmentMap::kStereographic:
        return 2 * std::tan(angle / 2);
      case EnvironmentMap::kOrthographic:
        return std::sin(angle);
      default:
        return angle;
    }
  }
  // NaN beyond the projection's reach; a hair beyond it is its end.
  double Angle(double radius) const {
    const auto within = [&](double end) { return radius > end && radius < end * (1 + 1e-12) ? end : radius; };
    switch (kind_) {
      case EnvironmentMap::kPerspective:
        return std::atan(radius);
      case EnvironmentMap::kEquisolid:
        return 2 * std::asin(within(2) / 2);
      case EnvironmentMap::kStereographic:
        return 2 * std::atan(radius / 2);
      case EnvironmentMap::kOrthographic:
        return std::asin(within(1));
      default:
        return within(std::numbers::pi) <= std::numbers::pi ? radius : std::nan("");
    }
  }

  EnvironmentMap kind_ = EnvironmentMap::kPerspective;
  double edge_ = 1;
  bool whole_turn_ = false;
};

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_LENS_PICTURE_H_
