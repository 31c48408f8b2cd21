// Pictures of volumes as an operation: windows, stages, supersampling, cameras around a volume.
#include "tessera/ops/volume.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "base/number_text.h"
#include "base/turn.h"
#include "graph/op.h"
#include "ops/volume/prepare.h"
#include "ops/volume/shear_warp.h"
#include "tessera/error.h"
#include "tessera/ops/accumulate.h"

namespace tessera::ops::volume {
namespace {

constexpr char kName[] = "volume";

// One volume, or several: surfaces by themselves, the nearest of which ends the rays of the media.
class DrawStage final : public graph::TileStage {
 public:
  DrawStage(VolumeDrawPointer draw, const graph::Workers& workers)
      : draw_(std::move(draw)), prepared_(1 + draw_->others.size()) {
    const double middle = MiddleDepth(*draw_);
    for (size_t k = 0; k < prepared_.size(); ++k) {
      const VolumeDraw& one = k == 0 ? *draw_ : *draw_->others[k - 1];
      Prepare(one, middle, workers, prepared_[k]);
      const PixelType type = one.volume.spec().type;
      if (IsSurface(one.params.mode)) {
        surfaces_.push_back({FindSurface(type), &prepared_[k].surface});
      } else {
        media_.push_back(&prepared_[k].medium);
        medium_ = FindMedium(type);
      }
    }
    if (media_.size() > 1) mixture_ = FindMixture();
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
    if (surfaces_.empty()) {
      DrawMedia(target);
    } else if (prepared_.size() == 1) {
      surfaces_[0].draw(*surfaces_[0].args, target);
    } else {
      DrawScene(args, target);
    }
  }

 private:
  struct Surface {
    DrawSurface draw;
    const SurfaceArgs* args;
  };

  void DrawMedia(const Target& target) const {
    if (mixture_ != nullptr) {
      mixture_(media_, target);
    } else {
      medium_(*media_[0], target);
    }
  }
  void DrawScene(const graph::TileArgs& args, const Target& target) const {
    const Roi& roi = args.out.roi;
    const auto pixels = static_cast<size_t>(roi.pixels());
    const size_t channels = draw_->params.aovs ? kAovChannels : 5;  // R, G, B, A, Z
    float* const nearest = args.scratch.Allocate<float>(channels * pixels);
    float* const one = args.scratch.Allocate<float>(channels * pixels);
    float* const depth = args.scratch.Allocate<float>(pixels);
    const auto all_channels = [&](float* to) {
      Target t;
      t.out = target.out;
      t.out.data = reinterpret_cast<std::byte*>(to);
      t.out.channels = static_cast<int>(channels);
      t.out.pixel_stride = static_cast<ptrdiff_t>(channels * sizeof(float));
      t.out.row_stride = t.out.pixel_stride * roi.width();
      t.scene = target.scene, t.scene_row = target.scene_row, t.scene_pixel = target.scene_pixel;
      return t;
    };
    for (size_t k = 0; k < surfaces_.size(); ++k) {
      surfaces_[k].draw(*surfaces_[k].args, all_channels(k == 0 ? nearest : one));
      for (size_t i = 0; k > 0 && i < channels * pixels; i += channels) {
        if (one[i + 4] < nearest[i + 4]) std::copy_n(one + i, channels, nearest + i);
      }
    }
    size_t at = 0;
    for (int y = 0; y < roi.height(); ++y) {
      for (int x = 0; x < roi.width(); ++x, ++at) {
        const float scene = target.scene == nullptr
                                ? std::numeric_limits<float>::infinity()
                                : target.scene[y * target.scene_row + x * target.scene_pixel];
        const float z = nearest[channels * at + 4];
        depth[at] = z < scene ? z : scene;
      }
    }
    if (!media_.empty()) {
      Target t = all_channels(one);
      t.scene = depth, t.scene_row = roi.width(), t.scene_pixel = 1;
      DrawMedia(t);
      for (size_t i = 0; i < channels * pixels; i += channels) {
        const float through = 1 - one[i + 3];
        for (size_t c = 0; c < 4; ++c) nearest[i + c] = one[i + c] + through * nearest[i + c];
        if (one[i + 4] < nearest[i + 4]) std::copy_n(one + i + 4, channels - 4, nearest + i + 4);
      }
    }
    const float* from = nearest;
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; ++x, from += channels) {
        auto* const to = reinterpret_cast<float*>(target.out.At(x, y));
        for (int c = 0; c < target.out.channels; ++c) to[c] = from[target.channels ? target.channels[c] : c];
      }
    }
  }

  VolumeDrawPointer draw_;
  std::vector<Prepared> prepared_;
  std::vector<Surface> surfaces_;
  std::vector<const MediumArgs*> media_;
  DrawMedium medium_ = nullptr;
  DrawMixture mixture_ = nullptr;
};

class VolumeOp final : public graph::OpWith<VolumeDrawPointer> {
 public:
  VolumeOp(const ImageSpec& spec, VolumeDrawPointer draw) : OpWith(std::move(draw)), spec_(spec) {}
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

// What would be left out of the picture is refused.
void RequireUsed(const VolumeParams& p, bool scene) {
  const auto refuse = [](const std::string& found, const char* expected) {
    throw Error(kName, "found " + found + ", expected " + expected);
  };
  if (!p.dmf.empty() && IsSurface(p.mode))
    refuse("a chain of density modulation functions beside a surface", "a mode of media or densities");
  if (!p.dmf.empty() && !IsHyper(p.mode) && p.classification != Classification::kPost)
    refuse("a chain of density modulation functions beside another classification", "post");
  if (IsSurface(p.mode) && p.method != VolumeMethod::kRays)
    refuse("a method for media beside a surface", "the method rays");
  const bool lit =
      p.scatter.lit || p.scatter.shadow != 0 || p.scatter.phase != 0 || !p.scatter.lights.empty();
  const bool scatters = p.mode >= VolumeMode::kFire && p.mode <= VolumeMode::kAttenuate;
  if (lit && !scatters)
    refuse("a medium's shadow or phase beside another mode", "fire, hyper, over, under or attenuate");
  const bool glows = p.emission.high != 0;
  if (glows && !scatters) refuse("a black body beside another mode", "fire, hyper, over, under or attenuate");
  if (glows && p.classification != Classification::kPost)
    refuse("a black body beside another classification", "post");
  if (p.method != VolumeMethod::kShearWarp) return;
  if (!p.dmf.empty())
    refuse("a chain of density modulation functions beside the method shearwarp", "another method, or none");
  if (glows) refuse("a black body beside the method shearwarp", "another method, or none");
  if (lit) refuse("a medium's shadow or phase beside the method shearwarp", "another method, or none");
  if (p.mode != VolumeMode::kOver && p.mode != VolumeMode::kUnder)
    refuse("another mode beside the method shearwarp", "over or under");
  if (p.classification != Classification::kPost)
    refuse("another classification beside the method shearwarp", "post");
  if (p.shade) refuse("shading beside the method shearwarp", "another method, or none");
  if (p.depth || p.aovs) refuse("depth beside the method shearwarp", "another method, or none");
  if (!p.planes.empty()) refuse("cutting planes beside the method shearwarp", "another method, or none");
  if (scene) refuse("the depth of a scene beside the method shearwarp", "another method, or none");
}

// `jittered`: the camera is one of several; the picture's is in the metadata given.
Node Make(const ImageSpec& given, std::span<const PlacedVolume> volumes, std::vector<Node> inputs,
          bool jittered = false) {
  if (volumes.empty() || volumes.size() > kMostVolumes) {
    throw Error(kName, "found " + std::to_string(volumes.size()) + " volumes, expected 1 to " +
                           std::to_string(kMostVolumes));
  }
  for (const PlacedVolume& v : volumes) RequireUsed(v.params, !inputs.empty());
  const Camera& camera = volumes[0].params.camera;
  VolumeDraw draw = CompletePlaced(given, volumes[0], camera);
  draw.with_scene = !inputs.empty();
  bool depth = false, aovs = false;
  int media = 0;
  for (const PlacedVolume& v : volumes) {
    depth |= v.params.depth, aovs |= v.params.aovs;
    media += IsSurface(v.params.mode) ? 0 : 1;
  }
  if (aovs && media > 1)
    throw Error(kName, "found aovs of several media, expected one medium among surfaces");
  draw.params.aovs = aovs;
  const auto front_to_back = [](VolumeDraw& d) {
    if (d.params.mode == VolumeMode::kOver) d.params.mode = VolumeMode::kUnder;
  };
  if (volumes.size() > 1) front_to_back(draw);
  if (draw.params.mode == VolumeMode::kOver && (draw.params.depth || aovs)) {
    // Where alpha passes 1/2 is known from the front; the picture stays the one without an end.
    front_to_back(draw);
    draw.params.termination = 0;
  }
  for (const PlacedVolume& v : volumes) {
    if (volumes.size() == 1) break;
    if (v.params.mode > VolumeMode::kUnder || v.params.method != VolumeMethod::kRays) {
      throw Error(kName,
                  "found a mode or method for one volume alone, expected surfaces, hypertexture, over or "
                  "under, and method rays, among several volumes");
    }
    if (&v != &volumes[0]) {
      auto other = std::make_shared<VolumeDraw>(CompletePlaced(given, v, camera));
      front_to_back(*other);
      other->params.aovs = aovs;
      draw.others.push_back(std::move(other));
    }
  }
  ImageSpec spec = given;
  spec.channels = {"R", "G", "B", "A"};
  spec.alpha = 3;
  spec.type = PixelType::kFloat;
  if (!jittered) camera.ToMetadata(spec);
  if (depth || aovs) spec.channels.push_back("Z");
  for (const char* name : {"N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "distance"}) {
    if (aovs) spec.channels.push_back(name);
  }
  auto shared = std::make_shared<const VolumeDraw>(std::move(draw));
  return graph::MakeNode(std::make_shared<const VolumeOp>(spec, std::move(shared)), std::move(inputs));
}

// The mean of pictures whose rays pass at jittered places in the pixel.
Node Jittered(const ImageSpec& spec, std::span<const PlacedVolume> given, int samples,
              const std::vector<Node>& inputs) {
  if (samples <= 1) return Make(spec, given, inputs);
  const Roi& window = spec.display_window.empty() ? spec.data_window : spec.display_window;
  std::vector<PlacedVolume> volumes(given.begin(), given.end());
  const Camera camera = volumes.at(0).params.camera;
  for (PlacedVolume& v : volumes) {
    // Noise is made once for all of them.
    const VolumeParams made = Complete(spec, v.volume, v.params).params;
    v.params.block = made.block, v.params.dmf = made.dmf;
  }
  ImageSpec seen = spec;
  camera.ToMetadata(seen);
  std::vector<Node> pictures;
  for (const JitterPoint& j : JitterSet(samples)) {
    // A sub-pixel shift of the projection: x' = x + dx w in clip space.
    const double dx = -(j.x - 0.5) * 2 / std::max(window.width(), 1),
                 dy = (j.y - 0.5) * 2 / std::max(window.height(), 1);
    Matrix4 shift = kIdentity4;
    shift[3] = dx, shift[7] = dy;
    volumes[0].params.camera = Camera(camera.world_to_camera(), Product(shift, camera.world_to_clip()));
    pictures.push_back(Make(seen, volumes, inputs, true));
  }
  return Average(pictures);
}

}  // namespace
}  // namespace tessera::ops::volume

namespace tessera {

Node RenderVolume(const ImageSpec& spec, const Volume& volume, const VolumeParams& params) {
  const PlacedVolume one[] = {{volume, params}};
  return ops::volume::Make(spec, one, {});
}

Node RenderVolume(const ImageSpec& spec, const Volume& volume, const VolumeParams& params,
                  const Node& scene_depth) {
  const PlacedVolume one[] = {{volume, params}};
  return ops::volume::Make(spec, one, {scene_depth});
}

Node RenderVolumeSupersampled(const ImageSpec& spec, const Volume& volume, const VolumeParams& params,
                              int samples) {
  const PlacedVolume one[] = {{volume, params}};
  return ops::volume::Jittered(spec, one, samples, {});
}

Node RenderVolumes(const ImageSpec& spec, std::span<const PlacedVolume> volumes, int samples) {
  return ops::volume::Jittered(spec, volumes, samples, {});
}

Node RenderVolumes(const ImageSpec& spec, std::span<const PlacedVolume> volumes, const Node& scene_depth) {
  return ops::volume::Make(spec, volumes, {scene_depth});
}

Node RenderVolumes(const ImageSpec& spec, std::span<const PlacedVolume> volumes, const Node& scene_depth,
                   int samples) {
  return ops::volume::Jittered(spec, volumes, samples, {scene_depth});
}

Node AddVolume(const Node& picture, const PlacedVolume& volume, int samples) {
  const auto* const op = picture.data() == nullptr
                             ? nullptr
                             : dynamic_cast<const ops::volume::VolumeOp*>(picture.data()->op.get());
  if (op == nullptr) {
    throw Error("volume", "found an image, expected a picture of volumes to which one is added");
  }
  const ops::volume::VolumeDraw& first = *op->params();
  std::vector<PlacedVolume> all = {first.placed};
  for (const auto& other : first.others) all.push_back(other->placed);
  all.push_back(volume);
  return ops::volume::Jittered(picture.spec(), all, samples, picture.data()->inputs);
}

Camera OrbitCamera(const Volume& volume, double azimuth, double elevation, double field_of_view,
                   double aspect, double zoom) {
  if (!(zoom > 0))
    throw Error("camera", "found zoom " + base::NumberText(zoom) + ", expected a positive number");
  const VolumeSpec& v = volume.spec();
  const Vector3 low = v.Low(), high = v.High();
  Vector3 centre, half;
  for (size_t a = 0; a < 3; ++a) centre[a] = 0.5 * (low[a] + high[a]), half[a] = 0.5 * (high[a] - low[a]);
  const double radius = std::sqrt(Dot(half, half));
  const base::Turn az = base::TurnOf(azimuth), el = base::TurnOf(elevation);
  const Vector3 to_eye = {az.sine * el.cosine, el.sine, az.cosine * el.cosine};
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
