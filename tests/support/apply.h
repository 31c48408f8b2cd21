// Operations of the registry by name, for tests that build graphs of them.
#ifndef TESSERA_TESTS_SUPPORT_APPLY_H_
#define TESSERA_TESTS_SUPPORT_APPLY_H_

#include <string>
#include <vector>

#include "ops/registry.h"
#include "tessera/error.h"

namespace tessera::testing {

// An operation and its argument line, as in OpInfo::examples.
struct Words {
  std::string op, arguments;
};

inline Node Apply(const Words& words, const std::vector<Node>& inputs) {
  const ops::OpInfo* const info = ops::FindOp(words.op);
  if (info == nullptr) throw Error(words.op, "is no operation");
  return info->make(inputs, ops::ParseExample(*info, words.arguments), nullptr);
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_APPLY_H_
