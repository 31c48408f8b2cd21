// Verify's own verdict against what is known.
#ifndef TESSERA_TESTS_RANDOM_VERDICT_H_
#define TESSERA_TESTS_RANDOM_VERDICT_H_

#include <cstdint>
#include <optional>
#include <string>

#include "random/tally.h"
#include "tessera/node.h"

namespace tessera::random {

// In words: `result`, which is right, was condemned; or it was passed with one wrong sample, which is written
// into it. Which one follows from `number`.
std::optional<std::string> WrongVerdict(const Node& node, const ImageView& result, uint64_t number,
                                        Tally& tally);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_VERDICT_H_
