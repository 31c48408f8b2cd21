// Every operation from pixels of a type straight to pixels of the same type, which is where kernels have ways
// of their own: the same as through planes of floats.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/registry.h"
#include "support/pictures.h"
#include "support/test_ops.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using testing::Content;
using testing::ExpectSameBits;
using testing::Picture;
using testing::UnifyNans;

// Rows of whole blocks, of groups of pixels and of less than a group; every loop of every vector length has
// a rest.
const Roi kWindows[] = {{-5, 3, -5 + 2 * kBlockPixels + 61, 5}, {-5, 3, 42, 8}};

struct Row {
  const ops::OpInfo* op;
  std::string example;
};
void PrintTo(const Row& r, std::ostream* out) { *out << r.op->name << " " << r.example; }

std::vector<Row> Rows() {
  std::vector<Row> rows;
  for (const ops::OpInfo& op : ops::Registry()) {
    for (const std::string& example : op.examples) {
      if (op.Operands(ops::ParseExample(op, example)) > 0) rows.push_back({&op, example});
    }
  }
  return rows;
}
std::string RowName(const ::testing::TestParamInfo<Row>& info) {
  std::string name = info.param.op->name + "_" + std::to_string(info.index);
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

class Packed : public ::testing::TestWithParam<Row> {};
INSTANTIATE_TEST_SUITE_P(Registry, Packed, ::testing::ValuesIn(Rows()), RowName);

TEST_P(Packed, EqualsTheWayThroughPlanes) {
  const Row& row = GetParam();
  const ops::Arguments arguments = ops::ParseExample(*row.op, row.example);
  for (const Roi& window : kWindows) {
    for (const int channels : {4, 3}) {
      for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf}) {
        std::vector<Node> inputs;
        for (int k = 0; k < row.op->Operands(arguments); ++k)
          inputs.push_back(FromImage(Picture(window, channels, type, 5u * static_cast<uint32_t>(k) + 2)));
        const Node node = row.op->make(inputs, arguments, nullptr);
        // Whole images and tiles of floats take no other way for packed pixels.
        const graph::OpKind kind = node.data()->op->Kind();
        if (kind == graph::OpKind::kWhole) return;
        for (const std::string& target : SimdTargets()) {
          SCOPED_TRACE(std::to_string(window.width()) + " pixels of " + std::to_string(channels) +
                       " channels of " + PixelTypeName(type) + " on " + target);
          SetSimdTarget(target);
          const Image on = Render(node, type, {.threads = 1, .rules_off = {"codes"}});
          const Image off = Render(node, type, {.threads = 1, .rules_off = {"all"}});
          UnifyNans(on), UnifyNans(off);
          ExpectSameBits(on, off);
        }
        SetSimdTarget("auto");
        if (HasFailure()) return;
      }
    }
  }
}

}  // namespace
}  // namespace tessera
