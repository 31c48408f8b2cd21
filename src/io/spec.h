// Between our ImageSpec and OpenImageIO's: types, windows, channels, metadata; and its messages on one line.
#ifndef TESSERA_IO_SPEC_H_
#define TESSERA_IO_SPEC_H_

#include <OpenImageIO/imageio.h>

#include <optional>
#include <string>
#include <string_view>

#include "tessera/image.h"

namespace tessera::io {

OIIO::TypeDesc TypeDescOf(PixelType type);
// Empty for a type that is none of ours.
std::optional<PixelType> PixelTypeOf(OIIO::TypeDesc type);
// The type that an image of that spec is read as: the widest of its channels' when it is one of ours, else
// float.
PixelType StorageType(const OIIO::ImageSpec& spec);

// Tile sizes become the attributes tile_width and tile_height, what is said of colours the colour state.
ImageSpec SpecFrom(const OIIO::ImageSpec& spec);
// Without tiles; metadata as it is. Attributes tile_width and tile_height are left to the writer.
OIIO::ImageSpec SpecTo(const ImageSpec& spec, PixelType type);

Attribute AttributeFrom(const OIIO::ParamValue& value);
// Sets or replaces; an attribute without any value erases. Throws Error when type and value do not agree.
void SetAttribute(OIIO::ImageSpec& spec, const Attribute& attribute);

// The inverse of TypeDesc::c_str, which OpenImageIO's own parser is not for every type ("rational2i").
OIIO::TypeDesc ParseType(const std::string& name);

// A message of OpenImageIO on one line, with `temporary` (where not empty) replaced by `shown`.
std::string OneLine(std::string_view message, const std::string& temporary = "",
                    const std::string& shown = "");

// Scanlines that EXR compresses together; 1 for other formats.
int ChunkRows(const std::string& format, const OIIO::ImageSpec& spec);

}  // namespace tessera::io

#endif  // TESSERA_IO_SPEC_H_
