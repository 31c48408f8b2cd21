// The coordinate ramp: s, t, 0, 1 over pixel centres.
#include <memory>
#include <span>
#include <string>

#include "graph/op.h"
#include "ops/generate/generate_ops.h"
#include "ops/generate/generators.h"
#include "tessera/ops/generate.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/generate/ramp.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

struct RampStage final : graph::PointStage {
  int channels[4];
  int x0, y0, width, height;

  void Run(const graph::PointArgs& args) const override {
    const s::D d;
    const int step = static_cast<int>(hn::Lanes(d));
    const float t = static_cast<float>((2.0 * (int64_t{args.y} - y0) + 1) / (2.0 * height));
    // (2 x + 1) / (2 width): numerator and denominator are floats exactly up to 2^24, so the quotient is
    // rounded once.
    const s::V divisor = hn::Set(d, 2.0f * static_cast<float>(width));
    const auto first = hn::Set(s::DI(), args.x - x0);
    for (int c = 0; c < 4; ++c) {
      const float rest = channels[c] == 1 ? t : channels[c] == 2 ? 0.0f : 1.0f;
      for (int i = 0; i < args.count; i += step) {
        s::V value = hn::Set(d, rest);
        if (channels[c] == 0) {
          const auto x = hn::Add(first, hn::LoadU(s::DI(), args.order + i));
          value = hn::Div(hn::Add(hn::ConvertTo(d, hn::Add(x, x)), hn::Set(d, 1.0f)), divisor);
        }
        hn::StoreU(value, d, args.out[c] + i);
      }
    }
  }
};

std::unique_ptr<graph::PointStage> MakeRamp(const int* channels, const Roi& frame) {
  auto stage = std::make_unique<RampStage>();
  for (int c = 0; c < 4; ++c) stage->channels[c] = channels[c];
  stage->x0 = frame.x0;
  stage->y0 = frame.y0;
  stage->width = frame.width();
  stage->height = frame.height();
  return stage;
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeRamp);

class RampOp final : public GeneratorOp<RampParams> {
 public:
  using GeneratorOp::GeneratorOp;
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    return HWY_DYNAMIC_DISPATCH(MakeRamp)(context.channels, params().frame);
  }
};

}  // namespace

OpInfo RampInfo() {
  OpInfo info = GeneratorRow("ramp", "Pixel coordinates s, t in [0,1] as colours");
  info.help =
      "Channel 0 is s = (x + 1/2) / width, channel 1 is t = (y + 1/2) / height, channel 2 is 0, channel 3 "
      "and all further ones are 1: the coloured quad that starts every pixel-texture algorithm. x (right) "
      "and y (down) count from the display window's corner, width and height are the display window's.";
  info.bound = "1 rounding up to 2^23 pixels across, 3 beyond: 3 u * |result|";
  info.bound_u = 3;
  info.make = [](std::span<const Node>, const Arguments&, const ImageSpec* output) { return Ramp(*output); };
  info.examples = {""};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Ramp(const ImageSpec& spec) {
  RampParams params{spec.display_window.empty() ? spec.data_window : spec.display_window};
  return graph::MakeNode(std::make_shared<const ops::RampOp>("ramp", spec, params), {});
}

}  // namespace tessera
#endif  // HWY_ONCE
