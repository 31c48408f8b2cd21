// Between what files say of their colours and an image's colour state.
#ifndef TESSERA_IO_COLOR_STATE_H_
#define TESSERA_IO_COLOR_STATE_H_

#include <OpenImageIO/imageio.h>

#include <string>
#include <vector>

#include "tessera/color_state.h"

namespace tessera::io {

// What the file says, the surest first: colorInteropID, an ICC profile, CICP, chromaticities,
// oiio:ColorSpace.
ColorState ColorStateOf(const OIIO::ImageSpec& spec);
// Sets oiio:ColorSpace as OpenImageIO's writers want it, or takes it off.
void SetColorSpace(OIIO::ImageSpec& spec, const ColorState& color);
// What EXR has for it besides: chromaticities of linear light, colorInteropID.
void SetExrColorState(OIIO::ImageSpec& spec, const ColorState& color);

// The H.273 codes of a space that oiio:ColorSpace does not say, as the attribute CICP (PNG's chunk cICP).
void SetCodePoints(OIIO::ImageSpec& spec, const ColorState& color);

// The name of the known space that a profile describes, empty for none.
std::string SpaceOfIccProfile(const std::vector<std::byte>& profile);

}  // namespace tessera::io

#endif  // TESSERA_IO_COLOR_STATE_H_
