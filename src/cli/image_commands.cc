// Commands that bring images in and out: FILE, -i, --create, --pattern, -o, -d.
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "cli/frame_stream.h"
#include "cli/messages.h"
#include "cli/pipes.h"
#include "cli/session.h"
#include "cli/tell.h"
#include "ops/apply.h"
#include "tessera/color_state.h"
#include "tessera/error_kind.h"
#include "tessera/io.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/generate.h"
#include "tessera/ops/geometry.h"

namespace tessera::cli {
namespace {

using ops::ParamInfo;
using ops::ParamType;

const std::vector<std::string> kTypes = {"uint8", "uint16", "half", "float"};

Command Row(const std::string& name, Effect effect, int inputs, const std::string& summary,
            void (*run)(const Step&, Session&), std::vector<ParamInfo> arguments,
            std::vector<ParamInfo> modifiers) {
  Command c = RowOf("Images", effect, name, inputs, summary, std::move(arguments), std::move(modifiers));
  c.run = run;
  return c;
}

Roi BoxOf(const Step& step, const std::string& text) {
  try {
    if (!text.empty() && text.find_first_not_of("0123456789x") == std::string::npos)
      return ParseGeometry(text.find('x') == std::string::npos ? text + "x" + text : text, Roi{});
  } catch (const Error&) {
  }
  throw UsageError(step.written, "found " + text + " as a thumbnail's size, expected WxH, such as 256x256");
}

// The sides of the image within a box, its aspect kept; none where it fits.
std::optional<ResizeParams> SizeWithin(const Roi& box, const Roi& frame) {
  if (frame.empty()) return {};
  const double scale = std::min(static_cast<double>(box.width()) / frame.width(),
                                static_cast<double>(box.height()) / frame.height());
  if (scale >= 1) return {};
  const auto scaled = [&](int side) { return std::max(1, static_cast<int>(std::lround(side * scale))); };
  ResizeParams size;
  size.width = scaled(frame.width()), size.height = scaled(frame.height());
  return size;
}

// The file's image of at least twice those sides.
Node Enough(const std::string& file, const ResizeParams& size, ReadOptions options) {
  // Of a JPEG, whose sides are below 2^16.
  options.enough_width = 2 * std::min(size.width, 1 << 16);
  options.enough_height = 2 * std::min(size.height, 1 << 16);
  return Read(file, options);
}

// The file's image within a box, from no more pixels than it takes to filter it well.
Node Thumbnail(const Roi& box, const std::string& file, const Node& image, const ReadOptions& options) {
  const std::optional<ResizeParams> size = SizeWithin(box, image.spec().display_window);
  return size ? Resize(Enough(file, *size, options), *size) : image;
}

ReadOptions OptionsOf(const Options& options) { return {.codec = options.codec, .formats = options.formats}; }

// Only formats that may hold several images are asked for their number; OpenEXR says it in its header.
int CountParts(const std::string& file, const ImageSpec& spec, const Options& options) {
  const auto item = [&](const char* name) {
    int value = 0;
    for (const Attribute& a : spec.metadata ? *spec.metadata : std::vector<Attribute>()) {
      if (a.name == name && a.bytes.size() == sizeof value) std::memcpy(&value, a.bytes.data(), sizeof value);
    }
    return value;
  };
  if (const int count = item("oiio:subimages"); count > 0) return count;
  std::string extension = std::filesystem::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array kSeveral = {".tif",  ".tiff", ".gif", ".webp", ".heic",
                                   ".heif", ".avif", ".ico", ".psd"};
  if (std::find(kSeveral.begin(), kSeveral.end(), extension) == kSeveral.end()) return 1;
  return std::max(1, static_cast<int>(Subimages(file, options.formats).size()));
}

// --ch of the registry, with one argument.
Node ChooseChannels(const Node& image, const std::string& channels) {
  const ops::OpInfo& op = *ops::FindOp("ch");
  return ops::Apply(op, std::array{image}, ops::ParseArguments(op, std::array{channels}, {}), nullptr);
}

// What makes itself from nothing, by its name in the registry.
Node Made(const std::string& name, const ImageSpec& spec) {
  const ops::OpInfo& op = *ops::FindOp(name);
  return ops::Apply(op, {}, ops::ParseArguments(op, {}, {}), &spec);
}

// In place of a file that is not there: black or a checkerboard, of the first input's size.
Entry Substitute(const std::string& file, Session& session) {
  ImageSpec spec(1920, 1080, 4);
  if (!session.first_spec.data_window.empty()) {
    const ImageSpec& first = session.first_spec;
    spec.data_window = first.data_window, spec.display_window = first.display_window;
    spec.channels = first.channels, spec.alpha = first.alpha, spec.type = first.type;
  }
  if (!session.options().quiet)
    std::fprintf(Messages(), "tessera: note: %s: no such file, %s is taken (--missingfile)\n",
                 Printable(file).c_str(), session.missing_file.c_str());
  if (session.missing_file == "black") return {Made("create", spec), file, {}};
  const std::vector<const ops::OpInfo*> generators = Generators();
  const ops::OpInfo* const checker = *std::find_if(generators.begin(), generators.end(),
                                                   [](const ops::OpInfo* g) { return g->name == "checker"; });
  const ops::Arguments a = ops::ParseArguments(
      *checker, {}, std::vector<std::pair<std::string, std::string>>{{"width", "64"}, {"height", "64"}});
  return {ops::Apply(*checker, {}, a, &spec), file, {}};
}

void ReadImage(const Step& step, Session& session) {
  const std::string& name = step.arguments.Text("FILE");
  if (name == "-" && session.frame_in) {
    session.Push(session.stream->ImageOf(*session.frame_in));
    return;
  }
  const std::string file = name == "-" ? StandardInput() : name;
  if (const auto label = session.labels.find(file); label != session.labels.end()) {
    session.Push(Entry(label->second));
    return;
  }
  if (session.missing_file != "error" && !std::filesystem::exists(file)) {
    session.Push(Substitute(file, session));
    return;
  }
  session.inputs.push_back(file);
  ReadOptions options = OptionsOf(session.options());
  const bool one = step.arguments.Given("subimage");
  if (one) {
    const std::string& part = step.arguments.Text("subimage");
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), options.subimage);
    if (error != std::errc() || end != part.data() + part.size()) {
      options.subimage = 0;
      options.part = part;
    }
  }
  const bool thumbnail = step.arguments.Given("thumbnail");
  if (thumbnail)
    options.enough_width = options.enough_height = 1 << 16;  // whole, its header read the cheap way
  Entry entry{Read(file, options), name, {}};
  entry.file = file;
  if (session.first_spec.data_window.empty()) session.first_spec = entry.node.spec();
  if (!one && !thumbnail) entry.parts_in_file = CountParts(file, entry.node.spec(), session.options());
  if (thumbnail)
    entry.node = Thumbnail(BoxOf(step, step.arguments.Text("thumbnail")), file, entry.node, options);
  if (step.arguments.Given("ch")) {
    OpenParts(entry, session.options());
    const std::string& channels = step.arguments.Text("ch");
    entry.node = ChooseChannels(entry.node, channels);
    for (Entry& part : entry.parts) part.node = ChooseChannels(part.node, channels);
  }
  if (session.options().autoorient) {
    OpenParts(entry, session.options());
    entry.node = Reorient(entry.node);
    for (Entry& part : entry.parts) part.node = Reorient(part.node);
  }
  if (session.options().verbose) {
    const ImageSpec& spec = entry.node.spec();
    const std::string space = ColorStateOf(spec).space;
    std::fprintf(Messages(), "tessera: reading %s: %d x %d, %d channels, %s, %s\n", file.c_str(),
                 spec.width(), spec.height(), spec.channel_count(), PixelTypeName(spec.type),
                 space.empty() ? "colour space unknown" : space.c_str());
  }
  if (session.options().TellsInputs()) TellInput(entry, session);
  if (!one && !thumbnail && !step.arguments.Given("ch")) entry.as_read = entry.node;
  session.Push(std::move(entry));
}

// Upright and within a box; of a file as it was read no more is decoded than that takes.
void MakeThumbnail(const Step& step, Session& session) {
  Entry entry = session.Pop();
  LeaveParts(entry, WordsOf(step), session.options());
  const Roi box = BoxOf(step, step.arguments.Text("SIZE"));
  const Node upright = Reorient(entry.node);
  if (const std::optional<ResizeParams> size = SizeWithin(box, upright.spec().display_window)) {
    const bool as_read = entry.as_read.data() == entry.node.data() && !session.options().autoorient;
    ResizeParams of_file = *size;
    if (OrientationOf(entry.node.spec()) > 4) std::swap(of_file.width, of_file.height);
    entry.node = Resize(
        as_read ? Reorient(Enough(entry.file, of_file, OptionsOf(session.options()))) : upright, *size);
  } else {
    entry.node = upright;
  }
  session.Push(std::move(entry), WordsOf(step));
}

// The spec of an image made from nothing.
ImageSpec SpecOf(const Step& step) {
  const Roi window = ParseGeometry(step.arguments.Text("GEOM"), Roi{});
  const int channels = step.arguments.Integer("NCHANS");
  RequireSize(step, window, channels);
  ImageSpec spec(window.width(), window.height(), channels);
  spec.data_window = spec.display_window = window;
  return spec;
}

// An image that a step makes from its words alone: what is wrong is the line.
template <typename Make>
void PushFromWords(const Step& step, Session& session, const std::string& name, const Make& make) {
  try {
    session.Push({make(), name, {}}, WordsOf(step));
  } catch (const Error& e) {
    if (KindOf(e) != ErrorKind::kUsage) throw;
    throw UsageError(SubjectOf(step.command->info, e), e.reason());
  }
}

void CreateImage(const Step& step, Session& session) {
  PushFromWords(step, session, "create", [&] { return Made("create", SpecOf(step)); });
}

void CreateKernel(const Step& step, Session& session) {
  const ops::Arguments& a = step.arguments;
  PushFromWords(step, session, "kernel",
                [&] { return KernelImage(NamedKernel(a.Text("NAME"), a.Text("GEOM"))); });
}

void CreatePattern(const Step& step, Session& session) {
  PushFromWords(step, session, step.generator->name, [&] {
    const ImageSpec spec = SpecOf(step);
    return ops::Apply(*step.generator, {}, step.generator_arguments, &spec);
  });
}

std::vector<ParamInfo> Shape() {
  return {{.name = "GEOM", .type = ParamType::kText, .default_value = "", .help = "WxH or WxH+X+Y, pixels"},
          {.name = "NCHANS",
           .type = ParamType::kInteger,
           .default_value = "",
           .help = "number of channels",
           .min = 1,
           .max = 1024}};
}

ParamInfo File(const std::string& help) {
  return {.name = "FILE", .type = ParamType::kText, .default_value = "", .help = help};
}

}  // namespace

void OpenParts(Entry& entry, const Options& options) {
  if (!entry.parts.empty()) return;
  for (int part = 1; part < entry.parts_in_file; ++part) {
    ReadOptions read = OptionsOf(options);
    read.subimage = part;
    entry.parts.push_back({Read(entry.file, read), entry.name, {}});
    entry.parts.back().file = entry.file;
  }
  entry.parts_in_file = 1;
}

std::vector<Entry> TakeParts(Entry& entry, const Options& options) {
  OpenParts(entry, options);
  return std::exchange(entry.parts, {});
}

void LeaveParts(Entry& entry, const std::string& words, const Options& options) {
  if (entry.PartCount() > 1 && !options.quiet && !options.dry_run) {
    std::fprintf(
        Messages(),
        "tessera: note: %s: %s works on the first of %d images, the others are left; -a is for all\n",
        Printable(entry.name).c_str(), Printable(words).c_str(), entry.PartCount());
  }
  entry.parts.clear();
  entry.parts_in_file = 1;
}

PixelType PixelTypeNamed(const std::string& name) {
  return static_cast<PixelType>(std::find(kTypes.begin(), kTypes.end(), name) - kTypes.begin());
}

std::vector<Command> ImageCommands() {
  std::vector<Command> rows;
  rows.push_back(Row("i", Effect::kPush, 0, "Pushes the image of a file; -i may be left out.", ReadImage,
                     {File("a file that OpenImageIO reads")},
                     {{.name = "subimage",
                       .type = ParamType::kText,
                       .default_value = "0",
                       .help = "index from 0, or name, of the part that is read"},
                      {.name = "thumbnail",
                       .type = ParamType::kText,
                       .default_value = "",
                       .help = "WxH, or one number for both: made smaller to fit within"},
                      {.name = "ch",
                       .type = ParamType::kText,
                       .default_value = "",
                       .help = "channels, as --ch takes them; the others are not read"}}));
  rows.back().info.help =
      "A thumbnail keeps its aspect and is filtered as by --resize; an image that fits is left as it is. A JPEG is "
      "decoded at 1/2, 1/4 or 1/8 of its sides as long as twice the thumbnail's are left: much faster, and other "
      "pixels than --resize gives: 1 or 2 codes of 255 away on average over a photograph, up to 30 where there is "
      "grain, and, of sides that the fraction does not divide, moved by less than half a pixel at the right and "
      "the lower edge. What is not needed of a progressive JPEG is not looked at. Files of other formats are "
      "decoded whole, as JPEG is with --codec oiio, and get the pixels of --resize.\n"
      "Of a file of several images (parts of an EXR, pages of a TIFF, frames of a GIF) all are read, and written "
      "again by -o into a format that can; commands work on the first, and say that the others are left, or with -a on all. "
      "subimage= reads one.\n"
      "- is standard input, which is kept in a temporary file; what it begins with tells the format.\n"
      "The slices of a volume file lie one above the other, the first on top, as --lookup:slices=N takes a "
      "table of three axes.";
  rows.push_back(Row("thumbnail", Effect::kApply, 1,
                     "Turns the top image upright and makes it smaller to fit within a size.", MakeThumbnail,
                     {{.name = "SIZE",
                       .type = ParamType::kText,
                       .default_value = "",
                       .help = "WxH, or one number for both"}},
                     {}));
  rows.back().info.help =
      "Upright as --reorient makes it, filtered as by --resize, the aspect kept; an image that fits keeps its pixels. "
      "Colours and profile are those of the image. Right behind the file's name a JPEG is decoded as small as "
      "-i:thumbnail= has it.";
  rows.back().lines = {"in.exr --thumbnail 64 -o out.exr"};
  rows.push_back(Row(
      "o", Effect::kUse, 1, "Writes the top image, which stays on the stack.", WriteOutput,
      {File("the file to write; its extension names the format")},
      {{.name = "type",
        .type = ParamType::kText,
        .default_value = "",
        .help = "uint8, uint16, half or float, for this file alone"},
       {.name = "datatype",
        .type = ParamType::kText,
        .default_value = "",
        .help = "another word for type",
        .only_with = "!type"},
       {.name = "compression",
        .type = ParamType::kText,
        .default_value = "",
        .help = "as --compression, for this file alone"},
       {.name = "tile",
        .type = ParamType::kText,
        .default_value = "",
        .help = "WxH: as --tile, for this file alone"},
       {.name = "scanline",
        .type = ParamType::kFlag,
        .default_value = "0",
        .help = "rows, not tiles",
        .only_with = "!tile"},
       {.name = "separate", .type = ParamType::kFlag, .default_value = "0", .help = "each channel apart"},
       {.name = "contig",
        .type = ParamType::kFlag,
        .default_value = "0",
        .help = "channels beside each other",
        .only_with = "!separate"},
       {.name = "bits",
        .type = ParamType::kInteger,
        .default_value = "0",
        .help = "bits of a sample, where the format has more kinds than types (DPX: 10)",
        .min = 0,
        .max = 32},
       {.name = "all",
        .type = ParamType::kInteger,
        .default_value = "",
        .help =
            "writes every image on the stack, the lowest first, numbered from here in the place of # or %04d",
        .min = 0,
        .max = 1000000000},
       {.name = "dither",
        .type = ParamType::kInteger,
        .default_value = "0",
        .help = "above 0: eight bits are dithered as --quantize:dither=1 8 does; the number is the seed",
        .min = 0,
        .max = 2147483647}}));
  for (const size_t i : {0, 1}) {
    rows.back().info.modifiers[i].type = ParamType::kChoice;
    rows.back().info.modifiers[i].choices = kTypes;
  }
  rows.back().info.help =
      "- is standard output, in the format of the first file that was read; png:- and the like name one. It is written "
      "when the line has succeeded, from a temporary file; reports would go there too.\n"
      "Without a type, here or by -d, the image keeps the type it has where the format can hold it. All "
      "outputs of a line (of a frame) are written beside their names and put in place together when the line "
      "has succeeded, so an output may be one of the inputs, and a run that fails leaves what was there. "
      "Sides are up to 2^24 pixels and samples at most 2^40; an image that is cut down before it is written "
      "may be larger.";
  rows.push_back(Row("d", Effect::kSetting, 0, "Pixel type of the outputs that follow.",
                     [](const Step& step, Session& session) {
                       const std::string& text = step.arguments.Text("TYPE");
                       const auto channels = ByChannel(text);
                       for (const auto& [channel, type] : channels)
                         session.channel_types[channel] = PixelTypeNamed(type);
                       if (!channels.empty()) return;
                       session.output_type = PixelTypeNamed(text);
                       session.channel_types.clear();
                     },
                     {{.name = "TYPE",
                       .type = ParamType::kChoice,
                       .default_value = "",
                       .help = "pixel type, or one for each of some channels: CHANNEL=TYPE,CHANNEL=TYPE",
                       .choices = kTypes}},
                     {}));
  rows.back().by_channel = true;
  rows.back().info.help =
      "-d half -d Z=float: what a channel is given counts beside the type of the others, which is the last that -d said, or the "
      "image's own; -d with a type alone is for all channels again. As oiiotool. Formats that have one type for all (all but "
      "OpenEXR) refuse several. A file with channels of several types is read as floats, and written as floats where nobody "
      "says otherwise.";
  rows.back().lines = {"in.exr -d half -o out.exr", "in.exr -d half -d A=float -o out.exr"};
  rows.back().applies_to = "o";
  rows.push_back(
      Row("colorconfig", Effect::kSetting, 0, "OpenColorIO config of the commands that follow.",
          [](const Step& step, Session& session) { session.color_config = step.arguments.Text("CONFIG"); },
          {{.name = "CONFIG",
            .type = ParamType::kText,
            .default_value = "",
            .help = "a config file, or built-in"}},
          {}));
  rows.back().applies_to = ":config";
  rows.push_back(
      Row("missingfile", Effect::kSetting, 0, "What is taken for an input that is not there.",
          [](const Step& step, Session& session) { session.missing_file = step.arguments.Text("OPTION"); },
          {{.name = "OPTION",
            .type = ParamType::kChoice,
            .default_value = "",
            .help = "an error, a black image, a checkerboard",
            .choices = {"error", "black", "checker"}}},
          {}));
  rows.back().applies_to = "i";
  rows.back().lines = {"--missingfile black in.exr -o out.exr"};
  rows.back().info.help =
      "Its size, channels and type are those of the first file that was read, else 1920 x 1080 and four channels. A "
      "note says so. As oiiotool --missingfile; a file that is there and cannot be read is an error all the same.";
  rows.push_back(Row(
      "label", Effect::kUse, 1, "Gives the top image a name that pushes it again.",
      [](const Step& step, Session& session) { session.labels[step.arguments.Text("NAME")] = session.Top(); },
      {{.name = "NAME",
        .type = ParamType::kText,
        .default_value = "",
        .help = "a name, in place of a file's"}},
      {}));
  rows.back().lines = {"in.exr --label plain --blur 9x9 plain --sub -o out.exr"};
  rows.back().any_text = true;
  rows.push_back(Row("create", Effect::kPush, 0, "Pushes a black image.", CreateImage, Shape(), {}));
  rows.push_back(Row(
      "kernel", Effect::kPush, 0, "Pushes a convolution kernel as an image centred on the origin.",
      CreateKernel,
      {{.name = "NAME", .type = ParamType::kText, .default_value = "", .help = "a kernel's name"},
       {.name = "GEOM", .type = ParamType::kText, .default_value = "", .help = "WxH or one number, pixels"}},
      {}));
  rows.back().info.help = "For --convolve, as oiiotool's --kernel. Names: ";
  for (const std::string& name : KernelNames())
    rows.back().info.help += (name == KernelNames()[0] ? "" : ", ") + name;
  rows.back().info.help +=
      ". Those with a number or a direction in their name have a size of their own and ignore GEOM.";
  std::vector<ParamInfo> pattern = Shape();
  pattern.insert(pattern.begin(), {.name = "NAME",
                                   .type = ParamType::kText,
                                   .default_value = "",
                                   .help = "a generator with its modifiers, as checker:width=8"});
  rows.push_back(Row("pattern", Effect::kPush, 0, "Pushes a generated image.", CreatePattern, pattern, {}));
  rows.back().info.help = "The generators are listed below; --help NAME tells all about one.";
  return rows;
}

}  // namespace tessera::cli
