// Volumes: the hypertexture paper's six effects beside its frame rates, its turbulence table with errors, and
// five ways to composite one density volume, speed against error.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "call.h"
#include "harness.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/targets.h"

namespace tessera::bench {
namespace {

constexpr int kSide = 256;   // voxels a side of the distance field
constexpr double kZoom = 2;  // the body fills the picture's height
constexpr double kAzimuth = 25, kElevation = 15, kView = 30;

// One way to the picture, and the frames per second that the paper gives for it (0: none).
struct Way {
  std::string name;
  Node node;
  double paper = 0;
};
struct Picture {
  std::vector<Way> ways;
  Node truth;  // null: each way's own reference in double
};

struct Group {
  std::function<Picture()> make;
  Options options;
  int threads = 2;
  bool done = false;
  double pixels = 0, copy_ns = 0;
  Picture picture;
  std::vector<Measured> results;

  void MeasureOnce() {
    if (done) return;
    done = true;
    picture = make();
    const Image output(picture.ways[0].node.spec());
    const ImageView out = output.view();
    pixels = static_cast<double>(output.spec().data_window.pixels());
    const size_t bytes = static_cast<size_t>(out.row_stride) * static_cast<size_t>(out.roi.height());
    const std::vector<std::byte> from(bytes);
    std::vector<std::unique_ptr<Contestant>> contestants;
    contestants.push_back(std::make_unique<Call>(
        "copy memcpy", [&] { std::memcpy(out.data, from.data(), bytes); }, "", true));
    for (const Way& way : picture.ways) {
      contestants.push_back(std::make_unique<Call>(
          way.name, [&way, out, this] { RenderInto(way.node, out, {.threads = threads}); }));
    }
    Frame frame;
    frame.width = out.roi.width(), frame.height = out.roi.height();
    frame.output = output;
    results = Measure(std::move(contestants), frame,
                      Oracle(picture.truth ? picture.truth : picture.ways[0].node, 4, 1), options.repetitions,
                      options.seconds);
    copy_ns = Median(results[0].seconds) * 1e9 / pixels;
  }
};

void Report(benchmark::State& state, Group& group, const std::string& name) {
  group.MeasureOnce();
  for (const Measured& m : group.results) {
    if (m.name != name) continue;
    for (auto _ : state) state.SetIterationTime(Median(m.seconds));
    const double ns = Median(m.seconds) * 1e9 / group.pixels;
    state.counters["ns_per_pixel"] = ns;
    state.counters["times_copy"] = ns / group.copy_ns;
    state.counters["frames_per_second"] = 1 / Median(m.seconds);
    state.counters["repetitions"] = static_cast<double>(m.seconds.size());
    for (const Way& way : group.picture.ways) {
      if (way.name == name && way.paper > 0) state.counters["paper_frames_per_second"] = way.paper;
    }
    if (m.is_copy) return;
    state.counters["copy_share"] = group.copy_ns / ns;
    state.counters["max_error"] = m.errors.max;
    state.counters["rms_error"] = m.errors.rms;
    state.counters["values_checked"] = static_cast<double>(m.errors.values);
    return;
  }
  state.SkipWithError("has no call for this task");
}

void Register(const std::string& task, const std::string& pixels, int width, int height,
              const Options& options, std::vector<std::string> names, std::function<Picture()> make) {
  names.insert(names.begin(), "copy memcpy");
  for (const int threads : options.threads) {
    auto group = std::make_shared<Group>();
    group->make = make;
    group->options = options;
    group->threads = threads;
    const std::string prefix = "volume/" + task + "/" + pixels + "/" + std::to_string(width) + "x" +
                               std::to_string(height) + "/threads:" + std::to_string(threads) + "/";
    for (const std::string& name : names) {
      benchmark::RegisterBenchmark((prefix + name).c_str(),
                                   [group, name](benchmark::State& state) { Report(state, *group, name); })
          ->Iterations(1)
          ->UseManualTime()
          ->Unit(benchmark::kMillisecond);
    }
  }
}

const Volume& Body() {
  static const Volume kBody = DistanceField(
      Solid::Parse("body"), VolumeSpec::Centred({kSide, kSide, kSide}, PixelType::kUint16), 0.25);
  return kBody;
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

std::string OnBestTarget(const std::string& way) { return "tessera " + SimdTarget() + way; }

void RegisterEffects(const Options& options) {
  for (const Effect& e : kEffects) {
    for (int k = 0; k < 2; ++k) {
      const auto [width, height] = kFrames[k];
      const std::vector<std::string> names = {OnBestTarget("")};
      Register(e.name, "uint16 field", width, height, options, names, [=] {
        Picture p;
        const VolumeParams params = Params(Body(), e.mode, width, height);
        p.ways = {{OnBestTarget(""), RenderVolume(ImageSpec(width, height, 4), Body(), params), e.paper[k]}};
        return p;
      });
    }
  }
}

// Table 3 of the paper: frames per second of an ATI 9700 Pro. The error is the picture's distance from the
// one that reads turbulence by eight lookups in a block of 256^3.
void RegisterTurbulence(const Options& options) {
  struct Lookup {
    const char* name;
    TurbulenceLookup lookup;
    NoiseContent content;
    int octaves;
    double paper[2];
  };
  static constexpr Lookup kLookups[] = {
      {" 8 lookups", TurbulenceLookup::kEight, NoiseContent::kNoise, 1, {2.45, 0.49}},
      {" 4 lookups", TurbulenceLookup::kFour, NoiseContent::kNoise, 1, {7.14, 2.40}},
      {" 4 channels", TurbulenceLookup::kFourChannels, NoiseContent::kFourOctaves, 1, {23.02, 3.82}},
      {" precomputed block", TurbulenceLookup::kBlock, NoiseContent::kTurbulence, 4, {23.24, 4.18}},
      {" exact noise", TurbulenceLookup::kExact, NoiseContent::kTurbulence, 4, {0, 0}}};
  std::vector<std::string> names;
  for (const Lookup& l : kLookups) names.push_back(OnBestTarget(l.name));
  for (int k = 0; k < 2; ++k) {
    const auto [width, height] = kFrames[k];
    Register("turbulence in fire", "uint16 field", width, height, options, names, [=] {
      const auto node_of = [&](const Lookup& l, int size) {
        VolumeParams p = Params(Body(), VolumeMode::kFire, width, height);
        Dmf lift;
        lift.kind = Dmf::Kind::kLift;
        lift.amount = 0.17;
        lift.frequency = 0.95;
        lift.lookup = l.lookup;
        lift.block = NoiseBlock(l.content, 4, l.octaves, 0, size);
        Dmf tear = lift;
        tear.kind = Dmf::Kind::kTurbulence;
        tear.amount = 1.35;
        p.dmf = {lift, tear};
        return RenderVolume(ImageSpec(width, height, 4), Body(), p);
      };
      Picture p;
      for (const Lookup& l : kLookups) p.ways.push_back({OnBestTarget(l.name), node_of(l, 64), l.paper[k]});
      p.truth = node_of(kLookups[0], 256);
      return p;
    });
  }
}

void RegisterMethods(const Options& options) {
  constexpr int kSize = 512;
  static constexpr const char* kNames[] = {" rays", " slices", " shells", " stacks", " shear-warp"};
  for (const bool parallel : {true, false}) {
    std::vector<std::string> names;
    for (const char* name : kNames) names.push_back(OnBestTarget(name));
    Register(
        parallel ? "methods, parallel" : "methods, perspective", "uint16 128^3", kSize, kSize, options, names,
        [=] {
          const Volume cloud(VolumeSpec::Centred({128, 128, 128}, PixelType::kUint16), [](const Vector3& p) {
            return std::exp(-5 * Dot(p, p)) *
                   (0.6 + 0.4 * std::sin(9 * p[0]) * std::cos(8 * p[1] + 5 * p[2]));
          });
          VolumeParams p = Params(cloud, VolumeMode::kUnder, kSize, kSize, parallel ? 0 : kView);
          p.transfer = {{{0.1, {0.1, 0.2, 1}, 0}, {0.5, {1, 0.6, 0.2}, 0.08}, {1, {1, 1, 1}, 0.3}}, 0.02};
          Picture picture;
          const ImageSpec spec(kSize, kSize, 4);
          for (int m = 0; m < 5; ++m) {
            p.method = static_cast<VolumeMethod>(m);
            picture.ways.push_back({OnBestTarget(kNames[m]), RenderVolume(spec, cloud, p)});
          }
          p.method = VolumeMethod::kRays;
          p.termination = 0;
          p.step = cloud.spec().spacing[0] / 10;
          picture.truth = RenderVolume(spec, cloud, p);
          return picture;
        });
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
    const Options options = ParseOptions(&argc, argv);
    RegisterEffects(options);
    RegisterMethods(options);
    RegisterTurbulence(options);
    return RunRegistered(&argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_volume: error: %s\n", error.what());
    return 2;
  }
}
