// The shortest case that still fails, and a line that shows it.
#ifndef TESSERA_TESTS_RANDOM_SHRINK_H_
#define TESSERA_TESTS_RANDOM_SHRINK_H_

#include <functional>
#include <string>

#include "random/compare.h"
#include "random/generate.h"

namespace tessera::random {

// Whether a case still fails in the same way; a case that cannot be built does not.
using Fails = std::function<bool(const Case&)>;
// Tries fewer operations, simpler arguments, smaller and simpler pictures until nothing more can be left
// away, or `tries` cases have been looked at.
Case Shrunk(Case c, const Fails& fails, int tries = 400);

// The same for a finding, which the same comparison makes again; within so many seconds.
Case ShrunkOf(const Case& c, const Finding& finding, Comparer& comparer, double seconds);

// A command line that computes the case: generators where the pictures can be made by them, else file names
// that tell what they hold ("photograph.3.uint8.tif").
std::string CommandLine(const Case& c);
// Every word of the case, whatever a command line cannot say included.
std::string InWords(const Case& c);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_SHRINK_H_
