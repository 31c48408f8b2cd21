// Volumes: the hypertexture paper's six effects beside its frame rates, scenes of several volumes, its
// turbulence table with errors, five ways to composite one density volume, speed against error, and what
// light within it costs.
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "contest.h"
#include "tessera/ops/noise.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"

namespace tessera::bench {
namespace {

constexpr int kSide = 256;   // voxels a side of the distance field
constexpr double kZoom = 2;  // the body fills the picture's height
constexpr double kAzimuth = 25, kElevation = 15, kView = 30;

// On the best target only.
void Register(const std::string& task, const std::string& pixels, int width, int height,
              const Options& options, const std::vector<std::string>& ways,
              const std::function<Contest()>& make) {
  Options best = options;
  best.targets.resize(1);
  for (const int threads : options.threads) {
    RegisterContest({"volume", task, pixels, width, height, threads, ways, {}}, best, make);
  }
}

// A contest for the picture; no ways yet.
Contest PictureOf(int width, int height) {
  Contest c;
  c.output = Image(ImageSpec(width, height, 4));
  c.oracle_rows = 1;
  return c;
}

const Volume& Body() {
  static const Volume kBody = DistanceField(
      Solid::Parse("body"), VolumeSpec::Centred({kSide, kSide, kSide}, PixelType::kUint16), 0.25);
  return kBody;
}

const Volume& Cloud() {
  static const Volume kCloud(VolumeSpec::Centred({128, 128, 128}, PixelType::kUint16), [](const Vector3& p) {
    return std::exp(-5 * Dot(p, p)) * (0.6 + 0.4 * std::sin(9 * p[0]) * std::cos(8 * p[1] + 5 * p[2]));
  });
  return kCloud;
}
VolumeTransferFunction CloudColors() {
  return {{{0.1, {0.1, 0.2, 1}, 0}, {0.5, {1, 0.6, 0.2}, 0.08}, {1, {1, 1, 1}, 0.3}}, 0.02};
}

VolumeParams Params(const Volume& volume, VolumeMode mode, int width, int height, double view = kView) {
  VolumeParams p;
  p.mode = mode;
  p.camera = OrbitCamera(volume, kAzimuth, kElevation, view, static_cast<double>(width) / height, kZoom);
  return p;
}

struct Effect {
  const char* name;
  VolumeMode mode;
  double paper[2];  // GeForce 6800 GT, frames per second without antialiasing at 300x300 and 1024x768
};
constexpr Effect kEffects[] = {
    {"lit", VolumeMode::kIso, {72.49, 20.57}},      {"solid", VolumeMode::kSolid, {69.33, 20.02}},
    {"bump", VolumeMode::kBump, {64.21, 17.52}},    {"fur", VolumeMode::kFur, {39.52, 9.88}},
    {"melting", VolumeMode::kMelt, {57.36, 16.92}}, {"fire", VolumeMode::kFire, {46.30, 10.42}}};
struct FrameSize {
  int width, height;
};
constexpr FrameSize kFrames[2] = {{300, 300}, {1024, 768}};

void RegisterEffects(const Options& options) {
  for (const Effect& e : kEffects) {
    for (int k = 0; k < 2; ++k) {
      const auto [width, height] = kFrames[k];
      Register(e.name, "uint16 field", width, height, options, {""}, [=] {
        Contest c = PictureOf(width, height);
        const VolumeParams params = Params(Body(), e.mode, width, height);
        c.ways = {{"", RenderVolume(c.output.spec(), Body(), params), e.paper[k]}};
        return c;
      });
    }
  }
}

// Fire whose turbulence is looked up so in a block.
Node FireOf(TurbulenceLookup lookup, const NoiseBlock& block, int width, int height) {
  VolumeParams p = Params(Body(), VolumeMode::kFire, width, height);
  Dmf lift;
  lift.kind = Dmf::Kind::kLift;
  lift.amount = 0.17;
  lift.frequency = 0.95;
  lift.lookup = lookup;
  lift.block = block;
  Dmf tear = lift;
  tear.kind = Dmf::Kind::kTurbulence;
  tear.amount = 1.35;
  p.dmf = {lift, tear};
  return RenderVolume(ImageSpec(width, height, 4), Body(), p);
}

constexpr int kBlockSize = 64, kFineSize = 256, kCells = 4;

// The sum of four octaves of the noise that the lookups read, ready-made.
NoiseBlock SumOfOctaves() {
  constexpr size_t kSamples = static_cast<size_t>(kBlockSize) * kBlockSize * kBlockSize;
  std::vector<float> sum(kSamples, 0);
  for (int octave = 0; octave < 4; ++octave) {
    NoiseParams noise;
    noise.dims = 3;
    noise.frequency = kCells << octave;
    noise.period = {kCells, kCells, kCells, 0};
    noise.slices = kBlockSize;
    noise.offset[2] = 0.5 * noise.frequency / kBlockSize;
    const Image samples = Render(Noise(ImageSpec(kBlockSize, kBlockSize * kBlockSize, 1), noise));
    const auto* const n = reinterpret_cast<const float*>(samples.view().data);
    for (size_t i = 0; i < kSamples; ++i) sum[i] += std::fabs(n[i]) / static_cast<float>(1 << octave);
  }
  return NoiseBlock(sum, kBlockSize, 1);
}

// Table 3 of the paper: frames per second of an ATI 9700 Pro. All read one noise: the error is the picture's
// distance from the one that reads turbulence by eight lookups in a block of 256^3.
void RegisterTurbulence(const Options& options) {
  struct Lookup {
    const char* name;
    TurbulenceLookup lookup;
    double paper[2];
  };
  static constexpr Lookup kLookups[] = {{"8 lookups", TurbulenceLookup::kEight, {2.45, 0.49}},
                                        {"4 lookups", TurbulenceLookup::kFour, {7.14, 2.40}},
                                        {"4 channels", TurbulenceLookup::kFourChannels, {23.02, 3.82}},
                                        {"precomputed block", TurbulenceLookup::kBlock, {23.24, 4.18}}};
  std::vector<std::string> names;
  for (const Lookup& l : kLookups) names.emplace_back(l.name);
  for (int k = 0; k < 2; ++k) {
    const auto [width, height] = kFrames[k];
    Register("turbulence in fire", "uint16 field", width, height, options, names, [=] {
      const auto noise = [](int size) { return NoiseBlock(NoiseContent::kNoise, kCells, 1, 0, size); };
      Contest c = PictureOf(width, height);
      for (const Lookup& l : kLookups) {
        const NoiseBlock block = l.lookup == TurbulenceLookup::kBlock ? SumOfOctaves()
                                 : l.lookup == TurbulenceLookup::kFourChannels
                                     ? NoiseBlock(NoiseContent::kFourOctaves, kCells, 4, 0, kBlockSize)
                                     : noise(kBlockSize);
        c.ways.push_back({l.name, FireOf(l.lookup, block, width, height), l.paper[k]});
      }
      c.truth = FireOf(TurbulenceLookup::kEight, noise(kFineSize), width, height);
      return c;
    });
    // The turbulence of the presets, whose octaves are noises of their own: its block beside the noise
    // itself.
    Register("preset turbulence in fire", "uint16 field", width, height, options, {"block", "exact noise"},
             [=] {
               const auto block = [](int size) {
                 return NoiseBlock(NoiseContent::kTurbulence, kTurbulenceCells, kTurbulenceOctaves, 0, size);
               };
               Contest c = PictureOf(width, height);
               c.ways = {{"block", FireOf(TurbulenceLookup::kBlock, block(kBlockSize), width, height)},
                         {"exact noise", FireOf(TurbulenceLookup::kExact, block(kBlockSize), width, height)}};
               c.truth = c.ways[1].node;
               return c;
             });
  }
}

void RegisterMethods(const Options& options) {
  constexpr int kSize = 512;
  static constexpr const char* kNames[] = {"rays", "slices", "shells", "stacks", "shear-warp"};
  for (const bool parallel : {true, false}) {
    const std::vector<std::string> names(std::begin(kNames), std::end(kNames));
    Register(parallel ? "methods, parallel" : "methods, perspective", "uint16 128^3", kSize, kSize, options,
             names, [=] {
               const Volume& cloud = Cloud();
               VolumeParams p = Params(cloud, VolumeMode::kUnder, kSize, kSize, parallel ? 0 : kView);
               p.transfer = CloudColors();
               Contest c = PictureOf(kSize, kSize);
               for (int m = 0; m < 5; ++m) {
                 p.method = static_cast<VolumeMethod>(m);
                 c.ways.push_back({kNames[m], RenderVolume(c.output.spec(), cloud, p)});
               }
               p.method = VolumeMethod::kRays;
               p.termination = 0;
               p.step = cloud.spec().spacing[0] / 10;
               c.truth = RenderVolume(c.output.spec(), cloud, p);
               return c;
             });
  }
}

// What light within a cloud and a chain cost beside the cloud alone, and the cloud's own shadow by its nodes,
// errors against nodes at every voxel. An opacity volume is made anew for every picture: a frame's time has
// it.
void RegisterMedia(const Options& options) {
  constexpr int kSize = 512;
  Register("a cloud, lit", "uint16 128^3", kSize, kSize, options, {"plain", "phase", "chain"}, [] {
    VolumeParams p = Params(Cloud(), VolumeMode::kUnder, kSize, kSize);
    p.transfer = CloudColors();
    Contest c = PictureOf(kSize, kSize);
    c.ways.push_back({"plain", RenderVolume(c.output.spec(), Cloud(), p)});
    p.scatter.phase = 0.4;
    c.ways.push_back({"phase", RenderVolume(c.output.spec(), Cloud(), p)});
    p.scatter = {};
    p.dmf = ParseDmf("warp(.05,1),turbulence(.8,1)*height(-1,1)");
    c.ways.push_back({"chain", RenderVolume(c.output.spec(), Cloud(), p)});
    return c;
  });
  static constexpr int kNodes[] = {17, 33, 64, 128};
  Register("a cloud, shadowed", "uint16 128^3", kSize, kSize, options, {"17 nodes", "33 nodes", "64 nodes"},
           [] {
             VolumeParams p = Params(Cloud(), VolumeMode::kUnder, kSize, kSize);
             p.transfer = CloudColors();
             p.scatter.shadow = 1;
             Contest c = PictureOf(kSize, kSize);
             for (const int nodes : kNodes) {
               p.scatter.size = nodes;
               const Node node = RenderVolume(c.output.spec(), Cloud(), p);
               if (nodes < 128) {
                 c.ways.push_back({std::to_string(nodes) + " nodes", node});
               } else {
                 c.truth = node;
               }
             }
             return c;
           });
}

// Several volumes in one march: a surface that ends the rays of a medium, media whose extinctions add up
// where they overlap, and all three.
void RegisterScenes(const Options& options) {
  struct Scene {
    const char* name;
    std::vector<VolumeMode> modes;  // of the body, or of the cloud beside it
  };
  static const Scene kScenes[] = {
      {"two volumes, lit and cloud", {VolumeMode::kIso, VolumeMode::kUnder}},
      {"two volumes, fire and cloud", {VolumeMode::kFire, VolumeMode::kUnder}},
      {"three volumes, lit, fire and cloud", {VolumeMode::kIso, VolumeMode::kFire, VolumeMode::kUnder}}};
  for (const Scene& scene : kScenes) {
    for (const auto [width, height] : kFrames) {
      Register(scene.name, "uint16", width, height, options, {""}, [&scene, width = width, height = height] {
        std::vector<PlacedVolume> volumes;
        for (const VolumeMode mode : scene.modes) {
          PlacedVolume v;
          v.volume = mode == VolumeMode::kUnder ? Cloud() : Body();
          v.params = Params(Body(), mode, width, height);
          if (mode == VolumeMode::kUnder) {
            v.params.transfer = CloudColors();
            v.to_world[3] = 0.5;  // half beside the body
          }
          volumes.push_back(v);
        }
        Contest c = PictureOf(width, height);
        c.ways = {{"", RenderVolumes(c.output.spec(), volumes)}};
        return c;
      });
    }
  }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera::bench;
  try {
    if (const std::string flag = "--field="; argc == 2 && std::string(argv[1]).starts_with(flag)) {
      tessera::WriteRawVolume(Body(), argv[1] + flag.size());  // for bench/vtk_volume.py
      return 0;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_volume: error: %s\n", error.what());
    return 2;
  }
  return RunSuite(argc, argv, [](const Options& options) {
    RegisterEffects(options);
    RegisterScenes(options);
    RegisterMethods(options);
    RegisterMedia(options);
    RegisterTurbulence(options);
  });
}
