// Noise on grids and at positions against libnoise, and the four ways to eight octaves of turbulence: by
// formula, by eight lookups in a stored block, by two lookups of four channels, by one lookup in a
// precomputed block.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <memory>
#include <random>
#include <utility>

#include "call.h"
#include "harness.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/lookup.h"
#include "tessera/ops/noise.h"
#include "tessera/render.h"
#include "tessera/targets.h"
#if defined(TESSERA_BENCH_LIBNOISE)
#include <libnoise/noise.h>
#endif

namespace tessera::bench {
namespace {

// What a task evaluates: named graphs of one window, the first of which is the truth; and a peer without our
// lattice.
struct NoiseCase {
  std::string task;
  std::vector<std::pair<std::string, Node>> nodes;
  std::function<void(const ImageView&)> peer;
};

struct Group {
  std::function<NoiseCase()> make;
  Options options;
  bool done = false;
  double pixels = 0, copy_ns = 0;
  std::vector<Measured> results;

  void MeasureOnce() {
    if (done) return;
    done = true;
    const NoiseCase c = make();
    const Image output(c.nodes[0].second.spec());
    const ImageView out = output.view();
    pixels = static_cast<double>(output.spec().data_window.pixels());
    const size_t bytes = static_cast<size_t>(out.row_stride) * static_cast<size_t>(out.roi.height());
    const std::vector<std::byte> from(bytes);
    std::vector<std::unique_ptr<Contestant>> contestants;
    contestants.push_back(std::make_unique<Call>(
        "copy memcpy", [&] { std::memcpy(out.data, from.data(), bytes); }, "", true));
    for (const std::string& target : options.targets) {
      for (const auto& [suffix, node] : c.nodes) {
        contestants.push_back(std::make_unique<Call>(
            "tessera " + target + suffix, [&node = node, out] { RenderInto(node, out, {.threads = 1}); },
            target));
      }
    }
    if (c.peer)
      contestants.push_back(std::make_unique<Call>("libnoise, its own lattice", [&] { c.peer(out); }));
    Frame frame;
    frame.width = out.roi.width(), frame.height = out.roi.height();
    frame.output = output;
    results = Measure(std::move(contestants), frame, Oracle(c.nodes[0].second, 4, 2), options.repetitions,
                      options.seconds);
    copy_ns = Median(results[0].seconds) * 1e9 / pixels;
    SetSimdTarget("auto");
  }
};

void Report(benchmark::State& state, Group& group, const std::string& name) {
  group.MeasureOnce();
  for (const Measured& m : group.results) {
    if (m.name != name) continue;
    for (auto _ : state) state.SetIterationTime(Median(m.seconds));
    const double ns = Median(m.seconds) * 1e9 / group.pixels;
    state.counters["ns_per_pixel"] = ns;
    state.counters["ns_per_pixel_min"] =
        *std::min_element(m.seconds.begin(), m.seconds.end()) * 1e9 / group.pixels;
    state.counters["times_copy"] = ns / group.copy_ns;
    state.counters["repetitions"] = static_cast<double>(m.seconds.size());
    if (m.is_copy) return;
    state.counters["copy_share"] = group.copy_ns / ns;
    state.counters["max_error"] = m.errors.max;
    state.counters["rms_error"] = m.errors.rms;
    state.counters["values_checked"] = static_cast<double>(m.errors.values);
    return;
  }
  state.SkipWithError("has no call for this task");
}

void Register(const std::string& task, int width, int height, const Options& options,
              std::vector<std::string> suffixes, bool peer, std::function<NoiseCase()> make) {
  auto group = std::make_shared<Group>();
  group->make = std::move(make);
  group->options = options;
  std::vector<std::string> names = {"copy memcpy"};
  for (const std::string& target : options.targets) {
    for (const std::string& suffix : suffixes) names.push_back("tessera " + target + suffix);
  }
#if defined(TESSERA_BENCH_LIBNOISE)
  if (peer) names.push_back("libnoise, its own lattice");
#else
  (void)peer;
#endif
  const std::string prefix =
      "noise/" + task + "/float/" + std::to_string(width) + "x" + std::to_string(height) + "/threads:1/";
  for (const std::string& name : names) {
    benchmark::RegisterBenchmark((prefix + name).c_str(),
                                 [group, name](benchmark::State& state) { Report(state, *group, name); })
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  }
}

void RegisterGrid(const std::string& task, const Options& options, NoiseParams p, int width, int height) {
  p.offset = {0.1, 0.2, 0.37, 0};
  // The specification's other method beside it, where a cell has a whole number of pixels.
  const bool whole = p.octaves == 1 && p.slices == 1 && std::fmod(width, p.frequency) == 0;
  std::vector<std::string> methods = {""};
  if (whole) methods.emplace_back(" by accumulation");
  Register(task, width, height, options, methods, p.dims == 3, [=] {
    NoiseCase c;
    c.task = task;
    c.nodes = {{"", Noise(ImageSpec(width, height, 1), p)}};
    if (whole) {
      NoiseParams accumulated = p;
      accumulated.method = NoiseMethod::kAccumulate;
      c.nodes.emplace_back(" by accumulation", Noise(ImageSpec(width, height, 1), accumulated));
    }
#if defined(TESSERA_BENCH_LIBNOISE)
    c.peer = [p](const ImageView& out) {
      noise::module::Perlin perlin;
      perlin.SetOctaveCount(p.octaves);
      const double step = p.frequency / out.roi.width();
      const int height_of_slice = out.roi.height() / p.slices;
      for (int y = 0; y < out.roi.height(); ++y) {
        auto* const row = reinterpret_cast<float*>(out.At(0, y));
        const double z = p.offset[2] + (y / height_of_slice) * step;
        for (int x = 0; x < out.roi.width(); ++x) {
          row[x] = static_cast<float>(perlin.GetValue(x * step, (y % height_of_slice) * step, z));
        }
      }
    };
#endif
    return c;
  });
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

constexpr int kBlock = 64, kPeriod = 4, kOctaves = 8;

// n(scale * p) of lattice period 4, as a block of 64^3 that repeats after 4 cells.
Node Block(int scale) {
  NoiseParams p;
  p.dims = 3;
  p.frequency = kPeriod * scale;
  p.period = {kPeriod, kPeriod, kPeriod, 0};
  p.slices = kBlock;
  p.offset[2] = 0.5 * p.frequency / kBlock;
  return Noise(ImageSpec(kBlock, kBlock * kBlock, 1), p);
}
Table TableOf(const Node& node, PixelType storage) {
  const Image image = Render(node);
  const auto* data = reinterpret_cast<const float*>(image.view().data);
  const int channels = image.spec().channel_count();
  return Table({kBlock, kBlock, kBlock}, channels,
               {data, static_cast<size_t>(kBlock) * kBlock * kBlock * static_cast<size_t>(channels)},
               TableAlign::kCentres, storage);
}

NoiseCase FourWays(int size) {
  const Node position = FromImage(Positions(size, false));
  const LookupParams repeat{.wrap = {TableWrap::kRepeat}};
  const auto scaled = [&](double factor) { return MulConstant(position, {factor}); };
  const auto add = [](Node& sum, const Node& term) { sum = sum ? Add(sum, term) : term; };
  Node formula, eight, block_sum;
  const Table single = TableOf(Block(1), PixelType::kFloat);
  std::vector<Node> channels;
  for (int k = 0; k < kOctaves; ++k) {
    const double scale = std::ldexp(1.0, k);
    NoiseParams p;
    p.dims = 3;
    p.frequency = scale;
    p.period = {kPeriod, kPeriod, kPeriod, 0};
    add(formula, MulConstant(Abs(NoiseAt(position, p)), {1 / scale}));
    add(eight, MulConstant(Abs(Lookup(scaled(scale / kPeriod), single, repeat)), {1 / scale}));
    add(block_sum, MulConstant(Abs(Block(1 << k)), {1 / scale}));
    if (k < 4) channels.push_back(Block(1 << k));
  }
  const Table packed = TableOf(
      AppendChannels(AppendChannels(AppendChannels(channels[0], channels[1]), channels[2]), channels[3]),
      PixelType::kFloat);
  const Table precomputed = TableOf(block_sum, PixelType::kFloat);
  Node four;
  for (int k = 0; k < 2; ++k) {
    const Node octaves = Abs(Lookup(scaled(std::ldexp(1.0, 4 * k) / kPeriod), packed, repeat));
    for (int c = 0; c < 4; ++c)
      add(four, MulConstant(SelectChannels(octaves, {octaves.spec().channels[static_cast<size_t>(c)]}),
                            {std::ldexp(1.0, -4 * k - c)}));
  }
  NoiseCase result;
  result.nodes = {{" formula", formula},
                  {" 8 lookups", eight},
                  {" 4 channels, 2 lookups", four},
                  {" precomputed, 1 lookup", Lookup(scaled(1.0 / kPeriod), precomputed, repeat)}};
  return result;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera;
  using namespace tessera::bench;
  try {
    const Options options = ParseOptions(&argc, argv);
    constexpr int kSize = 1024;
    NoiseParams p;
    for (const int dims : {3, 2}) {
      p.dims = dims;
      for (const int cells : {4, 16, 64, 256, 1024}) {
        p.frequency = cells;
        RegisterGrid(std::to_string(dims) + "-D " + std::to_string(cells) + " cells", options, p, kSize,
                     kSize);
      }
    }
    p.dims = 3;
    p.frequency = 16;
    p.slices = kBlock;
    RegisterGrid("3-D block", options, p, kBlock, kBlock * kBlock);
    p.slices = 1;
    p.frequency = 8;
    p.octaves = 8;
    RegisterGrid("3-D fBm 8 octaves", options, p, kSize, kSize);
    Register("3-D random positions", kSize, kSize, options, {""}, false, [] {
      NoiseParams at;
      at.dims = 3;
      at.frequency = 1;
      NoiseCase c;
      c.nodes = {{"", NoiseAt(FromImage(Positions(kSize, true)), at)}};
      return c;
    });
    Register("turbulence 8 octaves", kSize, kSize, options,
             {" formula", " 8 lookups", " 4 channels, 2 lookups", " precomputed, 1 lookup"}, false,
             [] { return FourWays(kSize); });
    return RunRegistered(&argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_noise: error: %s\n", error.what());
    return 1;
  }
}
