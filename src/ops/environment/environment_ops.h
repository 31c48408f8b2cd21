// Registry rows of the environment family: envmap, envconvert, phong, normals.
#ifndef TESSERA_OPS_ENVIRONMENT_ENVIRONMENT_OPS_H_
#define TESSERA_OPS_ENVIRONMENT_ENVIRONMENT_OPS_H_

#include <string>
#include <vector>

#include "ops/modifiers.h"
#include "ops/registry.h"
#include "tessera/ops/environment.h"

namespace tessera::ops {

OpInfo EnvironmentInfo();
OpInfo ConvertEnvironmentInfo();
OpInfo PhongInfo();
OpInfo NormalsInfo();

// Parameters that the rows share.
ParamInfo MapChoice(const std::string& name, const std::string& default_value, const std::string& help);
EnvironmentMap MapNamed(const std::string& name);
ParamInfo FieldOfViewModifier(const std::string& name, const std::string& whose);
Vector3 VectorOf(const std::vector<double>& numbers);
// 9 numbers (3x3) or 16 (4x4), row-major.
Matrix4 MatrixOf(const std::vector<double>& numbers);
// Throws Error(subject, ...) unless every number is finite (and the vector is not 0).
void RequireVector(const std::string& subject, const char* name, const Vector3& v, bool nonzero);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ENVIRONMENT_ENVIRONMENT_OPS_H_
