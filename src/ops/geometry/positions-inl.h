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

// A run of positions in source indices (pixel i's centre is i) and, where the filter widens, by how much.
struct Positions {
  alignas(64) double x[kRun], y[kRun];
  alignas(64) double wide_x[kRun], wide_y[kRun];
  bool widened = false;  // anywhere in the run
};

// The first tap and the fraction of every pixel of a run.
struct Indices {
  alignas(64) int32_t x[kRun], y[kRun];
  alignas(64) float fx[kRun], fy[kRun];
};

void MatrixPositions(const GatherMap& map, int x0, int y, int count, Positions& p) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const double* const m = map.m;
  const double row = y + 0.5;
  const VD half = hn::Set(d, 0.5), one = hn::Set(d, 1.0);
  // Rows of the matrix are taken once per run: what remains is a multiple of x.
  const VD ax = hn::Set(d, m[0]), bx = hn::Set(d, row * m[3] + m[6]);
  const VD ay = hn::Set(d, m[1]), by = hn::Set(d, row * m[4] + m[7]);
  const VD aq = hn::Set(d, m[2]), bq = hn::Set(d, row * m[5] + m[8]);
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
      sx = hn::IfThenElse(visible, hn::Div(sx, q), nowhere);
      sy = hn::IfThenElse(visible, hn::Div(sy, q), nowhere);
      if (map.reduce) {
        const auto steepest = [&](int column, VD at) HWY_ATTR {
          const VD dx = hn::Mul(hn::NegMulAdd(at, aq, hn::Set(d, m[column])), over);
          const VD dy = hn::Mul(hn::NegMulAdd(at, hn::Set(d, m[5]), hn::Set(d, m[3 + column])), over);
          return hn::Max(one, hn::Max(hn::Abs(dx), hn::Abs(dy)));
        };
        wide_x = steepest(0, sx);
        wide_y = steepest(1, sy);
      }
    } else if (map.reduce) {
      wide_x = hn::Set(d, std::max({1.0, std::fabs(m[0]), std::fabs(m[3])}));
      wide_y = hn::Set(d, std::max({1.0, std::fabs(m[1]), std::fabs(m[4])}));
    }
    hn::Store(hn::Sub(sx, half), d, p.x + i);
    hn::Store(hn::Sub(sy, half), d, p.y + i);
    hn::Store(wide_x, d, p.wide_x + i);
    hn::Store(wide_y, d, p.wide_y + i);
    widest = hn::Max(widest, hn::Max(wide_x, wide_y));
  }
  // NaN of a matrix that overflows is no reduction: such positions are nowhere.
  p.widened = map.reduce && !hn::AllTrue(d, hn::Le(widest, one));
}

void ImagePositions(const GatherJob& job, int x0, int y, int count, Positions& p) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const GatherMap& map = job.map;
  const auto* at = reinterpret_cast<const float*>(job.coordinates.At(x0, y));
  alignas(64) float s[kRun] = {}, t[kRun] = {};
  for (int i = 0; i < count; ++i, at += job.coordinates.channels) {
    s[i] = at[job.channel_x];
    t[i] = at[job.channel_y];
  }
  const VD row = hn::Set(d, map.y_per_pixel * (y + 0.5) + (map.y_offset - 0.5)), one = hn::Set(d, 1.0);
  const VD x_scale = hn::Set(d, map.x_scale), y_scale = hn::Set(d, map.y_scale);
  const VD per_pixel = hn::Set(d, map.x_per_pixel), offset = hn::Set(d, map.x_offset - 0.5);
  for (int i = 0; i < count; i += step) {
    const VD x = hn::Add(hn::Iota(d, 0), hn::Set(d, x0 + i + 0.5));
    const VD column = hn::Add(hn::Mul(per_pixel, x), offset);
    hn::Store(hn::Add(hn::Mul(x_scale, hn::PromoteTo(d, hn::Load(DF(), s + i))), column), d, p.x + i);
    hn::Store(hn::Add(hn::Mul(y_scale, hn::PromoteTo(d, hn::Load(DF(), t + i))), row), d, p.y + i);
    hn::Store(one, d, p.wide_x + i);
    hn::Store(one, d, p.wide_y + i);
  }
}

// One axis of a run: positions are brought back into the image where it repeats, and snapped.
void FindTaps(int origin, int size, Wrap wrap, int taps, int count, double* position, int32_t* first,
              float* fraction) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const VD low = hn::Set(d, static_cast<double>(origin)), half = hn::Set(d, 0.5);
  const VD farthest = hn::Set(d, kFarthest);
  const double period = wrap == Wrap::kMirror ? 2.0 * size : static_cast<double>(size);
  for (int i = 0; i < count; i += step) {
    VD v = hn::Sub(hn::Load(d, position + i), low);
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
    hn::Store(hn::Add(v, low), d, position + i);
    const VD counted = taps % 2 == 1 ? hn::Add(v, half) : v;
    const VD base = hn::Floor(counted);
    const auto f = hn::Min(hn::DemoteTo(DF(), hn::Sub(counted, base)), hn::Set(DF(), 1 - 0x1p-24f));
    hn::Store(f, DF(), fraction + i);
    const auto index = hn::DemoteTo(DI(), hn::Sub(base, hn::Set(d, (taps - 1) / 2)));
    hn::Store(index, DI(), first + i);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
