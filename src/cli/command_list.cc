// --list-commands: the same rows for programs (tsv, json) and as the reference page (markdown).
#include <OpenImageIO/strutil.h>

#include "cli/describe.h"
#include "cli/help.h"

namespace tessera::cli {
namespace {

// What is listed of a command or of a generator.
struct Item {
  std::string name, group, synopsis, operands;
  int taken = 0, given = 0;
  const ops::OpInfo* row = nullptr;
  std::vector<std::string> aliases, lines;
};

std::vector<Item> Items() {
  std::vector<Item> items;
  for (const Command& c : Commands()) {
    items.push_back({c.info.name, c.group, Synopsis(c), Operands(c), Taken(c), Given(c), &c.info, c.aliases,
                     ExampleLines(c)});
  }
  for (const ops::OpInfo* g : Generators()) {
    items.push_back({"pattern " + g->name,
                     "Patterns",
                     "--pattern " + GeneratorSynopsis(*g) + " GEOM NCHANS",
                     "Pushes one image.",
                     0,
                     1,
                     g,
                     {},
                     ExampleLines(*g)});
  }
  return items;
}

void PrintTsv(std::ostream& out) {
  out << "name\tgroup\ttakes\tgives\targuments\tmodifiers\tsummary\n";
  for (const Item& item : Items()) {
    out << item.name << '\t' << item.group << '\t' << item.taken << '\t' << item.given << '\t';
    std::string separator;
    for (const ops::ParamInfo& p : item.row->arguments) {
      out << separator << p.name;
      separator = " ";
    }
    out << '\t';
    separator.clear();
    for (const ops::ParamInfo& p : item.row->modifiers) {
      out << separator << p.name << '=' << p.default_value;
      separator = ":";
    }
    out << '\t' << item.row->summary << '\n';
  }
}

std::string Json(const std::string& text) {
  std::string result = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (c == '\n') {
      result += "\\n";
    } else if (static_cast<unsigned char>(c) < 0x20) {
      result += OIIO::Strutil::sprintf("\\u%04x", static_cast<int>(c));
    } else {
      result += c;
    }
  }
  return result + "\"";
}

void PrintJsonParams(std::ostream& out, const char* key, const std::vector<ops::ParamInfo>& params) {
  out << ",\n   \"" << key << "\": [";
  std::string separator;
  for (const ops::ParamInfo& p : params) {
    out << separator << "\n    {\"name\": " << Json(p.name) << ", \"type\": " << Json(TypeName(p.type))
        << ", \"default\": " << Json(p.default_value) << ", \"allowed\": " << Json(AllowedValues(p))
        << ", \"choices\": [";
    for (size_t i = 0; i < p.choices.size(); ++i) out << (i > 0 ? ", " : "") << Json(p.choices[i]);
    out << "], \"help\": " << Json(p.help) << "}";
    separator = ",";
  }
  out << "]";
}

void PrintJsonTexts(std::ostream& out, const char* key, const std::vector<std::string>& texts) {
  out << ",\n   \"" << key << "\": [";
  for (size_t i = 0; i < texts.size(); ++i) out << (i > 0 ? ", " : "") << Json(texts[i]);
  out << "]";
}

void PrintJson(std::ostream& out) {
  out << "[";
  std::string separator;
  for (const Item& item : Items()) {
    out << separator << "\n  {\"name\": " << Json(item.name) << ", \"group\": " << Json(item.group)
        << ", \"takes\": " << item.taken << ", \"gives\": " << item.given
        << ",\n   \"synopsis\": " << Json(item.synopsis) << ",\n   \"summary\": " << Json(item.row->summary)
        << ",\n   \"help\": " << Json(item.row->help) << ",\n   \"accuracy\": " << Json(item.row->bound);
    PrintJsonParams(out, "arguments", item.row->arguments);
    PrintJsonParams(out, "modifiers", item.row->modifiers);
    PrintJsonTexts(out, "examples", item.row->examples);
    PrintJsonTexts(out, "lines", item.lines);
    out << "}";
    separator = ",";
  }
  out << "\n]\n";
}

void PrintMarkdownParams(std::ostream& out, const std::vector<ops::ParamInfo>& params, bool modifiers) {
  for (const ops::ParamInfo& p : params) {
    const std::string allowed = AllowedValues(p);
    out << "- `" << (modifiers ? ":" + p.name + "=" : p.name) << "` " << p.help
        << (allowed.empty() ? "" : ". " + allowed) << "\n";
  }
}

void PrintMarkdown(std::ostream& out) {
  out << "# The commands of tessera\n\nMade by `tessera --list-commands:format=markdown`.\n";
  std::string group;
  for (const Item& item : Items()) {
    if (item.group != group) out << "\n## " << (group = item.group) << "\n";
    out << "\n### " << item.name << "\n\n`" << item.synopsis << "`\n\n"
        << item.row->summary << (item.operands.empty() ? "" : " " + item.operands) << "\n";
    if (!item.row->arguments.empty() || !item.row->modifiers.empty()) out << "\n";
    PrintMarkdownParams(out, item.row->arguments, false);
    PrintMarkdownParams(out, item.row->modifiers, true);
    if (!item.row->help.empty()) out << "\n" << item.row->help << "\n";
    if (!item.row->bound.empty()) out << "\nAccuracy: " << item.row->bound << "\n";
    const std::vector<std::string> lines = item.lines;
    if (!lines.empty()) out << "\n    " << lines[0] << "\n";
  }
}

}  // namespace

void PrintCommandList(std::ostream& out, const std::string& format) {
  if (format == "json") {
    PrintJson(out);
  } else if (format == "markdown") {
    PrintMarkdown(out);
  } else {
    PrintTsv(out);
  }
}

}  // namespace tessera::cli
