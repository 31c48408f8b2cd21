// Every row of the registry with its first example, through C++: a line each with the hash of the result's
// bits, for the tests of other languages to find again.
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "tessera/error.h"
#include "tessera/render.h"

namespace {

using tessera::Image;
using tessera::ImageSpec;
using tessera::Node;

constexpr int kWidth = 24, kHeight = 16, kChannels = 4;

// Exact in every language.
Image Picture(int k) {
  const Image image(ImageSpec(kWidth, kHeight, kChannels));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < kChannels; ++c)
        image.at<float>(x, y, c) = static_cast<float>((7 * x + 13 * y + 5 * c + 11 * k + x * y) % 32) / 32;
    }
  }
  return image;
}

// FNV-1a.
uint64_t HashOf(const Image& image) {
  uint64_t hash = 14695981039346656037u;
  const size_t bytes =
      static_cast<size_t>(image.spec().data_window.pixels()) * image.spec().channels.size() * 4;
  for (size_t i = 0; i < bytes; ++i)
    hash = (hash ^ std::to_integer<uint64_t>(image.view().data[i])) * 1099511628211u;
  return hash;
}

}  // namespace

int main() {
  try {
    for (const tessera::ops::OpInfo& op : tessera::ops::Registry()) {
      if (op.examples.empty()) continue;
      const tessera::ops::Arguments arguments = ParseExample(op, op.examples[0]);
      const ImageSpec spec(kWidth, kHeight, kChannels);
      std::vector<Node> inputs;
      for (int k = 0; !op.generator && k < op.Operands(arguments); ++k)
        inputs.push_back(FromImage(Picture(k)));
      const Image image = Render(op.make(inputs, arguments, op.generator ? &spec : nullptr));
      const tessera::Roi w = image.spec().data_window;
      std::printf("%s %d %d %d %d %d %016llx\n", op.name.c_str(), w.x0, w.y0, w.x1, w.y1,
                  image.spec().channel_count(), static_cast<unsigned long long>(HashOf(image)));
    }
  } catch (const tessera::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
