// The lines of a packet of pixels, forward and backward together, tap by tap: every integrator but the
// crossing of pixels.
#if defined(TESSERA_OPS_FLOW_WALK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FLOW_WALK_INL_H_
#undef TESSERA_OPS_FLOW_WALK_INL_H_
#else
#define TESSERA_OPS_FLOW_WALK_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "ops/flow/field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

// Chains of positions: first the forward ones of the packet's vectors, then the backward ones. They do not
// wait for each other, which hides the loads of one behind the arithmetic of the other.
constexpr int kChains = 2 * kParts;
HWY_INLINE float SignOf(int chain) { return chain < kParts ? 1.0f : -1.0f; }

// Starts as places in the picture.
HWY_INLINE V2 PlacesOf(const Place& place, const Starts& starts) {
  const D d;
  const DI di;
  return {hn::ConvertTo(d, hn::Add(starts.x, hn::Set(di, place.x))),
          hn::ConvertTo(d, hn::Add(starts.y, hn::Set(di, place.y)))};
}

// Whether all four pixels around every position exist.
HWY_INLINE bool AllInside(const Lines& lines, const V2& first, const V2& p) {
  const D d;
  const V x = hn::Add(first.x, p.x), y = hn::Add(first.y, p.y), zero = hn::Zero(d);
  const auto in_x = hn::And(hn::Ge(x, zero), hn::Lt(x, hn::Set(d, static_cast<float>(lines.width - 1))));
  const auto in_y = hn::And(hn::Ge(y, zero), hn::Lt(y, hn::Set(d, static_cast<float>(lines.height - 1))));
  return hn::AllTrue(d, hn::And(in_x, in_y));
}

// kChecked: lines may leave the picture; any integrator. Else only RK4 and the adaptive one.
template <bool kChecked>
class Walker {
 public:
  HWY_INLINE Walker(const Lines& lines, const Place& place, const Starts* starts)
      : lines_(lines), place_(place), starts_(starts) {
    for (int part = 0; part < kParts; ++part) {
      first_[part] = PlacesOf(place, starts[part]), base_[part] = BaseOf(lines, starts[part]);
    }
    for (int c = 0; c < kChains; ++c) {
      p_[c] = {hn::Zero(D()), hn::Zero(D())};
      v_[c] = c < kParts ? At(c, p_[c]) : v_[c - kParts];
    }
  }

  // tap(chain, number from 1, position), all chains of a number one after the other, `taps` numbers.
  template <class Tap>
  HWY_INLINE void Run(int taps, const Tap& tap) {
    int most = lines_.integrator == LicIntegrator::kAdaptive ? lines_.taps_at_once : 1, at_once = most;
    for (int done = 0; done < taps;) {
      int n = std::min(at_once, taps - done);
      const int parts = n == 1 ? lines_.parts : 1;
      const float h = lines_.step * static_cast<float>(n) / static_cast<float>(parts);
      V turned = hn::Zero(D());
      Stepped to[kChains];
      for (int i = 0; i < parts; ++i) {
        if (i > 0) Accept(to);
        Step(h, to, turned);
      }
      if (most > 1) {
        const float limit = lines_.turn * lines_.turn;
        if (n > 1 && !hn::AllFalse(D(), hn::Gt(turned, hn::Set(D(), limit)))) {
          at_once = n / 2;
          continue;
        }
        if (hn::AllFalse(D(), hn::Gt(turned, hn::Set(D(), 0.2f * limit)))) at_once = std::min(2 * n, most);
      }
      if (n == 1) {
        for (int c = 0; c < kChains; ++c) tap(c, done + 1, to[c].end);
      } else {
        Curve curve[kChains];
        for (int c = 0; c < kChains; ++c) {
          curve[c] = Hermite(p_[c], hn::Set(D(), SignOf(c) * h), v_[c], to[c].end, to[c].velocity);
        }
        const float share = 1.0f / static_cast<float>(n);
        for (int i = 1; i <= n; ++i) {
          const V t = hn::Set(D(), static_cast<float>(i) * share);
          for (int c = 0; c < kChains; ++c) tap(c, done + i, curve[c].At(p_[c], t));
        }
      }
      Accept(to);
      done += n;
    }
  }

 private:
  HWY_INLINE V2 At(int chain, const V2& p) const {
    const int part = chain % kParts;
    if (kChecked && !AllInside(lines_, first_[part], p)) {
      return VelocityAnywhere(lines_, place_, starts_[part], p);
    }
    return VelocityInside(lines_, place_, base_[part], p);
  }
  HWY_INLINE void Accept(const Stepped* to) {
    for (int c = 0; c < kChains; ++c) p_[c] = to[c].end, v_[c] = to[c].velocity;
  }
  // One step of the integrator; `turned`: the largest squared change of direction met.
  HWY_INLINE void Step(float h, Stepped* to, V& turned) const {
    const D d;
    const bool low =
        lines_.integrator == LicIntegrator::kEuler || lines_.integrator == LicIntegrator::kMidpoint;
    if (kChecked && low) {
      for (int c = 0; c < kChains; ++c) {
        const float signed_h = SignOf(c) * h;
        V2 slope = v_[c];
        if (lines_.integrator == LicIntegrator::kMidpoint) {
          slope = At(c, Along(p_[c], hn::Set(d, 0.5f * signed_h), slope));
        }
        to[c].end = Along(p_[c], hn::Set(d, signed_h), slope);
      }
    } else {
      V2 k2[kChains], k3[kChains], k4[kChains];
      for (int c = 0; c < kChains; ++c) k2[c] = At(c, Along(p_[c], hn::Set(d, 0.5f * SignOf(c) * h), v_[c]));
      for (int c = 0; c < kChains; ++c) k3[c] = At(c, Along(p_[c], hn::Set(d, 0.5f * SignOf(c) * h), k2[c]));
      for (int c = 0; c < kChains; ++c) k4[c] = At(c, Along(p_[c], hn::Set(d, SignOf(c) * h), k3[c]));
      for (int c = 0; c < kChains; ++c) {
        const V sixth = hn::Set(d, SignOf(c) * h / 6.0f), two = hn::Set(d, 2.0f);
        const V2 sum{hn::MulAdd(two, hn::Add(k2[c].x, k3[c].x), hn::Add(v_[c].x, k4[c].x)),
                     hn::MulAdd(two, hn::Add(k2[c].y, k3[c].y), hn::Add(v_[c].y, k4[c].y))};
        to[c].end = Along(p_[c], sixth, sum);
      }
      if (lines_.integrator == LicIntegrator::kAdaptive) {
        for (int c = 0; c < kChains; ++c) {
          turned = hn::Max(turned, Turn(v_[c], k4[c]));
          // Where the vector changes evenly k2 and k3 agree.
          turned = hn::Max(turned, hn::Mul(hn::Set(d, kUneven), Turn(k2[c], k3[c])));
          // A bend within the step, as at pixels' edges, that its ends do not show.
          const V2 ends{hn::Add(v_[c].x, k4[c].x), hn::Add(v_[c].y, k4[c].y)};
          const V2 middles{hn::Add(k2[c].x, k3[c].x), hn::Add(k2[c].y, k3[c].y)};
          turned = hn::Max(turned, hn::Mul(hn::Set(D(), kBend), Turn(ends, middles)));
        }
      }
    }
    for (int c = 0; c < kChains; ++c) to[c].velocity = At(c, to[c].end);
  }
  static HWY_INLINE V Turn(const V2& a, const V2& b) {
    const V x = hn::Sub(b.x, a.x), y = hn::Sub(b.y, a.y);
    return hn::MulAdd(x, x, hn::Mul(y, y));
  }
  static constexpr float kUneven = 4, kBend = 64;

  const Lines& lines_;
  const Place& place_;
  const Starts* starts_;
  V2 first_[kParts];  // the starts as places in the picture
  VU base_[kParts];
  V2 p_[kChains], v_[kChains];
};

// The starts of the packet's pixels; those beyond the picture stand in for its last ones.
HWY_INLINE void PixelStarts(int right, int bottom, Starts* starts) {
  const DI di;
  for (int part = 0; part < kParts; ++part) {
    const VI lane = hn::Iota(di, part * kLanes);
    const VI x = hn::And(lane, hn::Set(di, kSide - 1)), y = hn::ShiftRight<2>(lane);
    starts[part] = {hn::Min(x, hn::Set(di, right)), hn::Min(y, hn::Set(di, bottom))};
  }
}

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
