// Spot noise whose spots are shaped by the Jacobian of a surface's parameterisation.
#include "tessera/ops/shaped_spots.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/number_text.h"
#include "graph/op.h"
#include "ops/modifiers.h"
#include "ops/noise/noise_ops.h"
#include "ops/noise/plan.h"
#include "simd/lattice.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/shade.h"

namespace tessera::ops {
namespace {

// Cells are few against pixels: their numbers are made one by one.
using simd::LatticeMix;
using simd::LatticeNext;
double Unit(uint32_t h) { return std::ldexp(h >> 8, -24); }

// Of coordinates that may lie far outside.
int PixelOf(double v) { return static_cast<int>(std::clamp(std::floor(v), -0x1p30, 0x1p30)); }

// A spot in pixels: height * (1 - (e x^2 + 2 f x y + g y^2))^2 around its centre.
struct Spot {
  double x = 0, y = 0, e = 0, f = 0, g = 0, height = 0;
};

class ShapedSpotsStage final : public graph::TileStage {
 public:
  ShapedSpotsStage(const ShapedSpotParams& params, const Roi& data) : params_(params), data_(data) {
    NoiseParams noise;
    noise.kind = NoiseKind::kSpot;
    noise.seed = params.seed;
    noise.density = params.density;
    noise.frequency = params.frequency;
    noise.frame = params.frame;
    const NoisePlan plan = MakeNoisePlan(noise, true, 0);
    shape_ = plan.shape;
    seed_ = plan.octaves[0].seed;
    cell_ = std::max(params.frame.width(), 1) / params.frequency;
  }
  Roi InputRoi(int, const Roi& out) const override {
    // Shapes are taken at the nearest pixel that exists: a cell may be far larger than the image.
    const int reach = PixelOf(2 * cell_ + 3);
    return Intersection(Inflate(out, reach, reach), data_);
  }

  void Run(const graph::TileArgs& args) const override {
    const Roi& r = args.out.roi;
    if (r.empty()) return;
    const auto width = static_cast<size_t>(r.width());
    const size_t pixels = width * static_cast<size_t>(r.height());
    double* const sum = args.scratch.Allocate<double>(pixels);
    std::fill_n(sum, pixels, 0.0);
    const auto cell_of = [&](int pixel, int corner) {
      return static_cast<int>(std::floor((pixel - corner + 0.5) / cell_));
    };
    // Row by row of cells, so that spots are added in one order whatever the tile.
    for (int j = cell_of(r.y0, params_.frame.y0) - 1; j <= cell_of(r.y1 - 1, params_.frame.y0) + 1; ++j) {
      for (int i = cell_of(r.x0, params_.frame.x0) - 1; i <= cell_of(r.x1 - 1, params_.frame.x0) + 1; ++i) {
        AddCell(i, j, args.in[0], r, sum);
      }
    }
    for (int y = r.y0; y < r.y1; ++y) {
      auto* const out = reinterpret_cast<float*>(args.out.At(r.x0, y));
      const double* const row = sum + static_cast<size_t>(y - r.y0) * width;
      for (size_t x = 0; x < width; ++x)
        out[x] = static_cast<float>(params_.is_signed ? row[x] : 0.5 + 0.5 * row[x]);
    }
  }

 private:
  void AddCell(int i, int j, const ConstImageView& position, const Roi& r, double* sum) const {
    const uint32_t h = LatticeMix((static_cast<uint32_t>(i) * simd::kAxis[0]) ^
                                  (static_cast<uint32_t>(j) * simd::kAxis[1]) ^ seed_);
    const uint32_t number = LatticeNext(h, 1);
    uint32_t state = h;
    for (int m = 0; m < kMaxImpulses && number >= shape_.poisson[m]; ++m) {
      state = LatticeNext(state, 2);
      const double x = params_.frame.x0 + (i + Unit(state)) * cell_;
      state = LatticeNext(state, 3);
      const double y = params_.frame.y0 + (j + Unit(state)) * cell_;
      state = LatticeNext(state, 4);
      Spot spot = ShapeAt(position, x, y);
      spot.x = x, spot.y = y;
      if (state >> 31 != 0) spot.height = -spot.height;
      if (spot.height != 0) Add(spot, r, sum);
    }
  }

  // The metric of the surface at a texel, as an ellipse of the spot's size.
  Spot ShapeAt(const ConstImageView& position, double x, double y) const {
    const int px = std::clamp(PixelOf(x), data_.x0, data_.x1 - 1);
    const int py = std::clamp(PixelOf(y), data_.y0, data_.y1 - 1);
    const int x0 = std::max(px - 1, data_.x0), x1 = std::min(px + 1, data_.x1 - 1);
    const int y0 = std::max(py - 1, data_.y0), y1 = std::min(py + 1, data_.y1 - 1);
    const auto point = [&](int u, int v) { return reinterpret_cast<const float*>(position.At(u, v)); };
    const float *left = point(x0, py), *right = point(x1, py), *up = point(px, y0), *down = point(px, y1);
    double e = 0, f = 0, g = 0;
    for (int c = 0; c < std::min(position.channels, 3); ++c) {
      const double du = (static_cast<double>(right[c]) - left[c]) / std::max(x1 - x0, 1);
      const double dv = (static_cast<double>(down[c]) - up[c]) / std::max(y1 - y0, 1);
      e += du * du, f += du * dv, g += dv * dv;
    }
    Spot spot;
    const double determinant = e * g - f * f;
    const double half = 0.5 * (e + g);
    if (!(determinant > 1e-6 * half * half) || !std::isfinite(determinant)) return spot;
    // The smaller eigenvalue, the square of the least stretch, without cancellation.
    const double least = determinant / (half + std::hypot(0.5 * (e - g), f));
    double square = least * cell_ * cell_;
    if (params_.radius > 0) square = std::min(square, params_.radius * params_.radius);
    spot.e = e / square, spot.f = f / square, spot.g = g / square;
    // A round spot that fills its cell has area cell^2 and the plan's height.
    spot.height = shape_.scale * std::sqrt(std::sqrt(determinant) / square * cell_ * cell_);
    return spot;
  }

  static void Add(const Spot& spot, const Roi& r, double* sum) {
    const double determinant = spot.e * spot.g - spot.f * spot.f;
    const double wide = std::sqrt(spot.g / determinant), high = std::sqrt(spot.e / determinant);
    const int x0 = std::max(PixelOf(spot.x - wide - 0.5), r.x0);
    const int x1 = std::min(PixelOf(spot.x + wide + 1.5), r.x1);
    const int y0 = std::max(PixelOf(spot.y - high - 0.5), r.y0);
    const int y1 = std::min(PixelOf(spot.y + high + 1.5), r.y1);
    for (int y = y0; y < y1; ++y) {
      const double dy = y + 0.5 - spot.y;
      double* const row = sum + static_cast<size_t>(y - r.y0) * static_cast<size_t>(r.width());
      for (int x = x0; x < x1; ++x) {
        const double dx = x + 0.5 - spot.x;
        const double t = std::max(1 - (spot.e * dx * dx + 2 * spot.f * dx * dy + spot.g * dy * dy), 0.0);
        row[x - r.x0] += spot.height * t * t;
      }
    }
  }

  ShapedSpotParams params_;
  Roi data_;
  NoiseShape shape_;
  uint32_t seed_ = 0;
  double cell_ = 1;  // pixels
};

class ShapedSpotsOp final : public graph::OpWith<ShapedSpotParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "shapedspots"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec spec = inputs[0];
    spec.channels = DefaultChannelNames(1);
    spec.alpha = -1;
    spec.type = PixelType::kFloat;
    return spec;
  }
  std::vector<bool> NeededChannels(int, const std::vector<bool>&, const ImageSpec& in) const override {
    std::vector<bool> needed(in.channels.size(), false);
    std::fill_n(needed.begin(), std::min(in.channel_count(), 3), true);
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<ShapedSpotsStage>(params(), context.output.data_window);
  }
};

}  // namespace

OpInfo ShapedSpotsInfo() {
  OpInfo info;
  info.name = "shapedspots";
  info.family = "noise";
  info.summary = "Spot noise that is round on a surface, from the image of its positions";
  info.help =
      "The positions of an AOV file, else the image's first two or three channels, are the surface's point at "
      "every texel. Spots of random "
      "sign, Poisson with density= per cell of the texture (freq= cells across the width), are ellipses "
      "there so that they are round on the surface: (1 - |J (p - c)|^2 / R^2)^2 with J the Jacobian at the "
      "spot's centre. R is radius=, or what lets the spot fill its cell; standard deviation 1/3 everywhere. "
      "Where the Jacobian is singular there is no spot.\n"
      "Source: van Wijk, Spot noise, 1991.";
  info.bound = "u times the value and the sum of the spots";
  info.bound_u = 1;
  info.modifiers = {
      NumberModifier("seed", "0", -2147483648.0, 4294967295.0, "whole number, modulo 2^32"),
      NumberModifier("freq", "8", 1e-6, 65536, "lattice cells across the width"),
      NumberModifier("density", "2", 1e-3, 8, "spots per cell"),
      NumberModifier("radius", "0", 0, 1e30, "largest radius on the surface; 0: as the cell allows"),
      FlagModifier("signed", "values around 0 instead of 0.5"),
  };
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    ShapedSpotParams p;
    p.seed = static_cast<uint32_t>(static_cast<int64_t>(a.Number("seed")));
    p.frequency = a.Number("freq");
    p.density = a.Number("density");
    p.radius = a.Number("radius");
    p.is_signed = a.Flag("signed");
    return ShapedSpots(FindAov(in[0].spec(), Aov::kPosition).empty() ? in[0] : PositionsOf(in[0]), p);
  };
  info.examples = {"", "freq=3 density=1 signed=1 seed=4"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node ShapedSpots(const Node& position, const ShapedSpotParams& params) {
  const ImageSpec& spec = position.spec();
  if (spec.channel_count() < 2) {
    throw DataError("shapedspots", "found " + std::to_string(spec.channel_count()) +
                                       " channels, expected two or three coordinates");
  }
  ShapedSpotParams p = params;
  p.frame = spec.display_window.empty() ? spec.data_window : spec.display_window;
  const auto require = [](bool valid, const char* name, double found, const char* expected) {
    if (!valid)
      throw Error(std::string("shapedspots:") + name,
                  "found " + base::NumberText(found) + ", expected " + expected);
  };
  require(p.frequency > 0 && p.frequency <= 65536, "freq", p.frequency, "more than 0, at most 65536 cells");
  p.frequency = std::min<double>(p.frequency, std::max(p.frame.width(), 1));  // a pixel per cell
  require(p.density > 0 && p.density <= 8, "density", p.density, "more than 0, at most 8");
  require(p.radius >= 0, "radius", p.radius, "0 or more");
  return graph::MakeNode(std::make_shared<const ops::ShapedSpotsOp>(p), {position});
}

}  // namespace tessera
