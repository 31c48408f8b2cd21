// Modifiers that the geometry operations share.
#include "ops/geometry/modifiers.h"

#include "ops/geometry/filters.h"

namespace tessera::ops {

ParamInfo FilterModifier(const std::string& default_value, const std::string& help) {
  ParamInfo filter;
  filter.name = "filter";
  filter.type = ParamType::kChoice;
  filter.default_value = default_value;
  filter.help = help;
  filter.choices = FilterNames();
  return filter;
}

ParamInfo WarpFilterModifier(const std::string& default_value) {
  ParamInfo filter = FilterModifier(default_value, "how values between pixels are found");
  std::erase_if(filter.choices, [](const std::string& name) { return !FindFilter("", name).separable; });
  return filter;
}

ParamInfo WrapModifier(const std::string& name, const std::string& default_value) {
  ParamInfo wrap;
  wrap.name = name;
  wrap.type = ParamType::kChoice;
  wrap.default_value = default_value;
  wrap.help = "what lies beyond the image; periodic is another word for repeat";
  wrap.choices = {"black", "clamp", "repeat", "periodic", "mirror"};
  return wrap;
}

Wrap WrapNamed(const std::string& name) {
  if (name == "clamp") return Wrap::kClamp;
  if (name == "repeat" || name == "periodic") return Wrap::kRepeat;
  if (name == "mirror") return Wrap::kMirror;
  return Wrap::kBlack;
}

}  // namespace tessera::ops
