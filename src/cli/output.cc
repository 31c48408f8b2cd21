// -o: type, metadata, plan, reference check and statistics of one output, which is written beside its name.
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <new>
#include <set>

#include "cli/cost.h"
#include "cli/frame_names.h"
#include "cli/frame_stream.h"
#include "cli/json_report.h"
#include "cli/limits.h"
#include "cli/messages.h"
#include "cli/output_settings.h"
#include "cli/pieces.h"
#include "cli/pipes.h"
#include "cli/report.h"
#include "cli/session.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/verify.h"
#include "tessera/version.h"

namespace tessera::cli {
namespace {

// Of WriteOptions: a type for each channel.
constexpr char kChannelTypes[] = "tessera:ChannelTypes";

Attribute TextAttribute(const std::string& name, const std::string& text) {
  return {name, "string", {}, {text}};
}

// The text of an attribute of the image: what --attrib set, or else what came with the node.
std::string TextOf(const Entry& entry, const std::string& name) {
  for (const Attribute& a : entry.attributes) {
    if (a.name == name) return a.strings.empty() ? "" : a.strings[0];
  }
  if (entry.node.spec().metadata) {
    for (const Attribute& a : *entry.node.spec().metadata) {
      if (a.name == name) return a.strings.empty() ? "" : a.strings[0];
    }
  }
  return "";
}

// As oiiotool: the line is appended to the history, and Software names the program and the line.
void AddHistory(const Entry& entry, const std::string& line, std::vector<Attribute>& attributes) {
  std::erase_if(attributes,
                [](const Attribute& a) { return a.name == "Exif:ImageHistory" || a.name == "Software"; });
  std::string history = TextOf(entry, "Exif:ImageHistory");
  if (!history.ends_with(line)) {
    if (!history.empty() && !history.ends_with('\n')) history += '\n';
    history += line;
  }
  attributes.push_back(TextAttribute("Exif:ImageHistory", history));
  attributes.push_back(
      TextAttribute("Software", std::string("tessera " TESSERA_VERSION_STRING " : ") + line));
}

// `seconds`: what writing took.
void CheckAgainstReference(const Entry& entry, const std::string& file, const PendingOutput& output,
                           double seconds, const Options& options, int part = 0) {
  VerifyOptions verify;
  verify.samples = options.verify_samples;
  verify.render = options.render;
  verify.run_seconds = seconds;
  const VerifyReport report = VerifyStored(entry.node, output.ReadBack(part), verify);
  if (options.json) PrintJson(VerifyReportOf(file, part, report));
  const std::string which = part > 0 || entry.PartCount() > 1 ? " image " + std::to_string(part) : "";
  if (!options.json) std::cout << "verify " << file << which << ": " << report.Summary() << std::endl;
  if (!report.within_bound) {
    throw Error(file, "what was stored is not within its bound of the reference (" + report.Summary() + ")");
  }
}

double PixelsOf(const Entry& entry) {
  double pixels = static_cast<double>(entry.node.spec().data_window.pixels());
  for (const Entry& part : entry.parts) pixels += static_cast<double>(part.node.spec().data_window.pixels());
  return pixels;
}

[[noreturn]] void RefuseMemory(const Entry& entry, const std::string& file, const std::string& reason) {
  const LargestImage& largest = entry.largest;
  throw Error(file, "memory: " + reason + "; its largest image is " +
                        (largest.words.empty() ? "an input" : "the result of " + largest.words) + ", " +
                        std::to_string(largest.width) + " x " + std::to_string(largest.height) + " pixels");
}

void TellRunStats(const std::string& file, const RunStats& stats, const Options& options) {
  if (options.runstats && options.json) PrintJson(RunStatsReport(file, stats));
  if (options.runstats && !options.json) PrintRunStats(file, stats);
}

// Whether what is written is a frame of --stream.
bool IsStreamed(const std::string& name, const Session& session) {
  return name == "-" && session.stream != nullptr;
}

// Writes beside the file's name, or tells what would be done.
void Compute(const Entry& entry, const std::string& file, WriteOptions write, Session& session,
             const std::vector<PendingOutput::Part>& parts) {
  const Options& options = session.options();
  RequireTime(file);
  if (options.verbose) std::fprintf(Messages(), "tessera: writing %s\n", Printable(file).c_str());
  if (options.explain && options.cost) return PrintCost(entry, file, write, options);
  if (options.explain && options.json) {
    Json report = Report("explain");
    report["output"] = file;
    report["plan"] = Lines(Explain(entry.node, write.type.value_or(entry.node.spec().type), options.render));
    PrintJson(report);
    return;
  }
  if (options.explain) {
    std::cout << file << ":\n"
              << Explain(entry.node, write.type.value_or(entry.node.spec().type), options.render);
    for (const Entry& part : entry.parts)
      std::cout << Explain(part.node, write.type.value_or(part.node.spec().type), options.render);
    return;
  }
  if (options.dry_run) return;

  RunStats stats;
  if (options.runstats) write.stats = &stats;
  Progress::Frame& bar = session.progress();
  bar.Begin(file, PixelsOf(entry));
  if (const auto draw = bar.Callback()) {
    write.render.progress = [draw, ask = options.render.progress](double share) {
      return draw(share) && (!ask || ask(share));
    };
  }
  std::vector<Node> images = {entry.node};
  for (const PendingOutput::Part& part : parts) images.push_back(part.node);
  std::optional<MemoryGate::Share> memory;
  if (session.memory != nullptr) memory.emplace(*session.memory, images, write.render);
  if (IsStreamed(file, session)) {
    session.frame_out = session.stream->FrameOf(entry.node, write.render, write.stats);
    bar.End();
    TellRunStats(file, stats, options);
    return;
  }
  const auto start = std::chrono::steady_clock::now();
  PendingOutput output =
      parts.empty() ? PendingOutput(entry.node, file, write) : PendingOutput(parts, file, write);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  memory.reset();
  bar.End();
  if (options.verify) {
    CheckAgainstReference(entry, file, output, took.count(), options);
    for (size_t k = 0; k < entry.parts.size(); ++k)
      CheckAgainstReference(entry.parts[k], file, output, took.count(), options, static_cast<int>(k) + 1);
  }
  session.AddOutput(file, std::move(output));
  TellRunStats(file, stats, options);
}

// What was cropped for a smaller picture becomes a large one with black around it in formats without windows.
void SayPadding(const Entry& entry, const std::string& file, const Options& options) {
  const Roi &data = entry.node.spec().data_window, &display = entry.node.spec().display_window;
  if (options.quiet || display.empty() || Union(data, display) != display || data == display) return;
  const auto format = OIIO::ImageOutput::create(file);
  if (format == nullptr || format->supports("displaywindow")) return;
  std::fprintf(
      Messages(),
      "tessera: note: %s: %s has no data window, %d x %d pixels are written and those around %d x %d "
      "are black; --cut in place of --crop makes a smaller picture\n",
      Printable(file).c_str(), format->format_name(), display.width(), display.height(), data.width(),
      data.height());
}

}  // namespace

namespace {

// What -o and the settings before it ask for; whether that is a type.
WriteOptions OptionsFor(const Step& step, const Entry& entry, const Session& session, bool& asked) {
  WriteOptions write;
  write.render = session.options().render;
  write.codec = session.options().codec;
  write.sync = session.options().sync;
  write.attributes = entry.attributes;
  for (const Attribute& hint : session.output_hints) Replace(write.attributes, hint);
  for (const Attribute& hint : OutputHints(step)) Replace(write.attributes, hint);
  for (const char* const name : {"type", "datatype"}) {
    if (step.arguments.Given(name)) write.type = PixelTypeNamed(step.arguments.Text(name));
  }
  if (!write.type) write.type = session.output_type;
  asked = write.type.has_value();
  if (!write.type) write.type = entry.suggested;
  if (session.options().software_attribute) AddHistory(entry, session.history(), write.attributes);
  return write;
}

// A type that nobody asked for may become the format's nearest; one that was asked for may not.
void RequireType(const Entry& entry, const std::string& file, WriteOptions& write, bool asked) {
  const PixelType stored = StoredType(entry.node, file, write);
  if (!asked) {
    if (write.type) write.type = stored;
    return;
  }
  if (stored != *write.type) {
    throw Error(file, std::string("found the type ") + PixelTypeName(*write.type) +
                          ", expected one that this format holds, such as " + PixelTypeName(stored));
  }
}

// -d CHANNEL=TYPE: all of one type are of that, several are an attribute that the writer takes.
void ChooseChannelTypes(const Step& step, const Entry& entry, const std::string& file, bool asked,
                        const Session& session, WriteOptions& write) {
  const auto& chosen = session.channel_types;
  if (chosen.empty() || step.arguments.Given("type") || step.arguments.Given("datatype")) return;
  const PixelType rest = asked ? *write.type : StoredType(entry.node, file, write);
  std::vector<std::string> names;
  std::set<PixelType> types;
  for (const std::string& channel : entry.node.spec().channels) {
    const auto own = chosen.find(channel);
    const PixelType type = own == chosen.end() ? rest : own->second;
    types.insert(type), names.emplace_back(PixelTypeName(type));
  }
  if (types.size() == 1) {
    if (*types.begin() == rest) return;
    write.type = *types.begin();
    RequireType(entry, file, write, true);
    return;
  }
  if (session.options().verify) {
    throw DataError(file,
                    "found channels of several types beside --verify, expected one type, whose codes it "
                    "compares");
  }
  write.attributes.push_back(
      {kChannelTypes, "string[" + std::to_string(names.size()) + "]", {}, std::move(names)});
}

// What --dither and -o:dither= ask for, for eight bits alone. OpenImageIO's own dither, which the attribute
// would ask for, is left out.
Node Dithered(const Entry& entry, const std::string& file, WriteOptions& write) {
  const auto asked = std::find_if(write.attributes.begin(), write.attributes.end(),
                                  [](const Attribute& a) { return a.name == "oiio:dither"; });
  if (asked == write.attributes.end()) return entry.node;
  int seed = 0;
  if (asked->bytes.size() == sizeof seed) std::memcpy(&seed, asked->bytes.data(), sizeof seed);
  write.attributes.erase(asked);
  if (seed <= 0 || StoredType(entry.node, file, write) != PixelType::kUint8) return entry.node;
  return Quantize(entry.node, {.bits = 8, .dither = true, .seed = static_cast<uint32_t>(seed)});
}

// All images of the entry, where there are several and the format holds them.
std::vector<PendingOutput::Part> PartsFor(const Step& step, Entry& entry, const std::string& file,
                                          const Session& session) {
  if (entry.PartCount() == 1) return {};
  if (!HoldsParts(file)) {
    if (!session.options().quiet) {
      std::fprintf(Messages(),
                   "tessera: note: %s: the first of %d images is written, as the format holds one; "
                   "--sisplit or -i:subimage= gives the others\n",
                   Printable(file).c_str(), entry.PartCount());
    }
    entry.parts.clear();
    entry.parts_in_file = 1;
    return {};
  }
  OpenParts(entry, session.options());
  std::vector<PendingOutput::Part> parts;
  const auto add = [&](const Entry& part) {
    bool asked = false;
    WriteOptions own = OptionsFor(step, part, session, asked);
    const Node node = Dithered(part, file, own);
    ChooseChannelTypes(step, part, file, asked, session, own);
    parts.push_back({node, own.type, own.attributes});
  };
  add(entry);
  for (const Entry& part : entry.parts) {
    RequireSize(part);
    add(part);
  }
  return parts;
}

}  // namespace

namespace {

void ComputeLater(const Entry& entry, const std::string& file, const WriteOptions& write,
                  const std::vector<PendingOutput::Part>& parts, Session& session) {
  session.NoteSources(entry.node);
  for (const PendingOutput::Part& part : parts) session.NoteSources(part.node);
  session.Later([entry, file, write, parts, &session] {
    try {
      Compute(entry, file, write, session, parts);
    } catch (const Error& e) {
      if (e.subject() != "memory") throw;
      RefuseMemory(entry, file, MemoryReason(e.reason()));
    } catch (const std::bad_alloc&) {
      RefuseMemory(entry, file, MemoryReason());
    }
  });
}

// A frame of --stream: the display window, as formats without windows have it, in the stream's own samples.
void WriteFrame(const Step& step, Entry entry, const std::string& name, Session& session) {
  bool asked = false;
  WriteOptions write = OptionsFor(step, entry, session, asked);
  if (asked || !session.channel_types.empty()) {
    throw DataError("-o " + name,
                    "found -d or type= for a frame of --stream, expected it in the stream's format, as "
                    "--stream:output=rgb48le or C420p10");
  }
  LeaveParts(entry, WordsOf(step), session.options());
  KeepRegion(entry, name, session.options());
  const Roi &data = entry.node.spec().data_window, &display = entry.node.spec().display_window;
  if (session.options().auto_crop && data != display && !display.empty())
    entry.node = Crop(entry.node, display);
  RequireSize(entry);
  entry.node = session.stream->SamplesOf(entry.node);
  write.type = entry.node.spec().type;
  ComputeLater(entry, name, write, {}, session);
}

void WriteEntry(const Step& step, Entry entry, const std::string& name, Session& session) {
  if (IsStreamed(name, session)) {
    WriteFrame(step, std::move(entry), name, session);
    return;
  }
  const std::string file = IsStandardOutput(name) ? InPlaceOfStandardOutput(name, session) : name;
  if (SkipsOutput(file, session)) return;
  FitToFile(entry, file, session);
  for (Entry& part : entry.parts) FitToFile(part, file, session);
  if (session.options().region) OpenParts(entry, session.options());
  KeepRegion(entry, file, session.options());
  for (Entry& part : entry.parts) KeepRegion(part, file, session.options());
  RequireSize(entry);
  const std::vector<PendingOutput::Part> parts = PartsFor(step, entry, file, session);
  bool asked = false;
  WriteOptions write = OptionsFor(step, entry, session, asked);
  RequireType(entry, file, write, asked);
  entry.node = Dithered(entry, file, write);
  ChooseChannelTypes(step, entry, file, asked, session, write);
  SayPadding(entry, file, session.options());
  ComputeLater(entry, file, write, parts, session);
  if (session.options().adjust_time) AdjustTime(entry, file, session);
}

}  // namespace

void WriteOutput(const Step& step, Session& session) {
  const std::string& name = step.arguments.Text("FILE");
  if (!step.arguments.Given("all")) {
    WriteEntry(step, session.Top(), name, session);
    return;
  }
  const auto pattern = FindFrame(name, session.options().frame_padding);
  if (!pattern) {
    throw UsageError(WordsOf(step), "found the name " + name +
                                        ", expected one with # or %04d for the number of "
                                        "each image");
  }
  const int first = step.arguments.Integer("all");
  for (int k = 0; k < session.Depth(); ++k)
    WriteEntry(step, session.Top(session.Depth() - 1 - k), pattern->At(first + k), session);
}

}  // namespace tessera::cli
