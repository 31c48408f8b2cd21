// A file that was just written, decoded again: what --verify looks at.
#ifndef TESSERA_IO_READ_BACK_H_
#define TESSERA_IO_READ_BACK_H_

#include <OpenImageIO/imageio.h>

#include <optional>
#include <string>
#include <vector>

#include "base/digest.h"
#include "tessera/node.h"
#include "tessera/render.h"
#include "tessera/stored.h"

namespace tessera::io {

// Where an image's pixels are in a file.
struct FileLayout {
  std::string file, shown, format;     // its name now, that in messages, OpenImageIO's name of the format
  OIIO::ImageSpec spec;                // as it was written
  Roi window, data;                    // the image's pixels that are in the file, and those that there are
  std::vector<int> channels;           // of the image, as they were written
  PixelType type = PixelType::kFloat;  // of the rows that were written
  int part = 0;                        // of the file's images
};

// The file's pixels. Where the format does not keep what it is given, the node's, evaluated again. Throws
// Error where the file cannot be opened again or is another than was written.
StoredPixels ReadBack(const FileLayout& layout, const Node& node, const RenderOptions& render);

// Of the rows that the file holds, as base::AddToDigest is given them one by one; none where the format does
// not keep what it is given, though there too all rows must be readable. Throws Error as ReadBack.
std::optional<base::Digest> StoredDigest(const FileLayout& layout);

}  // namespace tessera::io

#endif  // TESSERA_IO_READ_BACK_H_
