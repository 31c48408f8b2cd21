// Quantising to N bits, with an optional dither that depends on nothing but position.
#include <memory>
#include <span>
#include <string>

#include "graph/op.h"
#include "ops/arithmetic/arithmetic_ops.h"
#include "ops/arithmetic/operands.h"
#include "ops/modifiers.h"
#include "tessera/ops/arithmetic.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/arithmetic/quantize.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

// NaN to 0, then to [0, 1]; -0 to +0.
HWY_INLINE s::V Unit(s::V x) {
  const s::D d;
  return s::ClampHigh(s::ClampLow(x, hn::Zero(d)), hn::Set(d, 1.0f));
}

struct Quantize {
  float steps;   // 2^bits - 1
  float levels;  // 2^bits

  HWY_INLINE s::V operator()(s::V value) const {
    const s::D d;
    const s::V x = Unit(value);
    // x * steps is the difference of two floats, levels * x - x: its rounding error e is a float too
    // (Fast2Sum), so ties are those of the exact product, with or without a fused multiply-add.
    const s::V scaled = hn::Mul(x, hn::Set(d, levels));
    const s::V product = hn::Sub(scaled, x);
    const s::V e = hn::Sub(hn::Sub(scaled, product), x);
    const s::V rounded = hn::Round(product);
    const s::V excess = hn::Sub(product, rounded);
    const s::V half = hn::Set(d, 0.5f), one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    // A rounded product on a tie was above or below it in truth.
    const auto up = hn::And(hn::Eq(excess, half), hn::Gt(e, zero));
    const auto down = hn::And(hn::Eq(excess, hn::Neg(half)), hn::Lt(e, zero));
    s::V code = hn::Add(rounded, hn::IfThenElseZero(up, one));
    code = hn::Sub(code, hn::IfThenElseZero(down, one));
    return hn::Div(code, hn::Set(d, steps));
  }
};

// A bijection of 32 bits that leaves no pattern (Ettinger's low-bias constants of Wellons' hash).
HWY_INLINE s::VU Mix(s::VU h) {
  const s::DU d;
  h = hn::Xor(h, hn::ShiftRight<16>(h));
  h = hn::Mul(h, hn::Set(d, 0x21f0aaadu));
  h = hn::Xor(h, hn::ShiftRight<15>(h));
  h = hn::Mul(h, hn::Set(d, 0xd35a2d97u));
  return hn::Xor(h, hn::ShiftRight<15>(h));
}

struct DitheredQuantize {
  double steps;
  uint32_t key[4];  // of each plane: channel and seed

  // Rounds in double: the product is exact there and the offset keeps 24 bits, so no target differs.
  template <class DF, class VF>
  HWY_INLINE hn::Vec<DF> RoundedSum(DF df, VF x, VF offset) const {
    const hn::Rebind<double, DF> dd;
    const auto sum = hn::Add(hn::Mul(hn::PromoteTo(dd, x), hn::Set(dd, steps)), hn::PromoteTo(dd, offset));
    return hn::DemoteTo(df, hn::Round(sum));
  }
  HWY_INLINE s::V One(s::V value, s::VU column, uint32_t row_key) const {
    const s::D d;
    const s::V x = Unit(value);
    const s::VU hash = Mix(hn::Xor(column, hn::Set(s::DU(), row_key)));
    // The upper 24 bits as a number in [-1/2, 1/2).
    const s::V share = hn::ConvertTo(d, hn::BitCast(s::DI(), hn::ShiftRight<8>(hash)));
    const s::V offset = hn::Sub(hn::Mul(share, hn::Set(d, 0x1p-24f)), hn::Set(d, 0.5f));
    const hn::Half<s::D> dh;
    const s::V code = hn::Combine(d, RoundedSum(dh, hn::UpperHalf(dh, x), hn::UpperHalf(dh, offset)),
                                  RoundedSum(dh, hn::LowerHalf(dh, x), hn::LowerHalf(dh, offset)));
    // Rounding half to even keeps codes 0 and the last, but leaves a negative zero.
    return hn::Div(hn::Abs(code), hn::Set(d, static_cast<float>(steps)));
  }
  HWY_INLINE s::Pixels operator()(const s::Pixels& p, s::Position at) const {
    const s::DU du;
    const s::VU column = hn::Mul(hn::BitCast(du, at.X()), hn::Set(du, 0x9e3779b1u));
    const uint32_t row = static_cast<uint32_t>(at.y()) * 0x85ebca77u;
    return {One(p.r, column, ScalarMix(row ^ key[0])), One(p.g, column, ScalarMix(row ^ key[1])),
            One(p.b, column, ScalarMix(row ^ key[2])), One(p.a, column, ScalarMix(row ^ key[3]))};
  }
  static HWY_INLINE uint32_t ScalarMix(uint32_t h) {
    h ^= h >> 16;
    h *= 0x21f0aaadu;
    h ^= h >> 15;
    h *= 0xd35a2d97u;
    return h ^ (h >> 15);
  }
};

std::unique_ptr<graph::PointStage> MakeQuantize(const QuantizeParams& params, const int* channels) {
  const uint32_t levels = 1u << params.bits;
  if (!params.dither) {
    return s::MakeFusedStage<1>(Quantize{static_cast<float>(levels - 1), static_cast<float>(levels)});
  }
  DitheredQuantize f{static_cast<double>(levels - 1), {}};
  for (int i = 0; i < 4; ++i) {
    f.key[i] =
        DitheredQuantize::ScalarMix(params.seed * 0xc2b2ae3du + static_cast<uint32_t>(channels[i]) + 1);
  }
  return s::MakeStage<1>(f);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeQuantize);

constexpr int kMaxBits = 24;  // a float's significand

class QuantizeOp final : public graph::OpWith<QuantizeParams> {
 public:
  explicit QuantizeOp(const QuantizeParams& params) : OpWith(params) {}
  std::string Name() const override { return "quantize"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::string Describe() const override {
    return std::string("quantize ")
        .append(std::to_string(params().bits))
        .append(params().dither ? " dithered" : "");
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    return HWY_DYNAMIC_DISPATCH(MakeQuantize)(params(), context.channels);
  }
};

}  // namespace

OpInfo QuantizeInfo() {
  OpInfo info;
  info.name = "quantize";
  info.family = "arithmetic";
  info.summary = "Round to the codes of an N-bit integer";
  info.help =
      "Every channel, alpha included, becomes code / (2^BITS - 1), where code is the exact product "
      "A * (2^BITS - 1) rounded half to even, A first limited to [0, 1] and NaN taken as 0: what storing the "
      "image "
      "with BITS bits and reading it back gives.\n"
      "With dither=1 an offset in [-1/2, 1/2) of a code is added before rounding. It is a hash of pixel "
      "position, channel and seed, so the picture does not depend on tiles or threads; the mean of a flat "
      "area is kept, and so are the codes 0 and 2^BITS - 1. Give each frame of a sequence its own seed.";
  info.bound = "the code is exact; its quotient 1 rounding: u * |result|";
  info.bound_u = 1;
  ParamInfo bits = IntegerModifier("BITS", "", 1, kMaxBits, "bits of the integer");
  info.arguments = {bits};
  ParamInfo dither = FlagModifier("dither", "1 adds a position hash of up to half a code before rounding");
  ParamInfo seed = OnlyWith(
      "dither", IntegerModifier("seed", "0", 0, 4294967295.0, "another seed, another dither pattern"));
  info.modifiers = {dither, seed};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Quantize(in[0], {.bits = a.Integer("BITS"),
                            .dither = a.Flag("dither"),
                            .seed = static_cast<uint32_t>(a.Number("seed"))});
  };
  info.examples = {"8", "1", "10 dither=1", "16 dither=1 seed=7", "24", "24 dither=1"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Quantize(const Node& image, const QuantizeParams& params) {
  if (params.bits < 1 || params.bits > ops::kMaxBits) {
    throw Error("quantize", "found " + std::to_string(params.bits) + " bits, expected 1 to " +
                                std::to_string(ops::kMaxBits));
  }
  return graph::MakeNode(std::make_shared<const ops::QuantizeOp>(params), {image});
}

}  // namespace tessera
#endif  // HWY_ONCE
