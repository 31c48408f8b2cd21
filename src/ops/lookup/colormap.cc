// Greys to colours: luminance through a map of colours. Made of the luminance and of tables.
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "base/number_text.h"
#include "ops/arithmetic/operands.h"
#include "ops/lookup/color_maps.h"
#include "ops/lookup/lookup_ops.h"
#include "tessera/color_state.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/lookup.h"

namespace tessera::ops {
namespace {

const NamedColorMap* FindMap(std::string_view name) {
  const auto* const found = std::find_if(std::begin(kColorMaps), std::end(kColorMaps),
                                         [&name](const NamedColorMap& map) { return map.name == name; });
  return found == std::end(kColorMaps) ? nullptr : found;
}

// Three equal channels of what is looked up.
Node Greys(const Node& image) {
  const ImageSpec& spec = image.spec();
  const bool colors = spec.channel_count() >= 3 && (spec.alpha < 0 || spec.alpha >= 3);
  const Node from = colors ? Luminance(image) : image;
  return SelectChannels(from, {{0, 0, "R"}, {0, 0, "G"}, {0, 0, "B"}});
}

}  // namespace

OpInfo ColorMapInfo() {
  OpInfo info;
  info.name = "colormap";
  info.family = "lookup";
  info.summary = "False colours: luminance through a map";
  info.help =
      "The luminance of R,G,B (rec709 weights), or the first channel of an image with fewer than three, limited "
      "to [0, 1], becomes a colour between the two nearest of the map's knots, which lie at equal distances "
      "from 0 to 1. MAP is inferno, viridis, magma, plasma (Smith et al. 2015: even steps to the "
      "eye), turbo (Mikhailov 2019), the older blue-red, spectrum and heat, or numbers: two or more R,G,B one "
      "after the other. The result has three channels, in linear light as oiiotool's (17 knots for the first "
      "five); alpha is dropped. NaN gets the first knot.";
  info.bound = "2 u times the larger knot read, and what 4 u of the luminance makes of the map's slope";
  info.bound_u = 2;
  ParamInfo map;
  map.name = "MAP";
  map.type = ParamType::kChoice;
  map.help = "a name, or comma-separated R,G,B triples";
  for (const NamedColorMap& known : kColorMaps) map.choices.emplace_back(known.name);
  map.numbers_too = true;
  map.min = -double{FLT_MAX}, map.max = double{FLT_MAX};
  map.min_count = 6, map.max_count = kMaxConstants;
  info.arguments = {map};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const std::vector<double>& knots = a.Numbers("MAP");
    return knots.empty() ? ColorMap(in[0], a.Text("MAP")) : ColorMap(in[0], knots);
  };
  info.examples = {"turbo", "viridis", "heat", "0.25,0.25,0.25,0,0.5,0,1,0,0"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node ColorMap(const Node& image, const std::vector<double>& knots) {
  ops::RequireFinite("colormap", knots);
  if (knots.size() < 6 || knots.size() % 3 != 0) {
    throw Error("colormap", "found " + std::to_string(knots.size()) +
                                " numbers, expected two or more colours of three, R,G,B");
  }
  Tables1DParams tables;
  for (size_t c = 0; c < 3; ++c) {
    std::vector<float> column;
    for (size_t k = c; k < knots.size(); k += 3) column.push_back(static_cast<float>(knots[k]));
    const int count = static_cast<int>(column.size());
    tables.tables.emplace_back(std::vector<int>{count}, 1, column, TableAlign::kEnds);
  }
  return WithColorState(ApplyTables1D(ops::Greys(image), tables), {});
}

Node ColorMap(const Node& image, std::string_view name) {
  const ops::NamedColorMap* const map = ops::FindMap(name);
  if (map == nullptr) {
    std::vector<std::string> names;
    for (const ops::NamedColorMap& known : ops::kColorMaps) names.emplace_back(known.name);
    const std::string near = ops::Nearest(std::string(name), names);
    throw Error("colormap", "found \"" + std::string(name) + "\", expected the name of a map" +
                                (near.empty() ? "" : "; did you mean " + near + "?"));
  }
  return ColorMap(image, std::vector<double>(map->knots.begin(), map->knots.end()));
}

}  // namespace tessera
