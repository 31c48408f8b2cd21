// The law of stores: after something computed tile by tile, every operation's result in a packed type is its
// float result rounded, however many blocks wide the picture is.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/cases.h"
#include "support/pictures.h"
#include "support/test_ops.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::Case;
using testing::ExpectSameBits;
using testing::OnEveryTarget;
using testing::Picture;
using testing::StoreSample;

// Wider than four blocks of 256 pixels, and not by a whole number of vectors.
const Roi kWide{-3, 2, 1080, 5};

Node Blurred(const Node& node) {
  const ops::OpInfo& blur = *ops::FindOp("blur");
  return blur.make(std::vector{node}, ops::ParseExample(blur, "3x3"), nullptr);
}

// The operation on blurred pictures; what has no operand is blurred itself, and halved.
Node AfterTiles(const Case& c, int channels) {
  if (c.Operands() == 0) return MulConstant(Blurred(c.Make(kWide, channels, PixelType::kFloat)), {0.5});
  std::vector<Node> inputs;
  for (int k = 0; k < c.Operands(); ++k) {
    inputs.push_back(
        Blurred(FromImage(Picture(kWide, channels, PixelType::kFloat, 7u * static_cast<uint32_t>(k) + 1))));
  }
  return c.On(inputs, {});
}

class PackedSinks : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Registry, PackedSinks, ::testing::ValuesIn(testing::AllCases()), testing::CaseName);

TEST_P(PackedSinks, AfterATileStepHoldTheFloatResultRounded) {
  OnEveryTarget([&] {
    for (const int channels : {3, 4}) {
      const Node node = AfterTiles(GetParam(), channels);
      const Image exact = Render(node);
      for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf}) {
        SCOPED_TRACE(std::to_string(channels) + " channels to " + PixelTypeName(type));
        const Image packed = Render(node, type);
        const Image expected(packed.spec());
        const Roi& w = node.spec().data_window;
        for (int y = w.y0; y < w.y1; ++y) {
          for (int x = w.x0; x < w.x1; ++x) {
            for (int c = 0; c < exact.spec().channel_count(); ++c) {
              StoreSample(expected.view(), x, y, c, exact.at<float>(x, y, c));
            }
          }
        }
        ExpectSameBits(packed, expected);
      }
    }
  });
}

}  // namespace
}  // namespace tessera
