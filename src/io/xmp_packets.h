// Where files hold XMP, for a look at it before OpenImageIO's reader takes it.
#ifndef TESSERA_IO_XMP_PACKETS_H_
#define TESSERA_IO_XMP_PACKETS_H_

#include <string>

namespace tessera::io {

// Throws Error naming the file, a PNG, JPEG or TIFF by its `format`, for XMP that would take its reader
// without end (XmpBudget), and for a PNG's texts that unpack to more than 256 MiB. Files that are not of the
// format, or damaged, are left to its reader.
void CheckXmp(const std::string& file, const std::string& format);

}  // namespace tessera::io

#endif  // TESSERA_IO_XMP_PACKETS_H_
