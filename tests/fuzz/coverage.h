// Which way an input took through a library that was compiled with TESSERA_FUZZ by gcc.
#ifndef TESSERA_TESTS_FUZZ_COVERAGE_H_
#define TESSERA_TESTS_FUZZ_COVERAGE_H_

#include <cstddef>
#include <string>

#include "random/draw.h"

namespace tessera::fuzz {

// Takes note of what ran since the last call. True where a block ran that had not run before, or one ran as
// many times more or less as none had. Always false without coverage.
bool TookANewWay();
// Blocks that have run at all; 0 without coverage.
size_t BlocksSeen();
// A number that an integer was compared with lately, as bytes; empty for none.
std::string ComparedWith(random::Draw& draw);

}  // namespace tessera::fuzz

#endif  // TESSERA_TESTS_FUZZ_COVERAGE_H_
