// -o: type, metadata, plan, reference check and statistics of one output, which is written beside its name.
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <new>

#include "cli/limits.h"
#include "cli/messages.h"
#include "cli/report.h"
#include "cli/session.h"
#include "tessera/verify.h"
#include "tessera/version.h"

namespace tessera::cli {
namespace {

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
                           double seconds, const Options& options) {
  VerifyOptions verify;
  verify.samples = options.verify_samples;
  verify.render = options.render;
  verify.run_seconds = seconds;
  const VerifyReport report = VerifyStored(entry.node, output.ReadBack(), verify);
  std::cout << "verify " << file << ": " << report.Summary() << std::endl;
  if (!report.within_bound) {
    throw Error(file, "what was stored is not within its bound of the reference (" + report.Summary() + ")");
  }
}

[[noreturn]] void RefuseMemory(const Entry& entry, const std::string& file, const std::string& reason) {
  const LargestImage& largest = entry.largest;
  throw Error(file, "memory: " + reason + "; its largest image is " +
                        (largest.words.empty() ? "an input" : "the result of " + largest.words) + ", " +
                        std::to_string(largest.width) + " x " + std::to_string(largest.height) + " pixels");
}

// Writes beside the file's name, or tells what would be done.
void Compute(const Entry& entry, const std::string& file, WriteOptions write, Session& session) {
  const Options& options = session.options();
  RequireTime(file);
  if (options.verbose) std::fprintf(Messages(), "tessera: writing %s\n", Printable(file).c_str());
  if (options.explain) {
    std::cout << file << ":\n"
              << Explain(entry.node, write.type.value_or(entry.node.spec().type), options.render);
    return;
  }
  if (options.dry_run) return;

  RunStats stats;
  if (options.runstats) write.stats = &stats;
  ProgressBar bar(file, options.ShowsProgress());
  if (const auto draw = bar.Callback()) {
    write.render.progress = [draw, ask = options.render.progress](double share) {
      return draw(share) && (!ask || ask(share));
    };
  }
  const auto start = std::chrono::steady_clock::now();
  PendingOutput output(entry.node, file, write);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  bar.Finish();
  if (options.verify) CheckAgainstReference(entry, file, output, took.count(), options);
  session.AddOutput(file, std::move(output));
  if (options.runstats) PrintRunStats(file, stats);
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

void WriteOutput(const Step& step, Session& session) {
  const Entry& entry = session.Top();
  const std::string& file = step.arguments.Text("FILE");
  RequireSize(entry);
  WriteOptions write;
  write.render = session.options().render;
  write.codec = session.options().codec;
  write.sync = session.options().sync;
  write.attributes = entry.attributes;
  if (step.arguments.Given("type")) {
    write.type = PixelTypeNamed(step.arguments.Text("type"));
  } else if (session.output_type) {
    write.type = session.output_type;
  }
  // A type that nobody asked for may become the format's nearest; one that was asked for may not.
  const PixelType stored = StoredType(entry.node, file, write);
  if (write.type && stored != *write.type) {
    throw Error(file, std::string("found the type ") + PixelTypeName(*write.type) +
                          ", expected one that this format holds, such as " + PixelTypeName(stored));
  }
  SayPadding(entry, file, session.options());
  if (session.options().software_attribute) AddHistory(entry, session.history(), write.attributes);
  session.Later([entry, file, write, &session] {
    try {
      Compute(entry, file, write, session);
    } catch (const Error& e) {
      if (e.subject() != "memory") throw;
      RefuseMemory(entry, file, MemoryReason(e.reason()));
    } catch (const std::bad_alloc&) {
      RefuseMemory(entry, file, MemoryReason());
    }
  });
}

}  // namespace tessera::cli
