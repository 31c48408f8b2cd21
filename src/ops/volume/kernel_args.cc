// From completed parameters of volume pictures to what their kernels are given.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model/volume_settings.h"
#include "ops/volume/prepare.h"
#include "ops/volume/transfer.h"

namespace tessera::ops::volume {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

Vector3 Centre(const VolumeSpec& s) {
  return s.Position(0.5 * (s.size[0] - 1), 0.5 * (s.size[1] - 1), 0.5 * (s.size[2] - 1));
}

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
  f.pages = data.pages.get();
  f.volume = &data;
  for (size_t a = 0; a < 2; ++a) f.bricks[a] = static_cast<int32_t>(data.bricks[a]);
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

const NoiseBlock::Data& DataOf(const Dmf& step) {
  static const NoiseBlock::Data kNone;
  return step.block.empty() ? kNone : step.block.data();
}

// Linear between points, constant beyond.
Line LineOf(const std::vector<std::array<double, 2>>& points) {
  Line line;
  for (size_t i = 0; i < points.size(); ++i) {
    const double width = i + 1 < points.size() ? points[i + 1][0] - points[i][0] : 0;
    const double slope = width > 0 ? (points[i + 1][1] - points[i][1]) / width : 0;
    line.push_back({static_cast<float>(points[i][0]), static_cast<float>(points[i][1]),
                    static_cast<float>(std::clamp(slope, -1e30, 1e30))});
  }
  return line;
}

// Towards the eye, as towards a light.
Light EyeOf(const VolumeDraw& draw) {
  const Camera& camera = draw.params.camera;
  const Roi& w = draw.window;
  Light eye{};
  eye.point = camera.perspective();
  const Vector3 way =
      camera.PixelRay(w, w.x0 + 0.5 * (w.width() - 1), w.y0 + 0.5 * (w.height() - 1)).direction;
  const Vector3 at = eye.point ? camera.eye() : Normalized({-way[0], -way[1], -way[2]});
  for (size_t a = 0; a < 3; ++a) eye.direction[a] = static_cast<float>(at[a]);
  return eye;
}

Light LightOf(const VolumeMaterial& material) {
  Light light{};
  for (size_t c = 0; c < 3; ++c) {
    light.color[c] = static_cast<float>(material.color[c]);
    light.direction[c] = static_cast<float>(material.light[c]);
  }
  light.ambient = static_cast<float>(material.ambient);
  light.diffuse = static_cast<float>(material.diffuse);
  light.specular = static_cast<float>(material.specular);
  light.exponent = static_cast<float>(material.exponent);
  light.point = material.point, light.flat = material.flat;
  return light;
}

// Fills in `out`. What may be leapt over is all that is neither between `low` and `high`, codes, nor reached
// by what is.
class Preparation {
 public:
  Preparation(const VolumeDraw& draw, double middle, Prepared& out)
      : draw_(draw),
        p_(draw.params),
        data_(*draw.volume.data()),
        v_(data_.spec),
        out_(out),
        rays_(RaysOf(draw, middle)),
        field_(FieldOf(draw)) {}

  void Surface(const graph::Workers& workers);
  void Medium(const graph::Workers& workers);

 private:
  double CodeOf(double value) const {
    return data_.code_scale == 0 ? 0 : (value - data_.code_bias) / data_.code_scale;
  }
  void Matter(double from, double to);
  void FindLeaps(const graph::Workers& workers);
  void Melt(SurfaceArgs& s);
  DmfStep StepOf(const Dmf& step) const;
  void Reach(const Dmf& step);
  bool Chain(MediumArgs& m);
  void Hyper(MediumArgs& m);
  void Density(MediumArgs& m);

  const VolumeDraw& draw_;
  const VolumeParams& p_;
  const model::VolumeData& data_;
  const VolumeSpec& v_;
  Prepared& out_;
  const RaySet rays_;
  Field field_;
  double low_ = -kEndless, high_ = kEndless;
  double far_ = 0;  // hypertextures: the distance beyond which nothing is seen
  model::Displacement reach_;
};

// The range of codes that matters, a rounding wider.
void Preparation::Matter(double from, double to) {
  const double a = CodeOf(from), b = CodeOf(to);
  low_ = std::min(a, b), high_ = std::max(a, b);
  const double wider = 4e-6 * (std::isfinite(low_) ? std::fabs(low_) : 0) +
                       4e-6 * (std::isfinite(high_) ? std::fabs(high_) : 0);
  low_ -= wider, high_ += wider;
}

void Preparation::FindLeaps(const graph::Workers& workers) {
  const model::ForEach for_each = [&](int64_t count, const std::function<void(int64_t)>& task) {
    workers.For(count, [&](int64_t i, int) { task(i); });
  };
  out_.leaps = data_.Leaps(low_, high_, for_each, reach_);
  out_.own = data_.Leaps(low_, high_, for_each);
  field_.leap = out_.leaps->leap.get();
  field_.own = out_.own->leap.get();
  field_.blocks[0] = out_.own->size[0];
  field_.blocks[1] = out_.own->size[0] * out_.own->size[1];
  field_.shift = out_.own->shift;
  field_.edge = static_cast<float>(1 << field_.shift);
  field_.per_edge = 1 / field_.edge;
  field_.pace = out_.own->pace;
  field_.least_pace = out_.own->least_pace;
}

void Preparation::Surface(const graph::Workers& workers) {
  SurfaceArgs& s = out_.surface;
  s.mode = p_.mode;
  s.light = LightOf(p_.material);
  const bool below = p_.inside_above == (data_.code_scale < 0);
  s.side = below ? 1.0f : -1.0f;
  s.level = static_cast<float>(CodeOf(p_.iso));
  s.margin = 4e-6f * std::fabs(s.level);
  if (p_.inside_above) {
    Matter(p_.iso, kEndless);
  } else {
    Matter(-kEndless, p_.iso);
  }
  if (p_.mode == VolumeMode::kSolid) {
    s.noise = ViewOf(p_.block, v_, p_.frequency);
    const auto size = static_cast<int>(draw_.colors.size() / 4) - 1;
    const double times = (size - 1) / (draw_.colors_high - draw_.colors_low);
    s.colors = {draw_.colors.data(), size, static_cast<float>(times),
                static_cast<float>(-draw_.colors_low * times)};
  } else if (p_.mode == VolumeMode::kBump) {
    s.noise = ViewOf(p_.block, v_, p_.frequency);
    s.k = static_cast<float>(p_.amount);
  } else if (p_.mode == VolumeMode::kMelt) {
    Melt(s);
  }
  FindLeaps(workers);
  s.rays = rays_;
  s.field = field_;
}

void Preparation::Melt(SurfaceArgs& s) {
  // Drops are longer than wide: the noise changes slowly downward.
  s.noise = ViewOf(p_.block, v_, p_.frequency, {0, kMeltDrift * p_.time, 0});
  s.noise.times[1] *= static_cast<float>(kMeltStretch);
  const double top = v_.High()[1], bottom = v_.Low()[1], height = (top - bottom) / v_.spacing[1];
  const double amount = p_.amount / v_.spacing[1];
  constexpr double kShare = kMeltNoise;
  s.sag[0] = static_cast<float>(amount);
  s.sag[1] = static_cast<float>((v_.size[1] - 0.5) / height);
  s.sag[2] = static_cast<float>(1 / height);
  s.sag[3] = static_cast<float>(kShare);
  const double most = std::max(std::fabs(p_.block.low()), std::fabs(p_.block.high()));
  const double largest = std::fabs(amount) * (1 - kShare + kShare * most);
  const double smallest = amount * (1 - kShare + kShare * p_.block.low());
  reach_.low[1] = std::min({0.0, smallest, amount < 0 ? -largest : 0.0});
  reach_.high[1] = std::max({0.0, smallest, amount > 0 ? largest : 0.0});
  s.steep[0] = static_cast<float>(2 * largest / height);
  const double* const slopes = p_.block.data().slopes;
  for (size_t a = 0; a < 3; ++a) {
    s.steep[a + 1] = static_cast<float>(std::fabs(amount * kShare * slopes[a] * s.noise.times[a]));
  }
}

// But for `again`.
DmfStep Preparation::StepOf(const Dmf& step) const {
  DmfStep k{};
  k.kind = step.kind;
  k.lookup = step.lookup;
  k.amount = static_cast<float>(step.amount);
  k.function = step.function ? &step.function : nullptr;
  if (!step.block.empty()) {
    const Vector3 offset = {step.drift[0] * p_.time, step.drift[1] * p_.time, step.drift[2] * p_.time};
    k.noise = ViewOf(step.block, v_, step.frequency, offset, step.upright);
    if (step.lookup == TurbulenceLookup::kExact) ExactOctaves(k.exact);
  }
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
    case Dmf::Kind::kLift:
      k.amount = static_cast<float>(step.amount / v_.spacing[1]);
      break;
    case Dmf::Kind::kSwell:
      k.second = static_cast<float>(DataOf(step).mean);
      break;
    case Dmf::Kind::kTable:
      k.table = LineOf(step.table);
      break;
    default:
      break;
  }
  for (const DmfInput& input : step.inputs) {
    DmfWeight weight{input.kind, {}, LineOf(input.points)};
    for (size_t a = 0; a < 3; ++a) weight.place[a] = static_cast<float>(input.place[a]);
    k.weights.push_back(std::move(weight));
  }
  return k;
}

// How far a step may move what is seen.
void Preparation::Reach(const Dmf& step) {
  const double largest = TurbulenceRange(step);
  if (step.kind == Dmf::Kind::kLift) {
    (step.amount > 0 ? reach_.low : reach_.high)[1] -= step.amount * largest / v_.spacing[1];
    return;
  }
  if (step.kind != Dmf::Kind::kWarp && step.kind != Dmf::Kind::kSwell) return;
  for (size_t a = 0; a < 3; ++a) {
    double most = 0;
    if (step.kind == Dmf::Kind::kSwell) {
      most = std::fabs(step.amount) * largest * 0.5 * v_.size[a];
    } else {
      const NoiseBlock::Data& d = DataOf(step);
      most = std::fabs(step.amount) *
             std::max<double>(std::fabs(d.bias), std::fabs(d.bias + 65535.0 * d.scale)) / v_.spacing[a];
    }
    reach_.low[a] -= most;
    reach_.high[a] += most;
  }
}

// The chain of modulation; whether there may be density where there was none.
bool Preparation::Chain(MediumArgs& m) {
  bool anywhere = false;
  const Dmf* lifts = nullptr;
  for (const Dmf& step : p_.dmf) {
    anywhere = anywhere || step.kind == Dmf::Kind::kFunction;
    Reach(step);
    DmfStep k = StepOf(step);
    if (step.kind == Dmf::Kind::kLift) lifts = &step;
    k.again = step.kind == Dmf::Kind::kTurbulence && lifts != nullptr && lifts->frequency == step.frequency &&
              lifts->upright == step.upright && lifts->drift == step.drift && lifts->lookup == step.lookup &&
              &lifts->block.data() == &step.block.data();
    for (const DmfInput& input : step.inputs) m.normals |= input.kind <= DmfInput::Kind::kEye;
    m.steps.push_back(std::move(k));
  }
  m.eye = EyeOf(draw_);
  return anywhere;
}

// Distance fields through density modulation.
void Preparation::Hyper(MediumArgs& m) {
  m.hyper = true;
  const double outer = p_.iso + p_.soft;
  m.outer = static_cast<float>(outer);
  m.per_width = p_.soft > 0 ? static_cast<float>(1 / p_.soft) : 0;
  const bool anywhere = Chain(m);
  double from = 0, to = 0;
  const bool seen = TransferSupport(draw_, from, to);
  const bool clear = !seen || from >= 0 || to <= 0;  // nothing is not seen
  m.clear = static_cast<float>(
      seen ? from - 1e-6 * std::max(draw_.transfer_high - draw_.transfer_low, std::fabs(from)) : kEndless);
  m.zero_stays = !anywhere && clear;
  double unseen = m.zero_stays ? Unseen(p_.dmf, m) : 0;
  if (p_.mode == VolumeMode::kFur)
    unseen *= (1 - 1e-4) / kFurEnd;  // no more is left of a density than so often
  m.unseen = static_cast<float>(unseen);
  far_ = outer - unseen * p_.soft;
  Matter(-kEndless, m.zero_stays ? far_ : kEndless);
  if (p_.mode == VolumeMode::kFur) {
    m.fur = ViewOf(p_.block, v_, p_.frequency);
    m.droop = static_cast<float>(p_.amount);
    const double sway = kFurSway * std::sin(kFurPace * p_.time);
    m.fur_lean[0] = static_cast<float>(sway);
    m.fur_lean[1] = -1;
    m.fur_lean[2] = 0;
    for (size_t c = 0; c < 3; ++c) {
      m.fur_root[c] = static_cast<float>(p_.fur.root[c]);
      m.fur_rise[c] = static_cast<float>(p_.fur.tip[c] - p_.fur.root[c]);
    }
    m.fur_guard = static_cast<float>(p_.fur.guard);
    m.fur_patches = static_cast<float>(p_.fur.patches);
  }
}

// Which codes a transfer function shows.
void Preparation::Density(MediumArgs& m) {
  double from = 0, to = 0;
  if (!p_.dmf.empty()) {
    const double domain = draw_.transfer_high - draw_.transfer_low;
    const bool anywhere = Chain(m);
    m.to_density[0] = static_cast<float>(1 / domain);
    m.to_density[1] = static_cast<float>(-draw_.transfer_low / domain);
    m.from_density[0] = static_cast<float>(domain);
    m.from_density[1] = static_cast<float>(draw_.transfer_low);
    if (p_.mode == VolumeMode::kMip || p_.mode == VolumeMode::kAttenuate) return;
    if (!TransferSupport(draw_, from, to)) {
      low_ = high_ = kEndless;
    } else if (!anywhere && from >= draw_.transfer_low) {  // nothing stays nothing, and that is not seen
      m.clear = static_cast<float>((from - draw_.transfer_low) / domain - 1e-6);
      Matter(draw_.transfer_low + Unseen(p_.dmf, m) * domain, kEndless);
    }
    return;
  }
  if (p_.mode != VolumeMode::kMip && p_.mode != VolumeMode::kAttenuate) {  // these see all
    if (TransferSupport(draw_, from, to)) {
      Matter(from, to);
    } else {
      low_ = high_ = kEndless;  // nothing is seen
    }
  }
  if (p_.classification == Classification::kPreIntegrated) {
    // Both ends of a segment are read.
    const double half = p_.method == VolumeMethod::kStacks ? 1.5 : 0.5 * p_.step / Smallest(v_.spacing) + 0.5;
    reach_.low = {-half, -half, -half};
    reach_.high = {half, half, half};
  }
}

void Preparation::Medium(const graph::Workers& workers) {
  MediumArgs& m = out_.medium;
  m.rays = rays_;
  m.mode = p_.mode;
  m.method = p_.method;
  m.classification = p_.classification;
  m.light = LightOf(p_.material);
  const bool scattered = p_.scatter.lit && !p_.material.flat;
  m.look = p_.mode == VolumeMode::kFur ? Look::kFur
           : p_.shade                  ? Look::kLit
           : scattered                 ? Look::kScattered
                                       : Look::kPlain;
  for (const VolumeLight& further : p_.scatter.lights) {
    if (p_.material.flat) break;
    FurtherLight f;
    f.light = m.light;
    f.light.ambient = 0;
    f.light.point = further.point;
    for (size_t c = 0; c < 3; ++c) {
      f.light.color[c] = static_cast<float>(further.color[c]);
      f.light.direction[c] = static_cast<float>(further.light[c]);
    }
    m.further.push_back(f);
  }
  m.phase = scattered ? static_cast<float>(p_.scatter.phase) : 0;
  m.step = static_cast<float>(p_.step);
  // Nothing ends a ray before it has met something: where rays begin depends on their neighbours.
  m.opaque = std::max(static_cast<float>(1 - p_.termination), std::numeric_limits<float>::min());
  m.reference = static_cast<float>(p_.transfer.length);
  const auto entries = static_cast<double>(kTransferSize);
  const double domain = draw_.transfer_high - draw_.transfer_low;
  m.transfer = {draw_.transfer.data(), kTransferSize, static_cast<float>((entries - 1) / domain),
                static_cast<float>(-draw_.transfer_low * (entries - 1) / domain)};
  if (!draw_.emission.empty()) {
    m.emission = m.transfer;
    m.emission.entries = draw_.emission.data();
  }
  m.pairs = draw_.pairs.empty() ? nullptr : draw_.pairs.data();
  m.mip_times = static_cast<float>(1 / domain);
  m.mip_plus = static_cast<float>(-draw_.transfer_low / domain);
  m.axis = StackAxis(p_.camera, v_);
  if (IsHyper(p_.mode)) {
    Hyper(m);
  } else {
    Density(m);
  }
  FindLeaps(workers);
  m.field = field_;
  if (m.zero_stays && field_.leaps && reach_ == model::Displacement()) {
    m.far = static_cast<float>(far_ + 4e-6 * (std::fabs(far_) + std::fabs(data_.code_bias)));
    m.pace = static_cast<float>(field_.least_pace / std::fabs(data_.code_scale));
  }
  if (p_.scatter.shadow > 0 && !p_.material.flat) PrepareOpacity(draw_, workers, out_);
}

}  // namespace

double MiddleDepth(const VolumeDraw& draw) {
  return draw.params.camera.PlanarDepth(Centre(draw.volume.spec()));
}

void Prepare(const VolumeDraw& draw, double middle, const graph::Workers& workers, Prepared& out) {
  Preparation preparation(draw, middle, out);
  if (IsSurface(draw.params.mode)) {
    preparation.Surface(workers);
  } else {
    preparation.Medium(workers);
  }
}

}  // namespace tessera::ops::volume
