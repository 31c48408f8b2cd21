/// Pixels of a result where they were stored: somebody's memory, or a file that is decoded again. @file
#ifndef TESSERA_STORED_H_
#define TESSERA_STORED_H_

#include <functional>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"

TESSERA_API_BEGIN
namespace tessera {

/// Pixels that VerifyStored reads, a few rows at a time.
struct StoredPixels {
  Roi window;                          ///< the part of the result that is held
  std::vector<int> channels;           ///< of the result, in the order in which they are held
  PixelType type = PixelType::kFloat;  ///< of the samples as they are read
  int bits = 0;           ///< integers that are held in fewer bits than the type has: their number
  int unassociated = -1;  ///< the held channel that is alpha where colours are held without it, or -1
  std::vector<std::string> remarks;  ///< what a reader of a comparison has to know

  /// Fills rows of the whole window's width: interleaved, the held channels, the type. Throws Error.
  std::function<void(const ImageView& rows)> read;
};

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_STORED_H_
