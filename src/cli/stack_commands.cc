// Commands on the image stack itself: --dup, --swap, --pop, --iccread.
#include <fstream>
#include <iterator>

#include "base/input_file.h"
#include "cli/session.h"
#include "tessera/color_state.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

using ops::ParamInfo;
using ops::ParamType;

Command Row(const std::string& name, Effect effect, int inputs, const std::string& summary,
            void (*run)(const Step&, Session&)) {
  Command c;
  c.info.name = name;
  c.info.inputs = inputs;
  c.info.summary = summary;
  c.group = "Stack";
  c.effect = effect;
  c.run = run;
  return c;
}

void ReadProfile(const Step& step, Session& session) {
  const std::string& file = step.arguments.Text("FILE");
  base::InputFile stream(file, "an ICC profile", int64_t{1} << 26);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) throw SystemError(file, "cannot be read");
  const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
  try {
    session.Top().node = WithIccProfile(session.Top().node, {bytes, bytes + text.size()});
  } catch (const Error& e) {
    ThrowAbout(file, e);
  }
}

void WriteProfile(const Step& step, Session& session) {
  const std::string& file = step.arguments.Text("FILE");
  const std::vector<std::byte> profile = IccProfileOf(session.Top().node.spec());
  if (profile.empty()) throw DataError(file, "found no ICC profile in the image");
  if (session.options().dry_run) return;
  session.Later([file, profile, &session] {
    session.AddOutput(file, PendingOutput(file, profile, session.options().sync));
  });
}

Command ProfileRow(const std::string& name, Effect effect, const std::string& summary,
                   void (*run)(const Step&, Session&)) {
  Command c = Row(name, effect, 1, summary, run);
  c.info.arguments = {
      {.name = "FILE", .type = ParamType::kText, .default_value = "", .help = "an .icc file"}};
  return c;
}

}  // namespace

std::vector<Command> StackCommands() {
  std::vector<Command> rows;
  rows.push_back(Row("dup", Effect::kDup, 1, "Pushes the top image once more.",
                     [](const Step&, Session& session) { session.Push(Entry(session.Top())); }));
  rows.push_back(Row("swap", Effect::kSwap, 2, "Swaps the two top images.",
                     [](const Step&, Session& session) { std::swap(session.Top(0), session.Top(1)); }));
  rows.push_back(Row("pop", Effect::kPop, 1, "Drops the top image.",
                     [](const Step&, Session& session) { session.Pop(); }));
  rows.push_back(
      ProfileRow("iccread", Effect::kApply, "Gives the top image the ICC profile of a file.", ReadProfile));
  rows.back().info.help =
      "No sample changes. The image is then in the colour space that the profile describes where that is a "
      "known one (sRGB, Display P3), else in an unknown one; conversions drop the profile. As oiiotool "
      "--iccread.";
  rows.push_back(
      ProfileRow("iccwrite", Effect::kUse, "Writes the top image's ICC profile to a file.", WriteProfile));
  return rows;
}

}  // namespace tessera::cli
