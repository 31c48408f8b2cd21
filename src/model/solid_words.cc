// Solids from words.
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tessera/error.h"
#include "tessera/volume.h"

namespace tessera {
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
