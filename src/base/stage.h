// How an operation is computed: an op compiled for this CPU. Stages are immutable; every thread uses the same
// one.
#ifndef TESSERA_BASE_STAGE_H_
#define TESSERA_BASE_STAGE_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "base/arena.h"
#include "base/block.h"
#include "tessera/image.h"
#include "tessera/roi.h"
#include "tessera/wrap.h"

namespace tessera::graph {

// Pixels a fused stage reads or writes directly instead of planes: `count` RGBA-interleaved pixels of one
// type. Null pixels: use the planes.
struct DirectPixels {
  PixelType type = PixelType::kFloat;
  const std::byte* read = nullptr;
  std::byte* write = nullptr;
  bool stream = false;  // write around the cache where aligned
};

// One block of one row for a point stage. Every plane holds kBlockPixels floats and `count` is no larger,
// except for a stage of AnyLength whose inputs and result are all direct; it is a multiple of kGroupPixels,
// of which the last ones may be padding (any value; never trapping, never stored).
struct PointArgs {
  int count = 0;
  int x = 0, y = 0;                       // image coordinates of the block's first pixel
  const int32_t* order = nullptr;         // position in a plane -> offset from x of the pixel it holds
  const float* const (*in)[4] = nullptr;  // in[k]: four planes of input k; a plane that no channel feeds is 0
                                          // (1 for a missing alpha)
  float* out[4] = {};  // four planes, null only where no plane is touched; may be any of the inputs' planes,
                       // in any order: read a group of every input before writing it
  DirectPixels source, sink;  // used only when CanFuse allowed it; or, with `others` (from input 1 on),
  DirectPixels others[2];     // CanFuseAll
  // Integer samples of one type from source to sink may stay codes, which are rounded once, from another
  // float: near a tie that may be the neighbouring code.
  bool codes = false;
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
  // True when a stage of two or three inputs may run from the interleaved four-channel pixels of all of them
  // (`source`, `others`) straight to the result's, every one of this type. All or nothing: else there are
  // planes only.
  virtual bool CanFuseAll(PixelType type) const {
    (void)type;
    return false;
  }
  // Whether a row of any length may be given at once where all inputs and the result are direct: the planes,
  // which have room for a block, are not touched then.
  virtual bool AnyLength() const { return false; }
  // Whether PointArgs::codes makes it faster.
  virtual bool UsesCodes() const { return false; }
  // A stage that does to every sample what this one does to those of each of its first `channels` channels,
  // from nothing but the same sample of its inputs: pixels of any number of channels may be given to it as if
  // they had four. Null where there is none.
  virtual std::unique_ptr<PointStage> OfSamples(int channels) const {
    (void)channels;
    return nullptr;
  }
  // This stage followed by `next`, which takes nothing but its result, as one stage that keeps the pixels in
  // registers, with the same bits; null when that would not be faster.
  virtual std::unique_ptr<PointStage> Then(const PointStage& next) const {
    (void)next;
    return nullptr;
  }
};

// Whether pixels are as tile and whole stages want them: of one type, channels side by side, pixels too.
inline bool IsDense(const ConstImageView& v, PixelType type) {
  const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
  return v.type == type && v.channel_stride == bytes && v.pixel_stride == bytes * v.channels &&
         v.row_stride % bytes == 0 && reinterpret_cast<uintptr_t>(v.data) % PixelBytes(type) == 0;
}
inline bool IsDenseFloat(const ConstImageView& v) { return IsDense(v, PixelType::kFloat); }

// One tile for a tile stage: interleaved and dense pixels, rows at any stride, all of them floats, or of one
// other type that the stage accepts. An input may be the source's own pixels and the output the caller's.
struct TileArgs {
  std::span<const ConstImageView> in;  // in[k].roi contains InputRoi(k, out.roi), borders filled; 64 bytes
                                       // beyond the end of a row may be read. An input that the op needs
                                       // whole is its whole data window instead, without that margin
  ImageView out;                       // nothing but its own pixels may be written
  bool stream = false;                 // write around the cache where aligned
  base::Arena& scratch;                // the worker's memory, released after the tile
  std::span<const int> channels = {};  // which channels of the result `out` holds, in its order
  std::span<const std::span<const int>> in_channels = {};  // the same for every input
};

// Width and height of a tile that suit a stage best; 0 leaves the choice to the planner.
struct TileSize {
  int width = 0, height = 0;
};

class TileStage {
 public:
  virtual ~TileStage() = default;
  // The region of input `k` that is needed to compute `out`; may leave the data window. Not asked for inputs
  // that the op needs whole.
  virtual Roi InputRoi(int k, const Roi& out) const = 0;
  // What lies beyond an input's data window: kBlack, kClamp, kRepeat, kMirror or kMirror101; the others
  // are taken as black.
  virtual Wrap InputBorder(int k) const {
    (void)k;
    return Wrap::kClamp;
  }
  virtual TileSize Preferred() const { return {}; }
  virtual void Run(const TileArgs& args) const = 0;
  // Whether the inputs and the result may all have this type; an input that the op needs whole stays float.
  // The result is what that of the floats would be rounded to.
  virtual bool Accepts(PixelType type) const { return type == PixelType::kFloat; }
  // Preferred() where it reads a source's own pixels and writes the result's: what lies in the cache is only
  // what it reads again.
  virtual TileSize PreferredAlone() const { return Preferred(); }
};

// What an evaluation may use. For calls task(i, worker) for every i in [0, count), on count() threads;
// results must not depend on the order. context() has the memory, and what is kept for later evaluations.
class Workers {
 public:
  virtual ~Workers() = default;
  virtual int count() const = 0;
  virtual Context& context() const = 0;
  virtual void For(int64_t count, const std::function<void(int64_t i, int worker)>& task) const = 0;
};

// An operation on whole images (recursive filters, transforms, streamlines that cross tiles).
class WholeStage {
 public:
  virtual ~WholeStage() = default;
  // in[k]: the whole data window of input k; out: the whole result. Float, interleaved and dense, any row
  // stride.
  virtual void Run(std::span<const ConstImageView> in, const ImageView& out,
                   const Workers& workers) const = 0;
};

}  // namespace tessera::graph

#endif  // TESSERA_BASE_STAGE_H_
