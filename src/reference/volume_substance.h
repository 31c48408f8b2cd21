// What the reference of volume pictures finds at a point: the field, noise, density and colour, in double.
#ifndef TESSERA_REFERENCE_VOLUME_SUBSTANCE_H_
#define TESSERA_REFERENCE_VOLUME_SUBSTANCE_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "model/volume_settings.h"

namespace tessera::reference {

inline Vector3 Add(const Vector3& a, const Vector3& b, double t = 1) {
  return {a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]};
}
inline double Length(const Vector3& v) { return std::sqrt(Dot(v, v)); }
inline double Clamped(double v) { return std::clamp(v, 0.0, 1.0); }

class Substance {
 public:
  explicit Substance(const ops::volume::VolumeDraw& draw)
      : draw_(draw), p_(draw.params), v_(draw.volume.spec()) {}

  double Voxels(double world, size_t axis) const { return (world - v_.origin[axis]) / v_.spacing[axis]; }
  double Field(const Vector3& p) const;
  double FieldAtVoxels(const Vector3& p) const { return draw_.volume.Sample(p[0], p[1], p[2]); }
  Vector3 FieldGradient(const Vector3& p) const;
  // Channel 0 of noise at world positions times the frequency plus an offset; all four where `channels` is
  // given.
  static double Noise(const NoiseBlock& block, const Vector3& p, double frequency, const Vector3& offset,
                      double* channels = nullptr);
  // Colour at place u of a table of four floats an entry.
  static std::array<double, 3> Entry(const std::vector<float>& table, double u);

  struct Class {
    std::array<double, 3> color = {0, 0, 0};
    double extinction = 0;
  };
  // Density, normal (or strand) and colour at a point.
  struct Matter {
    Class material;
    double value = 0;  // that was looked up, by Classification::kPost
    Vector3 normal = {0, 0, 0};
    double height = 0;  // above the roots
    double patch = 0;   // fur: what colour changes by from place to place
  };
  // `skew`: quantities of normals and gradients that steps are weighted by are off by that share of what
  // floats may be off by.
  Matter Hyper(const Vector3& p, double skew = 0) const;
  // Of a density volume; the segment's ends count where it is pre-integrated.
  Matter Density(const Vector3& p, const Vector3& front, const Vector3& back, double skew = 0) const;
  // Whether a step is weighted by normals or gradients.
  bool ReadsNormals() const;
  Class Classify(double value) const;
  // The medium's own light.
  std::array<double, 3> Glow(double value) const;

 private:
  // The place of a value among the entries of the transfer function.
  double Place(double value) const;
  Class ClassifyVoxels(const Vector3& p) const;
  Class ClassifyPair(double front, double back) const;
  double Turbulence(const Dmf& step, const Vector3& at) const;
  double Modulate(const Dmf& step, const Vector3& p, double distance, double solid, double t) const;
  // What a step may be weighted by; null where it moves the place that the field is read at.
  struct Around {
    Vector3 outward = {0, 0, 0};
    double slope = 0, solid = 0, off = 0, slope_off = 0;
  };
  double Weight(const Dmf& step, const Vector3& p, const Around* around) const;
  // A density t after the whole chain.
  double Chain(const Vector3& p, const Vector3& moved, double value, double t, double outward,
               double skew) const;
  Vector3 Moved(const Vector3& p) const;

  const ops::volume::VolumeDraw& draw_;
  const VolumeParams& p_;
  const VolumeSpec& v_;
};

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_VOLUME_SUBSTANCE_H_
