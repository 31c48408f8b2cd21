// Every row of the registry with each of its examples, as parameters of tests.
#ifndef TESSERA_TESTS_SUPPORT_CASES_H_
#define TESSERA_TESTS_SUPPORT_CASES_H_

#include <gtest/gtest.h>

#include <cctype>
#include <ostream>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/every_target.h"
#include "support/pictures.h"

namespace tessera::testing {

// One row with one of its examples, applied to pictures.
struct Case {
  const ops::OpInfo* op;
  std::string example;

  int Operands() const { return op->Operands(ops::ParseExample(*op, example)); }
  Node On(const std::vector<Node>& inputs, const ImageSpec& spec) const {
    return op->make(inputs, ops::ParseExample(*op, example), op->generator ? &spec : nullptr);
  }
  // On pictures of this window, type and channel count.
  Node Make(const Roi& window, int channels, PixelType type, Content content = Content::kOrdinary,
            bool unpacked = false) const {
    std::vector<Node> inputs;
    for (int k = 0; k < Operands(); ++k) {
      const Image picture = Picture(window, channels, type, 7u * static_cast<uint32_t>(k) + 1, content);
      inputs.push_back(FromImage(unpacked ? Unpacked(picture) : picture));
    }
    return On(inputs, Picture(window, channels, type, 0).spec());
  }
};

// gtest prints it beside a parameterised test's name.
inline void PrintTo(const Case& c, std::ostream* out) { *out << c.op->name << " " << c.example; }

inline std::vector<Case> AllCases() {
  std::vector<Case> cases;
  for (const ops::OpInfo& op : ops::Registry()) {
    for (const std::string& example : op.examples) cases.push_back({&op, example});
  }
  return cases;
}

inline std::string CaseName(const ::testing::TestParamInfo<Case>& info) {
  std::string name = info.param.op->name;
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name + "_" + std::to_string(info.index);
}

// Rows alone, for what depends on no example.
inline std::vector<const ops::OpInfo*> AllRows() {
  std::vector<const ops::OpInfo*> rows;
  for (const ops::OpInfo& op : ops::Registry()) rows.push_back(&op);
  return rows;
}
inline std::string RowName(const ::testing::TestParamInfo<const ops::OpInfo*>& info) {
  return info.param->name;
}

inline const Roi kWindow{-5, 3, 48, 22};  // 53 x 19, off the origin

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_CASES_H_
