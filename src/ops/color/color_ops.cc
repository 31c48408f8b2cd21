// What the colour operations share: weights, checks, nodes of matrices.
#include "ops/color/color_ops.h"

#include <cmath>
#include <limits>

#include "base/number_text.h"
#include "ops/modifiers.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {

void RequireFinite(const std::string& op, const std::string& what, double value) {
  if (std::fabs(value) <= std::numeric_limits<float>::max()) return;  // false for NaN
  throw Error(op, "found " + what + " " + base::NumberText(value) +
                      ", expected a finite number within float's range");
}

LuminanceWeights NormalizedWeights(const std::string& op, const LuminanceWeights& w) {
  for (const double v : {w.r, w.g, w.b}) RequireFinite(op, "weight", v);
  const double sum = w.r + w.g + w.b;
  if (std::fabs(sum) < 1e-6) {
    throw Error(op, "found luminance weights " + base::NumberText(w.r) + "," + base::NumberText(w.g) + "," +
                        base::NumberText(w.b) + " that sum to " + base::NumberText(sum) +
                        ", expected a sum whose magnitude is at least 1e-6");
  }
  return {w.r / sum, w.g / sum, w.b / sum};
}

Node MakeRgbNode(const std::string& op, const Node& image, const Matrix3& m, std::any parameters) {
  const ImageSpec& spec = image.spec();
  AffineParams p;
  p.channels = spec.channel_count(), p.alpha = spec.alpha, p.structure = AffineClass::kRgb;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) p.matrix[i][j] = m[i][j];
  }
  return graph::MakeNode(MakeAffine(op, std::move(p), std::move(parameters)), {image});
}

Node MakeScaleBiasNode(const std::string& op, const Node& image, double scale, double bias,
                       std::any parameters) {
  const ImageSpec& spec = image.spec();
  if (spec.channel_count() < 3) {
    return AsColors(
        image, [&](const Node& colors) { return MakeScaleBiasNode(op, colors, scale, bias, parameters); });
  }
  AffineParams p;
  p.channels = spec.channel_count(), p.alpha = spec.alpha;
  p.scale.assign(static_cast<size_t>(p.channels), 1.0);
  p.bias.assign(static_cast<size_t>(p.channels), 0.0);
  for (size_t c = 0; c < 3; ++c) p.scale[c] = scale, p.bias[c] = bias;
  return graph::MakeNode(MakeAffine(op, std::move(p), std::move(parameters)), {image});
}

ParamInfo WeightsParam() {
  ParamInfo p = ChoiceModifier("weights", {"rec709", "haeberli", "yiq"},
                               "luminance weights: a named set, or r,g,b (divided by their sum)");
  p.min_count = p.max_count = 3;
  p.numbers_too = true;
  return p;
}

LuminanceWeights WeightsOf(const Arguments& arguments) {
  const std::vector<double>& n = arguments.Numbers("weights");
  if (n.size() == 3) return {n[0], n[1], n[2]};
  const std::string& name = arguments.Text("weights");
  return name == "haeberli" ? kHaeberli : name == "yiq" ? kNtsc601 : kRec709;
}

}  // namespace tessera::ops
