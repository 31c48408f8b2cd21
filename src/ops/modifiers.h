// Parameters of registry rows, by kind: what every family's rows are written with.
#ifndef TESSERA_OPS_MODIFIERS_H_
#define TESSERA_OPS_MODIFIERS_H_

#include <string>
#include <vector>

#include "ops/registry.h"

namespace tessera::ops {

// A positional argument has "" as its default value: it is required. min and max are the range that is
// accepted, where there is one.
ParamInfo NumberModifier(std::string name, std::string default_value, double min, double max,
                         std::string help);
ParamInfo NumberModifier(std::string name, std::string default_value, std::string help);
ParamInfo IntegerModifier(std::string name, std::string default_value, double min, double max,
                          std::string help);
// The first choice is the default.
ParamInfo ChoiceModifier(std::string name, std::vector<std::string> choices, std::string help);
// Without a default.
ParamInfo ChoiceArgument(std::string name, std::vector<std::string> choices, std::string help);
ParamInfo FlagModifier(std::string name, std::string help, std::string default_value = "0");
ParamInfo TextModifier(std::string name, std::string help, std::string default_value = "");
// One to `most` numbers.
ParamInfo ListModifier(std::string name, std::string default_value, int most, double min, double max,
                       std::string help);
ParamInfo ListModifier(std::string name, std::string default_value, int most, std::string help);
// Exactly `count` numbers.
ParamInfo NumbersModifier(std::string name, std::string default_value, int count, double min, double max,
                          std::string help);
ParamInfo NumbersModifier(std::string name, std::string default_value, int count, std::string help);
// As many numbers as one of `counts` says.
ParamInfo NumbersModifier(std::string name, std::string default_value, std::vector<int> counts,
                          std::string help);
// The parameter with its ParamInfo::only_with.
ParamInfo OnlyWith(std::string conditions, ParamInfo param);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_MODIFIERS_H_
