// Solids as signed distances, and their combinations.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/number_text.h"
#include "base/turn.h"
#include "model/solid_node.h"
#include "tessera/error.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

using model::Ball;
using model::kSolidRow;
using model::SolidNode;
using model::SolidPart;
using model::SolidRow;
using model::SolidWithin;

Vector3 Minus(const Vector3& a, const Vector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline double Square(double x, double y, double z) { return x * x + y * y + z * z; }
double Length(const Vector3& v) { return std::sqrt(Square(v[0], v[1], v[2])); }

void Require(bool valid, const char* what, double found) {
  if (!valid) {
    throw Error("solid", std::string("found ") + what + " of " + base::NumberText(found) +
                             ", expected a positive number");
  }
}

double MeasureOne(const SolidNode& solid, const Vector3& p) {
  SolidRow row;
  row.count = 1;
  row.x[0] = p[0], row.y[0] = p[1], row.z[0] = p[2];
  double d[kSolidRow];
  solid.Measure(row, d);
  return d[0];
}

// Bounds are widened by this times the lengths that they come from. Far above what rounding takes: the square
// root of a cancelled difference (Cone) may be off by 1e-8.
constexpr double kRounding = 1e-7;

// One whose distance changes by no more than the way gone; `size`: of the lengths that it is made of.
class Shape : public SolidNode {
 public:
  explicit Shape(double size) : size_(size) {}
  SolidWithin Within(const Ball& ball) const override {
    const double middle = MeasureOne(*this, ball.centre);
    const double way =
        ball.radius + kRounding * (std::fabs(middle) + ball.radius + Length(ball.centre) + size_);
    return {nullptr, middle - way, middle + way};
  }

 private:
  double size_;
};

// f(x, y, z) -> distance.
template <typename F>
class ShapeOf final : public Shape {
 public:
  ShapeOf(double size, F f) : Shape(size), f_(std::move(f)) {}
  void Measure(const SolidRow& row, double* d) const override {
    for (int i = 0; i < row.count; ++i) d[i] = f_(row.x[i], row.y[i], row.z[i]);
  }

 private:
  F f_;
};
template <typename F>
SolidPart MakeShape(double size, F f) {
  return std::make_shared<ShapeOf<F>>(size, std::move(f));
}

double Largest(const Vector3& v) { return std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])}); }

class EllipsoidNode final : public SolidNode {
 public:
  EllipsoidNode(const Vector3& centre, const Vector3& radii)
      : centre_(centre),
        radii_(radii),
        least_(*std::min_element(radii.begin(), radii.end())),
        most_(*std::max_element(radii.begin(), radii.end())) {}
  void Measure(const SolidRow& row, double* d) const override {
    for (int i = 0; i < row.count; ++i) {
      const double x = row.x[i] - centre_[0], y = row.y[i] - centre_[1], z = row.z[i] - centre_[2];
      const double sx = x / radii_[0], sy = y / radii_[1], sz = z / radii_[2];
      const double k = std::sqrt(Square(sx, sy, sz));
      const double slope = std::sqrt(Square(sx / radii_[0], sy / radii_[1], sz / radii_[2]));
      // Near the surface (k - 1) k / |grad|; never more than the smallest radius' scale allows.
      const double near = (k - 1) * k / slope, length = std::sqrt(Square(x, y, z));
      const double inside = std::max(near, (k - 1) * most_),
                   outside = std::max((k - 1) * least_, std::min(near, length));
      d[i] = slope == 0 ? -least_ : k < 1 ? inside : outside;
    }
  }
  // Towards its centre this is no distance: k / |grad| is between the radii, whichever way one looks.
  SolidWithin Within(const Ball& ball) const override {
    const Vector3 q = Minus(ball.centre, centre_);
    const double k = Length({q[0] / radii_[0], q[1] / radii_[1], q[2] / radii_[2]});
    const double way = ball.radius / least_;
    const double low = std::max(k - way, 0.0) - 1, high = k + way - 1;
    const double rounding = kRounding * (k + way + 1) * most_;
    return {nullptr, low * (low < 0 ? most_ : least_) - rounding,
            high * (high < 0 ? least_ : most_) + rounding};
  }

 private:
  Vector3 centre_, radii_;
  double least_, most_;
};

// A solid seen otherwise: Place makes the solid's own places of a row's, Change its distances.
template <typename Way>
class Changed final : public SolidNode {
 public:
  Changed(SolidPart solid, const Way& way) : solid_(std::move(solid)), way_(way) {}
  void Measure(const SolidRow& row, double* d) const override {
    if constexpr (requires { way_.Place(0.0, 0.0, 0.0); }) {
      SolidRow own;
      own.count = row.count;
      for (int i = 0; i < row.count; ++i) {
        const Vector3 p = way_.Place(row.x[i], row.y[i], row.z[i]);
        own.x[i] = p[0], own.y[i] = p[1], own.z[i] = p[2];
      }
      solid_->Measure(own, d);
    } else {
      solid_->Measure(row, d);
    }
    if constexpr (requires { way_.Change(0.0); }) {
      for (int i = 0; i < row.count; ++i) d[i] = way_.Change(d[i]);
    }
  }
  SolidWithin Within(const Ball& ball) const override {
    Ball own = ball;
    if constexpr (requires { way_.Place(0.0, 0.0, 0.0); }) {
      own.centre = way_.Place(ball.centre[0], ball.centre[1], ball.centre[2]);
      if constexpr (requires { way_.scale; }) own.radius /= way_.scale;
      own.radius += kRounding * (own.radius + Length(own.centre));
    }
    SolidWithin found = solid_->Within(own);
    if (found.part != nullptr) found.part = std::make_shared<Changed>(found.part, way_);
    if constexpr (requires { way_.Change(0.0); }) {
      const double low = found.low, high = found.high;
      found.low = std::min(way_.Change(low), way_.Change(high));
      found.high = std::max(way_.Change(low), way_.Change(high));
      if constexpr (requires { way_.Least(); }) {
        if (low < 0 && high > 0) found.low = way_.Least();
      }
      const double rounding = kRounding * (std::fabs(found.low) + std::fabs(found.high));
      found.low -= rounding, found.high += rounding;
    }
    return found;
  }

 private:
  SolidPart solid_;
  Way way_;
};
template <typename Way>
SolidPart Change(const SolidPart& solid, const Way& way) {
  return std::make_shared<Changed<Way>>(solid, way);
}

struct Translation {
  Vector3 by;
  Vector3 Place(double x, double y, double z) const { return {x - by[0], y - by[1], z - by[2]}; }
};
struct Rotation {
  Vector3 axis;
  double cosine, sine;
  Vector3 Place(double x, double y, double z) const {
    const Vector3& n = axis;
    const double along = (n[0] * x + n[1] * y + n[2] * z) * (1 - cosine);
    return {x * cosine + (n[1] * z - n[2] * y) * sine + n[0] * along,
            y * cosine + (n[2] * x - n[0] * z) * sine + n[1] * along,
            z * cosine + (n[0] * y - n[1] * x) * sine + n[2] * along};
  }
};
struct Scaling {
  double scale;
  Vector3 Place(double x, double y, double z) const { return {x / scale, y / scale, z / scale}; }
  double Change(double d) const { return scale * d; }
};
struct Growth {
  double by;
  double Change(double d) const { return d - by; }
};
struct Shelling {
  double half;
  double Change(double d) const { return std::fabs(d) - half; }
  double Least() const { return -half; }
};
struct Complement {
  double Change(double d) const { return -d; }
};

// Polynomial blend: how much lower than the smaller of two distances the blended one is.
inline double Blend(double a, double b, double radius) {
  const double h = std::max(radius - std::fabs(a - b), 0.0);
  return h * h / (4 * radius);
}

enum class Join { kUnion, kIntersection, kDifference };

class Joined final : public SolidNode {
 public:
  Joined(Join join, SolidPart a, SolidPart b, double radius)
      : join_(join), a_(std::move(a)), b_(std::move(b)), radius_(radius > 0 ? radius : 0) {}
  void Measure(const SolidRow& row, double* d) const override {
    double other[kSolidRow];
    a_->Measure(row, d);
    b_->Measure(row, other);
    const int n = row.count;
    switch (join_) {
      case Join::kUnion:
        if (radius_ > 0) {
          for (int i = 0; i < n; ++i) d[i] = std::min(d[i], other[i]) - Blend(d[i], other[i], radius_);
        } else {
          for (int i = 0; i < n; ++i) d[i] = std::min(d[i], other[i]);
        }
        return;
      case Join::kIntersection:
        if (radius_ > 0) {
          for (int i = 0; i < n; ++i) d[i] = std::max(d[i], other[i]) + Blend(d[i], other[i], radius_);
        } else {
          for (int i = 0; i < n; ++i) d[i] = std::max(d[i], other[i]);
        }
        return;
      case Join::kDifference:
        for (int i = 0; i < n; ++i) d[i] = std::max(d[i], -other[i]);
    }
  }
  // Where one is the nearer by more than the blend's radius, the other does not matter.
  SolidWithin Within(const Ball& ball) const override {
    SolidWithin a = a_->Within(ball), b = b_->Within(ball);
    const SolidPart of_a = a.part != nullptr ? a.part : a_, of_b = b.part != nullptr ? b.part : b_;
    const double blend = radius_ / 4 * (1 + kRounding);
    SolidWithin both;
    if (join_ == Join::kUnion) {
      if (a.low > b.high + radius_) return {of_b, b.low, b.high};
      if (b.low > a.high + radius_) return {of_a, a.low, a.high};
      both.low = std::min(a.low, b.low) - blend, both.high = std::min(a.high, b.high);
    } else {
      const bool negative = join_ == Join::kDifference;
      const double low = negative ? -b.high : b.low, high = negative ? -b.low : b.high;
      if (a.low > high + radius_) return {of_a, a.low, a.high};
      if (low > a.high + radius_) return {negative ? Change(of_b, Complement{}) : of_b, low, high};
      both.low = std::max(a.low, low), both.high = std::max(a.high, high) + blend;
    }
    if (a.part != nullptr || b.part != nullptr)
      both.part = std::make_shared<Joined>(join_, of_a, of_b, radius_);
    return both;
  }

 private:
  Join join_;
  SolidPart a_, b_;
  double radius_;
};
SolidPart MakeJoined(Join join, const SolidPart& a, const SolidPart& b, double radius = 0) {
  return std::make_shared<Joined>(join, a, b, radius);
}

}  // namespace

double Solid::Distance(const Vector3& p) const { return MeasureOne(*node_, p); }
Solid Solid::Function(std::function<double(const Vector3&)> distance) {
  return Solid(MakeShape(0, [f = std::move(distance)](double x, double y, double z) {
    return f({x, y, z});
  }));
}

Solid Solid::Sphere(const Vector3& centre, double radius) {
  Require(radius > 0, "a radius", radius);
  return Solid(MakeShape(Largest(centre) + radius, [=](double x, double y, double z) {
    return std::sqrt(Square(x - centre[0], y - centre[1], z - centre[2])) - radius;
  }));
}
Solid Solid::Ellipsoid(const Vector3& centre, const Vector3& radii) {
  for (double r : radii) Require(r > 0, "a radius", r);
  return Solid(std::make_shared<EllipsoidNode>(centre, radii));
}
Solid Solid::Box(const Vector3& centre, const Vector3& half_size, double rounding) {
  for (double h : half_size) Require(h > rounding, "a half size less its rounding", h);
  return Solid(MakeShape(Largest(centre) + Largest(half_size), [=](double x, double y, double z) {
    const double qx = std::fabs(x - centre[0]) - (half_size[0] - rounding),
                 qy = std::fabs(y - centre[1]) - (half_size[1] - rounding),
                 qz = std::fabs(z - centre[2]) - (half_size[2] - rounding);
    return std::sqrt(Square(std::max(qx, 0.0), std::max(qy, 0.0), std::max(qz, 0.0))) +
           std::min(std::max(std::max(qx, qy), qz), 0.0) - rounding;
  }));
}
Solid Solid::Torus(const Vector3& centre, double radius, double tube) {
  Require(radius > 0 && tube > 0, "a radius", std::min(radius, tube));
  return Solid(MakeShape(Largest(centre) + radius + tube, [=](double x, double y, double z) {
    return std::hypot(std::hypot(x - centre[0], z - centre[2]) - radius, y - centre[1]) - tube;
  }));
}
Solid Solid::Capsule(const Vector3& from, const Vector3& to, double radius) {
  return Cone(from, to, radius, radius);
}
Solid Solid::Cone(const Vector3& from, const Vector3& to, double from_radius, double to_radius) {
  Require(from_radius >= 0 && to_radius >= 0 && from_radius + to_radius > 0, "a radius",
          std::min(from_radius, to_radius));
  const Vector3 axis = Minus(to, from);
  const double length = Length(axis), change = from_radius - to_radius;
  if (length <= std::fabs(change))
    return from_radius >= to_radius ? Sphere(from, from_radius) : Sphere(to, to_radius);
  // The tangent line of both circles leans by this sine.
  const double sine = change / length, cosine = std::sqrt(1 - sine * sine);
  const double size = Largest(from) + Largest(to) + from_radius + to_radius;
  return Solid(MakeShape(size, [=](double px, double py, double pz) {
    const double x = px - from[0], y = py - from[1], z = pz - from[2];
    const double along = (x * axis[0] + y * axis[1] + z * axis[2]) / length;
    const double square = Square(x, y, z);
    const double across = std::sqrt(std::max(square - along * along, 0.0));
    const double t = along - across * sine / cosine;  // where the normal of the side meets the axis
    if (t <= 0) return std::sqrt(square) - from_radius;
    if (t >= length) return std::sqrt(Square(px - to[0], py - to[1], pz - to[2])) - to_radius;
    return across * cosine + along * sine - from_radius;
  }));
}
Solid Solid::Plane(const Vector3& normal, double offset) {
  const Vector3 n = Normalized(normal);
  Require(Dot(n, n) > 0, "a normal's length", 0);
  return Solid(MakeShape(std::fabs(offset), [=](double x, double y, double z) {
    return n[0] * x + n[1] * y + n[2] * z - offset;
  }));
}

Solid Solid::Translated(const Vector3& by) const { return Solid(Change(node_, Translation{by})); }
Solid Solid::Rotated(const Vector3& axis, double degrees) const {
  const base::Turn turn = base::TurnOf(degrees);
  return Solid(Change(node_, Rotation{Normalized(axis), turn.cosine, -turn.sine}));
}
Solid Solid::Scaled(double by) const {
  Require(by > 0, "a scale", by);
  return Solid(Change(node_, Scaling{by}));
}
Solid Solid::Grown(double by) const { return Solid(Change(node_, Growth{by})); }
Solid Solid::Shell(double thickness) const { return Solid(Change(node_, Shelling{thickness / 2})); }

Solid Union(const Solid& a, const Solid& b) { return Solid(MakeJoined(Join::kUnion, a.node_, b.node_)); }
Solid Intersection(const Solid& a, const Solid& b) {
  return Solid(MakeJoined(Join::kIntersection, a.node_, b.node_));
}
Solid Difference(const Solid& a, const Solid& b) {
  return Solid(MakeJoined(Join::kDifference, a.node_, b.node_));
}
Solid SmoothUnion(const Solid& a, const Solid& b, double radius) {
  return Solid(MakeJoined(Join::kUnion, a.node_, b.node_, radius));
}
Solid SmoothIntersection(const Solid& a, const Solid& b, double radius) {
  return Solid(MakeJoined(Join::kIntersection, a.node_, b.node_, radius));
}

}  // namespace tessera
