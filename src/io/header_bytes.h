// What a file's header declares is there: some readers take memory for it first.
#ifndef TESSERA_IO_HEADER_BYTES_H_
#define TESSERA_IO_HEADER_BYTES_H_

#include <string>

namespace tessera::io {

// Throws Error naming the file for a part of its header (an EXR's attribute, a DPX's user data) that declares
// more bytes than the file has. Files that are not of the format are left to its reader.
void CheckHeaderBytes(const std::string& file, const std::string& format);

}  // namespace tessera::io

#endif  // TESSERA_IO_HEADER_BYTES_H_
