// GL's pixel zoom: pixels become rectangles.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "base/number_text.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/separable.h"
#include "ops/modifiers.h"
#include "tessera/error_kind.h"

namespace tessera::ops {
namespace {

// One axis: results [out0, out1), each with its source index.
struct ZoomAxis {
  int out0 = 0, out1 = 0;

  // Where the pixels [s0, s1) go, counted from `origin`.
  ZoomAxis(double factor, int s0, int s1, int origin) {
    const double a = (double{1} * s0 - origin) * factor, b = (double{1} * s1 - origin) * factor;
    // Centres x + 1/2 in [a, b), or in (b, a] for a negative factor.
    const double first = factor > 0 ? std::ceil(a - 0.5) : std::floor(b - 0.5) + 1;
    const double last = factor > 0 ? std::ceil(b - 0.5) : std::floor(a - 0.5) + 1;
    constexpr double kFarthest = 1 << 30;
    if (!(std::fabs(first) < kFarthest && std::fabs(last) < kFarthest)) {
      throw DataError(
          "zoom", "found a result of " + base::NumberText(last - first) + " pixels, expected at most 2^30");
    }
    out0 = origin + static_cast<int>(first);
    out1 = origin + static_cast<int>(last);
  }
};

int SourceOf(double factor, int x, int origin, int s0, int s1) {
  const double at = (double{1} * x - origin + 0.5) / factor;
  return std::clamp(origin + static_cast<int>(std::floor(at)), s0, s1 - 1);
}

class ZoomStage final : public graph::TileStage {
 public:
  ZoomStage(const ZoomParams& p, const ImageSpec& in, const Roi& out) : out_(out) {
    const Roi &s = in.data_window, &d = in.display_window;
    for (int x = out.x0; x < out.x1; ++x) columns_.push_back(SourceOf(p.x, x, d.x0, s.x0, s.x1));
    for (int y = out.y0; y < out.y1; ++y) rows_.push_back(SourceOf(p.y, y, d.y0, s.y0, s.y1));
  }
  Roi InputRoi(int, const Roi& out) const override {
    if (out.empty()) return {};
    const auto [x0, x1] = std::minmax({Column(out.x0), Column(out.x1 - 1)});
    const auto [y0, y1] = std::minmax({Row(out.y0), Row(out.y1 - 1)});
    return {x0, y0, x1 + 1, y1 + 1};
  }
  void Run(const graph::TileArgs& args) const override {
    const ConstImageView in = InputChannels(args, 0);
    const Roi& roi = args.out.roi;
    const int channels = args.out.channels;
    for (int y = roi.y0; y < roi.y1; ++y) {
      const auto* const row = reinterpret_cast<const float*>(in.At(in.roi.x0, Row(y)));
      auto* out = reinterpret_cast<float*>(args.out.At(roi.x0, y));
      for (int x = roi.x0; x < roi.x1; ++x, out += channels) {
        const float* const from = row + ptrdiff_t{channels} * (Column(x) - in.roi.x0);
        if (channels == 4) {
          std::memcpy(out, from, 16);
        } else {
          std::copy_n(from, channels, out);
        }
      }
    }
  }

 private:
  int Column(int x) const { return columns_[static_cast<size_t>(x - out_.x0)]; }
  int Row(int y) const { return rows_[static_cast<size_t>(y - out_.y0)]; }

  Roi out_;
  std::vector<int> columns_, rows_;
};

class ZoomOp final : public graph::OpWith<ZoomParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "zoom"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  bool IsIdentity() const override { return params().x == 1 && params().y == 1; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const ZoomParams& p = params();
    if (p.x == 0 || p.y == 0 || !std::isfinite(p.x) || !std::isfinite(p.y)) {
      throw Error("zoom", "found the factors " + base::NumberText(p.x) + "," + base::NumberText(p.y) +
                              ", expected finite ones other than 0");
    }
    ImageSpec spec = inputs[0];
    const Roi from = spec.display_window;
    for (Roi* w : {&spec.data_window, &spec.display_window}) {
      if (w->empty()) continue;
      const ZoomAxis x(p.x, w->x0, w->x1, from.x0), y(p.y, w->y0, w->y1, from.y0);
      *w = {x.out0, y.out0, x.out1, y.out1};
      if (w->empty()) throw DataError("zoom", "found factors that leave no pixel, expected larger ones");
    }
    return spec;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<ZoomStage>(params(), context.inputs[0], context.output.data_window);
  }
};

}  // namespace

OpInfo ZoomInfo() {
  OpInfo info;
  info.name = "zoom";
  info.family = "geometry";
  info.summary = "Pixel zoom: pixels become rectangles, negative factors reflect";
  info.help =
      "As GL's pixel zoom: pixel (i, j), counted from the display window's corner, becomes the rectangle "
      "between (i X, j Y) and ((i+1) X, (j+1) Y); each result pixel takes the pixel whose rectangle holds "
      "its centre, bit for bit, so that factors below 1 leave pixels out. A negative factor reflects about "
      "the corner, and the windows then lie left of it or above it.";
  info.bound = "exact";
  info.bound_u = 0;
  info.arguments = {NumbersModifier("X,Y", "", 2, -1e6, 1e6, "factors of width and height")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return Zoom(in[0], {a.Numbers("X,Y")[0], a.Numbers("X,Y")[1]});
  };
  info.examples = {"2,3", "-1,1", "0.4,-1.7", "-3.3,-0.5"};
  info.identity = "1,1";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Zoom(const Node& image, const ZoomParams& params) {
  return graph::MakeNode(std::make_shared<const ops::ZoomOp>(params), {image});
}

}  // namespace tessera
