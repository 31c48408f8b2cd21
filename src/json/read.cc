// Graphs from JSON, by whomever it was written: everything is looked at before it is used, and whatever is
// not part of the format is refused.
#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "base/number_text.h"
#include "base/policy.h"
#include "json/format.h"
#include "ops/apply.h"
#include "tessera/error_kind.h"
#include "tessera/graph_json.h"
#include "tessera/io.h"

namespace tessera {
namespace json {
namespace {

using ops::ParamType;

[[noreturn]] void Refuse(const std::string& subject, const std::string& reason) {
  throw DataError(subject, reason);
}

std::string Shown(const Json& value) {
  constexpr size_t kLongest = 40;
  const std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  return text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
}

void RequireKeys(const std::string& subject, const Json& object, std::initializer_list<const char*> known) {
  std::vector<std::string> names(known.begin(), known.end());
  for (const auto& [key, value] : object.items()) {
    if (std::find(names.begin(), names.end(), key) != names.end()) continue;
    std::string all;
    for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
    Refuse(subject, "found " + Shown(Json(key)) + ", expected " + all);
  }
}

// A whole number in [least, most].
int64_t WholeOf(const std::string& subject, const std::string& key, const Json& value, int64_t least,
                int64_t most) {
  // What is above the range of signed integers is unsigned, and of no use here.
  if (value.is_number_integer() && !(value.is_number_unsigned() && value.get<uint64_t>() > INT64_MAX)) {
    const auto number = value.get<int64_t>();
    if (number >= least && number <= most) return number;
  }
  Refuse(subject, "found " + Shown(value) + " for " + key + ", expected a whole number from " +
                      std::to_string(least) + " to " + std::to_string(most));
}

std::string TextOf(const std::string& subject, const std::string& key, const Json& value) {
  if (!value.is_string()) Refuse(subject, "found " + Shown(value) + " for " + key + ", expected text");
  auto text = value.get<std::string>();
  if (text.find('\0') != std::string::npos)
    Refuse(subject, "found a zero byte in " + key + ", expected text without");
  return text;
}

const Json& ListOf(const std::string& subject, const std::string& key, const Json& value) {
  if (!value.is_array()) Refuse(subject, "found " + Shown(value) + " for " + key + ", expected a list");
  return value;
}

std::string NumberIn(const std::string& subject, const Json& value) {
  if (value.is_number_unsigned()) return std::to_string(value.get<uint64_t>());
  if (value.is_number_integer()) return std::to_string(value.get<int64_t>());
  if (value.is_number_float()) return base::NumberText(value.get<double>());
  Refuse(subject, "found " + Shown(value) + ", expected a number");
}

std::string NumbersIn(const std::string& subject, const Json& value) {
  if (!value.is_array()) return NumberIn(subject, value);
  std::string text;
  for (const Json& v : value) text += (text.empty() ? "" : ",") + NumberIn(subject, v);
  return text;
}

// The text that the registry's parser reads.
std::string ParameterText(const std::string& subject, const ops::ParamInfo& param, const Json& value) {
  switch (param.type) {
    case ParamType::kNumber:
      return NumberIn(subject, value);
    case ParamType::kInteger:
      if (!value.is_number_integer()) Refuse(subject, "found " + Shown(value) + ", expected a whole number");
      return NumberIn(subject, value);
    case ParamType::kFlag:
      if (!value.is_boolean()) Refuse(subject, "found " + Shown(value) + ", expected true or false");
      return value.get<bool>() ? "1" : "0";
    case ParamType::kNumbers:
      return NumbersIn(subject, value);
    case ParamType::kChoice:
      if (param.numbers_too && !value.is_string()) return NumbersIn(subject, value);
      break;
    case ParamType::kText:
      break;
  }
  return TextOf(subject, param.name, value);
}

const ops::ParamInfo& ParameterNamed(const std::string& subject, const ops::OpInfo& op,
                                     const std::string& name) {
  std::vector<std::string> known;
  for (const auto* params : {&op.arguments, &op.modifiers}) {
    for (const ops::ParamInfo& p : *params) {
      if (p.name == name) return p;
      known.push_back(p.name);
    }
  }
  const std::string near = ops::Nearest(name, known);
  Refuse(subject,
         "found no parameter " + Shown(Json(name)) + (near.empty() ? "" : "; did you mean " + near + "?"));
}

Roi WindowOf(const std::string& subject, const std::string& key, const Json& value) {
  constexpr int64_t kFarthest = 1 << 30;
  if (ListOf(subject, key, value).size() != 4)
    Refuse(subject, "found " + Shown(value) + " for " + key + ", expected x0, y0, x1, y1");
  int corners[4];
  for (size_t k = 0; k < 4; ++k)
    corners[k] = static_cast<int>(WholeOf(subject, key, value[k], -kFarthest, kFarthest));
  const Roi roi{corners[0], corners[1], corners[2], corners[3]};
  if (roi.empty())
    Refuse(subject, "found no pixel in " + key + " " + Shown(value) + ", expected at least one");
  return roi;
}

PixelType TypeOf(const std::string& subject, const Json& value) {
  const std::string name = TextOf(subject, "type", value);
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    if (name == PixelTypeName(type)) return type;
  }
  Refuse(subject, "found " + Shown(value) + " for type, expected uint8, uint16, half or float");
}

void NameChannels(const std::string& subject, const Json& node, ImageSpec& spec) {
  const Json& channels = node["channels"];
  std::set<std::string> names;
  for (size_t k = 0; k < channels.size(); ++k) {
    spec.channels[k] = TextOf(subject, "channels", channels[k]);
    if (spec.channels[k].empty() || !names.insert(spec.channels[k]).second)
      Refuse(subject, "found " + Shown(channels[k]) + " among channels, expected names that differ");
  }
  spec.alpha = -1;
  if (node.contains("alpha"))
    spec.alpha = static_cast<int>(WholeOf(subject, "alpha", node["alpha"], 0, spec.channel_count() - 1));
}

ImageSpec OutputOf(const std::string& subject, const Json& node) {
  if (!node.contains("window")) Refuse(subject, "found no window, expected that of the pixels to make");
  if (!node.contains("channels")) Refuse(subject, "found no channels, expected their number or names");
  const Roi window = WindowOf(subject, "window", node["window"]);
  const Json& channels = node["channels"];
  constexpr int64_t kMostChannels = 1024;
  const int64_t count =
      WholeOf(subject, "channels", channels.is_array() ? Json(channels.size()) : channels, 1, kMostChannels);
  ImageSpec spec(window.width(), window.height(), static_cast<int>(count));
  spec.data_window = spec.display_window = window;
  if (node.contains("display")) spec.display_window = WindowOf(subject, "display", node["display"]);
  if (node.contains("type")) spec.type = TypeOf(subject, node["type"]);
  if (channels.is_array()) {
    NameChannels(subject, node, spec);
  } else if (node.contains("alpha")) {
    Refuse(subject, "found alpha without names of channels, expected both");
  }
  return spec;
}

class Reader {
 public:
  explicit Reader(const std::string& text) {
    if (text.size() > kMostBytes) {
      Refuse("graph", "found " + std::to_string(text.size()) + " bytes, expected at most " +
                          std::to_string(kMostBytes));
    }
    try {
      // Of a name that is there twice the second would be taken without a word.
      std::vector<std::set<std::string>> keys;
      const auto once = [&keys](int, Json::parse_event_t event, Json& parsed) {
        if (event == Json::parse_event_t::object_start) keys.emplace_back();
        if (event == Json::parse_event_t::object_end) keys.pop_back();
        if (event == Json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
          Refuse("graph", "found " + Shown(parsed) + " twice in one object, expected it once");
        return true;
      };
      graph_ = Json::parse(text, once);
    } catch (const Json::exception& e) {
      std::string what = e.what();
      what.erase(0, what.find(']') + 2);  // the library's own number of the error
      for (char& c : what) c = static_cast<unsigned char>(c) < ' ' ? ' ' : c;
      Refuse("graph", "is no JSON: " + what.substr(0, 200));
    }
    if (!graph_.is_object()) Refuse("graph", "found " + Shown(graph_) + ", expected an object");
    if (!graph_.contains("tessera_graph"))
      Refuse("graph", "found no tessera_graph, expected the version of a graph");
    WholeOf("graph", "tessera_graph", graph_["tessera_graph"], kVersion, kVersion);
    RequireKeys("graph", graph_, {"tessera_graph", "inputs", "nodes", "result"});
    for (const char* key : {"nodes", "result"}) {
      if (!graph_.contains(key)) Refuse("graph", std::string("found no ") + key + ", expected them");
    }
    ReadInputs();
    const Json& nodes = ListOf("graph", "nodes", graph_["nodes"]);
    if (nodes.empty() || nodes.size() > kMostNodes) {
      Refuse("graph",
             "found " + std::to_string(nodes.size()) + " nodes, expected 1 to " + std::to_string(kMostNodes));
    }
  }

  const std::vector<std::string>& inputs() const { return inputs_; }

  Node Build(const std::map<std::string, Node>& images) {
    for (const auto& [name, image] : images) {
      if (std::find(inputs_.begin(), inputs_.end(), name) == inputs_.end())
        throw Error(name, "is no open input of the graph, expected " + Names());
    }
    for (const std::string& name : inputs_) {
      const auto image = images.find(name);
      if (image == images.end() || !image->second)
        throw Error(name, "is an open input of the graph, expected an image for it");
      opened_.emplace(name, AsInput(image->second, name));
    }
    const Json& nodes = graph_["nodes"];
    const auto last = static_cast<size_t>(
        WholeOf("graph", "result", graph_["result"], 0, static_cast<int64_t>(nodes.size()) - 1));
    for (size_t k = 0; k < nodes.size(); ++k) {
      built_.push_back(BuildOne(k, nodes[k]));
      const ImageSpec& spec = built_[k].spec();
      const Roi& w = spec.data_window;
      base::RequireAllowed("node " + std::to_string(k), {int64_t{w.x1} - w.x0, int64_t{w.y1} - w.y0, 1},
                           spec.channel_count());
    }
    return built_[last];
  }

 private:
  void ReadInputs() {
    if (!graph_.contains("inputs")) return;
    for (const Json& name : ListOf("graph", "inputs", graph_["inputs"])) {
      const std::string text = TextOf("graph", "inputs", name);
      if (text.empty() || text.size() > kLongestName ||
          std::find(inputs_.begin(), inputs_.end(), text) != inputs_.end()) {
        Refuse("graph", "found " + Shown(name) + " among inputs, expected names that differ");
      }
      inputs_.push_back(text);
      if (inputs_.size() > kMostNodes) Refuse("graph", "found more inputs than nodes");
    }
  }

  std::string Names() const {
    std::string all;
    for (const std::string& name : inputs_) all += (all.empty() ? "" : ", ") + name;
    return all.empty() ? "none" : all;
  }

  Node BuildOne(size_t k, const Json& node) const {
    const std::string subject = "node " + std::to_string(k);
    if (!node.is_object()) Refuse(subject, "found " + Shown(node) + ", expected an object");
    if (node.contains("input")) {
      RequireKeys(subject, node, {"input"});
      const std::string name = TextOf(subject, "input", node["input"]);
      if (std::find(inputs_.begin(), inputs_.end(), name) == inputs_.end())
        Refuse(subject,
               "found the input " + Shown(node["input"]) + ", expected one of the graph's: " + Names());
      return opened_.at(name);
    }
    if (node.contains("file")) return BuildFile(subject, node);
    if (!node.contains("operation"))
      Refuse(subject, "found " + Shown(node) + ", expected an operation, a file or an input");
    return BuildOperation(subject, k, node);
  }

  static Node BuildFile(const std::string& subject, const Json& node) {
    RequireKeys(subject, node, {"file", "subimage", "part"});
    ReadOptions options;
    if (node.contains("subimage"))
      options.subimage = static_cast<int>(
          WholeOf(subject, "subimage", node["subimage"], 0, std::numeric_limits<int>::max()));
    if (node.contains("part")) options.part = TextOf(subject, "part", node["part"]);
    return Read(TextOf(subject, "file", node["file"]), options);
  }

  Node BuildOperation(const std::string& at, size_t k, const Json& node) const {
    RequireKeys(at, node,
                {"operation", "parameters", "inputs", "window", "display", "channels", "alpha", "type"});
    const std::string name = TextOf(at, "operation", node["operation"]);
    const std::string subject = at + " (" + name.substr(0, kLongestName) + ")";
    try {
      const ops::OpInfo& op = ops::OpNamed(name);
      std::vector<std::pair<std::string, std::string>> values;
      if (node.contains("parameters")) {
        const Json& parameters = node["parameters"];
        if (!parameters.is_object())
          Refuse(subject, "found " + Shown(parameters) + " for parameters, expected an object");
        for (const auto& [key, value] : parameters.items()) {
          const ops::ParamInfo& param = ParameterNamed(subject, op, key);
          values.emplace_back(key, ParameterText(subject + " " + key, param, value));
        }
      }
      const ops::Arguments arguments = ops::ArgumentsNamed(op, values);
      const std::vector<Node> inputs = InputsOf(subject, k, node);
      const auto wanted = static_cast<size_t>(op.generator ? 0 : op.Operands(arguments));
      if (inputs.size() != wanted) {
        Refuse(subject,
               "found " + std::to_string(inputs.size()) + " inputs, expected " + std::to_string(wanted));
      }
      if (op.generator) {
        const ImageSpec spec = OutputOf(subject, node);
        return ops::Apply(op, {}, arguments, &spec);
      }
      for (const char* key : {"window", "display", "channels", "alpha", "type"}) {
        if (node.contains(key))
          Refuse(subject, std::string("found ") + key + ", expected it for a generator alone");
      }
      return ops::Apply(op, inputs, arguments, nullptr);
    } catch (const Error& e) {
      if (e.subject().compare(0, at.size(), at) == 0) throw;
      // What is wrong with a graph is wrong with data, whoever finds it.
      if (KindOf(e) == ErrorKind::kUsage) Refuse(at + " (" + e.subject() + ")", e.reason());
      ThrowAbout(at + " (" + e.subject() + ")", e);
    }
  }

  std::vector<Node> InputsOf(const std::string& subject, size_t k, const Json& node) const {
    std::vector<Node> inputs;
    if (!node.contains("inputs")) return inputs;
    for (const Json& input : ListOf(subject, "inputs", node["inputs"])) {
      if (k == 0) Refuse(subject, "found inputs of the first node, expected none before it");
      inputs.push_back(
          built_[static_cast<size_t>(WholeOf(subject, "inputs", input, 0, static_cast<int64_t>(k) - 1))]);
      if (inputs.size() > kMostNodes) Refuse(subject, "found too many inputs");
    }
    return inputs;
  }

  Json graph_;
  std::vector<std::string> inputs_;
  std::map<std::string, Node> opened_;  // once each, however many nodes are of one
  std::vector<Node> built_;
};

}  // namespace
}  // namespace json

std::vector<std::string> GraphInputs(const std::string& json) { return json::Reader(json).inputs(); }

Node FromJson(const std::string& json, const std::map<std::string, Node>& images) {
  return json::Reader(json).Build(images);
}

}  // namespace tessera
