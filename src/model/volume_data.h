// What a Volume shares: samples with a border, in memory or in bricks on disk, bounds of blocks of cells, and
// how far a ray may leap from each.
#ifndef TESSERA_MODEL_VOLUME_DATA_H_
#define TESSERA_MODEL_VOLUME_DATA_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "base/paged_memory.h"
#include "tessera/export.h"
#include "tessera/volume.h"

TESSERA_API_BEGIN
namespace tessera::model {

inline constexpr int kVolumeBefore = 1, kVolumeBehind = 2;  // repeated voxels along every axis
inline constexpr int kVolumeBorder = kVolumeBefore + kVolumeBehind;
// A brick has 2^kBrickShift cells along every axis, and the voxels that interpolation in these cells and its
// gradient read: a border like the volume's, which neighbours hold too. So a kernel reads one brick a sample.
inline constexpr int kBrickShift = 5, kBrickEdge = 1 << kBrickShift, kBrickRow = kBrickEdge + kVolumeBorder;
inline constexpr int64_t kBrickSlice = int64_t{kBrickRow} * kBrickRow;
inline constexpr int64_t kBrickSamples = (kBrickSlice * kBrickRow + 63) / 64 * 64;

// Calls task(i) for every i in [0, count), in any order, perhaps at once.
using ForEach = std::function<void(int64_t count, const std::function<void(int64_t)>& task)>;

// How far from any point of a block of cells no block that matters is met.
struct LeapGrid {
  std::array<int, 3> size = {};  // blocks
  int shift = 2;                 // a block is 2^shift cells wide
  // Lower byte: 0 in blocks that matter, else 1 + whole voxels, rounded down. Upper byte times `pace`: voxels
  // per code in which the field changes by no more than a code, within an edge of the block. 64 bytes beyond
  // the end may be read.
  std::shared_ptr<uint16_t[]> leap;
  float pace = 0;
  float least_pace = 0;  // voxels per code in which the field changes by no more than a code anywhere
  bool any = false;      // a block matters
};

// How far, in voxels, the place where a field is read may lie from a point.
struct Displacement {
  std::array<double, 3> low = {0, 0, 0}, high = {0, 0, 0};
  bool operator==(const Displacement&) const = default;
};

struct VolumeData {
  VolumeSpec spec;
  std::shared_ptr<std::byte> memory;
  std::byte* samples = nullptr;  // of voxel (0, 0, 0), behind the border
  int64_t row = 0, slice = 0;    // strides in samples, of a brick where there are bricks
  // Null: samples are in memory, one row behind the other. Else they lie there in bricks, one row, then one
  // slice of bricks behind the other.
  std::unique_ptr<base::PagedMemory> pages;
  std::array<int64_t, 2> bricks = {0, 0};  // along x; along x times y
  int64_t nan_samples = 0;
  // value = code_scale * code + code_bias, code the stored integer or float.
  double code_scale = 1, code_bias = 0;

  VolumeData(const VolumeSpec& s);
  VolumeData(const VolumeData&) = delete;
  VolumeData& operator=(const VolumeData&) = delete;

  // Where the voxel's sample is, counted from `samples`; border included.
  int64_t IndexOf(int i, int j, int k) const;
  double Code(int i, int j, int k) const;                               // inside the border
  void SetCode(int i, int j, int k, double code);                       // rounded to the type
  void SetCodes(int i0, int count, int j, int k, const double* codes);  // from (i0, j, k) on, along x
  // The samples of a row; what is NaN is counted and set to 0.
  void SetRow(int j, int k, const std::byte* row);
  // Samples i0 to i1 - 1 of a row, border included, one behind the other.
  void CopyRow(int i0, int i1, int j, int k, std::byte* to) const;
  // Repeats the outermost voxels around the volume, where that is not done as they are set.
  void FillBorder();
  // Keeps what is resident within spec.memory; for whoever goes through a paged volume, every now and then.
  void Trim() const {
    if (pages != nullptr) pages->Trim();
  }

  // Blocks that matter hold a cell whose corners reach into [low, high] (codes), or a point from which a
  // displacement within `reach` leads into such a block. Computed once for a range and reach.
  std::shared_ptr<const LeapGrid> Leaps(double low, double high, const ForEach& for_each,
                                        const Displacement& reach = {}) const;
  // Smallest and largest code.
  std::array<float, 2> CodeRange(const ForEach& for_each) const;
  size_t extra_bytes() const;

 private:
  void Allocate();

  struct Blocks {
    std::array<int, 3> size = {};
    int shift = 2;
    std::vector<float> low, high;  // of the voxels of a block's cells
    std::vector<float> slope;      // bound of the gradient in them, codes per voxel
  };
  const Blocks& BlocksOf(const ForEach& for_each) const;

  mutable std::mutex mutex_;
  mutable std::unique_ptr<const Blocks> blocks_;
  struct Cached {
    double low = 0, high = 0;
    Displacement reach;
    std::shared_ptr<const LeapGrid> grid;
  };
  mutable std::vector<Cached> grids_;
};

}  // namespace tessera::model
TESSERA_API_END

#endif  // TESSERA_MODEL_VOLUME_DATA_H_
