// Evaluations in a context of the caller's own: every operation leaves the default one alone.
#include <gtest/gtest.h>

#include <string>

#include "ops/registry.h"
#include "support/pictures.h"
#include "support/sanitized.h"
#include "support/test_ops.h"
#include "tessera/context.h"
#include "tessera/render.h"

namespace tessera {
namespace {

// Its pictures are of a size that contexts keep.
constexpr Roi kWindow = {0, 0, 256, 128};

Node Example(const ops::OpInfo& op, const std::string& example) {
  const ops::Arguments arguments = ops::ParseExample(op, example);
  std::vector<Node> inputs;
  for (int k = 0; k < op.Operands(arguments); ++k)
    inputs.push_back(
        FromImage(testing::Picture(kWindow, 4, PixelType::kFloat, 3u * static_cast<uint32_t>(k) + 1)));
  const ImageSpec spec(kWindow.width(), kWindow.height(), 4);
  return op.make(inputs, arguments, op.generator ? &spec : nullptr);
}

class OwnContext : public ::testing::TestWithParam<const ops::OpInfo*> {};

TEST_P(OwnContext, HasAllThatIsKept) {
  const ops::OpInfo& op = *GetParam();
  for (const std::string& example : op.examples) {
    SCOPED_TRACE(example);
    const Node node = Example(op, example);
    Context::Default().Release();
    const ContextUse before = Context::Default().Use();
    Context own;
    const Image image = Render(node, PixelType::kFloat, {.context = &own});
    const ContextUse after = Context::Default().Use();
    EXPECT_EQ(after.memory, before.memory);
    EXPECT_EQ(after.cache, before.cache);
    EXPECT_EQ(after.entries, before.entries);
  }
}

std::vector<const ops::OpInfo*> Rows() {
  std::vector<const ops::OpInfo*> rows;
  for (const ops::OpInfo& op : ops::Registry()) rows.push_back(&op);
  return rows;
}
INSTANTIATE_TEST_SUITE_P(Registry, OwnContext, ::testing::ValuesIn(Rows()),
                         [](const ::testing::TestParamInfo<const ops::OpInfo*>& info) {
                           std::string name = info.param->name;
                           for (char& c : name)
                             c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
                           return name;
                         });

TEST(OwnContextTest, GivesTheSameBitsAndMayEndBeforeItsPictures) {
  const Node node = Example(*ops::FindOp("contrast"), "1.5");
  Image image;
  {
    Context own;
    image = Render(node, PixelType::kFloat, {.context = &own});
    EXPECT_EQ(own.Use().memory, 0u) << "the picture is in use";
    { const Image other = Render(node, PixelType::kFloat, {.context = &own}); }
    // What is freed is to be seen to be free: with that sanitizer nothing is kept.
    if (!testing::kAddressSanitized) EXPECT_GT(own.Use().memory, 0u);
  }
  testing::ExpectSameBits(image, Render(node));
}

}  // namespace
}  // namespace tessera
