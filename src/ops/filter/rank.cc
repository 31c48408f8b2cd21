// Order statistics of a window: median, largest, smallest sample. Pixels beyond the image take no part.
#include "ops/filter/rank/rank.h"

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <type_traits>

#include "graph/op.h"
#include "ops/filter/filter_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {
namespace {

constexpr int kLargestWindow = 255;

class RankStage final : public graph::TileStage {
 public:
  RankStage(RankKind kind, const RankParams& p, const ImageSpec& in)
      : kind_(kind), params_(p), type_(in.type), window_(in.data_window) {}
  Roi InputRoi(int, const Roi& out) const override { return Intersection(Footprint(out), window_); }
  graph::TileSize Preferred() const override {
    // Rows are reduced again in every tile that sees them. Floats are read and written where they are; tiles
    // of other pixels have to fit in L2 where operations come before or after.
    const int height = std::clamp(4 * params_.height, 64, 256);
    return {type_ == PixelType::kFloat ? 1024 : 512, height};
  }
  bool Accepts(PixelType type) const override { return type != PixelType::kHalf; }
  void Run(const graph::TileArgs& args) const override {
    switch (args.out.type) {
      case PixelType::kUint8:
        return RunOn<uint8_t>(args);
      case PixelType::kUint16:
        return RunOn<uint16_t>(args);
      default:
        return RunOn<float>(args);
    }
  }

 private:
  template <class T>
  void RunOn(const graph::TileArgs& args) const {
    const Roi& o = args.out.roi;
    if (o.empty()) return;
    const Roi needed = Footprint(o), inside = Intersection(needed, window_);
    const int channels = args.out.channels;
    constexpr auto kSample = static_cast<ptrdiff_t>(sizeof(T));
    const RankTile<T> tile{.in = reinterpret_cast<const T*>(args.in[0].At(inside.x0, inside.y0)),
                           .in_stride = args.in[0].row_stride / kSample,
                           .left = (inside.x0 - needed.x0) * channels,
                           .right = (inside.x1 - needed.x0) * channels,
                           .top = inside.y0 - needed.y0,
                           .bottom = inside.y1 - needed.y0,
                           .out = reinterpret_cast<T*>(args.out.data),
                           .out_stride = args.out.row_stride / kSample,
                           .samples = o.width() * channels,
                           .rows = o.height(),
                           .channels = channels,
                           .width = params_.width,
                           .height = params_.height,
                           .stream = args.stream};
    if (kind_ != RankKind::kMedian) {
      RunExtreme(functions_, kind_ == RankKind::kDilate, tile, args.scratch);
    } else if constexpr (std::is_same_v<T, float>) {
      const bool codes = type_ == PixelType::kUint8 || type_ == PixelType::kUint16;
      RunMedian(functions_, codes ? (type_ == PixelType::kUint8 ? 255 : 65535) : 0, tile, args.scratch);
    } else {
      RunMedian(functions_, tile, args.scratch);
    }
  }
  Roi Footprint(const Roi& out) const {
    const int left = params_.width / 2, top = params_.height / 2;
    return {out.x0 - left, out.y0 - top, out.x1 - left + params_.width - 1,
            out.y1 - top + params_.height - 1};
  }
  RankKind kind_;
  RankParams params_;
  PixelType type_;
  Roi window_;
  RankFunctions functions_{ChooseExtremes(), ChooseMedians(), ChooseSlides(), ChooseHistograms()};
};

class RankOp final : public graph::OpWith<RankParams> {
 public:
  RankOp(const char* name, RankKind kind, const RankParams& p) : OpWith(p), name_(name), kind_(kind) {
    if (p.width < 1 || p.height < 1 || p.width > kLargestWindow || p.height > kLargestWindow) {
      throw Error(name, "found a window of " + std::to_string(p.width) + "x" + std::to_string(p.height) +
                            ", expected 1x1 to 255x255");
    }
  }
  std::string Name() const override { return name_; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  std::string Describe() const override {
    return std::string(name_) + " " + std::to_string(params().width) + "x" + std::to_string(params().height);
  }
  bool IsIdentity() const override { return params().width == 1 && params().height == 1; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<RankStage>(kind_, params(), context.inputs[0]);
  }

 private:
  const char* name_;
  RankKind kind_;
};

Node Ranked(const char* name, RankKind kind, const Node& image, const RankParams& p) {
  return graph::MakeNode(std::make_shared<const RankOp>(name, kind, p), {image});
}

OpInfo RankRow(const char* name, const char* summary, const char* help,
               Node (*make)(std::span<const Node>, const Arguments&, const ImageSpec*)) {
  OpInfo info;
  info.name = name;
  info.family = "filter";
  info.summary = summary;
  info.help = std::string(help) +
              " SIZE is WxH, up to 255x255, each channel for itself; an even window begins half "
              "its size before the pixel. Pixels beyond the image take no part, as oiiotool.";
  info.bound = "exact";
  info.arguments = {TextModifier("SIZE", "WxH in pixels")};
  info.make = make;
  info.examples = {"3x3", "5x2", "9x7"};
  info.identity = "1x1";
  return info;
}

}  // namespace

RankParams WindowSize(const std::string& name, const Arguments& a) {
  const auto [width, height] = ParseSize(name, a.Text("SIZE"));
  if (width != static_cast<int>(width) || height != static_cast<int>(height)) {
    throw Error(name, "found the size '" + a.Text("SIZE") + "', expected whole numbers");
  }
  return {static_cast<int>(width), static_cast<int>(height)};
}

OpInfo MedianInfo() {
  return RankRow(
      "median", "The middle sample of a window",
      "Of an even number of samples the upper one of the middle two; NaN ranks above every number.",
      [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
        return Median(in[0], WindowSize("median", a));
      });
}
OpInfo DilateInfo() {
  return RankRow("dilate", "The largest sample of a window", "Numbers win over NaN.",
                 [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
                   return Dilate(in[0], WindowSize("dilate", a));
                 });
}
OpInfo ErodeInfo() {
  return RankRow("erode", "The smallest sample of a window", "Numbers win over NaN.",
                 [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
                   return Erode(in[0], WindowSize("erode", a));
                 });
}

}  // namespace tessera::ops

namespace tessera {

Node Median(const Node& image, const RankParams& p) {
  return ops::Ranked("median", ops::RankKind::kMedian, image, p);
}
Node Dilate(const Node& image, const RankParams& p) {
  return ops::Ranked("dilate", ops::RankKind::kDilate, image, p);
}
Node Erode(const Node& image, const RankParams& p) {
  return ops::Ranked("erode", ops::RankKind::kErode, image, p);
}

}  // namespace tessera
