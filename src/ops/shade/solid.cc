// Solid textures composed of blocks: places in the solid, look-ups or noise there, the meeting with the
// colour.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/number_text.h"
#include "base/turn.h"
#include "graph/op.h"
#include "model/shade_settings.h"
#include "ops/noise/noise_ops.h"
#include "ops/noise/plan.h"
#include "ops/shade/shade_ops.h"
#include "ops/shade/solid_kernel.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/lookup.h"
#include "tessera/ops/noise.h"

namespace tessera::ops {
namespace {

class FootprintStage final : public graph::TileStage {
 public:
  explicit FootprintStage(bool mixed) : mixed_(mixed) {}
  Roi InputRoi(int, const Roi& out) const override {
    return {out.x0 - 1, out.y0 - 1, out.x1 + 1, out.y1 + 1};
  }
  // What is reflected has the same products.
  Wrap InputBorder(int) const override { return Wrap::kMirror101; }
  void Run(const graph::TileArgs& args) const override {
    const ConstImageView& in = args.in[0];
    for (int y = args.out.roi.y0; y < args.out.roi.y1; ++y) {
      const float* rows[3];
      for (int k = 0; k < 3; ++k)
        rows[k] = reinterpret_cast<const float*>(in.At(args.out.roi.x0 - 1, y - 1 + k));
      footprint_(rows, in.channels, args.out.roi.width(), mixed_,
                 reinterpret_cast<float*>(args.out.At(args.out.roi.x0, y)));
    }
  }

 private:
  FootprintFunction footprint_ = FindFootprint();
  bool mixed_;
};

// The matrix of what a pixel covers of the solid: its squares, or its mixed products.
class FootprintOp final : public graph::OpWith<bool> {
 public:
  explicit FootprintOp(bool mixed) : OpWith(mixed) {}
  std::string Name() const override { return "footprint"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    ImageSpec out = in[0];
    out.channels =
        params() ? std::vector<std::string>{"xy", "xz", "yz"} : std::vector<std::string>{"xx", "yy", "zz"};
    out.alpha = -1;
    return out;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), false);
    std::fill_n(needed.begin(), 3, true);
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<FootprintStage>(params());
  }
};

class SolidOp final : public graph::OpWith<SolidSettings> {
 public:
  explicit SolidOp(SolidSettings settings) : OpWith(std::move(settings)) {}
  std::string Name() const override { return "solid"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireSameWindow(Name(), in);
    graph::RequireColor(Name(), in[0]);
    return in[0];
  }
  bool ReadsAlpha() const override { return true; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    SolidPlan plan;
    plan.params = params().solid;
    plan.table_channels = params().table_channels;
    plan.octaves = params().octaves;
    plan.footprint = params().footprint;
    plan.mean = params().mean;
    return MakeSolidStage(plan);
  }
};

Matrix4 ToSolid(const SolidParams& p) {
  Vector3 scale;
  double longest = 0;
  for (size_t k = 0; k < 3; ++k) longest = std::max(longest, p.high[k] - p.low[k]);
  for (size_t k = 0; k < 3; ++k) {
    const double extent = p.uniform ? longest : p.high[k] - p.low[k];
    scale[k] = extent > 0 ? 1 / extent : 0;
  }
  // R (scale (P - low) - 1/2) + 1/2; an axis without extent is 1/2 before the rotation.
  Matrix4 m = kIdentity4;
  for (size_t i = 0; i < 3; ++i) {
    m[4 * i + 3] = 0.5;
    for (size_t j = 0; j < 3; ++j) {
      const double r = p.rotation[3 * i + j];
      m[4 * i + j] = r * scale[j];
      m[4 * i + 3] -= r * (scale[j] > 0 ? scale[j] * p.low[j] + 0.5 : 0);
    }
  }
  return m;
}

void CheckSolid(const SolidParams& p) {
  RequireFinite3("solid", "box", p.low);
  RequireFinite3("solid", "box", p.high);
  RequireFinite3("solid", "rotate", p.rotation);
  RequireFinite3("solid", "plane", p.plane);
  RequireFinite3("solid", "ink", p.ink);
  RequireAtLeast("solid", "freq", p.frequency, 0);
  RequireAtLeast("solid", "strength", p.strength, -1e6);
  for (size_t k = 0; k < 3; ++k) {
    if (p.high[k] < p.low[k]) {
      throw Error("solid:box", "found " + base::NumberText(p.low[k]) + " to " + base::NumberText(p.high[k]) +
                                   ", expected the low corner before the high one");
    }
  }
  if (p.octaves < 0 || p.octaves > 24) {
    throw Error("solid:octaves", "found " + std::to_string(p.octaves) + ", expected 0 to 24");
  }
  if (!(p.width >= 0 && p.width <= 1)) {
    throw Error("solid:width", "found " + base::NumberText(p.width) + ", expected 0 to 1 of the spacing");
  }
  // Drift over many rotations shows as a texture that swells.
  const auto& r = p.rotation;
  const double det = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                     r[2] * (r[3] * r[7] - r[4] * r[6]);
  if (!(std::fabs(std::fabs(det) - 1) < 1e-3)) {
    throw Error("solid:rotate", "found a matrix of determinant " + base::NumberText(det) +
                                    ", expected a rotation (1, or -1 for a mirror image)");
  }
}

NoiseParams SolidNoise(const SolidParams& p, double frequency, int octaves, uint32_t seed) {
  NoiseParams n;
  n.dims = 3;
  n.frequency = frequency;
  n.octaves = octaves;
  n.seed = p.seed + seed;
  return n;
}

}  // namespace
}  // namespace tessera::ops

namespace tessera {

std::array<double, 9> RotationAbout(const Vector3& axis, double degrees) {
  const Vector3 u = Normalized(axis);
  if (Dot(u, u) == 0) throw Error("rotation", "found the axis 0,0,0, expected a direction");
  const auto [c, s] = base::TurnOf(degrees);
  std::array<double, 9> r;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) r[3 * i + j] = u[i] * u[j] * (1 - c) + (i == j ? c : 0);
  }
  r[1] -= u[2] * s, r[2] += u[1] * s, r[3] += u[2] * s;
  r[5] -= u[0] * s, r[6] -= u[1] * s, r[7] += u[0] * s;
  return r;
}

Node SolidCoordinates(const Node& position, const SolidParams& params) {
  ops::CheckSolid(params);
  graph::RequireColor("solid positions", position.spec());
  return TransformPoints(position, {ops::ToSolid(params), false});
}

Node SolidTexture(const Node& color, const Node& position, const SolidParams& params) {
  if (params.kind == SolidKind::kTable) throw Error("solid", "found the kind table without a table");
  const Node p = SolidCoordinates(position, params);
  ops::SolidSettings settings;
  settings.solid = params;
  std::vector<Node> inputs = {color, p};
  const bool marble = params.kind == SolidKind::kMarble, noise = params.kind == SolidKind::kNoise;
  settings.footprint = params.level_of_detail;
  // Octaves that fade, each by itself, come one by one.
  const auto add_noise = [&](NoiseParams n) {
    if (!settings.footprint) {
      inputs.push_back(NoiseAt(p, n));
      return;
    }
    settings.octaves = n.octaves;
    for (int k = 0; k < n.octaves; ++k) {
      NoiseParams octave = n;
      octave.weights.assign(static_cast<size_t>(n.octaves), 0.0);
      octave.weights[static_cast<size_t>(k)] = std::exp2(-k);
      inputs.push_back(NoiseAt(p, octave));
    }
  };
  if (marble || noise) {
    NoiseParams n = ops::SolidNoise(params, params.frequency, params.octaves, 0);
    if (marble) n.sum = NoiseSum::kTurbulence;
    settings.mean = marble ? ops::MeanSize(NoiseKind::kGradient, 3) : 0;
    add_noise(n);
  } else if (params.kind == SolidKind::kWood) {
    add_noise(ops::SolidNoise(params, ops::kWoodBendCells, std::min(params.octaves, 3), 1));
    // Fibres: fine across, long along z.
    const TransformParams fibres{
        {ops::kWoodAcross, 0, 0, 0, 0, ops::kWoodAcross, 0, 0, 0, 0, ops::kWoodAlong, 0, 0, 0, 0, 1}, false};
    inputs.push_back(NoiseAt(TransformPoints(p, fibres), ops::SolidNoise(params, 1, 1, 2)));
  }
  for (const bool mixed : {false, true}) {
    if (settings.footprint)
      inputs.push_back(graph::MakeNode(std::make_shared<const ops::FootprintOp>(mixed), {p}));
  }
  for (size_t k = 2; k < inputs.size(); ++k) inputs[k] = ops::ThreeChannels(inputs[k]);
  return graph::MakeNode(std::make_shared<const ops::SolidOp>(std::move(settings)), std::move(inputs));
}

Node SolidTexture(const Node& color, const Node& position, const Node& table, const TableLayout& layout,
                  const SolidParams& params) {
  SolidParams p = params;
  p.kind = SolidKind::kTable;
  LookupParams lookup = p.lookup;
  lookup.axes = {0, 1, 2};
  lookup.propagate_nan = true;
  const bool covers = lookup.filter == TableFilter::kTrilinear || lookup.filter == TableFilter::kEwa;
  if (p.level_of_detail && !covers) lookup.filter = TableFilter::kMipmap;
  TableLayout solid = layout;
  solid.dims = 3;
  const int channels = table.spec().channel_count();
  if (channels != 1 && channels != 3 && channels != 4) {
    throw DataError("solid",
                    "found a table of " + std::to_string(channels) + " channels, expected 1, 3 or 4");
  }
  ops::SolidSettings settings;
  settings.solid = p;
  settings.table_channels = channels;
  const Node texture = Lookup(SolidCoordinates(position, p), table, solid, lookup);
  return graph::MakeNode(std::make_shared<const ops::SolidOp>(std::move(settings)),
                         {color, channels == 1 ? ops::ThreeChannels(texture) : texture});
}

}  // namespace tessera
