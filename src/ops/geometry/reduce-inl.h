// Weights of look-ups whose filter is widened because the map reduces, for short runs of pixels at once.
#if defined(TESSERA_OPS_GEOMETRY_REDUCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_GEOMETRY_REDUCE_INL_H_
#undef TESSERA_OPS_GEOMETRY_REDUCE_INL_H_
#else
#define TESSERA_OPS_GEOMETRY_REDUCE_INL_H_
#endif

#include <hwy/highway.h>

#include <utility>

#include "ops/geometry/gather.h"
#include "ops/geometry/positions-inl.h"
#include "simd/floats-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;

// table[at] and table[at + 1] for every lane.
template <class D>
HWY_INLINE void LoadNeighbours(D d, const double* table, const int32_t* at, hn::Vec<D>& here,
                               hn::Vec<D>& next) {
  if constexpr (hn::MaxLanes(D()) == 1) {
    here = hn::Set(d, table[at[0]]), next = hn::Set(d, table[at[0] + 1]);
  } else {
    const auto pair = [&](int lane) HWY_ATTR { return hn::LoadU(hn::Full128<double>(), table + at[lane]); };
    hn::Vec<D> even, odd;
    if constexpr (hn::MaxLanes(D()) == 2) {
      even = pair(0), odd = pair(1);
    } else {
      const hn::CappedTag<double, 4> four;
      const auto quad = [&](int lane) HWY_ATTR { return hn::Combine(four, pair(lane + 2), pair(lane)); };
      if constexpr (hn::MaxLanes(D()) == 4) {
        even = quad(0), odd = quad(1);
      } else {
        even = hn::Combine(d, quad(4), quad(0)), odd = hn::Combine(d, quad(5), quad(1));
      }
    }
    here = hn::InterleaveLower(d, even, odd);
    next = hn::InterleaveUpper(d, even, odd);
  }
}

// The tabulated filter, wider. Whoever looks up one pixel or many gets the same bits.
template <class D>
struct WidenedFilter {
  using Vec = hn::Vec<D>;
  const double* fine;
  Vec per_pixel, end;

  WidenedFilter(D d, const GatherSource& source, Vec wide)
      : fine(source.fine.data()),
        per_pixel(hn::Div(hn::Set(d, double{GatherSource::kPhases}), wide)),
        end(hn::Set(d, source.reach * GatherSource::kPhases)) {}

  // The value at a distance in pixels; 0 unless `counts`.
  HWY_INLINE Vec Value(D d, Vec distance, hn::Mask<D> counts) const {
    const hn::Rebind<int32_t, D> di;
    const Vec at = hn::Mul(hn::Abs(distance), per_pixel);
    const auto reached = hn::And(counts, hn::Lt(at, end));
    const Vec low = hn::Floor(hn::IfThenElseZero(reached, at));
    alignas(64) int32_t index[hn::MaxLanes(D())];
    hn::Store(hn::DemoteTo(di, low), di, index);
    Vec here, next;
    LoadNeighbours(d, fine, index, here, next);
    return hn::IfThenElseZero(reached, hn::MulAdd(hn::Sub(at, low), hn::Sub(next, here), here));
  }
};

// Whether the filter reaches no pixel of the axis from any of these positions.
inline bool BeyondAxis(const GatherSource& source, int size, int count, const double* position,
                       const double* wide) {
  // As far as single pixels are asked: a run must not decide otherwise where the filter ends.
  const double radius = std::max(source.filter->width / 2, source.reach);
  bool all = true;
  for (int i = 0; i < count; ++i) {
    const double reach = radius * wide[i];
    all &= (position[i] + reach < 0) | (position[i] - reach > size - 1.0);
  }
  return all;
}

// One axis of up to kPixels pixels: weights, of sum 1, of the taps from `first` on. Neighbouring pixels have
// the same number of taps or one less, so that all are given `all` of them, and the last one counts where
// `last` has its bits set; where it does not, its weight is -0: a sum keeps its bits. A pixel has no taps
// here (`all` is not for it) where one of them lies beyond the image or has no weight (it must not be looked
// at: it may be NaN), or where there are many.
struct ReducedAxis {
  static constexpr int kPixels = 16, kMaxTaps = 24;
  int all = 0;
  alignas(64) int32_t first[kPixels], taps[kPixels];
  alignas(64) uint32_t last[kPixels];
  alignas(64) float weight[kMaxTaps][kPixels];

  // The positions are those that FindTaps leaves.
  void Find(const GatherSource& source, int size, int pixels, const double* position, const double* wide) {
    const DD d;
    const int step = static_cast<int>(hn::Lanes(d));
    const VD one = hn::Set(d, 1.0), radius = hn::Set(d, source.reach), end = hn::Set(d, size - 1.0),
             most = hn::Set(d, kMaxTaps);
    VD widest = hn::Zero(d);
    for (int i = 0; i < pixels; i += step) {
      const VD at = hn::Load(d, position + i), reach = hn::Mul(radius, hn::Load(d, wide + i));
      const VD from = hn::Ceil(hn::Sub(at, reach)), to = hn::Floor(hn::Add(at, reach));
      const VD count = hn::Add(hn::Sub(to, from), one);
      const auto here = hn::And(hn::And(hn::Ge(from, hn::Zero(d)), hn::Le(to, end)), hn::Le(count, most));
      const VD counted = hn::IfThenElseZero(here, count);
      widest = hn::Max(widest, counted);
      hn::Store(hn::DemoteTo(DI(), counted), DI(), taps + i);
      hn::Store(hn::DemoteTo(DI(), hn::IfThenElseZero(here, from)), DI(), first + i);
    }
    all = static_cast<int>(hn::GetLane(hn::MaxOfLanes(d, widest)));
    for (int i = 0; i < pixels; i += step) Weigh(source, size, i, position, wide);
  }

 private:
  void Weigh(const GatherSource& source, int size, int i, const double* position, const double* wide) {
    const DD d;
    const DF f;
    const DI di;
    const VD count = hn::PromoteTo(d, hn::Load(di, taps + i));
    const VD from = hn::PromoteTo(d, hn::Load(di, first + i));
    const WidenedFilter<DD> filter(d, source, hn::Load(d, wide + i));
    const VD at = hn::Load(d, position + i), stop = hn::Add(from, count), one = hn::Set(d, 1.0);
    VD exact[kMaxTaps], sum = hn::Zero(d), pixel = from;
    auto weighs = hn::Gt(count, sum);
    for (int k = 0; k < all; ++k) {
      const auto counts = hn::Lt(pixel, stop);
      const VD value = filter.Value(d, hn::Sub(pixel, at), counts);
      weighs = hn::And(weighs, hn::Or(hn::Ne(value, hn::Zero(d)), hn::Not(counts)));
      exact[k] = value;
      sum = hn::Add(sum, value);
      pixel = hn::Add(pixel, one);
    }
    const VD full = hn::Set(d, all);
    weighs = hn::And(weighs, hn::Ne(sum, hn::Zero(d)));
    weighs = hn::And(weighs, hn::Ge(count, hn::Set(d, all - 1)));
    weighs = hn::And(weighs, hn::Le(hn::Add(from, full), hn::Set(d, size)));
    const VD scale = hn::Div(one, sum);
    const auto whole = hn::Ge(count, full);
    for (int k = 0; k < all; ++k) {
      VD w = hn::Mul(exact[k], scale);
      if (k == all - 1) w = hn::IfThenElse(whole, w, hn::Set(d, -0.0));
      hn::Store(hn::DemoteTo(f, w), f, weight[k] + i);
    }
    const auto bits = hn::IfThenElseZero(whole, hn::Set(d, -1.0));
    hn::Store(hn::BitCast(hn::RebindToUnsigned<DI>(), hn::DemoteTo(di, bits)), hn::RebindToUnsigned<DI>(),
              last + i);
    hn::Store(hn::DemoteTo(di, hn::IfThenElseZero(weighs, count)), di, taps + i);
  }
};

// Sum over the taps of a row of pixel i of a run; kTaps: how many they are, 0 for x.all.
template <int kTaps>
HWY_INLINE s::Floats<4> ReducedRow(const ReducedAxis& x, int i, const float* row) {
  using F4 = s::Floats<4>;
  const int end = (kTaps > 0 ? kTaps : x.all) - 1;
  F4 sum = F4::Scaled(row, x.weight[0][i]);
  for (int k = 1; k < end; ++k) sum.AddScaled(row + 4 * k, x.weight[k][i]);
  if (end > 0) sum.AddScaled(F4::Load(row + 4 * end).Masked(x.last[i]), x.weight[end][i]);
  return sum;
}

// Sum over the taps of both axes.
template <int kTaps>
HWY_INLINE s::Floats<4> ReducedPixel(const ReducedAxis& x, const ReducedAxis& y, int i, const float* pixels,
                                     ptrdiff_t stride) {
  const float* row = pixels + stride * y.first[i] + ptrdiff_t{4} * x.first[i];
  const int end = y.all - 1;
  s::Floats<4> total = ReducedRow<kTaps>(x, i, row) * y.weight[0][i];
  for (int j = 1; j < end; ++j) total.AddScaled(ReducedRow<kTaps>(x, i, row += stride), y.weight[j][i]);
  if (end > 0) {
    total.AddScaled(ReducedRow<kTaps>(x, i, row += stride).Masked(y.last[i]), y.weight[end][i]);
  }
  return total;
}

// The pixels of a run, those that have taps along both axes, to `values`.
template <int kTaps>
void ReducedPixels(const ReducedAxis& x, const ReducedAxis& y, int count, const ConstImageView& group,
                   float* values) {
  const auto* const pixels = reinterpret_cast<const float*>(group.data);
  for (int i = 0; i < count; ++i) {
    if (x.taps[i] == 0 || y.taps[i] == 0) continue;
    ReducedPixel<kTaps>(x, y, i, pixels, group.row_stride / 4).Store(values + ptrdiff_t{4} * i);
  }
}

// The loop over so many taps, or over any number.
using ReducedLoop = void (*)(const ReducedAxis&, const ReducedAxis&, int, const ConstImageView&, float*);
template <int... kTaps>
ReducedLoop ReducedLoopOf(int taps, std::integer_sequence<int, kTaps...>) {
  static constexpr ReducedLoop kLoops[] = {&ReducedPixels<kTaps>...};
  return kLoops[taps < static_cast<int>(sizeof...(kTaps)) ? taps : 0];
}
inline ReducedLoop ReducedLoopOf(int taps) {
  return ReducedLoopOf(taps, std::make_integer_sequence<int, 15>());
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
