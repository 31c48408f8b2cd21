// Range compression and expansion: highlights to a logarithmic scale and back.
#include <cmath>
#include <memory>
#include <string>

#include "ops/color/color_ops.h"
#include "ops/modifiers.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/color/range.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/doubles-inl.h"
#include "simd/fused-inl.h"
#include "simd/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

// Sony Pictures Imageworks' numbers, published as floats; the logarithm is base 2 here.
constexpr double kJoin = 0.18000000715255737, kA = -0.54576885700225830078, kB = 0.18351669609546661377,
                 kC = 284.3577880859375, kLn2 = 0.69314718055994530942;

// Of magnitudes above the join; a NaN or an infinity gives any number.
struct Compress {
  static HWY_INLINE s::VD Map(s::VD x) {
    const s::DD d;
    const s::VD log = s::Log2OfDouble(hn::MulAdd(x, hn::Set(d, kC), hn::Set(d, 1.0)));
    return hn::MulAdd(log, hn::Set(d, kB * kLn2), hn::Set(d, kA));
  }
};
struct Expand {
  static HWY_INLINE s::VD Map(s::VD x) {
    const s::DD d;
    const s::VD t = hn::Mul(hn::Sub(x, hn::Set(d, kA)), hn::Set(d, 1 / (kB * kLn2)));
    return hn::Mul(hn::Sub(s::Exp2OfDouble(s::ClampExponent(t)), hn::Set(d, 1.0)), hn::Set(d, 1 / kC));
  }
};

// Channel by channel, those that are kept aside.
template <class F>
struct EachChannel {
  bool changed[4];
  static HWY_INLINE s::V Through(s::V x) {
    const s::D d;
    const s::V size = hn::Abs(x);
    // False for infinities and NaN, which stay.
    const auto beyond = hn::And(hn::Gt(size, hn::Set(d, static_cast<float>(kJoin))), hn::IsFinite(x));
    if (hn::AllFalse(d, beyond)) return x;
    const s::V v = s::InDouble([](s::VD t) HWY_ATTR { return F::Map(t); }, hn::IfThenElseZero(beyond, size));
    return hn::IfThenElse(beyond, hn::CopySign(v, x), x);
  }
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    return {changed[0] ? Through(p.r) : p.r, changed[1] ? Through(p.g) : p.g, changed[2] ? Through(p.b) : p.b,
            changed[3] ? Through(p.a) : p.a};
  }
};

// R, G and B by what their luminance goes through.
template <class F>
struct ByLuma {
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    const s::D d;
    const hn::Half<s::D> dh;
    s::VD low[3], high[3];
    Scaled(hn::LowerHalf(dh, p.r), hn::LowerHalf(dh, p.g), hn::LowerHalf(dh, p.b), low);
    Scaled(hn::UpperHalf(dh, p.r), hn::UpperHalf(dh, p.g), hn::UpperHalf(dh, p.b), high);
    const auto join = [&](int c) HWY_ATTR {
      return hn::Combine(d, hn::DemoteTo(dh, high[c]), hn::DemoteTo(dh, low[c]));
    };
    return {join(0), join(1), join(2), p.a};
  }
  template <class Half>
  static HWY_INLINE void Scaled(Half r, Half g, Half b, s::VD (&out)[3]) {
    const s::DD d;
    const s::VD rd = hn::PromoteTo(d, r), gd = hn::PromoteTo(d, g), bd = hn::PromoteTo(d, b);
    const s::VD luma =
        hn::MulAdd(rd, hn::Set(d, double{0.21264f}),
                   hn::MulAdd(gd, hn::Set(d, double{0.71517f}), hn::Mul(bd, hn::Set(d, double{0.07219f}))));
    const s::VD one = hn::Set(d, 1.0);
    const auto above = hn::Gt(luma, hn::Zero(d)), beyond = hn::Gt(luma, hn::Set(d, kJoin));
    // An infinite luminance stays infinite: over itself it is NaN.
    const auto endless = hn::Eq(luma, hn::Inf(d));
    const s::VD sane = hn::IfThenElse(hn::AndNot(endless, beyond), luma, one);
    s::VD scale = hn::IfThenElse(beyond, hn::Div(F::Map(sane), sane), one);
    scale = hn::IfThenElse(endless, hn::NaN(d), scale);
    scale = hn::IfThenElse(above, scale, hn::Zero(d));
    out[0] = hn::Mul(rd, scale), out[1] = hn::Mul(gd, scale), out[2] = hn::Mul(bd, scale);
  }
};

template <class F>
std::unique_ptr<graph::PointStage> MakeRange(const bool* changed, bool luma) {
  if (luma) return s::MakeFusedStage<1>(ByLuma<F>{});
  return s::MakeFusedStage<1>(EachChannel<F>{{changed[0], changed[1], changed[2], changed[3]}});
}
std::unique_ptr<graph::PointStage> MakeCompress(const bool* changed, bool luma) {
  return MakeRange<Compress>(changed, luma);
}
std::unique_ptr<graph::PointStage> MakeExpand(const bool* changed, bool luma) {
  return MakeRange<Expand>(changed, luma);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera {
namespace ops {
namespace {

HWY_EXPORT(MakeCompress);
HWY_EXPORT(MakeExpand);

bool IsKept(const ImageSpec& spec, int channel) {
  const std::string& name = spec.channels[static_cast<size_t>(channel)];
  return channel == spec.alpha || name == "Z" || name == "z";
}

class RangeOp final : public graph::OpWith<RangeParams> {
 public:
  RangeOp(bool expands, const RangeParams& params) : OpWith(params), expands_(expands) {}
  std::string Name() const override { return expands_ ? "rangeexpand" : "rangecompress"; }
  graph::OpKind Kind() const override {
    return params().luma ? graph::OpKind::kColor : graph::OpKind::kChannel;
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    bool changed[4];
    for (int i = 0; i < 4; ++i) {
      const int c = context.channels[i];
      changed[i] = c >= 0 && !IsKept(context.inputs[0], c);
    }
    if (expands_) return HWY_DYNAMIC_DISPATCH(MakeExpand)(changed, params().luma);
    return HWY_DYNAMIC_DISPATCH(MakeCompress)(changed, params().luma);
  }

 private:
  bool expands_;
};

Node Ranged(const Node& image, bool expands, RangeParams params) {
  const ImageSpec& spec = image.spec();
  for (int c = 0; c < 3 && params.luma; ++c) params.luma = c < spec.channel_count() && !IsKept(spec, c);
  return graph::MakeNode(std::make_shared<const RangeOp>(expands, params), {image});
}

OpInfo Row(const char* name, const char* summary, const std::string& formula) {
  OpInfo info;
  info.name = name;
  info.family = "color";
  info.summary = summary;
  info.help =
      formula +
      " with a = -0.54576886, b = 0.1835167, c = 284.35779; smaller ones stay, signs are kept. Alpha and the "
      "depth channel Z keep their bits. luma=1 scales R,G,B by the factor that their luminance (0.21264, "
      "0.71517, 0.07219) goes through, so that hues stay; a luminance that is not above 0 makes them 0, an "
      "infinite one NaN, as oiiotool's; channels beyond are kept (oiiotool scales them too). It has no effect "
      "where one of the first three channels is missing, alpha or Z. NaN and infinities stay.";
  info.bound = "3 u |result|";
  info.bound_u = 3;
  info.modifiers = {FlagModifier("luma", "1 goes by luminance, the same factor for R,G,B")};
  info.examples = {"", "luma=1"};
  return info;
}

}  // namespace

OpInfo RangeCompressInfo() {
  OpInfo info = Row("rangecompress", "Highlights to a logarithmic scale, for filters that ring",
                    "Each sample |v| above 0.18 becomes a + b ln(c |v| + 1)");
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return RangeCompress(in[0], {.luma = a.Flag("luma")});
  };
  return info;
}
OpInfo RangeExpandInfo() {
  OpInfo info = Row("rangeexpand", "Undo --rangecompress",
                    "Each sample |v| above 0.18 becomes (exp((|v| - a) / b) - 1) / c, the inverse of "
                    "--rangecompress,");
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return RangeExpand(in[0], {.luma = a.Flag("luma")});
  };
  return info;
}

}  // namespace ops

Node RangeCompress(const Node& image, const RangeParams& params) { return ops::Ranged(image, false, params); }
Node RangeExpand(const Node& image, const RangeParams& params) { return ops::Ranged(image, true, params); }

}  // namespace tessera
#endif  // HWY_ONCE
