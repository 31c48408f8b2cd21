// What a surface does around each texel of a row: everything in double, and the same bits on every target.
#include <cfloat>
#include <cstdlib>
#include <limits>
#include <memory>

#include "ops/shade/shadow_map.h"
#include "ops/shade/shadow_surface.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/shade/shadow_surface_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/doubles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::DD;
using s::SetD;
using s::VD;
using MD = hn::Mask<DD>;
namespace {

HWY_INLINE VD LoadD(const float* p) { return hn::PromoteTo(DD(), hn::LoadU(hn::Rebind<float, DD>(), p)); }
HWY_INLINE MD Hit(VD depth) { return hn::Lt(depth, SetD(1)); }
// std::min and std::max, whatever the target makes of NaN.
HWY_INLINE VD Least(VD a, VD b) { return hn::IfThenElse(hn::Lt(b, a), b, a); }
HWY_INLINE VD Most(VD a, VD b) { return hn::IfThenElse(hn::Lt(a, b), b, a); }

// Of estimates of one thing: the largest magnitude, but at most twice the smallest; 0 where their signs
// differ, as they do beside an edge. Of a smooth surface all are much alike.
class Agreed {
 public:
  HWY_INLINE Agreed()
      : least_(SetD(DBL_MAX)), most_(hn::Zero(DD())), up_(hn::MaskFromVec(hn::Zero(DD()))), down_(up_) {}
  HWY_INLINE void Add(VD estimate, MD counts) {
    const VD size = hn::Abs(estimate), zero = hn::Zero(DD());
    least_ = hn::IfThenElse(counts, Least(least_, size), least_);
    most_ = hn::IfThenElse(counts, Most(most_, size), most_);
    up_ = hn::Or(up_, hn::And(counts, hn::Gt(estimate, zero)));
    down_ = hn::Or(down_, hn::And(counts, hn::Lt(estimate, zero)));
  }
  HWY_INLINE VD size() const {
    return hn::IfThenZeroElse(hn::And(up_, down_), Least(most_, hn::Add(least_, least_)));
  }

 private:
  VD least_, most_;
  MD up_, down_;
};

// What a surface does along a line of five texels around the middle one: its slope per texel, and how it
// bends. A neighbour on another surface differs much more and does not count.
HWY_INLINE void CourseOf(const VD (&m)[5], const MD (&hit)[5], VD& slope, VD& bend) {
  const VD before = hn::Sub(m[2], m[1]), after = hn::Sub(m[3], m[2]);
  const VD one = hn::Abs(before), other = hn::Abs(after), least = Least(one, other);
  // Where it turns, the mean; the bend says the rest.
  const MD turns = hn::Lt(hn::Mul(before, after), hn::Zero(DD()));
  const VD most = hn::IfThenElse(turns, hn::Mul(SetD(0.5), hn::Abs(hn::Sub(m[3], m[1]))), Most(one, other));
  const VD between = Least(most, hn::Add(least, least));
  const VD beside = hn::IfThenElse(hit[1], one, hn::IfThenElseZero(hit[3], other));
  slope = hn::IfThenElse(hn::And(hit[1], hit[3]), between, beside);
  Agreed bends;
  for (int k = 0; k < 3; ++k) {
    bends.Add(hn::Add(hn::Sub(m[k], hn::Add(m[k + 1], m[k + 1])), m[k + 2]),
              hn::And(hit[k], hn::And(hit[k + 1], hit[k + 2])));
  }
  bend = bends.size();
}

// The surfaces of a vector of texels.
class SurfaceHere {
 public:
  HWY_INLINE SurfaceHere(const SurfaceRow& row, ptrdiff_t at)
      : slope_x_(hn::LoadU(DD(), row.plane[0] + at)),
        bend_x_(hn::LoadU(DD(), row.plane[1] + at)),
        slope_y_(hn::LoadU(DD(), row.plane[2] + at)),
        bend_y_(hn::LoadU(DD(), row.plane[3] + at)),
        twist_(hn::LoadU(DD(), row.plane[4] + at)) {}
  // How much deeper they may be so many texels away.
  HWY_INLINE VD Deeper(VD dx, VD dy) const {
    const VD slopes = hn::Add(hn::Mul(slope_x_, dx), hn::Mul(slope_y_, dy));
    const VD bends = hn::Add(hn::Mul(hn::Mul(bend_x_, dx), dx), hn::Mul(hn::Mul(bend_y_, dy), dy));
    return hn::Add(hn::Add(slopes, hn::Mul(SetD(0.5), bends)), hn::Mul(hn::Mul(twist_, dx), dy));
  }

 private:
  VD slope_x_, bend_x_, slope_y_, bend_y_, twist_;
};

class TargetKernel final : public SurfaceKernel {
 public:
  void Surfaces(const float* middle, ptrdiff_t stride, int count, const SurfaceRow& to) const override {
    const DD d;
    for (int x = 0; x < count; x += static_cast<int>(hn::Lanes(d))) {
      const float* const p = middle + x;
      VD across[5], down[5], slope, bend;
      MD hit_across[5], hit_down[5];
      for (int k = 0; k < 5; ++k) {
        across[k] = LoadD(p + k - 2), down[k] = LoadD(p + (k - 2) * stride);
        hit_across[k] = Hit(across[k]), hit_down[k] = Hit(down[k]);
      }
      CourseOf(across, hit_across, slope, bend);
      hn::StoreU(slope, d, to.plane[0] + x), hn::StoreU(bend, d, to.plane[1] + x);
      CourseOf(down, hit_down, slope, bend);
      hn::StoreU(slope, d, to.plane[2] + x), hn::StoreU(bend, d, to.plane[3] + x);
      Agreed twists;
      for (const int dy : {-1, 1}) {
        for (const int dx : {-1, 1}) {
          const VD corner = LoadD(p + dy * stride + dx), beside = across[2 + dx], below = down[2 + dy];
          const VD twist = hn::Add(hn::Sub(hn::Sub(corner, beside), below), across[2]);
          twists.Add(dx * dy > 0 ? twist : hn::Neg(twist),
                     hn::And(Hit(corner), hn::And(hit_down[2 + dy], hit_across[2 + dx])));
        }
      }
      hn::StoreU(twists.size(), d, to.plane[4] + x);
    }
  }

  void Deeper(const float* middle, ptrdiff_t stride, int count, const SurfaceRow& here, ptrdiff_t next,
              double reach, int around, float* scratch, double* deeper) const override {
    const DD d;
    DeepestOfColumns(middle, stride, count, around, scratch);
    for (int x = 0; x < count; x += static_cast<int>(hn::Lanes(d))) {
      const float* const p = middle + x;
      const VD m = LoadD(p);
      const SurfaceHere surface(here, x);
      VD most = surface.Deeper(SetD(reach), SetD(reach));
      VD deepest = LoadD(scratch + x);
      for (int k = 1; k <= 2 * around; ++k) deepest = hn::Max(deepest, LoadD(scratch + x + k));
      // Most surfaces are smooth, and what they foretell is the most there is.
      const MD rough = hn::And(Hit(m), hn::Gt(hn::Sub(deepest, m), most));
      for (int dy = -around; dy <= around && !hn::AllFalse(d, rough); ++dy) {
        for (int dx = -around; dx <= around; ++dx) {
          const VD there = LoadD(p + dy * stride + dx), difference = hn::Sub(there, m);
          MD own = hn::And(hn::And(rough, Hit(there)), hn::Gt(difference, most));
          if (hn::AllFalse(d, own)) continue;
          const VD right = SetD(std::abs(dx)), down = SetD(std::abs(dy)), surprise = SetD(kShadowSurprise);
          const auto foretold = [&](const SurfaceHere& by) HWY_ATTR {
            return hn::Not(hn::Gt(difference, hn::Mul(surprise, by.Deeper(right, down))));
          };
          own = hn::And(own, hn::And(foretold(surface), foretold(SurfaceHere(here, dy * next + x + dx))));
          most = hn::IfThenElse(own, difference, most);
        }
      }
      hn::StoreU(most, d, deeper + x);
    }
  }

 private:
  // Of what is hit up to so far above and below, from so far to the left on.
  static void DeepestOfColumns(const float* middle, ptrdiff_t stride, int count, int around, float* to) {
    const s::D d;
    const auto one = hn::Set(d, 1.0f);
    for (int x = 0; x < count + 2 * around; x += static_cast<int>(hn::Lanes(d))) {
      auto deepest = hn::Set(d, -std::numeric_limits<float>::infinity());
      for (int y = -around; y <= around; ++y) {
        const auto m = hn::LoadU(d, middle + y * stride + x - around);
        deepest = hn::IfThenElse(hn::And(hn::Lt(m, one), hn::Gt(m, deepest)), m, deepest);
      }
      hn::StoreU(deepest, d, to + x);
    }
  }
};

std::unique_ptr<const SurfaceKernel> MakeTargetKernel() { return std::make_unique<const TargetKernel>(); }

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MakeTargetKernel);
std::unique_ptr<const SurfaceKernel> MakeSurfaceKernel() { return HWY_DYNAMIC_DISPATCH(MakeTargetKernel)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
