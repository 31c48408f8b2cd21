// What stands for a reference where another library computes: the library's own evaluation, step by step. It
// is float, so its error is part of the bound.
#include <algorithm>
#include <any>
#include <cmath>
#include <limits>
#include <vector>

#include "model/foreign_pixels.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

// What the library's float arithmetic is trusted with: a part of the largest of a pixel's channels, 2^-8 at
// least, and so many times what its result moves by when its input moves by one float. Its own order of
// operations, its vector units and its approximate powers differ by that from one processor to the next.
constexpr double kForeignError = 0x1p-20, kSensitivity = 4;

void EvaluateForeign(const Call& call) {
  const auto& foreign = std::any_cast<const model::ForeignPixels&>(call.parameters);
  const ImageD& in = call.in[0];
  const int alpha = foreign.alpha ? call.in_specs[0].alpha : -1;
  // Rows at a time; `moved`: every sample of one channel a float further, to see how its rounding shows.
  const Roi& r = call.out.roi;
  const int width = r.width();
  const size_t count = static_cast<size_t>(width) * 4;
  const auto channel_of = [&](int p) { return p < 3 ? p : alpha; };
  std::vector<float> start(count), result(count), moved(count);
  std::vector<double> spread(count);
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int p = 0; p < 4; ++p) {
        const int c = channel_of(p);
        start[4 * x + p] = c < 0 ? 1.0f : static_cast<float>(in.at(r.x0 + x, y, c));
      }
    }
    result = start;
    foreign.check(result.data(), width);
    std::fill(spread.begin(), spread.end(), 0.0);
    for (int p = 0; call.scale != nullptr && p < 4; ++p) {
      if (channel_of(p) < 0) continue;
      std::vector<double> largest(count);
      for (const float towards :
           {-std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity()}) {
        moved = start;
        for (int x = 0; x < width; ++x) moved[4 * x + p] = std::nextafter(moved[4 * x + p], towards);
        foreign.check(moved.data(), width);
        for (size_t i = 0; i < count; ++i) {
          const double change = std::fabs(double{moved[i]} - result[i]);
          if (std::isfinite(change)) largest[i] = std::max(largest[i], change);
        }
      }
      for (size_t i = 0; i < count; ++i) spread[i] += largest[i];
    }
    for (int x = 0; x < width; ++x) {
      double size = 0x1p-8;
      for (int p = 0; p < 4; ++p) {
        for (const float v : {start[4 * x + p], result[4 * x + p]}) {
          if (std::isfinite(v)) size = std::max(size, std::fabs(double{v}));
        }
      }
      for (int c = 0; c < call.out.channels; ++c) {
        const int p = c < 3 ? c : c == alpha ? 3 : -1;
        call.out.at(r.x0 + x, y, c) = p < 0 ? in.at(r.x0 + x, y, c) : result[4 * x + p];
        if (call.scale == nullptr) continue;
        // An operation without a row has a bound of 2 units of 2^-24.
        call.scale->at(r.x0 + x, y, c) =
            p < 0 ? 0 : (kForeignError * size + kSensitivity * spread[4 * x + p]) * 0x1p23;
      }
    }
  }
}

}  // namespace

std::vector<Entry> ForeignEntries() {
  Entry entry{"ociocpu", EvaluateForeign};
  entry.remark =
      "what OpenColorIO computes is compared with its own unoptimised float evaluation, within 2^-20 of the "
      "largest channel and four times what that moves by when its input moves by one float";
  return {entry};
}

}  // namespace tessera::reference
