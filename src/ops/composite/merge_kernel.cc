// Kernels over lists of images: depth merge, depth complexity, decals.
#include <algorithm>
#include <memory>

#include "ops/composite/pick_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/composite/merge_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/composite/planes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
using s::Pixels;
using s::V;
using M = hn::Mask<s::D>;

HWY_INLINE V Zero() { return hn::Zero(s::D()); }
HWY_INLINE Pixels Pick(M m, const Pixels& a, const Pixels& b) {
  return s::Map(a, b, [m](V va, V vb) HWY_ATTR { return hn::IfThenElse(m, va, vb); });
}
// Whether depth z is in front of the nearest so far: any number is in front of NaN.
HWY_INLINE M InFront(V z, V nearest) {
  return hn::Or(hn::Lt(z, nearest), hn::AndNot(hn::IsNaN(z), hn::IsNaN(nearest)));
}

// f(i) -> Pixels at every vector of the block.
template <class F>
HWY_INLINE void ForBlock(const graph::PointArgs& args, const F& f) {
  float* const out[4] = {args.out[0], args.out[1], args.out[2], args.out[3]};
  for (int i = 0; i < args.count; i += s::kLanes) s::StorePlanes(f(i), out, i);
}
HWY_INLINE V OnlyPlane(const graph::PointArgs& args, int input, int i) {
  return hn::LoadU(s::D(), args.in[input][0] + i);
}

class Nearest final : public graph::PointStage {
 public:
  explicit Nearest(int images) : n_(images) {}
  void Run(const graph::PointArgs& args) const override {
    ForBlock(args, [&](int i) HWY_ATTR {
      Pixels best = s::LoadPlanes(args.in[0], i);
      V z = OnlyPlane(args, 2 * n_, i);
      for (int k = 1; k < n_; ++k) {
        const V zk = OnlyPlane(args, 2 * n_ + k, i);
        const M take = InFront(zk, z);
        best = Pick(take, s::LoadPlanes(args.in[k], i), best);
        z = hn::IfThenElse(take, zk, z);
      }
      return best;
    });
  }

 private:
  int n_;
};

// Front to back: every turn takes the nearest image not taken yet and puts it below what is there.
class SortedOver final : public graph::PointStage {
 public:
  SortedOver(int images, const ChannelRole (&roles)[4]) : n_(images) { std::copy_n(roles, 4, roles_); }
  void Run(const graph::PointArgs& args) const override {
    ForBlock(args, [&](int i) HWY_ATTR { return Merge(args, i); });
  }

 private:
  HWY_INLINE Pixels Merge(const graph::PointArgs& args, int i) const {
    const s::D d;
    const s::DI di;
    Pixels sum{Zero(), Zero(), Zero(), Zero()};
    V below = hn::Set(d, 1.0f);  // what the layers so far let through
    s::VI taken[kMostSorted / 32] = {};
    for (auto& bits : taken) bits = hn::Zero(di);
    M seen = hn::Lt(Zero(), Zero());  // a layer with alpha has given its depth
    for (int turn = 0; turn < n_; ++turn) {
      Pixels front{Zero(), Zero(), Zero(), Zero()};
      V alpha = Zero(), z = Zero();
      s::VI which = hn::Set(di, -1);
      for (int k = 0; k < n_; ++k) {
        const V zk = OnlyPlane(args, 2 * n_ + k, i);
        const auto free = hn::RebindMask(d, hn::Eq(hn::And(taken[k / 32], Bit(k)), hn::Zero(di)));
        const auto first = hn::RebindMask(d, hn::Eq(which, hn::Set(di, -1)));
        const M take = hn::And(free, hn::Or(first, InFront(zk, z)));
        front = Pick(take, s::LoadPlanes(args.in[k], i), front);
        alpha = hn::IfThenElse(take, OnlyPlane(args, n_ + k, i), alpha);
        z = hn::IfThenElse(take, zk, z);
        which = hn::IfThenElse(hn::RebindMask(di, take), hn::Set(di, k), which);
      }
      for (int k = 0; k < n_; ++k) {
        taken[k / 32] = hn::Or(taken[k / 32], hn::IfThenElseZero(hn::Eq(which, hn::Set(di, k)), Bit(k)));
      }
      const bool last = turn + 1 == n_;
      const M shown = hn::Or(hn::Gt(alpha, Zero()), hn::IsNaN(alpha));
      const M gives = hn::AndNot(seen, last ? hn::Not(hn::Lt(Zero(), Zero())) : shown);
      const auto add = [&](int c, V acc, V v) HWY_ATTR {
        return roles_[c] == ChannelRole::kDepth ? hn::IfThenElse(gives, v, acc) : hn::MulAdd(below, v, acc);
      };
      sum = {add(0, sum.r, front.r), add(1, sum.g, front.g), add(2, sum.b, front.b), add(3, sum.a, front.a)};
      seen = hn::Or(seen, shown);
      below = hn::Mul(below,
                      hn::Sub(hn::Set(d, 1.0f), s::ClampHigh(s::ClampLow(alpha, Zero()), hn::Set(d, 1.0f))));
    }
    return sum;
  }
  static HWY_INLINE s::VI Bit(int k) { return hn::Set(s::DI(), static_cast<int32_t>(1u << (k % 32))); }

  int n_;
  ChannelRole roles_[4];
};

class DepthCount final : public graph::PointStage {
 public:
  DepthCount(int images, float far) : n_(images), far_(far) {}
  void Run(const graph::PointArgs& args) const override {
    const s::D d;
    const V far = hn::Set(d, far_), one = hn::Set(d, 1.0f);
    ForBlock(args, [&](int i) HWY_ATTR {
      V count = Zero();
      for (int k = 0; k < n_; ++k) {
        count = hn::Add(count, hn::IfThenElseZero(hn::Lt(OnlyPlane(args, k, i), far), one));
      }
      return Pixels{count, count, count, count};
    });
  }

 private:
  int n_;
  float far_;
};

class DecalStage final : public graph::PointStage {
 public:
  DecalStage(int decals, float threshold, const ChannelRole (&roles)[4]) : n_(decals), threshold_(threshold) {
    std::copy_n(roles, 4, roles_);
  }
  void Run(const graph::PointArgs& args) const override {
    const s::D d;
    const V threshold = hn::Set(d, threshold_), one = hn::Set(d, 1.0f);
    ForBlock(args, [&](int i) HWY_ATTR {
      const Pixels base = s::LoadPlanes(args.in[0], i);
      const M inside = hn::Gt(OnlyPlane(args, 1, i), Zero());
      Pixels top = base;
      V alpha = Zero();
      M found = hn::Lt(Zero(), Zero());
      for (int k = n_ - 1; k >= 0; --k) {  // the first decal is on top: it replaces what others left
        const V a = OnlyPlane(args, 2 + n_ + k, i);
        const M passes = hn::And(inside, hn::Gt(a, threshold));
        top = Pick(passes, s::LoadPlanes(args.in[2 + k], i), top);
        alpha = hn::IfThenElse(passes, a, alpha);
        found = hn::Or(found, passes);
      }
      const V rest = hn::Sub(one, s::ClampHigh(s::ClampLow(alpha, Zero()), one));
      const auto over = [&](int c, V t, V b) HWY_ATTR {
        const V v = roles_[c] == ChannelRole::kDepth ? b : hn::MulAdd(rest, b, t);
        return hn::IfThenElse(found, v, b);
      };
      return Pixels{over(0, top.r, base.r), over(1, top.g, base.g), over(2, top.b, base.b),
                    over(3, top.a, base.a)};
    });
  }

 private:
  int n_;
  float threshold_;
  ChannelRole roles_[4];
};

std::unique_ptr<graph::PointStage> NewDepthMerge(int images, bool over, const ChannelRole (&roles)[4]) {
  if (over) return std::make_unique<SortedOver>(images, roles);
  return std::make_unique<Nearest>(images);
}
std::unique_ptr<graph::PointStage> NewDepthCount(int images, float far) {
  return std::make_unique<DepthCount>(images, far);
}
std::unique_ptr<graph::PointStage> NewDecals(int decals, float threshold, const ChannelRole (&roles)[4]) {
  return std::make_unique<DecalStage>(decals, threshold, roles);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewDepthMerge);
HWY_EXPORT(NewDepthCount);
HWY_EXPORT(NewDecals);

std::unique_ptr<graph::PointStage> MakeDepthMergeStage(int images, bool over, const ChannelRole (&roles)[4]) {
  return HWY_DYNAMIC_DISPATCH(NewDepthMerge)(images, over, roles);
}
std::unique_ptr<graph::PointStage> MakeDepthCountStage(int images, float far) {
  return HWY_DYNAMIC_DISPATCH(NewDepthCount)(images, far);
}
std::unique_ptr<graph::PointStage> MakeDecalStage(int decals, float threshold,
                                                  const ChannelRole (&roles)[4]) {
  return HWY_DYNAMIC_DISPATCH(NewDecals)(decals, threshold, roles);
}

}  // namespace tessera::ops
#endif
