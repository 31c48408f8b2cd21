// The largest or smallest sample of a window: along rows by windows that double or triple, then down the
// columns, strip by strip, so that every row of samples is reduced once for all results that share it.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "ops/filter/rank/rank.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/rank/extreme.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/rank/rank-inl.h"
#include "simd/pixels-inl.h"

#ifndef TESSERA_OPS_FILTER_RANK_EXTREME_CC_
#define TESSERA_OPS_FILTER_RANK_EXTREME_CC_
namespace tessera::ops {

// A strip's rows and lines stay in L1 with the rows that a short window keeps; whole pages of the image where
// its rows are.
constexpr int kStripBytes = 4096;
constexpr int kAhead = 2;  // rows
// Windows of odd heights up to this hold their rows in registers, two results at a time; others are built
// from running extremes of blocks of rows.
constexpr int kShort = 7;
constexpr bool IsShort(int height) { return height <= kShort && height % 2 == 1; }
constexpr int kRing = 8;       // rows that short windows keep: a power of two above kShort
constexpr int kMostTerms = 5;  // of one step along a row

// Samples in the longest vector.
template <class T>
constexpr int kUnit = 64 / sizeof(T);

// Samples of a line of work, with room for vectors that begin within it.
template <class T>
constexpr ptrdiff_t LineStride(int samples) {
  const ptrdiff_t stride = (ptrdiff_t{samples} + 3 * kUnit<T> - 1) / kUnit<T> * kUnit<T>;
  // Rows 4 KB apart would compete for the same cache sets.
  return stride % static_cast<ptrdiff_t>(4096 / sizeof(T)) == 0 ? stride + kUnit<T> : stride;
}

template <class T>
struct ExtremeWork {
  T* lines[2];  // of `line` samples
  T* rows;      // a short window's ring, or two blocks of rows and their running extreme
  ptrdiff_t stride;
};

}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_RANK_EXTREME_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// The extreme of two samples; equal ones give the later, b.
template <bool kLargest>
struct OfNumbers {
  using T = float;
  static constexpr bool kNumbersOnly = true, kRare = false;
  static constexpr float kNothing =
      kLargest ? -std::numeric_limits<float>::infinity() : std::numeric_limits<float>::infinity();
  static HWY_INLINE V Of(V a, V b) { return kLargest ? s::ClampLow(a, b) : s::ClampHigh(a, b); }
};
template <bool kLargest>
struct OfAll {
  using T = float;
  static constexpr bool kNumbersOnly = false, kRare = true;
  static constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
  static HWY_INLINE V Of(V a, V b) { return kLargest ? s::MaxNumber(a, b) : s::MinNumber(a, b); }
};

template <bool kLargest, class TT>
struct OfCodes {
  using T = TT;
  static constexpr bool kNumbersOnly = false, kRare = false;
  static constexpr T kNothing = kLargest ? T{0} : std::numeric_limits<T>::max();
  static HWY_INLINE VK<T> Of(VK<T> a, VK<T> b) { return kLargest ? hn::Max(a, b) : hn::Min(a, b); }
};

template <class T>
HWY_INLINE VK<T> Load(const T* p) {
  return hn::LoadU(DK<T>(), p);
}

// out[i] = the extreme of in[i + offset] over kTerms offsets.
template <class E, int kTerms>
void Combine(const typename E::T* in, const ptrdiff_t* offsets, int count, typename E::T* out) {
  using T = typename E::T;
  ptrdiff_t o[kTerms];
  std::copy_n(offsets, kTerms, o);
  for (int i = 0; i < count; i += kKeyLanes<T>) {
    VK<T> v = Load(in + i);
    for (int k = 1; k < kTerms; ++k) v = E::Of(v, Load(in + i + o[k]));
    hn::StoreU(v, DK<T>(), out + i);
  }
}

// Windows go down columns where the processor does not see them coming: on the way, the row `ahead` samples
// further is asked for.
HWY_INLINE bool HasNaN(const float* in, int count, ptrdiff_t ahead) {
  auto found = hn::IsNaN(hn::Zero(D()));
  int i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    PrefetchLine(in + ahead, i);
    found = hn::Or(found, hn::IsNaN(Load(in + i)));
  }
  bool any = !hn::AllFalse(D(), found);
  for (; i < count; ++i) any = any || in[i] != in[i];
  return any;
}

template <class E>
class Extremes {
 public:
  using T = typename E::T;
  Extremes(const RankTile<T>& t, const ExtremeWork<T>& work) : t_(t), work_(work) {}

  // False when there are samples that E is not made for.
  bool Run() {
    // What is rare need not be fastest: it is compiled once for all heights.
    if constexpr (!E::kRare) {
      if (IsShort(t_.height)) {
        Short();
        return !strange_;
      }
    }
    High();
    return !strange_;
  }

 private:
  // Row j of the window samples, reduced along the row.
  void Reduce(int j, T* out) {
    const int all = t_.window_samples();
    if (j < t_.top || j >= t_.bottom) {
      std::fill_n(out, t_.samples, E::kNothing);
      return;
    }
    const T* in = t_.in + (j - t_.top) * t_.in_stride;
    if constexpr (E::kNumbersOnly) {
      strange_ =
          strange_ || HasNaN(in, t_.right - t_.left, (j + kAhead < t_.bottom ? kAhead : 0) * t_.in_stride);
    }
    if (t_.left > 0 || t_.right < all) {
      T* const line = work_.lines[0];
      std::fill_n(line, t_.left, E::kNothing);
      std::copy_n(in, t_.right - t_.left, line + t_.left);
      std::fill_n(line + t_.right, all - t_.right, E::kNothing);
      in = line;
    }
    int have = 1;
    do {
      const int left = (t_.width + have - 1) / have;
      // Three at a time need the fewest loads and stores; what is left goes in one step where possible.
      const int terms = left <= kMostTerms ? left : 3;
      ptrdiff_t offsets[kMostTerms];
      for (int k = 0; k < terms; ++k) {
        offsets[k] = ptrdiff_t{std::min(k * have, t_.width - have)} * t_.channels;
      }
      have = std::min(have * terms, t_.width);
      T* const to = have == t_.width ? out : work_.lines[1];
      const int count = t_.samples + (t_.width - have) * t_.channels;
      switch (terms) {
        case 1:
          Combine<E, 1>(in, offsets, count, to);
          break;
        case 2:
          Combine<E, 2>(in, offsets, count, to);
          break;
        case 3:
          Combine<E, 3>(in, offsets, count, to);
          break;
        case 4:
          Combine<E, 4>(in, offsets, count, to);
          break;
        default:
          Combine<E, 5>(in, offsets, count, to);
      }
      in = to;
    } while (have < t_.width);
  }

  // Results y and, of two, y + 1, which share all rows but the first and the last.
  template <int kHeight>
  void Pair(int y, bool two) {
    const T* r[kHeight + 1];
    for (int k = 0; k <= kHeight; ++k) r[k] = Ring(y + k);
    T* const out = t_.out + y * t_.out_stride;
    const auto single = [&](int i) HWY_ATTR {
      VK<T> v = Load(r[0] + i);
      for (int k = 1; k < kHeight; ++k) v = E::Of(v, Load(r[k] + i));
      return v;
    };
    if (!two) return StoreRow(single, out, t_.samples, t_.stream);
    T* const next = out + t_.out_stride;
    const bool stream = t_.stream && MayStream(out) && MayStream(next);
    int i = 0;
    for (; i + kKeyLanes<T> <= t_.samples; i += kKeyLanes<T>) {
      VK<T> v = Load(r[1] + i);
      for (int k = 2; k < kHeight; ++k) v = E::Of(v, Load(r[k] + i));
      s::StoreOrStream(E::Of(Load(r[0] + i), v), DK<T>(), out + i, stream);
      s::StoreOrStream(E::Of(v, Load(r[kHeight] + i)), DK<T>(), next + i, stream);
    }
    if (i == t_.samples) return;
    StoreRow([&](int k) HWY_ATTR { return single(i + k); }, out + i, t_.samples - i, false);
    for (int k = 0; k < kHeight; ++k) r[k] = r[k + 1];
    StoreRow([&](int k) HWY_ATTR { return single(i + k); }, next + i, t_.samples - i, false);
  }

  T* Ring(int j) const { return work_.rows + (j & (kRing - 1)) * work_.stride; }

  void Short() {
    for (int j = 0; j < t_.height - 1; ++j) Reduce(j, Ring(j));
    for (int y = 0; y < t_.rows; y += 2) {
      const bool two = y + 1 < t_.rows;
      for (int j = y + t_.height - 1; j < y + t_.height + (two ? 1 : 0); ++j) Reduce(j, Ring(j));
      switch (t_.height) {
        case 1:
          StoreRow([&](int i) HWY_ATTR { return Load(Ring(y) + i); }, t_.out + y * t_.out_stride, t_.samples,
                   t_.stream);
          if (two) {
            StoreRow([&](int i) HWY_ATTR { return Load(Ring(y + 1) + i); }, t_.out + (y + 1) * t_.out_stride,
                     t_.samples, t_.stream);
          }
          break;
        case 3:
          Pair<3>(y, two);
          break;
        case 5:
          Pair<5>(y, two);
          break;
        default:
          Pair<7>(y, two);
      }
    }
  }

  // After van Herk, and Gil and Werman: a window that begins at row i of a block is what is left of the block
  // and the first i rows of the next.
  void High() {
    const int height = t_.height, all = t_.window_rows();
    const ptrdiff_t stride = work_.stride;
    T* rest = work_.rows;  // of the block: row i is the extreme of rows i and on
    T* next = rest + height * stride;
    T* const first = next + height * stride;
    for (int j = 0; j < height; ++j) Reduce(j, rest + j * stride);
    for (int begin = 0; begin < t_.rows; begin += height) {
      for (int i = height - 2; i >= 0; --i) {
        T* const row = rest + i * stride;
        for (int x = 0; x < t_.samples; x += kKeyLanes<T>) {
          hn::StoreU(E::Of(Load(row + x), Load(row + stride + x)), DK<T>(), row + x);
        }
      }
      const int rows = std::min(height, t_.rows - begin);
      StoreRow([&](int x) HWY_ATTR { return Load(rest + x); }, t_.out + begin * t_.out_stride, t_.samples,
               t_.stream);
      for (int i = 1; i <= height && begin + height + i - 1 < all; ++i) {
        T* const row = next + (i - 1) * stride;
        Reduce(begin + height + i - 1, row);
        if (i >= rows) continue;
        const T* const from = rest + i * stride;
        if (i == 1) {
          std::copy_n(row, t_.samples, first);
        }
        StoreRow(
            [&](int x) HWY_ATTR {
              const VK<T> v = E::Of(Load(first + x), Load(row + x));
              hn::StoreU(v, DK<T>(), first + x);
              return E::Of(Load(from + x), v);
            },
            t_.out + (begin + i) * t_.out_stride, t_.samples, t_.stream);
      }
      std::swap(rest, next);
    }
  }

  const RankTile<T>& t_;
  const ExtremeWork<T>& work_;
  bool strange_ = false;
};

void ExtremeOfFloats(bool largest, const RankTile<float>& t, const ExtremeWork<float>& work) {
  // NaN is rare; where there is none the processor's own minimum does.
  if (largest ? Extremes<OfNumbers<true>>(t, work).Run() : Extremes<OfNumbers<false>>(t, work).Run()) return;
  if (largest) {
    Extremes<OfAll<true>>(t, work).Run();
  } else {
    Extremes<OfAll<false>>(t, work).Run();
  }
}

template <class T>
HWY_INLINE void ExtremeOfCodes(bool largest, const RankTile<T>& t, const ExtremeWork<T>& work) {
  if (largest) {
    Extremes<OfCodes<true, T>>(t, work).Run();
  } else {
    Extremes<OfCodes<false, T>>(t, work).Run();
  }
}
void ExtremeOfBytes(bool largest, const RankTile<uint8_t>& t, const ExtremeWork<uint8_t>& work) {
  ExtremeOfCodes(largest, t, work);
}
void ExtremeOfWords(bool largest, const RankTile<uint16_t>& t, const ExtremeWork<uint16_t>& work) {
  ExtremeOfCodes(largest, t, work);
}
RankFunctions::Extremes ExtremesOfTarget() { return {ExtremeOfFloats, ExtremeOfBytes, ExtremeOfWords}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(ExtremesOfTarget);

RankFunctions::Extremes ChooseExtremes() { return HWY_DYNAMIC_DISPATCH(ExtremesOfTarget)(); }

template <class T>
void RunExtreme(const RankFunctions& functions, bool largest, const RankTile<T>& tile, base::Arena& scratch) {
  auto* const run = std::get<RankFunctions::Extreme<T>>(functions.extremes);
  // Strips of a wide window would do little but its margins.
  constexpr int kSamples = kStripBytes / static_cast<int>(sizeof(T));
  const int margin = (tile.width - 1) * tile.channels;
  const int wanted = std::max(kSamples, 4 * margin);
  const int strip = std::min((tile.samples + kUnit<T> - 1) / kUnit<T>, wanted / kUnit<T>) * kUnit<T>;
  ExtremeWork<T> work;
  const ptrdiff_t line = LineStride<T>(strip + margin);
  for (T*& p : work.lines) p = scratch.Allocate<T>(static_cast<size_t>(line));
  work.stride = LineStride<T>(strip);
  const int rows = std::max(kRing, 2 * tile.height + 1);
  work.rows = scratch.Allocate<T>(static_cast<size_t>(work.stride) * static_cast<size_t>(rows));
  for (int x = 0; x < tile.samples; x += strip) {
    run(largest, tile.Strip(x, std::min(strip, tile.samples - x)), work);
  }
}

template void RunExtreme(const RankFunctions&, bool, const RankTile<float>&, base::Arena&);
template void RunExtreme(const RankFunctions&, bool, const RankTile<uint8_t>&, base::Arena&);
template void RunExtreme(const RankFunctions&, bool, const RankTile<uint16_t>&, base::Arena&);

}  // namespace tessera::ops
#endif  // HWY_ONCE
