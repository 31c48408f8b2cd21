// --man: the manual page, in the macros of man(7).
#include <OpenImageIO/strutil.h>

#include "cli/describe.h"
#include "cli/help.h"
#include "tessera/version.h"

namespace tessera::cli {
namespace {

// Of the character of UTF-8 that begins with `c`.
size_t BytesOf(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 0xf0 ? 4 : byte >= 0xe0 ? 3 : byte >= 0xc0 ? 2 : 1;
}

std::string CodePoint(const std::string& character) {
  unsigned code = static_cast<unsigned char>(character[0]) & (0xffu >> (character.size() + 1));
  for (size_t k = 1; k < character.size(); ++k)
    code = code << 6 | (static_cast<unsigned char>(character[k]) & 0x3fu);
  return OIIO::Strutil::sprintf("\\[u%04X]", code);
}

// For roff: no escapes, no requests, and dashes that can be searched for and copied.
std::string Roff(const std::string& text) {
  std::string result;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (const size_t bytes = BytesOf(c); bytes > 1 && i + bytes <= text.size()) {
      result += CodePoint(text.substr(i, bytes));
      i += bytes - 1;
      continue;
    }
    const bool first = i == 0 || text[i - 1] == '\n';
    if (first && (c == '.' || c == '\'')) result += "\\&";
    if (c == '\\') {
      result += "\\e";
    } else if (c == '"') {
      result += "\\(dq";
    } else if (c == '-') {
      result += "\\-";
    } else if (c == '\'') {
      result += "\\(aq";
    } else if (c == '`') {
      result += "\\(ga";
    } else if (c == '^') {
      result += "\\(ha";
    } else if (c == '~') {
      result += "\\(ti";
    } else if (c == '\n') {
      result += i + 1 < text.size() && text[i + 1] == '\n' ? "\n.IP" : "\n";
      if (result.ends_with(".IP")) {
        while (i + 1 < text.size() && text[i + 1] == '\n') ++i;
        result += "\n";
      }
    } else {
      result += c;
    }
  }
  return result;
}

void Params(std::ostream& out, const std::vector<ops::ParamInfo>& params, const char* before,
            const char* after) {
  if (params.empty()) return;
  out << ".RS\n";
  for (const ops::ParamInfo& p : params) {
    const std::string allowed = AllowedValues(p);
    out << ".TP\n.I \"" << Roff(before + p.name + after) << "\"\n" << Roff(p.help);
    if (!p.help.empty() && !allowed.empty()) out << (p.help.ends_with(".") ? "\n" : ".\n");
    out << Roff(allowed) << "\n";
  }
  out << ".RE\n";
}

// May be broken between modifiers.
std::string Breakable(const std::string& synopsis) {
  std::string result;
  for (const char c : Roff(synopsis)) result += c == ':' ? std::string("\\::") : std::string(1, c);
  return result;
}

void Entry(std::ostream& out, const ops::OpInfo& row, const std::string& synopsis,
           const std::string& operands, const std::vector<std::string>& lines) {
  out << ".TP\n.B \"" << Breakable(synopsis) << "\"\n"
      << Roff(row.summary) << (row.summary.ends_with(".") ? "" : ".");
  if (!operands.empty()) out << "\n" << Roff(operands);
  out << "\n";
  Params(out, row.arguments, "", "");
  Params(out, row.modifiers, ":", "=");
  if (!row.help.empty()) out << ".IP\n" << Roff(row.help) << "\n";
  if (!row.bound.empty()) out << ".IP\nAccuracy: " << Roff(row.bound) << "\n";
  if (!lines.empty()) out << ".IP\nExample: " << Roff(lines[0]) << "\n";
}

}  // namespace

void PrintManual(std::ostream& out) {
  out << ".\\\" Made by tessera --man.\n"
         ".TH TESSERA 1 \"\" \"tessera " TESSERA_VERSION_STRING
         "\" \"User Commands\"\n"
         ".nh\n.ad l\n"
         ".SH NAME\n"
         "tessera \\- image operations, fused and run tile by tile\n"
         ".SH SYNOPSIS\n"
         ".B tessera\n"
         ".IR FILE \".\\|.\\|. \" COMMAND \".\\|.\\|.\"\n"
         ".B \\-o\n"
         ".I FILE\n"
         ".SH DESCRIPTION\n"
         "The line is read from left to right: a file name pushes an image, a command pops its operands and pushes its\n"
         "result.\nNothing is computed until an output needs it; the whole line is one pipeline.\n"
         "\\- and \\-\\- are equal; modifiers follow a command after colons, \\-\\-name:key=value.\n"
         "Whoever knows\n.BR oiiotool (1)\ncan use it.\n"
         ".PP\n\\- is standard input, \\-o png:\\- standard output, @FILE stands for the words in a file.\n"
         ".B \"tessera \\-\\-help COMMAND\"\ntells what stands here of one command,\n"
         ".B \"tessera \\-\\-help\\-search WORDS\"\nfinds those about something.\n"
         ".SH COMMANDS\n";
  std::string group;
  for (const Command& c : Commands()) {
    if (c.group != group) out << ".SS \"" << Roff(group = c.group) << "\"\n";
    Entry(out, c.info, Synopsis(c), Operands(c), ExampleLines(c));
  }
  out << ".SH PATTERNS\nFor\n.B \"\\-\\-pattern NAME GEOM NCHANS\"\n";
  for (const ops::OpInfo* g : Generators()) Entry(out, *g, GeneratorSynopsis(*g), "", ExampleLines(*g));
  out << ".SH ENVIRONMENT\n"
         ".TP\n.B OCIO\nThe OpenColorIO config, where neither \\-\\-colorconfig nor the file names one.\n"
         ".TP\n.B COLUMNS\nThe width of help and progress on a terminal.\n"
         ".TP\n.B NO_COLOR\nWhere it is set, help has no colours.\n"
         ".SH EXIT STATUS\n"
         ".TP\n.B 0\nDone.\n"
         ".TP\n.B 1\nAn error while working, a \\-\\-diff that is a FAILURE, a \\-\\-verify that is out of bounds.\n"
         ".TP\n.B 2\nA wrong command line, or a value that no image makes right; nothing was computed.\n"
         ".TP\n.B \"128 + N\"\nEnded by signal N.\n"
         ".PP\nNo file is left behind by a run that failed.\n"
         ".SH SEE ALSO\n.BR oiiotool (1)\n";
}

}  // namespace tessera::cli
