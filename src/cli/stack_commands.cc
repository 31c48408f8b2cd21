// Commands on the image stack itself: --dup, --swap, --pop, --attrib.
#include <charconv>
#include <cstring>

#include "cli/session.h"

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

void SetAttribute(const Step& step, Session& session) {
  Attribute attribute =
      MakeAttribute(step.arguments.Text("NAME"), step.arguments.Text("VALUE"), step.arguments.Text("type"));
  std::vector<Attribute>& all = session.Top().attributes;
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
