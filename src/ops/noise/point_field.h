// One noise at batches of positions: from positions to octaves' cells, and their sum.
#ifndef TESSERA_OPS_NOISE_POINT_FIELD_H_
#define TESSERA_OPS_NOISE_POINT_FIELD_H_

#include <array>
#include <cstdint>
#include <utility>

#include "base/arena_vector.h"
#include "ops/noise/kernels.h"
#include "ops/noise/plan.h"

namespace tessera::ops {

using NoisePeriods = std::array<int, 4>;  // cells along the axes; 0: none

class PointField {
 public:
  PointField(const NoiseParams& params, int channel);
  const NoisePlan& plan() const { return plan_; }

  // Position of the first octave, shared by fields of the same frequency, offset and period.
  PositionScale ScaleOf(int axis, int period) const;

  // Whether Points() serves positions of so many channels.
  bool HasPoints(int channels) const;
  // The kernel's parameters, but for a row's; octaves lie in the arena.
  PointRow Points(int channels, base::Arena& arena) const;

  struct Scratch {
    uint32_t* cell[4];
    float* fraction[4];
    float* value;
    float* slope[4];
    explicit Scratch(base::Arena& arena);
  };

  // What Run() is given: `base_cell`, `base_fraction`, positions in cells, reduced by `periods`; `warp`,
  // displacements per axis or null.
  struct Batch {
    int count = 0;
    float* const* base_cell = nullptr;
    float* const* base_fraction = nullptr;
    const uint32_t* invalid = nullptr;
    float* const* warp = nullptr;
    NoisePeriods periods = {};  // the parameters', or others where these are none (not of kGabor)
  };
  // `out` and `slopes` are set.
  void Run(const Batch& batch, const Scratch& scratch, float* out, float* const* slopes) const;

 private:
  std::pair<uint32_t, float> ShiftOf(const NoiseOctave& octave, int axis, int period) const;
  uint32_t PeriodOf(const NoiseOctave& octave, int axis, int period) const;
  void Evaluate(const NoiseBatch& b) const;

  NoisePlan plan_;
  NoiseKernels kernels_;
  NoiseEvaluate evaluate_ = nullptr;
  bool slopes_ = false;
};

}  // namespace tessera::ops

#endif  // TESSERA_OPS_NOISE_POINT_FIELD_H_
