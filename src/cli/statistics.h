// An image's extremes in one streamed pass.
#ifndef TESSERA_CLI_STATISTICS_H_
#define TESSERA_CLI_STATISTICS_H_

#include <vector>

#include "cli/session.h"

namespace tessera::cli {

// Of each channel, over its finite values; 0 where it has none.
struct ColorExtremes {
  std::vector<double> min, max, mean;
};
ColorExtremes ExtremesOf(const Entry& entry, const RenderOptions& render);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_STATISTICS_H_
