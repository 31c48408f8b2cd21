// libnoise and FastNoise2 as peers of noise.
#include <memory>

#include "noise_peers.h"
#include "workers.h"

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
Contest::Peer Libnoise(const NoiseParams& p, const Image& output, int threads) {
  const auto workers = std::make_shared<Workers>(threads);
  return {kLibnoise,
          [p, output, workers] {
            workers->Run([&](int thread) {
              noise::module::Perlin perlin;
              perlin.SetOctaveCount(p.octaves);
              const int width = output.spec().width(), rows = output.spec().height(),
                        height = rows / p.slices, count = workers->count();
              const double step = p.frequency / width;
              for (int row = rows * thread / count; row < rows * (thread + 1) / count; ++row) {
                float* const to = Samples(output) + static_cast<ptrdiff_t>(row) * width;
                for (int x = 0; x < width; ++x) {
                  to[x] = static_cast<float>(
                      perlin.GetValue(x * step, row % height * step, p.offset[2] + row / height * step));
                }
              }
            });
          },
          false};
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
// Rows of a plane, or slices of a block, a thread each.
Contest::Peer FastNoiseGrid(const NoiseParams& p, const Image& output, int threads) {
  const auto workers = std::make_shared<Workers>(threads);
  return {kFastNoise,
          [p, output, workers, generator = FastGenerator(p.octaves)] {
            const int width = output.spec().width(), height = output.spec().height() / p.slices;
            const auto step = static_cast<float>(p.frequency / width);
            const auto x = static_cast<float>(p.offset[0]), y = static_cast<float>(p.offset[1]),
                       z = static_cast<float>(p.offset[2]);
            workers->Run([&](int thread) {
              const int all = p.slices > 1 ? p.slices : height, count = workers->count(),
                        first = all * thread / count, part = all * (thread + 1) / count - first;
              const float shift = step * static_cast<float>(first);
              float* const to =
                  Samples(output) + static_cast<ptrdiff_t>(first) * width * (p.slices > 1 ? height : 1);
              if (p.dims == 2) {
                generator->GenUniformGrid2D(to, x, y + shift, width, part, step, step, 1);
              } else if (p.slices == 1) {
                generator->GenUniformGrid3D(to, x, y + shift, z, width, part, 1, step, step, step, 1);
              } else {
                generator->GenUniformGrid3D(to, x, y, z + shift, width, height, part, step, step, step, 1);
              }
            });
          },
          false};
}
Contest::Peer FastNoisePositions(const Image& positions, const Image& output, int threads) {
  struct Planes {
    std::vector<float> axis[3];
  };
  const auto planes = std::make_shared<Planes>();
  const float* const from = Samples(positions);
  const auto count = static_cast<size_t>(positions.spec().data_window.pixels());
  for (size_t i = 0; i < 3 * count; ++i) planes->axis[i % 3].push_back(from[i]);
  const auto workers = std::make_shared<Workers>(threads);
  return {kFastNoise,
          [planes, output, count, workers, generator = FastGenerator(1)] {
            workers->Run([&](int thread) {
              const auto index = static_cast<size_t>(thread), all = static_cast<size_t>(workers->count());
              const size_t first = count * index / all, part = count * (index + 1) / all - first;
              generator->GenPositionArray3D(Samples(output) + first, static_cast<int>(part),
                                            planes->axis[0].data() + first, planes->axis[1].data() + first,
                                            planes->axis[2].data() + first, 0, 0, 0, 1);
            });
          },
          false};
}
#endif

}  // namespace

std::vector<Contest::Peer> GridNoisePeers([[maybe_unused]] const NoiseParams& params,
                                          [[maybe_unused]] const Image& output,
                                          [[maybe_unused]] int threads) {
  std::vector<Contest::Peer> peers;
#if defined(TESSERA_BENCH_LIBNOISE)
  if (params.dims == 3) peers.push_back(Libnoise(params, output, threads));
#endif
#if defined(TESSERA_BENCH_FASTNOISE2)
  peers.push_back(FastNoiseGrid(params, output, threads));
#endif
  return peers;
}

std::vector<Contest::Peer> PositionNoisePeers([[maybe_unused]] const Image& positions,
                                              [[maybe_unused]] const Image& output,
                                              [[maybe_unused]] int threads) {
  std::vector<Contest::Peer> peers;
#if defined(TESSERA_BENCH_FASTNOISE2)
  peers.push_back(FastNoisePositions(positions, output, threads));
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
