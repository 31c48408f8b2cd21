// Checks and completes the parameters of volume pictures.
#include "ops/volume/prepare.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "model/black_body.h"
#include "model/volume_settings.h"
#include "ops/range.h"
#include "ops/volume/transfer.h"
#include "tessera/error.h"

namespace tessera::ops::volume {
namespace {

constexpr char kName[] = "volume";

// Drops below a body: long where a noise is high, with round ends.
Volume Dripping(const Volume& field, const VolumeParams& p, double side) {
  const double depth = kDripDepth * side, frequency = kDripNoise * p.frequency;
  const auto slope = [&](double x, double z) {
    double n = 0;
    p.block.Sample({x * frequency, 0.31 + kMeltDrift * p.time, z * frequency}, &n);
    const double u = std::clamp((n - kDripFrom) / (kDripTo - kDripFrom), 0.0, 1.0);
    return depth / (p.drip * u * u * (3 - 2 * u));  // infinite where none is
  };
  return Drawn(field, {.down = true, .iso = p.iso, .depth = depth, .slope = slope});
}

// Flames: the field drawn upward. They end below the volume's top, which would cut them.
Volume Burning(const Volume& field, const VolumeParams& p, double side) {
  const double slope = p.soft / p.amount;
  Volume drawn = Drawn(field, {.iso = p.iso, .depth = 0, .slope = [=](double, double) { return slope; }});
  const VolumeSpec& spec = drawn.spec();
  const double room = std::min(p.amount, kFireRoom * side) / spec.spacing[1];
  model::VolumeData& data = *drawn.data();
  for (int k = 0; k < spec.size[2]; ++k) {
    for (int j = 0; j < spec.size[1]; ++j) {
      const double u = 1 - (spec.size[1] - 1 - j) / room;
      if (!(u > 0)) continue;
      const double more = p.soft * u * u * (3 - 2 * u);
      for (int i = 0; i < spec.size[0]; ++i) {
        const double d = data.code_scale * data.Code(i, j, k) + data.code_bias;
        data.SetCode(i, j, k, (std::max(d, p.iso) + more - data.code_bias) / data.code_scale);
      }
    }
    data.Trim();
  }
  data.FillBorder();
  return drawn;
}

}  // namespace

bool IsSurface(VolumeMode mode) { return mode <= VolumeMode::kMelt; }
bool IsHyper(VolumeMode mode) { return mode >= VolumeMode::kFur && mode <= VolumeMode::kHyper; }

int StackAxis(const Camera& camera, const VolumeSpec& v) {
  double most = -1;
  int axis = 2;
  for (int a = 0; a < 3; ++a) {
    const auto c = static_cast<size_t>(a);
    const double along = std::fabs(camera.forward()[c]) / v.spacing[c];
    if (along > most * (1 + 1e-9)) most = along, axis = a;
  }
  return axis;
}

VolumeDraw Complete(const ImageSpec& spec, const Volume& volume, const VolumeParams& given) {
  VolumeDraw draw;
  draw.volume = volume;
  draw.params = given;
  draw.window = spec.display_window.empty() ? spec.data_window : spec.display_window;
  const VolumeSpec& v = volume.spec();
  VolumeParams& p = draw.params;
  for (double n : {p.iso, p.soft, p.time, p.frequency, p.amount, p.drip, p.step})
    RequireRange(kName, "a parameter of ", n, -1e6, 1e6);
  if (p.soft == -1) p.soft = p.mode == VolumeMode::kFur ? 0.08 : p.mode == VolumeMode::kFire ? 0.1 : 0.12;
  RequireRange(kName, "a soft region of ", p.soft, 0, 1e6);
  RequireRange(kName, "a step of ", p.step, 0, 1e6);
  RequireRange(kName, "a loop of ", p.loop, 0, 1e6);
  RequireRange(kName, "a termination of ", p.termination, 0, 1);
  RequireRange(kName, "a frequency of ", p.frequency, 0, 1e6);
  if (p.planes.size() > 16) throw Error(kName, "found more than 16 cutting planes");
  for (double c : p.material.color) RequireRange(kName, "a colour of ", c, 0, 1e6);
  RequireRange(kName, "an exponent of ", p.material.exponent, 0, 1e4);
  for (const auto& color : {p.fur.root, p.fur.tip}) {
    for (double c : color) RequireRange(kName, "a colour of hair of ", c, 0, 1e6);
  }
  for (double c : {p.fur.guard, p.fur.patches}) RequireRange(kName, "a share of hair of ", c, 0, 1);
  for (double c : {p.material.ambient, p.material.diffuse, p.material.specular})
    RequireRange(kName, "a light of ", c, 0, 1e6);
  if (!p.material.point) p.material.light = Normalized(p.material.light);
  for (double c : p.material.light) RequireRange(kName, "a light at ", c, -1e6, 1e6);
  const double voxel = Smallest(v.spacing);
  if (p.step == 0)
    p.step = p.mode == VolumeMode::kFire ? 2.5 * voxel : p.mode == VolumeMode::kFur ? 1.25 * voxel : voxel;
  VolumeScattering& scatter = p.scatter;
  RequireRange(kName, "a shadow of ", scatter.shadow, 0, 1);
  RequireRange(kName, "a phase of ", scatter.phase, -0.95, 0.95);
  RequireRange(kName, "a shadow's step of ", scatter.step, 0, 1e6);
  if (scatter.size != 0) RequireRange(kName, "a shadow's size of ", scatter.size, 2, 256);
  if (scatter.lights.size() > 7) {
    throw Error(kName,
                "found " + std::to_string(scatter.lights.size()) + " further lights, expected at most 7");
  }
  for (VolumeLight& light : scatter.lights) {
    if (!light.point) light.light = Normalized(light.light);
    for (double c : light.light) RequireRange(kName, "a further light at ", c, -1e6, 1e6);
    for (double c : light.color) RequireRange(kName, "a further light's colour of ", c, 0, 1e6);
  }
  // A way towards no light has no end.
  const auto require_direction = [&](const Vector3& light, bool point) {
    if (scatter.shadow > 0 && !point && light == Vector3{})
      throw Error(kName, "found a light in the direction 0,0,0, expected one of some length beside shadow=");
  };
  require_direction(p.material.light, p.material.point);
  for (const VolumeLight& light : scatter.lights) require_direction(light.light, light.point);
  scatter.lit = scatter.lit || scatter.shadow > 0 || scatter.phase != 0 || !scatter.lights.empty();
  if (scatter.step == 0) scatter.step = p.step;
  const double side =
      std::max({v.size[0] * v.spacing[0], v.size[1] * v.spacing[1], v.size[2] * v.spacing[2]});
  if (p.emission.high != 0 || p.emission.low != 0) {
    for (const double kelvin : {p.emission.low, p.emission.high})
      RequireRange(kName, "a black body of ", kelvin, model::kColdestBody, model::kHottestBody);
  }
  RequireRange(kName, "a black body's strength of ", p.emission.strength, 0, 1e6);
  const int most = std::max({v.size[0], v.size[1], v.size[2]});
  if (scatter.size == 0) scatter.size = std::clamp(most / 2 + 1, 2, 64);
  for (size_t a = 0; a < 3; ++a) {
    const double share = v.size[a] * v.spacing[a] / side;
    draw.nodes[a] = std::max(2, static_cast<int>(std::lrint((scatter.size - 1) * share)) + 1);
  }
  if (p.method == VolumeMethod::kShearWarp && p.camera.perspective()) {
    // All slices lie before the eye, the nearest one a slice away or more.
    const auto axis = static_cast<size_t>(StackAxis(p.camera, v));
    const double eye = (p.camera.eye()[axis] - v.origin[axis]) / v.spacing[axis];
    const bool backward = p.camera.forward()[axis] < 0;
    if (backward ? eye < v.size[axis] : eye > -1) {
      throw Error(kName,
                  "found the eye between the slices of method shearwarp, expected it before all of them");
    }
  }
  const auto need_block = [&](NoiseContent content, int cells, int octaves, int channels) {
    if (p.block.empty()) p.block = NoiseBlock(content, cells, octaves);
    if (p.block.channels() != channels) {
      throw Error(kName, "found a noise block of " + std::to_string(p.block.channels()) +
                             " channels, expected " + std::to_string(channels));
    }
  };
  const auto otherwise = [](double& value, double missing, double preset) {
    if (value == missing) value = preset;
  };
  switch (p.mode) {
    case VolumeMode::kSolid:
      otherwise(p.frequency, 0, 2.7 / side);
      need_block(NoiseContent::kMarble, 4, 5, 1);
      MakeColors(draw);
      break;
    case VolumeMode::kBump:
      otherwise(p.frequency, 0, 5 / side);
      if (p.amount < 0) p.amount = 1.6;
      need_block(NoiseContent::kGradient, 8, 1, 4);
      break;
    case VolumeMode::kMelt:
      otherwise(p.frequency, 0, 1.8 / side);
      if (p.amount < 0) p.amount = 0.21 * side * (1 - std::exp(-0.6 * (p.time > 0 ? p.time : 2.5)));
      need_block(NoiseContent::kNoise, 5, 1, 1);
      if (p.drip < 0) p.drip = 0.17 * side * (1 - std::exp(-0.6 * (p.time > 0 ? p.time : 2.5)));
      if (p.drip > 0 && !p.inside_above) draw.volume = Dripping(volume, p, side);
      break;
    case VolumeMode::kFur:
      otherwise(p.frequency, 0, 14 / side);
      // Farther, feet of strands on an ear of the body would leave its tip and meet on its axis.
      if (p.amount < 0) p.amount = 0.375 * p.soft;
      need_block(NoiseContent::kNoise, 16, 1, 1);
      break;
    default:
      break;
  }
  if (p.mode == VolumeMode::kFire) {
    if (p.amount < 0) p.amount = 0.3 * side;
    if (p.dmf.empty()) p.dmf = FireChain(p, side);
    if (p.amount > 0 && p.soft > 0 && !p.inside_above) draw.volume = Burning(volume, p, side);
  }
  if (!IsSurface(p.mode)) {
    for (Dmf& step : p.dmf) {
      // Steps that read the same noise share its block.
      for (const Dmf& before : p.dmf) {
        const auto reads = [](Dmf::Kind kind) {
          return kind == Dmf::Kind::kTurbulence || kind == Dmf::Kind::kLift || kind == Dmf::Kind::kSwell;
        };
        const bool turbulent = reads(step.kind) && reads(before.kind);
        if (&before == &step) break;
        if (turbulent && step.block.empty() && before.lookup == step.lookup) step.block = before.block;
      }
      for (size_t a = 0; a < 3 && p.loop > 0; ++a) {
        // Blocks of noise repeat.
        const double blocks = std::fabs(step.drift[a]) * p.loop, least = a == 1 && blocks > 0 ? 1 : 0;
        step.drift[a] = std::copysign(std::max(std::round(blocks), least) / p.loop, step.drift[a]);
      }
      CompleteDmf(step);
    }
  }
  if (!IsSurface(p.mode)) MakeTransfer(draw);
  return draw;
}

VolumeDraw CompletePlaced(const ImageSpec& spec, const PlacedVolume& placed, const Camera& camera) {
  const Matrix4& m = placed.to_world;
  VolumeParams p = placed.params;
  p.camera = camera;
  // Of the rotation's columns.
  const auto turned = [&](const Vector3& v) {
    Vector3 r;
    for (size_t a = 0; a < 3; ++a) r[a] = m[a] * v[0] + m[4 + a] * v[1] + m[8 + a] * v[2];
    return r;
  };
  for (size_t a = 0; a < 3; ++a) {
    const Vector3 column = turned({m[a], m[4 + a], m[8 + a]});
    bool rigid = m[12 + a] == 0 && m[15] == 1 && std::isfinite(m[4 * a + 3]);
    for (size_t b = 0; b < 3; ++b) rigid &= std::fabs(column[b] - (a == b ? 1 : 0)) < 1e-6;
    if (!rigid) throw Error(kName, "found a placement that scales or shears, expected a rigid motion");
  }
  if (m != kIdentity4) {
    p.camera = Camera(Product(camera.world_to_camera(), m), Product(camera.world_to_clip(), m));
    const auto place = [&](Vector3& light, bool point) {
      if (point) light = {light[0] - m[3], light[1] - m[7], light[2] - m[11]};
      light = turned(light);
    };
    place(p.material.light, p.material.point);
    for (VolumeLight& light : p.scatter.lights) place(light.light, light.point);
    for (CuttingPlane& plane : p.planes) {
      plane.offset -= Dot(plane.normal, {m[3], m[7], m[11]});
      plane.normal = turned(plane.normal);
    }
  }
  VolumeDraw draw = Complete(spec, placed.volume, p);
  draw.placed = placed;
  draw.placed.params.camera = camera;
  return draw;
}

}  // namespace tessera::ops::volume
