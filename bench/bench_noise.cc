// Noise on grids and at positions against FastNoise2 and libnoise, Gabor noise, SVG's turbulence, spots on a
// surface, and the four ways to
// eight octaves of turbulence: by formula, by eight lookups in a stored block, by two lookups of four
// channels, by one lookup in a precomputed block.
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "contest.h"
#include "harness.h"
#include "noise_peers.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/noise.h"
#include "tessera/ops/shaped_spots.h"
#include "tessera/ops/stored_noise.h"

namespace tessera::bench {
namespace {

constexpr int kSize = 1024, kBlock = 64, kPeriod = 4, kOctaves = 8;

void Register(const std::string& task, int width, int height, const Options& options,
              const std::vector<std::string>& ways, const std::vector<std::string>& peers,
              const std::function<Contest(int threads)>& make) {
  for (const int threads : options.threads) {
    const ContestNames names{"noise", task, "float", width, height, threads, ways, peers};
    RegisterContest(names, options, [make, threads] { return make(threads); });
  }
}

void RegisterGrid(const std::string& task, const Options& options, NoiseParams p, int width, int height) {
  p.offset = {0.1, 0.2, 0.37, 0};
  // The specification's other method beside it, where a cell has a whole number of pixels.
  const bool whole = p.octaves == 1 && p.slices == 1 && std::fmod(width, p.frequency) == 0;
  std::vector<std::string> ways = {""};
  if (whole) ways.emplace_back("by accumulation");
  Register(task, width, height, options, ways, GridNoisePeerNames(p.dims), [=](int threads) {
    Contest c;
    c.output = Image(ImageSpec(width, height, 1));
    c.ways.push_back({"", Noise(c.output.spec(), p)});
    if (whole) {
      NoiseParams accumulated = p;
      accumulated.method = NoiseMethod::kAccumulate;
      c.ways.push_back({"by accumulation", Noise(c.output.spec(), accumulated)});
    }
    c.peers = GridNoisePeers(p, c.output, threads);
    return c;
  });
}

void RegisterGrids(const Options& options) {
  NoiseParams p;
  for (const int dims : {3, 2}) {
    p.dims = dims;
    for (const int cells : {4, 16, 64, 256, 1024}) {
      p.frequency = cells;
      RegisterGrid(std::to_string(dims) + "-D " + std::to_string(cells) + " cells", options, p, kSize, kSize);
    }
  }
  p.dims = 3;
  p.slices = kBlock;
  for (const int cells : {4, 16, 64}) {
    p.frequency = cells;
    RegisterGrid("3-D block " + std::to_string(cells) + " cells", options, p, kBlock, kBlock * kBlock);
  }
  p.slices = 1;
  p.octaves = kOctaves;
  for (const int cells : {2, 8}) {
    p.frequency = cells;
    RegisterGrid("3-D fBm 8 octaves from " + std::to_string(cells) + " cells", options, p, kSize, kSize);
  }
}

// Positions in cells: a plane through four cells, or anywhere.
Image Positions(int size, bool random) {
  const Image image(ImageSpec(size, size, 3));
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> anywhere(-300, 300);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float plane[] = {4 * (static_cast<float>(x) + 0.5f) / static_cast<float>(size),
                             4 * (static_cast<float>(y) + 0.5f) / static_cast<float>(size), 0.37f};
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, c) = random ? anywhere(generator) : plane[c];
    }
  }
  return image;
}

Contest AtPositions(int threads) {
  NoiseParams p;
  p.dims = 3;
  p.frequency = 1;
  const Image positions = Positions(kSize, true);
  Contest c;
  c.output = Image(ImageSpec(kSize, kSize, 1));
  c.ways.push_back({"", NoiseAt(FromImage(positions), p)});
  c.peers = PositionNoisePeers(positions, c.output, threads);
  return c;
}

// Gabor noise, waves across the width or at positions, and SVG's turbulence both ways: no peer is built in
// that has them.
Contest GaborOnGrid(int dims, double waves, double bandwidth) {
  NoiseParams p;
  p.kind = NoiseKind::kGabor;
  p.dims = dims, p.frequency = waves, p.bandwidth = bandwidth;
  Contest c;
  c.output = Image(ImageSpec(kSize, kSize, 1));
  c.ways.push_back({"", Noise(c.output.spec(), p)});
  return c;
}
Contest GaborAt(bool random) {
  NoiseParams p;
  p.kind = NoiseKind::kGabor;
  p.dims = 3, p.frequency = 1;
  Contest c;
  c.output = Image(ImageSpec(kSize, kSize, 1));
  c.ways.push_back({"", NoiseAt(FromImage(Positions(kSize, random)), p)});
  return c;
}
Contest Svg() {
  SvgTurbulenceParams p;
  p.octaves = 4;
  Contest c;
  c.output = Image(ImageSpec(kSize, kSize, 4));
  const Image places(ImageSpec(kSize, kSize, 2));
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      places.at<float>(x, y, 0) = static_cast<float>(x);
      places.at<float>(x, y, 1) = static_cast<float>(y);
    }
  }
  c.ways = {{"pixels", SvgTurbulence(c.output.spec(), p)},
            {"positions", SvgTurbulenceAt(FromImage(places), p)}};
  return c;
}

// A paraboloid seen by its texture: stretched towards the rim.
Contest OnSurface(int cells) {
  const Image surface(ImageSpec(kSize, kSize, 3));
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const float u = static_cast<float>(2 * x - kSize) / kSize,
                  v = static_cast<float>(2 * y - kSize) / kSize;
      const float point[] = {u, v, u * u + v * v};
      for (int c = 0; c < 3; ++c) surface.at<float>(x, y, c) = point[c];
    }
  }
  Contest c;
  c.output = Image(ImageSpec(kSize, kSize, 1));
  ShapedSpotParams p;
  p.frequency = cells;
  c.ways.push_back({"", ShapedSpots(FromImage(surface), p)});
  return c;
}

Contest FourWays(int) {
  const Node position = FromImage(Positions(kSize, false));
  Node formula;
  for (int k = 0; k < kOctaves; ++k) {
    NoiseParams p;
    p.dims = 3;
    p.frequency = std::ldexp(1.0, k);
    p.period = {kPeriod, kPeriod, kPeriod, 0};
    const Node term = MulConstant(Abs(NoiseAt(position, p)), {std::ldexp(1.0, -k)});
    formula = k == 0 ? term : Add(formula, term);
  }
  const Node in_blocks = MulConstant(position, {1.0 / kPeriod});
  const auto stored = [&](NoisePacking packing) {
    const Table table =
        StoredNoise({.packing = packing, .size = kBlock, .cells = kPeriod, .octaves = kOctaves});
    return StoredTurbulence(in_blocks, table, {.packing = packing, .octaves = kOctaves});
  };
  Contest c;
  c.output = Image(ImageSpec(kSize, kSize, 1));
  c.ways = {{"formula", formula},
            {"8 lookups", stored(NoisePacking::kSingle)},
            {"4 channels, 2 lookups", stored(NoisePacking::kOctaves)},
            {"precomputed, 1 lookup", stored(NoisePacking::kPrecomputed)}};
  return c;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera::bench;
  return RunSuite(argc, argv, [](const Options& options) {
    std::fputs(MissingNoisePeers().c_str(), stderr);
    RegisterGrids(options);
    Register("3-D random positions", kSize, kSize, options, {""}, PositionNoisePeerNames(), AtPositions);
    for (const int waves : {16, 64}) {
      Register("Gabor 2-D " + std::to_string(waves) + " waves", kSize, kSize, options, {""}, {},
               [waves](int) { return GaborOnGrid(2, waves, 1); });
    }
    Register("Gabor 2-D 64 waves, bandwidth 0.3", kSize, kSize, options, {""}, {},
             [](int) { return GaborOnGrid(2, 64, 0.3); });
    Register("Gabor 3-D 16 waves", kSize, kSize, options, {""}, {},
             [](int) { return GaborOnGrid(3, 16, 1); });
    Register("Gabor at a plane's positions", kSize, kSize, options, {""}, {},
             [](int) { return GaborAt(false); });
    Register("Gabor at random positions", kSize, kSize, options, {""}, {}, [](int) { return GaborAt(true); });
    Register("SVG turbulence 4 octaves", kSize, kSize, options, {"pixels", "positions"}, {},
             [](int) { return Svg(); });
    for (const int cells : {16, 64, 256}) {
      Register("shapedspots " + std::to_string(cells) + " cells", kSize, kSize, options, {""}, {},
               [cells](int) { return OnSurface(cells); });
    }
    Register("turbulence 8 octaves", kSize, kSize, options,
             {"formula", "8 lookups", "4 channels, 2 lookups", "precomputed, 1 lookup"}, {}, FourWays);
  });
}
