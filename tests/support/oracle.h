// What the reference makes of a command, for tests that judge the reference itself by values from elsewhere.
#ifndef TESSERA_TESTS_SUPPORT_ORACLE_H_
#define TESSERA_TESTS_SUPPORT_ORACLE_H_

#include <string>
#include <vector>

#include "ops/registry.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/render.h"
#include "verify/evaluate.h"

namespace tessera::testing {

inline reference::ImageD ReferenceOf(const Node& node) {
  verify::ReferenceEngine engine([](const std::string&) { return 0.0; });
  return engine.Evaluate(node, node.spec().data_window).value;
}

// A row of the registry with words as in its examples, on these operands.
inline Node Command(const std::string& name, const std::string& words, const std::vector<Node>& operands) {
  const ops::OpInfo& op = *ops::FindOp(name);
  return op.make(operands, ops::ParseExample(op, words), nullptr);
}

// One row of float pixels, all with as many channels as the first.
inline Node Row(const std::vector<std::vector<float>>& pixels) {
  ImageSpec spec(static_cast<int>(pixels.size()), 1, static_cast<int>(pixels[0].size()));
  spec.type = PixelType::kFloat;
  const Image image(spec);
  for (size_t x = 0; x < pixels.size(); ++x) {
    for (size_t c = 0; c < pixels[0].size(); ++c)
      image.at<float>(static_cast<int>(x), 0, static_cast<int>(c)) = pixels[x][c];
  }
  return FromImage(image);
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_ORACLE_H_
