/// The instruction sets that kernels were compiled for, and how to force one. @file
#ifndef TESSERA_TARGETS_H_
#define TESSERA_TARGETS_H_

#include <string>
#include <vector>

#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera {

/// Names of the compiled targets that this CPU can run, best first: "AVX3", "AVX2", "SSE4"
/// on x86-64.
std::vector<std::string> SimdTargets();

/// The name of the one that the next evaluation uses.
std::string SimdTarget();

/// Forces a target for every later evaluation of the process; "auto" returns to the best. Not to be called
/// during an evaluation. Throws Error naming the available targets when `name` is none of them.
void SetSimdTarget(const std::string& name);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_TARGETS_H_
