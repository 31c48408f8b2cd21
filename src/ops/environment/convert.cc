// Environment maps from one projection to another: every pixel a grid of lookups, as dense as the texels
// beneath it.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/environment/environment_ops.h"
#include "ops/environment/lookup.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

constexpr int kMostSamples = 64;

class ConvertStage final : public graph::TileStage {
 public:
  ConvertStage(const EnvironmentConvertParams& p, const graph::StageContext& context)
      : params_(p),
        window_(context.output.data_window),
        to_(LayoutOf("envconvert", p.to, window_.width(), window_.height())),
        from_(LayoutOf("envconvert", p.from, context.whole[0].roi.width(), context.whole[0].roi.height())),
        lookup_(ChooseEnvironmentKernels().lookup) {
    for (int first = 0; first < context.whole[0].channels; first += 4) {
      atlases_.push_back(
          std::make_unique<const EnvironmentAtlas>(context.whole[0], first, from_, context.workers));
    }
  }
  Roi InputRoi(int, const Roi& out) const override { return out; }
  graph::TileSize Preferred() const override { return {64, 64}; }

  void Run(const graph::TileArgs& args) const override {
    const Roi& roi = args.out.roi;
    const int channels = args.out.channels;
    for (int y = roi.y0; y < roi.y1; ++y) {
      auto* out = reinterpret_cast<float*>(args.out.At(roi.x0, y));
      for (int x = roi.x0; x < roi.x1; ++x, out += channels) {
        for (size_t g = 0; g < atlases_.size(); ++g) {
          double rgba[4] = {};
          Pixel(x - window_.x0, y - window_.y0, *atlases_[g], rgba);
          for (int c = 0; c < channels; ++c) {
            const auto channel = static_cast<size_t>(args.channels[static_cast<size_t>(c)]);
            if (channel / 4 == g) out[c] = static_cast<float>(rgba[channel % 4]);
          }
        }
      }
    }
  }

 private:
  Vector3 Turned(const Vector3& d) const {
    const Matrix4& m = params_.matrix;
    return {m[0] * d[0] + m[1] * d[1] + m[2] * d[2], m[4] * d[0] + m[5] * d[1] + m[6] * d[2],
            m[8] * d[0] + m[9] * d[1] + m[10] * d[2]};
  }
  // Texels of the source that a step of the result passes, by the angle between its ends: no seam is in the
  // way.
  int Samples(const Place& from, const Place& to) const {
    if (params_.samples > 0) return params_.samples;
    const Vector3 a = Normalized(Turned(DirectionAt(to_, from))),
                  b = Normalized(Turned(DirectionAt(to_, to)));
    const Vector3 middle = {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
    const Vector3 across = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    // The mapping's derivative along the step, in texels: differences over a hundredth of it, so that both
    // places lie on one face.
    constexpr double kPart = 0.005;
    Place p, q;
    const Vector3 low = {middle[0] / 2 - kPart * across[0], middle[1] / 2 - kPart * across[1],
                         middle[2] / 2 - kPart * across[2]};
    const Vector3 high = {middle[0] / 2 + kPart * across[0], middle[1] / 2 + kPart * across[1],
                          middle[2] / 2 + kPart * across[2]};
    if (!(Dot(low, low) > 0) || !(Dot(high, high) > 0)) return kMostSamples;
    if (!PlaceOnFace(from_, low, &p) || !PlaceOnFace(from_, high, &q) || p.face != q.face) return 1;
    double u = std::fabs(q.u - p.u), v = std::fabs(q.v - p.v);
    if (from_.map == EnvironmentMap::kLatLong) u = std::min(u, from_.width - u);
    return std::clamp(static_cast<int>(std::ceil(std::max(u, v) / (2 * kPart) - 1e-6)), 1, kMostSamples);
  }
  void Pixel(int x, int y, const EnvironmentAtlas& atlas, double* rgba) const {
    Place centre;
    if (from_.faces.empty() || !FaceOf(x, y, &centre)) return;
    const auto at = [&](double dx, double dy) { return Place{centre.face, centre.u + dx, centre.v + dy}; };
    const int nx = Samples(at(-0.5, 0), at(0.5, 0)), ny = Samples(at(0, -0.5), at(0, 0.5));
    Directions run;
    alignas(64) float texels[4 * kDirectionRun];
    int held = 0;
    const auto flush = [&] {
      for (int i = held; i % 8 != 0; ++i) run.x[i] = run.y[i] = 0, run.z[i] = 1;
      lookup_(atlas, run, held, texels);
      for (int i = 0; i < held; ++i) {
        for (int c = 0; c < 4; ++c) rgba[c] += texels[4 * i + c];
      }
      held = 0;
    };
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const Vector3 d = Turned(DirectionAt(to_, at((i + 0.5) / nx - 0.5, (j + 0.5) / ny - 0.5)));
        run.x[held] = d[0], run.y[held] = d[1], run.z[held] = d[2];
        if (++held == kDirectionRun) flush();
      }
    }
    flush();
    for (int c = 0; c < 4; ++c) rgba[c] = rgba[c] / (double{1} * nx * ny);
  }
  // The face that a pixel belongs to; none in a cross's empty squares.
  bool FaceOf(int x, int y, Place* centre) const {
    for (size_t f = 0; f < to_.faces.size(); ++f) {
      const MapFace& face = to_.faces[f];
      const int i = x - face.x, j = y - face.y;
      if (i < 0 || j < 0 || i >= to_.width || j >= to_.height) continue;
      *centre = {static_cast<int>(f), (face.turned ? to_.width - 1 - i : i) + 0.5,
                 (face.turned ? to_.height - 1 - j : j) + 0.5};
      return true;
    }
    return false;
  }

  EnvironmentConvertParams params_;
  Roi window_;
  MapLayout to_, from_;
  std::vector<std::unique_ptr<const EnvironmentAtlas>> atlases_;  // of four channels each
  void (*lookup_)(const EnvironmentAtlas&, const Directions&, int, float*);
};

class ConvertOp final : public graph::OpWith<EnvironmentConvertParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "envconvert"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool NeedsWhole(int) const override { return true; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const EnvironmentConvertParams& p = params();
    LayoutOf("envconvert", p.from, inputs[0].width(), inputs[0].height());
    LayoutOf("envconvert", p.to, p.width, p.height);
    ImageSpec spec = inputs[0];
    spec.data_window = spec.display_window = {0, 0, p.width, p.height};
    if (inputs[0].data_window.empty()) spec.data_window = {};  // of nothing comes nothing
    return spec;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<ConvertStage>(params(), context);
  }
};

ParamInfo MapArgument(const char* name, const char* help) {
  ParamInfo p = MapChoice(name, "", help);
  return p;
}

}  // namespace

OpInfo ConvertEnvironmentInfo() {
  OpInfo info;
  info.name = "envconvert";
  info.family = "environment";
  info.summary = "Convert an environment map to another projection";
  info.help =
      "MAP --envconvert FROM TO GEOM makes a map of that size in the projection TO: sphere, parabolic, "
      "dualparabolic, latlong or cube (see --help envmap; GEOM's shape names a cube's layout: 6x1, 1x6, 4x3 "
      "or 3x4 faces). Every pixel is the mean of a grid of linear lookups, as many along each side as the "
      "mapping's derivatives put texels under it (at most 64), or samples=N. matrix= turns the result's "
      "directions into the source's. Pixels beyond a sphere map's rim have its colour, those beyond a "
      "parabolic map's circle their own directions. Source: McReynolds et al. 1997, 9.3.2; Heidrich and "
      "Seidel 1998.";
  info.help += " The map is held in memory whole.";
  info.bound = "8 u times the largest texel under a pixel (from lat-long: times 1 + w/8 + h/3)";
  info.bound_u = 8;
  info.arguments = {MapArgument("FROM", "projection of the map"),
                    MapArgument("TO", "projection of the result"),
                    TextModifier("GEOM", "size of the result, WxH")};
  info.modifiers = {
      NumbersModifier("matrix", "", {9, 16}, "from the result's directions to the map's, row-major"),
      IntegerModifier("samples", "0", 0, kMostSamples, "lookups along a pixel's side; 0: by its footprint")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    EnvironmentConvertParams p;
    p.from = MapNamed(a.Text("FROM")), p.to = MapNamed(a.Text("TO"));
    const Roi size = ParseGeometry(a.Text("GEOM"), {0, 0, in[0].spec().width(), in[0].spec().height()});
    p.width = size.width(), p.height = size.height();
    if (a.Given("matrix")) p.matrix = MatrixOf(a.Numbers("matrix"));
    p.samples = a.Integer("samples");
    return ConvertEnvironment(in[0], p);
  };
  info.examples = {"latlong cube 36x6", "sphere latlong 31x17", "dualparabolic sphere 20x20",
                   "latlong parabolic 9x9",
                   "latlong dualparabolic 24x12 samples=3 matrix=0,0,1,0,1,0,-1,0,0"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node ConvertEnvironment(const Node& map, const EnvironmentConvertParams& params) {
  if (params.width < 1 || params.height < 1 || params.width > 1 << 20 || params.height > 1 << 20) {
    throw Error("envconvert", "found a size of " + std::to_string(params.width) + "x" +
                                  std::to_string(params.height) + ", expected 1 to 1048576 pixels a side");
  }
  if (params.samples < 0 || params.samples > ops::kMostSamples) {
    throw Error("envconvert", "found samples=" + std::to_string(params.samples) + ", expected 0 to 64");
  }
  const Matrix4& m = params.matrix;
  Inverse({m[0], m[1], m[2], 0, m[4], m[5], m[6], 0, m[8], m[9], m[10], 0, 0, 0, 0, 1}, "envconvert matrix");
  return graph::MakeNode(std::make_shared<const ops::ConvertOp>(params), {map});
}

}  // namespace tessera
