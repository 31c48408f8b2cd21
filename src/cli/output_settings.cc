// Settings of the outputs that follow: --compression, --tile, --planarconfig, --no-clobber, --adjust-time.
#include "cli/output_settings.h"

#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <tuple>

#include "cli/messages.h"
#include "cli/metadata.h"
#include "ops/apply.h"
#include "tessera/error_kind.h"
#include "tessera/metadata.h"
#include "tessera/ops/arrangement.h"

namespace tessera::cli {
namespace {

using ops::ParamInfo;
using ops::ParamType;

Command Row(const std::string& name, const std::string& summary, std::vector<ParamInfo> arguments,
            void (*run)(const Step&, Session&), std::vector<std::string> lines) {
  Command c = RowOf("Files", Effect::kSetting, name, 0, summary, std::move(arguments));
  c.applies_to = "o";
  c.run = run;
  c.lines = std::move(lines);
  return c;
}

Command Switch(const std::string& name, const std::string& summary,
               void (*set)(const ops::Arguments&, Options&), std::vector<std::string> lines) {
  Command c = Row(name, summary, {}, nullptr, std::move(lines));
  c.effect = Effect::kOption;
  c.applies_to.clear();
  c.set = set;
  return c;
}

ParamInfo Whole(const std::string& name, int min, int max, const std::string& help) {
  return {.name = name,
          .type = ParamType::kInteger,
          .default_value = "",
          .help = help,
          .min = static_cast<double>(min),
          .max = static_cast<double>(max)};
}

Attribute IntItem(const std::string& name, int value) {
  return ParseAttribute(name, std::to_string(value), "int");
}

void SetTiles(std::vector<Attribute>& hints, int width, int height) {
  Replace(hints, IntItem("tile_width", width));
  Replace(hints, IntItem("tile_height", height));
}

// "2024:01:31 12:30:00", as Exif has it, in local time; false for what is none.
bool TimeOf(const std::string& text, std::time_t& time) {
  std::tm t{};
  char separators[2];
  if (std::sscanf(text.c_str(), "%d%c%d%c%d %d:%d:%d", &t.tm_year, &separators[0], &t.tm_mon, &separators[1],
                  &t.tm_mday, &t.tm_hour, &t.tm_min, &t.tm_sec) != 8)
    return false;
  t.tm_year -= 1900, t.tm_mon -= 1, t.tm_isdst = -1;
  time = std::mktime(&t);
  return time != static_cast<std::time_t>(-1);
}

// Than all of them.
bool IsNewer(const std::string& file, const std::vector<std::string>& inputs) {
  std::error_code code;
  const auto time = std::filesystem::last_write_time(file, code);
  return !code && !inputs.empty() && std::all_of(inputs.begin(), inputs.end(), [&](const std::string& input) {
    return std::filesystem::last_write_time(input, code) < time && !code;
  });
}

}  // namespace

void FitToFile(Entry& entry, const std::string& file, const Session& session) {
  const Options& options = session.options();
  if (!options.auto_trim && options.auto_crop) return;
  const auto format = OIIO::ImageOutput::create(file);
  if (format == nullptr) {
    OIIO::geterror();
    return;
  }
  const bool windows = format->supports("displaywindow");
  if (windows && options.auto_trim && !options.dry_run) entry.node = Trim(entry.node, options.render);
  if (windows || options.auto_crop) return;
  const ops::OpInfo& op = *ops::FindOp("fullpixels");
  entry.node = ops::Apply(op, std::array{entry.node}, ops::ParseArguments(op, {}, {}), nullptr);
}

void Replace(std::vector<Attribute>& list, const Attribute& item) {
  std::erase_if(list, [&](const Attribute& a) { return a.name == item.name; });
  list.push_back(item);
}

std::vector<Attribute> OutputHints(const Step& step) {
  const ops::Arguments& a = step.arguments;
  std::vector<Attribute> hints;
  if (a.Given("tile")) {
    int width = 0, height = 0;
    char rest = 0;
    const int found = std::sscanf(a.Text("tile").c_str(), "%dx%d%c", &width, &height, &rest);
    if (found != 2 || width < 1 || height < 1)
      throw UsageError(step.written, "found tile=" + a.Text("tile") + ", expected WxH, such as 64x64");
    SetTiles(hints, width, height);
  }
  if (a.Flag("scanline")) SetTiles(hints, 0, 0);
  if (a.Flag("separate")) Replace(hints, {"planarconfig", "string", {}, {"separate"}});
  if (a.Flag("contig")) Replace(hints, {"planarconfig", "string", {}, {"contig"}});
  if (a.Given("compression")) Replace(hints, {"compression", "string", {}, {a.Text("compression")}});
  if (a.Given("dither")) Replace(hints, IntItem("oiio:dither", a.Integer("dither")));
  if (a.Given("bits")) Replace(hints, IntItem("oiio:BitsPerSample", a.Integer("bits")));
  return hints;
}

bool SkipsOutput(const std::string& file, const Session& session) {
  std::error_code code;
  const Options& options = session.options();
  if (!std::filesystem::exists(file, code) ||
      !(options.no_clobber || (options.update && IsNewer(file, session.inputs))))
    return false;
  if (!options.quiet)
    std::fprintf(Messages(), "tessera: note: %s: is there and is left as it is (%s)\n",
                 Printable(file).c_str(), options.no_clobber ? "--no-clobber" : "-u");
  return true;
}

void AdjustTime(const Entry& entry, const std::string& file, Session& session) {
  const std::string text = ItemText(entry, "DateTime");
  std::time_t time = 0;
  if (text.empty() || session.options().dry_run) return;
  if (!TimeOf(text, time))
    throw DataError(file,
                    "found the DateTime \"" + text + "\", expected YYYY:MM:DD hh:mm:ss for --adjust-time");
  session.WhenInPlace([file, time] {
    const auto at = std::chrono::file_clock::from_sys(std::chrono::system_clock::from_time_t(time));
    std::error_code code;
    std::filesystem::last_write_time(file, at, code);
    if (code) throw SystemError(file, "its time cannot be set: " + code.message());
  });
}

std::vector<Command> OutputSettingCommands() {
  std::vector<Command> rows;
  rows.push_back(
      Row("compression", "Compression of the outputs that follow.",
          {{.name = "NAME",
            .type = ParamType::kText,
            .default_value = "",
            .help = "a name that the format knows, or NAME:QUALITY"}},
          [](const Step& step, Session& session) {
            Replace(session.output_hints, {"compression", "string", {}, {step.arguments.Text("NAME")}});
          },
          {"in.exr --compression dwaa:45 -o out.exr", "in.exr --compression jpeg:90 -o out.jpg"}));
  rows.back().info.help =
      "EXR: none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa, dwab; TIFF: none, lzw, zip, packbits, ccittrle, "
      "jpeg; JPEG and WebP: jpeg:QUALITY, webp:QUALITY, lossless. A name that a format does not know is passed over, "
      "as by oiiotool --compression. -o:compression= is for one output.";
  rows.push_back(Row("quality", "Quality of the lossy outputs that follow: --compression NAME:QUALITY.",
                     {Whole("QUALITY", 1, 100, "100 is best")},
                     [](const Step& step, Session& session) {
                       Replace(session.output_hints,
                               IntItem("CompressionQuality", step.arguments.Integer("QUALITY")));
                     },
                     {"in.exr --quality 90 -o out.jpg"}));
  rows.push_back(Row("tile", "Tiles in the outputs that follow, where the format has them.",
                     {Whole("WIDTH", 1, 1 << 16, "pixels"), Whole("HEIGHT", 1, 1 << 16, "pixels")},
                     [](const Step& step, Session& session) {
                       SetTiles(session.output_hints, step.arguments.Integer("WIDTH"),
                                step.arguments.Integer("HEIGHT"));
                     },
                     {"in.exr --tile 64 64 -o out.exr"}));
  rows.back().info.help = "TIFF wants multiples of 16. -o:tile=WxH is for one output.";
  rows.push_back(Row("scanline", "Rows, not tiles, in the outputs that follow.", {},
                     [](const Step&, Session& session) { SetTiles(session.output_hints, 0, 0); },
                     {"in.exr --scanline -o out.exr"}));
  rows.back().info.help = "What was read from tiles is written in tiles otherwise.";
  rows.push_back(
      Row("dither", "Dither of eight bits in the outputs that follow.", {},
          [](const Step&, Session& session) { Replace(session.output_hints, IntItem("oiio:dither", 1)); },
          {"in.exr --dither -d uint8 -o out.png"}));
  rows.back().info.help =
      "Up to half a code is added before eight bits are rounded, so that slow gradients show no bands; by a hash of the "
      "place, as --quantize:dither=1 8 does, and not oiiotool's random numbers. Other types are not dithered. -o:dither=1 "
      "is for one output, and -o:dither=0 not.";
  rows.push_back(
      Row("planarconfig", "How channels lie in the outputs that follow, where the format has both.",
          {{.name = "CONFIG",
            .type = ParamType::kChoice,
            .default_value = "",
            .help = "beside each other, each apart, or as the input has it",
            .choices = {"contig", "separate", "default"}}},
          [](const Step& step, Session& session) {
            const std::string& config = step.arguments.Text("CONFIG");
            std::erase_if(session.output_hints, [](const Attribute& a) { return a.name == "planarconfig"; });
            if (config != "default") session.output_hints.push_back({"planarconfig", "string", {}, {config}});
          },
          {"in.exr --planarconfig separate -o out.tif"}));
  rows.push_back(Switch("adjust-time", "Outputs get the time that their metadata (DateTime) say.",
                        [](const ops::Arguments&, Options& o) { o.adjust_time = true; },
                        {"in.exr --adjust-time -o out.exr"}));
  rows.back().info.help =
      "Without a DateTime the file keeps the time of its writing; oiiotool gives it the input's.";
  rows.push_back(Switch("no-clobber", "Outputs whose file is there already are left out.",
                        [](const ops::Arguments&, Options& o) { o.no_clobber = true; },
                        {"in.exr --no-clobber -o out.exr"}));
  rows.back().aliases = {"noclobber"};
  rows.back().info.help = "A note says so; the exit code is 0.";
  rows.push_back(Switch("u", "Outputs that are newer than all files that were read are left out.",
                        [](const ops::Arguments&, Options& o) { o.update = true; },
                        {"-u in.exr --flip -o out.exr"}));
  rows.back().info.help = "A note says so; the exit code is 0.";
  rows.push_back(Switch(
      "autotrim", "Outputs are cropped to their pixels that are not zero, where formats have windows.",
      [](const ops::Arguments&, Options& o) { o.auto_trim = true; }, {"in.exr --autotrim -o out.exr"}));
  rows.back().info.help = "As --trim before -o. The image is computed once more to find them.";
  rows.push_back(Switch("noautocrop",
                        "Outputs of formats without windows hold the data window, not the display window.",
                        [](const ops::Arguments&, Options& o) { o.auto_crop = false; },
                        {"in.exr --crop 64x64+8+8 --noautocrop -o out.png"}));
  rows.push_back(Switch("metamerge", "Operations of several images keep the metadata of all of them.",
                        [](const ops::Arguments&, Options& o) { o.metadata_merge = true; },
                        {"--metamerge a.exr b.exr --add -o out.exr"}));
  rows.back().info.help = "Items that the lowest operand has are its own; of the others' the first counts.";
  rows.push_back(Switch("sansattrib",
                        "The command line is written into the file without its --attrib and --sattrib.",
                        [](const ops::Arguments&, Options& o) { o.sans_attributes = true; },
                        {"in.exr --sansattrib --attrib Secret 7 -o out.exr"}));
  for (const auto& [name, why] :
       {std::pair{"native", "Nothing: samples are read as they are, always."},
        std::pair{"debug", "Nothing: -v, --explain and --runstats tell what is done."},
        std::pair{"autopremult",
                  "Nothing: unassociated alpha is multiplied in as a file is read, always."}}) {
    rows.push_back(Switch(name, why, [](const ops::Arguments&, Options&) {},
                          {std::string("--") + name + " in.exr -o out.exr"}));
    rows.back().info.help = "Taken so that lines of oiiotool need not be changed.";
  }
  for (const auto& [name, argument, why] :
       {std::tuple{"cache", "MB",
                   "Nothing: no cache of images is kept; --max-memory limits what a line takes."},
        std::tuple{"autotile", "TILESIZE", "Nothing: files are read as they lie."}}) {
    rows.push_back(Switch(name, why, [](const ops::Arguments&, Options&) {},
                          {std::string("--") + name + " 64 in.exr -o out.exr"}));
    rows.back().info.arguments = {Whole(argument, 0, 1 << 30, "taken, and has no use")};
    rows.back().info.help = "Taken so that lines of oiiotool need not be changed.";
  }
  return rows;
}

}  // namespace tessera::cli
