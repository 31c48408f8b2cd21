// Peers of noise, those that are built in: libnoise, and FastNoise2 with the widest vectors of the processor.
// Each has a lattice of its own, so what is compared is speed.
#ifndef TESSERA_BENCH_NOISE_PEERS_H_
#define TESSERA_BENCH_NOISE_PEERS_H_

#include <string>
#include <vector>

#include "contest.h"
#include "tessera/image.h"
#include "tessera/ops/noise.h"

namespace tessera::bench {

// Gradient noise of two or three dimensions on the pixels of `output`, slices stacked along y.
std::vector<Contest::Peer> GridNoisePeers(const NoiseParams& params, const Image& output, int threads);
// One octave at the positions of a three-channel image, in cells.
std::vector<Contest::Peer> PositionNoisePeers(const Image& positions, const Image& output, int threads);
// The names that these give.
std::vector<std::string> GridNoisePeerNames(int dims);
std::vector<std::string> PositionNoisePeerNames();
// What is not built in and how to get it; empty when nothing is missing.
std::string MissingNoisePeers();

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_NOISE_PEERS_H_
