// The reader of an image file, chosen by what the file begins with among formats that are stood behind.
#ifndef TESSERA_IO_OPEN_INPUT_H_
#define TESSERA_IO_OPEN_INPUT_H_

#include <OpenImageIO/imageio.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "tessera/io.h"

namespace tessera::io {

// Opens the file, which exists, in this process. Throws Error naming it for what no reader takes, and, with
// Formats::kTrusted, for formats off the list.
std::unique_ptr<OIIO::ImageInput> OpenImage(const std::string& file, Formats formats);

// Whether the file begins as one of a format on the list, and has no other's name.
bool IsListed(const std::string& file);

// Whether a format of OpenImageIO is on the list.
bool IsTrusted(std::string_view format);

// Throws Error for a header that declares more than the file's bytes can hold as they are packed.
void CheckPlausible(const std::string& file, const std::string& format, const OIIO::ImageSpec& spec,
                    int64_t file_bytes);

// Throws Error for a header of deep pixels, of no pixels or of more than is read, and as CheckPlausible.
void CheckSpec(const std::string& file, const std::string& format, const OIIO::ImageSpec& spec,
               int64_t file_bytes);

}  // namespace tessera::io

#endif  // TESSERA_IO_OPEN_INPUT_H_
