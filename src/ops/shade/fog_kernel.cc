// Fog on blocks of pixels: distance, optical depth and transmittance in double, the mix in float.
#include "ops/shade/fog_kernel.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/prefetch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/shade/fog_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/doubles-inl.h"
#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::DD;
using s::EachPart;
using s::Join;
using s::kParts;
using s::Part;
using s::SetD;
using s::V;
using s::VD;
namespace {

constexpr double kLog2E = 1.4426950408889634074;

// What passes through and 1 minus that, without cancellation.
struct Attenuation {
  V through, rest;
};

// A block between the two passes over it: first distances and what the law makes of them, then powers and
// the mix. In one loop the chain of dependent operations is longer than processors look ahead. `first` and
// `second` are through and rest, or, where the law gives optical depths, -depth / ln 2 as a fraction in
// [-1/2, 1/2] and, in `whole`, an integer.
struct FogBlock {
  alignas(64) float first[kBlockPixels];
  union {
    alignas(64) float second[kBlockPixels];
    alignas(64) int32_t whole[kBlockPixels];
  };
};

// Splits t = -depth / ln 2 of optical depths >= 0, given in double. The double carries the depth's digits to
// the fraction; from there floats do. NaN stays.
HWY_INLINE void StoreExponent(const VD (&t)[kParts], int i, FogBlock& block) {
  VD shifted[kParts], fraction[kParts];
  EachPart([&]<int kPart>() HWY_ATTR {
    const VD least = SetD(-160), magic = SetD(0x1.8p52);  // adding it rounds to an integer in the lowest bits
    const VD v = hn::IfThenElse(hn::Lt(t[kPart], least), least, t[kPart]);
    shifted[kPart] = hn::Add(v, magic);
    fraction[kPart] = hn::Sub(v, hn::Sub(shifted[kPart], magic));
  });
  hn::Store(Join(fraction), s::D(), block.first + i);
  hn::Store(s::JoinLowBits(shifted), s::DI(), block.whole + i);
}

// 2^(whole + fraction) and 1 minus that: 2^whole (1 + p), p = 2^fraction - 1. |relative error| of either
// result is below 1.5 ULP.
HWY_INLINE Attenuation Attenuate(const FogBlock& block, int i) {
  const s::D d;
  const s::DI di;
  const V f = hn::Load(d, block.first + i), one = hn::Set(d, 1.0f);
  V q = hn::Set(d, 1.5252734e-5f);
  for (const float c :
       {1.5403530e-4f, 1.3333558e-3f, 9.6181291e-3f, 5.5504109e-2f, 2.4022651e-1f, 6.9314718e-1f}) {
    q = hn::MulAdd(q, f, hn::Set(d, c));
  }
  const V p = hn::Mul(f, q);
  // 2^whole as a product, so that subnormal powers are right.
  const s::VI biased = hn::Add(hn::Load(di, block.whole + i), hn::Set(di, 127 + 64));
  const V scale = hn::Mul(hn::BitCast(d, hn::ShiftLeft<23>(biased)), hn::Set(d, 0x1p-64f));
  return {hn::MulAdd(scale, p, scale), hn::NegMulAdd(scale, p, hn::Sub(one, scale))};
}

// Laws of fog: of a distance d >= 0 or NaN, a height y and a density factor f > 0, in double, the optical
// depth over -ln 2; or, where kDirect, what does not pass.
struct ExpLaw {
  static constexpr bool kDirect = false;
  double slope;  // density times 1 / ln 2, or its root where squared
  bool squared;
  HWY_INLINE VD operator()(VD d, VD, VD f) const {
    const VD x = hn::Mul(hn::Mul(d, SetD(-slope)), f);
    return squared ? hn::NegMulAdd(x, x, hn::Zero(DD())) : x;
  }
};
struct LinearLaw {
  static constexpr bool kDirect = true;
  double start, end;
  HWY_INLINE VD operator()(VD d, VD, VD f) const {
    const VD zero = hn::Zero(DD()), one = SetD(1);
    VD fogged;
    if (start == end) {
      fogged = hn::IfThenElse(hn::Lt(d, SetD(start)), zero, one);
    } else {
      fogged = hn::Mul(hn::Sub(d, SetD(start)), SetD(1 / (end - start)));
    }
    fogged = hn::Min(hn::Mul(hn::Min(hn::Max(fogged, zero), one), f), one);
    return hn::IfThenElse(hn::Eq(d, d), fogged, d);
  }
};
struct GivenLaw {  // the "distance" is the transmittance
  static constexpr bool kDirect = true;
  HWY_INLINE VD operator()(VD t, VD, VD f) const {
    const VD one = SetD(1), kept = hn::Min(hn::Max(t, hn::Zero(DD())), one);
    const VD rest = hn::Min(hn::Mul(hn::Sub(one, kept), f), one);
    return hn::IfThenElse(hn::Eq(t, t), rest, t);
  }
};

// Mean density between the eye's height and y, times the distance, over -ln 2. A mean of 0 leaves an infinite
// ray clear.
HWY_INLINE VD ExponentOf(VD d, VD mean, VD f) {
  const VD zero = hn::Zero(DD());
  const VD x = hn::Mul(hn::Mul(hn::Mul(d, mean), SetD(-kLog2E)), f);
  return hn::IfThenElse(hn::And(hn::Eq(mean, zero), hn::Eq(d, d)), zero, x);
}
constexpr double kFarHeight = 1e60;  // stands for infinite heights

struct LayerLaw {
  static constexpr bool kDirect = false;
  const FogSegment* segments;
  size_t count;
  double eye, density_at_eye;
  HWY_INLINE VD operator()(VD d, VD y, VD f) const {
    const VD zero = hn::Zero(DD()), at_eye = SetD(eye);
    const VD limited = hn::Min(hn::Max(y, SetD(-kFarHeight)), SetD(kFarHeight));
    const VD low = hn::Min(limited, at_eye), high = hn::Max(limited, at_eye);
    VD sum = zero;
    for (size_t k = 0; k < count; ++k) {
      const FogSegment& g = segments[k];
      const VD bottom = hn::Max(low, SetD(g.bottom)), top = hn::Min(high, SetD(g.top));
      const VD overlap = hn::Max(hn::Sub(top, bottom), zero);
      if (g.slope == 0) {
        sum = hn::MulAdd(SetD(g.base), overlap, sum);
      } else {  // the density at the overlap's middle is its mean
        const VD middle = hn::MulAdd(hn::Add(bottom, top), SetD(0.5), SetD(-g.bottom));
        sum = hn::MulAdd(hn::MulAdd(SetD(g.slope), middle, SetD(g.base)), overlap, sum);
      }
    }
    const VD mean = hn::IfThenElse(hn::Eq(low, high), SetD(density_at_eye), hn::Div(sum, hn::Sub(high, low)));
    return ExponentOf(d, mean, f);
  }
};

struct ExponentialLaw {
  static constexpr bool kDirect = false;
  const ExponentialLayer* layers;
  size_t count;
  double eye;
  HWY_INLINE VD operator()(VD d, VD y, VD f) const {
    const VD one = SetD(1), at_eye = SetD(eye);
    const VD limited = hn::Min(hn::Max(y, SetD(-kFarHeight)), SetD(kFarHeight));
    const VD low = hn::Min(limited, at_eye), span = hn::Abs(hn::Sub(limited, at_eye));
    VD mean = hn::Zero(DD());
    for (size_t k = 0; k < count; ++k) {
      const ExponentialLayer& g = layers[k];
      // From the lower of the two points, so that nothing overflows: sigma(low) (1 - e^-x) / x.
      const VD turns = hn::Mul(hn::Sub(low, SetD(g.height)), SetD(-kLog2E / g.falloff));
      const VD sigma =
          hn::Mul(SetD(g.density), s::Exp2OfDouble(hn::Min(hn::Max(turns, SetD(-1000)), SetD(1000))));
      const VD x = hn::Mul(span, SetD(1 / g.falloff));
      const VD series = hn::MulAdd(
          x,
          hn::MulAdd(x, hn::MulAdd(x, hn::MulAdd(x, SetD(1.0 / 120), SetD(-1.0 / 24)), SetD(1.0 / 6)),
                     SetD(-0.5)),
          one);
      const VD far = hn::Div(hn::Sub(one, s::Exp2OfDouble(s::ClampExponent(hn::Mul(x, SetD(-kLog2E))))), x);
      mean = hn::MulAdd(sigma, hn::IfThenElse(hn::Lt(x, SetD(0x1p-6)), series, far), mean);
    }
    return ExponentOf(d, mean, f);
  }
};

// The second pass: colours to colours by load(i) -> Pixels and store(pixels, i). kOptions: there may be a fog
// colour for every pixel, or a mask.
template <bool kDirect, bool kOptions, class Load, class Store>
HWY_INLINE void Mix(const FogPlan& plan, const graph::PointArgs& args, const FogBlock& block,
                    const Load& load, const Store& store) {
  const s::D d;
  const V zero = hn::Zero(d);
  const V constant[3] = {hn::Set(d, plan.color[0]), hn::Set(d, plan.color[1]), hn::Set(d, plan.color[2])};
  const int count = args.count, step = static_cast<int>(hn::Lanes(d));
  for (int i = 0; i < count; i += step) {
    const s::Pixels c = load(i);
    Attenuation fog;
    if constexpr (kDirect) {
      fog = {hn::Load(d, block.first + i), hn::Load(d, block.second + i)};
    } else {
      fog = Attenuate(block, i);
    }
    // Nothing changes where the position is NaN, the mask is not positive, or the fog adds nothing.
    auto keep = hn::Or(hn::IsNaN(fog.through), hn::Eq(fog.rest, zero));
    if constexpr (kOptions) {
      if (plan.mask_input >= 0) {
        keep = hn::Or(keep, hn::Not(hn::Gt(hn::LoadU(d, args.in[plan.mask_input][0] + i), zero)));
      }
    }
    const auto hidden = hn::Eq(fog.through, zero);
    const V from[3] = {c.r, c.g, c.b};
    V target[3], fogged[3];
    for (int k = 0; k < 3; ++k) {
      V color = constant[k];
      if constexpr (kOptions) {
        if (plan.color_input >= 0) color = hn::LoadU(d, args.in[plan.color_input][k] + i);
      }
      target[k] = hn::Mul(c.a, color);
      V mixed = hn::MulAdd(fog.through, from[k], hn::Mul(fog.rest, target[k]));
      // Roundings do not leave the interval between both colours; NaN stays.
      const V low = hn::Min(from[k], target[k]), high = hn::Max(from[k], target[k]);
      mixed = hn::IfThenElse(hn::Lt(mixed, low), low, mixed);
      fogged[k] = hn::IfThenElse(hn::Gt(mixed, high), high, mixed);
    }
    if (HWY_UNLIKELY(!hn::AllFalse(d, hn::Or(keep, hidden)))) {
      for (int k = 0; k < 3; ++k) {
        fogged[k] = hn::IfThenElse(keep, from[k], hn::IfThenElse(hidden, target[k], fogged[k]));
      }
    }
    store({fogged[0], fogged[1], fogged[2], c.a}, i);
  }
}
template <bool kDirect>
HWY_NOINLINE void MixBlock(const FogPlan& plan, const graph::PointArgs& args, const FogBlock& block) {
  const bool options = plan.color_input >= 0 || plan.mask_input >= 0;
  const auto mix = [&](const auto& load, const auto& store) HWY_ATTR {
    if (options) return Mix<kDirect, true>(plan, args, block, load, store);
    Mix<kDirect, false>(plan, args, block, load, store);
  };
  const auto direct = [&](auto tag) HWY_ATTR {
    constexpr PixelType type = decltype(tag)::value;
    using T = typename s::Samples<type>::T;
    const T* const from = reinterpret_cast<const T*>(args.source.read);
    T* const to = reinterpret_cast<T*>(args.sink.write);
    const bool stream = args.sink.stream && s::CanStream(to) && to != from;
    Mix<kDirect, false>(
        plan, args, block,
        [&](int i) HWY_ATTR {
          base::PrefetchAhead(from + 4 * i, 4 * s::kLanes);
          return s::ValuesOf<type>(s::LoadRgbaCodes<type>(from + 4 * i));
        },
        [&](const s::Pixels& p, int i) HWY_ATTR { s::StoreRgba<type, true>(p, to + 4 * i, stream); });
  };
  const graph::DirectPixels &source = args.source, &sink = args.sink;
  if (source.read == nullptr && sink.write == nullptr) {
    mix([&](int i) HWY_ATTR { return s::LoadPlanes(args.in[0], i); },
        [&](const s::Pixels& p, int i) HWY_ATTR { s::StorePlanes(p, args.out, i); });
  } else if (source.read != nullptr && sink.write != nullptr && !options && source.type == sink.type &&
             sink.type == PixelType::kHalf) {
    direct(std::integral_constant<PixelType, PixelType::kHalf>());
  } else if (source.read != nullptr && sink.write != nullptr && !options && source.type == sink.type &&
             sink.type == PixelType::kFloat) {
    direct(std::integral_constant<PixelType, PixelType::kFloat>());
  } else {  // the rarer types by way of planes
    alignas(64) float planes[4][kBlockPixels];
    float* const plane[4] = {planes[0], planes[1], planes[2], planes[3]};
    s::LoadChunk(args, 0, args.count, plane);
    mix([&](int i) HWY_ATTR { return s::LoadPlanes(plane, i); },
        [&](const s::Pixels& p, int i) HWY_ATTR { s::StorePlanes(p, plane, i); });
    s::StoreChunk(args, 0, args.count, [&](int i) HWY_ATTR { return s::LoadPlanes(plane, i); });
  }
}

template <class Law>
class FogStage final : public graph::PointStage {
 public:
  FogStage(FogPlan plan, Law law) : plan_(std::move(plan)), law_(law) {
    // The plan's lists have moved with it, and the law points into them.
    if constexpr (std::is_same_v<Law, LayerLaw>) law_.segments = plan_.segments.data();
    if constexpr (std::is_same_v<Law, ExponentialLaw>) law_.layers = plan_.exponential.data();
  }
  bool CanFuse(bool, PixelType) const override { return true; }

  void Run(const graph::PointArgs& args) const override {
    FogBlock block;
    if (plan_.mask_input >= 0) {
      const float* const mask = args.in[plan_.mask_input][0];
      Depths(
          args, [mask](int i) HWY_ATTR { return hn::LoadU(s::D(), mask + i); }, block);
    } else {
      Depths(
          args, [](int) HWY_ATTR { return hn::Set(s::D(), 1.0f); }, block);
    }
    MixBlock<Law::kDirect>(plan_, args, block);
  }

 private:
  // The first pass; factor(i) is the density's.
  template <class Factor>
  HWY_INLINE void Depths(const graph::PointArgs& args, const Factor& factor, FogBlock& block) const {
    const s::D d;
    const Law law(law_);
    const float* const* const plane = args.in[1];
    const double eye[3] = {plan_.eye[0], plan_.eye[1], plan_.eye[2]};
    const bool given = plan_.distance;
    const int count = args.count, step = static_cast<int>(hn::Lanes(d));
    for (int i = 0; i < count; i += step) {
      const V x = hn::LoadU(d, plane[0] + i), y = hn::LoadU(d, plane[1] + i), f = factor(i);
      VD distance[kParts], t[kParts];
      if (given) {
        EachPart([&]<int kPart>() HWY_ATTR {
          const VD far = Part<kPart>(x), zero = hn::Zero(DD());
          distance[kPart] = hn::IfThenElse(hn::Lt(far, zero), zero, far);
        });
      } else {
        Distances(eye, x, y, hn::LoadU(d, plane[2] + i), distance);
      }
      EachPart([&]<int kPart>()
                   HWY_ATTR { t[kPart] = law(distance[kPart], Part<kPart>(y), Part<kPart>(f)); });
      if constexpr (Law::kDirect) {
        VD through[kParts];
        for (int k = 0; k < kParts; ++k) through[k] = hn::Sub(SetD(1), t[k]);
        hn::Store(Join(through), d, block.first + i);
        hn::Store(Join(t), d, block.second + i);
      } else {
        StoreExponent(t, i, block);
      }
    }
  }

  // |p - eye|: the root of floats, improved once, where floats hold the square; else the root of doubles.
  static HWY_INLINE void Distances(const double (&eye)[3], V px, V py, V pz, VD (&distance)[kParts]) {
    const s::D d;
    VD square[kParts];
    EachPart([&]<int kPart>() HWY_ATTR {
      const VD x = hn::Sub(Part<kPart>(px), SetD(eye[0])), y = hn::Sub(Part<kPart>(py), SetD(eye[1])),
               z = hn::Sub(Part<kPart>(pz), SetD(eye[2]));
      square[kPart] = hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
    });
    const V s = Join(square), root = hn::Sqrt(s), half = hn::Div(hn::Set(d, 0.5f), root);
    const V low = hn::Set(d, 1e-30f), high = hn::Set(d, 1e30f);
    const bool ordinary = hn::AllTrue(d, hn::And(hn::Gt(s, low), hn::Lt(s, high)));
    EachPart([&]<int kPart>() HWY_ATTR {
      const VD r = Part<kPart>(root);
      distance[kPart] = hn::MulAdd(hn::NegMulAdd(r, r, square[kPart]), Part<kPart>(half), r);
      if (HWY_UNLIKELY(!ordinary)) {
        const VD rounded = Part<kPart>(s);
        const auto inside = hn::And(hn::Gt(rounded, SetD(1e-30f)), hn::Lt(rounded, SetD(1e30f)));
        distance[kPart] = hn::IfThenElse(inside, distance[kPart], hn::Sqrt(square[kPart]));
      }
    });
  }

  FogPlan plan_;
  Law law_;
};

std::unique_ptr<graph::PointStage> MakeFog(const FogPlan& plan) {
  if (plan.layered) {
    if (!plan.exponential.empty()) {
      return std::make_unique<FogStage<ExponentialLaw>>(
          plan, ExponentialLaw{nullptr, plan.exponential.size(), plan.eye[1]});
    }
    return std::make_unique<FogStage<LayerLaw>>(
        plan, LayerLaw{nullptr, plan.segments.size(), plan.eye[1], plan.density_at_eye});
  }
  switch (plan.mode) {
    case FogMode::kLinear:
      return std::make_unique<FogStage<LinearLaw>>(plan, LinearLaw{plan.start, plan.end});
    case FogMode::kTransmittance:
      return std::make_unique<FogStage<GivenLaw>>(plan, GivenLaw{});
    default: {
      const bool squared = plan.mode == FogMode::kExp2;
      return std::make_unique<FogStage<ExpLaw>>(
          plan, ExpLaw{plan.density * (squared ? std::sqrt(kLog2E) : kLog2E), squared});
    }
  }
}

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MakeFog);
std::unique_ptr<graph::PointStage> MakeFogStage(const FogPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(MakeFog)(plan);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
