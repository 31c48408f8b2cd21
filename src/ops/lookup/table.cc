// Colour tables: one 1-D table per channel, and RGB through a 3-D table.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "base/number_lines.h"
#include "graph/op.h"
#include "model/lookup_settings.h"
#include "ops/lookup/lookup_ops.h"
#include "ops/lookup/point_stages.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/lookup.h"

namespace tessera::ops {
namespace {

using model::Table3DSettings;
using model::Tables1DSettings;

class Table3DOp final : public graph::OpWith<Table3DSettings> {
 public:
  explicit Table3DOp(Table3DSettings settings)
      : OpWith(std::move(settings)), grid_(std::make_shared<const Grid>(params().table, params().lookup)) {}
  std::string Name() const override { return "table3d"; }
  graph::OpKind Kind() const override { return graph::OpKind::kColor; }
  std::string Describe() const override {
    const Table& t = params().table;
    return "table " + std::to_string(t.size(0)) + "x" + std::to_string(t.size(1)) + "x" +
           std::to_string(t.size(2));
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireColor("table3d", in[0]);
    return in[0];
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    return MakeTable3DStage(grid_);
  }

 private:
  std::shared_ptr<const Grid> grid_;
};

// Bit for bit: signs of zeros count.
bool SameEntries(const Table& a, const Table& b) {
  if (a.sizes() != b.sizes() || a.channels() != b.channels() || a.align() != b.align() ||
      a.storage() != b.storage()) {
    return false;
  }
  const std::vector<float> x = a.Samples(), y = b.Samples();
  return std::equal(x.begin(), x.end(), y.begin(), y.end(), [](float v, float w) {
    return std::bit_cast<uint32_t>(v) == std::bit_cast<uint32_t>(w);
  });
}

class Tables1DOp final : public graph::OpWith<Tables1DSettings> {
 public:
  explicit Tables1DOp(Tables1DSettings settings) : OpWith(std::move(settings)) {
    // Channels with the same entries share them: one table stays in the nearest cache where three do not.
    const std::vector<Table>& tables = params().tables;
    for (size_t c = 0; c < tables.size(); ++c) {
      size_t same = 0;
      while (same < c && !SameEntries(tables[same], tables[c])) ++same;
      grids_.push_back(same < c            ? grids_[same]
                       : tables[c].empty() ? nullptr
                                           : std::make_shared<const Grid>(tables[c], params().lookup));
    }
  }
  std::string Name() const override { return "table"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  std::string Describe() const override {
    const auto first = std::find_if(params().tables.begin(), params().tables.end(),
                                    [](const Table& t) { return !t.empty(); });
    return first == params().tables.end() ? "table" : "table of " + std::to_string(first->size(0));
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  bool IsIdentity() const override {
    return std::all_of(grids_.begin(), grids_.end(), [](const auto& grid) { return grid == nullptr; });
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext& context) const override {
    std::shared_ptr<const Grid> grids[4];
    for (int p = 0; p < 4; ++p) {
      const int c = context.channels[p];
      if (c >= 0 && static_cast<size_t>(c) < grids_.size()) grids[p] = grids_[static_cast<size_t>(c)];
    }
    return MakeTables1DStage(grids);
  }

 private:
  std::vector<std::shared_ptr<const Grid>> grids_;
};

constexpr size_t kMostColumns = 4;
constexpr size_t kMostEntries = size_t{1} << 22;

// Each line is an entry; columns become tables.
std::vector<std::vector<float>> ReadColumns(const std::string& file) {
  std::vector<std::vector<float>> columns;
  const auto add = [&](std::span<const double> entry, int line) {
    if (columns.empty()) columns.resize(entry.size());
    if (entry.size() != columns.size()) {
      throw DataError(file, "line " + std::to_string(line) + ": found " + std::to_string(entry.size()) +
                                " numbers, expected " + std::to_string(columns.size()) +
                                " as in the first line");
    }
    for (size_t c = 0; c < entry.size(); ++c) columns[c].push_back(static_cast<float>(entry[c]));
    if (columns[0].size() > kMostEntries)
      throw DataError(file, "found more than 2^22 entries, expected fewer");
  };
  base::ReadNumberLines(file, "numbers (a list such as 0,0.25,1) or a text file of them",
                        {"1 to 4 finite numbers", 1, kMostColumns}, add);
  if (columns.empty()) throw DataError(file, "found no numbers, expected a table with one entry per line");
  return columns;
}

bool IsNumberList(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789+-.,eE ") == std::string::npos &&
         text.find_first_of("0123456789") != std::string::npos;
}

std::vector<float> NumberList(const std::string& text) {
  std::vector<float> values;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    std::string word = text.substr(begin, end - begin);
    word.erase(0, std::min(word.find_first_not_of(" +"), word.size()));
    double value = 0;
    const auto [last, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || last != word.data() + word.size() ||
        !std::isfinite(static_cast<float>(value))) {
      throw Error("table", "found \"" + word.substr(0, 40) + "\" at position " +
                               std::to_string(values.size() + 1) + ", expected a finite number");
    }
    values.push_back(static_cast<float>(value));
    begin = end + 1;
  }
  return values;
}

Node MakeTable(std::span<const Node> in, const Arguments& a, const ImageSpec*) {
  const std::string& text = a.Text("TABLE");
  const std::vector<std::vector<float>> columns =
      IsNumberList(text) ? std::vector<std::vector<float>>{NumberList(text)} : ReadColumns(text);
  const ImageSpec& spec = in[0].spec();
  std::vector<int> channels;
  const std::string& names = a.Text("channels");
  if (names == "color") {
    for (int c = 0; c < std::min(3, spec.channel_count()); ++c) {
      if (c != spec.alpha) channels.push_back(c);
    }
  } else if (names == "all") {
    for (int c = 0; c < spec.channel_count(); ++c) channels.push_back(c);
  } else {
    for (size_t begin = 0; begin <= names.size();) {
      const size_t end = std::min(names.find(',', begin), names.size());
      const std::string name = names.substr(begin, end - begin);
      const int c = spec.ChannelIndex(name);
      if (c < 0) {
        std::string present;
        for (const std::string& n : spec.channels) present += (present.empty() ? "" : ",") + n;
        throw DataError("table:channels",
                        "found \"" + name + "\", expected channels of the image (" + present + ")");
      }
      channels.push_back(c);
      begin = end + 1;
    }
  }
  if (columns.size() > 1 && columns.size() != channels.size()) {
    throw Error("table", "found " + std::to_string(columns.size()) +
                             " columns, expected one, or one for each of " + std::to_string(channels.size()) +
                             " channels");
  }
  Tables1DParams p;
  p.filter = a.Text("filter") == "nearest" ? TableFilter::kNearest
             : a.Text("filter") == "cubic" ? TableFilter::kCubic
                                           : TableFilter::kLinear;
  p.tables.resize(static_cast<size_t>(spec.channel_count()));
  for (size_t k = 0; k < channels.size(); ++k) {
    const std::vector<float>& column = columns[columns.size() > 1 ? k : 0];
    p.tables[static_cast<size_t>(channels[k])] =
        Table({static_cast<int>(column.size())}, 1, column,
              a.Text("align") == "centres" ? TableAlign::kCentres : TableAlign::kEnds);
  }
  if (a.Flag("count") && a.notes != nullptr) {
    constexpr size_t kAtOnce = 4;
    for (size_t k = 0; k < channels.size(); k += kAtOnce) {
      const std::vector<int> some(
          channels.begin() + static_cast<ptrdiff_t>(k),
          channels.begin() + static_cast<ptrdiff_t>(std::min(k + kAtOnce, channels.size())));
      std::string text;
      for (const int c : some) text += (text.empty() ? "" : ",") + spec.channels[static_cast<size_t>(c)];
      const auto dims = static_cast<int>(some.size());
      a.notes->push_back(text + ": " + CountLostCoordinates(in[0], dims, {.axes = some}).Summary());
    }
  }
  return ApplyTables1D(in[0], p);
}

}  // namespace

std::vector<Table> TablesOfText(const std::string& text) {
  const std::vector<std::vector<float>> columns =
      IsNumberList(text) ? std::vector<std::vector<float>>{NumberList(text)} : ReadColumns(text);
  std::vector<Table> tables;
  for (const std::vector<float>& column : columns) {
    tables.emplace_back(std::vector<int>{static_cast<int>(column.size())}, 1, column, TableAlign::kEnds);
  }
  return tables;
}

OpInfo TableInfo() {
  OpInfo info;
  info.name = "table";
  info.family = "lookup";
  info.summary = "Colour tables: each channel through a 1-D table";
  info.help =
      "TABLE is a list of numbers (0,0.25,1) or a text file with one entry per line, one column for all "
      "channels or one for each. Entry j of N lies at j/(N-1); samples are clamped to [0,1] to find their "
      "place, NaN reads entry 0 (count=1 prints how often), entries may have any value. channels=color (the "
      "first three but alpha), all, or a list of names; the others keep their bits: channels=A is OpenGL's "
      "ALPHA table, channels=all its INTENSITY table. filter=nearest is OpenGL's own rule; with align=centres, where "
      "entry j fills the range from j/N to (j+1)/N, it makes N equal steps (SVG's discrete). stage= names the "
      "place in the pixel-transfer pipeline that the table stands for; on a command line the order of the "
      "commands is what counts. 8-bit pixels are mapped code by code. LUT files: --lut. Source: "
      "McReynolds et al. 1997, 12.2.3.";
  info.bound = "2 u times the larger entry read (cubic 8 u); entries are exact";
  info.bound_u = 2;
  info.arguments = {TextModifier("TABLE", "numbers, or a text file of them")};
  info.modifiers = {TextModifier("channels", "color, all, or names (R,G,B)", "color"),
                    ChoiceModifier("filter", {"linear", "nearest", "cubic"}, "how entries are combined"),
                    ChoiceModifier("align", {"ends", "centres"},
                                   "where entries lie: from 0 to 1, or in the middle of N equal ranges"),
                    ChoiceModifier("stage", {"color", "postconvolution", "postmatrix"},
                                   "the colour table of OpenGL's pipeline that it stands for"),
                    FlagModifier("count", "print how many pixels have a NaN that looks up a table")};
  info.make = MakeTable;
  info.examples = {
      "0,0.1,0.3,1",         "1,0 channels=all",         "0,1,0.5,0.25,0.125 filter=nearest",   "0.5",
      "-1,3,2 channels=G,R", "0,0.2,0.1,1 filter=cubic", "0,0.5,1 filter=nearest align=centres"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node ApplyTable3D(const Node& image, const Table& table, const Table3DParams& params) {
  if (table.dims() != 3) {
    throw Error("table3d", "found a table of " + std::to_string(table.dims()) + " dimensions, expected 3");
  }
  if (table.channels() < 3) {
    throw Error("table3d",
                "found a table of " + std::to_string(table.channels()) + " channels, expected 3 or 4");
  }
  if (model::HasMipChain(params.filter)) {
    throw Error("table3d", "found a filter of mip levels, expected nearest, linear, tetrahedral or cubic");
  }
  model::Table3DSettings settings{table, {}};
  settings.lookup.filter = params.filter;
  settings.lookup.cubic = params.cubic;
  return graph::MakeNode(std::make_shared<const ops::Table3DOp>(std::move(settings)), {image});
}

Node ApplyTables1D(const Node& image, const Tables1DParams& params) {
  for (const Table& table : params.tables) {
    if (table.empty() || (table.dims() == 1 && table.channels() == 1)) continue;
    throw Error("table", "found a table of " + std::to_string(table.dims()) + " dimensions and " +
                             std::to_string(table.channels()) + " channels, expected one of each");
  }
  if (model::HasMipChain(params.filter))
    throw Error("table", "found a filter of mip levels, expected nearest, linear or cubic");
  model::Tables1DSettings settings{params.tables, {}};
  settings.lookup.filter = params.filter == TableFilter::kTetrahedral ? TableFilter::kLinear : params.filter;
  settings.lookup.cubic = params.cubic;
  return graph::MakeNode(std::make_shared<const ops::Tables1DOp>(std::move(settings)), {image});
}

}  // namespace tessera
