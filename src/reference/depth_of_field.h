// Depth of field's reference.
#ifndef TESSERA_REFERENCE_DEPTH_OF_FIELD_H_
#define TESSERA_REFERENCE_DEPTH_OF_FIELD_H_

#include <any>

#include "reference/reference.h"

namespace tessera::reference {

void EvaluateDepthOfField(const Call& call);
Roi DepthOfFieldRegion(const std::any& parameters, int input, const Roi& out);

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_DEPTH_OF_FIELD_H_
