// Depths of another kind, world positions from depths, points through a matrix, background masked out.
#include <cmath>
#include <memory>
#include <utility>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "ops/shade/place_kernel.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

bool IsWindow(DepthKind kind) { return kind == DepthKind::kWindow || kind == DepthKind::kReversedWindow; }

void CheckDepth(const std::string& op, const DepthParams& p) {
  if (!IsWindow(p.from) && !IsWindow(p.to)) return;
  const bool right = p.parallel ? std::isfinite(p.far) : p.near > 0;
  if (!right || !(p.far > p.near) || !std::isfinite(p.near)) {
    throw Error(op, "found near " + base::NumberText(p.near) + " and far " + base::NumberText(p.far) +
                        (p.parallel ? ", expected near < far, both finite, of a parallel camera"
                                    : ", expected 0 < near < far"));
  }
}

DepthPlan PlanOf(const DepthParams& params, const ImageSpec& spec) {
  const Roi& window = spec.display_window.empty() ? spec.data_window : spec.display_window;
  return {params, RaysOf(params.camera, window)};
}

class DepthOp final : public graph::OpWith<DepthParams> {
 public:
  explicit DepthOp(DepthParams params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "depth"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  bool IsIdentity() const override { return params().from == params().to; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    return MakeDepthStage(PlanOf(params(), context.inputs[0]));
  }
};

class PositionOp final : public graph::OpWith<DepthParams> {
 public:
  explicit PositionOp(DepthParams params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "position"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    ImageSpec out = in[0];
    out.type = PixelType::kFloat;  // half floats do not hold positions
    return out;
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    return MakePositionStage(PlanOf(params(), context.inputs[0]));
  }
};

class TransformOp final : public graph::OpWith<TransformParams> {
 public:
  explicit TransformOp(TransformParams params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "transform"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireColor(Name(), in[0]);
    return in[0];
  }
  bool IsIdentity() const override { return params().matrix == kIdentity4; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    TransformPlan plan;
    std::copy(params().matrix.begin(), params().matrix.end(), plan.matrix);
    plan.divide = params().divide;
    return MakeTransformStage(plan);
  }
};

class MaskOp final : public graph::OpWith<int> {
 public:
  MaskOp() : OpWith(0) {}
  std::string Name() const override { return "maskaov"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireSameWindow(Name(), in);
    return in[0];
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return MakeMaskStage();
  }
};

std::vector<std::string> KindsFrom(size_t first) {
  std::vector<std::string> kinds = DepthKinds();
  std::rotate(kinds.begin(), kinds.begin() + static_cast<ptrdiff_t>(first), kinds.end());
  return kinds;
}
DepthParams DepthArguments(const std::string& op, const Arguments& a, std::span<const Node> in,
                           DepthKind from, DepthKind to) {
  DepthParams p;
  p.from = from, p.to = to;
  if (IsWindow(from) || IsWindow(to)) SetPlanes(a, CameraOf(a, "camera", in), p);
  const bool planar_from = from != DepthKind::kEuclidean, planar_to = to != DepthKind::kEuclidean;
  if (op == "position" || planar_from != planar_to) p.camera = NeededCamera(op, a, "camera", in);
  return p;
}

}  // namespace

OpInfo DepthInfo() {
  OpInfo info;
  info.name = "depth";
  info.family = "shade";
  info.summary = "Depth of one kind as another: planar, distance, window";
  info.help =
      "DEPTH --depth:from=window:to=euclidean. planar: along the viewing axis in world units; euclidean: "
      "distance to the eye; window: a depth buffer in [0,1], 0 near, z = n f / (f - w (f - n)), of a "
      "parallel camera n + w (f - n); reversed: 1 - w; near= and far= are the camera's where they are not given "
      "(0.1 and 1000 without one). Between planar and euclidean the camera matters: camera= with 16 numbers (world to clip) or 32 "
      "(world to camera, world to clip), rows of matrices for column vectors, or else the image's "
      "worldToCamera and worldToNDC; d = z |ray|, ray of length 1 along the axis. Every channel is "
      "converted; of an AOV file the depth alone, by its name. NaN stays; infinity stays infinite. Source: "
      "McReynolds et al. 1997, 4.3.";
  info.bound = "16 u * |result| (window depths: 16 u * (|result| + 1))";
  info.bound_u = 16;
  info.modifiers = {ChoiceModifier("from", KindsFrom(0), "kind of depth in the image"),
                    ChoiceModifier("to", KindsFrom(1), "kind of depth wanted"),
                    CameraModifier("camera", "16 or 32 numbers; default the image's metadata")};
  for (ParamInfo& m : PlanesModifiers()) info.modifiers.push_back(std::move(m));
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return ConvertDepth(
        IsAovFile(in[0].spec()) ? DepthsOf(in[0]) : in[0],
        DepthArguments("depth", a, in, DepthKindNamed(a.Text("from")), DepthKindNamed(a.Text("to"))));
  };
  info.examples = {"camera=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,0", "from=window to=planar near=0.5 far=20"};
  info.identity = "from=planar to=planar";
  return info;
}

OpInfo PositionInfo() {
  OpInfo info;
  info.name = "position";
  info.family = "shade";
  info.summary = "World positions from depths and a camera";
  info.help =
      "DEPTH --position:camera=… gives X,Y,Z: eye + depth * ray of the pixel's centre, in world units. "
      "depth= says what the first channel holds (see --depth); a depth channel by a renderer's name is "
      "preferred. camera= as there. Infinite depths give infinite positions; NaN gives NaN. A "
      "position AOV is more accurate where there is one.";
  info.bound = "4 u * (|origin| + |depth * ray|) + the depth's own formula, 16 u";
  info.bound_u = 20;
  info.modifiers = {ChoiceModifier("depth", KindsFrom(0), "kind of depth in the image"),
                    CameraModifier("camera", "16 or 32 numbers; default the image's metadata")};
  for (ParamInfo& m : PlanesModifiers()) info.modifiers.push_back(std::move(m));
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return PositionFromDepth(
        in[0], DepthArguments("position", a, in, DepthKindNamed(a.Text("depth")), DepthKind::kPlanar));
  };
  info.examples = {"camera=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,0",
                   "depth=euclidean camera=0.5,0.1,0,0.3,0,0.5,0,1,0,0,-0.1,-1,0,0,0,1"};
  return info;
}

OpInfo TransformPointsInfo() {
  OpInfo info;
  info.name = "transform";
  info.family = "shade";
  info.summary = "Points through a 4x4 matrix";
  info.help =
      "POSITION --transform M: the first three channels, or an AOV file's positions alone, become M (x,y,z,1), "
      "in double, rounded once; M has "
      "16 numbers, row by row, for column vectors. divide=1 divides by w (points where w is 0 become NaN), "
      "inverse=1 uses the inverse. Alpha and further channels keep their bits.";
  info.bound = "2 u * (sum of |products|, over |w|)";
  info.bound_u = 2;
  ParamInfo matrix = ListModifier("M", "", 16, -1e38, 1e38, "16 numbers, row by row");
  matrix.counts = {16};
  info.arguments = {matrix};
  info.modifiers = {FlagModifier("divide", "divide by w"), FlagModifier("inverse", "the inverse matrix")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    TransformParams p;
    std::copy_n(a.Numbers("M").begin(), 16, p.matrix.begin());
    if (a.Flag("inverse")) p.matrix = Inverse(p.matrix, "transform");
    p.divide = a.Flag("divide");
    return TransformPoints(FindAov(in[0].spec(), Aov::kPosition).empty() ? in[0] : PositionsOf(in[0]), p);
  };
  info.examples = {"1,0.5,0,2,0,1,-0.25,1e3,0.125,0,2,-1,0,0,0,1",
                   "1,0.5,0,2,0,1,-0.25,1,0.125,0,2,-1,0.1,0.1,0.2,3 divide=1"};
  info.identity = "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node ConvertDepth(const Node& depth, const DepthParams& params) {
  ops::CheckDepth("depth", params);
  return graph::MakeNode(std::make_shared<const ops::DepthOp>(params), {depth});
}

Node PositionFromDepth(const Node& depth, const DepthParams& params) {
  ops::CheckDepth("position", params);
  const Node three = SelectChannels(DepthsOf(depth), {{0, 0, "X"}, {0, 0, "Y"}, {0, 0, "Z"}});
  return graph::MakeNode(std::make_shared<const ops::PositionOp>(params), {three});
}

Node TransformPoints(const Node& position, const TransformParams& params) {
  ops::RequireFinite3("transform", "matrix", params.matrix);
  return graph::MakeNode(std::make_shared<const ops::TransformOp>(params), {position});
}

Node MaskAov(const Node& image, const Node& mask) {
  return graph::MakeNode(std::make_shared<const ops::MaskOp>(),
                         {image, SelectChannels(mask, std::vector<ChannelChoice>{{0, 0, "mask"}})});
}

}  // namespace tessera
