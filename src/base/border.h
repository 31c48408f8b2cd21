// What lies beyond the data window, for stages that look there.
#ifndef TESSERA_BASE_BORDER_H_
#define TESSERA_BASE_BORDER_H_

#include "base/stage.h"
#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::base {

// The part of the data window whose pixels appear in `wanted` once the border rule is applied.
Roi BorderSource(const Roi& wanted, const Roi& window, Wrap wrap);

// Fills `out` (any region) from `in`, which covers BorderSource(out.roi(), window, wrap). Border pixels are
// copies, so a fused evaluation equals an eager one bit for bit. An empty window gives zeros.
void FillWithBorder(const ConstImageView& in, const Roi& window, Wrap wrap, const ImageView& out);

}  // namespace tessera::base
TESSERA_API_END

#endif  // TESSERA_BASE_BORDER_H_
