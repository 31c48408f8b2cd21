// Opacity volumes: transmittances from nodes to the light, each by a march of its own.
#include <algorithm>
#include <cstdint>

#include "ops/volume/march.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/volume/opacity_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/volume/walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

// Beyond that nothing is seen of the light: exp(-30) is 1e-13.
inline constexpr float kDark = 30;

// The ray from a node (voxels) to the light, s in world units.
HWY_INLINE Ray ToTheLight(const MediumArgs& args, const Vec3& node) {
  const D d;
  const RaySet& set = args.rays;
  const Vec3 l = ToLight(set, args.towards, node);
  Ray r;
  r.origin = node;
  r.direction = {hn::Mul(l.x, Set(1 / set.spacing[0])), hn::Mul(l.y, Set(1 / set.spacing[1])),
                 hn::Mul(l.z, Set(1 / set.spacing[2]))};
  r.length = hn::Sqrt(Dot(r.direction, r.direction));
  r.world = Set(1);
  r.begin = hn::Zero(d);
  r.end = Set(1e30f);
  if (args.towards.point) {
    const auto away = [&](V v, int a) HWY_ATTR {
      return hn::Sub(Set(args.towards.direction[a]),
                     hn::MulAdd(v, Set(set.spacing[a]), Set(set.to_world[a])));
    };
    const Vec3 way = {away(node.x, 0), away(node.y, 1), away(node.z, 2)};
    r.end = hn::Sqrt(Dot(way, way));
  }
  Clip(set, r);
  r.enter = hn::Zero(d);  // samples are counted from the node
  return r;
}

template <typename T>
HWY_INLINE V Extinction(const MediumArgs& args, const Medium<T>& medium, const Ray& ray, const Walk& walk,
                        V along, M active) {
  if (!args.hyper) return medium.Density(ray, along, hn::Mul(Set(0.5f), walk.lattice.step), walk.to_eye).a;
  const Vec3 p[1] = {At(ray, along)};
  M lanes[1] = {active};
  Sample sample[1];
  if (!medium.Hyper(p, lanes, sample)) return hn::Zero(D());
  return hn::IfThenElseZero(lanes[0], ColorOf(args.transfer, sample[0].value).a);
}

template <typename T>
void FillType(const MediumArgs& args, const OpacityView& o, int64_t row, float* nodes) {
  const D d;
  const Medium<T> medium(args);
  const auto axis = [&](V at, int a) HWY_ATTR {
    const V v = hn::Mul(hn::Sub(at, Set(o.plus[a])), Set(1 / o.times[a]));
    return hn::Min(hn::Max(v, Set(args.rays.low[a])), Set(args.rays.high[a]));
  };
  const auto y = static_cast<float>(row % o.size[1]), z = static_cast<float>(row / o.size[1]);
  for (int x = 0; x < o.size[0]; x += kLanes) {
    const V at = hn::Add(Set(static_cast<float>(x)), hn::ConvertTo(d, hn::Iota(DI(), 0)));
    const Ray ray = ToTheLight(args, {axis(at, 0), axis(Set(y), 1), axis(Set(z), 2)});
    const Walk walk(args, ray, 0, 1);
    V depth = hn::Zero(d);
    V i = walk.First();
    M active = hn::And(ray.hits, walk.Holds(i));
    while (walk.Leap(args.field, ray, i, active)) {
      const V along = walk.Along(i);
      const V share = hn::IfThenElseZero(active, ShareOf(ray, along, walk.per_step));
      const V extinction = Extinction(args, medium, ray, walk, along, active);
      depth = hn::MulAdd(hn::Mul(extinction, walk.length), share, depth);
      active = hn::And(active, hn::Lt(depth, Set(kDark)));
      i = hn::Add(i, Set(1));
      active = hn::And(active, walk.Holds(i));
    }
    HWY_ALIGN float through[kLanes];
    hn::Store(hn::Exp(d, hn::Neg(hn::Min(depth, Set(80)))), d, through);
    std::copy_n(through, std::min(kLanes, o.size[0] - x), nodes + x);
    args.field.Trim();
  }
}

FillOpacity FindOpacityHere(PixelType type) {
  return ForSampleType(type, [](auto sample) -> FillOpacity { return FillType<decltype(sample)>; });
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::volume {

HWY_EXPORT(FindOpacityHere);

FillOpacity FindOpacity(PixelType type) { return HWY_DYNAMIC_DISPATCH(FindOpacityHere)(type); }

}  // namespace tessera::ops::volume
#endif  // HWY_ONCE
