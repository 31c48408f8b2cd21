// Look-ups in two passes over short runs of pixels: first positions, in double, to indices and fractions;
// then pixels.
#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

#include "ops/geometry/gather.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/geometry/gather_kernel.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/geometry/positions-inl.h"
#include "ops/geometry/reduce-inl.h"
#include "simd/floats-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using F4 = s::Floats<4>;
using F8 = s::Floats<8>;

// An index beyond the image by its wrap mode; -1 for black.
int Wrapped(int64_t i, int size, Wrap wrap) {
  if (i >= 0 && i < size) return static_cast<int>(i);
  switch (wrap) {
    case Wrap::kClamp:
      return i < 0 ? 0 : size - 1;
    case Wrap::kRepeat:
      return static_cast<int>((i % size + size) % size);
    case Wrap::kMirror: {
      const int64_t m = (i % (2 * int64_t{size}) + 2 * int64_t{size}) % (2 * int64_t{size});
      return static_cast<int>(m < size ? m : 2 * int64_t{size} - 1 - m);
    }
    default:
      return -1;
  }
}

// The pixels with weight along one axis, for what the short paths leave: edges, whole positions, reductions
// by much.
struct AxisWeights {
  std::vector<int> index;
  std::vector<float> weight;

  // `position` in indices of the image; `reduced`: the filter is widened along one axis at least.
  void Find(const GatherSource& source, double position, double wide, bool reduced, int size, Wrap wrap) {
    index.clear(), weight.clear(), exact_.clear();
    wide = std::min(wide, GatherSource::kWidest / source.filter->width);
    const double radius = source.filter->width / 2 * wide;
    const double from = std::ceil(position - radius), to = std::floor(position + radius);
    if (!(std::fabs(position) < 0x1p28) || size == 0) return;
    const bool beyond = to < 0 || from > size - 1;
    if (beyond && wrap == Wrap::kBlack) return;
    // Nearest, where a position half-way between two pixels takes the right one; or nothing but the edge's
    // pixel.
    if ((source.taps == 1 && wide == 1) || (beyond && wrap == Wrap::kClamp)) {
      const int at = Wrapped(static_cast<int64_t>(std::floor(position + 0.5)), size, wrap);
      if (at >= 0) index.push_back(at), weight.push_back(1);
      return;
    }
    const hn::CappedTag<double, 1> d;
    const WidenedFilter<hn::CappedTag<double, 1>> filter(d, source, hn::Set(d, wide));
    const auto all = hn::Eq(hn::Zero(d), hn::Zero(d));
    double sum = 0;
    const bool fold = to - from >= size;  // pixels are seen more than once: their weights are added
    if (fold) exact_.assign(static_cast<size_t>(size), 0);
    for (double j = from; j <= to; ++j) {
      const double w = reduced ? hn::GetLane(filter.Value(d, hn::Set(d, j - position), all))
                               : source.filter->value(j - position);
      const int at = Wrapped(static_cast<int64_t>(j), size, wrap);
      if (at >= 0 || !source.renormalize) sum += w;
      if (w == 0 || at < 0) continue;
      if (fold) {
        exact_[static_cast<size_t>(at)] += w;
      } else {
        index.push_back(at), exact_.push_back(w);
      }
    }
    if (sum == 0) {
      index.clear();
      return;
    }
    if (fold) {
      for (int at = 0; at < size; ++at) {
        if (exact_[static_cast<size_t>(at)] != 0) index.push_back(at);
      }
    }
    const double scale = 1 / sum;
    for (const double w : exact_) {
      if (w != 0) weight.push_back(static_cast<float>(w * scale));
    }
  }

 private:
  std::vector<double> exact_;
};

// Sum over the pixels of both axes, in parts so that very wide filters keep their accuracy.
F4 WeightedPixels(const AxisWeights& x, const AxisWeights& y, const ConstImageView& group) {
  constexpr size_t kPart = 32;
  const auto* const pixels = reinterpret_cast<const float*>(group.data);
  const ptrdiff_t stride = group.row_stride / 4;
  const bool single_x = x.index.size() == 1 && x.weight[0] == 1,
             single_y = y.index.size() == 1 && y.weight[0] == 1;
  F4 total = F4::Zero();
  for (size_t j0 = 0; j0 < y.index.size(); j0 += kPart) {
    F4 part = F4::Zero();
    for (size_t j = j0; j < std::min(y.index.size(), j0 + kPart); ++j) {
      const float* const row = pixels + stride * y.index[j];
      F4 line = F4::Zero();
      for (size_t i0 = 0; i0 < x.index.size(); i0 += kPart) {
        F4 piece = F4::Scaled(row + ptrdiff_t{4} * x.index[i0], x.weight[i0]);
        for (size_t i = i0 + 1; i < std::min(x.index.size(), i0 + kPart); ++i) {
          piece.AddScaled(row + ptrdiff_t{4} * x.index[i], x.weight[i]);
        }
        line = i0 == 0 ? piece : line + piece;
      }
      if (single_x && single_y) return line;  // the pixel's own bits, -0 too
      if (j == j0) {
        part = line * y.weight[j];
      } else {
        part.AddScaled(line, y.weight[j]);
      }
    }
    total = j0 == 0 ? part : total + part;
  }
  return total;
}

// Weights at a fraction, from the table.
HWY_INLINE void TableWeights(const GatherSource& source, float fraction, float* w) {
  const float at = fraction * GatherSource::kPhases;
  const int i = static_cast<int>(at);
  const float f = at - static_cast<float>(i);
  const float* const row = &source.phase_weights[static_cast<size_t>(i) * source.taps];
  for (int k = 0; k < source.taps; ++k) w[k] = row[k] + f * (row[k + source.taps] - row[k]);
}

// (1 - f) * first pixel + f * second pixel.
template <class Pair>
HWY_INLINE F4 Blend(const Pair& pair, float f) {
#if HWY_TARGET != HWY_SCALAR
  if constexpr (Pair::kVectors == 1) {
    const F4::Tag half;
    F4 r;
    r.v[0] = hn::MulAdd(hn::UpperHalf(half, pair.v[0]), hn::Set(half, f),
                        hn::Mul(hn::LowerHalf(half, pair.v[0]), hn::Set(half, 1 - f)));
    return r;
  } else
#endif
  {
    F4 r;
    for (int i = 0; i < F4::kVectors; ++i) {
      const F4::Tag d;
      r.v[i] = hn::MulAdd(pair.v[i + F4::kVectors], hn::Set(d, f), hn::Mul(pair.v[i], hn::Set(d, 1 - f)));
    }
    return r;
  }
}

// Two by two pixels: along y, then along x.
HWY_INLINE F4 Bilinear(const float* p, ptrdiff_t stride, float fx, float fy) {
  F8 rows = F8::Scaled(p, 1 - fy);
  rows.AddScaled(p + stride, fy);
  return Blend(rows, fx);
}

#undef TESSERA_GATHER_FOUR
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
#define TESSERA_GATHER_FOUR 1
// Bilinear of four pixels in one vector, the same sums. The loads of two neighbours fill half a vector.
using F16 = s::Floats<16>;
HWY_INLINE F16 Bilinear4(const float* const (&p)[4], ptrdiff_t stride, const float* fx, const float* fy) {
  const F16::Tag d;
  const hn::Half<F16::Tag> half;
  const auto each = [&](const float* f, const int32_t(&lanes)[16]) HWY_ATTR {
    return hn::TableLookupLanes(hn::LoadDup128(d, f), hn::SetTableIndices(d, lanes));
  };
  static constexpr int32_t kFirst[16] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
  static constexpr int32_t kSecond[16] = {2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3};
  static constexpr int32_t kAll[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  static constexpr int32_t kLeft[16] = {0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27};
  static constexpr int32_t kRight[16] = {4, 5, 6, 7, 12, 13, 14, 15, 20, 21, 22, 23, 28, 29, 30, 31};
  const auto one = hn::Set(d, 1.0f);
  const auto rows = [&](int i, F16::Vector f) HWY_ATTR {
    const auto top = hn::Combine(d, hn::LoadU(half, p[i + 1]), hn::LoadU(half, p[i]));
    const auto bottom = hn::Combine(d, hn::LoadU(half, p[i + 1] + stride), hn::LoadU(half, p[i] + stride));
    return hn::MulAdd(bottom, f, hn::Mul(top, hn::Sub(one, f)));
  };
  const auto a = rows(0, each(fy, kFirst)), b = rows(2, each(fy, kSecond));
  const auto pixels = [&](const int32_t(&lanes)[16]) HWY_ATTR {
    return F16::Vector{_mm512_permutex2var_ps(a.raw, _mm512_loadu_si512(lanes), b.raw)};
  };
  const auto f = each(fx, kAll);
  F16 r;
  r.v[0] = hn::MulAdd(pixels(kRight), f, hn::Mul(pixels(kLeft), hn::Sub(one, f)));
  return r;
}
#else
#define TESSERA_GATHER_FOUR 0
#endif

template <int kTaps>
HWY_INLINE F4 Filtered(const GatherSource& source, const float* p, ptrdiff_t stride, float fx, float fy) {
  float wx[kTaps], wy[kTaps];
  TableWeights(source, fx, wx);
  TableWeights(source, fy, wy);
  F4 sum;
  for (int j = 0; j < kTaps; ++j, p += stride) {
    F4 line = F4::Scaled(p, wx[0]);
    for (int i = 1; i < kTaps; ++i) line.AddScaled(p + 4 * i, wx[i]);
    if (j == 0) {
      sum = line * wy[0];
    } else {
      sum.AddScaled(line, wy[j]);
    }
  }
  return sum;
}

class Gatherer {
 public:
  explicit Gatherer(const GatherJob& job) : job_(job), source_(job.source) {
    linear_ = source_.taps == 2 && source_.filter->value(0.25) == 0.75;
    direct_ = job.channels.size() == 4 && job.channels[0] == 0 && job.channels[1] == 1 &&
              job.channels[2] == 2 && job.channels[3] == 3;
  }

  void Run() {
    const Roi& roi = job_.out.roi;
    if (source_.groups.empty() || source_.window.empty()) return Clear();
    const bool even = source_.taps % 2 == 0 && source_.pixels_per_row() > 0;
    above_.assign(static_cast<size_t>(roi.width() / kRun + 1), 0);
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; x += kRun) {
        const int count = std::min(kRun, roi.x1 - x);
        if (!Plain(even, x, y, count)) {
          LookUpAny(x, y, count);
          continue;
        }
        const ptrdiff_t ahead = Ahead(x, index_.offset[0]);
        ForTaps([&](auto taps, auto linear, size_t g) { LookUpPlain<taps, linear>(g, x, y, count, ahead); });
      }
    }
  }

 private:
  template <int kTaps>
  using Taps = std::integral_constant<int, kTaps>;

  // Whether no pixel of a run needs a second look: then the taps are known, else the positions.
  bool Plain(bool even, int x, int y, int count) {
    if (job_.map.from_image) {
      const Coordinates from(job_, x, y, count);
      if (even && PlainImageTaps(job_, from, x, y, count, index_)) return true;
      ImagePositions(job_, from, x, y, count, at_);
      return false;
    }
    if (!job_.map.projective && even && PlainMatrixTaps(job_, x, y, count, index_)) return true;
    MatrixPositions(job_.map, source_.window, x, y, count, at_);
    return job_.map.projective && even && PlainTaps(source_, at_, count, index_);
  }

  void Clear() {
    const Roi& roi = job_.out.roi;
    for (int y = roi.y0; y < roi.y1; ++y) ClearRun(roi.x0, y, roi.width());
  }
  void ClearRun(int x, int y, int count) {
    std::fill_n(reinterpret_cast<float*>(job_.out.At(x, y)),
                static_cast<size_t>(count) * static_cast<size_t>(job_.out.channels), 0.0f);
  }

  // look_up(taps, linear, group) for every group of channels.
  template <class F>
  HWY_INLINE void ForTaps(const F& look_up) {
    using std::bool_constant;
    for (size_t g = 0; g < source_.groups.size(); ++g) {
      if (linear_) {
        look_up(Taps<2>(), bool_constant<true>(), g);
      } else if (source_.taps == 4) {
        look_up(Taps<4>(), bool_constant<false>(), g);
      } else if (source_.taps == 6) {
        look_up(Taps<6>(), bool_constant<false>(), g);
      } else if (source_.taps == 3) {
        look_up(Taps<3>(), bool_constant<false>(), g);
      } else if (source_.taps == 2) {
        look_up(Taps<2>(), bool_constant<false>(), g);
      } else {
        look_up(Taps<1>(), bool_constant<false>(), g);
      }
    }
  }

  template <int kTaps, bool kLinear>
  HWY_INLINE F4 Look(const float* p, ptrdiff_t stride, float fx, float fy) const {
    if constexpr (kTaps == 1) {
      return F4::Load(p);
    } else if constexpr (kLinear) {
      return Bilinear(p, stride, fx, fy);
    } else {
      return Filtered<kTaps>(source_, p, stride, fx, fy);
    }
  }

  HWY_INLINE void Write(F4 value, size_t g, float* out, bool stream) const {
    value = value.OneNaN();
    if (stream) {
      value.Stream(out);
    } else if (direct_) {
      value.Store(out);
    } else {
      Scatter(value, g, out);
    }
  }

  // How many floats behind a pixel of this run those lie that the rows below will look at, going by where the
  // row above has looked. They are fetched: the processor does not foresee short pieces of many rows.
  ptrdiff_t Ahead(int x, int64_t first) {
    int64_t& above = above_[static_cast<size_t>((x - job_.out.roi.x0) / kRun)];
    const int64_t step = first - above;
    above = first;
    constexpr int64_t kFarthestStep = int64_t{1} << 24;
    return step > -kFarthestStep && step < kFarthestStep ? 4 * kRowsAhead * step : 0;
  }

  void LookUpAny(int x, int y, int count) {
    const Roi& w = source_.window;
    FindTaps(w.width(), source_.wrap_x, source_.taps, count, at_.x, index_.x, index_.fx);
    FindTaps(w.height(), source_.wrap_y, source_.taps, count, at_.y, index_.y, index_.fy);
    if (Beyond(count)) return ClearRun(x, y, count);
    const ptrdiff_t ahead = Ahead(x, int64_t{index_.y[0]} * source_.pixels_per_row() + index_.x[0]);
    ForTaps([&](auto taps, auto linear, size_t g) { LookUp<taps, linear>(g, x, y, count, ahead); });
  }

  // No pixel of the run needs a second look.
  template <int kTaps, bool kLinear>
  void LookUpPlain(size_t g, int x, int y, int count, ptrdiff_t ahead) {
    const ConstImageView& group = source_.groups[g];
    const auto* const pixels = reinterpret_cast<const float*>(group.data);
    const ptrdiff_t stride = group.row_stride / 4;
    auto* const out = reinterpret_cast<float*>(job_.out.At(x, y));
    const auto at = [&](int i) { return pixels + ptrdiff_t{4} * index_.offset[i]; };
    int i = 0;
#if TESSERA_GATHER_FOUR
    if (kLinear && direct_) {
      const bool lines = job_.stream && reinterpret_cast<uintptr_t>(out) % 64 == 0;
      for (; i + 4 <= count; i += 4) {
        const float* const p[4] = {at(i), at(i + 1), at(i + 2), at(i + 3)};
        hwy::Prefetch(p[0] + ahead);
        const F16 value = Bilinear4(p, stride, index_.fx + i, index_.fy + i).OneNaN();
        lines ? value.Stream(out + 4 * i) : value.Store(out + 4 * i);
      }
    }
#endif
    const bool stream = direct_ && job_.stream && reinterpret_cast<uintptr_t>(out) % 16 == 0;
    for (; i < count; ++i) {
      if (i % 4 == 0) hwy::Prefetch(at(i) + ahead);
      Write(Look<kTaps, kLinear>(at(i), stride, index_.fx[i], index_.fy[i]), g,
            out + ptrdiff_t{job_.out.channels} * i, stream);
    }
  }

  template <int kTaps, bool kLinear>
  void LookUp(size_t g, int x, int y, int count, ptrdiff_t ahead) {
    const ConstImageView& group = source_.groups[g];
    const auto* const pixels = reinterpret_cast<const float*>(group.data);
    const ptrdiff_t stride = group.row_stride / 4;
    const int last_x = source_.window.width() - kTaps, last_y = source_.window.height() - kTaps;
    auto* const out = reinterpret_cast<float*>(job_.out.At(x, y));
    const bool stream = direct_ && job_.stream && reinterpret_cast<uintptr_t>(out) % 16 == 0;
    const auto write = [&](int i, const F4& value)
                           HWY_ATTR { Write(value, g, out + ptrdiff_t{job_.out.channels} * i, stream); };
    for (int i = 0; i < count; ++i) {
      if (at_.widened && i % ReducedAxis::kPixels == 0) {
        alignas(64) float values[4 * ReducedAxis::kPixels];
        const int reduced = std::min(ReducedAxis::kPixels, count - i);
        if (LookUpReduced(group, i, reduced, values)) {
          for (int k = 0; k < reduced; ++k) write(i + k, F4::Load(values + ptrdiff_t{4} * k));
          i += reduced - 1;
          continue;
        }
      }
      const int ix = index_.x[i], iy = index_.y[i];
      const float fx = index_.fx[i], fy = index_.fy[i];
      // Inside, between pixels, not reduced: no pixel needs a second look.
      const bool plain = (ix >= 0) & (ix <= last_x) & (iy >= 0) & (iy <= last_y) &
                         ((kTaps == 1) | ((fx > 0) & (fy > 0))) &
                         ((at_.wide_x[i] <= 1) & (at_.wide_y[i] <= 1));
      if (HWY_LIKELY(plain)) {
        const float* const p = pixels + stride * iy + ptrdiff_t{4} * ix;
        if (i % 4 == 0) hwy::Prefetch(p + ahead);
        write(i, Look<kTaps, kLinear>(p, stride, fx, fy));
      } else {
        write(i, Careful(group, i));
      }
    }
  }

  // A few pixels that are all reduced: those that cannot be done as their neighbours are done with care.
  // False where some are not reduced.
  bool LookUpReduced(const ConstImageView& group, int i, int count, float* values) {
    for (int k = i; k < i + count; ++k) {
      // Along an axis that is not reduced the nearest pixel is no filter of one pixel's width.
      if (!Reduced(k) || (source_.taps == 1 && !(at_.wide_x[k] > 1 && at_.wide_y[k] > 1))) return false;
    }
    reduced_x_.Find(source_, source_.window.width(), count, at_.x + i, at_.wide_x + i);
    reduced_y_.Find(source_, source_.window.height(), count, at_.y + i, at_.wide_y + i);
    ReducedLoopOf(reduced_x_.all)(reduced_x_, reduced_y_, count, group, values);
    for (int k = 0; k < count; ++k) {
      const bool done = reduced_x_.taps[k] > 0 && reduced_y_.taps[k] > 0;
      if (!done) Careful(group, i + k).Store(values + ptrdiff_t{4} * k);
    }
    return true;
  }
  bool Reduced(int i) const { return at_.wide_x[i] > 1 || at_.wide_y[i] > 1; }

  // Whether a run sees nothing of the image but the black beyond it.
  bool Beyond(int count) const {
    const Roi& w = source_.window;
    return (source_.wrap_x == Wrap::kBlack && BeyondAxis(source_, w.width(), count, at_.x, at_.wide_x)) ||
           (source_.wrap_y == Wrap::kBlack && BeyondAxis(source_, w.height(), count, at_.y, at_.wide_y));
  }

  HWY_NOINLINE F4 Careful(const ConstImageView& group, int i) {
    const Roi& w = source_.window;
    x_.Find(source_, at_.x[i], at_.wide_x[i], Reduced(i), w.width(), source_.wrap_x);
    if (x_.index.empty()) return F4::Zero();
    y_.Find(source_, at_.y[i], at_.wide_y[i], Reduced(i), w.height(), source_.wrap_y);
    if (y_.index.empty()) return F4::Zero();
    return WeightedPixels(x_, y_, group);
  }

  void Scatter(const F4& value, size_t g, float* out) const {
    float pixel[4];
    value.Store(pixel);
    for (size_t c = 0; c < job_.channels.size(); ++c) {
      const auto channel = static_cast<size_t>(job_.channels[c]);
      if (channel / 4 == g) out[c] = pixel[channel % 4];
    }
  }

  static constexpr int kRowsAhead = 3;

  const GatherJob& job_;
  const GatherSource& source_;
  bool linear_, direct_;
  std::vector<int64_t> above_;  // the first pixel of every run of the row above
  Positions at_;
  Indices index_;
  AxisWeights x_, y_;
  ReducedAxis reduced_x_, reduced_y_;
};

void Gather(const GatherJob& job) { Gatherer(job).Run(); }

GatherFunction GatherOfTarget() { return &Gather; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(GatherOfTarget);

GatherFunction ChooseGather() { return HWY_DYNAMIC_DISPATCH(GatherOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
