// What several peers need to know about our operations beyond their affine map.
#ifndef TESSERA_BENCH_PEERS_PEERS_H_
#define TESSERA_BENCH_PEERS_PEERS_H_

#include <optional>
#include <utility>
#include <vector>

#include "task.h"

namespace tessera::bench {

// Lower and upper limits of a clamp step, four each; nothing when they are not given as one or four numbers.
std::optional<std::pair<std::vector<double>, std::vector<double>>> ClampRange(const Step& step);

// True when the step's luminance weights are Rec. 709's, the only ones that the peers' saturation knows.
bool IsRec709(const Step& step);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_PEERS_PEERS_H_
