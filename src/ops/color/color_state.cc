// The command that says which colour space an image is in; the state itself is the graph's.
#include "tessera/color_state.h"

#include "ops/color/color_ops.h"
#include "ops/modifiers.h"

namespace tessera::ops {

OpInfo ColorStateInfo() {
  OpInfo info;
  info.name = "iscolorspace";
  info.family = "ocio";
  info.summary = "Say which colour space the image is in";
  info.help =
      "No sample changes. An image carries the name of its colour space: files bring it (EXR's "
      "colorInteropID and chromaticities, CICP, an ICC profile that names a known space, oiio:ColorSpace), "
      "conversions set it, every other command passes on that of its first image. --colorconvert current, "
      "--tocolorspace, --ociodisplay and --ociolook start from it, and files are tagged with it. SPACE "
      "takes its place, with --iscolorspace \"\" nothing is known; ICC profile and tags of another space "
      "are dropped. As oiiotool --iscolorspace.";
  info.bound = "exact";
  ParamInfo space = TextModifier("SPACE", "a name of the config in use, or \"\"");
  space.min_count = 0;
  info.arguments = {space};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return WithColorState(in[0], {a.Text("SPACE"), ColorStateOf(in[0].spec()).premultiplied});
  };
  info.examples = {"ACEScg"};
  info.identity = "ACEScg";
  return info;
}

}  // namespace tessera::ops
