// Lookups in tests: small images from lists of samples, random tables, the error against the reference.
#ifndef TESSERA_TESTS_SUPPORT_LOOKUPS_H_
#define TESSERA_TESTS_SUPPORT_LOOKUPS_H_

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "reference/reference.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"

namespace tessera::testing {

using Samples = std::vector<float>;

inline Image Row(const Samples& values, int channels, PixelType type = PixelType::kFloat) {
  Image image(ImageSpec(static_cast<int>(values.size()) / channels, 1, channels, type));
  std::memcpy(image.view().data, values.data(), values.size() * sizeof(float));
  return image;
}
inline Node Pixels(const Samples& values, int channels) { return FromImage(Row(values, channels)); }
inline Samples Values(const Node& node) {
  const Image image = Render(node);
  Samples out(static_cast<size_t>(image.spec().data_window.pixels()) * image.spec().channels.size());
  std::memcpy(out.data(), image.view().data, out.size() * sizeof(float));
  return out;
}
inline Samples Random(size_t n, float low, float high, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> d(low, high);
  Samples s(n);
  for (float& v : s) v = d(random);
  return s;
}
inline Table RandomTable(std::vector<int> sizes, int channels, TableAlign align = TableAlign::kCentres,
                         unsigned seed = 1) {
  size_t n = static_cast<size_t>(channels);
  for (const int size : sizes) n *= static_cast<size_t>(size);
  const Samples s = Random(n, -1, 2, seed);
  return Table(std::move(sizes), channels, s, align);
}
// The largest error of a node of one input, in units of 2^-24 times the reference's scale.
inline double WorstError(const Node& node, const Node& input) {
  const Image in = Render(input), got = Render(node);
  const Roi window = node.spec().data_window;
  std::vector<reference::ImageD> inputs = {reference::ImageD(window, in.spec().channel_count())};
  const auto* const samples = reinterpret_cast<const float*>(in.view().data);
  std::copy_n(samples, inputs[0].samples.size(), inputs[0].samples.begin());
  reference::ImageD want(window, node.spec().channel_count()), scale = want;
  const std::vector<ImageSpec> specs = {input.spec()};
  const graph::Op& op = *node.data()->op;
  reference::Find(op.Name())->evaluate({op.Parameters(), inputs, specs, node.spec(), want, &scale});
  double worst = 0;
  const auto* const out = reinterpret_cast<const float*>(got.view().data);
  for (size_t i = 0; i < want.samples.size(); ++i) {
    const double error = std::fabs(out[i] - want.samples[i]);
    if (std::isnan(error) && std::isnan(out[i]) == std::isnan(want.samples[i])) continue;
    const double units = error == 0 ? 0 : error / scale.samples[i] * 0x1p24;
    if (!(units <= worst)) worst = std::isnan(units) ? std::numeric_limits<double>::infinity() : units;
  }
  return worst;
}

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_LOOKUPS_H_
