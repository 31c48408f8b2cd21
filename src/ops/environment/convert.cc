// Environment maps from one projection to another: every pixel a grid of lookups, as dense as the texels
// beneath it.
#include <algorithm>
#include <cmath>
#include <limits>
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
constexpr int kEdgeSamples = 8;  // where a pixel's side leaves what a lens sees
constexpr double kSlack =
    0.01;  // texels more than a whole number: a map of the same size is read once a pixel
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kOpposite = 1e-20;  // of the sum of two directions, squared: they are, but for roundings
constexpr double kEdge = -1, kNowhere = -2;  // in place of a number of texels

Matrix4 Linear(const Matrix4& m) {
  return {m[0], m[1], m[2], 0, m[4], m[5], m[6], 0, m[8], m[9], m[10], 0, 0, 0, 0, 1};
}

class ConvertStage final : public graph::TileStage {
 public:
  ConvertStage(const EnvironmentConvertParams& p, const graph::StageContext& context)
      : params_(p),
        window_(context.output.data_window),
        to_(LayoutOf("envconvert", p.to, window_.width(), window_.height(), p.to_field_of_view)),
        from_(LayoutOf("envconvert", p.from, context.whole[0].roi.width(), context.whole[0].roi.height(),
                       p.from_field_of_view)),
        turn_(Product(Transposed(ViewRotation(p.from_rotation)),
                      Product(Linear(p.matrix), ViewRotation(p.rotation)))),
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
    const Matrix4& m = turn_;
    return {m[0] * d[0] + m[1] * d[1] + m[2] * d[2], m[4] * d[0] + m[5] * d[1] + m[6] * d[2],
            m[8] * d[0] + m[9] * d[1] + m[10] * d[2]};
  }
  // Texels between two directions' places; below 0 across a seam, or where there is no place.
  double TexelsBetween(const Vector3& low, const Vector3& high) const {
    Place p, q;
    if (!PlaceOnFace(from_, low, &p) || !PlaceOnFace(from_, high, &q) || p.face != q.face) return -1;
    // Behind an octahedron its faces are apart.
    const bool behind = from_.map == EnvironmentMap::kOctahedral && (low[2] < 0 || high[2] < 0);
    if (behind && ((low[0] < 0) != (high[0] < 0) || (low[1] < 0) != (high[1] < 0))) return -1;
    double u = std::fabs(q.u - p.u);
    if (from_.map == EnvironmentMap::kLatLong || from_.whole_turn) u = std::min(u, from_.width - u);
    return std::max(u, std::fabs(q.v - p.v));
  }
  // Texels of the source that a step of the result passes, by the mapping's derivative along the chord
  // between its ends: differences over a hundredth of it, so that no seam is in the way, and where one is, on
  // one side of it. Infinite between opposite directions; kEdge where an end has no direction, or no place on
  // the map; kNowhere where nothing of it has.
  double TexelsAlong(const Place& from, const Place& to) const {
    const Vector3 a = Normalized(Turned(DirectionAt(to_, from))),
                  b = Normalized(Turned(DirectionAt(to_, to)));
    if (Dot(a, a) == 0 || Dot(b, b) == 0) return kEdge;
    const auto along = [&](double part) {
      Vector3 d;
      for (size_t k = 0; k < 3; ++k) d[k] = (a[k] + b[k]) / 2 + part * (b[k] - a[k]);
      return d;
    };
    constexpr double kPart = 0.005;
    const Vector3 low = along(-kPart), middle = along(0), high = along(kPart);
    for (const Vector3& d : {low, middle, high}) {
      if (!(Dot(d, d) > kOpposite)) return kInfinity;
    }
    if (const double both = TexelsBetween(low, high); both >= 0) return both / (2 * kPart);
    const double one = std::max(TexelsBetween(low, middle), TexelsBetween(middle, high)) / kPart;
    Place p;
    if (one >= 0) return one;
    return PlaceOnFace(from_, a, &p) || PlaceOnFace(from_, middle, &p) || PlaceOnFace(from_, b, &p)
               ? kEdge
               : kNowhere;
  }
  static int SamplesOf(double texels) {
    if (texels < 0) return kEdgeSamples;
    return static_cast<int>(std::clamp(std::ceil(texels - kSlack), 1.0, double{kMostSamples}));
  }
  // Whether nothing of a pixel that reaches so many texels is on a lens's picture: most of a sphere, of most
  // lenses.
  bool SeesNothing(const Place& centre, double texels) const {
    if (!IsLens(from_.map)) return false;
    const Vector3 d = Turned(DirectionAt(to_, centre));
    Place p;
    if (!(Dot(d, d) > 0) || !PlaceOnFace(from_, d, &p)) return false;
    return p.u < -texels || p.v < -texels || p.u > from_.width + texels || p.v > from_.height + texels;
  }
  void Pixel(int x, int y, const EnvironmentAtlas& atlas, double* rgba) const {
    Place centre;
    if (from_.faces.empty() || !FaceOf(x, y, &centre)) return;
    const auto at = [&](double dx, double dy) { return Place{centre.face, centre.u + dx, centre.v + dy}; };
    int nx = params_.samples, ny = params_.samples;
    if (nx == 0) {
      const double across = TexelsAlong(at(-0.5, 0), at(0.5, 0)), down = TexelsAlong(at(0, -0.5), at(0, 0.5));
      if (across == kNowhere && down == kNowhere) return;
      if (across >= 0 && down >= 0 && SeesNothing(centre, across + down + 1)) return;
      nx = SamplesOf(across), ny = SamplesOf(down);
    }
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
        if (Dot(d, d) == 0) continue;
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
  Matrix4 turn_;                                                  // from the result's directions to the map's
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
    LayoutOf("envconvert", p.from, inputs[0].width(), inputs[0].height(), p.from_field_of_view);
    LayoutOf("envconvert", p.to, p.width, p.height, p.to_field_of_view);
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
      "MAP --envconvert FROM TO GEOM makes a map of that size in the projection TO. Maps of all directions: "
      "sphere, parabolic, dualparabolic, latlong, cube, octahedral (see --help envmap; GEOM's shape names a "
      "cube's layout: 6x1, 1x6, 4x3 or 3x4 faces). Pictures through a lens, to and from: perspective, the "
      "fisheyes equidistant, equisolid, stereographic and orthographic, cylinder; fov= is the result's angle "
      "across its width, fromfov= the map's, in degrees; texels are square.\n"
      "rotate=YAW,PITCH,ROLL turns the view that the result has, in degrees: to the right, up, and clockwise "
      "about its own axis, so that the picture turns counter-clockwise; fromrotate= says where the given "
      "picture looked, which need not be the middle. matrix= turns directions between the two.\n"
      "Every pixel is the mean of a grid of linear lookups, as many along each side as the mapping's "
      "derivatives put texels under it (at most 64), or samples=N; 8 along a side that leaves what a lens "
      "sees. Where the result has no direction, or the given picture shows nothing, is 0, alpha too; the "
      "edge between is as sharp as the grid. Pixels beyond a sphere map's rim have its colour, those beyond "
      "a parabolic map's circle their own directions. Source: Haeberli and Segal 1993, 4.7; McReynolds et "
      "al. 1997, 9.3.2; Heidrich and Seidel 1998; Miyamoto 1964; Cigolle et al. 2014.";
  info.help += " The map is held in memory whole.";
  info.bound = "8 u times the largest texel under a pixel (from lat-long: times 1 + w/8 + h/3)";
  info.bound_u = 8;
  info.arguments = {MapArgument("FROM", "projection of the map"),
                    MapArgument("TO", "projection of the result"),
                    TextModifier("GEOM", "size of the result, WxH")};
  info.modifiers = {
      FieldOfViewModifier("fov", "the result's"),
      FieldOfViewModifier("fromfov", "the map's"),
      NumbersModifier("rotate", "0,0,0", 3,
                      "yaw right, pitch up, roll clockwise of the result's view, degrees"),
      NumbersModifier("fromrotate", "0,0,0", 3, "the same of the view that the map has"),
      NumbersModifier("matrix", "", {9, 16}, "from the result's directions to the map's, row-major"),
      IntegerModifier("samples", "0", 0, kMostSamples, "lookups along a pixel's side; 0: by its footprint")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    EnvironmentConvertParams p;
    p.from = MapNamed(a.Text("FROM")), p.to = MapNamed(a.Text("TO"));
    const Roi size = ParseGeometry(a.Text("GEOM"), {0, 0, in[0].spec().width(), in[0].spec().height()});
    p.width = size.width(), p.height = size.height();
    if (a.Given("matrix")) p.matrix = MatrixOf(a.Numbers("matrix"));
    p.samples = a.Integer("samples");
    p.to_field_of_view = a.Number("fov"), p.from_field_of_view = a.Number("fromfov");
    p.rotation = VectorOf(a.Numbers("rotate")), p.from_rotation = VectorOf(a.Numbers("fromrotate"));
    return ConvertEnvironment(in[0], p);
  };
  info.examples = {"latlong cube 36x6",
                   "sphere latlong 31x17",
                   "dualparabolic sphere 20x20",
                   "latlong parabolic 9x9",
                   "latlong dualparabolic 24x12 samples=3 matrix=0,0,1,0,1,0,-1,0,0",
                   "latlong equidistant 17x13 fov=220 rotate=130,-20,35",
                   "perspective latlong 24x12 fromfov=100 fromrotate=-40,10,15",
                   "equisolid cylinder 24x10 fromfov=250 rotate=10,0,0",
                   "octahedral orthographic 13x13 rotate=0,70,0",
                   "cylinder octahedral 16x16",
                   "stereographic perspective 15x9 fromfov=300 fov=120"};
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
  ops::RequireFieldOfView("envconvert", "fromfov", params.from, params.from_field_of_view);
  ops::RequireFieldOfView("envconvert", "fov", params.to, params.to_field_of_view);
  for (const YawPitchRoll* const view : {&params.from_rotation, &params.rotation}) {
    const char* const name = view == &params.rotation ? "rotate" : "fromrotate";
    ops::RequireVector("envconvert", name, *view, false);
  }
  Inverse(ops::Linear(params.matrix), "envconvert matrix");
  return graph::MakeNode(std::make_shared<const ops::ConvertOp>(params), {map});
}

}  // namespace tessera
