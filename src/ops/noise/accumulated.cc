// High-resolution filtering by accumulation: rows of noise as sums of lattice points' blocks of pixels.
//
// n(x, y) = sum over lattice points q of W(x - x_q) W(y - y_q) (value_q + gradient_q . (p - q)) with the
// window W(t) = 1 - u(|t|), |t| < 1. Where a cell has a whole number of pixels, W and t W sampled once serve
// every lattice point. Blocks of points two cells apart do not overlap: four passes, by the parity of the
// point's coordinates. Source: McReynolds et al. 1997, 5.13.3; doc/maths/noise.md.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/number_text.h"
#include "ops/noise/field.h"
#include "tessera/error.h"

namespace tessera::ops {

void CheckAccumulation(const std::string& op, const NoiseParams& params) {
  if (params.method != NoiseMethod::kAccumulate) return;
  const bool lattice = (params.kind == NoiseKind::kGradient || params.kind == NoiseKind::kValue) &&
                       params.lattice == NoiseLattice::kTessera && params.dims >= 2;
  if (!lattice || HasSlopes(params) || params.warp != 0) {
    throw Error(
        op + ":method",
        "found accumulate, expected it with value or gradient noise of lattice tessera in 2 to 4 dimensions, "
        "without slopes and warp");
  }
  const NoisePlan plan = MakeNoisePlan(params, true, 0);
  for (const NoiseOctave& octave : plan.octaves) {
    if (PixelsPerCell(plan, octave) != 0) continue;
    throw Error(op + ":method", "found " + base::NumberText(1 / (plan.step[0] * octave.scale)) +
                                    " pixels per cell of " +
                                    "an octave, expected a whole number for accumulate");
  }
}

void GridField::PrepareStencil(Columns& columns) const {
  Stencil& stencil = columns.stencil;
  const int pixels = stencil.pixels;
  // The first pixel's place in its cell, and every pixel's phase.
  const double place = columns.fraction[0] * static_cast<double>(pixels);
  const int first = std::clamp(static_cast<int>(std::floor(place + 1e-4)), 0, pixels - 1);
  const double phase = place - first;
  stencil.start = -first - pixels;
  const size_t padded = static_cast<size_t>(2 * pixels + kNoisePadding);
  stencil.window.assign(padded, 0);
  stencil.ramp.assign(padded, 0);
  std::vector<float> fraction(static_cast<size_t>(pixels) + kNoisePadding, 0), fade(fraction.size());
  for (int m = 0; m < pixels; ++m)
    fraction[static_cast<size_t>(m)] = static_cast<float>((m + phase) / pixels);
  kernels_.fade(fraction.data(), pixels, plan_.shape.fade, fade.data());
  for (size_t m = 0; m < static_cast<size_t>(pixels); ++m) {
    const size_t right = m + static_cast<size_t>(pixels);
    stencil.window[m] = fade[m];  // left of the point the window is what is missing on the other side
    stencil.ramp[m] = (fraction[m] - 1) * fade[m];
    stencil.window[right] = 1 - fade[m];
    stencil.ramp[right] = fraction[m] * (1 - fade[m]);
  }
}

void GridCursor::AccumulatedRow(const GridRow& row, const GridField::Columns& columns, float* out) {
  const GridField::Stencil& stencil = columns.stencil;
  const int width = x1_ - x0_, offset = x0_ - field_.x0_;
  std::fill_n(stamped_, width + 2 * margin_ + kNoiseBatch, 0.0f);
  const uint32_t* const hash = columns.hash.data();  // odd multiples of cells: parity is kept
  const float weight[2] = {(1 - row.fade) * row.scale, row.fade * row.scale};
  const float fraction[2] = {row.fraction, row.fraction - 1};
  const GridLatticeRow* const lattice[2] = {&row.lower, &row.upper};
  for (int pass = 0; pass < 4; ++pass) {
    const int side = pass >> 1;
    const GridLatticeRow& q = *lattice[side];
    for (int c = 0; c < row.columns.count; ++c) {
      const int column = row.columns.first + c;
      if ((hash[column] & 1u) != static_cast<uint32_t>(pass & 1)) continue;
      GridStamp stamp;
      stamp.taps = 2 * stencil.pixels;
      stamp.rest = weight[side] * std::fma(q.gy[c], fraction[side], q.rest[c]);
      stamp.gx = weight[side] * q.gx[c];
      stamp.window = stencil.window.data();
      stamp.ramp = stencil.ramp.data();
      const int at = stencil.start + column * stencil.pixels - offset;  // of the tile's pixels
      if (at + stamp.taps <= 0 || at >= width) continue;
      stamp.out = stamped_ + margin_ + at;
      field_.grid_.stamp(stamp);
    }
  }
  for (int x = 0; x < width; x += kNoiseBatch) {
    const int count = std::min(kNoiseBatch, width - x);
    float sum[kNoiseBatch] = {};
    std::copy_n(out + x, count, sum);
    field_.kernels_.accumulate({count, stamped_ + margin_ + x, row.sum, row.weight, sum});
    std::copy_n(sum, count, out + x);
  }
}

}  // namespace tessera::ops
