// Positions of runs of pixels, in double, and what a filter needs of them: first taps and fractions.
#if defined(TESSERA_OPS_GEOMETRY_POSITIONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_GEOMETRY_POSITIONS_INL_H_
#undef TESSERA_OPS_GEOMETRY_POSITIONS_INL_H_
#else
#define TESSERA_OPS_GEOMETRY_POSITIONS_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "ops/geometry/gather.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kRun = 64;
using DD = hn::CappedTag<double, 8>;
using DF = hn::Rebind<float, DD>;
using DI = hn::Rebind<int32_t, DD>;
using VD = hn::Vec<DD>;

// Positions further out than this, and NaN, are nowhere.
constexpr double kFarthest = 0x1p40;
// Nearer to a pixel's centre or edge than this is there: whole shifts keep bits, and filters that end
// abruptly end alike on both sides.
constexpr double kSnap = 0x1p-17;

// A run of positions in indices of the image (the centre of its first pixel is 0) and, where the filter
// widens, by how much.
struct Positions {
  alignas(64) double x[kRun], y[kRun];
  alignas(64) double wide_x[kRun], wide_y[kRun];
  bool widened = false;  // anywhere in the run
};

// The first tap and the fraction of every pixel of a run; where no pixel needs a second look, offset is all
// that is known of the taps: how many pixels of memory they lie behind the image's first.
struct Indices {
  alignas(64) int32_t x[kRun], y[kRun];
  alignas(64) int32_t offset[kRun];
  alignas(64) float fx[kRun], fy[kRun];
};

// Constants of a run of positions by a matrix: (a x + b) / (a x + b), without a divisor where it is affine.
struct MatrixRow {
  double ax, bx, ay, by, aq, bq;
  MatrixRow(const GatherMap& map, const Roi& window, int y) {
    const double* const m = map.m;
    const double row = y + 0.5;
    ax = m[0], bx = row * m[3] + m[6];
    ay = m[1], by = row * m[4] + m[7];
    aq = m[2], bq = row * m[5] + m[8];
    if (!map.projective) bx -= window.x0 + 0.5, by -= window.y0 + 0.5;
  }
};

void MatrixPositions(const GatherMap& map, const Roi& window, int x0, int y, int count, Positions& p) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const double* const m = map.m;
  const MatrixRow row(map, window, y);
  const VD one = hn::Set(d, 1.0);
  const VD ax = hn::Set(d, row.ax), bx = hn::Set(d, row.bx);
  const VD ay = hn::Set(d, row.ay), by = hn::Set(d, row.by);
  const VD aq = hn::Set(d, row.aq), bq = hn::Set(d, row.bq);
  const VD nowhere = hn::Set(d, 2 * kFarthest);
  VD widest = one;
  for (int i = 0; i < count; i += step) {
    const VD x = hn::Add(hn::Iota(d, 0), hn::Set(d, x0 + i + 0.5));
    VD sx = hn::MulAdd(ax, x, bx), sy = hn::MulAdd(ay, x, by);
    VD wide_x = one, wide_y = one;
    if (map.projective) {
      const VD q = hn::MulAdd(aq, x, bq);
      const auto visible = hn::Gt(q, hn::Zero(d));
      const VD over = hn::Div(one, q);
      sx = hn::IfThenElse(visible, hn::Mul(sx, over), nowhere);
      sy = hn::IfThenElse(visible, hn::Mul(sy, over), nowhere);
      if (map.reduce) {
        const auto steepest = [&](int column, VD at) HWY_ATTR {
          const VD dx = hn::Mul(hn::NegMulAdd(at, aq, hn::Set(d, m[column])), over);
          const VD dy = hn::Mul(hn::NegMulAdd(at, hn::Set(d, m[5]), hn::Set(d, m[3 + column])), over);
          return hn::Max(one, hn::Max(hn::Abs(dx), hn::Abs(dy)));
        };
        wide_x = steepest(0, sx);
        wide_y = steepest(1, sy);
      }
      sx = hn::Sub(sx, hn::Set(d, window.x0 + 0.5));
      sy = hn::Sub(sy, hn::Set(d, window.y0 + 0.5));
    } else if (map.reduce) {
      wide_x = hn::Set(d, std::max({1.0, std::fabs(m[0]), std::fabs(m[3])}));
      wide_y = hn::Set(d, std::max({1.0, std::fabs(m[1]), std::fabs(m[4])}));
    }
    hn::Store(sx, d, p.x + i);
    hn::Store(sy, d, p.y + i);
    hn::Store(wide_x, d, p.wide_x + i);
    hn::Store(wide_y, d, p.wide_y + i);
    widest = hn::Max(widest, hn::Max(wide_x, wide_y));
  }
  // NaN of a matrix that overflows is no reduction: such positions are nowhere.
  p.widened = map.reduce && !hn::AllTrue(d, hn::Le(widest, one));
}

// Positions from channels s and t of an image.
struct ImageRow {
  VD row, x_scale, y_scale, per_pixel, offset;
  ImageRow(const GatherMap& map, const Roi& window, int y)
      : row(hn::Set(DD(), map.y_per_pixel * (y + 0.5) + (map.y_offset - 0.5 - window.y0))),
        x_scale(hn::Set(DD(), map.x_scale)),
        y_scale(hn::Set(DD(), map.y_scale)),
        per_pixel(hn::Set(DD(), map.x_per_pixel)),
        offset(hn::Set(DD(), map.x_offset - 0.5 - window.x0)) {}
  HWY_INLINE void At(int x0, hn::Vec<DF> s, hn::Vec<DF> t, VD& x, VD& y) const {
    const DD d;
    const VD centre = hn::Add(hn::Iota(d, 0), hn::Set(d, x0 + 0.5));
    x = hn::Add(hn::Mul(x_scale, hn::PromoteTo(d, s)), hn::Add(hn::Mul(per_pixel, centre), offset));
    y = hn::Add(hn::Mul(y_scale, hn::PromoteTo(d, t)), row);
  }
};

// The two channels of a run.
struct Coordinates {
  alignas(64) float s[kRun], t[kRun];
  Coordinates(const GatherJob& job, int x, int y, int count) {
    const auto* at = reinterpret_cast<const float*>(job.coordinates.At(x, y));
    for (int i = 0; i < count; ++i, at += job.coordinates.channels) {
      s[i] = at[job.channel_x];
      t[i] = at[job.channel_y];
    }
    std::fill(s + count, s + kRun, 0.0f), std::fill(t + count, t + kRun, 0.0f);
  }
};

void ImagePositions(const GatherJob& job, const Coordinates& from, int x0, int y, int count, Positions& p) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const ImageRow row(job.map, job.source.window, y);
  const VD one = hn::Set(d, 1.0);
  for (int i = 0; i < count; i += step) {
    VD px, py;
    row.At(x0 + i, hn::Load(DF(), from.s + i), hn::Load(DF(), from.t + i), px, py);
    hn::Store(px, d, p.x + i);
    hn::Store(py, d, p.y + i);
    hn::Store(one, d, p.wide_x + i);
    hn::Store(one, d, p.wide_y + i);
  }
  p.widened = false;
}

// One axis of a run: positions are brought back into the image where it repeats, and snapped.
void FindTaps(int size, Wrap wrap, int taps, int count, double* position, int32_t* first, float* fraction) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const VD half = hn::Set(d, 0.5);
  const VD farthest = hn::Set(d, kFarthest);
  const double period = wrap == Wrap::kMirror ? 2.0 * size : static_cast<double>(size);
  for (int i = 0; i < count; i += step) {
    VD v = hn::Load(d, position + i);
    const auto somewhere = hn::Lt(hn::Abs(v), farthest);
    if (wrap == Wrap::kRepeat || wrap == Wrap::kMirror) {
      VD edge = hn::Add(v, half);  // distance from the image's edge
      edge = hn::NegMulAdd(hn::Set(d, period), hn::Floor(hn::Mul(edge, hn::Set(d, 1 / period))), edge);
      if (wrap == Wrap::kMirror) edge = hn::Min(edge, hn::Sub(hn::Set(d, period), edge));
      v = hn::Sub(edge, half);
    }
    const VD near = hn::Mul(hn::Round(hn::Add(v, v)), half);
    v = hn::IfThenElse(hn::Lt(hn::Abs(hn::Sub(v, near)), hn::Set(d, kSnap)), near, v);
    // Out of reach of every filter is out of reach, however far.
    const VD reach = hn::Set(d, 0x1p29);
    v = hn::IfThenElse(somewhere, hn::Min(hn::Max(v, hn::Neg(reach)), reach), reach);
    hn::Store(v, d, position + i);
    const VD counted = taps % 2 == 1 ? hn::Add(v, half) : v;
    const VD base = hn::Floor(counted);
    const auto f = hn::Min(hn::DemoteTo(DF(), hn::Sub(counted, base)), hn::Set(DF(), 1 - 0x1p-24f));
    hn::Store(f, DF(), fraction + i);
    const auto index = hn::DemoteTo(DI(), hn::Sub(base, hn::Set(d, (taps - 1) / 2)));
    hn::Store(index, DI(), first + i);
  }
}

// Both axes of a run at once, for an even number of taps, while every pixel's taps lie in the image and no
// position is snapped; false where one is or may be, and nothing is known then. position(i, x, y) gives the
// vectors from pixel i on. `inside`: all are known to lie in the image. The results are those of FindTaps.
template <class Position>
bool FindPlainTaps(const GatherSource& source, int count, bool inside, const Position& position,
                   Indices& to) {
  const DD d;
  const DF f;
  const int step = static_cast<int>(hn::Lanes(d)), lead = (source.taps - 1) / 2;
  const VD low = hn::Set(d, lead), stride = hn::Set(d, source.pixels_per_row()),
           first = hn::Set(d, -lead * (source.pixels_per_row() + 1.0)),
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
    if (!inside) {
      within = hn::And(within, hn::And(hn::And(hn::Ge(x, low), hn::Lt(x, end_x)),
                                       hn::And(hn::Ge(y, low), hn::Lt(y, end_y))));
    }
    const VD base_x = hn::Floor(x), base_y = hn::Floor(y);
    const auto fx = hn::DemoteTo(f, hn::Sub(x, base_x)), fy = hn::DemoteTo(f, hn::Sub(y, base_y));
    least = hn::Min(least, hn::Min(room(fx), room(fy)));
    hn::Store(fx, f, to.fx + i);
    hn::Store(fy, f, to.fy + i);
    hn::Store(hn::DemoteTo(DI(), hn::MulAdd(base_y, stride, hn::Add(base_x, first))), DI(), to.offset + i);
  }
  return hn::AllTrue(d, within) && hn::AllTrue(f, hn::Ge(least, hn::Set(f, static_cast<float>(4 * kSnap))));
}

bool PlainMatrixTaps(const GatherJob& job, int x0, int y, int count, Indices& to) {
  const GatherMap& map = job.map;
  const GatherSource& source = job.source;
  if (map.projective || (map.reduce && !(std::max({std::fabs(map.m[0]), std::fabs(map.m[3]),
                                                   std::fabs(map.m[1]), std::fabs(map.m[4])}) <= 1))) {
    return false;
  }
  const MatrixRow row(map, source.window, y);
  // Along a row both coordinates only grow or only fall: the run's ends are what is furthest out.
  const double first = x0 + 0.5, last = x0 + count - 0.5;
  const auto inside = [&](double a, double b, int size) {
    const int lead = (source.taps - 1) / 2, end = size - source.taps + lead + 1;
    constexpr double kMargin = 0x1p-8;  // more than the roundings of these sums
    return std::min(a * first, a * last) + b >= lead + kMargin &&
           std::max(a * first, a * last) + b < end - kMargin;
  };
  if (!inside(row.ax, row.bx, source.window.width()) || !inside(row.ay, row.by, source.window.height())) {
    return false;
  }
  const DD d;
  const VD ax = hn::Set(d, row.ax), bx = hn::Set(d, row.bx), ay = hn::Set(d, row.ay), by = hn::Set(d, row.by);
  const VD column = hn::Add(hn::Iota(d, 0), hn::Set(d, x0 + 0.5));
  return FindPlainTaps(
      source, count, /*inside=*/true,
      [&](int i, VD& px, VD& py) HWY_ATTR {
        const VD x = hn::Add(column, hn::Set(d, i));
        px = hn::MulAdd(ax, x, bx);
        py = hn::MulAdd(ay, x, by);
      },
      to);
}

bool PlainTaps(const GatherSource& source, const Positions& at, int count, Indices& to) {
  if (count != kRun || at.widened) return false;
  return FindPlainTaps(
      source, count, /*inside=*/false,
      [&](int i, VD& px, VD& py) HWY_ATTR { px = hn::Load(DD(), at.x + i), py = hn::Load(DD(), at.y + i); },
      to);
}

bool PlainImageTaps(const GatherJob& job, const Coordinates& from, int x0, int y, int count, Indices& to) {
  if (count != kRun) return false;
  const ImageRow row(job.map, job.source.window, y);
  return FindPlainTaps(
      job.source, count, /*inside=*/false,
      [&](int i, VD& px, VD& py)
          HWY_ATTR { row.At(x0 + i, hn::Load(DF(), from.s + i), hn::Load(DF(), from.t + i), px, py); },
      to);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
