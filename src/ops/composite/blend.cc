// Blending by mode: Porter-Duff operators, GL equations with factors, SVG and CSS modes.
#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>

#include "ops/composite/composite_ops.h"
#include "ops/modifiers.h"
#include "tessera/ops/composite.h"

namespace tessera {

const std::vector<std::string>& BlendModeNames() {
  static const std::vector<std::string> kNames = {
      "clear",      "src",         "dst",         "over",       "dst-over",  "in",       "dst-in",
      "out",        "dst-out",     "atop",        "dst-atop",   "xor",       "plus",     "add",
      "subtract",   "revsubtract", "min",         "max",        "modulate",  "constant", "straight-over",
      "normal",     "multiply",    "screen",      "overlay",    "darken",    "lighten",  "color-dodge",
      "color-burn", "hard-light",  "soft-light",  "difference", "exclusion", "hue",      "saturation",
      "color",      "luminosity",  "plus-lighter"};
  return kNames;
}

const std::vector<std::string>& BlendFactorNames() {
  static const std::vector<std::string> kNames = {"zero",
                                                  "one",
                                                  "src-color",
                                                  "one-minus-src-color",
                                                  "dst-color",
                                                  "one-minus-dst-color",
                                                  "src-alpha",
                                                  "one-minus-src-alpha",
                                                  "dst-alpha",
                                                  "one-minus-dst-alpha",
                                                  "src-alpha-saturate",
                                                  "constant-color",
                                                  "one-minus-constant-color",
                                                  "constant-alpha",
                                                  "one-minus-constant-alpha"};
  return kNames;
}

namespace ops {
namespace {

// What CSS and the canvas of HTML call some of them.
constexpr std::pair<const char*, BlendMode> kCanvasNames[] = {
    {"copy", BlendMode::kSource},
    {"source", BlendMode::kSource},
    {"destination", BlendMode::kDestination},
    {"source-over", BlendMode::kOver},
    {"destination-over", BlendMode::kDestinationOver},
    {"source-in", BlendMode::kIn},
    {"destination-in", BlendMode::kDestinationIn},
    {"source-out", BlendMode::kOut},
    {"destination-out", BlendMode::kDestinationOut},
    {"source-atop", BlendMode::kAtop},
    {"destination-atop", BlendMode::kDestinationAtop},
    {"lighter", BlendMode::kPlus}};

std::vector<std::string> ModeWords() {
  std::vector<std::string> words = BlendModeNames();
  for (const auto& [name, mode] : kCanvasNames) words.emplace_back(name);
  return words;
}

BlendMode ModeOf(const std::string& word) {
  for (const auto& [name, mode] : kCanvasNames) {
    if (word == name) return mode;
  }
  return ChoiceOf<BlendMode>(BlendModeNames(), word);
}

bool NonSeparable(BlendMode mode) { return mode >= BlendMode::kHue && mode <= BlendMode::kLuminosity; }
bool HasFactors(BlendMode mode) {
  return mode == BlendMode::kAdd || mode == BlendMode::kSubtract || mode == BlendMode::kReverseSubtract;
}

// The mode that gives the same of the images exchanged, or the mode itself.
BlendMode Exchanged(BlendMode mode) {
  switch (mode) {
    case BlendMode::kDestinationOver:
      return BlendMode::kOver;
    case BlendMode::kDestinationIn:
      return BlendMode::kIn;
    case BlendMode::kDestinationOut:
      return BlendMode::kOut;
    case BlendMode::kDestinationAtop:
      return BlendMode::kAtop;
    case BlendMode::kOverlay:
      return BlendMode::kHardLight;
    default:
      return mode;
  }
}

GlBlend Resolve(const BlendParams& p) {
  using E = GlBlend::Equation;
  using F = BlendFactor;
  switch (p.mode) {
    case BlendMode::kClear:
      return {E::kAdd, F::kZero, F::kZero, F::kZero, F::kZero};
    case BlendMode::kMin:
      return {E::kMin};
    case BlendMode::kMax:
      return {E::kMax};
    case BlendMode::kModulate:
      return {E::kAdd, F::kDestinationColor, F::kZero, F::kDestinationColor, F::kZero};
    case BlendMode::kConstant:
      return {E::kAdd, F::kConstantColor, F::kOneMinusConstantColor, F::kConstantColor,
              F::kOneMinusConstantColor};
    case BlendMode::kStraightOver:
      return {E::kAdd, F::kSourceAlpha, F::kOneMinusSourceAlpha, F::kOne, F::kOneMinusSourceAlpha};
    default:
      break;
  }
  const auto given = [](F factor, F otherwise) { return factor == F::kDefault ? otherwise : factor; };
  GlBlend blend;
  blend.equation = p.mode == BlendMode::kSubtract          ? E::kSubtract
                   : p.mode == BlendMode::kReverseSubtract ? E::kReverseSubtract
                                                           : E::kAdd;
  blend.source = given(p.source, F::kOne);
  blend.destination = given(p.destination, F::kOne);
  blend.source_alpha = given(p.source_alpha, blend.source);
  blend.destination_alpha = given(p.destination_alpha, blend.destination);
  return blend;
}

std::unique_ptr<graph::PointStage> MakeStage(const BlendParams& p, const BlendPlanes& planes,
                                             const graph::StageContext& context) {
  switch (p.mode) {
    case BlendMode::kOver:
      return MakePorterDuffStage(PorterDuff::kOver, planes);
    case BlendMode::kIn:
      return MakePorterDuffStage(PorterDuff::kIn, planes);
    case BlendMode::kOut:
      return MakePorterDuffStage(PorterDuff::kOut, planes);
    case BlendMode::kAtop:
      return MakePorterDuffStage(PorterDuff::kAtop, planes);
    case BlendMode::kXor:
      return MakePorterDuffStage(PorterDuff::kXor, planes);
    case BlendMode::kPlus:
      return MakePorterDuffStage(PorterDuff::kPlus, planes);
    default:
      break;
  }
  if (NonSeparable(p.mode)) return MakeNonSeparableStage(p.mode);
  if (p.mode >= BlendMode::kMultiply) return MakeSeparableStage(p.mode, planes);
  float constant[4];
  for (size_t i = 0; i < 4; ++i) {
    // Further channels are colours of the constant's last one.
    const int c = planes.roles[i] == ChannelRole::kAlpha ? 3 : std::clamp(context.channels[i], 0, 2);
    constant[i] = static_cast<float>(p.constant[static_cast<size_t>(c)]);
  }
  return MakeGlStage(Resolve(p), planes, constant, static_cast<float>(p.constant[3]));
}

ParamInfo FactorModifier(const char* name, const char* help) {
  std::vector<std::string> choices = {"default"};
  choices.insert(choices.end(), BlendFactorNames().begin(), BlendFactorNames().end());
  return ChoiceModifier(name, choices, help);
}

BlendFactor FactorOf(const std::string& word) {
  if (word == "default") return BlendFactor::kDefault;
  return static_cast<BlendFactor>(static_cast<int>(ChoiceOf<BlendFactor>(BlendFactorNames(), word)) + 1);
}

bool ReadsConstant(const BlendParams& p) {
  const std::array factors = {p.source, p.destination, p.source_alpha, p.destination_alpha};
  return p.mode == BlendMode::kConstant || std::any_of(factors.begin(), factors.end(), [](BlendFactor f) {
           return f >= BlendFactor::kConstantColor;
         });
}

}  // namespace

OpInfo BlendInfo() {
  OpInfo info;
  info.name = "blend";
  info.family = "composite";
  info.inputs = 2;
  info.summary = "Two images by any operator, blend equation or blend mode";
  info.help =
      "FG BG --blend MODE on premultiplied pixels; s, d are samples of FG and BG, as, ad their "
      "alphas.\n"
      "Porter-Duff, Fs s + Fd d: clear 0,0; src 1,0; dst 0,1; over 1,1-as; dst-over 1-ad,1; in ad,0; dst-in "
      "0,as; out 1-ad,0; dst-out 0,1-as; atop ad,1-as; dst-atop 1-ad,as; xor 1-ad,1-as; plus 1,1.\n"
      "GL: add, subtract (s - d), revsubtract (d - s) with factors src=, dst=, srcalpha=, dstalpha= "
      "(default one; those of alpha as the colours'), constant=r,g,b,a for the constant factors; min, max "
      "(a number wins over NaN, no factors); modulate s d; constant c s + (1-c) d; straight-over: FG is not "
      "premultiplied.\n"
      "SVG and CSS, T + (1-ad) s + (1-as) d with T = as ad B(d/ad, s/as): normal (over), multiply, screen, "
      "overlay, darken, lighten, color-dodge, color-burn, hard-light, soft-light, difference, exclusion; "
      "plus-lighter min(1, s+d); on R,G,B only: hue, saturation, color, luminosity.\n"
      "Names of CSS and canvas: copy, source-over, source-in, source-out, source-atop, destination-over, "
      "destination-in, destination-out, destination-atop, lighter (plus).\n"
      "Nothing is limited in float; integers saturate and are rounded once. T is 0 unless both alphas are "
      "positive. The non-separable modes limit colours to [0, alpha] first. Images without alpha are "
      "opaque; the result covers both windows. Source: Porter and Duff 1984, OpenGL 4.6 section 17.3.6, W3C "
      "Compositing and Blending Level 1 sections 9 and 10.";
  info.bound =
      "4 u (Porter-Duff, GL), 8 u (separable), 32 u (non-separable) * sum of the magnitudes of the terms";
  info.bound_u = 4;
  info.arguments = {ChoiceArgument("MODE", ModeWords(), "operator, equation or mode")};
  info.modifiers = {
      OnlyWith("MODE=add|subtract|revsubtract", FactorModifier("src", "factor of FG")),
      OnlyWith("MODE=add|subtract|revsubtract", FactorModifier("dst", "factor of BG")),
      OnlyWith("MODE=add|subtract|revsubtract", FactorModifier("srcalpha", "factor of FG's alpha")),
      OnlyWith("MODE=add|subtract|revsubtract", FactorModifier("dstalpha", "factor of BG's alpha")),
      ListModifier("constant", "0,0,0,0", 4, -double{FLT_MAX}, double{FLT_MAX},
                   "constant colour r,g,b,a; one number serves all")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    BlendParams p;
    p.mode = ModeOf(a.Text("MODE"));
    p.source = FactorOf(a.Text("src")), p.destination = FactorOf(a.Text("dst"));
    p.source_alpha = FactorOf(a.Text("srcalpha")), p.destination_alpha = FactorOf(a.Text("dstalpha"));
    if (a.Given("constant") && !ReadsConstant(p)) {
      throw Error("blend",
                  "found constant= with nothing that reads it, expected MODE constant or a factor "
                  "with constant in its name");
    }
    const std::vector<double>& constant = a.Numbers("constant");
    for (size_t i = 0; i < 4; ++i) {
      p.constant[i] = constant.size() == 1 ? constant[0] : i < constant.size() ? constant[i] : 0;
    }
    return Blend(in[0], in[1], p);
  };
  info.identity = "src";
  info.examples = {"over",
                   "in",
                   "out",
                   "atop",
                   "xor",
                   "plus",
                   "dst-over",
                   "dst-in",
                   "dst-out",
                   "dst-atop",
                   "clear",
                   "subtract src=src-alpha dst=one-minus-src-alpha",
                   "revsubtract srcalpha=zero",
                   "add src=constant-color dst=one-minus-constant-alpha constant=0.2,0.4,0.6,0.3",
                   "add src=src-alpha-saturate dst=one",
                   "min",
                   "max",
                   "modulate",
                   "constant constant=0.25",
                   "straight-over",
                   "multiply",
                   "screen",
                   "overlay",
                   "darken",
                   "lighten",
                   "color-dodge",
                   "color-burn",
                   "hard-light",
                   "soft-light",
                   "difference",
                   "exclusion",
                   "hue",
                   "saturation",
                   "color",
                   "luminosity",
                   "plus-lighter"};
  return info;
}

}  // namespace ops

Node Blend(const Node& foreground, const Node& background, const BlendParams& params) {
  for (const double v : params.constant) {
    if (!(std::fabs(v) <= double{FLT_MAX}))
      throw Error("blend", "found a constant that is not finite, expected a number");
  }
  BlendParams p = params;
  if (p.mode == BlendMode::kNormal) p.mode = BlendMode::kOver;
  const std::string& name = BlendModeNames()[static_cast<size_t>(p.mode)];
  const bool factors = p.source != BlendFactor::kDefault || p.destination != BlendFactor::kDefault ||
                       p.source_alpha != BlendFactor::kDefault ||
                       p.destination_alpha != BlendFactor::kDefault;
  if (factors && !ops::HasFactors(p.mode)) {
    throw Error("blend", "found factors with the mode " + name + ", expected add, subtract or revsubtract");
  }
  ops::Layers layers = ops::MakeLayers("blend", {foreground, background});
  if (p.mode == BlendMode::kSource) return layers.images[0];
  if (p.mode == BlendMode::kDestination) return layers.images[1];
  if (ops::Exchanged(p.mode) != p.mode) {
    p.mode = ops::Exchanged(p.mode);
    std::swap(layers.images[0], layers.images[1]);
  }
  const std::vector<Node>& images = layers.images;
  const int depth = ops::FindDepth("blend", layers.spec, "");
  const int alpha_a = images[0].spec().alpha, alpha_b = images[1].spec().alpha;
  if (layers.spec.alpha < 0) layers.spec.alpha = alpha_a >= 0 ? alpha_a : alpha_b;
  const bool separate = ops::NonSeparable(p.mode);
  if (separate) graph::RequireColor("blend", layers.spec);
  const bool rgba =
      separate || (layers.spec.channel_count() == 4 && alpha_a == 3 && alpha_b == 3 && depth < 0);
  ops::CompositeOp::Traits t{.name = "blend",
                             .description = "blend " + name,
                             .parameters = p,
                             .spec = layers.spec,
                             .rgba = rgba,
                             .make = {}};
  t.make = [p, rgba, depth](const graph::StageContext& context) {
    ops::BlendPlanes planes;
    if (!rgba) {
      planes.form = ops::BlendPlanes::Form::kPlanes;
      std::ranges::copy(ops::RolesOf(context, depth), planes.roles);
    }
    return ops::MakeStage(p, planes, context);
  };
  std::vector<Node> inputs = images;
  if (!rgba) inputs.insert(inputs.end(), {ops::AlphaOf(images[0]), ops::AlphaOf(images[1])});
  return ops::MakeCompositeNode(std::move(t), std::move(inputs));
}

}  // namespace tessera
