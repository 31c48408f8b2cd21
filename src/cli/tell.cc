// Commands that print what a file or an image is: --info and its kin, --printinfo, --echo, --list-formats.
#include "cli/tell.h"

#include <OpenImageIO/strutil.h>

#include <iostream>

#include "cli/json_report.h"
#include "cli/metadata.h"

namespace tessera::cli {
namespace {

using ops::Arguments;
using ops::ParamInfo;
using ops::ParamType;

Command Row(const std::string& name, Effect effect, const std::string& summary,
            std::vector<ParamInfo> arguments, std::vector<std::string> lines) {
  Command c;
  c.info.name = name;
  c.info.inputs = 0;
  c.info.summary = summary;
  c.info.arguments = std::move(arguments);
  c.group = "Reports";
  c.effect = effect;
  c.lines = std::move(lines);
  return c;
}

Command Option(const std::string& name, const std::string& summary, void (*set)(const Arguments&, Options&),
               std::vector<ParamInfo> arguments, std::vector<std::string> lines) {
  Command c = Row(name, Effect::kOption, summary, std::move(arguments), std::move(lines));
  c.set = set;
  return c;
}

ParamInfo Text(const std::string& name, const std::string& help) {
  return {.name = name, .type = ParamType::kText, .default_value = "", .help = help};
}

ParamInfo Flag(const std::string& name, const std::string& value, const std::string& help) {
  return {.name = name, .type = ParamType::kFlag, .default_value = value, .help = help};
}

InfoOptions Asked(const Options& options) {
  InfoOptions info;
  info.verbose = options.verbose;
  info.all = options.all_parts;
  info.xml = options.info_xml;
  info.hash = options.info_hash;
  info.match = options.info_match;
  info.no_match = options.info_no_match;
  info.formats = options.formats;
  return info;
}

void TellPrograms(const char* kind, const std::string& file, Entry entry, const Options& options) {
  Json report = Report(kind);
  report["file"] = file;
  const std::vector<Entry> parts = options.all_parts ? TakeParts(entry, options) : std::vector<Entry>();
  report["images_in_file"] = options.all_parts ? static_cast<int>(parts.size()) + 1 : entry.PartCount();
  report["images"] = Json::array({Describe(entry)});
  for (const Entry& part : parts) report["images"].push_back(Describe(part));
  for (size_t k = 0; options.info_hash && report["report"] == "info" && k < report["images"].size(); ++k)
    report["images"][k]["sha1"] = PixelHash(file, static_cast<int>(k), options.formats);
  PrintJson(report);
}

void PrintImage(const Step& step, Session& session) {
  Entry entry = session.Top();
  InfoOptions info = Asked(session.options());
  info.verbose = step.arguments.Flag("verbose");
  info.hash = false;
  if (session.options().json) {
    session.Later(
        [entry, &options = session.options()] { TellPrograms("printinfo", entry.file, entry, options); });
    return;
  }
  std::vector<Entry> parts;
  if (session.options().all_parts) parts = TakeParts(entry, session.options());
  session.Later([entry, parts, info] {
    std::cout << InfoText(entry.node.spec(), entry.attributes, info);
    for (const Entry& part : parts) std::cout << InfoText(part.node.spec(), part.attributes, info);
    std::cout.flush();
  });
}

void Echo(const Step& step, Session& session) {
  const std::string text = OIIO::Strutil::unescape_chars(step.arguments.Text("TEXT"));
  session.Later([text, ends = step.arguments.Integer("newline")] {
    std::cout << text << std::string(static_cast<size_t>(ends), '\n') << std::flush;
  });
}

}  // namespace

void TellInput(const Entry& entry, Session& session) {
  session.Later([entry, file = entry.file, &options = session.options()] {
    if (options.json) {
      TellPrograms("info", file, entry, options);
    } else {
      std::cout << InfoText(file, Asked(options));
    }
    if (options.dump) {
      DumpOptions dump;
      dump.empty = options.dump_empty;
      dump.c_name = options.dump_name;
      dump.formats = options.formats;
      DumpPixels(file, 0, dump, [](const std::string& line) { std::cout << line; });
    }
    std::cout.flush();
  });
}

std::vector<Command> TellCommands() {
  std::vector<Command> rows;
  rows.push_back(Option("info", "Prints size, channels, type and format of every file that is read.",
                        [](const Arguments& a, Options& o) {
                          o.info = true;
                          o.info_xml = a.Text("format") == "xml";
                          o.verbose = o.verbose || a.Flag("verbose");
                        },
                        {}, {"--info in.exr", "--info -v -a in.exr"}));
  rows.back().info.modifiers = {{.name = "format",
                                 .type = ParamType::kChoice,
                                 .default_value = "text",
                                 .help = "how it is printed",
                                 .choices = {"text", "xml"}},
                                Flag("verbose", "0", "as -v")};
  rows.back().info.help =
      "With -v every metadata item, with -a every image of the file. No output is needed beside it. The text is "
      "OpenImageIO's; --json is for programs. As oiiotool --info, but that levels of a MIP map are not counted.";
  rows.push_back(
      Option("json", "Prints reports as JSON, one object a line.",
             [](const Arguments&, Options& o) { o.json = true, o.list_format = "json"; }, {},
             {"--json --info in.exr", "--json a.exr b.exr --diff", "--json in.exr --verify -o out.exr"}));
  rows.back().bearing = Bearing::kRun;
  rows.back().info.help =
      "--info, --hash, --printinfo, --printstats, --diff, --pdiff, --colorcount, --rangecheck, --explain, --verify, --runstats, --part, --resume and "
      "--list-commands. Each object says in \"report\" which of them it is; doc/reports.md has the keys. Numbers that "
      "are not finite are null, exit codes as without it, and errors go to standard error as always.";
  rows.push_back(
      Option("metamatch", "Which items --info -v and --printinfo print.",
             [](const Arguments& a, Options& o) { o.info_match = a.Text("REGEX"); },
             {Text("REGEX", "a POSIX extended regular expression, found anywhere in the name, of any case")},
             {"--info -v --metamatch 'Exif|IPTC' in.exr"}));
  rows.push_back(
      Option("no-metamatch", "Which items --info -v and --printinfo leave out.",
             [](const Arguments& a, Options& o) { o.info_no_match = a.Text("REGEX"); },
             {Text("REGEX", "a POSIX extended regular expression, found anywhere in the name, of any case")},
             {"--info -v --no-metamatch 'openexr:' in.exr"}));
  rows.push_back(Option("hash", "Prints the SHA-1 of the pixels of every file that is read.",
                        [](const Arguments&, Options& o) { o.info_hash = true; }, {}, {"--hash in.exr"}));
  rows.back().info.help =
      "Of the pixels in the file's own type (float where that is none of uint8, uint16, half, float), interleaved: "
      "oiiotool --hash of such a file is the same.";
  rows.push_back(Option("dumpdata", "Prints every pixel of every file that is read.",
                        [](const Arguments& a, Options& o) {
                          o.dump = true;
                          o.dump_empty = a.Flag("empty");
                          o.dump_name = a.Text("C");
                        },
                        {}, {"--dumpdata in.exr", "--dumpdata:C=table in.exr"}));
  rows.back().info.modifiers = {Flag("empty", "1", "pixels that are 0 too"),
                                Text("C", "an array of that name, for a program in C")};
  rows.push_back(Option("list-formats", "Prints the formats that OpenImageIO has, with their extensions.",
                        [](const Arguments&, Options& o) { o.list_formats = true; }, {}, {"--list-formats"}));
  rows.back().info.help = "Which of them are read without --formats all: --help formats.";

  rows.push_back(Row("printinfo", Effect::kUse, "Prints size, channels, type and metadata of the top image.",
                     {}, {"in.exr --resize 50% --printinfo"}));
  rows.back().info.inputs = 1;
  rows.back().info.modifiers = {Flag("verbose", "1", "metadata too")};
  rows.back().info.help =
      "What an output would say of itself, of no format; the type is the one that it would have.";
  rows.back().run = PrintImage;
  rows.push_back(Row("echo", Effect::kPrint, "Prints a text.",
                     {Text("TEXT", "the text; \\n and \\t as in C")}, {"in.exr --echo done -o out.exr"}));
  rows.back().any_text = true;
  rows.back().info.modifiers = {{.name = "newline",
                                 .type = ParamType::kInteger,
                                 .default_value = "1",
                                 .help = "line ends behind it",
                                 .min = 0,
                                 .max = 100}};
  rows.back().info.help =
      "When what stands before it has been done. Expressions in braces are for it: --help evalon.";
  rows.back().run = Echo;
  return rows;
}

}  // namespace tessera::cli
