// Ambient occlusion and curvature of heights.
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "base/arena.h"
#include "model/horizon.h"
#include "ops/bump/bump_ops.h"
#include "ops/bump/height_op.h"
#include "ops/geometry/filters.h"
#include "ops/geometry/modifiers.h"
#include "ops/modifiers.h"
#include "ops/range.h"
#include "tessera/ops/bump.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/bump/relief.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/doubles-inl.h"

#ifndef TESSERA_OPS_BUMP_RELIEF_CC_
#define TESSERA_OPS_BUMP_RELIEF_CC_
namespace tessera::ops {

// All rays one after the other: offsets, and what a difference of heights is multiplied by.
struct HorizonTap {
  int dx = 0, dy = 0;
  float slope = 0;
};
struct ReliefSetup {
  std::vector<std::vector<HorizonTap>> rays;
  double scale = 1;
  bool gaussian = false;           // curvature: fxx fyy - fxy^2, else its mean
  double factor = 1, summand = 0;  // of the result
};
// `row` is the first pixel, rows `stride` floats apart. Whole vectors are read and written.
using ReliefFunction = void (*)(const ReliefSetup& setup, const float* row, ptrdiff_t stride, int count,
                                float* out);
struct ReliefFunctions {
  ReliefFunction occlusion, curvature;
};

}  // namespace tessera::ops
#endif  // TESSERA_OPS_BUMP_RELIEF_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::DD;
using s::VD;

void OcclusionRow(const ReliefSetup& setup, const float* row, ptrdiff_t stride, int count, float* out) {
  const s::D d;
  const s::V one = hn::Set(d, 1.0f);
  for (int i = 0; i < count; i += s::kLanes) {
    const s::V centre = hn::LoadU(d, row + i);
    s::V open = hn::Zero(d);
    for (const std::vector<HorizonTap>& ray : setup.rays) {
      s::V steepest = hn::Zero(d);
      for (const HorizonTap& tap : ray) {
        const s::V there = hn::LoadU(d, row + i + tap.dy * stride + tap.dx);
        const s::V slope = hn::Mul(hn::Sub(there, centre), hn::Set(d, tap.slope));
        steepest = hn::IfThenElse(hn::Gt(slope, steepest), slope, steepest);  // a NaN hides nothing
      }
      // The square of the horizon's cosine.
      open = hn::Add(open, hn::Div(one, hn::MulAdd(steepest, steepest, one)));
    }
    hn::StoreU(hn::Div(open, hn::Set(d, static_cast<float>(setup.rays.size()))), d, out + i);
  }
}

void CurvatureRow(const ReliefSetup& setup, const float* row, ptrdiff_t stride, int count, float* out) {
  const DD d;
  const hn::Rebind<float, DD> df;
  const VD scale = hn::Set(d, setup.scale), one = hn::Set(d, 1.0);
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const auto at = [&](int dx, int dy)
                        HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(df, row + i + dy * stride + dx)); };
    const VD h = at(0, 0);
    const auto apart = [&](VD a, VD b) HWY_ATTR { return hn::Mul(hn::Sub(a, b), scale); };
    // Differences first, so that heights far from 0 lose nothing.
    const VD right = apart(at(1, 0), h), left = apart(at(-1, 0), h), up = apart(at(0, -1), h),
             down = apart(at(0, 1), h);
    const VD half = hn::Set(d, 0.5), quarter = hn::Set(d, 0.25);
    const VD fx = hn::Mul(hn::Sub(right, left), half), fy = hn::Mul(hn::Sub(up, down), half);
    const VD fxx = hn::Add(right, left), fyy = hn::Add(up, down);
    const VD fxy = hn::Mul(hn::Sub(apart(at(1, -1), at(-1, -1)), apart(at(1, 1), at(-1, 1))), quarter);
    const VD q = hn::MulAdd(fx, fx, hn::MulAdd(fy, fy, one));
    VD v;
    if (setup.gaussian) {
      v = hn::Div(hn::MulSub(fxx, fyy, hn::Mul(fxy, fxy)), hn::Mul(q, q));
    } else {
      const VD across = hn::Mul(hn::MulAdd(fy, fy, one), fxx), along = hn::Mul(hn::MulAdd(fx, fx, one), fyy);
      const VD twice = hn::Mul(hn::Mul(fx, fy), hn::Add(fxy, fxy));
      // A hill bends down and counts as positive.
      v = hn::Div(hn::Mul(hn::Sub(twice, hn::Add(across, along)), half), hn::Mul(q, hn::Sqrt(q)));
    }
    v = hn::MulAdd(v, hn::Set(d, setup.factor), hn::Set(d, setup.summand));
    hn::StoreU(hn::DemoteTo(df, hn::IfThenElse(hn::IsNaN(v), hn::NaN(d), v)), df, out + i);
  }
}

ReliefFunctions ReliefOfTarget() { return {OcclusionRow, CurvatureRow}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {
namespace ops {
namespace {

HWY_EXPORT(ReliefOfTarget);
ReliefFunctions ChooseRelief() { return HWY_DYNAMIC_DISPATCH(ReliefOfTarget)(); }

class ReliefStage final : public graph::TileStage {
 public:
  ReliefStage(ReliefSetup setup, ReliefFunction run, int reach, Wrap wrap)
      : setup_(std::move(setup)), run_(run), reach_(reach), border_(wrap) {}
  Roi InputRoi(int, const Roi& out) const override { return Inflate(out, reach_, reach_); }
  Wrap InputBorder(int) const override { return border_; }
  void Run(const graph::TileArgs& args) const override {
    const Roi& o = args.out.roi;
    const ConstImageView& in = args.in[0];
    auto* const plane = args.scratch.Allocate<float>(static_cast<size_t>(o.width()) + 16);
    for (int y = o.y0; y < o.y1; ++y) {
      run_(setup_, reinterpret_cast<const float*>(in.At(o.x0, y)), in.row_stride / 4, o.width(), plane);
      std::copy_n(plane, o.width(), reinterpret_cast<float*>(args.out.At(o.x0, y)));
    }
  }

 private:
  ReliefSetup setup_;
  ReliefFunction run_;
  int reach_;
  Wrap border_;
};

class OcclusionOp final : public HeightOp<HeightOcclusionParams> {
 public:
  using HeightOp::HeightOp;
  std::string Name() const override { return "heighttoao"; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return SpecWith(inputs, {"Y"}); }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    ReliefSetup setup;
    for (int k = 0; k < params().directions; ++k) {
      std::vector<HorizonTap>& ray = setup.rays.emplace_back();
      for (const model::HorizonPlace& p : model::HorizonRay(k, params().directions, params().radius))
        ray.push_back({p.dx, p.dy, static_cast<float>(params().scale / p.distance)});
    }
    return std::make_unique<ReliefStage>(std::move(setup), ChooseRelief().occlusion, params().radius,
                                         params().wrap);
  }
};

class CurvatureOp final : public HeightOp<HeightCurvatureParams> {
 public:
  using HeightOp::HeightOp;
  std::string Name() const override { return "curvature"; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return SpecWith(inputs, {"Y"}); }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    ReliefSetup setup;
    setup.scale = params().scale;
    setup.gaussian = params().output == CurvatureOutput::kGaussian;
    setup.factor = params().pack ? params().gain / 2 : params().gain;
    setup.summand = params().pack ? 0.5 : 0;
    return std::make_unique<ReliefStage>(std::move(setup), ChooseRelief().curvature, 1, params().wrap);
  }
};

constexpr double kSteepest = 1e6;

}  // namespace

OpInfo HeightOcclusionInfo() {
  OpInfo info;
  info.name = "heighttoao";
  info.family = "bump";
  info.summary = "Ambient occlusion of a height image";
  info.help =
      "HEIGHT --heighttoao gives the share of an even sky's light that reaches each point of the relief, 1 on open ground: "
      "the mean over directions= of the square of the cosine of the horizon, which is looked for up to radius= pixels away. "
      "Heights are the first channel, times scale=, in pixels (default of integer codes a tenth of the picture's width, of "
      "half and float 1, as --normalmap). wrap=periodic for textures that repeat. A NaN hides nothing and is open. Cost "
      "grows with radius times directions. Source: Max 1988.";
  info.bound = "4 u (2 + directions / 8)";
  info.bound_u = 4;
  info.modifiers = {NumberModifier("scale", "", -kSteepest, kSteepest, "of the heights"),
                    IntegerModifier("radius", "16", 1, 255, "pixels to where a horizon is looked for"),
                    IntegerModifier("directions", "16", 4, 64, "to how many sides"),
                    WrapModifier("wrap", "clamp")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return HeightToOcclusion(in[0], {HeightScale(a, in[0].spec()), a.Integer("radius"),
                                     a.Integer("directions"), WrapNamed(a.Text("wrap"))});
  };
  info.examples = {"radius=8 scale=4", "radius=3 directions=7 scale=20 wrap=periodic",
                   "radius=5 directions=8 scale=-2 wrap=black"};
  return info;
}

OpInfo HeightCurvatureInfo() {
  OpInfo info;
  info.name = "curvature";
  info.family = "bump";
  info.summary = "Curvature of a height image";
  info.help =
      "HEIGHT --curvature gives gain= times the relief's curvature per pixel, positive on hills and edges, negative in "
      "hollows: output=mean is -((1 + f_y^2) f_xx - 2 f_x f_y f_xy + (1 + f_x^2) f_yy)/(2 (1 + f_x^2 + f_y^2)^(3/2)), "
      "gaussian (f_xx f_yy - f_xy^2)/(1 + f_x^2 + f_y^2)^2, f the first channel times scale= (as --heighttoao). pack=1 "
      "stores 1/2 + half of it, as integer codes do by default: flat ground is grey. Derivatives are differences of "
      "neighbours; --blur before shows larger forms.";
  info.bound = "2 u (|result| + what the largest heights around round)";
  info.bound_u = 2;
  info.modifiers = {NumberModifier("scale", "", -kSteepest, kSteepest, "of the heights"),
                    ChoiceModifier("output", {"mean", "gaussian"}, "which curvature"),
                    NumberModifier("gain", "1", -1e6, 1e6, "of the result"),
                    FlagModifier("pack", "to codes in [0,1]", ""), WrapModifier("wrap", "clamp")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const ImageSpec& spec = in[0].spec();
    return HeightToCurvature(
        in[0],
        {HeightScale(a, spec),
         a.Text("output") == "gaussian" ? CurvatureOutput::kGaussian : CurvatureOutput::kMean,
         a.Number("gain"), a.Given("pack") ? a.Flag("pack") : HoldsCodes(spec), WrapNamed(a.Text("wrap"))});
  };
  info.examples = {"scale=2", "scale=4 gain=3 pack=1 wrap=periodic", "output=gaussian scale=0.7 wrap=mirror"};
  return info;
}

}  // namespace ops

Node HeightToOcclusion(const Node& height, const HeightOcclusionParams& p) {
  ops::RequireRange("heighttoao", "scale=", p.scale, -ops::kSteepest, ops::kSteepest);
  ops::RequireRange("heighttoao", "radius=", p.radius, 1, 255);
  ops::RequireRange("heighttoao", "directions=", p.directions, 4, 64);
  ops::RequireImageWrap("heighttoao", p.wrap);
  return graph::MakeNode(std::make_shared<const ops::OcclusionOp>(p), {height});
}

Node HeightToCurvature(const Node& height, const HeightCurvatureParams& p) {
  ops::RequireRange("curvature", "scale=", p.scale, -ops::kSteepest, ops::kSteepest);
  ops::RequireRange("curvature", "gain=", p.gain, -1e6, 1e6);
  ops::RequireImageWrap("curvature", p.wrap);
  return graph::MakeNode(std::make_shared<const ops::CurvatureOp>(p), {height});
}

}  // namespace tessera
#endif  // HWY_ONCE
