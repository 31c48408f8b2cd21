// Noise evaluated on rows of a grid and at lists of positions, for the noise operations and for textures.
#ifndef TESSERA_OPS_NOISE_FIELD_H_
#define TESSERA_OPS_NOISE_FIELD_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/arena_vector.h"
#include "ops/noise/kernels.h"
#include "ops/noise/plan.h"
#include "tessera/image.h"

namespace tessera::ops {

// A noise prepared for the columns of a grid. Immutable; rows are made by cursors.
class GridField {
 public:
  // `data`: the pixels of image coordinates that rows will cover; `moved`: rows may be asked for at places
  // beside them.
  GridField(const NoiseParams& params, const Roi& data, int channel, bool moved = false);
  const NoisePlan& plan() const { return plan_; }
  bool slopes() const { return slopes_; }

 private:
  friend class GridCursor;
  struct Stencil {   // of one octave, for accumulation: blocks of lattice columns
    int pixels = 0;  // per cell
    int start = 0;   // pixel offset of the first column's block
    std::vector<float> window, ramp;
  };
  struct Columns {                      // of one octave
    std::vector<uint32_t> hash, cell;   // lattice columns in use; cells of pixels
    std::vector<int32_t> left;          // per pixel, where the row collapses
    std::vector<float> fraction, fade;  // per pixel
    std::vector<double> position;       // per pixel, for lattice perlin: in [0, 256)
    Stencil stencil;
  };
  struct RowPlace {         // a row between two lattice rows
    uint32_t hash[2] = {};  // of the lower and the upper one, and the octave's seed
    float fraction = 0, fade = 0;
  };
  struct Rows {  // of one octave
    std::vector<LatticePlace> place;
    std::vector<RowPlace> between;
  };
  RowPlace Between(const NoiseOctave& octave, const LatticePlace& place, float fade) const;
  void Prepare(const NoiseOctave& octave, Columns& columns) const;
  void PrepareRows(const Roi& data);
  void PrepareStencil(Columns& columns) const;

  NoisePlan plan_;
  NoiseKernels kernels_;
  GridKernels grid_;
  NoiseEvaluate evaluate_ = nullptr;
  bool collapses_ = false;  // the row-collapse form serves
  bool slopes_ = false;
  int x0_ = 0, x1_ = 0;
  std::vector<Columns> columns_;
  std::vector<Rows> rows_;  // rows first_row_ ... of a slice
  int first_row_ = 0;
  std::vector<std::unique_ptr<GridField>> warp_;  // one noise per dimension
};

// Makes rows of one tile, top to bottom: what neighbouring rows share is kept.
class GridCursor {
 public:
  GridCursor(const GridField& field, int x0, int x1, base::Arena& arena);
  // Values of row y at x0 .. x1 - 1; `slopes`: dims arrays, null unless the field has them. Writes around the
  // cache when asked and one octave is all there is. `moved`: how far to the right and down of its pixel each
  // is read, in widths of the frame, two rows with kNoisePadding more; of fields that may be moved.
  void Row(int y, float* out, float* const* slopes = nullptr, bool stream = false,
           const float* const* moved = nullptr);
  // Values of rows y0 .. y1 - 1, which lie `stride` floats apart.
  void Run(int y0, int y1, float* out, ptrdiff_t stride, bool stream);

 private:
  struct Rows {  // of one octave
    GridFill fill;
    GridRow row;
    uint32_t lower_hash = 0, upper_hash = 0;  // of the lattice rows that row.lower and row.upper hold
    bool valid = false;
  };
  void Collapse(base::Arena& arena);
  void EnterSlice(int y);
  void PlaceSlice(size_t octave, int slice);
  float FadeOf(float fraction) const;
  LatticePlace RowPlaceOf(size_t octave) const;
  void FillLattice(Rows& rows, const uint32_t* hash);
  void Place(Rows& rows, const GridField::RowPlace& y, float* out, bool stream);
  void CollapsedRow(size_t k, float* out, bool stream);
  void AccumulatedRow(const GridRow& row, const GridField::Columns& columns, float* out);
  void AddBatch(const NoiseOctave& octave, int at, int count, float* out, float* const* slopes);
  void BatchRow(int y, float* out, float* const* slopes, const float* const* moved);
  void Displace(const NoiseOctave& octave, int from, const float* const* moved, NoiseBatch& batch);
  void PerlinRow(float* out, float* const* slopes);
  void Finish(float* out) const;

  const GridField& field_;
  int x0_, x1_;
  bool bent_ = false;                                    // by bias and gain
  int slice_begin_ = 0, slice_end_ = 0, slice_top_ = 0;  // rows y of the slice; its first
  base::ArenaVector<Rows> rows_;
  int row_ = 0;                               // of the slice, from its first
  base::ArenaVector<LatticePlace> place_[3];  // y, z, w of every octave for the current row
  float* stamped_ = nullptr;                  // of accumulation: a row with margins
  int margin_ = 0;
  float* value_ = nullptr;  // of batches
  float* slope_[4] = {};
  uint32_t* cell_[4] = {};
  float* fraction_[4] = {};
  base::ArenaVector<GridCursor> warp_;
  base::ArenaVector<float*> warp_row_;
};

// The columns that pixels from .. from + width - 1 of a row use: `left` (padded by kNoisePadding), fractions
// and fades are per pixel.
GridColumns TileColumns(const GridKernels& grid, const std::vector<int32_t>& left,
                        const std::vector<float>& fraction, const std::vector<float>& fade, size_t from,
                        size_t width, base::Arena& arena);
// Throws Error where accumulation is asked for and cannot be had; the frame is known.
void CheckAccumulation(const std::string& op, const NoiseParams& params);
// d shape(n) / dn of a sum's shape.
float ShapeSlope(NoiseSum sum, float n);
// The noise that displaces positions along an axis.
NoiseParams WarpParams(const NoiseParams& params, int axis);
// The result after the parameters' bias and gain.
float BentValue(const NoiseParams& params, float value);
// Perlin's bias and gain of t in [0,1] (clamped): gain(contrast, bias(b, t)).
float BiasAndGain(double bias, double contrast, float t);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_NOISE_FIELD_H_
