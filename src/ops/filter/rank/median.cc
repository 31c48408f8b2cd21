// Medians of windows, on integers in the order of the samples.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numeric>

#include "ops/filter/rank/rank.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/rank/median.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/rank/keys-inl.h"
#include "simd/pixels-inl.h"

#ifndef TESSERA_OPS_FILTER_RANK_MEDIAN_CC_
#define TESSERA_OPS_FILTER_RANK_MEDIAN_CC_
namespace tessera::ops {

// A strip's rows, its sorted columns and the results' own memory share L1.
template <class Sample>
constexpr int kMedianStrip = 4096 / sizeof(Sample);
constexpr ptrdiff_t kKeyMargin = 64;  // a vector may begin at any sample that exists
constexpr ptrdiff_t ToKeyLine(int samples) { return (ptrdiff_t{samples} + kKeyMargin + 63) / 64 * 64; }
// Sorted columns are as many lines, a constant apart: their addresses take few registers. It leaves room for
// the margins of all but images of very many channels.
constexpr int kMostSorted = 5;
constexpr ptrdiff_t kSortedBytes = 6400;
template <class Key>
constexpr ptrdiff_t kSortedLine = kSortedBytes / sizeof(Key);
static_assert(ToKeyLine(kMedianStrip<uint8_t>) < kSortedLine<int8_t>);
static_assert(ToKeyLine(kMedianStrip<float>) < kSortedLine<int32_t>);
constexpr int kAhead = 2;  // rows
// Windows whose counts fit in a byte's key.
constexpr int kMostOfBytes = 127;

struct MedianWork {
  std::byte* keys;     // window.height rows of `stride` keys
  std::byte* columns;  // kMostSorted lines of kSortedBytes
  std::byte* results;  // one
  std::byte* ranks;    // one
  const void** rows;   // two pointers for every row of the window
  ptrdiff_t stride;
};

}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_RANK_MEDIAN_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
template <class VT>
HWY_INLINE void Sort(VT& a, VT& b) {
  const VT low = hn::Min(a, b);
  b = hn::Max(a, b);
  a = low;
}
template <class VT>
HWY_INLINE VT MiddleOf(VT a, VT b, VT c) {
  Sort(a, b);
  return hn::Max(a, hn::Min(b, c));
}

// The columns of three rows, sorted; every one of them serves three results.
template <class T>
void SortColumns3(const T* const* rows, int count, T* to) {
  const DK<T> d;
  const T *const first = rows[0], *const second = rows[1], *const third = rows[2];
  for (int i = 0; i < count; i += kKeyLanes<T>) {
    VK<T> a = hn::LoadU(d, first + i), b = hn::LoadU(d, second + i), c = hn::LoadU(d, third + i);
    Sort(a, b), Sort(b, c), Sort(a, b);
    hn::StoreU(a, d, to + i), hn::StoreU(b, d, to + kSortedLine<T> + i),
        hn::StoreU(c, d, to + 2 * kSortedLine<T> + i);
  }
}

// The middle of nine is the middle of the largest of the low ones, the middle of the middle ones and the
// smallest of the high ones.
template <class T>
struct MiddleOfNine {
  const T* columns;
  ptrdiff_t channels;
  HWY_INLINE VK<T> At(int line, int column, int i) const {
    return hn::LoadU(DK<T>(), columns + line * kSortedLine<T> + i + column * channels);
  }
  HWY_INLINE VK<T> operator()(int i) const {
    const VK<T> low = hn::Max(hn::Max(At(0, 0, i), At(0, 1, i)), At(0, 2, i));
    const VK<T> high = hn::Min(hn::Min(At(2, 0, i), At(2, 1, i)), At(2, 2, i));
    return MiddleOf(low, high, MiddleOf(At(1, 0, i), At(1, 1, i), At(1, 2, i)));
  }
};

template <class VT>
HWY_INLINE void SortFive(VT (&v)[5]) {
  Sort(v[0], v[3]), Sort(v[1], v[4]), Sort(v[0], v[2]);
  Sort(v[1], v[3]), Sort(v[0], v[1]), Sort(v[2], v[4]);
  Sort(v[1], v[2]), Sort(v[3], v[4]), Sort(v[2], v[3]);
}

template <class T>
void SortColumns5(const T* const* rows, int count, T* to) {
  const DK<T> d;
  const T* row[5];
  for (int k = 0; k < 5; ++k) row[k] = rows[k];
  for (int i = 0; i < count; i += kKeyLanes<T>) {
    VK<T> v[5];
    for (int k = 0; k < 5; ++k) v[k] = hn::LoadU(d, row[k] + i);
    SortFive(v);
    for (int k = 0; k < 5; ++k) hn::StoreU(v[k], d, to + k * kSortedLine<T> + i);
  }
}

// With sorted columns sorted along the rows, each sample has all those above and to the left below it: twelve
// of 25 are out of the question, and an order of exchanges found by search picks the middle of the other 13.
// What an exchange leaves unused costs nothing.
template <class T>
struct MiddleOf25 {
  const T* columns;
  ptrdiff_t channels;
  HWY_INLINE void Row(int line, int i, VK<T> (&v)[5]) const {
    for (int k = 0; k < 5; ++k) v[k] = hn::LoadU(DK<T>(), columns + line * kSortedLine<T> + i + k * channels);
    SortFive(v);
  }
  HWY_INLINE VK<T> operator()(int i) const {
    VK<T> p[13], v[5];
    Row(0, i, v), p[0] = v[3], p[1] = v[4];
    Row(1, i, v), p[2] = v[2], p[3] = v[3], p[4] = v[4];
    Row(2, i, v), p[5] = v[1], p[6] = v[2], p[7] = v[3];
    Row(3, i, v), p[8] = v[0], p[9] = v[1], p[10] = v[2];
    Row(4, i, v), p[11] = v[0], p[12] = v[1];
    Sort(p[12], p[7]), Sort(p[6], p[3]), Sort(p[1], p[12]), Sort(p[1], p[6]), Sort(p[1], p[2]);
    Sort(p[10], p[4]), Sort(p[0], p[6]), Sort(p[0], p[2]), Sort(p[10], p[12]), Sort(p[3], p[12]);
    Sort(p[6], p[9]), Sort(p[10], p[3]), Sort(p[6], p[2]), Sort(p[3], p[9]), Sort(p[2], p[5]);
    Sort(p[10], p[11]), Sort(p[10], p[5]), Sort(p[3], p[11]), Sort(p[5], p[8]), Sort(p[3], p[8]);
    return p[3];
  }
};

// The samples of the wanted ranks, bit by bit from the top: the largest key that no more than `rank` keys are
// below. Counts must fit in T.
template <class K, int kVectors>
HWY_INLINE void Select(const typename K::T* const* rows, int x, int width, int height, int channels,
                       const typename K::T* ranks, typename K::T* to) {
  using T = typename K::T;
  const DK<T> d;
  const VK<T> sign = hn::Set(d, static_cast<T>(-1 - ((int64_t{1} << (K::kBits - 1)) - 1)));
  VK<T> found[kVectors], below[kVectors];
  for (int v = 0; v < kVectors; ++v) found[v] = sign;
  for (int bit = K::kBits - 1; bit >= 0; --bit) {
    // A key's top bit is upside down.
    VK<T> limit[kVectors];
    for (int v = 0; v < kVectors; ++v) {
      limit[v] =
          bit == K::kBits - 1 ? hn::Zero(d) : hn::Or(found[v], hn::Set(d, static_cast<T>(int64_t{1} << bit)));
      below[v] = hn::Zero(d);
    }
    for (int y = 0; y < height; ++y) {
      const T* p = rows[y] + x;
      for (int c = 0; c < width; ++c, p += channels) {
        for (int v = 0; v < kVectors; ++v) {
          // VecFromMask is -1 where true.
          below[v] =
              hn::Sub(below[v], hn::VecFromMask(d, hn::Lt(hn::LoadU(d, p + v * kKeyLanes<T>), limit[v])));
        }
      }
    }
    for (int v = 0; v < kVectors; ++v) {
      const VK<T> rank = hn::LoadU(d, ranks + x + v * kKeyLanes<T>);
      found[v] = hn::IfThenElse(hn::Gt(below[v], rank), found[v], limit[v]);
    }
  }
  for (int v = 0; v < kVectors; ++v) hn::StoreU(found[v], d, to + x + v * kKeyLanes<T>);
}

template <class K>
class Medians {
 public:
  using T = typename K::T;
  using Sample = typename K::Sample;
  Medians(const RankTile<Sample>& t, const MedianWork& work) : t_(t), work_(work) {}

  // False when some sample has no key.
  bool Run() {
    for (int j = 0; j < t_.height - 1; ++j) {
      if (!Fetch(j)) return false;
    }
    const T** const rows = Pointers() + t_.height;
    T* const ranks = reinterpret_cast<T*>(work_.ranks);
    T* const results = reinterpret_cast<T*>(work_.results);
    T* const columns = reinterpret_cast<T*>(work_.columns);
    const bool sortable = t_.width == t_.height && (t_.width == 3 || t_.width == 5) &&
                          ToKeyLine(t_.window_samples()) <= kSortedLine<T>;
    int rows_of_ranks = -1;
    // The results whose windows all exist.
    const int begin = std::min(t_.left, t_.samples),
              end = std::clamp(t_.right - (t_.width - 1) * t_.channels, begin, t_.samples);
    for (int y = 0; y < t_.rows; ++y) {
      if (!Fetch(y + t_.height - 1)) return false;
      for (int k = 0; k < t_.height; ++k) rows[k] = Pointers()[(y + k) % t_.height];
      const int rows_inside = std::min(y + t_.height, t_.bottom) - std::max(y, t_.top);
      const bool sort = sortable && rows_inside == t_.height;
      // What a border reaches has other ranks and is left to selection.
      const int left = sort ? begin : t_.samples, right = sort ? end : t_.samples;
      if (rows_inside != rows_of_ranks) {
        SetRanks(0, left, rows_inside, ranks);
        SetRanks(right, t_.samples, rows_inside, ranks);
        rows_of_ranks = rows_inside;
      }
      Sample* const out = t_.out + y * t_.out_stride;
      if (sort && t_.width == 3) {
        SortColumns3(rows, t_.window_samples(), columns);
        StoreKeys<K>(MiddleOfNine<T>{columns, t_.channels}, results, out, t_.samples, t_.stream);
      } else if (sort) {
        SortColumns5(rows, t_.window_samples(), columns);
        StoreKeys<K>(MiddleOf25<T>{columns, t_.channels}, results, out, t_.samples, t_.stream);
      }
      Selected(rows, 0, left, ranks, results, out);
      Selected(rows, right, t_.samples, ranks, results, out);
    }
    return true;
  }

 private:
  const T** Pointers() const { return reinterpret_cast<const T**>(work_.rows); }

  // Row j of the window samples as keys; what does not exist as the largest.
  bool Fetch(int j) {
    const int all = t_.window_samples(), slot = j % t_.height;
    T* const row = reinterpret_cast<T*>(work_.keys) + slot * work_.stride;
    const T last = static_cast<T>((int64_t{1} << (K::kBits - 1)) - 1);
    Pointers()[slot] = row;
    if (j < t_.top || j >= t_.bottom) {
      std::fill_n(row, all, last);
      return true;
    }
    const Sample* const in = t_.in + (j - t_.top) * t_.in_stride;
    const Sample* const ahead = in + (j + kAhead < t_.bottom ? kAhead : 0) * t_.in_stride;
    const int count = t_.right - t_.left;
    if constexpr (K::kInPlace) {
      if (!AreUnsigned(in, count, ahead)) return false;
      if (count == all) {
        Pointers()[slot] = reinterpret_cast<const T*>(in);
        return true;
      }
      std::memcpy(row + t_.left, in, static_cast<size_t>(count) * sizeof(T));
    } else {
      if (!ToKeys<K>(in, count, ahead, row + t_.left)) return false;
    }
    std::fill_n(row, t_.left, last);
    std::fill_n(row + t_.right, all - t_.right, last);
    return true;
  }

  // Of the results [begin, end), whole pixels.
  void SetRanks(int begin, int end, int rows_inside, T* ranks) {
    const int left = t_.left / t_.channels, right = t_.right / t_.channels;
    for (int pixel = begin / t_.channels, x = begin; x < end; ++pixel) {
      const int columns = std::min(pixel + t_.width, right) - std::max(pixel, left);
      for (const int next = std::min(x + t_.channels, end); x < next; ++x) {
        ranks[x] = static_cast<T>(columns * rows_inside / 2);
      }
    }
  }

  // The results [begin, end) of a row.
  void Selected(const T* const* rows, int begin, int end, const T* ranks, T* results, Sample* out) {
    constexpr int kBlock = 4;
    int x = begin;
    for (; x + kBlock * kKeyLanes<T> <= end; x += kBlock * kKeyLanes<T>) {
      Select<K, kBlock>(rows, x, t_.width, t_.height, t_.channels, ranks, results);
    }
    for (; x < end; x += kKeyLanes<T>) {
      Select<K, 1>(rows, x, t_.width, t_.height, t_.channels, ranks, results);
    }
    if constexpr (K::kInPlace) {
      if (end > begin)
        std::memcpy(out + begin, results + begin, static_cast<size_t>(end - begin) * sizeof(T));
    } else {
      StoreValues<K>(results + begin, out + begin, end - begin, false);
    }
  }

  const RankTile<Sample>& t_;
  const MedianWork& work_;
};

void MedianOfFloats(int code, const RankTile<float>& t, const MedianWork& work) {
  const int count = t.width * t.height;
  if (code == 255 && count <= kMostOfBytes) {
    if (Medians<CodeKeys<PixelType::kUint8, int8_t>>(t, work).Run()) return;
  } else if (code == 255) {
    if (Medians<CodeKeys<PixelType::kUint8, int16_t>>(t, work).Run()) return;
  } else if (code == 65535) {
    if (Medians<CodeKeys<PixelType::kUint16, int16_t>>(t, work).Run()) return;
  }
  if (Medians<Bits>(t, work).Run()) return;
  Medians<FloatKeys>(t, work).Run();
}
void MedianOfBytes(int, const RankTile<uint8_t>& t, const MedianWork& work) {
  if (t.width * t.height <= kMostOfBytes) {
    Medians<StoredKeys<uint8_t, int8_t>>(t, work).Run();
  } else {
    Medians<StoredKeys<uint8_t, int16_t>>(t, work).Run();
  }
}
void MedianOfWords(int, const RankTile<uint16_t>& t, const MedianWork& work) {
  Medians<StoredKeys<uint16_t, int16_t>>(t, work).Run();
}
RankFunctions::Medians MediansOfTarget() { return {MedianOfFloats, MedianOfBytes, MedianOfWords}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(MediansOfTarget);

template <class T>
void RunStrips(const RankFunctions& functions, int code, const RankTile<T>& tile, base::Arena& scratch) {
  auto* const run = std::get<RankFunctions::Median<T>>(functions.medians);
  // Strips of a wide window would do little but its margins.
  const int margin = (tile.width - 1) * tile.channels;
  const int wanted = std::max(kMedianStrip<T>, 4 * margin);
  // Whole pixels: how many columns lie inside is the same for all samples of a pixel.
  const int unit = std::lcm(64 / static_cast<int>(sizeof(T)), tile.channels);
  const int strip = std::min((tile.samples + unit - 1) / unit, std::max(1, wanted / unit)) * unit;
  MedianWork work;
  work.stride = ToKeyLine(strip + margin);
  const auto lines = [&](int count) {
    return reinterpret_cast<std::byte*>(
        scratch.Allocate<int32_t>(static_cast<size_t>(work.stride) * static_cast<size_t>(count)));
  };
  work.keys = lines(tile.height);
  work.columns = scratch.Allocate<std::byte>(kMostSorted * kSortedBytes);
  work.results = lines(1);
  work.ranks = lines(1);
  work.rows = scratch.Allocate<const void*>(2 * static_cast<size_t>(tile.height));
  for (int x = 0; x < tile.samples; x += strip) {
    run(code, tile.Strip(x, std::min(strip, tile.samples - x)), work);
  }
}

// Nanoseconds a sample with AVX2: selection looks at all of the window for every bit of a key.
constexpr bool Slides(double selection, int width, int height) {
  return selection * width * height > 38 + 2.2 * height;
}
constexpr double kBytes = 0.13, kWords = 0.3, kFloats = 1.5;  // of selection, for each sample of the window
static_assert(Slides(kBytes, 128, 255) &&
              Slides(kBytes, 255, 128));  // counts that are selected fit in 16 bits

}  // namespace

RankFunctions::Medians ChooseMedians() { return HWY_DYNAMIC_DISPATCH(MediansOfTarget)(); }

void RunMedian(const RankFunctions& functions, int code, const RankTile<float>& tile, base::Arena& scratch) {
  const double selection = code == 255 ? kBytes : code == 65535 ? kWords : kFloats;
  if (Slides(selection, tile.width, tile.height)) return RunSlidingMedian(functions, tile, scratch);
  RunStrips(functions, code, tile, scratch);
}
void RunMedian(const RankFunctions& functions, const RankTile<uint8_t>& tile, base::Arena& scratch) {
  constexpr int kSelected = 224;  // selection is faster
  if (tile.width * tile.height > kSelected) return RunHistogramMedian(functions, tile, scratch);
  RunStrips(functions, 0, tile, scratch);
}
void RunMedian(const RankFunctions& functions, const RankTile<uint16_t>& tile, base::Arena& scratch) {
  if (Slides(kWords, tile.width, tile.height)) return RunSlidingMedian(functions, tile, scratch);
  RunStrips(functions, 0, tile, scratch);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
