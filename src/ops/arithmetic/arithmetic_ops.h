// Registry rows of the arithmetic family: sums, products, comparisons, limits.
#ifndef TESSERA_OPS_ARITHMETIC_ARITHMETIC_OPS_H_
#define TESSERA_OPS_ARITHMETIC_ARITHMETIC_OPS_H_

#include "ops/registry.h"

namespace tessera::ops {

OpInfo AddInfo();
OpInfo SubInfo();
OpInfo MulInfo();
OpInfo DivInfo();
OpInfo MadInfo();
OpInfo MinInfo();
OpInfo MaxInfo();
OpInfo AbsDiffInfo();
OpInfo AddConstantInfo();
OpInfo SubConstantInfo();
OpInfo MulConstantInfo();
OpInfo DivConstantInfo();
OpInfo MinConstantInfo();
OpInfo MaxConstantInfo();
OpInfo AbsDiffConstantInfo();
OpInfo AbsInfo();
OpInfo InvertInfo();
OpInfo ClampInfo();
OpInfo ThresholdInfo();
OpInfo QuantizeInfo();
OpInfo FixNanInfo();

}  // namespace tessera::ops

#endif  // TESSERA_OPS_ARITHMETIC_ARITHMETIC_OPS_H_
