/// Metadata items made of text, and text made of them. @file
#ifndef TESSERA_METADATA_H_
#define TESSERA_METADATA_H_

#include <optional>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"

TESSERA_API_BEGIN
namespace tessera {

/// An item of the given OpenImageIO type ("int", "float[3]", "rational", "timecode", "matrix", "string"),
/// from comma-separated numbers, HH:MM:SS:FF for a timecode, A/B for a rational. Without a type it is an int
/// or a float where the text is one, else a string. Throws Error: no such type, text that is no such value.
Attribute ParseAttribute(const std::string& name, const std::string& text, const std::string& type = "");

/// The value in words, as OpenImageIO prints it, without quotes.
std::string AttributeText(const Attribute& attribute);

/// The value in words of an item, or of what OpenImageIO knows an image by ("width", "full_x", "nchannels",
/// "channelnames", "geom"), of the spec with `own` over its metadata. Empty optional for none.
std::optional<std::string> DescribedValue(const ImageSpec& spec, const std::vector<Attribute>& own,
                                          const std::string& name);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_METADATA_H_
