// Walks from pixels near a surface's edge to the farther surface, in eight directions.
#include "ops/accumulate/hidden.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/arena_vector.h"

namespace tessera::ops {
namespace {

constexpr std::array<std::array<int, 2>, 8> kDirections = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};

// Whether anything lies behind a step of this pixel's neighbours: only there a walk can end.
bool StepsBack(const DefocusPlanes& all, int x, int y) {
  const float here = all.shift[all.Index(x, y)];
  for (const auto& [dx, dy] : kDirections) {
    if (!all.roi.Contains({x + dx, y + dy, x + dx + 1, y + dy + 1})) continue;
    const ptrdiff_t i = all.Index(x + dx, y + dy);
    if (all.level[i] >= 0 && here > all.shift[i] + kSurfaceStep) return true;
  }
  return false;
}

// 1 for pixels of all.roi that lie within `reach` of one that steps back, rows and columns apart.
uint8_t* NearSteps(const DefocusPlanes& all, int reach, base::Arena& scratch) {
  const int w = all.roi.width(), h = all.roi.height();
  const size_t area = static_cast<size_t>(w) * static_cast<size_t>(h);
  uint8_t *const rows = scratch.Allocate<uint8_t>(area), *const near = scratch.Allocate<uint8_t>(area);
  std::fill_n(rows, area, uint8_t{0});
  std::fill_n(near, area, uint8_t{0});
  for (int y = 0; y < h; ++y) {
    int done = 0;  // columns up to here are marked
    for (int x = 0; x < w; ++x) {
      if (all.level[static_cast<ptrdiff_t>(y) * w + x] < 0 || !StepsBack(all, all.roi.x0 + x, all.roi.y0 + y))
        continue;
      const int end = std::min(w, x + reach + 1);
      for (int i = std::max(done, x - reach); i < end; ++i) rows[static_cast<ptrdiff_t>(y) * w + i] = 1;
      done = end;
    }
  }
  base::ArenaVector<int> last(static_cast<size_t>(w), -1, scratch);  // rows of a column up to here are marked
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      if (rows[static_cast<ptrdiff_t>(y) * w + x] == 0) continue;
      const int end = std::min(h, y + reach + 1);
      for (int j = std::max(last[static_cast<size_t>(x)], y - reach); j < end; ++j)
        if (j >= 0) near[static_cast<ptrdiff_t>(j) * w + x] = 1;
      last[static_cast<size_t>(x)] = end;
    }
  }
  return near;
}

// The first pixel of the farther surface, of which no more than four times the median of the first five is
// taken, so that a light beside an edge is not drawn out beneath it.
constexpr int kMostBeyond = 5;
float WithoutLight(float* values, int count) {
  const float first = values[0];
  float* const end = std::remove_if(values, values + count, [](float v) { return !std::isfinite(v); });
  if (end == values) return first;
  std::sort(values, end);
  const float median = values[(end - values - 1) / 2];
  if (!std::isfinite(first)) return median;
  return first > 0 ? std::min(first, 4 * std::max(median, 0.0f)) : first;
}

}  // namespace

DefocusPlanes DefocusPlanes::Make(const Roi& roi, base::Arena& scratch) {
  const auto area = static_cast<size_t>(roi.pixels());
  return {roi, scratch.Allocate<float>(area), scratch.Allocate<int16_t>(area),
          scratch.Allocate<int16_t>(area)};
}

void FindHidden(const DefocusPlanes& all, const ConstImageView& color, int reach, int samples,
                const DefocusPlanes& hidden, float* values, base::Arena& scratch) {
  const uint8_t* const near = NearSteps(all, reach, scratch);
  const auto channels = static_cast<size_t>(samples - 1);
  base::ArenaVector<double> sums(channels, 0.0, scratch);
  const Roi& r = hidden.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      const ptrdiff_t out = hidden.Index(x, y), here = all.Index(x, y);
      hidden.level[out] = -1;
      if (near[here] == 0 || all.level[here] < 0) continue;
      const float own = all.shift[here];
      double total = 0, nearest = HUGE_VAL;
      std::fill(sums.begin(), sums.end(), 0.0);
      for (const auto& [dx, dy] : kDirections) {
        const int square = dx * dx + dy * dy;
        float before = own;
        for (int k = 1; k * k * square <= reach * reach; ++k) {
          const int u = x + k * dx, v = y + k * dy;
          if (!all.roi.Contains({u, v, u + 1, v + 1})) break;
          const ptrdiff_t i = all.Index(u, v);
          if (all.level[i] < 0) break;
          const float there = all.shift[i];
          if (there > before + kSurfaceStep && there > own + kSurfaceStep) {
            const double distance = static_cast<double>(k) * k * square, weight = 1 / distance;
            if (distance < nearest) {
              nearest = distance;
              hidden.level[out] = all.level[i], hidden.layer[out] = all.layer[i];
            }
            const float* beyond[kMostBeyond];
            int count = 0;
            for (float last = there; count < kMostBeyond; ++count) {
              const int m = k + count, s = x + m * dx, t = y + m * dy;
              if (m * m * square > reach * reach || !all.roi.Contains({s, t, s + 1, t + 1})) break;
              const ptrdiff_t j = all.Index(s, t);
              if (all.level[j] < 0 || !(std::fabs(all.shift[j] - last) <= kSurfaceStep)) break;
              last = all.shift[j];
              beyond[count] = reinterpret_cast<const float*>(color.At(s, t));
            }
            for (size_t c = 0; c < channels; ++c) {
              float samples_beyond[kMostBeyond];
              for (int m = 0; m < count; ++m) samples_beyond[m] = beyond[m][c];
              sums[c] += weight * WithoutLight(samples_beyond, count);
            }
            total += weight;
            break;
          }
          before = there;
        }
      }
      if (total == 0) continue;
      for (size_t c = 0; c < channels; ++c)
        values[out * samples + static_cast<ptrdiff_t>(c)] = static_cast<float>(sums[c] / total);
    }
  }
}

}  // namespace tessera::ops
