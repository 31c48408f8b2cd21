// Surfaces of volumes: the first crossing of a level along rays, found by leaping, lit and textured.
#include <cstdint>

#include "ops/volume/march.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/volume/surface_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/volume/rays-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

constexpr float kPerVoxel = static_cast<float>(1 / kSurfaceStep);

// The level's side of the field at positions in voxels: negative inside, in codes.
template <typename T, bool kSags>
class Level {
 public:
  explicit Level(const SurfaceArgs& args)
      : args_(args), samples_(static_cast<const T*>(args.field.samples)) {}

  // Where the field is read for a point.
  HWY_INLINE Vec3 Place(const Vec3& p, ValueAndGradient* sag = nullptr) const {
    if constexpr (!kSags) {
      (void)sag;
      return p;
    } else {
      // p + up * amount g(height) (floor + noise), g = t^2 of the way down the body.
      const float* const a = args_.sag;
      const V down = Clamp01(hn::MulAdd(p.y, Set(-a[2]), Set(a[1])));
      const V weight = hn::Mul(Set(a[0]), hn::Mul(down, down));
      ValueAndGradient n;
      if (sag == nullptr) {
        n.value = NoiseValue(args_.noise, p);
      } else {
        n = NoiseGradient(args_.noise, p);
        const V low = hn::Zero(D());
        const M moves = hn::And(hn::Gt(down, low), hn::Lt(down, Set(1)));
        const V shaped = hn::MulAdd(n.value, Set(a[3]), Set(1 - a[3]));
        sag->gradient = Scaled(n.gradient, hn::Mul(weight, Set(a[3])));
        const V steeper = hn::Mul(hn::Mul(Set(-2 * a[0] * a[2]), down), shaped);
        sag->gradient.y = hn::Add(sag->gradient.y, hn::IfThenElseZero(moves, steeper));
      }
      const V shaped = hn::MulAdd(n.value, Set(a[3]), Set(1 - a[3]));
      return {p.x, hn::MulAdd(weight, shaped, p.y), p.z};
    }
  }

  HWY_INLINE V AtCell(const Cell& c) const {
    const Field& f = args_.field;
    const V code = Trilinear(samples_, f.row, f.slice, IndexOf(c, f.row, f.slice), c.f);
    return hn::Mul(Set(args_.side), hn::Sub(code, Set(args_.level)));
  }
  HWY_INLINE V At(const Vec3& p) const { return AtCell(Locate(args_.field, Place(p))); }

  // Gradient per voxel, outward times a positive factor.
  HWY_INLINE Vec3 Gradient(const Vec3& p) const {
    const Field& f = args_.field;
    ValueAndGradient sag;
    const Cell c = Locate(f, Place(p, kSags ? &sag : nullptr));
    Vec3 g = TrilinearGradient(samples_, f.row, f.slice, IndexOf(c, f.row, f.slice), c.f).gradient;
    if constexpr (kSags) {
      const V up = g.y;
      g = AddScaled(g, sag.gradient, up);
    }
    return Scaled(g, Set(args_.side));
  }

 private:
  const SurfaceArgs& args_;
  const T* samples_;
};

// How much of a way that is free where a displaced field is read is free along the ray: one over the speed of
// that place, |d + up g|, g the slope of the displacement along the unit direction d.
class SlowDown {
 public:
  SlowDown(const SurfaceArgs& args, const Ray& ray) : args_(args) {
    const V per = hn::Div(Set(1), ray.length);
    const auto along = [&](V v) HWY_ATTR { return hn::Abs(hn::Mul(v, per)); };
    rise_ = along(ray.direction.y);
    const float* const s = args.steep;
    linear_ = hn::Mul(rise_, Set(s[0]));
    square_ = hn::MulAdd(along(ray.direction.x), Set(s[1]),
                         hn::MulAdd(rise_, Set(s[2]), hn::Mul(along(ray.direction.z), Set(s[3]))));
  }
  HWY_INLINE V Within(const Vec3& p, V way) const {
    const float* const a = args_.sag;
    const V down = Clamp01(hn::MulAdd(hn::MulAdd(rise_, way, hn::Neg(p.y)), Set(a[2]), Set(a[1])));
    const V slope = hn::Mul(down, hn::MulAdd(down, square_, linear_));
    const V speed = hn::MulAdd(slope, hn::MulAdd(Set(2), rise_, slope), Set(1.00001f));
    return hn::Div(Set(1), hn::Sqrt(speed));
  }

 private:
  const SurfaceArgs& args_;
  V rise_, linear_, square_;
};

struct Hit {
  V along;       // s
  M found, cap;  // cap: the ray began inside
};

template <typename T, bool kSags>
HWY_INLINE Hit FirstCrossing(const SurfaceArgs& args, const Level<T, kSags>& level, const Ray& ray,
                             float from) {
  const D d;
  const DI di;
  const Field& field = args.field;
  const V step = hn::Div(Set(static_cast<float>(kSurfaceStep)), ray.length);
  // Steps are counted on a grid that begins where the ray does, so that they do not depend on leaps.
  V i = hn::Floor(hn::Div(hn::Sub(Set(from), ray.begin), step));
  i = hn::Max(hn::Sub(i, Set(1)), hn::Zero(d));
  M active = ray.hits, found = hn::MaskFromVec(hn::Zero(d));
  V last = hn::Zero(d), value = hn::Zero(d);
  const V edge = Set(static_cast<float>(1 << field.shift)), per_voxel = Set(kPerVoxel);
  const SlowDown slow(args, ray);
  while (!hn::AllFalse(d, active)) {
    const V along = hn::MulAdd(i, step, ray.begin);
    const M ended = hn::Gt(along, ray.end);
    active = hn::AndNot(ended, active);
    const Vec3 p = At(ray, along);
    const Cell cell = Locate(field, p);
    V steps = Set(1);
    M near = active;
    Cell read = cell;
    if (field.leaps) {
      VI entry = LeapOf(field, field.leap, cell);
      const auto room_of = [&]() HWY_ATTR {
        return hn::Sub(hn::ConvertTo(d, hn::And(entry, hn::Set(di, 255))), Set(1));
      };
      V room = room_of();
      near = hn::And(active, hn::Lt(room, Set(1)));
      steps = hn::Floor(hn::Mul(room, Set(kPerVoxel)));
      if constexpr (kSags) {
        // Where the field is read, it has leaps of its own, as long as displacement allows.
        if (!hn::AllFalse(d, near)) {
          read = Locate(field, level.Place(p));
          entry = LeapOf(field, field.own, read);
          room = room_of();
          room = hn::Mul(room, slow.Within(p, room));
          const M far = hn::And(near, hn::Ge(room, Set(1)));
          steps = hn::IfThenElse(far, hn::Floor(hn::Mul(room, Set(kPerVoxel))), steps);
          near = hn::AndNot(far, near);
        }
      }
      if (!hn::AllFalse(d, near)) {
        const V v = level.AtCell(read);
        const V q = hn::ConvertTo(d, hn::ShiftRight<8>(entry));
        const V level_room = hn::Mul(hn::Mul(hn::Sub(v, Set(args.margin)), q), Set(field.pace));
        V free = hn::Min(level_room, edge);
        if constexpr (kSags) free = hn::Mul(free, slow.Within(p, edge));
        steps = hn::IfThenElse(near, hn::Floor(hn::Mul(free, per_voxel)), steps);
        value = hn::IfThenElse(near, v, value);
      }
    } else {
      if (!hn::AllFalse(d, near)) value = hn::IfThenElse(near, level.At(p), value);
    }
    const M inside = hn::And(near, hn::Le(value, hn::Zero(d)));
    found = hn::Or(found, inside);
    last = hn::IfThenElse(inside, i, last);
    active = hn::AndNot(inside, active);
    i = hn::Add(i, hn::Max(steps, Set(1)));
  }
  Hit hit;
  hit.found = found;
  hit.cap = hn::And(found, hn::Eq(last, hn::Zero(d)));
  V high = hn::MulAdd(last, step, ray.begin);
  hit.along = high;
  if (hn::AllFalse(d, hn::AndNot(hit.cap, found))) return hit;
  // Between two neighbours of the grid the field is almost linear: secants, of which the end that stays is
  // weighed half (the Illinois rule), so that both ends close in where the field has a kink.
  V low = hn::MulAdd(hn::Sub(last, Set(1)), step, ray.begin);
  V above = level.At(At(ray, low)), below = value;
  M was_outside = hn::MaskFromVec(hn::Zero(d)), was_inside = was_outside;
  constexpr int kPasses = 4;
  for (int pass = 0; pass < kPasses; ++pass) {
    const V share = hn::Div(above, hn::Max(hn::Sub(above, below), Set(1e-30f)));
    const V middle = Lerp(low, high, Clamp01(share));
    hit.along = hn::IfThenElse(hit.cap, high, middle);
    if (pass + 1 == kPasses) break;
    const V v = level.At(At(ray, middle));
    const M outside = hn::Gt(v, hn::Zero(d)), inside = hn::Not(outside);
    low = hn::IfThenElse(outside, middle, low);
    high = hn::IfThenElse(outside, high, middle);
    const V half = Set(0.5f);
    above = hn::IfThenElse(outside, v, hn::IfThenElse(was_inside, hn::Mul(above, half), above));
    below = hn::IfThenElse(inside, v, hn::IfThenElse(was_outside, hn::Mul(below, half), below));
    was_outside = outside;
    was_inside = inside;
  }
  return hit;
}

template <typename T, bool kSags>
void Draw(const SurfaceArgs& args, const Target& target) {
  const D d;
  const Level<T, kSags> level(args);
  Packet nothing = {};
  for (float& z : nothing.v[4]) z = std::numeric_limits<float>::infinity();
  const V infinity = Set(std::numeric_limits<float>::infinity());
  ForPackets(args.rays, args.field, target, nothing,
             [&](int x0, int y0, float from, Packet& packet) HWY_ATTR {
               for (int part = 0; part < kPacket; part += kLanes) {
                 V x, y;
                 PixelsOf(x0, y0, part, x, y);
                 const Ray ray = RayOf(args.rays, x, y, SceneDepth(target, x, y));
                 const Hit hit = FirstCrossing(args, level, ray, from);
                 V color[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
                 if (!hn::AllFalse(d, hit.found)) {
                   const Vec3 p = At(ray, hit.along);
                   const Vec3 to_eye = ToEye(args.rays, ray);
                   Vec3 normal = WorldNormal(args.rays, level.Gradient(p), 1);
                   s::Pixels material = {Set(args.light.color[0]), Set(args.light.color[1]),
                                         Set(args.light.color[2]), Set(1)};
                   if (args.mode == VolumeMode::kSolid) {
                     material = ColorOf(args.colors, NoiseValue(args.noise, p));
                   } else if (args.mode == VolumeMode::kBump) {
                     V n[4];
                     NoiseChannels(args.noise, p, n);
                     const Vec3 bump = Unit({n[0], n[1], n[2]});
                     const Vec3 sum = AddScaled(bump, normal, Set(args.k));
                     const M none = hn::Lt(Dot(sum, sum), Set(1e-12f));
                     const Vec3 bent = Unit(sum);
                     normal = {hn::IfThenElse(none, normal.x, bent.x), hn::IfThenElse(none, normal.y, bent.y),
                               hn::IfThenElse(none, normal.z, bent.z)};
                   }
                   normal = {hn::IfThenElse(hit.cap, to_eye.x, normal.x),
                             hn::IfThenElse(hit.cap, to_eye.y, normal.y),
                             hn::IfThenElse(hit.cap, to_eye.z, normal.z)};
                   const Shine shine = Lit(args.light, normal, to_eye);
                   color[0] = hn::MulAdd(material.r, shine.lit, shine.gloss);
                   color[1] = hn::MulAdd(material.g, shine.lit, shine.gloss);
                   color[2] = hn::MulAdd(material.b, shine.lit, shine.gloss);
                 }
                 for (int c = 0; c < 3; ++c)
                   hn::Store(hn::IfThenElseZero(hit.found, color[c]), d, packet.v[c] + part);
                 hn::Store(hn::IfThenElseZero(hit.found, Set(1)), d, packet.v[3] + part);
                 const V depth = hn::Add(hit.along, Set(args.rays.middle_depth));
                 hn::Store(hn::IfThenElse(hit.found, depth, infinity), d, packet.v[4] + part);
               }
             });
}

template <typename T>
void DrawType(const SurfaceArgs& args, const Target& target) {
  if (args.mode == VolumeMode::kMelt) {
    Draw<T, true>(args, target);
  } else {
    Draw<T, false>(args, target);
  }
}

DrawSurface FindSurfaceHere(PixelType type) {
  return ForSampleType(type, [](auto sample) -> DrawSurface { return DrawType<decltype(sample)>; });
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::volume {

HWY_EXPORT(FindSurfaceHere);

DrawSurface FindSurface(PixelType type) { return HWY_DYNAMIC_DISPATCH(FindSurfaceHere)(type); }

}  // namespace tessera::ops::volume
#endif  // HWY_ONCE
