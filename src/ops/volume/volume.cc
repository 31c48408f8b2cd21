// Pictures of volumes as an operation: windows, stages, supersampling, cameras around a volume.
#include "tessera/ops/volume.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/volume/prepare.h"
#include "ops/volume/shear_warp.h"
#include "tessera/error.h"
#include "tessera/ops/accumulate.h"

namespace tessera::ops::volume {
namespace {

constexpr char kName[] = "volume";

class DrawStage final : public graph::TileStage {
 public:
  DrawStage(base::VolumeDrawPointer draw, const graph::Workers& workers) : draw_(std::move(draw)) {
    Prepare(*draw_, workers, prepared_);
    const PixelType type = draw_->volume.spec().type;
    if (IsSurface(draw_->params.mode)) {
      surface_ = FindSurface(type);
    } else {
      medium_ = FindMedium(type);
    }
  }
  Roi InputRoi(int, const Roi& out) const override { return out; }
  graph::TileSize Preferred() const override { return {64, 64}; }
  void Run(const graph::TileArgs& args) const override {
    Target target;
    target.out = args.out;
    target.channels = args.channels.empty() ? nullptr : args.channels.data();
    target.rgba = args.out.channels == 4;
    for (size_t c = 0; c < args.channels.size(); ++c) target.rgba &= args.channels[c] == static_cast<int>(c);
    if (draw_->with_scene) {
      const ConstImageView& scene = args.in[0];
      target.scene = reinterpret_cast<const float*>(scene.At(args.out.roi.x0, args.out.roi.y0));
      target.scene_row = scene.row_stride / static_cast<ptrdiff_t>(sizeof(float));
      target.scene_pixel = scene.pixel_stride / static_cast<ptrdiff_t>(sizeof(float));
    }
    if (surface_ != nullptr) {
      surface_(prepared_.surface, target);
    } else {
      medium_(prepared_.medium, target);
    }
  }

 private:
  base::VolumeDrawPointer draw_;
  Prepared prepared_;
  DrawSurface surface_ = nullptr;
  DrawMedium medium_ = nullptr;
};

class VolumeOp final : public graph::OpWith<base::VolumeDrawPointer> {
 public:
  VolumeOp(const ImageSpec& spec, base::VolumeDrawPointer draw) : OpWith(std::move(draw)), spec_(spec) {}
  std::string Name() const override { return kName; }
  graph::OpKind Kind() const override {
    return params()->params.method == VolumeMethod::kShearWarp ? graph::OpKind::kWhole : graph::OpKind::kTile;
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    if (!inputs.empty()) {
      const ImageSpec all[] = {spec_, inputs[0]};
      graph::RequireSameWindow(kName, all);
    }
    return spec_;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), false);
    needed[0] = true;
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<DrawStage>(params(), context.workers);
  }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext& context) const override {
    return MakeShearWarp(params(), context);
  }

 private:
  ImageSpec spec_;
};

Node Make(const ImageSpec& given, const Volume& volume, const VolumeParams& params,
          std::vector<Node> inputs) {
  base::VolumeDraw draw = Complete(given, volume, params);
  draw.with_scene = !inputs.empty();
  ImageSpec spec = given;
  spec.channels = {"R", "G", "B", "A"};
  spec.alpha = 3;
  spec.type = PixelType::kFloat;
  if (params.depth) spec.channels.push_back("Z");
  auto shared = std::make_shared<const base::VolumeDraw>(std::move(draw));
  return graph::MakeNode(std::make_shared<const VolumeOp>(spec, std::move(shared)), std::move(inputs));
}

}  // namespace
}  // namespace tessera::ops::volume

namespace tessera {

Node RenderVolume(const ImageSpec& spec, const Volume& volume, const VolumeParams& params) {
  return ops::volume::Make(spec, volume, params, {});
}

Node RenderVolume(const ImageSpec& spec, const Volume& volume, const VolumeParams& params,
                  const Node& scene_depth) {
  return ops::volume::Make(spec, volume, params, {scene_depth});
}

Node RenderVolumeSupersampled(const ImageSpec& spec, const Volume& volume, const VolumeParams& params,
                              int samples) {
  const Roi& window = spec.display_window.empty() ? spec.data_window : spec.display_window;
  std::vector<Node> pictures;
  // Noise is made once for all of them.
  VolumeParams shared = ops::volume::Complete(spec, volume, params).params;
  for (const JitterPoint& j : JitterSet(samples)) {
    // A sub-pixel shift of the projection: x' = x + dx w in clip space.
    const double dx = -(j.x - 0.5) * 2 / std::max(window.width(), 1),
                 dy = (j.y - 0.5) * 2 / std::max(window.height(), 1);
    Matrix4 shift = kIdentity4;
    shift[3] = dx, shift[7] = dy;
    const Camera& camera = params.camera;
    shared.camera = Camera(camera.world_to_camera(), Product(shift, camera.world_to_clip()));
    pictures.push_back(RenderVolume(spec, volume, shared));
  }
  return Average(pictures);
}

Camera OrbitCamera(const Volume& volume, double azimuth, double elevation, double field_of_view,
                   double aspect, double zoom) {
  if (!(zoom > 0))
    throw Error("camera", "found zoom " + std::to_string(zoom) + ", expected a positive number");
  const VolumeSpec& v = volume.spec();
  const Vector3 low = v.Low(), high = v.High();
  Vector3 centre, half;
  for (size_t a = 0; a < 3; ++a) centre[a] = 0.5 * (low[a] + high[a]), half[a] = 0.5 * (high[a] - low[a]);
  const double radius = std::sqrt(Dot(half, half));
  const double az = azimuth * std::numbers::pi / 180, el = elevation * std::numbers::pi / 180;
  const Vector3 to_eye = {std::sin(az) * std::cos(el), std::sin(el), std::cos(az) * std::cos(el)};
  const Vector3 up = std::fabs(to_eye[1]) > 0.999 ? Vector3{0, 0, -1} : Vector3{0, 1, 0};
  const double narrow = std::min(aspect, 1.0);
  if (field_of_view <= 0) {
    const double away = 2 * radius;
    const Vector3 eye = {centre[0] + away * to_eye[0], centre[1] + away * to_eye[1],
                         centre[2] + away * to_eye[2]};
    return Camera::Parallel(eye, centre, up, 2 * radius / zoom / narrow, aspect, 0.1 * radius, 4 * radius);
  }
  const double angle = field_of_view * std::numbers::pi / 360;
  const double away = radius / std::sin(std::atan(std::tan(angle) * narrow)) / zoom;
  const Vector3 eye = {centre[0] + away * to_eye[0], centre[1] + away * to_eye[1],
                       centre[2] + away * to_eye[2]};
  return Camera::Perspective(eye, centre, up, field_of_view, aspect, 0.01 * away, away + 2 * radius);
}

}  // namespace tessera
