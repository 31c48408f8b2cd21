// What an EXR file's header says that the packing of its pixels depends on.
#ifndef TESSERA_IO_CODEC_EXR_HEADER_H_
#define TESSERA_IO_CODEC_EXR_HEADER_H_

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace tessera::io {

struct ExrHeader {
  size_t end = 0;  // where the table of chunks begins
  std::vector<std::string> channels;
  bool increasing = true;
};

// False for what is no header of one part's scan lines.
bool ParseExrHeader(std::span<const unsigned char> file, ExrHeader& header);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_EXR_HEADER_H_
