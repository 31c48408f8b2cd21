// AOVs found by the names that renderers give their channels.
#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <utility>

#include "graph/op.h"
#include "ops/channels/names.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"

namespace tessera::ops {
namespace {

std::string Lower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

// What an AOV is called, in lower case, and its channels' last parts, one set per component.
struct Convention {
  Aov aov;
  const char* name;                      // on the command line
  std::vector<std::string_view> layers;  // last word before the component
  std::vector<std::string_view> bare;    // names of single channels that need no layer
  int components, needed;
  const char* result;  // channel names
};

// Blender: Combined, Position, Normal, Depth, Mist, Vector, IndexOB, IndexMA, DiffCol. Arnold and Karma: P,
// Pref, N, Z, motionvector, id, albedo. RenderMan: P, __Pworld, Pworld, Nworld, __Nworld, z, depth,
// dPcameradtime. V-Ray: worldPosition, normals, zDepth, velocity, objectID; from 3ds Max VRayNormals,
// VRayZDepth, VRayVelocity, VRayObjectID, VRayMtlID.
const std::vector<Convention>& Conventions() {
  static const std::vector<Convention> kConventions = {
      {Aov::kColor,
       "color",
       {"combined", "beauty", "rgba", "rgb", "ci", "c", "color", "effectsresult"},
       {},
       4,
       3,
       "R,G,B,A"},
      {Aov::kPosition,
       "position",
       {"position", "p", "pworld", "__pworld", "worldposition", "worldpos", "pos", "point", "points", "pw"},
       {},
       3,
       3,
       "X,Y,Z"},
      {Aov::kRest, "rest", {"pref", "__pref", "rest", "__wpref", "wpref", "restposition"}, {}, 3, 3, "X,Y,Z"},
      {Aov::kNormal,
       "normal",
       {"normal", "n", "nworld", "__nworld", "normals", "worldnormal", "nn", "__n", "denoising normal",
        "vraynormals"},
       {},
       3,
       3,
       "X,Y,Z"},
      {Aov::kDepth,
       "depth",
       {"depth", "z", "zdepth", "__depth", "vrayzdepth", "pz"},
       {"z", "depth", "zdepth", "pz"},
       1,
       1,
       "Z"},
      {Aov::kMist, "mist", {"mist"}, {"mist"}, 1, 1, "mist"},
      {Aov::kMotion,
       "motion",
       {"vector", "motionvector", "motion", "velocity", "mv", "dpcameradtime", "motionvecs", "forward",
        "vrayvelocity"},
       {},
       4,
       2,
       "X,Y,Z,W"},
      {Aov::kId,
       "id",
       {"indexob", "indexma", "id", "objectid", "obj_id", "nodeid", "materialid", "renderid", "vrayobjectid",
        "vraymtlid"},
       {"id", "objectid", "indexob", "indexma"},
       1,
       1,
       "id"},
      {Aov::kAlbedo,
       "albedo",
       {"diffcol", "albedo", "diffuse_albedo", "rawdiffusefilter", "basecolor"},
       {},
       3,
       3,
       "R,G,B"},
  };
  return kConventions;
}

const Convention& ConventionOf(Aov aov) {
  return *std::find_if(Conventions().begin(), Conventions().end(),
                       [aov](const Convention& c) { return c.aov == aov; });
}

// Index of a channel's last word as a component: x or r 0, y or g 1, z or b 2, w or a 3; -1 otherwise.
int ComponentOf(std::string_view word) {
  static constexpr std::string_view kWords[][4] = {
      {"x", "r", "red", "u"}, {"y", "g", "green", "v"}, {"z", "b", "blue", ""}, {"w", "a", "alpha", ""}};
  for (int c = 0; c < 4; ++c) {
    for (const std::string_view w : kWords[c]) {
      if (!w.empty() && w == word) return c;
    }
  }
  return -1;
}

struct ChannelName {
  std::string prefix, layer, last;  // ViewLayer. | Position | X, in lower case
};
ChannelName Split(const std::string& name) {
  const std::string lower = Lower(name);
  const size_t dot = lower.rfind('.');
  if (dot == std::string::npos) return {"", "", lower};
  const size_t before = lower.rfind('.', dot == 0 ? 0 : dot - 1);
  const size_t begin = before == std::string::npos || before == dot ? 0 : before + 1;
  return {lower.substr(0, begin), lower.substr(begin, dot - begin), lower.substr(dot + 1)};
}

// The components of one layer, collected by what comes before the last word.
std::vector<int> Collect(const ImageSpec& spec, const Convention& convention, const std::string& layer) {
  const std::string wanted = Lower(layer);
  const auto inside = [&](const std::string& name) {
    return Lower(name).compare(0, wanted.size(), wanted) == 0;
  };
  const auto is_one_of = [](const std::vector<std::string_view>& list, const std::string& word) {
    return std::find(list.begin(), list.end(), word) != list.end();
  };
  // Earlier names of the list are preferred to later ones.
  for (const std::string_view known : convention.layers) {
    for (int c = 0; c < spec.channel_count(); ++c) {
      const std::string& name = spec.channels[static_cast<size_t>(c)];
      const ChannelName first = Split(name);
      if (first.layer != known || !inside(name)) continue;
      std::array<int, 4> found = {-1, -1, -1, -1};
      for (int k = 0; k < spec.channel_count(); ++k) {
        const ChannelName other = Split(spec.channels[static_cast<size_t>(k)]);
        const int component = ComponentOf(other.last);
        if (other.prefix == first.prefix && other.layer == first.layer && component >= 0) {
          found[static_cast<size_t>(component)] = k;
        }
      }
      if (convention.components == 1) {
        // One number, often written as a colour: its first component, never its alpha.
        const auto first_found = std::find_if(found.begin(), found.begin() + 3, [](int k) { return k >= 0; });
        return {first_found != found.begin() + 3 ? *first_found : c};
      }
      std::vector<int> channels;
      for (int k = 0; k < convention.components && found[static_cast<size_t>(k)] >= 0; ++k) {
        channels.push_back(found[static_cast<size_t>(k)]);
      }
      if (static_cast<int>(channels.size()) >= convention.needed) return channels;
    }
  }
  for (int c = 0; c < spec.channel_count(); ++c) {
    const ChannelName name = Split(spec.channels[static_cast<size_t>(c)]);
    if (is_one_of(convention.bare, name.last) && name.layer.empty() && inside(name.last)) return {c};
  }
  return {};
}

// Channels without a layer: R,G,B(,A) are colour, X,Y,Z a position.
std::vector<int> Bare(const ImageSpec& spec, std::initializer_list<const char*> names, size_t needed) {
  std::vector<int> channels;
  for (const char* name : names) {
    const int c = spec.ChannelIndex(name);
    if (c < 0) break;
    channels.push_back(c);
  }
  return channels.size() >= needed ? channels : std::vector<int>{};
}

// The channels as an image; the result's names by position in `names`.
Node Select(const Node& image, const std::vector<int>& channels, const std::string& names) {
  const std::vector<std::string> words = SplitCommas(names);
  std::vector<ChannelChoice> choices;
  for (size_t k = 0; k < channels.size(); ++k)
    choices.push_back({channels[k], 0, k < words.size() ? words[k] : ""});
  return SelectChannels(image, choices);
}

}  // namespace

OpInfo AovInfo() {
  OpInfo info;
  info.name = "aov";
  info.family = "shade";
  info.summary = "One AOV of a renderer's image, by the name it goes by";
  std::string known;
  for (const Convention& c : Conventions()) {
    known += (known.empty() ? "" : "; ") + std::string(c.name) + ":";
    for (const std::string_view word : c.layers) known += " " + std::string(word);
  }
  info.help =
      "IMAGE --aov NAME takes the channels that Blender, Arnold, Karma, RenderMan or V-Ray give that "
      "content, in order and renamed to R,G,B,A, X,Y,Z or Z: ViewLayer.Position.X, P.X, __Pworld.r and "
      "worldPosition.R all are "
      "--aov position. Letter case does not matter. Known names (the word before the component): " +
      known +
      ". layer= restricts the search to channels whose names begin so (a view layer). channels= names the "
      "channels instead, as --ch does. mask= names a channel (alpha, coverage): where it is not above 0 the "
      "result is NaN, which later commands leave alone: background keeps its bits.";
  info.bound = "exact";
  ParamInfo name = ChoiceModifier("NAME", {"color"}, "which AOV");
  name.choices.clear();
  for (const Convention& c : Conventions()) name.choices.push_back(c.name);
  name.default_value.clear();
  info.arguments = {name};
  ParamInfo layer = TextModifier("layer", "beginning of the channels' names");
  ParamInfo channels = layer;
  channels.name = "channels", channels.help = "the channels, instead of searching";
  ParamInfo mask = layer;
  mask.name = "mask", mask.help = "a channel that is 0 on background";
  layer.only_with = "!channels";
  info.modifiers = {layer, channels, mask};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const auto convention = std::find_if(Conventions().begin(), Conventions().end(),
                                         [&](const Convention& c) { return a.Text("NAME") == c.name; });
    Node node;
    if (a.Given("channels")) {
      node = SelectChannels(in[0], a.Text("channels"));
      std::vector<int> all;
      for (int c = 0; c < node.spec().channel_count(); ++c) all.push_back(c);
      node = Select(node, all, convention->result);
    } else {
      node = SelectAov(in[0], convention->aov, a.Given("layer") ? a.Text("layer") : "");
    }
    return a.Given("mask") ? MaskAov(node, SelectChannels(in[0], a.Text("mask"))) : node;
  };
  info.examples = {"position channels=2,1,0", "depth channels=1"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

std::vector<int> FindAov(const ImageSpec& spec, Aov aov, const std::string& layer) {
  if (layer.empty() && aov == Aov::kColor) {
    if (auto bare = ops::Bare(spec, {"R", "G", "B", "A"}, 3); !bare.empty()) return bare;
  }
  const std::vector<int> xyz = layer.empty() ? ops::Bare(spec, {"X", "Y", "Z"}, 3) : std::vector<int>{};
  std::vector<int> found = ops::Collect(spec, ops::ConventionOf(aov), layer);
  if (aov == Aov::kPosition && found.empty()) return xyz;
  // The Z of X,Y,Z is no depth.
  if (aov == Aov::kDepth && !found.empty() && !xyz.empty() && found[0] == xyz[2]) return {};
  return found;
}

Node SelectAov(const Node& image, Aov aov, const std::string& layer) {
  const ops::Convention& convention = ops::ConventionOf(aov);
  const std::vector<int> channels = FindAov(image.spec(), aov, layer);
  if (channels.empty()) {
    throw DataError("aov", "found no " + std::string(convention.name) + " among the channels " +
                               ops::ListChannels(image.spec()) + (layer.empty() ? "" : " of layer " + layer) +
                               ", expected one of a renderer's names; channels= names them");
  }
  return ops::Select(image, channels, convention.result);
}

Node PositionsOf(const Node& image) {
  const std::vector<int> found = FindAov(image.spec(), Aov::kPosition);
  if (!found.empty()) return ops::Select(image, found, "X,Y,Z");
  if (image.spec().channel_count() < 3) {
    throw DataError("positions", "found the channels " + ops::ListChannels(image.spec()) +
                                     ", expected three coordinates or a position AOV");
  }
  return ops::Select(image, {0, 1, 2}, "X,Y,Z");
}

Node NormalsOf(const Node& image) {
  const std::vector<int> found = FindAov(image.spec(), Aov::kNormal);
  if (found.size() < 3 || found == std::vector<int>{0, 1, 2}) return image;
  return ops::Select(image, found, "X,Y,Z");
}

bool IsAovFile(const ImageSpec& spec) {
  const auto holds = [&](Aov aov) { return !FindAov(spec, aov).empty(); };
  return holds(Aov::kDepth) && (holds(Aov::kColor) || holds(Aov::kPosition) || holds(Aov::kNormal));
}

Node DepthsOf(const Node& image) {
  const std::vector<int> found = FindAov(image.spec(), Aov::kDepth);
  return ops::Select(image, {found.empty() ? 0 : found[0]}, "Z");
}

}  // namespace tessera
