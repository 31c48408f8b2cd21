// The registry as dictionaries: methods, their signatures, docstrings and stubs are made from it.
#include <pybind11/stl.h>

#include "ops/apply.h"
#include "ops/registry.h"
#include "ops/wrap.h"
#include "python/core.h"

namespace tessera::python {
namespace {

py::dict ParameterOf(const ops::ParamInfo& p, bool positional) {
  constexpr const char* kKinds[] = {"number", "integer", "flag", "numbers", "choice", "text"};
  py::dict d;
  d["name"] = p.name, d["kind"] = kKinds[static_cast<int>(p.type)];
  d["positional"] = positional, d["required"] = positional && p.default_value.empty();
  d["default"] = p.default_value, d["help"] = p.help, d["use"] = ops::UseOf(p);
  d["min"] = p.min > -1e38 ? py::object(py::float_(p.min)) : py::none();
  d["max"] = p.max < 1e38 ? py::object(py::float_(p.max)) : py::none();
  d["min_count"] = p.min_count, d["max_count"] = p.max_count, d["counts"] = p.counts;
  d["choices"] = p.choices, d["numbers_too"] = p.numbers_too;
  d["other_names"] = ops::OtherNames(p);
  return d;
}

py::list Operations() {
  py::list rows;
  for (const ops::OpInfo& op : ops::Registry()) {
    py::dict row;
    row["name"] = op.name, row["family"] = op.family, row["generator"] = op.generator;
    // -1: as many as the parameters say.
    row["images"] = op.generator ? 0 : op.operands != nullptr ? -1 : op.inputs;
    row["summary"] = op.summary, row["help"] = op.help;
    row["bound"] = op.bound, row["bound_u"] = op.bound_u, row["examples"] = op.examples;
    py::list parameters;
    for (const auto& p : op.arguments) parameters.append(ParameterOf(p, true));
    for (const auto& p : op.modifiers) parameters.append(ParameterOf(p, false));
    row["parameters"] = parameters;
    rows.append(row);
  }
  return rows;
}

}  // namespace

void AddRows(py::module_& core) {
  core.def("operations", &Operations);
  core.def("split_example", [](const std::string& name, const std::string& example) {
    const ops::OpInfo& op = ops::OpNamed(name);
    const ops::Words words = ops::SplitExample(op, example);
    Values values;
    for (size_t k = 0; k < words.positional.size(); ++k)
      values.emplace_back(op.arguments[k].name, words.positional[k]);
    values.insert(values.end(), words.modifiers.begin(), words.modifiers.end());
    return values;
  });
  // Throws for what is wrong whatever the images are; how many it takes.
  core.def("check", [](const std::string& name, const Values& values) {
    const ops::OpInfo& op = ops::OpNamed(name);
    const ops::Arguments arguments = ops::ArgumentsNamed(op, values);
    return op.generator ? 0 : op.Operands(arguments);
  });
  core.def("nearest", [](const std::string& word, const std::vector<std::string>& known) {
    return ops::Nearest(word, known);
  });
}

}  // namespace tessera::python
