// Hue, saturation, colour and luminosity of Compositing and Blending Level 1 on premultiplied pixels. All is
// done at the scale of the product of the alphas, so that nothing is divided by alpha; colours are limited to
// [0, 1] first, for which the formulas are made.
#include <memory>

#include "ops/composite/blend_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/composite/nonseparable_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/pair-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::Pixels;
using s::V;

struct Rgb {
  V r, g, b;
};
template <class F>
HWY_INLINE Rgb Each(const Rgb& c, const F& f) {
  return {f(c.r), f(c.g), f(c.b)};
}
HWY_INLINE V Smallest(const Rgb& c) { return hn::Min(c.r, hn::Min(c.g, c.b)); }
HWY_INLINE V Largest(const Rgb& c) { return hn::Max(c.r, hn::Max(c.g, c.b)); }
HWY_INLINE V Luminosity(const Rgb& c) {
  const s::D d;
  const V rg = hn::MulAdd(c.g, hn::Set(d, 0.59f), hn::Mul(c.r, hn::Set(d, 0.3f)));
  return hn::MulAdd(c.b, hn::Set(d, 0.11f), rg);
}
// The colour's own differences, scaled so that the largest is `saturation`.
HWY_INLINE Rgb WithSaturation(const Rgb& c, V saturation) {
  const V low = Smallest(c), range = hn::Sub(Largest(c), low);
  const auto coloured = hn::Gt(range, hn::Zero(s::D()));
  return Each(c, [&](V v) HWY_ATTR {
    // The quotient first: it is at most 1 however small the range is.
    return hn::IfThenElseZero(coloured, hn::Mul(hn::Div(hn::Sub(v, low), range), saturation));
  });
}
// The colour moved to luminosity l and drawn towards grey into [0, limit].
HWY_INLINE Rgb WithLuminosity(const Rgb& colour, V luminosity, V limit) {
  const V l =
      hn::Min(luminosity, limit);  // rounding may have left it above, where nothing could be drawn towards it
  const V shift = hn::Sub(l, Luminosity(colour));
  Rgb c = Each(colour, [&](V v) HWY_ATTR { return hn::Add(v, shift); });
  const V low = Smallest(c), high = Largest(c);
  const auto below = hn::Lt(low, hn::Zero(s::D())), above = hn::Gt(high, limit);
  const V from_low = hn::Sub(l, low), from_high = hn::Sub(high, l), room = hn::Sub(limit, l);
  c = Each(c, [&](V v) HWY_ATTR {
    return hn::IfThenElse(below, hn::MulAdd(hn::Div(hn::Sub(v, l), from_low), l, l), v);
  });
  return Each(c, [&](V v) HWY_ATTR {
    return hn::IfThenElse(above, hn::MulAdd(hn::Div(hn::Sub(v, l), from_high), room, l), v);
  });
}

template <BlendMode kMode>
struct NonSeparable {
  HWY_INLINE Pixels operator()(const Pixels& a, const Pixels& b) const {
    const V zero = hn::Zero(s::D()), one = hn::Set(s::D(), 1.0f);
    const auto limited = [&](V v, V limit) HWY_ATTR { return s::ClampHigh(s::ClampLow(v, zero), limit); };
    const Rgb src{limited(a.r, a.a), limited(a.g, a.a), limited(a.b, a.a)};
    const Rgb dst{limited(b.r, b.a), limited(b.g, b.a), limited(b.b, b.a)};
    const V both = hn::Mul(a.a, b.a);
    const auto times = [](const Rgb& c, V k)
                           HWY_ATTR { return Each(c, [&](V v) HWY_ATTR { return hn::Mul(v, k); }); };
    const auto range = [](const Rgb& c) HWY_ATTR { return hn::Sub(Largest(c), Smallest(c)); };
    Rgb term;
    if constexpr (kMode == BlendMode::kHue) {
      term =
          WithLuminosity(WithSaturation(src, hn::Mul(range(dst), a.a)), hn::Mul(Luminosity(dst), a.a), both);
    } else if constexpr (kMode == BlendMode::kSaturation) {
      term =
          WithLuminosity(WithSaturation(dst, hn::Mul(range(src), b.a)), hn::Mul(Luminosity(dst), a.a), both);
    } else if constexpr (kMode == BlendMode::kColor) {
      term = WithLuminosity(times(src, b.a), hn::Mul(Luminosity(dst), a.a), both);
    } else {
      term = WithLuminosity(times(dst, a.a), hn::Mul(Luminosity(src), b.a), both);
    }
    const auto mixed = hn::And(hn::Gt(a.a, zero), hn::Gt(b.a, zero));
    const V rest_a = hn::Sub(one, a.a), rest_b = hn::Sub(one, b.a);
    const auto mix = [&](V va, V vb, V t) HWY_ATTR {
      return hn::MulAdd(rest_a, vb, hn::MulAdd(rest_b, va, hn::IfThenElseZero(mixed, t)));
    };
    return {mix(a.r, b.r, term.r), mix(a.g, b.g, term.g), mix(a.b, b.b, term.b), mix(a.a, b.a, both)};
  }
};

std::unique_ptr<graph::PointStage> NewNonSeparableStage(BlendMode mode) {
  switch (mode) {
    case BlendMode::kHue:
      return s::MakePairStage(NonSeparable<BlendMode::kHue>());
    case BlendMode::kSaturation:
      return s::MakePairStage(NonSeparable<BlendMode::kSaturation>());
    case BlendMode::kColor:
      return s::MakePairStage(NonSeparable<BlendMode::kColor>());
    default:
      return s::MakePairStage(NonSeparable<BlendMode::kLuminosity>());
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewNonSeparableStage);

std::unique_ptr<graph::PointStage> MakeNonSeparableStage(BlendMode mode) {
  return HWY_DYNAMIC_DISPATCH(NewNonSeparableStage)(mode);
}

}  // namespace tessera::ops
#endif
