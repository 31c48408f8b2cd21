// Pixels of an opened file by OpenImageIO, a part at a time, and stopped at the first that cannot be read.
#ifndef TESSERA_IO_READ_ROWS_H_
#define TESSERA_IO_READ_ROWS_H_

#include <OpenImageIO/imageio.h>

#include <cstddef>
#include <string>

#include "tessera/roi.h"

namespace tessera::io {

// Where samples of channels [first, last) go, which are of this type, `pixel` and `row` bytes apart.
struct RowsOut {
  int first, last;
  OIIO::TypeDesc type;
  std::byte* data;
  ptrdiff_t pixel, row;
};

// Rows of the image that the reader is at, over its whole width; of a tiled one they begin where tiles do,
// and end there or with the image. False where the reader has something to say (ImageInput::geterror), even
// where it says that all was read: of strips and tiles that are missing it leaves the pixels as they are.
// What it says of many rows grows without limit, and then ends the program; so it is asked for some at a
// time.
bool ReadRows(OIIO::ImageInput& input, int subimage, const Roi& rows, const RowsOut& out);

// Throws Error naming the file where the reader would never end: it rounds rows up to whole strips in 32
// bits.
void CheckStrips(const std::string& file, const OIIO::ImageSpec& spec);

// Slices [z0, z1) of the image, counted from 0, packed one after the other; of a tiled one z0 is where tiles
// begin.
bool ReadSlices(OIIO::ImageInput& input, int subimage, int z0, int z1, int first, int last,
                OIIO::TypeDesc type, std::byte* data);

}  // namespace tessera::io

#endif  // TESSERA_IO_READ_ROWS_H_
