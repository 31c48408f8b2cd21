// Density modulation functions: where the field is read, what becomes of its density, and how far each acts.
#if defined(TESSERA_OPS_VOLUME_CHAIN_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_VOLUME_CHAIN_INL_H_
#undef TESSERA_OPS_VOLUME_CHAIN_INL_H_
#else
#define TESSERA_OPS_VOLUME_CHAIN_INL_H_
#endif

#include <hwy/highway.h>

#include "ops/volume/exact_noise-inl.h"
#include "ops/volume/rays-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

using Kind = Dmf::Kind;

// Functions of their own, not inline: what they do takes far longer than a call, and every sample type,
// method and instruction set would hold its own copies.

// Turbulence at p by the lookups that a step asks for.
inline HWY_NOINLINE V Turbulence(const DmfStep& step, const Vec3& p) {
  switch (step.lookup) {
    case TurbulenceLookup::kBlock:
      return NoiseValue(step.noise, p);
    case TurbulenceLookup::kExact:
      return ExactTurbulence(step.noise, step.exact, p);
    case TurbulenceLookup::kFourChannels: {
      V c[4];
      NoiseChannels(step.noise, p, c);
      V sum = hn::Abs(c[0]);
      for (int k = 1; k < 4; ++k)
        sum = hn::MulAdd(hn::Abs(c[k]), Set(1.0f / static_cast<float>(1 << k)), sum);
      return sum;
    }
    default: {
      const int octaves = step.lookup == TurbulenceLookup::kFour ? 4 : 8;
      V sum = hn::Zero(D());
      for (int k = 0; k < octaves; ++k) {
        const auto scale = static_cast<float>(1 << k);
        const V n = NoiseAt(step.noise, LocateNoise(step.noise, p, scale, kOctaveShifts[k]));
        sum = hn::MulAdd(hn::Abs(n), Set(1 / scale), sum);
      }
      return sum;
    }
  }
}

// What a sample is: a value for the transfer function and, where it is lit, a normal.
struct Sample {
  V value;      // field value, or density
  V distance;   // hypertexture
  Vec3 normal;  // world, outward; unit or zero
  V slope;      // of the field, per world unit; where the chain asks for it
  V patch;      // fur: what colour changes by from place to place
};

// Linear between points.
HWY_INLINE V ValueOf(const Line& line, V at) {
  V value = Set(line[0].value);
  for (const LinePoint& point : line) {
    const V here = hn::MulAdd(hn::Sub(at, Set(point.at)), Set(point.slope), Set(point.value));
    value = hn::IfThenElse(hn::Ge(at, Set(point.at)), here, value);
  }
  return value;
}
// How much of a step acts at p; `solid` and what is known of the field there (null: nothing, of steps that
// move the place where it is read).
inline HWY_NOINLINE V WeightOf(const MediumArgs& args, const DmfStep& step, const Vec3& p,
                               const Sample* sample, V solid) {
  const RaySet& set = args.rays;
  const auto world = [&](V v, int a)
                         HWY_ATTR { return hn::MulAdd(v, Set(set.spacing[a]), Set(set.to_world[a])); };
  const Vec3 own = {world(p.x, 0), world(p.y, 1), world(p.z, 2)};
  V product = Set(1);
  for (const DmfWeight& weight : step.weights) {
    const Vec3 place = {Set(weight.place[0]), Set(weight.place[1]), Set(weight.place[2])};
    V at = solid;
    switch (weight.kind) {
      case DmfInput::Kind::kGradient:
        at = sample->slope;
        break;
      case DmfInput::Kind::kLight:
        at = Dot(sample->normal, ToLight(set, args.light, p));
        break;
      case DmfInput::Kind::kEye:
        at = Dot(sample->normal, ToLight(set, args.eye, p));
        break;
      case DmfInput::Kind::kDensity:
        break;
      case DmfInput::Kind::kHeight:
        at = own.y;
        break;
      case DmfInput::Kind::kPlane:
        at = Dot(place, own);
        break;
      case DmfInput::Kind::kSphere: {
        const Vec3 away = AddScaled(own, place, Set(-1));
        at = hn::Sqrt(Dot(away, away));
      }
    }
    product = hn::Mul(product, ValueOf(weight.line, at));
  }
  return product;
}

inline bool Moves(Kind kind) { return kind == Kind::kWarp || kind == Kind::kLift || kind == Kind::kSwell; }
// Where the field is read for a sample at p.
inline HWY_NOINLINE void Displace(const MediumArgs& args, const DmfStep& step, const Vec3& p, Vec3& q,
                                  V& turbulence) {
  switch (step.kind) {
    case Kind::kWarp: {
      V n[4];
      NoiseChannels(step.noise, p, n);
      q.x = hn::MulAdd(n[0], Set(step.amount / args.rays.spacing[0]), q.x);
      q.y = hn::MulAdd(n[1], Set(step.amount / args.rays.spacing[1]), q.y);
      q.z = hn::MulAdd(n[2], Set(step.amount / args.rays.spacing[2]), q.z);
      return;
    }
    case Kind::kLift:
      turbulence = Turbulence(step, p);
      q.y = hn::NegMulAdd(turbulence, Set(step.amount), q.y);
      return;
    case Kind::kSwell: {
      const V grow = hn::Mul(hn::Sub(Turbulence(step, p), Set(step.second)), Set(step.amount));
      const auto axis = [&](V v, float last)
                            HWY_ATTR { return hn::MulAdd(hn::Sub(v, Set(0.5f * last)), grow, v); };
      q = {axis(q.x, args.field.last[0]), axis(q.y, args.field.last[1]), axis(q.z, args.field.last[2])};
      return;
    }
    default:
      return;
  }
}

HWY_INLINE void Move(const MediumArgs& args, const DmfStep& step, const Vec3& p, Vec3& q, V& turbulence) {
  const Vec3 before = q;
  Displace(args, step, p, q, turbulence);
  if (step.weights.empty()) return;
  const V share = WeightOf(args, step, p, nullptr, hn::Zero(D()));
  q = {Lerp(before.x, q.x, share), Lerp(before.y, q.y, share), Lerp(before.z, q.z, share)};
}

// A density t torn by turbulence.
HWY_INLINE V Torn(const DmfStep& step, V turbulence, V t) {
  return Clamp01(hn::Mul(t, hn::MulAdd(turbulence, Set(step.amount), Set(1 - step.amount))));
}
// A density t, `solid` before the chain, after one more function.
inline HWY_NOINLINE V Modulate(const MediumArgs& args, const DmfStep& step, const Vec3& p, V distance,
                               V solid, V t) {
  const D d;
  const V one = Set(1);
  switch (step.kind) {
    case Kind::kBias:
      return Power(t, step.amount);
    case Kind::kGain: {
      const M low = hn::Lt(t, Set(0.5f));
      const V u = hn::IfThenElse(low, t, hn::Sub(one, t));
      const V half = hn::Mul(Set(0.5f), Power(hn::Add(u, u), step.amount));
      return hn::IfThenElse(low, half, hn::Sub(one, half));
    }
    case Kind::kNoise: {
      // None at the ends of the soft region, all of it an eighth further in.
      const V window = hn::Min(hn::Mul(hn::Min(solid, hn::Sub(one, solid)), Set(8)), one);
      return Clamp01(hn::MulAdd(NoiseValue(step.noise, p), hn::Mul(window, Set(step.amount)), t));
    }
    case Kind::kTurbulence:
      return Torn(step, Turbulence(step, p), t);
    case Kind::kThreshold: {
      const V u = Clamp01(hn::Mul(hn::Sub(t, Set(step.amount)), Set(step.second)));
      const V risen = hn::Mul(hn::Mul(u, u), hn::NegMulAdd(u, Set(2), Set(3)));
      return hn::IfThenElseZero(hn::Gt(solid, hn::Zero(d)), risen);
    }
    case Kind::kTable:
      return hn::IfThenElseZero(hn::Gt(solid, hn::Zero(d)), Clamp01(ValueOf(step.table, t)));
    case Kind::kFunction: {
      HWY_ALIGN float x[kLanes], y[kLanes], z[kLanes], dist[kLanes], density[kLanes];
      const RaySet& r = args.rays;
      hn::Store(hn::MulAdd(p.x, Set(r.spacing[0]), Set(r.to_world[0])), d, x);
      hn::Store(hn::MulAdd(p.y, Set(r.spacing[1]), Set(r.to_world[1])), d, y);
      hn::Store(hn::MulAdd(p.z, Set(r.spacing[2]), Set(r.to_world[2])), d, z);
      hn::Store(distance, d, dist);
      hn::Store(t, d, density);
      (*step.function)({kLanes, x, y, z, dist, density});
      return Clamp01(hn::Load(d, density));
    }
    default:
      return t;
  }
}

// The same as far as the step acts there.
HWY_INLINE V Weighted(const MediumArgs& args, const DmfStep& step, const Vec3& p, const Sample& sample,
                      V solid, V t, V changed) {
  if (step.weights.empty()) return changed;
  return Lerp(t, changed, WeightOf(args, step, p, &sample, solid));
}
// The magnitude of a gradient in codes per voxel, per world unit.
HWY_INLINE V SlopeOf(const MediumArgs& args, const Vec3& gradient) {
  const RaySet& set = args.rays;
  const Vec3 g = {hn::Mul(gradient.x, Set(args.field.scale / set.spacing[0])),
                  hn::Mul(gradient.y, Set(args.field.scale / set.spacing[1])),
                  hn::Mul(gradient.z, Set(args.field.scale / set.spacing[2]))};
  return hn::Sqrt(Dot(g, g));
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
