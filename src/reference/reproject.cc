// Reference of reproject: rays of the new camera against every triangle that may be there, in space and in
// double.
#include "tessera/ops/reproject.h"

#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "reference/reference.h"
#include "tessera/camera.h"

namespace tessera::reference {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();

const Roi& FrameOf(const ImageSpec& spec) {
  return spec.display_window.empty() ? spec.data_window : spec.display_window;
}
Vector3 Difference(const Vector3& a, const Vector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
// Where a camera shows a point, in pixels.
std::array<double, 2> PlaceOf(const Camera& camera, const Roi& frame, const Vector3& p) {
  const auto clip = Transform(camera.world_to_clip(), p);
  return {frame.x0 + frame.width() * (clip[0] / clip[3] + 1) / 2,
          frame.y0 + frame.height() * (1 - clip[1] / clip[3]) / 2};
}

class Scene {
 public:
  struct Piece {  // of a pixel, the upper right or the lower left
    int x, y;
    Vector3 a, b, c;
    bool upper;                         // the other one lies across from b, else across from c
    std::array<double, 4> bounds = {};  // of the result's places that may show it, generously
  };

  Scene(const Call& call, const ReprojectParams& p)
      : call_(call),
        p_(p),
        depth_(call.in[1]),
        from_(FrameOf(call.in_specs[0])),
        to_(FrameOf(call.out_spec)) {
    const Roi& r = depth_.roi;
    for (int y = r.y0; y < r.y1; ++y) {
      for (int x = r.x0; x < r.x1; ++x) AddPixel(x, y);
    }
    rows_.resize(static_cast<size_t>(to_.height()));
    for (size_t k = 0; k < pieces_.size(); ++k) {
      for (size_t row = RowOf(pieces_[k].bounds[1]); row <= RowOf(pieces_[k].bounds[3]); ++row)
        rows_[row].push_back(k);
    }
  }
  const std::vector<Piece>& pieces() const { return pieces_; }
  const Roi& to() const { return to_; }

  bool Usable(int x, int y) const {
    const Roi& r = depth_.roi;
    if (x < r.x0 || x >= r.x1 || y < r.y0 || y >= r.y1) return false;
    const double z = depth_.at(x, y, 0);
    return std::isfinite(z) && (!p_.from.perspective() || z > 0);
  }
  // Side by side or across a corner. Remembers whether any answer hangs on roundings.
  bool Joined(int x0, int y0, int x1, int y1) const {
    if (!Usable(x0, y0) || !Usable(x1, y1)) return false;
    const double a = depth_.at(x0, y0, 0), b = depth_.at(x1, y1, 0);
    const double limit = p_.tear * std::min(std::fabs(a), std::fabs(b)), apart = std::fabs(a - b);
    const double off = call_.Tolerance(1, x0, y0, 0) + call_.Tolerance(1, x1, y1, 0);
    if (std::fabs(apart - limit) <= (1 + p_.tear) * off + 1e-12 * limit) doubtful_ = true;
    return apart <= limit;
  }
  bool TakeDoubt() const {
    const bool doubtful = doubtful_;
    doubtful_ = false;
    return doubtful;
  }

  // The nearest piece on the ray, given how far beyond its edges a piece reaches, and which of two at the
  // same depth is taken.
  struct Seen {
    const Piece* piece = nullptr;
    double depth = kNothing;
    double u = 0, v = 0;
  };
  Seen Look(double x, double y, double hair, bool last) const {
    const Camera::Ray ray = p_.to.PixelRay(to_, x - 0.5, y - 0.5);
    Seen seen;
    for (const size_t k : rows_[RowOf(y)]) {
      const Piece& piece = pieces_[k];
      const auto& [left, upper, right, lower] = piece.bounds;
      if (!(x >= left && x <= right && y >= upper && y <= lower)) continue;
      const double t = Meet(ray, piece, hair);
      if (!(t < kNothing)) continue;
      const double same = 1e-9 * std::fabs(t);
      if (!(seen.piece == nullptr || t < seen.depth - same || (last && t <= seen.depth + same))) continue;
      seen.piece = &piece, seen.depth = t;
    }
    if (seen.piece == nullptr) return seen;
    Vector3 world;
    for (size_t k = 0; k < 3; ++k) world[k] = ray.origin[k] + seen.depth * ray.direction[k];
    const auto place = PlaceOf(p_.from, from_, world);
    const Piece& q = *seen.piece;
    seen.u = std::isfinite(place[0]) ? std::clamp(place[0], q.x + 0.0, q.x + 1.0) : q.x + 0.5;
    seen.v = std::isfinite(place[1]) ? std::clamp(place[1], q.y + 0.0, q.y + 1.0) : q.y + 0.5;
    return seen;
  }
  double Color(const Seen& seen, int channel, double* largest) const {
    const double left = std::floor(seen.u - 0.5), upper = std::floor(seen.v - 0.5);
    // Beside the middle of a pixel roundings say which neighbour has next to no weight, and the other none.
    constexpr double kNext = 1 + 1e-9;
    double sum = 0;
    for (const int j : {-1, 0, 1, 2}) {
      for (const int i : {-1, 0, 1, 2}) {
        const double across = std::fabs(left + i - (seen.u - 0.5)),
                     down = std::fabs(upper + j - (seen.v - 0.5));
        if (across > kNext || down > kNext) continue;
        const double weight = across < 1 && down < 1 ? (1 - across) * (1 - down) : 0;
        int x = static_cast<int>(left) + i, y = static_cast<int>(upper) + j;
        const bool own = x == seen.piece->x && y == seen.piece->y;
        if (!own && !Joined(seen.piece->x, seen.piece->y, x, y)) x = seen.piece->x, y = seen.piece->y;
        const double value = call_.in[0].at(x, y, channel);
        if (weight > 0) sum += weight * value;
        if (weight < 1e-9 && !std::isfinite(value)) {
          doubtful_ = true;
        } else if (!(std::fabs(value) <= *largest)) {
          *largest = std::fabs(value);
        }
      }
    }
    return sum;
  }
  // Places of the result near which whether pixels hang together is not certain.
  bool IsDoubtful(double x, double y) const {
    for (const std::array<double, 4>& d : doubts_) {
      if (x >= d[0] && y >= d[1] && x <= d[2] && y <= d[3]) return true;
    }
    return false;
  }

 private:
  // The row of the result that has y, or the nearest.
  size_t RowOf(double y) const {
    return static_cast<size_t>(std::clamp(std::floor(y) - to_.y0, 0.0, to_.height() - 1.0));
  }
  // The pixels around the corner (cx, cy) that can be reached from (x, y) by sides.
  double CornerDepth(int x, int y, int cx, int cy) const {
    std::vector<std::array<int, 2>> group = {{x, y}};
    for (size_t k = 0; k < group.size(); ++k) {
      const auto [gx, gy] = group[k];
      const std::array<int, 2> beside[2] = {{2 * cx - 1 - gx, gy}, {gx, 2 * cy - 1 - gy}};
      for (const auto& q : beside) {
        if (Joined(gx, gy, q[0], q[1]) && std::find(group.begin(), group.end(), q) == group.end())
          group.push_back(q);
      }
    }
    double sum = 0;
    for (const auto& q : group) {
      const double z = depth_.at(q[0], q[1], 0);
      sum += p_.from.perspective() ? 1 / z : z;
    }
    sum /= static_cast<double>(group.size());
    return p_.from.perspective() ? 1 / sum : sum;
  }
  void AddPixel(int x, int y) {
    if (!Usable(x, y)) return;
    doubtful_ = false;
    Vector3 corner[2][2];
    bool behind = false;
    std::array<double, 4> bounds = {kNothing, kNothing, -kNothing, -kNothing};
    for (const int j : {0, 1}) {
      for (const int i : {0, 1}) {
        const Camera::Ray ray = p_.from.PixelRay(from_, x + i - 0.5, y + j - 0.5);
        const double t = CornerDepth(x, y, x + i, y + j);
        for (size_t k = 0; k < 3; ++k) corner[j][i][k] = ray.origin[k] + t * ray.direction[k];
        behind = behind || !(Transform(p_.to.world_to_clip(), corner[j][i])[3] > 0);
        const auto at = PlaceOf(p_.to, to_, corner[j][i]);
        behind = behind || !std::isfinite(at[0]) || !std::isfinite(at[1]);
        bounds = {std::min(bounds[0], at[0]), std::min(bounds[1], at[1]), std::max(bounds[2], at[0]),
                  std::max(bounds[3], at[1])};
      }
    }
    if (TakeDoubt()) {
      const double all = behind ? kNothing : 1;
      doubts_.push_back({bounds[0] - all, bounds[1] - all, bounds[2] + all, bounds[3] + all});
    }
    if (behind) return;
    const double margin = 0.01 + 1e-4 * (bounds[2] - bounds[0] + bounds[3] - bounds[1]);
    bounds = {bounds[0] - margin, bounds[1] - margin, bounds[2] + margin, bounds[3] + margin};
    pieces_.push_back({x, y, corner[0][0], corner[0][1], corner[1][1], true, bounds});
    pieces_.push_back({x, y, corner[0][0], corner[1][1], corner[1][0], false, bounds});
  }
  // Depth at which a ray meets a piece that shows both cameras the same side; nothing else.
  double Meet(const Camera::Ray& ray, const Piece& piece, double hair) const {
    const Vector3 ab = Difference(piece.b, piece.a), ac = Difference(piece.c, piece.a);
    const Vector3 normal = Cross(ab, ac);
    const auto side = [&](const Camera& c) {
      return Dot(normal, c.perspective() ? Difference(piece.a, c.eye()) : c.forward());
    };
    if (!(side(p_.from) * side(p_.to) > 0)) return kNothing;
    // Moeller and Trumbore.
    const Vector3 across = Cross(ray.direction, ac);
    const double determinant = Dot(ab, across);
    if (determinant == 0) return kNothing;
    const Vector3 offset = Difference(ray.origin, piece.a);
    const double b = Dot(offset, across) / determinant;
    const Vector3 along = Cross(offset, ab);
    const double c = Dot(ray.direction, along) / determinant;
    // Its two pieces are one, however narrow.
    const double other = std::max(hair, 1e-9);
    if (!(b >= -(piece.upper ? other : hair) && c >= -(piece.upper ? hair : other) && b + c <= 1 + hair)) {
      return kNothing;
    }
    return Dot(ac, along) / determinant;
  }

  const Call& call_;
  const ReprojectParams& p_;
  const ImageD& depth_;
  const Roi from_, to_;
  mutable bool doubtful_ = false;
  std::vector<std::array<double, 4>> doubts_;
  std::vector<Piece> pieces_;
  std::vector<std::vector<size_t>> rows_;  // of the result: the pieces that may be there
};

void EvaluateReproject(const Call& call) {
  const auto& p = std::any_cast<const ReprojectParams&>(call.parameters);
  const Scene scene(call, p);
  const int n = p.samples, colors = call.in[0].channels;
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    call.Check();
    for (int x = r.x0; x < r.x1; ++x) {
      std::vector<double> sum(static_cast<size_t>(call.out.channels)), other(sum), largest(sum);
      for (int k = 0; k < n * n; ++k) {
        const double px = x + (k % n + 0.5) / n, py = y + (k / n + 0.5) / n;
        // As wide as pieces are, and a little wider or narrower: where that makes a difference, it may be
        // taken.
        const Scene::Seen seen = scene.Look(px, py, 1e-9, false), narrow = scene.Look(px, py, -1e-7, true),
                          wide = scene.Look(px, py, 1e-7, true);
        if (scene.IsDoubtful(px, py)) call.Undecided(x, y);
        scene.TakeDoubt();
        for (int c = 0; c < call.out.channels; ++c) {
          const auto channel = static_cast<size_t>(c);
          const auto value = [&](const Scene::Seen& s) {
            if (s.piece == nullptr) return 0.0;
            return c < colors ? scene.Color(s, c, &largest[channel]) : 1.0;
          };
          const double v = value(seen), a = value(narrow), b = value(wide);
          sum[channel] += v;
          if (c >= colors) largest[channel] = 1;
          other[channel] += std::max(std::fabs(v - a), std::fabs(v - b));
        }
        if (scene.TakeDoubt()) call.Undecided(x, y);
      }
      for (int c = 0; c < call.out.channels; ++c) {
        const auto channel = static_cast<size_t>(c);
        call.out.at(x, y, c) = sum[channel] / (n * n);
        if (other[channel] > 0x1p-26 * largest[channel]) call.Undecided(x, y, c, other[channel] / (n * n));
        if (call.scale != nullptr) call.scale->at(x, y, c) = std::max(largest[channel], 1e-30);
      }
    }
  }
}

Roi Everything(const std::any&, int, const Roi&) {
  return {INT32_MIN / 2, INT32_MIN / 2, INT32_MAX / 2, INT32_MAX / 2};
}

}  // namespace

std::vector<Entry> ReprojectEntries() { return {{"reproject", EvaluateReproject, Everything}}; }

}  // namespace tessera::reference
