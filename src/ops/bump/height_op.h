// What operations on heights, the first channel of an image, have in common.
#ifndef TESSERA_OPS_BUMP_HEIGHT_OP_H_
#define TESSERA_OPS_BUMP_HEIGHT_OP_H_

#include <string>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "ops/registry.h"

namespace tessera::ops {

template <class P>
class HeightOp : public graph::OpWith<P> {
 public:
  using graph::OpWith<P>::OpWith;
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), false);
    needed[0] = true;
    return needed;
  }

 protected:
  static ImageSpec SpecWith(std::span<const ImageSpec> inputs, std::vector<std::string> channels) {
    ImageSpec spec = inputs[0];
    spec.channels = std::move(channels);
    spec.alpha = -1;
    return spec;
  }
};

// Codes hold a picture: heights from 0 to 1 are as high as a tenth of its width, and no result is negative.
inline bool HoldsCodes(const ImageSpec& spec) {
  return spec.type == PixelType::kUint8 || spec.type == PixelType::kUint16;
}
// The argument `scale`, or what it is where it was not given.
inline double HeightScale(const Arguments& a, const ImageSpec& spec) {
  if (a.Given("scale")) return a.Number("scale");
  const Roi& frame = spec.display_window.empty() ? spec.data_window : spec.display_window;
  return HoldsCodes(spec) ? 0.1 * frame.width() : 1;
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_BUMP_HEIGHT_OP_H_
