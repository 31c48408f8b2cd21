// Samples that are NaN or infinite: made black, filled from their neighbours, or refused.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "graph/op.h"
#include "ops/arithmetic/arithmetic_ops.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arithmetic.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/arithmetic/fixnan.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

struct Blacken {
  HWY_INLINE s::V operator()(s::V x) const { return hn::IfThenElseZero(hn::IsFinite(x), x); }
  static HWY_INLINE s::V OfFinite(s::V x) { return x; }
};
std::unique_ptr<graph::PointStage> MakeBlacken() { return s::MakeFusedStage<1>(Blacken{}); }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeBlacken);

bool IsLost(float v) { return (std::bit_cast<uint32_t>(v) & 0x7f800000u) == 0x7f800000u; }
// Without branches, for compilers to make vectors of.
bool AnyLost(const float* row, int count) {
  uint32_t any = 0;
  for (int i = 0; i < count; ++i) any |= IsLost(row[i]) ? 1u : 0u;
  return any != 0;
}

// Copies, and mends or refuses what is lost.
class MendStage final : public graph::TileStage {
 public:
  MendStage(bool mends, const Roi& image) : mends_(mends), image_(image) {}
  Roi InputRoi(int, const Roi& out) const override { return mends_ ? Inflate(out, 1, 1) : out; }
  void Run(const graph::TileArgs& args) const override {
    const Roi& o = args.out.roi;
    const ConstImageView& in = args.in[0];
    const int samples = o.width() * in.channels;
    for (int y = o.y0; y < o.y1; ++y) {
      const auto* const from = reinterpret_cast<const float*>(in.At(o.x0, y));
      auto* const to = reinterpret_cast<float*>(args.out.At(o.x0, y));
      std::copy_n(from, samples, to);
      if (!AnyLost(to, samples)) continue;
      if (!mends_) {
        throw DataError("fixnan",
                        "found samples that are NaN or infinite, expected finite ones (box3 and black "
                        "mend them)");
      }
      for (int i = 0; i < samples; ++i) {
        if (IsLost(from[i])) to[i] = Mean(in, o.x0 + i / in.channels, y, i % in.channels);
      }
    }
  }

 private:
  // Of the finite samples among the nine, within the image; 0 of none.
  float Mean(const ConstImageView& in, int x, int y, int channel) const {
    const Roi box = Intersection({x - 1, y - 1, x + 2, y + 2}, image_);
    double sum = 0;
    int count = 0;
    for (int j = box.y0; j < box.y1; ++j) {
      for (int i = box.x0; i < box.x1; ++i) {
        const float v = reinterpret_cast<const float*>(in.At(i, j))[channel];
        if (!IsLost(v)) sum += double{v}, ++count;
      }
    }
    return count == 0 ? 0.0f : static_cast<float>(sum / count);
  }

  bool mends_;
  Roi image_;
};

class FixNanOp final : public graph::OpWith<FixNanParams> {
 public:
  explicit FixNanOp(const FixNanParams& params) : OpWith(params) {}
  std::string Name() const override { return "fixnan"; }
  graph::OpKind Kind() const override {
    return params().mode == FixNanMode::kBlack ? graph::OpKind::kChannel : graph::OpKind::kTile;
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return HWY_DYNAMIC_DISPATCH(MakeBlacken)();
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<MendStage>(params().mode == FixNanMode::kBox3, context.inputs[0].data_window);
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
};

}  // namespace

OpInfo FixNanInfo() {
  OpInfo info;
  info.name = "fixnan";
  info.family = "arithmetic";
  info.summary = "Mend samples that are NaN or infinite";
  info.help =
      "black makes them 0; box3 makes each the mean of the finite samples of its channel among the nine pixels "
      "around it (within the image; 0 where there is none); error refuses an image that has any where the "
      "result is computed; none keeps everything. Finite samples keep their bits, alpha is a channel like the "
      "others. box3 takes what is in the image, so that the order of pixels does not matter: oiiotool 2.4 takes "
      "samples mended before as well, which differs where two lost ones touch.";
  info.bound = "exact; box3: 1 rounding of the mean, summed in double";
  info.bound_u = 2;
  info.arguments = {ChoiceArgument("STRATEGY", {"none", "black", "box3", "error"}, "what is done with them")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::string& text = a.Text("STRATEGY");
    return FixNan(in[0], text == "none"    ? FixNanMode::kNone
                         : text == "black" ? FixNanMode::kBlack
                         : text == "box3"  ? FixNanMode::kBox3
                                           : FixNanMode::kError);
  };
  info.examples = {"box3", "black", "none"};
  info.identity = "none";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node FixNan(const Node& image, FixNanMode mode) {
  if (mode == FixNanMode::kNone) return image;
  return graph::MakeNode(std::make_shared<const ops::FixNanOp>(FixNanParams{mode}), {image});
}

}  // namespace tessera
#endif  // HWY_ONCE
