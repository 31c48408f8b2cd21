// Rows of the shading family, and what its commands share.
#ifndef TESSERA_OPS_SHADE_SHADE_OPS_H_
#define TESSERA_OPS_SHADE_SHADE_OPS_H_

#include <optional>
#include <span>
#include <string>

#include "ops/registry.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {

OpInfo AovInfo();
OpInfo DepthInfo();
OpInfo PositionInfo();
OpInfo TransformPointsInfo();
OpInfo ReprojectInfo();
OpInfo FogInfo();
OpInfo LayerFogInfo();
OpInfo ShadowInfo();
OpInfo SoftShadowInfo();
OpInfo DiffuseLightInfo();
OpInfo SpotlightInfo();
OpInfo SolidInfo();

// A `camera=` or `light=` modifier of 16 or 32 numbers.
ParamInfo CameraModifier(const char* name, const char* help);
// The kinds of depths by name, DepthKind's order.
const std::vector<std::string>& DepthKinds();
DepthKind DepthKindNamed(const std::string& name);
// near= and far= of window depths, and what they are: as given, else the camera's, else the modifiers'
// defaults.
std::vector<ParamInfo> PlanesModifiers();
void SetPlanes(const Arguments& arguments, const std::optional<Camera>& camera, DepthParams& params);
// The camera written on the command line, or else the first that an image's metadata hold; none without.
std::optional<Camera> CameraOf(const Arguments& arguments, const char* name, std::span<const Node> images);
// The same or an Error that says how to give one.
Camera NeededCamera(const std::string& op, const Arguments& arguments, const char* name,
                    std::span<const Node> images);
// The eye written on the command line, or else the camera's, or else the origin.
Vector3 EyeOf(const Arguments& arguments, std::span<const Node> images);
Vector3 VectorOf(const Arguments& arguments, const char* name);

// The image itself when it has three channels or more, else its first one three times.
Node ThreeChannels(const Node& image);

// Throws Error(op, ...) unless the value is finite and at least `low`.
void RequireAtLeast(const std::string& op, const std::string& what, double value, double low);
void RequireFinite3(const std::string& op, const std::string& what, std::span<const double> values);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_SHADE_SHADE_OPS_H_
