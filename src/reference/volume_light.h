// Reference of volume pictures: light on normals and in media.
#ifndef TESSERA_REFERENCE_VOLUME_LIGHT_H_
#define TESSERA_REFERENCE_VOLUME_LIGHT_H_

#include <algorithm>
#include <cmath>

#include "reference/volume_substance.h"
#include "tessera/ops/volume.h"

namespace tessera::reference::volume {

constexpr double kNormalError = 2e-6;

// The largest value that a sample may have.
inline double BrightestOf(const ops::volume::VolumeDraw& draw) {
  const VolumeParams& p = draw.params;
  double most = 1;
  for (size_t i = 0; i < draw.transfer.size(); ++i) {
    if (i % 4 != 3) most = std::max(most, static_cast<double>(draw.transfer[i]));
  }
  double own = 0;
  for (const float c : draw.emission) own = std::max(own, static_cast<double>(c));
  const VolumeMaterial& m = p.material;
  const bool hyper = p.mode >= VolumeMode::kFur && p.mode <= VolumeMode::kHyper;
  if ((!p.shade && !p.scatter.lit && p.mode != VolumeMode::kFur) || m.flat) return most + own;
  double color = hyper ? std::max({m.color[0], m.color[1], m.color[2]}) : 1;
  if (p.mode == VolumeMode::kFur) {
    double most_of_strand = 0;
    for (size_t k = 0; k < 3; ++k) most_of_strand = std::max({most_of_strand, p.fur.root[k], p.fur.tip[k]});
    color *= most_of_strand * (1 + p.fur.patches);
  }
  const double g = std::fabs(p.scatter.phase), phase = (1 + g) / ((1 - g) * (1 - g));
  double lights = 1;
  for (const VolumeLight& light : p.scatter.lights)
    lights += std::max({light.color[0], light.color[1], light.color[2]});
  const double lit = most * color * m.diffuse + m.specular;
  return most * color * 1.3 * m.ambient + lit * phase * lights + own;
}

class Lighting {
 protected:
  explicit Lighting(const VolumeParams& params) : params_(params) {}

  struct Shine {
    double lit = 0, gloss = 0, off = 0;  // what the gloss may be off by
  };
  // What the k-th power of a cosine is off by.
  static double PowerError(double base, double exponent) {
    const double near = std::min(base + kNormalError, 1.0);
    return near > 0 ? kNormalError * exponent * std::pow(near, exponent - 1) : 0;
  }
  static Vector3 ToLight(const Vector3& light, bool point, const Vector3& p) {
    return point ? Normalized(Add(light, p, -1)) : light;
  }
  Vector3 ToLight(const Vector3& p) const {
    return ToLight(params_.material.light, params_.material.point, p);
  }
  Shine Lit(const Vector3& normal, const Vector3& to_light, const Vector3& to_eye) const {
    const VolumeMaterial& m = params_.material;
    Shine s;
    if (m.flat) {
      s.lit = 1;
      return s;
    }
    const double facing = Dot(normal, to_light);
    s.lit = m.ambient * (1 + 0.3 * normal[1]) + m.diffuse * std::max(facing, 0.0);
    const double half = Dot(normal, Normalized(Add(to_light, to_eye)));
    if (facing > 0 && half > 1e-6) s.gloss = m.specular * std::pow(half, m.exponent);
    if (facing > -1e-5) s.off = m.specular * PowerError(half, m.exponent);
    return s;
  }
  // Henyey and Greenstein 1941, times 4 pi: the light goes along -l, and on to the eye.
  double Phase(const Vector3& to_light, const Vector3& to_eye) const {
    const double g = params_.scatter.phase, cosine = -Dot(to_light, to_eye);
    return (1 - g * g) / std::pow(1 + g * g - 2 * g * cosine, 1.5);
  }
  // What its float is off by, relative: unit vectors are off by some 3e-7.
  double PhaseError() const {
    const double g = std::fabs(params_.scatter.phase);
    return g == 0 ? 0 : 1e-6 * std::sqrt(g) / (1 - g);
  }

 private:
  const VolumeParams& params_;
};

}  // namespace tessera::reference::volume

#endif  // TESSERA_REFERENCE_VOLUME_LIGHT_H_
