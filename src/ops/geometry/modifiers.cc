// Modifiers that the geometry operations share.
#include "ops/geometry/modifiers.h"

#include <cmath>
#include <numbers>

#include "ops/geometry/filters.h"
#include "ops/wrap.h"
#include "tessera/ops/curve.h"

namespace tessera::ops {
namespace {

// The constants of oiiotool's rangecompress: beyond the join y = a + b ln(c |x| + 1), which meets y = x
// there.
constexpr double kJoin = 0.18, kA = -0.54576885700225830078, kB = 0.18351669609546661377,
                 kC = 284.3577880859375;

}  // namespace

ParamInfo FilterModifier(const std::string& default_value, const std::string& help) {
  ParamInfo filter;
  filter.name = "filter";
  filter.type = ParamType::kChoice;
  filter.default_value = default_value;
  filter.help = help;
  filter.choices = FilterNames();
  return filter;
}

ParamInfo WarpFilterModifier(const std::string& default_value) {
  ParamInfo filter = FilterModifier(default_value, "how values between pixels are found");
  std::erase_if(filter.choices, [](const std::string& name) { return !FindFilter("", name).separable; });
  return filter;
}

ParamInfo WrapModifier(const std::string& name, const std::string& default_value) {
  ParamInfo wrap = WrapModifier({"black", "clamp", "repeat", "mirror"}, default_value.c_str(),
                                "what lies beyond the image");
  wrap.name = name;
  return wrap;
}

ParamInfo HighlightModifier() {
  ParamInfo highlight;
  highlight.name = "highlightcomp";
  highlight.type = ParamType::kFlag;
  highlight.default_value = "0";
  highlight.help =
      "filter logarithms of what is brighter than 0.18 (R, G and B): no ringing about highlights";
  return highlight;
}

Node CompressRange(const Node& image) {
  CurveFormula f;
  f.kind = CurveFormula::Kind::kLog;
  f.in_scale = kC, f.in_offset = 1;
  f.out_scale = kB * std::numbers::ln2, f.out_offset = kA;
  f.join = kJoin;
  f.negatives = Negatives::kMirror;
  return ApplyCurve(image, {{f}});
}

Node ExpandRange(const Node& image) {
  CurveFormula f;
  f.kind = CurveFormula::Kind::kExp;
  f.in_scale = std::numbers::log2e / kB, f.in_offset = -kA * f.in_scale;
  f.out_scale = 1 / kC, f.out_offset = -1 / kC;
  f.join = kJoin;
  f.negatives = Negatives::kMirror;
  return ApplyCurve(image, {{f}});
}

}  // namespace tessera::ops
