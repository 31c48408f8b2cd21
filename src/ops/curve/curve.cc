// Curves by formula and powers by constant: operations, rows, public functions.
#include "tessera/ops/curve.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/arithmetic/operands.h"
#include "ops/curve/curve_kernel.h"
#include "ops/curve/curve_ops.h"
#include "ops/curve/curve_value.h"
#include "ops/modifiers.h"
#include "tessera/color_state.h"

namespace tessera::ops {
namespace {

using Kind = CurveFormula::Kind;

// The formula of a channel, or null where it keeps its bits.
const CurveFormula* FormulaOf(const std::vector<CurveFormula>& formulas, const ImageSpec& spec, int channel) {
  if (channel < 0) return nullptr;
  if (channel == spec.alpha) return formulas.size() == 4 ? &formulas[3] : nullptr;
  if (spec.channel_count() < 3) return formulas.data();
  if (channel >= 3) return nullptr;
  return formulas.size() == 1 ? formulas.data() : &formulas[static_cast<size_t>(channel)];
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// What -infinity gives.
double LimitBelow(const CurveFormula& f) {
  switch (f.negatives) {
    case Negatives::kMirror:
      return -ValueOf(f, kInfinity);
    case Negatives::kKeep:
      return -kInfinity;
    case Negatives::kExtend:
      return ValueOf(f, -kInfinity);
    case Negatives::kClamp:
      break;
  }
  return ValueOf(f, 0);
}

class CurveOp final : public graph::OpWith<CurveParams> {
 public:
  explicit CurveOp(CurveParams params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "curve"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::string Describe() const override {
    constexpr const char* kNames[] = {"linear", "power",      "log", "exp",
                                      "PQ",     "inverse PQ", "HLG", "inverse HLG"};
    return std::string("curve ") + kNames[static_cast<int>(params().formulas[0].kind)];
  }
  bool IsIdentity() const override {
    return std::all_of(params().formulas.begin(), params().formulas.end(), [](const CurveFormula& f) {
      return f.kind == Kind::kLinear && f.slope == 1 && f.offset == 0 && f.negatives != Negatives::kClamp;
    });
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    PlaneCurve planes[4];
    for (int p = 0; p < 4; ++p) {
      const CurveFormula* const f = FormulaOf(params().formulas, context.inputs[0], context.channels[p]);
      if (f == nullptr) continue;
      planes[p] = {true, *f, static_cast<float>(ValueOf(*f, kInfinity)), static_cast<float>(LimitBelow(*f)),
                   static_cast<float>(ValueOf(*f, 0))};
    }
    return MakeCurveStage(planes, context.inputs[0].type == PixelType::kUint8, context.workers.context());
  }
};

class PowerConstantOp final : public graph::OpWith<PowerConstants> {
 public:
  explicit PowerConstantOp(PowerConstants params) : OpWith(std::move(params)) {}
  std::string Name() const override { return "powc"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  bool IsIdentity() const override {
    return std::all_of(params().values.begin(), params().values.end(), [](double v) { return v == 1; });
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    PlanePower planes[4];
    for (int p = 0; p < 4; ++p) {
      planes[p].exponent = ChannelValue(params().values, context.channels[p], 1);
      planes[p].active = planes[p].exponent != 1;
    }
    return MakePowerStage(planes, context.inputs[0].type == PixelType::kUint8, context.workers.context());
  }
};

}  // namespace

OpInfo CurveInfo() {
  OpInfo info;
  info.name = "curve";
  info.family = "curve";
  info.summary = "Transfer function by formula: video, camera and plain logarithms, powers";
  info.help =
      "NAME encodes light into a signal: srgb, rec709, pq (1.0 is 10,000 cd/m2), hlg, acescct, cineon, logc3 "
      "(EI 800), logc4, slog3, vlog, log3g10, log10, log2, ln, or gamma with exponent=. inverse=1 decodes a "
      "signal to light. R,G,B (every channel but alpha where there are fewer than three) are changed; alpha "
      "and further channels keep their bits. Negative samples: mirror gives -f(-x), the default of srgb, "
      "rec709, pq, hlg and gamma; extend the formula as it stands, the default of the logarithms; clamp as "
      "0; keep their own bits. Evaluated in more than float's precision, most curves by polynomials that are "
      "fitted to the formula; continuous and monotone over all floats: "
      "where published pieces do not quite meet, their join is moved to where they do (sRGB: 0.00313066844; "
      "rec709 has BT.2020's long constants 1.09929682680944 and 0.018053968510807 where BT.709 prints 1.099 "
      "and 0.018: up to 2.5e-4 apart). NaN stays NaN; infinities follow the limit. The result's colour "
      "space is known for srgb, rec709 and gamma 1.8, 2.2, 2.4 on linear Rec.709, for acescct on ACEScg, "
      "and for what undoes them; light of unknown primaries counts as Rec.709's.";
  info.bound = "2 u (|result| + 2^-20 of its terms): 1 ULP but where a sum cancels; measured 0.74 ULP";
  info.bound_u = 2;
  ParamInfo name;
  name.name = "NAME";
  name.type = ParamType::kChoice;
  name.help = "the curve";
  name.choices = TransferFunctionNames();
  name.choices.push_back("gamma");
  info.arguments = {name};
  ParamInfo exponent = NumberModifier("exponent", "2.2", 1e-3, 1e3,
                                      "of gamma: the signal is light to the power of 1/exponent");
  ParamInfo negatives =
      ChoiceArgument("negatives", {"mirror", "extend", "clamp", "keep"}, "what happens to negative samples");
  info.modifiers = {FlagModifier("inverse", "1 decodes: signal to light"), exponent, negatives};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::vector<std::string>& names = TransferFunctionNames();
    const auto at = std::find(names.begin(), names.end(), a.Text("NAME"));
    CurveFormula formula;
    if (at == names.end()) {
      formula.kind = a.Number("exponent") == 1 ? Kind::kLinear : Kind::kPower;
      formula.exponent = a.Flag("inverse") ? a.Number("exponent") : 1 / a.Number("exponent");
      formula.negatives = Negatives::kMirror;
    } else {
      const auto curve = static_cast<TransferFunction>(at - names.begin());
      formula = a.Flag("inverse") ? Decoding(curve) : Encoding(curve);
    }
    if (a.Given("negatives")) {
      const std::vector<std::string> choices = {"mirror", "extend", "clamp", "keep"};
      formula.negatives = static_cast<Negatives>(
          std::find(choices.begin(), choices.end(), a.Text("negatives")) - choices.begin());
    }
    const ColorState color = ColorStateOf(in[0].spec());
    return WithColorState(
        ApplyCurve(in[0], {{formula}}),
        {SpaceAfterCurve(a.Text("NAME"), a.Number("exponent"), a.Flag("inverse"), color.space),
         color.premultiplied});
  };
  info.identity = "gamma exponent=1";
  info.examples = {"srgb", "srgb inverse=1", "rec709", "pq", "hlg", "acescct", "logc3", "gamma exponent=2.4"};
  return info;
}

OpInfo PowerConstantInfo() {
  OpInfo info;
  info.name = "powc";
  info.family = "curve";
  info.summary = "Raise to a constant power per channel";
  info.help =
      "Each sample of the result is A^c by C's rules: pow(A, 0) = 1 even of NaN, pow(0, c < 0) is infinite, "
      "a negative sample needs a whole exponent (else NaN; see --curve gamma for other rules). One value "
      "serves all channels, alpha included; of several values the n-th is channel n's, channels beyond the "
      "list keep their bits and values beyond the last channel are ignored, as oiiotool.";
  info.bound = "1.5 ULP (3 u |result|); measured 0.7 ULP";
  info.bound_u = 3;
  info.arguments = {ConstantsArgument("exponents")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return PowerConstant(in[0], a.Numbers("VALUES"));
  };
  info.examples = {"2", "3,2,1,2"};
  info.identity = "1";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node ApplyCurve(const Node& image, const CurveParams& params) {
  const size_t count = params.formulas.size();
  if (count != 1 && count != 3 && count != 4) {
    throw Error("curve", "found " + std::to_string(count) + " formulas, expected 1, 3 or 4");
  }
  for (const CurveFormula& f : params.formulas) {
    for (const double v :
         {f.in_scale, f.in_offset, f.exponent, f.out_scale, f.out_offset, f.floor, f.slope, f.offset}) {
      if (!std::isfinite(v))
        throw Error("curve", "found " + base::NumberText(v) + ", expected finite numbers");
    }
    if (std::isnan(f.join)) throw Error("curve", "found a join of nan, expected a number");
    if (f.kind == CurveFormula::Kind::kPower && !(f.exponent > 0)) {
      throw Error("curve", "found an exponent of " + base::NumberText(f.exponent) + ", expected one above 0");
    }
  }
  return graph::MakeNode(std::make_shared<const ops::CurveOp>(params), {image});
}

static Node ThroughCurve(const Node& image, TransferFunction curve, bool inverse) {
  const ColorState color = ColorStateOf(image.spec());
  const std::string& name = TransferFunctionNames()[static_cast<size_t>(curve)];
  return WithColorState(ApplyCurve(image, {{inverse ? Decoding(curve) : Encoding(curve)}}),
                        {ops::SpaceAfterCurve(name, 0, inverse, color.space), color.premultiplied});
}

Node Encode(const Node& image, TransferFunction curve) { return ThroughCurve(image, curve, false); }
Node Decode(const Node& image, TransferFunction curve) { return ThroughCurve(image, curve, true); }

Node Power(const Node& image, double exponent, Negatives negatives) {
  CurveFormula formula;
  formula.kind = exponent == 1 ? CurveFormula::Kind::kLinear : CurveFormula::Kind::kPower;
  formula.exponent = exponent;
  formula.negatives = negatives;
  return ApplyCurve(image, {{formula}});
}

Node PowerConstant(const Node& image, const std::vector<double>& values) {
  ops::RequireConstants("powc", values);
  return graph::MakeNode(std::make_shared<const ops::PowerConstantOp>(PowerConstants{values}), {image});
}

}  // namespace tessera
