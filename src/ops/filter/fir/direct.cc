// Direct window sums on every target. Sums are grouped by the tap's column modulo 4, in the same order for
// every vector length: with four channels and 16 lanes the groups are what one aligned load serves, and only
// the four group sums have to be shifted.
#include <algorithm>
#include <memory>
#include <utility>

#include "ops/filter/fir/fir.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/fir/direct.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/fir/dense-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Output rows that share their loads, as far as the registers go.
constexpr int kRows = kLanes == 16 ? 4 : 2;

template <bool kCentered, int kR, int kJ>
HWY_INLINE void DirectStrip(const DirectWindow& window, const FloatTile& t, int x, int y_begin, int y_end) {
  const int count = std::min(kJ * kLanes, t.samples - x);
  for (int y = y_begin; y + kR <= y_end; y += kR) {
    V total[kR][kJ];
    DirectBlock<kCentered>(window, t.in + y * t.in_stride + x, t.in_stride, t.channels, total);
    if (!window.dense) UnsignedZeros(total);
    for (int r = 0; r < kR; ++r) {
      float* out = t.out + (y + r) * t.out_stride + x;
      for (int j = 0; j < kJ; ++j) StorePart(total[r][j], out + j * kLanes, count - j * kLanes, t.stream);
    }
  }
}

template <bool kCentered>
void DirectColumns(const DirectWindow& window, const FloatTile& t, int x_begin) {
  const int whole = t.rows / kRows * kRows;
  int x = x_begin;
  for (; x + kLanes < t.samples; x += 2 * kLanes) {
    DirectStrip<kCentered, kRows, 2>(window, t, x, 0, whole);
    DirectStrip<kCentered, 1, 2>(window, t, x, whole, t.rows);
  }
  for (; x < t.samples; x += kLanes) DirectStrip<kCentered, 1, 1>(window, t, x, 0, t.rows);
}

// How many floats lie in front of the first whole vector of results, which can be written around the cache.
// With 16 lanes DirectDense() sees to them.
int FloatsToVector(const FloatTile& t) {
  if (kLanes == 16 || !t.stream || t.out_stride % kLanes != 0) return 0;
  constexpr auto kBytes = sizeof(float) * kLanes;
  const auto floats = static_cast<int>(-reinterpret_cast<uintptr_t>(t.out) % kBytes / sizeof(float));
  return std::min(floats, t.samples);
}

void SumDirectly(const DirectWindow& window, const FloatTile& tile) {
  const auto columns = window.centered ? DirectColumns<true> : DirectColumns<false>;
  FloatTile t = tile;
  if (const int before = FloatsToVector(t); before > 0) {
    t.samples = before;
    columns(window, t, 0);
    t.in += before, t.out += before, t.samples = tile.samples - before;
  }
  const int done = DirectDense(window, t);
  if (done > 0) {
    FloatTile rest = t;
    const int rows = t.rows - t.rows % DenseRows(window.width);
    rest.in += rows * t.in_stride, rest.out += rows * t.out_stride;
    rest.rows -= rows, rest.samples = done;
    if (rest.rows > 0) columns(window, rest, 0);
  }
  if (done < t.samples) columns(window, t, done);
}

class DirectSums final : public WindowSums {
 public:
  explicit DirectSums(const DirectWindow& window) : window_(window) {}
  void Run(const FloatTile& tile, base::Arena&) const override { SumDirectly(window_, tile); }

 private:
  DirectWindow window_;
};
std::unique_ptr<const WindowSums> DirectSumsOfTarget(const DirectWindow& window) {
  return std::make_unique<const DirectSums>(window);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(DirectSumsOfTarget);

std::unique_ptr<const WindowSums> MakeDirectSums(const DirectWindow& window) {
  return HWY_DYNAMIC_DISPATCH(DirectSumsOfTarget)(window);
}

DirectWindow MakeDirectWindow(int width, int height, std::vector<float> weights) {
  DirectWindow window;
  window.width = width, window.height = height, window.weights = std::move(weights);
  window.dense = true;
  for (int dx = 0; dx < width; ++dx) {
    const auto zero = [&](int dy) { return window.weights[static_cast<size_t>(dy * width + dx)] == 0; };
    for (int dy = 0; dy < height;) {
      const int begin = dy;
      while (dy < height && !zero(dy)) ++dy;
      if (dy > begin) window.runs[dx % 4].push_back({dx, begin, dy});
      while (dy < height && zero(dy)) ++dy, window.dense = false;
    }
  }
  return window;
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
