// How an operation is computed: an op compiled for this CPU. Stages are immutable; every thread uses the same one.
#ifndef TESSERA_GRAPH_STAGE_H_
#define TESSERA_GRAPH_STAGE_H_

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/block.h"
#include "base/tile.h"
#include "tessera/image.h"
#include "tessera/roi.h"

namespace tessera::graph {

// Pixels a fused stage reads or writes directly instead of planes: `count` RGBA-interleaved pixels of one type.
// Null pixels: use the planes.
struct DirectPixels {
  PixelType type = PixelType::kFloat;
  const std::byte* read = nullptr;
  std::byte* write = nullptr;
  bool stream = false;  // write around the cache where aligned
};

// One block of one row for a point stage. Every plane holds kBlockPixels floats and `count` is no larger, except
// where both source and sink are direct and no plane is touched; it is a multiple of kGroupPixels, of which the last ones may be padding (any value; never trapping, never stored).
struct PointArgs {
  int count = 0;
  int x = 0, y = 0;                 // image coordinates of the block's first pixel
  const int32_t* order = nullptr;   // position in a plane -> offset from x of the pixel it holds
  const float* const (*in)[4] = nullptr;  // in[k]: four planes of input k; a plane that no channel feeds is 0
                                          // (1 for a missing alpha)
  float* out[4] = {};               // four planes, never null; may be any of the inputs' planes, in any order: read a
                                    // group of every input before writing it
  DirectPixels source, sink;        // used only when CanFuse allowed it
};

class PointStage {
 public:
  virtual ~PointStage() = default;
  virtual void Run(const PointArgs&) const = 0;
  // True when input 0 may come straight from (`load`) or the result go straight to (`!load`) interleaved
  // four-channel pixels of this type, saving a trip through L1.
  virtual bool CanFuse(bool load, PixelType type) const {
    (void)load, (void)type;
    return false;
  }
};

// What lies beyond an input's data window.
enum class Border : uint8_t { kBlack, kClamp, kRepeat, kMirror };

class TileStage {
 public:
  virtual ~TileStage() = default;
  // The region of input `k` that is needed to compute `out`; may leave the data window.
  virtual Roi InputRoi(int k, const Roi& out) const = 0;
  virtual Border InputBorder(int k) const {
    (void)k;
    return Border::kClamp;
  }
  // Computes out.roi(); in[k] covers InputRoi(k, out.roi()), borders filled.
  virtual void Run(std::span<const base::Tile* const> in, base::Tile& out, base::Arena& scratch) const = 0;
};

}  // namespace tessera::graph

#endif  // TESSERA_GRAPH_STAGE_H_
