// The same check on every instruction set that kernels were compiled for and this processor runs.
#ifndef TESSERA_TESTS_SUPPORT_EVERY_TARGET_H_
#define TESSERA_TESTS_SUPPORT_EVERY_TARGET_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tessera/targets.h"

namespace tessera::testing {

// Restores the best instruction set when a test leaves.
struct AutoTarget {
  ~AutoTarget() { SetSimdTarget("auto"); }
};

// Whether there is this one: presets of sanitizers compile fewer.
inline bool HasTarget(const std::string& name) {
  const std::vector<std::string> all = SimdTargets();
  return std::find(all.begin(), all.end(), name) != all.end();
}
inline bool HasBothFusedTargets() { return HasTarget("AVX2") && HasTarget("AVX3"); }

template <class F>
void OnEveryTarget(F check) {
  const AutoTarget restore;
  for (const std::string& target : SimdTargets()) {
    SCOPED_TRACE(target);
    SetSimdTarget(target);
    check();
  }
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_EVERY_TARGET_H_
