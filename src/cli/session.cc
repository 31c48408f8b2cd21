// Runs a checked line: steps in order, then all outputs at once.
#include "cli/session.h"

#include <iostream>
#include <span>

namespace tessera::cli {

Entry Session::Pop() {
  Entry entry = std::move(stack_.back());
  stack_.pop_back();
  return entry;
}

int Session::Run(const std::vector<Step>& steps) {
  for (const Step& step : steps) step.command->run(step, *this);
  for (PendingOutput& output : outputs_) output.Commit();
  return exit_code;
}

void ApplyOperation(const Step& step, Session& session) {
  const ops::OpInfo& op = step.command->info;
  std::vector<Entry> operands(static_cast<size_t>(op.Operands(step.arguments)));
  for (auto it = operands.rbegin(); it != operands.rend(); ++it) *it = session.Pop();
  std::vector<Node> inputs;
  for (const Entry& e : operands) inputs.push_back(e.node);
  Entry result;
  ops::Arguments arguments = step.arguments;
  std::vector<std::string> notes;
  if (!session.options().dry_run) arguments.notes = &notes;
  const auto config = arguments.values.find("config");
  if (config != arguments.values.end() && !config->second.given) config->second.text = session.color_config;
  try {
    result.node = op.make(inputs, arguments, nullptr);
  } catch (const Error& e) {
    // The operation knows its own name; the line knows it with its dashes.
    throw Error("--" + (e.subject().starts_with(op.name) ? e.subject() : op.name + " " + e.subject()),
                e.reason());
  }
  for (const std::string& note : notes) std::cout << step.written << ": " << note << std::endl;
  result.name = step.written;
  if (!operands.empty()) result.attributes = std::move(operands.front().attributes);
  session.Push(std::move(result));
}

}  // namespace tessera::cli
