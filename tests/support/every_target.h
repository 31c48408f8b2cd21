// The same check on every instruction set that kernels were compiled for and this processor runs.
#ifndef TESSERA_TESTS_SUPPORT_EVERY_TARGET_H_
#define TESSERA_TESTS_SUPPORT_EVERY_TARGET_H_

#include <gtest/gtest.h>

#include <string>

#include "tessera/targets.h"

namespace tessera::testing {

template <class F>
void OnEveryTarget(F check) {
  for (const std::string& target : SimdTargets()) {
    SCOPED_TRACE(target);
    SetSimdTarget(target);
    check();
  }
  SetSimdTarget("auto");
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_EVERY_TARGET_H_
