// Media: samples along rays, classified or modulated (hypertexture), shaded and composited.
#include <cstdint>
#include <limits>

#include "ops/volume/march.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/volume/medium_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/volume/mixture-inl.h"
#include "ops/volume/walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

// Hypertexture, four samples of every ray at a time, so that one's reads go on while the others wait. Sixteen
// rays have enough reads in two.
template <typename T>
HWY_INLINE Sums MarchHyper(const MediumArgs& args, const Medium<T>& medium, const Ray& ray, float from) {
  const D d;
  const V zero = hn::Zero(d);
  constexpr int K = kLanes < 16 ? 4 : 2;
  const Walk walk(args, ray, from, 1);
  Sums sums = {zero, zero, zero, zero, zero, hn::MaskFromVec(zero)};
  V i = walk.First();
  M active = hn::And(ray.hits, walk.Holds(i));
  bool among = false;  // something was where the rays were: no leap is tried
  while (among ? !hn::AllFalse(d, active) : walk.Leap(args.field, ray, i, active)) {
    Vec3 p[K];
    V along[K];
    M lanes[K];
    Sample sample[K];
    if (!among && args.pace > 0) {
      // All rays go to the soft region before any of them is looked at.
      const V steps = walk.Free(args, medium.Value(At(ray, walk.Along(i))));
      const M outside = hn::Gt(steps, zero);
      i = hn::IfThenElse(outside, hn::Add(i, steps), i);
      const bool moved = !hn::AllFalse(d, hn::And(active, outside));
      active = hn::And(active, walk.Holds(i));
      if (moved) continue;
    }
    for (int k = 0; k < K; ++k) {
      const V at = hn::Add(i, Set(static_cast<float>(k)));
      along[k] = walk.Along(at);
      p[k] = At(ray, along[k]);
      lanes[k] = hn::And(active, hn::Lt(at, walk.lattice.count));
    }
    among = medium.Hyper(p, lanes, sample);
    const auto seen = [&]() HWY_ATTR {
      M any = hn::MaskFromVec(zero);
      for (int k = 0; k < K; ++k) {
        any = hn::Or(any, hn::And(lanes[k], hn::Gt(sample[k].value, Set(args.clear))));
      }
      return !hn::AllFalse(d, any);
    };
    if (among && seen()) {
      s::Pixels c[K];
      V alpha[K], share[K];
      for (int k = 0; k < K; ++k) c[k] = ColorOf(args.transfer, sample[k].value);
      for (int k = 0; k < K; ++k) Shade(args, p[k], sample[k], walk.to_eye, c[k]);
      walk.Shares<K>(ray, i, share);
      for (int k = 0; k < K; ++k) alpha[k] = Opacity(c[k].a, walk.length, share[k]);
      for (int k = 0; k < K; ++k) {
        Under(c[k], hn::IfThenElseZero(hn::And(lanes[k], active), alpha[k]), along[k], sums);
        active = hn::And(active, hn::Lt(sums.a, Set(args.opaque)));
      }
    }
    V next = Set(static_cast<float>(K));
    if (args.pace > 0) {
      const V behind = hn::Add(Set(static_cast<float>(K - 1)), walk.Free(args, sample[K - 1].distance));
      next = hn::Max(next, behind);
    }
    i = hn::Add(i, next);
    active = hn::And(active, walk.Holds(i));
  }
  return sums;
}

// Density volumes.
template <typename T>
HWY_INLINE Sums March(const MediumArgs& args, const Medium<T>& medium, const Ray& ray, float from) {
  const D d;
  const V zero = hn::Zero(d), one = Set(1);
  const bool backwards = args.mode == VolumeMode::kOver;
  const Walk walk(args, ray, from, backwards ? -1.0f : 1.0f);
  Sums sums = {
      zero, zero, zero, args.mode == VolumeMode::kMip ? Set(-1e30f) : zero, zero, hn::MaskFromVec(zero)};
  V path = zero;  // of the samples whose mean is taken
  V i = walk.First();
  M active = hn::And(ray.hits, walk.Holds(i));
  while (walk.Leap(args.field, ray, i, active)) {
    const V along = walk.Along(i);
    const V share = hn::IfThenElseZero(active, ShareOf(ray, along, walk.per_step));
    if (args.mode == VolumeMode::kMip) {
      const V v = Clamp01(hn::MulAdd(medium.Shown(At(ray, along)), Set(args.mip_times), Set(args.mip_plus)));
      sums.a = hn::IfThenElse(hn::Gt(share, zero), hn::Max(sums.a, v), sums.a);
    } else {
      s::Pixels c = medium.Density(ray, along, hn::Mul(Set(0.5f), walk.lattice.step), walk.to_eye);
      if (args.mode == VolumeMode::kXray) {
        sums.a = hn::MulAdd(hn::Mul(c.a, walk.length), share, sums.a);
      } else if (args.mode == VolumeMode::kAttenuate) {
        // The opacity of a reference length, whatever the step: a mean over the ray's way.
        const V alpha = hn::Mul(Opacity(c.a, Set(args.reference), one), share);
        sums.r = hn::MulAdd(c.r, alpha, sums.r);
        sums.g = hn::MulAdd(c.g, alpha, sums.g);
        sums.b = hn::MulAdd(c.b, alpha, sums.b);
        sums.a = hn::Add(sums.a, alpha);
        path = hn::Add(path, share);
      } else {
        const V alpha = Opacity(c.a, walk.length, share);
        if (backwards) {
          const auto over = [&](V under, V color)
                                HWY_ATTR { return hn::MulAdd(alpha, hn::Sub(color, under), under); };
          sums.r = over(sums.r, c.r);
          sums.g = over(sums.g, c.g);
          sums.b = over(sums.b, c.b);
          sums.a = over(sums.a, one);
        } else {
          Under(c, alpha, along, sums);
          active = hn::And(active, hn::Lt(sums.a, Set(args.opaque)));
        }
      }
    }
    i = hn::Add(i, Set(walk.direction));
    active = hn::And(active, walk.Holds(i));
  }
  if (args.mode == VolumeMode::kAttenuate) {
    const V all = hn::IfThenElse(hn::Gt(path, zero), path, one);
    sums.r = hn::Div(sums.r, all);
    sums.g = hn::Div(sums.g, all);
    sums.b = hn::Div(sums.b, all);
    sums.a = hn::Div(sums.a, all);
  }
  return sums;
}

template <typename T>
void DrawType(const MediumArgs& args, const Target& target) {
  const D d;
  const Medium<T> medium(args);
  const bool xray = args.mode == VolumeMode::kXray;
  Packet nothing = {};
  for (int c = 0; c < 4; ++c) std::fill_n(nothing.v[c], kPacket, xray ? 1.0f : 0.0f);
  for (const int c : {4, 11}) std::fill_n(nothing.v[c], kPacket, std::numeric_limits<float>::infinity());
  const V zero = hn::Zero(d), one = Set(1);
  ForPackets(
      args.rays, args.field, target, nothing, [&](int x0, int y0, float from, Packet(&packets)[2]) HWY_ATTR {
        for (int part = 0; part < 2 * kPacket; part += kLanes) {
          const int left = x0 + part / kPacket * 4;
          if (left >= target.out.roi.x1) break;
          V x, y;
          PixelsOf(left, y0, part % kPacket, x, y);
          const Ray ray = RayOf(args.rays, x, y, SceneDepth(target, x, y));
          Sums sums = args.hyper ? MarchHyper<T>(args, medium, ray, from) : March<T>(args, medium, ray, from);
          if (xray) {
            sums.r = sums.g = sums.b = hn::Exp(d, hn::Neg(sums.a));
            sums.a = one;
          } else if (args.mode == VolumeMode::kMip) {
            const M any = hn::Ge(sums.a, zero);
            sums.r = sums.g = sums.b = hn::IfThenElseZero(any, sums.a);
            sums.a = hn::IfThenElseZero(any, one);
          }
          Store(sums, args.rays.middle_depth, part % kPacket, packets[part / kPacket]);
          if (!args.rays.aovs) continue;
          const V at = hn::IfThenElse(sums.deep, sums.depth, ray.begin);
          const Vec3 p = At(ray, at);
          const Vec3 normal = WorldNormal(args.rays, medium.ValueGradient(p).gradient, args.hyper ? 1 : -1);
          StoreAovs(args.rays, ray, sums.deep, at, p, normal, part % kPacket, packets[part / kPacket]);
        }
      });
}

DrawMedium FindMediumHere(PixelType type) {
  return ForSampleType(type, [](auto sample) -> DrawMedium { return DrawType<decltype(sample)>; });
}

DrawMixture FindMixtureHere() { return DrawMixtureHere; }

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::volume {

HWY_EXPORT(FindMediumHere);
HWY_EXPORT(FindMixtureHere);

DrawMedium FindMedium(PixelType type) { return HWY_DYNAMIC_DISPATCH(FindMediumHere)(type); }
DrawMixture FindMixture() { return HWY_DYNAMIC_DISPATCH(FindMixtureHere)(); }

}  // namespace tessera::ops::volume
#endif  // HWY_ONCE
