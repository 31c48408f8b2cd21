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

// Samples of every ray that a medium is asked for at once: one call of its own code for all of them.
inline constexpr int kBatch = 4, kPair = 2;

struct Stretch {
  V along[kBatch];
  V half, per_step;  // of a segment's length; one over its whole length
  M lanes[kBatch];   // rays in which the medium may be something
};
// Extinctions and colours times extinctions.
struct Mixture {
  s::Pixels at[kBatch];
};

// Adds what a medium is along a stretch of rays; false where it is nothing.
template <typename T>
HWY_NOINLINE bool AddMedium(const MediumArgs& args, const Ray& ray, const Vec3& to_eye,
                            const Stretch& stretch, Mixture& sum) {
  const D d;
  const V zero = hn::Zero(d);
  const Medium<T> medium(args);
  bool some = false;
  for (int first = 0; first < kBatch; first += kPair) {
    M lanes[kPair], any = hn::MaskFromVec(zero);
    for (int k = 0; k < kPair; ++k) {
      lanes[k] = stretch.lanes[first + k];
      any = hn::Or(any, lanes[k]);
    }
    if (hn::AllFalse(d, any)) continue;
    s::Pixels c[kPair];
    Vec3 p[kPair];
    if (args.hyper) {
      Sample sample[kPair];
      for (int k = 0; k < kPair; ++k) p[k] = At(ray, stretch.along[first + k]);
      if (!medium.Hyper(p, lanes, sample)) continue;
      some = true;
      any = hn::MaskFromVec(zero);
      for (int k = 0; k < kPair; ++k) {
        any = hn::Or(any, hn::And(lanes[k], hn::Gt(sample[k].value, Set(args.clear))));
      }
      if (hn::AllFalse(d, any)) continue;
      for (int k = 0; k < kPair; ++k) c[k] = ColorOf(args.transfer, sample[k].value);
      for (int k = 0; k < kPair; ++k) Shade(args, p[k], sample[k], to_eye, c[k]);
    } else {
      any = hn::MaskFromVec(zero);
      for (int k = 0; k < kPair; ++k) {
        c[k] = medium.Density(ray, stretch.along[first + k], stretch.half, to_eye);
        any = hn::Or(any, hn::And(lanes[k], hn::Gt(c[k].a, zero)));
      }
      if (hn::AllFalse(d, any)) continue;
      some = true;
    }
    for (int k = 0; k < kPair; ++k) {
      const V share = ShareOf(ray, stretch.along[first + k], stretch.per_step);
      const V extinction = hn::Mul(c[k].a, hn::IfThenElseZero(lanes[k], share));
      s::Pixels& to = sum.at[first + k];
      to.r = hn::Add(to.r, hn::Mul(c[k].r, extinction));
      to.g = hn::Add(to.g, hn::Mul(c[k].g, extinction));
      to.b = hn::Add(to.b, hn::Mul(c[k].b, extinction));
      to.a = hn::Add(to.a, extinction);
    }
  }
  return some;
}
using MediumFunction = bool (*)(const MediumArgs&, const Ray&, const Vec3&, const Stretch&, Mixture&);
inline MediumFunction FindMediumFunction(PixelType type) {
  return ForSampleType(type, [](auto sample) -> MediumFunction { return AddMedium<decltype(sample)>; });
}

// One of the media on the rays' common lattice.
class Part {
 public:
  Part() = default;
  HWY_INLINE Part(const MediumArgs& args, const Ray& ray)
      : args_(&args),
        ray_(ray),
        exit_(args.field, ray, 1),
        to_eye_(ToEye(args.rays, ray)),
        add_(FindMediumFunction(args.field.type)) {}
  const Ray& ray() const { return ray_; }

  // Samples from which on, and up to which, the medium may be something; from `from` on at the soonest.
  HWY_INLINE void Begin(V base, V step, V per_step, const Cone& cone) {
    step_ = step, base_ = base, per_step_ = per_step;
    per_voxel_ = hn::Div(per_step, ray_.length);
    const auto place = [&](V at) HWY_ATTR { return hn::MulAdd(hn::Sub(at, base), per_step, Set(0.5f)); };
    count_ = hn::IfThenElseZero(ray_.hits, hn::Ceil(place(ray_.end)));
    next_ = hn::Max(hn::Floor(place(ray_.begin)), hn::Zero(D()));
    next_ = hn::Max(next_, hn::Floor(hn::Mul(hn::Sub(Set(cone.start), base), per_step)));
    next_ = hn::IfThenElse(ray_.hits, next_, Set(kEndless));
    if (cone.missed) next_ = Set(kEndless);
    Close();
  }
  HWY_INLINE V next() const { return next_; }
  // Where sample i, the medium's next one, is in nothing, leads to the one behind that.
  HWY_INLINE void Leap(V i, M active) {
    const Field& field = args_->field;
    if (among_ || !field.leaps) return;
    const M due = hn::And(active, hn::Eq(next_, i));
    if (hn::AllFalse(D(), due)) return;
    const V along = hn::MulAdd(i, step_, base_);
    const Block block = BlockOf(field, At(ray_, along));
    const V room = RoomOf(LeapOf(field.leap, block.index));
    const M empty = hn::And(due, hn::Ge(room, hn::Zero(D())));
    const V steps = StepsOf(field, exit_, block.at, room, along, per_voxel_, per_step_);
    next_ = hn::IfThenElse(empty, hn::Add(i, steps), next_);
    Close();
  }
  // Adds what it is in the samples from i.
  HWY_INLINE bool Add(V i, M active, Stretch& stretch, Mixture& sum) {
    M any = hn::MaskFromVec(hn::Zero(D()));
    for (int k = 0; k < kBatch; ++k) {
      const V at = hn::Add(i, Set(static_cast<float>(k)));
      stretch.lanes[k] = hn::And(active, hn::And(hn::Le(next_, at), hn::Lt(at, count_)));
      any = hn::Or(any, stretch.lanes[k]);
    }
    among_ = !hn::AllFalse(D(), any) && add_(*args_, ray_, to_eye_, stretch, sum);
    next_ = hn::Max(next_, hn::Add(i, Set(static_cast<float>(kBatch))));
    Close();
    return among_;
  }

  static constexpr float kEndless = 1e30f;

 private:
  HWY_INLINE void Close() { next_ = hn::IfThenElse(hn::Lt(next_, count_), next_, Set(kEndless)); }

  const MediumArgs* args_ = nullptr;
  Ray ray_;
  Exit exit_;
  Vec3 to_eye_;
  MediumFunction add_ = nullptr;
  V step_, base_, per_step_, per_voxel_, count_;
  V next_;
  bool among_ = false;  // something was where the rays were: no leap is tried
};

// Samples lie on one lattice, which begins where the first medium does; so they do not depend on leaps.
inline Sums MarchAll(std::span<const MediumArgs* const> media, const Cone* cones, std::span<Part> parts) {
  const D d;
  const V zero = hn::Zero(d), one = Set(1);
  V enter = Set(Part::kEndless);
  M active = hn::MaskFromVec(zero);
  float spacing = media[0]->step, opaque = media[0]->opaque;
  for (size_t k = 0; k < media.size(); ++k) {
    const Ray& r = parts[k].ray();
    enter = hn::IfThenElse(r.hits, hn::Min(enter, r.enter), enter);
    active = hn::Or(active, r.hits);
    spacing = std::min(spacing, media[k]->step);
    opaque = std::max(opaque, media[k]->opaque);
  }
  Sums sums = {zero, zero, zero, zero, zero, hn::MaskFromVec(zero)};
  if (hn::AllFalse(d, active)) return sums;
  const V world = parts[0].ray().world, step = hn::Div(Set(spacing), world), per_step = hn::Div(one, step);
  const V length = hn::Mul(step, world);
  Stretch stretch;
  stretch.half = hn::Mul(Set(0.5f), step);
  stretch.per_step = per_step;
  const V base = hn::Add(hn::IfThenElseZero(active, enter), stretch.half);
  for (size_t k = 0; k < parts.size(); ++k) parts[k].Begin(base, step, per_step, cones[k]);
  const auto next = [&]() HWY_ATTR {
    V first = parts[0].next();
    for (const Part& p : parts.subspan(1)) first = hn::Min(first, p.next());
    return first;
  };
  for (V i = next();; i = next()) {
    active = hn::And(active, hn::Lt(i, Set(Part::kEndless)));
    if (hn::AllFalse(d, active)) return sums;
    // To a sample at which one of the media may be something, of every ray that goes on.
    for (Part& p : parts) p.Leap(i, active);
    if (!hn::AllFalse(d, hn::And(active, hn::Gt(next(), i)))) continue;
    Mixture sum;
    for (int k = 0; k < kBatch; ++k) {
      stretch.along[k] = hn::MulAdd(hn::Add(i, Set(static_cast<float>(k))), step, base);
      sum.at[k] = {zero, zero, zero, zero};
    }
    bool some = false;
    for (Part& p : parts) some |= p.Add(i, active, stretch, sum);
    if (!some) continue;
    for (int k = 0; k < kBatch; ++k) {
      const s::Pixels& all = sum.at[k];
      const V per = hn::Div(one, hn::Max(all.a, Set(1e-30f)));
      const s::Pixels c = {hn::Mul(all.r, per), hn::Mul(all.g, per), hn::Mul(all.b, per), all.a};
      Under(c, hn::IfThenElseZero(active, Opacity(all.a, length, one)), stretch.along[k], sums);
      active = hn::And(active, hn::Lt(sums.a, Set(opaque)));
    }
  }
}

inline void DrawMixtureHere(std::span<const MediumArgs* const> media, const Target& target) {
  const Roi& roi = target.out.roi;
  const size_t count = media.size();
  Packet packet = {};
  for (int by = roi.y0; by < roi.y1; by += kTile) {
    for (int bx = roi.x0; bx < roi.x1; bx += kTile) {
      const int width = std::min(kTile, roi.x1 - bx), height = std::min(kTile, roi.y1 - by);
      Cone cones[kMostVolumes];
      for (size_t k = 0; k < count; ++k)
        cones[k] = ConeOf(media[k]->rays, media[k]->field, bx, by, width, height);
      for (int y0 = by; y0 < by + height; y0 += 4) {
        for (int x0 = bx; x0 < bx + width; x0 += 4) {
          for (int part = 0; part < kPacket; part += kLanes) {
            V x, y;
            PixelsOf(x0, y0, part, x, y);
            const V scene = SceneDepth(target, x, y);
            Part parts[kMostVolumes];
            for (size_t k = 0; k < count; ++k) parts[k] = Part(*media[k], RayOf(media[k]->rays, x, y, scene));
            const Sums sums = MarchAll(media, cones, {parts, count});
            Store(sums, media[0]->rays.middle_depth, part, packet);
          }
          Write(target, x0, y0, packet);
          for (const MediumArgs* const one : media) one->field.Trim();
        }
      }
    }
  }
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
