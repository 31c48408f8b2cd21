// The photograph that times and errors are taken on.
#ifndef TESSERA_BENCH_PHOTOGRAPH_H_
#define TESSERA_BENCH_PHOTOGRAPH_H_

#include <string>

namespace tessera::bench {

// The file: $TESSERA_PHOTOGRAPH, or a garden of 18 million pixels in Debian's mate-backgrounds; empty when
// neither is there.
std::string PhotographFile();

// Its sample (0 red, 1 green, 2 blue) in [0, 1], mirrored beyond its edges. Its codes are of 8 bits: `noise`,
// in [0, 1], says where within a code the sample lies. Without a photograph broad shading, patches and fine
// grain.
float Photograph(int x, int y, int channel, float noise);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_PHOTOGRAPH_H_
