// Images whose windows differ, made alike: 0 where one has no pixel.
#ifndef TESSERA_OPS_UNION_H_
#define TESSERA_OPS_UNION_H_

#include <algorithm>
#include <vector>

#include "tessera/node.h"
#include "tessera/ops/channels.h"
#include "tessera/roi.h"

namespace tessera::ops {

// Each image cropped to the union of all data windows; as they are where one is null, for MakeNode to refuse.
inline std::vector<Node> OnUnion(std::vector<Node> images) {
  if (std::any_of(images.begin(), images.end(), [](const Node& image) { return !image; })) return images;
  Roi all;
  for (const Node& image : images) all = Union(all, image.spec().data_window);
  for (Node& image : images) {
    if (image.spec().data_window != all) image = Crop(image, all);
  }
  return images;
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_UNION_H_
