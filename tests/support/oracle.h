// What the reference makes of a node, for tests that judge the reference itself by values from elsewhere.
#ifndef TESSERA_TESTS_SUPPORT_ORACLE_H_
#define TESSERA_TESTS_SUPPORT_ORACLE_H_

#include <string>

#include "tessera/node.h"
#include "verify/evaluate.h"

namespace tessera::testing {

inline reference::ImageD ReferenceOf(const Node& node) {
  verify::ReferenceEngine engine([](const std::string&) { return 0.0; });
  return engine.Evaluate(node, node.spec().data_window).value;
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_ORACLE_H_
