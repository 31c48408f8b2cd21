// A curve's formula in double: what limits, special samples and tables of pieces are taken from.
#ifndef TESSERA_OPS_CURVE_CURVE_VALUE_H_
#define TESSERA_OPS_CURVE_CURVE_VALUE_H_

#include "tessera/ops/curve.h"

namespace tessera::ops {

// The formula at x, which may be infinite; its rule for negative samples is not applied.
double ValueOf(const CurveFormula& f, double x);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CURVE_CURVE_VALUE_H_
