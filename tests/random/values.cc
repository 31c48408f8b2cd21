// How values are drawn: within the declared ranges, mostly near what is sane, and cheap.
#include "random/values.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include "tessera/ops/filter.h"

namespace tessera::random {
namespace {

using ops::OpInfo;
using ops::ParamInfo;
using ops::ParamType;

std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    if (end > begin) parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::string NumberWord(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g", v);
  return text;
}

// What makes a case take long is kept small; the cost of the rest does not depend on a parameter.
struct Cap {
  const char* op;  // null: every row
  const char* param;
  double low, high;
};
constexpr Cap kCaps[] = {
    {nullptr, "octaves", 0, 5},
    {nullptr, "samples", 1, 2},
    {nullptr, "bake", 0, 6},
    {nullptr, "pcf", 1, 4},
    {nullptr, "seed", 0, 100000},
    {nullptr, "bits", 0, 32},
    {nullptr, "slices", 1, 4},
    {nullptr, "n", 1, 4},
    {nullptr, "N", 1, 5},
    {"lic", "length", 0, 8},
    {"lic", "step", 0.25, 4},
    {"lic", "spot", 1, 4},
    {"lic", "animate", 0, 8},
    {"lic", "frame", 1, 8},
    {"lic", "gain", 0, 2},
    {"lic", "waves", 0, 6},
    {"halo", "radius", 0, 7},
    {"dof", "max", 0, 6},
    {"dof", "aperture", 0, 6},
    {"blur", "sigma", 0, 12},
    {"unsharp", "width", 1, 9},
    {"shiftaccum", "width", 1, 5},
    {"shapedspots", "freq", 1, 20},
    {"solid", "freq", 0, 30},
    {"noiseat", "channels", 1, 6},
    {"layerfog", "table", 0, 12},
    {"envmap", "table", -1, 8},
    {"envmap", "gloss", 0, 60},
    {"phong", "table", 0, 300},
    {"puffs", "interval", 0.05, 2},
    {"puffs", "life", 0.05, 2},
    {"puffs", "time", 0, 4},
    {"puffs", "radius", 0.5, 20},
    {"puffs", "growth", 0, 30},
    {"airbrush", "spacing", 0.5, 8},
    {"paint", "path", -20, 90},
    {"paint", "spacing", 0.05, 4},
    {"paint", "size", 0, 60},
    {"paint", "jitter", 0, 1},
    {"paint", "drift", -60, 60},
    {"paint", "time", 0, 3},
    {"paint", "life", 0.05, 3},
    {"airbrush", "radius", 0.5, 30},
    {"airbrush", "stroke", -20, 90},
    {"lightpoints", "points", -5, 60},
    {"lightpoints", "attenuation", 0, 2},
    {"zoom", "X,Y", -3, 3},
    {"shift", "X,Y", -90, 90},
    {"volume", "step", 0, 0.3},
    {"volume", "dims", 6, 16},
    {"volume", "zoom", 0.5, 3},
    {"volume", "freq", 0, 12},
    {"volume", "spacing", 0.5, 2},
    {"volume", "range", 0, 2},
    {"volume", "memory", 0, 0.02},
    {"volume", "shadowstep", 0, 0.3},
    {"volume", "shadowsize", 0, 12},
    {"invert", "chbegin", 0, 6},
    {"invert", "chend", 0, 8},
    {nullptr, "channel", 0, 3},
    {nullptr, "chan_s", 0, 3},
    {nullptr, "chan_t", 0, 3},
    {nullptr, "mask", -1, 3},
    {nullptr, "axes", 0, 3},
    {"stencil", "mask", 0, 255},
    {nullptr, "anchor", 0, 4},
    {nullptr, "kernelsize", 1, 7},
};

const Cap* CapOf(const OpInfo& op, const ParamInfo& param) {
  const Cap* best = nullptr;
  for (const Cap& cap : kCaps) {
    if (param.name != cap.param || (cap.op != nullptr && op.name != cap.op)) continue;
    if (best == nullptr || cap.op != nullptr) best = &cap;
  }
  return best;
}

void Narrow(const OpInfo& op, const ParamInfo& param, double& low, double& high) {
  const Cap* const best = CapOf(op, param);
  if (best == nullptr) return;
  low = std::max(low, best->low), high = std::min(high, best->high);
}

double Number(Draw& draw, const OpInfo& op, const ParamInfo& param) {
  double low = param.min, high = param.max;
  Narrow(op, param, low, high);
  const bool whole = param.type == ParamType::kInteger;
  double v = 0;
  if (high - low <= 1000 && draw.Chance(0.6)) {
    v = whole ? std::floor(low + draw.Unit() * (high - low + 1)) : draw.Real(low, high);
    if (high - low > 60 && draw.Chance(0.5)) v = low + (v - low) / 20;
  } else if (const double d = std::atof(param.default_value.c_str()); d != 0 && draw.Chance(0.4)) {
    v = d * draw.Of({-1.0, 0.5, 1.0, 1.3, 2.0, 4.0});
  } else {
    switch (draw.Weighted({30, 30, 20, 16, 4})) {
      case 0:
        v = draw.Of({0.0, 1.0, -1.0, 0.5, 2.0, 0.25, 3.0});
        break;
      case 1:
        v = draw.Real(-2, 2);
        break;
      case 2:
        v = draw.Real(0, 1);
        break;
      case 3:
        v = draw.Real(0, 12);
        break;
      default:
        v = draw.Of({1e-6, 1e4, -1e4, 1e-30, 1e10, low, high});
        if (std::fabs(v) > 1e30) v = 1e30;
    }
  }
  v = std::clamp(v, low, high);
  return whole ? std::floor(v) : v;
}

int Count(Draw& draw, const ParamInfo& param, const Surroundings& around) {
  if (!param.counts.empty()) {
    return param
        .counts[static_cast<size_t>(draw.Below(std::min<int>(4, static_cast<int>(param.counts.size()))))];
  }
  const int most = std::min(param.max_count, param.min_count + 5);
  if (param.max_count >= around.channels && draw.Chance(0.6)) {
    return std::max(param.min_count, draw.Of({1, around.channels}));
  }
  return draw.Between(param.min_count, most);
}

std::string Numbers(Draw& draw, const OpInfo& op, const ParamInfo& param, const Surroundings& around) {
  const int count = Count(draw, param, around);
  // Matrices: something near the identity.
  const int side = count == 9 ? 3 : count == 16 || count == 12 || count == 20 ? 4 : 0;
  std::string text;
  for (int i = 0; i < count; ++i) {
    double v = Number(draw, op, param);
    if (side > 0) v = (i % (side + 1) == 0 ? 1 : 0) + (draw.Chance(0.5) ? draw.Real(-0.4, 0.4) : 0.0);
    // The perspective of a warp is felt within hundreds of pixels.
    if (op.name == "warp" && (i == 2 || i == 5)) v /= 1000;
    if (op.name == "warp" && i == 8) v = 1;
    text += (i > 0 ? "," : "") + NumberWord(v);
  }
  return text;
}

// Whether the conditions of ParamInfo::only_with hold for what is written.
bool MayStand(const OpInfo& op, const ParamInfo& param, const Words& words) {
  const auto written = [&](const std::string& name) -> const std::string* {
    for (size_t i = 0; i < words.positional.size(); ++i) {
      if (op.arguments[i].name == name) return &words.positional[i];
    }
    for (const auto& [key, value] : words.modifiers) {
      if (key == name) return &value;
    }
    return nullptr;
  };
  for (std::string condition : Split(param.only_with, ' ')) {
    const bool holds = condition[0] != '!';
    if (!holds) condition.erase(0, 1);
    const size_t equals = std::min(condition.find('='), condition.size());
    const std::string name = condition.substr(0, equals);
    const std::string* const value = written(name);
    bool now = value != nullptr && *value != "0";
    if (equals < condition.size()) {
      std::string text = value != nullptr ? *value : "";
      for (const ParamInfo& p : op.modifiers) {
        if (value == nullptr && p.name == name) text = p.default_value;
      }
      const std::vector<std::string> values = Split(condition.substr(equals + 1), '|');
      now = std::find(values.begin(), values.end(), text) != values.end();
    }
    if (now != holds) return false;
  }
  return true;
}

constexpr char kConfig[] = R"(ocio_profile_version: 2
search_path: .
strictparsing: true
roles: {default: lin, scene_linear: lin}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
looks:
  - !<Look> {name: warm, process_space: lin, transform: !<CDLTransform> {slope: [1.2, 1, 0.8], offset: [0.01, 0, -0.01], power: [1.1, 1, 0.9], sat: 1.15}}
displays:
  monitor:
    - !<View> {name: film, colorspace: video, looks: warm}
    - !<View> {name: plain, colorspace: video}
colorspaces:
  - !<ColorSpace> {name: lin}
  - !<ColorSpace> {name: video, from_scene_reference: !<ExponentWithLinearTransform> {gamma: [2.4, 2.4, 2.4, 1], offset: [0.055, 0.055, 0.055, 0], direction: inverse}}
  - !<ColorSpace> {name: mixed, from_scene_reference: !<MatrixTransform> {matrix: [0.8, 0.15, 0.05, 0, 0.1, 0.85, 0.05, 0, 0, 0.1, 0.9, 0, 0, 0, 0, 1]}}
)";

void WriteText(const std::string& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

}  // namespace

Words WordsOf(const OpInfo& op, const std::string& example) {
  Words words;
  for (const std::string& word : Split(example, ' ')) {
    const size_t equals = word.find('=');
    const bool is_modifier = equals != std::string::npos &&
                             std::any_of(op.modifiers.begin(), op.modifiers.end(), [&](const ParamInfo& p) {
                               return p.name == word.substr(0, equals);
                             });
    if (words.positional.size() < op.arguments.size() && words.modifiers.empty() && !is_modifier) {
      words.positional.push_back(word);
    } else {
      words.modifiers.emplace_back(word.substr(0, equals),
                                   equals == std::string::npos ? "" : word.substr(equals + 1));
    }
  }
  return words;
}

ops::Arguments Parsed(const OpInfo& op, const Words& words) {
  return ops::ParseArguments(op, words.positional, words.modifiers);
}

bool IsCheap(const OpInfo& op, const ops::Arguments& arguments) {
  const auto cheap = [&](const ParamInfo& param) {
    const Cap* const cap = CapOf(op, param);
    const auto value = arguments.values.find(param.name);
    if (cap == nullptr || value == arguments.values.end() || !value->second.given) return true;
    const std::vector<double>& numbers = value->second.numbers;
    return std::all_of(numbers.begin(), numbers.end(),
                       [&](double v) { return v >= cap->low && v <= cap->high; });
  };
  return std::all_of(op.arguments.begin(), op.arguments.end(), cheap) &&
         std::all_of(op.modifiers.begin(), op.modifiers.end(), cheap);
}

WordSource::WordSource(const std::vector<const OpInfo*>& rows, const std::string& folder) {
  for (const OpInfo* op : rows) {
    for (const std::string& example : op->examples) {
      const Words words = WordsOf(*op, example);
      for (size_t i = 0; i < words.positional.size(); ++i) {
        own_[op->name + " " + op->arguments[i].name].push_back(words.positional[i]);
        shared_[op->arguments[i].name].push_back(words.positional[i]);
      }
      for (const auto& [key, value] : words.modifiers) {
        own_[op->name + " " + key].push_back(value);
        shared_[key].push_back(value);
      }
    }
  }
  WriteText(folder + "/config.ocio", kConfig);
  std::string cube = "LUT_3D_SIZE 3\n", curve = "Version 1\nFrom 0 1\nLength 5\nComponents 1\n{\n";
  for (int i = 0; i < 27; ++i) {
    char line[80];
    std::snprintf(line, sizeof line, "%.3f %.3f %.3f\n", i % 3 / 2.2, i / 3 % 3 / 1.9,
                  i / 9 / 2.0 + 0.02 * (i % 3));
    cube += line;
  }
  for (const char* value : {"0", "0.3", "0.45", "0.8", "1"}) curve += std::string(value) + "\n";
  WriteText(folder + "/cube.cube", cube);
  WriteText(folder + "/curve.spi1d", curve + "}\n");
  files_["FILE"] = {folder + "/cube.cube", folder + "/curve.spi1d"};
  files_["config"] = {folder + "/config.ocio"};
}

std::string WordSource::Text(Draw& draw, const OpInfo& op, const ParamInfo& param,
                             const Surroundings& around) const {
  static const std::vector<std::string> kKernels = KernelNames();
  const std::string& name = param.name;
  const auto number_list = [&](int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += (i > 0 ? "," : "") + NumberWord(draw.Real(-0.25, 1.25));
    return text;
  };
  const auto size = [&](int most) {
    return std::to_string(draw.Between(1, most)) + "x" + std::to_string(draw.Between(1, most));
  };
  const auto odd = [&] { return std::to_string(2 * draw.Between(0, draw.Chance(0.85) ? 3 : 10) + 1); };
  if (op.name == "morphology") {
    const std::string width = odd();
    return width + "x" + odd();
  }
  if (name == "SIZE" || (name == "size" && op.name != "volume")) return size(draw.Chance(0.85) ? 7 : 21);
  if (name == "GEOM" && op.name == "resize") {
    if (draw.Chance(0.5)) return std::to_string(draw.Between(20, 250)) + "%";
    return std::to_string(draw.Between(1, 2 * around.width)) + "x" + std::to_string(draw.Between(1, 40));
  }
  if (name == "GEOM" && (op.name == "crop" || op.name == "cut")) {
    return std::to_string(draw.Between(1, around.width + 8)) + "x" +
           std::to_string(draw.Between(1, around.height + 8)) + "+" + std::to_string(draw.Between(0, 9)) +
           "+" + std::to_string(draw.Between(0, 9));
  }
  if (name == "GEOM" || name == "fit") return size(30);
  if (name == "+X+Y") {
    const auto offset = [&] {
      const int by = draw.Between(-40, 40);
      return (by < 0 ? "" : "+") + std::to_string(by);
    };
    const std::string across = offset();
    return across + offset();
  }
  if (name == "WxH") return draw.Of({"1x1", "2x1", "1x2", "2x2", "3x1"});
  if (name == "kernel" || name == "KERNEL") return draw.Of(kKernels);
  if (name == "depth" || name == "depthchannel" || name == "idchannel") {
    return std::to_string(draw.Below(around.channels));
  }
  if (name == "normalchannels" || (name == "channels" && op.name == "aov")) {
    return draw.Of({"0,1,2", "2,1,0", "1,2,0", "0", "1"});
  }
  if (name == "channels") return draw.Of({"color", "all", "R", "G,B"});
  if (name == "TABLE" || name == "table1" || name == "table2" || name == "tablec" || name == "map") {
    return number_list(draw.Of({1, 2, 3, 4, 5, 9, 17}));
  }
  if (name == "wrap") return draw.Of({"clamp", "glclamp", "border", "repeat", "mirror", "repeat,mirror"});
  if (name == "LIST") {
    std::string text;
    for (int i = 0, n = draw.Between(1, 6); i < n; ++i) {
      text +=
          (i > 0 ? "," : "") + (draw.Chance(0.85) ? std::to_string(draw.Below(around.channels))
                                                  : "N" + std::to_string(i) + "=" + NumberWord(draw.Unit()));
    }
    return text;
  }
  if (name == "NAMES") return draw.Of({"X,Y,Z", "B,G,R", ",,Z", "Y", "R,G,B,A", "A", "R,G,B,Z"});
  if (name == "FROM" || name == "TO" || name == "from" || name == "to" || name == "SPACE")
    return draw.Of({"lin", "video", "mixed"});
  if (name == "DISPLAY") return "monitor";
  if (name == "VIEW") return draw.Of({"film", "plain"});
  if (name == "LOOK" || name == "looks") return "warm";
  if (const auto it = files_.find(name); it != files_.end()) return draw.Of(it->second);
  if (const auto it = own_.find(op.name + " " + name); it != own_.end()) return draw.Of(it->second);
  return param.default_value;
}

std::string WordSource::Value(Draw& draw, const OpInfo& op, const ParamInfo& param,
                              const Surroundings& around) const {
  const auto own = own_.find(op.name + " " + param.name);
  const auto shared = shared_.find(param.name);
  if (own != own_.end() && draw.Chance(0.2)) return draw.Of(own->second);
  switch (param.type) {
    case ParamType::kFlag:
      return draw.Chance(0.7) ? "1" : "0";
    case ParamType::kChoice:
      if (!param.numbers_too || draw.Chance(0.5)) return draw.Of(param.choices);
      break;
    case ParamType::kText:
      return Text(draw, op, param, around);
    case ParamType::kNumber:
    case ParamType::kInteger:
      return NumberWord(Number(draw, op, param));
    case ParamType::kNumbers:
      break;
  }
  if (shared != shared_.end() && !param.counts.empty() && draw.Chance(0.5)) return draw.Of(shared->second);
  return Numbers(draw, op, param, around);
}

Words WordSource::Drawn(Draw& draw, const OpInfo& op, const Surroundings& around) const {
  Words words = Any(draw, op, around);
  // Every texel for every pixel takes minutes of large maps.
  if (op.name == "envmap" && int64_t{around.width} * around.height > 1 << 14) {
    std::erase_if(words.modifiers, [](const auto& m) { return m.first == "table" && m.second == "-1"; });
  }
  return words;
}

Words WordSource::Any(Draw& draw, const OpInfo& op, const Surroundings& around) const {
  Words words;
  const bool from_example = !op.examples.empty() && draw.Chance(0.5);
  if (from_example) {
    words = WordsOf(op, draw.Of(op.examples));
    if (draw.Chance(0.35)) return words;
  }
  // An OpenColorIO row names what its config has: all of it is drawn together.
  const bool ocio = std::any_of(op.modifiers.begin(), op.modifiers.end(),
                                [](const ParamInfo& p) { return p.name == "config"; });
  if (ocio && from_example) return words;
  if (!from_example || draw.Chance(0.4)) {
    std::vector<std::string> positional;
    for (const ParamInfo& p : op.arguments) positional.push_back(Value(draw, op, p, around));
    words.positional = std::move(positional);
  }
  const double share = std::min(0.5, 2.0 / (static_cast<double>(op.modifiers.size()) + 0.1));
  for (const ParamInfo& p : op.modifiers) {
    const bool needed = ocio && p.name == "config";
    if (!needed && !draw.Chance(from_example ? share / 2 : share)) continue;
    if (ocio && (p.name == "key" || p.name == "value" || p.name == "cccid")) continue;
    const std::string value = Value(draw, op, p, around);
    if (value.empty()) continue;
    const auto at = std::find_if(words.modifiers.begin(), words.modifiers.end(),
                                 [&](const auto& m) { return m.first == p.name; });
    if (at != words.modifiers.end()) {
      at->second = value;
    } else {
      words.modifiers.emplace_back(p.name, value);
    }
  }
  // What has no use beside the rest is left out, mostly: a few refusals are worth having.
  if (draw.Chance(0.97)) {
    for (int round = 0; round < 2; ++round) {
      const auto useless = [&](const auto& m) {
        const auto p = std::find_if(op.modifiers.begin(), op.modifiers.end(),
                                    [&](const ParamInfo& q) { return q.name == m.first; });
        return p != op.modifiers.end() && !MayStand(op, *p, words);
      };
      const Words before = words;
      std::erase_if(words.modifiers, useless);
      if (before == words) break;
    }
    if (std::any_of(op.arguments.begin(), op.arguments.end(),
                    [&](const ParamInfo& p) { return ops::IsLeftOut(p, words.modifiers); })) {
      words.positional.clear();
    }
  }
  return words;
}

}  // namespace tessera::random
