// Modifiers that the geometry operations share.
#ifndef TESSERA_OPS_GEOMETRY_MODIFIERS_H_
#define TESSERA_OPS_GEOMETRY_MODIFIERS_H_

#include <string>

#include "ops/registry.h"
#include "ops/wrap.h"
#include "tessera/ops/geometry.h"

namespace tessera::ops {

// `:filter=`, one of oiiotool's names; for warps and shifts one of those that are products of two axes.
ParamInfo FilterModifier(const std::string& default_value, const std::string& help);
ParamInfo WarpFilterModifier(const std::string& default_value);
// `:NAME=black|clamp|repeat|mirror`, what lies beyond the image.
ParamInfo WrapModifier(const std::string& name, const std::string& default_value);

// `:highlightcomp=`, and what it does before and after: colours above 0.18 become logarithms, so that a
// highlight does not ring or shine through its neighbours; signs are kept, alpha is left alone.
ParamInfo HighlightModifier();
Node CompressRange(const Node& image);
Node ExpandRange(const Node& image);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_GEOMETRY_MODIFIERS_H_
