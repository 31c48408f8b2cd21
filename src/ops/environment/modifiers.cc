// Modifiers that the rows of the environment family share.
#include <algorithm>
#include <cmath>

#include "base/number_text.h"
#include "ops/environment/environment_ops.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

const std::vector<std::string> kMaps = {"sphere",    "parabolic",     "dualparabolic", "latlong",
                                        "cube",      "octahedral",    "perspective",   "equidistant",
                                        "equisolid", "stereographic", "orthographic",  "cylinder"};

}  // namespace

ParamInfo MapChoice(const std::string& name, const std::string& default_value, const std::string& help) {
  ParamInfo p = ChoiceArgument(name, kMaps, help);
  p.default_value = default_value;
  return p;
}
EnvironmentMap MapNamed(const std::string& name) {
  return static_cast<EnvironmentMap>(std::find(kMaps.begin(), kMaps.end(), name) - kMaps.begin());
}
ParamInfo FieldOfViewModifier(const std::string& name, const std::string& whose) {
  return NumberModifier(
      name, "0", 0, 360,
      whose + " angle across, degrees, of a lens; 0: 90 perspective, 360 cylinder, 180 others");
}
Vector3 VectorOf(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

Matrix4 MatrixOf(const std::vector<double>& v) {
  Matrix4 m = kIdentity4;
  if (v.size() == 16) {
    std::copy(v.begin(), v.end(), m.begin());
  } else {
    for (size_t i = 0; i < 9; ++i) m[i / 3 * 4 + i % 3] = v[i];
  }
  return m;
}

void RequireVector(const std::string& subject, const char* name, const Vector3& v, bool nonzero) {
  double largest = 0;
  for (const double c : v) largest = std::max(largest, std::isfinite(c) ? std::fabs(c) : 1e300);
  if (largest <= 1e38 && (largest > 0 || !nonzero)) return;
  throw Error(subject, std::string("found ") + name + "=" + base::NumberText(v[0]) + "," +
                           base::NumberText(v[1]) + "," + base::NumberText(v[2]) +
                           ", expected finite numbers" + (nonzero ? ", not all 0" : ""));
}

}  // namespace tessera::ops
