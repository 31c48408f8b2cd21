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
#include <bit>

#include "ops/flow/close-inl.h"
#include "ops/flow/field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {

// Chains of positions: first the forward ones of the packet's vectors, then the backward ones. They do not
// wait for each other, which hides the loads of one behind the arithmetic of the other.
constexpr int kChains = 2 * kParts;
HWY_INLINE float SignOf(int chain) { return chain < kParts ? 1.0f : -1.0f; }
HWY_INLINE V2 Ahead(int chain, const V2& p, V h, const V2& k) {
  if (chain < kParts) return {hn::MulAdd(h, k.x, p.x), hn::MulAdd(h, k.y, p.y)};
  return {hn::NegMulAdd(h, k.x, p.x), hn::NegMulAdd(h, k.y, p.y)};
}

// Starts as places in the picture.
HWY_INLINE V2 PlacesOf(const Place& place, const Starts& starts) {
  const D d;
  const DI di;
  return {hn::ConvertTo(d, hn::Add(starts.x, hn::Set(di, place.x))),
          hn::ConvertTo(d, hn::Add(starts.y, hn::Set(di, place.y)))};
}

// Whether all four pixels around every position exist, and those up to `margin` pixels beyond.
HWY_INLINE bool AllInside(const Lines& lines, const V2& first, const V2& p, int margin = 0) {
  const D d;
  const V x = hn::Add(first.x, p.x), y = hn::Add(first.y, p.y),
          least = hn::Set(d, static_cast<float>(margin));
  const V most_x = hn::Set(d, static_cast<float>(lines.width - 1 - margin));
  const V most_y = hn::Set(d, static_cast<float>(lines.height - 1 - margin));
  const auto in_x = hn::And(hn::Ge(x, least), hn::Lt(x, most_x));
  const auto in_y = hn::And(hn::Ge(y, least), hn::Lt(y, most_y));
  return hn::AllTrue(d, hn::And(in_x, in_y));
}

HWY_INLINE bool IsLow(LicIntegrator integrator) {
  return integrator == LicIntegrator::kEuler || integrator == LicIntegrator::kMidpoint;
}
// Which integrators code is made for: those of low order, the others, or both.
enum class Orders { kLow, kHigh, kAny };

// kChecked: lines may leave the picture; else Place::near_uv is there.
template <bool kChecked, Orders kOrders = Orders::kAny>
class Walker {
 public:
  HWY_INLINE Walker(const Lines& lines, const Place& place, const Starts* starts)
      : lines_(lines), place_(place), starts_(starts) {
    row_ = hn::Set(D(), static_cast<float>(lines.uv_row / 2));
    for (int part = 0; part < kParts; ++part) {
      first_[part] = PlacesOf(place, starts[part]), base_[part] = NearBaseOf(starts[part], row_);
    }
    for (int c = 0; c < kChains; ++c) {
      p_[c] = {hn::Zero(D()), hn::Zero(D())};
      v_[c] = c < kParts ? At(c, p_[c]) : v_[c - kParts];
    }
  }

  // tap(chain, number from 1, position, inside), `taps` numbers, those of a chain one after the other.
  // `inside`: all four pixels around every position are known to exist.
  template <class Tap>
  HWY_INLINE void Run(int taps, const Tap& tap) {
    int most = 1;
    if (lines_.integrator == LicIntegrator::kAdaptive) most = lines_.taps_if_even;
    int at_once = most;
    // Lines that are caught by a sink bend within every pixel too, but have come to it by longer steps.
    bool rough = false, smooth = false;
    // Of steps from tap to tap: whether their errors are looked at, how many parts of them most lines need,
    // and a bit for each line that has ended in a sink.
    bool known = false, watched = false;
    int finer = 1;
    uint32_t still = 0;
    for (int done = 0; done < taps;) {
      int n = std::min(at_once, taps - done);
      const int parts = n == 1 ? lines_.parts * finer : 1;
      const float h = lines_.step * static_cast<float>(n) / static_cast<float>(parts);
      // Of a step that needs a smooth field half: its errors are to be those of two.
      const bool even = n > lines_.taps_at_once;
      const float limit = lines_.turn * lines_.turn * (even ? 0.5f : 1.0f);
      Asked asked{n > 1 ? limit : kNoLimit, even, rough, true};
      bool tried = true;
      V turned = hn::Zero(D());
      Stepped to[kChains];
      Mended mended;
      if (n == 1 && !known && lines_.error > 0) {
        known = true, watched = IsEvenAround(lines_, place_);
      }
      for (int i = 0; i < parts; ++i) {
        if (i > 0) Accept(to);
        asked.watched = n == 1 && watched;
        // Nobody asks for the vectors at the last tap.
        asked.ends = n > 1 || asked.watched || i + 1 < parts || done + 1 < taps;
        if (still == ~0u) {
          for (int c = 0; c < kChains; ++c) to[c] = {p_[c], v_[c], hn::Zero(D())};
          continue;
        }
        tried = Step(h, asked, to, turned);
        if (asked.watched) Mend(h, still, to, mended);
      }
      if (most > 1) {
        if (!tried || (n > 1 && !hn::AllFalse(D(), hn::Gt(turned, hn::Set(D(), limit))))) {
          at_once = n / 2;
          if (even) most = lines_.taps_at_once;
          // Half of what was tried turns by half as much: what would fail is not tried.
          V half = hn::Mul(turned, hn::Set(D(), 0.25f));
          while (!tried && at_once > 1 && TurnsSoon(half, lines_.turn * lines_.turn)) {
            at_once /= 2, half = hn::Mul(half, hn::Set(D(), 0.25f));
          }
          continue;
        }
        smooth = smooth || n > 1;
        if (mended.most > kLines / 8) {
          finer = std::min(2 * finer, kMostParts);
        } else if (n == 1 && !mended.close) {
          finer = std::max(finer / 2, 1);
        }
        if (n == 1 && asked.ends) rough = !smooth && !watched && Bent(h, to) > kPacket / 2;
        if (!rough && still == 0 && finer == 1 &&
            hn::AllFalse(D(), hn::Gt(turned, hn::Set(D(), 0.2f * limit))))
          at_once = std::min(2 * n, most);
      }
      if (n == 1) {
        HWY_UNROLL(4)
        for (int c = 0; c < kChains; ++c) {
          tap(c, done + 1, to[c].end, !kChecked || AllInside(lines_, first_[c % kParts], to[c].end));
        }
      } else {
        // Chain by chain: the polynomials stay in registers.
        const V share = hn::Set(D(), 1.0f / static_cast<float>(n)), one = hn::Set(D(), 1.0f);
        HWY_UNROLL(4)
        for (int c = 0; c < kChains; ++c) {
          const V2 start = p_[c];
          const Curve curve = Hermite(start, hn::Set(D(), SignOf(c) * h), v_[c], to[c].end, to[c].velocity);
          const bool inside = !kChecked || (Deep(c, start) && Deep(c, to[c].end));
          V number = one;
          for (int i = 1; i <= n; ++i, number = hn::Add(number, one)) {
            tap(c, done + i, curve.At(start, hn::Mul(number, share)), inside);
          }
        }
      }
      Accept(to);
      done += n;
    }
  }

 private:
  HWY_INLINE V2 At(int chain, const V2& p) const {
    const int part = chain % kParts;
    if (kChecked && (place_.near_uv == nullptr || !AllInside(lines_, first_[part], p))) {
      return VelocityAnywhere(lines_, place_, starts_[part], p);
    }
    return VelocityAt(lines_, place_, place_.near_uv, SampledNear(row_, base_[part], p));
  }
  HWY_INLINE bool Inside(const V2* p) const {
    bool inside = !kChecked || place_.near_uv != nullptr;
    for (int c = 0; kChecked && c < kChains; ++c)
      inside = inside && AllInside(lines_, first_[c % kParts], p[c]);
    return inside;
  }
  // The vectors of all chains. Where the samples are is found for all of them before the first one is taken:
  // the processor, which looks only so far ahead, would else wait for one chain after the other.
  template <bool kEven = false>
  HWY_INLINE void AtAll(const V2* p, V2* v, Evenness* even = nullptr) const {
    Sampled at[kChains];
    HWY_UNROLL(4)
    for (int c = 0; c < kChains; ++c) at[c] = SampledNear(row_, base_[c % kParts], p[c]);
    HWY_UNROLL(5)
    for (int c = 0; c <= kChains; ++c) {
      if (c < kChains) v[c] = VectorAt<kEven>(place_.near_uv, lines_.uv_row, at[c], even);
      if (c > 0 && !lines_.speed) v[c - 1] = DirectionOf<kEven>(place_, v[c - 1], even);
    }
  }
  HWY_INLINE void At(const V2* p, V2* v) const {
    if (Inside(p)) return AtAll(p, v);
    for (int c = 0; c < kChains; ++c) v[c] = VelocityAnywhere(lines_, place_, starts_[c % kParts], p[c]);
  }
  // So far inside that a step between two such places is inside: a curve that turns by 0.3 within ten pixels,
  // or by 0.2 within twenty, leaves its chord by less than one and a half.
  HWY_INLINE bool Deep(int chain, const V2& p) const {
    return AllInside(lines_, first_[chain % kParts], p, 2);
  }
  HWY_INLINE void Accept(const Stepped* to) {
    for (int c = 0; c < kChains; ++c) p_[c] = to[c].end, v_[c] = to[c].velocity;
  }
  // What was mended within a tap: the most lines of a step; whether twice the step would have been too wrong.
  struct Mended {
    int most = 0;
    bool close = false;
  };
  // Steps of their own for those lines for which the step taken is too wrong; lines in `still` stay.
  HWY_INLINE void Mend(float h, uint32_t& still, Stepped* to, Mended& mended) const {
    const D d;
    uint32_t wrong = 0, close = 0;
    HWY_UNROLL(4)
    for (int c = 0; c < kChains; ++c) {
      const auto lanes = hn::Gt(to[c].wrong, hn::Set(d, lines_.error * lines_.error));
      wrong |= BitsOf(lanes) << (c * kLanes);
      const auto near = hn::Gt(to[c].wrong, hn::Set(d, lines_.error * lines_.error / 512));
      close |= BitsOf(near) << (c * kLanes);
    }
    mended.close |= (close & ~still) != 0;
    if (HWY_LIKELY((wrong | still) == 0)) return;
    mended.most = std::max(mended.most, std::popcount(wrong & ~still));
    Tapped at;
    for (int c = 0; c < kChains; ++c) {
      const int i = c * kLanes;
      hn::Store(p_[c].x, d, at.x + i), hn::Store(p_[c].y, d, at.y + i);
      hn::Store(v_[c].x, d, at.u + i), hn::Store(v_[c].y, d, at.v + i);
      hn::Store(to[c].end.x, d, at.end_x + i), hn::Store(to[c].end.y, d, at.end_y + i);
      hn::Store(to[c].velocity.x, d, at.end_u + i), hn::Store(to[c].velocity.y, d, at.end_v + i);
    }
    wrong &= ~still;
    for (uint32_t left = still; left != 0; left &= left - 1) {
      const int l = std::countr_zero(left);
      at.end_x[l] = at.x[l], at.end_y[l] = at.y[l], at.end_u[l] = at.u[l], at.end_v[l] = at.v[l];
    }
    if (wrong != 0) still |= FollowClosely(lines_, place_, starts_, h, wrong, at);
    for (int c = 0; c < kChains; ++c) {
      const int i = c * kLanes;
      to[c].end = {hn::Load(d, at.end_x + i), hn::Load(d, at.end_y + i)};
      to[c].velocity = {hn::Load(d, at.end_u + i), hn::Load(d, at.end_v + i)};
    }
  }
  struct Asked {
    float limit;           // of the squared change of direction
    bool even;             // the field is to be smooth
    bool rough;            // the lines bend within every pixel
    bool ends;             // the vectors at the step's ends are wanted
    bool watched = false;  // and Stepped::wrong
  };
  // One step of the integrator; `turned`: the largest squared change of direction met. False, with no more
  // done, where the first half of the step shows that it turns by more than the square root of the limit,
  // which is then `turned`, or the field to be not smooth.
  HWY_INLINE bool Step(float h, const Asked& asked, Stepped* to, V& turned) const {
    const D d;
    V2 k4[kChains];
    if (kOrders == Orders::kLow || (kOrders == Orders::kAny && IsLow(lines_.integrator))) {
      V2 slope[kChains];
      for (int c = 0; c < kChains; ++c) slope[c] = v_[c];
      if (lines_.integrator == LicIntegrator::kMidpoint) {
        V2 at[kChains];
        for (int c = 0; c < kChains; ++c) at[c] = Ahead(c, p_[c], hn::Set(d, 0.5f * h), slope[c]);
        At(at, slope);
      }
      for (int c = 0; c < kChains; ++c) to[c].end = Ahead(c, p_[c], hn::Set(d, h), slope[c]);
    } else {
      const V whole = hn::Set(d, h), half = hn::Set(d, 0.5f * h), sixth = hn::Set(d, h / 6.0f);
      const V two = hn::Set(d, 2.0f);
      const bool adaptive = lines_.integrator == LicIntegrator::kAdaptive;
      V2 at[kChains], k2[kChains], k3[kChains];
      HWY_UNROLL(4)
      for (int c = 0; c < kChains; ++c) at[c] = Ahead(c, p_[c], half, v_[c]);
      Evenness found{hn::Zero(d), hn::Set(d, hwy::HighestValue<float>())};
      if (asked.even) {
        if (!Inside(at)) return false;
        AtAll<true>(at, k2, &found);
      } else {
        At(at, k2);
      }
      if (adaptive && asked.limit < kNoLimit) {
        V half_turned = hn::Zero(d);
        HWY_UNROLL(4)
        for (int c = 0; c < kChains; ++c) half_turned = hn::Max(half_turned, Turn(v_[c], k2[c]));
        if (TurnsSoon(half_turned, asked.limit)) {
          turned = half_turned;
          return false;
        }
      }
      if (asked.even) {
        const float twist = hn::GetLane(hn::MaxOfLanes(d, found.twist));
        const float squared = hn::GetLane(hn::MinOfLanes(d, found.squared));
        if (!(twist * twist <= kEven * kEven * squared)) return false;
      }
      if (asked.rough) {
        Third(h, k2, to);
      } else {
        HWY_UNROLL(4)
        for (int c = 0; c < kChains; ++c) at[c] = Ahead(c, p_[c], half, k2[c]);
        At(at, k3);
        HWY_UNROLL(4)
        for (int c = 0; c < kChains; ++c) at[c] = Ahead(c, p_[c], whole, k3[c]);
        At(at, k4);
        HWY_UNROLL(4)
        for (int c = 0; c < kChains; ++c) {
          const V2 sum{hn::MulAdd(two, hn::Add(k2[c].x, k3[c].x), hn::Add(v_[c].x, k4[c].x)),
                       hn::MulAdd(two, hn::Add(k2[c].y, k3[c].y), hn::Add(v_[c].y, k4[c].y))};
          to[c].end = Ahead(c, p_[c], sixth, sum);
        }
        if (adaptive) {
          HWY_UNROLL(4)
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
    }
    if (!asked.ends) return true;
    V2 ends[kChains], last[kChains];
    HWY_UNROLL(4)
    for (int c = 0; c < kChains; ++c) ends[c] = to[c].end;
    At(ends, last);
    HWY_UNROLL(4)
    for (int c = 0; c < kChains; ++c) to[c].velocity = last[c];
    if (kOrders != Orders::kLow && asked.watched) {
      const V sixth = hn::Set(d, h * h / 36);
      for (int c = 0; c < kChains; ++c) to[c].wrong = hn::Mul(sixth, Turn(k4[c], last[c]));
    }
    return true;
  }
  // The end of a step of third order, stages at 1/2 and 4/5. Where the vector has kinks within the step its
  // error is about that of the fourth order, which then is not one either.
  HWY_INLINE void Third(float h, const V2* k2, Stepped* to) const {
    const D d;
    const V back = hn::Set(d, -0.16f * h), on = hn::Set(d, 0.96f * h);
    const V b1 = hn::Set(d, h * (5.0f / 24)), b2 = hn::Set(d, h * (4.0f / 9)),
            b3 = hn::Set(d, h * (25.0f / 72));
    V2 at[kChains], k3[kChains];
    HWY_UNROLL(4)
    for (int c = 0; c < kChains; ++c) at[c] = Ahead(c, Ahead(c, p_[c], back, v_[c]), on, k2[c]);
    At(at, k3);
    HWY_UNROLL(4)
    for (int c = 0; c < kChains; ++c) {
      to[c].end = Ahead(c, Ahead(c, Ahead(c, p_[c], b1, v_[c]), b2, k2[c]), b3, k3[c]);
    }
  }
  // The number of lines whose mean vector over a step is so far from the mean of those at its ends that no
  // order helps.
  HWY_INLINE int Bent(float h, const Stepped* to) const {
    const D d;
    size_t bent = 0;
    HWY_UNROLL(4)
    for (int c = 0; c < kChains; ++c) {
      const V twice = hn::Set(d, SignOf(c) * 2 / h);
      const V2 sum{hn::Add(v_[c].x, to[c].velocity.x), hn::Add(v_[c].y, to[c].velocity.y)};
      const V x = hn::NegMulAdd(twice, hn::Sub(to[c].end.x, p_[c].x), sum.x);
      const V y = hn::NegMulAdd(twice, hn::Sub(to[c].end.y, p_[c].y), sum.y);
      bent += hn::CountTrue(d, hn::Gt(hn::MulAdd(x, x, hn::Mul(y, y)), hn::Set(d, 4 * kBent * kBent)));
    }
    return static_cast<int>(bent);
  }
  // Whether half a step that turns so much is half of one that turns too much.
  static HWY_INLINE bool TurnsSoon(V half_turned, float limit) {
    return !hn::AllFalse(D(), hn::Gt(half_turned, hn::Set(D(), kHalfTurn * limit)));
  }
  static HWY_INLINE V Turn(const V2& a, const V2& b) {
    const V x = hn::Sub(b.x, a.x), y = hn::Sub(b.y, a.y);
    return hn::MulAdd(x, x, hn::Mul(y, y));
  }
  static constexpr int kMostParts = 8;
  static constexpr float kUneven = 4, kBend = 64;
  // What half a step may turn by, as a share of the whole one's; squares.
  static constexpr float kHalfTurn = 0.4f, kNoLimit = 1e9f;
  static constexpr float kBent = 0.1f;
  // The largest second difference between neighbouring pixels of a smooth field, of the vectors' length.
  static constexpr float kEven = 2e-4f;

  const Lines& lines_;
  const Place& place_;
  const Starts* starts_;
  V2 first_[kParts];  // the starts as places in the picture
  V row_, base_[kParts];
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
