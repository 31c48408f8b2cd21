// Vectors on a surface, given by a picture of its positions, as a field of the picture for --lic.
#include "ops/flow/surface_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/flow/flow_ops.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/flow.h"

namespace tessera::ops {
namespace flow {
namespace {

constexpr char kSurface[] = "surfacefield";

class SurfaceStage final : public graph::TileStage {
 public:
  SurfaceStage(const SurfaceFieldParams& params, const ImageSpec& positions)
      : window_(positions.data_window), run_(ChooseSurfaceFunction()) {
    setup_.edge = params.edge * params.edge;
    setup_.by_camera = params.camera.has_value();
    if (!setup_.by_camera) return;
    const Matrix4& m = params.camera->world_to_clip();
    std::copy(m.begin(), m.end(), setup_.matrix);
    const Roi& shown = positions.display_window.empty() ? positions.data_window : positions.display_window;
    setup_.across = 0.5 * shown.width(), setup_.down = 0.5 * shown.height();
  }
  Roi InputRoi(int k, const Roi& out) const override {
    return k == 0 ? Inflate(out, kSurfaceReach, kSurfaceReach) : out;
  }
  void Run(const graph::TileArgs& args) const override {
    const Roi& o = args.out.roi;
    const Planes positions(args, 0, Inflate(o, kSurfaceReach, kSurfaceReach), window_);
    const Planes vectors(args, 1, o, window_);
    const Planes normals(args, setup_.by_camera ? 2 : 1, o, window_);
    const auto wide = static_cast<size_t>(o.width() + kSurfaceSlack);
    float* const result[3] = {args.scratch.Allocate<float>(wide), args.scratch.Allocate<float>(wide),
                              args.scratch.Allocate<float>(wide)};
    SurfaceRow row{{}, {}, {}, positions.stride, o.width(), result[0], result[1], result[2]};
    for (int y = o.y0; y < o.y1; ++y) {
      for (int c = 0; c < 3; ++c) {
        row.position[c] = positions.At(c, o.x0, y);
        row.vector[c] = vectors.At(c, o.x0, y);
        row.normal[c] = normals.At(c, o.x0, y);
      }
      run_(setup_, row);
      auto* to = reinterpret_cast<float*>(args.out.At(o.x0, y));
      for (int x = 0; x < o.width(); ++x) {
        for (const int c : args.channels) *to++ = result[c][x];
      }
    }
  }

 private:
  // A region of an input's three channels as planes; NaN beyond the window and behind the rows.
  struct Planes {
    Planes(const graph::TileArgs& args, size_t input, const Roi& region, const Roi& window)
        : roi(region), stride(region.width() + kSurfaceSlack) {
      const size_t plane = static_cast<size_t>(stride) * static_cast<size_t>(roi.height());
      for (float*& p : first) p = args.scratch.Allocate<float>(plane);
      const Roi inside = Intersection(roi, window);
      for (int y = roi.y0; y < roi.y1; ++y) {
        const ptrdiff_t at = (y - roi.y0) * stride;
        const bool there = y >= inside.y0 && y < inside.y1;
        for (int c = 0; c < 3; ++c) {
          float* const to = first[c] + at;
          std::fill_n(to, stride, std::numeric_limits<float>::quiet_NaN());
          if (!there) continue;
          const auto* from = reinterpret_cast<const float*>(args.in[input].At(inside.x0, y)) + c;
          for (int x = inside.x0; x < inside.x1; ++x, from += 3) to[x - roi.x0] = *from;
        }
      }
    }
    const float* At(int channel, int x, int y) const {
      return first[channel] + (y - roi.y0) * stride + x - roi.x0;
    }

    Roi roi;
    ptrdiff_t stride;
    float* first[3] = {};
  };

  Roi window_;
  SurfaceFunction run_;
  SurfaceSetup setup_;
};

class SurfaceOp final : public graph::OpWith<SurfaceFieldParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return kSurface; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireSameWindow(kSurface, inputs);
    ImageSpec spec = inputs[0];
    spec.channels = {"X", "Y", "A"};
    spec.alpha = 2;
    return spec;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<SurfaceStage>(params(), context.inputs[0]);
  }
};

Node Three(const Node& image, const char* what) {
  if (image.spec().channel_count() < 3) {
    throw DataError(kSurface, std::string("found ") + what + " of " +
                                  std::to_string(image.spec().channel_count()) +
                                  " channels, expected three: x, y and z");
  }
  return SelectChannels(image, {{0, 0, "X"}, {1, 0, "Y"}, {2, 0, "Z"}});
}

Node Make(std::vector<Node> inputs, const SurfaceFieldParams& params) {
  if (!(params.edge == 0 || (params.edge >= 1 && params.edge <= 1e6))) {
    throw Error(kSurface,
                "found edge " + base::NumberText(params.edge) + ", expected 0 for none or 1 to 1e6");
  }
  return graph::MakeNode(std::make_shared<const SurfaceOp>(params), std::move(inputs));
}

}  // namespace
}  // namespace flow

OpInfo SurfaceFieldInfo() {
  OpInfo info;
  info.name = flow::kSurface;
  info.family = "flow";
  info.inputs = 2;
  info.summary = "Vectors on a surface as a field of the picture, for --lic";
  info.help =
      "POSITION VECTOR: a picture of a surface's positions (an AOV file or its first three channels) and of a "
      "vector at each, world units in three channels, become X right and Y down, pixels per unit: the part of "
      "the vector along the surface as the picture shows it; A is 1.\n"
      "by=differences solves V = x dP/dx + y dP/dy + (across the surface) with the positions' own differences "
      "to their neighbours; it needs no camera. by=camera takes the normal AOV of POSITION, V - N (V.N)/(N.N), "
      "and how the point moves in the picture of camera=, or of the image's own.\n"
      "Lines end where the surface does: pixels without a position, vector or normal are 0 with A 0, which "
      "--lic masks, and so is, of two neighbours further apart than edge= times the larger of the steps just before "
      "and behind, the left or upper one (a curved outline has 2.4). Taps of --lic a pixel apart or nearer "
      "cannot pass them. alpha=1 and --fillholes close the seams.\n"
      "Lines on a surface: P V --surfacefield --lic:alpha=1. A texture that stays on the surface as the camera "
      "moves is noise at its positions: P --noiseat:type=hash:freq=100 P V --surfacefield "
      "--lic:input=1:contrast=equalize. Of volumes, P is --volume:aovs=1. Colour by any scalar: the lines "
      "times its colours, as --lic says. Source: Laramee et al. 2003; Cabral and Leedom 1993.";
  info.bound =
      "u * (|result| + 4e-8 k^2 |V| / |dP|), k = |dP/dx| |dP/dy| / |dP/dx x dP/dy|; by=camera: u * (|result| + "
      "4e-8 of the terms that cancel)";
  info.bound_u = 1;
  info.modifiers = {
      ChoiceModifier("by", {"differences", "camera"}, "how vectors come to the picture"),
      OnlyWith("by=camera", CameraModifier("camera", "16 or 32 numbers; default the image's metadata")),
      NumberModifier("edge", "3", 0, 1e6,
                     "steps that much longer than those beside are gaps, 1 or more; 0: none are")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    SurfaceFieldParams p;
    p.edge = a.Number("edge");
    if (a.Text("by") == "differences") return SurfaceField(in[0], in[1], p);
    p.camera = NeededCamera(flow::kSurface, a, "camera", in);
    return SurfaceField(in[0], NormalsOf(in[0]), in[1], p);
  };
  info.examples = {"", "edge=0", "by=camera camera=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,4 edge=2"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node SurfaceField(const Node& positions, const Node& vectors, const SurfaceFieldParams& params) {
  if (params.camera) {
    throw Error(ops::flow::kSurface, "found a camera without normals, expected both or neither");
  }
  return ops::flow::Make({PositionsOf(positions), ops::flow::Three(vectors, "vectors")}, params);
}

Node SurfaceField(const Node& positions, const Node& normals, const Node& vectors,
                  const SurfaceFieldParams& params) {
  if (!params.camera)
    throw Error(ops::flow::kSurface, "found normals without a camera, expected both or neither");
  return ops::flow::Make(
      {PositionsOf(positions), ops::flow::Three(vectors, "vectors"), ops::flow::Three(normals, "normals")},
      params);
}

}  // namespace tessera
