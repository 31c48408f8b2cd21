// Running sums in double, 32 tracks side by side.
#include "ops/filter/box/running_sum.h"

#include <algorithm>
#include <cmath>

#include "ops/filter/lines/extend.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/box/running_sum.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/lines/tracks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

// Samples of one vector as two vectors of doubles.
using DD = hn::Repartition<double, D>;
constexpr int kHalves = 2;
struct Doubles {
  hn::Vec<DD> h[kHalves];
};
HWY_INLINE Doubles Widen(V v) {
  const hn::Half<D> half;
  return {{hn::PromoteTo(DD(), hn::LowerHalf(half, v)), hn::PromoteTo(DD(), hn::UpperHalf(half, v))}};
}
HWY_INLINE V Narrow(const Doubles& v) {
  const hn::Half<D> half;
  return hn::Combine(D(), hn::DemoteTo(half, v.h[1]), hn::DemoteTo(half, v.h[0]));
}

// The sum of samples [first, last] of one vector, afresh.
template <class Sample>
HWY_INLINE Doubles SumOf(int first, int last, int j, const Sample& sample) {
  Doubles sum;
  for (auto& h : sum.h) h = hn::Zero(DD());
  for (int n = first; n <= last; ++n) {
    const Doubles x = Widen(sample(n, j));
    for (int i = 0; i < kHalves; ++i) sum.h[i] = hn::Add(sum.h[i], x.h[i]);
  }
  return sum;
}

// out[n] = factor * sum of the `count` samples from n - before on. `scale`, when not null, multiplies sample
// n.
template <class Io>
void SumLine(const Io& io, int length, int count, double factor, const AxisBorder& border, const float* scale,
             float* HWY_RESTRICT copy) {
  const D d;
  const int before = (count - 1) / 2, after = count - 1 - before;
  const V beyond = hn::Set(d, border.value);
  // Samples as they were: the results may overwrite them.
  const auto kept = [&](int n, int j) HWY_ATTR { return hn::Load(d, copy + (n * kFlight + j) * kLanes); };
  for (int n = 0; n < std::min(after, length); ++n) {
    for (int j = 0; j < kFlight; ++j) hn::Store(io.Read(n, j), d, copy + (n * kFlight + j) * kLanes);
  }
  const auto outside = [&](int n, int j) HWY_ATTR {
    const int source = border.Shown(n);
    return source < 0 ? beyond : io.Read(source, j);
  };
  // Once the line's begin is overwritten, mirrored and repeated samples come from the copy.
  const auto any = [&](int n, int j) HWY_ATTR {
    if (n >= 0 && n < length) return kept(n, j);
    const int source = border.Shown(n);
    return source < 0 ? beyond : kept(source, j);
  };
  Doubles sum[kFlight];
  V largest[kFlight];
  const auto first_sample = [&](int n, int j)
                                HWY_ATTR { return n >= 0 && n < length ? io.Read(n, j) : outside(n, j); };
  for (int j = 0; j < kFlight; ++j) {
    sum[j] = SumOf(-before, after - 1, j, first_sample);
    largest[j] = hn::Zero(d);
  }
  // Everything is kept before the first result is written where the border may ask for any of it.
  int copied = std::min(after, length);
  if (border.rule == AxisBorder::kMapped) {
    for (; copied < length; ++copied) {
      for (int j = 0; j < kFlight; ++j)
        hn::Store(io.Read(copied, j), d, copy + (copied * kFlight + j) * kLanes);
    }
  }
  const auto step = [&](int n, int j, V entering, V leaving) HWY_ATTR {
    const Doubles in = Widen(entering);
    V mean;
    {
      Doubles scaled;
      for (int i = 0; i < kHalves; ++i) {
        sum[j].h[i] = hn::Add(sum[j].h[i], in.h[i]);
        scaled.h[i] = hn::Mul(sum[j].h[i], hn::Set(DD(), factor));
      }
      mean = Narrow(scaled);
    }
    // A sum much smaller than what went through it has lost its low bits; after an infinity it is NaN.
    const V size = hn::Abs(mean);
    largest[j] = hn::Max(largest[j], size);
    if (HWY_UNLIKELY(!hn::AllTrue(d, hn::Ge(hn::Mul(size, hn::Set(d, 0x1p20f)), largest[j])))) {
      sum[j] = SumOf(n - before, n + after, j, any);
      Doubles scaled;
      for (int i = 0; i < kHalves; ++i) scaled.h[i] = hn::Mul(sum[j].h[i], hn::Set(DD(), factor));
      mean = Narrow(scaled);
      largest[j] = hn::IfThenElseZero(hn::IsFinite(mean), hn::Abs(mean));
      // Every NaN leaves as the same one.
      mean = hn::IfThenElse(hn::IsNaN(mean), hn::NaN(d), mean);
    }
    if (scale != nullptr) mean = hn::Mul(mean, hn::Set(d, scale[n]));
    io.Write(mean, n, j);
    const Doubles out = Widen(leaving);
    for (int i = 0; i < kHalves; ++i) sum[j].h[i] = hn::Sub(sum[j].h[i], out.h[i]);
  };
  const auto edge = [&](int n) HWY_ATTR {
    for (int j = 0; j < kFlight; ++j) {
      if (n + after < length && n + after >= copied) {
        hn::Store(io.Read(n + after, j), d, copy + ((n + after) * kFlight + j) * kLanes);
      }
      step(n, j, any(n + after, j), any(n - before, j));
    }
  };
  int n = 0;
  for (; n < std::min(before, length); ++n) edge(n);
  for (; n < length - after; ++n) {
    io.Prefetch(std::min(n + after + 12, length - 1));
    HWY_UNROLL(2)
    for (int j = 0; j < kFlight; ++j) {
      V entering;
      if (n + after >= copied) {
        entering = io.Read(n + after, j);
        hn::Store(entering, d, copy + ((n + after) * kFlight + j) * kLanes);
      } else {
        entering = kept(n + after, j);
      }
      step(n, j, entering, kept(n - before, j));
    }
  }
  for (; n < length; ++n) edge(n);
}

struct BoxLine {
  int count;
  double factor;
  template <class Io>
  void operator()(const Io& io, int length, const AxisBorder& border, const float* scale,
                  float* scratch) const {
    SumLine(io, length, count, factor, border, scale, scratch);
  }
};

void BoxTracks(int count, double factor, const TrackBlock& b, bool rgba_rows, const AxisBorder& border,
               const float* scale, float* scratch) {
  ForLines(BoxLine{count, factor}, b, rgba_rows, border, scale, scratch);
}
BoxTracksFunction BoxTracksOfTarget() { return BoxTracks; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(BoxTracksOfTarget);

BoxTracksFunction ChooseBoxTracks() { return HWY_DYNAMIC_DISPATCH(BoxTracksOfTarget)(); }

void RunBox(BoxTracksFunction tracks, int width, int height, const ConstImageView& in, const ImageView& out,
            Wrap wrap, double border_value, const graph::Workers& workers) {
  const bool rows = width > 1, columns = height > 1 || width == 1;
  FilterLines(
      rows, columns, in, out, workers,
      [&](int axis, const TrackBlock& block, bool rgba_rows, const float* scale, float* scratch) {
        const int count = axis == 0 ? width : height;
        tracks(count, 1.0 / count, block, rgba_rows, AxisBorder(wrap, border_value, block.length), scale,
               scratch);
      },
      [&](int axis, int length) {
        std::vector<float> scale;
        if (wrap != Wrap::kRenormalize) return scale;
        const int count = axis == 0 ? width : height, before = (count - 1) / 2;
        for (int n = 0; n < length; ++n) {
          const int inside = std::min(length, n - before + count) - std::max(0, n - before);
          scale.push_back(static_cast<float>(double{1} * count / inside));
        }
        return scale;
      });
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
