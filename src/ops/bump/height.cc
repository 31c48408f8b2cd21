// Relief and normals from heights.
#include "ops/bump/height.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "base/arena.h"
#include "base/number_text.h"
#include "graph/op.h"
#include "ops/bump/bump_ops.h"
#include "ops/bump/height_op.h"
#include "ops/environment/environment_ops.h"
#include "ops/geometry/filters.h"
#include "ops/geometry/modifiers.h"
#include "ops/modifiers.h"
#include "tessera/error.h"

namespace tessera::ops {

void AddSlopeTaps(Slope slope, HeightSetup& setup) {
  const auto add = [&setup](int dx, int dy, double x, double y) { setup.taps.push_back({dx, dy, x, y, 0}); };
  switch (slope) {
    case Slope::kCentral:
      add(-1, 0, -0.5, 0), add(1, 0, 0.5, 0), add(0, -1, 0, 0.5), add(0, 1, 0, -0.5);
      break;
    case Slope::kForward:
      add(1, 0, 1, 0), add(0, -1, 0, 1);
      break;
    case Slope::kSobel:
      for (int k = -1; k <= 1; ++k) {
        const double w = k == 0 ? 0.25 : 0.125;
        add(-1, k, -w, 0), add(1, k, w, 0), add(k, -1, 0, w), add(k, 1, 0, -w);
      }
      break;
    case Slope::kGaussian: {
      // A ramp of slope 1 shall give 1.
      double ramp = 0;
      for (int j = -3; j <= 3; ++j) {
        for (int i = -3; i <= 3; ++i) ramp += i * i * std::exp(-0.5 * (i * i + j * j));
      }
      for (int j = -3; j <= 3; ++j) {
        for (int i = -3; i <= 3; ++i) {
          const double g = std::exp(-0.5 * (i * i + j * j)) / ramp;
          if (i != 0 || j != 0) add(i, j, i * g, -j * g);
        }
      }
      setup.reach = std::max(setup.reach, 3);
      break;
    }
  }
}

void AddShiftTaps(BumpMethod method, double dx, double dy, HeightSetup& setup) {
  // f at an offset, bilinear, counted `weight` times.
  const auto add = [&setup](double x, double y, double weight) {
    const double i = std::floor(x), j = std::floor(y), fx = x - i, fy = y - j;
    for (int k = 0; k < 4; ++k) {
      const double w = (k % 2 ? fx : 1 - fx) * (k / 2 ? fy : 1 - fy) * weight;
      const int tx = static_cast<int>(i) + k % 2, ty = static_cast<int>(j) + k / 2;
      if (w == 0 || (tx == 0 && ty == 0)) continue;
      setup.taps.push_back({tx, ty, 0, 0, w});
      setup.reach = std::max({setup.reach, std::abs(tx), std::abs(ty)});
    }
  };
  if (method == BumpMethod::kForward) {
    add(dx, dy, -1);
  } else {
    add(-dx / 2, -dy / 2, 1), add(dx / 2, dy / 2, -1);
  }
}

namespace {

class HeightStage final : public graph::TileStage {
 public:
  HeightStage(const HeightSetup& setup, Wrap wrap, bool normals)
      : setup_(setup), border_(wrap), normals_(normals), kernels_(ChooseHeightKernels()) {}
  Roi InputRoi(int, const Roi& out) const override { return Inflate(out, setup_.reach, setup_.reach); }
  Wrap InputBorder(int) const override { return border_; }
  void Run(const graph::TileArgs& args) const override {
    const Roi& o = args.out.roi;
    const ConstImageView& in = args.in[0];
    const int width = o.width(), channels = args.out.channels;
    const size_t room = static_cast<size_t>(width) + 16;
    float* const plane[3] = {args.scratch.Allocate<float>(room), args.scratch.Allocate<float>(room),
                             args.scratch.Allocate<float>(room)};
    for (int y = o.y0; y < o.y1; ++y) {
      const auto* row = reinterpret_cast<const float*>(in.At(o.x0, y));
      auto* const out = reinterpret_cast<float*>(args.out.At(o.x0, y));
      if (normals_) {
        kernels_.normals(setup_, row, in.row_stride / 4, width, plane[0], plane[1], plane[2]);
      } else {
        kernels_.shade(setup_, row, in.row_stride / 4, width, plane[0]);
      }
      for (int c = 0; c < channels; ++c) {
        const float* const from = plane[normals_ ? args.channels[static_cast<size_t>(c)] : 0];
        for (int i = 0; i < width; ++i) out[ptrdiff_t{i} * channels + c] = from[i];
      }
    }
  }

 private:
  HeightSetup setup_;
  Wrap border_;
  bool normals_;
  HeightKernels kernels_;
};

class NormalMapOp final : public HeightOp<HeightNormalsParams> {
 public:
  using HeightOp::HeightOp;
  std::string Name() const override { return "normalmap"; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    return SpecWith(inputs, {"X", "Y", "Z"});
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    HeightSetup setup;
    setup.scale = params().scale;
    setup.pack = params().pack;
    AddSlopeTaps(params().slope, setup);
    return std::make_unique<HeightStage>(setup, params().wrap, true);
  }
};

class BumpOp final : public HeightOp<BumpParams> {
 public:
  using HeightOp::HeightOp;
  std::string Name() const override { return "bump"; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return SpecWith(inputs, {"Y"}); }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    const BumpParams& p = params();
    HeightSetup setup;
    Vector3 d = Normalized(p.light);
    if (p.output == BumpOutput::kSpecular) {
      d[2] += 1;
      d = Dot(d, d) > 1e-30 ? Normalized(d) : Vector3{};
    }
    std::copy(d.begin(), d.end(), setup.direction);
    setup.scale = p.scale, setup.shift = p.shift, setup.exponent = p.exponent;
    setup.length = p.length, setup.output = p.output, setup.bits = p.bits;
    setup.slopes_only = p.method == BumpMethod::kNormals;
    if (setup.slopes_only || p.length) AddSlopeTaps(p.slope, setup);
    if (!setup.slopes_only) AddShiftTaps(p.method, p.shift * d[0], -p.shift * d[1], setup);
    return std::make_unique<HeightStage>(setup, p.wrap, false);
  }
};

void RequireScale(const std::string& op, double scale) {
  if (!(std::fabs(scale) <= 1e30))
    throw Error(op, "found scale=" + base::NumberText(scale) + ", expected a finite number");
}

ParamInfo SlopeChoice() {
  return ChoiceModifier("slope", {"central", "forward", "sobel", "gaussian"}, "how slopes are measured");
}
Slope SlopeNamed(const std::string& name) {
  return name == "forward"    ? Slope::kForward
         : name == "sobel"    ? Slope::kSobel
         : name == "gaussian" ? Slope::kGaussian
                              : Slope::kCentral;
}

}  // namespace

OpInfo HeightNormalsInfo() {
  OpInfo info;
  info.name = "normalmap";
  info.family = "bump";
  info.summary = "Normals of a height image";
  info.help =
      "HEIGHT --normalmap gives X,Y,Z = (-f_x, -f_y, 1)/sqrt(1 + f_x^2 + f_y^2) of the first channel f, "
      "times scale=, in pixels (default of integer codes a tenth of the picture's width: heights from 0 to 1 "
      "are that high; of half and float 1); x to the right, y up. slope=central is (f(x+1) - f(x-1))/2, forward f(x+1) - "
      "f(x), sobel its operator over 8, gaussian the derivative of a Gaussian over 7x7 pixels. pack=1 stores "
      "(n+1)/2, as integer codes do by default. Adding a constant to the heights changes nothing. Source: McReynolds et al. 1997, 8.3.2.";
  info.bound = "4 u";
  info.bound_u = 4;
  info.modifiers = {NumberModifier("scale", "", -1e30, 1e30, "of the heights"), SlopeChoice(),
                    WrapModifier("wrap", "clamp"), FlagModifier("pack", "to codes in [0,1]", "")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const ImageSpec& spec = in[0].spec();
    return HeightToNormals(in[0],
                           {HeightScale(a, spec), SlopeNamed(a.Text("slope")), WrapNamed(a.Text("wrap")),
                            a.Given("pack") ? a.Flag("pack") : HoldsCodes(spec)});
  };
  info.examples = {"", "scale=4 slope=sobel wrap=periodic", "slope=forward wrap=mirror pack=1",
                   "slope=gaussian scale=-0.5 wrap=black"};
  return info;
}

OpInfo BumpInfo() {
  OpInfo info;
  info.name = "bump";
  info.family = "bump";
  info.summary = "Light a height image as relief";
  info.help =
      "HEIGHT --bump:light=x,y,z shades the relief of the first channel (times scale=, in pixels; x right, y "
      "up, z to the viewer). output=diffuse is max(n'.L, 0) with the perturbed normal n'; specular max(n'.H, "
      "0)^exponent with H halfway to +z; emboss E + 1/2. method=normals works with slopes; shift is shift "
      "and subtract about the pixel, E = f(p - s L/2) - f(p + s L/2), n'.L = (E/s + L_z)/sqrt(1 + f_x^2 + "
      "f_y^2); forward is the papers' E = f(p) - f(p + s L). length=0 leaves the root out, as hardware "
      "without it did. bits=8 or 12 models its framebuffer. Source: McReynolds et al. 1997, 8.3.";
  info.bound = "4 u (1 + |E|/s), specular times 1 + exponent";
  info.bound_u = 4;
  info.modifiers = {
      NumbersModifier("light", "-1,1,1", {3}, "to the light"),
      NumberModifier("scale", "1", -1e30, 1e30, "of the heights"),
      ChoiceModifier("method", {"normals", "shift", "forward"}, "how n'.L is found"),
      ChoiceModifier("output", {"diffuse", "specular", "emboss"}, "what is written"),
      OnlyWith("method=shift|forward", NumberModifier("shift", "1", 1e-3, 64, "s, in pixels")),
      OnlyWith("output=specular", NumberModifier("exponent", "20", 0, 10000, "of the highlight")),
      FlagModifier("length", "divide by the normal's length", "1"),
      SlopeChoice(),
      WrapModifier("wrap", "clamp"),
      IntegerModifier("bits", "0", 0, 24, "of the framebuffer; 0: none")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    BumpParams p;
    p.light = VectorOf(a.Numbers("light"));
    p.scale = a.Number("scale"), p.shift = a.Number("shift"), p.exponent = a.Number("exponent");
    const std::string& method = a.Text("method");
    p.method = method == "shift"     ? BumpMethod::kShift
               : method == "forward" ? BumpMethod::kForward
                                     : BumpMethod::kNormals;
    const std::string& output = a.Text("output");
    p.output = output == "specular" ? BumpOutput::kSpecular
               : output == "emboss" ? BumpOutput::kEmboss
                                    : BumpOutput::kDiffuse;
    p.length = a.Flag("length");
    p.slope = SlopeNamed(a.Text("slope"));
    p.wrap = WrapNamed(a.Text("wrap"));
    p.bits = a.Integer("bits");
    return Bump(in[0], p);
  };
  info.examples = {"light=-1,1,1", "method=shift light=0.5,0.3,0.812 shift=1.5 wrap=mirror",
                   "method=forward output=emboss shift=3 length=0",
                   "output=specular exponent=12 scale=0.25 slope=sobel",
                   "method=shift length=0 light=0,0,1 wrap=periodic"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node HeightToNormals(const Node& height, const HeightNormalsParams& params) {
  ops::RequireScale("normalmap", params.scale);
  ops::RequireImageWrap("normalmap", params.wrap);
  return graph::MakeNode(std::make_shared<const ops::NormalMapOp>(params), {height});
}

Node Bump(const Node& height, const BumpParams& p) {
  ops::RequireScale("bump", p.scale);
  ops::RequireImageWrap("bump", p.wrap);
  ops::RequireVector("bump", "light", p.light, true);
  if (!(p.shift >= 1e-3 && p.shift <= 64)) {
    throw Error("bump", "found shift=" + base::NumberText(p.shift) + ", expected 0.001 to 64 pixels");
  }
  if (!(p.exponent >= 0 && p.exponent <= 10000)) {
    throw Error("bump", "found exponent=" + base::NumberText(p.exponent) + ", expected 0 to 10000");
  }
  if (p.bits < 0 || p.bits > 24)
    throw Error("bump", "found bits=" + std::to_string(p.bits) + ", expected 0 to 24");
  return graph::MakeNode(std::make_shared<const ops::BumpOp>(p), {height});
}

}  // namespace tessera
