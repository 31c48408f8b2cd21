// What is checked of an EXR file's headers before OpenEXR reads them.
#ifndef TESSERA_IO_EXR_HEADER_H_
#define TESSERA_IO_EXR_HEADER_H_

#include <string>

namespace tessera::io {

// Throws Error naming the file for an attribute that declares more bytes than follow.
void CheckExrHeader(const std::string& file);

}  // namespace tessera::io

#endif  // TESSERA_IO_EXR_HEADER_H_
