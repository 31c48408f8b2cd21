// Solid textures on blocks of pixels: procedures at p, and how they meet the picture's colour.
#include "ops/shade/solid_kernel.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/shade/solid_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/doubles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::EachPart;
using s::Join;
using s::kParts;
using s::Part;
using s::RowTimes;
using s::SetD;
using s::V;
using s::VD;
namespace {

HWY_INLINE V SetF(double v) { return hn::Set(s::D(), static_cast<float>(v)); }
HWY_INLINE V Clamped(V v, V low, V high) { return hn::Min(hn::Max(v, low), high); }

// A texture's colour, premultiplied by its own alpha.
struct Texel {
  V r, g, b, a;
};

// v - floor(v) of a sum in double, as float in [0, 1].
template <class F>
HWY_INLINE V Fraction(const F& sum) {
  VD parts[kParts];
  EachPart([&]<int kPart>() HWY_ATTR {
    const VD v = sum.template operator()<kPart>();
    parts[kPart] = hn::Sub(v, hn::Floor(v));
  });
  return Join(parts);
}

// 1/2 + 1/2 sin(2 pi f) of f in [0, 1], to 2e-7.
HWY_INLINE V Wave(V f) {
  // -cos(2 pi h) of h in [0, 1/2] by sin of h - 1/4.
  const V shifted = hn::Sub(f, SetF(0.25));
  const V h = hn::Sub(hn::Abs(hn::Sub(shifted, hn::Round(shifted))), SetF(0.25));  // [-1/4, 1/4]
  const V q = hn::Mul(h, h);
  V p = SetF(-15.094643);
  for (const double c : {42.058694, -76.705860, 81.605249, -41.341702, 6.2831853})
    p = hn::MulAdd(p, q, SetF(c));
  return hn::NegMulAdd(hn::Mul(h, p), SetF(0.5), SetF(0.5));
}

template <size_t n>
HWY_INLINE Texel Ramp(const SolidStop (&stops)[n], V t) {
  const V zero = hn::Zero(s::D());
  V c[3] = {SetF(stops[0].color[0]), SetF(stops[0].color[1]), SetF(stops[0].color[2])};
  for (size_t k = 0; k + 1 < n; ++k) {
    const double width = stops[k + 1].at - stops[k].at;
    const V x = Clamped(hn::Sub(t, SetF(stops[k].at)), zero, SetF(width));
    for (size_t i = 0; i < 3; ++i) {
      c[i] = hn::MulAdd(x, SetF((stops[k + 1].color[i] - stops[k].color[i]) / width), c[i]);
    }
  }
  return {c[0], c[1], c[2], SetF(1)};
}

class SolidStage final : public graph::PointStage {
 public:
  explicit SolidStage(const SolidPlan& plan) : plan_(plan) {
    const double* const r = plan.params.plane.data();
    slope_ = plan.params.frequency * (std::fabs(r[0]) + std::fabs(r[1]) + std::fabs(r[2]));
  }

  void Run(const graph::PointArgs& args) const override {
    const s::D d;
    float* const out[4] = {args.out[0], args.out[1], args.out[2], args.out[3]};
    for (int i = 0; i < args.count; i += static_cast<int>(hn::Lanes(d))) {
      const s::Pixels c = s::LoadPlanes(args.in[0], i), p = s::LoadPlanes(args.in[1], i);
      const Texel t = Make(args, i, c, p);
      // A place that is not a number leaves the pixel alone.
      auto keep = hn::IsNaN(p.r);
      if (plan_.params.kind != SolidKind::kTable || plan_.table_channels > 1) {
        keep = hn::Or(keep, hn::Or(hn::IsNaN(p.g), hn::IsNaN(p.b)));
      }
      const V r = hn::IfThenElse(keep, c.r, Blend(c.r, c.a, t.r, t.a));
      const V g = hn::IfThenElse(keep, c.g, Blend(c.g, c.a, t.g, t.a));
      const V b = hn::IfThenElse(keep, c.b, Blend(c.b, c.a, t.b, t.a));
      s::StorePlanes({r, g, b, c.a}, out, i);
    }
  }

 private:
  HWY_INLINE V Blend(V color, V alpha, V texture, V opaque) const {
    switch (plan_.params.blend) {
      case SolidBlend::kModulate:  // transparent places leave the colour
        return hn::Mul(color, hn::Add(texture, hn::Sub(SetF(1), opaque)));
      case SolidBlend::kReplace:
        return hn::Mul(texture, alpha);
      case SolidBlend::kOver:
        return hn::MulAdd(texture, alpha, hn::Mul(color, hn::Sub(SetF(1), opaque)));
      default:
        return hn::MulAdd(texture, alpha, color);
    }
  }

  HWY_INLINE Texel Make(const graph::PointArgs& args, int i, const s::Pixels& c, const s::Pixels& p) const {
    const s::D d;
    const auto plane = [&](int k) HWY_ATTR { return hn::LoadU(d, args.in[k][0] + i); };
    const SolidParams& q = plan_.params;
    switch (q.kind) {
      case SolidKind::kTable: {
        if (plan_.table_channels == 1) return {p.r, p.r, p.r, SetF(1)};
        return {p.r, p.g, p.b, plan_.table_channels == 4 ? p.a : SetF(1)};
      }
      case SolidKind::kMarble: {
        const V turbulence = Noise(args, i);
        const V f = Fraction([&]<int kPart>() HWY_ATTR {
          const VD x = Part<kPart>(p.r), y = Part<kPart>(p.g), z = Part<kPart>(p.b);
          const double bands = q.frequency;
          const double row[4] = {bands * kMarbleAxis[0], bands * kMarbleAxis[1], bands * kMarbleAxis[2], 0};
          return hn::MulAdd(Part<kPart>(turbulence), SetD(kMarbleTurbulence * q.strength),
                            RowTimes(row, x, y, z));
        });
        return Ramp(kMarbleRamp, Wave(f));
      }
      case SolidKind::kWood: {
        const V bend = plane(2), grain = plane(3);
        const V w = Fraction([&]<int kPart>() HWY_ATTR {
          const VD x = hn::Sub(Part<kPart>(p.r), SetD(0.5)), y = hn::Sub(Part<kPart>(p.g), SetD(0.5));
          const VD radius = hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y)));
          return hn::MulAdd(Part<kPart>(bend), SetD(kWoodBend * q.strength),
                            hn::Mul(radius, SetD(q.frequency)));
        });
        // Slow growth in summer, a quick dark edge.
        const V late =
            hn::Min(hn::Mul(w, SetF(1 / kWoodLate)), hn::Mul(hn::Sub(SetF(1), w), SetF(1 / (1 - kWoodLate))));
        const Texel t = Ramp(kWoodRamp, hn::Mul(late, late));
        const V shade = hn::MulAdd(grain, SetF(kWoodGrain), SetF(1));
        return {hn::Mul(t.r, shade), hn::Mul(t.g, shade), hn::Mul(t.b, shade), t.a};
      }
      case SolidKind::kNoise: {
        const V v = Clamped(hn::MulAdd(Noise(args, i), SetF(0.5), SetF(0.5)), hn::Zero(d), SetF(1));
        return {v, v, v, SetF(1)};
      }
      case SolidKind::kContours:
        return Contours(args, i, p);
      default:
        return Halftone(c, p);
    }
  }

  // The noise of marble, or its octaves one by one, each fading where it is finer than the pixels.
  HWY_INLINE V Noise(const graph::PointArgs& args, int i) const {
    const s::D d;
    if (!plan_.spread) return hn::LoadU(d, args.in[2][0] + i);
    const V spread = hn::Mul(hn::LoadU(d, args.in[2 + plan_.octaves][0] + i), SetF(plan_.params.frequency));
    V sum = hn::Zero(d);
    float gain = 1, cells = 1;
    for (int k = 0; k < plan_.octaves; ++k, gain *= 0.5f, cells *= 2) {
      const V fade = Clamped(hn::NegMulAdd(spread, SetF(4 * cells), SetF(2)), hn::Zero(d), SetF(1));
      const V value = hn::LoadU(d, args.in[2 + k][0] + i), mean = SetF(gain * plan_.mean);
      sum = hn::Add(sum, hn::MulAdd(fade, hn::Sub(value, mean), mean));
    }
    return sum;
  }

  HWY_INLINE Texel Contours(const graph::PointArgs& args, int i, const s::Pixels& p) const {
    const s::D d;
    const SolidParams& q = plan_.params;
    const V f = Fraction([&]<int kPart>() HWY_ATTR {
      const double row[4] = {q.frequency * q.plane[0], q.frequency * q.plane[1], q.frequency * q.plane[2],
                             0.5};
      return RowTimes(row, Part<kPart>(p.r), Part<kPart>(p.g), Part<kPart>(p.b));
    });
    // Distance to the line in spacings, minus half its width.
    const V outside = hn::Sub(hn::Abs(hn::Sub(f, SetF(0.5))), SetF(0.5 * q.width));
    V covered;
    if (plan_.spread) {  // an edge one pixel wide
      const V pixel = hn::Max(hn::Mul(hn::LoadU(d, args.in[2][0] + i), SetF(slope_)), SetF(1e-30));
      covered = Clamped(hn::Sub(SetF(0.5), hn::Div(outside, pixel)), hn::Zero(d), SetF(1));
    } else {
      covered = hn::IfThenElseZero(hn::Lt(outside, hn::Zero(d)), SetF(1));
    }
    return Inked(covered);
  }

  // The ink where `covered` is 1.
  HWY_INLINE Texel Inked(V covered) const {
    const auto& ink = plan_.params.ink;
    Texel t = {hn::Mul(covered, SetF(ink[0])), hn::Mul(covered, SetF(ink[1])), hn::Mul(covered, SetF(ink[2])),
               covered};
    if (plan_.params.blend == SolidBlend::kReplace) {  // white paper
      const V paper = hn::Sub(SetF(1), covered);
      t = {hn::Add(t.r, paper), hn::Add(t.g, paper), hn::Add(t.b, paper), SetF(1)};
    }
    return t;
  }

  HWY_INLINE Texel Halftone(const s::Pixels& c, const s::Pixels& p) const {
    const V one = SetF(1), zero = hn::Zero(s::D());
    const auto triangle = [&](V v) HWY_ATTR {
      const V f = Fraction([&]<int kPart>()
                               HWY_ATTR { return hn::Mul(Part<kPart>(v), SetD(plan_.params.frequency)); });
      return hn::Abs(hn::MulAdd(f, SetF(2), SetF(-1)));
    };
    // The sum of three even distributions, made even by its own distribution.
    const V x = hn::Add(hn::Add(triangle(p.r), triangle(p.g)), triangle(p.b)), rest = hn::Sub(SetF(3), x);
    const V sixth = SetF(1.0 / 6);
    const V low = hn::Mul(hn::Mul(hn::Mul(x, x), x), sixth);
    const V middle =
        hn::Mul(hn::MulAdd(hn::MulAdd(hn::MulAdd(x, SetF(-2), SetF(9)), x, SetF(-9)), x, SetF(3)), sixth);
    const V high = hn::Sub(one, hn::Mul(hn::Mul(hn::Mul(rest, rest), rest), sixth));
    const V threshold = hn::IfThenElse(hn::Lt(x, one), low, hn::IfThenElse(hn::Lt(x, SetF(2)), middle, high));
    const V luminance =
        hn::MulAdd(c.b, SetF(0.0722), hn::MulAdd(c.g, SetF(0.7152), hn::Mul(c.r, SetF(0.2126))));
    return Inked(hn::IfThenElse(hn::Gt(luminance, threshold), zero, one));
  }

  SolidPlan plan_;
  double slope_ = 1;
};

std::unique_ptr<graph::PointStage> MakeSolid(const SolidPlan& plan) {
  return std::make_unique<SolidStage>(plan);
}

void Spread(const float* const rows[3], int channels, int count, float* out) {
  const auto nearer = [](float a, float b) {  // the one that is a number, the smaller of two
    if (!(a == a)) return b;
    return b == b ? std::min(a, b) : a;
  };
  const int pixel = channels;
  for (int i = 0; i < count; ++i) {
    const float* const here = rows[1] + (i + 1) * pixel;
    const float* const neighbours[4] = {here - pixel, here + pixel, rows[0] + (i + 1) * pixel,
                                        rows[2] + (i + 1) * pixel};
    float reach[4];
    for (int n = 0; n < 4; ++n) {
      float largest = 0;
      for (int c = 0; c < 3; ++c) {
        const float difference = std::fabs(neighbours[n][c] - here[c]);
        largest = difference == difference ? std::max(largest, difference) : difference;
        if (!(largest == largest)) break;
      }
      reach[n] = largest;
    }
    const float x = nearer(reach[0], reach[1]), y = nearer(reach[2], reach[3]);
    const float both = x == x ? (y == y ? std::max(x, y) : x) : y;
    out[i] = both == both ? both : 0.0f;
  }
}
SpreadFunction FindSpreadHere() { return &Spread; }

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MakeSolid);
HWY_EXPORT(FindSpreadHere);
std::unique_ptr<graph::PointStage> MakeSolidStage(const SolidPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(MakeSolid)(plan);
}
SpreadFunction FindSpread() { return HWY_DYNAMIC_DISPATCH(FindSpreadHere)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
