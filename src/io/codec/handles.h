// Rows by OpenImageIO itself, of which every worker has the file open for itself: for files whose chunks do
// not depend on each other, but are unpacked by nobody else.
#ifndef TESSERA_IO_CODEC_HANDLES_H_
#define TESSERA_IO_CODEC_HANDLES_H_

#include <string>

#include "io/codec/codec.h"

namespace tessera::io {

// `rows`: of a chunk; of a file with tiles, those of a tile.
Choice<Decoder> MakeHandlesDecoder(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                                   int last, int rows);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_HANDLES_H_
