// Exact Euclidean distance transforms of grids (Felzenszwalb and Huttenlocher, lower envelopes of parabolas).
#ifndef TESSERA_MODEL_DISTANCE_TRANSFORM_H_
#define TESSERA_MODEL_DISTANCE_TRANSFORM_H_

#include <array>
#include <cstdint>
#include <vector>

namespace tessera::model {

// For every point of a grid (x fastest) the squared distance to the nearest point whose `set` is not 0, in
// units of `spacing`; infinity where the set is empty. `nearest`, where given, receives that point's index
// (-1: none).
std::vector<float> SquaredDistances(const std::array<int, 3>& size, const std::vector<uint8_t>& set,
                                    const std::array<double, 3>& spacing = {1, 1, 1},
                                    std::vector<int32_t>* nearest = nullptr);

}  // namespace tessera::model

#endif  // TESSERA_MODEL_DISTANCE_TRANSFORM_H_
