// Reference of volume pictures: every ray in small fixed steps, in double, without leaps.
#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "ops/volume/settings.h"
#include "reference/reference.h"
#include "reference/volume_substance.h"

namespace tessera::reference {
namespace {

using ops::volume::VolumeDraw;
using Result = std::array<double, 5>;  // R, G, B, A, Z
constexpr double kEndless = std::numeric_limits<double>::infinity();

// One ray in world space; t is the planar depth.
struct Ray {
  Vector3 origin, direction;
  double enter = 0, begin = 0, end = 0;
  bool misses = false;
};

class Picture {
 public:
  explicit Picture(const VolumeDraw& draw)
      : draw_(draw), p_(draw.params), v_(draw.volume.spec()), substance_(draw) {}

  // The ray of a pixel, moved; clipped to the volume, the planes and the scene.
  Ray RayOf(double x, double y, double scene, const Vector3& moved) const {
    const Camera::Ray r = p_.camera.PixelRay(draw_.window, x, y);
    Ray ray{Add(r.origin, moved), r.direction};
    ray.enter = p_.camera.perspective() ? 0 : -kEndless;
    ray.end = std::isnan(scene) ? -kEndless : scene;
    const Vector3 low = v_.Low(), high = v_.High();
    for (size_t a = 0; a < 3; ++a) {
      if (ray.direction[a] == 0) {
        ray.misses |= ray.origin[a] < low[a] || ray.origin[a] > high[a];
        continue;
      }
      const double u = (low[a] - ray.origin[a]) / ray.direction[a],
                   w = (high[a] - ray.origin[a]) / ray.direction[a];
      ray.enter = std::max(ray.enter, std::min(u, w));
      ray.end = std::min(ray.end, std::max(u, w));
    }
    ray.begin = ray.enter;
    for (const CuttingPlane& plane : p_.planes) {
      const double above = Dot(plane.normal, ray.origin) - plane.offset,
                   rise = Dot(plane.normal, ray.direction);
      if (rise > 0) ray.begin = std::max(ray.begin, -above / rise);
      if (rise < 0) ray.end = std::min(ray.end, -above / rise);
      ray.misses |= rise == 0 && above < 0;
    }
    ray.misses |= !(ray.begin < ray.end);
    return ray;
  }
  bool IsSurface() const { return p_.mode <= VolumeMode::kMelt; }
  Result Draw(double x, double y, double scene, const Vector3& moved) const {
    const Ray ray = RayOf(x, y, scene, moved);
    return IsSurface() ? Surface(ray, ray.misses) : Medium(ray, ray.misses);
  }
  // Lit colour and extinction at planar depth t, of the segment of `half` before and behind.
  std::array<double, 4> Light(const Ray& ray, double t, double half) const {
    const bool hyper = p_.mode >= VolumeMode::kFur && p_.mode <= VolumeMode::kHyper;
    const Vector3 p = Add(ray.origin, ray.direction, t);
    const Substance::Matter m = hyper ? substance_.Hyper(p)
                                      : substance_.Density(p, Add(ray.origin, ray.direction, t - half),
                                                           Add(ray.origin, ray.direction, t + half));
    std::array<double, 4> c = {m.material.color[0], m.material.color[1], m.material.color[2],
                               m.material.extinction};
    Paint(m, ToEye(ray), hyper, c);
    return c;
  }
  double step() const { return p_.step; }

  // Moves that the float kernel's positions are uncertain by, across the view, world units.
  std::vector<Vector3> Moves() const {
    const Vector3 f = p_.camera.forward();
    const Vector3 side = Normalized(Cross(f, std::fabs(f[1]) < 0.9 ? Vector3{0, 1, 0} : Vector3{1, 0, 0}));
    const Vector3 up = Cross(side, f);
    const double by = 1e-4 * std::min({v_.spacing[0], v_.spacing[1], v_.spacing[2]});
    std::vector<Vector3> moves;
    for (const Vector3& direction : {side, up, f}) {
      moves.push_back(Add({}, direction, by));
      moves.push_back(Add({}, direction, -by));
    }
    return moves;
  }

 private:
  // --- Surfaces. ---
  Vector3 MeltPlace(const Vector3& p) const {
    const double bottom = v_.Low()[1], top = v_.High()[1];
    const double down = Clamped((top - p[1]) / (top - bottom));
    const Vector3 at = {p[0] * p_.frequency,
                        p[1] * p_.frequency * ops::volume::kMeltStretch +
                            v_.origin[1] * p_.frequency * (1 - ops::volume::kMeltStretch),
                        p[2] * p_.frequency};
    const double n = Substance::Noise(p_.block, at, 1, {0, ops::volume::kMeltDrift * p_.time, 0});
    return {p[0],
            p[1] + p_.amount * down * down * (1 - ops::volume::kMeltNoise + ops::volume::kMeltNoise * n),
            p[2]};
  }
  // Negative inside.
  double Level(const Vector3& p) const {
    const double v = substance_.Field(p_.mode == VolumeMode::kMelt ? MeltPlace(p) : p) - p_.iso;
    return p_.inside_above ? -v : v;
  }
  Vector3 MeltNormal(const Vector3& p) const {
    // The field's gradient where it is read, times the displacement's own: by the noise's central
    // differences.
    const Vector3 q = MeltPlace(p);
    Vector3 g = substance_.FieldGradient(q);
    const double texel = 1.0 / p_.block.size();
    Vector3 slope;
    const double bottom = v_.Low()[1], top = v_.High()[1];
    const double down = Clamped((top - p[1]) / (top - bottom));
    const Vector3 at = {p[0] * p_.frequency,
                        p[1] * p_.frequency * ops::volume::kMeltStretch +
                            v_.origin[1] * p_.frequency * (1 - ops::volume::kMeltStretch),
                        p[2] * p_.frequency};
    const Vector3 drift = {0, ops::volume::kMeltDrift * p_.time, 0};
    for (size_t a = 0; a < 3; ++a) {
      Vector3 step = {0, 0, 0};
      step[a] = texel;
      const double n = (Substance::Noise(p_.block, Add(at, step), 1, drift) -
                        Substance::Noise(p_.block, Add(at, step, -1), 1, drift)) /
                       (2 * texel);
      slope[a] = p_.amount * down * down * ops::volume::kMeltNoise * n * p_.frequency *
                 (a == 1 ? ops::volume::kMeltStretch : 1);
    }
    if (down > 0 && down < 1) {
      const double n = Substance::Noise(p_.block, at, 1, drift);
      slope[1] += -2 * p_.amount * down / (top - bottom) *
                  (1 - ops::volume::kMeltNoise + ops::volume::kMeltNoise * n);
    }
    return Add(g, slope, g[1]);
  }

  struct Shine {
    double lit = 0, gloss = 0;
  };
  Shine Lit(const Vector3& normal, const Vector3& to_eye) const {
    const VolumeMaterial& m = p_.material;
    const double facing = Dot(normal, m.light);
    Shine s;
    s.lit = m.ambient * (1 + 0.3 * normal[1]) + m.diffuse * std::max(facing, 0.0);
    const double half = Dot(normal, Normalized(Add(m.light, to_eye)));
    if (facing > 0 && half > 1e-6) s.gloss = m.specular * std::pow(half, m.exponent);
    return s;
  }
  Vector3 ToEye(const Ray& ray) const { return Normalized(Add({}, ray.direction, -1)); }

  Result Surface(const Ray& ray, bool misses) const {
    const Result nothing = {0, 0, 0, 0, kEndless};
    if (misses) return nothing;
    Vector3 voxels;
    for (size_t a = 0; a < 3; ++a) voxels[a] = ray.direction[a] / v_.spacing[a];
    const double step = ops::volume::kSurfaceStep / Length(voxels);
    double t = ray.begin;
    bool cap = true;
    for (int64_t i = 0;; ++i, cap = false) {
      t = ray.begin + static_cast<double>(i) * step;
      if (t > ray.end) return nothing;
      if (Level(Add(ray.origin, ray.direction, t)) <= 0) break;
    }
    if (!cap) {
      double outside = t - step, inside = t;
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (outside + inside);
        (Level(Add(ray.origin, ray.direction, middle)) > 0 ? outside : inside) = middle;
      }
      t = inside;
    }
    const Vector3 p = Add(ray.origin, ray.direction, t), to_eye = ToEye(ray);
    Vector3 normal = Normalized(p_.mode == VolumeMode::kMelt ? MeltNormal(p) : substance_.FieldGradient(p));
    if (p_.inside_above) normal = Add({}, normal, -1);
    std::array<double, 3> color = p_.material.color;
    if (p_.mode == VolumeMode::kSolid) {
      const int entries = static_cast<int>(draw_.colors.size() / 4) - 1;
      const double u =
          std::clamp(Substance::Noise(p_.block, p, p_.frequency, {}) * (entries - 1), 0.0, entries - 1.0);
      color = Substance::Entry(draw_.colors, u);
    } else if (p_.mode == VolumeMode::kBump) {
      double n[4];
      Substance::Noise(p_.block, p, p_.frequency, {}, n);
      const Vector3 sum = Add(Normalized({n[0], n[1], n[2]}), normal, p_.amount);
      if (Length(sum) >= 1e-6) normal = Normalized(sum);
    }
    if (cap) normal = to_eye;
    const Shine s = Lit(normal, to_eye);
    return {color[0] * s.lit + s.gloss, color[1] * s.lit + s.gloss, color[2] * s.lit + s.gloss, 1, t};
  }

  // --- Media. ---
  Result Medium(const Ray& ray, bool misses) const {
    Result sum = {0, 0, 0, 0, kEndless};
    if (p_.mode == VolumeMode::kXray) sum = {1, 1, 1, 1, kEndless};
    if (misses) return sum;
    const double world = Length(ray.direction);
    // Samples stand for segments of equal length; where they lie is the method's choice.
    double step = p_.step / world, base = ray.enter + 0.5 * step;
    if (p_.method == VolumeMethod::kSlices) {
      step = p_.step;
      base = (std::floor(ray.enter / step) + 0.5) * step;
    } else if (p_.method == VolumeMethod::kShells && p_.camera.perspective()) {
      base = (std::floor(ray.enter / step) + 0.5) * step;
    } else if (p_.method == VolumeMethod::kStacks || p_.method == VolumeMethod::kShearWarp) {
      size_t axis = 0;
      double most = -1;
      for (size_t a = 0; a < 3; ++a) {
        const double along = std::fabs(p_.camera.forward()[a]) / v_.spacing[a];
        if (along > most * (1 + 1e-9)) most = along, axis = a;
      }
      const double o = substance_.Voxels(ray.origin[axis], axis), d = ray.direction[axis] / v_.spacing[axis];
      step = 1 / std::fabs(d);
      base = (std::nearbyint(o + ray.enter * d) - o) / d;
    }
    std::vector<std::array<double, 4>> samples;  // colour and opacity, front to back
    std::vector<double> depths;
    double largest = -1, optical = 0;
    const int64_t first =
        std::max<int64_t>(0, static_cast<int64_t>(std::floor((ray.begin - base) / step + 0.5)));
    for (int64_t i = first;; ++i) {
      const double t = base + static_cast<double>(i) * step;
      if (t - 0.5 * step >= ray.end) break;
      const double share = (std::min(t + 0.5 * step, ray.end) - std::max(t - 0.5 * step, ray.begin)) / step;
      if (share <= 0) continue;
      if (p_.mode == VolumeMode::kMip) {
        const double v = substance_.Field(Add(ray.origin, ray.direction, t));
        largest =
            std::max(largest, Clamped((v - draw_.transfer_low) / (draw_.transfer_high - draw_.transfer_low)));
        continue;
      }
      std::array<double, 4> c = Light(ray, t, 0.5 * step);
      const double length = share * step * world;
      optical += c[3] * length;
      c[3] = -std::expm1(-c[3] * length);
      samples.push_back(c);
      depths.push_back(t);
    }
    switch (p_.mode) {
      case VolumeMode::kMip:
        if (largest >= 0) sum = {largest, largest, largest, 1, kEndless};
        break;
      case VolumeMode::kXray:
        sum = {std::exp(-optical), std::exp(-optical), std::exp(-optical), 1, kEndless};
        break;
      case VolumeMode::kAttenuate:
        for (const auto& c : samples) {
          for (size_t k = 0; k < 3; ++k) sum[k] += c[3] * c[k] / static_cast<double>(samples.size());
          sum[3] += c[3] / static_cast<double>(samples.size());
        }
        break;
      default:
        for (size_t i = 0; i < samples.size(); ++i) {
          const auto& c = samples[i];
          const double weight = (1 - sum[3]) * c[3];
          for (size_t k = 0; k < 3; ++k) sum[k] += weight * c[k];
          sum[3] += weight;
          if (sum[3] >= 0.5 && sum[4] == kEndless && p_.mode != VolumeMode::kOver) sum[4] = depths[i];
        }
    }
    return sum;
  }

  void Paint(const Substance::Matter& m, const Vector3& to_eye, bool hyper, std::array<double, 4>& c) const {
    const VolumeMaterial& light = p_.material;
    if (p_.mode == VolumeMode::kFur) {
      const double cosine = Dot(m.normal, light.light), view = Dot(m.normal, to_eye);
      const double across = std::sqrt(std::max(1 - cosine * cosine, 0.0)),
                   aside = std::sqrt(std::max(1 - view * view, 0.0));
      const double facing = 0.5 + 0.5 * cosine,
                   occlusion = ops::volume::kFurRoot + (1 - ops::volume::kFurRoot) * m.height;
      const double lit = occlusion * (light.diffuse * facing * (0.4 + 0.6 * across) + light.ambient);
      const double gleam = std::max(across * aside - cosine * view, 0.0);
      const double gloss =
          gleam > 1e-6 ? light.specular * std::pow(gleam, light.exponent) * facing * facing * occlusion : 0;
      for (size_t k = 0; k < 3; ++k) c[k] = c[k] * light.color[k] * lit + gloss;
    } else if (p_.shade) {
      const Shine s = Lit(m.normal, to_eye);
      for (size_t k = 0; k < 3; ++k) c[k] = c[k] * (hyper ? light.color[k] : 1) * s.lit + s.gloss;
    }
  }

  const VolumeDraw& draw_;
  const VolumeParams& p_;
  const VolumeSpec& v_;
  const Substance substance_;
};

// The pictures of one scene: the nearest surface, and all media on one lattice before it.
class Scene {
 public:
  explicit Scene(const VolumeDraw& draw) {
    Add(draw);
    for (const auto& other : draw.others) Add(*other);
  }
  double brightest() const { return brightest_; }
  double termination() const { return termination_; }
  size_t moves() const { return moves_[0].size(); }

  // Moved by the m-th of the moves; -1: not moved.
  Result Draw(double x, double y, double scene, int m) const {
    const auto moved = [&](size_t k) { return m < 0 ? Vector3{0, 0, 0} : moves_[k][static_cast<size_t>(m)]; };
    if (pictures_.size() == 1) return pictures_[0].Draw(x, y, scene, moved(0));
    Result surface = {0, 0, 0, 0, kEndless};
    for (size_t k = 0; k < pictures_.size(); ++k) {
      if (!pictures_[k].IsSurface()) continue;
      const Result r = pictures_[k].Draw(x, y, scene, moved(k));
      if (r[4] < surface[4]) surface = r;
    }
    std::vector<size_t> media;
    std::vector<Ray> rays;
    double enter = kEndless, begin = kEndless, end = -kEndless, spacing = kEndless;
    for (size_t k = 0; k < pictures_.size(); ++k) {
      if (pictures_[k].IsSurface()) continue;
      spacing = std::min(spacing, pictures_[k].step());
      const Ray ray = pictures_[k].RayOf(x, y, surface[4] < scene ? surface[4] : scene, moved(k));
      if (ray.misses) continue;
      enter = std::min(enter, ray.enter), begin = std::min(begin, ray.begin), end = std::max(end, ray.end);
      media.push_back(k);
      rays.push_back(ray);
    }
    if (media.empty()) return surface;
    const double world = Length(rays[0].direction), step = spacing / world, base = enter + 0.5 * step;
    Result sum = {0, 0, 0, 0, kEndless};
    const auto first = static_cast<int64_t>(std::max(0.0, std::floor((begin - base) / step + 0.5)));
    for (int64_t i = first;; ++i) {
      const double t = base + static_cast<double>(i) * step;
      if (t - 0.5 * step >= end) break;
      std::array<double, 4> all = {0, 0, 0, 0};
      for (size_t k = 0; k < media.size(); ++k) {
        const Ray& ray = rays[k];
        const double share = (std::min(t + 0.5 * step, ray.end) - std::max(t - 0.5 * step, ray.begin)) / step;
        if (share <= 0) continue;
        const std::array<double, 4> c = pictures_[media[k]].Light(ray, t, 0.5 * step);
        for (size_t n = 0; n < 3; ++n) all[n] += share * c[3] * c[n];
        all[3] += share * c[3];
      }
      if (all[3] <= 0) continue;
      const double weight = (1 - sum[3]) * -std::expm1(-all[3] * step * world);
      for (size_t n = 0; n < 3; ++n) sum[n] += weight * all[n] / all[3];
      sum[3] += weight;
      if (sum[3] >= 0.5 && sum[4] == kEndless) sum[4] = t;
    }
    const double through = 1 - sum[3];
    for (size_t n = 0; n < 4; ++n) sum[n] += through * surface[n];
    sum[4] = std::min(sum[4], surface[4]);
    return sum;
  }

 private:
  void Add(const VolumeDraw& draw) {
    pictures_.emplace_back(draw);
    moves_.push_back(pictures_.back().Moves());
    for (size_t i = 0; i < draw.transfer.size(); ++i) {
      if (i % 4 != 3) brightest_ = std::max(brightest_, static_cast<double>(draw.transfer[i]));
    }
    if (!pictures_.back().IsSurface()) termination_ = std::max(termination_, draw.params.termination);
  }

  std::vector<Picture> pictures_;
  std::vector<std::vector<Vector3>> moves_;
  double brightest_ = 1, termination_ = 0;
};

void Evaluate(const Call& call) {
  const VolumeDraw& draw = *std::any_cast<const ops::volume::VolumeDrawPointer&>(call.parameters);
  const Scene scene(draw);
  const Roi& roi = call.out.roi;
  constexpr double kBound = 168 * 0x1p-24;  // the row's
  // Rays are moved by 1e-4 voxel for the response. A sheared picture is resampled, which moves them by up to
  // half a voxel and smooths them.
  const bool sheared = draw.params.method == VolumeMethod::kShearWarp;
  const double sway = sheared ? 0.5e4 : 1, resampled = sheared ? 0.02 : 0;
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      const double depth = draw.with_scene ? call.in[0].at(x, y, 0) : kEndless;
      const Result r = scene.Draw(x, y, depth, -1);
      Result response = {0, 0, 0, 0, 0};
      for (size_t m = 0; call.scale != nullptr && m < scene.moves(); ++m) {
        const Result moved = scene.Draw(x, y, depth, static_cast<int>(m));
        for (size_t c = 0; c < 5; ++c) {
          const double change = std::fabs(moved[c] - r[c]);
          if (moved[c] != r[c]) response[c] = std::max(response[c], std::isfinite(change) ? change : 1e30);
        }
      }
      for (int c = 0; c < call.out.channels; ++c) {
        const auto k = static_cast<size_t>(c);
        call.out.at(x, y, c) = r[k];
        if (call.scale == nullptr) continue;
        const double ends = (scene.termination() + resampled) * scene.brightest();
        call.scale->at(x, y, c) = std::max(1.0, std::fabs(r[k])) + (sway * response[k] + ends) / kBound;
      }
    }
  }
}

}  // namespace

std::vector<Entry> VolumeEntries() { return {{"volume", Evaluate}}; }

}  // namespace tessera::reference
