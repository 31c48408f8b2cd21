// What is measured: a chain of registry operations with their arguments, and the pixels it reads and writes.
#ifndef TESSERA_BENCH_TASK_H_
#define TESSERA_BENCH_TASK_H_

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ops/registry.h"
#include "tessera/image.h"
#include "tessera/node.h"

namespace tessera::bench {

// One operation of a chain. `matrix`, when set, is the 4x5 affine map (rows R,G,B,A; last column the bias)
// that the operation is, found by probing the double-precision reference: peers need no knowledge of our
// operations.
struct Step {
  const ops::OpInfo* info = nullptr;
  ops::Arguments arguments;
  struct Affine {
    double m[4][5];
    bool has_bias() const { return m[0][4] != 0 || m[1][4] != 0 || m[2][4] != 0 || m[3][4] != 0; }
    bool diagonal() const;
  };
  std::optional<Affine> affine;

  const std::string& op() const { return info->name; }
  // The numbers of an argument or modifier; empty when the operation has none of that name.
  std::vector<double> Numbers(const std::string& name) const;
  // The numbers of positional argument `index`.
  std::vector<double> Positional(size_t index) const;
};

struct Task {
  std::string name;
  std::vector<Step> steps;
  // Input `index` where noise is no sensible one (coordinates); null for noise.
  Image (*make_input)(int width, int height, PixelType type, size_t index) = nullptr;

  int inputs() const {
    return steps.front().info->generator ? 0 : steps.front().info->Operands(steps.front().arguments);
  }
  // The lazy result on these inputs; `output` gives windows and channels to a generator. Throws Error.
  Node Build(const std::vector<Node>& inputs, const ImageSpec& output) const;
};

// A chain of (operation, example arguments as in OpInfo::examples); the first operation takes every input.
// Throws Error when an operation is unknown.
Task MakeTask(const std::string& name, const std::vector<std::pair<std::string, std::string>>& steps);

// The contestants' common pixels: inputs that nobody writes, one output that everybody writes.
struct Frame {
  int width = 0, height = 0;
  PixelType type = PixelType::kFloat;
  std::vector<Image> inputs;
  Image output;

  int64_t pixels() const { return int64_t{width} * height; }
  // True when the output is RGBA over the input's window, the only shape that peers are asked for.
  bool plain() const;
};

// What a picture shows: white noise; oblique stripes of black and white with lines a pixel wide; a checker of
// 60 pixels; a photograph (photograph.h).
enum class Content { kNoise, kEdges, kChecker, kPhoto };
inline constexpr Content kContents[] = {Content::kNoise, Content::kEdges, Content::kChecker, Content::kPhoto};

// A deterministic RGBA picture: colours in [0,1], alpha in [0.25,1] so that dividing by it is sane.
Image MakeInput(int width, int height, PixelType type, uint64_t seed, Content content = Content::kNoise);

// The exact value of a stored sample.
double Decode(const std::byte* sample, PixelType type);

}  // namespace tessera::bench

#endif  // TESSERA_BENCH_TASK_H_
