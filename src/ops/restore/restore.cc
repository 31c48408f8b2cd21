// Means weighted by likeness: the bilateral filter and non-local means. And bands smoothed, made of others.
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>

#include "base/arena.h"
#include "graph/op.h"
#include "ops/filter/frame.h"
#include "ops/modifiers.h"
#include "ops/range.h"
#include "ops/restore/restore_ops.h"
#include "ops/wrap.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {

std::vector<int> ComparedChannels(const ImageSpec& image) {
  std::vector<int> channels;
  for (int c = 0; c < image.channel_count() && channels.size() < 3; ++c) {
    if (c != image.alpha) channels.push_back(c);
  }
  if (channels.empty()) channels.push_back(0);
  return channels;
}

std::vector<bool> NeededToCompare(const std::vector<bool>& result, const ImageSpec& in) {
  std::vector<bool> needed = result;
  for (const int c : ComparedChannels(in)) needed[static_cast<size_t>(c)] = true;
  return needed;
}

namespace {

// The plane of a channel: where it stands among those that are compared, or behind them in the image's order.
int PlaneOf(int channel, std::span<const int> held, const std::vector<int>& compared) {
  const auto own = std::find(compared.begin(), compared.end(), channel);
  if (own != compared.end()) return static_cast<int>(own - compared.begin());
  auto plane = static_cast<int>(compared.size());
  for (const int c : held) {
    if (c == channel) break;
    if (std::find(compared.begin(), compared.end(), c) == compared.end()) ++plane;
  }
  return plane;
}

}  // namespace

WeighedTile ApartFor(const graph::TileArgs& args, const std::vector<int>& compared, int reach) {
  constexpr int kVector = 16;  // samples of the widest one
  const Roi& o = args.out.roi;
  const ConstImageView& in = args.in[0];
  const std::span<const int> held = args.in_channels[0];
  WeighedTile tile;
  tile.planes = in.channels;
  tile.compared = static_cast<int>(compared.size());
  tile.width = o.width(), tile.height = o.height();
  const int wide = tile.width + 2 * reach, high = tile.height + 2 * reach;
  tile.out_stride = (tile.width + kVector - 1) / kVector * kVector;
  // What a vector that begins in the last pixel reads to its right.
  tile.stride = (wide + kVector - 1) / kVector * kVector + kVector;
  tile.in = args.scratch.Allocate<const float*>(static_cast<size_t>(tile.planes));
  tile.out = args.scratch.Allocate<float*>(static_cast<size_t>(tile.planes));
  for (int i = 0; i < in.channels; ++i) {
    const auto plane = static_cast<size_t>(PlaneOf(held[static_cast<size_t>(i)], held, compared));
    const size_t room = static_cast<size_t>(tile.stride) * static_cast<size_t>(high) + kVector;
    auto* const samples = args.scratch.Allocate<float>(room);
    for (int y = 0; y < high; ++y) {
      const auto* const from = reinterpret_cast<const float*>(in.At(o.x0 - reach, o.y0 - reach + y)) + i;
      float* const to = samples + y * tile.stride;
      for (int x = 0; x < wide; ++x) to[x] = from[ptrdiff_t{x} * in.channels];
      std::fill(to + wide, to + tile.stride, 0.0f);
    }
    std::fill_n(samples + room - kVector, kVector, 0.0f);
    tile.in[plane] = samples + reach * tile.stride + reach;
    tile.out[plane] =
        args.scratch.Allocate<float>(static_cast<size_t>(tile.out_stride) * static_cast<size_t>(tile.height));
  }
  return tile;
}

void Together(const WeighedTile& tile, const std::vector<int>& compared, const graph::TileArgs& args) {
  const Roi& o = args.out.roi;
  for (int i = 0; i < args.out.channels; ++i) {
    const int plane = PlaneOf(args.channels[static_cast<size_t>(i)], args.in_channels[0], compared);
    for (int y = 0; y < tile.height; ++y) {
      const float* const from = tile.out[plane] + y * tile.out_stride;
      auto* const to = reinterpret_cast<float*>(args.out.At(o.x0, o.y0 + y)) + i;
      for (int x = 0; x < tile.width; ++x) to[ptrdiff_t{x} * args.out.channels] = from[x];
    }
  }
}

namespace {

const double kLog2E = std::log2(std::exp(1.0));

class BilateralStage final : public graph::TileStage {
 public:
  BilateralStage(const BilateralParams& p, const ImageSpec& in)
      : border_(p.wrap), compared_(ComparedChannels(in)) {
    setup_.radius = static_cast<int>(std::ceil(2 * p.sigma));
    setup_.range = static_cast<float>(kLog2E / (2 * p.range * p.range));
    for (int j = -setup_.radius; j <= setup_.radius; ++j) {
      for (int i = -setup_.radius; i <= setup_.radius; ++i)
        setup_.space.push_back(static_cast<float>(kLog2E * (i * i + j * j) / (2 * p.sigma * p.sigma)));
    }
  }
  Roi InputRoi(int, const Roi& out) const override { return Inflate(out, setup_.radius, setup_.radius); }
  Wrap InputBorder(int) const override { return border_; }
  graph::TileSize Preferred() const override { return {128, 64}; }
  void Run(const graph::TileArgs& args) const override {
    if (args.out.roi.empty()) return;
    const WeighedTile tile = ApartFor(args, compared_, setup_.radius);
    run_(setup_, tile);
    Together(tile, compared_, args);
  }

 private:
  Wrap border_;
  std::vector<int> compared_;
  BilateralSetup setup_;
  BilateralFunction run_ = ChooseBilateral();
};

class PatchStage final : public graph::TileStage {
 public:
  PatchStage(const NonLocalMeansParams& p, const ImageSpec& in)
      : border_(p.wrap), compared_(ComparedChannels(in)) {
    setup_.patch = p.patch / 2, setup_.search = p.search / 2;
    const double h = p.strength * p.sigma;
    const double samples = double{1} * p.patch * p.patch * static_cast<double>(compared_.size());
    setup_.factor = static_cast<float>(kLog2E / (h * h * samples));
    setup_.allowance = static_cast<float>(kLog2E * 2 / (p.strength * p.strength));
  }
  Roi InputRoi(int, const Roi& out) const override { return Inflate(out, Reach(), Reach()); }
  Wrap InputBorder(int) const override { return border_; }
  graph::TileSize Preferred() const override { return {96, 48}; }
  void Run(const graph::TileArgs& args) const override {
    if (args.out.roi.empty()) return;
    const WeighedTile tile = ApartFor(args, compared_, Reach());
    run_(setup_, tile, args.scratch);
    Together(tile, compared_, args);
  }

 private:
  int Reach() const { return setup_.patch + setup_.search; }
  Wrap border_;
  std::vector<int> compared_;
  PatchSetup setup_;
  PatchFunction run_ = ChoosePatches();
};

// What both have in common.
template <class P, class S>
class WeighedOp final : public graph::OpWith<P> {
 public:
  WeighedOp(const char* name, const P& p) : graph::OpWith<P>(p), name_(name) {}
  std::string Name() const override { return name_; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec& in) const override {
    return NeededToCompare(result, in);
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<S>(this->params(), context.inputs[0]);
  }

 private:
  const char* name_;
};

void RequireOdd(const char* op, const char* what, int found) {
  if (found % 2 != 0) return;
  throw Error(op, std::string("found ") + what + "=" + std::to_string(found) + ", expected an odd number");
}
void RequireKnownBorder(const char* op, Wrap wrap) {
  RequireWrap(op, wrap, {Wrap::kClamp, Wrap::kBlack, Wrap::kRepeat, Wrap::kMirror, Wrap::kMirror101});
}
ParamInfo BorderModifier() {
  return WrapModifier({"clamp", "black", "repeat", "mirror", "mirror101"}, "clamp",
                      "what lies beyond the image");
}

}  // namespace

OpInfo BilateralInfo() {
  OpInfo info;
  info.name = "bilateral";
  info.family = "restore";
  info.summary = "Smooth what is alike, keep edges: the bilateral filter";
  info.help =
      "The mean of the pixels within 2 sigma, weighted by exp(-r^2/(2 sigma^2) - d^2/(2 range^2)): r is the distance in "
      "pixels, d the distance of the colours, in units of the samples (1 is white). A small range= keeps more edges, a "
      "large one is a blur. The first three channels but alpha are compared together, and every channel, alpha too, is "
      "mixed by the same weights. Flat parts keep their bits; colours that are not finite stay where they are and do "
      "not spread. For noise as of a camera --nlmeans keeps more detail. Source: Tomasi and Manduchi 1998.";
  info.bound = "2 u (|result| + weighted mean of |difference| (2 radius + 9 + 8 log2(1/weight)))";
  info.bound_u = 2;
  info.modifiers = {NumberModifier("sigma", "3", 0.1, 20, "of distances, in pixels"),
                    NumberModifier("range", "0.1", 1e-6, 1e6, "of differences of colours"), BorderModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Bilateral(in[0], {a.Number("sigma"), a.Number("range"), WrapNamed(a.Text("wrap"))});
  };
  info.examples = {"sigma=2 range=0.15", "sigma=0.8 range=0.02 wrap=mirror", "sigma=1.2 range=5 wrap=black"};
  return info;
}

OpInfo NonLocalMeansInfo() {
  OpInfo info;
  info.name = "nlmeans";
  info.family = "restore";
  info.summary = "Take noise away by the mean of like patches: non-local means";
  info.help =
      "Each pixel becomes the mean of those in a square of search= pixels about it, weighted by exp(-max(D - 2 "
      "sigma^2, 0)/(strength sigma)^2), D the mean squared difference of the colours of two squares of patch= pixels. "
      "sigma= is the standard deviation of the noise, in units of the samples (5 of 255 is 0.02). The first three "
      "channels but alpha are compared together, and every channel, alpha too, is mixed by the same weights. Pixels "
      "whose patch holds what is not finite stay as they are. Cost grows with search^2. Source: Buades, Coll and Morel "
      "2005.";
  info.bound =
      "2 u (|result| + weighted mean of |difference| (2 search + 9 + (9 + 2 patch) (log2(1/weight) + 3/strength^2)))";
  info.bound_u = 2;
  info.modifiers = {NumberModifier("sigma", "0.05", 1e-6, 1e6, "of the noise"),
                    NumberModifier("strength", "0.6", 0.1, 10, "how unlike patches may be, in sigma"),
                    IntegerModifier("patch", "5", 1, 15, "side of what is compared, odd"),
                    IntegerModifier("search", "15", 3, 63, "side of where is looked, odd"), BorderModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return NonLocalMeans(in[0], {a.Number("sigma"), a.Number("strength"), a.Integer("patch"),
                                 a.Integer("search"), WrapNamed(a.Text("wrap"))});
  };
  info.examples = {"sigma=0.1 search=7", "sigma=0.2 strength=1 patch=3 search=5 wrap=mirror",
                   "sigma=0.05 patch=1 search=3 wrap=black"};
  return info;
}

OpInfo DebandInfo() {
  OpInfo info;
  info.name = "deband";
  info.family = "restore";
  info.summary = "Smooth the steps of gradients";
  info.help =
      "Where the samples within radius= pixels differ by half of threshold= at most, the mean of that square takes the "
      "sample's place; from there it takes less of it until they differ by threshold=, and edges stay. Steps of eight bits "
      "differ by 1/255: the default takes in those and their noise of a code. A radius as wide as the bands makes a ramp "
      "of them. Channel by channel, alpha is left alone. Bits for the result are needed as well: -d uint16, or "
      "--quantize 8:dither= before eight. With a radius above 4 the image is held in memory whole.";
  info.bound = "what the operations that it is made of make together";
  info.modifiers = {
      IntegerModifier("radius", "16", 1, 127, "pixels"),
      NumberModifier("threshold", "0.012", 1e-6, 1e6, "of differences; three of 255 by default")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Deband(in[0], {a.Integer("radius"), a.Number("threshold")});
  };
  info.examples = {"radius=8 threshold=0.2", "radius=3 threshold=2"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Bilateral(const Node& image, const BilateralParams& p) {
  ops::RequireRange("bilateral", "sigma=", p.sigma, 0.1, 20);
  ops::RequireRange("bilateral", "range=", p.range, 1e-6, 1e6);
  ops::RequireKnownBorder("bilateral", p.wrap);
  using Op = ops::WeighedOp<BilateralParams, ops::BilateralStage>;
  return ops::InDisplayWindow(image, p.wrap, [&](const Node& framed) {
    return graph::MakeNode(std::make_shared<const Op>("bilateral", p), {framed});
  });
}

Node NonLocalMeans(const Node& image, const NonLocalMeansParams& p) {
  ops::RequireRange("nlmeans", "sigma=", p.sigma, 1e-6, 1e6);
  ops::RequireRange("nlmeans", "strength=", p.strength, 0.1, 10);
  ops::RequireRange("nlmeans", "patch=", p.patch, 1, 15);
  ops::RequireRange("nlmeans", "search=", p.search, 3, 63);
  ops::RequireOdd("nlmeans", "patch", p.patch);
  ops::RequireOdd("nlmeans", "search", p.search);
  ops::RequireKnownBorder("nlmeans", p.wrap);
  using Op = ops::WeighedOp<NonLocalMeansParams, ops::PatchStage>;
  return ops::InDisplayWindow(image, p.wrap, [&](const Node& framed) {
    return graph::MakeNode(std::make_shared<const Op>("nlmeans", p), {framed});
  });
}

Node Deband(const Node& image, const DebandParams& p) {
  ops::RequireRange("deband", "radius=", p.radius, 1, 127);
  ops::RequireRange("deband", "threshold=", p.threshold, 1e-6, 1e6);
  const int side = 2 * p.radius + 1;
  const Node spread = Sub(Dilate(image, {side, side}), Erode(image, {side, side}));
  // 1 up to half of the threshold, 0 from it on.
  Node share = Clamp(AddConstant(MulConstant(spread, {-2 / p.threshold}), {2}), {.min = {0}, .max = {1}});
  const int alpha = image.spec().alpha;
  if (alpha >= 0) {
    std::vector<double> none(static_cast<size_t>(image.spec().channel_count()), 1);
    none[static_cast<size_t>(alpha)] = 0;
    share = MulConstant(share, none);
  }
  return Mad(Sub(BoxBlur(image, {side, side}), image), share, image);
}

}  // namespace tessera
