// The words of the noise commands: modifiers, and the parameters that they make.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/number_text.h"
#include "model/gabor_lattice.h"
#include "ops/modifiers.h"
#include "ops/noise/noise_ops.h"
#include "tessera/error.h"

namespace tessera::ops {
const char* NoiseName(NoiseKind kind) {
  constexpr const char* kNames[] = {"white",  "value", "perlin", "simplex", "cell",
                                    "sparse", "spot",  "hash",   "gabor"};
  return kNames[static_cast<int>(kind)];
}

std::vector<ParamInfo> NoiseModifiers(NoiseKind kind) {
  constexpr double kFar = 0x1p40;
  const bool white = kind == NoiseKind::kWhite, per_pixel = white || kind == NoiseKind::kHash;
  std::vector<ParamInfo> m = {
      NumberModifier("seed", "0", -2147483648.0, 4294967295.0, "whole number, modulo 2^32"),
      NumberModifier("freq", per_pixel ? "0" : "8", 0, kFar,
                     per_pixel ? "cells across the width; 0: one per pixel"
                               : "lattice cells across the width; 0: one per pixel"),
      ListModifier("offset", "0", 4, -kFar, kFar, "position of the corner in cells: x,y,z,w"),
      NumberModifier("z", "0", -kFar, kFar, "third coordinate in cells, added to offset's"),
      NumberModifier("w", "0", -kFar, kFar, "fourth coordinate in cells, added to offset's"),
      IntegerModifier("dims", "2", 1, 4, "dimensions of the lattice"),
      IntegerModifier("octaves", "1", 0, 64, "number of octaves summed"),
      NumberModifier("lacunarity", "2", 1, 16, "frequency of an octave over the one before"),
      OnlyWith("!weights", NumberModifier("gain", "0.5", 0, 4, "weight of an octave over the one before")),
      ListModifier("weights", "", 64, -1e6, 1e6,
                   "weight per octave instead of gain; octaves without one have 0"),
      OnlyWith("!sum", FlagModifier("turbulence", "sum absolute values: the same as sum=turbulence")),
      ChoiceModifier("sum", {"fbm", "turbulence", "billow", "ridged"},
                     "n, |n|, 2|n|-1 or (1-|n|)^2 per octave; the last two fill [0,1] unless signed=1"),
      FlagModifier("signed", "values in [-1,1] instead of around 0.5"),
      OnlyWith("!gradient pack=none", FlagModifier("color", "independent noise in every channel")),
      OnlyWith("pack=none",
               FlagModifier("gradient", "channel 0 the value, further ones its slopes per cell")),
      ChoiceModifier("pack", {"none", "octaves", "normal"},
                     "octaves: one in each channel, as many as channels or more; normal: R, G, B the "
                     "gradient's direction, A the value"),
      NumberModifier("aspect", "1", 1e-3, 1e3, "cells along x for one along y"),
      NumberModifier("warp", "0", -1e4, 1e4, "domain warp: positions move by this many cells times noise"),
      FlagModifier("antialias", "fade octaves to their mean from 1/2 to 1 cell per pixel"),
      IntegerModifier("slices", "1", 1, 65536, "slices of a volume stacked along y, one step of z apart"),
      NumberModifier("bias", "0.5", 1e-6, 1 - 1e-6, "Perlin's bias of the result in [0,1]"),
      NumberModifier("contrast", "0.5", 1e-6, 1 - 1e-6, "Perlin's gain of the result in [0,1]"),
  };
  m.push_back(ListModifier("period", "0", 4, 0, 1 << 24, "cells until it repeats; 0: never"));
  if (kind == NoiseKind::kGradient) {
    m.push_back(ChoiceModifier("lattice", {"tessera", "perlin", "osl"}, "hash and gradients"));
  } else if (white || kind == NoiseKind::kHash || kind == NoiseKind::kSimplex) {
    m.push_back(ChoiceModifier("lattice", {"tessera", "osl"},
                               white ? "hash; osl is OSL's cellnoise"
                               : kind == NoiseKind::kHash
                                   ? "hash; osl is OSL's hashnoise"
                                   : "hash and gradients; osl is OSL's simplex noise"));
  } else {
    m.push_back(ChoiceModifier("lattice", {"tessera"}, "the only one: none is published for this noise"));
  }
  if (kind == NoiseKind::kGradient || kind == NoiseKind::kValue) {
    m.push_back(
        ChoiceModifier("method", {"auto", "accumulate"},
                       "accumulate: blocks of lattice points added in passes (whole pixels per cell)"));
    m.push_back(
        ChoiceModifier("fade", {"quintic", "cubic", "linear"}, "interpolation between lattice points"));
  }
  if (kind == NoiseKind::kCell) {
    m.push_back(ChoiceModifier("distance", {"f1", "f2", "f2-f1"},
                               "to the nearest, second nearest, or the difference"));
    m.push_back(NumberModifier("jitter", "1", 0, 1, "how far feature points leave cell centres"));
  }
  if (kind == NoiseKind::kSparse || kind == NoiseKind::kSpot) {
    m.push_back(NumberModifier("density", "2", 1e-3, 8, "impulses per cell"));
  }
  if (kind == NoiseKind::kSpot) {
    m.push_back(NumberModifier("stretch", "1", 1, 64, "length over width of a spot"));
    m.push_back(NumberModifier("angle", "0", -1e9, 1e9, "direction of spots, degrees counter-clockwise"));
  }
  if (kind == NoiseKind::kGabor) {
    m.push_back(NumberModifier("bandwidth", "1", model::kLeastBandwidth, model::kMostBandwidth,
                               "octaves that a kernel spans: 0.1 long even waves, 3 single blobs"));
    m.push_back(ChoiceModifier("orientation", {"isotropic", "anisotropic", "hybrid"},
                               "waves run in any direction, in one, or in those perpendicular to it"));
    m.push_back(ListModifier("direction", "1,0,0", 3, -1e6, 1e6, "of anisotropic and hybrid waves"));
    m.push_back(NumberModifier("angle", "0", -1e9, 1e9,
                               "turns the direction in the plane of x and y, degrees counter-clockwise"));
    m.push_back(NumberModifier("impulses", "16", 1, 32, "kernels that overlap at a point"));
  }
  return m;
}

NoiseParams NoiseArguments(NoiseKind kind, const Arguments& a) {
  const auto has = [&](const char* name) { return a.values.contains(name); };
  NoiseParams p;
  p.kind = kind;
  p.dims = a.Integer("dims");
  const auto seed = static_cast<int64_t>(a.Number("seed"));
  p.seed = static_cast<uint32_t>(seed);
  p.frequency = a.Number("freq");
  const std::vector<double>& offset = a.Numbers("offset");
  for (size_t i = 0; i < offset.size(); ++i) p.offset[i] = offset[i];
  p.offset[2] += a.Number("z");
  p.offset[3] += a.Number("w");
  p.octaves = a.Integer("octaves");
  p.lacunarity = a.Number("lacunarity");
  p.gain = a.Number("gain");
  if (a.Given("weights")) p.weights = a.Numbers("weights");
  constexpr std::pair<const char*, NoiseSum> kSums[] = {{"fbm", NoiseSum::kFbm},
                                                        {"turbulence", NoiseSum::kTurbulence},
                                                        {"billow", NoiseSum::kBillow},
                                                        {"ridged", NoiseSum::kRidged}};
  for (const auto& [name, sum] : kSums) {
    if (a.Text("sum") == name) p.sum = sum;
  }
  if (a.Flag("turbulence")) p.sum = NoiseSum::kTurbulence;
  p.is_signed = a.Flag("signed");
  p.output = a.Text("pack") == "octaves"  ? NoiseOutput::kOctaves
             : a.Text("pack") == "normal" ? NoiseOutput::kNormal
             : a.Flag("gradient")         ? NoiseOutput::kGradient
             : a.Flag("color")            ? NoiseOutput::kColor
                                          : NoiseOutput::kValue;
  p.aspect = a.Number("aspect");
  p.warp = a.Number("warp");
  if (has("antialias")) p.antialias = a.Flag("antialias");
  if (has("slices")) p.slices = a.Integer("slices");
  p.bias = a.Number("bias");
  p.contrast = a.Number("contrast");
  if (has("period")) {
    const std::vector<double>& period = a.Numbers("period");
    for (double cells : period) {
      if (cells != std::floor(cells)) {
        throw Error(std::string(NoiseName(kind)) + ":period",
                    "found " + base::NumberText(cells) + ", expected a whole number of cells");
      }
    }
    for (size_t i = 0; i < 4; ++i)
      p.period[i] = static_cast<int>(period.size() == 1 ? period[0] : i < period.size() ? period[i] : 0);
  }
  if (has("lattice")) {
    const std::string& lattice = a.Text("lattice");
    p.lattice = lattice == "perlin" ? NoiseLattice::kPerlin
                : lattice == "osl"  ? NoiseLattice::kOsl
                                    : NoiseLattice::kTessera;
  }
  if (has("fade")) {
    p.fade = a.Text("fade") == "cubic"    ? NoiseFade::kCubic
             : a.Text("fade") == "linear" ? NoiseFade::kLinear
                                          : NoiseFade::kQuintic;
  }
  if (has("method") && a.Text("method") == "accumulate") p.method = NoiseMethod::kAccumulate;
  if (has("distance")) {
    p.distance = a.Text("distance") == "f2"      ? CellDistance::kF2
                 : a.Text("distance") == "f2-f1" ? CellDistance::kF2MinusF1
                                                 : CellDistance::kF1;
  }
  if (has("jitter")) p.jitter = a.Number("jitter");
  if (has("density")) p.density = a.Number("density");
  if (has("stretch")) p.stretch = a.Number("stretch");
  if (has("angle")) p.angle = a.Number("angle");
  if (has("bandwidth")) p.bandwidth = a.Number("bandwidth");
  if (has("orientation")) {
    p.orientation = a.Text("orientation") == "hybrid"        ? GaborOrientation::kHybrid
                    : a.Text("orientation") == "anisotropic" ? GaborOrientation::kAnisotropic
                                                             : GaborOrientation::kIsotropic;
  }
  if (has("direction")) {
    const std::vector<double>& direction = a.Numbers("direction");
    for (size_t i = 0; i < 3; ++i) p.direction[i] = i < direction.size() ? direction[i] : 0;
  }
  if (has("impulses")) p.impulses = a.Number("impulses");
  return p;
}

}  // namespace tessera::ops
