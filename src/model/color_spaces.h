// Colour spaces that files, configs and OpenImageIO call by many names: what is known of each.
#ifndef TESSERA_MODEL_COLOR_SPACES_H_
#define TESSERA_MODEL_COLOR_SPACES_H_

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::model {

struct ColorSpace {
  // As an image carries it, then what else it is called: in OpenColorIO's ACES configs, by the Color Interop
  // Forum, in ICC profiles. Compared regardless of case.
  std::vector<std::string> names;
  std::string interop;  // the Color Interop Forum's identifier, EXR's colorInteropID
  std::string oiio;     // oiio:ColorSpace as OpenImageIO's writers know it; empty: they know none
  bool linear = false;
  // x and y of red, green, blue and white, as EXR has them; of linear spaces.
  std::array<float, 8> chromaticities = {};
  // ITU-T H.273: colour primaries and transfer characteristics; 0 for none.
  int cicp_primaries = 0, cicp_transfer = 0;

  const std::string& name() const { return names[0]; }
};

// Light of primaries that only the config knows: OpenImageIO's "Linear", OpenColorIO's role.
inline constexpr char kSceneLinear[] = "scene_linear";

const std::vector<ColorSpace>& ColorSpaces();
// By any of its names; null for one that is not known.
const ColorSpace* FindColorSpace(std::string_view name);
// By EXR's chromaticities, within their usual rounding; null for none.
const ColorSpace* FindColorSpace(const std::array<float, 8>& chromaticities);
// By H.273's codes; null for none.
const ColorSpace* FindColorSpace(int primaries, int transfer);
// Whether both names are of one space.
bool SameColorSpace(std::string_view a, std::string_view b);

}  // namespace tessera::model
TESSERA_API_END

#endif  // TESSERA_MODEL_COLOR_SPACES_H_
