// Means over a sliding window. Where samples may be rounded to a grid on which all sums are exact, sums run:
// a row or a column enters, another one leaves. Where that would be seen, or a sample is not finite, a sum is
// the end of one block plus the begin of the next (van Herk 1992, Gil and Werman 1993, with sums for maxima),
// in double: three additions per sample and axis for any window, and nothing is ever subtracted, so that a
// NaN, an infinity or a large value leaves with the window and constants stay.
#include "ops/filter/box/strips.h"

#include <algorithm>
#include <array>
#include <vector>

#include "base/arena.h"
#include "base/worker_arenas.h"
#include "ops/filter/lines/extend.h"
#include "simd/pixels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/box/strips.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/box/grid-inl.h"
#include "ops/filter/box/pixels-inl.h"
#include "ops/filter/box/sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

class BoxStripRun {
 public:
  BoxStripRun(const BoxStrip& s, double* doubles, float* floats)
      : s_(s), stride_(s.stride()), before_x_((s.width - 1) / 2), before_y_((s.height - 1) / 2) {
    ends_ = doubles;
    sums_ = ends_ + stride_ * s.height;
    means_.columns = columns_ = sums_ + stride_;
    means_.ends = columns_ + stride_ * kBoxRows;
    padded_ = floats;
    beyond_ = padded_ + stride_ * s.padded_rows();
    results_ = beyond_ + stride_;
    std::fill_n(beyond_, stride_, s.y->value);
    const int left = s.first - before_x_;
    // Whole vectors are read: in the image's last columns they would reach beyond its memory.
    inside_ = left >= 0 && ptrdiff_t{left} * s.in.channels + stride_ <= ptrdiff_t{Width()} * s.in.channels;
  }

  void Run() {
    for (int t = s_.row_begin; t < s_.row_end;) {
      const int end = s_.largest != 0 ? RunOnGrid<true>(t) : RunOnGrid<false>(t);
      if (end > t && least_ >= least_mean_) {
        t = end;
      } else {
        const int last = end > t ? end : std::min(s_.row_end, t + run_);
        RunBlocks(t, last);
        t = last;
      }
    }
  }

 private:
  // ---- On a grid ----

  // Returns the row that it comes to: `begin` where there is no grid. Results may be off by more than a last
  // place if least_ is below least_mean_.
  template <bool kCodes>
  int RunOnGrid(int begin) {
    const int height = s_.height, last = std::min(s_.row_end, begin + run_ / kBoxRows * kBoxRows);
    least_ = ~uint32_t{0};
    int t = begin;
    while (t < last) {
      const int rows = last - t >= kBoxRows ? kBoxRows : 1;
      const bool pixels =
          kMeansOfPixels && !kCodes && rows == kBoxRows && s_.in.channels == 4 && s_.row_factors == nullptr;
      const bool moves = moved_ == t && (pixels || Enter<kCodes>(t + height, rows));
      if (!moves && (t > begin || !StartSums<kCodes>(t, rows))) break;
      if (pixels) {
        moved_ = Pixels(t, /*fresh=*/moves) ? t + rows : -1;
        if (moved_ > t) t = moved_;
        continue;
      }
      SourceRows leave{}, enter{};
      for (int r = 0; r < rows; ++r) {
        leave[static_cast<size_t>(r)] = Kept(t + r);
        enter[static_cast<size_t>(r)] = Kept(t + height + r);
      }
      rows == kBoxRows
          ? MoveColumns<kBoxRows, kCodes>(leave, enter, s_.largest, grid_.offset, sums_, columns_, stride_)
          : MoveColumns<1, kCodes>(leave, enter, s_.largest, grid_.offset, sums_, columns_, stride_);
      Results</*kRunning=*/true>(t, rows);
      moved_ = t += rows;
    }
    return t;
  }

  // Moves on by kBoxRows rows at once; says if what enters suits the grid. If not, the sums are lost.
  bool Pixels(int t, bool fresh) {
    PixelRows rows{.offset = grid_.offset,
                   .factor = s_.factor,
                   .sums = sums_,
                   .ring = means_.ends,
                   .width = s_.width,
                   .count = s_.count,
                   .less = less_};
    for (int r = 0; r < kBoxRows; ++r) {
      const auto i = static_cast<size_t>(r);
      rows.leave[i] = Kept(t + r);
      rows.enter[i] = fresh ? Fresh(t + s_.height + r) : Kept(t + s_.height + r);
      rows.out[i] = ResultRow(t + r);
      const float* const next = SourceRow(t + s_.height + kBoxRows + r);
      rows.next[i] = next == nullptr ? beyond_ : next + ptrdiff_t{std::max(0, s_.first - before_x_)} * 4;
    }
    Magnitudes entered;
    const uint32_t least =
        s_.stream ? MeansOfPixels<true>(rows, entered) : MeansOfPixels<false>(rows, entered);
    if (!Suits(entered)) return false;
    least_ = std::min(least_, least);
    return true;
  }

  int Place(int t) const { return t % s_.padded_rows(); }
  const float* Fresh(int t) { return RowAt(t, Place(t), /*fresh=*/true); }
  const float* Kept(int t) { return RowAt(t, Place(t), /*fresh=*/false); }

  Magnitudes MeasureRows(int t, int rows) {
    Magnitudes all;
    for (int r = 0; r < rows; ++r) all.Add(Measure(Fresh(t + r), stride_, Ahead()));
    return all;
  }
  // The rows that enter next are fetched meanwhile: a piece of a row is too short for the hardware to notice.
  ptrdiff_t Ahead() const { return inside_ ? kBoxRows * s_.in.row_stride / ptrdiff_t{sizeof(float)} : 0; }
  // Whether `rows` rows from t on may enter sums that there are.
  template <bool kCodes>
  bool Enter(int t, int rows) {
    const Magnitudes m = MeasureRows(t, rows);
    return kCodes || Suits(m);
  }
  // Whether samples of these magnitudes may enter too.
  bool Suits(const Magnitudes& m) {
    const Grid needed(m, Samples());
    if (!needed.exists || needed.exponent > grid_.exponent) return false;
    Seen(m);
    return true;
  }
  // The sums of the window of row t, on a grid that suits its rows and those that enter next.
  template <bool kCodes>
  bool StartSums(int t, int rows) {
    const int height = s_.height;
    const Magnitudes m = MeasureRows(t, height + rows);
    if (!kCodes) {
      seen_ = {}, grid_ = Grid(m, 2 * Samples());  // twice: rows to come may be brighter
      if (!grid_.exists) return false;
      least_mean_ = grid_.LeastMean();
      Seen(m);
    }
    std::fill_n(sums_, stride_, 0.0);
    for (int i = 0; i < height; ++i) {
      AddRow<kCodes>(Kept(t + i), s_.largest, grid_.offset, sums_, stride_);
    }
    return true;
  }
  void Seen(const Magnitudes& m) {
    seen_.Add(m);
    less_ = grid_.ZerosAreZeros(seen_) ? 1 : 0;
  }
  int64_t Samples() const { return int64_t{s_.width} * s_.height; }

  // ---- By blocks ----

  void RunBlocks(int begin, int end) {
    const int height = s_.height;
    moved_ = -1;
    for (int t = begin; t < end; t += height) {
      // The block's ends, from its last rows on; the rows of the first block come in here.
      for (int i = height; i > 0;) {
        const int rows = i >= kBoxRows ? kBoxRows : 1;
        i -= rows;
        const SourceRows from = Rows(t + i, i, rows, /*fresh=*/t == begin);
        double* const ends = ends_ + i * stride_;
        const bool more = i + rows < height;
        rows == kBoxRows ? SumEnds<kBoxRows>(from, more, ends, stride_)
                         : SumEnds<1>(from, more, ends, stride_);
      }
      std::fill_n(sums_, stride_, 0.0);
      const int last = std::min(height, end - t);
      for (int i = 0; i < last;) {
        const int rows = last - i >= kBoxRows ? kBoxRows : 1;
        const SourceRows from = Rows(t + height + i, i, rows, /*fresh=*/true);
        const double* const ends = ends_ + i * stride_;
        rows == kBoxRows ? SumColumns<kBoxRows>(from, ends, sums_, columns_, stride_)
                         : SumColumns<1>(from, ends, sums_, columns_, stride_);
        Results</*kRunning=*/false>(t + i, rows);
        i += rows;
      }
    }
  }

  SourceRows Rows(int t, int i, int count, bool fresh) {
    SourceRows rows{};
    for (int r = 0; r < count; ++r) rows[static_cast<size_t>(r)] = RowAt(t + r, i + r, fresh);
    return rows;
  }

  // ---- Rows in and out ----

  int Width() const { return s_.in.roi.width(); }

  // Row t of all that windows see: the image's row t - before_y_, or the one shown there; null for the value.
  const float* SourceRow(int t) const {
    const int y = s_.y->Shown(t - before_y_);
    if (y < 0) return nullptr;
    return reinterpret_cast<const float*>(s_.in.data + y * s_.in.row_stride);
  }
  // The strip's part of it, with what lies beside the image; `i`: its place among the padded rows.
  const float* RowAt(int t, int i, bool fresh) {
    const float* const line = SourceRow(t);
    if (line == nullptr) return beyond_;
    const int channels = s_.in.channels, left = s_.first - before_x_;
    if (inside_) return line + ptrdiff_t{left} * channels;
    float* const padded = padded_ + i * stride_;
    if (!fresh) return padded;
    float* to = padded;
    const auto outside = [&](int x) {
      const int at = s_.x->Shown(x);
      for (int c = 0; c < channels; ++c) *to++ = at < 0 ? s_.x->value : line[ptrdiff_t{at} * channels + c];
    };
    const int end = left + s_.pixels(), inner = std::clamp(left, 0, Width()),
              outer = std::clamp(end, 0, Width());
    for (int x = left; x < std::min(0, end); ++x) outside(x);
    to = std::copy(line + ptrdiff_t{inner} * channels, line + ptrdiff_t{outer} * channels, to);
    for (int x = std::max(Width(), left); x < end; ++x) outside(x);
    std::fill(to, padded + stride_, 0.0f);
    return padded;
  }

  template <bool kRunning>
  void Results(int y, int rows) {
    for (int r = 0; r < rows; ++r) {
      const auto i = static_cast<size_t>(r);
      means_.out[i] = results_ + r * stride_;
      if (s_.row_factors != nullptr) means_.factors[i] = s_.row_factors[y + r];
    }
    MeansOf<kRunning>(s_, means_, rows);
    if (kRunning && KeepsSums(s_)) {
      const auto area = hn::Set(DB(), static_cast<float>(s_.width * s_.height));
      for (ptrdiff_t i = 0; i < rows * stride_; i += kByteLanes) {
        hn::Store(SettledSample(hn::Load(DB(), results_ + i), area), DB(), results_ + i);
      }
    }
    for (int r = 0; r < rows; ++r) Put(results_ + r * stride_, ResultRow(y + r));
  }

  // Whole cache lines go around the cache; parts of lines would be slow. The least result in magnitude is
  // kept.
  void Put(const float* HWY_RESTRICT from, float* HWY_RESTRICT to) {
    const hn::CappedTag<float, 16> f;
    const hn::RebindToUnsigned<decltype(f)> u;
    const auto magnitude = hn::Set(u, 0x7fffffffu), less = hn::Set(u, less_);
    auto least = hn::Set(u, ~uint32_t{0});
    const ptrdiff_t floats = ptrdiff_t{s_.count} * s_.in.channels;
    ptrdiff_t i = 0;
    for (; i + 16 <= floats; i += static_cast<ptrdiff_t>(hn::Lanes(f))) {
      const auto v = hn::Load(f, from + i);
      least = hn::Min(least, hn::Sub(hn::And(hn::BitCast(u, v), magnitude), less));
      s_.stream ? hn::Stream(v, f, to + i) : hn::StoreU(v, f, to + i);
    }
    least_ = std::min(least_, hn::GetLane(hn::MinOfLanes(u, least)));
    for (; i < floats; ++i) {
      least_ = std::min(least_, (std::bit_cast<uint32_t>(from[i]) & 0x7fffffffu) - less_);
      to[i] = from[i];
    }
  }

  float* ResultRow(int y) const {
    return reinterpret_cast<float*>(s_.out.data + y * s_.out.row_stride) +
           ptrdiff_t{s_.first} * s_.in.channels;
  }

  const BoxStrip& s_;
  const ptrdiff_t stride_;
  const int before_x_, before_y_;
  bool inside_ = false;
  double *ends_, *sums_, *columns_;
  float *padded_, *beyond_, *results_;
  MeanRows means_;
  // Rows that are done again together: whole blocks.
  static constexpr int kLeastRun = 32;
  const int run_ = (kLeastRun + s_.height - 1) / s_.height * s_.height;
  // On a grid: the row that sums_ have come to, or -1, and what came in since they were started.
  int moved_ = -1;
  Grid grid_;
  Magnitudes seen_;
  // The least result in magnitude and the least that is right, as bits of floats; less_ is 1 where results of
  // 0 are right: less 1, they are the largest.
  uint32_t least_ = 0, least_mean_ = 0, less_ = 1;
};

void RunBoxStrip(const BoxStrip& s, double* doubles, float* floats) { BoxStripRun(s, doubles, floats).Run(); }
BoxStripFunction BoxStripOfTarget() { return RunBoxStrip; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(BoxStripOfTarget);

// What a strip goes over again and again: its window's rows, their sums and those of kBoxRows rows, in bytes.
// A little more than a second cache pays for itself: longer rows suit the prefetcher, and halos are a smaller
// part.
constexpr int kStripBytes = 640 << 10;
constexpr int kWidestStrip = 1024;
// Results beyond this go around the cache.
constexpr int64_t kStreamBytes = int64_t{8} << 20;

// Columns of a strip: a multiple of 16, several times the halo where that fits.
int StripWidth(int width, int height, int channels) {
  const int column = channels * ((height + kBoxRows) * 4 + (kBoxRows + 1) * 8);
  return std::clamp(kStripBytes / column - width, std::max(64, 2 * width), kWidestStrip) / 16 * 16;
}

// The size, a multiple of `step`, of parts of about the given size and alike: a small rest costs what a whole
// part does to begin.
int Even(int length, int size, int step) {
  const int parts = std::max(1, (length + size / 2) / size);
  return ((length + parts - 1) / parts + step - 1) / step * step;
}

// Where strips begin, and their end. Rows that reach beyond the image's sides are copied: where the box is
// narrow beside the strips, such strips are no wider than they must be.
std::vector<int> Strips(int columns, int width, int height, int channels) {
  const int most = StripWidth(width, height, channels), edge = (width / 2 + 1 + 15 / channels + 15) / 16 * 16;
  const bool edges = columns > most && most >= 8 * width;
  std::vector<int> strips;
  if (edges) strips.push_back(0);
  const int begin = edges ? edge : 0, end = edges ? (columns - edge) / 16 * 16 : columns;
  const int step = Even(end - begin, most, 16);
  for (int x = begin; x < end; x += step) strips.push_back(x);
  if (edges) strips.push_back(end);
  strips.push_back(columns);
  return strips;
}

// One over the number of pixels of every window that lie inside.
std::vector<double> InverseCounts(int length, int size) {
  std::vector<double> inverse;
  for (int n = 0; n < length; ++n) {
    const int first = n - (size - 1) / 2;
    inverse.push_back(1.0 / (std::min(length, first + size) - std::max(0, first)));
  }
  return inverse;
}

}  // namespace

BoxStripFunction ChooseBoxStrip() { return HWY_DYNAMIC_DISPATCH(BoxStripOfTarget)(); }

void RunBoxStrips(BoxStripFunction run, int width, int height, const ConstImageView& in, const ImageView& out,
                  Wrap wrap, double border_value, int largest, const graph::Workers& workers) {
  const int columns = in.roi.width(), rows = in.roi.height();
  const AxisBorder x(wrap, border_value, columns), y(wrap, border_value, rows);
  BoxStrip all{.in = in, .out = out, .width = width, .height = height, .x = &x, .y = &y};
  all.factor = 1.0 / (double{1} * width * height);
  all.largest = static_cast<float>(largest);
  all.stream = out.roi.pixels() * out.pixel_stride > kStreamBytes &&
               reinterpret_cast<uintptr_t>(out.data) % 64 == 0 && out.row_stride % 64 == 0;
  std::vector<double> column_factors, row_factors;
  if (wrap == Wrap::kRenormalize) {
    column_factors = InverseCounts(columns, width), row_factors = InverseCounts(rows, height);
    all.column_factors = column_factors.data(), all.row_factors = row_factors.data();
  }
  // Bands cost the sums of one more block each: they are several blocks high.
  constexpr int kBlocksPerBand = 8, kLeastBand = 512;
  const std::vector<int> strips = Strips(columns, width, height, in.channels);
  const int band = Even(rows, std::max(kBlocksPerBand * height, kLeastBand), height);
  const int64_t across = std::ssize(strips) - 1, down = (rows + band - 1) / band;
  base::WorkerArenas arenas(workers);
  workers.For(across * down, [&](int64_t i, int worker) {
    BoxStrip s = all;
    const auto strip = static_cast<size_t>(i % across);
    s.first = strips[strip];
    s.count = strips[strip + 1] - s.first;
    s.row_begin = static_cast<int>(i / across) * band;
    s.row_end = std::min(rows, s.row_begin + band);
    base::Arena& arena = arenas[worker];
    arena.Reset();
    double* const doubles = arena.Allocate<double>(s.scratch_doubles());
    run(s, doubles, arena.Allocate<float>(s.scratch_floats()));
    if (s.stream) simd::FlushStreams();
  });
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
