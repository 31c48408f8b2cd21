// Positions of runs of pixels, in double, and what a filter needs of them: first taps and fractions.
#if defined(TESSERA_OPS_GEOMETRY_POSITIONS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_GEOMETRY_POSITIONS_INL_H_
#undef TESSERA_OPS_GEOMETRY_POSITIONS_INL_H_
#else
#define TESSERA_OPS_GEOMETRY_POSITIONS_INL_H_
#endif

#include <hwy/cache_control.h>
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
// Beyond this all positions are alike: no image is that wide, nor a widened filter.
constexpr double kOutOfReach = 0x1p27;
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

// The first tap of every pixel of a run, and its fraction, or for bilinear look-ups the distance from the
// nearer pixel, as LerpFromNearer wants it; 0 is a pixel's centre.
struct Indices {
  alignas(64) int32_t x[kRun], y[kRun];
  alignas(64) float fx[kRun], fy[kRun];
};

// A matrix whose results are indices of the image: the centre of its first pixel is 0.
struct IndexMatrix {
  double m[9];
  IndexMatrix(const GatherMap& map, const Roi& window) {
    std::copy(map.m, map.m + 9, m);
    for (int row = 0; row < 9; row += 3) {
      m[row] -= (window.x0 + 0.5) * m[row + 2], m[row + 1] -= (window.y0 + 0.5) * m[row + 2];
    }
  }
};

// Positions along a row: (a x + b) / (a x + b), or without a divisor where the matrix is affine.
struct MatrixRow {
  VD ax, bx, ay, by, aq, bq;

  MatrixRow(const IndexMatrix& matrix, int y) {
    const DD d;
    const double* const m = matrix.m;
    const double row = y + 0.5;
    ax = hn::Set(d, m[0]), bx = hn::Set(d, row * m[3] + m[6]);
    ay = hn::Set(d, m[1]), by = hn::Set(d, row * m[4] + m[7]);
    aq = hn::Set(d, m[2]), bq = hn::Set(d, row * m[5] + m[8]);
  }
  HWY_INLINE void Affine(VD x, VD& sx, VD& sy) const {
    sx = hn::MulAdd(ax, x, bx);
    sy = hn::MulAdd(ay, x, by);
  }
  // Returns the divisor.
  HWY_INLINE VD Projective(VD x, VD& sx, VD& sy, VD& over) const {
    const VD q = hn::MulAdd(aq, x, bq);
    over = hn::Div(hn::Set(DD(), 1.0), q);
    Affine(x, sx, sy);
    sx = hn::Mul(sx, over), sy = hn::Mul(sy, over);
    return q;
  }
};

void MatrixPositions(const GatherMap& map, const Roi& window, int x0, int y, int count, Positions& p) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const IndexMatrix matrix(map, window);
  const double* const m = matrix.m;
  const MatrixRow row(matrix, y);
  const VD one = hn::Set(d, 1.0), nowhere = hn::Set(d, 2 * kFarthest);
  VD widest = one;
  for (int i = 0; i < count; i += step) {
    const VD x = hn::Add(hn::Iota(d, 0), hn::Set(d, x0 + i + 0.5));
    VD sx, sy, wide_x = one, wide_y = one;
    if (map.projective) {
      VD over;
      const auto visible = hn::Gt(row.Projective(x, sx, sy, over), hn::Zero(d));
      sx = hn::IfThenElse(visible, sx, nowhere);
      sy = hn::IfThenElse(visible, sy, nowhere);
      if (map.reduce) {
        const auto steepest = [&](int column, VD at) HWY_ATTR {
          const VD dx = hn::Mul(hn::NegMulAdd(at, hn::Set(d, m[2]), hn::Set(d, m[column])), over);
          const VD dy = hn::Mul(hn::NegMulAdd(at, hn::Set(d, m[5]), hn::Set(d, m[3 + column])), over);
          return hn::Max(one, hn::Max(hn::Abs(dx), hn::Abs(dy)));
        };
        wide_x = steepest(0, sx);
        wide_y = steepest(1, sy);
      }
    } else {
      row.Affine(x, sx, sy);
      if (map.reduce) {
        wide_x = hn::Set(d, std::max({1.0, std::fabs(m[0]), std::fabs(m[3])}));
        wide_y = hn::Set(d, std::max({1.0, std::fabs(m[1]), std::fabs(m[4])}));
      }
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

// The two channels of a run, adjacent; the last pixel's again up to the next whole vector of any target.
struct Coordinates {
  alignas(64) float pairs[2 * kRun];

  Coordinates(const GatherJob& job, int x, int y, int count) {
    const int channels = job.coordinates.channels;
    const auto* const row = reinterpret_cast<const float*>(job.coordinates.At(x, y));
    const ptrdiff_t step = job.channel_y - job.channel_x;
    // The processor does not foresee short pieces of many rows.
    constexpr int kLine = 16;
    const float* const below = row + job.coordinates.row_stride / 4;
    for (int i = 0; i < channels * count; i += kLine) hwy::Prefetch(below + i);
    if (channels == 4 && job.channel_x == 0 && step == 1 && count == kRun) {
      FirstHalves(row);
      return;
    }
    const float* from = row + job.channel_x;
    float* to = pairs;
    for (const float* const end = from + ptrdiff_t{channels} * count; from != end;
         from += channels, to += 2) {
      to[0] = from[0], to[1] = from[step];
    }
    for (; (to - pairs) % 32 != 0; to += 2) to[0] = to[-2], to[1] = to[-1];
  }

 private:
  // Of a whole run of pixels of four channels.
  void FirstHalves(const float* from) {
    const hn::CappedTag<uint64_t, 8> d;
    const hn::RebindToFloat<hn::Repartition<uint32_t, decltype(d)>> f;
    constexpr int kLanes = static_cast<int>(hn::MaxLanes(d));
    for (int i = 0; i < kRun; i += kLanes) {
      const auto low = hn::BitCast(d, hn::LoadU(f, from + ptrdiff_t{4} * i));
      const auto high = hn::BitCast(d, hn::LoadU(f, from + ptrdiff_t{4} * i + 2 * kLanes));
      hn::Store(hn::BitCast(f, hn::ConcatEven(d, high, low)), f, pairs + 2 * i);
    }
  }
};

// Positions from two channels of an image.
struct ImageRow {
  VD row, x_scale, y_scale, per_pixel, offset;
  ImageRow(const GatherMap& map, const Roi& window, int y)
      : row(hn::Set(DD(), map.y_per_pixel * (y + 0.5) + (map.y_offset - 0.5 - window.y0))),
        x_scale(hn::Set(DD(), map.x_scale)),
        y_scale(hn::Set(DD(), map.y_scale)),
        per_pixel(hn::Set(DD(), map.x_per_pixel)),
        offset(hn::Set(DD(), map.x_offset - 0.5 - window.x0)) {}
  // Of the pixels from x0 on, whose coordinates are `pairs`.
  HWY_INLINE void At(int x0, const float* pairs, VD& x, VD& y) const {
    const DD d;
    hn::Vec<DF> s, t;
    hn::LoadInterleaved2(DF(), pairs, s, t);
    const VD centre = hn::Add(hn::Iota(d, 0), hn::Set(d, x0 + 0.5));
    x = hn::Add(hn::Mul(x_scale, hn::PromoteTo(d, s)), hn::Add(hn::Mul(per_pixel, centre), offset));
    y = hn::Add(hn::Mul(y_scale, hn::PromoteTo(d, t)), row);
  }
};

void ImagePositions(const GatherJob& job, const Coordinates& from, int x0, int y, int count, Positions& p) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const ImageRow row(job.map, job.source.window, y);
  const VD one = hn::Set(d, 1.0);
  for (int i = 0; i < count; i += step) {
    VD px, py;
    row.At(x0 + i, from.pairs + 2 * i, px, py);
    hn::Store(px, d, p.x + i);
    hn::Store(py, d, p.y + i);
    hn::Store(one, d, p.wide_x + i);
    hn::Store(one, d, p.wide_y + i);
  }
  p.widened = false;
}

// One axis of a run: positions are brought back into the image where it repeats, and snapped. `nearer`:
// distances from the nearer pixel instead of fractions.
void FindTaps(int size, Wrap wrap, int taps, bool nearer, int count, double* position, int32_t* first,
              float* fraction) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const VD half = hn::Set(d, 0.5);
  const VD farthest = hn::Set(d, kFarthest);
  const double period = wrap == Wrap::kMirror ? 2.0 * size : static_cast<double>(size);
  for (int i = 0; i < count; i += step) {
    const VD raw = hn::Load(d, position + i);
    VD v = raw;
    const auto somewhere = hn::Lt(hn::Abs(v), farthest);
    if (wrap == Wrap::kRepeat || wrap == Wrap::kMirror) {
      VD edge = hn::Add(v, half);  // distance from the image's edge
      // Inside nothing is rounded: runs of pixels that all lie there are not brought back.
      const auto inside = hn::And(hn::Ge(edge, hn::Zero(d)), hn::Lt(edge, hn::Set(d, size)));
      edge = hn::NegMulAdd(hn::Set(d, period), hn::Floor(hn::Mul(edge, hn::Set(d, 1 / period))), edge);
      if (wrap == Wrap::kMirror) edge = hn::Min(edge, hn::Sub(hn::Set(d, period), edge));
      v = hn::IfThenElse(inside, v, hn::Sub(edge, half));
    }
    const VD near = hn::Mul(hn::Round(hn::Add(v, v)), half);
    v = hn::IfThenElse(hn::Lt(hn::Abs(hn::Sub(v, near)), hn::Set(d, kSnap)), near, v);
    // Out of reach of every filter is out of reach, however far; nowhere is beyond that.
    const VD reach = hn::Set(d, kOutOfReach);
    v = hn::IfThenElse(somewhere, hn::Min(hn::Max(v, hn::Neg(reach)), reach), hn::Set(d, 4 * kOutOfReach));
    hn::Store(v, d, position + i);
    const VD counted = taps % 2 == 1 ? hn::Add(v, half) : v;
    const VD base = hn::Floor(counted);
    // Half-way between two pixels, the nearer one is that of the position before it was snapped.
    const VD from = hn::IfThenElse(hn::Lt(hn::Abs(hn::Sub(v, raw)), hn::Set(d, kSnap)), raw, v);
    const auto f = nearer ? hn::DemoteTo(DF(), hn::Sub(v, hn::Round(from)))
                          : hn::Min(hn::DemoteTo(DF(), hn::Sub(counted, base)), hn::Set(DF(), 1 - 0x1p-24f));
    hn::Store(f, DF(), fraction + i);
    const auto index = hn::DemoteTo(DI(), hn::Sub(base, hn::Set(d, (taps - 1) / 2)));
    hn::Store(index, DI(), first + i);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
