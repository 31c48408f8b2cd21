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
    const V code = TrilinearAt(f, samples_, c);
    return hn::Mul(Set(args_.side), hn::Sub(code, Set(args_.level)));
  }
  HWY_INLINE V At(const Vec3& p) const { return AtCell(Locate(args_.field, Place(p))); }

  // Gradient per voxel, outward times a positive factor.
  HWY_INLINE Vec3 Gradient(const Vec3& p) const {
    const Field& f = args_.field;
    ValueAndGradient sag;
    const Cell c = Locate(f, Place(p, kSags ? &sag : nullptr));
    Vec3 g = TrilinearGradientAt(f, samples_, c).gradient;
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

// Sets of rays that are followed at once, so that one's reads go on while another waits. Sixteen rays keep a
// processor busy by themselves.
inline constexpr int kSets = kLanes < 16 ? 2 : 1;

// Steps are counted on a grid that begins where the ray does, so that they do not depend on leaps.
template <typename T, bool kSags>
class Search {
 public:
  HWY_INLINE Search(const SurfaceArgs& args, const Level<T, kSags>& level, const Ray (&rays)[kSets],
                    float from)
      : args_(args), level_(level), rays_(rays) {
    for (int k = 0; k < kSets; ++k) {
      step_[k] = hn::Div(Set(static_cast<float>(kSurfaceStep)), rays[k].length);
      const V first = hn::Floor(hn::Div(hn::Sub(Set(from), rays[k].begin), step_[k]));
      i_[k] = hn::Max(hn::Sub(first, Set(1)), hn::Zero(D()));
      active_[k] = rays[k].hits;
      found_[k] = hn::MaskFromVec(hn::Zero(D()));
      last_[k] = value_[k] = hn::Zero(D());
      outside_[k] = from_[k] = hn::Sub(i_[k], Set(1));
      free_[k] = Set(kUnknown);
      // Rounding may put the last place behind the end.
      final_[k] = hn::Sub(hn::Floor(hn::Div(hn::Sub(rays[k].end, rays[k].begin), step_[k])), Set(1));
    }
  }

  HWY_INLINE void Run(Hit (&hits)[kSets]) {
    while (Some(active_)) {
      if (args_.field.leaps) {
        Leap();
      } else {
        Walk();
      }
    }
    for (int k = 0; k < kSets; ++k) {
      hits[k].found = found_[k];
      hits[k].cap = hn::And(found_[k], hn::Eq(last_[k], hn::Zero(D())));
      hits[k].along = hn::MulAdd(last_[k], step_[k], rays_[k].begin);
    }
    M between[kSets];
    for (int k = 0; k < kSets; ++k) between[k] = hn::AndNot(hits[k].cap, found_[k]);
    if (Some(between)) CloseIn(hits);
  }

 private:
  static HWY_INLINE bool Some(const M (&masks)[kSets]) {
    M any = masks[0];
    for (int k = 1; k < kSets; ++k) any = hn::Or(any, masks[k]);
    return !hn::AllFalse(D(), any);
  }
  // Where the rays are; those that have ended go on no more.
  HWY_INLINE void Arrive(Vec3 (&p)[kSets]) {
    for (int k = 0; k < kSets; ++k) {
      const V along = hn::MulAdd(i_[k], step_[k], rays_[k].begin);
      active_[k] = hn::AndNot(hn::Gt(along, rays_[k].end), active_[k]);
      p[k] = At(rays_[k], along);
    }
  }
  HWY_INLINE void Step(int k, M near, V steps) {
    const M inside = hn::And(near, hn::Le(value_[k], hn::Zero(D())));
    found_[k] = hn::Or(found_[k], inside);
    last_[k] = hn::IfThenElse(inside, i_[k], last_[k]);
    active_[k] = hn::AndNot(inside, active_[k]);
    i_[k] = hn::Add(i_[k], hn::Max(steps, Set(1)));
  }
  // As Step, of a displaced field, whose steps have to be short: as long as free ways of `free` places before
  // and behind meet, what lies between two places is outside. The free way is taken to shrink as it did
  // before; where it turns out too short, the place behind what is known is next.
  HWY_INLINE void Stride(int k, M near, V free) {
    const V zero = hn::Zero(D()), one = Set(1);
    free = hn::Max(free, zero);
    const V whole = hn::Floor(free), i = i_[k], next = hn::Add(outside_[k], one);
    const M inside = hn::And(near, hn::Le(value_[k], zero));
    const M gap = hn::Gt(hn::Sub(i, hn::IfThenZeroElse(inside, whole)), next);
    const M first = hn::AndNot(gap, inside);
    found_[k] = hn::Or(found_[k], first);
    last_[k] = hn::IfThenElse(first, i, last_[k]);
    active_[k] = hn::AndNot(first, active_[k]);
    // The ways meet after 2 / (1 + rate) of this one; a little less is tried.
    const V rate = hn::Div(hn::Sub(free_[k], free), hn::Sub(i, from_[k]));
    const V meet = hn::Div(hn::Mul(Set(1.8f), free), hn::Max(hn::Add(one, rate), Set(0.6f)));
    const V tried = hn::IfThenElseZero(near, hn::Min(hn::Floor(meet), hn::Sub(final_[k], i)));
    i_[k] = hn::IfThenElse(gap, next, hn::Add(i, hn::Max(hn::Max(tried, whole), one)));
    outside_[k] = hn::IfThenElse(gap, outside_[k], hn::Add(i, whole));
    from_[k] = hn::IfThenElse(gap, from_[k], i);
    free_[k] = hn::IfThenElse(gap, free_[k], hn::IfThenElse(near, free, Set(kUnknown)));
  }
  HWY_INLINE void Walk() {
    Vec3 p[kSets];
    Arrive(p);
    for (int k = 0; k < kSets; ++k) {
      value_[k] = hn::IfThenElse(active_[k], level_.At(p[k]), value_[k]);
      Step(k, active_[k], Set(1));
    }
  }
  HWY_INLINE void Leap() {
    const D d;
    const DI di;
    const Field& field = args_.field;
    const V edge = Set(field.edge), per_voxel = Set(kPerVoxel);
    Vec3 p[kSets];
    Arrive(p);
    VI entry[kSets];
    V room[kSets], steps[kSets];
    M near[kSets];
    Cell cells[kSets];
    const auto look_up = [&](int k, const uint16_t* leaps, VI block) HWY_ATTR {
      entry[k] = LeapOf(leaps, block);
      room[k] = hn::Sub(hn::ConvertTo(d, hn::And(entry[k], hn::Set(di, 255))), Set(1));
    };
    for (int k = 0; k < kSets; ++k) {
      near[k] = active_[k];
      steps[k] = hn::Zero(d);
      if constexpr (kSags) {
        if (among_) continue;
        look_up(k, field.leap, BlockOf(field, p[k]).index);
      } else {
        // The cell is the one that is read where something is near.
        cells[k] = Locate(field, p[k]);
        look_up(k, field.leap, BlockIndexOf(field, cells[k]));
      }
      near[k] = hn::And(active_[k], hn::Lt(room[k], Set(1)));
      steps[k] = hn::Mul(room[k], per_voxel);
    }
    if (Some(near)) {
      V v[kSets];
      if constexpr (kSags) {
        // Where a displaced field is read, it has leaps of its own, as long as displacement allows.
        for (int k = 0; k < kSets; ++k) cells[k] = Locate(field, level_.Place(p[k]));
        for (int k = 0; k < kSets; ++k) look_up(k, field.own, BlockIndexOf(field, cells[k]));
      }
      for (int k = 0; k < kSets; ++k) v[k] = level_.AtCell(cells[k]);
      M away[kSets];
      for (int k = 0; k < kSets; ++k) {
        const V q = hn::ConvertTo(d, hn::And(hn::ShiftRight<8>(entry[k]), hn::Set(di, 255)));
        const V beyond = hn::Sub(v[k], Set(args_.margin));
        V free = hn::Min(hn::Mul(hn::Mul(beyond, q), Set(field.pace)), edge);
        free = hn::Max(hn::Mul(beyond, Set(field.least_pace)), free);
        if constexpr (kSags) {
          free = hn::Max(free, room[k]);
          away[k] = hn::AndNot(hn::And(near[k], hn::Lt(free, edge)), active_[k]);
          free = hn::Mul(free, SlowDown(args_, rays_[k]).Within(p[k], hn::Max(free, hn::Zero(d))));
        }
        steps[k] = hn::IfThenElse(near[k], hn::Mul(free, per_voxel), steps[k]);
        value_[k] = hn::IfThenElse(near[k], v[k], value_[k]);
      }
      if constexpr (kSags) among_ = !Some(away);
    }
    for (int k = 0; k < kSets; ++k) {
      if constexpr (kSags) {
        Stride(k, near[k], steps[k]);
      } else {
        Step(k, near[k], hn::Floor(steps[k]));
      }
    }
  }
  // Between two neighbours of the grid the field is almost linear: secants, of which the end that stays is
  // weighed half (the Illinois rule), so that both ends close in where the field has a kink. Four of them do
  // almost everywhere; rays that graze a surface go on, each until it hardly moves, whatever its neighbours
  // do.
  HWY_INLINE void CloseIn(Hit (&hits)[kSets]) const {
    V low[kSets], high[kSets], above[kSets], below[kSets];
    M was_outside[kSets], was_inside[kSets], open[kSets];
    for (int k = 0; k < kSets; ++k) {
      open[k] = hn::AndNot(hits[k].cap, found_[k]);
      high[k] = hits[k].along;
      low[k] = hn::MulAdd(hn::Sub(last_[k], Set(1)), step_[k], rays_[k].begin);
      above[k] = level_.At(At(rays_[k], low[k]));
      below[k] = value_[k];
      was_outside[k] = was_inside[k] = hn::MaskFromVec(hn::Zero(D()));
    }
    constexpr int kPasses = 4, kMostPasses = 24;
    for (int pass = 0; pass < kMostPasses; ++pass) {
      V v[kSets], middle[kSets];
      for (int k = 0; k < kSets; ++k) {
        const V share = hn::Div(above[k], hn::Max(hn::Sub(above[k], below[k]), Set(1e-30f)));
        middle[k] = Lerp(low[k], high[k], Clamp01(share));
        const V moved = hn::Abs(hn::Sub(middle[k], hits[k].along));
        hits[k].along = hn::IfThenElse(open[k], middle[k], hits[k].along);
        if (pass + 1 >= kPasses) open[k] = hn::And(open[k], hn::Gt(moved, hn::Mul(step_[k], Set(kStill))));
      }
      if (pass + 1 >= kPasses && !Some(open)) break;
      for (int k = 0; k < kSets; ++k) v[k] = level_.At(At(rays_[k], middle[k]));
      for (int k = 0; k < kSets; ++k) {
        const M outside = hn::Gt(v[k], hn::Zero(D())), inside = hn::Not(outside);
        low[k] = hn::IfThenElse(outside, middle[k], low[k]);
        high[k] = hn::IfThenElse(outside, high[k], middle[k]);
        const V half = Set(0.5f);
        above[k] =
            hn::IfThenElse(outside, v[k], hn::IfThenElse(was_inside[k], hn::Mul(above[k], half), above[k]));
        below[k] =
            hn::IfThenElse(inside, v[k], hn::IfThenElse(was_outside[k], hn::Mul(below[k], half), below[k]));
        was_outside[k] = outside;
        was_inside[k] = inside;
      }
    }
  }

  const SurfaceArgs& args_;
  const Level<T, kSags>& level_;
  const Ray (&rays_)[kSets];
  V step_[kSets], i_[kSets];
  M active_[kSets], found_[kSets];
  V last_[kSets], value_[kSets];  // of the grid's first place inside
  // A displaced field's: the last place before which all are outside; where the free way was measured, and
  // how many places it had; the last place of the ray.
  V outside_[kSets], from_[kSets], free_[kSets], final_[kSets];
  static constexpr float kUnknown = 1e9f;
  static constexpr float kStill = 1e-4f;  // of a step of the grid: a quarter of the bound's 1e-4 voxel
  // A displaced field matters in wide regions: in small steps through one, its leaps are not asked again.
  bool among_ = false;
};

// What a hit shows.
template <typename T, bool kSags>
HWY_INLINE void Paint(const SurfaceArgs& args, const Level<T, kSags>& level, const Ray& ray, const Hit& hit,
                      int part, Packet& packet) {
  const D d;
  V color[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  if (!hn::AllFalse(d, hit.found)) {
    const Vec3 p = At(ray, hit.along);
    const Vec3 to_eye = ToEye(args.rays, ray);
    Vec3 normal = WorldNormal(args.rays, level.Gradient(p), 1);
    s::Pixels material = {Set(args.light.color[0]), Set(args.light.color[1]), Set(args.light.color[2]),
                          Set(1)};
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
    normal = {hn::IfThenElse(hit.cap, to_eye.x, normal.x), hn::IfThenElse(hit.cap, to_eye.y, normal.y),
              hn::IfThenElse(hit.cap, to_eye.z, normal.z)};
    const Shine shine = Lit(args.light, ToLight(args.rays, args.light, p), normal, to_eye);
    color[0] = hn::MulAdd(material.r, shine.lit, shine.gloss);
    color[1] = hn::MulAdd(material.g, shine.lit, shine.gloss);
    color[2] = hn::MulAdd(material.b, shine.lit, shine.gloss);
    if (args.rays.aovs) StoreAovs(args.rays, ray, hit.found, hit.along, p, normal, part, packet);
  } else if (args.rays.aovs) {
    const Vec3 none = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    StoreAovs(args.rays, ray, hit.found, hit.along, none, none, part, packet);
  }
  for (int c = 0; c < 3; ++c) hn::Store(hn::IfThenElseZero(hit.found, color[c]), d, packet.v[c] + part);
  hn::Store(hn::IfThenElseZero(hit.found, Set(1)), d, packet.v[3] + part);
  const V depth = hn::Add(hit.along, Set(args.rays.middle_depth));
  const V infinity = Set(std::numeric_limits<float>::infinity());
  hn::Store(hn::IfThenElse(hit.found, depth, infinity), d, packet.v[4] + part);
}

template <typename T, bool kSags>
void Draw(const SurfaceArgs& args, const Target& target) {
  const Level<T, kSags> level(args);
  Packet nothing = {};
  for (const int c : {4, 11}) std::fill_n(nothing.v[c], kPacket, std::numeric_limits<float>::infinity());
  constexpr int kParts = 2 * kPacket / kLanes;  // of two packets
  ForPackets(args.rays, args.field, target, nothing,
             [&](int x0, int y0, float from, Packet(&packets)[2]) HWY_ATTR {
               for (int first = 0; first < kParts; first += kSets) {
                 Ray rays[kSets];
                 for (int k = 0; k < kSets; ++k) {
                   const int part = (first + k) * kLanes;
                   V x, y;
                   PixelsOf(x0 + part / kPacket * 4, y0, part % kPacket, x, y);
                   rays[k] = RayOf(args.rays, x, y, SceneDepth(target, x, y));
                 }
                 Hit hits[kSets];
                 Search<T, kSags>(args, level, rays, from).Run(hits);
                 for (int k = 0; k < kSets; ++k) {
                   const int part = (first + k) * kLanes;
                   Paint(args, level, rays[k], hits[k], part % kPacket, packets[part / kPacket]);
                 }
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
