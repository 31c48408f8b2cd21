// Lines from depth, normals, ids and masks, and halos of lines.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "ops/composite/composite_ops.h"
#include "ops/modifiers.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/outline.h"

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
  LineOp(std::string name, std::any parameters, ImageSpec spec, int reach, graph::Border border, Run run)
      : name_(std::move(name)),
        parameters_(std::move(parameters)),
        spec_(std::move(spec)),
        reach_(reach),
        border_(border),
        run_(std::move(run)) {}
  std::string Name() const override { return name_; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  const std::any& Parameters() const override { return parameters_; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    graph::RequireSameWindow(name_, inputs);
    return spec_;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<Stage>(reach_, border_, run_);
  }

 private:
  class Stage final : public graph::TileStage {
   public:
    Stage(int reach, graph::Border border, LineOp::Run run)
        : reach_(reach), border_(border), run_(std::move(run)) {}
    Roi InputRoi(int, const Roi& out) const override { return Inflate(out, reach_, reach_); }
    graph::Border InputBorder(int) const override { return border_; }
    void Run(const graph::TileArgs& args) const override { run_(args); }

   private:
    int reach_;
    graph::Border border_;
    LineOp::Run run_;
  };

  std::string name_;
  std::any parameters_;
  ImageSpec spec_;
  int reach_;
  graph::Border border_;
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

bool Bends(float before, float here, float after, double tolerance) {
  const double a = Reciprocal(before), b = Reciprocal(here), c = Reciprocal(after);
  return std::fabs(a - 2 * b + c) > tolerance * std::max({std::fabs(a), std::fabs(b), std::fabs(c)});
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
};

void RunEdges(const EdgeTests& e, const Roi& window, const graph::TileArgs& args) {
  FillTile(args, [&](int x, int y) {
    constexpr int kSteps[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    size_t k = 0;
    if (e.depth) {
      const ConstImageView& z = args.in[k++];
      const float here = *Pixel(z, x, y);
      const bool row = x > window.x0 && x + 1 < window.x1, column = y > window.y0 && y + 1 < window.y1;
      if (row && Bends(*Pixel(z, x - 1, y), here, *Pixel(z, x + 1, y), e.depth_tolerance)) return 1.0f;
      if (column && Bends(*Pixel(z, x, y - 1), here, *Pixel(z, x, y + 1), e.depth_tolerance)) return 1.0f;
    }
    for (; k < args.in.size(); ++k) {
      const ConstImageView& in = args.in[k];
      const bool normals = e.normal && k == (e.depth ? 1 : 0);
      for (const auto& [dx, dy] : kSteps) {
        if (!window.Contains({x + dx, y + dy, x + dx + 1, y + dy + 1})) continue;
        const float *here = Pixel(in, x, y), *there = Pixel(in, x + dx, y + dy);
        if (normals ? Turns(here, there, e.cosine) : !std::equal(here, here + in.channels, there))
          return 1.0f;
      }
    }
    return 0.0f;
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

// Three channels of normals: as named, or the three whose names end in x, y and z below a layer N or normal.
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
  for (int c = 0; c + 2 < spec.channel_count(); ++c) {
    std::string name = spec.channels[static_cast<size_t>(c)];
    std::ranges::transform(name, name.begin(), [](unsigned char x) { return std::tolower(x); });
    const size_t dot = name.rfind('.');
    const std::string layer = name.substr(0, dot == std::string::npos ? name.size() - 1 : dot);
    const bool normal = layer == "n" || layer == "normal" || layer == "normals" ||
                        layer.ends_with(".normal") || layer.ends_with(".n");
    if (normal && name.back() == 'x') return {c, c + 1, c + 2};
  }
  return {};
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
      "nothing however tilted. Normals: the angle to one of the four neighbours exceeds normal= degrees (a "
      "zero or NaN normal always). Ids: a neighbour's differs. Each test is made where its channels are: "
      "depthchannel= (default the first named Z or depth), normalchannels= (three; default N.x,N.y,N.z and "
      "the like), idchannel=. Silhouettes of a mask are --outline, lines that stop behind others --halo. "
      "Compare McReynolds et al. 1997, 15.3.";
  info.bound = "exact";
  info.modifiers = {NumberModifier("depth", "0.01", 0, 1e30, "tolerance, relative to 1/z"),
                    NumberModifier("normal", "30", 0, 90, "degrees between neighbours' normals"),
                    TextModifier("depthchannel", "name or number of the depth channel"),
                    TextModifier("normalchannels", "names or numbers of three channels, comma-separated"),
                    TextModifier("idchannel", "name or number of a channel whose changes are lines")};
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
    return Edges(inputs, {a.Number("depth"), a.Number("normal")});
  };
  info.examples = {"depthchannel=2 normalchannels=0,1,2", "depthchannel=0 depth=0.5",
                   "normalchannels=1,2,0 normal=60", "idchannel=1"};
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
      "LINES DEPTH --halo: a line pixel (first channel of LINES above 0) is kept where its depth (first "
      "channel of DEPTH) is at most epsilon= above that of every line pixel within radius= pixels, else it "
      "becomes 0; epsilon must reach radius times the depth's slope along a line, or lines erase themselves. "
      "One channel. Source: McReynolds et al. 1997, 15.2.";
  info.bound = "exact";
  info.modifiers = {
      IntegerModifier("radius", "3", 0, 64, "pixels on either side of a line that it keeps free"),
      NumberModifier("epsilon", "0.01", 0, 1e30, "depth units that count as equal")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Halo(in[0], in[1], {a.Integer("radius"), a.Number("epsilon")});
  };
  info.examples = {"", "radius=7 epsilon=0.25", "radius=0"};
  return info;
}

}  // namespace ops

Node Edges(const EdgeInputs& inputs, const EdgeParams& params) {
  if (!inputs.depth && !inputs.normal && !inputs.id) {
    throw Error(
        "edges",
        "found neither depth nor normals nor ids, expected at least one (depthchannel=, normalchannels=, "
        "idchannel= name them)");
  }
  const ops::EdgeTests e{static_cast<bool>(inputs.depth), static_cast<bool>(inputs.normal),
                         params.depth_tolerance, std::cos(params.normal_degrees * std::numbers::pi / 180)};
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
    ops::RunEdges(e, window, args);
  };
  return graph::MakeNode(std::make_shared<const ops::LineOp>("edges", std::pair(inputs, params), spec, 1,
                                                             graph::Border::kClamp, run),
                         std::move(nodes));
}

Node Outline(const Node& mask, const OutlineParams& params) {
  const auto run = [params](const graph::TileArgs& args) { ops::RunOutline(params, args); };
  return graph::MakeNode(
      std::make_shared<const ops::LineOp>("outline", params, ops::LineSpec(mask.spec()), 1,
                                          params.clamp ? graph::Border::kClamp : graph::Border::kBlack, run),
      {ops::ChannelOf(mask, 0)});
}

Node Halo(const Node& lines, const Node& depth, const HaloParams& params) {
  if (params.radius < 0 || params.radius > 64) {
    throw Error("halo", "found radius " + std::to_string(params.radius) + ", expected 0 to 64");
  }
  const auto run = [params](const graph::TileArgs& args) { ops::RunHalo(params, args); };
  return graph::MakeNode(std::make_shared<const ops::LineOp>("halo", params, ops::LineSpec(lines.spec()),
                                                             params.radius, graph::Border::kBlack, run),
                         {ops::ChannelOf(lines, 0), ops::ChannelOf(depth, 0)});
}

}  // namespace tessera
