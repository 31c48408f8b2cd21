// Pictures with depth as surfaces, and what another camera sees of them.
#include "ops/shade/depth_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace tessera::ops {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Of a triangle: as far beyond an edge still belongs to it, so that no place between two is missed.
constexpr double kHair = 1e-9;

Vector3 Minus(const Vector3& a, const Vector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

// In pixels of a picture shown in `frame`.
void Pixel(const std::array<double, 4>& clip, const Roi& frame, double* x, double* y) {
  *x = frame.x0 + (clip[0] / clip[3] + 1) / 2 * frame.width();
  *y = frame.y0 + (1 - clip[1] / clip[3]) / 2 * frame.height();
}

}  // namespace

DepthMesh::DepthMesh(const ConstImageView& depth, const Roi& from_frame, const Roi& to_frame,
                     const ReprojectParams& params, const graph::Workers& workers)
    : depth_(depth), from_frame_(from_frame), to_frame_(to_frame), params_(params) {
  const Roi& w = depth_.roi;
  if (w.empty()) return;
  columns_ = (w.width() + kBlock - 1) / kBlock, rows_ = (w.height() + kBlock - 1) / kBlock;
  blocks_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows_));
  workers.For(rows_, [&](int64_t row, int) {
    for (int column = 0; column < columns_; ++column) {
      const int x0 = w.x0 + column * kBlock, y0 = w.y0 + static_cast<int>(row) * kBlock;
      Roi bounds{};
      Corner corners[4];
      for (int y = y0; y < std::min(y0 + kBlock, w.y1); ++y) {
        for (int x = x0; x < std::min(x0 + kBlock, w.x1); ++x) {
          if (QuadOf(x, y, corners)) bounds = Union(bounds, BoundsOf(corners));
        }
      }
      blocks_[static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column)] =
          bounds;
    }
  });
}

bool DepthMesh::Valid(int x, int y, float* depth) const {
  const Roi& w = depth_.roi;
  if (x < w.x0 || y < w.y0 || x >= w.x1 || y >= w.y1) return false;
  *depth = *reinterpret_cast<const float*>(depth_.At(x, y));
  return std::isfinite(*depth) && (*depth > 0 || !params_.from.perspective());
}

bool DepthMesh::Joined(int x0, int y0, int x1, int y1) const {
  float a, b;
  if (!Valid(x0, y0, &a) || !Valid(x1, y1, &b)) return false;
  const double nearer = std::min(std::fabs(double{a}), std::fabs(double{b}));
  return std::fabs(double{a} - double{b}) <= params_.tear * nearer;
}

// The mean over the pixels around a corner that hang together with this one there: of what is linear across a
// plane that is seen in perspective, 1/depth.
double DepthMesh::CornerDepth(int x, int y, int corner_x, int corner_y) const {
  bool member[4] = {};
  const auto column = [&](int k) { return corner_x - 1 + k % 2; };
  const auto row = [&](int k) { return corner_y - 1 + k / 2; };
  member[(y - corner_y + 1) * 2 + x - corner_x + 1] = true;
  constexpr int kSides[4][2] = {{0, 1}, {0, 2}, {1, 3}, {2, 3}};
  bool joined[4];
  for (int k = 0; k < 4; ++k) {
    joined[k] = Joined(column(kSides[k][0]), row(kSides[k][0]), column(kSides[k][1]), row(kSides[k][1]));
  }
  for (int round = 0; round < 3; ++round) {
    for (int k = 0; k < 4; ++k) {
      if (joined[k])
        member[kSides[k][0]] = member[kSides[k][1]] = member[kSides[k][0]] || member[kSides[k][1]];
    }
  }
  const bool inverse = params_.from.perspective();
  double sum = 0, count = 0;
  for (int k = 0; k < 4; ++k) {
    float depth;
    if (!member[k] || !Valid(column(k), row(k), &depth)) continue;
    sum += inverse ? 1 / double{depth} : double{depth}, ++count;
  }
  return inverse ? count / sum : sum / count;
}

bool DepthMesh::QuadOf(int x, int y, Corner (&corners)[4]) const {
  float depth;
  if (!Valid(x, y, &depth)) return false;
  for (int k = 0; k < 4; ++k) {
    const int cx = x + k % 2, cy = y + k / 2;
    const Camera::Ray ray = params_.from.PixelRay(from_frame_, cx - 0.5, cy - 0.5);
    const double t = CornerDepth(x, y, cx, cy);
    Corner& c = corners[k];
    for (size_t i = 0; i < 3; ++i) c.world[i] = ray.origin[i] + t * ray.direction[i];
    const std::array<double, 4> clip = Transform(params_.to.world_to_clip(), c.world);
    if (!(clip[3] > 0)) return false;
    Pixel(clip, to_frame_, &c.x, &c.y);
    c.w = clip[3];
    if (!std::isfinite(c.x) || !std::isfinite(c.y)) return false;
  }
  return true;
}

Roi DepthMesh::BoundsOf(const Corner (&c)[4]) const {
  const auto [left, right] = std::minmax({c[0].x, c[1].x, c[2].x, c[3].x});
  const auto [upper, lower] = std::minmax({c[0].y, c[1].y, c[2].y, c[3].y});
  const Roi& f = to_frame_;
  if (!(left < f.x1 && right > f.x0 && upper < f.y1 && lower > f.y0)) return {};
  const auto at = [](double v, int low, int high) {
    return static_cast<int>(std::clamp(std::floor(v), double{1} * low, double{1} * high));
  };
  return {at(left - kHair, f.x0, f.x1 - 1), at(upper - kHair, f.y0, f.y1 - 1),
          at(right + kHair, f.x0, f.x1 - 1) + 1, at(lower + kHair, f.y0, f.y1 - 1) + 1};
}

// Seen by both cameras from the same side.
bool DepthMesh::Faces(const Corner& a, const Corner& b, const Corner& c) const {
  const Vector3 normal = Cross(Minus(b.world, a.world), Minus(c.world, a.world));
  const auto side = [&](const Camera& camera) {
    return Dot(normal, camera.perspective() ? Minus(a.world, camera.eye()) : camera.forward());
  };
  return side(params_.from) * side(params_.to) > 0;
}

void DepthMesh::Triangle(const Corner& a, const Corner& b, const Corner& c, int x, int y, const Roi& roi,
                         std::span<Hit> hits) const {
  if (!Faces(a, b, c)) return;
  const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (area == 0) return;
  const int n = params_.samples;
  const auto first = [&](double low, int from) {  // the first place that is not before
    return static_cast<int>(std::max(0.0, std::ceil((low - kHair - from) * n - 0.5)));
  };
  const auto last = [&](double high, int from, int size) {
    return static_cast<int>(std::min(double{1} * size * n - 1, std::floor((high + kHair - from) * n - 0.5)));
  };
  const auto [left, right] = std::minmax({a.x, b.x, c.x});
  const auto [upper, lower] = std::minmax({a.y, b.y, c.y});
  if (!(left < roi.x1 && right > roi.x0 && upper < roi.y1 && lower > roi.y0)) return;
  const int i0 = first(left, roi.x0), i1 = last(right, roi.x0, roi.width());
  const int j0 = first(upper, roi.y0), j1 = last(lower, roi.y0, roi.height());
  for (int j = j0; j <= j1; ++j) {
    const double py = roi.y0 + j / n + (j % n + 0.5) / n;  // whatever the region
    for (int i = i0; i <= i1; ++i) {
      const double px = roi.x0 + i / n + (i % n + 0.5) / n;
      const double wa = ((b.x - px) * (c.y - py) - (b.y - py) * (c.x - px)) / area;
      const double wb = ((c.x - px) * (a.y - py) - (c.y - py) * (a.x - px)) / area;
      const double wc = ((a.x - px) * (b.y - py) - (a.y - py) * (b.x - px)) / area;
      if (!(wa >= -kHair && wb >= -kHair && wc >= -kHair)) continue;
      // Straight lines in space are so on the screen after division.
      const double ka = wa / a.w, kb = wb / b.w, kc = wc / c.w, sum = ka + kb + kc;
      Vector3 world;
      for (size_t k = 0; k < 3; ++k) {
        world[k] = (ka * a.world[k] + kb * b.world[k] + kc * c.world[k]) / sum;
      }
      const double depth = params_.to.PlanarDepth(world);
      const size_t pixel =
          static_cast<size_t>(j / n) * static_cast<size_t>(roi.width()) + static_cast<size_t>(i / n);
      Hit& hit = hits[(pixel * static_cast<size_t>(n) + static_cast<size_t>(j % n)) * static_cast<size_t>(n) +
                      static_cast<size_t>(i % n)];
      if (!(depth < hit.depth)) continue;
      hit.depth = depth, hit.x = x, hit.y = y;
      Pixel(Transform(params_.from.world_to_clip(), world), from_frame_, &hit.u, &hit.v);
      hit.u = std::isfinite(hit.u) ? std::clamp(hit.u, x + 0.0, x + 1.0) : x + 0.5;
      hit.v = std::isfinite(hit.v) ? std::clamp(hit.v, y + 0.0, y + 1.0) : y + 0.5;
    }
  }
}

void DepthMesh::Rasterize(const Roi& roi, std::span<Hit> hits) const {
  std::fill(hits.begin(), hits.end(), Hit{kInfinity, 0, 0, 0, 0});
  const Roi& w = depth_.roi;
  Corner c[4];
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const size_t block =
          static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column);
      if (Intersection(blocks_[block], roi).empty()) continue;
      const int x0 = w.x0 + column * kBlock, y0 = w.y0 + row * kBlock;
      for (int y = y0; y < std::min(y0 + kBlock, w.y1); ++y) {
        for (int x = x0; x < std::min(x0 + kBlock, w.x1); ++x) {
          if (!QuadOf(x, y, c) || Intersection(BoundsOf(c), roi).empty()) continue;
          Triangle(c[0], c[1], c[3], x, y, roi, hits);
          Triangle(c[0], c[3], c[2], x, y, roi, hits);
        }
      }
    }
  }
}

}  // namespace tessera::ops
