// Lines from depth, normals, ids and masks, and halos of lines.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "ops/composite/composite_ops.h"
#include "ops/modifiers.h"
#include "ops/shade/aov_inputs.h"
#include "tessera/error_kind.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/outline.h"
#include "tessera/ops/shade.h"

namespace tessera {
namespace ops {
namespace {

const float* Pixel(const ConstImageView& v, int x, int y) {
  return reinterpret_cast<const float*>(v.At(x, y));
}

ImageSpec LineSpec(ImageSpec spec) {
  spec.channels = {"Y"};
  spec.alpha = -1;
  return spec;
}

// An operation on a neighbourhood that gives one channel, from a function of the tile.
class LineOp final : public graph::Op {
 public:
  using Run = std::function<void(const graph::TileArgs&)>;
  LineOp(std::string name, std::any parameters, ImageSpec spec, int reach, Wrap wrap, Run run)
      : name_(std::move(name)),
        parameters_(std::move(parameters)),
        spec_(std::move(spec)),
        reach_(reach),
        wrap_(wrap),
        run_(std::move(run)) {}
  std::string Name() const override { return name_; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  const std::any& Parameters() const override { return parameters_; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireSameWindow(name_, inputs);
    return spec_;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<Stage>(reach_, wrap_, run_);
  }

 private:
  class Stage final : public graph::TileStage {
   public:
    Stage(int reach, Wrap wrap, LineOp::Run run) : reach_(reach), wrap_(wrap), run_(std::move(run)) {}
    Roi InputRoi(int, const Roi& out) const override { return Inflate(out, reach_, reach_); }
    Wrap InputBorder(int) const override { return wrap_; }
    void Run(const graph::TileArgs& args) const override { run_(args); }

   private:
    int reach_;
    Wrap wrap_;
    LineOp::Run run_;
  };

  std::string name_;
  std::any parameters_;
  ImageSpec spec_;
  int reach_;
  Wrap wrap_;
  Run run_;
};

// value(x, y) of every pixel of the tile.
template <class F>
void FillTile(const graph::TileArgs& args, const F& value) {
  const Roi& o = args.out.roi;
  for (int y = o.y0; y < o.y1; ++y) {
    auto* const out = reinterpret_cast<float*>(args.out.At(o.x0, y));
    for (int x = o.x0; x < o.x1; ++x) out[x - o.x0] = value(x, y);
  }
}

double Reciprocal(float z) { return z == 0 || std::isnan(z) ? 0.0 : 1.0 / double{z}; }

// The second difference of 1/z, 0 where it is within the tolerance.
double Bend(float before, float here, float after, double tolerance) {
  const double a = Reciprocal(before), b = Reciprocal(here), c = Reciprocal(after);
  const double bend = a - 2 * b + c;
  return std::fabs(bend) > tolerance * std::max({std::fabs(a), std::fabs(b), std::fabs(c)}) ? bend : 0;
}

bool Turns(const float* n, const float* m, double cosine) {
  double dot = 0, nn = 0, mm = 0;
  for (int i = 0; i < 3; ++i) {
    dot += double{n[i]} * double{m[i]}, nn += double{n[i]} * double{n[i]}, mm += double{m[i]} * double{m[i]};
  }
  // Also true where a length is 0 or anything is NaN.
  return !(nn > 0 && mm > 0 && std::fabs(dot) >= cosine * std::sqrt(nn * mm));
}

// The tests to make: which inputs there are, in the order depth, normal, id.
struct EdgeTests {
  bool depth = false, normal = false;
  double depth_tolerance = 0, cosine = 0;
  bool smooth = false;
};

// The tests at the pixels of one tile, which has enough of its surroundings; beyond the window there is
// nothing.
class EdgePixels {
 public:
  EdgePixels(const EdgeTests& tests, const Roi& window, const graph::TileArgs& args)
      : e_(tests), window_(window), in_(args.in) {}

  // No normal, or nothing in any distance.
  bool Background(int x, int y) const {
    if (e_.depth) {
      const float z = *Pixel(in_[0], x, y);
      if (z == 0 || !std::isfinite(z)) return true;  // its reciprocal is 0
    }
    if (!e_.normal) return false;
    const float* const n = Pixel(in_[e_.depth ? 1 : 0], x, y);
    return !(double{n[0]} * double{n[0]} + double{n[1]} * double{n[1]} + double{n[2]} * double{n[2]} > 0);
  }
  // How the depth bends at a pixel along the row (dx = 1) or the column (dy = 1).
  double DepthBend(int x, int y, int dx, int dy) const {
    if (!e_.depth || !Inside(x - dx, y - dy) || !Inside(x + dx, y + dy)) return 0;
    const ConstImageView& z = in_[0];
    return Bend(*Pixel(z, x - dx, y - dy), *Pixel(z, x, y), *Pixel(z, x + dx, y + dy), e_.depth_tolerance);
  }
  // Whether normals or ids of two neighbours differ.
  bool Differ(int x, int y, int dx, int dy) const {
    for (size_t k = e_.depth ? 1 : 0; k < in_.size(); ++k) {
      const float *here = Pixel(in_[k], x, y), *there = Pixel(in_[k], x + dx, y + dy);
      const bool normals = e_.normal && k == (e_.depth ? 1 : 0);
      if (normals ? Turns(here, there, e_.cosine) : !std::equal(here, here + in_[k].channels, there))
        return true;
    }
    return false;
  }
  bool Inside(int x, int y) const { return window_.Contains({x, y, x + 1, y + 1}); }

  // A line is on the pixel.
  bool On(int x, int y) const {
    if (DepthBend(x, y, 1, 0) == 0 && DepthBend(x, y, 0, 1) == 0 && !DiffersFromAny(x, y)) return false;
    return !Background(x, y);  // asked last: most pixels have no line
  }
  // A line runs between a pixel and the next one along the row or column: of the depth where it bends one
  // way here and the other way there.
  bool Between(int x, int y, int dx, int dy) const {
    if (!Inside(x, y) || !Inside(x + dx, y + dy)) return false;
    const bool here = Background(x, y), there = Background(x + dx, y + dy);
    if (here || there) return here != there;
    return DepthBend(x, y, dx, dy) * DepthBend(x + dx, y + dy, dx, dy) < 0 || Differ(x, y, dx, dy);
  }
  // The depth bends at the pixel, and no line is beside it.
  bool Crease(int x, int y) const {
    const auto along = [&](int dx, int dy) {
      return DepthBend(x, y, dx, dy) != 0 && !Between(x, y, dx, dy) && !Between(x - dx, y - dy, dx, dy);
    };
    return !Background(x, y) && (along(1, 0) || along(0, 1));
  }

 private:
  bool DiffersFromAny(int x, int y) const {
    for (const auto& [dx, dy] : {std::pair(-1, 0), std::pair(1, 0), std::pair(0, -1), std::pair(0, 1)}) {
      if (Inside(x + dx, y + dy) && Differ(x, y, dx, dy)) return true;
    }
    return false;
  }

  const EdgeTests& e_;
  const Roi& window_;
  std::span<const ConstImageView> in_;
};

void RunEdges(const EdgeTests& e, const Roi& window, const graph::TileArgs& args) {
  const EdgePixels pixels(e, window, args);
  FillTile(args, [&](int x, int y) { return pixels.On(x, y) ? 1.0f : 0.0f; });
}

// Pixels of a square of 5 x 5 that can be reached from its middle without crossing a line: `right` and `down`
// have bits where one runs to the right of, or below, a pixel.
uint32_t OwnSide(uint32_t right, uint32_t down) {
  constexpr uint32_t kAll = (1u << 25) - 1, kNotLast = 0x0f7bdef;  // columns 0 to 3
  const uint32_t across = ~right & kNotLast, below = ~down & kAll;
  uint32_t side = 1u << 12;
  for (uint32_t before = 0; before != side;) {
    before = side;
    side |= ((side & across) << 1) | ((side >> 1) & across) | ((side & below) << 5) | ((side >> 5) & below);
    side &= kAll;
  }
  return side;
}

// Coverage by a line one pixel wide along the boundary of a side that has this share of the weights around
// the pixel. They are nearly a Gaussian's of deviation 1: the boundary is where its integral has the share.
double LineCoverage(uint32_t side) {
  static constexpr int kBinomial[] = {1, 4, 6, 4, 1};
  int share = 0;
  for (int k = 0; k < 25; ++k) share += (side >> k & 1) != 0 ? kBinomial[k / 5] * kBinomial[k % 5] : 0;
  if (share <= 128) return 1;
  if (share >= 216) return 0;  // more than a pixel away
  const double y = 2.5066282746310002 * (share / 256.0 - 0.5), q = y * y;
  return std::max(1 - y * (1 + q * (1.0 / 6 + q * (7.0 / 120 + q * (127.0 / 5040)))), 0.0);
}

void RunSmoothEdges(const EdgeTests& e, const Roi& window, const graph::TileArgs& args) {
  const EdgePixels pixels(e, window, args);
  const Roi &o = args.out.roi, wide = Inflate(o, 2, 2);
  // Bit 0: a line to the right, bit 1: below.
  const auto width = static_cast<size_t>(wide.width());
  uint8_t* const lines = args.scratch.Allocate<uint8_t>(width * static_cast<size_t>(wide.height()));
  for (int y = wide.y0; y < wide.y1; ++y) {
    uint8_t* const row = lines + static_cast<size_t>(y - wide.y0) * width;
    for (int x = wide.x0; x < wide.x1; ++x) {
      // What lies between the last pixel and the next is of no square, and the next one's bends are not
      // there.
      const bool right = x + 1 < wide.x1 && pixels.Between(x, y, 1, 0);
      const bool below = y + 1 < wide.y1 && pixels.Between(x, y, 0, 1);
      row[x - wide.x0] = static_cast<uint8_t>((right ? 1 : 0) | (below ? 2 : 0));
    }
  }
  FillTile(args, [&](int x, int y) {
    uint32_t right = 0, down = 0;
    for (int j = 0; j < 5; ++j) {
      const uint8_t* const row = lines + static_cast<size_t>(y - o.y0 + j) * width + (x - o.x0);
      for (int i = 0; i < 5; ++i) {
        right |= (row[i] & 1u) << (5 * j + i), down |= (row[i] >> 1 & 1u) << (5 * j + i);
      }
    }
    const double line = (right | down) == 0 ? 0 : LineCoverage(OwnSide(right, down));
    return e.depth && line < 1 && pixels.Crease(x, y) ? 1.0f : static_cast<float>(line);
  });
}

void RunOutline(const OutlineParams& p, const graph::TileArgs& args) {
  const ConstImageView& in = args.in[0];
  const auto inside = [&](int x, int y) { return *Pixel(in, x, y) > 0.5f; };
  FillTile(args, [&](int x, int y) {
    const int k = inside(x - 1, y) + inside(x + 1, y) + inside(x, y - 1) + inside(x, y + 1);
    const bool inner = inside(x, y) && k < 4, outer = !inside(x, y) && k > 0;
    switch (p.kind) {
      case OutlineKind::kInner:
        return inner ? 1.0f : 0.0f;
      case OutlineKind::kOuter:
        return outer ? 1.0f : 0.0f;
      case OutlineKind::kBoth:
        return inner || outer ? 1.0f : 0.0f;
      case OutlineKind::kCount:
        break;
    }
    return 0.25f * static_cast<float>(k);
  });
}

void RunHalo(const HaloParams& p, const graph::TileArgs& args) {
  const ConstImageView &lines = args.in[0], &depth = args.in[1];
  FillTile(args, [&](int x, int y) {
    const float line = *Pixel(lines, x, y), z = *Pixel(depth, x, y);
    if (!(line > 0)) return 0.0f;
    for (int dy = -p.radius; dy <= p.radius; ++dy) {
      const int reach = static_cast<int>(std::sqrt(double(p.radius * p.radius - dy * dy)));
      const float* const row = Pixel(lines, x - reach, y + dy);
      const float* const row_z = Pixel(depth, x - reach, y + dy);
      for (int i = 0; i <= 2 * reach; ++i) {
        if (row[i] > 0 && double{z} > double{row_z[i]} + p.epsilon) return 0.0f;
      }
    }
    return std::isnan(z) ? 0.0f : line;
  });
}

const std::vector<std::string>& OutlineNames() {
  static const std::vector<std::string> kNames = {"inner", "outer", "both", "count"};
  return kNames;
}

// Three channels of normals: as named, or those that a renderer names so; none: empty.
std::vector<int> FindNormals(const ImageSpec& spec, const std::string& names) {
  std::vector<int> found;
  if (!names.empty()) {
    size_t start = 0;
    while (start <= names.size()) {
      const size_t comma = std::min(names.find(',', start), names.size());
      found.push_back(FindDepth("edges", spec, names.substr(start, comma - start)));
      start = comma + 1;
    }
    if (found.size() != 3) {
      throw Error("edges", "found " + std::to_string(found.size()) + " channels of normals, expected three");
    }
    return found;
  }
  found = FindAov(spec, Aov::kNormal);
  return found.size() == 3 ? found : std::vector<int>{};
}

}  // namespace

OpInfo EdgesInfo() {
  OpInfo info;
  info.name = "edges";
  info.family = "composite";
  info.summary = "Lines where depth bends, normals turn or ids differ";
  info.help =
      "From a picture with its AOVs to one channel, 1 on lines and 0 elsewhere. Depth: the second difference "
      "of 1/z along the row or column exceeds depth= times the largest 1/z of the three pixels; planes give "
      "nothing however tilted. Normals: the angle to one of the four neighbours exceeds normal= degrees, or "
      "its normal is 0 or NaN. Ids: a neighbour's differs. Background, whose normal is 0 or NaN or whose depth "
      "is 0, NaN or infinite, has no lines: its neighbour on the object has. smooth=1: lines of one pixel, "
      "antialiased, along the middle between pixels that differ (half of them on the background), laid "
      "through the 5 x 5 pixels around each; creases of the depth, which lie on pixels, stay as they are. "
      "Each test is made where its channels are: depthchannel= and normalchannels= (three; default by the "
      "names that renderers give them), idchannel=. Silhouettes of a mask are --outline, lines that stop "
      "behind others --halo. "
      "Compare McReynolds et al. 1997, 15.3.";
  info.bound = "exact; smooth=1: 1 u";
  info.bound_u = 1;
  info.modifiers = {NumberModifier("depth", "0.01", 0, 1e30, "tolerance, relative to 1/z"),
                    NumberModifier("normal", "30", 0, 90, "degrees between neighbours' normals"),
                    TextModifier("depthchannel", "name or number of the depth channel"),
                    TextModifier("normalchannels", "names or numbers of three channels, comma-separated"),
                    TextModifier("idchannel", "name or number of a channel whose changes are lines"),
                    FlagModifier("smooth", "lines of one pixel, antialiased")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    EdgeInputs inputs;
    const int depth = FindDepth("edges", in[0].spec(), a.Text("depthchannel"));
    const std::vector<int> normals = FindNormals(in[0].spec(), a.Text("normalchannels"));
    if (depth >= 0) inputs.depth = ChannelOf(in[0], depth);
    if (!normals.empty()) {
      std::vector<ChannelChoice> choices;
      for (const int c : normals) choices.push_back({c, 0, {}});
      inputs.normal = SelectChannels(in[0], choices);
    }
    if (!a.Text("idchannel").empty()) {
      inputs.id = ChannelOf(in[0], FindDepth("edges", in[0].spec(), a.Text("idchannel")));
    }
    return Edges(inputs, {a.Number("depth"), a.Number("normal"), a.Flag("smooth")});
  };
  info.examples = {"depthchannel=2 normalchannels=0,1,2", "depthchannel=0 depth=0.5",
                   "normalchannels=1,2,0 normal=60", "idchannel=1",
                   "depthchannel=0 depth=0.4 normalchannels=0,1,2 normal=50 smooth=1"};
  return info;
}

OpInfo OutlineInfo() {
  OpInfo info;
  info.name = "outline";
  info.family = "composite";
  info.summary = "Silhouette of a mask by counting neighbours";
  info.help =
      "The mask is the first channel above 1/2; k counts its pixels among the four neighbours. kind=inner: "
      "mask pixels with k < 4; outer: pixels beside the mask, k > 0; both; count: k / 4. Outside the image "
      "nothing is mask; clamp=1 repeats the edge. The result has one channel. Compare "
      "McReynolds et al. 1997, 15.3.";
  info.bound = "exact";
  info.modifiers = {ChoiceModifier("kind", OutlineNames(), "which pixels are marked"),
                    FlagModifier("clamp", "1: the mask goes on beyond the image's edge")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Outline(in[0], {ChoiceOf<OutlineKind>(OutlineNames(), a.Text("kind")), a.Flag("clamp")});
  };
  info.examples = {"", "kind=outer", "kind=both clamp=1", "kind=count"};
  return info;
}

OpInfo HaloInfo() {
  OpInfo info;
  info.name = "halo";
  info.family = "composite";
  info.inputs = 2;
  info.summary = "Break lines that pass behind nearer ones";
  info.help =
      "LINES DEPTH --halo: a line pixel (first channel of LINES above 0) is kept where its depth (of an "
      "AOV file by its name, else the first channel of DEPTH) is at most epsilon= above that of every line "
      "pixel within radius= pixels, else it becomes 0; epsilon must reach radius times the depth's slope "
      "along a line, or lines erase themselves. "
      "One channel. Source: McReynolds et al. 1997, 15.2.";
  info.bound = "exact";
  info.modifiers = {
      IntegerModifier("radius", "3", 0, 64, "pixels on either side of a line that it keeps free"),
      NumberModifier("epsilon", "0.01", 0, 1e30, "depth units that count as equal")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Halo(in[0], DepthsOf(in[1]), {a.Integer("radius"), a.Number("epsilon")});
  };
  info.examples = {"", "radius=7 epsilon=0.25", "radius=0"};
  return info;
}

}  // namespace ops

Node Edges(const EdgeInputs& inputs, const EdgeParams& params) {
  if (!inputs.depth && !inputs.normal && !inputs.id) {
    throw DataError(
        "edges",
        "found neither depth nor normals nor ids, expected at least one (depthchannel=, normalchannels=, "
        "idchannel= name them)");
  }
  const ops::EdgeTests e{static_cast<bool>(inputs.depth), static_cast<bool>(inputs.normal),
                         params.depth_tolerance, std::cos(params.normal_degrees * std::numbers::pi / 180),
                         params.smooth};
  std::vector<Node> nodes;
  if (inputs.depth) nodes.push_back(ops::ChannelOf(inputs.depth, 0));
  if (inputs.normal) {
    graph::RequireColor("edges", inputs.normal.spec());
    nodes.push_back(
        SelectChannels(inputs.normal, std::vector<ChannelChoice>{{0, 0, {}}, {1, 0, {}}, {2, 0, {}}}));
  }
  if (inputs.id) nodes.push_back(inputs.id);
  const ImageSpec spec = ops::LineSpec(nodes[0].spec());
  const auto run = [e, window = spec.data_window](const graph::TileArgs& args) {
    e.smooth ? ops::RunSmoothEdges(e, window, args) : ops::RunEdges(e, window, args);
  };
  return graph::MakeNode(std::make_shared<const ops::LineOp>("edges", std::pair(inputs, params), spec,
                                                             params.smooth ? 3 : 1, Wrap::kClamp, run),
                         std::move(nodes));
}

Node Outline(const Node& mask, const OutlineParams& params) {
  const auto run = [params](const graph::TileArgs& args) { ops::RunOutline(params, args); };
  return graph::MakeNode(std::make_shared<const ops::LineOp>("outline", params, ops::LineSpec(mask.spec()), 1,
                                                             params.clamp ? Wrap::kClamp : Wrap::kBlack, run),
                         {ops::ChannelOf(mask, 0)});
}

Node Halo(const Node& lines, const Node& depth, const HaloParams& params) {
  if (params.radius < 0 || params.radius > 64) {
    throw Error("halo", "found radius " + std::to_string(params.radius) + ", expected 0 to 64");
  }
  const auto run = [params](const graph::TileArgs& args) { ops::RunHalo(params, args); };
  return graph::MakeNode(std::make_shared<const ops::LineOp>("halo", params, ops::LineSpec(lines.spec()),
                                                             params.radius, Wrap::kBlack, run),
                         {ops::ChannelOf(lines, 0), ops::ChannelOf(depth, 0)});
}

}  // namespace tessera
