// Environment lookups: what is validated, prepared once, and done for every row.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "graph/op.h"
#include "ops/environment/environment_ops.h"
#include "ops/environment/lobe.h"
#include "ops/environment/lookup.h"
#include "ops/environment/prepared.h"
#include "ops/environment/settings.h"
#include "ops/modifiers.h"
#include "tessera/error.h"

namespace tessera::ops {
namespace {

ReflectionSetup SetupOf(const EnvironmentParams& p, const Roi& display, bool positions) {
  ReflectionSetup s;
  s.direction = p.direction;
  s.fresnel = p.fresnel.has_value();
  s.reflectance = p.fresnel.value_or(1);
  s.codes = p.bits > 0 ? std::ldexp(1.0, p.bits) - 1 : 0;
  double largest = 0;
  for (size_t i = 0; i < 9; ++i) {
    s.matrix[i] = p.matrix[i / 3 * 4 + i % 3];
    largest = std::max(largest, std::fabs(s.matrix[i]));
  }
  // Directions have any length: keeping them in range costs nothing, and leaves rotations alone.
  if (largest > 0x1p20 || largest < 0x1p-20) {
    for (double& m : s.matrix) m /= largest;
  }
  for (size_t i = 0; i < 9; ++i) {
    const double* const a = s.matrix + i / 3 * 3;
    const double* const b = s.matrix + i % 3 * 3;
    s.rigid = s.rigid && std::fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] - (i % 4 == 0 ? 1 : 0)) < 1e-3;
  }
  const auto set = [&s](const Vector3& base) { std::copy_n(base.begin(), 3, s.base); };
  const bool ray = p.camera && !p.camera->perspective();
  if (positions && !ray) {
    s.use_position = 1;
    const Vector3& eye = p.eye ? *p.eye : p.camera->eye();
    set({-eye[0], -eye[1], -eye[2]});
  } else if (p.camera) {
    // A ray's direction is affine in the pixel's place.
    const Vector3 at = p.camera->PixelRay(display, -0.5, -0.5).direction;
    const Vector3 right = p.camera->PixelRay(display, 0.5, -0.5).direction;
    const Vector3 down = p.camera->PixelRay(display, -0.5, 0.5).direction;
    set(at);
    for (size_t k = 0; k < 3; ++k) s.column[k] = right[k] - at[k], s.row[k] = down[k] - at[k];
  } else {
    set({-p.view[0], -p.view[1], -p.view[2]});
  }
  return s;
}

class EnvironmentStage final : public graph::TileStage {
 public:
  EnvironmentStage(const EnvironmentParams& p, bool positions, std::shared_ptr<const PreparedEnvironment> map,
                   const graph::StageContext& context)
      : positions_(positions),
        map_(std::move(map)),
        exponent_(p.lobe),
        alpha_(context.output.alpha),
        map_channels_(context.output.channel_count()),
        setup_(SetupOf(p, context.output.display_window, positions_)),
        reflect_kernels_(ChooseReflectKernels()),
        kernels_(ChooseEnvironmentKernels()),
        mip_kernels_(ChooseMipKernels()),
        lobe_(ChooseLobe()) {}
  Roi InputRoi(int, const Roi& out) const override { return Inflate(out, reach(), reach()); }
  // Normals of 0: no neighbours.
  graph::Border InputBorder(int) const override { return graph::Border::kBlack; }
  graph::TileSize Preferred() const override { return {512, 8}; }

  void Run(const graph::TileArgs& args) const override {
    const Roi& roi = args.out.roi;
    if (map_->empty) {
      for (int y = roi.y0; y < roi.y1; ++y) {
        std::fill_n(reinterpret_cast<float*>(args.out.At(roi.x0, y)),
                    ptrdiff_t{roi.width()} * args.out.channels, 0.0f);
      }
      return;
    }
    const Inputs inputs(args, positions_ ? 2 : 1);
    if (!map_->mips.empty()) return RunFiltered(args, inputs);
    ReflectionRun run;
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; x += kDirectionRun) {
        const int count = std::min(kDirectionRun, roi.x1 - x);
        Reflect(args, inputs, x, y, count, run);
        Shade(args, x, y, count, run, nullptr, nullptr);
      }
    }
  }

 private:
  // Where the vectors' three channels are.
  struct Inputs {
    Inputs(const graph::TileArgs& args, size_t count) {
      for (size_t k = 0; k < count; ++k) {
        const std::span<const int> held = args.in_channels[k];
        for (int c = 0; c < 3; ++c) {
          at[k][c] = static_cast<int>(std::find(held.begin(), held.end(), c) - held.begin());
        }
      }
    }
    int at[2][3] = {};
  };

  int reach() const { return map_->mips.empty() ? 0 : 1; }
  void Reflect(const graph::TileArgs& args, const Inputs& inputs, int x, int y, int count,
               ReflectionRun& run) const {
    const auto planes = [&](size_t k, float(*plane)[kDirectionRun]) {
      reflect_kernels_.planes(reinterpret_cast<const float*>(args.in[k].At(x, y)), args.in[k].channels,
                              inputs.at[k], count, plane);
    };
    planes(0, run.normal);
    if (positions_) planes(1, run.position);
    reflect_kernels_.reflect(setup_, x, y, count, run);
  }
  // Columns of as many pixels as a run has with its neighbours, three rows at a time.
  void RunFiltered(const graph::TileArgs& args, const Inputs& inputs) const {
    const Roi& roi = args.out.roi;
    ReflectionRun runs[3];
    MirrorRow rows[3];
    alignas(64) double level[kDirectionRun];
    for (int x = roi.x0; x < roi.x1; x += kMirrorPixels) {
      const int count = std::min(kMirrorPixels, roi.x1 - x);
      for (int y = roi.y0 - 1; y <= roi.y1; ++y) {
        const auto of = [](int row) { return ((row % 3) + 3) % 3; };
        ReflectionRun& run = runs[of(y)];
        std::fill_n(run.valid, kDirectionRun, 0.0f);
        Reflect(args, inputs, x - 1, y, count + 2, run);
        for (int i = count + 2; i < kDirectionRun; ++i) {
          run.directions.x[i] = run.directions.y[i] = 0, run.directions.z[i] = 1, run.valid[i] = 0;
        }
        mip_kernels_.normalize(run, rows[of(y)]);
        if (y <= roi.y0) continue;
        // The row before, whose neighbours are known by now, without the pixel on its left.
        ReflectionRun& middle = runs[of(y - 1)];
        const MirrorRow& row = rows[of(y - 1)];
        mip_kernels_.levels(*map_->mips[0], rows[of(y - 2)], row, rows[of(y)], count, level);
        std::copy_n(row.x + 1, kDirectionRun - 1, middle.directions.x);
        std::copy_n(row.y + 1, kDirectionRun - 1, middle.directions.y);
        std::copy_n(row.z + 1, kDirectionRun - 1, middle.directions.z);
        std::copy_n(middle.valid + 1, kDirectionRun - 1, middle.valid);
        std::copy_n(middle.fresnel + 1, kDirectionRun - 1, middle.fresnel);
        middle.directions.moderate = true;
        Shade(args, x, y - 1, count, middle, &row, level);
      }
    }
  }
  // All channels of a run.
  void Shade(const graph::TileArgs& args, int x, int y, int count, const ReflectionRun& run,
             const MirrorRow* row, const double* level) const {
    const int channels = args.out.channels;
    auto* const out = reinterpret_cast<float*>(args.out.At(x, y));
    bool direct = channels == 4 && map_channels_ == 4;
    for (int c = 0; c < channels; ++c) direct = direct && args.channels[static_cast<size_t>(c)] == c;
    alignas(64) float buffer[4 * kDirectionRun];
    for (int g = 0; g < (map_channels_ + 3) / 4; ++g) {
      float* const rgba = direct ? out : buffer;
      LookUp(g, run, count, row, level, rgba);
      for (int c = 0; c < channels && !direct; ++c) {
        const int channel = args.channels[static_cast<size_t>(c)];
        if (channel / 4 != g) continue;
        for (int i = 0; i < count; ++i) out[ptrdiff_t{i} * channels + c] = buffer[4 * i + channel % 4];
      }
    }
  }
  // Four channels of a run.
  void LookUp(int group, const ReflectionRun& run, int count, const MirrorRow* row, const double* level,
              float* rgba) const {
    const Directions& d = run.directions;
    if (!map_->samples.empty()) {
      lobe_(*map_->samples[static_cast<size_t>(group)], exponent_, false, d.x, d.y, d.z, count, rgba);
    } else {
      // Where all is seen from afar, the map itself is not.
      if (row == nullptr || *std::min_element(level, level + count) < 1) {
        kernels_.lookup(*map_->atlases[static_cast<size_t>(group)], d, count, rgba);
      }
      if (row != nullptr) mip_kernels_.mix(*map_->mips[static_cast<size_t>(group)], *row, level, count, rgba);
    }
    if (setup_.fresnel) {
      for (int i = 0; i < count; ++i) {
        for (int c = 0; c < 4; ++c) rgba[4 * i + c] *= 4 * group + c == alpha_ ? 1 : run.fresnel[i];
      }
    }
    if (run.all_valid) return;
    for (int i = 0; i < count; ++i) {
      if (run.valid[i] == 0) std::fill_n(rgba + 4 * i, 4, 0.0f);
    }
  }

  bool positions_;
  std::shared_ptr<const PreparedEnvironment> map_;
  double exponent_;
  int alpha_, map_channels_;
  ReflectionSetup setup_;
  ReflectKernels reflect_kernels_;
  EnvironmentKernels kernels_;
  MipKernels mip_kernels_;
  LobeFunction lobe_;
};

class EnvironmentOp final : public graph::OpWith<ops::EnvironmentSettings> {
 public:
  EnvironmentOp(ops::EnvironmentSettings settings, bool positions, EnvironmentTexture texture)
      : OpWith(std::move(settings)), positions_(positions), texture_(std::move(texture)) {}
  EnvironmentOp(ops::EnvironmentSettings settings, bool positions)
      : OpWith(std::move(settings)), positions_(positions) {}
  std::string Name() const override { return "envmap"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const ImageSpec& map = params().FromInput() ? inputs.back() : params().picture.spec();
    const size_t pixels = positions_ ? 2 : 1;
    for (size_t k = 0; k < pixels; ++k) graph::RequireColor("envmap", inputs[k]);
    graph::RequireSameWindow("envmap", inputs.first(pixels));
    LayoutOf("envmap", params().params.map, map.width(), map.height());
    ImageSpec spec = inputs[0];
    spec.channels = map.channels;
    spec.alpha = map.alpha;
    spec.type = map.type;
    return spec;
  }
  bool NeedsWhole(int k) const override { return k > (positions_ ? 1 : 0); }
  std::vector<bool> NeededChannels(int k, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), NeedsWhole(k));
    if (!NeedsWhole(k)) std::fill_n(needed.begin(), 3, true);
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const EnvironmentParams& p = params().params;
    auto map = texture_ ? texture_->data()->Prepared(context.workers)
                        : std::make_shared<const PreparedEnvironment>(context.whole.back(), p, false,
                                                                      context.workers);
    return std::make_unique<EnvironmentStage>(p, positions_, std::move(map), context);
  }

 private:
  bool positions_;
  std::optional<EnvironmentTexture> texture_;
};

void Check(const EnvironmentParams& p, bool positions) {
  RequireVector("envmap", "view", p.view, true);
  if (p.eye) RequireVector("envmap", "eye", *p.eye, false);
  if (positions && !p.eye && !p.camera) {
    throw Error("envmap", "found positions without an eye, expected eye=x,y,z or a camera");
  }
  const Matrix4& m = p.matrix;
  Inverse({m[0], m[1], m[2], 0, m[4], m[5], m[6], 0, m[8], m[9], m[10], 0, 0, 0, 0, 1}, "envmap matrix");
  if (!(p.lobe >= 0 && p.lobe <= 10000)) {
    throw Error("envmap", "found gloss=" + std::to_string(p.lobe) + ", expected 0 (a mirror) to 10000");
  }
  if (p.lobe > 0 && p.lobe < 1e-3)
    throw Error("envmap", "found gloss below 0.001, expected 0 or more than that");
  if (p.table < -1 || p.table > 4096) {
    throw Error("envmap",
                "found table=" + std::to_string(p.table) + ", expected -1 (exact), 0 (chosen) or up to 4096");
  }
  if (p.lobe > 0 && p.filter == EnvironmentFilter::kMip) {
    throw Error("envmap", "found filter=mip with gloss, expected a mirror: a lobe is an average already");
  }
  if (p.fresnel && !(*p.fresnel >= 0 && *p.fresnel <= 1)) {
    throw Error("envmap", "found fresnel=" + std::to_string(*p.fresnel) + ", expected 0 to 1");
  }
  if (p.bits < 0 || p.bits > 24) {
    throw Error("envmap", "found bits=" + std::to_string(p.bits) + ", expected 0 (none) to 24");
  }
}

// The texture's own map and lobe in the place of the parameters'.
ops::EnvironmentSettings SettingsOf(const EnvironmentTexture& texture, EnvironmentParams p, bool positions) {
  const EnvironmentTexture::Data& data = *texture.data();
  p.map = data.params.map, p.lobe = data.params.lobe, p.table = data.params.table,
  p.filter = data.params.filter;
  Check(p, positions);
  return {p, data.picture};
}

Node MakeEnvironment(std::span<const Node> in, const Arguments& a, const ImageSpec*) {
  EnvironmentParams p;
  p.map = MapNamed(a.Text("map"));
  if (a.Given("matrix")) p.matrix = MatrixOf(a.Numbers("matrix"));
  if (a.Given("view")) p.view = VectorOf(a.Numbers("view"));
  if (a.Given("eye")) p.eye = VectorOf(a.Numbers("eye"));
  p.lobe = a.Number("gloss");
  if (a.Text("along") == "normal" || a.Flag("diffuse")) p.direction = EnvironmentDirection::kNormal;
  if (a.Flag("diffuse") && !a.Given("gloss")) p.lobe = 1;
  p.table = a.Integer("table");
  if (a.Text("filter") == "mip") p.filter = EnvironmentFilter::kMip;
  p.bits = a.Integer("bits");
  if (a.Given("fresnel")) p.fresnel = a.Number("fresnel");
  if (a.Text("camera") == "metadata") {
    for (size_t k = 0; k + 1 < in.size() && !p.camera; ++k) p.camera = Camera::FromMetadata(in[k].spec());
    if (!p.camera)
      throw Error("envmap:camera", "found no worldToNDC in the metadata, expected 16 or 32 numbers");
  } else if (a.Given("camera")) {
    p.camera = Camera::FromNumbers(a.Numbers("camera"), "envmap:camera");
  }
  if (in.size() == 3) {
    if (!p.camera && !p.eye) p.camera = Camera::FromMetadata(in[1].spec());
    return Environment(in[0], in[1], in[2], p);
  }
  return Environment(in[0], in[1], p);
}

}  // namespace

OpInfo EnvironmentInfo() {
  OpInfo info;
  info.name = "envmap";
  info.family = "environment";
  info.inputs = 2;
  info.operands = [](const Arguments& a) { return a.Flag("position") ? 3 : 2; };
  info.summary = "Reflection of an environment map in surfaces with given normals";
  info.help =
      "NORMAL MAP --envmap looks the map up in the direction of reflection u - 2 (n.u) n of every normal "
      "(first three "
      "channels, any length); u points from the eye to the surface: against view= (default +z, an "
      "orthographic "
      "viewer), along the rays of camera=, or, as NORMAL POSITION MAP --envmap:position=1, from eye= (or the "
      "camera, "
      "or the one in the positions' metadata) to each position. matrix= turns directions from the normals' "
      "space into "
      "the map's. along=normal looks up the normal itself.\n"
      "map=latlong: +z in the middle, +x a quarter to its left, y up; sphere: a mirrored ball seen from +z; "
      "parabolic: "
      "(x,y)/(1+z), nothing behind; dualparabolic: front and back side by side; cube: OpenGL's faces as a "
      "6:1 or 1:6 "
      "strip (+x -x +y -y +z -z) or a 4:3 or 3:4 cross. Lookups are linear and continuous over seams and "
      "poles.\n"
      "gloss=E averages the map with the weights max(d.w,0)^E of a Phong lobe (white stays white); diffuse=1 "
      "is the "
      "lobe 1 about the normal: irradiance over pi. Lobes are tabulated as a cube map of table=N texels an "
      "edge (0: "
      "by the exponent; -1: summed exactly for every pixel, slow). fresnel=F0 multiplies the colour by F0 + "
      "(1-F0)"
      "(1-|n.v|)^5. filter=mip shows, in a mirror, an average as wide as the angle to the directions looked up "
      "by the neighbouring pixels, between the map and a chain of cube maps, each of half the edge: what is "
      "seen from afar is calm. bits=8 or 12 first stores the normals as the papers' framebuffers did.\n"
      "The result has the map's channels; normals (or positions) that are 0, NaN or infinite give 0, so that "
      "adding the result to a picture leaves its background alone. Source: spec/environment.md.";
  info.bound =
      "8 u times the largest texel (lat-long: times 1 + w/8 + h/3, which is where the texel is looked up); a "
      "lobe's table 1 % of the map's contrast; filter=mip twice that of the map's largest texel";
  info.bound_u = 8;
  ParamInfo camera =
      NumbersModifier("camera", {16, 32}, "world to clip, or world to camera and to clip; or metadata");
  camera.type = ParamType::kChoice;
  camera.choices = {"metadata"};
  camera.numbers_too = true;
  info.modifiers = {
      MapChoice("map", "latlong", "projection of the map"),
      NumbersModifier("matrix", {9, 16}, "from the normals' space to the map's, row-major"),
      NumberModifier("gloss", "0", 0, 10000, "exponent of the lobe; 0: a mirror"),
      FlagModifier("diffuse", "irradiance over pi: gloss=1:along=normal"),
      {.name = "along",
       .type = ParamType::kChoice,
       .default_value = "reflection",
       .help = "what is looked up",
       .choices = {"reflection", "normal"}},
      FlagModifier("position", "positions are given, below the map"),
      NumbersModifier("view", {3}, "to a distant viewer"),
      NumbersModifier("eye", {3}, "the viewer's place, with positions"),
      camera,
      NumberModifier("fresnel", "1", 0, 1, "reflectance at normal incidence"),
      IntegerModifier("table", "0", -1, 4096, "texels along an edge of a lobe's table"),
      ChoiceModifier("filter", {"bilinear", "mip"},
                     "of a mirror: four texels, or as wide as a pixel's reflection"),
      IntegerModifier("bits", "0", 0, 24, "of the framebuffer that holds the normals; 0: none")};
  info.make = MakeEnvironment;
  info.examples = {"",
                   "map=sphere matrix=0,0,1,0,1,0,-1,0,0",
                   "map=dualparabolic fresnel=0.04",
                   "map=parabolic along=normal",
                   "position=1 eye=0.5,3,-2",
                   "gloss=20 table=-1",
                   "diffuse=1 table=-1 map=sphere",
                   "filter=mip map=sphere fresnel=0.1",
                   "camera=1,0,0,0,0,1,0,0,0,0,-1,0,0,0,-1,0 view=0,0,1"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Environment(const Node& normals, const Node& map, const EnvironmentParams& params) {
  ops::Check(params, false);
  return graph::MakeNode(
      std::make_shared<const ops::EnvironmentOp>(ops::EnvironmentSettings{params, {}}, false),
      {normals, map});
}

Node Environment(const Node& normals, const Node& positions, const Node& map,
                 const EnvironmentParams& params) {
  ops::Check(params, true);
  return graph::MakeNode(
      std::make_shared<const ops::EnvironmentOp>(ops::EnvironmentSettings{params, {}}, true),
      {normals, positions, map});
}

Node Environment(const Node& normals, const EnvironmentTexture& texture, const EnvironmentParams& params) {
  const ops::EnvironmentSettings settings = ops::SettingsOf(texture, params, false);
  return graph::MakeNode(std::make_shared<const ops::EnvironmentOp>(settings, false, texture), {normals});
}

Node Environment(const Node& normals, const Node& positions, const EnvironmentTexture& texture,
                 const EnvironmentParams& params) {
  const ops::EnvironmentSettings settings = ops::SettingsOf(texture, params, true);
  return graph::MakeNode(std::make_shared<const ops::EnvironmentOp>(settings, true, texture),
                         {normals, positions});
}

}  // namespace tessera
