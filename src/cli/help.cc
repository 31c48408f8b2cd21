// --help and --version for people to read.
#include "cli/help.h"

#include "cli/describe.h"
#include "cli/session.h"
#include "tessera/targets.h"
#include "tessera/version.h"

namespace tessera::cli {
namespace {

void PrintParam(std::ostream& out, const ops::ParamInfo& param, const Layout& layout) {
  const bool fits = 4 + param.name.size() + param.help.size() <= layout.columns;
  out << "  " << layout.Name(param.name)
      << (fits ? "  " + param.help + "\n" : "\n" + layout.Wrapped(param.help, 6))
      << layout.Wrapped(AllowedValues(param), 6);
}

// Some of them, of those that fit into a line of any terminal that is no narrower than usual.
void PrintExamples(std::ostream& out, std::vector<std::string> lines, const Layout& layout) {
  constexpr size_t kMost = 4, kColumns = 100;
  std::erase_if(lines, [](const std::string& line) { return 2 + line.size() > kColumns; });
  if (lines.empty()) return;
  out << "\n" << layout.Heading("Examples") << "\n";
  for (size_t i = 0; i < std::min(kMost, lines.size()); ++i) out << "  " << lines[i] << "\n";
}

constexpr char kUsage[] =
    "The line is read from left to right: a file name pushes an image, a command pops its operands and pushes its "
    "result. Nothing is computed until an output needs it. - and -- are equal; modifiers follow a command after colons, "
    "--name:key=value. --help COMMAND tells all about one, --help-search WORDS finds those about something. - is "
    "standard input, -o png:- standard output, @FILE stands for the words in a file.";

void PrintPatterns(std::ostream& out, const Layout& layout) {
  for (const ops::OpInfo* g : Generators())
    out << "  " << layout.Name(GeneratorSynopsis(*g, layout.columns)) << "\n"
        << layout.Wrapped(g->summary, 6);
}

}  // namespace

void PrintOverview(std::ostream& out, const Layout& layout) {
  out << layout.Wrapped("tessera " TESSERA_VERSION_STRING ": image operations, fused and run tile by tile.",
                        0)
      << "\n"
      << layout.Heading("Usage: tessera FILE... COMMAND... -o FILE") << "\n"
      << layout.Wrapped(kUsage, 2) << "\n  tessera in.exr --saturate 1.2 --hue 30 -d half -o out.exr\n";
  std::string group;
  for (const Command& c : Commands()) {
    if (c.group != group) out << "\n" << layout.Heading(group = c.group) << "\n";
    out << "  " << layout.Name(Synopsis(c, layout.columns)) << "\n" << layout.Wrapped(c.info.summary, 6);
  }
  out << "\n" << layout.Heading("Patterns, for --pattern NAME GEOM NCHANS") << "\n";
  PrintPatterns(out, layout);
  out << "\n"
      << layout.Heading("Exit codes") << "\n"
      << "  0  done\n"
         "  1  an error while working, a --diff that is a FAILURE, a --verify that is out of bounds\n"
         "  2  a wrong command line, or a value that no image makes right; nothing was computed\n"
         "  128 + N  ended by signal N (130 for Ctrl-C)\n"
         "  No file is left behind by a run that failed.\n";
}

namespace {

// All about a command or, where that is null, about the pattern of that row.
void PrintPage(std::ostream& out, const Command* command, const ops::OpInfo& row, const Layout& layout) {
  out << layout.Name(command != nullptr ? Synopsis(*command, layout.columns)
                                        : GeneratorSynopsis(row, layout.columns))
      << "\n\n"
      << layout.Wrapped(row.summary, 2);
  if (command != nullptr) out << layout.Wrapped(Operands(*command), 2);
  if (!row.arguments.empty()) out << "\n" << layout.Heading("Arguments") << "\n";
  for (const ops::ParamInfo& p : row.arguments) PrintParam(out, p, layout);
  if (!row.modifiers.empty()) out << "\n" << layout.Heading("Modifiers") << "\n";
  for (const ops::ParamInfo& p : row.modifiers) PrintParam(out, p, layout);
  if (!row.help.empty()) out << "\n" << layout.Wrapped(row.help, 2);
  if (!row.bound.empty()) out << "\n" << layout.Heading("Accuracy") << "\n" << layout.Wrapped(row.bound, 2);
  PrintExamples(out, command != nullptr ? ExampleLines(*command) : ExampleLines(row), layout);
}

}  // namespace

void PrintCommandHelp(std::ostream& out, const std::string& topic, const Layout& layout) {
  const std::string name = topic.substr(std::min(topic.find_first_not_of('-'), topic.size()));
  const Command* const command = FindCommand(name);
  const ops::OpInfo* pattern = nullptr;
  std::vector<std::string> names = CommandNames();
  for (const ops::OpInfo* g : Generators()) {
    names.push_back(g->name);
    if (g->name == name) pattern = g;
  }
  if (command == nullptr && pattern == nullptr) {
    const std::string near = ops::Nearest(name, names);
    throw UsageError("--help " + topic,
                     near.empty()
                         ? "unknown command, --help lists them all, --help-search finds them by words"
                         : "unknown command; did you mean " + near + "?");
  }
  if (command != nullptr) PrintPage(out, command, command->info, layout);
  if (pattern != nullptr) {
    if (command != nullptr) out << "\nThe pattern of that name\n\n";
    PrintPage(out, nullptr, *pattern, layout);
  }
  if (command != nullptr && command->info.name == "pattern") {
    out << "\n" << layout.Heading("Patterns") << "\n";
    PrintPatterns(out, layout);
  }
}

void PrintVersion(std::ostream& out) {
  out << "tessera " TESSERA_VERSION_STRING "\ntargets:";
  for (const std::string& target : SimdTargets()) out << ' ' << target;
  out << "\n";
}

}  // namespace tessera::cli
