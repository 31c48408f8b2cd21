// Whether a written ICO holds its picture, found without a reader.
#ifndef TESSERA_IO_ICO_CHECK_H_
#define TESSERA_IO_ICO_CHECK_H_

#include <string>

#include "base/digest.h"

namespace tessera::io {

// Of an ICO of one image of 1 to 4 channels of 8 bits, as OpenImageIO writes it: whether the rows that the
// digest was made of (base::AddToDigest, one after the other from the top) are in the file. Of one that is a
// PNG inside: whether that has an end.
bool IcoHolds(const std::string& file, int width, int height, int channels, const base::Digest& digest);

}  // namespace tessera::io

#endif  // TESSERA_IO_ICO_CHECK_H_
