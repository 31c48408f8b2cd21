// Rows of the registry by name, and on images as nodes that know what they were asked for.
#ifndef TESSERA_OPS_APPLY_H_
#define TESSERA_OPS_APPLY_H_

#include <span>
#include <string>
#include <utility>

#include "ops/registry.h"
#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera::ops {

// The row of that name; throws Error with the nearest for one that is not there.
const OpInfo& OpNamed(const std::string& name);
// Values by the names of parameters, positional or not, in any order; throws Error as ParseArguments does.
Arguments ArgumentsNamed(const OpInfo& op, std::span<const std::pair<std::string, std::string>> values);
// OpInfo::make, with the row, the values that are not defaults and the inputs kept in the result
// (graph/origin.h). A row that returns one of its inputs, for it changes nothing, leaves no trace.
Node Apply(const OpInfo& op, std::span<const Node> inputs, const Arguments& arguments,
           const ImageSpec* output);

}  // namespace tessera::ops
TESSERA_API_END

#endif  // TESSERA_OPS_APPLY_H_
