// Random graphs of the registry's rows over random images; each case is a pure function of a seed and an
// index.
#ifndef TESSERA_TESTS_RANDOM_GENERATE_H_
#define TESSERA_TESTS_RANDOM_GENERATE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "random/draw.h"
#include "random/images.h"
#include "random/tally.h"
#include "random/values.h"
#include "tessera/node.h"

namespace tessera::random {

// One operation of a graph. Values are numbered: the pictures first, then the steps in their order.
struct Step {
  const ops::OpInfo* op = nullptr;
  Words words;
  std::vector<int> inputs;
  Roi window;        // of a generator
  int channels = 4;  // of a generator
};

// What is compared; a bit each in Case::checks.
enum class Check {
  kRules,      // all rewrite rules on against all off
  kEachRule,   // all on against one off
  kTypes,      // the packed result against the float result, rounded
  kTiles,      // tile shapes
  kThreads,    // two or three threads
  kShuffle,    // tiles in another order
  kPixels,     // the caller's pixels, strided or in part, against an image
  kStream,     // sources in rows against sources in memory
  kFile,       // written to a file and read back
  kInPlace,    // into the pixels of the source
  kEager,      // operation by operation, optimiser off, against the graph at once
  kTargets,    // instruction sets with fused multiply-add against each other
  kReference,  // every operation by itself within its bound of the double reference
  kPlain,      // the same on an instruction set without fused multiply-add
  kVerify,     // Verify passes what is right and condemns what is not
  kJson,       // written as JSON and read back: the same plan
  kPaged,      // what is held whole in memory against paged
  kCount
};
const char* CheckName(Check check);
constexpr uint32_t Bit(Check check) { return 1u << static_cast<int>(check); }

struct Case {
  uint64_t seed = 0, index = 0;
  std::vector<Picture> pictures;
  std::vector<Step> steps;  // the last one is the result
  PixelType type = PixelType::kFloat;
  uint32_t checks = 0;
  // How the comparisons are made.
  int tile_width = 8, tile_height = 8, threads = 2;
  Layout layout;                  // of the caller's pixels
  bool partial = false;           // only a part of the window is asked for
  bool large = false;             // a result that does not fit into a cache, and is stored around it
  std::string format;             // of the file: its extension
  int first_rule = 0, rules = 0;  // which rules are switched off one at a time
  int values() const { return static_cast<int>(pictures.size() + steps.size()); }
};

// A case's nodes; the pixels live as long.
struct Built {
  std::vector<Pixels> pixels;
  std::vector<Node> values;
  const Node& result() const { return values.back(); }
};
enum class Backing {
  kView,      // pixels as the picture says
  kStreamed,  // the same in rows
  kFloats,    // dense floats where the picture has integers, whatever the operations make of codes
};
// Throws Error where a step refuses its arguments or inputs.
Built Build(const Case& c, Backing backing = Backing::kView);
Node MakeStep(const Step& step, const std::vector<Node>& values);

class Generator {
 public:
  // `rows`: what is drawn from; `folder` for files that arguments name.
  Generator(std::vector<const ops::OpInfo*> rows, const std::string& folder, Tally& tally);
  // `only`, where not null, is one of the operations.
  Case Make(uint64_t seed, uint64_t index, const ops::OpInfo* only = nullptr);
  const std::vector<const ops::OpInfo*>& rows() const { return rows_; }

 private:
  struct State;
  // `plain`: without arguments or modifiers; a clamp is to [0, 1].
  bool AddStep(Draw& draw, const ops::OpInfo& op, State& state, bool plain = false);
  const ops::OpInfo& DrawRow(Draw& draw, const std::vector<const ops::OpInfo*>& rows) const;
  void DrawChecks(Draw& draw, Case& c, const Node& result) const;
  Case MakeLarge(uint64_t seed, uint64_t index, Draw& draw, const ops::OpInfo* only);
  Case MakePacked(uint64_t seed, uint64_t index, Draw& draw);
  Case Finished(Draw& draw, State& state) const;

  std::vector<const ops::OpInfo*> rows_, tiles_, points_, pairs_, sample_pairs_, grades_, quick_, wholes_,
      moves_;
  const ops::OpInfo* clamp_ = nullptr;
  WordSource words_;
  Tally& tally_;
};

// All rows of the registry.
std::vector<const ops::OpInfo*> RegistryRows();
// Drops what the result does not depend on, and numbers the rest anew.
void Prune(Case& c);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_GENERATE_H_
