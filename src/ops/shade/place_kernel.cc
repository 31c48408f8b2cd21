// Places on blocks of pixels, in double: depths, points from depths, points through a matrix.
#include "ops/shade/place_kernel.h"

#include <cmath>
#include <limits>
#include <memory>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/shade/place_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/doubles-inl.h"
#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::DD;
using s::EachPart;
using s::Join;
using s::kParts;
using s::LengthOf;
using s::Part;
using s::RowTimes;
using s::SetD;
using s::V;
using s::VD;
namespace {

HWY_INLINE VD RayTimes(const double (&ray)[3][3], int axis, VD x, VD y) {
  return hn::MulAdd(SetD(ray[2][axis]), y, hn::MulAdd(SetD(ray[1][axis]), x, SetD(ray[0][axis])));
}

// Depths of any kind to planar ones and back.
struct DepthConversion {
  DepthPlan plan;

  template <int kPart>
  HWY_INLINE VD RayLength(VD x, VD y) const {
    const auto& r = plan.rays.direction;
    return LengthOf(RayTimes(r, 0, x, y), RayTimes(r, 1, x, y), RayTimes(r, 2, x, y));
  }
  template <int kPart>
  HWY_INLINE VD Planar(VD depth, VD x, VD y) const {
    const double n = plan.params.near, f = plan.params.far;
    switch (plan.params.from) {
      case DepthKind::kPlanar:
        return depth;
      case DepthKind::kEuclidean:
        return hn::Div(depth, RayLength<kPart>(x, y));
      default: {
        const VD one = SetD(1);
        if (plan.params.from == DepthKind::kReversedWindow) depth = hn::Sub(one, depth);
        if (plan.params.parallel) return hn::MulAdd(depth, SetD(f - n), SetD(n));
        if (std::isinf(f)) return hn::Div(SetD(n), hn::Sub(one, depth));
        return hn::Div(SetD(n * f), hn::NegMulAdd(depth, SetD(f - n), SetD(f)));
      }
    }
  }
  template <int kPart>
  HWY_INLINE VD FromPlanar(VD depth, VD x, VD y) const {
    const double n = plan.params.near, f = plan.params.far;
    switch (plan.params.to) {
      case DepthKind::kPlanar:
        return depth;
      case DepthKind::kEuclidean:
        return hn::Mul(depth, RayLength<kPart>(x, y));
      default: {
        if (plan.params.parallel) {
          const VD past = plan.params.to == DepthKind::kReversedWindow ? hn::Sub(SetD(f), depth)
                                                                       : hn::Sub(depth, SetD(n));
          return hn::Div(past, SetD(f - n));
        }
        // f/(f-n) - n f/((f-n) z), or n f/((f-n) z) - n/(f-n).
        const bool endless = std::isinf(f);
        const VD share = hn::Div(SetD(endless ? n : n * f / (f - n)), depth);
        if (plan.params.to == DepthKind::kReversedWindow)
          return hn::Sub(share, SetD(endless ? 0 : n / (f - n)));
        return hn::Sub(SetD(endless ? 1 : f / (f - n)), share);
      }
    }
  }
};

class DepthStage final : public graph::PointStage {
 public:
  explicit DepthStage(const DepthPlan& plan) : conversion_{plan} {}
  void Run(const graph::PointArgs& args) const override {
    s::RunPoint<1>(args, [this](const s::Pixels& p, s::Position at) HWY_ATTR {
      const V x = at.XFloat();
      return s::Map(p, [&](V depth) HWY_ATTR {
        VD parts[kParts];
        EachPart([&]<int kPart>() HWY_ATTR {
          const VD px = Part<kPart>(x), py = SetD(at.y());
          parts[kPart] =
              conversion_.FromPlanar<kPart>(conversion_.Planar<kPart>(Part<kPart>(depth), px, py), px, py);
        });
        return Join(parts);
      });
    });
  }

 private:
  DepthConversion conversion_;
};

class PositionStage final : public graph::PointStage {
 public:
  explicit PositionStage(const DepthPlan& plan) : conversion_{plan} {}
  void Run(const graph::PointArgs& args) const override {
    s::RunPoint<1>(args, [this](const s::Pixels& p, s::Position at) HWY_ATTR {
      const V column = at.XFloat();
      VD parts[3][kParts];
      EachPart([&]<int kPart>() HWY_ATTR {
        const VD x = Part<kPart>(column), y = SetD(at.y());
        const VD t = conversion_.Planar<kPart>(Part<kPart>(p.r), x, y);
        const PixelRays& rays = conversion_.plan.rays;
        for (int k = 0; k < 3; ++k) {
          const VD direction = RayTimes(rays.direction, k, x, y);
          // A ray that has no part of an axis stays where it is, however deep.
          const auto none = hn::And(hn::Eq(direction, hn::Zero(DD())), hn::Eq(t, t));
          parts[k][kPart] = hn::Add(RayTimes(rays.origin, k, x, y),
                                    hn::IfThenElse(none, hn::Zero(DD()), hn::Mul(direction, t)));
        }
      });
      return s::Pixels{Join(parts[0]), Join(parts[1]), Join(parts[2]), p.a};
    });
  }

 private:
  DepthConversion conversion_;
};

struct TransformKernel {
  TransformPlan plan;
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    VD parts[3][kParts];
    EachPart([&]<int kPart>() HWY_ATTR {
      const VD x = Part<kPart>(p.r), y = Part<kPart>(p.g), z = Part<kPart>(p.b);
      VD w = SetD(1);
      if (plan.divide) {
        w = RowTimes(plan.matrix + 12, x, y, z);
        const VD nan = SetD(std::numeric_limits<double>::quiet_NaN());
        w = hn::IfThenElse(hn::Eq(w, hn::Zero(DD())), nan, w);
      }
      for (int k = 0; k < 3; ++k) {
        const VD v = RowTimes(plan.matrix + 4 * k, x, y, z);
        parts[k][kPart] = plan.divide ? hn::Div(v, w) : v;
      }
    });
    // Which of several NaN a sum passes on depends on the compiler: all leave as the same one.
    const auto one_nan = [](V v) HWY_ATTR { return hn::IfThenElse(hn::IsNaN(v), hn::NaN(s::D()), v); };
    return {one_nan(Join(parts[0])), one_nan(Join(parts[1])), one_nan(Join(parts[2])), p.a};
  }
};

struct FogAxesKernel {
  FogAxesPlan plan;
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    VD d[kParts], h[kParts];
    EachPart([&]<int kPart>() HWY_ATTR {
      const VD y = Part<kPart>(p.g);
      d[kPart] = hn::Mul(LengthOf(hn::Sub(Part<kPart>(p.r), SetD(plan.eye[0])), hn::Sub(y, SetD(plan.eye[1])),
                                  hn::Sub(Part<kPart>(p.b), SetD(plan.eye[2]))),
                         SetD(plan.distance_scale));
      h[kPart] = hn::Mul(hn::Sub(y, SetD(plan.low)), SetD(plan.height_scale));
    });
    return {Join(d), Join(h), hn::Set(s::D(), static_cast<float>(plan.constant)), p.a};
  }
};

struct MaskKernel {
  HWY_INLINE s::Pixels operator()(const s::Pixels& p, const s::Pixels& mask) const {
    const s::D d;
    const V nan = hn::Set(d, std::numeric_limits<float>::quiet_NaN());
    return s::Map(p, mask, [&](V v, V m) HWY_ATTR { return hn::IfThenElse(hn::Gt(m, hn::Zero(d)), v, nan); });
  }
};

std::unique_ptr<graph::PointStage> MakeDepth(const DepthPlan& plan) {
  return std::make_unique<DepthStage>(plan);
}
std::unique_ptr<graph::PointStage> MakePosition(const DepthPlan& plan) {
  return std::make_unique<PositionStage>(plan);
}
std::unique_ptr<graph::PointStage> MakeTransform(const TransformPlan& plan) {
  return s::MakeFusedStage<1>(TransformKernel{plan});
}
std::unique_ptr<graph::PointStage> MakeFogAxes(const FogAxesPlan& plan) {
  return s::MakeFusedStage<1>(FogAxesKernel{plan});
}
std::unique_ptr<graph::PointStage> MakeMask() { return s::MakeFusedStage<2>(MaskKernel{}); }

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MakeDepth);
HWY_EXPORT(MakePosition);
HWY_EXPORT(MakeTransform);
HWY_EXPORT(MakeFogAxes);
HWY_EXPORT(MakeMask);

std::unique_ptr<graph::PointStage> MakeDepthStage(const DepthPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(MakeDepth)(plan);
}
std::unique_ptr<graph::PointStage> MakePositionStage(const DepthPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(MakePosition)(plan);
}
std::unique_ptr<graph::PointStage> MakeTransformStage(const TransformPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(MakeTransform)(plan);
}
std::unique_ptr<graph::PointStage> MakeFogAxesStage(const FogAxesPlan& plan) {
  return HWY_DYNAMIC_DISPATCH(MakeFogAxes)(plan);
}
std::unique_ptr<graph::PointStage> MakeMaskStage() { return HWY_DYNAMIC_DISPATCH(MakeMask)(); }

PixelRays RaysOf(const Camera& camera, const Roi& window) {
  // Affine in clip coordinates, which are affine in pixels.
  const auto at = [&](double x, double y) { return camera.PixelRay(window, x, y); };
  const Camera::Ray zero = at(0, 0), x = at(1, 0), y = at(0, 1);
  PixelRays rays;
  for (size_t k = 0; k < 3; ++k) {
    rays.origin[0][k] = zero.origin[k];
    rays.origin[1][k] = x.origin[k] - zero.origin[k];
    rays.origin[2][k] = y.origin[k] - zero.origin[k];
    rays.direction[0][k] = zero.direction[k];
    rays.direction[1][k] = x.direction[k] - zero.direction[k];
    rays.direction[2][k] = y.direction[k] - zero.direction[k];
  }
  return rays;
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
