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

// Parameters of a texture's noise. Time is a third coordinate; what rises is sampled lower down.
class Fields {
 public:
  explicit Fields(TextureParams& p) : p_(p) {}

  void Add() {
    const double f = p_.frequency;
    switch (p_.kind) {
      case TextureKind::kClouds:
        // The same noise twice, the second time without its finest octaves and nearer to the sun, which is at
        // the upper left.
        for (const int octaves : {p_.octaves, std::min(p_.octaves, 5)}) {
          NoiseParams& n = One(0, f, 1, octaves, {-0.25, 0, 0.12});
          n.gain = 0.55;
        }
        p_.fields[1].offset[0] -= 0.09;
        p_.fields[1].offset[1] -= 0.12;
        return;
      case TextureKind::kMarble:
        for (int k = 0; k < 4; ++k) {
          constexpr double kFrequency[] = {0.55, 1.2, 2.6, 5.5}, kAmount[] = {0.165, 0.143, 0.11, 0.072};
          Curl(k, kFrequency[k] * f, 1, kAmount[k], {0, 0, 0.06 + 0.03 * k});
        }
        One(0, f, 1, p_.octaves, {0, 0, 0.1}).sum = NoiseSum::kTurbulence;
        One(1, 0.8 * f, 1, std::min(p_.octaves, 6), {0, 0, 0.1});
        return;
      case TextureKind::kWood:
        One(0, 1.1 * f, 0.22, std::min(p_.octaves, 4), {0, 0, 0.1});
        One(1, 30 * f, 0.04, std::min(p_.octaves, 3), {0, 0, 0.1});
        return;
      case TextureKind::kFire:
        return Fire(f);
      case TextureKind::kSmoke:
        for (int k = 0; k < 4; ++k) {
          constexpr double kFrequency[] = {0.7, 1.5, 3, 6.5}, kAmount[] = {0.25, 0.25, 0.225, 0.163};
          Curl(k, kFrequency[k] * f, 1, kAmount[k], {0, (0.6 + 0.5 * k) * p_.rise, 0.2 + 0.1 * k});
        }
        One(0, 0.45 * f, 1e-3, std::min(p_.octaves, 2), {0, 0.35 * p_.rise, 0.2});
        One(1, 1.6 * f, 1, p_.octaves, {0, 0.9 * p_.rise, 0.3});
        One(2, 0.85 * f, 1, std::min(p_.octaves, 2), {0, 0.6 * p_.rise, 0.25});
        return;
      default:
        return;
    }
  }

 private:
  // A noise of so many cells down a width, `aspect` times as many across, moving at cells per second.
  NoiseParams& One(int index, double frequency, double aspect, int octaves,
                   const std::array<double, 3>& speed) {
    NoiseParams n;
    n.dims = 3;
    n.antialias = true;
    n.seed = OctaveSeed(p_.seed, 2000 + index, 0);
    n.frequency = frequency;
    n.aspect = aspect;
    n.octaves = octaves;
    n.offset = {0, 0, 0.37, 0};
    const double height = p_.frame.height() / std::max<double>(p_.frame.width(), 1);
    // Looped, noise comes back after no less than what is in view.
    const double in_view[3] = {frequency * aspect, frequency * height, 2};
    for (size_t a = 0; a < 3; ++a) {
      if (p_.loop == 0 || speed[a] == 0) {
        n.offset[a] += speed[a] * p_.time;
        continue;
      }
      // A period is counted in floats, in the finest octave's cells.
      constexpr double kMostCells = 4096, kMostInView = 1 << 20;
      const double passing = std::min(std::round(std::fabs(speed[a]) * p_.loop), kMostCells);
      const double cells = std::max(std::min(std::ceil(in_view[a]), kMostInView), passing);
      const double turns = p_.time / p_.loop;
      n.offset[a] += std::copysign(cells, speed[a]) * (turns - std::floor(turns));
      n.period[a] = static_cast<int>(cells);
    }
    p_.fields.push_back(n);
    return p_.fields.back();
  }
  // `amount`: cells across that a slope of 1 a cell moves by. A potential of cells that are longer than wide
  // moves as much less across.
  void Curl(int index, double across, double slender, double amount, const std::array<double, 3>& speed) {
    NoiseParams& n = One(10 + index, across / slender, slender, 1, speed);
    n.output = NoiseOutput::kGradient;
    const double by = p_.curl * amount / std::max(across, 0.5);
    p_.curls.push_back({by / slender, by});
  }
  void Fire(double f) {
    const auto moving = [&](double cells, double rise, double change) {
      return std::array<double, 3>{-p_.wind * cells, rise * p_.rise, change};
    };
    for (int k = 0; k < 3; ++k) {
      constexpr double kFrequency[] = {1, 2.2, 4.6}, kAmount[] = {0.26, 0.23, 0.18};
      const double cells = kFrequency[k] * f;
      Curl(k, cells, 1 / 0.6, kAmount[k], moving(cells, 1.2 + k, 0.3 + 0.2 * k));
    }
    const int wide = std::min(p_.octaves, 2), middle = std::min(p_.octaves, 3);
    One(0, 0.45 * f, 1.1 / 0.45, wide, moving(1.1 * f, 1.1, 0.45));
    One(1, 0.9 * f, 2.6 / 0.9, p_.layers > 1 ? middle : 0, moving(2.6 * f, 2.2, 0.8));
    One(2, 1.6 * f, 6 / 1.6, p_.layers > 2 ? std::min(p_.octaves, 5) : 0, moving(6 * f, 3.6, 1.2));
    // Points in space, of which a plane of time shows those that it passes.
    One(3, 16.0 / 3 * f, 1, 1, moving(16.0 / 3 * f, 9, 0.4)).kind = NoiseKind::kCell;
  }

  TextureParams& p_;
};

class TextureStage final : public graph::TileStage {
 public:
  TextureStage(const TextureParams& p, const ImageSpec& spec)
      : params_(p), spec_(spec), kernels_(FindNoiseKernels()), gardner_(GardnerOf(p), spec.data_window) {
    for (const NoiseParams& n : p.fields) fields_.emplace_back(n, spec.data_window, 0, !p.curls.empty());
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
    const Curls curls = Allocate(args, width);
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
      const float up = 1 - (static_cast<float>(y - params_.frame.y0) + 0.5f) * inverse_height;
      Move(cursors, y, width, CurlGrowth(params_.kind, up), curls, noise);
      for (size_t k = params_.curls.size(); k < cursors.size(); ++k)
        cursors[k].Row(y, noise[k], nullptr, false, curls.used());
      if (UsesGardner()) gardner_.Row(y, r.x0, r.x1, gardner);
      const float down = static_cast<float>(y - params_.frame.y0) + 0.5f;
      TexturePlace place{0, down * inverse_width, 1 - down * inverse_height, 0, down / frame_width};
      for (size_t x = 0; x < width; ++x) {
        const float across = static_cast<float>(r.x0 + static_cast<int>(x) - params_.frame.x0) + 0.5f;
        place.s = across * inverse_width, place.exact_s = across / frame_width;
        const auto n = [&](size_t k) { return noise[params_.curls.size() + k][x]; };
        const Rgba c =
            Shade(curls.used() ? Moved(place, curls, x, frame_width * inverse_height) : place, n, gardner[x]);
        for (size_t k = 0; k < 4; ++k) colors[k][x] = c[k];
      }
      kernels_.interleave(planes.data(), static_cast<int>(planes.size()), r.width(),
                          reinterpret_cast<float*>(args.out.At(r.x0, y)));
    }
  }

 private:
  // Rows: how far right and down of its pixel the place that is seen lies, and a potential's slopes.
  struct Curls {
    float *moved[2] = {}, *slopes[3] = {};
    const float* const* used() const { return moved[0] != nullptr ? moved : nullptr; }
  };
  Curls Allocate(const graph::TileArgs& args, size_t width) const {
    Curls c;
    if (params_.curls.empty()) return c;
    for (float*& row : c.moved) row = args.scratch.Allocate<float>(width + kNoisePadding);
    for (float*& row : c.slopes) row = args.scratch.Allocate<float>(width + kNoisePadding);
    return c;
  }
  // Each curl is read where those before have moved to.
  void Move(base::ArenaVector<GridCursor>& cursors, int y, size_t width, float growth, const Curls& c,
            const base::ArenaVector<float*>& noise) const {
    if (params_.curls.empty()) return;
    for (float* const row : c.moved) std::fill_n(row, width + kNoisePadding, 0.0f);
    for (size_t k = 0; k < params_.curls.size(); ++k) {
      cursors[k].Row(y, noise[k], c.slopes, false, c.moved);
      const float right = growth * static_cast<float>(params_.curls[k][0]);
      const float up = growth * static_cast<float>(params_.curls[k][1]);
      for (size_t x = 0; x < width; ++x) {
        c.moved[0][x] += right * c.slopes[1][x];
        c.moved[1][x] -= up * c.slopes[0][x];
      }
    }
  }
  static TexturePlace Moved(TexturePlace p, const Curls& c, size_t x, double aspect) {
    const float right = c.moved[0][x], down = c.moved[1][x];
    p.s += right, p.exact_s += right;
    p.t += down, p.exact_t += down;
    p.h -= down * static_cast<float>(aspect);
    return p;
  }
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
        return Marble(p, params_.frequency, n(0), n(1));
      case TextureKind::kWood:
        return Wood(p, 14 * params_.frequency, n(0), n(1));
      case TextureKind::kFire:
        return Fire(p, static_cast<float>(params_.height), static_cast<float>(params_.embers), n(0), n(1),
                    n(2), n(3));
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
                    NumberModifier("time", "0", -1e6, 1e6, "seconds"),
                    NumberModifier("loop", "0", 0, 1e6,
                                   "seconds after which frames repeat, speeds rounded to it; 0: never")};
  if (kind == TextureKind::kFire || kind == TextureKind::kSmoke || kind == TextureKind::kMarble) {
    info.bound += ", plus what moving a place by 2.5e-7 widths at every curl changes";
    info.modifiers.push_back(NumberModifier("curl", "1", 0, 4, "factor on the curls"));
  }
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
  if constexpr (kind != TextureKind::kRipples) p.loop = a.Number("loop");
  if constexpr (kind == TextureKind::kFire || kind == TextureKind::kSmoke || kind == TextureKind::kMarble)
    p.curl = a.Number("curl");
  if constexpr (kind == TextureKind::kFire || kind == TextureKind::kSmoke) p.rise = a.Number("rise");
  if constexpr (kind == TextureKind::kFire) {
    p.layers = a.Integer("layers");
    p.wind = a.Number("wind");
    p.height = a.Number("height");
    p.embers = a.Number("embers");
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
      "towards the horizon. The sun is at the upper left: thick parts, and those behind others, are in "
      "shadow. They drift to the right.\nSource: Gardner, Visual simulation of clouds, 1985.",
      "3");
  info.make = Make<TextureKind::kClouds>;
  return info;
}
OpInfo MarbleInfo() {
  OpInfo info = TextureRow(
      TextureKind::kMarble, "Marble: a ramp of sin(2 pi (x + turbulence))",
      "Bands across the picture, roughened by turbulence and moved by curls of noise, which fold them but "
      "close none into eyes, through a ramp of greys; fine veins cross them.\n"
      "Source: Perlin 1985; Bridson et al. 2007.",
      "3");
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
      "Tongues reach as high as a broad noise says, thinner the higher; finer layers, which rise faster, "
      "open them into sheets, and all is moved by curls of noise that rise too, so that tips bend, part "
      "and go up by themselves. Sparks rise among them. Premultiplied, with alpha, and brighter than that, "
      "as it gives light: lay it over anything.\nSource: McReynolds et al. 1997, 11.3; Bridson et al. 2007.",
      "3");
  info.modifiers.push_back(IntegerModifier("layers", "3", 1, 3, "layers of noise, the broadest first"));
  info.modifiers.push_back(NumberModifier("rise", "1", -100, 100, "factor on the speeds of rising"));
  info.modifiers.push_back(NumberModifier("wind", "0", -100, 100, "drift to the right, widths per second"));
  info.modifiers.push_back(NumberModifier("height", "1", 0.1, 4, "factor on how high flames reach"));
  info.modifiers.push_back(NumberModifier("embers", "1", 0, 4, "brightness of the sparks"));
  info.examples = {"", "time=0.7 layers=2 rise=0.5 wind=-0.3", "time=1.3 loop=4 height=.7 embers=2 curl=1.5"};
  info.make = Make<TextureKind::kFire>;
  return info;
}
OpInfo SmokeInfo() {
  OpInfo info = TextureRow(
      TextureKind::kSmoke, "Smoke: a rising, widening, fading plume",
      "Luminance and alpha of a plume from the middle of the lower edge, swaying, rolled up by curls of "
      "noise that rise and grow with height, lit from the left. Premultiplied, with alpha.\n"
      "Source: McReynolds et al. 1997, 11.2; Bridson et al. 2007.",
      "4");
  info.modifiers.push_back(NumberModifier("rise", "1", -100, 100, "factor on the speeds of rising"));
  info.examples = {"", "time=2.5 loop=5 curl=2"};
  info.make = Make<TextureKind::kSmoke>;
  return info;
}
OpInfo RipplesInfo() {
  OpInfo info = TextureRow(
      TextureKind::kRipples, "Water ripples: a displacement for --distort",
      "Rings of waves from three drops: channel 0 is the displacement to the right, channel 1 down, around "
      "0.5; further channels are the height.",
      "18");
  std::erase_if(info.modifiers, [](const ParamInfo& m) { return m.name == "octaves" || m.name == "loop"; });
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
  require(params.loop >= 0 && params.loop <= 1e6, "loop", params.loop, "0 to 1e6 seconds");
  require(params.curl >= 0 && params.curl <= 4, "curl", params.curl, "0 to 4");
  require(params.height >= 0.1 && params.height <= 4, "height", params.height, "0.1 to 4");
  require(params.embers >= 0 && params.embers <= 4, "embers", params.embers, "0 to 4");
  for (double v : {params.rise, params.wind}) {
    require(std::fabs(v) <= 100, "rise or wind", v, "numbers within 100");
  }
  TextureParams p = params;
  p.frame = spec.display_window.empty() ? spec.data_window : spec.display_window;
  p.fields.clear(), p.curls.clear();
  ops::Fields(p).Add();
  p.drift = ops::GardnerDrift(p);
  for (NoiseParams& field : p.fields) {
    field.frame = p.frame;
    ops::CheckNoise(name, field);
  }
  return graph::MakeNode(std::make_shared<const ops::TextureOp>(spec, p), {});
}

}  // namespace tessera
