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

#include "base/arena_vector.h"
#include "ops/geometry/plain-inl.h"
#include "ops/geometry/positions-inl.h"
#include "ops/geometry/reduce-inl.h"
#include "simd/floats-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using F4 = s::Floats<4>;
using F8 = s::Floats<8>;

// The pixels with weight along one axis, for what the short paths leave: edges, whole positions, reductions
// by much.
struct AxisWeights {
  explicit AxisWeights(base::Arena& scratch) : index(scratch), weight(scratch), exact_(scratch) {}

  base::ArenaVector<int> index;
  base::ArenaVector<float> weight;

  // `position` in indices of the image; `reduced`: the filter is widened along one axis at least.
  void Find(const GatherSource& source, double position, double wide, bool reduced, int size, Wrap wrap) {
    index.clear(), weight.clear(), exact_.clear();
    wide = std::min(wide, GatherSource::kWidest / source.filter->width);
    const double radius = source.reach * wide;
    const double from = std::ceil(position - radius), to = std::floor(position + radius);
    if (!(std::fabs(position) <= kOutOfReach) || size == 0) return;
    const bool beyond = to < 0 || from > size - 1;
    if (beyond && wrap == Wrap::kBlack) return;
    // Nearest, where a position half-way between two pixels takes the right one; or nothing but the edge's
    // pixel.
    if ((source.taps == 1 && wide == 1) || (beyond && wrap == Wrap::kClamp)) {
      const int at = WrappedIndex(static_cast<int64_t>(std::floor(position + 0.5)), size, wrap);
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
      const int at = WrappedIndex(static_cast<int64_t>(j), size, wrap);
      if (at >= 0 || !source.renormalize) sum += w;
      if (w == 0 || at < 0) continue;
      if (fold) {
        exact_[static_cast<size_t>(at)] += w;
      } else {
        index.push_back(at), exact_.push_back(w);
      }
    }
    // Beyond the edge with lobes below 0 alone there is nothing to see.
    if (sum == 0 || (source.renormalize && sum < 0)) {
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
  base::ArenaVector<double> exact_;
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

// Two by two pixels, as BlendSquares4 has many.
HWY_INLINE F4 Bilinear(const float* p, ptrdiff_t stride, float gx, float gy) {
  const F8 rows = s::LerpFromNearer(F8::Load(p), F8::Load(p + stride), F8::Set(gy));
  return s::LerpFromNearer(s::Lower(rows), s::Upper(rows), F4::Set(gx));
}

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
    direct_ = job.channels.size() == 4 && job.channels[0] == 0 && job.channels[1] == 1 &&
              job.channels[2] == 2 && job.channels[3] == 3;
  }

  void Run() {
    const Roi& roi = job_.out.roi;
    if (source_.groups.empty() || source_.window.empty()) return Clear();
    above_.assign(static_cast<size_t>(roi.width() / kRun + 1), 0);
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; x += kRun) {
        const int count = std::min(kRun, roi.x1 - x);
        job_.map.from_image ? RunImage(x, y, count) : RunMatrix(x, y, count);
      }
    }
  }

 private:
  template <int kTaps>
  using Taps = std::integral_constant<int, kTaps>;

  void RunMatrix(int x, int y, int count) {
    if (able_ && PlainMatrix(job_, x, y, count, plain_) && LookUpPlain(x, y, count)) return;
    MatrixPositions(job_.map, source_.window, x, y, count, at_);
    LookUpAny(x, y, count);
  }
  void RunImage(int x, int y, int count) {
    const Coordinates from(job_, x, y, count);
    if (able_ && PlainImage(job_, paired_, from, x, y, count, plain_) && LookUpPlain(x, y, count)) return;
    ImagePositions(job_, from, x, y, count, at_);
    LookUpAny(x, y, count);
  }

  void Clear() {
    const Roi& roi = job_.out.roi;
    for (int y = roi.y0; y < roi.y1; ++y) ClearRun(roi.x0, y, roi.width());
  }
  void ClearRun(int x, int y, int count) {
    std::fill_n(reinterpret_cast<float*>(job_.out.At(x, y)),
                static_cast<size_t>(count) * static_cast<size_t>(job_.out.channels), 0.0f);
  }

  // Whether the result holds any of the group's channels.
  bool IsWanted(size_t g) const {
    return std::any_of(job_.channels.begin(), job_.channels.end(),
                       [g](int channel) { return static_cast<size_t>(channel) / 4 == g; });
  }

  // look_up(taps, linear, group) for every group of channels that is wanted.
  template <class F>
  HWY_INLINE void ForTaps(const F& look_up) {
    using std::bool_constant;
    for (size_t g = 0; g < source_.groups.size(); ++g) {
      if (!IsWanted(g)) continue;
      if (source_.linear) {
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
    const bool nearer = source_.linear;
    FindTaps(w.width(), source_.wrap_x, source_.taps, nearer, count, at_.x, index_.x, index_.fx);
    FindTaps(w.height(), source_.wrap_y, source_.taps, nearer, count, at_.y, index_.y, index_.fy);
    if (Beyond(count)) return ClearRun(x, y, count);
    const ptrdiff_t ahead = Ahead(x, int64_t{index_.y[0]} * source_.pixels_per_row + index_.x[0]);
    ForTaps([&](auto taps, auto linear, size_t g) { LookUp<taps, linear>(g, x, y, count, ahead); });
  }

  // No pixel of the run needs a second look; false where that turns out to be wrong.
  bool LookUpPlain(int x, int y, int count) {
    const ptrdiff_t ahead = Ahead(x, static_cast<uint32_t>(plain_.base[0]) / 2);
    bool sure = true;
    if (source_.linear) {
      for (size_t g = 0; g < source_.groups.size() && sure; ++g)
        sure = !IsWanted(g) || BlendRun(g, x, y, count, ahead);
    } else {
      ForTaps([&](auto taps, auto, size_t g) { FilterRun<taps>(g, x, y, count, ahead); });
    }
    return sure;
  }
  HWY_INLINE void PrefetchAhead(const float* pixels, int count, ptrdiff_t ahead) const {
    for (int i = 0; i < count; i += 4) hwy::Prefetch(At<4>(pixels, plain_.base[i]) + ahead);
  }
  bool BlendRun(size_t g, int x, int y, int count, ptrdiff_t ahead) {
    const ConstImageView& group = source_.groups[g];
    const auto* const pixels = reinterpret_cast<const float*>(group.data);
    auto* const out = reinterpret_cast<float*>(job_.out.At(x, y));
    alignas(64) float copy[4 * kRun];
    const int whole = (count + s::kQuarter - 1) / s::kQuarter * s::kQuarter;
    const bool direct = direct_ && whole == count;
    BlockResults results{copy, {6, 0}, false};
    if (direct) results.to = out, results.stream = job_.stream && s::CanStream(out);
    for (int i = count; i < whole; ++i) plain_.base[i] = plain_.base[count - 1];
    PrefetchAhead(pixels, count, ahead);
    if (BlendSquares4(pixels, group.row_stride / 4, plain_, whole, results)) return false;
    for (int i = 0; i < count && !direct; ++i) {
      Write(F4::Load(copy + 4 * i), g, out + ptrdiff_t{job_.out.channels} * i, false);
    }
    return true;
  }
  template <int kTaps>
  void FilterRun(size_t g, int x, int y, int count, ptrdiff_t ahead) {
    const ConstImageView& group = source_.groups[g];
    const auto* const pixels = reinterpret_cast<const float*>(group.data);
    auto* const out = reinterpret_cast<float*>(job_.out.At(x, y));
    const bool stream = direct_ && job_.stream && reinterpret_cast<uintptr_t>(out) % 16 == 0;
    PrefetchAhead(pixels, count, ahead);
    for (int i = 0; i < count; ++i) {
      Write(
          Look<kTaps, false>(At<4>(pixels, plain_.base[i]), group.row_stride / 4, plain_.fx[i], plain_.fy[i]),
          g, out + ptrdiff_t{job_.out.channels} * i, stream);
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
                         ((kTaps == 1) | ((fx != 0) & (fy != 0))) &
                         ((at_.wide_x[i] <= 1) & (at_.wide_y[i] <= 1));
      if (HWY_LIKELY(plain)) {
        const float* const p = pixels + stride * iy + ptrdiff_t{4} * ix;
        if (i % 4 == 0) hwy::Prefetch(p + ahead);
        const F4 value = Look<kTaps, kLinear>(p, stride, fx, fy);
        write(i, kLinear && !Finite(value) ? Careful(group, i) : value);
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

  // Differences of infinite pixels are no numbers.
  static HWY_INLINE bool Finite(const F4& value) {
    bool finite = true;
    for (const F4::Vector& v : value.v) {
      finite &= hn::AllTrue(F4::Tag(), hn::Eq(hn::Sub(v, v), hn::Zero(F4::Tag())));
    }
    return finite;
  }

  static constexpr int kRowsAhead = 3;

  const GatherJob& job_;
  const GatherSource& source_;
  bool direct_;
  const bool able_ = source_.taps % 2 == 0 && source_.pixels_per_row > 0;  // to do plain runs
  const PairedMap paired_{job_};
  PlainTaps plain_;
  base::ArenaVector<int64_t> above_{job_.scratch};  // the first pixel of every run of the row above
  Positions at_;
  Indices index_;
  AxisWeights x_{job_.scratch}, y_{job_.scratch};
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
