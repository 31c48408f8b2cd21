// Blocks of stored noise in the four packings, and turbulence looked up in them.
#include "tessera/ops/stored_noise.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "ops/wrap.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/lookup.h"
#include "tessera/ops/noise.h"
#include "tessera/render.h"

namespace tessera {
namespace {

constexpr int kPackedOctaves = 4;

void Require(bool valid, const char* name, int found, const char* expected) {
  if (valid) return;
  throw Error(std::string("stored noise:") + name,
              "found " + std::to_string(found) + ", expected " + expected);
}

bool IsInteger(PixelType type) { return type == PixelType::kUint8 || type == PixelType::kUint16; }
bool HasFourChannels(NoisePacking packing) {
  return packing == NoisePacking::kOctaves || packing == NoisePacking::kNormal;
}

// n(2^k p) on the lattice that repeats after the block's cells.
Node OctaveOf(const StoredNoiseParams& params, int k) {
  NoiseParams p;
  p.dims = 3;
  p.seed = params.seed;
  p.frequency = std::ldexp(params.cells, k);
  p.period = {params.cells, params.cells, params.cells, 0};
  p.slices = params.size;
  p.offset[2] = 0.5 * p.frequency / params.size;
  const bool normal = params.packing == NoisePacking::kNormal;
  if (normal) p.output = NoiseOutput::kNormal;
  return Noise(ImageSpec(params.size, params.size * params.size, normal ? 4 : 1), p);
}

// term / 2^k added to a sum, which may be empty.
void AddOctave(Node& sum, const Node& term, int k) {
  const Node weighted = k == 0 ? term : MulConstant(term, {std::ldexp(1.0, -k)});
  sum = sum ? Add(sum, weighted) : weighted;
}

}  // namespace

Node StoredNoiseImage(const StoredNoiseParams& params) {
  Require(params.size >= 2 && params.size <= 512, "size", params.size, "2 to 512 samples");
  Require(params.cells >= 1 && params.cells <= params.size, "cells", params.cells, "1 to the size");
  Require(params.octaves >= 1 && params.octaves <= 16, "octaves", params.octaves, "1 to 16");
  const bool integer = IsInteger(params.storage);
  if (params.packing == NoisePacking::kPrecomputed) {
    Node sum;
    for (int k = 0; k < params.octaves; ++k) AddOctave(sum, Abs(OctaveOf(params, k)), k);
    return integer ? MulConstant(sum, {0.5}) : sum;
  }
  Node block = OctaveOf(params, 0);
  for (int k = 1; k < kPackedOctaves && params.packing == NoisePacking::kOctaves; ++k) {
    block = AppendChannels(block, OctaveOf(params, k));
  }
  return integer ? AddConstant(MulConstant(block, {0.5}), {0.5}) : block;
}

Table StoredNoise(const StoredNoiseParams& params) {
  const Image image = Render(StoredNoiseImage(params), params.storage);
  return TableFromImage(image.view(), {.dims = 3, .slices = {params.size}});
}

Node StoredTurbulence(const Node& position, const Table& table, const StoredTurbulenceParams& params) {
  Require(params.octaves >= 1 && params.octaves <= 16, "octaves", params.octaves, "1 to 16");
  ops::RequireWrap("stored noise", params.wrap, {Wrap::kRepeat, Wrap::kMirror});
  const int channels = HasFourChannels(params.packing) ? kPackedOctaves : 1;
  Require(table.dims() == 3, "table", table.dims(), "three dimensions");
  Require(table.channels() == channels, "table", table.channels(),
          channels == 1 ? "one channel in this packing" : "four channels in this packing");
  const bool integer = IsInteger(table.storage());
  const LookupParams lookup{.wrap = {params.wrap}};
  const auto read = [&](int k) {  // at 2^k times the position
    return Lookup(k == 0 ? position : MulConstant(position, {std::ldexp(1.0, k)}), table, lookup);
  };
  if (params.packing == NoisePacking::kPrecomputed) return integer ? MulConstant(read(0), {2}) : read(0);
  const auto size_of = [&](const Node& stored) {
    return Abs(integer ? AddConstant(MulConstant(stored, {2}), {-1}) : stored);
  };
  const auto channel = [](const Node& image, int c) {
    return SelectChannels(image, {image.spec().channels[static_cast<size_t>(c)]});
  };
  Node sum;
  if (params.packing == NoisePacking::kOctaves) {
    for (int k = 0; k < params.octaves; k += kPackedOctaves) {
      const Node octaves = size_of(read(k));
      for (int c = 0; c < std::min(kPackedOctaves, params.octaves - k); ++c)
        AddOctave(sum, channel(octaves, c), k + c);
    }
    return sum;
  }
  for (int k = 0; k < params.octaves; ++k) {
    const Node stored = read(k);
    AddOctave(sum, size_of(channels == 1 ? stored : channel(stored, 3)), k);
  }
  return sum;
}

}  // namespace tessera
