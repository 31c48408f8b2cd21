// A command as the line's reader sees it: its row (name, arguments, modifiers, help), what it does to the
// stack, its action.
#ifndef TESSERA_CLI_COMMAND_H_
#define TESSERA_CLI_COMMAND_H_

#include <span>
#include <string>
#include <vector>

#include "ops/registry.h"

namespace tessera::cli {

class Session;
struct Options;
struct Step;

// What a command does to the image stack; enough to check a whole line before any file is touched.
enum class Effect {
  kOption,   // holds for the whole line, wherever it stands
  kSetting,  // holds for the commands after it
  kPush,     // pushes an image
  kApply,    // pops its operands and pushes the result
  kUse,      // looks at its operands and leaves them
  kDup,
  kSwap,
  kPop,
  kPrint,    // leaves it alone and prints
  kSplit,    // pops one image and pushes as many as it holds
  kJoin,     // pops all and pushes one
  kControl,  // says which command is next
};

// What an option bears on: the files that are made; which frames are made; the run alone, so that files do
// not tell of it.
enum class Bearing { kFiles, kFrames, kRun };

struct Command {
  ops::OpInfo info;   // name without dashes; `make` is set for the operations of the registry only
  std::string group;  // heading of the help and of the reference page
  Effect effect = Effect::kApply;
  // kSetting: the command it is meant for, or after a colon the modifier of the commands that it is meant
  // for; one of them must follow.
  std::string applies_to;
  bool optional_argument = false;  // its argument may be left out (--help)
  bool any_text = false;           // an argument may be the name of a command (--attrib NAME --add)
  bool by_channel = false;         // its choice may be several, CHANNEL=CHOICE,CHANNEL=CHOICE
  Bearing bearing = Bearing::kFiles;
  std::vector<std::string> aliases = {};
  std::vector<std::string> lines = {};  // examples, without the program; of the registry's: OpInfo::examples
  void (*set)(const ops::Arguments&, Options&) = nullptr;  // kOption
  void (*run)(const Step&, Session&) = nullptr;            // every other one
};

// A row with what every command has; what else there is to say of it is added by whoever makes it.
Command RowOf(const std::string& group, Effect effect, const std::string& name, int inputs,
              const std::string& summary, std::vector<ops::ParamInfo> arguments,
              std::vector<ops::ParamInfo> modifiers = {});
// All commands: the general ones in the order of the manual, then the registry's, family by family.
const std::vector<Command>& Commands();
// By name or alias without dashes; null when there is none.
const Command* FindCommand(const std::string& name);
// The command behind a bare file name.
const Command& ReadCommand();
// Every word that may follow the dashes, for suggestions.
std::vector<std::string> CommandNames();
// Generators that `--pattern NAME` knows.
std::vector<const ops::OpInfo*> Generators();

// Rows of the general commands, by topic (options.cc, sequence_commands.cc, stack_commands.cc,
// graph_commands.cc, metadata_commands.cc, output_settings.cc, tell.cc, count_commands.cc, part_commands.cc,
// control.cc, draw_commands.cc, diff.cc, window_commands.cc, pieces.cc, contact_sheet.cc).
std::vector<Command> OptionCommands();
std::vector<Command> ImageCommands();
std::vector<Command> SequenceCommands();
std::vector<Command> StackCommands();
std::vector<Command> GraphCommands();
std::vector<Command> MetadataCommands();
std::vector<Command> OutputSettingCommands();
std::vector<Command> TellCommands();
std::vector<Command> ControlCommands();
std::vector<Command> DrawCommands();
std::vector<Command> CountCommands();
std::vector<Command> PartCommands();
std::vector<Command> ReportCommands();
std::vector<Command> WindowCommands();
std::vector<Command> PieceCommands();
std::vector<Command> SheetCommands();

}  // namespace tessera::cli

#endif  // TESSERA_CLI_COMMAND_H_
