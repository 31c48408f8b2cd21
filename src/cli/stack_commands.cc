// Commands on the image stack itself: --dup, --swap, --pop, --attrib.
#include <charconv>
#include <cstring>
#include <fstream>
#include <iterator>

#include "base/input_file.h"
#include "cli/session.h"
#include "tessera/color_state.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arrangement.h"

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

template <typename T>
bool Holds(const std::string& text, Attribute& attribute) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return false;
  attribute.bytes.resize(sizeof value);
  std::memcpy(attribute.bytes.data(), &value, sizeof value);
  return true;
}

// An attribute of the asked type; without one, an int or a float where the text is one, else a string.
Attribute MakeAttribute(const std::string& name, const std::string& text, const std::string& type) {
  Attribute attribute{name, "string", {}, {}};
  if ((type.empty() || type == "int") && Holds<int>(text, attribute)) {
    attribute.type = "int";
  } else if ((type.empty() || type == "float") && Holds<float>(text, attribute)) {
    attribute.type = "float";
  } else if (type.empty() || type == "string") {
    attribute.strings = {text};
  } else {
    throw UsageError("--attrib " + name,
                     "found \"" + text + "\", expected " + (type == "int" ? "an int" : "a float"));
  }
  return attribute;
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

void SetAttribute(const Step& step, Session& session) {
  Attribute attribute =
      MakeAttribute(step.arguments.Text("NAME"), step.arguments.Text("VALUE"), step.arguments.Text("type"));
  // What an image carries as its state is no item beside it.
  Entry& top = session.Top();
  const ColorState color = ColorStateOf(top.node.spec());
  if (attribute.name == "oiio:ColorSpace") {
    top.node = WithColorState(top.node, {step.arguments.Text("VALUE"), color.premultiplied});
    return;
  }
  if (attribute.name == "oiio:UnassociatedAlpha") {
    top.node = WithColorState(top.node, {color.space, step.arguments.Text("VALUE") == "0"});
    return;
  }
  // Nor is what --reorient goes by.
  int orientation = 0;
  if (attribute.name == "Orientation" && attribute.type == "int")
    std::memcpy(&orientation, attribute.bytes.data(), sizeof orientation);
  if (orientation >= 1 && orientation <= 8) {
    top.node = WithOrientation(top.node, orientation);
    return;
  }
  std::vector<Attribute>& all = top.attributes;
  std::erase_if(all, [&](const Attribute& a) { return a.name == attribute.name; });
  all.push_back(std::move(attribute));
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
  rows.push_back(Row("attrib", Effect::kApply, 1, "Sets a metadata item of the top image.", SetAttribute));
  rows.back().info.arguments = {
      {.name = "NAME", .type = ParamType::kText, .default_value = "", .help = "the item's name"},
      {.name = "VALUE", .type = ParamType::kText, .default_value = "", .help = "its value"}};
  rows.back().info.modifiers = {{.name = "type",
                                 .type = ParamType::kChoice,
                                 .default_value = "",
                                 .help = "how the value is stored; by its looks when left out",
                                 .choices = {"int", "float", "string"}}};
  return rows;
}

}  // namespace tessera::cli
