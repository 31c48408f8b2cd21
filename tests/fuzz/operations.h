// Operations of the registry for fuzz targets: their words, and small pictures to try them on.
#ifndef TESSERA_TESTS_FUZZ_OPERATIONS_H_
#define TESSERA_TESTS_FUZZ_OPERATIONS_H_

#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "tessera/image.h"
#include "tessera/node.h"

namespace tessera::fuzz {

// Names, parameters, choices and values of examples of every row.
std::vector<std::string> RegistryWords();
// Values of one parameter in the examples of every row that has it.
std::vector<std::string> ExamplesOf(const std::string& parameter);

// 9 x 7 pixels of all kinds, R,G,B,A or fewer.
Node SmallPicture(int channels = 4);

// Renders what is small enough.
void RenderSmall(const Node& node);

// The operation with these words on small pictures, rendered where it takes little time; what it refuses is
// thrown.
using Modifiers = std::vector<std::pair<std::string, std::string>>;
void ApplyTo(const std::string& operation, const std::vector<std::string>& positional,
             const Modifiers& modifiers);

}  // namespace tessera::fuzz

#endif  // TESSERA_TESTS_FUZZ_OPERATIONS_H_
