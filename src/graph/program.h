// The bound plan: once the pixels' layouts are known, a list of steps over named buffers that a worker
// carries out for any region without a question. Rules (rules.h) rewrite the list; bits do not depend on
// them.
#ifndef TESSERA_GRAPH_PROGRAM_H_
#define TESSERA_GRAPH_PROGRAM_H_

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "graph/plan.h"
#include "simd/pixels.h"
#include "tessera/image.h"

namespace tessera::graph {

class RuleSet;

// What is known of a buffer's pixels before any of them is there.
struct Layout {
  PixelType type = PixelType::kFloat;
  int channels = 0;
  ptrdiff_t channel_stride = 0, pixel_stride = 0;  // bytes
  bool aligned = true;                             // every sample lies at a multiple of its size
  bool ascending = true;                           // a row begins behind the end of the one before

  bool operator==(const Layout&) const = default;
  static Layout Of(const ConstImageView& view);
  static Layout Packed(PixelType type, int channels);
  // Of that type, channels side by side, pixels too.
  bool IsDense(PixelType of) const;
  // Pixels of four samples side by side.
  bool IsRgba() const;
};

// Rows of samples, all treated alike, four of which are a pixel to the stage.
struct Samples {
  const PointStage* stage = nullptr;
  std::string label;
  std::vector<BufferId> in;
  bool codes = false;
};

// Bytes moved: every byte of a result's pixel is a copy of an input's, or a constant.
struct ByteMoves {
  std::vector<BufferId> in;
  simd::Moves moves;
  bool same = false;  // pixels of the one input as they are
};

// A tile stage: regions of its inputs, extended at the image's edge, to a region.
struct Window {
  const TileStep* planned = nullptr;
  struct Input {
    BufferId pixels = -1;  // -1: wanted whole, in `planned`
    BufferId tile = -1;    // whose region of them
  };
  std::vector<Input> in;
  PixelType type = PixelType::kFloat;  // of inputs and result
};

struct Step {
  BufferId made = 0;  // the plan's buffer that it makes
  BufferId to = 0;    // whose pixels it writes: that buffer's own, or the result's
  std::variant<Points, Samples, ByteMoves, Window> how;
  std::vector<std::string> rules;  // that were applied, by name
};

class Program {
 public:
  // `sources`, `result`: the layouts of all pixels that will ever be given to it. The plan must outlive it.
  Program(const Plan& plan, std::span<const Layout> sources, const Layout& result, const RuleSet& rules);

  const Plan& plan() const { return *plan_; }
  BufferId result() const { return plan_->result(); }
  bool IsSource(BufferId id) const { return plan_->IsSource(id); }
  const Layout& layout(BufferId id) const { return layouts_[static_cast<size_t>(id)]; }
  // A single tile stage from the sources' own pixels to the result's.
  bool IsOneWindow() const;
  // Places in a worker's memory: a tile dies after its last reader, and a later one may take its place. By
  // BufferId, -1 for what is not made in memory of its own.
  std::vector<int> TilePlaces() const;
  // Names of the rules that were applied, each once.
  std::vector<std::string> AppliedRules() const;

  std::vector<Step> steps;                                // rules change it
  std::vector<std::unique_ptr<const PointStage>> stages;  // made by rules

 private:
  const Plan* plan_;
  std::vector<Layout> layouts_;
};

// Where a step hands on all channels of one buffer, in order, that buffer; else -1.
BufferId OnlyCopies(const Program& program, const Step& step);
// The buffers whose pixels a step reads.
std::vector<BufferId> Readings(const Step& step);
// How often every plane is read, stores included.
std::vector<int> PlaneReaders(const Points& points);

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_PROGRAM_H_
