// Codes: the whole numbers of 8- and 16-bit images, and the images whose samples are sure to be some.
#ifndef TESSERA_OPS_CODES_H_
#define TESSERA_OPS_CODES_H_

#include "tessera/image.h"
#include "tessera/node.h"

namespace tessera::ops {

// Of images of bytes and words; else 0.
inline int LargestCode(PixelType type) {
  return type == PixelType::kUint8 ? 255 : type == PixelType::kUint16 ? 65535 : 0;
}
bool IsCode(double value, PixelType type);

// Whether all samples of an image are codes of its type: its pixels come from a source and nothing was done
// to them but to choose channels and windows.
bool HoldsCodes(const Node& image);
// The type that all samples are codes of, or kFloat: an image that was computed has its source's type and any
// values.
PixelType CodesOf(const Node& image);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CODES_H_
