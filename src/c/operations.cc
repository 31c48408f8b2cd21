// The registry as the C interface shows it.
#include <iterator>
#include <mutex>
#include <set>

#include "c/handles.h"

namespace tessera::c {
namespace {

// A row's parameters: positional ones first.
size_t ParameterCount(const ops::OpInfo& op) { return op.arguments.size() + op.modifiers.size(); }
const ops::ParamInfo* ParameterAt(const ops::OpInfo& op, size_t index) {
  if (index < op.arguments.size()) return &op.arguments[index];
  index -= op.arguments.size();
  return index < op.modifiers.size() ? &op.modifiers[index] : nullptr;
}

const ops::OpInfo* RowOrNull(const tessera_operation* operation) {
  const auto* const row = reinterpret_cast<const ops::OpInfo*>(operation);
  for (const ops::OpInfo& op : ops::Registry()) {
    if (&op == row) return row;
  }
  return nullptr;
}

// The same text for as long as the library is loaded.
const char* Kept(const std::string& text) {
  static std::mutex mutex;
  static std::set<std::string> texts;
  const std::lock_guard lock(mutex);
  return texts.insert(text).first->c_str();
}

}  // namespace

const ops::OpInfo& RowOf(const tessera_operation* operation) {
  const ops::OpInfo* const row = RowOrNull(operation);
  if (row == nullptr) {
    throw Misuse("operation", std::string("found ") + (operation == nullptr ? "NULL" : "something else") +
                                  ", expected one of the registry's");
  }
  return *row;
}

const ops::OpInfo& RowNamed(const std::string& name) {
  const ops::OpInfo* const row = ops::FindOp(name);
  if (row != nullptr) return *row;
  std::vector<std::string> known;
  for (const ops::OpInfo& op : ops::Registry()) known.push_back(op.name);
  const std::string near = ops::Nearest(name, known);
  throw Misuse(name.empty() ? "operation" : name,
               "found no operation of that name" + (near.empty() ? "" : "; did you mean " + near + "?"));
}

}  // namespace tessera::c

using namespace tessera::c;  // NOLINT: all that this file is for
using tessera::ops::OpInfo;
using tessera::ops::ParamInfo;
using tessera::ops::ParamType;

extern "C" {

size_t tessera_operation_count(void) { return tessera::ops::Registry().size(); }

const tessera_operation* tessera_operation_at(size_t index) {
  const auto& rows = tessera::ops::Registry();
  return index < rows.size() ? reinterpret_cast<const tessera_operation*>(&rows[index]) : nullptr;
}

const tessera_operation* tessera_operation_find(const char* name) {
  if (name == nullptr) return nullptr;
  const OpInfo* found = nullptr;
  Guarded(nullptr, [&] { found = tessera::ops::FindOp(name); });
  return reinterpret_cast<const tessera_operation*>(found);
}

tessera_status tessera_operation_get_info(const tessera_operation* operation, tessera_operation_info* info,
                                          tessera_error** error) {
  return Guarded(error, [&] {
    const OpInfo& op = RowOf(operation);
    tessera_operation_info all = {};
    all.name = op.name.c_str(), all.family = op.family.c_str();
    all.summary = op.summary.c_str(), all.help = op.help.c_str();
    all.bound = op.bound.c_str(), all.bound_u = op.bound_u;
    all.generator = op.generator ? 1 : 0;
    all.images = op.generator ? 0 : op.operands != nullptr ? -1 : op.inputs;
    all.parameters = ParameterCount(op), all.examples = op.examples.size();
    Fill(info, all, "info");
  });
}

const char* tessera_operation_example(const tessera_operation* operation, size_t index) {
  const OpInfo* const op = RowOrNull(operation);
  return op == nullptr || index >= op->examples.size() ? nullptr : op->examples[index].c_str();
}

tessera_status tessera_parameter_get_info(const tessera_operation* operation, size_t parameter,
                                          tessera_parameter_info* info, tessera_error** error) {
  return Guarded(error, [&] {
    const OpInfo& op = RowOf(operation);
    const ParamInfo* const p = ParameterAt(op, parameter);
    if (p == nullptr) {
      throw Misuse("parameter", "found " + std::to_string(parameter) + ", expected less than " +
                                    std::to_string(ParameterCount(op)));
    }
    tessera_parameter_info all = {};
    all.name = p->name.c_str(), all.help = p->help.c_str();
    all.kind = static_cast<tessera_parameter_kind>(p->type);
    all.positional = parameter < op.arguments.size() ? 1 : 0;
    all.required = all.positional != 0 && p->default_value.empty() ? 1 : 0;
    all.default_value = p->default_value.c_str();
    all.use = Kept(tessera::ops::UseOf(*p));
    all.minimum = p->min, all.maximum = p->max;
    all.count_minimum = p->min_count, all.count_maximum = p->max_count;
    all.counts = p->counts.size(), all.choices = p->choices.size();
    all.numbers_too = p->numbers_too ? 1 : 0;
    Fill(info, all, "info");
  });
}

const char* tessera_parameter_choice(const tessera_operation* operation, size_t parameter, size_t index) {
  const OpInfo* const op = RowOrNull(operation);
  const ParamInfo* const p = op == nullptr ? nullptr : ParameterAt(*op, parameter);
  return p == nullptr || index >= p->choices.size() ? nullptr : p->choices[index].c_str();
}

int32_t tessera_parameter_count(const tessera_operation* operation, size_t parameter, size_t index) {
  const OpInfo* const op = RowOrNull(operation);
  const ParamInfo* const p = op == nullptr ? nullptr : ParameterAt(*op, parameter);
  return p == nullptr || index >= p->counts.size() ? 0 : p->counts[index];
}

}  // extern "C"
