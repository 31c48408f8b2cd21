// Refusals that name the limit, the subject and what was found.
#include "base/policy.h"

#include "tessera/context.h"
#include "tessera/error_kind.h"

namespace tessera::base {

void RequireAllowed(const std::string& subject, const std::array<int64_t, 3>& sides, int64_t channels) {
  const Policy policy = Context::Default().policy();
  const auto [width, height, depth] = sides;
  // Two sides fit 62 bits.
  if (width > 0 && height > 0 && depth > 0 && width * height > policy.pixels / depth) {
    throw DataError(subject, "found " + std::to_string(width) + " x " + std::to_string(height) +
                                 (depth > 1 ? " x " + std::to_string(depth) + " voxels" : " pixels") +
                                 ", over the limit pixels=" + std::to_string(policy.pixels));
  }
  if (channels > policy.channels) {
    throw DataError(subject, "found " + std::to_string(channels) +
                                 " channels, over the limit channels=" + std::to_string(policy.channels));
  }
}

}  // namespace tessera::base
