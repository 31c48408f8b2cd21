// Volumes: frames per second of the hypertexture paper's six effects beside its tables, its turbulence table with
// errors, and five ways to composite one density volume, speed against error. `bench_volume [threads] [voxels a side]`.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "tessera/error.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera::bench {
namespace {

struct Frame {
  int width, height;
};
constexpr Frame kFrames[2] = {{300, 300}, {1024, 768}};
constexpr double kZoom = 2;  // the body fills the picture's height

// Median of at least 15 frames, seconds; the volume's tables are made before.
double Seconds(const Node& node, const Image& out, int threads) {
  const RenderOptions options{.threads = threads};
  RenderInto(node, out.view(), options);
  std::vector<double> seconds;
  double sum = 0;
  while (seconds.size() < 15 || (sum < 0.5 && seconds.size() < 60)) {
    const auto start = std::chrono::steady_clock::now();
    RenderInto(node, out.view(), options);
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    sum += seconds.back();
  }
  std::nth_element(seconds.begin(), seconds.begin() + static_cast<ptrdiff_t>(seconds.size() / 2), seconds.end());
  return seconds[seconds.size() / 2];
}

struct Difference {
  double rms = 0, most = 0;
};
Difference Between(const Image& a, const Image& b) {
  Difference d;
  const Roi& w = a.spec().data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      for (int c = 0; c < 4; ++c) {
        const double e = std::fabs(static_cast<double>(a.at<float>(x, y, c)) - b.at<float>(x, y, c));
        d.rms += e * e;
        d.most = std::max(d.most, e);
      }
    }
  }
  d.rms = std::sqrt(d.rms / (4.0 * static_cast<double>(w.pixels())));
  return d;
}

struct Effect {
  const char* name;
  VolumeMode mode;
  double paper[2];  // GeForce 6800 GT, frames per second without antialiasing
};
constexpr Effect kEffects[] = {{"lit", VolumeMode::kIso, {72.49, 20.57}},   {"solid", VolumeMode::kSolid, {69.33, 20.02}},
                               {"bump", VolumeMode::kBump, {64.21, 17.52}}, {"fur", VolumeMode::kFur, {39.52, 9.88}},
                               {"melting", VolumeMode::kMelt, {57.36, 16.92}}, {"fire", VolumeMode::kFire, {46.30, 10.42}}};

VolumeParams Params(const Volume& volume, VolumeMode mode, const Frame& f, double fov = 30) {
  VolumeParams p;
  p.mode = mode;
  p.camera = OrbitCamera(volume, 25, 15, fov, static_cast<double>(f.width) / f.height, kZoom);
  return p;
}

void Effects(const Volume& volume, int threads) {
  std::printf("\nEffects (frames/s; paper: GeForce 6800 GT)\n%-10s%10s%10s%8s%10s%10s%8s%12s%12s\n", "", "300x300", "paper",
              "ratio", "1024x768", "paper", "ratio", "max error", "RMS error");
  for (const Effect& e : kEffects) {
    std::printf("%-10s", e.name);
    for (int k = 0; k < 2; ++k) {
      const Frame& f = kFrames[k];
      const Node node = RenderVolume(ImageSpec(f.width, f.height, 4), volume, Params(volume, e.mode, f));
      const double rate = 1 / Seconds(node, Image(ImageSpec(f.width, f.height, 4)), threads);
      std::printf("%10.1f%10.2f%8.2f", rate, e.paper[k], rate / e.paper[k]);
    }
    // Against the march in double, on some tiles of a small picture.
    const Node node = RenderVolume(ImageSpec(96, 96, 4), volume, Params(volume, e.mode, {96, 96}));
    const VerifyReport report = Verify(node, PixelType::kFloat, {.samples = 6, .tile_size = 16, .render = {}});
    std::printf("%12.1e%12.1e%s\n", report.max_error, report.rms_error, report.within_bound ? "" : "  OUT OF BOUND");
    std::fflush(stdout);
  }
}

void Turbulence(const Volume& volume, int threads) {
  std::printf("\nTurbulence in the march (fire; frames/s; paper: ATI 9700 Pro; error: picture from 64^3 against 256^3 noise)\n"
              "%-22s%10s%10s%10s%10s%12s%12s\n", "", "300x300", "paper", "1024x768", "paper", "RMS", "max");
  struct Row {
    const char* name;
    TurbulenceLookup lookup;
    NoiseContent content;
    int octaves;
    double paper[2];
  };
  const Row rows[] = {{"8 lookups", TurbulenceLookup::kEight, NoiseContent::kNoise, 1, {2.45, 0.49}},
                      {"4 lookups", TurbulenceLookup::kFour, NoiseContent::kNoise, 1, {7.14, 2.40}},
                      {"4 channels", TurbulenceLookup::kFourChannels, NoiseContent::kFourOctaves, 1, {23.02, 3.82}},
                      {"precomputed block", TurbulenceLookup::kBlock, NoiseContent::kTurbulence, 4, {23.24, 4.18}}};
  for (const Row& row : rows) {
    const auto node_of = [&](const Frame& f, int size) {
      VolumeParams p = Params(volume, VolumeMode::kFire, f);
      Dmf lift;
      lift.kind = Dmf::Kind::kLift;
      lift.amount = 0.17;
      lift.frequency = 0.95;
      lift.lookup = row.lookup;
      lift.block = NoiseBlock(row.content, 4, row.octaves, 0, size);
      Dmf tear = lift;
      tear.kind = Dmf::Kind::kTurbulence;
      tear.amount = 1.35;
      p.dmf = {lift, tear};
      return RenderVolume(ImageSpec(f.width, f.height, 4), volume, p);
    };
    std::printf("%-22s", row.name);
    for (int k = 0; k < 2; ++k) {
      const Frame& f = kFrames[k];
      std::printf("%10.1f%10.2f", 1 / Seconds(node_of(f, 64), Image(ImageSpec(f.width, f.height, 4)), threads), row.paper[k]);
    }
    const Difference d = Between(Render(node_of({150, 150}, 64)), Render(node_of({150, 150}, 256)));
    std::printf("%12.1e%12.1e\n", d.rms, d.most);
    std::fflush(stdout);
  }
}

void Methods(int threads) {
  const Volume cloud(VolumeSpec::Centred({128, 128, 128}, PixelType::kUint16), [](const Vector3& p) {
    return std::exp(-5 * Dot(p, p)) * (0.6 + 0.4 * std::sin(9 * p[0]) * std::cos(8 * p[1] + 5 * p[2]));
  });
  std::printf("\nMethods (128^3 density, 512x512, parallel view; error against rays at a tenth of a voxel)\n"
              "%-12s%10s%12s%12s\n", "", "ms", "RMS", "max");
  const Frame f = {512, 512};
  VolumeParams p = Params(cloud, VolumeMode::kUnder, f, 0);
  p.transfer = {{{0.1, {0.1, 0.2, 1}, 0}, {0.5, {1, 0.6, 0.2}, 0.08}, {1, {1, 1, 1}, 0.3}}, 0.02};
  p.termination = 0;
  p.step = cloud.spec().spacing[0] / 10;
  const Image fine = Render(RenderVolume(ImageSpec(f.width, f.height, 4), cloud, p));
  p.step = 0;
  p.termination = 1.0 / 512;
  const char* const names[] = {"rays", "slices", "shells", "stacks", "shear-warp"};
  for (int m = 0; m < 5; ++m) {
    p.method = static_cast<VolumeMethod>(m);
    const Node node = RenderVolume(ImageSpec(f.width, f.height, 4), cloud, p);
    const Image image(ImageSpec(f.width, f.height, 4));
    const double seconds = Seconds(node, image, threads);
    const Difference d = Between(image, fine);
    std::printf("%-12s%10.2f%12.1e%12.1e\n", names[m], 1e3 * seconds, d.rms, d.most);
  }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera;
  try {
    const int threads = argc > 1 ? std::atoi(argv[1]) : 2, side = argc > 2 ? std::atoi(argv[2]) : 256;
    const Volume volume =
        DistanceField(Solid::Parse("body"), VolumeSpec::Centred({side, side, side}, PixelType::kUint16), 0.25);
    std::printf("%d^3 uint16 distance field, %d threads, perspective\n", side, threads);
    bench::Effects(volume, threads);
    bench::Methods(threads);
    bench::Turbulence(volume, threads);
  } catch (const Error& e) {
    std::fprintf(stderr, "bench_volume: %s\n", e.what());
    return 1;
  }
}
