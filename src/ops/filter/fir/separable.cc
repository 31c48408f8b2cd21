// Window sums of products of a column and a row: columns into a strip in L1, rows from there.
#include <algorithm>
#include <cstdlib>
#include <memory>
#include <numeric>

#include "base/prefetch.h"
#include "ops/filter/fir/fir.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/fir/separable.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/fir/fir-inl.h"
#include "ops/filter/fir/symmetric-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Output rows that share their loads.
constexpr int kColumnRows = kLanes == 16 ? 8 : 4;

// Rows [0, kR) of the column sums of `floats` (whole vectors) samples.
template <int kR, int kJ>
HWY_INLINE void ColumnBlock(const float* HWY_RESTRICT weights, int taps, const float* in, ptrdiff_t stride,
                            float* out, ptrdiff_t out_stride) {
  V acc[kR][kJ];
  for (auto& row : acc) {
    for (V& a : row) a = Nothing();
  }
  AddRun<false>(acc, acc, in, stride, weights, 1, 0, taps);
  for (int r = 0; r < kR; ++r) {
    for (int j = 0; j < kJ; ++j) hn::StoreU(acc[r][j], D(), out + r * out_stride + j * kLanes);
  }
}

template <int kR>
void Columns(const std::vector<float>& column, const float* in, ptrdiff_t stride, int floats, float* out,
             ptrdiff_t out_stride) {
  const int taps = static_cast<int>(column.size());
  int x = 0;
  if (IsSymmetric(column)) {
    for (; x < floats; x += kLanes) {
      SymmetricColumn<kR>(column.data(), taps, in + x, stride, out + x, out_stride);
    }
    return;
  }
  for (; x + kLanes < floats; x += 2 * kLanes) {
    ColumnBlock<kR, 2>(column.data(), taps, in + x, stride, out + x, out_stride);
  }
  for (; x < floats; x += kLanes)
    ColumnBlock<kR, 1>(column.data(), taps, in + x, stride, out + x, out_stride);
}

// The row sums of kJ vectors side by side, group by group.
template <int kJ>
HWY_INLINE void RowSum(const float* HWY_RESTRICT weights, int taps, const float* in, int channels,
                       V (&total)[kJ]) {
  for (V& v : total) v = Nothing();
  for (int g = 0; g < std::min(4, taps); ++g) {
    V acc[kJ];
    for (V& v : acc) v = Nothing();
    for (int k = g; k < taps; k += 4) {
      const V weight = hn::Set(D(), weights[k]);
      for (int j = 0; j < kJ; ++j) acc[j] = hn::MulAdd(Load(in + k * channels + j * kLanes), weight, acc[j]);
    }
    for (int j = 0; j < kJ; ++j) total[j] = hn::Add(total[j], acc[j]);
  }
}

// Group sums of kJ registers from aligned loads.
template <int kJ>
HWY_INLINE void RowGroups(const float* HWY_RESTRICT weights, int taps, const float* in, V (&acc)[kJ][4]) {
  for (auto& groups : acc) {
    for (V& a : groups) a = Nothing();
  }
  int k = 0;
  for (; k + 4 <= taps; k += 4, in += kLanes) {
    V v[kJ];
    for (int j = 0; j < kJ; ++j) v[j] = Load(in + j * kLanes);
    HWY_UNROLL(4)
    for (int g = 0; g < 4; ++g) {
      const V w = hn::Set(D(), weights[k + g]);
      HWY_UNROLL(4)
      for (int j = 0; j < kJ; ++j) acc[j][g] = hn::MulAdd(v[j], w, acc[j][g]);
    }
  }
  HWY_UNROLL(4)
  for (int g = 0; g < 3; ++g) {
    if (k + g >= taps) break;
    const V w = hn::Set(D(), weights[k + g]);
    HWY_UNROLL(4)
    for (int j = 0; j < kJ; ++j) acc[j][g] = hn::MulAdd(Load(in + j * kLanes), w, acc[j][g]);
  }
}

// RGBA; `in` is padded so that whole blocks may be computed.
template <bool kAdd>
void RowRgba(const std::vector<float>& row, const float* in, int floats, float* out, bool stream) {
  constexpr int kJ = 4;
  const int taps = static_cast<int>(row.size());
  V first[1][4];
  RowGroups<1>(row.data(), taps, in, first);
  for (int x = 0; x < floats; x += kJ * kLanes) {
    V acc[kJ][4];
    RowGroups<kJ>(row.data(), taps, in + x + kLanes, acc);
    for (int j = 0; j < kJ && x + j * kLanes < floats; ++j) {
      const V(&now)[4] = j == 0 ? first[0] : acc[j - 1];
      V v = hn::Add(Nothing(), now[0]);
      if (taps > 1) v = hn::Add(v, s::ShiftBlocks<1>(now[1], acc[j][1]));
      if (taps > 2) v = hn::Add(v, s::ShiftBlocks<2>(now[2], acc[j][2]));
      if (taps > 3) v = hn::Add(v, s::ShiftBlocks<3>(now[3], acc[j][3]));
      float* to = out + x + j * kLanes;
      const int count = floats - x - j * kLanes;
      if (kAdd) v = hn::Add(Load(to), v);
      StorePart(v, to, count, stream);
    }
    for (int g = 0; g < 4; ++g) first[0][g] = acc[kJ - 1][g];
  }
}

// One row of sums of `floats` samples, stored or added to `out`, which for adding is scratch memory of whole
// vectors.
template <bool kAdd>
void Row(const std::vector<float>& row, const float* in, int floats, int channels, float* out, bool stream) {
  if constexpr (kFourPixels) {
    if (channels == 4) return RowRgba<kAdd>(row, in, floats, out, stream);
  }
  const int taps = static_cast<int>(row.size());
  const auto run = [&]<int kJ>(int x) HWY_ATTR {
    V sum[kJ];
    RowSum(row.data(), taps, in + x, channels, sum);
    for (int j = 0; j < kJ; ++j) {
      float* const to = out + x + j * kLanes;
      StorePart(kAdd ? hn::Add(Load(to), sum[j]) : sum[j], to, floats - x - j * kLanes, stream);
    }
  };
  int x = 0;
  for (; x + kAbreast * kLanes <= floats; x += kAbreast * kLanes) run.template operator()<kAbreast>(x);
  for (; x < floats; x += kLanes) run.template operator()<1>(x);
}

constexpr int kStripPad = 5 * 16;  // a strip's last block of four registers, and the one after it

// How a tile is cut. The column sums of a strip and of its halo stay in L1, or in L2 where the halo is wide:
// a strip much narrower than its halo would compute most columns twice. Under tall kernels many result rows
// share what comes from beyond L2.
struct Blocks {
  int strip, rows, reach;
  ptrdiff_t stride;
  Blocks(const SeparableWindow& window, int channels) {
    reach = (window.width - 1) * channels;
    strip = std::clamp(8 * reach, 640, 2048) / 32 * 32;
    rows = window.height > 64 ? 32 : kColumnRows;
    stride = ((strip + reach + kStripPad + 15) / 16 | 1) * 16;
  }
  // Rows whose distance is a multiple of a page lie in the same few sets of the first cache and drive each
  // other out: those of a tile are then copied, one after the other, to where they do not.
  size_t CopiedFloats(const SeparableWindow& window, const FloatTile& t) const {
    constexpr int kPage = 4096, kWays = 8;
    constexpr size_t kMost = size_t{1} << 18;  // a second cache
    const auto period = std::gcd(std::abs(t.in_stride) * ptrdiff_t{sizeof(float)}, ptrdiff_t{kPage});
    const bool collide = window.height - 1 + rows > kPage / period * kWays;
    const size_t floats = static_cast<size_t>(t.rows + window.height - 1) * static_cast<size_t>(stride);
    return collide && floats <= kMost ? floats : 0;
  }
};
constexpr int kChunk = 512;  // columns of a tall kernel whose rows stay in L2

// `rows` rows of column sums.
void ColumnRows(const std::vector<float>& column, const float* in, ptrdiff_t in_stride, int rows, int floats,
                float* out, ptrdiff_t stride) {
  const int chunk = rows > kColumnRows ? kChunk : floats;
  for (int x = 0; x < floats; x += chunk) {
    const int count = std::min(chunk, floats - x);
    for (int r = 0; r < rows;) {
      const float* from = in + r * in_stride + x;
      float* const to = out + r * stride + x;
      if (rows - r >= kColumnRows) {
        Columns<kColumnRows>(column, from, in_stride, count, to, stride);
        r += kColumnRows;
      } else {
        Columns<1>(column, from, in_stride, count, to, stride);
        ++r;
      }
    }
  }
}

// The rows below are fetched meanwhile: a piece of a row is too short for the hardware to notice.
void CopyRow(const float* HWY_RESTRICT in, ptrdiff_t stride, int floats, float* HWY_RESTRICT out) {
  constexpr ptrdiff_t kAhead = 4;
  for (int x = 0; x < floats; x += kLanes) {
    base::PrefetchSecond(in + kAhead * stride + x);
    hn::StoreU(Load(in + x), D(), out + x);
  }
}

void SumByColumns(const SeparableWindow& window, const FloatTile& t, base::Arena& arena) {
  const Blocks blocks(window, t.channels);
  const size_t copied_floats = blocks.CopiedFloats(window, t);
  const bool copies = copied_floats != 0;
  auto* const scratch = arena.Allocate<float>(static_cast<size_t>(blocks.rows) *
                                                  static_cast<size_t>(blocks.stride + blocks.strip) +
                                              copied_floats + 64);
  float* const sums = scratch + blocks.rows * blocks.stride;  // for kernels of several terms
  float* const copy = sums + blocks.rows * blocks.strip;
  const bool one = window.terms.size() == 1;
  const bool symmetric = one && IsSymmetric(window.terms[0].row);
  for (int x = 0; x < t.samples; x += blocks.strip) {
    const int count = std::min(blocks.strip, t.samples - x);
    const int floats = count + blocks.reach, all_rows = t.rows + window.height - 1;
    const float* const source = t.in + x;
    const float* const in = copies ? copy : source;
    const ptrdiff_t in_stride = copies ? blocks.stride : t.in_stride;
    int copied = 0;
    for (int y = 0; y < t.rows; y += blocks.rows) {
      const int rows = std::min(blocks.rows, t.rows - y);
      for (; copies && copied < y + rows + window.height - 1; ++copied) {
        CopyRow(source + copied * t.in_stride, t.in_stride, floats, copy + copied * blocks.stride);
      }
      for (size_t k = 0; k < window.terms.size(); ++k) {
        const SeparableWindow::Term& term = window.terms[k];
        ColumnRows(term.column, in + y * in_stride, in_stride, rows, floats, scratch, blocks.stride);
        for (int r = 0; r < rows; ++r) {
          float* out = t.out + (y + r) * t.out_stride + x;
          float* to = sums + r * blocks.strip;
          if (symmetric) {
            const float* const soon =
                source + std::min(y + rows + window.height - 1 + r, all_rows - 1) * t.in_stride;
            RunSymmetricRow(term.row, scratch + r * blocks.stride, soon, count, t.channels, out, t.stream);
          } else if (one) {
            Row<false>(term.row, scratch + r * blocks.stride, count, t.channels, out, t.stream);
          } else if (k == 0) {
            Row<false>(term.row, scratch + r * blocks.stride, count, t.channels, to, false);
          } else {
            Row<true>(term.row, scratch + r * blocks.stride, count, t.channels, to, false);
          }
        }
      }
      for (int r = 0; r < rows && !one; ++r) {
        float* out = t.out + (y + r) * t.out_stride + x;
        for (int i = 0; i < count; i += kLanes) {
          StorePart(Load(sums + r * blocks.strip + i), out + i, count - i, t.stream);
        }
      }
    }
  }
}

class SeparableSums final : public WindowSums {
 public:
  explicit SeparableSums(const SeparableWindow& window) : window_(window) {}
  void Run(const FloatTile& tile, base::Arena& scratch) const override {
    SumByColumns(window_, tile, scratch);
  }

 private:
  SeparableWindow window_;
};
std::unique_ptr<const WindowSums> SeparableSumsOfTarget(const SeparableWindow& window) {
  return std::make_unique<const SeparableSums>(window);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(SeparableSumsOfTarget);

std::unique_ptr<const WindowSums> MakeSeparableSums(const SeparableWindow& window) {
  return HWY_DYNAMIC_DISPATCH(SeparableSumsOfTarget)(window);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
