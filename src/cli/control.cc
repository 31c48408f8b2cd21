// Blocks of a line and the commands that make them, as oiiotool has them.
#include "cli/control.h"

#include <OpenImageIO/strutil.h>

#include <algorithm>

#include "cli/expression.h"
#include "cli/session.h"

namespace tessera::cli {
namespace {

using ops::ParamInfo;
using ops::ParamType;

struct Kind {
  const char* begin;
  const char* end;
};
constexpr Kind kKinds[] = {{"if", "endif"}, {"while", "endwhile"}, {"for", "endfor"}};

const Kind* BeginOf(const std::string& name) {
  const auto it =
      std::find_if(std::begin(kKinds), std::end(kKinds), [&](const Kind& k) { return name == k.begin; });
  return it == std::end(kKinds) ? nullptr : it;
}
const Kind* EndOf(const std::string& name) {
  const auto it =
      std::find_if(std::begin(kKinds), std::end(kKinds), [&](const Kind& k) { return name == k.end; });
  return it == std::end(kKinds) ? nullptr : it;
}

void If(const Step& step, Session& session) {
  if (IsTrue(step.arguments.Text("VALUE"))) return;
  session.flow.next = session.blocks().Partner(session.at()) + 1;
}

void Else(const Step&, Session& session) { session.flow.next = session.blocks().Partner(session.at()) + 1; }

void Nothing(const Step&, Session&) {}

void EndLoop(const Step&, Session& session) { session.flow.next = session.blocks().Partner(session.at()); }

// END, or BEGIN,END, or BEGIN,END,STEP.
std::vector<double> RangeOf(const Step& step) {
  const std::string& text = step.arguments.Text("RANGE");
  std::vector<double> values;
  for (std::string_view rest = text; !rest.empty();) {
    const size_t comma = std::min(rest.find(','), rest.size());
    const std::string part = OIIO::Strutil::strip(std::string(rest.substr(0, comma)));
    if (!OIIO::Strutil::string_is_float(part)) values.clear(), rest = {};
    if (rest.empty()) break;
    values.push_back(OIIO::Strutil::stof(part));
    rest.remove_prefix(std::min(comma + 1, rest.size()));
  }
  if (values.size() == 1) values.insert(values.begin(), 0);
  if (values.size() == 2) values.push_back(1);
  if (values.size() != 3 || values[2] == 0)
    throw UsageError(
        step.written,
        "found the range \"" + text + "\", expected END or BEGIN,END or BEGIN,END,STEP, a step other than 0");
  return values;
}

void For(const Step& step, Session& session) {
  const std::vector<double> range = RangeOf(step);
  Flow& flow = session.flow;
  const auto under_way = flow.loops.find(session.at());
  const double value = under_way == flow.loops.end() ? range[0] : under_way->second + range[2];
  flow.variables[step.arguments.Text("VARIABLE")] = NumberOf(value);
  if (range[2] > 0 ? value < range[1] : value > range[1]) {
    flow.loops[session.at()] = value;
  } else {
    flow.loops.erase(session.at());
    flow.next = session.blocks().Partner(session.at()) + 1;
  }
}

void SetVariable(const Step& step, Session& session) {
  const std::string& name = step.arguments.Text("NAME");
  const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_';
  });
  if (!plain || std::isdigit(static_cast<unsigned char>(name[0])) != 0)
    throw UsageError(step.written,
                     "found the name \"" + name + "\", expected letters, digits and _, no digit first");
  session.flow.variables[name] = step.arguments.Text("VALUE");
}

Command Row(const std::string& name, const std::string& summary, std::vector<ParamInfo> arguments,
            void (*run)(const Step&, Session&), std::vector<std::string> lines) {
  Command c = RowOf("Control", Effect::kControl, name, 0, summary, std::move(arguments));
  c.any_text = true;
  c.run = run;
  c.lines = std::move(lines);
  return c;
}

Command Switch(const std::string& name, const std::string& summary,
               void (*set)(const ops::Arguments&, Options&), const std::string& line) {
  Command c = Row(name, summary, {}, nullptr, {line});
  c.effect = Effect::kOption;
  c.set = set;
  return c;
}

ParamInfo Text(const std::string& name, const std::string& help) {
  return {.name = name, .type = ParamType::kText, .default_value = "", .help = help};
}

constexpr char kTruth[] = "0, nothing, false, no and off are false, all else is true";

}  // namespace

Blocks::Blocks(const std::vector<Step>& steps) {
  std::vector<size_t> open, otherwise;  // the beginnings; their --else, or themselves
  for (size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].command->effect != Effect::kControl) continue;
    const std::string& name = steps[i].command->info.name;
    if (BeginOf(name) != nullptr) {
      open.push_back(i), otherwise.push_back(i);
      continue;
    }
    const Kind* const ends = EndOf(name);
    if (ends == nullptr && name != "else") continue;
    const std::string begin = ends != nullptr ? ends->begin : "if";
    const bool fits = !open.empty() && steps[open.back()].command->info.name == begin &&
                      (ends != nullptr || otherwise.back() == open.back());
    if (!fits) throw UsageError(steps[i].written, "found no --" + begin + " before it that it belongs to");
    partner_[otherwise.back()] = i;
    if (ends == nullptr) {
      otherwise.back() = i;
      continue;
    }
    partner_[i] = open.back();
    open.pop_back(), otherwise.pop_back();
  }
  if (!open.empty()) {
    const Step& first = steps[open.back()];
    throw UsageError(first.written,
                     std::string("found no --") + BeginOf(first.command->info.name)->end + " behind it");
  }
}

bool IsKnownAhead(const std::vector<Step>& steps) {
  return std::none_of(steps.begin(), steps.end(), [](const Step& s) {
    return !s.deferred.empty() || s.command->effect == Effect::kSplit ||
           s.command->effect == Effect::kControl;
  });
}

std::vector<Command> ControlCommands() {
  std::vector<Command> rows;
  rows.push_back(Row("set", "Sets a variable for expressions in braces.",
                     {Text("NAME", "letters, digits and _"), Text("VALUE", "a text or a number")},
                     SetVariable, {"in.exr --set k '{TOP.width/4}' --cshift '+{k}+0' -o out.exr"}));
  rows.back().info.modifiers = {
      Text("type", "taken as oiiotool has it; values are kept as they are written")};
  rows.push_back(Row("if", "Goes on with what follows where a value is true, else behind --else or --endif.",
                     {Text("VALUE", kTruth)}, If,
                     {"in.exr --if '{TOP.width > 100}' --resize 100x0 --endif -o out.exr"}));
  rows.push_back(Row("else", "What follows is for the value of --if being false.", {}, Else,
                     {"in.exr --if '{TOP.width > 100}' --flip --else --flop --endif -o out.exr"}));
  rows.push_back(Row("endif", "Ends --if.", {}, Nothing, {"in.exr --if 0 --flip --endif -o out.exr"}));
  rows.push_back(Row("while", "Repeats what follows for as long as a value is true.", {Text("VALUE", kTruth)},
                     If, {"in.exr --while '{TOP.width > 16}' --resize 50% --endwhile -o out.exr"}));
  rows.push_back(Row("endwhile", "Ends --while.", {}, EndLoop,
                     {"in.exr --while '{TOP.width > 16}' --resize 50% --endwhile -o out.exr"}));
  rows.push_back(Row("for", "Repeats what follows with a variable that counts.",
                     {Text("VARIABLE", "its name"),
                      Text("RANGE", "END, or BEGIN,END, or BEGIN,END,STEP; END is not reached")},
                     For, {"in.exr --for i 0,4 --addc '{i*0.1}' --endfor -o out.exr"}));
  rows.back().info.help =
      "BEGIN is 0 and STEP 1 where they are left out; with a STEP below 0 it counts down, which oiiotool does not.";
  rows.push_back(Row("endfor", "Ends --for.", {}, EndLoop, {"in.exr --for i 3 --flip --endfor -o out.exr"}));
  rows.push_back(Switch(
      "evaloff", "Braces in the words that follow are themselves.",
      [](const ops::Arguments&, Options& o) { o.evaluate = false; },
      "in.exr --evaloff --caption '{not a number}' -o out.exr"));
  rows.push_back(Switch(
      "evalon", "Braces in the words that follow hold expressions again.",
      [](const ops::Arguments&, Options& o) { o.evaluate = true; },
      "in.exr --evaloff --caption '{}' --evalon -o '{TOP.nchannels}.exr'"));
  rows.back().info.help = kExpressionHelp;
  return rows;
}

}  // namespace tessera::cli
