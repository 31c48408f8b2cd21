// Verify's own verdict against what is known.
#ifndef TESSERA_TESTS_RANDOM_VERDICT_H_
#define TESSERA_TESTS_RANDOM_VERDICT_H_

#include <optional>
#include <string>

#include "tessera/node.h"

namespace tessera::random {

// In words: an honest result that was condemned, or one with a wrong sample that was passed.
std::optional<std::string> WrongVerdict(const Node& node, PixelType type);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_VERDICT_H_
