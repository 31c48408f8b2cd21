// What a texture's colour does to that of the surface it lies on: OpenGL's texture environments.
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "model/texture_environment_settings.h"
#include "ops/composite/composite_ops.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/composite/texture_environment.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/pair-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::Pixels;
using s::V;

// On texture and fragment, R, G, B and A of either; chosen at run time, memory is slower than the choice.
class TextureEnvironmentKernel {
 public:
  explicit TextureEnvironmentKernel(const TextureEnvironmentParams& p, bool texture_colors,
                                    bool texture_alpha)
      : p_(p), texture_colors_(texture_colors), texture_alpha_(texture_alpha) {
    for (size_t c = 0; c < 4; ++c) constant_[c] = static_cast<float>(p.constant[c]);
    scale_ = static_cast<float>(p.scale);
  }

  HWY_INLINE Pixels operator()(const Pixels& t, const Pixels& f) const {
    if (p_.mode == TextureMode::kCombine) return Combine(t, f);
    const V alpha = Alpha(t.a, f.a);
    if (!texture_colors_) return {f.r, f.g, f.b, alpha};
    return {Color(t.r, f.r, t.a, 0), Color(t.g, f.g, t.a, 1), Color(t.b, f.b, t.a, 2), alpha};
  }

 private:
  static HWY_INLINE V Set(float v) { return hn::Set(s::D(), v); }
  static HWY_INLINE V Sum(V a, V b, V c, V d) { return hn::MulAdd(a, b, hn::Mul(c, d)); }

  HWY_INLINE V Color(V t, V f, V alpha, int channel) const {
    switch (p_.mode) {
      case TextureMode::kModulate:
        return hn::Mul(t, f);
      case TextureMode::kDecal:
        return Sum(t, alpha, f, hn::Sub(Set(1), alpha));
      case TextureMode::kBlend:
        return Sum(f, hn::Sub(Set(1), t), Set(constant_[channel]), t);
      case TextureMode::kAdd:
        return hn::Add(t, f);
      default:
        return t;
    }
  }
  HWY_INLINE V Alpha(V t, V f) const {
    if (p_.mode == TextureMode::kDecal || !texture_alpha_) return f;
    return p_.mode == TextureMode::kReplace ? t : hn::Mul(t, f);
  }

  struct Terms {
    V v[4];
  };
  HWY_INLINE Terms Argument(TextureArgument argument, const Pixels& t, const Pixels& f) const {
    const int of = static_cast<int>(argument) / 4, form = static_cast<int>(argument) % 4;
    Terms a = of == 0   ? Terms{{t.r, t.g, t.b, t.a}}
              : of == 1 ? Terms{{f.r, f.g, f.b, f.a}}
                        : Terms{{Set(constant_[0]), Set(constant_[1]), Set(constant_[2]), Set(constant_[3])}};
    if (form >= 2) a.v[0] = a.v[1] = a.v[2] = a.v[3];
    if (form % 2 == 1) {
      for (V& v : a.v) v = hn::Sub(Set(1), v);
    }
    return a;
  }
  HWY_INLINE V Function(V a, V b, V c) const {
    switch (p_.function) {
      case TextureFunction::kModulate:
        return hn::Mul(a, b);
      case TextureFunction::kAdd:
        return hn::Add(a, b);
      case TextureFunction::kAddSigned:
        return hn::Sub(hn::Add(a, b), Set(0.5f));
      case TextureFunction::kInterpolate:
        return Sum(a, c, b, hn::Sub(Set(1), c));
      case TextureFunction::kSubtract:
        return hn::Sub(a, b);
      default:
        return a;
    }
  }
  HWY_INLINE Pixels Combine(const Pixels& t, const Pixels& f) const {
    const Terms a = Argument(p_.arguments[0], t, f), b = Argument(p_.arguments[1], t, f),
                c = Argument(p_.arguments[2], t, f);
    const V scale = Set(scale_);
    V r[4];
    if (p_.function == TextureFunction::kDot) {
      const auto term = [&](int k) HWY_ATTR {
        return hn::Mul(hn::Sub(a.v[k], Set(0.5f)), hn::Sub(b.v[k], Set(0.5f)));
      };
      const V dot = hn::Mul(Set(4), hn::Add(hn::Add(term(0), term(1)), term(2)));
      for (int k = 0; k < 3; ++k) r[k] = hn::Mul(scale, dot);
      r[3] = f.a;
    } else {
      for (int k = 0; k < 4; ++k) r[k] = hn::Mul(scale, Function(a.v[k], b.v[k], c.v[k]));
    }
    return {r[0], r[1], r[2], r[3]};
  }

  TextureEnvironmentParams p_;
  bool texture_colors_, texture_alpha_;
  float constant_[4], scale_;
};

std::unique_ptr<graph::PointStage> NewTextureEnvironment(const TextureEnvironmentParams& p,
                                                         bool texture_colors, bool texture_alpha) {
  return s::MakePairStage(TextureEnvironmentKernel(p, texture_colors, texture_alpha));
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"

namespace tessera {
namespace ops {
namespace {

HWY_EXPORT(NewTextureEnvironment);

std::unique_ptr<graph::PointStage> MakeTextureEnvironment(const TextureEnvironmentParams& p,
                                                          bool texture_colors, bool texture_alpha) {
  return HWY_DYNAMIC_DISPATCH(NewTextureEnvironment)(p, texture_colors, texture_alpha);
}

const std::vector<std::string> kModes = {"modulate", "decal", "blend", "replace", "add", "combine"};
const std::vector<std::string> kFunctions = {"modulate",    "replace",  "add", "add-signed",
                                             "interpolate", "subtract", "dot"};
std::vector<std::string> ArgumentNames() {
  std::vector<std::string> names;
  for (const std::string of : {"texture", "fragment", "constant"}) {
    for (const std::string form : {"", "-alpha"}) {
      names.push_back(of + form), names.push_back("one-minus-" + of + form);
    }
  }
  return names;
}

// R, G, B and A of any image that OpenGL has a base format for: one grey channel serves all three, without
// alpha it is 1, without colours they are 0. Channels beyond the third colour are left out.
Node AsRgba(const std::string& what, const Node& image) {
  const ImageSpec& spec = image.spec();
  std::vector<int> colors;
  for (int c = 0; c < spec.channel_count(); ++c) {
    if (c != spec.alpha) colors.push_back(c);
  }
  if (colors.size() == 2) {
    throw DataError("texenv", "found " + what + " of " + std::to_string(spec.channel_count()) +
                                  " channels, expected R,G,B or one grey channel, A beside them or alone");
  }
  std::vector<ChannelChoice> choices;
  for (size_t k = 0; k < 3; ++k) {
    const int from = colors.empty() ? -1 : colors[colors.size() == 1 ? 0 : k];
    choices.push_back({from, 0, std::string(1, "RGB"[k])});
  }
  choices.push_back({spec.alpha, 1, "A"});
  return SelectChannels(image, choices);
}

ParamInfo ArgumentModifier(const char* name, const char* first, const char* help) {
  ParamInfo p = ChoiceModifier(name, ArgumentNames(), help);
  p.default_value = first;
  p.only_with = "MODE=combine";
  return p;
}

}  // namespace

OpInfo TextureEnvironmentInfo() {
  OpInfo info;
  info.name = "texenv";
  info.family = "composite";
  info.inputs = 2;
  info.summary = "A texture on a surface's colour, by OpenGL's texture environments";
  info.help =
      "TEXTURE FRAGMENT --texenv MODE, with T and F their colours, C the constant and A with a letter an alpha. "
      "modulate: T F, alpha At Af; decal: At T + (1 - At) F, alpha Af; blend: (1 - T) F + T C, alpha At Af; "
      "replace: T, alpha At; add: T + F, alpha At Af. Textures are R,G,B, or one grey channel for all three, "
      "with A or without, or A alone, which leaves the colours; without A alpha stays the fragment's. Colours "
      "are not premultiplied.\n"
      "combine: function= of arg0=, arg1= and arg2=, each the texture, the fragment or the constant, as it is, as its "
      "alpha, or 1 minus either; alpha is that of the arguments' alphas. replace a0; modulate a0 a1; add; "
      "add-signed a0 + a1 - 1/2; interpolate a0 a2 + a1 (1 - a2); subtract a0 - a1; dot 4 sum (a0 - 1/2)(a1 - 1/2) "
      "in all three, alpha Af. scale= 1, 2 or 4 times that.\n"
      "Nothing is limited to [0,1], as OpenGL does: --clamp does it. The result has the fragment's windows and "
      "R,G,B, and A where either has it; further channels are left out. Source: McReynolds et al. 1997, 5.1.2; OpenGL 2.1 2006, 3.8.13.";
  info.bound = "8 u * scale * the sum of the magnitudes of the terms";
  info.bound_u = 8;
  info.arguments = {ChoiceArgument("MODE", kModes, "what the texture does")};
  info.modifiers = {
      OnlyWith("MODE=blend|combine", ListModifier("constant", "0,0,0,0", 4, -double{FLT_MAX}, double{FLT_MAX},
                                                  "constant colour r,g,b,a; one number serves all")),
      OnlyWith("MODE=combine", ChoiceModifier("function", kFunctions, "of the arguments")),
      ArgumentModifier("arg0", "texture", "first argument"),
      ArgumentModifier("arg1", "fragment", "second argument"),
      ArgumentModifier("arg2", "constant", "third argument, of interpolate"),
      OnlyWith("MODE=combine", ChoiceModifier("scale", {"1", "2", "4"}, "of the result"))};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    TextureEnvironmentParams p;
    p.mode = ChoiceOf<TextureMode>(kModes, a.Text("MODE"));
    const std::vector<double>& constant = a.Numbers("constant");
    for (size_t i = 0; i < 4; ++i) {
      p.constant[i] = constant.size() == 1 ? constant[0] : i < constant.size() ? constant[i] : 0;
    }
    p.function = ChoiceOf<TextureFunction>(kFunctions, a.Text("function"));
    const std::vector<std::string> names = ArgumentNames();
    const char* const arguments[] = {"arg0", "arg1", "arg2"};
    for (size_t k = 0; k < 3; ++k) p.arguments[k] = ChoiceOf<TextureArgument>(names, a.Text(arguments[k]));
    p.scale = std::stoi(a.Text("scale"));
    return TextureEnvironment(in[0], in[1], p);
  };
  info.examples = {"modulate",
                   "decal",
                   "blend constant=0.9,0.4,0.1,1",
                   "replace",
                   "add",
                   "combine function=interpolate arg2=fragment-alpha",
                   "combine function=dot scale=2",
                   "combine function=add-signed arg1=one-minus-constant constant=0.3",
                   "combine function=subtract arg0=one-minus-fragment-alpha scale=4"};
  return info;
}

}  // namespace ops

Node TextureEnvironment(const Node& texture, const Node& fragment, const TextureEnvironmentParams& params) {
  for (const double v : params.constant) {
    if (!(std::fabs(v) <= double{FLT_MAX}))
      throw Error("texenv", "found a constant that is not finite, expected a number");
  }
  if (params.scale != 1 && params.scale != 2 && params.scale != 4) {
    throw Error("texenv", "found scale=" + std::to_string(params.scale) + ", expected 1, 2 or 4");
  }
  const bool alpha = texture.spec().alpha >= 0, colors = texture.spec().channel_count() > (alpha ? 1 : 0);
  if (!colors && params.mode == TextureMode::kDecal) {
    throw DataError("texenv", "found a texture of alpha alone, expected colours for decal");
  }
  const std::vector<ImageSpec> specs = {texture.spec(), fragment.spec()};
  graph::RequireSameWindow("texenv", specs);
  const Node t = ops::AsRgba("a texture", texture), f = ops::AsRgba("a fragment", fragment);
  ops::CompositeOp::Traits traits{.name = "texenv",
                                  .description = {},
                                  .parameters = ops::TextureEnvironmentSettings{params, colors, alpha},
                                  .spec = f.spec(),
                                  .rgba = true,
                                  .make = [params, colors, alpha](const graph::StageContext&) {
                                    return ops::MakeTextureEnvironment(params, colors, alpha);
                                  }};
  const Node whole = ops::MakeCompositeNode(std::move(traits), {t, f});
  const bool transparent = fragment.spec().alpha >= 0 || (alpha && params.mode != TextureMode::kDecal);
  if (transparent) return whole;
  return SelectChannels(whole, std::vector<ChannelChoice>{{0, 0, "R"}, {1, 0, "G"}, {2, 0, "B"}});
}

}  // namespace tessera
#endif  // HWY_ONCE
