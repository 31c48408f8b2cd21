// Noise on pixel grids: the generators white, value, perlin, simplex, cell, sparse, spot, hash and gabor.
#include "tessera/ops/noise.h"

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "ops/noise/field.h"
#include "ops/noise/noise_ops.h"

namespace tessera::ops {

NoiseEvaluate FindLattice(NoiseKind kind, NoiseLattice lattice, int dims, bool slopes);
NoiseEvaluate FindFeature(NoiseKind kind, int dims, bool slopes);
NoiseEvaluate FindSimplex(NoiseLattice lattice, int dims, bool slopes);
NoiseEvaluate FindGabor(int dims, bool slopes);

NoiseEvaluate FindNoise(NoiseKind kind, NoiseLattice lattice, int dims, bool slopes) {
  if (kind == NoiseKind::kSimplex) return FindSimplex(lattice, dims, slopes);
  if (kind == NoiseKind::kWhite || kind == NoiseKind::kHash || kind == NoiseKind::kValue ||
      kind == NoiseKind::kGradient) {
    return FindLattice(kind, lattice, dims, slopes);
  }
  if (kind == NoiseKind::kGabor) return FindGabor(dims, slopes);
  return FindFeature(kind, dims, slopes);
}

namespace {

class NoiseStage final : public graph::TileStage {
 public:
  NoiseStage(const NoiseParams& params, const ImageSpec& spec) : params_(params), spec_(spec) {
    const int fields = HasFieldPerChannel(params) ? spec.channel_count() : 1;
    for (int c = 0; c < fields; ++c) {
      const bool color = params.output == NoiseOutput::kColor;
      fields_.emplace_back(FieldParams(params, c), spec.data_window, color ? c : 0);
    }
    kernels_ = FindNoiseKernels();
  }
  Roi InputRoi(int, const Roi& out) const override { return out; }
  // Tiles have a cost of their own: narrow ones are high.
  graph::TileSize Preferred() const override {
    return {spec_.width(), std::max(64, 131072 / std::max(spec_.width(), 1))};
  }

  void Run(const graph::TileArgs& args) const override {
    const Roi& r = args.out.roi;
    if (r.empty()) return;
    const auto width = static_cast<size_t>(r.width());
    base::ArenaVector<GridCursor> cursors(args.scratch);
    for (const GridField& field : fields_) cursors.emplace_back(field, r.x0, r.x1, args.scratch);
    const auto row_of = [&] { return args.scratch.Allocate<float>(width + kNoisePadding); };
    float* const ones = row_of();
    float* const zeros = row_of();
    std::fill_n(ones, width, 1.0f);
    std::fill_n(zeros, width, 0.0f);
    base::ArenaVector<float*> values(args.scratch), planes(args.scratch);
    for (size_t c = 0; c < fields_.size(); ++c) values.push_back(row_of());
    float* slopes[4] = {};
    const bool gradient = HasSlopes(params_), normal = params_.output == NoiseOutput::kNormal;
    const bool packed = normal || params_.output == NoiseOutput::kOctaves;
    for (int a = 0; a < std::max(params_.dims, 3) && gradient; ++a) slopes[a] = row_of();
    const int channels = static_cast<int>(args.channels.size());
    for (int c : args.channels) {
      if (normal) {
        planes.push_back(c < 3 ? slopes[c] : c == 3 ? values[0] : zeros);
      } else if (gradient) {
        planes.push_back(c == 0 ? values[0] : c <= params_.dims ? slopes[c - 1] : zeros);
      } else {
        planes.push_back(
            c == spec_.alpha && !packed ? ones : values[fields_.size() > 1 ? static_cast<size_t>(c) : 0]);
      }
    }
    const bool direct = channels == 1 && planes[0] != ones && planes[0] != zeros && !gradient;
    if (direct) {
      const size_t field = fields_.size() > 1 ? static_cast<size_t>(args.channels[0]) : 0;
      float* const out = reinterpret_cast<float*>(args.out.At(r.x0, r.y0));
      const ptrdiff_t stride =
          r.height() > 1 ? reinterpret_cast<float*>(args.out.At(r.x0, r.y0 + 1)) - out : 0;
      return cursors[field].Run(r.y0, r.y1, out, stride, args.stream);
    }
    for (int y = r.y0; y < r.y1; ++y) {
      float* const out = reinterpret_cast<float*>(args.out.At(r.x0, y));
      for (size_t c = 0; c < cursors.size(); ++c) {
        const bool needed = std::find(planes.begin(), planes.end(), values[c]) != planes.end();
        if (needed || gradient) cursors[c].Row(y, values[c], gradient ? slopes : nullptr);
      }
      if (normal) kernels_.normal(slopes, params_.dims, r.width(), params_.is_signed);
      kernels_.interleave(planes.data(), channels, r.width(), out);
    }
  }

 private:
  NoiseParams params_;
  ImageSpec spec_;
  NoiseKernels kernels_;
  std::vector<GridField> fields_;
};

class NoiseOp final : public graph::OpWith<NoiseParams> {
 public:
  NoiseOp(const ImageSpec& spec, NoiseParams params) : OpWith(std::move(params)), spec_(spec) {}
  std::string Name() const override { return NoiseName(params().kind); }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec>) const override { return spec_; }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    return std::make_unique<NoiseStage>(params(), spec_);
  }

 private:
  ImageSpec spec_;
};

constexpr char kCommonHelp[] =
    "Pixel (x, y) is at ((x + 1/2) * step, (y + 1/2) * step, 0, 0) + offset in lattice cells, step = freq / "
    "width of the display window; z= and w= add to the third and fourth coordinate. Octave k has "
    "lacunarity^k times the frequency, weight gain^k and, but for the first one and for published lattices, "
    "a pseudo-random shift. Values are 0.5 + N / 2, with signed=1 N; a turbulence is its sum; billow and "
    "ridged are divided by the sum of the octaves' weights, 0.5 + N / 2 and N of that in [0,1], with "
    "signed=1 they are the sums. "
    "Alpha is 1. Cells and fractions are kept apart, so that noise at 2^31 is as good as at 0 (it comes "
    "back 2^32 cells away along an axis, and 2^31 away along two at once), and all instruction sets with "
    "FMA give the same bits.";

OpInfo NoiseRow(NoiseKind kind, const char* summary, const std::string& help,
                std::vector<std::string> examples) {
  OpInfo info;
  info.name = NoiseName(kind);
  info.family = "noise";
  info.generator = true;
  info.inputs = 0;
  info.summary = summary;
  info.help = help + "\n" + kCommonHelp;
  info.bound = "1e-6 on a range of 2, times the sum of the octaves' weights";
  info.bound_u = 16.7;
  info.modifiers = NoiseModifiers(kind);
  info.examples = std::move(examples);
  return info;
}

// The factory of a kind, as a plain function.
template <NoiseKind kind>
Node Make(std::span<const Node>, const Arguments& arguments, const ImageSpec* output) {
  return Noise(*output, NoiseArguments(kind, arguments));
}

}  // namespace

OpInfo WhiteNoiseInfo() {
  OpInfo info = NoiseRow(
      NoiseKind::kWhite, "White noise: an independent uniform number per cell",
      "A hash of the cell, uniform in [0,1) ([-1,1) with signed=1); one cell per pixel unless freq= says "
      "otherwise. lattice=osl is Open Shading Language's cellnoise.",
      {"", "seed=-1 signed=1 color=1"});
  info.make = Make<NoiseKind::kWhite>;
  return info;
}
OpInfo ValueNoiseInfo() {
  OpInfo info = NoiseRow(NoiseKind::kValue, "Value noise: random numbers at lattice points, interpolated",
                         "Uniform numbers in [-1,1] at lattice points, interpolated with the fade.",
                         {"", "dims=4 w=2.7 fade=linear freq=20"});
  info.make = Make<NoiseKind::kValue>;
  return info;
}
OpInfo GradientNoiseInfo() {
  OpInfo info = NoiseRow(
      NoiseKind::kGradient, "Gradient noise (Perlin)",
      "Gradients at lattice points, interpolated with the fade (Perlin 1985: fade=cubic, 2002: quintic); 0 "
      "at every lattice point. Gradients of lattice=tessera: unit vectors (2-D), edges of the cube (3-D), "
      "of the hypercube (4-D), scaled to [-1,1]. lattice=perlin: the published permutation and gradients, "
      "evaluated in double. lattice=osl: Open Shading Language's noise as in MaterialX and Cycles.\n"
      "Stored noise: slices= stacks a block (64x4096 with dims=3, slices=64 and period= is one of 64^3 that "
      "repeats) in the four packings of Miller and Jones: as it is; pack=octaves, a turbulence's octaves "
      "side by side; pack=normal, the gradient's direction with the density in A; turbulence=1, precomputed.",
      {"dims=3 z=0.5", "octaves=8 gain=0.5 dims=3 z=1.25 freq=3 signed=1", "gradient=1 dims=3 octaves=2",
       "lattice=perlin dims=3 z=-1.25 octaves=3"});
  info.make = Make<NoiseKind::kGradient>;
  return info;
}
OpInfo SimplexNoiseInfo() {
  OpInfo info = NoiseRow(
      NoiseKind::kSimplex, "Simplex noise: gradients at the corners of simplices",
      "Perlin's simplex grid with radial kernels (1/2 - r^2)^4, continuous in every derivative up to the "
      "third, scaled to [-1,1]. The skewed lattice repeats where the sum of coordinates passes +-2^31. With "
      "period= the lattice is turned and fitted to the periods, so lengths differ by up to 0.7 cells per "
      "period; axes without one then repeat after 2^20 cells. lattice=osl: Open Shading Language's simplex "
      "noise.",
      {"dims=3 z=0.5"});
  info.make = Make<NoiseKind::kSimplex>;
  return info;
}
OpInfo CellNoiseInfo() {
  OpInfo info = NoiseRow(
      NoiseKind::kCell, "Cell noise (Worley): distance to the nearest feature points",
      "One feature point per cell, sought in the 3^dims cells around a position; Euclidean distances in "
      "cells, not mapped to [0,1].",
      {""});
  info.make = Make<NoiseKind::kCell>;
  return info;
}
OpInfo SparseNoiseInfo() {
  OpInfo info =
      NoiseRow(NoiseKind::kSparse, "Sparse convolution noise (Lewis)",
               "Impulses of uniform random height, Poisson with density= per cell (at most 23 in a cell), "
               "convolved with the radial kernel (1 - r^2)^3 of radius one cell; isotropic, mean 0, standard "
               "deviation 1/3 by Campbell's theorem.",
               {""});
  info.make = Make<NoiseKind::kSparse>;
  return info;
}
OpInfo SpotNoiseInfo() {
  OpInfo info = NoiseRow(
      NoiseKind::kSpot, "Spot noise (van Wijk)",
      "Spots of random sign, Poisson with density= per cell (at most 23 in a cell), profile (1 - r^2)^2 over "
      "an ellipse one cell long and 1 / stretch wide; mean 0, standard deviation 1/3.",
      {"", "stretch=6 angle=30 freq=5"});
  info.make = Make<NoiseKind::kSpot>;
  return info;
}

OpInfo HashNoiseInfo() {
  OpInfo info = NoiseRow(
      NoiseKind::kHash, "Hash noise: an independent uniform number per position",
      "A hash of the coordinates' bits as floats, uniform in [0,1) ([-1,1) with signed=1): any other "
      "position has another number, so it is of use where positions are exact. lattice=osl is Open Shading "
      "Language's hashnoise (Cycles' white noise texture). Positions beyond 2^31 cells repeat.",
      {"", "lattice=osl freq=9 dims=3 offset=-0.3"});
  info.make = Make<NoiseKind::kHash>;
  return info;
}
OpInfo GaborNoiseInfo() {
  OpInfo info = NoiseRow(
      NoiseKind::kGabor, "Gabor noise: waves of one length, in any direction or in one",
      "Impulses, impulses= within a kernel's reach, convolved with exp(-pi a^2 r^2) cos(2 pi (w.x + "
      "phase)): a wave per cell (freq= is the waves across the width), of random phase, under a Gaussian "
      "that spans bandwidth= octaves at half amplitude, a = sqrt(pi / ln 2) (2^b - 1) / (2^b + 1), and "
      "ends at 1.26 / a. orientation=, direction= and bandwidth= mean what anisotropic, direction and "
      "bandwidth mean in Open Shading Language: isotropic waves run anywhere, anisotropic ones along "
      "direction= turned by angle=, hybrid ones perpendicular to it. A spectrum that is a ring, or a pair "
      "of spots, of Gaussian width; mean 0 and standard deviation 1/3, whatever the impulses. period= is "
      "no shorter than a kernel's radius; where it is shorter than two the variance is up to a tenth off.\n"
      "Source: Lagae et al. 2009.",
      {"", "orientation=anisotropic angle=30 bandwidth=0.3 octaves=2 signed=1",
       "dims=3 z=0.4 orientation=hybrid direction=1,1,0.5 impulses=4 freq=5",
       "gradient=1 period=8,6 freq=8"});
  info.bound += " and 1 + 2 radii of a kernel in waves, wherever kernels meet";
  info.make = Make<NoiseKind::kGabor>;
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Noise(const ImageSpec& spec, const NoiseParams& params) {
  const char* const name = ops::NoiseName(params.kind);
  if (spec.channels.empty()) throw Error(name, "found no channels, expected at least one");
  ops::CheckNoise(name, params);
  ops::CheckPacking(name, params, spec.channel_count());
  if (params.low_parts) throw Error(std::string(name) + ":low", "found low parts, which only positions have");
  NoiseParams p = params;
  p.frame = spec.display_window.empty() ? spec.data_window : spec.display_window;
  ops::CheckAccumulation(name, p);
  return graph::MakeNode(std::make_shared<const ops::NoiseOp>(spec, p), {});
}

}  // namespace tessera
