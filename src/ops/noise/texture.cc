// Procedural textures: rows of noise turned into colours.
#include "tessera/ops/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/modifiers.h"
#include "ops/noise/field.h"
#include "ops/noise/gardner.h"
#include "ops/noise/noise_ops.h"
#include "ops/noise/texture_shade.h"

namespace tessera::ops {
namespace {

const char* TextureName(TextureKind kind) {
  constexpr const char* kNames[] = {"clouds", "marble", "wood", "fire", "smoke", "ripples", "gardner"};
  return kNames[static_cast<int>(kind)];
}

// The noise that a texture is made of. Time is a third coordinate; what rises is sampled lower down.
std::vector<NoiseParams> FieldsOf(const TextureParams& p) {
  NoiseParams base;
  base.dims = 3;
  base.octaves = p.octaves;
  base.antialias = true;
  const auto field = [&](uint32_t index, double frequency, double aspect, double rise, double change,
                         int octaves) {
    NoiseParams n = base;
    n.seed = OctaveSeed(p.seed, 2000 + static_cast<int>(index), 0);
    n.frequency = frequency;
    n.aspect = aspect;
    n.octaves = octaves;
    n.offset = {0, rise * p.time, 0.37 + change * p.time, 0};
    return n;
  };
  const double f = p.frequency;
  switch (p.kind) {
    case TextureKind::kClouds: {
      // The same noise twice, the second time without its finest octaves and nearer to the sun, which is at
      // the upper left.
      std::vector<NoiseParams> fields = {field(0, f, 1, 0, 0.12, p.octaves),
                                         field(0, f, 1, 0, 0.12, std::min(p.octaves, 5))};
      for (NoiseParams& n : fields) {
        n.offset[0] = -0.25 * p.time;
        n.gain = 0.55;
      }
      fields[1].offset[0] -= 0.09;
      fields[1].offset[1] -= 0.12;
      return fields;
    }
    case TextureKind::kMarble: {
      NoiseParams n = field(0, f, 1, 0, 0.15, p.octaves);
      n.sum = NoiseSum::kTurbulence;
      return {n};
    }
    case TextureKind::kWood:
      return {field(0, 1.1 * f, 0.22, 0, 0.1, std::min(p.octaves, 4)),
              field(1, 30 * f, 0.04, 0, 0.1, std::min(p.octaves, 3))};
    case TextureKind::kFire: {
      std::vector<NoiseParams> fields = {
          field(0, f, 1.7, 1.1 * p.rise, 0.45, p.octaves),
          field(1, 1.7 * f, 1.9, 2.2 * p.rise, 0.8, p.layers > 1 ? std::max(p.octaves - 1, 0) : 0),
          field(2, 3.5 * f, 2, 4.7 * p.rise, 1.4, p.layers > 2 ? std::max(p.octaves - 2, 0) : 0)};
      for (NoiseParams& n : fields) n.offset[0] = -p.wind * p.time * n.frequency * n.aspect;
      return fields;
    }
    case TextureKind::kSmoke:
      return {field(0, 0.45 * f, 1e-3, 0.35, 0.2, std::min(p.octaves, 2)),
              field(1, 1.6 * f, 1, 0.9, 0.3, p.octaves),
              field(2, 4 * f, 1, 2.2, 0.6, std::min(p.octaves, 5))};
    default:
      return {};
  }
}

class TextureStage final : public graph::TileStage {
 public:
  TextureStage(const TextureParams& p, const ImageSpec& spec)
      : params_(p), spec_(spec), kernels_(FindNoiseKernels()), gardner_(GardnerOf(p), spec.data_window) {
    for (const NoiseParams& n : p.fields) fields_.emplace_back(n, spec.data_window, 0);
  }
  Roi InputRoi(int, const Roi& out) const override { return out; }
  graph::TileSize Preferred() const override { return {spec_.width(), 32}; }

  void Run(const graph::TileArgs& args) const override {
    const Roi& r = args.out.roi;
    if (r.empty()) return;
    const auto width = static_cast<size_t>(r.width());
    const auto row = [&] { return args.scratch.Allocate<float>(width + kNoisePadding); };
    base::ArenaVector<GridCursor> cursors(args.scratch);
    base::ArenaVector<float*> noise(args.scratch), planes(args.scratch);
    std::array<float*, 4> colors;
    for (const GridField& field : fields_) {
      cursors.emplace_back(field, r.x0, r.x1, args.scratch);
      noise.push_back(row());
    }
    for (float*& color : colors) color = row();
    float* const gardner = row();
    float* const zeros = row();
    float* const ones = row();
    std::fill_n(zeros, width, 0.0f);
    std::fill_n(ones, width, 1.0f);
    for (int c : args.channels) planes.push_back(PlaneOf(c, colors, zeros, ones));
    const double frame_width = std::max(params_.frame.width(), 1);
    const float inverse_width = 1.0f / static_cast<float>(std::max(params_.frame.width(), 1));
    const float inverse_height = 1.0f / static_cast<float>(std::max(params_.frame.height(), 1));
    for (int y = r.y0; y < r.y1; ++y) {
      for (size_t k = 0; k < cursors.size(); ++k) cursors[k].Row(y, noise[k]);
      if (UsesGardner()) gardner_.Row(y, r.x0, r.x1, gardner);
      const float down = static_cast<float>(y - params_.frame.y0) + 0.5f;
      TexturePlace place{0, down * inverse_width, 1 - down * inverse_height, 0, down / frame_width};
      for (size_t x = 0; x < width; ++x) {
        const float across = static_cast<float>(r.x0 + static_cast<int>(x) - params_.frame.x0) + 0.5f;
        place.s = across * inverse_width, place.exact_s = across / frame_width;
        const auto n = [&](size_t k) { return noise[k][x]; };
        const Rgba c = Shade(place, n, gardner[x]);
        for (size_t k = 0; k < 4; ++k) colors[k][x] = c[k];
      }
      kernels_.interleave(planes.data(), static_cast<int>(planes.size()), r.width(),
                          reinterpret_cast<float*>(args.out.At(r.x0, y)));
    }
  }

 private:
  bool UsesGardner() const {
    return params_.kind == TextureKind::kClouds || params_.kind == TextureKind::kGardner;
  }

  template <class NoiseAt>
  Rgba Shade(const TexturePlace& p, const NoiseAt& n, float gardner) const {
    const auto frequency = static_cast<float>(params_.frequency);
    switch (params_.kind) {
      case TextureKind::kClouds:
        return Clouds(p, gardner, n(0), n(1));
      case TextureKind::kMarble:
        return Marble(p, params_.frequency, n(0));
      case TextureKind::kWood:
        return Wood(p, 14 * params_.frequency, n(0), n(1));
      case TextureKind::kFire:
        return Fire(p, n(0), n(1), n(2));
      case TextureKind::kSmoke:
        return Smoke(p, n(0), n(1), n(2));
      case TextureKind::kRipples:
        // Waves repeat every second; whole ones would cost the float its fraction.
        return Ripples(p, frequency, static_cast<float>(params_.time - std::floor(params_.time)),
                       params_.seed);
      default:
        return {gardner, gardner, gardner, 1};
    }
  }

  float* PlaneOf(int channel, const std::array<float*, 4>& colors, float* zeros, float* ones) const {
    const bool covers = params_.kind == TextureKind::kFire || params_.kind == TextureKind::kSmoke;
    const bool grey = params_.kind == TextureKind::kRipples || params_.kind == TextureKind::kGardner;
    if (channel == spec_.alpha) return covers ? colors[3] : ones;
    if (channel < 3) return colors[static_cast<size_t>(channel)];
    return grey ? colors[2] : zeros;
  }

  TextureParams params_;
  ImageSpec spec_;
  NoiseKernels kernels_;
  GardnerRows gardner_;
  std::vector<GridField> fields_;
};

class TextureOp final : public graph::OpWith<TextureParams> {
 public:
  TextureOp(const ImageSpec& spec, TextureParams params) : OpWith(std::move(params)), spec_(spec) {}
  std::string Name() const override { return TextureName(params().kind); }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec>) const override { return spec_; }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<TextureStage>(params(), spec_);
  }

 private:
  ImageSpec spec_;
};

OpInfo TextureRow(TextureKind kind, const char* summary, const std::string& help, const char* frequency) {
  OpInfo info;
  info.name = TextureName(kind);
  info.family = "noise";
  info.generator = true;
  info.inputs = 0;
  info.summary = summary;
  info.help = help +
              "\nLengths are in widths of the display window; colours are linear. time= moves a coordinate "
              "of the noise, so frames flow without flicker; octaves beyond Nyquist are faded.";
  info.bound = "4e-5, times the distance from the top in widths where that is above 1";
  info.bound_u = 672;
  info.modifiers = {NumberModifier("seed", "0", -2147483648.0, 4294967295.0, "whole number, modulo 2^32"),
                    NumberModifier("freq", frequency, 0, 1048576, "features across the width"),
                    IntegerModifier("octaves", "8", 0, 64, "octaves of the noise"),
                    NumberModifier("time", "0", -1e6, 1e6, "seconds")};
  info.examples = {""};
  return info;
}

// Sums of sines have terms of their own, ripples none.
constexpr bool HasOctaves(TextureKind kind) {
  return kind != TextureKind::kGardner && kind != TextureKind::kRipples;
}

template <TextureKind kind>
Node Make(std::span<const Node>, const Arguments& a, const ImageSpec* output) {
  TextureParams p;
  p.kind = kind;
  p.seed = static_cast<uint32_t>(static_cast<int64_t>(a.Number("seed")));
  p.frequency = a.Number("freq");
  if constexpr (HasOctaves(kind)) p.octaves = a.Integer("octaves");
  p.time = a.Number("time");
  if constexpr (kind == TextureKind::kFire) {
    p.layers = a.Integer("layers");
    p.rise = a.Number("rise");
    p.wind = a.Number("wind");
  }
  if constexpr (kind == TextureKind::kGardner) {
    p.terms = a.Integer("terms");
    p.amplitude = a.Number("amplitude");
    p.threshold = a.Number("threshold");
    p.scale = a.Number("scale");
    p.slices = a.Integer("slices");
  }
  return Texture(*output, p);
}

}  // namespace

OpInfo CloudsInfo() {
  OpInfo info = TextureRow(
      TextureKind::kClouds, "Clouds (Gardner) over a blue sky",
      "Gardner's product of sums of sines, broken up by fBm, decides where clouds are; the sky pales "
      "towards the horizon. The sun is at the upper left: thick parts, and those behind others, are in shadow. "
      "They drift to the right.\nSource: Gardner, Visual simulation of clouds, 1985.",
      "3");
  info.make = Make<TextureKind::kClouds>;
  return info;
}
OpInfo MarbleInfo() {
  OpInfo info =
      TextureRow(TextureKind::kMarble, "Marble: a ramp of sin(2 pi (x + turbulence))",
                 "Bands across the picture, displaced by turbulence, through a ramp of greys.", "3");
  info.make = Make<TextureKind::kMarble>;
  return info;
}
OpInfo WoodInfo() {
  OpInfo info = TextureRow(
      TextureKind::kWood, "Wood: rings around an axis, bent by noise",
      "A board cut nearly along its tree's axis: rings with a slow light and a quick dark side, and grain.",
      "2");
  info.bound = "1e-5, times the distance from the top in widths where that is above 1";
  info.bound_u = 168;
  info.make = Make<TextureKind::kWood>;
  return info;
}
OpInfo FireInfo() {
  OpInfo info = TextureRow(
      TextureKind::kFire, "Fire: layers of rising noise through a ramp of heat",
      "Heat falls with the height above the lower edge and is torn by three layers of fBm that rise at "
      "different speeds. Premultiplied, with alpha: lay it over anything.",
      "3");
  info.modifiers.push_back(IntegerModifier("layers", "3", 1, 3, "layers of noise, the broadest first"));
  info.modifiers.push_back(NumberModifier("rise", "1", -100, 100, "factor on the speeds of rising"));
  info.modifiers.push_back(NumberModifier("wind", "0", -100, 100, "drift to the right, widths per second"));
  info.examples = {"", "time=0.7 layers=2 rise=0.5 wind=-0.3"};
  info.make = Make<TextureKind::kFire>;
  return info;
}
OpInfo SmokeInfo() {
  OpInfo info =
      TextureRow(TextureKind::kSmoke, "Smoke: a rising, widening, fading plume",
                 "Luminance and alpha of a plume from the middle of the lower edge, swaying and breaking up. "
                 "Premultiplied, with alpha.",
                 "4");
  info.make = Make<TextureKind::kSmoke>;
  return info;
}
OpInfo RipplesInfo() {
  OpInfo info = TextureRow(
      TextureKind::kRipples, "Water ripples: a displacement for --distort",
      "Rings of waves from three drops: channel 0 is the displacement to the right, channel 1 down, around "
      "0.5; further channels are the height.",
      "18");
  std::erase_if(info.modifiers, [](const ParamInfo& m) { return m.name == "octaves"; });
  info.make = Make<TextureKind::kRipples>;
  return info;
}
OpInfo GardnerInfo() {
  OpInfo info = TextureRow(
      TextureKind::kGardner, "Gardner's product of sums of sines",
      "T = scale * X * Y, X and Y sums over terms= of c_i sin(f_i x + p_i) + t0 with c_1 = amplitude, "
      "c_{i+1} = 0.707 c_i, f_{i+1} = 2 f_i, phases p_i = pi/2 sin(f_{i-1} y). With slices= a volume: a "
      "third factor, inside the ellipsoid that touches the volume's sides, fading towards its rim.",
      "3");
  std::erase_if(info.modifiers, [](const ParamInfo& m) { return m.name == "octaves"; });
  info.bound = "(terms + 6) u * the sum of |c_i| and |terms t0|, times the other factors";
  info.bound_u = 336;
  info.modifiers.push_back(IntegerModifier("terms", "5", 1, 12, "sines per axis"));
  info.modifiers.push_back(NumberModifier("amplitude", "1", -1e3, 1e3, "c_1"));
  info.modifiers.push_back(NumberModifier("threshold", "0.6", -1e3, 1e3, "t0"));
  info.modifiers.push_back(NumberModifier("scale", "0.05", -1e3, 1e3, "k"));
  info.modifiers.push_back(IntegerModifier("slices", "1", 1, 65536, "slices of a volume stacked along y"));
  info.examples = {"", "slices=4"};
  info.make = Make<TextureKind::kGardner>;
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Texture(const ImageSpec& spec, const TextureParams& params) {
  const std::string name = ops::TextureName(params.kind);
  if (spec.channels.empty()) throw Error(name, "found no channels, expected at least one");
  const auto require = [&](bool valid, const char* what, double found, const char* expected) {
    if (!valid) throw Error(name + ":" + what, "found " + base::NumberText(found) + ", expected " + expected);
  };
  require(params.frequency >= 0 && params.frequency <= 1048576, "freq", params.frequency, "0 to 2^20");
  require(params.octaves >= 0 && params.octaves <= 64, "octaves", params.octaves, "0 to 64");
  require(std::fabs(params.time) <= 1e6, "time", params.time, "seconds within 1e6");
  require(params.terms >= 1 && params.terms <= ops::kMaxGardnerTerms, "terms", params.terms, "1 to 12");
  for (double v : {params.amplitude, params.threshold, params.scale}) {
    require(std::fabs(v) <= 1e3, "amplitude, threshold or scale", v, "numbers within 1000");
  }
  require(params.slices >= 1, "slices", params.slices, "1 or more");
  require(params.layers >= 1 && params.layers <= 3, "layers", params.layers, "1 to 3");
  for (double v : {params.rise, params.wind}) {
    require(std::fabs(v) <= 100, "rise or wind", v, "numbers within 100");
  }
  TextureParams p = params;
  p.frame = spec.display_window.empty() ? spec.data_window : spec.display_window;
  p.fields = ops::FieldsOf(p);
  for (NoiseParams& field : p.fields) {
    field.frame = p.frame;
    ops::CheckNoise(name, field);
  }
  return graph::MakeNode(std::make_shared<const ops::TextureOp>(spec, p), {});
}

}  // namespace tessera
