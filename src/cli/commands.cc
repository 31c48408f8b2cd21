// The table of all commands: the general ones, then one row per operation of the registry, made without
// naming any.
#include <algorithm>

#include "cli/session.h"

namespace tessera::cli {
namespace {

std::vector<Command> AllCommands() {
  std::vector<Command> rows;
  for (auto part :
       {OptionCommands, ImageCommands, SequenceCommands, OutputSettingCommands, StackCommands, GraphCommands,
        MetadataCommands, PartCommands, ReportCommands, TellCommands, CountCommands, ControlCommands,
        DrawCommands, WindowCommands, PieceCommands, SheetCommands}) {
    std::vector<Command> more = part();
    rows.insert(rows.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  }
  for (const ops::OpInfo& op : ops::Registry()) {
    if (op.generator) continue;
    Command c;
    c.info = op;
    c.group = "Operations: " + op.family;
    c.run = ApplyOperation;
    rows.push_back(std::move(c));
  }
  return rows;
}

}  // namespace

Command RowOf(const std::string& group, Effect effect, const std::string& name, int inputs,
              const std::string& summary, std::vector<ops::ParamInfo> arguments,
              std::vector<ops::ParamInfo> modifiers) {
  Command c;
  c.info.name = name;
  c.info.inputs = inputs;
  c.info.summary = summary;
  c.info.arguments = std::move(arguments);
  c.info.modifiers = std::move(modifiers);
  c.group = group;
  c.effect = effect;
  return c;
}

const std::vector<Command>& Commands() {
  static const std::vector<Command> kRows = AllCommands();
  return kRows;
}

const Command* FindCommand(const std::string& name) {
  const auto& rows = Commands();
  const auto it = std::find_if(rows.begin(), rows.end(), [&](const Command& c) {
    return c.info.name == name || std::find(c.aliases.begin(), c.aliases.end(), name) != c.aliases.end();
  });
  return it == rows.end() ? nullptr : &*it;
}

const Command& ReadCommand() {
  static const Command& kRead = *FindCommand("i");
  return kRead;
}

std::vector<std::string> CommandNames() {
  std::vector<std::string> names;
  for (const Command& c : Commands()) {
    names.push_back(c.info.name);
    names.insert(names.end(), c.aliases.begin(), c.aliases.end());
  }
  return names;
}

std::vector<const ops::OpInfo*> Generators() {
  std::vector<const ops::OpInfo*> found;
  for (const ops::OpInfo& op : ops::Registry()) {
    if (op.generator) found.push_back(&op);
  }
  return found;
}

}  // namespace tessera::cli
