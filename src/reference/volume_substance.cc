// What the reference of volume pictures finds at a point.
#include "reference/volume_substance.h"

#include "model/volume_settings.h"
#include "reference/noise_lattice.h"

namespace tessera::reference {
namespace {

Vector3 Drift(const Dmf& step, double time) { return Add({}, step.drift, time); }
Vector3 Upright(const Dmf& step, const Vector3& p) { return {p[0], p[1] * step.upright, p[2]}; }
Vector3 Shift(int octave) {
  const auto& s = ops::volume::kOctaveShifts[octave];
  return {s[0], s[1], s[2]};
}
double Power(double t, double exponent) { return t > 0 ? std::pow(t, exponent) : 0; }
// Linear between points, constant beyond.
double Follow(const std::vector<std::array<double, 2>>& points, double at) {
  if (!(at >= points.front()[0])) return points.front()[1];
  for (size_t i = points.size() - 1; i-- > 0;) {
    const auto &a = points[i], &b = points[i + 1];
    if (at >= b[0]) return b[1] + 0 * a[0];
    if (at >= a[0]) return a[1] + (b[1] - a[1]) * (at - a[0]) / (b[0] - a[0]);
  }
  return points.back()[1];
}
bool OfNormals(const DmfInput& input) {
  return input.kind == DmfInput::Kind::kGradient || input.kind == DmfInput::Kind::kLight ||
         input.kind == DmfInput::Kind::kEye;
}

}  // namespace

double Substance::Field(const Vector3& p) const {
  return draw_.volume.Sample(Voxels(p[0], 0), Voxels(p[1], 1), Voxels(p[2], 2));
}

Vector3 Substance::FieldGradient(const Vector3& p) const {
  Vector3 g = draw_.volume.Gradient(Voxels(p[0], 0), Voxels(p[1], 1), Voxels(p[2], 2));
  for (size_t a = 0; a < 3; ++a) g[a] /= v_.spacing[a];
  return g;
}

double Substance::Noise(const NoiseBlock& block, const Vector3& p, double frequency, const Vector3& offset,
                        double* channels) {
  double values[4] = {0, 0, 0, 0};
  block.Sample(Add(offset, p, frequency), values);
  if (channels != nullptr) std::copy_n(values, 4, channels);
  return values[0];
}

std::array<double, 3> Substance::Entry(const std::vector<float>& table, double u) {
  const auto i = static_cast<size_t>(u);
  const double f = u - static_cast<double>(i);
  std::array<double, 3> c;
  for (size_t k = 0; k < 3; ++k) c[k] = (1 - f) * table[4 * i + k] + f * table[4 * i + 4 + k];
  return c;
}

double Substance::Place(double value) const {
  return std::clamp((value - draw_.transfer_low) / (draw_.transfer_high - draw_.transfer_low), 0.0, 1.0) *
         (ops::volume::kTransferSize - 1);
}

Substance::Class Substance::Classify(double value) const {
  const double u = Place(value);
  const auto i = static_cast<size_t>(u);
  const double f = u - static_cast<double>(i);
  return {Entry(draw_.transfer, u), (1 - f) * draw_.transfer[4 * i + 3] + f * draw_.transfer[4 * i + 7]};
}

std::array<double, 3> Substance::Glow(double value) const { return Entry(draw_.emission, Place(value)); }

Substance::Class Substance::ClassifyVoxels(const Vector3& p) const {
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

Substance::Class Substance::ClassifyPair(double front, double back) const {
  const auto place = [&](double v) {
    return std::clamp((v - draw_.transfer_low) / (draw_.transfer_high - draw_.transfer_low), 0.0, 1.0) *
           (ops::volume::kPairSize - 1);
  };
  const double u = place(front), w = place(back);
  const auto i = static_cast<size_t>(u), j = static_cast<size_t>(w);
  double c[4];
  for (size_t k = 0; k < 4; ++k) {
    const auto at = [&](size_t b, size_t a) {
      return static_cast<double>(draw_.pairs[(b * (ops::volume::kPairSize + 1) + a) * 4 + k]);
    };
    const double fu = u - static_cast<double>(i), fw = w - static_cast<double>(j);
    c[k] = (1 - fw) * ((1 - fu) * at(j, i) + fu * at(j, i + 1)) +
           fw * ((1 - fu) * at(j + 1, i) + fu * at(j + 1, i + 1));
  }
  return {{c[0], c[1], c[2]}, c[3]};
}

double Substance::Turbulence(const Dmf& step, const Vector3& at) const {
  const Vector3 p = Upright(step, at);
  const Vector3 offset = Drift(step, p_.time);
  double n[4];
  switch (step.lookup) {
    case TurbulenceLookup::kBlock:
      return Noise(step.block, p, step.frequency, offset);
    case TurbulenceLookup::kFourChannels:
      Noise(step.block, p, step.frequency, offset, n);
      return std::fabs(n[0]) + std::fabs(n[1]) / 2 + std::fabs(n[2]) / 4 + std::fabs(n[3]) / 8;
    case TurbulenceLookup::kExact: {
      NoiseParams noise;
      noise.dims = 3;
      double sum = 0;
      for (int k = 0; k < kTurbulenceOctaves; ++k) {
        const double scale = 1 << k;
        const uint32_t period = kTurbulenceCells, seed = OctaveSeed(0, 0, 0);
        NoisePlace place;
        for (size_t a = 0; a < 3; ++a) {
          const double u = (p[a] * step.frequency + offset[a]) * scale + Shift(k)[a];
          const double cell = (u - std::floor(u)) * period, whole = std::floor(cell);
          place.cell[a] = static_cast<uint32_t>(whole) % period;
          place.fraction[a] = cell - whole;
        }
        sum += std::fabs(EvaluateNoise(noise, seed, {period, period, period, 0}, 0, place).value) / scale;
      }
      return sum;
    }
    default: {
      double sum = 0;
      for (int k = 0; k < (step.lookup == TurbulenceLookup::kFour ? 4 : 8); ++k) {
        const double scale = 1 << k;
        const Vector3 at_octave = Add(Shift(k), offset, scale);
        sum += std::fabs(Noise(step.block, p, step.frequency * scale, at_octave)) / scale;
      }
      return sum;
    }
  }
}

double Substance::Modulate(const Dmf& step, const Vector3& p, double distance, double solid, double t) const {
  switch (step.kind) {
    case Dmf::Kind::kBias:
      return Power(t, std::log(step.amount) / std::log(0.5));
    case Dmf::Kind::kGain: {
      const double exponent = std::log(1 - step.amount) / std::log(0.5);
      return t < 0.5 ? 0.5 * Power(2 * t, exponent) : 1 - 0.5 * Power(2 - 2 * t, exponent);
    }
    case Dmf::Kind::kNoise:
      return Clamped(t + std::min(1.0, 8 * std::min(solid, 1 - solid)) * step.amount *
                             Noise(step.block, Upright(step, p), step.frequency, Drift(step, p_.time)));
    case Dmf::Kind::kTurbulence:
      return Clamped(t * (1 - step.amount + step.amount * Turbulence(step, p)));
    case Dmf::Kind::kThreshold: {
      const double u = Clamped((t - step.amount) / std::max(step.softness, 1e-6));
      return solid > 0 ? u * u * (3 - 2 * u) : 0;
    }
    case Dmf::Kind::kTable:
      return solid > 0 ? Clamped(Follow(step.table, t)) : 0;
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

bool Substance::ReadsNormals() const {
  for (const Dmf& step : p_.dmf) {
    for (const DmfInput& input : step.inputs) {
      if (OfNormals(input)) return true;
    }
  }
  return false;
}

double Substance::Weight(const Dmf& step, const Vector3& p, const Around* around) const {
  const auto to_eye = [&]() -> Vector3 {
    const Camera& camera = p_.camera;
    if (camera.perspective()) return Normalized(Add(camera.eye(), p, -1));
    const Roi& w = draw_.window;
    const Camera::Ray ray = camera.PixelRay(w, w.x0 + 0.5 * (w.width() - 1), w.y0 + 0.5 * (w.height() - 1));
    return Normalized(Add({}, ray.direction, -1));
  };
  const VolumeMaterial& m = p_.material;
  double product = 1;
  for (const DmfInput& input : step.inputs) {
    double at = 0;
    switch (input.kind) {
      case DmfInput::Kind::kGradient:
        at = around->slope + around->slope_off;
        break;
      case DmfInput::Kind::kLight:
        at = Dot(around->outward, m.point ? Normalized(Add(m.light, p, -1)) : m.light) + around->off;
        break;
      case DmfInput::Kind::kEye:
        at = Dot(around->outward, to_eye()) + around->off;
        break;
      case DmfInput::Kind::kDensity:
        at = around->solid;
        break;
      case DmfInput::Kind::kHeight:
        at = p[1];
        break;
      case DmfInput::Kind::kPlane:
        at = Dot(input.place, p);
        break;
      case DmfInput::Kind::kSphere:
        at = Length(Add(p, input.place, -1));
    }
    product *= Follow(input.points, at);
  }
  return product;
}

double Substance::Chain(const Vector3& p, const Vector3& moved, double value, double t, double outward,
                        double skew) const {
  Around around;
  around.solid = t;
  if (ReadsNormals()) {
    const Vector3 gradient = FieldGradient(moved);
    around.outward = Add({}, Normalized(gradient), outward);
    around.slope = Length(gradient);
    // Codes are interpolated by floats: a gradient's digits are those of the codes.
    const double voxel = std::min({v_.spacing[0], v_.spacing[1], v_.spacing[2]});
    const double digits = 5e-7 * std::max(std::fabs(value - v_.bias), std::fabs(v_.scale) * 1e-3) / voxel;
    around.slope_off = skew * (digits + 1e-6 * around.slope);
    // Where all samples are the same, there is no gradient whatever the digits.
    const double turned = around.slope > 1e-3 * digits ? std::min(2.0, digits / around.slope) : 0;
    around.off = skew * (2e-6 + turned);
  }
  const double solid = t;
  for (const Dmf& step : p_.dmf) {
    const double changed = Modulate(step, p, value, solid, t);
    t += step.inputs.empty() ? changed - t : Weight(step, p, &around) * (changed - t);
  }
  return t;
}

Vector3 Substance::Moved(const Vector3& p) const {
  Vector3 q = p;
  for (const Dmf& step : p_.dmf) {
    const Vector3 before = q;
    if (step.kind == Dmf::Kind::kWarp) {
      double n[4];
      Noise(step.block, Upright(step, p), step.frequency, Drift(step, p_.time), n);
      q = Add(q, {n[0], n[1], n[2]}, step.amount);
    } else if (step.kind == Dmf::Kind::kLift) {
      q[1] -= step.amount * Turbulence(step, p);
    } else if (step.kind == Dmf::Kind::kSwell) {
      const Vector3 centre =
          v_.Position(0.5 * (v_.size[0] - 1), 0.5 * (v_.size[1] - 1), 0.5 * (v_.size[2] - 1));
      q = Add(q, Add(q, centre, -1), step.amount * (Turbulence(step, p) - step.block.data().mean));
    } else {
      continue;
    }
    if (!step.inputs.empty()) q = Add(before, Add(q, before, -1), Weight(step, p, nullptr));
  }
  return q;
}

Substance::Matter Substance::Hyper(const Vector3& p, double skew) const {
  const Vector3 q = Moved(p);
  const double d = Field(q), outer = p_.iso + p_.soft;
  Matter m;
  double t = p_.soft > 0 ? Clamped((outer - d) / p_.soft) : d <= outer ? 1 : 0;
  m.normal = Normalized(FieldGradient(q));
  m.height = 1 - Clamped((outer - d) / std::max(p_.soft, 1e-30));
  if (p_.mode == VolumeMode::kFur) {
    const Vector3 lean = {ops::volume::kFurSway * std::sin(ops::volume::kFurPace * p_.time), -1, 0};
    const Vector3 across = Add(lean, m.normal, -Dot(lean, m.normal));
    const double h = 1 - t;
    Vector3 foot = Add(p, m.normal, -std::max(d - p_.iso, 0.0));
    foot = Add(foot, across, -p_.amount * h * h);
    m.normal = Normalized(Add(m.normal, across, 2 * p_.amount / p_.soft * h));
    const double n = Clamped(0.5 + ops::volume::kFurSpread * Noise(p_.block, foot, p_.frequency, {}));
    // Counted from the block that the volume's first voxel is in.
    Vector3 blocks;
    for (size_t k = 0; k < 3; ++k)
      blocks[k] = -ops::volume::kFurPatch * std::floor(v_.origin[k] * p_.frequency);
    m.patch = Noise(p_.block, foot, ops::volume::kFurPatch * p_.frequency, blocks);
    if (t < 1) {
      const double over = Clamped((h - ops::volume::kFurUnder) / 0.25);
      const double least = ops::volume::kFurThin[0] + ops::volume::kFurThin[1] * h +
                           p_.fur.guard * ops::volume::kFurGuard * over * over * (3 - 2 * over);
      t = Clamped(ops::volume::kFurSharp * (n - least)) * std::min(ops::volume::kFurEnd * t, 1.0);
    }
  }
  t = Chain(p, q, d, t, 1, skew);
  m.value = t;
  m.material = Classify(t);
  return m;
}

Substance::Matter Substance::Density(const Vector3& p, const Vector3& front, const Vector3& back,
                                     double skew) const {
  Matter m;
  if (!p_.dmf.empty()) {
    const Vector3 q = Moved(p);
    const double low = draw_.transfer_low, domain = draw_.transfer_high - low, value = Field(q);
    m.normal = Add({}, Normalized(FieldGradient(q)), -1);
    m.value = low + domain * Chain(p, q, value, Clamped((value - low) / domain), -1, skew);
    m.material = Classify(m.value);
    return m;
  }
  m.normal = Add({}, Normalized(FieldGradient(p)), -1);
  switch (p_.classification) {
    case Classification::kPost:
      m.value = Field(p);
      m.material = Classify(m.value);
      break;
    case Classification::kPre:
      m.material = ClassifyVoxels(p);
      break;
    default:
      m.material = ClassifyPair(Field(front), Field(back));
  }
  return m;
}

}  // namespace tessera::reference
