// Affine and projective warps.
#include <algorithm>
#include <cmath>
#include <string>

#include "ops/geometry/filters.h"
#include "ops/geometry/footprint.h"
#include "ops/geometry/gather_stage.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/modifiers.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"

namespace tessera::ops {
namespace {

using Matrix = std::vector<double>;

// The inverse, divided so that q is positive where the picture's centre goes; empty when there is none.
Matrix Inverse(const Matrix& m, const Roi& frame) {
  const auto minor = [&](size_t a, size_t b, size_t c, size_t d) {
    return static_cast<long double>(m[a]) * m[b] - static_cast<long double>(m[c]) * m[d];
  };
  const long double adjugate[9] = {minor(4, 8, 5, 7), minor(2, 7, 1, 8), minor(1, 5, 2, 4),
                                   minor(5, 6, 3, 8), minor(0, 8, 2, 6), minor(2, 3, 0, 5),
                                   minor(3, 7, 4, 6), minor(1, 6, 0, 7), minor(0, 4, 1, 3)};
  const long double det = m[0] * adjugate[0] + m[1] * adjugate[3] + m[2] * adjugate[6];
  const double q =
      0.5 * (double{1} * frame.x0 + frame.x1) * m[2] + 0.5 * (double{1} * frame.y0 + frame.y1) * m[5] + m[8];
  Matrix inverse;
  for (const long double a : adjugate) inverse.push_back(static_cast<double>((q < 0 ? -a : a) / det));
  const bool finite = std::all_of(inverse.begin(), inverse.end(), [](double v) { return std::isfinite(v); });
  return det != 0 && finite ? inverse : Matrix();
}

class WarpOp final : public graph::OpWith<WarpParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "warp"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool NeedsWhole(int) const override { return true; }
  bool IsIdentity() const override {
    return params().matrix == std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1} && !params().recompute_window &&
           (IsFootprintFilter(Filter()) || FindFilter("warp", Filter()).Interpolates());
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const WarpParams& p = params();
    if (p.matrix.size() != 9) {
      throw Error("warp", "found " + std::to_string(p.matrix.size()) + " numbers, expected 9");
    }
    if (Inverse(p.matrix, inputs[0].display_window).empty()) {
      throw Error("warp", "found a matrix without an inverse, expected an invertible one");
    }
    if (!IsFootprintFilter(Filter())) RequireWarpFilter("warp", Filter());
    if (p.anisotropy < 1 || p.anisotropy > kMostAnisotropy) {
      throw Error("warp", "found the anisotropy " + std::to_string(p.anisotropy) + ", expected 1 to " +
                              std::to_string(kMostAnisotropy));
    }
    ImageSpec spec = inputs[0];
    if (p.recompute_window && !spec.data_window.empty()) spec.data_window = Warped(spec.data_window);
    return spec;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const Matrix inverse = Inverse(params().matrix, context.inputs[0].display_window);
    GatherSettings s;
    std::copy(inverse.begin(), inverse.end(), s.map.m);
    s.map.projective = inverse[2] != 0 || inverse[5] != 0;
    if (!s.map.projective) {
      for (double& v : s.map.m) v /= inverse[8];
    }
    if (IsFootprintFilter(Filter())) {
      return MakeFootprintStage(s.map, Filter(), params().anisotropy, params().wrap, context);
    }
    s.map.reduce = true;
    s.filter = Filter();
    s.wrap_x = s.wrap_y = params().wrap;
    return MakeGatherStage(s, context);
  }

 private:
  std::string Filter() const { return params().filter.empty() ? "lanczos3" : params().filter; }

  // As oiiotool: around the four corner pixels' centres.
  Roi Warped(const Roi& w) const {
    const Matrix& m = params().matrix;
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (const double x : {w.x0 + 0.5, w.x1 - 0.5}) {
      for (const double y : {w.y0 + 0.5, w.y1 - 0.5}) {
        const double q = x * m[2] + y * m[5] + m[8];
        const double at[2] = {(x * m[0] + y * m[3] + m[6]) / q, (x * m[1] + y * m[4] + m[7]) / q};
        for (int i = 0; i < 2; ++i) lo[i] = std::min(lo[i], at[i]), hi[i] = std::max(hi[i], at[i]);
      }
    }
    constexpr double kFarthest = 1 << 24;
    for (int i = 0; i < 2; ++i) {
      if (!(lo[i] > -kFarthest && hi[i] < kFarthest)) {
        throw DataError("warp",
                        "found a warped window that leaves +-2^24 pixels, expected one that does not");
      }
    }
    const auto whole = [](double v) { return static_cast<int>(std::floor(v)); };
    return {whole(lo[0]), whole(lo[1]), whole(hi[0]) + 1, whole(hi[1]) + 1};
  }
};

}  // namespace

OpInfo WarpInfo() {
  OpInfo info;
  info.name = "warp";
  info.family = "geometry";
  info.summary = "Warp by a 3x3 matrix, affine or projective";
  info.help =
      "As oiiotool, M is row-major and a position is a row vector: (x' q, y' q, q) = (x, y, 1) M carries the "
      "image's pixels to their new places; pixel centres are at half-integers. Every result pixel gathers "
      "with the filter about where it came from, widened by the map's derivatives where it reduces. "
      "Positions are computed in double; one within 2^-17 of a pixel's centre or edge counts as there, so "
      "that flips, quarter turns and whole shifts keep bits. The windows stay unless recompute_roi=1. Behind "
      "the projector (q <= 0 where the picture's centre has q > 0) is black.";
  info.help +=
      " The image is held in memory whole. A result pixel of an oblique view covers a long, thin part of the image, "
      "which those filters take to be the box around it; two follow it, in any direction, at a cost that the map "
      "does not change: trilinear, the mean of up to aniso= look-ups in mip levels along its longer axis, as "
      "graphics hardware does it, and ewa, a Gaussian under an ellipse (Heckbert 1989), up to 70 * aniso pixels. "
      "Root mean square error of a checkered floor towards its horizon against the mean of 256 places a pixel: "
      "triangle 0.065, trilinear with aniso=1 0.071, 4 0.022, 8 and 16 0.016; ewa 0.028, as it is softer than that "
      "mean and moves without flicker. Positions of these two are not rounded.";
  info.bound = "6 u * (1 + taps / 128 + level / 2) * (largest |value| under the filter) * (sum of |weight|)";
  info.bound_u = 6;
  info.arguments = {NumbersModifier("M", "", 9, "nine numbers, row-major")};
  ParamInfo filter = WarpFilterModifier("lanczos3");
  filter.choices.insert(filter.choices.end(), {"trilinear", "ewa"});
  info.modifiers = {filter, WrapModifier("wrap", "black"),
                    FlagModifier("recompute_roi", "the data window holds the whole warped image"),
                    HighlightModifier(),
                    OnlyWith("filter=trilinear|ewa",
                             IntegerModifier("aniso", "16", 1, kMostAnisotropy,
                                             "longest length of what a result pixel covers, in widths of it; "
                                             "longer is widened, 1 is a plain mip map"))};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Warp(in[0], {a.Numbers("M"), a.Text("filter"), WrapNamed(a.Text("wrap")), a.Flag("recompute_roi"),
                        a.Flag("highlightcomp"), static_cast<int>(a.Integer("aniso"))});
  };
  info.examples = {"0.9,0.3,0,-0.3,0.9,0,2,-4,1 filter=triangle",
                   "0.9,0.3,0,-0.3,0.9,0,2,-4,1",
                   "1.1,0.05,0.001,-0.02,1.2,0.002,3,1,1 filter=mitchell wrap=clamp",
                   "0.4,0.1,0,-0.1,0.3,0,2,5,1 filter=catmull-rom wrap=mirror",
                   "1.3,0.2,-0.01,0.1,1.1,0.03,3,-2,1 filter=triangle wrap=repeat",
                   "0,1,0,-1,0,0,20,4,1 recompute_roi=1",
                   "1.7,0,0,0,-2.1,0,0,31,1 filter=gaussian recompute_roi=1",
                   "2.5,0,0,0,0.3,0,0.5,0,1 filter=box wrap=repeat",
                   "0.5,0.1,0,-0.1,0.3,0.02,2,5,1 filter=trilinear aniso=8 wrap=clamp",
                   "0.4,0.1,0,-0.1,0.1,0.01,2,5,1 filter=ewa wrap=repeat",
                   "0.3,0.2,0,-0.2,0.9,0.01,2,5,1 filter=ewa",
                   "0.4,0,0,0.3,0.05,0,5,5,1 filter=trilinear wrap=mirror"};
  info.identity = "1,0,0,0,1,0,0,0,1";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Warp(const Node& image, const WarpParams& params) {
  ops::RequireImageWrap("warp", params.wrap);
  if (params.compress_highlights) {
    WarpParams plain = params;
    plain.compress_highlights = false;
    return ops::ExpandRange(Warp(ops::CompressRange(image), plain));
  }
  return graph::MakeNode(std::make_shared<const ops::WarpOp>(params), {image});
}

}  // namespace tessera
