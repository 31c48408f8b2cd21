// Mip chains: levels of their own, and all of them in one picture.
#include <algorithm>
#include <string>

#include "base/tile.h"
#include "graph/little_memory.h"
#include "ops/codes.h"
#include "ops/filter/filter_ops.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/mip_boxes.h"
#include "ops/geometry/modifiers.h"
#include "ops/geometry/separable.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"

namespace tessera::ops {
namespace {

int LevelSide(int side, int level) { return std::max(1, level < 31 ? side >> level : 0); }

// Level `level` of `source` (a data window) laid down with its corner at `at`.
SeparableMap LevelMap(const Roi& source, const Roi& at, const MipParams& p) {
  SeparableMap map;
  const auto axis = [](int o0, int o1, int s0, int s1) {
    AxisMap m{o0, o1, s0, s1, 0, 1, 1};
    m.step = static_cast<double>(s1 - s0) / (o1 - o0);
    m.origin = s0 - o0 * m.step;
    m.scale = 1 / m.step;
    return m;
  };
  map.x = axis(at.x0, at.x1, source.x0, source.x1);
  map.y = axis(at.y0, at.y1, source.y0, source.y1);
  map.filter = &FindFilter("mip", p.filter);
  map.wrap = p.wrap;
  return map;
}

// The levels from 1 on; indices beyond the source are folded onto it, so that the whole image serves.
std::vector<MipLevel> LevelsOf(const ImageSpec& in, const MipParams& p) {
  std::vector<MipLevel> levels;
  for (int level = 1; level < MipLevelCount(in); ++level) {
    const Roi window = MipLevelWindow(in, level);
    const SeparableMap map = LevelMap(in.data_window, window, p);
    levels.push_back(
        {window, MakeAxisTaps(map.x, *map.filter, map.wrap), MakeAxisTaps(map.y, *map.filter, map.wrap)});
  }
  return levels;
}

// Every level from level 0, a tile at a time.
class AtlasStage final : public graph::TileStage {
 public:
  AtlasStage(const ImageSpec& in, const MipParams& p, int largest)
      : levels_(LevelsOf(in, p)), source_(in.data_window), wrap_(p.wrap), largest_(largest) {}
  Roi InputRoi(int, const Roi& out) const override {
    Roi in = Intersection(out, source_);
    for (const MipLevel& level : levels_) {
      const Roi part = Intersection(out, level.window);
      if (part.empty()) continue;
      Roi r;
      level.x.Range(part.x0, part.x1, &r.x0, &r.x1);
      level.y.Range(part.y0, part.y1, &r.y0, &r.y1);
      in = Union(in, r);
    }
    return in;
  }
  Wrap InputBorder(int) const override { return wrap_; }
  graph::TileSize Preferred() const override { return {512, 128}; }
  void Run(const graph::TileArgs& args) const override {
    const ConstImageView in = InputChannels(args, 0);
    const Roi& roi = args.out.roi;
    const size_t pixel = static_cast<size_t>(args.out.pixel_stride);
    for (int y = roi.y0; y < roi.y1; ++y) {
      std::byte* const row = args.out.At(roi.x0, y);
      const Roi copied = Intersection({roi.x0, y, roi.x1, y + 1}, source_);
      const size_t n = pixel * static_cast<size_t>(copied.width());
      if (n > 0) std::copy_n(in.At(copied.x0, y), n, row);
      std::fill_n(row + n, pixel * static_cast<size_t>(roi.width()) - n, std::byte{0});
    }
    for (const MipLevel& level : levels_) {
      const Roi part = Intersection(roi, level.window);
      if (!part.empty()) run_({in, args.out.Sub(part), level.x, level.y, false, args.scratch, largest_});
    }
  }

 private:
  std::vector<MipLevel> levels_;
  Roi source_;
  Wrap wrap_;
  int largest_;
  ResampleFunction run_ = ChooseResample();
};

class MipOp final : public graph::OpWith<MipParams>, public graph::LittleMemory {
 public:
  MipOp(const MipParams& p, PixelType codes) : OpWith(p), codes_(codes) {}
  std::string Name() const override { return "mip"; }
  // All levels of boxes are made in one pass.
  graph::OpKind Kind() const override {
    const MipParams& p = params();
    const bool together = p.level < 0 && p.filter == "box" && p.method == FilterMethod::kAuto;
    return together ? graph::OpKind::kWhole : graph::OpKind::kTile;
  }
  bool IsIdentity() const override { return params().level == 0; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const std::string& filter = params().filter;
    if (filter != "box" && filter != "linear" && filter != "mitchell" && filter != "lanczos3") {
      throw Error("mip", "found the filter \"" + filter + "\", expected box, linear, mitchell or lanczos3");
    }
    ImageSpec spec = inputs[0];
    if (spec.data_window.empty()) return spec;
    const int levels = MipLevelCount(spec), level = params().level;
    if (level >= levels || level < -1) {
      throw DataError("mip", "found the level " + std::to_string(level) + ", expected 0 to " +
                                 std::to_string(levels - 1));
    }
    const Roi all = MipLevelWindow(spec, -1);
    const Roi& w = spec.data_window;
    spec.data_window =
        level < 0 ? all
                  : Roi{w.x0, w.y0, w.x0 + LevelSide(w.width(), level), w.y0 + LevelSide(w.height(), level)};
    spec.display_window = spec.data_window;
    return spec;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    if (params().level < 0) {
      return std::make_unique<AtlasStage>(context.inputs[0], params(), LargestCode(codes_));
    }
    MipParams p = params();
    if (p.level == 0) p.filter = "box";  // the image itself; some filters would blur it
    return MakeSeparableStage(LevelMap(context.inputs[0].data_window, context.output.data_window, p), codes_);
  }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext& context) const override {
    const ImageSpec& in = context.inputs[0];
    return MakeMipBoxes(LevelsOf(in, params()), in.data_window, LargestCode(codes_));
  }
  std::shared_ptr<const graph::Op> InLittleMemory() const override {
    if (Kind() != graph::OpKind::kWhole) return nullptr;
    MipParams p = params();
    p.method = FilterMethod::kDirect;
    return std::make_shared<const MipOp>(p, codes_);
  }
  std::string InParts() const override { return "method=direct"; }

 private:
  PixelType codes_;  // of the image, whose stages may be given them as floats
};

}  // namespace

OpInfo MipInfo() {
  OpInfo info;
  info.name = "mip";
  info.family = "geometry";
  info.summary = "Mip chain: all levels in one picture, or one level";
  info.help =
      "Level k has the sides max(1, floor(side / 2^k)); every level is filtered from level 0 with the filter "
      "widened to 2^k pixels (applying a filter level by level gives another, wrong one), beyond the edge as "
      "wrap= says, which is the texture's own mode. Without level= the result holds level 0 on the left and "
      "levels 1, 2, ... below each other on its right; what is left over is zero. With level= it is that "
      "level alone. Where both sides are halved by a box, a pixel of 8- or 16-bit codes is the exact mean of "
      "four of them, rounded half to even. All levels of a box take the picture and the result in memory whole; "
      "where --max-memory does not allow that, auto is direct.";
  info.bound = "6 u * (largest |value| under the filter) * (sum of |weight|)";
  info.bound_u = 6;
  ParamInfo filter = FilterModifier("box", "the filter, in pixels of the level");
  filter.choices = {"box", "linear", "mitchell", "lanczos3"};
  const ParamInfo level = IntegerModifier("level", "-1", -1, 31, "one level from 0; -1 gives all");
  ParamInfo method = MethodModifier({"auto", "direct"});
  method.help =
      "direct: every level by itself, in tiles; auto makes all levels of a box in one pass over the picture";
  info.modifiers = {filter, WrapModifier("wrap", "clamp"), level, method};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Mip(in[0], {a.Text("filter"), WrapNamed(a.Text("wrap")), a.Integer("level"),
                       MethodNamed(a.Text("method"))});
  };
  info.identity = "level=0";
  info.examples = {"filter=mitchell",
                   "",
                   "filter=lanczos3 wrap=repeat",
                   "filter=linear wrap=mirror level=0",
                   "filter=box wrap=black",
                   "method=direct"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

int MipLevelCount(const ImageSpec& spec) {
  int levels = 1;
  for (int side = std::max(spec.width(), spec.height()); side > 1; side /= 2) ++levels;
  return levels;
}

Roi MipLevelWindow(const ImageSpec& spec, int level) {
  const Roi& w = spec.data_window;
  if (w.empty() || level == 0) return w;
  // A column right of level 0, as wide as level 1.
  int y = w.y0, bottom = w.y1;
  Roi found;
  for (int k = 1; k < MipLevelCount(spec); ++k) {
    const Roi window{w.x1, y, w.x1 + ops::LevelSide(w.width(), k), y + ops::LevelSide(w.height(), k)};
    if (k == level) found = window;
    y = window.y1;
    bottom = std::max(bottom, window.y1);
  }
  if (level < 0) return {w.x0, w.y0, w.x1 + (y > w.y0 ? ops::LevelSide(w.width(), 1) : 0), bottom};
  return found;
}

Node Mip(const Node& image, const MipParams& params) {
  ops::RequireImageWrap("mip", params.wrap);
  if (params.method != FilterMethod::kAuto && params.method != FilterMethod::kDirect) {
    throw Error("mip", "found another method than auto or direct, expected one of these");
  }
  return graph::MakeNode(std::make_shared<const ops::MipOp>(params, ops::CodesOf(image)), {image});
}

std::vector<Node> MipChain(const Node& image, const MipParams& params) {
  std::vector<Node> levels;
  for (int level = 0; level < MipLevelCount(image.spec()); ++level) {
    levels.push_back(Mip(image, {params.filter, params.wrap, level, params.method}));
  }
  return levels;
}

}  // namespace tessera
