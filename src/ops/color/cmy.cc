// CMY: the complement of R, G, B.
#include "ops/color/color_ops.h"

namespace tessera {
namespace ops {
OpInfo CmyInfo() {
  OpInfo info;
  info.name = "cmy";
  info.family = "color";
  info.summary = "Cyan, magenta, yellow: 1 - (R,G,B)";
  info.help =
      "R,G,B become 1 - R, 1 - G, 1 - B under the same channel names; alpha and further channels are kept. "
      "It is its own inverse. Meant for unpremultiplied colours. Source: McReynolds et al. 1997, 12.2.4.";
  info.bound = "u (1 + |v|)";
  info.bound_u = 1;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Cmy(in[0]); };
  info.examples = {""};
  return info;
}

}  // namespace ops

Node Cmy(const Node& image) { return ops::MakeScaleBiasNode("cmy", image, -1, 1, CmyParams()); }

}  // namespace tessera
