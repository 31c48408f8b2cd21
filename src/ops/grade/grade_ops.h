// The rows of the grade family, and what its operations share. They are made of other operations.
#ifndef TESSERA_OPS_GRADE_GRADE_OPS_H_
#define TESSERA_OPS_GRADE_GRADE_OPS_H_

#include <string>
#include <vector>

#include "ops/registry.h"
#include "tessera/ops/grade.h"

namespace tessera::ops {

OpInfo ExposureInfo();
OpInfo WhiteBalanceInfo();
OpInfo GradeInfo();
OpInfo CdlInfo();
OpInfo LevelsInfo();
OpInfo VibranceInfo();
OpInfo CurvesInfo();
OpInfo DespillInfo();
OpInfo KeyInfo();

// A row of an operation that is made of others.
OpInfo MadeRow(const char* family, const char* name, const char* summary, const char* help);
// A modifier of one number, or of three for R, G, B; and its value.
ParamInfo RgbModifier(const char* name, const char* default_value, const char* help);
Rgb RgbOf(const Arguments& arguments, const char* name);

// Lists of the operations of constants: three values leave alpha alone.
inline std::vector<double> Listed(const Rgb& v) { return {v[0], v[1], v[2]}; }
// factor v + summand.
Node Scaled(const Node& image, const Rgb& factor, const Rgb& summand);
// Powers of R, G, B; samples below 0 are kept.
Node Powers(const Node& image, const Rgb& exponents);
// The channels of those numbers, which keep their names.
Node Picked(const Node& image, const std::vector<int>& channels);
// `colors`, three channels, in place of the image's first three.
Node WithColors(const Node& image, const Node& colors);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GRADE_GRADE_OPS_H_
