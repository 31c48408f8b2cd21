// The rows of the colour family, and what its operations share.
#ifndef TESSERA_OPS_COLOR_COLOR_OPS_H_
#define TESSERA_OPS_COLOR_COLOR_OPS_H_

#include <any>
#include <array>
#include <string>

#include "ops/color/affine.h"
#include "ops/registry.h"
#include "tessera/ops/color.h"

namespace tessera::ops {

OpInfo BrightnessInfo();
OpInfo CmyInfo();
OpInfo CmykInfo();
OpInfo ColorMatrixInfo();
OpInfo ColorStateInfo();
OpInfo ContrastInfo();
OpInfo RangeCompressInfo();
OpInfo RangeExpandInfo();
OpInfo HueInfo();
OpInfo InterpolateInfo();
OpInfo LuminanceInfo();
OpInfo PremultiplyInfo();
OpInfo RepremultiplyInfo();
OpInfo SaturateInfo();
OpInfo UnpremultiplyInfo();
OpInfo YiqInfo();

using Matrix3 = std::array<std::array<double, 3>, 3>;

// Throws Error(op, ...) unless the value is finite and within float's range.
void RequireFinite(const std::string& op, const std::string& what, double value);
// The weights divided by their sum; throws Error(op, ...).
LuminanceWeights NormalizedWeights(const std::string& op, const LuminanceWeights& w);

// A node of a 3x3 matrix on columns (R,G,B), of class kRgb.
Node MakeRgbNode(const std::string& op, const Node& image, const Matrix3& m, std::any parameters);
// A node of (R,G,B)' = scale (R,G,B) + bias, other channels untouched.
Node MakeScaleBiasNode(const std::string& op, const Node& image, double scale, double bias,
                       std::any parameters);

// The "weights" modifier and its value.
ParamInfo WeightsParam();
LuminanceWeights WeightsOf(const Arguments& arguments);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_COLOR_COLOR_OPS_H_
