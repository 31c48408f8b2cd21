// The pixel-transfer pipeline: stages in their order, each made of other operations.
#include "tessera/ops/transfer.h"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "graph/op.h"
#include "ops/arithmetic/operands.h"
#include "ops/curve/curve_ops.h"
#include "ops/filter/filter_ops.h"
#include "ops/lookup/lookup_ops.h"
#include "ops/modifiers.h"
#include "ops/wrap.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/color.h"

namespace tessera {
namespace {

// How many tables a format holds.
size_t CountOf(ColorTableFormat format) {
  constexpr size_t kCounts[] = {4, 3, 1, 2, 1, 1};
  return kCounts[static_cast<int>(format)];
}

// What a channel is: 0 to 2 for R, G, B, 3 for alpha, -1 for others.
int WhichOf(const ImageSpec& spec, int c) { return c == spec.alpha ? 3 : c < 3 ? c : -1; }

// The table of a channel: which = 0 to 2 for R, G, B, 3 for alpha; -1 where the format has none.
int TableIndex(ColorTableFormat format, int which) {
  const bool alpha = which == 3;
  switch (format) {
    case ColorTableFormat::kRgba:
      return which;
    case ColorTableFormat::kRgb:
      return alpha ? -1 : which;
    case ColorTableFormat::kLuminance:
      return alpha ? -1 : 0;
    case ColorTableFormat::kLuminanceAlpha:
      return alpha ? 1 : 0;
    case ColorTableFormat::kAlpha:
      return alpha ? 0 : -1;
    case ColorTableFormat::kIntensity:
      break;
  }
  return 0;
}

// Called before a stage that looks up: its name, its input, the channels that it reads.
using BeforeLookup = std::function<void(const char* stage, const Node& input, const std::vector<int>&)>;

Node Tables(const Node& image, const ColorTable& table, const char* stage, const BeforeLookup& before) {
  if (table.tables.empty()) return image;
  const std::string name = std::string("transfer:") + stage;
  if (table.tables.size() != CountOf(table.format)) {
    throw Error(name, "found " + std::to_string(table.tables.size()) + " tables, expected " +
                          std::to_string(CountOf(table.format)) + " for this format");
  }
  for (const Table& t : table.tables) {
    if (t.empty()) throw Error(name, "found an empty table, expected one of one dimension");
    if (t.dims() == 1 && t.channels() == 1) continue;
    throw Error(name, "found a table of " + std::to_string(t.dims()) + " dimensions and " +
                          std::to_string(t.channels()) + " channels, expected one of each");
  }
  const ImageSpec& spec = image.spec();
  Tables1DParams params;
  params.filter = table.interpolate ? TableFilter::kLinear : TableFilter::kNearest;
  params.tables.resize(static_cast<size_t>(spec.channel_count()));
  std::vector<int> channels;
  for (int c = 0; c < spec.channel_count(); ++c) {
    const int which = WhichOf(spec, c), index = which < 0 ? -1 : TableIndex(table.format, which);
    if (index < 0) continue;
    params.tables[static_cast<size_t>(c)] = table.tables[static_cast<size_t>(index)];
    channels.push_back(c);
  }
  if (before && !channels.empty()) before(stage, image, channels);
  return ApplyTables1D(image, params);
}

// A list as constants per channel: one for all, one per channel, or OpenGL's four for R, G, B and alpha.
std::vector<double> PerChannel(const ImageSpec& spec, const char* name, const std::vector<double>& values,
                               double otherwise) {
  const auto count = static_cast<size_t>(spec.channel_count());
  ops::RequireFinite(std::string("transfer:") + name, values);
  if (values.size() == 1 || values.size() == count) return values;
  if (values.size() != 4) {
    throw Error(std::string("transfer:") + name,
                "found " + std::to_string(values.size()) + " numbers, expected 1 for all channels" +
                    (count == 4 || count == 1 ? "" : ", " + std::to_string(count) + ", one per channel,") +
                    " or 4 for R,G,B,A");
  }
  std::vector<double> constants;
  for (int c = 0; c < spec.channel_count(); ++c) {
    const int which = WhichOf(spec, c);
    constants.push_back(which < 0 ? otherwise : values[static_cast<size_t>(which)]);
  }
  return constants;
}

struct Constants {
  const std::vector<double>& values;
  const char* name;
};
Node ScaleAndBias(const Node& image, const Constants& scale, const Constants& bias) {
  Node node = image;
  const ImageSpec& spec = image.spec();
  if (!scale.values.empty()) node = MulConstant(node, PerChannel(spec, scale.name, scale.values, 1));
  if (!bias.values.empty()) node = AddConstant(node, PerChannel(spec, bias.name, bias.values, 0));
  return node;
}

Node Matrix(const Node& image, const std::vector<double>& matrix) {
  if (matrix.empty()) return image;
  if (matrix.size() != 9 && matrix.size() != 16) {
    throw Error("transfer:matrix", "found " + std::to_string(matrix.size()) + " numbers, expected 9 or 16");
  }
  return ColorMatrix(image, {matrix, /*transpose=*/true});
}

Node Pipeline(const Node& image, const TransferParams& p, const BeforeLookup& before) {
  if (p.bits < 0 || p.bits > 24) {
    throw Error("transfer:quantize", "found " + std::to_string(p.bits) + " bits, expected 0 to 24");
  }
  Node node = image;
  // What stands between a stage and the next: the limits and codes of a framebuffer.
  const auto store = [&](Node result) {
    if (result.data() == node.data()) return;
    if (p.bits != 0) {
      result = Quantize(result, {.bits = p.bits});
    } else if (p.clamp == TransferClamp::kStages) {
      result = Clamp(result, {.min = {0}, .max = {1}});
    }
    node = std::move(result);
  };
  store(ScaleAndBias(node, {p.scale, "scale"}, {p.bias, "bias"}));
  if (!p.maps.empty()) {
    if (p.maps.size() != 1 && p.maps.size() != 4) {
      throw Error("transfer:map", "found " + std::to_string(p.maps.size()) + " maps, expected 1 or 4");
    }
    store(Tables(node, {p.maps, p.maps.size() == 1 ? ColorTableFormat::kIntensity : ColorTableFormat::kRgba},
                 "map", before));
  }
  store(Tables(node, p.table1, "table1", before));
  if (p.kernel) store(Convolve(node, *p.kernel, p.convolve));
  store(ScaleAndBias(node, {p.scale_convolved, "scalec"}, {p.bias_convolved, "biasc"}));
  store(Tables(node, p.table_convolved, "tablec", before));
  store(Matrix(node, p.matrix));
  store(ScaleAndBias(node, {p.scale2, "scale2"}, {p.bias2, "bias2"}));
  store(Tables(node, p.table2, "table2", before));
  if (!p.lookup.empty()) {
    const Node looked_up = Lookup(node, p.lookup, p.lookup_params);
    if (before) before("lookup", node, {});
    store(looked_up);
  }
  if (p.bits != 0 && node.data() == image.data()) return Quantize(node, {.bits = p.bits});
  if (p.clamp == TransferClamp::kFinal && p.bits == 0) return Clamp(node, {.min = {0}, .max = {1}});
  return node;
}

}  // namespace

Node Transfer(const Node& image, const TransferParams& params) { return Pipeline(image, params, {}); }

std::vector<LostSamples> CountLostSamples(const Node& image, const TransferParams& params,
                                          const RenderOptions& options) {
  std::vector<LostSamples> counts;
  Pipeline(image, params, [&](const char* stage, const Node& input, const std::vector<int>& channels) {
    const auto dims = static_cast<int>(channels.size());
    counts.push_back(
        {stage, channels.empty()
                    ? CountLostCoordinates(input, params.lookup.dims(), params.lookup_params, options)
                    : CountLostCoordinates(input, dims, {.axes = channels}, options)});
  });
  return counts;
}

namespace ops {
namespace {

ParamInfo ListParam(const std::string& name, const std::string& help) {
  ParamInfo p = ConstantsArgument("");
  p.name = name;
  p.help = help;
  return p;
}
ParamInfo TableParam(const std::string& name, const std::string& help) { return TextModifier(name, help); }

const std::vector<std::string> kFormats = {"rgba",           "rgb",   "luminance",
                                           "luminancealpha", "alpha", "intensity"};
const std::vector<std::string> kClamps = {"none", "final", "stages"};

ColorTable ColorTableOf(const Arguments& a, const std::string& name) {
  ColorTable table;
  if (a.Text(name).empty()) return table;
  table.tables = TablesOfText(a.Text(name));
  table.interpolate = a.Flag("interpolate");
  if (a.Given("format")) {
    table.format = static_cast<ColorTableFormat>(
        std::find(kFormats.begin(), kFormats.end(), a.Text("format")) - kFormats.begin());
    return table;
  }
  // One column serves the colours, two the colours and alpha, three and four the channels.
  constexpr ColorTableFormat kByCount[] = {ColorTableFormat::kLuminance, ColorTableFormat::kLuminanceAlpha,
                                           ColorTableFormat::kRgb, ColorTableFormat::kRgba};
  table.format = kByCount[table.tables.size() - 1];
  return table;
}

}  // namespace

OpInfo TransferInfo() {
  OpInfo info;
  info.name = "transfer";
  info.family = "curve";
  info.summary = "OpenGL's pixel-transfer pipeline: scale, tables, convolution, matrix, tables";
  info.help =
      "The stages that are given, in this order: scale and bias, map, table1, kernel, scalec and biasc, "
      "tablec, matrix, scale2 and bias2, table2. Scales and biases: one number for every channel, alpha "
      "included, one per channel, or four for R,G,B,A of an image of other channels. Tables: numbers (0,0.25,1) or a text file whose columns are tables; "
      "entry j of N lies at j/(N-1), the nearest entry is taken (interpolate=1: linear); only the sample "
      "that is looked up is limited to [0,1], NaN reads entry 0 (count=1 prints how often, table by table, for "
      "one more evaluation of what comes before it). format= says which channels tables replace: "
      "by default one column serves R,G,B, two R,G,B and A, three R,G,B, four all. A map replaces all four "
      "channels. The kernel is applied as --convolve does it, with its words wrap= (OpenGL's REDUCE is valid, "
      "its CONSTANT_BORDER black, its REPLICATE_BORDER clamp, the default), bordervalue=, correlate=, "
      "divisor=, method= and preservealpha=. The matrix is row by row and acts on columns (R,G,B,A), or R,G,B for 9 numbers. Nothing "
      "else limits values unless clamp=final (after the last stage) or clamp=stages (after each); "
      "quantize=BITS rounds to codes of that depth after each stage, as a framebuffer does. Scales, matrices "
      "and limits fold into one matrix. Source: OpenGL 1.2, 3.6; McReynolds et al. 1997, 12.1.1.";
  info.bound = "each stage as its own operation";
  info.modifiers = {
      ListParam("scale", "factors, stage 2"),
      ListParam("bias", "summands, stage 2"),
      TableParam("map", "pixel maps, stage 3: one column, or four for R,G,B,A"),
      TableParam("table1", "colour table, stage 4"),
      TableParam("kernel", "name of a kernel (gaussian, sobel_x, ...), stage 5"),
      ListParam("kernelsize", "width and height of the kernel, 3,3 by default"),
      ListParam("scalec", "factors after the convolution, stage 6"),
      ListParam("biasc", "summands after the convolution, stage 6"),
      TableParam("tablec", "colour table after the convolution, stage 7"),
      ListParam("matrix", "9 or 16 numbers, stage 8"),
      ListParam("scale2", "factors after the matrix, stage 9"),
      ListParam("bias2", "summands after the matrix, stage 9"),
      TableParam("table2", "colour table after the matrix, stage 10"),
      OnlyWith("kernel", FilterWrapModifier()),
      OnlyWith("kernel", BorderValueModifier()),
      OnlyWith("kernel", FlagModifier("correlate", "do not turn the kernel round")),
      OnlyWith("kernel",
               NumberModifier("divisor", "0", -1e30, 1e30, "the kernel's sum is divided by it; 0: by 1")),
      OnlyWith("kernel", MethodModifier()),
      OnlyWith("kernel", FlagModifier("preservealpha", "convolve the colours, divided by alpha, alone")),
      FlagModifier("count", "print how many pixels look up a table with NaN")};
  info.modifiers[9].min_count = 9, info.modifiers[9].max_count = 16, info.modifiers[9].counts = {9, 16};
  info.modifiers[5].min_count = info.modifiers[5].max_count = 2, info.modifiers[5].only_with = "kernel";
  ParamInfo interpolate = TableParam("interpolate", "1: linear between entries");
  interpolate.type = ParamType::kFlag;
  interpolate.default_value = "0";
  ParamInfo format = TableParam("format", "channels that tables replace (default: by their number)");
  format.type = ParamType::kChoice;
  format.choices = kFormats;
  ParamInfo clamp = TableParam("clamp", "where samples are limited to [0,1]");
  clamp.type = ParamType::kChoice;
  clamp.default_value = "none";
  clamp.choices = kClamps;
  ParamInfo bits = TableParam("quantize", "bits of the framebuffer between stages, 0 for float");
  bits.type = ParamType::kInteger;
  bits.default_value = "0";
  bits.min = 0, bits.max = 24;
  info.modifiers.insert(info.modifiers.end(), {interpolate, format, clamp, bits});
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    TransferParams p;
    p.scale = a.Numbers("scale"), p.bias = a.Numbers("bias");
    if (!a.Text("map").empty()) p.maps = TablesOfText(a.Text("map"));
    p.table1 = ColorTableOf(a, "table1");
    if (!a.Text("kernel").empty()) {
      const std::vector<double>& size = a.Numbers("kernelsize");
      p.kernel =
          size.empty() ? NamedKernel(a.Text("kernel")) : NamedKernel(a.Text("kernel"), size[0], size[1]);
      p.convolve.wrap = WrapNamed(a.Text("wrap")), p.convolve.border_value = a.Number("bordervalue");
      p.convolve.correlate = a.Flag("correlate"), p.convolve.divisor = a.Number("divisor");
      p.convolve.method = MethodNamed(a.Text("method")), p.convolve.preserve_alpha = a.Flag("preservealpha");
    }
    p.scale_convolved = a.Numbers("scalec"), p.bias_convolved = a.Numbers("biasc");
    p.table_convolved = ColorTableOf(a, "tablec");
    p.matrix = a.Numbers("matrix");
    p.scale2 = a.Numbers("scale2"), p.bias2 = a.Numbers("bias2");
    p.table2 = ColorTableOf(a, "table2");
    p.clamp = static_cast<TransferClamp>(std::find(kClamps.begin(), kClamps.end(), a.Text("clamp")) -
                                         kClamps.begin());
    p.bits = a.Integer("quantize");
    const Node result = Transfer(in[0], p);
    if (a.Flag("count") && a.notes != nullptr) {
      for (const LostSamples& s : CountLostSamples(in[0], p))
        a.notes->push_back(s.stage + ": " + s.lost.Summary());
    }
    return result;
  };
  info.identity = "scale=1";
  info.examples = {"scale=2,2,2,1 bias=-1,-1,-1,0 matrix=0,1,0,1,0,0,0,0,1 scale2=0.5 bias2=0.5",
                   "scale=0.5 bias=0.25 matrix=1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1 clamp=final",
                   "kernel=gaussian kernelsize=5,3 wrap=mirror scalec=0.5,2,1,1 biasc=0.1",
                   "kernel=emboss_ne wrap=black bordervalue=0.5 correlate=1 divisor=2 preservealpha=1",
                   "table1=0,0.25,1 interpolate=1 matrix=0.5,0.5,0,0,1,0,0,0,1 table2=0,0.5,1 clamp=stages"};
  return info;
}

}  // namespace ops
}  // namespace tessera
