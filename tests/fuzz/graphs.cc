// Random graphs on random bytes: the bits of a result do not depend on tiles, rules or the optimiser.
#include "fuzz/graphs.h"

#include "random/samples.h"
#include "tessera/render.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() { return GraphSeeds(); }
std::vector<std::string> Words() { return HardValues(); }
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Input in(data, size);
  fuzz::Try([&] {
    const auto graph = fuzz::GraphOf(in);
    if (!graph) return;
    const random::Case& c = graph->drawn;
    const Image fast = Render(graph->built.result(), PixelType::kFloat, {.threads = 1}),
                plain = Render(graph->built.result(), PixelType::kFloat,
                               {.threads = 1,
                                .tile_width = c.tile_width,
                                .tile_height = c.tile_height,
                                .rules_off = {"all"}});
    const auto differ = random::Differ(fast.view(), plain.view());
    if (differ) fuzz::Fail("rules and tiles change bits: " + *differ);
    for (const random::Pixels& pixels : graph->built.pixels)
      fuzz::Require(pixels.GapsAreWhole(), "bytes between the pixels were written");
  });
  return 0;
}
