/// What an image's numbers mean: its colour space, and whether colours are multiplied by alpha. @file
#ifndef TESSERA_COLOR_STATE_H_
#define TESSERA_COLOR_STATE_H_

#include <cstddef>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// Files and conversions of colour set it, every other operation passes on that of its first image, and files
/// are tagged with it. An ImageSpec carries it in its metadata under OpenImageIO's names, oiio:ColorSpace and
/// oiio:UnassociatedAlpha.
struct ColorState {
  /// The colour space's name as files and OpenColorIO configs have it ("ACEScg", "sRGB"); the role
  /// "scene_linear": light of primaries that only the config knows; empty: unknown.
  std::string space = {};
  bool premultiplied = true;  ///< colours have been multiplied by alpha

  /// The same name and the same alpha.
  bool operator==(const ColorState&) const = default;
};

/// The state that a spec carries.
ColorState ColorStateOf(const ImageSpec& spec);

/// Gives it another. Where the space becomes another, the metadata that told of the old one (ICC profile,
/// chromaticities, colorInteropID, ...) are dropped.
void SetColorState(ImageSpec& spec, const ColorState& color);

/// The same samples under another state; a profile that is given is kept as ICCProfile, in place of any
/// other.
Node WithColorState(const Node& image, const ColorState& color,
                    const std::vector<std::byte>& icc_profile = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_COLOR_STATE_H_
