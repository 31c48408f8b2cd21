// --help and --version for people to read.
#include "cli/help.h"

#include "cli/describe.h"
#include "cli/session.h"
#include "tessera/targets.h"
#include "tessera/version.h"

namespace tessera::cli {
namespace {

constexpr size_t kColumns = 100;

// `text` broken at blanks, every line indented.
std::string Wrapped(const std::string& text, size_t indent) {
  std::string result;
  const std::string margin(indent, ' ');
  size_t column = 0;
  for (size_t begin = 0; begin < text.size();) {
    size_t end = text.find_first_of(" \n", begin);
    if (end == std::string::npos) end = text.size();
    const size_t length = end - begin;
    if (column > 0 && column + 1 + length > kColumns) {
      result += '\n';
      column = 0;
    }
    if (length > 0) {
      result += column == 0 ? margin : " ";
      column += (column == 0 ? indent : 1) + length;
      result.append(text, begin, length);
    }
    if (end < text.size() && text[end] == '\n') {
      result += '\n';
      column = 0;
    }
    begin = end + 1;
  }
  if (!result.empty() && result.back() != '\n') result += '\n';
  return result;
}

void PrintParam(std::ostream& out, const ops::ParamInfo& param) {
  const bool fits = 4 + param.name.size() + param.help.size() <= kColumns;
  out << "  " << param.name << (fits ? "  " + param.help + "\n" : "\n" + Wrapped(param.help, 6))
      << Wrapped(AllowedValues(param), 6);
}

// Some of them, of those that fit into a line.
void PrintExamples(std::ostream& out, std::vector<std::string> lines) {
  constexpr size_t kMost = 4;
  std::erase_if(lines, [](const std::string& line) { return 2 + line.size() > kColumns; });
  if (lines.empty()) return;
  out << "\nExamples\n";
  for (size_t i = 0; i < std::min(kMost, lines.size()); ++i) out << "  " << lines[i] << "\n";
}

}  // namespace

void PrintOverview(std::ostream& out) {
  out << "tessera " TESSERA_VERSION_STRING
         ": image operations, fused and run tile by tile.\n\n"
         "Usage: tessera FILE... COMMAND... -o FILE\n"
         "  The line is read from left to right: a file name pushes an image, a command pops its operands\n"
         "  and pushes its result. Nothing is computed until an output needs it. - and -- are equal;\n"
         "  modifiers follow a command after colons, --name:key=value. --help COMMAND tells all about one.\n"
         "  - is standard input, -o png:- standard output, @FILE stands for the words in a file.\n\n"
         "  tessera in.exr --saturate 1.2 --hue 30 -d half -o out.exr\n";
  std::string group;
  for (const Command& c : Commands()) {
    if (c.group != group) out << "\n" << (group = c.group) << "\n";
    out << "  " << Synopsis(c) << "\n" << Wrapped(c.info.summary, 6);
  }
  out << "\nPatterns, for --pattern NAME GEOM NCHANS\n";
  for (const ops::OpInfo* g : Generators())
    out << "  " << GeneratorSynopsis(*g) << "\n" << Wrapped(g->summary, 6);
  out << "\nExit codes\n"
         "  0  done\n"
         "  1  an error while working, a --diff that is a FAILURE, a --verify that is out of bounds\n"
         "  2  a wrong command line, or a value that no image makes right; nothing was computed\n"
         "  128 + N  ended by signal N (130 for Ctrl-C)\n"
         "  No file is left behind by a run that failed.\n";
}

namespace {

// All about a command or, where that is null, about the pattern of that row.
void PrintPage(std::ostream& out, const Command* command, const ops::OpInfo& row) {
  out << (command != nullptr ? Synopsis(*command) : GeneratorSynopsis(row)) << "\n\n"
      << Wrapped(row.summary, 2);
  if (command != nullptr) out << Wrapped(Operands(*command), 2);
  if (!row.arguments.empty()) out << "\nArguments\n";
  for (const ops::ParamInfo& p : row.arguments) PrintParam(out, p);
  if (!row.modifiers.empty()) out << "\nModifiers\n";
  for (const ops::ParamInfo& p : row.modifiers) PrintParam(out, p);
  if (!row.help.empty()) out << "\n" << Wrapped(row.help, 2);
  if (!row.bound.empty()) out << "\nAccuracy\n" << Wrapped(row.bound, 2);
  PrintExamples(out, command != nullptr ? ExampleLines(*command) : ExampleLines(row));
}

}  // namespace

void PrintCommandHelp(std::ostream& out, const std::string& topic) {
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
    throw UsageError("--help " + topic, near.empty() ? "unknown command, --help lists them all"
                                                     : "unknown command; did you mean " + near + "?");
  }
  if (command != nullptr) PrintPage(out, command, command->info);
  if (pattern != nullptr) {
    if (command != nullptr) out << "\nThe pattern of that name\n\n";
    PrintPage(out, nullptr, *pattern);
  }
  if (command != nullptr && command->info.name == "pattern") {
    out << "\nPatterns\n";
    for (const ops::OpInfo* g : Generators())
      out << "  " << GeneratorSynopsis(*g) << "\n" << Wrapped(g->summary, 6);
  }
}

void PrintVersion(std::ostream& out) {
  out << "tessera " TESSERA_VERSION_STRING "\ntargets:";
  for (const std::string& target : SimdTargets()) out << ' ' << target;
  out << "\n";
}

}  // namespace tessera::cli
