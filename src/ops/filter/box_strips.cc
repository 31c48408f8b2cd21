// Sums over a sliding window as the end of one block plus the begin of the next (van Herk 1992, Gil and
// Werman 1993, with sums for maxima), in double: three additions per sample and axis for any window, and
// nothing is ever subtracted, so that a NaN, an infinity or a large value leaves with the window and
// constants stay.
#include "ops/filter/box_strips.h"

#include <algorithm>
#include <array>
#include <type_traits>
#include <vector>

#include "base/arena.h"
#include "ops/filter/extend.h"
#include "simd/pixels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/box_strips.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/codes-inl.h"

#ifndef TESSERA_OPS_FILTER_BOX_STRIPS_CC_
#define TESSERA_OPS_FILTER_BOX_STRIPS_CC_

namespace tessera::ops {

constexpr int kBoxRows = 4;  // rows that go through together: the sums so far stay in registers

// A strip's columns for the results of whole blocks of rows, and where its sums are.
struct BoxStrip {
  ConstImageView in;
  ImageView out;
  int width = 1, height = 1;  // of the box
  const AxisBorder* x = nullptr;
  const AxisBorder* y = nullptr;
  int first = 0, count = 0;        // columns of the image, from 0
  int row_begin = 0, row_end = 0;  // rows of the image, from 0; row_begin is a multiple of `height`
  // One factor for all results, or (where not null) one per column and row.
  double factor = 1;
  const double* column_factors = nullptr;
  const double* row_factors = nullptr;
  float largest = 0;
  bool stream = false;

  int pixels() const { return count + width - 1; }
  ptrdiff_t stride() const { return (ptrdiff_t{pixels()} * in.channels + 15) / 16 * 16; }
};

// Doubles that a strip needs: ends of sums of a block's rows, sums so far, columns' sums, ends of sums along
// rows.
inline size_t BoxScratchDoubles(const BoxStrip& s) {
  const auto stride = static_cast<size_t>(s.stride());
  return stride * (static_cast<size_t>(s.height) + 1 + kBoxRows) +
         static_cast<size_t>(s.width) * kBoxRows * 4 + 8;
}
// Floats: rows of a block where the strip reaches beyond the image, one row of what lies there, and
// results on their way around the cache.
inline size_t BoxScratchFloats(const BoxStrip& s) {
  return static_cast<size_t>(s.stride()) * (static_cast<size_t>(s.height) + 1 + kBoxRows);
}

}  // namespace tessera::ops

#endif  // TESSERA_OPS_FILTER_BOX_STRIPS_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Samples in double; those of integer images as the codes that they are.
template <bool kCodes>
HWY_INLINE VD Sample(const float* p, [[maybe_unused]] float largest) {
  const DF f;
  const auto v = hn::LoadU(f, p);
  if constexpr (kCodes) {
    return hn::PromoteTo(DD(), hn::Round(hn::Mul(v, hn::Set(f, largest))));
  } else {
    return hn::PromoteTo(DD(), v);
  }
}

using SourceRows = std::array<const float*, kBoxRows>;

// ends[r] = the sum of rows r to the block's last one, for kR rows; `more`: ends[kR] is there.
template <int kR, bool kCodes>
void SumEnds(const SourceRows& rows, float largest, bool more, double* HWY_RESTRICT ends, ptrdiff_t stride) {
  const DD d;
  const float* from[kR];
  for (int r = 0; r < kR; ++r) from[r] = rows[static_cast<size_t>(r)];
  for (ptrdiff_t x = 0; x < stride; x += kDoubles) {
    VD sum = more ? hn::Load(d, ends + kR * stride + x) : hn::Zero(d);
    HWY_UNROLL(4)
    for (int r = kR - 1; r >= 0; --r) {
      sum = hn::Add(sum, Sample<kCodes>(from[r] + x, largest));
      hn::Store(sum, d, ends + r * stride + x);
    }
  }
}

// columns[r] = ends[r] + begin, then begin += row r of the next block.
template <int kR, bool kCodes>
void SumColumns(const SourceRows& rows, float largest, const double* HWY_RESTRICT ends,
                double* HWY_RESTRICT begin, double* HWY_RESTRICT columns, ptrdiff_t stride) {
  const DD d;
  const float* from[kR];
  for (int r = 0; r < kR; ++r) from[r] = rows[static_cast<size_t>(r)];
  for (ptrdiff_t x = 0; x < stride; x += kDoubles) {
    VD sum = hn::Load(d, begin + x);
    HWY_UNROLL(4)
    for (int r = 0; r < kR; ++r) {
      hn::Store(hn::Add(hn::Load(d, ends + r * stride + x), sum), d, columns + r * stride + x);
      sum = hn::Add(sum, Sample<kCodes>(from[r] + x, largest));
    }
    hn::Store(sum, d, begin + x);
  }
}

// What becomes of a sum: the mean of floats, or anything.
enum class Means { kFloats, kAny };

// Results of kR rows and all channels that lie in one vector of D, from sums of columns.
template <class D, Means kMeans, int kR>
void SumRows(D d, const BoxStrip& s, const double* HWY_RESTRICT columns, double* HWY_RESTRICT ends,
             const std::array<float*, kBoxRows>& out, const std::array<double, kBoxRows>& row_factor) {
  const hn::Rebind<float, D> f;
  constexpr ptrdiff_t kStep = static_cast<ptrdiff_t>(hn::MaxLanes(D()));
  const ptrdiff_t stride = s.stride(), pixel = s.in.channels;
  const bool codes = s.largest != 0;
  const auto factor = hn::Set(d, s.factor), unit = hn::Set(d, codes ? 1.0 / double{s.largest} : 1.0);
  const int width = s.width, count = s.count;
  float* to[kR];
  for (int r = 0; r < kR; ++r) to[r] = out[static_cast<size_t>(r)];
  for (int x0 = 0; x0 < count; x0 += width) {
    hn::Vec<D> sum[kR];
    const double* p = columns + (x0 + width - 1) * pixel;
    double* end = ends + (width - 1) * kR * kStep;
    for (auto& v : sum) v = hn::Zero(d);
    for (int i = width; i > 0; --i, p -= pixel, end -= kR * kStep) {
      HWY_UNROLL(4)
      for (int r = 0; r < kR; ++r) {
        sum[r] = hn::Add(sum[r], hn::LoadU(d, p + r * stride));
        hn::Store(sum[r], d, end + r * kStep);
      }
    }
    for (auto& v : sum) v = hn::Zero(d);
    p = columns + (x0 + width) * pixel;
    end = ends;
    const int last = std::min(width, count - x0);
    ptrdiff_t at = x0 * pixel;
    for (int i = 0; i < last; ++i, p += pixel, end += kR * kStep, at += pixel) {
      HWY_UNROLL(4)
      for (int r = 0; r < kR; ++r) {
        const auto whole = hn::Add(hn::Load(d, end + r * kStep), sum[r]);
        sum[r] = hn::Add(sum[r], hn::LoadU(d, p + r * stride));
        if constexpr (kMeans == Means::kAny) {
          auto mean = s.column_factors == nullptr
                          ? hn::Mul(whole, factor)
                          : hn::Mul(whole, hn::Set(d, s.column_factors[s.first + x0 + i] *
                                                          row_factor[static_cast<size_t>(r)]));
          if (codes) mean = hn::Mul(Settled(d, mean), unit);
          hn::StoreU(ToFloats(d, mean), f, to[r] + at);
        } else {
          hn::StoreU(ToFloats(d, hn::Mul(whole, factor)), f, to[r] + at);
        }
      }
    }
  }
}

template <class D, Means kMeans>
void SumRowsOf(D d, const BoxStrip& s, int rows, const double* columns, double* ends,
               std::array<float*, kBoxRows> out, const std::array<double, kBoxRows>& row_factor) {
  for (int c = 0; c < s.in.channels; c += static_cast<int>(hn::Lanes(d))) {
    if (rows == kBoxRows) {
      SumRows<D, kMeans, kBoxRows>(d, s, columns + c, ends, out, row_factor);
    } else {
      SumRows<D, kMeans, 1>(d, s, columns + c, ends, out, row_factor);
    }
    for (auto& to : out) to += hn::Lanes(d);
  }
}

class BoxStripRun {
 public:
  BoxStripRun(const BoxStrip& s, double* doubles, float* floats)
      : s_(s), stride_(s.stride()), before_x_((s.width - 1) / 2), before_y_((s.height - 1) / 2) {
    ends_ = doubles;
    begin_ = ends_ + stride_ * s.height;
    columns_ = begin_ + stride_;
    row_ends_ = columns_ + stride_ * kBoxRows;
    padded_ = floats;
    beyond_ = floats + stride_ * s.height;
    results_ = beyond_ + stride_;
    std::fill_n(beyond_, stride_, s.y->value);
    const int left = s.first - before_x_;
    // Whole vectors are read: in the image's last columns they would reach beyond its memory.
    inside_ = left >= 0 && ptrdiff_t{left} * s.in.channels + stride_ <= ptrdiff_t{Width()} * s.in.channels;
  }

  template <bool kCodes>
  void Run() {
    const int height = s_.height;
    for (int t = s_.row_begin; t < s_.row_end; t += height) {
      // The block's ends, from its last rows on; the rows of the first block come in here.
      for (int i = height; i > 0;) {
        const int rows = i >= kBoxRows ? kBoxRows : 1;
        i -= rows;
        const SourceRows from = Rows(t + i, i, rows, /*fresh=*/t == s_.row_begin);
        double* const ends = ends_ + i * stride_;
        const bool more = i + rows < height;
        rows == kBoxRows ? SumEnds<kBoxRows, kCodes>(from, s_.largest, more, ends, stride_)
                         : SumEnds<1, kCodes>(from, s_.largest, more, ends, stride_);
      }
      std::fill_n(begin_, stride_, 0.0);
      const int last = std::min(height, s_.row_end - t);
      for (int i = 0; i < last;) {
        const int rows = last - i >= kBoxRows ? kBoxRows : 1;
        const SourceRows from = Rows(t + height + i, i, rows, /*fresh=*/true);
        const double* const ends = ends_ + i * stride_;
        rows == kBoxRows ? SumColumns<kBoxRows, kCodes>(from, s_.largest, ends, begin_, columns_, stride_)
                         : SumColumns<1, kCodes>(from, s_.largest, ends, begin_, columns_, stride_);
        Results(t + i, rows);
        i += rows;
      }
    }
  }

 private:
  int Width() const { return s_.in.roi.width(); }
  int Height() const { return s_.in.roi.height(); }

  // Row t of all that windows see: the image's row t - before_y_, or what lies there; place i of the block.
  const float* RowAt(int t, int i, bool fresh) {
    const int height = Height(), n = t - before_y_;
    int y = n;
    if (n < 0 || n >= height) {
      if (s_.y->rule == AxisBorder::kValue) return beyond_;
      y = s_.y->rule == AxisBorder::kEdge ? std::clamp(n, 0, height - 1) : s_.y->Map(n);
    }
    const auto* const line = reinterpret_cast<const float*>(s_.in.data + y * s_.in.row_stride);
    const int channels = s_.in.channels, left = s_.first - before_x_;
    if (inside_) return line + ptrdiff_t{left} * channels;
    float* const padded = padded_ + i * stride_;
    if (!fresh) return padded;
    float* to = padded;
    const auto outside = [&](int x) {
      const int at = s_.x->rule == AxisBorder::kEdge     ? std::clamp(x, 0, Width() - 1)
                     : s_.x->rule == AxisBorder::kMapped ? s_.x->Map(x)
                                                         : -1;
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

  SourceRows Rows(int t, int i, int count, bool fresh) {
    SourceRows rows{};
    for (int r = 0; r < count; ++r) rows[static_cast<size_t>(r)] = RowAt(t + r, i + r, fresh);
    return rows;
  }

  void Results(int y, int rows) {
    std::array<float*, kBoxRows> out{};
    std::array<double, kBoxRows> factors{};
    for (int r = 0; r < rows; ++r) {
      out[static_cast<size_t>(r)] = s_.stream ? results_ + r * stride_ : ResultRow(y + r);
      if (s_.row_factors != nullptr) factors[static_cast<size_t>(r)] = s_.row_factors[y + r];
    }
    // Four channels lie in one vector, or as many as there are lanes.
    const hn::CappedTag<double, 4> d4;
    const hn::CappedTag<double, 1> d1;
    const bool whole = s_.in.channels % static_cast<int>(hn::Lanes(d4)) == 0;
    const bool any = s_.row_factors != nullptr || s_.largest != 0;
    const auto run = [&](auto d, auto means) {
      SumRowsOf<decltype(d), decltype(means)::value>(d, s_, rows, columns_, row_ends_, out, factors);
    };
    using Any = std::integral_constant<Means, Means::kAny>;
    using Floats = std::integral_constant<Means, Means::kFloats>;
    if (whole) {
      any ? run(d4, Any()) : run(d4, Floats());
    } else {
      any ? run(d1, Any()) : run(d1, Floats());
    }
    if (!s_.stream) return;
    // Whole cache lines go around the cache; parts of lines would be slow.
    const hn::CappedTag<float, 16> f;
    const ptrdiff_t floats = ptrdiff_t{s_.count} * s_.in.channels;
    for (int r = 0; r < rows; ++r) {
      const float* const from = out[static_cast<size_t>(r)];
      float* const to = ResultRow(y + r);
      ptrdiff_t i = 0;
      for (; i + 16 <= floats; i += static_cast<ptrdiff_t>(hn::Lanes(f))) {
        hn::Stream(hn::Load(f, from + i), f, to + i);
      }
      std::copy(from + i, from + floats, to + i);
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
  double *ends_, *begin_, *columns_, *row_ends_;
  float *padded_, *beyond_, *results_;
};

void RunBoxStrip(const BoxStrip& s, double* doubles, float* floats) {
  BoxStripRun run(s, doubles, floats);
  s.largest != 0 ? run.Run<true>() : run.Run<false>();
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(RunBoxStrip);

// Ends of a block's sums that stay in L2 beside its rows, in samples of a row.
constexpr int kEndsInL2 = 48 << 10;
constexpr int kWidestStrip = 1024;
// Results beyond this go around the cache.
constexpr int64_t kStreamBytes = int64_t{8} << 20;

// Columns of a strip: a multiple of 16, several times the halo where that fits.
int StripWidth(int width, int height, int channels) {
  const int fits = kEndsInL2 / (height * channels) - width;
  return std::clamp(fits, std::max(64, 2 * width), kWidestStrip) / 16 * 16;
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

void RunBoxStrips(int width, int height, const ConstImageView& in, const ImageView& out, BorderMode border,
                  double border_value, int largest, const graph::Workers& workers) {
  const int columns = in.roi.width(), rows = in.roi.height();
  const AxisBorder x(border, border_value, columns), y(border, border_value, rows);
  BoxStrip all{.in = in, .out = out, .width = width, .height = height, .x = &x, .y = &y};
  all.factor = 1.0 / (double{1} * width * height);
  all.largest = static_cast<float>(largest);
  all.stream = out.roi.pixels() * out.pixel_stride > kStreamBytes &&
               reinterpret_cast<uintptr_t>(out.data) % 64 == 0 && out.row_stride % 64 == 0;
  std::vector<double> column_factors, row_factors;
  if (border == BorderMode::kRenormalize) {
    column_factors = InverseCounts(columns, width), row_factors = InverseCounts(rows, height);
    all.column_factors = column_factors.data(), all.row_factors = row_factors.data();
  }
  // Bands cost the sums of one more block each: they are several blocks high.
  constexpr int kBlocksPerBand = 8, kLeastBand = 512;
  const int strip = StripWidth(width, height, in.channels);
  const int band = std::max(kBlocksPerBand * height, (kLeastBand + height - 1) / height * height);
  const int64_t across = (columns + strip - 1) / strip, down = (rows + band - 1) / band;
  std::vector<base::Arena> arenas(static_cast<size_t>(workers.count()));
  auto* const run = &HWY_DYNAMIC_DISPATCH(RunBoxStrip);
  workers.For(across * down, [&](int64_t i, int worker) {
    BoxStrip s = all;
    s.first = static_cast<int>(i % across) * strip;
    s.count = std::min(strip, columns - s.first);
    s.row_begin = static_cast<int>(i / across) * band;
    s.row_end = std::min(rows, s.row_begin + band);
    base::Arena& arena = arenas[static_cast<size_t>(worker)];
    arena.Reset();
    double* const doubles = arena.Allocate<double>(BoxScratchDoubles(s));
    run(s, doubles, arena.Allocate<float>(BoxScratchFloats(s)));
    if (s.stream) simd::FlushStreams();
  });
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
