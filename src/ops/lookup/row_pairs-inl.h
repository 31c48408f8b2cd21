// Lookups of scattered places in a picture that the nearer caches do not hold: from a copy in which every
// entry has the one above it at its side, so that a square lies in one line where rows need two.
#if defined(TESSERA_OPS_LOOKUP_ROW_PAIRS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_LOOKUP_ROW_PAIRS_INL_H_
#undef TESSERA_OPS_LOOKUP_ROW_PAIRS_INL_H_
#else
#define TESSERA_OPS_LOOKUP_ROW_PAIRS_INL_H_
#endif

#include <hwy/highway.h>

#ifdef __unix__
#include <unistd.h>
#endif

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "base/arena.h"
#include "ops/lookup/pictures-inl.h"
#include "tessera/error.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Shorter vectors take so many instructions that the lines are not what is waited for.
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
// Whether most neighbouring pixels of a block look up places many rows apart. Not from what the first pass
// has just stored, which would have to be waited for.
HWY_INLINE bool FarApart(const BlockCoordinates& block, int count, float rows) {
  int far = 0;
  for (int i = 0; i + 1 < count; i += 16) {
    const float* const y = block.from + block.rows.Offset(i, block.channels) + block.axis[1];
    far += std::fabs(y[block.channels] - *y) * rows > 4 ? 1 : -1;
  }
  return far > 0;
}

// Second passes, as those of pictures in every bit. pairs: of entry 0 of both axes.

inline bool GatherSquarePairs(const float* pairs, const Grid&, const Taps& taps, int count,
                              const BlockResults& results) {
  return BlendSquares(taps, count, results, [&](int pixel, V distance) HWY_ATTR {
    const int32_t* const place = taps.base + pixel;
    const auto squares = [&](int odd) HWY_ATTR {
      return s::LoadQuads(
          [&](int j) HWY_ATTR { return pairs + 2 * size_t{static_cast<uint32_t>(place[j / 2 + odd])}; }, 0);
    };
    V below, above;
    s::SplitInBlocks(squares(0), squares(1), below, above);
    return s::LerpFromNearer(below, above, hn::DupOdd(distance));
  });
}

// Two rows of four entries fill half a vector. Pixels kFirst, kFirst + 1 alternate by two entries in the
// lower half, kFirst + 4, kFirst + 5 in the upper one.
template <int kFirst>
HWY_INLINE V CubicRowPairs(const float* pairs, ptrdiff_t stride, const int32_t* base, const V* weight) {
  const s::D d;
  const hn::Half<s::D> half;
  alignas(64) static constexpr int32_t kPixel[16] = {
      kFirst,     kFirst,     kFirst + 1, kFirst + 1, kFirst,     kFirst,     kFirst + 1, kFirst + 1,
      kFirst + 4, kFirst + 4, kFirst + 5, kFirst + 5, kFirst + 4, kFirst + 4, kFirst + 5, kFirst + 5};
  const auto pixel = hn::SetTableIndices(d, kPixel);
  V sum = hn::Zero(d);
  for (int k = 0; k < 4; k += 2) {
    const auto two = [&](int first) HWY_ATTR {
      const auto rows = [&](int i)
                            HWY_ATTR { return hn::LoadU(half, pairs + k * stride + 2 * ptrdiff_t{base[i]}); };
      return hn::Combine(d, rows(first + 4), rows(first));
    };
    V row, next;
    s::SplitInBlocks(two(kFirst), two(kFirst + 1), row, next);
    const V w = hn::TableLookupLanes(weight[k], pixel);
    sum = k == 0 ? hn::Mul(row, w) : hn::MulAdd(row, w, sum);
    sum = hn::MulAdd(next, hn::TableLookupLanes(weight[k + 1], pixel), sum);
  }
  return sum;
}
// Four entries along x of every pixel, blended along y: q[k] has the k-th of each.
HWY_INLINE void CubicColumns(const float* pairs, ptrdiff_t stride, const int32_t* base, const V* w, V* q) {
  const V a = CubicRowPairs<0>(pairs, stride, base, w), b = CubicRowPairs<8>(pairs, stride, base, w),
          c = CubicRowPairs<2>(pairs, stride, base, w), e = CubicRowPairs<10>(pairs, stride, base, w);
  s::SplitInBlocks(s::EvenBlocks(a, b), s::EvenBlocks(c, e), q[0], q[1]);
  s::SplitInBlocks(s::OddBlocks(a, b), s::OddBlocks(c, e), q[2], q[3]);
}
inline bool GatherCubicPairs(const float* pairs, const Grid& grid, const Taps& taps, int count,
                             const BlockResults& results) {
  const s::D d;
  const ptrdiff_t stride = 2 * ptrdiff_t{grid.axis(1).stride};
  Sink sink(results);
  for (int i = 0; i < count; i += s::kLanes) {
    const int32_t* const base = taps.base + i;
    V w[4];
    for (int k = 0; k < 4; ++k) w[k] = hn::Load(d, taps.weight[4 + k] + i);
    V q[4];
    CubicColumns(pairs, stride, base, w, q);
    V sum = hn::Mul(q[0], hn::Load(d, taps.weight[0] + i));
    for (int k = 1; k < 4; ++k) sum = hn::MulAdd(q[k], hn::Load(d, taps.weight[k] + i), sum);
    sink.Store(sum, results.to + results.rows.Offset(i, 1));
  }
  return sink.Suspicious();
}

// The copy of a picture, made by the first thread that has seen as many pixels far apart as tell that more
// will come: it costs as much as they gain when there is one for two entries. Until then, and where the
// system refuses the memory, the picture itself serves. Shared by all threads.
class RowPairs {
 public:
  // Null where the picture's own rows do as well for so many pixels.
  static std::unique_ptr<RowPairs> Of(const Grid& grid, int64_t pixels) {
    static const int64_t most = MostBytes();
    if (grid.texel() != 1 || grid.bytes() <= kNearBytes || grid.bytes() > most) return nullptr;
    if (pixels < grid.bytes() / 4) return nullptr;
    return std::make_unique<RowPairs>(grid);
  }
  explicit RowPairs(const Grid& grid)
      : grid_(grid),
        gather_(grid.params().filter == TableFilter::kCubic ? GatherCubicPairs : GatherSquarePairs) {}

  // For a block of `count` pixels; null while it is better looked up in the picture.
  HWY_INLINE const float* For(const BlockCoordinates& block, int count) {
    if (!FarApart(block, count, grid_.axis(1).per_unit)) return nullptr;
    const float* const pairs = pairs_.load(std::memory_order_acquire);
    return pairs != nullptr ? pairs : Make(count);
  }
  bool Gather(const float* pairs, const Taps& taps, int count, const BlockResults& results) const {
    return gather_(pairs, grid_, taps, count, results);
  }

 private:
  static constexpr int64_t kNearBytes = int64_t{1} << 21;

  // A copy must stay in the last cache, beside the pictures that stream through it and what other processes
  // have there: one that does not takes twice as long as the picture.
  static int64_t MostBytes() {
    int64_t cache = 0;
#ifdef _SC_LEVEL3_CACHE_SIZE
    cache = sysconf(_SC_LEVEL3_CACHE_SIZE);
#endif
    return std::min(cache / 5, kMidBytes);
  }

  const float* Make(int count) {
    const int64_t before = pixels_.fetch_add(count, std::memory_order_relaxed),
                  enough = grid_.bytes() / 4 / 32;
    if (before >= enough || before + count < enough) return nullptr;
    const GridAxis &x = grid_.axis(0), &y = grid_.axis(1);
    const int64_t first = x.first_stored + int64_t{y.first_stored} * y.stride;
    try {
      memory_ = base::AllocateAligned(2 * static_cast<size_t>(grid_.bytes()), base::Access::kScattered);
    } catch (const Error&) {
      return nullptr;
    }
    float* const pairs = reinterpret_cast<float*>(memory_.get()) - 2 * first;
    for (int row = y.first_stored; row < y.last_stored; ++row) {
      const float* const from = grid_.data() + int64_t{row} * y.stride;
      float* const to = pairs + 2 * int64_t{row} * y.stride;
      const s::D d;
      int i = x.first_stored;
      for (; i + s::kLanes <= x.last_stored + 1; i += s::kLanes)
        hn::StoreInterleaved2(hn::LoadU(d, from + i), hn::LoadU(d, from + i + y.stride), d, to + 2 * i);
      for (; i <= x.last_stored; ++i) to[2 * i] = from[i], to[2 * i + 1] = from[i + y.stride];
    }
    pairs_.store(pairs, std::memory_order_release);
    return pairs;
  }

  const Grid& grid_;
  bool (*const gather_)(const float*, const Grid&, const Taps&, int, const BlockResults&);
  std::atomic<int64_t> pixels_ = 0;
  std::shared_ptr<std::byte> memory_;
  std::atomic<const float*> pairs_ = nullptr;
};
#else
class RowPairs {
 public:
  static std::unique_ptr<RowPairs> Of(const Grid&, int64_t) { return nullptr; }
  const float* For(const BlockCoordinates&, int) { return nullptr; }
  bool Gather(const float*, const Taps&, int, const BlockResults&) const { return false; }
};
#endif

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
