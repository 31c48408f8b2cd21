// OpenColorIO configs from strangers, as --colorconfig reads them.
#include <OpenColorIO/OpenColorIO.h>

#include "fuzz/fuzz.h"
#include "fuzz/operations.h"
#include "random/values.h"
#include "tessera/ocio.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  const random::WordSource words({}, Folder());  // writes one
  return {
      Contents(Folder() + "/config.ocio"),
      "ocio_profile_version: 1\nroles:\n  default: a\ncolorspaces:\n"
      "  - !<ColorSpace>\n    name: a\n    to_reference: !<FileTransform> {src: cube.cube, interpolation: linear}\n"};
}
std::vector<std::string> Words() {
  return {"ocio_profile_version: 2.1",
          "search_path: ",
          "- !<ColorSpace> {name: ",
          "- !<View> {name: ",
          "- !<Look> {name: ",
          "!<FileTransform> {src: ",
          "!<GroupTransform> {children: [",
          "!<ColorSpaceTransform> {src: lin, dst: video}",
          "!<LookTransform> {src: lin, dst: video, looks: warm}",
          "!<BuiltinTransform> {style: ACEScct_to_ACES2065-1}",
          "!<LogTransform> {base: 2}",
          "!<RangeTransform> {",
          "!<AllocationTransform> {allocation: lg2, vars: [-8, 8]}",
          "!<FixedFunctionTransform> {style: ACES_RedMod03}",
          "$VAR",
          "environment: {}",
          "&a",
          "*a",
          "<<: *a",
          "lin",
          "video",
          "from_scene_reference: ",
          "to_reference: ",
          "display_colorspaces:",
          "view_transforms:",
          "named_transforms:",
          "shared_views:",
          "inherits: ",
          "\n  ",
          "{",
          "}",
          "[",
          "]",
          ": ",
          ", "};
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const Node kPicture = fuzz::SmallPicture(3);
  static fuzz::File file("stranger.ocio");
  const OcioParams params = {.config = file.Put({reinterpret_cast<const char*>(data), size})};
  fuzz::Try([&] { fuzz::RenderSmall(ColorConvert(kPicture, "lin", "video", params)); });
  fuzz::Try([&] { fuzz::RenderSmall(OcioDisplay(kPicture, "", "", {}, params)); });
  fuzz::Try([&] { OcioLook(kPicture, "warm", {}, params); });
  OCIO_NAMESPACE::ClearAllCaches();  // they go by names
  return 0;
}
