// Tables of curves as cubic polynomials: chooses the pieces, fits and checks them.
#include "ops/curve/curve_pieces.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "ops/curve/curve_constants.h"
#include "ops/curve/curve_value.h"
#include "tessera/context.h"

namespace tessera::ops {
namespace {

using Kind = CurveFormula::Kind;
using Row = CurvePieces::Row;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// What the roundings before the last one, the fit and the coefficients' own may add to an error, in ULP; and
// where a few pieces have more, how much.
constexpr double kGoodUlps = 0.2, kMostUlps = 0.45;

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

// A piece as a polynomial in t = (x - middle) / half, and how far that is from the curve.
struct Polynomial {
  double middle, half, p[4], error = 0;
};
Polynomial PolynomialOf(const CurveFormula& f, double begin, double end) {
  Polynomial c{(begin + end) / 2, (end - begin) / 2, {}};
  double chebyshev[4] = {};
  for (int k = 0; k < 4; ++k) {
    const double angle = std::numbers::pi * (k + 0.5) / 4,
                 y = ValueOf(f, c.middle + c.half * std::cos(angle));
    for (int j = 0; j < 4; ++j) chebyshev[j] += (j == 0 ? 0.25 : 0.5) * y * std::cos(j * angle);
  }
  c.p[0] = chebyshev[0] - chebyshev[2], c.p[1] = chebyshev[1] - 3 * chebyshev[3];
  c.p[2] = 2 * chebyshev[2], c.p[3] = 4 * chebyshev[3];
  const double ends[2] = {c.p[0] + c.p[2] - c.p[1] - c.p[3], c.p[0] + c.p[2] + c.p[1] + c.p[3]};
  c.error = std::max({std::fabs(ends[0] - ValueOf(f, begin)), std::fabs(ends[1] - ValueOf(f, end)),
                      std::fabs(c.p[0] - ValueOf(f, c.middle))});
  return c;
}

// A piece's row and what its error has beside the last rounding, in ULP.
struct Piece {
  Row row;
  double ulps;
};
// About one of the floats near the middle; nothing where it is not accurate enough.
std::optional<Piece> PieceOf(const Polynomial& cubic, double begin, double end, double k) {
  const double* const p = cubic.p;
  const double h = cubic.half, first = p[0] - p[1] + p[2] - p[3], last = p[0] + p[1] + p[2] + p[3];
  if (!(first * last > 0)) return {};
  // Where the curve is nearest to a float; steps that grow, as the distances might repeat with equal ones.
  constexpr int kAttempts = 128;
  const double apart = std::max(std::min(std::fabs(begin), std::fabs(end)), h);
  const double near = std::min(0x1p-29 * std::fabs(p[0]), 0x1p-27 * std::fabs(p[1] / h) * apart);
  Row row{};
  double s = 0, closest = kInfinity;
  const auto middle = std::bit_cast<uint32_t>(static_cast<float>(cubic.middle));
  const auto room = std::abs(static_cast<int64_t>(std::bit_cast<uint32_t>(static_cast<float>(end))) - middle);
  const auto step = static_cast<uint32_t>(std::clamp<int64_t>(room / (8 * kAttempts), 1, 1 << 8));
  for (uint32_t i = 0; i < kAttempts && closest > near; ++i) {
    const auto centre = std::bit_cast<float>(middle + i * step + i * i / 8);
    const double at = (centre - cubic.middle) / h, p0 = p[0] + at * (p[1] + at * (p[2] + at * p[3]));
    const auto c0 = static_cast<float>(p0);
    if (std::fabs(p0 - c0) < closest) closest = std::fabs(p0 - c0), s = at, row.centre = centre, row.c0 = c0;
  }
  // About it. What the cubic term that follows from the others leaves is a cube, of which a line takes three
  // quarters.
  double p1 = p[1] + s * (2 * p[2] + 3 * s * p[3]);
  const double p2 = p[2] + 3 * s * p[3], rest3 = p[3] - (p2 == 0 ? 0 : k * p2 * p2 / p1);
  p1 += 0.75 * rest3;
  row.c1 = static_cast<float>(p1 / h), row.r = static_cast<float>(p2 / (p1 * h));
  const double error = cubic.error + std::fabs(rest3) / 4 + std::fabs(p1 - row.c1 * h) + closest;
  // A line's slope is not rounded again; x - centre is exact within an octave.
  const double roundings = (row.r == 0 ? 0 : 1) + (begin > 0 && end <= 2 * begin ? 0 : 1);
  const double rest = std::fabs(p[1]) + std::fabs(p[2]) + std::fabs(p[3]);
  const double least = std::min(std::fabs(first), std::fabs(last));
  const double ulps = (error * 0x1p24 + roundings * rest) / least;
  // Errors below what tells neighbouring floats apart leave results monotone from piece to piece.
  if (!(ulps <= kMostUlps) || !(error <= 0x1p-25 * std::fabs(p[1] / h) * apart)) return {};
  return Piece{row, ulps};
}

// The piece that begins and ends at these samples.
std::optional<Piece> FitPiece(const CurveFormula& f, float begin, float end, double k) {
  const double middle = (double{begin} + end) / 2, last = std::nextafter(end, begin);
  if (!std::isfinite(ValueOf(f, begin)) || !std::isfinite(ValueOf(f, last))) return {};
  const bool joined = f.kind <= Kind::kExp, line = joined && middle < f.join;
  std::optional<Piece> piece;
  if (line) {
    const auto slope = static_cast<float>(f.slope);
    const double ulps = std::fabs(slope / f.slope - 1) * 0x1p24;
    if (f.offset == 0 && ulps <= kGoodUlps) {
      piece = {{0, 0, slope, 0}, ulps};
    } else {
      const double half = last - middle;
      piece = PieceOf({middle, half, {f.slope * middle + f.offset, f.slope * half}}, begin, last, k);
      // About the line's zero the rounding of its slope is all that is lost, as long as x - zero is exact.
      const auto zero = static_cast<float>(-f.offset / f.slope);
      if (!piece && ulps <= kMostUlps && begin >= zero / 2 && last <= 2 * zero) {
        piece = {{zero, static_cast<float>(f.slope * zero + f.offset), slope, 0}, ulps};
      }
    }
  } else {
    const double first = joined ? std::max<double>(begin, f.join) : begin;
    if (!(first < last)) return {};
    piece = PieceOf(PolynomialOf(f, first, last), first, last, k);
  }
  // A few samples on the other side of the join, where rounding has put it.
  if (piece && joined && begin < f.join && f.join <= last) {
    const Row& row = piece->row;
    const double x = line ? last : begin, u = x - row.centre, z = u * row.r, exact = ValueOf(f, x);
    const double got = row.c0 + u * row.c1 * (1 + z * (1 + z * k));
    if (!(std::fabs(got - exact) <= kGoodUlps * 0x1p-24 * std::fabs(exact))) return {};
  }
  return piece;
}

// Fits the pieces from v = `low` to before v = `high`, 2^(23 - shift) of them in an octave. Able where all
// but a few that come after `main` are accurate.
void FitPieces(const CurveFormula& f, float low, float high, float main, int shift, CurvePieces& t) {
  t.shift = shift, t.first = std::bit_cast<uint32_t>(low);
  const uint32_t count = (std::bit_cast<uint32_t>(high) - t.first) >> shift;
  std::vector<Row> rows(count + 1, Row{kNaN, kNaN, kNaN, kNaN});
  const float main_place = PlaceOf(t, main);
  uint32_t failed = 0;
  float begin = BeginOf(t, low);
  for (uint32_t j = 0; j < count; ++j) {
    const float next = std::bit_cast<float>(t.first + ((j + 1) << shift)), end = BeginOf(t, next);
    const auto piece = FitPiece(f, begin, end, t.cubic + t.cubic_slope * next);
    if (piece) rows[j] = piece->row;
    if (next > main_place && !(piece && piece->ulps <= kGoodUlps)) ++failed;
    begin = end;
  }
  t.span = count << shift;
  t.able = failed <= count / 16;
  t.rows = std::make_shared<const std::vector<Row>>(std::move(rows));
}

// c3 c1 / c2^2 of v^e; of a logarithm with e = 0, of exponentials its limit.
float CubicOfPower(double e) { return e == 1 ? 0 : static_cast<float>(2 * (e - 2) / (3 * (e - 1))); }
constexpr float kCubicOfExp = 2.0f / 3;

CurvePieces Fitted(const CurveFormula& f) {
  CurvePieces t;
  // As few pieces as will do.
  const auto fit = [&](float low, float high, float main, int shift, int least_shift) {
    for (; shift >= least_shift && !t.able; --shift) FitPieces(f, low, high, main, shift, t);
  };
  switch (f.kind) {
    case Kind::kPq:
      t.cubic = 1.55f;  // 2 to 1.3
      fit(0x1p-26f, 8, 0x1p-26f, 17, 17);
      return t;
    case Kind::kHlg:  // its join is at 1/12
      t.place_scale = 12, t.cubic = (CubicOfPower(0.5) + CubicOfPower(0)) / 2;
      fit(0x1p-24f, 128, 0x1p-24f, 17, 17);
      return t;
    case Kind::kPqInverse:
      // The last piece ends near a signal of 1.04; the factors make steps of light about equal.
      t.place_scale = 12.0f / 32, t.place_bits = 1.8f / 32 * 0x1p-23f;
      t.place_offset = 1.9999f - PlaceOf(t, 1.04f);
      // 0.29 and 0.68 at signals of 0.03 and 0.8.
      t.cubic_slope = (0.68f - 0.29f) / (PlaceOf(t, 0.8f) - PlaceOf(t, 0.03f));
      t.cubic = 0.29f - t.cubic_slope * PlaceOf(t, 0.03f);
      fit(1, 2, 0.01f, 13, 13);
      return t;
    case Kind::kHlgInverse:  // its join is at 1/2
      t.place_scale = 2, t.cubic = kCubicOfExp;
      fit(0x1p-7f, 2.5f, 0x1p-7f, 15, 15);
      return t;
    case Kind::kExp: {
      const double steepness = f.in_scale * kLn2, range = 18 / steepness;
      const bool joined = std::isfinite(f.join);
      if (!(steepness > 0) || !(range > 0x1p-20 && range < 0x1p20) || (!joined && f.out_offset == 0))
        return t;
      const double start = joined ? f.join : 0;
      t.cubic = kCubicOfExp;
      t.place_scale = static_cast<float>(1 / range), t.place_offset = static_cast<float>(1 - start / range);
      // About a zero narrow pieces leave less to other ways.
      const double zero = (std::log2(-f.out_offset / f.out_scale) - f.in_offset) / f.in_scale;
      const int shift = zero > start ? 13 : 14;
      fit(0.5f, 2, static_cast<float>(start), shift, shift);
      return t;
    }
    case Kind::kPower:
    case Kind::kLog:
      break;
    default:
      return t;
  }
  t.cubic = CubicOfPower(f.kind == Kind::kPower ? f.exponent : 0);
  const bool joined = std::isfinite(f.join);
  if (!joined && f.in_offset == 0 && (f.kind == Kind::kLog || f.out_offset == 0)) {
    if (f.kind == Kind::kPower) fit(0x1p-16f, 0x1p8f, 0x1p-16f, 18, 16);
    return t;
  }
  if (!(f.in_scale > 0)) return t;
  // v is the distance from a little below the place where the formula ends, in that of the join.
  const double end = -f.in_offset / f.in_scale;
  const double reach = joined ? f.join - end : end == 0 ? 1 : std::fabs(end);
  const double from = joined ? end - reach / 4 : end, size = joined ? f.join - from : reach;
  if (!(reach > 0) || !(size > 0x1p-30) || !(size < 0x1p30)) return t;
  t.place_scale = static_cast<float>(1 / size), t.place_offset = static_cast<float>(-from / size);
  const float start = joined ? std::max(static_cast<float>(f.join), 0.0f) : static_cast<float>(from + size);
  // From 0 where that lies on the linear part.
  const float at_zero = t.place_offset;
  const int below = at_zero > 0 && at_zero < 1 ? std::min(-std::ilogb(at_zero), 8)
                    : joined || end < 0        ? 1
                                               : 12;
  constexpr float kMost = 256;
  const float high = std::max(2.0f, std::ldexp(1.0f, std::ilogb(PlaceOf(t, kMost)) + 1));
  fit(std::ldexp(1.0f, -below), high, start, 18, 16);
  return t;
}

}  // namespace

CurvePieces PiecesOf(const CurveFormula& f, Context& context) {
  const double numbers[] = {f.in_scale, f.in_offset, f.exponent, f.out_scale, f.out_offset,
                            f.floor,    f.join,      f.slope,    f.offset};
  std::string key(reinterpret_cast<const char*>(numbers), sizeof numbers);
  key += static_cast<char>(f.kind), key += static_cast<char>(f.negatives);
  constexpr size_t kBytes = size_t{1} << 15;  // about
  return *context.Cached<CurvePieces>(key, kBytes, [&f] { return std::make_shared<CurvePieces>(Fitted(f)); });
}

}  // namespace tessera::ops
