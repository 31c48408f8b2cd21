// Parameters of registry rows, by kind: what every family's rows are written with.
#ifndef TESSERA_OPS_MODIFIERS_H_
#define TESSERA_OPS_MODIFIERS_H_

#include <string>
#include <vector>

#include "ops/registry.h"

namespace tessera::ops {

// min and max are the range that is accepted.
ParamInfo NumberModifier(const char* name, const char* default_value, double min, double max,
                         const char* help);
ParamInfo IntegerModifier(const char* name, const char* default_value, double min, double max,
                          const char* help);
// The first choice is the default.
ParamInfo ChoiceModifier(const char* name, std::vector<std::string> choices, const char* help);
ParamInfo FlagModifier(const char* name, const char* help, const char* default_value = "0");
ParamInfo TextModifier(const char* name, const char* help);
// One to `most` numbers.
ParamInfo ListModifier(const char* name, const char* default_value, int most, double min, double max,
                       const char* help);
// The parameter with its ParamInfo::only_with.
ParamInfo OnlyWith(const char* conditions, ParamInfo param);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_MODIFIERS_H_
