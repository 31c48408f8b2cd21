// Commands on the images of a file of several: --subimage, --sisplit, --siappend, --siappendall, --unmip.
#include <charconv>

#include "cli/metadata.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

using ops::ParamInfo;
using ops::ParamType;

// An image and its other parts, each by itself.
std::vector<Entry> Taken(Entry entry, const Options& options) {
  std::vector<Entry> all = TakeParts(entry, options);
  all.insert(all.begin(), std::move(entry));
  return all;
}

Entry Together(std::vector<Entry> all) {
  Entry result = std::move(all.front());
  result.parts.assign(std::make_move_iterator(all.begin() + 1), std::make_move_iterator(all.end()));
  return result;
}

std::string NameOf(const Entry& entry) {
  const std::string name = ItemText(entry, "oiio:subimagename");
  return name.empty() ? ItemText(entry, "name") : name;
}

size_t FindPart(const Step& step, const std::vector<Entry>& all) {
  const std::string& which = step.arguments.Text("WHICH");
  size_t index = 0;
  const auto [end, error] = std::from_chars(which.data(), which.data() + which.size(), index);
  const bool number = error == std::errc() && end == which.data() + which.size();
  if (number && index < all.size()) return index;
  std::string names;
  for (size_t k = 0; k < all.size(); ++k) {
    const std::string name = NameOf(all[k]);
    if (!number && name == which) return k;
    names += (k > 0 ? ", " : "") + std::to_string(k) + (name.empty() ? "" : " (" + name + ")");
  }
  throw DataError(WordsOf(step), "found no such image in " + all[0].name + ", which has " + names);
}

void ChoosePart(const Step& step, Session& session) {
  std::vector<Entry> all = Taken(session.Pop(), session.options());
  const size_t at = FindPart(step, all);
  if (!step.arguments.Flag("delete")) {
    session.Push(std::move(all[at]));
    return;
  }
  if (all.size() == 1)
    throw DataError(WordsOf(step),
                    "found one image alone in " + all[0].name + ", expected another that stays");
  all.erase(all.begin() + static_cast<ptrdiff_t>(at));
  session.Push(Together(std::move(all)));
}

void Split(const Step&, Session& session) {
  std::vector<Entry> all = Taken(session.Pop(), session.options());
  for (Entry& part : all) session.Push(std::move(part));
}

// The last `count` images, the lowest first.
void Append(int count, Session& session) {
  std::vector<std::vector<Entry>> operands;
  for (int k = 0; k < count; ++k) operands.push_back(Taken(session.Pop(), session.options()));
  std::vector<Entry> all;
  for (auto it = operands.rbegin(); it != operands.rend(); ++it)
    all.insert(all.end(), std::make_move_iterator(it->begin()), std::make_move_iterator(it->end()));
  session.Push(Together(std::move(all)));
}

Command Row(const std::string& name, Effect effect, int inputs, const std::string& summary,
            void (*run)(const Step&, Session&), std::vector<std::string> lines) {
  Command c;
  c.info.name = name;
  c.info.inputs = inputs;
  c.info.summary = summary;
  c.group = "Images of a file of several";
  c.effect = effect;
  c.run = run;
  c.lines = std::move(lines);
  return c;
}

}  // namespace

std::vector<Command> PartCommands() {
  std::vector<Command> rows;
  rows.push_back(
      Row("subimage", Effect::kApply, 1, "Keeps one image of the top file's several.", ChoosePart,
          {"in.exr --subimage 0 -o out.exr", "a.exr b.exr --siappend --subimage:delete=1 1 -o out.exr"}));
  rows.back().info.arguments = {
      {.name = "WHICH", .type = ParamType::kText, .default_value = "", .help = "index from 0, or name"}};
  rows.back().info.modifiers = {{.name = "delete",
                                 .type = ParamType::kFlag,
                                 .default_value = "0",
                                 .help = "takes it away and keeps the others"}};
  rows.push_back(Row("sisplit", Effect::kSplit, 1, "Pushes every image of the top file's several by itself.",
                     Split, {"in.exr --sisplit --siappendall -o out.exr"}));
  rows.push_back(Row("siappend", Effect::kApply, 2, "Makes the last images one file's several.",
                     [](const Step& step, Session& session) { Append(step.arguments.Integer("n"), session); },
                     {"a.exr b.exr --siappend -o out.exr", "a.exr b.exr c.exr --siappend:n=3 -o out.tif"}));
  rows.back().info.modifiers = {{.name = "n",
                                 .type = ParamType::kInteger,
                                 .default_value = "2",
                                 .help = "how many images",
                                 .min = 2,
                                 .max = 4096}};
  rows.back().info.operands = [](const ops::Arguments& a) { return a.Integer("n"); };
  rows.back().info.help =
      "Those that are several themselves bring all of theirs. EXR wants the same display window in all of them and a "
      "name each (--attrib oiio:subimagename); formats that hold one image get the first.";
  rows.push_back(Row("siappendall", Effect::kJoin, 1, "Makes all images on the stack one file's several.",
                     [](const Step&, Session& session) { Append(session.Depth(), session); },
                     {"a.exr b.exr c.exr --siappendall -o out.exr"}));
  rows.push_back(Row("unmip", Effect::kApply, 1, "Drops the levels of a MIP map but the first.",
                     [](const Step&, Session&) {}, {"in.exr --unmip -o out.exr"}));
  rows.back().info.help =
      "Nothing is to be done: of a file with levels the first alone is read, by every line. --mip makes levels.";
  return rows;
}

}  // namespace tessera::cli
