// Noise rendered to plain lists of values, for the noise tests.
#ifndef TESSERA_TESTS_SUPPORT_NOISE_VALUES_H_
#define TESSERA_TESTS_SUPPORT_NOISE_VALUES_H_

#include <algorithm>
#include <vector>

#include "tessera/ops/noise.h"
#include "tessera/render.h"

namespace tessera::testing {

inline std::vector<float> Values(const Node& node, const RenderOptions& options = {}) {
  const Image image = Render(node, PixelType::kFloat, options);
  const auto* data = reinterpret_cast<const float*>(image.view().data);
  return {data, data + image.spec().data_window.pixels() * image.spec().channel_count()};
}
// Noise at listed positions, `dims` numbers each.
inline std::vector<float> At(const std::vector<float>& positions, NoiseParams params, int channels = 1) {
  const int count = static_cast<int>(positions.size()) / params.dims;
  const Image image(ImageSpec(count, 1, params.dims));
  std::copy(positions.begin(), positions.end(), reinterpret_cast<float*>(image.view().data));
  return Values(NoiseAt(FromImage(image), params, channels));
}
inline NoiseParams Gradient(int dims) {
  NoiseParams p;
  p.dims = dims;
  p.frequency = 1;
  return p;
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_NOISE_VALUES_H_
