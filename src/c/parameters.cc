// Parameters of the C interface: typed values become the registry's text, which its one parser checks.
#include <utility>

#include "base/number_text.h"
#include "c/handles.h"
#include "ops/wrap.h"

namespace tessera::c {
namespace {

using ops::ParamInfo;
using ops::ParamType;

constexpr const char* kKinds[] = {"a number",          "a whole number", "a flag",
                                  "a list of numbers", "a choice",       "text"};

const ParamInfo& Named(const ops::OpInfo& op, const std::string& name, const std::string& text) {
  std::vector<std::string> known;
  for (const ParamInfo& p : op.arguments) {
    if (p.name == name) return p;
    known.push_back(p.name);
  }
  if (const ParamInfo* const p = ops::FindModifier(op, name, text)) return *p;
  for (const ParamInfo& p : op.modifiers) known.push_back(p.name);
  const std::string near = ops::Nearest(name, known);
  std::string all;
  for (const std::string& word : known) all += (all.empty() ? "" : ", ") + word;
  throw Misuse(op.name, "found no parameter \"" + name + "\"" +
                            (near.empty() ? ", expected " + (all.empty() ? "none" : all)
                                          : "; did you mean " + near + "?"));
}

void Set(tessera_parameters* parameters, const char* name, ParamType type, std::string text) {
  tessera_parameters& p = Checked(parameters, "parameters");
  const ParamInfo& param = Named(*p.op, Text(name, "name"), text);
  const bool fits = param.type == type || (type == ParamType::kInteger && param.type == ParamType::kNumber) ||
                    (type == ParamType::kNumber && param.type == ParamType::kNumbers) ||
                    (type == ParamType::kText && param.type == ParamType::kChoice) ||
                    (type == ParamType::kNumbers && param.type == ParamType::kChoice && param.numbers_too);
  if (!fits) {
    throw Misuse(p.op->name + ":" + param.name, std::string("found ") + kKinds[static_cast<int>(type)] +
                                                    ", expected " + kKinds[static_cast<int>(param.type)]);
  }
  ops::CheckValue(*p.op, param, text);
  p.values[param.name] = std::move(text);
}

}  // namespace

ops::Arguments ArgumentsOf(const tessera_parameters& parameters) {
  const ops::OpInfo& op = *parameters.op;
  std::vector<std::string> positional;
  std::vector<std::pair<std::string, std::string>> modifiers;
  std::string missing;
  for (const ParamInfo& p : op.arguments) {
    const auto value = parameters.values.find(p.name);
    if (value == parameters.values.end()) {
      if (missing.empty()) missing = p.name;
      if (p.default_value.empty()) throw Misuse(op.name, "found no " + missing + ", expected it to be set");
    } else if (!missing.empty()) {
      throw Misuse(op.name, "found " + p.name + " without " + missing + ", expected both");
    } else {
      positional.push_back(value->second);
    }
  }
  for (const ParamInfo& p : op.modifiers) {
    const auto value = parameters.values.find(p.name);
    if (value != parameters.values.end()) modifiers.emplace_back(value->first, value->second);
  }
  try {
    return ops::ParseArguments(op, positional, modifiers);
  } catch (const Error& error) {
    throw Misuse(error.subject(), error.reason());
  }
}

}  // namespace tessera::c

using namespace tessera::c;  // NOLINT: all that this file is for
using tessera::base::NumberText;
using tessera::ops::ParamType;

extern "C" {

tessera_status tessera_parameters_new(const char* operation, tessera_parameters** parameters,
                                      tessera_error** error) {
  return Guarded(error, [&] {
    tessera_parameters*& result = Result(parameters, "parameters");
    const tessera::ops::OpInfo& op = RowNamed(Text(operation, "operation"));
    result = new tessera_parameters;
    result->op = &op;
  });
}

void tessera_parameters_free(tessera_parameters* parameters) {
  if (parameters != nullptr && parameters->tag == Tag::kParameters) delete parameters;
}

tessera_status tessera_set_number(tessera_parameters* parameters, const char* name, double value,
                                  tessera_error** error) {
  return Guarded(error, [&] { Set(parameters, name, ParamType::kNumber, NumberText(value)); });
}

tessera_status tessera_set_integer(tessera_parameters* parameters, const char* name, int64_t value,
                                   tessera_error** error) {
  return Guarded(error, [&] { Set(parameters, name, ParamType::kInteger, std::to_string(value)); });
}

tessera_status tessera_set_flag(tessera_parameters* parameters, const char* name, int32_t value,
                                tessera_error** error) {
  return Guarded(error, [&] { Set(parameters, name, ParamType::kFlag, std::to_string(value)); });
}

tessera_status tessera_set_numbers(tessera_parameters* parameters, const char* name, const double* values,
                                   size_t count, tessera_error** error) {
  return Guarded(error, [&] {
    constexpr size_t kMost = size_t{1} << 20;  // more than any row takes
    if (values == nullptr && count > 0) throw Misuse("values", "found NULL, expected numbers");
    if (count > kMost) throw Misuse("count", "found " + std::to_string(count) + ", expected at most 2^20");
    std::string text;
    for (size_t k = 0; k < count; ++k) text += (k > 0 ? "," : "") + NumberText(values[k]);
    Set(parameters, name, ParamType::kNumbers, std::move(text));
  });
}

tessera_status tessera_set_text(tessera_parameters* parameters, const char* name, const char* text,
                                tessera_error** error) {
  return Guarded(error, [&] { Set(parameters, name, ParamType::kText, Text(text, "text")); });
}

tessera_status tessera_parameters_parse(tessera_parameters* parameters, const char* line,
                                        tessera_error** error) {
  return Guarded(error, [&] {
    tessera_parameters& p = Checked(parameters, "parameters");
    const tessera::ops::Words words = tessera::ops::SplitExample(*p.op, Text(line, "line"));
    auto values = p.values;  // all of the line or nothing of it
    for (size_t k = 0; k < words.positional.size(); ++k)
      values[p.op->arguments[k].name] = words.positional[k];
    for (const auto& [name, text] : words.modifiers) {
      for (const auto& argument : p.op->arguments) {
        if (argument.name == name)
          throw Misuse(p.op->name, "found " + name + "= behind the first words, expected it in its place");
      }
      values[Named(*p.op, name, text).name] = text;
    }
    for (const auto& [name, text] : values) tessera::ops::CheckValue(*p.op, Named(*p.op, name, text), text);
    p.values = std::move(values);
  });
}

tessera_status tessera_parameters_images(const tessera_parameters* parameters, size_t* count,
                                         tessera_error** error) {
  return Guarded(error, [&] {
    size_t& result = Result(count, "count");
    const tessera_parameters& p = Checked(parameters, "parameters");
    const tessera::ops::Arguments arguments = ArgumentsOf(p);
    result = p.op->generator ? 0 : static_cast<size_t>(p.op->Operands(arguments));
  });
}

}  // extern "C"
