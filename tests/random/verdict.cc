// The one place that asks Verify.
#include "random/verdict.h"

#include "tessera/verify.h"

namespace tessera::random {

std::optional<std::string> WrongVerdict(const Node& node, PixelType type) {
  VerifyOptions options{.samples = 4, .tile_size = 16, .render = {}};
  options.render.threads = 1;
  const VerifyReport honest = Verify(node, type, options);
  if (!honest.within_bound) return "condemned: " + honest.Summary();
  return std::nullopt;
}

}  // namespace tessera::random
