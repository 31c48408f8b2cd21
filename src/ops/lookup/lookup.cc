// Pixel textures: a coordinate image looks up a table of one to four dimensions.
#include "tessera/ops/lookup.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>

#include "graph/op.h"
#include "model/lookup_settings.h"
#include "model/table_axis.h"
#include "ops/lookup/footprints.h"
#include "ops/lookup/lookup_ops.h"
#include "ops/lookup/lookup_stage.h"
#include "ops/modifiers.h"
#include "ops/wrap.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::ops {
namespace {

using model::LookupSettings;

std::string ChannelList(const ImageSpec& spec) {
  std::string text;
  for (const std::string& name : spec.channels) {
    if (text.size() > 60) return text + ",…";
    text += (text.empty() ? "" : ",") + name;
  }
  return text;
}

class LookupOp final : public graph::OpWith<LookupSettings> {
 public:
  explicit LookupOp(LookupSettings settings) : OpWith(std::move(settings)) {
    if (!params().table.empty()) levels_ = Levels(params().table, params().lookup, nullptr);
  }
  std::string Name() const override { return "lookup"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool NeedsWhole(int k) const override { return k == 1; }
  std::string Describe() const override {
    return "lookup " + std::to_string(params().table.empty() ? params().layout.dims : params().table.dims()) +
           "-D";
  }

  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    ImageSpec out = in[0];
    if (params().table.empty()) {
      out.channels = in[1].channels;
      out.alpha = in[1].alpha;
      out.type = in[1].type;
    } else {
      out.channels = DefaultChannelNames(params().table.channels());
      out.alpha = ImageSpec(0, 0, params().table.channels()).alpha;
      out.type = params().table.storage();
    }
    if (in[0].data_window.empty()) return out;  // nothing is looked up, so the table may be empty too
    const LookupParams& p = params().lookup;
    const int dims = Dims(in);
    if (model::HasMipChain(p.filter) && dims == 4) {
      throw Error("lookup", "found the filter " +
                                std::string(p.filter == TableFilter::kMipmap ? "mipmap"
                                            : p.filter == TableFilter::kEwa  ? "ewa"
                                                                             : "trilinear") +
                                " for 4 dimensions, expected 1 to 3");
    }
    const auto needed = static_cast<size_t>(dims) + (p.projective ? 1 : 0);
    if (!p.axes.empty() && p.axes.size() != needed) {
      throw Error("lookup", "found " + std::to_string(p.axes.size()) + " axes, expected " +
                                std::to_string(needed) + " coordinate channels");
    }
    for (const int axis : Axes(dims)) RequireChannel(in[0], axis, "coordinate");
    if (p.mask >= 0) RequireChannel(in[0], p.mask, "mask");
    return out;
  }

  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    LookupPlan plan;
    plan.params = params().lookup;
    plan.window = context.inputs[0].data_window;
    plan.coordinate_channels = context.inputs[0].channel_count();
    if (plan.window.empty()) return MakeLookupStage(plan);
    plan.dims = Dims(context.inputs);
    plan.axes = Axes(plan.dims);
    if (!levels_.empty()) {
      plan.groups = {levels_};
      return MakeLookupStage(plan);
    }
    const ConstImageView& image = context.whole[1];
    for (int first = 0; first < image.channels; first += 4) {
      ConstImageView part = image;
      part.data += 4 * first;
      part.channels = std::min(4, image.channels - first);
      LookupParams group = plan.params;
      const auto skip = std::min(static_cast<size_t>(first), group.border.size());
      group.border.erase(group.border.begin(), group.border.begin() + static_cast<ptrdiff_t>(skip));
      if (model::HasMipChain(plan.params.filter)) {
        plan.groups.push_back(Levels(TableFromImage(part, params().layout), group, &context.workers));
      } else {
        plan.groups.push_back({std::make_shared<const Grid>(part, params().layout, group, &context.workers)});
      }
    }
    return MakeLookupStage(plan);
  }

 private:
  using GridLevels = std::vector<std::shared_ptr<const Grid>>;

  static GridLevels Levels(const Table& table, const LookupParams& params, const graph::Workers* workers) {
    GridLevels levels;
    if (!model::HasMipChain(params.filter) || table.dims() > 3) {
      levels.push_back(std::make_shared<const Grid>(table, params, workers));
      return levels;
    }
    for (const Table& level : MipChain(table, MipFilter::kBox, params.wrap, params.border)) {
      levels.push_back(std::make_shared<const Grid>(level, params, workers));
    }
    return levels;
  }
  int Dims(std::span<const ImageSpec> in) const {
    if (!params().table.empty()) return params().table.dims();
    return static_cast<int>(model::TableSizes(in[1].data_window, 1, params().layout).size());
  }
  std::vector<int> Axes(int dims) const {
    std::vector<int> axes = params().lookup.axes;
    const int count = dims + (params().lookup.projective ? 1 : 0);
    for (int a = 0; axes.size() < static_cast<size_t>(count); ++a) axes.push_back(a);
    return axes;
  }
  static void RequireChannel(const ImageSpec& coords, int channel, const char* what) {
    if (channel >= 0 && channel < coords.channel_count()) return;
    throw DataError("lookup", "found " + std::to_string(coords.channel_count()) + " channels (" +
                                  ChannelList(coords) + "), expected channel " + std::to_string(channel) +
                                  " as a " + what);
  }

  GridLevels levels_;  // of a table given by value; empty for a node
};

void Check(const LookupParams& params) {
  for (const double v : params.border) {
    if (!(std::fabs(v) <= 3.4028234e38))
      throw Error("lookup border", "found " + std::to_string(v) + ", expected finite numbers");
  }
  if (params.anisotropy < 1 || params.anisotropy > kMostAnisotropy) {
    throw Error("lookup", "found the anisotropy " + std::to_string(params.anisotropy) + ", expected 1 to " +
                              std::to_string(kMostAnisotropy));
  }
  for (const Wrap wrap : params.wrap) {
    RequireWrap("lookup", wrap, {Wrap::kClamp, Wrap::kGlClamp, Wrap::kBlack, Wrap::kRepeat, Wrap::kMirror});
  }
}

TableFilter FilterOf(const std::string& name) {
  return name == "nearest"       ? TableFilter::kNearest
         : name == "tetrahedral" ? TableFilter::kTetrahedral
         : name == "cubic"       ? TableFilter::kCubic
         : name == "mipmap"      ? TableFilter::kMipmap
         : name == "trilinear"   ? TableFilter::kTrilinear
         : name == "ewa"         ? TableFilter::kEwa
                                 : TableFilter::kLinear;
}

std::vector<Wrap> WrapsOf(const std::string& text) {
  const std::vector<std::string> names = {"clamp", "glclamp", "black", "repeat", "mirror"};
  std::vector<Wrap> wraps;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const auto found = std::find(names.begin(), names.end(), word);
    if (found == names.end()) {
      const std::string near = Nearest(word, names);
      throw Error("lookup:wrap", "found \"" + word.substr(0, 40) +
                                     "\", expected clamp, glclamp, black, repeat or mirror" +
                                     (near.empty() ? "" : "; did you mean " + near + "?"));
    }
    wraps.push_back(WrapNamed(word));
    begin = end + 1;
  }
  if (wraps.size() > 4) {
    throw Error("lookup:wrap",
                "found " + std::to_string(wraps.size()) + " modes, expected one, or one per axis");
  }
  return wraps;
}

std::vector<int> Whole(const std::string& name, const std::vector<double>& numbers) {
  std::vector<int> out;
  for (const double v : numbers) {
    if (v != std::floor(v))
      throw Error("lookup:" + name, "found " + std::to_string(v) + ", expected whole numbers");
    out.push_back(static_cast<int>(v));
  }
  return out;
}

Node MakeLookup(std::span<const Node> in, const Arguments& a, const ImageSpec*) {
  TableLayout layout;
  layout.dims = a.Integer("dims");
  layout.slices = Whole("slices", a.Numbers("slices"));
  layout.align = a.Text("align") == "ends" ? TableAlign::kEnds : TableAlign::kCentres;
  LookupParams p;
  p.filter = FilterOf(a.Text("filter"));
  p.cubic = a.Text("cubic") == "mitchell"  ? CubicKernel::kMitchell
            : a.Text("cubic") == "bspline" ? CubicKernel::kBSpline
                                           : CubicKernel::kCatmullRom;
  p.anisotropy = a.Integer("aniso");
  p.wrap = WrapsOf(a.Text("wrap"));
  p.border = a.Numbers("bordervalue");
  if (p.border.size() == 1) p.border.resize(in[1].spec().channels.size(), p.border[0]);
  p.axes = Whole("axes", a.Numbers("axes"));
  p.projective = a.Flag("projective");
  p.propagate_nan = a.Flag("nan");
  p.mask = a.Integer("mask");
  const Node result = Lookup(in[0], in[1], layout, p);
  if (a.Flag("count") && a.notes != nullptr) {
    const auto dims = static_cast<int>(model::TableSizes(in[1].spec().data_window, 1, layout).size());
    a.notes->push_back(CountLostCoordinates(in[0], dims, p).Summary());
  }
  return result;
}

}  // namespace

OpInfo LookupInfo() {
  OpInfo info;
  info.name = "lookup";
  info.family = "lookup";
  info.inputs = 2;
  info.summary = "Pixel texture: the first image's channels look up the second";
  info.help =
      "COORDS TABLE --lookup. The channels of COORDS are s,t,r,q in [0,1] across TABLE; the result has "
      "TABLE's channels. s runs along x, t along y; a third and a fourth axis are slices stacked along y "
      "(slices=N: N slices; slices=N,M: N varies faster). Entry i of N lies at (i + 1/2)/N (align=centres) "
      "or at i/(N-1) (align=ends, for tabulated functions).\n"
      "Filters: nearest; linear (2^D entries); tetrahedral (D+1 entries of a simplex); cubic (4^D); mipmap "
      "(linear, between two levels chosen by the differences of neighbouring coordinates, the smaller of "
      "both sides at an object's edge); trilinear and ewa follow what a pixel covers of the table, by those "
      "differences, in any direction: the mean of up to aniso= such lookups along its longer axis, as graphics "
      "hardware does it, and a Gaussian under an ellipse (Heckbert 1989); where a pixel covers no more than an "
      "entry they are linear, bit for bit. Coordinates are not rounded.\n"
      "Wrap, one mode or one per axis: clamp (to the edge entry), glclamp (OpenGL 1.x: half border colour at "
      "0 and 1), black (the border colour, bordervalue=, 0 by default), repeat, mirror. projective=1 divides by the channel after the last coordinate; where it "
      "is not positive the result is the border colour. A coordinate that is NaN (infinite, with repeat or "
      "mirror) gives the border colour, or NaN with nan=1; count=1 prints how many there are and where the "
      "first is, for one more evaluation of COORDS. Where channel mask= is 0 the pixel keeps COORDS' bits. "
      "NaN and infinite entries reach only results in which they have weight. Source: Heidrich et al. 1999, "
      "2 and 7; Williams 1983; McReynolds et al. 1997, 5.3.";
  info.help += " The table is held in memory whole.";
  info.bound =
      "3 u (four dimensions 4 u; cubic in D dimensions 8 u D 1.25^(D-1), measured 5.5, 9.8, 10.6 and 15 u) times "
      "the largest entry read; but for cubic, an axis whose positions are "
      "no exact products (its size, with align=ends less 1, is no power of two) adds u/2 of the largest "
      "difference of entries read; trilinear and ewa u more, and 2 N u (10 N u beyond the table) of that difference "
      "for each axis of N entries of a level; entries are exact";
  info.bound_u = 4;
  ParamInfo wrap = WrapModifier({"clamp", "glclamp", "black", "repeat", "mirror"}, "clamp",
                                "clamp, glclamp, black, repeat or mirror; one, or one per axis");
  wrap.type = ParamType::kText;  // a list
  wrap.choices = {};
  info.modifiers = {
      IntegerModifier("dims", "0", 0, 4,
                      "dimensions of the table; 0: 2 and one for each number of slices, 1 for one row"),
      ChoiceModifier("filter", {"linear", "nearest", "tetrahedral", "cubic", "mipmap", "trilinear", "ewa"},
                     "how entries are combined"),
      wrap,
      FlagModifier("projective", "divide by the next channel"),
      ListModifier("bordervalue", "", 64, -1e38, 1e38,
                   "the border colour, one value, or one per channel of the table"),
      ChoiceModifier("align", {"centres", "ends"}, "where the entries lie"),
      ListModifier("slices", "", 2, 1, 1e6, "slices along y: N, or N,M"),
      ListModifier("axes", "", 5, 0, 65535, "channels of COORDS that are s,t,... (and q); default 0,1,..."),
      IntegerModifier("mask", "-1", -1, 65535, "channel of COORDS that is 0 where nothing is looked up"),
      OnlyWith("filter=trilinear|ewa",
               IntegerModifier("aniso", "16", 1, kMostAnisotropy,
                               "longest length of what a pixel covers, in widths of it; longer is widened")),
      ChoiceModifier("cubic", {"catmullrom", "mitchell", "bspline"}, "kernel of filter=cubic"),
      FlagModifier("nan", "NaN coordinates give NaN"),
      FlagModifier("count", "print how many pixels have coordinates that are no numbers")};
  info.make = MakeLookup;
  info.examples = {"dims=2",
                   "dims=2 filter=nearest wrap=repeat",
                   "dims=2 filter=cubic wrap=mirror",
                   "dims=2 filter=cubic cubic=mitchell wrap=black bordervalue=0.5,0.25",
                   "dims=2 filter=tetrahedral wrap=repeat,mirror align=ends",
                   "dims=2 wrap=glclamp bordervalue=1,1,1,1 projective=1",
                   "dims=2 wrap=black mask=2 axes=1,0",
                   "dims=2 filter=trilinear aniso=8 wrap=repeat",
                   "dims=2 filter=ewa wrap=clamp,mirror",
                   "slices=1 filter=trilinear aniso=4 wrap=black bordervalue=0.3",
                   "slices=1 filter=tetrahedral wrap=mirror",
                   "slices=1,1 axes=0,1,2,0"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Lookup(const Node& coords, const Table& table, const LookupParams& params) {
  if (table.empty()) throw Error("lookup", "found an empty table, expected 1 to 4 dimensions");
  ops::Check(params);
  model::LookupSettings settings;
  settings.table = table;
  settings.lookup = params;
  return graph::MakeNode(std::make_shared<const ops::LookupOp>(std::move(settings)), {coords});
}

Node Lookup(const Node& coords, const Node& table, const TableLayout& layout, const LookupParams& params) {
  ops::Check(params);
  model::LookupSettings settings;
  settings.layout = layout;
  settings.lookup = params;
  return graph::MakeNode(std::make_shared<const ops::LookupOp>(std::move(settings)), {coords, table});
}

}  // namespace tessera
