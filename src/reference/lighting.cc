// Reference of normals and Phong's lighting.
#include <algorithm>
#include <any>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/ops/environment.h"

namespace tessera::reference {
namespace {

Vector3 At(const ImageD& image, int x, int y) {
  return {image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
}
bool Usable(double square) { return square > 0 && square < std::numeric_limits<double>::infinity(); }

// Transposed and inverted by cofactors, which are the cross products of the matrix's rows.
Vector3 NormalTimes(const Matrix4& m, const Vector3& n) {
  const Vector3 a = {m[0], m[1], m[2]}, b = {m[4], m[5], m[6]}, c = {m[8], m[9], m[10]};
  const double determinant = Dot(a, Cross(b, c));
  return {Dot(Cross(b, c), n) / determinant, Dot(Cross(c, a), n) / determinant,
          Dot(Cross(a, b), n) / determinant};
}

// Whether a vector is one at all is a decision where it may be off by all that it is.
bool MayBeNothing(const Call& call, int x, int y) {
  double off = 0;
  for (int c = 0; c < 3; ++c) {
    const double each = call.Tolerance(0, x, y, c);
    if (std::fabs(call.in[0].at(x, y, c)) > 2 * each) return false;
    off += each;
  }
  return off > 0;
}

void EvaluateNormals(const Call& call) {
  const auto& p = std::any_cast<const NormalsParams&>(call.parameters);
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      Vector3 n = At(call.in[0], x, y);
      for (double& v : n) v = p.unpack ? 2 * v - 1 : v;
      if (p.matrix) n = NormalTimes(*p.matrix, n);
      if (p.reflect) {
        const Vector3 v = Normalized(*p.reflect);
        const double nv = Dot(n, v), nn = Dot(n, n);
        for (size_t k = 0; k < 3; ++k) n[k] = 2 * nv * n[k] - nn * v[k];
      }
      const double square = Dot(n, n), length = p.normalize && Usable(square) ? std::sqrt(square) : 1;
      if (p.normalize && !p.unpack && MayBeNothing(call, x, y)) {
        for (int c = 0; c < 3; ++c) call.Undecided(x, y, c, 2);
      }
      for (int c = 0; c < call.out.channels; ++c) {
        double v = call.in[0].at(x, y, c);
        if (c < 3) {
          v = n[static_cast<size_t>(c)] / length * (p.flip ? -1 : 1);
          if (p.pack) v = (v + 1) / 2;
        }
        call.out.at(x, y, c) = v;
        const double about = p.pack || p.unpack ? 1 : std::sqrt(square) / length * 1e-7;
        if (call.scale != nullptr)
          call.scale->at(x, y, c) = std::max({std::fabs(v), c < 3 ? about : 0, kSmallestScale});
      }
    }
  }
}

double Power(double x, double e) { return x > 0 ? std::pow(std::min(x, 1.0), e) : 0; }

double Quantized(double v, int bits) {
  const double codes = std::ldexp(1.0, bits) - 1;
  return bits > 0 ? std::nearbyint(v * codes) / codes : v;
}

// The power of a highlight, by formula or by the table that was asked for.
double Highlit(const PhongParams& p, double base) {
  if (p.table == 0) return Power(base, p.exponent);
  const double at = Quantized(std::clamp(base, 0.0, 1.0), p.bits) * (p.table - 1);
  const double cell = std::min(std::floor(at), p.table - 2.0);
  const auto entry = [&](double i) { return Quantized(Power(i / (p.table - 1), p.exponent), p.bits); };
  return Quantized(entry(cell) + (at - cell) * (entry(cell + 1) - entry(cell)), p.bits);
}

void EvaluatePhong(const Call& call) {
  const auto& p = std::any_cast<const PhongParams&>(call.parameters);
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      const Vector3 raw = At(call.in[0], x, y), n = Normalized(raw);
      bool valid = Usable(Dot(raw, raw));
      Vector3 l = p.point ? p.light : Normalized(p.light), v = Normalized(p.view);
      Vector3 to_light = p.light;
      double weight = 1;
      if (call.in.size() == 2) {
        const Vector3 at = At(call.in[1], x, y);
        valid = valid && std::isfinite(Dot(at, at));
        if (p.eye) v = Normalized({(*p.eye)[0] - at[0], (*p.eye)[1] - at[1], (*p.eye)[2] - at[2]});
        if (p.point) {
          l = {p.light[0] - at[0], p.light[1] - at[1], p.light[2] - at[2]};
          to_light = l;
          const double d = std::sqrt(Dot(l, l));
          l = Normalized(l);
          weight = 1 / std::max(p.attenuation[0] + p.attenuation[1] * d + p.attenuation[2] * d * d, 1e-20);
          if (p.spot_cutoff < 180 || p.spot_exponent > 0) {
            const double c = -Dot(l, Normalized(p.spot_direction));
            const double edge = std::cos(p.spot_cutoff * std::numbers::pi / 180);
            weight *= c < edge ? 0 : p.spot_exponent == 0 ? 1 : Power(c, p.spot_exponent);
          }
        }
      }
      double base;
      if (p.highlight == Highlight::kHalfway) {
        const Vector3 half = {l[0] + v[0], l[1] + v[1], l[2] + v[2]};
        base = Dot(half, half) > 1e-30 ? Dot(Normalized(half), n) : 0;
      } else {
        base = 2 * Dot(n, v) * Dot(n, l) - Dot(v, l);
      }
      const double ln = Dot(l, n), high = Dot(to_light, raw) > 0 ? Highlit(p, base) : 0;
      for (int c = 0; c < call.out.channels; ++c) {
        const auto k = static_cast<size_t>(c);
        const double terms[3] = {p.ambient[k], std::max(ln, 0.0) * p.diffuse[k], high * p.specular[k]};
        call.out.at(x, y, c) = valid ? p.emission[k] + weight * (terms[0] + terms[1] + terms[2]) : 0;
        double size = std::fabs(p.emission[k]);
        for (const double term : terms) size += std::fabs(weight * term);
        size += std::fabs(weight * p.diffuse[k]) * 1e-6;  // a cosine of 0 has a rounding too
        if (call.scale != nullptr) call.scale->at(x, y, c) = std::max(size, kSmallestScale);
      }
    }
  }
}

}  // namespace

std::vector<Entry> LightingEntries() { return {{"normals", EvaluateNormals}, {"phong", EvaluatePhong}}; }

}  // namespace tessera::reference
