// Random graphs of the registry over pixels of any bits, drawn by the bytes of an input.
#ifndef TESSERA_TESTS_FUZZ_GRAPHS_H_
#define TESSERA_TESTS_FUZZ_GRAPHS_H_

#include <optional>
#include <string>
#include <vector>

#include "fuzz/fuzz.h"
#include "random/generate.h"

namespace tessera::fuzz {

// Inputs that seed some graphs.
inline std::vector<std::string> GraphSeeds() {
  std::vector<std::string> seeds;
  for (uint16_t i = 0; i < 64; ++i) {
    std::string seed(2, '\0');
    std::memcpy(seed.data(), &i, sizeof i);
    for (int k = 0; k < 64; ++k) seed += static_cast<char>((i + k) * 37);
    seeds.push_back(seed);
  }
  return seeds;
}
// Floats and halves that are hard.
inline std::vector<std::string> HardValues() {
  return {std::string("\0\0\xc0\x7f", 4),     std::string("\0\0\x80\x7f", 4),
          std::string("\0\0\x80\xff", 4),     std::string("\1\0\0\0", 4),
          std::string("\xff\xff\x7f\x7f", 4), std::string("\0\x7c", 2),
          std::string("\0\x7e", 2),           std::string("\1\0", 2),
          std::string("\0\0\0\x80", 4),       std::string("\0\0\x80\x3f", 4)};
}

struct Graph {
  random::Case drawn;
  random::Built built;
};

// The first two bytes draw the graph, the next one how it is evaluated, the others are its pixels, again and
// again. Nothing for graphs that take long.
inline std::optional<Graph> GraphOf(Input& in) {
  static random::Tally tally;
  static random::Generator generator(random::RegistryRows(), Folder(), tally);
  Graph graph;
  graph.drawn = generator.Make(7, in.Take<uint16_t>());
  if (graph.drawn.large) return std::nullopt;
  graph.built = random::Build(graph.drawn);
  const std::string_view bytes = in.Rest();
  size_t next = 0;
  for (const random::Pixels& pixels : graph.built.pixels) {
    if (bytes.empty()) break;
    const ImageView view = pixels.view();
    for (int y = view.roi.y0; y < view.roi.y1; ++y) {
      for (int x = view.roi.x0; x < view.roi.x1; ++x) {
        for (int c = 0; c < view.channels; ++c) {
          for (size_t i = 0; i < PixelBytes(view.type); ++i)
            view.At(x, y, c)[i] = static_cast<std::byte>(bytes[next++ % bytes.size()]);
        }
      }
    }
  }
  return graph;
}

}  // namespace tessera::fuzz

#endif  // TESSERA_TESTS_FUZZ_GRAPHS_H_
