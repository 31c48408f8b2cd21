// Parameters of registry rows, by kind.
#include "ops/modifiers.h"

#include <utility>

namespace tessera::ops {
namespace {

ParamInfo Modifier(const char* name, ParamType type, const char* default_value, const char* help) {
  ParamInfo param;
  param.name = name;
  param.type = type;
  param.default_value = default_value;
  param.help = help;
  return param;
}

}  // namespace

ParamInfo NumberModifier(const char* name, const char* default_value, double min, double max,
                         const char* help) {
  ParamInfo param = Modifier(name, ParamType::kNumber, default_value, help);
  param.min = min;
  param.max = max;
  return param;
}
ParamInfo IntegerModifier(const char* name, const char* default_value, double min, double max,
                          const char* help) {
  ParamInfo param = NumberModifier(name, default_value, min, max, help);
  param.type = ParamType::kInteger;
  return param;
}
ParamInfo ChoiceModifier(const char* name, std::vector<std::string> choices, const char* help) {
  ParamInfo param = Modifier(name, ParamType::kChoice, "", help);
  param.default_value = choices.front();
  param.choices = std::move(choices);
  return param;
}
ParamInfo FlagModifier(const char* name, const char* help, const char* default_value) {
  return Modifier(name, ParamType::kFlag, default_value, help);
}
ParamInfo TextModifier(const char* name, const char* help) {
  return Modifier(name, ParamType::kText, "", help);
}
ParamInfo ListModifier(const char* name, const char* default_value, int most, double min, double max,
                       const char* help) {
  ParamInfo param = NumberModifier(name, default_value, min, max, help);
  param.type = ParamType::kNumbers;
  param.max_count = most;
  return param;
}
ParamInfo OnlyWith(const char* conditions, ParamInfo param) {
  param.only_with = conditions;
  return param;
}

}  // namespace tessera::ops
