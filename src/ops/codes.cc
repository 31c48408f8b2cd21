// Which images hold codes.
#include "ops/codes.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "graph/op.h"

namespace tessera::ops {

bool IsCode(double value, PixelType type) {
  const double code = value * LargestCode(type);
  return value >= 0 && value <= 1 && code == std::round(code);
}

bool HoldsCodes(const Node& image) {
  const graph::NodeData& d = *image.data();
  if (LargestCode(d.spec.type) == 0) return false;
  switch (d.op->Kind()) {
    case graph::OpKind::kSource:
      return true;
    case graph::OpKind::kCrop:
      return HoldsCodes(d.inputs[0]) && d.inputs[0].spec().type == d.spec.type;
    case graph::OpKind::kShuffle: {
      std::vector<ImageSpec> specs;
      for (const Node& in : d.inputs) {
        if (!HoldsCodes(in) || in.spec().type != d.spec.type) return false;
        specs.push_back(in.spec());
      }
      const std::vector<graph::ChannelRef> map = d.op->ChannelMap(specs);
      return std::all_of(map.begin(), map.end(), [&](const graph::ChannelRef& ref) {
        return ref.input >= 0 || IsCode(double{ref.value}, d.spec.type);
      });
    }
    default:
      return false;
  }
}

PixelType CodesOf(const Node& image) { return HoldsCodes(image) ? image.spec().type : PixelType::kFloat; }

}  // namespace tessera::ops
