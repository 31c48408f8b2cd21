// Reference of volume pictures: every ray in small fixed steps, in double, without leaps.
#include <algorithm>
#include <array>
#include <any>
#include <cmath>
#include <limits>
#include <vector>

#include "tessera/ops/noise_block.h"
#include "tessera/ops/volume_draw.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

using base::VolumeDraw;
using Result = std::array<double, 5>;  // R, G, B, A, Z
constexpr double kEndless = std::numeric_limits<double>::infinity();

Vector3 Add(const Vector3& a, const Vector3& b, double t = 1) {
  return {a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]};
}
double Length(const Vector3& v) { return std::sqrt(Dot(v, v)); }
double Clamped(double v) { return std::clamp(v, 0.0, 1.0); }

// One ray in world space; t is the planar depth.
struct Ray {
  Vector3 origin, direction;
  double enter = 0, begin = 0, end = 0;
};

class Picture {
 public:
  explicit Picture(const VolumeDraw& draw) : draw_(draw), p_(draw.params), v_(draw.volume.spec()) {}

  Result Draw(double x, double y, double scene, const Vector3& moved) const {
    const Camera::Ray r = p_.camera.PixelRay(draw_.window, x, y);
    Ray ray{Add(r.origin, moved), r.direction};
    ray.enter = p_.camera.perspective() ? 0 : -kEndless;
    ray.end = std::isnan(scene) ? -kEndless : scene;
    const Vector3 low = v_.Low(), high = v_.High();
    bool misses = false;
    for (size_t a = 0; a < 3; ++a) {
      if (ray.direction[a] == 0) {
        misses |= ray.origin[a] < low[a] || ray.origin[a] > high[a];
        continue;
      }
      const double u = (low[a] - ray.origin[a]) / ray.direction[a], w = (high[a] - ray.origin[a]) / ray.direction[a];
      ray.enter = std::max(ray.enter, std::min(u, w));
      ray.end = std::min(ray.end, std::max(u, w));
    }
    ray.begin = ray.enter;
    for (const CuttingPlane& plane : p_.planes) {
      const double above = Dot(plane.normal, ray.origin) - plane.offset, rise = Dot(plane.normal, ray.direction);
      if (rise > 0) ray.begin = std::max(ray.begin, -above / rise);
      if (rise < 0) ray.end = std::min(ray.end, -above / rise);
      misses |= rise == 0 && above < 0;
    }
    misses |= !(ray.begin < ray.end);
    return p_.mode <= VolumeMode::kMelt ? Surface(ray, misses) : Medium(ray, misses);
  }

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
  double Voxels(double world, size_t axis) const { return (world - v_.origin[axis]) / v_.spacing[axis]; }
  double Field(const Vector3& p) const {
    return draw_.volume.Sample(Voxels(p[0], 0), Voxels(p[1], 1), Voxels(p[2], 2));
  }
  Vector3 FieldGradient(const Vector3& p) const {
    Vector3 g = draw_.volume.Gradient(Voxels(p[0], 0), Voxels(p[1], 1), Voxels(p[2], 2));
    for (size_t a = 0; a < 3; ++a) g[a] /= v_.spacing[a];
    return g;
  }
  // Noise at world positions times the frequency plus an offset.
  static double NoiseAt(const NoiseBlock& block, const Vector3& p, double frequency, const Vector3& offset,
                        double* channels = nullptr) {
    double values[4] = {0, 0, 0, 0};
    block.Sample(Add(offset, p, frequency), values);
    if (channels != nullptr) std::copy_n(values, 4, channels);
    return values[0];
  }

  // --- Surfaces. ---
  Vector3 MeltPlace(const Vector3& p) const {
    const double bottom = v_.Low()[1], top = v_.High()[1];
    const double down = Clamped((top - p[1]) / (top - bottom));
    const Vector3 at = {p[0] * p_.frequency, p[1] * p_.frequency * base::kMeltStretch +
                                                 v_.origin[1] * p_.frequency * (1 - base::kMeltStretch),
                        p[2] * p_.frequency};
    const double n = NoiseAt(p_.block, at, 1, {0, base::kMeltDrift * p_.time, 0});
    return {p[0], p[1] + p_.amount * down * down * (1 - base::kMeltNoise + base::kMeltNoise * n), p[2]};
  }
  // Negative inside.
  double Level(const Vector3& p) const {
    const double v = Field(p_.mode == VolumeMode::kMelt ? MeltPlace(p) : p) - p_.iso;
    return p_.inside_above ? -v : v;
  }
  Vector3 MeltNormal(const Vector3& p) const {
    // The field's gradient where it is read, times the displacement's own: by the noise's central differences.
    const Vector3 q = MeltPlace(p);
    Vector3 g = FieldGradient(q);
    const double texel = 1.0 / p_.block.size();
    Vector3 slope;
    const double bottom = v_.Low()[1], top = v_.High()[1];
    const double down = Clamped((top - p[1]) / (top - bottom));
    const Vector3 at = {p[0] * p_.frequency, p[1] * p_.frequency * base::kMeltStretch +
                                                 v_.origin[1] * p_.frequency * (1 - base::kMeltStretch),
                        p[2] * p_.frequency};
    const Vector3 drift = {0, base::kMeltDrift * p_.time, 0};
    for (size_t a = 0; a < 3; ++a) {
      Vector3 step = {0, 0, 0};
      step[a] = texel;
      const double n = (NoiseAt(p_.block, Add(at, step), 1, drift) - NoiseAt(p_.block, Add(at, step, -1), 1, drift)) / (2 * texel);
      slope[a] = p_.amount * down * down * base::kMeltNoise * n * p_.frequency * (a == 1 ? base::kMeltStretch : 1);
    }
    if (down > 0 && down < 1) {
      const double n = NoiseAt(p_.block, at, 1, drift);
      slope[1] += -2 * p_.amount * down / (top - bottom) * (1 - base::kMeltNoise + base::kMeltNoise * n);
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
    const double step = base::kSurfaceStep / Length(voxels);
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
    Vector3 normal = Normalized(p_.mode == VolumeMode::kMelt ? MeltNormal(p) : FieldGradient(p));
    if (p_.inside_above) normal = Add({}, normal, -1);
    std::array<double, 3> color = p_.material.color;
    if (p_.mode == VolumeMode::kSolid) {
      const int entries = static_cast<int>(draw_.colors.size() / 4) - 1;
      const double u = std::clamp(NoiseAt(p_.block, p, p_.frequency, {}) * (entries - 1), 0.0, entries - 1.0);
      color = Entry(draw_.colors, u);
    } else if (p_.mode == VolumeMode::kBump) {
      double n[4];
      NoiseAt(p_.block, p, p_.frequency, {}, n);
      const Vector3 sum = Add(Normalized({n[0], n[1], n[2]}), normal, p_.amount);
      if (Length(sum) >= 1e-6) normal = Normalized(sum);
    }
    if (cap) normal = to_eye;
    const Shine s = Lit(normal, to_eye);
    return {color[0] * s.lit + s.gloss, color[1] * s.lit + s.gloss, color[2] * s.lit + s.gloss, 1, t};
  }

  // --- Media. ---
  static std::array<double, 3> Entry(const std::vector<float>& table, double u) {
    const auto i = static_cast<size_t>(u);
    const double f = u - static_cast<double>(i);
    std::array<double, 3> c;
    for (size_t k = 0; k < 3; ++k) c[k] = (1 - f) * table[4 * i + k] + f * table[4 * i + 4 + k];
    return c;
  }
  struct Class {
    std::array<double, 3> color = {0, 0, 0};
    double extinction = 0;
  };
  Class Classify(double value) const {
    const double u = std::clamp((value - draw_.transfer_low) / (draw_.transfer_high - draw_.transfer_low), 0.0, 1.0) *
                     (base::kTransferSize - 1);
    const auto i = static_cast<size_t>(u);
    const double f = u - static_cast<double>(i);
    return {Entry(draw_.transfer, u), (1 - f) * draw_.transfer[4 * i + 3] + f * draw_.transfer[4 * i + 7]};
  }
  Class ClassifyVoxels(const Vector3& p) const {
    const auto& n = v_.size;
    int cell[3];
    double f[3];
    for (size_t a = 0; a < 3; ++a) {
      const double x = std::clamp(Voxels(p[a], a), 0.0, n[a] - 1.0);
      cell[a] = static_cast<int>(std::floor(x));
      f[a] = x - cell[a];
    }
    Class sum;
    for (int c = 0; c < 8; ++c) {
      const int i = c & 1, j = c >> 1 & 1, k = c >> 2;
      const double w = (i ? f[0] : 1 - f[0]) * (j ? f[1] : 1 - f[1]) * (k ? f[2] : 1 - f[2]);
      const Class at = Classify(draw_.volume.At(cell[0] + i, cell[1] + j, cell[2] + k));
      for (size_t q = 0; q < 3; ++q) sum.color[q] += w * at.extinction * at.color[q];
      sum.extinction += w * at.extinction;
    }
    for (double& c : sum.color) c = sum.extinction > 0 ? c / sum.extinction : 0;
    return sum;
  }
  Class ClassifyPair(double front, double back) const {
    const auto place = [&](double v) {
      return std::clamp((v - draw_.transfer_low) / (draw_.transfer_high - draw_.transfer_low), 0.0, 1.0) *
             (base::kPairSize - 1);
    };
    const double u = place(front), w = place(back);
    const auto i = static_cast<size_t>(u), j = static_cast<size_t>(w);
    double c[4];
    for (size_t k = 0; k < 4; ++k) {
      const auto at = [&](size_t b, size_t a) { return static_cast<double>(draw_.pairs[(b * (base::kPairSize + 1) + a) * 4 + k]); };
      const double fu = u - static_cast<double>(i), fw = w - static_cast<double>(j);
      c[k] = (1 - fw) * ((1 - fu) * at(j, i) + fu * at(j, i + 1)) + fw * ((1 - fu) * at(j + 1, i) + fu * at(j + 1, i + 1));
    }
    return {{c[0], c[1], c[2]}, c[3]};
  }

  static Vector3 Drift(const Dmf& step, double time) { return Add({}, step.drift, time); }
  static Vector3 Upright(const Dmf& step, const Vector3& p) { return {p[0], p[1] * step.upright, p[2]}; }
  double Turbulence(const Dmf& step, const Vector3& at) const {
    const Vector3 p = Upright(step, at);
    const Vector3 offset = Drift(step, p_.time);
    double n[4];
    switch (step.lookup) {
      case TurbulenceLookup::kBlock:
        return NoiseAt(step.block, p, step.frequency, offset);
      case TurbulenceLookup::kFourChannels:
        NoiseAt(step.block, p, step.frequency, offset, n);
        return std::fabs(n[0]) + std::fabs(n[1]) / 2 + std::fabs(n[2]) / 4 + std::fabs(n[3]) / 8;
      default: {
        double sum = 0;
        for (int k = 0; k < (step.lookup == TurbulenceLookup::kFour ? 4 : 8); ++k) {
          const double scale = 1 << k;
          sum += std::fabs(NoiseAt(step.block, p, step.frequency * scale, Add({}, offset, scale))) / scale;
        }
        return sum;
      }
    }
  }
  static double Power(double t, double exponent) { return t > 0 ? std::pow(t, exponent) : 0; }
  double Modulate(const Dmf& step, const Vector3& p, double distance, double t) const {
    switch (step.kind) {
      case Dmf::Kind::kBias:
        return Power(t, std::log(step.amount) / std::log(0.5));
      case Dmf::Kind::kGain: {
        const double exponent = std::log(1 - step.amount) / std::log(0.5);
        return t < 0.5 ? 0.5 * Power(2 * t, exponent) : 1 - 0.5 * Power(2 - 2 * t, exponent);
      }
      case Dmf::Kind::kNoise:
        return Clamped(t + step.amount * NoiseAt(step.block, Upright(step, p), step.frequency, Drift(step, p_.time)));
      case Dmf::Kind::kTurbulence:
        return Clamped(t * (1 - step.amount + step.amount * Turbulence(step, p)));
      case Dmf::Kind::kThreshold: {
        const double u = Clamped((t - step.amount) / std::max(step.softness, 1e-6));
        return u * u * (3 - 2 * u);
      }
      case Dmf::Kind::kFunction: {
        const auto x = static_cast<float>(p[0]), y = static_cast<float>(p[1]), z = static_cast<float>(p[2]);
        const auto d = static_cast<float>(distance);
        auto density = static_cast<float>(t);
        step.function({1, &x, &y, &z, &d, &density});
        return Clamped(density);
      }
      default:
        return t;
    }
  }
  Vector3 Moved(const Vector3& p) const {
    Vector3 q = p;
    for (const Dmf& step : p_.dmf) {
      if (step.kind == Dmf::Kind::kWarp) {
        double n[4];
        NoiseAt(step.block, Upright(step, p), step.frequency, Drift(step, p_.time), n);
        q = Add(q, {n[0], n[1], n[2]}, step.amount);
      } else if (step.kind == Dmf::Kind::kLift) {
        q[1] -= step.amount * Turbulence(step, p);
      } else if (step.kind == Dmf::Kind::kSwell) {
        const Vector3 centre = v_.Position(0.5 * (v_.size[0] - 1), 0.5 * (v_.size[1] - 1), 0.5 * (v_.size[2] - 1));
        q = Add(q, Add(q, centre, -1), step.amount * (Turbulence(step, p) - step.block.data().mean));
      }
    }
    return q;
  }

  // Density, normal (or strand) and colour at a point of hypertexture.
  struct Matter {
    Class material;
    Vector3 normal = {0, 0, 0};
    double height = 0;
  };
  Matter Hyper(const Vector3& p) const {
    const Vector3 q = Moved(p);
    const double d = Field(q), outer = p_.iso + p_.soft;
    Matter m;
    double t = p_.soft > 0 ? Clamped((outer - d) / p_.soft) : d <= outer ? 1 : 0;
    m.normal = Normalized(FieldGradient(q));
    m.height = 1 - Clamped((outer - d) / std::max(p_.soft, 1e-30));
    if (p_.mode == VolumeMode::kFur) {
      const Vector3 lean = {base::kFurSway * std::sin(base::kFurPace * p_.time), -1, 0};
      const Vector3 across = Add(lean, m.normal, -Dot(lean, m.normal));
      const double h = 1 - t;
      Vector3 foot = Add(p, m.normal, -std::max(d - p_.iso, 0.0));
      foot = Add(foot, across, -p_.amount * h * h);
      m.normal = Normalized(Add(m.normal, across, 2 * p_.amount / p_.soft * h));
      const double n = Clamped(0.5 + base::kFurSpread * NoiseAt(p_.block, foot, p_.frequency, {}));
      if (t < 1) t *= n < 0.5 ? 4 * n * n * n : 1 - 4 * (1 - n) * (1 - n) * (1 - n);
    }
    for (const Dmf& step : p_.dmf) t = Modulate(step, p, d, t);
    m.material = Classify(t);
    return m;
  }
  Matter Density(const Vector3& p, const Vector3& front, const Vector3& back) const {
    Matter m;
    m.normal = Add({}, Normalized(FieldGradient(p)), -1);
    switch (p_.classification) {
      case Classification::kPost:
        m.material = Classify(Field(p));
        break;
      case Classification::kPre:
        m.material = ClassifyVoxels(p);
        break;
      default:
        m.material = ClassifyPair(Field(front), Field(back));
    }
    return m;
  }

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
      const double o = Voxels(ray.origin[axis], axis), d = ray.direction[axis] / v_.spacing[axis];
      step = 1 / std::fabs(d);
      base = (std::nearbyint(o + ray.enter * d) - o) / d;
    }
    std::vector<std::array<double, 4>> samples;  // colour and opacity, front to back
    std::vector<double> depths;
    double largest = -1, optical = 0;
    const int64_t first = std::max<int64_t>(0, static_cast<int64_t>(std::floor((ray.begin - base) / step + 0.5)));
    for (int64_t i = first;; ++i) {
      const double t = base + static_cast<double>(i) * step;
      if (t - 0.5 * step >= ray.end) break;
      const double share = (std::min(t + 0.5 * step, ray.end) - std::max(t - 0.5 * step, ray.begin)) / step;
      if (share <= 0) continue;
      const Vector3 p = Add(ray.origin, ray.direction, t);
      if (p_.mode == VolumeMode::kMip) {
        largest = std::max(largest, Clamped((Field(p) - draw_.transfer_low) / (draw_.transfer_high - draw_.transfer_low)));
        continue;
      }
      const bool hyper = p_.mode >= VolumeMode::kFur && p_.mode <= VolumeMode::kHyper;
      const Matter m = hyper ? Hyper(p)
                             : Density(p, Add(ray.origin, ray.direction, t - 0.5 * step),
                                       Add(ray.origin, ray.direction, t + 0.5 * step));
      const double length = share * step * world;
      optical += m.material.extinction * length;
      std::array<double, 4> c = {m.material.color[0], m.material.color[1], m.material.color[2],
                                 -std::expm1(-m.material.extinction * length)};
      Paint(m, ToEye(ray), hyper, c);
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

  void Paint(const Matter& m, const Vector3& to_eye, bool hyper, std::array<double, 4>& c) const {
    const VolumeMaterial& light = p_.material;
    if (p_.mode == VolumeMode::kFur) {
      const double cosine = Dot(m.normal, light.light), view = Dot(m.normal, to_eye);
      const double across = std::sqrt(std::max(1 - cosine * cosine, 0.0)), aside = std::sqrt(std::max(1 - view * view, 0.0));
      const double facing = 0.5 + 0.5 * cosine, occlusion = base::kFurRoot + (1 - base::kFurRoot) * m.height;
      const double lit = occlusion * (light.diffuse * facing * (0.4 + 0.6 * across) + light.ambient);
      const double gleam = std::max(across * aside - cosine * view, 0.0);
      const double gloss = gleam > 1e-6 ? light.specular * std::pow(gleam, light.exponent) * facing * facing * occlusion : 0;
      for (size_t k = 0; k < 3; ++k) c[k] = c[k] * light.color[k] * lit + gloss;
    } else if (p_.shade) {
      const Shine s = Lit(m.normal, to_eye);
      for (size_t k = 0; k < 3; ++k) c[k] = c[k] * (hyper ? light.color[k] : 1) * s.lit + s.gloss;
    }
  }

  const VolumeDraw& draw_;
  const VolumeParams& p_;
  const VolumeSpec& v_;
};

void Evaluate(const Call& call) {
  const VolumeDraw& draw = *std::any_cast<const base::VolumeDrawPointer&>(call.parameters);
  const Picture picture(draw);
  const std::vector<Vector3> moves = picture.Moves();
  const Roi& roi = call.out.roi;
  double brightest = 1;
  for (size_t i = 0; i < draw.transfer.size(); ++i) {
    if (i % 4 != 3) brightest = std::max(brightest, static_cast<double>(draw.transfer[i]));
  }
  constexpr double kBound = 168 * 0x1p-24;  // the row's
  for (int y = roi.y0; y < roi.y1; ++y) {
    for (int x = roi.x0; x < roi.x1; ++x) {
      const double scene = draw.with_scene ? call.in[0].at(x, y, 0) : kEndless;
      const Result r = picture.Draw(x, y, scene, {0, 0, 0});
      Result response = {0, 0, 0, 0, 0};
      if (call.scale != nullptr) {
        for (const Vector3& move : moves) {
          const Result m = picture.Draw(x, y, scene, move);
          for (size_t c = 0; c < 5; ++c) {
            const double change = std::fabs(m[c] - r[c]);
            if (m[c] != r[c]) response[c] = std::max(response[c], std::isfinite(change) ? change : 1e30);
          }
        }
      }
      for (int c = 0; c < call.out.channels; ++c) {
        const auto k = static_cast<size_t>(c);
        call.out.at(x, y, c) = r[k];
        if (call.scale == nullptr) continue;
        const double ends = draw.params.mode > VolumeMode::kMelt ? draw.params.termination * brightest : 0;
        call.scale->at(x, y, c) = std::max(1.0, std::fabs(r[k])) + (response[k] + ends) / kBound;
      }
    }
  }
}

}  // namespace

std::vector<Entry> VolumeEntries() { return {{"volume", Evaluate}}; }

}  // namespace tessera::reference
