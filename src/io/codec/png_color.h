// PNG's chunk cICP (PNG specification, third edition, 11.3.2.6): the codes of ITU-T H.273 for its colours,
// which OpenImageIO 2.4 neither reads nor writes.
#ifndef TESSERA_IO_CODEC_PNG_COLOR_H_
#define TESSERA_IO_CODEC_PNG_COLOR_H_

#include <OpenImageIO/imageio.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tessera::io {

// The attribute CICP from the file's chunk, where it has one of RGB and full range.
void ReadPngCodePoints(const std::string& file, OIIO::ImageSpec& spec);
// The chunk of the attribute CICP behind the header chunk of a file's first chunks, unless there is one.
void AddPngCodePoints(const OIIO::ImageSpec& spec, std::vector<uint8_t>& chunks);

}  // namespace tessera::io

#endif  // TESSERA_IO_CODEC_PNG_COLOR_H_
