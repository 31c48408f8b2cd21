// Commands that change metadata and no pixel: --attrib and its kin, --keyword, --orientation, --pastemeta.
#include <OpenImageIO/strutil.h>

#include <regex>

#include "cli/metadata.h"
#include "tessera/error_kind.h"
#include "tessera/metadata.h"

namespace tessera::cli {
namespace {

using ops::ParamInfo;
using ops::ParamType;

ParamInfo Text(const std::string& name, const std::string& help) {
  return {.name = name, .type = ParamType::kText, .default_value = "", .help = help};
}

Command Row(const std::string& name, const std::string& summary, std::vector<ParamInfo> arguments,
            void (*run)(const Step&, Session&), std::vector<std::string> lines) {
  Command c = RowOf("Metadata", Effect::kApply, name, 1, summary, std::move(arguments));
  c.any_text = true;
  c.run = run;
  c.lines = std::move(lines);
  return c;
}

void Set(const Step& step, Session& session, const std::string& name, const std::string& text,
         const std::string& type) {
  session.ForParts([&](Entry& entry) {
    if (text.empty()) {
      EraseItem(entry, name);
      return;
    }
    try {
      SetItem(entry, ParseAttribute(name, text, type));
    } catch (const Error& e) {
      throw UsageError(step.written + " " + e.subject(), e.reason());
    }
  });
}

void SetAttribute(const Step& step, Session& session) {
  const ops::Arguments& a = step.arguments;
  const std::string& name = a.Text("NAME");
  // A colour space may have a number's name.
  Set(step, session, name, a.Text("VALUE"), name == "oiio:ColorSpace" ? "string" : a.Text("type"));
}

void EraseAttribute(const Step& step, Session& session) {
  std::regex pattern;
  try {
    pattern.assign(step.arguments.Text("REGEX"), std::regex::basic | std::regex::icase);
  } catch (const std::regex_error& e) {
    throw UsageError(step.written, "found \"" + step.arguments.Text("REGEX") +
                                       "\", expected a regular expression (POSIX basic): " + e.what());
  }
  session.ForParts([&](Entry& entry) {
    for (const Attribute& item : MetadataOf(entry)) {
      if (std::regex_match(item.name, pattern)) EraseItem(entry, item.name);
    }
  });
}

void AddKeyword(const Step& step, Session& session) {
  const std::string& word = step.arguments.Text("KEYWORD");
  if (word.empty()) return;
  session.ForParts([&](Entry& entry) {
    std::vector<std::string> words;
    const std::string before = ItemText(entry, "Keywords");
    if (!before.empty()) OIIO::Strutil::split(before, words, ";");
    for (std::string& w : words) w = OIIO::Strutil::strip(w);
    if (std::find(words.begin(), words.end(), word) != words.end()) return;
    words.push_back(word);
    SetItem(entry, {"Keywords", "string", {}, {OIIO::Strutil::join(words, "; ")}});
  });
}

// What a clockwise quarter turn makes of an orientation.
constexpr int kClockwise[] = {0, 6, 7, 8, 5, 2, 3, 4, 1};

template <int kTurns>
void Turn(const Step&, Session& session) {
  session.ForParts([](Entry& entry) {
    const std::string text = ItemText(entry, "Orientation");
    int orientation = text.empty() ? 1 : OIIO::Strutil::stoi(text);
    if (orientation < 1 || orientation > 8) return;
    for (int k = 0; k < kTurns; ++k) orientation = kClockwise[orientation];
    SetItem(entry, ParseAttribute("Orientation", std::to_string(orientation), "int"));
  });
}

void PasteMetadata(const Step&, Session& session) {
  Entry pixels = session.Pop();
  const Entry from = session.Pop();
  for (const Attribute& item : MetadataOf(pixels)) EraseItem(pixels, item.name);
  for (const Attribute& item : MetadataOf(from)) SetItem(pixels, item);
  session.Push(std::move(pixels));
}

}  // namespace

std::vector<Command> MetadataCommands() {
  std::vector<Command> rows;
  rows.push_back(Row("attrib", "Sets a metadata item of the top image; an empty value erases it.",
                     {Text("NAME", "the item's name"), Text("VALUE", "its value")}, SetAttribute,
                     {"in.exr --attrib Copyright 'A. Nobody' -o out.exr",
                      "in.exr --attrib:type=timecode smpte:TimeCode 01:02:03:04 -o out.exr"}));
  rows.back().info.modifiers = {{.name = "type",
                                 .type = ParamType::kText,
                                 .default_value = "",
                                 .help = "OpenImageIO's name of a type; by its looks when left out"}};
  rows.back().info.help =
      "Types are int, float, string, uint, double, arrays and groups of them (float[3], point, color, matrix: "
      "comma-separated values), timecode (HH:MM:SS:FF) and rational (A/B). What formats do with items is "
      "OpenImageIO's to say; oiio:ColorSpace, oiio:UnassociatedAlpha and Orientation are the image's state "
      "and are seen by the commands that go by it. As oiiotool --attrib, but that a value that is none of "
      "its type is an error.";
  rows.push_back(Row("sattrib", "Sets a metadata item to a string, whatever it looks like.",
                     {Text("NAME", "the item's name"), Text("VALUE", "its value; empty erases")},
                     [](const Step& step, Session& session) {
                       const ops::Arguments& a = step.arguments;
                       Set(step, session, a.Text("NAME"), a.Text("VALUE"), "string");
                     },
                     {"in.exr --sattrib Shot 0042 -o out.exr"}));
  rows.push_back(Row("eraseattrib", "Erases the metadata items whose names match.",
                     {Text("REGEX", "a POSIX basic regular expression of the whole name, of any case")},
                     EraseAttribute, {"in.exr --eraseattrib 'Exif:.*' -o out.exr"}));
  rows.push_back(Row("caption", "Sets the caption (ImageDescription).", {Text("TEXT", "empty erases it")},
                     [](const Step& step, Session& session) {
                       Set(step, session, "ImageDescription", step.arguments.Text("TEXT"), "string");
                     },
                     {"in.exr --caption 'Harbour at dawn' -o out.exr"}));
  rows.push_back(Row("keyword", "Adds a keyword, unless it is there.", {Text("KEYWORD", "one keyword")},
                     AddKeyword, {"in.exr --keyword harbour --keyword dawn -o out.exr"}));
  rows.back().info.help = "Keywords is one string with \"; \" between the words, as OpenImageIO has it.";
  rows.push_back(Row("clear-keywords", "Erases all keywords.", {},
                     [](const Step&, Session& session) {
                       session.ForParts([](Entry& entry) { EraseItem(entry, "Keywords"); });
                     },
                     {"in.exr --clear-keywords -o out.exr"}));
  rows.push_back(Row("orientation", "Sets the orientation that viewers and --reorient go by.",
                     {{.name = "ORIENT",
                       .type = ParamType::kInteger,
                       .default_value = "",
                       .help = "as Exif counts: 1 upright, 3 upside down, 6 and 8 on a side",
                       .min = 1,
                       .max = 8}},
                     [](const Step& step, Session& session) {
                       Set(step, session, "Orientation", step.arguments.Text("ORIENT"), "int");
                     },
                     {"in.exr --orientation 6 --reorient -o out.exr"}));
  rows.back().info.help = "No pixel moves; --reorient turns the pixels. As oiiotool --orientation.";
  rows.push_back(Row("orientcw", "Turns the orientation by 90 degrees clockwise; no pixel moves.", {},
                     Turn<1>, {"in.exr --orientcw -o out.exr"}));
  rows.push_back(Row("orientccw", "Turns the orientation by 90 degrees counter-clockwise; no pixel moves.",
                     {}, Turn<3>, {"in.exr --orientccw -o out.exr"}));
  rows.push_back(Row("orient180", "Turns the orientation by 180 degrees; no pixel moves.", {}, Turn<2>,
                     {"in.exr --orient180 -o out.exr"}));
  rows.push_back(Row("pastemeta", "Gives the top image the metadata of the one below.", {}, PasteMetadata,
                     {"a.exr b.exr --pastemeta -o out.exr"}));
  rows.back().info.inputs = 2;
  rows.back().info.help =
      "Pixels, windows, channels and type stay the top image's; all of its items go. As oiiotool --pastemeta.";
  return rows;
}

}  // namespace tessera::cli
