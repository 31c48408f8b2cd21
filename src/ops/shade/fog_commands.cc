// The commands --fog and --layerfog: which images and numbers they take.
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/number_text.h"
#include "ops/modifiers.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/environment.h"
#include "tessera/ops/lookup.h"

namespace tessera::ops {
namespace {

// color= is a colour, or says where fog's colour comes from.
ParamInfo ColorModifier() {
  ParamInfo param = ChoiceModifier("color", {"image", "map", "height"},
                                   "fog colour r,g,b; or image: one more operand with a colour per pixel; "
                                   "map: one more operand, a latitude-longitude map looked up in the viewing "
                                   "direction; height: by ramp=");
  param.default_value = "0.5,0.5,0.5";
  param.numbers_too = true;
  param.min_count = param.max_count = 3;
  return param;
}
ParamInfo RampModifier() {
  ParamInfo param =
      OnlyWith("color=height", ListModifier("ramp", "", 256, -1e38, 1e38, "y0,r,g,b,y1,r,g,b,…"));
  for (int n = 8; n <= 256; n += 4) param.counts.push_back(n);
  return param;
}
ParamInfo MaskModifier() {
  return FlagModifier(
      "mask", "one more operand on top: its first channel multiplies the density; 0 leaves a pixel alone");
}

bool HasColorImage(const Arguments& a) { return a.Text("color") == "image" || a.Text("color") == "map"; }
int FogOperands(const Arguments& a) { return 2 + (HasColorImage(a) ? 1 : 0) + (a.Flag("mask") ? 1 : 0); }

// Fog's colour by height: a table between the ramp's ends, fine enough for its steps.
Node RampImage(const std::string& op, const Node& position, const std::vector<double>& ramp) {
  constexpr int kSize = 4096;
  const size_t stops = ramp.size() / 4;
  for (size_t k = 1; k < stops; ++k) {
    if (ramp[4 * k] > ramp[4 * k - 4]) continue;
    throw Error(op + ":ramp", "found height " + base::NumberText(ramp[4 * k]) + " after " +
                                  base::NumberText(ramp[4 * k - 4]) + ", expected increasing heights");
  }
  const double low = ramp[0], high = ramp[4 * (stops - 1)];
  std::vector<float> samples;
  size_t k = 0;
  for (int i = 0; i < kSize; ++i) {
    const double y = low + (high - low) * i / (kSize - 1);
    while (k + 2 < stops && y > ramp[4 * (k + 1)]) ++k;
    const double t = std::clamp((y - ramp[4 * k]) / (ramp[4 * (k + 1)] - ramp[4 * k]), 0.0, 1.0);
    for (size_t c = 1; c < 4; ++c) {
      samples.push_back(static_cast<float>((1 - t) * ramp[4 * k + c] + t * ramp[4 * (k + 1) + c]));
    }
  }
  TransformParams axis;
  axis.matrix = {0, 1 / (high - low), 0, -low / (high - low), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  const Table table({kSize}, 3, samples, TableAlign::kEnds);
  return Lookup(TransformPoints(position, axis), table);
}

bool NeedsPositions(const Arguments& a) { return a.Text("color") == "height" || a.Text("color") == "map"; }

// What color= asks for, per pixel; empty for a constant.
Node FogColor(const std::string& op, std::span<const Node> in, const Node& position, const Vector3& eye,
              const Arguments& a) {
  const std::string& text = a.Text("color");
  if (text == "image") return in[2];
  if (text == "height") {
    if (!a.Given("ramp"))
      throw Error(op + ":color", "found height without ramp=, expected ramp=y0,r,g,b,y1,r,g,b,…");
    return RampImage(op, position, a.Numbers("ramp"));
  }
  if (text == "map") {
    TransformParams from_eye;
    for (size_t k = 0; k < 3; ++k) from_eye.matrix[4 * k + 3] = -eye[k];
    EnvironmentParams look;
    look.direction = EnvironmentDirection::kNormal;
    return Environment(TransformPoints(position, from_eye), in[2], look);
  }
  return {};
}
std::array<double, 3> ConstantColor(const Arguments& a) {
  const std::vector<double>& c = a.Numbers("color");
  return c.empty() ? std::array<double, 3>{0, 0, 0} : std::array{c[0], c[1], c[2]};
}
Node MaskOf(std::span<const Node> in, const Arguments& a) { return a.Flag("mask") ? in.back() : Node(); }

// The second operand as positions, or, where they are enough, as distances.
struct FogPlace {
  Node place;
  bool distance = false;
};
FogPlace FogPlaceOf(const std::string& op, std::span<const Node> in, const Arguments& a) {
  const ImageSpec& spec = in[1].spec();
  const std::string& kind = a.Text("depth");
  const std::vector<int> position = FindAov(spec, Aov::kPosition), depth = FindAov(spec, Aov::kDepth);
  const bool is_depth = kind != "auto" || (position.empty() && (!depth.empty() || spec.channel_count() < 3));
  if (!is_depth) return {PositionsOf(in[1]), false};
  const auto camera = CameraOf(a, "camera", in.subspan(1, 1));
  const bool is_enough = op == "fog" && !NeedsPositions(a);
  if (is_enough && (kind == "euclidean" || (kind == "auto" && !camera))) {
    return {SelectChannels(in[1], {{depth.empty() ? 0 : depth[0], 0, "Z"}}), true};
  }
  DepthParams p;
  p.from = kind == "auto" ? DepthKind::kPlanar : DepthKindNamed(kind);
  if (p.from != DepthKind::kPlanar) SetPlanes(a, camera, p);
  p.camera = NeededCamera(op, a, "camera", in.subspan(1, 1));
  return {PositionFromDepth(in[1], p), false};
}

void AddPlaceModifiers(OpInfo& info) {
  ParamInfo eye = NumbersModifier("eye", "", 3, "x,y,z; default the camera's, or the origin");
  ParamInfo depth = ChoiceModifier("depth", {"auto", "planar", "euclidean", "window", "reversed"},
                                   "the second image is a depth of that kind");
  for (ParamInfo& m : std::vector{
           eye,
           CameraModifier("camera", "16 or 32 numbers; default the image's metadata"),
           depth,
       })
    info.modifiers.push_back(std::move(m));
  for (ParamInfo& m : PlanesModifiers())
    info.modifiers.push_back(OnlyWith("depth=window|reversed", std::move(m)));
  for (ParamInfo& m : std::vector{MaskModifier(), RampModifier()}) info.modifiers.push_back(std::move(m));
}

constexpr const char* kCommonHelp =
    "Result = T C + (1 - T) A F for colour C with alpha A (premultiplied; 1 without) and fog colour F; alpha "
    "and further channels stay. The second image has positions (X,Y,Z as its first channels, or a renderer's "
    "position AOV among many), or depths: one channel, or a depth AOV without positions. Planar depths "
    "become distances by camera= (or worldToNDC of the file); depth= says otherwise. eye= is the eye's "
    "position; positions in camera space have it at the origin. color=image, map or height let the colour "
    "vary; mask=1 multiplies the density by an image: coverage (0: background keeps its bits), below 1 for "
    "pixels that emit light. Hard cases: T = 1 keeps bits, T = 0 gives A F; distance 0 is clear, infinite "
    "gives F, negative depths count as 0; NaN passes. ";

}  // namespace

OpInfo FogInfo() {
  OpInfo info;
  info.name = "fog";
  info.family = "shade";
  info.operands = FogOperands;
  info.inputs = 2;
  info.summary = "Fog by distance, from positions or depths";
  info.help = std::string(
                  "COLOR POSITION --fog:density=0.02:color=0.6,0.7,0.8:eye=x,y,z. exp: T = exp(-density d); "
                  "exp2: T = exp(-(density d)^2); linear: T = (end - d) / (end - start) within [0,1] "
                  "(Blender's Mist with linear falloff is 1 - T); transmittance: the second image is T. d is "
                  "the Euclidean distance to the eye.\n") +
              kCommonHelp + "Source: Heidrich et al. 1999, 5.1.";
  info.bound = "4 u * (T |C| + (1 - T) |A F|); T within 2 ULP";
  info.bound_u = 4;
  info.modifiers = {
      OnlyWith("mode=exp|exp2", NumberModifier("density", "0.1", 0, 1e38, "per world unit")), ColorModifier(),
      ChoiceModifier("mode", {"exp", "exp2", "linear", "transmittance"}, "law of transmittance"),
      OnlyWith("mode=linear", NumberModifier("start", "0", -1e38, 1e38, "distance where linear fog begins")),
      OnlyWith("mode=linear", NumberModifier("end", "100", -1e38, 1e38, "distance where it hides all"))};
  AddPlaceModifiers(info);
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    FogParams p;
    const std::string& mode = a.Text("mode");
    p.mode = mode == "exp2"     ? FogMode::kExp2
             : mode == "linear" ? FogMode::kLinear
             : mode == "exp"    ? FogMode::kExp
                                : FogMode::kTransmittance;
    p.density = a.Number("density");
    p.start = a.Number("start"), p.end = a.Number("end");
    p.color = ConstantColor(a);
    p.eye = EyeOf(a, in.subspan(1, 1));
    FogPlace place{in[1], true};
    if (p.mode != FogMode::kTransmittance) place = FogPlaceOf("fog", in, a);
    p.distance = place.distance;
    if (p.mode == FogMode::kTransmittance && NeedsPositions(a)) {
      throw Error("fog:color", "found " + a.Text("color") +
                                   " with mode=transmittance, whose second image has no positions, expected "
                                   "image or r,g,b");
    }
    return Fog(in[0], place.place, p, FogColor("fog", in, place.place, p.eye, a), MaskOf(in, a));
  };
  info.examples = {
      "density=0.7 color=0.5,0.6,0.7 eye=0.1,-0.2,0.3", "density=0.9 mode=exp2 mask=1",
      "mode=linear start=0.25 end=1.5 color=image", "mode=transmittance",
      "density=0.4 color=image mask=1 camera=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,0 depth=planar"};
  info.identity = "density=0";
  return info;
}

OpInfo LayerFogInfo() {
  OpInfo info;
  info.name = "layerfog";
  info.family = "shade";
  info.operands = FogOperands;
  info.inputs = 2;
  info.summary = "Fog whose density depends on height, from positions";
  info.help = std::string(
                  "COLOR POSITION --layerfog:layers=y0,s0,y1,s1,…:eye=x,y,z:color=r,g,b. T = exp(-d m), m "
                  "the mean density between the eye's height and the point's, world y up; exact for every "
                  "profile, at equal heights the density itself. profile=layers: density s_k from height y_k "
                  "(included) up to the next, the last one upwards, none below the first; linear: straight "
                  "between (y_k, s_k), the end values beyond, for any sampled profile; exp: triples y,s,H "
                  "that add up, density s exp(-(h - y) / H). table=N uses the paper's look-up with N entries "
                  "per axis for comparison: form=1d (mean density by height), 2d (T by distance and height), "
                  "3d (and the eye's height), over range=distance,low,high; bits= quantises coordinates and "
                  "entries, as 8- and 12-bit "
                  "framebuffers did.\n") +
              kCommonHelp + "Source: Heidrich et al. 1999, 5.2 (eq. 5 with a signed height).";
  info.bound = "4 u * (T |C| + (1 - T) |A F|); T within 4 ULP (table=0)";
  info.bound_u = 4;
  ParamInfo layers =
      ListModifier("layers", "0,0.1", 8192, -1e38, 1e38, "y,s pairs; with profile=exp y,s,H triples");
  layers.min_count = 2;
  info.modifiers = {
      layers,
      ChoiceModifier("profile", {"layers", "linear", "exp"}, "how density depends on height"),
      ColorModifier(),
      IntegerModifier("table", "0", 0, 4096, "entries per axis of the look-up; 0: exact"),
      OnlyWith("table", ChoiceModifier("form", {"1d", "2d", "3d"}, "axes of the table")),
      OnlyWith("table",
               NumbersModifier("range", "100,0,10", 3, "distance, lowest and highest height of the table")),
      OnlyWith("table", IntegerModifier("bits", "0", 0, 16, "depth of the table's numbers; 0: floats"))};
  AddPlaceModifiers(info);
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    LayerFogParams p;
    const std::vector<double>& v = a.Numbers("layers");
    const std::string& profile = a.Text("profile");
    const size_t stride = profile == "exp" ? 3 : 2;
    if (v.size() % stride != 0) {
      throw Error("layerfog:layers", "found " + std::to_string(v.size()) + " numbers, expected " +
                                         (stride == 3 ? "triples y,s,H" : "pairs y,s"));
    }
    for (size_t k = 0; k < v.size(); k += stride) {
      if (stride == 3) p.exponential.push_back({v[k], v[k + 1], v[k + 2]});
      if (stride == 2) p.layers.push_back({v[k], v[k + 1]});
    }
    p.profile = profile == "exp"      ? FogProfile::kExponential
                : profile == "linear" ? FogProfile::kLinear
                                      : FogProfile::kConstant;
    p.color = ConstantColor(a);
    p.eye = EyeOf(a, in.subspan(1, 1));
    const Node place = FogPlaceOf("layerfog", in, a).place;
    if (a.Integer("table") > 0) {
      if (in.size() > 2 || a.Text("color") == "height") {
        throw Error("layerfog:table",
                    "found a table with a colour per pixel or a mask, expected color=r,g,b and no mask");
      }
      FogTableParams t;
      t.form = a.Text("form") == "1d"   ? FogTable::kMeanOfHeight
               : a.Text("form") == "2d" ? FogTable::kDistanceHeight
                                        : FogTable::kDistanceHeightHeight;
      t.size = a.Integer("table");
      const Vector3 range = VectorOf(a, "range");
      t.distance = range[0], t.low = range[1], t.high = range[2];
      t.bits = a.Integer("bits");
      return LayerFogByTable(in[0], place, p, t);
    }
    return LayerFog(in[0], place, p, FogColor("layerfog", in, place, p.eye, a), MaskOf(in, a));
  };
  info.examples = {"layers=-0.5,0.2,0.1,0.9,0.6,0.3,1.2,0.05 eye=0.1,0.35,-0.2 color=0.5,0.6,0.7",
                   "profile=exp layers=0,0.5,0.4,-1,0.2,3 eye=0,2,0 mask=1",
                   "profile=linear layers=-1,0,0,0.8,0.5,0.1,1,0.6 eye=0,-0.1,0 color=image",
                   "layers=0,0.9,0.5,0 table=64 range=4,-1,2 eye=0,0.6,0"};
  info.identity = "layers=0,0";
  return info;
}

}  // namespace tessera::ops
