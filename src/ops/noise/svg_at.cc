// SVG 1.1's feTurbulence at the positions that an image holds.
#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/arena_vector.h"
#include "graph/op.h"
#include "ops/modifiers.h"
#include "ops/noise/kernels.h"
#include "ops/noise/noise_ops.h"
#include "ops/noise/svg.h"
#include "tessera/error_kind.h"
#include "tessera/ops/noise.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {
namespace {

class SvgAtStage final : public graph::TileStage {
 public:
  explicit SvgAtStage(const SvgTurbulenceParams& p)
      : params_(p),
        kernels_(FindNoiseKernels()),
        points_(FindSvgPoints()),
        lattice_(p.seed),
        axis_{{p.base_frequency[0], p.stitch, p.frame.x0, p.frame.width()},
              {p.base_frequency[1], p.stitch, p.frame.y0, p.frame.height()}} {}
  Roi InputRoi(int, const Roi& out) const override { return out; }

  void Run(const graph::TileArgs& args) const override {
    const Roi& r = args.out.roi;
    const ConstImageView& in = args.in[0];
    const auto plane = [&] {
      float* const floats = args.scratch.Allocate<float>(kNoiseBatch);
      std::fill_n(floats, kNoiseBatch, 0.0f);
      return floats;
    };
    base::ArenaVector<float*> coordinates(args.scratch);
    for (int c = 0; c < in.channels; ++c) coordinates.push_back(plane());
    const auto coordinate = [&](int channel) {
      const auto present = std::find(args.in_channels[0].begin(), args.in_channels[0].end(), channel);
      return coordinates[static_cast<size_t>(present - args.in_channels[0].begin())];
    };
    SvgPoints points;
    points.x = coordinate(0), points.y = coordinate(1);
    points.axis = axis_;
    points.lattice = &lattice_;
    points.octaves = params_.octaves;
    points.fractal_noise = params_.fractal_noise;
    points.channels = 4;
    float* const zeros = plane();
    base::ArenaVector<float*> planes(args.scratch);
    for (int c : args.channels) {
      planes.push_back(c < 4 ? plane() : zeros);
      if (c < 4) points.out[c] = planes.back();
    }
    for (int y = r.y0; y < r.y1; ++y) {
      for (int x = r.x0; x < r.x1; x += kNoiseBatch) {
        points.count = std::min(kNoiseBatch, r.x1 - x);
        kernels_.separate(reinterpret_cast<const float*>(in.At(x, y)), in.channels, points.count,
                          coordinates.data());
        points_(points);
        kernels_.interleave(planes.data(), static_cast<int>(planes.size()), points.count,
                            reinterpret_cast<float*>(args.out.At(x, y)));
      }
    }
  }

 private:
  SvgTurbulenceParams params_;
  NoiseKernels kernels_;
  SvgEvaluate points_;
  SvgLattice lattice_;
  SvgAxis axis_[2];
};

class SvgAtOp final : public graph::OpWith<SvgTurbulenceParams> {
 public:
  SvgAtOp(SvgTurbulenceParams params, int channels) : OpWith(std::move(params)), channels_(channels) {}
  std::string Name() const override { return "turbulenceat"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = inputs[0];
    spec.channels = DefaultChannelNames(channels_);
    spec.alpha = spec.ChannelIndex("A");
    spec.type = PixelType::kFloat;
    return spec;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), false);
    std::fill_n(needed.begin(), 2, true);
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<SvgAtStage>(params());
  }

 private:
  int channels_;
};

}  // namespace

OpInfo SvgTurbulenceAtInfo() {
  OpInfo info;
  info.name = "turbulenceat";
  info.family = "noise";
  info.summary = "SVG's feTurbulence at the positions held in an image";
  info.help =
      "The first two coordinates of an AOV file's positions, found by their names, else the first two "
      "channels, are points of user space: what --pattern turbulence and --pattern fractalnoise have at "
      "pixel (x, y), this has where the position is (x, y), in the same bits. type= is the filter's "
      "attribute. The result has channels= channels, of which the first four have a noise each and further "
      "ones are 0. stitch= tiles the image's display window. A position that is NaN or infinite gives "
      "noise 0, which is 0 for turbulence and 0.5 for fractalnoise.\n"
      "Source: SVG 1.1, section 15.24.";
  info.bound = "1e-5 * sum of weights, and the seed's rules exactly";
  info.bound_u = 84;
  info.modifiers = {ChoiceModifier("type", {"turbulence", "fractalnoise"}, "sums of |noise|, or of noise"),
                    IntegerModifier("channels", "4", 1, 64, "channels of the result")};
  for (ParamInfo& modifier : SvgModifiers()) info.modifiers.push_back(std::move(modifier));
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const bool named = !FindAov(in[0].spec(), Aov::kPosition).empty();
    return SvgTurbulenceAt(named ? PositionsOf(in[0]) : in[0],
                           SvgArguments(a, a.Text("type") == "fractalnoise"), a.Integer("channels"));
  };
  info.examples = {"basefreq=2.7", "type=fractalnoise seed=7 basefreq=3,11 octaves=4 channels=3"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node SvgTurbulenceAt(const Node& position, const SvgTurbulenceParams& params, int channels) {
  const char* const name = "turbulenceat";
  const ImageSpec& spec = position.spec();
  if (spec.channel_count() < 2) {
    throw DataError(name, "found " + std::to_string(spec.channel_count()) +
                              " channels, expected at least 2, coordinates x and y");
  }
  if (channels < 1) {
    throw Error(std::string(name) + ":channels",
                "found " + std::to_string(channels) + ", expected at least 1");
  }
  ops::CheckSvg(name, params);
  SvgTurbulenceParams p = params;
  p.frame = spec.display_window.empty() ? spec.data_window : spec.display_window;
  return graph::MakeNode(std::make_shared<const ops::SvgAtOp>(p, channels), {position});
}

}  // namespace tessera
