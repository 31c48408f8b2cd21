// Curves as 32 polynomials whose coefficients lie in registers, or rows of them in the first cache: the
// tables of a formula.
//
// A sample x finds its piece by a few bits of a float, v = scale x + offset: octaves of v, halves or quarters
// of them are the pieces, so they become narrow where logarithms and powers bend. A curve's join is a v of 1,
// where a piece begins; below it lie the linear part's pieces, 0 among them. (Exponentials choose v in [1,2),
// where all pieces are equally wide; PQ's decoding adds the bits of x as a number, which is log2 x all but
// linear between octaves.) In its piece, about a centre c near the middle,
//   u = x - c, scaled by a power of two, exactly
//   y = s + (e + t),  s = fma(u, c1, c0),  e = fma(u, c1, c0 - s),  t = c0' + u (c1' + u (c2 + ... u c10))
// where c0 + c0' and c1 + c1' are twice float's precision and e is just what s lost in rounding, as long as s
// stays within a factor of two of c0. So the error is half a unit for the last sum and about 2^-23 t more;
// pieces are as narrow as keeps t (but for c0') below a ninth of y and the polynomial within 2^-27 of the
// formula. Scales, offsets, both branches and the linear part cost nothing at run time. Pieces that would not
// be as accurate, next to a zero, and everything outside the table are left to the formula in double.
#ifndef TESSERA_OPS_CURVE_CURVE_PIECES_H_
#define TESSERA_OPS_CURVE_CURVE_PIECES_H_

#include "tessera/ops/curve.h"

namespace tessera::ops {

struct CurvePieces {
  static constexpr int kCount = 32, kDegree = 10;
  // False where the formula has no such table: no sum or join that would make it worth while, or too steep.
  bool able = false;
  // v = scale x + offset + bits (the bits of x as an integer), fused in this order; v in [low, high) has the
  // piece whose number is in the bits of v from `shift` on.
  float place_scale = 1, place_offset = 0, place_bits = 0, low = 0, high = 0;
  int shift = 0;
  // A piece's terms: u = scale x + centre, then the coefficients, c2 to c10 last.
  enum Term { kScale, kCentre, kC0, kC1, kRest0, kRest1, kC2 };
  static constexpr int kTerms = kC2 + kDegree - 1, kPaddedTerms = 16;
  alignas(64) float row[kCount][kPaddedTerms] = {};
  alignas(64) float column[kTerms][kCount] = {};  // the same, for registers that hold a term of all pieces
};
CurvePieces PiecesOf(const CurveFormula& formula);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CURVE_CURVE_PIECES_H_
