// OpenColorIO's exponents and logarithms as formulas of curves.
#ifndef TESSERA_OCIO_FORMULAS_H_
#define TESSERA_OCIO_FORMULAS_H_

#include <OpenColorIO/OpenColorIO.h>

#include "tessera/ops/curve.h"

namespace tessera::ocio {

CurveParams FormulasOf(const OCIO_NAMESPACE::ExponentTransform& t);
CurveParams FormulasOf(const OCIO_NAMESPACE::ExponentWithLinearTransform& t);
CurveParams FormulasOf(const OCIO_NAMESPACE::LogTransform& t);
CurveParams FormulasOf(const OCIO_NAMESPACE::LogAffineTransform& t);
CurveParams FormulasOf(const OCIO_NAMESPACE::LogCameraTransform& t);

}  // namespace tessera::ocio

#endif  // TESSERA_OCIO_FORMULAS_H_
