// Adds noise to an image: oiiotool's, number for number, from Jenkins' hash of column, row, channel and seed.
#include <cfloat>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "graph/op.h"
#include "ops/arithmetic/operands.h"
#include "ops/generate/generate_ops.h"
#include "ops/modifiers.h"
#include "tessera/ops/generate.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/generate/add_noise.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/math-inl.h"
#include "simd/osl_hash-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

struct AddNoiseStage final : graph::PointStage {
  AddNoiseParams params;
  int channels[4];  // -1: the plane stays

  void Run(const graph::PointArgs& args) const override {
    const s::D d;
    for (int i = 0; i < args.count; i += s::kLanes) {
      const s::VU x = hn::BitCast(s::DU(), s::Position(args, i).X());
      const s::VU place =
          s::JenkinsFinal(x, hn::Set(s::DU(), static_cast<uint32_t>(args.y)), hn::Zero(s::DU()));
      const s::Pixels in = s::LoadPlanes(args.in[0], i);
      const auto through = [&](int plane, s::V v) HWY_ATTR {
        if (channels[plane] < 0) return v;
        const auto channel = static_cast<uint32_t>(params.mono ? 0 : channels[plane]);
        switch (params.type) {
          case AddedNoise::kGaussian:
            return hn::Add(v, Gaussian(place, channel));
          case AddedNoise::kUniform: {
            const s::V t = Random(place, channel, params.seed);
            const s::V low = hn::Set(d, static_cast<float>(params.min)),
                       high = hn::Set(d, static_cast<float>(params.max));
            const s::V one = hn::Set(d, 1.0f);
            return hn::Add(v, hn::Add(hn::Mul(low, hn::Sub(one, t)), hn::Mul(high, t)));
          }
          case AddedNoise::kSalt:
            break;
        }
        const auto hit =
            hn::Lt(Random(place, channel, params.seed), hn::Set(d, static_cast<float>(params.portion)));
        return hn::IfThenElse(hit, hn::Set(d, static_cast<float>(params.value)), v);
      };
      s::StorePlanes({through(0, in.r), through(1, in.g), through(2, in.b), through(3, in.a)}, args.out, i);
    }
  }

 private:
  // A multiple of 2^-20 in [0, 1).
  static HWY_INLINE s::V Random(s::VU place, uint32_t channel, uint32_t seed) {
    const s::DU du;
    const s::VU hash = s::JenkinsFinal(place, hn::Set(du, channel), hn::Set(du, seed));
    const s::VI low = hn::BitCast(s::DI(), hn::And(hash, hn::Set(du, 0xfffffu)));
    return hn::Mul(hn::ConvertTo(s::D(), low), hn::Set(s::D(), 0x1p-20f));
  }
  // Marsaglia's polar method, with the next seed until a point lies within the circle.
  HWY_INLINE s::V Gaussian(s::VU place, uint32_t channel) const {
    const s::D d;
    const s::V zero = hn::Zero(d), one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
    s::V x = zero, square = zero;
    auto found = hn::Lt(zero, zero);
    for (uint32_t seed = params.seed; !hn::AllTrue(d, found); ++seed) {
      const s::V u = hn::Sub(hn::Mul(two, Random(place, channel, seed)), one);
      const s::V v = hn::Sub(hn::Mul(two, Random(place, channel, seed + 139)), one);
      const s::V r = hn::Add(hn::Mul(u, u), hn::Mul(v, v));  // rounded as oiiotool's: it decides
      const auto good = hn::AndNot(found, hn::And(hn::Le(r, one), hn::Gt(r, zero)));
      x = hn::IfThenElse(good, u, x), square = hn::IfThenElse(good, r, square);
      found = hn::Or(found, good);
    }
    const hn::Half<s::D> dh;
    const s::DD dd;
    const auto half = [&](auto u, auto r) HWY_ATTR {
      const s::VD rd = hn::PromoteTo(dd, r), ud = hn::PromoteTo(dd, u);
      const s::VD log = hn::Mul(s::Log2OfDouble(rd), hn::Set(dd, -2 * 0.69314718055994530942));
      const s::VD size = hn::Sqrt(hn::Max(hn::Div(log, rd), hn::Zero(dd)));
      return hn::DemoteTo(
          dh, hn::MulAdd(hn::Mul(ud, size), hn::Set(dd, params.stddev), hn::Set(dd, params.mean)));
    };
    return hn::Combine(d, half(hn::UpperHalf(dh, x), hn::UpperHalf(dh, square)),
                       half(hn::LowerHalf(dh, x), hn::LowerHalf(dh, square)));
  }
};

std::unique_ptr<graph::PointStage> MakeAddNoise(const AddNoiseParams& params, const int* channels) {
  auto stage = std::make_unique<AddNoiseStage>();
  stage->params = params;
  for (int i = 0; i < 4; ++i) stage->channels[i] = channels[i];
  return stage;
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MakeAddNoise);

class AddNoiseOp final : public graph::OpWith<AddNoiseParams> {
 public:
  explicit AddNoiseOp(const AddNoiseParams& params) : OpWith(params) {}
  std::string Name() const override { return "noise"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  bool IsIdentity() const override { return params().channels == 0; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    int channels[4];
    for (int i = 0; i < 4; ++i) {
      channels[i] = context.channels[i] < params().channels ? context.channels[i] : -1;
    }
    return HWY_DYNAMIC_DISPATCH(MakeAddNoise)(params(), channels);
  }
};

ParamInfo Number(const char* name, const char* default_value, const char* only_with, const char* help) {
  return OnlyWith(only_with, NumberModifier(name, default_value, help));
}

}  // namespace

OpInfo AddNoiseInfo() {
  OpInfo info;
  info.name = "noise";
  info.family = "generate";
  info.summary = "Add noise to an image";
  info.help =
      "type=gaussian adds numbers of the normal distribution, uniform (or white) of an even one from min= to "
      "max=; salt puts value= in place of the portion= of samples. Every channel has numbers of its own, alpha "
      "too; mono=1 gives all channels the same, nchannels=3 leaves alpha alone. The numbers are oiiotool's: "
      "Jenkins' lookup3 of column, row, channel and seed, 20 bits of it; gaussian by Marsaglia's polar method, "
      "with the next seed where a point is refused. They depend on nothing else, so that a crop has the same. "
      "Nothing is clamped. Not here: type=blue, whose table is OpenImageIO's own.";
  info.bound = "3 u (|A| + |noise|), of uniform 3 u (|A| + |min| + |max|); salt: 1 rounding of the value";
  info.bound_u = 3;
  ParamInfo type = ChoiceModifier("type", {"gaussian", "uniform", "white", "salt"}, "the distribution");
  ParamInfo seed = IntegerModifier("seed", "0", -2147483647, 2147483647, "other numbers");
  ParamInfo mono = FlagModifier("mono", "1 gives all channels the same numbers");
  ParamInfo count = seed;
  count.name = "nchannels";
  count.default_value = "10000";
  count.help = "only so many channels";
  count.min = 0, count.max = kMaxConstants;
  info.modifiers = {type,
                    Number("mean", "0", "type=gaussian", "mean of what is added"),
                    Number("stddev", "0.1", "type=gaussian", "standard deviation of it"),
                    Number("min", "0", "type=uniform|white", "least of what is added"),
                    Number("max", "0.1", "type=uniform|white", "most of what is added"),
                    Number("value", "0", "type=salt", "what takes the place of samples"),
                    Number("portion", "0.01", "type=salt", "how many of them, 1 for all"),
                    seed,
                    mono,
                    count};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::string& name = a.Text("type");
    return AddNoise(in[0], {.type = name == "gaussian" ? AddedNoise::kGaussian
                                    : name == "salt"   ? AddedNoise::kSalt
                                                       : AddedNoise::kUniform,
                            .mean = a.Number("mean"),
                            .stddev = a.Number("stddev"),
                            .min = a.Number("min"),
                            .max = a.Number("max"),
                            .value = a.Number("value"),
                            .portion = a.Number("portion"),
                            .seed = static_cast<uint32_t>(a.Integer("seed")),
                            .mono = a.Flag("mono"),
                            .channels = a.Integer("nchannels")});
  };
  info.examples = {"stddev=0.05 nchannels=3",
                   "",
                   "type=uniform min=-0.1 max=0.3 seed=7",
                   "type=salt value=1 portion=0.2 mono=1",
                   "mean=0.1 mono=1 seed=-3",
                   "nchannels=0"};
  info.identity = "nchannels=0";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node AddNoise(const Node& image, const AddNoiseParams& params) {
  ops::RequireFinite("noise",
                     {params.mean, params.stddev, params.min, params.max, params.value, params.portion});
  if (params.channels < 0) {
    throw Error("noise", "found " + std::to_string(params.channels) + " channels, expected 0 or more");
  }
  return graph::MakeNode(std::make_shared<const ops::AddNoiseOp>(params), {image});
}

}  // namespace tessera
#endif  // HWY_ONCE
