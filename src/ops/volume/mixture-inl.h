// Several media along the same rays, merged: where they overlap their extinctions add up.
#if defined(TESSERA_OPS_VOLUME_MIXTURE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_VOLUME_MIXTURE_INL_H_
#undef TESSERA_OPS_VOLUME_MIXTURE_INL_H_
#else
#define TESSERA_OPS_VOLUME_MIXTURE_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <span>

#include "ops/volume/walk-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

// Lit colour and extinction of one of the media; lanes in which there is none leave the set.
template <typename T>
HWY_NOINLINE void Probe(const MediumArgs& args, const Ray& ray, const V& along, const V& half, M& lanes,
                        s::Pixels& c) {
  const Medium<T> medium(args);
  const Vec3 to_eye = ToEye(args.rays, ray);
  if (!args.hyper) {
    c = medium.Density(ray, along, half, to_eye);
    return;
  }
  const Vec3 p[1] = {At(ray, along)};
  M left[1] = {lanes};
  Sample sample[1];
  const bool some = medium.Hyper(p, left, sample);
  lanes = left[0];
  if (!some) return;
  c = ColorOf(args.transfer, sample[0].value);
  Shade(args, sample[0], to_eye, c);
}
using ProbeFunction = void (*)(const MediumArgs&, const Ray&, const V&, const V&, M&, s::Pixels&);
inline ProbeFunction FindProbe(PixelType type) {
  return ForSampleType(type, [](auto sample) -> ProbeFunction { return Probe<decltype(sample)>; });
}

// Samples lie on one lattice, which begins where the first medium does.
inline Sums MarchAll(std::span<const MediumArgs* const> media, const ProbeFunction* probes, const Ray* rays) {
  const D d;
  const V zero = hn::Zero(d), one = Set(1), endless = Set(1e30f);
  V enter = endless, begin = endless, end = hn::Neg(endless);
  M hits = hn::MaskFromVec(zero);
  float spacing = media[0]->step, opaque = media[0]->opaque;
  for (size_t k = 0; k < media.size(); ++k) {
    const Ray& r = rays[k];
    enter = hn::IfThenElse(r.hits, hn::Min(enter, r.enter), enter);
    begin = hn::IfThenElse(r.hits, hn::Min(begin, r.begin), begin);
    end = hn::IfThenElse(r.hits, hn::Max(end, r.end), end);
    hits = hn::Or(hits, r.hits);
    spacing = std::min(spacing, media[k]->step);
    opaque = std::max(opaque, media[k]->opaque);
  }
  Sums sums = {zero, zero, zero, zero, zero, hn::MaskFromVec(zero)};
  if (hn::AllFalse(d, hits)) return sums;
  const V step = hn::Div(Set(spacing), rays[0].world), per_step = hn::Div(one, step);
  const V half = hn::Mul(Set(0.5f), step), length = hn::Mul(step, rays[0].world);
  const V base = hn::Add(hn::IfThenElseZero(hits, enter), half);
  const auto place = [&](V at) HWY_ATTR { return hn::MulAdd(hn::Sub(at, base), per_step, Set(0.5f)); };
  const V count = hn::Ceil(place(end));
  V i = hn::IfThenElseZero(hits, hn::Max(hn::Floor(place(begin)), zero));
  M active = hn::And(hits, hn::Lt(i, count));
  while (!hn::AllFalse(d, active)) {
    const V along = hn::MulAdd(i, step, base);
    // To the next sample at which one of the media may be something.
    V jump = endless;
    M reads[kMostVolumes];
    for (size_t k = 0; k < media.size(); ++k) {
      const Field& field = media[k]->field;
      const Ray& r = rays[k];
      const M past = hn::Or(hn::Not(r.hits), hn::Ge(hn::Sub(along, half), r.end));
      const M before = hn::Le(hn::Add(along, half), r.begin);
      reads[k] = hn::AndNot(hn::Or(past, before), active);
      V steps = zero;
      if (field.leaps) {
        const Block block = BlockOf(field, At(r, along));
        const V room = RoomOf(LeapOf(field.leap, block));
        const V per_voxel = hn::Div(per_step, r.length);
        const M empty = hn::Ge(room, zero);
        steps = hn::IfThenElseZero(
            empty, StepsOf(field, Exit(field, r, 1), block.at, room, along, per_voxel, per_step));
        reads[k] = hn::AndNot(empty, reads[k]);
      }
      // A sample less than are left, for rounding.
      const V until = hn::Sub(hn::Floor(hn::Mul(hn::Sub(hn::Sub(r.begin, half), along), per_step)), one);
      steps = hn::IfThenElse(before, hn::Max(until, one), steps);
      jump = hn::Min(jump, hn::IfThenElse(past, endless, steps));
    }
    const M busy = hn::And(active, hn::Le(jump, zero));
    if (!hn::AllFalse(d, busy)) {
      s::Pixels sum = {zero, zero, zero, zero};
      for (size_t k = 0; k < media.size(); ++k) {
        M lanes = hn::And(reads[k], busy);
        if (hn::AllFalse(d, lanes)) continue;
        s::Pixels c;
        probes[k](*media[k], rays[k], along, half, lanes, c);
        if (hn::AllFalse(d, lanes)) continue;
        const V extinction = hn::Mul(c.a, hn::IfThenElseZero(lanes, ShareOf(rays[k], along, per_step)));
        sum.r = hn::Add(sum.r, hn::Mul(c.r, extinction));
        sum.g = hn::Add(sum.g, hn::Mul(c.g, extinction));
        sum.b = hn::Add(sum.b, hn::Mul(c.b, extinction));
        sum.a = hn::Add(sum.a, extinction);
      }
      const V per = hn::Div(one, hn::Max(sum.a, Set(1e-30f)));
      const s::Pixels c = {hn::Mul(sum.r, per), hn::Mul(sum.g, per), hn::Mul(sum.b, per), sum.a};
      Under(c, hn::IfThenElseZero(busy, Opacity(sum.a, length, one)), along, sums);
      active = hn::And(active, hn::Lt(sums.a, Set(opaque)));
    }
    i = hn::Add(i, hn::IfThenElse(busy, one, hn::Max(jump, one)));
    active = hn::And(active, hn::Lt(i, count));
  }
  return sums;
}

inline void DrawMixtureHere(std::span<const MediumArgs* const> media, const Target& target) {
  const Roi& roi = target.out.roi;
  ProbeFunction probes[kMostVolumes];
  for (size_t k = 0; k < media.size(); ++k) probes[k] = FindProbe(media[k]->field.type);
  Packet packet;
  for (int y0 = roi.y0; y0 < roi.y1; y0 += 4) {
    for (int x0 = roi.x0; x0 < roi.x1; x0 += 4) {
      for (int part = 0; part < kPacket; part += kLanes) {
        V x, y;
        PixelsOf(x0, y0, part, x, y);
        const V scene = SceneDepth(target, x, y);
        Ray rays[kMostVolumes];
        for (size_t k = 0; k < media.size(); ++k) rays[k] = RayOf(media[k]->rays, x, y, scene);
        Store(MarchAll(media, probes, rays), media[0]->rays.middle_depth, part, packet);
      }
      Write(target, x0, y0, packet);
    }
  }
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
