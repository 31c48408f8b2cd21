// Graphs as files: --save-graph, --load-graph, and `tessera run`, which is the latter in other words.
#include <algorithm>
#include <iterator>
#include <map>
#include <sstream>

#include "base/input_file.h"
#include "cli/arguments.h"
#include "cli/session.h"
#include "graph/origin.h"
#include "tessera/error_kind.h"
#include "tessera/graph_json.h"

namespace tessera::cli {
namespace {

using ops::ParamInfo;
using ops::ParamType;

void SaveGraph(const Step& step, Session& session) {
  const std::string& file = step.arguments.Text("FILE");
  GraphJson graph;
  try {
    graph = ToJson(session.Top().node);
  } catch (const Error& e) {
    throw UsageError(WordsOf(step), e.subject() + " " + e.reason());
  }
  for (const auto& [name, image] : graph.inputs) {
    const graph::Origin* const origin = graph::OriginOf(image);
    if (origin == nullptr || origin->name.empty())
      throw UsageError(WordsOf(step),
                       "found pixels that the line drew or computed on the way, expected "
                       "operations of the registry on files");
  }
  if (session.options().dry_run) return;
  session.Later([file, text = std::move(graph.text), &session] {
    const auto* const bytes = reinterpret_cast<const std::byte*>(text.data());
    session.AddOutput(file, PendingOutput(file, {bytes, bytes + text.size()}, session.options().sync));
  });
}

std::vector<std::string> NamesOf(const std::string& text) {
  std::vector<std::string> names;
  std::istringstream words(text);
  for (std::string name; std::getline(words, name, ',');) names.push_back(name);
  return names;
}

std::string Listed(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  return all.empty() ? "none" : all;
}

void LoadGraph(const Step& step, Session& session) {
  const std::string& file = step.arguments.Text("FILE");
  constexpr int64_t kMostBytes = int64_t{64} << 20;
  base::InputFile stream(file, "a graph", kMostBytes);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) throw SystemError(file, "cannot be read");
  try {
    std::map<std::string, Node> images;
    const std::vector<std::string> names = GraphInputs(text);
    for (const std::string& name : NamesOf(step.arguments.Text("inputs"))) {
      if (std::find(names.begin(), names.end(), name) == names.end())
        throw DataError(file, "has no open input \"" + name + "\", expected " + Listed(names));
    }
    for (const std::string& name : names) {
      const auto label = session.labels.find(name);
      if (label == session.labels.end()) {
        throw DataError(file, "has the open input \"" + name +
                                  "\", expected an image of that name: --label " + name +
                                  ", or `tessera run` with -i " + name + "=FILE");
      }
      images[name] = label->second.node;
    }
    session.inputs.push_back(file);
    session.Push({FromJson(text, images), file, {}}, WordsOf(step));
  } catch (const Error& e) {
    if (e.subject() == file) throw;
    // What is wrong with a graph is the file's, not the line's.
    if (KindOf(e) == ErrorKind::kUsage) throw DataError(file, e.subject() + ": " + e.reason());
    ThrowAbout(file, DataError(file, e.subject() + ": " + e.reason()));
  }
}

ParamInfo GraphFile(const std::string& help) {
  return {.name = "FILE", .type = ParamType::kText, .default_value = "", .help = help};
}

}  // namespace

std::vector<Command> GraphCommands() {
  std::vector<Command> rows;
  rows.push_back(RowOf("Graphs", Effect::kUse, "save-graph", 1,
                       "Writes what the top image is made of as a graph in JSON.",
                       {GraphFile("a .json file")}));
  rows.back().info.help =
      "Operations by their names, with the values that were written; files by theirs. Nothing is computed. "
      "--load-graph and `tessera run`, the C and C++ interfaces and Python read it. Metadata that the line sets are not in it, and what is no "
      "operation of the registry (drawing, --trim of pixels, --kernel) is refused.";
  rows.back().lines = {"in.exr --saturate 1.2 --blur:sigma=3 --save-graph look.json"};
  rows.back().run = SaveGraph;
  rows.push_back(RowOf("Graphs", Effect::kPush, "load-graph", 0, "Pushes the image of a graph in JSON.",
                       {GraphFile("a file that --save-graph, Python or a program wrote")},
                       {{.name = "inputs",
                         .type = ParamType::kText,
                         .default_value = "",
                         .help = "names that must be among its open inputs, comma-separated"}}));
  rows.back().info.help =
      "Its open inputs are the images with those labels. `tessera run look.json -i plate=a.exr -o out.exr` is "
      "short for a.exr --label plate --pop --load-graph look.json -o out.exr. A graph holds no code: operations "
      "and files alone, which are read as if the line named them.";
  rows.back().lines = {"in.exr --label plate --pop --load-graph look.json -o out.exr"};
  rows.back().run = LoadGraph;
  return rows;
}

std::vector<std::string> WithoutRun(const std::vector<std::string>& words) {
  if (words.empty() || words[0] != "run") return words;
  if (words.size() < 2) throw UsageError("run", "found no graph, expected a file that --save-graph wrote");
  std::vector<std::string> line;
  std::string names;
  size_t k = 2;
  while (k < words.size() && (words[k] == "-i" || words[k] == "--i")) {
    const std::string word = k + 1 < words.size() ? words[k + 1] : "";
    const size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == word.size())
      throw UsageError("run", "found -i \"" + word + "\", expected NAME=FILE");
    names += (names.empty() ? "" : ",") + word.substr(0, equals);
    line.insert(line.end(), {"-i", word.substr(equals + 1), "--label", word.substr(0, equals), "--pop"});
    k += 2;
  }
  line.insert(line.end(), {"--load-graph" + (names.empty() ? "" : ":inputs=\"" + names + "\""), words[1]});
  line.insert(line.end(), words.begin() + static_cast<ptrdiff_t>(k), words.end());
  return line;
}

}  // namespace tessera::cli
