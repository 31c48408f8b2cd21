// Parameters of registry rows, by kind.
#include "ops/modifiers.h"

#include <algorithm>
#include <utility>

namespace tessera::ops {
namespace {

ParamInfo Modifier(std::string name, ParamType type, std::string default_value, std::string help) {
  ParamInfo param;
  param.name = std::move(name);
  param.type = type;
  param.default_value = std::move(default_value);
  param.help = std::move(help);
  return param;
}

}  // namespace

ParamInfo NumberModifier(std::string name, std::string default_value, double min, double max,
                         std::string help) {
  ParamInfo param = Modifier(std::move(name), ParamType::kNumber, std::move(default_value), std::move(help));
  param.min = min;
  param.max = max;
  return param;
}
ParamInfo NumberModifier(std::string name, std::string default_value, std::string help) {
  return Modifier(std::move(name), ParamType::kNumber, std::move(default_value), std::move(help));
}
ParamInfo IntegerModifier(std::string name, std::string default_value, double min, double max,
                          std::string help) {
  ParamInfo param = NumberModifier(std::move(name), std::move(default_value), min, max, std::move(help));
  param.type = ParamType::kInteger;
  return param;
}
ParamInfo ChoiceArgument(std::string name, std::vector<std::string> choices, std::string help) {
  ParamInfo param = Modifier(std::move(name), ParamType::kChoice, "", std::move(help));
  param.choices = std::move(choices);
  return param;
}
ParamInfo ChoiceModifier(std::string name, std::vector<std::string> choices, std::string help) {
  ParamInfo param = ChoiceArgument(std::move(name), std::move(choices), std::move(help));
  param.default_value = param.choices.front();
  return param;
}
ParamInfo FlagModifier(std::string name, std::string help, std::string default_value) {
  return Modifier(std::move(name), ParamType::kFlag, std::move(default_value), std::move(help));
}
ParamInfo TextModifier(std::string name, std::string help, std::string default_value) {
  return Modifier(std::move(name), ParamType::kText, std::move(default_value), std::move(help));
}
ParamInfo ListModifier(std::string name, std::string default_value, int most, double min, double max,
                       std::string help) {
  ParamInfo param = NumberModifier(std::move(name), std::move(default_value), min, max, std::move(help));
  param.type = ParamType::kNumbers;
  param.max_count = most;
  return param;
}
ParamInfo ListModifier(std::string name, std::string default_value, int most, std::string help) {
  ParamInfo param = Modifier(std::move(name), ParamType::kNumbers, std::move(default_value), std::move(help));
  param.max_count = most;
  return param;
}
ParamInfo NumbersModifier(std::string name, std::string default_value, int count, double min, double max,
                          std::string help) {
  ParamInfo param = ListModifier(std::move(name), std::move(default_value), count, min, max, std::move(help));
  param.min_count = count;
  return param;
}
ParamInfo NumbersModifier(std::string name, std::string default_value, int count, std::string help) {
  ParamInfo param = ListModifier(std::move(name), std::move(default_value), count, std::move(help));
  param.min_count = count;
  return param;
}
ParamInfo NumbersModifier(std::string name, std::string default_value, std::vector<int> counts,
                          std::string help) {
  const int most = *std::max_element(counts.begin(), counts.end());
  ParamInfo param = ListModifier(std::move(name), std::move(default_value), most, std::move(help));
  param.counts = std::move(counts);
  return param;
}
ParamInfo OnlyWith(std::string conditions, ParamInfo param) {
  param.only_with = std::move(conditions);
  return param;
}

}  // namespace tessera::ops
