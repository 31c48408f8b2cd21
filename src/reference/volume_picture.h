// Reference of volume pictures: one volume, its rays in small fixed steps, in double, without leaps.
#ifndef TESSERA_REFERENCE_VOLUME_PICTURE_H_
#define TESSERA_REFERENCE_VOLUME_PICTURE_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <vector>

#include "model/volume_settings.h"
#include "reference/volume_light.h"
#include "reference/volume_opacity.h"
#include "reference/volume_sheared.h"
#include "reference/volume_substance.h"

namespace tessera::reference::volume {

using ops::volume::VolumeDraw;
// R, G, B, A, Z, normal, position, distance, and what the first four may be off by that is not seen by moving
// the ray: what a step of the samples' own length misses of an integral (kAttenuate), highlights of normals
// that are off in their last digits.
constexpr size_t kChannels = 12, kMissed = 12;
// 1 where alpha comes so near to 1/2 at a sample that another may be the one that has the depth; 2 where the
// surface may be another.
constexpr size_t kDoubt = 13;
using Result = std::array<double, kChannels + 2>;
constexpr double kEndless = std::numeric_limits<double>::infinity();
inline Result Colored(double r, double g, double b, double a, double z = kEndless) {
  return {r, g, b, a, z, 0, 0, 0, 0, 0, 0, kEndless, 0, 0};
}
constexpr double kTie = 1e-5;  // of alpha

// One ray in world space; t is the planar depth.
struct Ray {
  Vector3 origin, direction, moved;  // origin includes what it was moved by
  double enter = 0, begin = 0, end = 0;
  bool misses = false;
};

class Picture : private Lighting {
 public:
  // `direct`: shadows are marched to the light from every sample, not from an opacity volume's nodes.
  explicit Picture(const VolumeDraw& draw, bool direct = false)
      : Lighting(draw.params),
        draw_(draw),
        p_(draw.params),
        v_(draw.volume.spec()),
        substance_(draw),
        sheared_(draw, substance_),
        direct_(direct),
        brightest_(BrightestOf(draw)) {
    opacity_.emplace_back(draw, substance_, p_.material.light, p_.material.point);
    for (const VolumeLight& light : p_.scatter.lights)
      opacity_.emplace_back(draw, substance_, light.light, light.point);
  }
  Picture(const Picture&) = delete;

  // The ray of a pixel, moved; clipped to the volume, the planes and the scene.
  Ray RayOf(double x, double y, double scene, const Vector3& moved) const {
    const Camera::Ray r = p_.camera.PixelRay(draw_.window, x, y);
    Ray ray{Add(r.origin, moved), r.direction, moved};
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
  // Sheared pictures tell themselves what they leave out.
  bool EndsEarly() const {
    return !IsSurface() && (p_.mode < VolumeMode::kOver || p_.mode == VolumeMode::kUnder) &&
           p_.method != VolumeMethod::kShearWarp;
  }
  double Brightest() const { return brightest_; }
  Result Draw(double x, double y, double scene, const Vector3& moved) const {
    if (p_.method == VolumeMethod::kShearWarp) {
      const Camera::Ray r = p_.camera.PixelRay(draw_.window, x, y);
      const std::array<double, 5> c = sheared_.Draw(Add(r.origin, moved), r.direction);
      Result result = Colored(c[0], c[1], c[2], c[3]);
      result[kMissed] = c[4] * Brightest();
      return result;
    }
    const Ray ray = RayOf(x, y, scene, moved);
    return IsSurface() ? Surface(ray, ray.misses) : Medium(ray, ray.misses);
  }
  // Lit colour and extinction at planar depth t, of the segment of `half` before and behind; what the
  // highlight may be off by.
  std::array<double, 5> Light(const Ray& ray, double t, double half) const {
    const bool hyper = p_.mode >= VolumeMode::kFur && p_.mode <= VolumeMode::kHyper;
    const Vector3 p = Add(ray.origin, ray.direction, t);
    const auto matter = [&](double skew) {
      return hyper ? substance_.Hyper(p, skew)
                   : substance_.Density(p, Add(ray.origin, ray.direction, t - half),
                                        Add(ray.origin, ray.direction, t + half), skew);
    };
    const Substance::Matter m = matter(0);
    std::array<double, 5> c = {m.material.color[0], m.material.color[1], m.material.color[2],
                               m.material.extinction, 0};
    Paint(m, p, ToEye(ray), hyper, c);
    if (!draw_.emission.empty()) {
      const bool alone = !p_.shade && (!p_.scatter.lit || p_.material.flat);
      const std::array<double, 3> own = substance_.Glow(m.value);
      for (size_t k = 0; k < 3; ++k) c[k] = own[k] + (alone ? 0 : c[k]);
    }
    if (substance_.ReadsNormals()) {
      // What another last digit of a normal makes of extinction, and of colour.
      for (const double skew : {-1.0, 1.0}) {
        const Substance::Matter other = matter(skew);
        double color = 0;
        for (size_t k = 0; k < 3; ++k)
          color = std::max(color, std::fabs(other.material.color[k] - m.material.color[k]));
        const double change = std::fabs(other.material.extinction - m.material.extinction);
        c[4] += Brightest() * (color + change / std::max(m.material.extinction, 1e-6));
      }
    }
    return c;
  }
  // Normal, position and distance of what is at t, in the world.
  void AddAovs(const Ray& ray, double t, const Vector3& normal, Result& r) const {
    const Vector3 p = Add(ray.origin, ray.direction, t);
    const Matrix4& m = draw_.placed.to_world;
    for (size_t a = 0; a < 3; ++a) {
      const Vector3 row = {m[4 * a], m[4 * a + 1], m[4 * a + 2]};
      r[5 + a] = Dot(row, normal);
      r[8 + a] = Dot(row, p) + m[4 * a + 3];
    }
    r[11] = t * Length(ray.direction);
  }
  // The unit normal of the field at a point, outward.
  Vector3 OutwardAt(const Vector3& p) const {
    const bool hyper = p_.mode >= VolumeMode::kFur && p_.mode <= VolumeMode::kHyper;
    return Add({}, Normalized(substance_.FieldGradient(p)), hyper ? 1 : -1);
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

  Vector3 ToEye(const Ray& ray) const { return Normalized(Add({}, ray.direction, -1)); }

  Result Surface(const Ray& ray, bool misses) const {
    const Result nothing = Colored(0, 0, 0, 0);
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
    double doubt = 0;
    if (!cap) {
      double outside = t - step, inside = t;
      if (CrossesAgain(ray, outside, inside)) doubt = 2;
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (outside + inside);
        (Level(Add(ray.origin, ray.direction, middle)) > 0 ? outside : inside) = middle;
      }
      t = inside;
    }
    // A surface holds a place where it is, whatever moves the ray: how a normal changes across it shows
    // beside it.
    const Vector3 p = Add(Add(ray.origin, ray.direction, t), ray.moved), to_eye = ToEye(ray);
    Vector3 normal = Normalized(p_.mode == VolumeMode::kMelt ? MeltNormal(p) : substance_.FieldGradient(p));
    if (p_.inside_above) normal = Add({}, normal, -1);
    std::array<double, 3> color = p_.material.color;
    if (p_.mode == VolumeMode::kSolid) {
      const int entries = static_cast<int>(draw_.colors.size() / 4) - 1;
      const double share = (Substance::Noise(p_.block, p, p_.frequency, {}) - draw_.colors_low) /
                           (draw_.colors_high - draw_.colors_low);
      const double u = std::clamp(share * (entries - 1), 0.0, entries - 1.0);
      color = Substance::Entry(draw_.colors, u);
    } else if (p_.mode == VolumeMode::kBump) {
      double n[4];
      Substance::Noise(p_.block, p, p_.frequency, {}, n);
      const Vector3 sum = Add(Normalized({n[0], n[1], n[2]}), normal, p_.amount);
      if (Length(sum) >= 1e-6) normal = Normalized(sum);
    }
    if (cap) normal = to_eye;
    const Shine s = Lit(normal, ToLight(p), to_eye);
    Result r =
        Colored(color[0] * s.lit + s.gloss, color[1] * s.lit + s.gloss, color[2] * s.lit + s.gloss, 1, t);
    r[kMissed] = s.off;
    r[kDoubt] = doubt;
    AddAovs(ray, t, normal, r);
    return r;
  }
  // Whether the surface is crossed three times or more between two places of the grid, as a body that sags
  // far does: each crossing is as good as the others.
  bool CrossesAgain(const Ray& ray, double outside, double inside) const {
    constexpr int kParts = 16;
    bool was_inside = false;
    int crossings = 0;
    for (int i = 1; i <= kParts; ++i) {
      const double t = outside + (inside - outside) * i / kParts;
      const bool is_inside = i == kParts || Level(Add(ray.origin, ray.direction, t)) <= 0;
      crossings += is_inside != was_inside;
      was_inside = is_inside;
    }
    return crossings > 1;
  }

  // --- Media. ---
  Result Medium(const Ray& ray, bool misses) const {
    Result sum = Colored(0, 0, 0, 0);
    if (p_.mode == VolumeMode::kXray) sum = Colored(1, 1, 1, 1);
    if (misses) return sum;
    const double world = Length(ray.direction);
    // Samples stand for segments of equal length; where they lie is the method's choice.
    double step = p_.step / world, base = ray.enter + 0.5 * step;
    if (p_.method == VolumeMethod::kSlices) {
      step = p_.step;
      base = (std::floor(ray.enter / step) + 0.5) * step;
    } else if (p_.method == VolumeMethod::kShells && p_.camera.perspective()) {
      base = (std::floor(ray.enter / step) + 0.5) * step;
    } else if (p_.method == VolumeMethod::kStacks) {
      const size_t axis = AxisOfSlices(draw_);
      const double o = substance_.Voxels(ray.origin[axis], axis), d = ray.direction[axis] / v_.spacing[axis];
      step = 1 / std::fabs(d);
      base = (std::nearbyint(o + ray.enter * d) - o) / d;
    }
    if (p_.mode == VolumeMode::kAttenuate) return Attenuate(ray, step, base);
    std::vector<std::array<double, 5>> samples;  // colour and opacity, front to back
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
        const Vector3 p = Add(ray.origin, ray.direction, t);
        const double v = p_.dmf.empty() ? substance_.Field(p) : substance_.Density(p, p, p).value;
        largest =
            std::max(largest, Clamped((v - draw_.transfer_low) / (draw_.transfer_high - draw_.transfer_low)));
        continue;
      }
      std::array<double, 5> c = Light(ray, t, 0.5 * step);
      const double length = share * step * world;
      optical += c[3] * length;
      c[3] = -std::expm1(-c[3] * length);
      samples.push_back(c);
      depths.push_back(t);
    }
    switch (p_.mode) {
      case VolumeMode::kMip:
        if (largest >= 0) sum = Colored(largest, largest, largest, 1);
        break;
      case VolumeMode::kXray:
        sum = Colored(std::exp(-optical), std::exp(-optical), std::exp(-optical), 1);
        break;
      default:
        for (size_t i = 0; i < samples.size(); ++i) {
          const auto& c = samples[i];
          const double weight = (1 - sum[3]) * c[3];
          for (size_t k = 0; k < 3; ++k) sum[k] += weight * c[k];
          sum[3] += weight;
          sum[kMissed] += weight * c[4];
          if (std::fabs(sum[3] - 0.5) < kTie) sum[kDoubt] = 1;
          if (sum[3] >= 0.5 && sum[4] == kEndless && p_.mode != VolumeMode::kOver) sum[4] = depths[i];
        }
        if (sum[4] < kEndless) AddAovs(ray, sum[4], OutwardAt(Add(ray.origin, ray.direction, sum[4])), sum);
    }
    return sum;
  }

  // a c of a length of material, whatever the step, as the mean over the ray's way: 1 / (end - begin) times
  // the integral of (1 - exp(-extinction length)) c. Every sample's segment is integrated by Gauss's three
  // places in each of its halves; what the segment's middle alone makes of it is the step's own error, and is
  // told.
  Result Attenuate(const Ray& ray, double step, double base) const {
    const auto at = [&](double t, double half) {
      std::array<double, 5> c = Light(ray, t, half);
      c[3] = -std::expm1(-c[3] * p_.transfer.length);
      for (const size_t k : {0, 1, 2, 4}) c[k] *= c[3];
      return c;
    };
    const double aside = std::sqrt(0.6), weights[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    Result sum = Colored(0, 0, 0, 0);
    double gloss_off = 0;
    std::array<double, 4> middles = {0, 0, 0, 0};
    double path = 0;
    const auto first = static_cast<int64_t>(std::max(0.0, std::floor((ray.begin - base) / step + 0.5)));
    for (int64_t i = first; base + (static_cast<double>(i) - 0.5) * step < ray.end; ++i) {
      const double middle = base + static_cast<double>(i) * step;
      const double from = std::max(middle - 0.5 * step, ray.begin),
                   to = std::min(middle + 0.5 * step, ray.end);
      if (to <= from) continue;
      const double size = (to - from) / step;
      path += size;
      const std::array<double, 5> coarse = at(middle, 0.5 * step);
      gloss_off += size * coarse[4];
      for (size_t k = 0; k < 4; ++k) middles[k] += size * coarse[k];
      for (int part = 0; part < 6; ++part) {
        const double half = 0.25 * (to - from), centre = from + (part < 3 ? half : 3 * half);
        const std::array<double, 5> fine = at(centre + (part % 3 - 1) * aside * half, 0.5 * half);
        for (size_t k = 0; k < 4; ++k) sum[k] += 0.5 * size * weights[part % 3] * fine[k];
      }
    }
    for (size_t k = 0; k < 4 && path > 0; ++k) {
      sum[k] /= path;
      sum[kMissed] = std::max(sum[kMissed], std::fabs(middles[k] / path - sum[k]));
    }
    if (path > 0) sum[kMissed] += gloss_off / path;
    return sum;
  }

  // Light of one of the lights that reaches p and the eye, and what it may be off by.
  struct Reach {
    double share = 1, off = 0;
  };
  Reach ReachOf(size_t light, const Vector3& p, const Vector3& to_light, const Vector3& to_eye) const {
    Reach r;
    if (!p_.scatter.lit || p_.material.flat) return r;
    const double strength = p_.scatter.shadow, phase = Phase(to_light, to_eye);
    if (strength > 0) {
      const OpacityVolume& opacity = opacity_[light];
      const OpacityVolume::Share s = direct_ ? OpacityVolume::Share{opacity.Through(p), 0} : opacity.At(p);
      r = {1 - strength * (1 - s.through), strength * s.off};
    }
    return {r.share * phase, r.off * phase + r.share * phase * PhaseError()};
  }
  // What further lights add to a sample of the colour `own`.
  void AddLights(const Substance::Matter& m, const Vector3& p, const Vector3& to_eye, bool hyper,
                 const std::array<double, 5>& own, std::array<double, 5>& c) const {
    for (size_t n = 0; n < p_.scatter.lights.size(); ++n) {
      const VolumeLight& light = p_.scatter.lights[n];
      const Vector3 to_light = ToLight(light.light, light.point, p);
      const Reach reach = ReachOf(n + 1, p, to_light, to_eye);
      double diffuse = p_.material.diffuse, gloss = 0, off = 0;
      if (p_.shade) {
        const Shine s = Lit(m.normal, to_light, to_eye);
        diffuse *= std::max(Dot(m.normal, to_light), 0.0);
        gloss = s.gloss, off = s.off;
      }
      double most = 0;
      for (size_t k = 0; k < 3; ++k) {
        const double lit = own[k] * (hyper ? p_.material.color[k] : 1) * diffuse + gloss;
        c[k] += lit * reach.share * light.color[k];
        most = std::max(most, (lit * reach.off + off * reach.share) * light.color[k]);
      }
      c[4] += most;
    }
  }
  void Paint(const Substance::Matter& m, const Vector3& p, const Vector3& to_eye, bool hyper,
             std::array<double, 5>& c) const {
    const Vector3 to_light = ToLight(p);
    const VolumeMaterial& light = p_.material;
    const Reach reach = ReachOf(0, p, to_light, to_eye);
    const double there = reach.share, off = reach.off;
    const std::array<double, 5> plain = c;
    if (p_.mode == VolumeMode::kFur && light.flat) {
      for (size_t k = 0; k < 3; ++k) c[k] *= light.color[k];
    } else if (p_.mode == VolumeMode::kFur) {
      const double cosine = Dot(m.normal, to_light), view = Dot(m.normal, to_eye);
      const double across = std::sqrt(std::max(1 - cosine * cosine, 0.0)),
                   aside = std::sqrt(std::max(1 - view * view, 0.0));
      const double facing = 0.5 + 0.5 * cosine,
                   occlusion = ops::volume::kFurRoot + (1 - ops::volume::kFurRoot) * m.height;
      const double lit = occlusion * (light.diffuse * facing * (0.4 + 0.6 * across) + light.ambient);
      const double gleam = std::max(across * aside - cosine * view, 0.0);
      const double gloss =
          gleam > 1e-6 ? light.specular * std::pow(gleam, light.exponent) * facing * facing * occlusion : 0;
      for (size_t k = 0; k < 3; ++k) {
        const double strand = (1 - m.height) * p_.fur.root[k] + m.height * p_.fur.tip[k];
        c[k] = c[k] * light.color[k] * strand * (1 + p_.fur.patches * m.patch) * lit + gloss;
      }
      c[4] = light.specular * PowerError(gleam, light.exponent) * facing * facing * occlusion;
    } else if (p_.shade) {
      const Shine s = Lit(m.normal, to_light, to_eye);
      const double ambient = light.flat ? s.lit : light.ambient * (1 + 0.3 * m.normal[1]);
      const double lit = ambient + (s.lit - ambient) * there;
      c[4] = s.off * there + off * s.gloss;
      for (size_t k = 0; k < 3; ++k) {
        const double own = c[k] * (hyper ? light.color[k] : 1);
        c[4] = std::max(c[4], s.off * there + off * (s.gloss + own * (s.lit - ambient)));
        c[k] = own * lit + s.gloss * there;
      }
    } else if (p_.scatter.lit && !light.flat) {
      for (size_t k = 0; k < 3; ++k) {
        const double own = c[k] * (hyper ? light.color[k] : 1);
        c[4] = std::max(c[4], own * light.diffuse * off);
        c[k] = own * (light.ambient + light.diffuse * there);
      }
    }
    if (!light.flat) AddLights(m, p, to_eye, hyper, plain, c);
  }

  const VolumeDraw& draw_;
  const VolumeParams& p_;
  const VolumeSpec& v_;
  const Substance substance_;
  const ShearedPicture sheared_;
  std::deque<OpacityVolume> opacity_;  // of every light
  const bool direct_;
  const double brightest_;
};

}  // namespace tessera::reference::volume

#endif  // TESSERA_REFERENCE_VOLUME_PICTURE_H_
