// A checkerboard of two colours.
#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "graph/op.h"
#include "ops/arithmetic/operands.h"
#include "ops/generate/generate_ops.h"
#include "ops/generate/generators.h"
#include "ops/modifiers.h"
#include "tessera/ops/generate.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/generate/checker.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

struct CheckerStage final : graph::PointStage {
  float colors[2][4];
  int width, height;

  void Run(const graph::PointArgs& args) const override {
    const s::D d;
    const s::DI di;
    const int step = static_cast<int>(hn::Lanes(d));
    const int row = FloorModulo(args.y, 2 * height) >= height ? 1 : 0;
    const float* even = colors[row];
    const float* odd = colors[1 - row];
    // Columns within the period of two squares; only the block's first pixel needs a division.
    const s::VI first = hn::Set(di, FloorModulo(args.x, 2 * width));
    const s::VI side = hn::Set(di, width), period = hn::Set(di, 2 * width);
    const s::V inverse = hn::Set(d, 1.0f / static_cast<float>(width));
    const s::V half = hn::Set(d, 0.5f);
    for (int i = 0; i < args.count; i += step) {
      const s::VI x = hn::Add(first, hn::LoadU(di, args.order + i));
      hn::Mask<s::D> second;
      if (width >= kBlockPixels) {  // at most one period is left behind
        const s::VI wrapped = hn::IfThenElse(hn::Lt(x, period), x, hn::Sub(x, period));
        second = hn::RebindMask(d, hn::Gt(side, wrapped));
        second = hn::Not(second);
      } else {  // x < 384, so a float's quotient of the middle of the pixel has the right floor
        const s::V square = hn::Floor(hn::Mul(hn::Add(hn::ConvertTo(d, x), half), inverse));
        second = hn::Ne(hn::Floor(hn::Mul(square, half)), hn::Mul(square, half));
      }
      for (int c = 0; c < 4; ++c) {
        hn::StoreU(hn::IfThenElse(second, hn::Set(d, odd[c]), hn::Set(d, even[c])), d, args.out[c] + i);
      }
    }
  }

 private:
  static int FloorModulo(int a, int b) { return a % b + (a % b < 0 ? b : 0); }
};

std::unique_ptr<graph::PointStage> MakeChecker(const float (*colors)[4], int width, int height) {
  auto stage = std::make_unique<CheckerStage>();
  for (int c = 0; c < 4; ++c) {
    stage->colors[0][c] = colors[0][c];
    stage->colors[1][c] = colors[1][c];
  }
  stage->width = width;
  stage->height = height;
  return stage;
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeChecker);

class CheckerOp final : public GeneratorOp<CheckerParams> {
 public:
  using GeneratorOp::GeneratorOp;
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    float colors[2][4];
    for (int i = 0; i < 4; ++i) {
      colors[0][i] = static_cast<float>(ChannelValue(params().color1, context.channels[i], 0));
      colors[1][i] = static_cast<float>(ChannelValue(params().color2, context.channels[i], 1));
    }
    return HWY_DYNAMIC_DISPATCH(MakeChecker)(colors, params().width, params().height);
  }
};

constexpr int kLongestSide = 1 << 29;  // twice as many pixels are counted in an int

ParamInfo SideModifier(const char* name, const char* help) {
  return IntegerModifier(name, "16", 1, kLongestSide, help);
}

}  // namespace

OpInfo CheckerInfo() {
  OpInfo info = GeneratorRow("checker", "Checkerboard of two colours");
  info.help =
      "Rectangles of width= x height= pixels; the one that holds pixel (0, 0) has color1. A colour of one "
      "value serves every channel; channels beyond a longer list get 0 in color1 and 1 in color2, values "
      "beyond the last channel are ignored, as oiiotool's --pattern checker. Left of and above the origin "
      "the squares go on at the same size (oiiotool 2.4 repeats a column there).";
  info.bound = "1 rounding of each constant";
  info.bound_u = 1;
  info.modifiers = {
      ColorModifier("color1", "0", "colour at the origin"), ColorModifier("color2", "1", "the other colour"),
      SideModifier("width", "pixels of a square"), SideModifier("height", "pixels of a square")};
  info.make = [](std::span<const Node>, const Arguments& a, const ImageSpec* output) {
    return Checker(*output, {.color1 = a.Numbers("color1"),
                             .color2 = a.Numbers("color2"),
                             .width = a.Integer("width"),
                             .height = a.Integer("height")});
  };
  info.examples = {"", "color1=1,0.5,0.25 color2=0.1,0.2 width=5 height=3", "width=1 height=1"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Checker(const ImageSpec& spec, const CheckerParams& params) {
  ops::RequireConstants("checker:color1", params.color1);
  ops::RequireConstants("checker:color2", params.color2);
  if (std::min(params.width, params.height) < 1 ||
      std::max(params.width, params.height) > ops::kLongestSide) {
    throw Error("checker", "found squares of " + std::to_string(params.width) + "x" +
                               std::to_string(params.height) + " pixels, expected sides from 1 to " +
                               std::to_string(ops::kLongestSide));
  }
  return graph::MakeNode(std::make_shared<const ops::CheckerOp>("checker", spec, params), {});
}

}  // namespace tessera
#endif  // HWY_ONCE
