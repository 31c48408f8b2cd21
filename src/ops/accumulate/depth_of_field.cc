// Depth of field: the operation, and the method that gathers the neighbours whose circle of confusion reaches
// a pixel.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "base/arena_vector.h"
#include "base/number_text.h"
#include "graph/op.h"
#include "ops/accumulate/accumulate_ops.h"
#include "ops/accumulate/disc_kernel.h"
#include "ops/accumulate/lens_layers.h"
#include "ops/geometry/separable.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/accumulate.h"

namespace tessera::ops {
namespace {

constexpr int kLargestRadius = 128;
constexpr int kPad = 16;
constexpr int kMostBlades = 16;

// The radius of a point's disc in pixels; 0 where there is no depth.
double CircleOfConfusion(const DepthOfFieldParams& p, double depth) {
  if (!(depth > 0)) return 0;
  return std::max(0.5, std::min(p.max_radius, p.aperture * std::fabs(1 / p.focus - 1 / depth)));
}

class DepthOfFieldStage final : public graph::TileStage {
 public:
  DepthOfFieldStage(const DepthOfFieldParams& p, const Roi& window)
      : params_(p),
        margin_(static_cast<int>(std::ceil(p.max_radius))),
        window_(window),
        gather_(ChooseGatherDiscs()) {}

  Roi InputRoi(int, const Roi& out) const override { return Inflate(out, margin_, margin_); }
  graph::TileSize Preferred() const override { return {256, 64}; }

  void Run(const graph::TileArgs& args) const override {
    const ConstImageView color = InputChannels(args, 0);
    const Roi &in = color.roi, &out = args.out.roi;
    const int channels = args.out.channels;
    DiscRow row;
    row.stride = in.width() + kPad;
    const size_t plane = static_cast<size_t>(row.stride) * static_cast<size_t>(in.height()) + kPad;
    const auto new_plane = [&] {
      float* const p = args.scratch.Allocate<float>(plane);
      std::fill_n(p, plane, 0.0f);
      return p;
    };
    float *const radius = new_plane(), *const density = new_plane(), *const depth = new_plane();
    base::ArenaVector<float*> values(args.scratch);
    for (int c = 0; c < channels; ++c) values.push_back(new_plane());

    const std::span<const int> present = args.in_channels[1];
    const auto channel = std::find(present.begin(), present.end(), params_.depth_channel) - present.begin();
    float largest = 0;
    for (int y = in.y0; y < in.y1; ++y) {
      ptrdiff_t i = (y - in.y0) * row.stride;
      for (int x = in.x0; x < in.x1; ++x, ++i) {
        const auto* const pixel = reinterpret_cast<const float*>(color.At(x, y));
        for (int c = 0; c < channels; ++c) values[static_cast<size_t>(c)][i] = pixel[c];
        depth[i] = reinterpret_cast<const float*>(args.in[1].At(x, y))[channel];
        // Beyond the image there is nothing to gather.
        const double c = window_.Contains({x, y, x + 1, y + 1}) ? CircleOfConfusion(params_, depth[i]) : 0;
        radius[i] = static_cast<float>(c);
        density[i] = c > 0 ? static_cast<float>(1 / (std::numbers::pi * c * c)) : 0;
        largest = std::max(largest, radius[i]);
      }
    }

    row.width = out.width();
    row.reach = std::min(margin_, static_cast<int>(std::ceil(largest - 0.5f)));
    row.largest = largest;
    row.padded = (out.width() + kPad - 1) / kPad * kPad;
    const size_t sums = static_cast<size_t>(row.padded) * static_cast<size_t>(channels + 1);
    row.sums = args.scratch.Allocate<float>(sums);
    row.parts = args.scratch.Allocate<float>(sums);
    row.values = {args.scratch.Allocate<const float*>(values.size()), values.size()};
    for (int y = out.y0; y < out.y1; ++y) {
      const ptrdiff_t first = (y - in.y0) * row.stride + (out.x0 - in.x0);
      row.radius = radius + first, row.density = density + first, row.depth = depth + first;
      for (size_t c = 0; c < values.size(); ++c) row.values[c] = values[c] + first;
      gather_(row);
      Finish(row, channels, reinterpret_cast<float*>(args.out.At(out.x0, y)));
    }
  }

 private:
  static void Finish(const DiscRow& row, int channels, float* out) {
    const float* const totals = row.sums + ptrdiff_t{channels} * row.padded;
    for (int x = 0; x < row.width; ++x, out += channels) {
      // Without a depth, or alone in its disc: the pixel itself, bit for bit.
      const bool alone = row.density[x] == 0 || totals[x] == row.density[x];
      for (int c = 0; c < channels; ++c) {
        out[c] = alone ? row.values[static_cast<size_t>(c)][x]
                       : row.sums[ptrdiff_t{c} * row.padded + x] / totals[x];
      }
    }
  }

  DepthOfFieldParams params_;
  int margin_;
  Roi window_;
  DiscFunction gather_;
};

class DepthOfFieldOp final : public graph::OpWith<DepthOfFieldParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "dof"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool IsIdentity() const override { return params().aperture == 0; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const DepthOfFieldParams& p = params();
    if (!(p.focus > 0))
      throw Error("dof", "found a focus of " + base::NumberText(p.focus) + ", expected a depth above 0");
    if (!(p.aperture >= 0) || std::isinf(p.aperture)) {
      throw Error("dof", "found an aperture of " + base::NumberText(p.aperture) +
                             ", expected a finite one of at least 0");
    }
    if (!(p.max_radius >= 0 && p.max_radius <= kLargestRadius)) {
      throw Error("dof",
                  "found a radius of " + base::NumberText(p.max_radius) + " pixels, expected 0 to 128");
    }
    if (p.depth_channel < 0 || p.depth_channel >= inputs[1].channel_count()) {
      throw DataError("dof", "found the depth channel " + std::to_string(p.depth_channel) +
                                 ", expected 0 to " + std::to_string(inputs[1].channel_count() - 1));
    }
    if (p.blades < 3 || p.blades > kMostBlades) {
      throw Error("dof", "found " + std::to_string(p.blades) + " blades, expected 3 to " +
                             std::to_string(kMostBlades));
    }
    if (!std::isfinite(p.rotation))
      throw Error("dof", "found a rotation of " + base::NumberText(p.rotation) + ", expected finite degrees");
    if (p.method == DepthOfFieldMethod::kGather && p.shape != ApertureShape::kDisc)
      throw Error("dof", "found a shape for gathering, expected a disc or the layers' method");
    if ((p.shape == ApertureShape::kPicture) != (inputs.size() == 3))
      throw Error("dof", "found a picture's shape without the picture, expected it as the third image");
    graph::RequireSameWindow("dof", inputs.first(2));
    return inputs[0];
  }
  bool NeedsWhole(int k) const override { return k == 2; }
  std::vector<bool> NeededChannels(int k, const std::vector<bool>& result,
                                   const ImageSpec& in) const override {
    if (k == 0) return result;
    std::vector<bool> needed(in.channels.size(), false);
    needed[k == 1 ? static_cast<size_t>(params().depth_channel) : 0] = true;
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const Roi& window = context.inputs[0].data_window;
    if (params().method == DepthOfFieldMethod::kGather)
      return std::make_unique<DepthOfFieldStage>(params(), window);
    const bool pictured = context.inputs.size() == 3 && !window.empty();
    return MakeLensLayersStage(params(), window, pictured ? &context.whole[2] : nullptr);
  }
};

}  // namespace

OpInfo DepthOfFieldInfo() {
  OpInfo info;
  info.name = "dof";
  info.family = "accumulate";
  info.inputs = 2;
  info.summary = "Depth of field from colour and depth";
  info.operands = [](const Arguments& a) { return a.Text("shape") == "picture" ? 3 : 2; };
  info.help =
      "COLOR DEPTH --dof FOCUS: a point at depth z is spread over a disc of radius aperture |1/FOCUS - "
      "1/z| pixels, at most max=. method=layers: what is spread is composited from near to far, so that "
      "near objects get soft edges over what is sharp, and what is far is not drawn over what is near. "
      "What a near edge uncovers is guessed from the farther surface beside it: the mean of what is found "
      "in eight directions within max=. A plane's light is conserved, and bright points become the lens's "
      "opening: shape=polygon has blades=, shape=picture (COLOR DEPTH PICTURE --dof) is the first channel "
      "of a picture, brightness the light that passes, its longer side the disc's diameter (a disc where "
      "it is black everywhere), held in memory whole; before the focus it is turned by half a turn, as a "
      "lens does. Cost: per pixel O(radius) and O(1) for every layer of depths that is there, O(radius^2) "
      "for pictures. method=gather: a mean of the neighbours whose disc reaches a pixel; what lies behind "
      "it is spread no further than itself, so objects keep hard edges; O(max^2). Alpha is treated as the "
      "colours; premultiply first. A depth of infinity is infinitely far; a depth that is zero, negative "
      "or NaN leaves the pixel as it is and gives nothing to others. Approximate where one object hides "
      "another. Source: McReynolds et al. 1997, 9.2.";
  info.bound = "64 u * (largest |value| spread to the pixel)";
  info.bound_u = 64;
  info.arguments = {NumberModifier("FOCUS", "", 1e-30, 1e38, "the depth that is sharp")};
  info.modifiers = {
      NumberModifier("aperture", "8", 0, 1e30, "radius in pixels times depth"),
      NumberModifier("max", "32", 0, kLargestRadius, "largest radius in pixels"),
      IntegerModifier("channel", "0", 0, 1023, "channel of the depth image"),
      ChoiceModifier("method", {"layers", "gather"}, "composited by depth, or a mean of what reaches"),
      OnlyWith("method=layers",
               ChoiceModifier("shape", {"disc", "polygon", "picture"}, "of the lens's opening")),
      OnlyWith("shape=polygon",
               IntegerModifier("blades", "6", 3, kMostBlades, "corners, on the disc's edge")),
      OnlyWith("shape=polygon",
               NumberModifier("rotation", "0", -1e6, 1e6,
                              "degrees, counter-clockwise as seen; 0: a corner points right"))};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    DepthOfFieldParams p{a.Number("FOCUS"), a.Number("aperture"), a.Number("max"), a.Integer("channel")};
    const std::string& shape = a.Text("shape");
    if (a.Text("method") == "gather") p.method = DepthOfFieldMethod::kGather;
    if (shape == "polygon") p.shape = ApertureShape::kPolygon;
    p.blades = a.Integer("blades"), p.rotation = a.Number("rotation");
    return shape == "picture" ? DepthOfField(in[0], in[1], in[2], p) : DepthOfField(in[0], in[1], p);
  };
  info.identity = "0.8 aperture=0";
  info.examples = {"0.8 aperture=4 max=6",
                   "0.3 aperture=1 max=3.7 channel=1",
                   "1e30 aperture=2 max=2",
                   "0.8 aperture=4 max=6 method=gather",
                   "0.5 aperture=3 max=5 shape=polygon blades=5 rotation=20",
                   "0.6 aperture=4 max=4.3 shape=picture"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node DepthOfField(const Node& image, const Node& depth, const DepthOfFieldParams& params) {
  return graph::MakeNode(std::make_shared<const ops::DepthOfFieldOp>(params), {image, depth});
}

Node DepthOfField(const Node& image, const Node& depth, const Node& aperture,
                  const DepthOfFieldParams& params) {
  DepthOfFieldParams p = params;
  p.shape = ApertureShape::kPicture;
  return graph::MakeNode(std::make_shared<const ops::DepthOfFieldOp>(p), {image, depth, aperture});
}

}  // namespace tessera
