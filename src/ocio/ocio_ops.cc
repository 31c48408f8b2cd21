// The commands of colour management, as oiiotool has them, and what they share: config, context, baking.
#include <algorithm>

#include "ops/registry.h"
#include "tessera/error.h"
#include "tessera/export.h"
#include "tessera/ocio.h"

namespace tessera::ops {
namespace {

ParamInfo TextParam(const std::string& name, const std::string& help) {
  ParamInfo p;
  p.name = name;
  p.type = ParamType::kText;
  p.help = help;
  return p;
}
ParamInfo FlagParam(const std::string& name, const std::string& help, const std::string& otherwise = "0") {
  ParamInfo p = TextParam(name, help);
  p.type = ParamType::kFlag;
  p.default_value = otherwise;
  return p;
}
ParamInfo InterpParam() {
  ParamInfo p = TextParam(
      "interp", "how entries of the tables are combined (default: as a CLF or CTF says, else tetrahedral)");
  p.type = ParamType::kChoice;
  p.choices = {"nearest", "linear", "tetrahedral", "cubic"};
  return p;
}
ParamInfo CccIdParam() {
  return TextParam("cccid",
                   "which correction of a .ccc or .cdl file: its id or its index (default: the first)");
}
ParamInfo BakeParam() {
  ParamInfo p = TextParam(
      "bake",
      "2 to 129: run it as a shaper and a table of that many entries cubed, and print the error; 0: not "
      "baked");
  p.type = ParamType::kInteger;
  p.default_value = "0";
  p.min = 0, p.max = 129;
  return p;
}

// The modifiers of every command that needs a config.
void AddConfigModifiers(OpInfo& info) {
  info.modifiers.push_back(TextParam(
      "config", "OpenColorIO config file (default: --colorconfig, else the variable OCIO, else built-in)"));
  info.modifiers.push_back(TextParam("key", "context variables, comma-separated"));
  info.modifiers.push_back(TextParam("value", "their values, comma-separated"));
  info.modifiers.push_back(
      FlagParam("unpremult", "1 divides by alpha before and multiplies after, but where it is 0"));
  info.modifiers.push_back(BakeParam());
}

std::vector<std::string> Pieces(const std::string& text) {
  std::vector<std::string> pieces;
  for (size_t begin = 0; !text.empty() && begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    pieces.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return pieces;
}

OcioParams OcioParamsOf(const OpInfo& info, const Arguments& a) {
  OcioParams params;
  params.config = a.Text("config");
  params.unpremult = a.Flag("unpremult");
  const std::vector<std::string> keys = Pieces(a.Text("key")), values = Pieces(a.Text("value"));
  if (keys.size() != values.size()) {
    throw Error(info.name + ":key", "found " + std::to_string(keys.size()) + " keys and " +
                                        std::to_string(values.size()) + " values, expected as many of both");
  }
  for (size_t i = 0; i < keys.size(); ++i) params.context.emplace_back(keys[i], values[i]);
  return params;
}

LutParams LutParamsOf(const Arguments& a) {
  const std::string& interp = a.Text("interp");
  LutParams params;
  if (a.Given("interp")) {
    params.filter = interp == "nearest"  ? TableFilter::kNearest
                    : interp == "linear" ? TableFilter::kLinear
                    : interp == "cubic"  ? TableFilter::kCubic
                                         : TableFilter::kTetrahedral;
  }
  params.inverse = a.Flag("inverse");
  params.cccid = a.Text("cccid");
  return params;
}

// The transform itself, or baked with its error told.
template <class F>
Node MaybeBaked(const Node& image, const Arguments& a, const F& transform) {
  const int size = a.Integer("bake");
  if (size == 0) return transform(image);
  if (size < 2) throw Error("bake", "found a size of 1, expected 0, or 2 to 129");
  BakeParams params;
  params.size = size;
  BakeReport report;
  const Node baked = Bake(image, transform, params, a.notes != nullptr ? &report : nullptr);
  if (a.notes != nullptr) a.notes->push_back("bake " + std::to_string(size) + ": " + report.Summary());
  return baked;
}

OpInfo Row(const std::string& name, const std::string& summary, const std::string& help) {
  OpInfo info;
  info.name = name;
  info.family = "ocio";
  info.summary = summary;
  info.help =
      help +
      " What OpenColorIO's optimised processor holds of matrices, ranges, CDLs, exponents, logarithms, 1-D "
      "and 3-D LUTs runs as this program's own operations and folds with its neighbours; the rest (inverse, "
      "half-domain and hue-preserving LUTs, fixed functions, grading) runs in OpenColorIO's CPU processor "
      "within the same pass. An image whose space is unknown, and an EXR that says none, count as the "
      "config's role scene_linear, in the built-in config ACEScg. The result carries its own space and "
      "files are tagged with it; behind a LUT it is unknown, but for .cc, .ccc and .cdl. Alpha takes part "
      "only where a transform has it. A single channel, alone or beside alpha, is a grey, of which the "
      "result's red is kept; two without alpha are red and green, blue is 0, as in oiiotool. bake=N samples "
      "the whole transform into a shaper curve and an N x N x N table read with tetrahedra and prints the "
      "domain (the range of the image's colours) and the largest and RMS error and largest CIEDE2000 "
      "against the transform itself on 64 tiles of the image.";
  info.bound =
      "1e-5 of OpenColorIO's own result without optimisation losses; each operation as its own page says";
  return info;
}

OpInfo LutInfo() {
  OpInfo info = Row(
      "lut", "Apply a LUT file of any format that OpenColorIO reads",
      "FILE is a .cube, .spi1d, .spi3d, .spimtx, .3dl, .csp, .clf, .ctf, .cc, .ccc, .cdl, .lut, .look, .itx, "
      ".mga, .m3d, .cub, .vf or .icc. inverse=1 applies the inverse.");
  info.arguments = {TextParam("FILE", "the LUT file")};
  info.modifiers = {InterpParam(), FlagParam("inverse", "1 applies the inverse"), CccIdParam(), BakeParam()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return MaybeBaked(in[0], a, [&](const Node& n) { return ApplyLut(n, a.Text("FILE"), LutParamsOf(a)); });
  };
  return info;
}

OpInfo ColorConvertInfo() {
  OpInfo info = Row(
      "colorconvert", "Convert from one colour space of a config to another",
      "FROM and TO are colour spaces, aliases or roles of the config; FROM current, or \"\", is the space "
      "that the image is in. The built-in config has lin_rec709 (also linear), sRGB, Rec709, ACES2065-1, "
      "ACEScg, ACEScct, ACEScc, ADX10, camera logs and raw; its roles are those of OpenColorIO's ACES "
      "configs. strict=0 leaves the image alone where a space is unknown.");
  info.arguments = {TextParam("FROM", "colour space of the image, or current"),
                    TextParam("TO", "colour space of the result")};
  info.arguments[0].min_count = 0;
  AddConfigModifiers(info);
  info.modifiers.push_back(FlagParam("strict", "0 leaves the image alone where a space is unknown", "1"));
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const OcioParams params = OcioParamsOf(ColorConvertInfo(), a);
    const bool current = a.Text("FROM").empty() || a.Text("FROM") == "current";
    if (!a.Flag("strict") &&
        !((current || HasColorSpace(a.Text("FROM"), params)) && HasColorSpace(a.Text("TO"), params))) {
      return in[0];
    }
    return MaybeBaked(in[0], a,
                      [&](const Node& n) { return ColorConvert(n, a.Text("FROM"), a.Text("TO"), params); });
  };
  info.identity = "ACEScg ACEScg config=built-in";
  info.examples = {"ACEScg sRGB config=built-in", "linear ACEScct config=built-in",
                   "Rec709 ACEScg config=built-in"};
  return info;
}

OpInfo ToColorSpaceInfo() {
  OpInfo info = Row("tocolorspace", "Convert to a colour space of a config",
                    "From the space that the image is in, as --colorconvert current SPACE.");
  info.arguments = {TextParam("SPACE", "colour space of the result")};
  AddConfigModifiers(info);
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const OcioParams params = OcioParamsOf(ToColorSpaceInfo(), a);
    return MaybeBaked(in[0], a, [&](const Node& n) { return ColorConvert(n, "", a.Text("SPACE"), params); });
  };
  info.examples = {"sRGB config=built-in"};
  return info;
}

OpInfo OcioDisplayInfo() {
  OpInfo info = Row(
      "ociodisplay", "Apply a display and view of a config",
      "DISPLAY and VIEW are the config's; \"\" takes its default. The image is in the space from=, else in "
      "the one it carries (see --iscolorspace). looks= replaces the view's own. inverse=1 leads from the "
      "display to from=, else to scene_linear.");
  info.arguments = {TextParam("DISPLAY", "display of the config"), TextParam("VIEW", "view of that display")};
  for (ParamInfo& name : info.arguments) name.min_count = 0;  // "" is the config's default
  AddConfigModifiers(info);
  info.modifiers.push_back(TextParam("from", "colour space of the image"));
  info.modifiers.push_back(TextParam("looks", "looks in place of the view's own"));
  info.modifiers.push_back(FlagParam("inverse", "1 goes from the display to the image's space"));
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const OcioParams params = OcioParamsOf(OcioDisplayInfo(), a);
    const OcioDisplayParams display{a.Text("from"), a.Text("looks"), a.Flag("inverse")};
    return MaybeBaked(in[0], a, [&](const Node& n) {
      return OcioDisplay(n, a.Text("DISPLAY"), a.Text("VIEW"), display, params);
    });
  };
  info.examples = {"sRGB Un-tone-mapped from=ACEScg config=built-in"};
  return info;
}

OpInfo OcioLookInfo() {
  OpInfo info = Row(
      "ociolook", "Apply looks of a config",
      "LOOK is a look, or several: a,b one after the other, -a the inverse, a|b the first that works. from= "
      "and to= are the spaces of the image and of the result, with inverse=1 too (from= defaults as "
      "--ociodisplay's, to= to the image's).");
  info.arguments = {TextParam("LOOK", "looks of the config")};
  AddConfigModifiers(info);
  info.modifiers.push_back(TextParam("from", "colour space of the image"));
  info.modifiers.push_back(TextParam("to", "colour space of the result (default: that of the image)"));
  info.modifiers.push_back(FlagParam("inverse", "1 applies the inverse"));
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const OcioParams params = OcioParamsOf(OcioLookInfo(), a);
    const OcioLookParams look{a.Text("from"), a.Text("to"), a.Flag("inverse")};
    return MaybeBaked(in[0], a, [&](const Node& n) { return OcioLook(n, a.Text("LOOK"), look, params); });
  };
  return info;
}

OpInfo OcioFileTransformInfo() {
  OpInfo info = Row("ociofiletransform", "Apply a LUT file found along a config's search path",
                    "FILE is looked for along the search path of the config; --lut takes it as it stands.");
  info.arguments = {TextParam("FILE", "the LUT file")};
  AddConfigModifiers(info);
  info.modifiers.push_back(InterpParam());
  info.modifiers.push_back(FlagParam("inverse", "1 applies the inverse"));
  info.modifiers.push_back(CccIdParam());
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const OcioParams params = OcioParamsOf(OcioFileTransformInfo(), a);
    return MaybeBaked(in[0], a, [&](const Node& n) {
      return OcioFileTransform(n, a.Text("FILE"), LutParamsOf(a), params);
    });
  };
  return info;
}

std::vector<OpInfo> OcioRows() {
  return {LutInfo(),         ColorConvertInfo(), ToColorSpaceInfo(),
          OcioDisplayInfo(), OcioLookInfo(),     OcioFileTransformInfo()};
}

}  // namespace
}  // namespace tessera::ops

// Asked for by name by whoever links this component (cmake/component.cmake).
extern "C" {
TESSERA_API bool tessera_component_ocio =
    (tessera::ops::AddComponent({"ocio", "transfer", &tessera::ops::OcioRows}), true);
}
