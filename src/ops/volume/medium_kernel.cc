// Media: samples along rays, classified or modulated (hypertexture), shaded and composited.
#include <cstdint>
#include <limits>

#include "ops/volume/march.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/volume/medium_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/volume/medium-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

// Where the samples of rays lie: sample i at base + i * step stands for the segment of that length around it.
struct Lattice {
  V base, step, first, count;
};
HWY_INLINE Lattice LatticeOf(const MediumArgs& args, const Ray& ray) {
  const D d;
  const RaySet& set = args.rays;
  Lattice l;
  const V half = Set(0.5f);
  if (args.method == VolumeMethod::kSlices) {
    l.step = Set(args.step);
    const V depth = hn::Add(ray.enter, Set(set.middle_depth));
    l.base =
        hn::Sub(hn::Mul(hn::Add(hn::Floor(hn::Div(depth, l.step)), half), l.step), Set(set.middle_depth));
  } else if (args.method == VolumeMethod::kShells && set.perspective) {
    l.step = hn::Div(Set(args.step), ray.world);
    const V depth = hn::Add(ray.enter, Set(set.middle_depth));
    l.base =
        hn::Sub(hn::Mul(hn::Add(hn::Floor(hn::Div(depth, l.step)), half), l.step), Set(set.middle_depth));
  } else if (args.method == VolumeMethod::kStacks || args.method == VolumeMethod::kShearWarp) {
    const V o = args.axis == 0 ? ray.origin.x : args.axis == 1 ? ray.origin.y : ray.origin.z;
    const V dir = args.axis == 0 ? ray.direction.x : args.axis == 1 ? ray.direction.y : ray.direction.z;
    const V size = hn::Max(hn::Abs(dir), hn::Mul(Set(1e-4f), ray.length));
    l.step = hn::Div(Set(1), size);
    const V at = hn::MulAdd(ray.enter, dir, o);
    l.base =
        hn::Div(hn::Sub(hn::Round(at), o), hn::IfThenElse(hn::Lt(dir, hn::Zero(d)), hn::Neg(size), size));
  } else {
    l.step = hn::Div(Set(args.step), ray.world);
    l.base = hn::MulAdd(half, l.step, ray.enter);
  }
  const V per = hn::Div(Set(1), l.step);
  l.first = hn::Max(hn::Floor(hn::MulAdd(hn::Sub(ray.begin, l.base), per, half)), hn::Zero(d));
  l.count = hn::Ceil(hn::MulAdd(hn::Sub(ray.end, l.base), per, half));
  return l;
}

// The sums along rays.
struct Sums {
  V r, g, b, a;  // colour, alpha (or the sum, or the maximum)
  V depth;       // where alpha passes 1/2
  M deep;
};

template <typename T>
HWY_INLINE Sums March(const MediumArgs& args, const Medium<T>& medium, const Ray& ray, float from) {
  const D d;
  const DI di;
  const V zero = hn::Zero(d), one = Set(1);
  const Field& field = args.field;
  const Lattice lattice = LatticeOf(args, ray);
  const bool backwards = args.mode == VolumeMode::kOver;
  const V direction = Set(backwards ? -1.0f : 1.0f);
  const V per_step = hn::Div(one, lattice.step);
  const V voxels = hn::Mul(lattice.step, ray.length);  // of a step
  const V per_voxel = hn::Div(one, voxels), length = hn::Mul(lattice.step, ray.world);
  const Vec3 to_eye = ToEye(args.rays, ray);
  const V start = hn::Max(lattice.first, hn::Floor(hn::Mul(hn::Sub(Set(from), lattice.base), per_step)));
  V i = backwards ? hn::Sub(lattice.count, one) : start;
  Sums sums = {zero, zero, zero, args.mode == VolumeMode::kMip ? Set(-1e30f) : zero, zero, hn::Lt(one, zero)};
  const auto inside = [&]() HWY_ATTR { return hn::And(hn::Ge(i, start), hn::Lt(i, lattice.count)); };
  M active = hn::And(ray.hits, inside());
  for (;;) {
    // Leap until all rays that go on are where something may be.
    Vec3 p;
    V along;
    for (;;) {
      along = hn::MulAdd(i, lattice.step, lattice.base);
      p = At(ray, along);
      if (!field.leaps) break;
      const VI entry = hn::And(LeapOf(field, field.leap, Locate(field, p)), hn::Set(di, 255));
      const V room = hn::Sub(hn::ConvertTo(d, entry), Set(1));
      const M free = hn::And(active, hn::Ge(room, zero));
      if (hn::AllFalse(d, free)) break;
      const V steps = hn::Max(hn::Floor(hn::Mul(room, per_voxel)), one);
      i = hn::IfThenElse(free, hn::MulAdd(direction, steps, i), i);
      active = hn::And(active, inside());
      if (hn::AllFalse(d, active)) return sums;
    }
    M lanes = active;
    if (hn::AllFalse(d, lanes)) return sums;

    // How much of the segment is inside: 1 but at the ends.
    const V low = hn::Max(Set(-0.5f), hn::Mul(hn::Sub(ray.begin, along), per_step));
    const V high = hn::Min(Set(0.5f), hn::Mul(hn::Sub(ray.end, along), per_step));
    const V whole = hn::Max(hn::Sub(high, low), zero);
    Sample sample;
    s::Pixels c;
    if (args.hyper) {
      sample = medium.Hyper(p, lanes);
      if (hn::AllFalse(d, lanes)) {
        i = hn::Add(i, direction);
        active = hn::And(active, inside());
        if (hn::AllFalse(d, active)) return sums;
        continue;
      }
      c = ColorOf(args.transfer, sample.value);
    } else if (args.classification == Classification::kPost) {
      sample = medium.Density(p);
      c = ColorOf(args.transfer, sample.value);
    } else {
      if (args.look != Look::kPlain) sample = medium.Density(p);
      if (args.classification == Classification::kPre) {
        c = medium.Classified(p);
      } else {
        const V half = hn::Mul(Set(0.5f), lattice.step);
        c = medium.Integrated(medium.Value(At(ray, hn::Sub(along, half))),
                              medium.Value(At(ray, hn::Add(along, half))));
      }
    }
    const V share = hn::IfThenElseZero(lanes, whole);
    if (args.mode == VolumeMode::kMip) {
      const V v = Clamp01(hn::MulAdd(medium.Value(p), Set(args.mip_times), Set(args.mip_plus)));
      sums.a = hn::IfThenElse(hn::Gt(share, zero), hn::Max(sums.a, v), sums.a);
    } else if (args.mode == VolumeMode::kXray) {
      sums.a = hn::MulAdd(hn::Mul(c.a, length), share, sums.a);
    } else {
      V r = c.r, g = c.g, b = c.b;
      if (args.look == Look::kLit) {
        const Shine shine = Lit(args.light, sample.normal, to_eye);
        r = hn::MulAdd(r, hn::Mul(shine.lit, Set(args.hyper ? args.light.color[0] : 1)), shine.gloss);
        g = hn::MulAdd(g, hn::Mul(shine.lit, Set(args.hyper ? args.light.color[1] : 1)), shine.gloss);
        b = hn::MulAdd(b, hn::Mul(shine.lit, Set(args.hyper ? args.light.color[2] : 1)), shine.gloss);
      } else if (args.look == Look::kFur) {
        // Kajiya and Kay: light across the strand, darker towards the roots.
        const Vec3 l = {Set(args.light.direction[0]), Set(args.light.direction[1]),
                        Set(args.light.direction[2])};
        const V cosine = Dot(sample.normal, l), view = Dot(sample.normal, to_eye);
        const V across = hn::Sqrt(hn::Max(hn::NegMulAdd(cosine, cosine, one), zero));
        const V aside = hn::Sqrt(hn::Max(hn::NegMulAdd(view, view, one), zero));
        const V facing = hn::MulAdd(cosine, Set(0.5f), Set(0.5f));
        const V height =
            Clamp01(hn::Sub(one, hn::Mul(hn::Sub(Set(args.outer), sample.distance), Set(args.per_width))));
        const V occlusion = hn::MulAdd(height, Set(static_cast<float>(1 - base::kFurRoot)),
                                       Set(static_cast<float>(base::kFurRoot)));
        const V diffuse =
            hn::Mul(hn::Mul(Set(args.light.diffuse), facing), hn::MulAdd(across, Set(0.6f), Set(0.4f)));
        const V lit = hn::Mul(occlusion, hn::Add(diffuse, Set(args.light.ambient)));
        const V gleam =
            Power(hn::Max(hn::NegMulAdd(cosine, view, hn::Mul(across, aside)), zero), args.light.exponent);
        const V gloss =
            hn::Mul(hn::Mul(Set(args.light.specular), gleam), hn::Mul(hn::Mul(facing, facing), occlusion));
        r = hn::MulAdd(hn::Mul(r, Set(args.light.color[0])), lit, gloss);
        g = hn::MulAdd(hn::Mul(g, Set(args.light.color[1])), lit, gloss);
        b = hn::MulAdd(hn::Mul(b, Set(args.light.color[2])), lit, gloss);
      }
      const V optical = hn::Mul(hn::Mul(c.a, length), share);
      const V alpha = hn::Neg(hn::Expm1(d, hn::Neg(optical)));
      if (args.mode == VolumeMode::kAttenuate) {
        sums.r = hn::MulAdd(r, alpha, sums.r);
        sums.g = hn::MulAdd(g, alpha, sums.g);
        sums.b = hn::MulAdd(b, alpha, sums.b);
        sums.a = hn::Add(sums.a, alpha);
      } else if (backwards) {
        const auto over = [&](V under, V color)
                              HWY_ATTR { return hn::MulAdd(alpha, hn::Sub(color, under), under); };
        sums.r = over(sums.r, r);
        sums.g = over(sums.g, g);
        sums.b = over(sums.b, b);
        sums.a = over(sums.a, one);
      } else {
        const V weight = hn::NegMulAdd(sums.a, alpha, alpha);
        sums.r = hn::MulAdd(r, weight, sums.r);
        sums.g = hn::MulAdd(g, weight, sums.g);
        sums.b = hn::MulAdd(b, weight, sums.b);
        sums.a = hn::Add(sums.a, weight);
        const M passes = hn::AndNot(sums.deep, hn::Ge(sums.a, Set(0.5f)));
        sums.depth = hn::IfThenElse(passes, along, sums.depth);
        sums.deep = hn::Or(sums.deep, passes);
        active = hn::And(active, hn::Lt(sums.a, Set(args.opaque)));
      }
    }
    i = hn::Add(i, direction);
    active = hn::And(active, inside());
    if (hn::AllFalse(d, active)) return sums;
  }
}

template <typename T>
void DrawType(const MediumArgs& args, const Target& target) {
  const D d;
  const Medium<T> medium(args);
  const bool xray = args.mode == VolumeMode::kXray;
  Packet nothing = {};
  for (int c = 0; c < 4; ++c) std::fill_n(nothing.v[c], kPacket, xray ? 1.0f : 0.0f);
  std::fill_n(nothing.v[4], kPacket, std::numeric_limits<float>::infinity());
  const V zero = hn::Zero(d), one = Set(1), infinity = Set(std::numeric_limits<float>::infinity());
  ForPackets(args.rays, args.field, target, nothing,
             [&](int x0, int y0, float from, Packet& packet) HWY_ATTR {
               for (int part = 0; part < kPacket; part += kLanes) {
                 V x, y;
                 PixelsOf(x0, y0, part, x, y);
                 const Ray ray = RayOf(args.rays, x, y, SceneDepth(target, x, y));
                 Sums sums = March<T>(args, medium, ray, from);
                 if (xray) {
                   sums.r = sums.g = sums.b = hn::Exp(d, hn::Neg(sums.a));
                   sums.a = one;
                 } else if (args.mode == VolumeMode::kMip) {
                   const M any = hn::Ge(sums.a, zero);
                   sums.r = sums.g = sums.b = hn::IfThenElseZero(any, sums.a);
                   sums.a = hn::IfThenElseZero(any, one);
                 } else if (args.mode == VolumeMode::kAttenuate) {
                   const Lattice l = LatticeOf(args, ray);
                   const V samples = hn::Max(hn::Sub(l.count, l.first), one);
                   sums.r = hn::Div(sums.r, samples);
                   sums.g = hn::Div(sums.g, samples);
                   sums.b = hn::Div(sums.b, samples);
                   sums.a = hn::Div(sums.a, samples);
                 }
                 hn::Store(sums.r, d, packet.v[0] + part);
                 hn::Store(sums.g, d, packet.v[1] + part);
                 hn::Store(sums.b, d, packet.v[2] + part);
                 hn::Store(sums.a, d, packet.v[3] + part);
                 const V depth = hn::Add(sums.depth, Set(args.rays.middle_depth));
                 hn::Store(hn::IfThenElse(sums.deep, depth, infinity), d, packet.v[4] + part);
               }
             });
}

DrawMedium FindMediumHere(PixelType type) {
  switch (type) {
    case PixelType::kUint8:
      return DrawType<uint8_t>;
    case PixelType::kUint16:
      return DrawType<uint16_t>;
    case PixelType::kHalf:
      return DrawType<hwy::float16_t>;
    default:
      return DrawType<float>;
  }
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::volume {

HWY_EXPORT(FindMediumHere);

DrawMedium FindMedium(PixelType type) { return HWY_DYNAMIC_DISPATCH(FindMediumHere)(type); }

}  // namespace tessera::ops::volume
#endif  // HWY_ONCE
