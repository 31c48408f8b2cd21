// What the kernels of order statistics are given.
#ifndef TESSERA_OPS_FILTER_RANK_RANK_H_
#define TESSERA_OPS_FILTER_RANK_RANK_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <tuple>

#include "base/arena.h"

namespace tessera::ops {

enum class RankKind { kMedian, kDilate, kErode };

// Results [0, across) by [0, down) of one channel, and the columns and rows that exist under their windows.
struct RankView {
  int columns, rows;  // that exist
  int left, top;      // where the first result's window begins, from the first of them: at most 0
  int width, height;  // of the window
  int across, down;   // results

  // Columns [FirstColumn(x), LastColumn(x)) lie under the window of result x, and such rows under y's.
  int FirstColumn(int x) const { return std::max(0, x + left); }
  int LastColumn(int x) const { return std::min(columns, x + left + width); }
  int FirstRow(int y) const { return std::max(0, y + top); }
  int LastRow(int y) const { return std::min(rows, y + top + height); }
};

// Results and the samples that their windows see. Window samples (x, y) are those under result (0, 0)'s
// window and on to the right and down; of them only columns [left, right) and rows [top, bottom) exist.
// Columns are counted in samples.
template <class T>
struct RankTile {
  const T* in;  // the first sample that exists; a vector beyond the end of a row may be read
  ptrdiff_t in_stride;
  int left, right, top, bottom;
  T* out;
  ptrdiff_t out_stride;
  int samples, rows, channels;
  int width, height;  // of the window, in pixels
  bool stream;        // write around the cache where aligned

  int window_samples() const { return samples + (width - 1) * channels; }
  int window_rows() const { return rows + height - 1; }

  // The results of pixels [x, x + across) by [y, y + down).
  RankView View(int x, int y, int across, int down) const {
    const int first = std::max(x, left / channels), last = std::min(x + across + width - 1, right / channels);
    const int above = std::max(y, top), below = std::min(y + down + height - 1, bottom);
    return {last - first, below - above, x - first, y - above, width, height, across, down};
  }
  // The first sample that exists under the windows of a view from pixel (x, y) on.
  const T* First(const RankView& view, int x, int y, int channel) const {
    return in + (y - view.top - top) * in_stride + ptrdiff_t{x - view.left} * channels - left + channel;
  }

  // The results [first, first + count) of every row.
  RankTile Strip(int first, int count) const {
    RankTile t = *this;
    t.samples = count;
    t.out += first;
    t.in += std::max(0, first - left);
    t.left = std::max(0, left - first);
    t.right = std::min(right - first, t.window_samples());
    return t;
  }
};

// What the kernels work on, their own affair.
template <class T>
struct ExtremeWork;
struct MedianWork;
struct HistogramStrip;
template <class T, class Rank>
struct RankedBlock;

// The kernels of one instruction set, chosen when a stage is made.
struct RankFunctions {
  template <class T>
  using Extreme = void (*)(bool largest, const RankTile<T>&, const ExtremeWork<T>&);
  template <class T>
  using Median = void (*)(int code, const RankTile<T>&, const MedianWork&);
  template <class T, class Rank>
  using Slide = void (*)(const RankedBlock<T, Rank>&);
  using Extremes = std::tuple<Extreme<float>, Extreme<uint8_t>, Extreme<uint16_t>>;
  using Medians = std::tuple<Median<float>, Median<uint8_t>, Median<uint16_t>>;
  using Slides = std::tuple<Slide<float, uint16_t>, Slide<float, uint32_t>, Slide<uint16_t, uint16_t>,
                            Slide<uint16_t, uint32_t>, Slide<uint8_t, uint16_t>, Slide<uint8_t, uint32_t>>;
  using Histograms = void (*)(const HistogramStrip&);

  Extremes extremes;
  Medians medians;
  Slides slides;
  Histograms histograms;
};
RankFunctions::Extremes ChooseExtremes();
RankFunctions::Medians ChooseMedians();
RankFunctions::Slides ChooseSlides();
RankFunctions::Histograms ChooseHistograms();

// The largest or smallest number under every window; of equal ones the last in reading order, of nothing but
// NaN the first. Samples are floats or the codes of integers.
template <class T>
void RunExtreme(const RankFunctions& functions, bool largest, const RankTile<T>& tile, base::Arena& scratch);
// Sample n / 2 of the n that exist under every window, in the order -inf, ..., -0, 0, ..., inf, NaN. `code`:
// the largest code of an image of integers, whose samples may be codes / largest, or 0.
void RunMedian(const RankFunctions& functions, int code, const RankTile<float>& tile, base::Arena& scratch);
// The same of codes.
void RunMedian(const RankFunctions& functions, const RankTile<uint8_t>& tile, base::Arena& scratch);
void RunMedian(const RankFunctions& functions, const RankTile<uint16_t>& tile, base::Arena& scratch);
// The same for large windows, at a cost that grows with their height alone.
template <class T>
void RunSlidingMedian(const RankFunctions& functions, const RankTile<T>& tile, base::Arena& scratch);
// The same of bytes, at a cost that does not grow with the window.
void RunHistogramMedian(const RankFunctions& functions, const RankTile<uint8_t>& tile, base::Arena& scratch);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_RANK_RANK_H_
