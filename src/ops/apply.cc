// Rows on images: what was asked for is kept beside what is computed.
#include "ops/apply.h"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "graph/origin.h"
#include "ops/wrap.h"
#include "tessera/error.h"

namespace tessera::ops {

const OpInfo& OpNamed(const std::string& name) {
  if (const OpInfo* const row = FindOp(name)) return *row;
  std::vector<std::string> known;
  for (const OpInfo& op : Registry()) known.push_back(op.name);
  const std::string near = Nearest(name, known);
  throw Error(name.empty() ? "operation" : name,
              "found no operation of that name" + (near.empty() ? "" : "; did you mean " + near + "?"));
}

Arguments ArgumentsNamed(const OpInfo& op, std::span<const std::pair<std::string, std::string>> values) {
  std::vector<std::string> positional;
  std::string missing;
  const auto is_positional = [&op](const std::string& name) {
    return std::any_of(op.arguments.begin(), op.arguments.end(),
                       [&](const ParamInfo& p) { return p.name == name; });
  };
  for (const ParamInfo& p : op.arguments) {
    const auto value =
        std::find_if(values.begin(), values.end(), [&p](const auto& v) { return v.first == p.name; });
    if (value == values.end()) {
      if (missing.empty()) missing = p.name;
      if (p.default_value.empty()) throw Error(op.name, "found no " + missing + ", expected it to be set");
    } else if (!missing.empty()) {
      throw Error(op.name, "found " + p.name + " without " + missing + ", expected both");
    } else {
      positional.push_back(value->second);
    }
  }
  std::vector<std::pair<std::string, std::string>> modifiers;
  std::copy_if(values.begin(), values.end(), std::back_inserter(modifiers),
               [&](const auto& value) { return !is_positional(value.first); });
  return ParseArguments(op, positional, modifiers);
}

Node Apply(const OpInfo& op, std::span<const Node> inputs, const Arguments& arguments,
           const ImageSpec* output) {
  Node made = op.make(inputs, arguments, output);
  if (std::any_of(inputs.begin(), inputs.end(), [&](const Node& in) { return in.data() == made.data(); }))
    return made;
  graph::Origin origin;
  origin.name = op.name;
  origin.inputs.assign(inputs.begin(), inputs.end());
  if (output != nullptr) origin.output = *output;
  for (const auto* params : {&op.arguments, &op.modifiers}) {
    for (const ParamInfo& p : *params) {
      const Arguments::Value& value = arguments.values.at(p.name);
      // Neither: set by whoever calls, such as the line's OpenColorIO config.
      if (value.given || value.text != OwnWords(p, p.default_value))
        origin.values.emplace_back(p.name, value.text);
    }
  }
  return graph::WithOrigin(made, std::move(origin));
}

}  // namespace tessera::ops
