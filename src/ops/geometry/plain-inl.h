// Runs of which no pixel needs a second look: all taps lie in the image, nothing is snapped and nothing is
// reduced. Their positions go to taps without a stop, with the results of FindTaps.
#if defined(TESSERA_OPS_GEOMETRY_PLAIN_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_GEOMETRY_PLAIN_INL_H_
#undef TESSERA_OPS_GEOMETRY_PLAIN_INL_H_
#else
#define TESSERA_OPS_GEOMETRY_PLAIN_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "ops/geometry/gather.h"
#include "ops/geometry/positions-inl.h"
#include "ops/lookup/squares-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

static_assert(kRun == kSquares);

// Taps of a plain run: first taps' places in memory, with the distances of squares or with fractions.
struct PlainTaps : Squares {
  alignas(64) float fx[kRun], fy[kRun];
};

// Nearer than this to a pixel's centre or to the middle between two, a position may be snapped.
constexpr float kClose = static_cast<float>(4 * kSnap);

// Whether no distance of a run is close to what it would be snapped to; the middle itself is as good as any.
inline bool Apart(const PlainTaps& taps, int count) {
  const s::D d;
  const V middle = hn::Set(d, 0.5f), close = hn::Set(d, kClose);
  auto apart = hn::Eq(middle, middle);
  for (int i = 0; i < 2 * count; i += s::kLanes) {
    const V h = hn::Abs(hn::Load(d, taps.distance + i));
    apart = hn::And(apart, hn::Or(hn::Eq(h, middle), hn::Ge(hn::Min(h, hn::Sub(middle, h)), close)));
  }
  return hn::AllTrue(d, apart);
}

// Squares of positions that all lie in the image, or may not where `inside` is false. position(i, x, y) gives
// the vectors from pixel i on, in double.
template <bool kInside, class Position>
HWY_INLINE bool FindSquares(const GatherSource& source, int count, Position position, PlainTaps& to) {
  const DD d;
  const DF f;
  const DI di;
  const int step = static_cast<int>(hn::Lanes(d));
  const VD stride = hn::Set(d, source.pixels_per_row), one = hn::Set(d, 1.0),
           last_x = hn::Set(d, source.window.width() - 2), last_y = hn::Set(d, source.window.height() - 2);
  const auto up = hn::Set(di, 2 * source.pixels_per_row);
  const s::D all;
  const V middle = hn::Set(all, 0.5f);
  V least = middle;
  auto within = hn::Eq(one, one);
  for (int i = 0; i < count; i += step) {
    VD x, y;
    position(i, x, y);
    const VD near_x = hn::Round(x), near_y = hn::Round(y);
    if constexpr (!kInside) {
      within = hn::And(within, hn::And(hn::And(hn::Ge(near_x, one), hn::Le(near_x, last_x)),
                                       hn::And(hn::Ge(near_y, one), hn::Le(near_y, last_y))));
    }
    const auto gx = hn::DemoteTo(f, hn::Sub(x, near_x)), gy = hn::DemoteTo(f, hn::Sub(y, near_y));
    const V h = hn::Abs(hn::Combine(all, gy, gx));
    least = hn::Min(least, hn::Min(h, hn::Sub(middle, h)));
    hn::StoreInterleaved2(gx, gy, f, to.distance + 2 * i);
    // Where the nearer pixel is the second of a square, the first one comes before.
    const auto near = hn::DemoteTo(di, hn::MulAdd(near_y, stride, near_x));
    const auto first = hn::Add(near, hn::BroadcastSignBit(hn::BitCast(di, gx)));
    const auto before = hn::And(hn::BroadcastSignBit(hn::BitCast(di, gy)), up);
    hn::Store(hn::Sub(hn::Add(first, first), before), di, to.base + i);
  }
  return hn::AllTrue(d, within) &&
         (hn::AllTrue(all, hn::Ge(least, hn::Set(all, kClose))) || Apart(to, count));
}

// First taps and fractions for any even number of taps.
template <bool kInside, class Position>
HWY_INLINE bool FindFractions(const GatherSource& source, int count, Position position, PlainTaps& to) {
  const DD d;
  const DF f;
  const DI di;
  const int step = static_cast<int>(hn::Lanes(d)), lead = (source.taps - 1) / 2;
  const VD low = hn::Set(d, lead), stride = hn::Set(d, source.pixels_per_row),
           first = hn::Set(d, -lead * (source.pixels_per_row + 1.0)),
           end_x = hn::Set(d, source.window.width() - source.taps + lead + 1),
           end_y = hn::Set(d, source.window.height() - source.taps + lead + 1);
  const auto one = hn::Set(f, 1.0f), middle = hn::Set(f, 0.5f);
  // How far twice a fraction is from a whole number: half-way between two pixels nothing is moved.
  const auto room = [&](auto fraction) HWY_ATTR {
    const auto twice = hn::Add(fraction, fraction);
    const auto away = hn::Abs(hn::Sub(twice, hn::Round(twice)));
    return hn::IfThenElse(hn::Eq(fraction, middle), one, away);
  };
  auto within = hn::Eq(low, low);
  auto least = one;
  for (int i = 0; i < count; i += step) {
    VD x, y;
    position(i, x, y);
    if constexpr (!kInside) {
      within = hn::And(within, hn::And(hn::And(hn::Ge(x, low), hn::Lt(x, end_x)),
                                       hn::And(hn::Ge(y, low), hn::Lt(y, end_y))));
    }
    const VD base_x = hn::Floor(x), base_y = hn::Floor(y);
    const auto fx = hn::DemoteTo(f, hn::Sub(x, base_x)), fy = hn::DemoteTo(f, hn::Sub(y, base_y));
    least = hn::Min(least, hn::Min(room(fx), room(fy)));
    hn::Store(fx, f, to.fx + i);
    hn::Store(fy, f, to.fy + i);
    const auto base = hn::DemoteTo(di, hn::MulAdd(base_y, stride, hn::Add(base_x, first)));
    hn::Store(hn::Add(base, base), di, to.base + i);
  }
  return hn::AllTrue(d, within) && hn::AllTrue(f, hn::Ge(least, hn::Set(f, kClose)));
}

template <bool kInside, class Position>
HWY_INLINE bool FindPlain(const GatherSource& source, int count, Position position, PlainTaps& to) {
  return source.linear ? FindSquares<kInside>(source, count, position, to)
                       : FindFractions<kInside>(source, count, position, to);
}

// Whether positions between two ends lie in the image with all taps, with more room than roundings need.
inline bool EndsInside(const GatherSource& source, double a, double b, int size) {
  constexpr double kMargin = 0x1p-8;
  const int lead = (source.taps - 1) / 2, end = size - source.taps + lead + 1;
  return std::min(a, b) >= lead + kMargin && std::max(a, b) < end - kMargin;
}

// Centres of the pixels from x0 on; steps from these are exact.
HWY_INLINE VD FirstColumn(int x0) { return hn::Add(hn::Iota(DD(), 0), hn::Set(DD(), x0 + 0.5)); }

// Along a row both coordinates of an affine map only grow or only fall, so a run's ends are what is furthest
// out.
inline bool PlainAffine(const GatherSource& source, const IndexMatrix& matrix, int x0, int y, int count,
                        PlainTaps& to) {
  const double* const m = matrix.m;
  const auto inside = [&](int axis, int size) {
    const double b = (y + 0.5) * m[3 + axis] + m[6 + axis];
    return EndsInside(source, (x0 + 0.5) * m[axis] + b, (x0 + count - 0.5) * m[axis] + b, size);
  };
  if (!inside(0, source.window.width()) || !inside(1, source.window.height())) return false;
  const MatrixRow row(matrix, y);
  const VD step = hn::Set(DD(), static_cast<double>(hn::Lanes(DD())));
  return FindPlain</*kInside=*/true>(
      source, count,
      [row, step, column = FirstColumn(x0)](int, VD& px, VD& py) mutable HWY_ATTR {
        row.Affine(column, px, py);
        column = hn::Add(column, step);
      },
      to);
}

// The same of a projective map. Whether a run reduces nowhere is told by its ends too: slopes, those of
// MatrixPositions, depend on positions and divisors.
inline bool PlainProjective(const GatherSource& source, const IndexMatrix& matrix, bool reduce, int x0, int y,
                            int count, PlainTaps& to) {
  const double* const m = matrix.m;
  double at[2][2], over[2];  // of both axes at both ends
  for (int end = 0; end < 2; ++end) {
    const double x = x0 + (end == 0 ? 0.5 : count - 0.5), row = y + 0.5, q = x * m[2] + row * m[5] + m[8];
    if (!(q > 0)) return false;
    over[end] = 1 / q;
    for (int a = 0; a < 2; ++a) at[a][end] = (x * m[a] + row * m[3 + a] + m[6 + a]) * over[end];
  }
  const auto enlarges = [&](int a) {
    double slope = 0;
    for (const double v : at[a]) {
      slope = std::max({slope, std::fabs(m[a] - v * m[2]), std::fabs(m[3 + a] - v * m[5])});
    }
    return slope * std::max(over[0], over[1]) <= 1 - 0x1p-30;
  };
  if (!EndsInside(source, at[0][0], at[0][1], source.window.width()) ||
      !EndsInside(source, at[1][0], at[1][1], source.window.height()) ||
      (reduce && !(enlarges(0) && enlarges(1)))) {
    return false;
  }
  const MatrixRow row(matrix, y);
  const VD step = hn::Set(DD(), static_cast<double>(hn::Lanes(DD())));
  return FindPlain</*kInside=*/true>(
      source, count,
      [row, step, column = FirstColumn(x0)](int, VD& px, VD& py) mutable HWY_ATTR {
        VD over;
        row.Projective(column, px, py, over);
        column = hn::Add(column, step);
      },
      to);
}

inline bool PlainMatrix(const GatherJob& job, int x0, int y, int count, PlainTaps& to) {
  const GatherMap& map = job.map;
  const IndexMatrix matrix(map, job.source.window);
  if (map.projective) return PlainProjective(job.source, matrix, map.reduce, x0, y, count, to);
  const double* const m = map.m;
  const bool enlarges = std::max({std::fabs(m[0]), std::fabs(m[3]), std::fabs(m[1]), std::fabs(m[4])}) <= 1;
  return (enlarges || !map.reduce) && PlainAffine(job.source, matrix, x0, y, count, to);
}

// Coordinates of an image whose positions are a s + b, a and b floats and |b| at most 1: products and sums
// are exact in double, so that one rounding of the distance in float is that of FindTaps. They stay in pairs.
struct PairedMap {
  V scale, offset;
  bool exact;

  explicit PairedMap(const GatherJob& job) {
    const GatherMap& map = job.map;
    const Roi& w = job.source.window;
    const double x = map.x_offset - 0.5 - w.x0, y = map.y_offset - 0.5 - w.y0;
    scale = InPairs(static_cast<float>(map.x_scale), static_cast<float>(map.y_scale));
    offset = InPairs(static_cast<float>(x), static_cast<float>(y));
    constexpr int kMost = 1 << 22;
    const auto fits = [](double v, double most) {
      return std::fabs(v) <= most && v == static_cast<float>(v);
    };
    exact = map.x_per_pixel == 0 && map.y_per_pixel == 0 && fits(map.x_scale, kMost) &&
            fits(map.y_scale, kMost) && fits(x, 1) && fits(y, 1) && w.width() <= kMost && w.height() <= kMost;
  }
};
inline bool PairedSquares(const GatherSource& source, const PairedMap& map, const Coordinates& from,
                          int count, PlainTaps& to) {
  const s::D d;
  const V one = hn::Set(d, 1.0f), middle = hn::Set(d, 0.5f), close = hn::Set(d, kClose),
          last = InPairs(static_cast<float>(source.window.width() - 2),
                         static_cast<float>(source.window.height() - 2));
  const PairPlaces<4> places(source.pixels_per_row);
  V lowest = last, highest = one;
  auto apart = hn::Eq(one, one);
  // The cells of a vector of pairs.
  const auto cells = [&](int i) HWY_ATTR {
    const V at = hn::Load(d, from.pairs + i);
    const V near = hn::Round(hn::MulAdd(at, map.scale, map.offset));
    lowest = hn::Min(lowest, near), highest = hn::Max(highest, near);
    const V g = s::Fused(at, map.scale, hn::Sub(map.offset, near)), h = hn::Abs(g);
    // False for NaN, and where rounding may have taken the further pixel for the nearer one.
    apart = hn::And(apart, hn::Ge(hn::Min(hn::Sub(middle, h), h), close));
    hn::Store(g, d, to.distance + i);
    return hn::Sub(near, hn::IfNegativeThenElse(g, one, hn::Zero(d)));
  };
  for (int i = 0; i < count; i += s::kLanes) {
    const V low = cells(2 * i), high = cells(2 * i + s::kLanes);
    hn::Store(places(low, high), s::DI(), to.base + i);
  }
  return hn::AllTrue(d, hn::Ge(lowest, one)) && hn::AllTrue(d, hn::Le(highest, last)) &&
         hn::AllTrue(d, apart);
}

inline bool PlainImage(const GatherJob& job, const PairedMap& map, const Coordinates& from, int x0, int y,
                       int count, PlainTaps& to) {
  const GatherSource& source = job.source;
  if (source.linear && map.exact) return PairedSquares(source, map, from, count, to);
  const ImageRow row(job.map, source.window, y);
  return FindPlain</*kInside=*/false>(
      source, count, [&](int i, VD& px, VD& py) HWY_ATTR { row.At(x0 + i, from.pairs + 2 * i, px, py); }, to);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
