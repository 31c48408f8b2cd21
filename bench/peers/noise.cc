// libnoise and FastNoise2 as peers of noise.
#include <memory>

#include "noise_peers.h"

#if defined(TESSERA_BENCH_LIBNOISE)
#include <libnoise/noise.h>
#endif
#if defined(TESSERA_BENCH_FASTNOISE2)
#include <FastNoise/FastNoise.h>
#endif

namespace tessera::bench {
namespace {

[[maybe_unused]] constexpr char kLibnoise[] = "libnoise, its own lattice";
[[maybe_unused]] constexpr char kFastNoise[] = "FastNoise2, its own lattice";

[[maybe_unused]] float* Samples(const Image& image) { return reinterpret_cast<float*>(image.view().data); }

#if defined(TESSERA_BENCH_LIBNOISE)
Contest::Peer Libnoise(const NoiseParams& p, const Image& output) {
  return {kLibnoise, [p, output] {
            noise::module::Perlin perlin;
            perlin.SetOctaveCount(p.octaves);
            const int width = output.spec().width(), height = output.spec().height() / p.slices;
            const double step = p.frequency / width;
            float* to = Samples(output);
            for (int slice = 0; slice < p.slices; ++slice) {
              for (int y = 0; y < height; ++y) {
                for (int x = 0; x < width; ++x) {
                  *to++ = static_cast<float>(perlin.GetValue(x * step, y * step, p.offset[2] + slice * step));
                }
              }
            }
          }};
}
#endif

#if defined(TESSERA_BENCH_FASTNOISE2)
FastNoise::SmartNode<> FastGenerator(int octaves) {
  auto perlin = FastNoise::New<FastNoise::Perlin>();
  perlin->SetScale(1);
  if (octaves == 1) return perlin;
  auto sum = FastNoise::New<FastNoise::FractalFBm>();
  sum->SetSource(perlin);
  sum->SetOctaveCount(octaves);
  sum->SetGain(0.5f);
  sum->SetLacunarity(2);
  return sum;
}
Contest::Peer FastNoiseGrid(const NoiseParams& p, const Image& output) {
  return {kFastNoise, [p, output, generator = FastGenerator(p.octaves)] {
            const int width = output.spec().width(), height = output.spec().height() / p.slices;
            const auto step = static_cast<float>(p.frequency / width);
            const auto x = static_cast<float>(p.offset[0]), y = static_cast<float>(p.offset[1]),
                       z = static_cast<float>(p.offset[2]);
            if (p.dims == 2) {
              generator->GenUniformGrid2D(Samples(output), x, y, width, height, step, step, 1);
            } else {
              generator->GenUniformGrid3D(Samples(output), x, y, z, width, height, p.slices, step, step, step,
                                          1);
            }
          }};
}
Contest::Peer FastNoisePositions(const Image& positions, const Image& output) {
  struct Planes {
    std::vector<float> axis[3];
  };
  const auto planes = std::make_shared<Planes>();
  const float* const from = Samples(positions);
  const auto count = static_cast<size_t>(positions.spec().data_window.pixels());
  for (size_t i = 0; i < 3 * count; ++i) planes->axis[i % 3].push_back(from[i]);
  return {kFastNoise, [planes, output, count, generator = FastGenerator(1)] {
            generator->GenPositionArray3D(Samples(output), static_cast<int>(count), planes->axis[0].data(),
                                          planes->axis[1].data(), planes->axis[2].data(), 0, 0, 0, 1);
          }};
}
#endif

}  // namespace

std::vector<Contest::Peer> GridNoisePeers([[maybe_unused]] const NoiseParams& params,
                                          [[maybe_unused]] const Image& output) {
  std::vector<Contest::Peer> peers;
#if defined(TESSERA_BENCH_LIBNOISE)
  if (params.dims == 3) peers.push_back(Libnoise(params, output));
#endif
#if defined(TESSERA_BENCH_FASTNOISE2)
  peers.push_back(FastNoiseGrid(params, output));
#endif
  return peers;
}

std::vector<Contest::Peer> PositionNoisePeers([[maybe_unused]] const Image& positions,
                                              [[maybe_unused]] const Image& output) {
  std::vector<Contest::Peer> peers;
#if defined(TESSERA_BENCH_FASTNOISE2)
  peers.push_back(FastNoisePositions(positions, output));
#endif
  return peers;
}

std::vector<std::string> GridNoisePeerNames([[maybe_unused]] int dims) {
  std::vector<std::string> names;
#if defined(TESSERA_BENCH_LIBNOISE)
  if (dims == 3) names.emplace_back(kLibnoise);
#endif
#if defined(TESSERA_BENCH_FASTNOISE2)
  names.emplace_back(kFastNoise);
#endif
  return names;
}

std::vector<std::string> PositionNoisePeerNames() {
  std::vector<std::string> names;
#if defined(TESSERA_BENCH_FASTNOISE2)
  names.emplace_back(kFastNoise);
#endif
  return names;
}

std::string MissingNoisePeers() {
  std::string missing;
#if !defined(TESSERA_BENCH_LIBNOISE)
  missing += "libnoise is not built in: install libnoise-dev and configure again.\n";
#endif
#if !defined(TESSERA_BENCH_FASTNOISE2)
  missing +=
      "FastNoise2 is not built in: install https://github.com/Auburn/FastNoise2 (cmake --install, any prefix) "
      "and configure again with -DCMAKE_PREFIX_PATH=PREFIX.\n";
#endif
  return missing;
}

}  // namespace tessera::bench
