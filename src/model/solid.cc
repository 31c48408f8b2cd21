// Solids as signed distances, their combinations, and their words.
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <string_view>

#include "base/number_text.h"
#include "base/turn.h"
#include "tessera/error.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

Vector3 Minus(const Vector3& a, const Vector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double Length(const Vector3& v) { return std::sqrt(Dot(v, v)); }

void Require(bool valid, const char* what, double found) {
  if (!valid) {
    throw Error("solid", std::string("found ") + what + " of " + base::NumberText(found) +
                             ", expected a positive number");
  }
}

// Polynomial blend: how much lower than the smaller of two distances the blended one is.
double Blend(double a, double b, double radius) {
  const double h = std::max(radius - std::fabs(a - b), 0.0);
  return radius > 0 ? h * h / (4 * radius) : 0;
}

}  // namespace

double Solid::Distance(const Vector3& p) const { return distance_(p); }
Solid Solid::Function(std::function<double(const Vector3&)> distance) { return Solid(std::move(distance)); }

Solid Solid::Sphere(const Vector3& centre, double radius) {
  Require(radius > 0, "a radius", radius);
  return Solid([=](const Vector3& p) { return Length(Minus(p, centre)) - radius; });
}
Solid Solid::Ellipsoid(const Vector3& centre, const Vector3& radii) {
  for (double r : radii) Require(r > 0, "a radius", r);
  const double smallest = *std::min_element(radii.begin(), radii.end());
  return Solid([=](const Vector3& p) {
    const Vector3 q = Minus(p, centre);
    const Vector3 s = {q[0] / radii[0], q[1] / radii[1], q[2] / radii[2]};
    const Vector3 t = {s[0] / radii[0], s[1] / radii[1], s[2] / radii[2]};
    const double k = Length(s), slope = Length(t);
    // Near the surface (k - 1) k / |grad|; never more than the smallest radius' scale allows.
    if (slope == 0) return -smallest;
    const double near = (k - 1) * k / slope;
    return k < 1 ? std::max(near, (k - 1) * *std::max_element(radii.begin(), radii.end()))
                 : std::max((k - 1) * smallest, std::min(near, Length(q)));
  });
}
Solid Solid::Box(const Vector3& centre, const Vector3& half_size, double rounding) {
  for (double h : half_size) Require(h > rounding, "a half size less its rounding", h);
  return Solid([=](const Vector3& p) {
    Vector3 q;
    for (size_t a = 0; a < 3; ++a) q[a] = std::fabs(p[a] - centre[a]) - (half_size[a] - rounding);
    const Vector3 out = {std::max(q[0], 0.0), std::max(q[1], 0.0), std::max(q[2], 0.0)};
    return Length(out) + std::min(std::max({q[0], q[1], q[2]}), 0.0) - rounding;
  });
}
Solid Solid::Torus(const Vector3& centre, double radius, double tube) {
  Require(radius > 0 && tube > 0, "a radius", std::min(radius, tube));
  return Solid([=](const Vector3& p) {
    const Vector3 q = Minus(p, centre);
    return std::hypot(std::hypot(q[0], q[2]) - radius, q[1]) - tube;
  });
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
  return Solid([=](const Vector3& p) {
    const Vector3 q = Minus(p, from);
    const double along = Dot(q, axis) / length;
    const double across = std::sqrt(std::max(Dot(q, q) - along * along, 0.0));
    const double t = along - across * sine / cosine;  // where the normal of the side meets the axis
    if (t <= 0) return Length(q) - from_radius;
    if (t >= length) return Length(Minus(p, to)) - to_radius;
    return across * cosine + along * sine - from_radius;
  });
}
Solid Solid::Plane(const Vector3& normal, double offset) {
  const Vector3 n = Normalized(normal);
  Require(Dot(n, n) > 0, "a normal's length", 0);
  return Solid([=](const Vector3& p) { return Dot(n, p) - offset; });
}

Solid Solid::Translated(const Vector3& by) const {
  return Solid([f = distance_, by](const Vector3& p) { return f(Minus(p, by)); });
}
Solid Solid::Rotated(const Vector3& axis, double degrees) const {
  const Vector3 n = Normalized(axis);
  const double c = base::TurnOf(degrees).cosine, s = -base::TurnOf(degrees).sine;
  return Solid([f = distance_, n, c, s](const Vector3& p) {
    const Vector3 side = Cross(n, p);
    const double along = Dot(n, p) * (1 - c);
    return f({p[0] * c + side[0] * s + n[0] * along, p[1] * c + side[1] * s + n[1] * along,
              p[2] * c + side[2] * s + n[2] * along});
  });
}
Solid Solid::Scaled(double by) const {
  Require(by > 0, "a scale", by);
  return Solid([f = distance_, by](const Vector3& p) { return by * f({p[0] / by, p[1] / by, p[2] / by}); });
}
Solid Solid::Grown(double by) const {
  return Solid([f = distance_, by](const Vector3& p) { return f(p) - by; });
}
Solid Solid::Shell(double thickness) const {
  return Solid([f = distance_, half = thickness / 2](const Vector3& p) { return std::fabs(f(p)) - half; });
}

Solid Union(const Solid& a, const Solid& b) {
  return Solid([f = a.distance_, g = b.distance_](const Vector3& p) { return std::min(f(p), g(p)); });
}
Solid Intersection(const Solid& a, const Solid& b) {
  return Solid([f = a.distance_, g = b.distance_](const Vector3& p) { return std::max(f(p), g(p)); });
}
Solid Difference(const Solid& a, const Solid& b) {
  return Solid([f = a.distance_, g = b.distance_](const Vector3& p) { return std::max(f(p), -g(p)); });
}
Solid SmoothUnion(const Solid& a, const Solid& b, double radius) {
  return Solid([f = a.distance_, g = b.distance_, radius](const Vector3& p) {
    const double u = f(p), v = g(p);
    return std::min(u, v) - Blend(u, v, radius);
  });
}
Solid SmoothIntersection(const Solid& a, const Solid& b, double radius) {
  return Solid([f = a.distance_, g = b.distance_, radius](const Vector3& p) {
    const double u = f(p), v = g(p);
    return std::max(u, v) + Blend(u, v, radius);
  });
}

namespace {

// A seated figure: one connected body with round and thin parts, hollows and a hole, inside [-0.8, 0.8]^3.
Solid Body() {
  Solid s = Solid::Ellipsoid({0, -0.28, 0}, {0.34, 0.40, 0.30});   // trunk
  s = SmoothUnion(s, Solid::Sphere({0, 0.34, 0.02}, 0.27), 0.16);  // head
  for (const double side : {-1.0, 1.0}) {
    s = SmoothUnion(s, Solid::Cone({side * 0.17, 0.52, 0}, {side * 0.27, 0.74, -0.02}, 0.085, 0.035),
                    0.06);  // ears
    s = SmoothUnion(s, Solid::Cone({side * 0.26, -0.10, 0.04}, {side * 0.50, -0.30, 0.24}, 0.115, 0.085),
                    0.08);
    s = SmoothUnion(s, Solid::Capsule({side * 0.50, -0.30, 0.24}, {side * 0.24, -0.42, 0.42}, 0.085), 0.05);
    s = SmoothUnion(s, Solid::Cone({side * 0.22, -0.58, 0.04}, {side * 0.42, -0.66, 0.40}, 0.15, 0.10), 0.10);
    s = SmoothUnion(s, Solid::Ellipsoid({side * 0.43, -0.62, 0.50}, {0.10, 0.13, 0.085}), 0.05);  // feet
    s = Difference(s, Solid::Sphere({side * 0.105, 0.40, 0.265}, 0.055));                         // eyes
  }
  s = SmoothUnion(s, Solid::Ellipsoid({0, 0.27, 0.25}, {0.11, 0.085, 0.10}), 0.07);  // snout
  const Solid tail = Solid::Torus({0, 0, 0}, 0.20, 0.055).Rotated({1, 0, 0}, 90).Rotated({0, 1, 0}, 90);
  return SmoothUnion(s, tail.Translated({0, -0.42, -0.42}), 0.07);
}

// Words of a solid, read by descent.
class SolidReader {
 public:
  explicit SolidReader(const std::string& text) : text_(text) {}

  Solid Read() {
    Solid s = Expression();
    Skip();
    if (at_ < text_.size()) Refuse("an operator |, & or -");
    return s;
  }

 private:
  [[noreturn]] void Refuse(const std::string& expected) const {
    const std::string rest = text_.substr(at_, 24);
    throw Error("solid",
                "found " +
                    (rest.empty() ? "the end of \"" + text_.substr(0, 60) + "\"" : "\"" + rest + "\"") +
                    ", expected " + expected);
  }
  void Skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  bool Take(char c) {
    Skip();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  double Number() {
    Skip();
    double v = 0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), v);
    if (error != std::errc() || !std::isfinite(v)) Refuse("a number");
    at_ = static_cast<size_t>(end - text_.data());
    return v;
  }
  double Radius() {  // of a blend, right behind its operator
    const bool digit =
        at_ < text_.size() && (std::isdigit(static_cast<unsigned char>(text_[at_])) || text_[at_] == '.');
    return digit ? Number() : 0;
  }

  Solid Expression() {
    Solid s = Term();
    for (;;) {
      if (Take('|')) {
        const double r = Radius();
        const Solid t = Term();
        s = r > 0 ? SmoothUnion(s, t, r) : Union(s, t);
      } else if (Take('&')) {
        const double r = Radius();
        const Solid t = Term();
        s = r > 0 ? SmoothIntersection(s, t, r) : Intersection(s, t);
      } else if (Take('-')) {
        s = Difference(s, Term());
      } else {
        return s;
      }
    }
  }

  Solid Term() {
    if (Take('(')) {
      Solid s = Expression();
      if (!Take(')')) Refuse("a closing parenthesis");
      return s;
    }
    Skip();
    std::string name;
    while (at_ < text_.size() && std::isalpha(static_cast<unsigned char>(text_[at_]))) name += text_[at_++];
    std::vector<double> v;
    if (Take('(')) {
      do v.push_back(Number());
      while (Take(','));
      if (!Take(')')) Refuse("a closing parenthesis");
    }
    return Named(name, v);
  }

  Solid Named(const std::string& name, const std::vector<double>& v) {
    static const std::map<std::string, std::pair<size_t, const char*>> kNumbers = {
        {"sphere", {4, "x,y,z,radius"}},
        {"ellipsoid", {6, "x,y,z,rx,ry,rz"}},
        {"box", {6, "x,y,z,half width,half height,half depth"}},
        {"roundbox", {7, "x,y,z,half width,half height,half depth,rounding"}},
        {"torus", {5, "x,y,z,radius,tube"}},
        {"capsule", {7, "x,y,z to x,y,z,radius"}},
        {"cone", {8, "x,y,z to x,y,z,radius,radius"}},
        {"plane", {4, "normal x,y,z,offset"}},
        {"body", {0, "no numbers"}},
        {"knot", {0, "no numbers"}}};
    const auto known = kNumbers.find(name);
    if (known == kNumbers.end()) {
      std::string names;
      for (const auto& [n, unused] : kNumbers) names += (names.empty() ? "" : ", ") + n;
      throw Error("solid", "found \"" + name + "\", expected one of " + names);
    }
    if (v.size() != known->second.first) {
      throw Error("solid", "found " + std::to_string(v.size()) + " numbers for " + name + ", expected " +
                               std::to_string(known->second.first) + ": " + known->second.second);
    }
    const auto at = [&](size_t i) { return Vector3{v[i], v[i + 1], v[i + 2]}; };
    if (name == "sphere") return Solid::Sphere(at(0), v[3]);
    if (name == "ellipsoid") return Solid::Ellipsoid(at(0), at(3));
    if (name == "box") return Solid::Box(at(0), at(3));
    if (name == "roundbox") return Solid::Box(at(0), at(3), v[6]);
    if (name == "torus") return Solid::Torus(at(0), v[3], v[4]);
    if (name == "capsule") return Solid::Capsule(at(0), at(3), v[6]);
    if (name == "cone") return Solid::Cone(at(0), at(3), v[6], v[7]);
    if (name == "plane") return Solid::Plane(at(0), v[3]);
    if (name == "body") return Body();
    const Solid ring = Solid::Torus({0, 0, 0}, 0.46, 0.15);
    const Solid crossed = ring.Rotated({1, 0, 0}, 90).Translated({0.22, 0, 0});
    return SmoothUnion(ring.Translated({-0.22, 0, 0}), crossed, 0.08);
  }

  const std::string& text_;
  size_t at_ = 0;
};

}  // namespace

Solid Solid::Parse(const std::string& words) { return SolidReader(words).Read(); }

}  // namespace tessera
