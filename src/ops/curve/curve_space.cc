// Which colour space a named curve leads to.
#include <cmath>
#include <string>

#include "model/color_spaces.h"
#include "ops/curve/curve_ops.h"

namespace tessera::ops {
namespace {

// Curves that lead from light of certain primaries to a signal that has a name.
struct Encoded {
  const char* curve;
  double exponent;  // of gamma
  const char* light;
  const char* signal;
  const char* shown = nullptr;  // the same signal, for a display
};
constexpr Encoded kEncoded[] = {{"srgb", 0, "lin_rec709", "sRGB", "sRGB Display"},
                                {"rec709", 0, "lin_rec709", "Rec709"},
                                {"acescct", 0, "ACEScg", "ACEScct"},
                                {"gamma", 1.8, "lin_rec709", "g18_rec709"},
                                {"gamma", 2.2, "lin_rec709", "g22_rec709"},
                                {"gamma", 2.4, "lin_rec709", "g24_rec709", "Rec.1886 Rec.709 Display"}};

}  // namespace

std::string SpaceAfterCurve(const std::string& curve, double exponent, bool inverse,
                            const std::string& space) {
  if (curve == "gamma" && exponent == 1) return space;
  for (const Encoded& e : kEncoded) {
    if (curve != e.curve || (e.exponent != 0 && exponent != e.exponent)) continue;
    const auto is = [&](const char* name) { return name != nullptr && model::SameColorSpace(space, name); };
    if (inverse) return is(e.signal) || is(e.shown) ? e.light : "";
    // Light that nothing is known of is taken for video's, which these curves are made for.
    const bool video = std::string(e.light) == "lin_rec709";
    if (is(e.light) || (video && (space.empty() || space == model::kSceneLinear))) return e.signal;
  }
  return "";
}

}  // namespace tessera::ops
