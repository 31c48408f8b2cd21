// What the kernel of curves needs to know: formulas per plane, and the values that no formula gives.
#ifndef TESSERA_OPS_CURVE_CURVE_KERNEL_H_
#define TESSERA_OPS_CURVE_CURVE_KERNEL_H_

#include <memory>

#include "base/stage.h"
#include "tessera/context.h"
#include "tessera/ops/curve.h"

namespace tessera::ops {

// A formula on its way to a plane; `active` is false where the plane keeps its bits.
struct PlaneCurve {
  bool active = false;
  CurveFormula formula;
  float at_infinity = 0, at_minus_infinity = 0, at_zero = 0;
  bool operator==(const PlaneCurve&) const = default;
};
// `bytes`: samples come from 8-bit pixels. Those that still are code / 255 are looked up, with the same bits.
// `context` keeps what is fitted.
std::unique_ptr<graph::PointStage> MakeCurveStage(const PlaneCurve (&planes)[4], bool bytes,
                                                  Context& context);

// x^exponent by C's rules.
struct PlanePower {
  bool active = false;
  double exponent = 1;
  bool operator==(const PlanePower&) const = default;
};
std::unique_ptr<graph::PointStage> MakePowerStage(const PlanePower (&planes)[4], bool bytes,
                                                  Context& context);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CURVE_CURVE_KERNEL_H_
