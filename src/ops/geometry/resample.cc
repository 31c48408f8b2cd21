// Another resolution without a filter: the nearest pixel, or four of them.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/geometry/geometry_ops.h"
#include "ops/geometry/resize_window.h"
#include "ops/geometry/separable.h"
#include "ops/modifiers.h"
#include "tessera/ops/arrangement.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/geometry.h"

namespace tessera::ops {
namespace {

// Where a result pixel of one axis looks: two pixels, the same where the weight of the second is 0.
struct Look {
  int first, second;
  float weight;  // of the second
};
constexpr int kNowhere = std::numeric_limits<int>::min();

// oiiotool's positions, operation by operation: half-way cases go where its rounding takes them.
float PositionOf(int i, int to0, int to_size, int from0, int from_size) {
  const float part =
      (static_cast<float>(i) - static_cast<float>(to0) + 0.5f) * (1.0f / static_cast<float>(to_size));
  return static_cast<float>(from0) + part * static_cast<float>(from_size);
}

class Axis {
 public:
  Axis(int begin, int end, const WindowSide& to, const WindowSide& from, const WindowSide& there,
       bool interpolate)
      : begin_(begin) {
    for (int i = begin; i < end; ++i) {
      const float at = PositionOf(i, to.begin, to.size, from.begin, from.size);
      looks_.push_back(interpolate ? Between(at, there) : Nearest(at, there));
    }
  }
  const Look& operator[](int i) const { return looks_[static_cast<size_t>(i - begin_)]; }
  // The pixels that [i0, i1) looks at; positions never fall.
  std::pair<int, int> Reach(int i0, int i1) const {
    int low = std::numeric_limits<int>::max(), high = kNowhere;
    for (int i = i0; i < i1; ++i) {
      const Look& look = (*this)[i];
      if (look.first == kNowhere) continue;
      low = std::min(low, look.first), high = std::max(high, look.second);
    }
    return high == kNowhere ? std::pair(0, 0) : std::pair(low, high + 1);
  }

 private:
  static Look Nearest(float at, const WindowSide& there) {
    const double i = std::floor(at);
    if (!(i >= there.begin && i < double{1} * there.begin + there.size)) return {kNowhere, kNowhere, 0};
    return {static_cast<int>(i), static_cast<int>(i), 0};
  }
  static Look Between(float at, const WindowSide& there) {
    const float centre = at - 0.5f, first = std::floor(centre), weight = centre - first;
    const auto inside = [&](double i) {
      return static_cast<int>(std::clamp(i, double{1} * there.begin, there.begin + there.size - 1.0));
    };
    const Look look{inside(first), inside(double{first} + 1), weight};
    return weight == 0 || look.first == look.second ? Look{look.first, look.first, 0} : look;
  }

  int begin_;
  std::vector<Look> looks_;
};

class ResampleStage final : public graph::TileStage {
 public:
  ResampleStage(Axis x, Axis y, bool interpolate)
      : x_(std::move(x)), y_(std::move(y)), interpolate_(interpolate) {}
  Roi InputRoi(int, const Roi& out) const override {
    const auto [x0, x1] = x_.Reach(out.x0, out.x1);
    const auto [y0, y1] = y_.Reach(out.y0, out.y1);
    const Roi in{x0, y0, x1, y1};
    return in.empty() ? Roi{} : in;
  }
  bool Accepts(PixelType type) const override { return type == PixelType::kFloat || !interpolate_; }
  void Run(const graph::TileArgs& args) const override {
    const ConstImageView in = args.out.type == PixelType::kFloat ? InputChannels(args, 0) : args.in[0];
    for (int y = args.out.roi.y0; y < args.out.roi.y1; ++y) {
      interpolate_ ? Interpolate(in, args.out, y) : Pick(in, args.out, y);
    }
  }

 private:
  void Pick(const ConstImageView& in, const ImageView& out, int y) const {
    const auto bytes = static_cast<size_t>(out.pixel_stride);
    const int row = y_[y].first;
    std::byte* to = out.At(out.roi.x0, y);
    for (int x = out.roi.x0; x < out.roi.x1; ++x, to += bytes) {
      const int column = x_[x].first;
      if (row == kNowhere || column == kNowhere) {
        std::memset(to, 0, bytes);
      } else if (bytes == 4) {
        std::memcpy(to, in.At(column, row), 4);
      } else {
        std::memcpy(to, in.At(column, row), bytes);
      }
    }
  }

  // What has no weight is not looked at: an infinity beside a pixel stays there.
  static double Mix(double a, double b, double weight) {
    return weight == 0 ? a : (1 - weight) * a + weight * b;
  }

  void Interpolate(const ConstImageView& in, const ImageView& out, int y) const {
    const Look& row = y_[y];
    auto* to = reinterpret_cast<float*>(out.At(out.roi.x0, y));
    for (int x = out.roi.x0; x < out.roi.x1; ++x, to += out.channels) {
      const Look& column = x_[x];
      const auto sample = [&](int sx, int sy) { return reinterpret_cast<const float*>(in.At(sx, sy)); };
      const float *const a = sample(column.first, row.first), *const b = sample(column.second, row.first),
                         *const c = sample(column.first, row.second),
                         *const d = sample(column.second, row.second);
      for (int k = 0; k < out.channels; ++k) {
        const double upper = Mix(a[k], b[k], column.weight), lower = Mix(c[k], d[k], column.weight);
        to[k] = static_cast<float>(Mix(upper, lower, row.weight));
      }
    }
  }

  Axis x_, y_;
  bool interpolate_;
};

class ResampleOp final : public graph::OpWith<ResampleParams> {
 public:
  ResampleOp(const ResampleParams& params, const Roi& data) : OpWith(params), data_(data) {}
  std::string Name() const override { return "resample"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = inputs[0];
    const Roi display = ResizedDisplay("resample", {params().x, params().y, params().width, params().height});
    const Roi full = spec.display_window.empty() ? spec.data_window : spec.display_window;
    spec.data_window = data_.empty()   ? Roi{}
                       : data_ == full ? display
                                       : ScaledWindow("resample", data_, full, display);
    spec.display_window = display;
    return spec;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const ImageSpec& in = context.inputs[0];
    const Roi &there = in.data_window, &out = context.output.data_window, &to = context.output.display_window;
    const Roi& from = in.display_window.empty() ? in.data_window : in.display_window;
    const bool between = params().interpolate;
    return std::make_unique<ResampleStage>(
        Axis(out.x0, out.x1, {to.x0, to.width()}, {from.x0, from.width()}, {there.x0, there.width()},
             between),
        Axis(out.y0, out.y1, {to.y0, to.height()}, {from.y0, from.height()}, {there.y0, there.height()},
             between),
        between);
  }

 private:
  Roi data_;
};

}  // namespace

OpInfo ResampleInfo() {
  OpInfo info;
  info.name = "resample";
  info.family = "geometry";
  info.summary = "Another resolution without a filter";
  info.help =
      "GEOM as --resize takes it, and the same windows. Every result pixel is the image at its own centre, "
      "interpolated between the four pixels about it, or with interp=0 the pixel that it falls into, bit for bit. "
      "Pixels in between are left out where it reduces: --resize filters. Positions are computed in float as "
      "oiiotool computes them, so that the same pixel is taken where one falls onto an edge.";
  info.bound = "2 u * (largest of the four values)";
  info.bound_u = 2;
  info.arguments = {TextModifier("GEOM", "the new size, such as 1920x1080, 50% or 1280x0")};
  info.modifiers = {FlagModifier("interp", "0: the nearest pixel", "1")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const ImageSpec& spec = in[0].spec();
    const ResizeParams p =
        ParseResize(a.Text("GEOM"), spec.display_window.empty() ? spec.data_window : spec.display_window);
    return Resample(in[0], {p.width, p.height, p.x, p.y, a.Flag("interp")});
  };
  info.identity = "100%";
  info.examples = {"50%", "173% interp=0", "61x17", "37%x210% interp=0", "150x0+3-4"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Resample(const Node& image, const ResampleParams& params) {
  const Roi& data = image.spec().data_window;
  const Roi& full = image.spec().display_window;
  if (params.width == full.width() && params.height == full.height() && params.x == full.x0 &&
      params.y == full.y0)
    return image;
  const Roi framed = data.empty() ? data : Union(data, full);
  return graph::MakeNode(std::make_shared<const ops::ResampleOp>(params, data),
                         {framed == data ? image : Crop(image, framed)});
}

}  // namespace tessera
