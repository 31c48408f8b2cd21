// Tables of curves as 32 polynomials: chooses the pieces, fits them at Chebyshev's points, checks them.
#include "ops/curve/curve_pieces.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "ops/curve/curve_constants.h"
#include "ops/curve/curve_value.h"

namespace tessera::ops {
namespace {

using Kind = CurveFormula::Kind;
constexpr int kDegree = CurvePieces::kDegree;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The vectors' v.
float PlaceOf(const CurvePieces& t, float x) {
  const float v = std::fma(x, t.place_scale, t.place_offset);
  return t.place_bits == 0 ? v : std::fma(static_cast<float>(std::bit_cast<int32_t>(x)), t.place_bits, v);
}

// The least x whose v is not below `v`, by bisection over the floats in their order.
float BeginOf(const CurvePieces& t, float v) {
  const auto float_of = [](int64_t order) {
    const auto bits = static_cast<uint32_t>(order < 0 ? 0x80000000 - order : order);
    return std::bit_cast<float>(bits);
  };
  constexpr int64_t kMost = 0x7f7fffff;
  int64_t low = t.place_bits == 0 ? -kMost : 0, high = kMost;
  while (low < high) {
    const int64_t middle = low + (high - low) / 2;
    if (PlaceOf(t, float_of(middle)) >= v) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return float_of(low);
}

// A float without its last two bits: what c0 must be for c0 - s to be exact also where s is larger.
float ShortOf(double v) { return std::bit_cast<float>(std::bit_cast<uint32_t>(static_cast<float>(v)) & ~3u); }

// The polynomial of a piece from `begin` to `end` about `centre`; false where it is not accurate enough.
bool FitAbout(const CurveFormula& f, double begin, double end, double centre, int index, CurvePieces& t) {
  const double half = std::max(end - centre, centre - begin);
  int exponent = 0;
  std::frexp(half, &exponent);
  const double scale = std::ldexp(1.0, -exponent), at_centre = ValueOf(f, centre);
  // (f(x) - f(c)) / u at Chebyshev's points: divided differences, then coefficients of powers.
  double u[kDegree], newton[kDegree], sum[kDegree] = {};
  for (int k = 0; k < kDegree; ++k) {
    const double x = (begin + end) / 2 + (end - begin) / 2 * std::cos(std::numbers::pi * (k + 0.5) / kDegree);
    u[k] = (x - centre) * scale;
    newton[k] = (ValueOf(f, x) - at_centre) / u[k];
  }
  for (int k = 1; k < kDegree; ++k) {
    for (int j = kDegree - 1; j >= k; --j) newton[j] = (newton[j] - newton[j - 1]) / (u[j] - u[j - k]);
  }
  for (int k = kDegree - 1; k >= 0; --k) {
    for (int j = kDegree - 1; j > 0; --j) sum[j] = sum[j - 1] - u[k] * sum[j];
    sum[0] = newton[k] - u[k] * sum[0];
  }
  const bool zero = std::fabs(at_centre) < 0x1p-10 * std::fabs(sum[0]);  // c0 is but a rest there
  const float c0 = zero ? 0 : ShortOf(at_centre);
  const auto c1 = static_cast<float>(sum[0]);
  float* const row = t.row[index];
  row[CurvePieces::kScale] = static_cast<float>(scale);
  row[CurvePieces::kCentre] = static_cast<float>(-centre * scale);
  row[CurvePieces::kC0] = c0, row[CurvePieces::kRest0] = static_cast<float>(at_centre - c0);
  row[CurvePieces::kC1] = c1, row[CurvePieces::kRest1] = static_cast<float>(sum[0] - c1);
  for (int k = 2; k <= kDegree; ++k) row[CurvePieces::kC2 + k - 2] = static_cast<float>(sum[k - 1]);
  for (const double x : {begin, end}) {
    const double v = (x - centre) * scale, exact = ValueOf(f, x), line = at_centre + v * sum[0];
    double rest = 0;
    for (int k = kDegree - 1; k > 0; --k) rest = (rest + sum[k]) * v;
    rest *= v;
    // Less than what tells neighbouring floats apart, so that results are monotone from piece to piece.
    const double step = 0x1p-25 * std::fabs(sum[0] * scale) * std::max(std::fabs(x), end - begin);
    if (!(std::fabs(line + rest - exact) <= std::min(0x1p-27 * std::fabs(exact), step)) ||
        !(std::fabs(rest) <= 0.11 * std::fabs(exact)) || std::fabs(line) < std::fabs(c0) / 2) {
      return false;
    }
  }
  return true;
}

// Piece `index`, which begins and ends at these samples.
bool FitPiece(const CurveFormula& f, float begin, float end, double zero, int index, CurvePieces& t) {
  if (f.kind <= Kind::kExp && (double{begin} + end) / 2 < f.join) {  // a line about 0
    const float c0 = ShortOf(f.offset), c1 = static_cast<float>(f.slope);
    float* const row = t.row[index];
    std::fill_n(row, CurvePieces::kTerms, 0.0f);
    row[CurvePieces::kScale] = 1;
    row[CurvePieces::kC0] = c0, row[CurvePieces::kRest0] = static_cast<float>(f.offset - c0);
    row[CurvePieces::kC1] = c1, row[CurvePieces::kRest1] = static_cast<float>(f.slope - c1);
    const double least = std::fabs(f.offset) / 2;
    return std::fabs(f.slope * begin + f.offset) >= least && std::fabs(f.slope * end + f.offset) >= least;
  }
  const double first = f.kind <= Kind::kExp ? std::max<double>(begin, f.join) : begin;
  if (!std::isfinite(ValueOf(f, first)) || !std::isfinite(ValueOf(f, end))) return false;
  if (first < zero && zero < end) return FitAbout(f, first, end, static_cast<float>(zero), index, t);
  if (first <= 0 && 0 < end) return FitAbout(f, first, end, 0, index, t);  // x - c is not exact near 0
  // Where the curve is steep a centre nearer its small end keeps s above c0 / 2.
  for (const double part : {0.5, 0.4, 0.6, 0.3, 0.7}) {
    if (FitAbout(f, first, end, static_cast<float>(first + part * (end - first)), index, t)) return true;
  }
  return false;
}

// Fits all pieces from v = `low` on. Those before the one of `main`, where the curve proper begins, may fail.
bool FitPieces(const CurveFormula& f, float low, float main, double zero, CurvePieces& t) {
  const auto first = std::bit_cast<uint32_t>(low);
  const float main_place = PlaceOf(t, main);
  t.low = low;
  float begin = BeginOf(t, low);
  for (int j = 0; j < CurvePieces::kCount; ++j) {
    t.high = std::bit_cast<float>(first + (static_cast<uint32_t>(j + 1) << t.shift));
    const float end = BeginOf(t, t.high);
    const auto index = static_cast<int>((first >> t.shift) + j) % CurvePieces::kCount;
    if (!FitPiece(f, begin, end, zero, index, t)) {
      if (t.high > main_place) return false;
      t.low = t.high;
    }
    begin = end;
  }
  return true;
}

// The rows of the table, if there is one.
CurvePieces RowsOf(const CurveFormula& f) {
  CurvePieces t;
  const double steepness = f.in_scale * kLn2;
  switch (f.kind) {
    case Kind::kPq:
      t.shift = 23;
      t.able = FitPieces(f, 0x1p-28f, 1, kInfinity, t);
      return t;
    case Kind::kHlg:  // its join is at 1/12
      t.place_scale = 12, t.shift = 23;
      t.able = FitPieces(f, 0x1p-28f, 1, kInfinity, t);
      return t;
    case Kind::kPqInverse: {
      // Piece 32 ends near a signal of 1.04; the factors make steps of light about equal.
      t.place_scale = 12.0f / 32, t.place_bits = 1.8f / 32 * 0x1p-23f, t.shift = 18;
      t.place_offset = 0;
      t.place_offset = 1.9999f - PlaceOf(t, 1.04f);
      t.able = FitPieces(f, 1, 0.01f, kInfinity, t);
      return t;
    }
    case Kind::kExp: {
      // Only where light of 0 lies on it: there a sum cancels, and is the centre of a piece.
      const double start = std::isfinite(f.join) ? f.join : 0;
      const double zero = (std::log2(-f.out_offset / f.out_scale) - f.in_offset) / f.in_scale;
      if (!(f.in_scale > 0) || !(zero > start)) return t;
      const double pieces = std::max(1.0, std::ceil((zero - start) * steepness / 0.42 - 0.5));
      const double range = CurvePieces::kCount * (zero - start) / (pieces + 0.5);
      if (!(range * steepness < 100)) return t;
      t.place_scale = static_cast<float>(1 / range), t.place_offset = static_cast<float>(1 - start / range);
      t.shift = 18;
      t.able = FitPieces(f, 1, static_cast<float>(start + range / 64), zero, t);
      return t;
    }
    case Kind::kPower:
    case Kind::kLog:
      break;
    default:
      return t;
  }
  if (!std::isfinite(f.join) && f.in_offset == 0 && (f.kind == Kind::kLog || f.out_offset == 0)) return t;
  if (!(f.in_scale > 0)) return t;
  // v is the distance from a little below the place where the formula ends, in that of the join.
  const double end = -f.in_offset / f.in_scale;
  const bool joined = std::isfinite(f.join);
  const double reach = joined ? f.join - end : end == 0 ? 1 : std::fabs(end);
  const double from = joined ? end - reach / 4 : end, size = joined ? f.join - from : reach;
  if (!(reach > 0) || !(size > 0x1p-60) || !(size < 0x1p60)) return t;
  t.place_scale = static_cast<float>(1 / size), t.place_offset = static_cast<float>(-from / size);
  const float start = joined ? std::max(static_cast<float>(f.join), 0.0f) : static_cast<float>(from + size);
  for (t.shift = 23; t.shift >= 21; --t.shift) {
    // Down to 0 where that lies on the linear part; else half of the pieces at most for what is below `size`.
    const float at_zero = t.place_offset;
    const int octaves = CurvePieces::kCount >> (23 - t.shift);
    const int below = at_zero > 0 && at_zero < 1 ? -std::ilogb(at_zero) : joined || end < 0 ? 1 : octaves / 2;
    if (below > octaves / 2) return t;
    t.able = FitPieces(f, std::ldexp(1.0f, -below), start, kInfinity, t);
    if (t.able) return t;
  }
  return t;
}

}  // namespace

CurvePieces PiecesOf(const CurveFormula& formula) {
  CurvePieces t = RowsOf(formula);
  for (int k = 0; k < CurvePieces::kTerms; ++k) {
    for (int j = 0; j < CurvePieces::kCount; ++j) t.column[k][j] = t.row[j][k];
  }
  return t;
}

}  // namespace tessera::ops
