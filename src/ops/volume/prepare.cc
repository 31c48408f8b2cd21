// Completes the parameters of volume pictures and turns them into kernel arguments.
#include "ops/volume/prepare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/number_text.h"
#include "model/volume_settings.h"
#include "ops/volume/transfer.h"
#include "tessera/error.h"

namespace tessera::ops::volume {
namespace {

constexpr char kName[] = "volume";

void RequireRange(const char* what, double v, double low, double high) {
  if (v >= low && v <= high) return;
  throw Error(kName, std::string("found ") + what + " " + base::NumberText(v) + ", expected " +
                         base::NumberText(low) + " to " + base::NumberText(high));
}

Vector3 Centre(const VolumeSpec& s) {
  return s.Position(0.5 * (s.size[0] - 1), 0.5 * (s.size[1] - 1), 0.5 * (s.size[2] - 1));
}
// The axis that the view is nearest to, x before y before z.
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
double Smallest(const Vector3& v) { return std::min({v[0], v[1], v[2]}); }

RaySet RaysOf(const VolumeDraw& draw, double middle) {
  const VolumeSpec& v = draw.volume.spec();
  const Camera& camera = draw.params.camera;
  const Roi& w = draw.window;
  RaySet r{};
  r.perspective = camera.perspective();
  const double mx = w.x0 + 0.5 * (w.width() - 1), my = w.y0 + 0.5 * (w.height() - 1);
  r.middle_x = static_cast<float>(mx);
  r.middle_y = static_cast<float>(my);
  r.middle_depth = static_cast<float>(middle);
  r.centre = static_cast<float>(camera.PlanarDepth(Centre(v)) - middle);
  const Camera::Ray at[3] = {camera.PixelRay(w, mx, my), camera.PixelRay(w, mx + 1, my),
                             camera.PixelRay(w, mx, my + 1)};
  for (size_t a = 0; a < 3; ++a) {
    double origin[3], direction[3];
    for (size_t c = 0; c < 3; ++c) {
      origin[c] = (at[c].origin[a] + middle * at[c].direction[a] - v.origin[a]) / v.spacing[a];
      direction[c] = at[c].direction[a] / v.spacing[a];
    }
    for (size_t c = 0; c < 3; ++c) {
      r.origin[a][c] = static_cast<float>(c == 0 ? origin[0] : origin[c] - origin[0]);
      r.direction[a][c] = static_cast<float>(c == 0 ? direction[0] : direction[c] - direction[0]);
    }
    r.spacing[a] = static_cast<float>(v.spacing[a]);
    r.to_world[a] = static_cast<float>(v.origin[a]);
    r.low[a] = -0.5f;
    r.high[a] = static_cast<float>(v.size[a]) - 0.5f;
  }
  r.aovs = draw.params.aovs;
  for (size_t k = 0; k < 12; ++k) r.place[k] = static_cast<float>(draw.placed.to_world[k]);
  r.planes = static_cast<int>(draw.params.planes.size());
  for (int k = 0; k < r.planes; ++k) {
    const CuttingPlane& p = draw.params.planes[static_cast<size_t>(k)];
    for (size_t a = 0; a < 3; ++a) r.plane[k][a] = static_cast<float>(p.normal[a] * v.spacing[a]);
    r.plane[k][3] = static_cast<float>(p.offset - Dot(p.normal, v.origin));
  }
  return r;
}

Field FieldOf(const VolumeDraw& draw) {
  const model::VolumeData& data = *draw.volume.data();
  Field f;
  f.samples = data.samples;
  f.type = data.spec.type;
  f.row = static_cast<int32_t>(data.row);
  f.slice = static_cast<int32_t>(data.slice);
  for (size_t a = 0; a < 3; ++a) f.last[a] = static_cast<float>(data.spec.size[a] - 1);
  f.scale = static_cast<float>(data.code_scale);
  f.bias = static_cast<float>(data.code_bias);
  f.leaps = draw.params.leap;
  return f;
}

NoiseView ViewOf(const NoiseBlock& block, const VolumeSpec& v, double frequency,
                 const Vector3& offset = {0, 0, 0}, double upright = 1) {
  const NoiseBlock::Data& d = block.data();
  NoiseView n;
  const ptrdiff_t first = static_cast<ptrdiff_t>(d.slice) + d.row + 1;
  n.samples = d.samples.get() + first * d.channels;
  if (d.channels == 1) n.cells = d.cells.get() + 4 * first;
  n.row = d.row;
  n.slice = d.slice;
  n.size = d.size;
  n.scale = d.scale;
  n.bias = d.bias;
  n.half = 0.5f / static_cast<float>(d.size);
  for (size_t a = 0; a < 3; ++a) {
    const double along = a == 1 ? frequency * upright : frequency;
    n.times[a] = static_cast<float>(v.spacing[a] * along);
    const double plus = v.origin[a] * along + offset[a];
    n.plus[a] = static_cast<float>(plus - std::floor(plus));
  }
  return n;
}

}  // namespace

bool IsSurface(VolumeMode mode) { return mode <= VolumeMode::kMelt; }
bool IsHyper(VolumeMode mode) { return mode >= VolumeMode::kFur && mode <= VolumeMode::kHyper; }

VolumeDraw Complete(const ImageSpec& spec, const Volume& volume, const VolumeParams& given) {
  VolumeDraw draw;
  draw.volume = volume;
  draw.params = given;
  draw.window = spec.display_window.empty() ? spec.data_window : spec.display_window;
  const VolumeSpec& v = volume.spec();
  VolumeParams& p = draw.params;
  for (double n : {p.iso, p.soft, p.time, p.frequency, p.amount, p.step})
    RequireRange("a parameter of", n, -1e6, 1e6);
  if (p.soft == -1) p.soft = p.mode == VolumeMode::kFur ? 0.08 : p.mode == VolumeMode::kFire ? 0.1 : 0.12;
  RequireRange("a soft region of", p.soft, 0, 1e6);
  RequireRange("a step of", p.step, 0, 1e6);
  RequireRange("a termination of", p.termination, 0, 1);
  RequireRange("a frequency of", p.frequency, 0, 1e6);
  if (p.planes.size() > 16) throw Error(kName, "found more than 16 cutting planes");
  for (double c : p.material.color) RequireRange("a colour of", c, 0, 1e6);
  RequireRange("an exponent of", p.material.exponent, 0, 1e4);
  for (double c : {p.material.ambient, p.material.diffuse, p.material.specular})
    RequireRange("a light of", c, 0, 1e6);
  if (!p.material.point) p.material.light = Normalized(p.material.light);
  for (double c : p.material.light) RequireRange("a light at", c, -1e6, 1e6);
  const double voxel = Smallest(v.spacing);
  if (p.step == 0)
    p.step = p.mode == VolumeMode::kFire ? 2.5 * voxel : p.mode == VolumeMode::kFur ? 1.25 * voxel : voxel;
  const double side =
      std::max({v.size[0] * v.spacing[0], v.size[1] * v.spacing[1], v.size[2] * v.spacing[2]});
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
  if (p.mode == VolumeMode::kFire && p.dmf.empty()) p.dmf = FireChain(p, side);
  if (IsHyper(p.mode)) {
    for (Dmf& step : p.dmf) {
      // Steps that read the same noise share its block.
      for (const Dmf& before : p.dmf) {
        const bool turbulent = step.kind >= Dmf::Kind::kTurbulence && step.kind != Dmf::Kind::kWarp &&
                               step.kind != Dmf::Kind::kThreshold && before.kind != Dmf::Kind::kWarp &&
                               before.kind > Dmf::Kind::kNoise;
        if (&before == &step) break;
        if (turbulent && step.block.empty() && before.lookup == step.lookup) step.block = before.block;
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
    Vector3& light = p.material.light;
    if (p.material.point) light = {light[0] - m[3], light[1] - m[7], light[2] - m[11]};
    light = turned(light);
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

double MiddleDepth(const VolumeDraw& draw) {
  return draw.params.camera.PlanarDepth(Centre(draw.volume.spec()));
}

void Prepare(const VolumeDraw& draw, double middle, const graph::Workers& workers, Prepared& out) {
  const VolumeParams& p = draw.params;
  const model::VolumeData& data = *draw.volume.data();
  const VolumeSpec& v = data.spec;
  const double voxel = Smallest(v.spacing);
  const model::ForEach for_each = [&](int64_t count, const std::function<void(int64_t)>& task) {
    workers.For(count, [&](int64_t i, int) { task(i); });
  };
  const RaySet rays = RaysOf(draw, middle);
  Field field = FieldOf(draw);
  Light light{};
  for (size_t c = 0; c < 3; ++c) {
    light.color[c] = static_cast<float>(p.material.color[c]);
    light.direction[c] = static_cast<float>(p.material.light[c]);
  }
  light.ambient = static_cast<float>(p.material.ambient);
  light.diffuse = static_cast<float>(p.material.diffuse);
  light.specular = static_cast<float>(p.material.specular);
  light.exponent = static_cast<float>(p.material.exponent);
  light.point = p.material.point, light.flat = p.material.flat;
  const auto code_of = [&](double value) {
    return data.code_scale == 0 ? 0 : (value - data.code_bias) / data.code_scale;
  };
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  // The range of codes that matters, a rounding wider.
  double low = -kEndless, high = kEndless;
  const auto matter = [&](double from, double to) {
    const double a = code_of(from), b = code_of(to);
    low = std::min(a, b), high = std::max(a, b);
    const double wider =
        4e-6 * (std::isfinite(low) ? std::fabs(low) : 0) + 4e-6 * (std::isfinite(high) ? std::fabs(high) : 0);
    low -= wider, high += wider;
  };
  model::Displacement reach;
  const auto find_leaps = [&]() {
    out.leaps = data.Leaps(low, high, for_each, reach);
    out.own = data.Leaps(low, high, for_each);
    field.leap = out.leaps->leap.get();
    field.own = out.own->leap.get();
    field.blocks[0] = out.own->size[0];
    field.blocks[1] = out.own->size[0] * out.own->size[1];
    field.shift = out.own->shift;
    field.edge = static_cast<float>(1 << field.shift);
    field.per_edge = 1 / field.edge;
    field.pace = out.own->pace;
    field.least_pace = out.own->least_pace;
  };

  if (IsSurface(p.mode)) {
    SurfaceArgs& s = out.surface;
    s.mode = p.mode;
    s.light = light;
    const bool below = p.inside_above == (data.code_scale < 0);
    s.side = below ? 1.0f : -1.0f;
    s.level = static_cast<float>(code_of(p.iso));
    s.margin = 4e-6f * std::fabs(s.level);
    if (p.inside_above) {
      matter(p.iso, kEndless);
    } else {
      matter(-kEndless, p.iso);
    }
    if (p.mode == VolumeMode::kSolid) {
      s.noise = ViewOf(p.block, v, p.frequency);
      const auto size = static_cast<int>(draw.colors.size() / 4) - 1;
      const double times = (size - 1) / (draw.colors_high - draw.colors_low);
      s.colors = {draw.colors.data(), size, static_cast<float>(times),
                  static_cast<float>(-draw.colors_low * times)};
    } else if (p.mode == VolumeMode::kBump) {
      s.noise = ViewOf(p.block, v, p.frequency);
      s.k = static_cast<float>(p.amount);
    } else if (p.mode == VolumeMode::kMelt) {
      // Drops are longer than wide: the noise changes slowly downward.
      s.noise = ViewOf(p.block, v, p.frequency, {0, kMeltDrift * p.time, 0});
      s.noise.times[1] *= static_cast<float>(kMeltStretch);
      const double top = v.High()[1], bottom = v.Low()[1], height = (top - bottom) / v.spacing[1];
      const double amount = p.amount / v.spacing[1];
      constexpr double kShare = kMeltNoise;
      s.sag[0] = static_cast<float>(amount);
      s.sag[1] = static_cast<float>((v.size[1] - 0.5) / height);
      s.sag[2] = static_cast<float>(1 / height);
      s.sag[3] = static_cast<float>(kShare);
      const double most = std::max(std::fabs(p.block.low()), std::fabs(p.block.high()));
      const double largest = std::fabs(amount) * (1 - kShare + kShare * most);
      const double smallest = amount * (1 - kShare + kShare * p.block.low());
      reach.low[1] = std::min({0.0, smallest, amount < 0 ? -largest : 0.0});
      reach.high[1] = std::max({0.0, smallest, amount > 0 ? largest : 0.0});
      s.steep[0] = static_cast<float>(2 * largest / height);
      const double* const slopes = p.block.data().slopes;
      for (size_t a = 0; a < 3; ++a) {
        s.steep[a + 1] = static_cast<float>(std::fabs(amount * kShare * slopes[a] * s.noise.times[a]));
      }
    }
    find_leaps();
    s.rays = rays;
    s.field = field;
    return;
  }

  MediumArgs& m = out.medium;
  m.rays = rays;
  m.mode = p.mode;
  m.method = p.method;
  m.classification = p.classification;
  m.light = light;
  m.look = p.mode == VolumeMode::kFur ? Look::kFur : p.shade ? Look::kLit : Look::kPlain;
  m.step = static_cast<float>(p.step);
  m.opaque = static_cast<float>(1 - p.termination);
  m.reference = static_cast<float>(p.transfer.length);
  const auto entries = static_cast<double>(kTransferSize);
  const double domain = draw.transfer_high - draw.transfer_low;
  m.transfer = {draw.transfer.data(), kTransferSize, static_cast<float>((entries - 1) / domain),
                static_cast<float>(-draw.transfer_low * (entries - 1) / domain)};
  m.pairs = draw.pairs.empty() ? nullptr : draw.pairs.data();
  m.mip_times = static_cast<float>(1 / domain);
  m.mip_plus = static_cast<float>(-draw.transfer_low / domain);
  m.axis = StackAxis(p.camera, v);
  double far = 0;
  if (IsHyper(p.mode)) {
    m.hyper = true;
    const double outer = p.iso + p.soft;
    m.outer = static_cast<float>(outer);
    m.per_width = p.soft > 0 ? static_cast<float>(1 / p.soft) : 0;
    bool anywhere = false;
    const Dmf* lifts = nullptr;
    for (const Dmf& step : p.dmf) {
      DmfStep k{};
      k.kind = step.kind;
      k.lookup = step.lookup;
      k.amount = static_cast<float>(step.amount);
      k.function = step.function ? &step.function : nullptr;
      if (!step.block.empty()) {
        const Vector3 offset = {step.drift[0] * p.time, step.drift[1] * p.time, step.drift[2] * p.time};
        k.noise = ViewOf(step.block, v, step.frequency, offset, step.upright);
        if (step.lookup == TurbulenceLookup::kExact) ExactOctaves(k.exact);
      }
      const double largest = TurbulenceRange(step);
      static const NoiseBlock::Data kNone;
      const NoiseBlock::Data& d = step.block.empty() ? kNone : step.block.data();
      switch (step.kind) {
        case Dmf::Kind::kBias:
          k.amount = static_cast<float>(std::log(step.amount) / std::log(0.5));
          break;
        case Dmf::Kind::kGain:
          k.amount = static_cast<float>(std::log(1 - step.amount) / std::log(0.5));
          break;
        case Dmf::Kind::kThreshold:
          k.second = static_cast<float>(1 / std::max(step.softness, 1e-6));
          break;
        case Dmf::Kind::kFunction:
          anywhere = true;  // may make density where there was none
          break;
        case Dmf::Kind::kWarp:
          for (size_t a = 0; a < 3; ++a) {
            const double most = std::fabs(step.amount) *
                                std::max<double>(std::fabs(d.bias), std::fabs(d.bias + 65535.0 * d.scale));
            reach.low[a] -= most / v.spacing[a];
            reach.high[a] += most / v.spacing[a];
          }
          break;
        case Dmf::Kind::kLift:
          (step.amount > 0 ? reach.low : reach.high)[1] -= step.amount * largest / v.spacing[1];
          k.amount = static_cast<float>(step.amount / v.spacing[1]);
          break;
        case Dmf::Kind::kSwell: {
          k.second = static_cast<float>(d.mean);
          for (size_t a = 0; a < 3; ++a) {
            const double most = std::fabs(step.amount) * largest * 0.5 * v.size[a];
            reach.low[a] -= most;
            reach.high[a] += most;
          }
          break;
        }
        default:
          break;
      }
      if (step.kind == Dmf::Kind::kLift) lifts = &step;
      k.again = step.kind == Dmf::Kind::kTurbulence && lifts != nullptr &&
                lifts->frequency == step.frequency && lifts->upright == step.upright &&
                lifts->drift == step.drift && lifts->lookup == step.lookup &&
                &lifts->block.data() == &step.block.data();
      m.steps.push_back(k);
    }
    double from = 0, to = 0;
    const bool seen = TransferSupport(draw, from, to);
    const bool clear = !seen || from >= 0 || to <= 0;  // nothing is not seen
    m.clear = static_cast<float>(seen ? from - 1e-6 * std::max(domain, std::fabs(from)) : kEndless);
    m.zero_stays = !anywhere && clear;
    const double unseen = m.zero_stays ? Unseen(p.dmf, m) : 0;
    m.unseen = static_cast<float>(unseen);
    far = outer - unseen * p.soft;
    matter(-kEndless, m.zero_stays ? far : kEndless);
    if (p.mode == VolumeMode::kFur) {
      m.fur = ViewOf(p.block, v, p.frequency);
      m.droop = static_cast<float>(p.amount);
      const double sway = kFurSway * std::sin(kFurPace * p.time);
      m.fur_lean[0] = static_cast<float>(sway);
      m.fur_lean[1] = -1;
      m.fur_lean[2] = 0;
    }
  } else {
    double from = 0, to = 0;
    const bool everywhere =
        p.mode == VolumeMode::kMip || p.mode == VolumeMode::kAttenuate || !TransferSupport(draw, from, to);
    if (everywhere && p.mode != VolumeMode::kMip && p.mode != VolumeMode::kAttenuate) {
      matter(kEndless, kEndless);  // nothing is seen
      low = high = kEndless;
    } else if (p.mode == VolumeMode::kMip || p.mode == VolumeMode::kAttenuate) {
      low = -kEndless, high = kEndless;
    } else {
      matter(from, to);
    }
    if (p.classification == Classification::kPreIntegrated) {
      // Both ends of a segment are read.
      const double half = p.method == VolumeMethod::kStacks ? 1.5 : 0.5 * p.step / voxel + 0.5;
      reach.low = {-half, -half, -half};
      reach.high = {half, half, half};
    }
  }
  find_leaps();
  m.field = field;
  if (m.zero_stays && field.leaps && reach == model::Displacement()) {
    m.far = static_cast<float>(far + 4e-6 * (std::fabs(far) + std::fabs(data.code_bias)));
    m.pace = static_cast<float>(field.least_pace / std::fabs(data.code_scale));
  }
}

}  // namespace tessera::ops::volume
