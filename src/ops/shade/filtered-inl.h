// Periodic functions of one argument averaged over a footprint of it: by differences of their integrals,
// which are known. Marble's bands, wood's rings, lines, and the cells of a screen.
#if defined(TESSERA_OPS_SHADE_FILTERED_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_SHADE_FILTERED_INL_H_
#undef TESSERA_OPS_SHADE_FILTERED_INL_H_
#else
#define TESSERA_OPS_SHADE_FILTERED_INL_H_
#endif

#include <hwy/highway.h>

#include <cmath>
#include <numbers>

#include "ops/shade/solid_kernel.h"
#include "simd/doubles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::SetD;
using s::VD;

HWY_INLINE VD Periodic(VD v) { return hn::Sub(v, hn::Floor(v)); }
HWY_INLINE VD FootprintWidth(VD square, double narrowest) {
  return hn::Min(hn::Max(hn::Sqrt(hn::Max(square, hn::Zero(s::DD()))), SetD(narrowest)), SetD(kWidest));
}

// The two ends of a footprint around a place: whole periods and the rest of each.
struct Ends {
  VD from, to, periods, scale;
  HWY_INLINE Ends(VD at, VD width) {
    // The place in its own period first, so that ends differ exactly however far away it is.
    const VD f = Periodic(s::NumberOr(at, hn::Zero(s::DD()))), half = hn::Mul(width, SetD(0.5));
    const VD a = hn::Sub(f, half), b = hn::Add(f, half), low = hn::Floor(a), high = hn::Floor(b);
    from = hn::Sub(a, low), to = hn::Sub(b, high);
    periods = hn::Sub(high, low);
    scale = hn::Div(SetD(1), width);
  }
  // The mean of a function whose integral over a period is `whole`, and from its start to each end so much.
  HWY_INLINE VD Mean(VD to_first, VD to_last, VD whole) const {
    return hn::Mul(hn::MulAdd(periods, whole, hn::Sub(to_last, to_first)), scale);
  }
};

// Integrals of 1/2 - 1/2 cos(2 pi f) through marble's ramp, from 0 to f: between the places where two stops
// are reached, constant + linear f + wave sin(2 pi f).
class BandFilter {
 public:
  BandFilter() {
    constexpr double kPi = std::numbers::pi;
    for (size_t k = 0; k < kSegments; ++k) {
      const SolidStop &low = kMarbleRamp[k], &high = kMarbleRamp[k + 1];
      starts_[k] = std::acos(1 - 2 * low.at) / (2 * kPi);
      for (size_t c = 0; c < 3; ++c) {
        const double slope = (high.color[c] - low.color[c]) / (high.at - low.at);
        Piece& piece = pieces_[k][c];
        piece = {0, low.color[c] + slope * (0.5 - low.at), -slope / (4 * kPi)};
        const double start = starts_[k], wave = std::sin(2 * kPi * start);
        if (k > 0) {
          const Piece& last = pieces_[k - 1][c];
          piece.constant =
              last.constant + (last.linear - piece.linear) * start + (last.wave - piece.wave) * wave;
        }
      }
    }
    for (size_t c = 0; c < 3; ++c)
      whole_[c] = 2 * (pieces_[kSegments - 1][c].constant + 0.5 * pieces_[kSegments - 1][c].linear);
  }

  // The mean colour of the bands 1/2 + 1/2 sin(2 pi phase).
  HWY_INLINE void Mean(VD phase, VD width, VD* color) const {
    const Ends ends(hn::Add(phase, SetD(0.25)), width);
    VD first[3], last[3];
    Integral(ends.from, first);
    Integral(ends.to, last);
    for (size_t c = 0; c < 3; ++c) color[c] = ends.Mean(first[c], last[c], SetD(whole_[c]));
  }

 private:
  static constexpr size_t kSegments = std::size(kMarbleRamp) - 1;
  struct Piece {
    double constant, linear, wave;
  };

  HWY_INLINE void Integral(VD f, VD* sum) const {
    // The second half of a period mirrors the first.
    const auto mirrored = hn::Gt(f, SetD(0.5));
    const VD g = hn::IfThenElse(mirrored, hn::Sub(SetD(1), f), f);
    const VD wave = SineOfTurns(g);
    for (size_t c = 0; c < 3; ++c) {
      const auto piece = [&](size_t k) HWY_ATTR {
        const Piece& p = pieces_[k][c];
        return hn::MulAdd(SetD(p.wave), wave, hn::MulAdd(SetD(p.linear), g, SetD(p.constant)));
      };
      VD v = piece(0);
      for (size_t k = 1; k < kSegments; ++k) v = hn::IfThenElse(hn::Ge(g, SetD(starts_[k])), piece(k), v);
      sum[c] = hn::IfThenElse(mirrored, hn::Sub(SetD(whole_[c]), v), v);
    }
  }
  // sin(2 pi g) of g in [0, 1/2], to 1e-11.
  static HWY_INLINE VD SineOfTurns(VD g) {
    const VD x = hn::Mul(hn::Sub(SetD(0.25), hn::Abs(hn::Sub(g, SetD(0.25)))), SetD(2 * std::numbers::pi));
    const VD q = hn::Mul(x, x);
    return hn::Mul(x, s::Polynomial(q, {1.0, -1.0 / 6, 1.0 / 120, -1.0 / 5040, 1.0 / 362880, -1.0 / 39916800,
                                        1.0 / 6227020800.0, -1.0 / 1307674368000.0}));
  }

  double starts_[kSegments];
  Piece pieces_[kSegments][3];
  double whole_[3];
};

// Wood's rings: late = f / kWoodLate, then (1 - f) / (1 - kWoodLate), squared, through its ramp of two parts.
class RingFilter {
 public:
  HWY_INLINE void Mean(VD rings, VD width, VD* color) const {
    const Ends ends(rings, width);
    for (size_t c = 0; c < 3; ++c) {
      color[c] = ends.Mean(Integral(ends.from, c), Integral(ends.to, c), SetD(OfLate(1, c)));
    }
  }

 private:
  static constexpr double Slope(size_t k, size_t c) {
    return (kWoodRamp[k + 1].color[c] - kWoodRamp[k].color[c]) / (kWoodRamp[k + 1].at - kWoodRamp[k].at);
  }
  // The integral of the ramp of late^2 from 0: of the first part's line all the way, and of what the second
  // part's line is steeper from where it begins.
  static HWY_INLINE VD OfLate(VD late, size_t c) {
    const double bend = std::sqrt(kWoodRamp[1].at);
    const VD more = hn::Max(late, SetD(bend));
    const VD line = hn::MulAdd(hn::Mul(hn::Mul(late, late), late), SetD(Slope(0, c) / 3),
                               hn::Mul(late, SetD(kWoodRamp[0].color[c])));
    // (t^2 - at) from bend to t: t^3 / 3 - at t + 2/3 bend^3.
    const VD second =
        hn::MulAdd(more, hn::Sub(hn::Mul(hn::Mul(more, more), SetD(1.0 / 3)), SetD(kWoodRamp[1].at)),
                   SetD(2.0 / 3 * bend * bend * bend));
    return hn::MulAdd(second, SetD(Slope(1, c) - Slope(0, c)), line);
  }
  static double OfLate(double late, size_t c) {
    const double bend = std::sqrt(kWoodRamp[1].at), more = late > bend ? late : bend;
    return kWoodRamp[0].color[c] * late + Slope(0, c) / 3 * late * late * late +
           (Slope(1, c) - Slope(0, c)) *
               (more * (more * more / 3 - kWoodRamp[1].at) + 2.0 / 3 * bend * bend * bend);
  }
  static HWY_INLINE VD Integral(VD f, size_t c) {
    const VD rising = OfLate(hn::Mul(hn::Min(f, SetD(kWoodLate)), SetD(1 / kWoodLate)), c);
    const VD falling =
        OfLate(hn::Mul(hn::Min(hn::Sub(SetD(1), f), SetD(1 - kWoodLate)), SetD(1 / (1 - kWoodLate))), c);
    return hn::MulAdd(rising, SetD(kWoodLate),
                      hn::Mul(hn::Sub(SetD(OfLate(1, c)), falling), SetD(1 - kWoodLate)));
  }
};

// How much of a footprint lines cover that are `line` of their spacing wide, at whole numbers.
HWY_INLINE VD LineCoverage(VD at, VD width, double line) {
  const Ends ends(hn::Add(at, SetD(0.5)), width);
  const auto covered = [line](VD f) HWY_ATTR {
    const VD inside = hn::Add(hn::Sub(f, SetD(0.5)), SetD(0.5 * line));
    return hn::Min(hn::Max(inside, hn::Zero(s::DD())), SetD(line));
  };
  return ends.Mean(covered(ends.from), covered(ends.to), SetD(line));
}

// Of |2 frac(at) - 1| over a footprint: mean, variance, and half the mean slope.
struct TriangleMoments {
  VD mean, variance, slope;
  HWY_INLINE TriangleMoments(VD at, VD width) {
    const Ends ends(at, width);
    const VD from = Signed(ends.from), to = Signed(ends.to);
    mean = ends.Mean(First(from), First(to), SetD(0.5));
    variance = hn::NegMulAdd(mean, mean, ends.Mean(Second(from), Second(to), SetD(1.0 / 3)));
    slope = hn::Mul(hn::Mul(hn::Sub(hn::Abs(to), hn::Abs(from)), ends.scale), SetD(0.5));
  }

 private:
  // Of g = 2 f - 1 the integrals of |g| and g^2 are (g |g| + 1) / 4 and (g^3 + 1) / 6.
  static HWY_INLINE VD Signed(VD f) { return hn::MulAdd(f, SetD(2), SetD(-1)); }
  static HWY_INLINE VD First(VD g) { return hn::MulAdd(hn::Mul(g, hn::Abs(g)), SetD(0.25), SetD(0.25)); }
  static HWY_INLINE VD Second(VD g) {
    return hn::MulAdd(hn::Mul(hn::Mul(g, g), g), SetD(1.0 / 6), SetD(1.0 / 6));
  }
};

// Where the distribution of the sum of three even numbers is `share`, in [0, 3]; below and above for shares
// of 0 or less and more than 1.
HWY_INLINE VD ScreenLevel(VD share) {
  // Half of it mirrors the other.
  const auto upper = hn::Gt(share, SetD(0.5));
  const VD low = hn::IfThenElse(upper, hn::Sub(SetD(1), share), share);
  const VD six = hn::Max(hn::Mul(low, SetD(6)), SetD(1e-30));
  const VD root = s::Exp2OfDouble(hn::Mul(s::Log2OfDouble(six), SetD(1.0 / 3)));
  // -x^3 / 3 + 3/2 x^2 - 3/2 x + 1/2 from 1 to 3/2 by Newton's steps.
  VD x = hn::MulAdd(hn::Sub(low, SetD(1.0 / 6)), SetD(1.5), SetD(1));
  for (int k = 0; k < 4; ++k) {
    const VD value = s::Polynomial(x, {0.5, -1.5, 1.5, -1.0 / 3});
    x = hn::Sub(x, hn::Div(hn::Sub(value, low), s::Polynomial(x, {-1.5, 3.0, -1.0})));
  }
  x = hn::IfThenElse(hn::Lt(low, SetD(1.0 / 6)), root, x);
  x = hn::IfThenElse(upper, hn::Sub(SetD(3), x), x);
  x = hn::IfThenElse(hn::Gt(share, SetD(0)), x, SetD(-1e30));
  return hn::IfThenElse(hn::Gt(share, SetD(1)), SetD(1e30), x);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
