// CMYK by removal of the common grey: K = min(C,M,Y).
#include <memory>

#include "ops/color/color_ops.h"
#include "tessera/color_state.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/color/cmyk.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

struct CmykKernel {
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    const s::V one = hn::Set(s::D(), 1.0f);
    const s::V c = hn::Sub(one, p.r), m = hn::Sub(one, p.g), y = hn::Sub(one, p.b);
    const s::V k = s::MinNumber(s::MinNumber(c, m), y);
    return {hn::Sub(c, k), hn::Sub(m, k), hn::Sub(y, k), k};
  }
};
std::unique_ptr<graph::PointStage> MakeCmyk() { return s::MakeFusedStage<1>(CmykKernel{}); }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {
namespace ops {
namespace {

HWY_EXPORT(MakeCmyk);

class CmykOp final : public graph::OpWith<CmykParams> {
 public:
  CmykOp() : OpWith(CmykParams()) {}
  std::string Name() const override { return "cmyk"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireColor(Name(), inputs[0]);
    ImageSpec spec = inputs[0];
    spec.channels = {"C", "M", "Y", "K"};
    spec.alpha = -1;
    SetColorState(spec, {});
    return spec;
  }
  // K takes the fourth plane, where the input's alpha comes in.
  bool WritesAlpha() const override { return true; }
  bool ReadsAlpha() const override { return true; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return HWY_DYNAMIC_DISPATCH(MakeCmyk)();
  }
};

}  // namespace

OpInfo CmykInfo() {
  OpInfo info;
  info.name = "cmyk";
  info.family = "color";
  info.summary = "Cyan, magenta, yellow, black";
  info.help =
      "C,M,Y = 1 - (R,G,B), K = min(C,M,Y), and K is taken off C, M and Y (simple removal). The result has "
      "the four channels C, M, Y, K; the fourth holds K, and alpha and further channels are dropped. In the "
      "minimum a number wins over NaN. Source: McReynolds et al. 1997, 12.2.4.";
  info.bound = "4 u max(1,|R|,|G|,|B|)";
  info.bound_u = 4;
  info.make = [](std::span<const Node> in, const Arguments&, const ImageSpec*) { return Cmyk(in[0]); };
  info.examples = {""};
  return info;
}

}  // namespace ops

Node Cmyk(const Node& image) { return graph::MakeNode(std::make_shared<const ops::CmykOp>(), {image}); }

}  // namespace tessera
#endif  // HWY_ONCE
