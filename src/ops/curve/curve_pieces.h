// Curves as a few hundred cubic polynomials, each a row of four floats: the tables of a formula.
//
// A sample x finds its piece by the upper bits of a float, v = scale x + offset: parts of octaves of v are
// the pieces, so they become narrow where logarithms and powers bend. A curve's join is a v of 1, where a
// piece begins; below it lie the linear part's pieces, 0 among them. (Exponentials choose v in [1,2), where
// all pieces are equally wide; PQ's decoding adds the bits of x as a number, which is log2 x all but linear
// between octaves.) In its piece
//   y = c0 + u (c1 + c1 z (1 + k z)),  z = u r,  u = x - centre.
// The centre is a float near the middle at which the curve is almost a float, c0, to some 2^-29: there are
// many to choose from (Gal's accurate tables). What is added to c0 is a small part t of y, so that its
// rounding, 2^-24 t, does not show, and the last sum's half unit is nearly all of the error: 0.7 ULP at most,
// 0.95 next to a zero. The cubic term needs no coefficient of its own: powers, logarithms and exponentials
// have the same k everywhere, other curves nearly so. Scales, offsets, both branches and the linear part cost
// nothing at run time. Rows that would be less accurate, about a zero at a sample that is not 0, hold NaN;
// they and everything outside the table are left to other ways.
#ifndef TESSERA_OPS_CURVE_CURVE_PIECES_H_
#define TESSERA_OPS_CURVE_CURVE_PIECES_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "tessera/ops/curve.h"

namespace tessera::ops {

struct CurvePieces {
  // False where the formula has no such table: no sum or join that would make it worth while, or too steep.
  bool able = false;
  // v = scale x + offset + bits (the bits of x as an integer), fused in this order.
  float place_scale = 1, place_offset = 0, place_bits = 0;
  // The bits of the least v that has a piece; how far beyond them those of the others lie; those from `shift`
  // on are the piece's number.
  uint32_t first = 0, span = 0;
  int shift = 0;
  float cubic = 0, cubic_slope = 0;  // k = cubic + cubic_slope v, the latter with place_bits only
  struct alignas(16) Row {
    float centre, c0, c1, r;
  };
  std::shared_ptr<const std::vector<Row>> rows;  // and one of NaN for what has no piece
};
// Fitting takes as long as some 10^5 samples: the context keeps it.
CurvePieces PiecesOf(const CurveFormula& formula, Context& context);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CURVE_CURVE_PIECES_H_
