// A picture with depth as another camera sees it.
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "base/arena_vector.h"
#include "base/number_text.h"
#include "graph/op.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "ops/shade/depth_mesh.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

constexpr int kMostSamples = 8, kLargest = 1 << 20;

Roi FrameOf(const ImageSpec& spec) {
  return spec.display_window.empty() ? spec.data_window : spec.display_window;
}

class ReprojectStage final : public graph::TileStage {
 public:
  ReprojectStage(const ReprojectParams& p, const graph::StageContext& context)
      : samples_(p.samples),
        coverage_(context.output.channel_count() > context.inputs[0].channel_count()
                      ? context.output.channel_count() - 1
                      : -1),
        color_(context.whole[0]),
        mesh_(context.whole[1], FrameOf(context.inputs[0]), FrameOf(context.output), p, context.workers) {}
  Roi InputRoi(int, const Roi& out) const override { return out; }
  graph::TileSize Preferred() const override {
    const int side = samples_ <= 2 ? 64 : samples_ <= 4 ? 32 : 16;  // places fit into a cache
    return {side, side};
  }

  void Run(const graph::TileArgs& args) const override {
    const Roi& roi = args.out.roi;
    const auto places = static_cast<size_t>(samples_) * static_cast<size_t>(samples_);
    base::ArenaVector<DepthMesh::Hit> hits(static_cast<size_t>(roi.pixels()) * places, DepthMesh::Hit{},
                                           args.scratch);
    mesh_.Rasterize(roi, hits);
    const auto* hit = hits.data();
    for (int y = roi.y0; y < roi.y1; ++y) {
      auto* out = reinterpret_cast<float*>(args.out.At(roi.x0, y));
      for (int x = roi.x0; x < roi.x1; ++x, out += args.out.channels, hit += places) {
        for (int c = 0; c < args.out.channels; ++c) {
          const int channel = args.channels[static_cast<size_t>(c)];
          double sum = 0;
          for (size_t k = 0; k < places; ++k) {
            if (std::isfinite(hit[k].depth)) sum += channel == coverage_ ? 1 : ColorAt(hit[k], channel);
          }
          out[c] = static_cast<float>(sum / static_cast<double>(places));
        }
      }
    }
  }

 private:
  // Linear between the pixels of one surface; what belongs to another counts as the pixel itself.
  double ColorAt(const DepthMesh::Hit& hit, int channel) const {
    const double left = std::floor(hit.u - 0.5), upper = std::floor(hit.v - 0.5);
    const double fu = hit.u - 0.5 - left, fv = hit.v - 0.5 - upper;
    double sum = 0;
    for (int k = 0; k < 4; ++k) {
      const double weight = (k % 2 != 0 ? fu : 1 - fu) * (k / 2 != 0 ? fv : 1 - fv);
      if (weight == 0) continue;
      int x = static_cast<int>(left) + k % 2, y = static_cast<int>(upper) + k / 2;
      if ((x != hit.x || y != hit.y) && !mesh_.Joined(hit.x, hit.y, x, y)) x = hit.x, y = hit.y;
      sum += weight * double{*reinterpret_cast<const float*>(color_.At(x, y, channel))};
    }
    return sum;
  }

  int samples_, coverage_;
  ConstImageView color_;
  DepthMesh mesh_;
};

class ReprojectOp final : public graph::OpWith<ReprojectParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "reproject"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool NeedsWhole(int) const override { return true; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireSameWindow("reproject", inputs);
    ImageSpec spec = inputs[0];
    if (!spec.data_window.empty()) {
      spec.data_window = spec.display_window =
          params().width > 0 ? Roi{0, 0, params().width, params().height} : FrameOf(spec);
    }
    if (spec.alpha < 0) {
      spec.alpha = spec.channel_count();
      spec.channels.push_back(spec.ChannelIndex("A") < 0 ? "A" : "coverage");
    }
    params().to.ToMetadata(spec);
    return spec;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<ReprojectStage>(params(), context);
  }
};

}  // namespace

OpInfo ReprojectInfo() {
  OpInfo info;
  info.name = "reproject";
  info.family = "shade";
  info.inputs = 2;
  info.summary = "A picture with depth as another camera sees it";
  info.help =
      "COLOR DEPTH --reproject:move=RIGHT,UP,FORWARD moves the camera by world units along its own axes (0.03,0,0 and "
      "-0.03,0,0 are a stereo pair), or to= is the new camera: 16 numbers (world to clip) or 32 (world to "
      "camera, world to clip), rows of matrices for column vectors. from= is the picture's camera, else its "
      "metadata's; depth= says what the first channel of DEPTH holds (see --depth), a depth channel by a "
      "renderer's name is preferred.\n"
      "Every pixel is a quadrilateral in space. Its corners are the means of 1/depth over the pixels that hang "
      "together there: neighbours whose depths differ by no more than tear= of the nearer one. The nearest "
      "surface that faces both cameras is seen; colours are linear between pixels of one surface, so that "
      "nothing of the background is drawn along at an object's edge. Each pixel is the mean over samples= "
      "places along each side. What the picture never showed is a hole: 0, with alpha 0 (--fillholes fills "
      "them); a picture without alpha gets one, coverage. Depths that are NaN, infinite or not in front of the "
      "eye, and quadrilaterals that reach behind the new eye, are holes as well. geometry= gives the result "
      "another size. The result's metadata hold the new camera. Source: Haeberli and Segal 1993, 3.2; "
      "McReynolds et al. 1997, 5.11; Chen and Williams 1993.";
  info.help += " Colours and depths are held in memory whole.";
  info.bound = "2 u times the largest |value| between which a result is interpolated";
  info.bound_u = 2;
  info.modifiers = {
      NumbersModifier("move", "0,0,0", 3, -1e30, 1e30, "right, up and forward, world units"),
      OnlyWith("!move", CameraModifier("to", "16 or 32 numbers: the new camera")),
      CameraModifier("from", "16 or 32 numbers; default the images' metadata"),
      ChoiceModifier("depth", DepthKinds(), "kind of depth in the image"),
      NumberModifier("tear", "0.1", 0, 1e30, "of the nearer depth: neighbours farther apart are apart"),
      IntegerModifier("samples", "2", 1, kMostSamples, "places along a pixel's side"),
      TextModifier("geometry", "WxH of the result; default the picture's")};
  for (ParamInfo& m : PlanesModifiers()) info.modifiers.push_back(std::move(m));
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    ReprojectParams p;
    p.from = NeededCamera("reproject", a, "from", in);
    p.to = a.Given("to") ? Camera::FromNumbers(a.Numbers("to"), "reproject:to")
                         : Moved(p.from, VectorOf(a, "move"));
    p.tear = a.Number("tear"), p.samples = a.Integer("samples");
    if (a.Given("geometry")) {
      const Roi frame = FrameOf(in[0].spec());
      const Roi size = ParseGeometry(a.Text("geometry"), {0, 0, frame.width(), frame.height()});
      p.width = size.width(), p.height = size.height();
    }
    DepthParams depth;
    depth.from = DepthKindNamed(a.Text("depth")), depth.to = DepthKind::kPlanar, depth.camera = p.from;
    SetPlanes(a, p.from, depth);
    return Reproject(in[0], ConvertDepth(DepthsOf(in[1]), depth), p);
  };
  info.examples = {
      "move=0.3,0.1,0.2 from=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,0",
      "from=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,0 to=2,0,0.5,-0.3,0.1,2,0,0,0,0,-1,-2,-0.2,0,-1,0.1 "
      "samples=1 tear=2 depth=euclidean geometry=29x18",
      "from=0.5,0,0,0,0,0.5,0,0,0,0,-0.1,-1,0,0,0,1 to=0.5,0,0.4,0,0,0.5,0.1,0,0,0,-0.1,-1,0,0,0,1 "
      "samples=3 tear=10"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Camera Moved(const Camera& camera, const Vector3& right_up_forward) {
  const auto along = [&](double x, double y) {
    const Camera::Ray a = camera.RayAt(-x, -y), b = camera.RayAt(x, y);
    const bool parallel = !camera.perspective();
    Vector3 v;
    for (size_t k = 0; k < 3; ++k)
      v[k] = parallel ? b.origin[k] - a.origin[k] : b.direction[k] - a.direction[k];
    return Normalized(v);
  };
  const Vector3 right = along(1, 0), up = along(0, 1);
  Matrix4 back = kIdentity4;
  for (size_t k = 0; k < 3; ++k) {
    back[4 * k + 3] = -(right_up_forward[0] * right[k] + right_up_forward[1] * up[k] +
                        right_up_forward[2] * camera.forward()[k]);
  }
  return {Product(camera.world_to_camera(), back), Product(camera.world_to_clip(), back), "moved camera"};
}

Node Reproject(const Node& color, const Node& depth, const ReprojectParams& params) {
  if (!(params.tear >= 0)) {
    throw Error("reproject", "found tear=" + base::NumberText(params.tear) + ", expected 0 or more");
  }
  if (params.samples < 1 || params.samples > ops::kMostSamples) {
    throw Error("reproject", "found samples=" + std::to_string(params.samples) + ", expected 1 to 8");
  }
  const bool own = params.width == 0 && params.height == 0;
  if (!own && (params.width < 1 || params.height < 1 || params.width > ops::kLargest ||
               params.height > ops::kLargest)) {
    throw Error("reproject", "found a size of " + std::to_string(params.width) + "x" +
                                 std::to_string(params.height) + ", expected 1 to 1048576 pixels a side");
  }
  return graph::MakeNode(std::make_shared<const ops::ReprojectOp>(params),
                         {color, SelectChannels(depth, std::vector<ChannelChoice>{{0, 0, "Z"}})});
}

}  // namespace tessera
