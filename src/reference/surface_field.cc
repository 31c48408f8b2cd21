// Reference of a surface's vectors on its picture: Gram and Schmidt's process on the positions' differences,
// the quotient rule for a camera, gaps pair by pair.
#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/camera.h"
#include "tessera/ops/flow.h"

namespace tessera::reference {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Vector3 Less(const Vector3& a, const Vector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double Long(const Vector3& v) { return std::hypot(v[0], v[1], v[2]); }

class Surface {
 public:
  Surface(const Call& call, const SurfaceFieldParams& p)
      : call_(call), p_(p), window_(call.in_specs[0].data_window) {}

  struct Found {
    double value[2] = {kNone, kNone}, scale[2] = {0, 0};
  };
  Found At(int x, int y) {
    doubtful_ = false;
    const Vector3 v = Three(1, x, y);
    Found found;
    if (p_.camera) {
      ThroughCamera(x, y, v, found);
    } else {
      ByDifferences(x, y, v, found);
    }
    for (const auto& [i, j] : {std::pair(1, 0), std::pair(0, 1), std::pair(1, 1), std::pair(-1, 1)}) {
      if (Gap(x, y, i, j)) found.value[0] = found.value[1] = kNone;
    }
    if (doubtful_) call_.Undecided(x, y);
    return found;
  }

 private:
  Vector3 Three(size_t k, int x, int y) const {
    if (!window_.Contains({x, y, x + 1, y + 1})) return {kNone, kNone, kNone};
    return {call_.in[k].at(x, y, 0), call_.in[k].at(x, y, 1), call_.in[k].at(x, y, 2)};
  }
  Vector3 Point(int x, int y) const { return Three(0, x, y); }
  double Off(int x, int y) const {
    double off = 0;
    if (call_.tolerances.empty() || !window_.Contains({x, y, x + 1, y + 1})) return off;
    for (int c = 0; c < 3; ++c) off = std::max(off, call_.Tolerance(0, x, y, c));
    return off;
  }
  // Whether no surface joins (x, y) with the pixel (i, j) further.
  bool Gap(int x, int y, int i, int j) {
    if (p_.edge == 0) return false;
    double steps[3], off = 0;
    for (int k = 0; k < 3; ++k) {
      const int from = k - 1, to = k;
      steps[k] = Long(Less(Point(x + to * i, y + to * j), Point(x + from * i, y + from * j)));
      for (const int at : {from, to}) off = std::max(off, 4 * Off(x + at * i, y + at * j));
    }
    if (!std::isfinite(steps[1])) return false;
    double beside = 0;
    for (const int k : {0, 2}) {
      if (std::isfinite(steps[k])) beside = std::max(beside, steps[k]);
    }
    const double margin = std::fabs(steps[1] - p_.edge * beside);
    if (margin <= (1 + p_.edge) * off + 1e-12 * steps[1] || (off > 0 && beside <= off)) doubtful_ = true;
    return beside > 0 && steps[1] > p_.edge * beside;
  }
  std::optional<Vector3> Derivative(int x, int y, int i, int j) {
    Vector3 sum = {};
    int joined = 0;
    for (const int side : {-1, 0}) {
      const int from_x = x + side * i, from_y = y + side * j;
      const Vector3 step = Less(Point(from_x + i, from_y + j), Point(from_x, from_y));
      if (!std::isfinite(Long(step)) || Gap(from_x, from_y, i, j)) continue;
      for (size_t c = 0; c < 3; ++c) sum[c] += step[c];
      ++joined;
    }
    if (joined == 0) return std::nullopt;
    for (double& c : sum) c /= joined;
    return sum;
  }

  void ByDifferences(int x, int y, const Vector3& v, Found& found) {
    const auto px = Derivative(x, y, 1, 0), py = Derivative(x, y, 0, 1);
    if (!px || !py) return;
    const double a = Long(*px), b = Long(*py);
    if (!(a > 0 && b > 0)) return;
    // P_y without its part along P_x.
    Vector3 along, rest;
    for (size_t c = 0; c < 3; ++c) along[c] = (*px)[c] / a;
    const double shared = Dot(along, *py);
    for (size_t c = 0; c < 3; ++c) rest[c] = (*py)[c] - shared * along[c];
    const double height = Long(rest), sine = Long(Cross(*px, *py)) / (a * b);
    double off = 0;
    for (const auto& [i, j] :
         {std::pair(0, 0), std::pair(-1, 0), std::pair(1, 0), std::pair(0, -1), std::pair(0, 1)})
      off = std::max(off, 4 * Off(x + i, y + j));
    if (std::fabs(sine - 1e-10) < 1e-12 || (off > 0 && off / a + off / b > 0.25 * sine)) doubtful_ = true;
    if (!(sine > 1e-10)) return;
    found.value[1] = Dot(v, rest) / (height * height);
    found.value[0] = (Dot(v, along) - found.value[1] * shared) / a;
    const double steep = Long(v) / (sine * sine);
    found.scale[0] = 4e-8 * steep / a, found.scale[1] = 4e-8 * steep / b;
  }
  void ThroughCamera(int x, int y, const Vector3& v, Found& found) {
    const Vector3 n = Three(2, x, y), p = Point(x, y);
    const double length = Long(n);
    if (!(length > 0)) return;
    Vector3 tangent;
    const double across = Dot(v, n) / length;
    for (size_t c = 0; c < 3; ++c) tangent[c] = v[c] - across * (n[c] / length);
    const Matrix4& m = p_.camera->world_to_clip();
    const auto at = Transform(m, p);
    std::array<double, 4> moves = {}, terms = {}, parts = {};
    for (size_t r = 0; r < 4; ++r) {
      parts[r] = std::fabs(m[4 * r + 3]);
      for (size_t c = 0; c < 3; ++c) {
        moves[r] += m[4 * r + c] * tangent[c];
        terms[r] += std::fabs(m[4 * r + c]) * (std::fabs(v[c]) + std::fabs(across * n[c] / length));
        parts[r] += std::fabs(m[4 * r + c] * p[c]);
      }
    }
    const Roi& shown = call_.in_specs[0].display_window.empty() ? window_ : call_.in_specs[0].display_window;
    if (!(at[3] != 0)) return;
    const double pixels[2] = {0.5 * shown.width(), -0.5 * shown.height()};
    for (size_t r = 0; r < 2; ++r) {
      const double place = at[r] / at[3], w = std::fabs(at[3]);
      found.value[r] = pixels[r] * (moves[r] - place * moves[3]) / at[3];
      // A w that nearly cancels is off by its terms' roundings.
      const double lost = 4e-8 * parts[3] / w;
      const double size = (terms[r] + (parts[r] / w) * terms[3]) / w;
      found.scale[r] = std::fabs(pixels[r]) * size * (4e-8 + lost * (1 + parts[r] / w));
    }
  }

  const Call& call_;
  const SurfaceFieldParams& p_;
  Roi window_;
  bool doubtful_ = false;
};

void Evaluate(const Call& call) {
  Surface surface(call, std::any_cast<const SurfaceFieldParams&>(call.parameters));
  Surface::Found found;
  ForEachSample(call, [&](int x, int y, int c) {
    if (c == 0) found = surface.At(x, y);
    const auto k = static_cast<size_t>(c);
    constexpr double kMost = std::numeric_limits<float>::max();
    const bool none = !(std::fabs(found.value[0]) <= kMost) || !(std::fabs(found.value[1]) <= kMost);
    if (k == 2) return std::pair{none ? 0.0 : 1.0, 0.0};
    return none ? std::pair{0.0, 0.0} : std::pair{found.value[k], std::fabs(found.value[k]) + found.scale[k]};
  });
}

Roi Input(const std::any&, int input, const Roi& out) { return input == 0 ? Inflate(out, 2, 2) : out; }

}  // namespace

std::vector<Entry> SurfaceFieldEntries() { return {{"surfacefield", Evaluate, Input}}; }

}  // namespace tessera::reference
