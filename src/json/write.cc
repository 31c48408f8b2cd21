// Graphs to JSON: every node once, inputs before what is made of them.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <unordered_map>

#include "graph/op.h"
#include "graph/origin.h"
#include "graph/source.h"
#include "json/format.h"
#include "ops/apply.h"
#include "tessera/error.h"
#include "tessera/graph_json.h"

namespace tessera {
namespace json {
namespace {

using graph::Origin;
using ops::ParamType;

Json NumberOf(double value) {
  constexpr double kWhole = 9007199254740992.0;  // 2^53
  if (std::abs(value) <= kWhole && value == std::trunc(value) && !(value == 0 && std::signbit(value)))
    return static_cast<int64_t>(value);
  return value;
}

Json NumbersOf(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double v : values) list.push_back(NumberOf(v));
  return list;
}

Json ValueOf(const ops::ParamInfo& param, const ops::Arguments::Value& value) {
  switch (param.type) {
    case ParamType::kNumber:
    case ParamType::kInteger:
      return NumberOf(value.numbers.at(0));
    case ParamType::kFlag:
      return value.numbers.at(0) != 0;
    case ParamType::kNumbers:
      return NumbersOf(value.numbers);
    case ParamType::kChoice:
      return value.numbers.empty() ? Json(value.text) : NumbersOf(value.numbers);
    case ParamType::kText:
      break;
  }
  return value.text;
}

Json ParametersOf(const Origin& origin) {
  const ops::OpInfo& op = ops::OpNamed(origin.name);
  const ops::Arguments arguments = ops::ArgumentsNamed(op, origin.values);
  Json parameters = Json::object();
  for (const auto* params : {&op.arguments, &op.modifiers}) {
    for (const ops::ParamInfo& p : *params) {
      const ops::Arguments::Value& value = arguments.values.at(p.name);
      if (value.given) parameters[p.name] = ValueOf(p, value);
    }
  }
  return parameters;
}

Json WindowOf(const Roi& r) { return Json::array({r.x0, r.y0, r.x1, r.y1}); }

void DescribeOutput(const ImageSpec& spec, Json& node) {
  node["window"] = WindowOf(spec.data_window);
  if (spec.display_window != spec.data_window) node["display"] = WindowOf(spec.display_window);
  if (spec.type != PixelType::kFloat) node["type"] = PixelTypeName(spec.type);
  const ImageSpec plain(1, 1, spec.channel_count());
  if (spec.channels == plain.channels && spec.alpha == plain.alpha) {
    node["channels"] = spec.channel_count();
  } else {
    node["channels"] = spec.channels;
    if (spec.alpha >= 0) node["alpha"] = spec.alpha;
  }
}

// A row of the registry leaves a node with its origin; what has none is pixels, or was made by a function.
bool IsPixels(const Node& node) {
  const Origin* const origin = graph::OriginOf(node);
  if (origin != nullptr) return origin->kind == Origin::Kind::kPixels;
  const graph::Op& op = *node.data()->op;
  return op.Kind() == graph::OpKind::kSource && static_cast<const graph::SourceOp&>(op).source().View();
}

class Writer {
 public:
  GraphJson Write(const Node& result) {
    CollectNames(result);
    const size_t last = Add(result);
    GraphJson graph;
    Json inputs = Json::array();
    for (const auto& [name, node] : inputs_) inputs.push_back(name);
    try {
      graph.text = "{\n \"tessera_graph\": " + std::to_string(kVersion) + ",\n \"inputs\": " + inputs.dump() +
                   ",\n \"nodes\": [\n";
      for (size_t k = 0; k < nodes_.size(); ++k)
        graph.text += "  " + nodes_[k].dump() + (k + 1 < nodes_.size() ? ",\n" : "\n");
      graph.text += " ],\n \"result\": " + std::to_string(last) + "\n}\n";
    } catch (const Json::exception&) {
      throw Error("graph", "a parameter or a name holds text that is no UTF-8, expected UTF-8");
    }
    graph.inputs = std::move(inputs_);
    return graph;
  }

 private:
  // What is open below a node; null where that is the end.
  static const std::vector<Node>* Below(const Node& node) {
    if (IsPixels(node)) return nullptr;
    const Origin* const origin = graph::OriginOf(node);
    return origin != nullptr && origin->kind == Origin::Kind::kOperation ? &origin->inputs : nullptr;
  }

  // Calls visit(node) for every node once, inputs first; a chain may be long, so there is no recursion.
  template <typename Visit>
  static void Each(const Node& result, const Visit& visit) {
    std::set<const graph::NodeData*> seen;
    std::vector<std::pair<Node, bool>> left = {{result, false}};
    while (!left.empty()) {
      const auto [node, ready] = left.back();
      left.pop_back();
      if (ready) {
        visit(node);
        continue;
      }
      if (!seen.insert(node.data()).second) continue;
      left.emplace_back(node, true);
      const std::vector<Node>* const below = Below(node);
      if (below == nullptr) continue;
      for (size_t k = below->size(); k-- > 0;) {
        if (!seen.contains((*below)[k].data())) left.emplace_back((*below)[k], false);
      }
    }
  }

  void CollectNames(const Node& result) {
    Each(result, [this](const Node& node) {
      const Origin* const origin = graph::OriginOf(node);
      if (!IsPixels(node) || origin == nullptr || origin->name.empty()) return;
      if (!names_.insert(origin->name).second)
        throw Error(origin->name, "is the name of two images of the graph, expected one");
    });
  }

  std::string FreeName() {
    for (int k = 1;; ++k) {
      std::string name = k == 1 ? "image" : "image" + std::to_string(k);
      if (names_.insert(name).second) return name;
    }
  }

  size_t Add(const Node& result) {
    Each(result, [this](const Node& node) {
      // A loop of Each may come to a node by two ways before it is written; it is visited once all the same.
      nodes_.push_back(Describe(node));
      index_[node.data()] = nodes_.size() - 1;
    });
    return index_.at(result.data());
  }

  Json Describe(const Node& node) {
    const Origin* const origin = graph::OriginOf(node);
    Json described;
    if (IsPixels(node)) {
      const std::string name = origin == nullptr || origin->name.empty() ? FreeName() : origin->name;
      inputs_.emplace_back(name, node);
      described["input"] = name;
      return described;
    }
    if (origin == nullptr) {
      const graph::Op& op = *node.data()->op;
      throw Error(op.Name(), "does not know what it was asked for (" + op.Describe() +
                                 "), expected an operation of the registry by its name, or a file");
    }
    if (origin->kind == Origin::Kind::kFile) {
      described["file"] = origin->name;
      for (const auto& [name, value] : origin->values)
        described[name] = name == "subimage" ? Json(std::stoi(value)) : Json(value);
      return described;
    }
    described["operation"] = origin->name;
    if (origin->output) DescribeOutput(*origin->output, described);
    Json parameters = ParametersOf(*origin);
    if (!parameters.empty()) described["parameters"] = std::move(parameters);
    if (!origin->inputs.empty()) {
      Json inputs = Json::array();
      for (const Node& input : origin->inputs) inputs.push_back(index_.at(input.data()));
      described["inputs"] = std::move(inputs);
    }
    return described;
  }

  std::vector<Json> nodes_;
  std::unordered_map<const graph::NodeData*, size_t> index_;
  std::set<std::string> names_;
  std::vector<std::pair<std::string, Node>> inputs_;
};

}  // namespace
}  // namespace json

GraphJson ToJson(const Node& result) {
  if (!result) throw Error("graph", "is empty, expected an image");
  return json::Writer().Write(result);
}

Node AsInput(const Node& image, const std::string& name) {
  if (name.empty() || name.size() > json::kLongestName)
    throw Error("input", "found a name of " + std::to_string(name.size()) + " bytes, expected 1 to " +
                             std::to_string(json::kLongestName));
  graph::Origin origin;
  const graph::Origin* const before = graph::OriginOf(image);
  // What is computed stays alive by what it was computed from.
  if (before != nullptr) origin.owner = before->owner, origin.inputs = before->inputs;
  origin.kind = graph::Origin::Kind::kPixels, origin.name = name;
  return graph::WithOrigin(image, std::move(origin));
}

Node Apply(const std::string& operation, const std::vector<Node>& images, const std::string& line) {
  const ops::OpInfo& op = ops::OpNamed(operation);
  if (op.generator) throw Error(operation, "is a generator, expected one that takes images");
  const ops::Arguments arguments = ops::ParseExample(op, line);
  const auto wanted = static_cast<size_t>(op.Operands(arguments));
  if (images.size() != wanted) {
    throw Error(operation,
                "found " + std::to_string(images.size()) + " images, expected " + std::to_string(wanted));
  }
  return ops::Apply(op, images, arguments, nullptr);
}

Node Generate(const std::string& operation, const ImageSpec& spec, const std::string& line) {
  const ops::OpInfo& op = ops::OpNamed(operation);
  if (!op.generator) throw Error(operation, "takes images, expected a generator");
  return ops::Apply(op, {}, ops::ParseExample(op, line), &spec);
}

}  // namespace tessera
