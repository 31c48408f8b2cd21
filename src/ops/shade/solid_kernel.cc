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

#include "ops/shade/filtered-inl.h"
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
  explicit SolidStage(const SolidPlan& plan) : plan_(plan) {}

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
    if (plan_.footprint) return Filtered(args, i, c, p);
    switch (q.kind) {
      case SolidKind::kTable: {
        if (plan_.table_channels == 1) return {p.r, p.r, p.r, SetF(1)};
        return {p.r, p.g, p.b, plan_.table_channels == 4 ? p.a : SetF(1)};
      }
      case SolidKind::kMarble: {
        const V turbulence = plane(2);
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
        const V v = Clamped(hn::MulAdd(plane(2), SetF(0.5), SetF(0.5)), hn::Zero(d), SetF(1));
        return {v, v, v, SetF(1)};
      }
      case SolidKind::kContours:
        return Contours(p);
      default:
        return Halftone(c, p);
    }
  }

  // The footprint of pixels in the solid: a symmetric matrix, the squares first.
  struct Footprint {
    s::Pixels square, mixed;  // xx, yy, zz; xy, xz, yz
    HWY_INLINE V Trace() const { return hn::Add(hn::Add(square.r, square.g), square.b); }
    // The squared width of the footprint along a gradient.
    template <int kPart>
    HWY_INLINE VD Along(VD x, VD y, VD z) const {
      const VD mixed_terms = hn::MulAdd(
          hn::Mul(x, y), Part<kPart>(mixed.r),
          hn::MulAdd(hn::Mul(x, z), Part<kPart>(mixed.g), hn::Mul(hn::Mul(y, z), Part<kPart>(mixed.b))));
      return hn::MulAdd(
          hn::Mul(x, x), Part<kPart>(square.r),
          hn::MulAdd(hn::Mul(y, y), Part<kPart>(square.g),
                     hn::MulAdd(hn::Mul(z, z), Part<kPart>(square.b), hn::Add(mixed_terms, mixed_terms))));
    }
  };

  // What is left of a noise's value in the mean over a footprint of so many squared cells.
  static HWY_INLINE V Fade(V cells, double fade) {
    return hn::Div(SetF(1), hn::MulAdd(cells, SetF(fade), SetF(1)));
  }
  struct Sum {
    V value, variance;
  };
  // Octaves one by one, each as its mean over the footprint, and the variance within.
  HWY_INLINE Sum Octaves(const graph::PointArgs& args, int i, const Footprint& footprint, double cells,
                         double fade, double variance) const {
    const s::D d;
    const V trace = footprint.Trace();
    Sum sum = {hn::Zero(d), hn::Zero(d)};
    double gain = 1;
    for (int k = 0; k < plan_.octaves; ++k, gain *= 0.5, cells *= 2) {
      const V left = Fade(hn::Mul(trace, SetF(cells * cells)), fade);
      const V value = hn::LoadU(d, args.in[2 + k][0] + i), mean = SetF(gain * plan_.mean);
      sum.value = hn::Add(sum.value, hn::MulAdd(left, hn::Sub(value, mean), mean));
      sum.variance =
          hn::MulAdd(hn::NegMulAdd(left, left, SetF(1)), SetF(gain * gain * variance), sum.variance);
    }
    return sum;
  }

  // The procedure's mean over the footprint.
  HWY_INLINE Texel Filtered(const graph::PointArgs& args, int i, const s::Pixels& c,
                            const s::Pixels& p) const {
    const s::D d;
    const SolidParams& q = plan_.params;
    const int last = 2 + plan_.octaves + (q.kind == SolidKind::kWood ? 1 : 0);
    const Footprint footprint = {s::LoadPlanes(args.in[last], i), s::LoadPlanes(args.in[last + 1], i)};
    switch (q.kind) {
      case SolidKind::kMarble: {
        const Sum noise = Octaves(args, i, footprint, q.frequency, kSizeFade, kSizeVariance);
        const double turbulence = kMarbleTurbulence * q.strength;
        return InColors([&]<int kPart>(VD* color) HWY_ATTR {
          const double row[4] = {q.frequency * kMarbleAxis[0], q.frequency * kMarbleAxis[1],
                                 q.frequency * kMarbleAxis[2], 0};
          const VD phase = hn::MulAdd(Part<kPart>(noise.value), SetD(turbulence),
                                      RowTimes(row, Part<kPart>(p.r), Part<kPart>(p.g), Part<kPart>(p.b)));
          const VD square =
              hn::MulAdd(Part<kPart>(noise.variance), SetD(12 * turbulence * turbulence),
                         footprint.template Along<kPart>(SetD(row[0]), SetD(row[1]), SetD(row[2])));
          bands_.Mean(phase, FootprintWidth(square, kNarrowest), color);
        });
      }
      case SolidKind::kWood: {
        const Sum noise = Octaves(args, i, footprint, kWoodBendCells, kNoiseFade, kNoiseVariance);
        const double bend = kWoodBend * q.strength;
        const Texel t = InColors([&]<int kPart>(VD* color) HWY_ATTR {
          const VD x = hn::Sub(Part<kPart>(p.r), SetD(0.5)), y = hn::Sub(Part<kPart>(p.g), SetD(0.5));
          const VD radius = hn::Sqrt(hn::MulAdd(x, x, hn::Mul(y, y)));
          // On the axis itself rings have no direction.
          const VD scale = hn::Div(SetD(q.frequency), hn::Max(radius, SetD(1e-30)));
          const VD square = hn::MulAdd(
              Part<kPart>(noise.variance), SetD(12 * bend * bend),
              footprint.template Along<kPart>(hn::Mul(x, scale), hn::Mul(y, scale), hn::Zero(s::DD())));
          const VD rings =
              hn::MulAdd(Part<kPart>(noise.value), SetD(bend), hn::Mul(radius, SetD(q.frequency)));
          rings_.Mean(rings, FootprintWidth(square, kNarrowest), color);
        });
        const V across =
            hn::Mul(hn::Add(footprint.square.r, footprint.square.g), SetF(kWoodAcross * kWoodAcross));
        const V cells = hn::MulAdd(footprint.square.b, SetF(kWoodAlong * kWoodAlong), across);
        const V grain = hn::Mul(hn::LoadU(d, args.in[last - 1][0] + i), Fade(cells, kNoiseFade));
        const V shade = hn::MulAdd(grain, SetF(kWoodGrain), SetF(1));
        return {hn::Mul(t.r, shade), hn::Mul(t.g, shade), hn::Mul(t.b, shade), t.a};
      }
      case SolidKind::kNoise: {
        const Sum noise = Octaves(args, i, footprint, q.frequency, kNoiseFade, kNoiseVariance);
        const V v = Clamped(hn::MulAdd(noise.value, SetF(0.5), SetF(0.5)), hn::Zero(d), SetF(1));
        return {v, v, v, SetF(1)};
      }
      case SolidKind::kContours: {
        VD covered[kParts];
        EachPart([&]<int kPart>() HWY_ATTR {
          const double row[4] = {q.frequency * q.plane[0], q.frequency * q.plane[1], q.frequency * q.plane[2],
                                 0};
          const VD at = RowTimes(row, Part<kPart>(p.r), Part<kPart>(p.g), Part<kPart>(p.b));
          const VD square = footprint.template Along<kPart>(SetD(row[0]), SetD(row[1]), SetD(row[2]));
          covered[kPart] = LineCoverage(at, FootprintWidth(square, kNarrowest), q.width);
        });
        return Inked(Join(covered));
      }
      default:
        return FilteredScreen(c, p, footprint);
    }
  }

  // The share of a footprint in which the screen is not below the luminance: the three triangles' sum, taken
  // as even between the ends that its variance gives.
  HWY_INLINE Texel FilteredScreen(const s::Pixels& c, const s::Pixels& p, const Footprint& footprint) const {
    const double cells = plan_.params.frequency;
    VD covered[kParts];
    EachPart([&]<int kPart>() HWY_ATTR {
      const auto axis = [&](V at, V square) HWY_ATTR {
        const VD width = FootprintWidth(hn::Mul(Part<kPart>(square), SetD(cells * cells)), kNarrowestScreen);
        return TriangleMoments(hn::Mul(Part<kPart>(at), SetD(cells)), width);
      };
      const TriangleMoments x = axis(p.r, footprint.square.r), y = axis(p.g, footprint.square.g),
                            z = axis(p.b, footprint.square.b);
      // Where the axes move together their triangles do.
      const VD together =
          hn::MulAdd(hn::Mul(x.slope, y.slope), Part<kPart>(footprint.mixed.r),
                     hn::MulAdd(hn::Mul(x.slope, z.slope), Part<kPart>(footprint.mixed.g),
                                hn::Mul(hn::Mul(y.slope, z.slope), Part<kPart>(footprint.mixed.b))));
      const VD variance = hn::MulAdd(together, SetD(2.0 / 3 * cells * cells),
                                     hn::Add(hn::Add(x.variance, y.variance), z.variance));
      const VD half = FootprintWidth(hn::Mul(variance, SetD(3)), kNarrowestScreen);
      const VD mean = hn::Add(hn::Add(x.mean, y.mean), z.mean);
      const VD luminance =
          hn::MulAdd(Part<kPart>(c.b), SetD(0.0722),
                     hn::MulAdd(Part<kPart>(c.g), SetD(0.7152), hn::Mul(Part<kPart>(c.r), SetD(0.2126))));
      const VD above = hn::Div(hn::Sub(mean, ScreenLevel(luminance)), hn::Add(half, half));
      covered[kPart] = hn::Min(hn::Max(hn::Add(above, SetD(0.5)), hn::Zero(s::DD())), SetD(1));
    });
    return Inked(Join(covered));
  }

  // An opaque texel of three doubles per part.
  template <class F>
  static HWY_INLINE Texel InColors(const F& f) {
    VD parts[3][kParts];
    EachPart([&]<int kPart>() HWY_ATTR {
      VD color[3];
      f.template operator()<kPart>(color);
      for (size_t k = 0; k < 3; ++k) parts[k][kPart] = color[k];
    });
    return {Join(parts[0]), Join(parts[1]), Join(parts[2]), SetF(1)};
  }

  HWY_INLINE Texel Contours(const s::Pixels& p) const {
    const SolidParams& q = plan_.params;
    const V f = Fraction([&]<int kPart>() HWY_ATTR {
      const double row[4] = {q.frequency * q.plane[0], q.frequency * q.plane[1], q.frequency * q.plane[2],
                             0.5};
      return RowTimes(row, Part<kPart>(p.r), Part<kPart>(p.g), Part<kPart>(p.b));
    });
    // Distance to the line in spacings, minus half its width.
    const V outside = hn::Sub(hn::Abs(hn::Sub(f, SetF(0.5))), SetF(0.5 * q.width));
    return Inked(hn::IfThenElseZero(hn::Lt(outside, hn::Zero(s::D())), SetF(1)));
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
  BandFilter bands_;
  RingFilter rings_;
};

std::unique_ptr<graph::PointStage> MakeSolid(const SolidPlan& plan) {
  return std::make_unique<SolidStage>(plan);
}

void Footprint(const float* const rows[3], int channels, int count, bool mixed, float* out) {
  const int pixel = channels;
  for (int i = 0; i < count; ++i) {
    const float* const here = rows[1] + (i + 1) * pixel;
    const float* const neighbours[4] = {here - pixel, here + pixel, rows[0] + (i + 1) * pixel,
                                        rows[2] + (i + 1) * pixel};
    double sum[3] = {};
    for (int axis = 0; axis < 2; ++axis) {
      double j[2][3], square[2];
      bool number[2];
      for (int side = 0; side < 2; ++side) {
        square[side] = 0;
        for (int c = 0; c < 3; ++c) {
          j[side][c] = double{neighbours[2 * axis + side][c]} - double{here[c]};
          square[side] += j[side][c] * j[side][c];
        }
        number[side] = square[side] <= 1e100;  // neither NaN nor infinite
      }
      const double both = number[0] && number[1] ? square[0] + square[1] : 0;
      for (int side = 0; side < 2; ++side) {
        if (!number[side]) continue;
        // Alone it counts for both.
        const double weight = !number[1 - side] ? 1 : both > 0 ? square[1 - side] / both : 0;
        const double* const v = j[side];
        sum[0] += weight * (mixed ? v[0] * v[1] : v[0] * v[0]);
        sum[1] += weight * (mixed ? v[0] * v[2] : v[1] * v[1]);
        sum[2] += weight * (mixed ? v[1] * v[2] : v[2] * v[2]);
      }
    }
    for (int c = 0; c < 3; ++c) out[3 * i + c] = static_cast<float>(std::min(std::max(sum[c], -1e30), 1e30));
  }
}
FootprintFunction FindFootprintHere() { return &Footprint; }

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MakeSolid);
HWY_EXPORT(FindFootprintHere);
std::unique_ptr<graph::PointStage> MakeSolidStage(const SolidPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(MakeSolid)(plan);
}
FootprintFunction FindFootprint() { return HWY_DYNAMIC_DISPATCH(FindFootprintHere)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
