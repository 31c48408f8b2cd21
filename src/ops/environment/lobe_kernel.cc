// Sums over an environment's samples with the weights of a Phong lobe, in double.
#include <algorithm>
#include <cmath>
#include <limits>

#include "ops/environment/lobe.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/environment/lobe_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using DD = hn::CappedTag<double, kLobeGroup>;
using DF = hn::Rebind<float, DD>;
using VD = hn::Vec<DD>;

constexpr int kLanesOf = static_cast<int>(hn::MaxLanes(DD()));
constexpr int kVectors = kLobeGroup / kLanesOf;

// Below this a cosine counts as 0: its powers would leave the range of double's normal numbers.
constexpr double kTiny = 1e-300;

// cosine^exponent of positive cosines up to about 1. kPlain: the exponent is 1.
template <bool kPlain>
HWY_INLINE VD Power(VD cosine, double exponent) {
  const DD d;
  if constexpr (kPlain) {
    return hn::Max(cosine, hn::Zero(d));
  } else {
    const auto seen = hn::Gt(cosine, hn::Set(d, kTiny));
    const hn::Repartition<double, s::D> dd;
    static_assert(hn::MaxLanes(dd) == hn::MaxLanes(DD()));
    const VD safe = hn::IfThenElse(seen, cosine, hn::Set(d, 1.0));
    const VD t = hn::Mul(s::Log2OfDouble<s::Precision::kDouble>(safe), hn::Set(d, exponent));
    const auto counts = hn::And(seen, hn::Gt(t, hn::Set(d, -900.0)));
    return hn::IfThenElseZero(counts, s::Exp2OfDouble<s::Precision::kDouble>(hn::IfThenElseZero(counts, t)));
  }
}

// Eight running sums, whatever the vectors' width, so that every target adds in the same order.
struct Sums {
  VD v[kVectors];
  HWY_INLINE void Clear() {
    for (int k = 0; k < kVectors; ++k) v[k] = hn::Zero(DD());
  }
  double Total() const {
    alignas(64) double lane[kLobeGroup];
    for (int k = 0; k < kVectors; ++k) hn::Store(v[k], DD(), lane + k * kLanesOf);
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
  }
};

struct Seen {
  double d[3];
  // The largest cosine that the direction can have with an item of the block.
  double Bound(const LobeSamples::Block& b) const {
    const double c = d[0] * b.axis[0] + d[1] * b.axis[1] + d[2] * b.axis[2];
    if (c >= b.cos_radius) return 1;
    return c * b.cos_radius + std::sqrt(std::max(0.0, 1 - c * c)) * b.sin_radius;
  }
  double Nearest(const LobeSamples::Block& b) const {
    return d[0] * b.nearest[0] + d[1] * b.nearest[1] + d[2] * b.nearest[2];
  }
};

template <bool kPlain>
void Average(const LobeSamples& samples, double exponent, bool cut, const Seen& seen, float* rgba) {
  const DD d;
  const DF df;
  double nearest = 0;
  for (const LobeSamples::Block& b : samples.blocks) nearest = std::max(nearest, seen.Nearest(b));
  std::fill_n(rgba, 4, 0.0f);
  const double floor = cut ? nearest * std::pow(1e-6, 1 / exponent) : 0;
  // Where all powers would vanish they are taken relative to the nearest item's.
  double scale = 1;
  if (exponent * std::log2(std::max(nearest, kTiny)) < -60) {
    for (const LobeSamples::Block& b : samples.blocks) {
      if (!(seen.Bound(b) > nearest)) continue;
      for (int64_t i = b.first; i < b.first + b.count; ++i) {
        const auto at = static_cast<size_t>(i);
        if (samples.weight[at] > 0) {
          nearest = std::max(
              nearest, seen.d[0] * samples.x[at] + seen.d[1] * samples.y[at] + seen.d[2] * samples.z[at]);
        }
      }
    }
    scale = nearest > 0 ? 1 / nearest : 1;
  }
  const VD dx = hn::Set(d, seen.d[0] * scale), dy = hn::Set(d, seen.d[1] * scale),
           dz = hn::Set(d, seen.d[2] * scale);
  Sums weight, color[4];
  weight.Clear();
  for (Sums& c : color) c.Clear();
  for (const LobeSamples::Block& b : samples.blocks) {
    if (!(seen.Bound(b) > floor)) continue;
    for (int64_t i = b.first; i < b.first + b.count; i += kLobeGroup) {
      for (int k = 0; k < kVectors; ++k) {
        const int64_t at = i + k * kLanesOf;
        const VD cosine = hn::MulAdd(dx, hn::LoadU(d, samples.x.data() + at),
                                     hn::MulAdd(dy, hn::LoadU(d, samples.y.data() + at),
                                                hn::Mul(dz, hn::LoadU(d, samples.z.data() + at))));
        const VD p = Power<kPlain>(cosine, exponent);
        const auto load = [&](const std::vector<float>& v)
                              HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(df, v.data() + at)); };
        weight.v[k] = hn::MulAdd(p, load(samples.weight), weight.v[k]);
        for (int c = 0; c < 4; ++c) color[c].v[k] = hn::MulAdd(p, load(samples.color[c]), color[c].v[k]);
      }
    }
  }
  const double total = weight.Total();
  if (!(total > 0)) return;
  for (int c = 0; c < 4; ++c) {
    const auto v = static_cast<float>(color[c].Total() / total);
    rgba[c] = std::isnan(v) ? std::numeric_limits<float>::quiet_NaN() : v;
  }
}

void Lobe(const LobeSamples& samples, double exponent, bool cut, const double* x, const double* y,
          const double* z, int count, float* rgba) {
  for (int i = 0; i < count; ++i) {
    const double length = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
    const Seen seen = {{x[i] / length, y[i] / length, z[i] / length}};
    if (exponent == 1) {
      Average<true>(samples, exponent, cut, seen, rgba + 4 * i);
    } else {
      Average<false>(samples, exponent, cut, seen, rgba + 4 * i);
    }
  }
}

}  // namespace

LobeFunction LobeOfTarget() { return &Lobe; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(LobeOfTarget);

LobeFunction ChooseLobe() { return HWY_DYNAMIC_DISPATCH(LobeOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
