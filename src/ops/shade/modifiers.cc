// Modifiers and checks that the shading commands share.
#include "ops/modifiers.h"

#include <algorithm>
#include <cmath>

#include "base/number_text.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {

ParamInfo CameraModifier(const char* name, const char* help) {
  ParamInfo param = ListModifier(name, "", 32, -1e38, 1e38, help);
  param.counts = {16, 32};
  return param;
}

std::optional<Camera> CameraOf(const Arguments& arguments, const char* name, std::span<const Node> images) {
  if (arguments.Given(name)) return Camera::FromNumbers(arguments.Numbers(name), name);
  for (const Node& image : images) {
    if (auto camera = Camera::FromMetadata(image.spec())) return camera;
  }
  return std::nullopt;
}

Camera NeededCamera(const std::string& op, const Arguments& arguments, const char* name,
                    std::span<const Node> images) {
  if (auto camera = CameraOf(arguments, name, images)) return *camera;
  throw DataError(
      op, "found no " + std::string(name) + ", expected " + name +
              "= with 16 numbers (world to clip, row by row) or an image with the attributes worldToCamera "
              "and worldToNDC");
}

const std::vector<std::string>& DepthKinds() {
  static const std::vector<std::string> kinds = {"planar", "euclidean", "window", "reversed"};
  return kinds;
}
DepthKind DepthKindNamed(const std::string& name) {
  return static_cast<DepthKind>(std::find(DepthKinds().begin(), DepthKinds().end(), name) -
                                DepthKinds().begin());
}

std::vector<ParamInfo> PlanesModifiers() {
  return {NumberModifier("near", "0.1", 1e-30, 1e30,
                         "near plane of window depths, world units; before that the camera's"),
          NumberModifier("far", "1000", 1e-30, 1e38,
                         "far plane; before that the camera's; 1e38 counts as infinite")};
}
void SetPlanes(const Arguments& arguments, const std::optional<Camera>& camera, DepthParams& params) {
  params.near = arguments.Number("near"), params.far = arguments.Number("far");
  if (params.far >= 1e38) params.far = INFINITY;
  if (!camera) return;
  params.parallel = !camera->perspective();
  const auto planes = camera->ClipPlanes();
  if (planes && !arguments.Given("near")) params.near = planes->near;
  if (planes && !arguments.Given("far")) params.far = planes->far;
}

Vector3 EyeOf(const Arguments& arguments, std::span<const Node> images) {
  if (arguments.Given("eye")) return VectorOf(arguments, "eye");
  const auto camera = CameraOf(arguments, "camera", images);
  return camera ? camera->eye() : Vector3{};
}

Vector3 VectorOf(const Arguments& arguments, const char* name) {
  const std::vector<double>& v = arguments.Numbers(name);
  return {v[0], v[1], v[2]};
}

Node ThreeChannels(const Node& image) {
  if (image.spec().channel_count() >= 3) return image;
  return SelectChannels(image, {{0, 0, "X"}, {0, 0, "Y"}, {0, 0, "Z"}});
}

void RequireAtLeast(const std::string& op, const std::string& what, double value, double low) {
  if (std::isfinite(value) && value >= low) return;
  throw Error(op + " " + what, "found " + base::NumberText(value) +
                                   ", expected a finite number of at least " + base::NumberText(low));
}

void RequireFinite3(const std::string& op, const std::string& what, std::span<const double> values) {
  for (const double v : values) {
    if (!std::isfinite(v))
      throw Error(op + " " + what, "found " + base::NumberText(v) + ", expected finite numbers");
  }
}

}  // namespace tessera::ops
