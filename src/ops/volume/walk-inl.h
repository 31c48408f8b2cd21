// A ray's samples on their lattice: which of them are looked at, and the sums along the ray.
#if defined(TESSERA_OPS_VOLUME_WALK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_VOLUME_WALK_INL_H_
#undef TESSERA_OPS_VOLUME_WALK_INL_H_
#else
#define TESSERA_OPS_VOLUME_WALK_INL_H_
#endif

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include <limits>

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

// Where rays leave a block of cells, a little before its face so that rounding skips no sample behind it.
class Exit {
 public:
  Exit() = default;
  // `direction`: 1 along the rays, -1 against them.
  HWY_INLINE Exit(const Field& field, const Ray& ray, float direction) : direction_(direction) {
    constexpr float kMargin = 0.01f;  // voxels
    const auto axis = [&](V origin, V along, V& inverse, V& plane) HWY_ATTR {
      const V way = hn::Mul(along, Set(direction));
      const M down = hn::Lt(way, hn::Zero(D()));
      const V size = hn::Max(hn::Abs(way), Set(1e-20f));
      inverse = hn::Div(Set(1), hn::IfThenElse(down, hn::Neg(size), size));
      plane = hn::Sub(hn::IfThenElse(down, Set(kMargin), Set(field.edge - kMargin)), origin);
    };
    axis(ray.origin.x, ray.direction.x, inverse_.x, plane_.x);
    axis(ray.origin.y, ray.direction.y, inverse_.y, plane_.y);
    axis(ray.origin.z, ray.direction.z, inverse_.z, plane_.z);
  }
  // How far it is from `along` to the end of the block.
  HWY_INLINE V Of(const Field& field, const Vec3& block, V along) const {
    const V edge = Set(field.edge);
    const auto axis = [&](V at, V inverse, V plane)
                          HWY_ATTR { return hn::Mul(hn::MulAdd(at, edge, plane), inverse); };
    const V leave = hn::Min(hn::Min(axis(block.x, inverse_.x, plane_.x), axis(block.y, inverse_.y, plane_.y)),
                            axis(block.z, inverse_.z, plane_.z));
    return hn::NegMulAdd(along, Set(direction_), leave);
  }

 private:
  float direction_ = 1;
  Vec3 inverse_, plane_;
};

// How many samples from a place whose leap entry says that nothing is near, at least 1.
HWY_INLINE V StepsOf(const Field& field, const Exit& exit, const Vec3& block, V room, V along, V per_voxel,
                     V per_step) {
  const V steps = hn::Max(hn::Floor(hn::Mul(room, per_voxel)), Set(1));
  return hn::Max(steps, hn::Ceil(hn::Mul(exit.Of(field, block, along), per_step)));
}
// Room of a leap grid's entry, voxels; negative in blocks that matter.
HWY_INLINE V RoomOf(VI entry) {
  return hn::Sub(hn::ConvertTo(D(), hn::And(entry, hn::Set(DI(), 255))), Set(1));
}

// How much of a sample's segment is inside: 1 but at the ends.
HWY_INLINE V ShareOf(const Ray& ray, V along, V per_step) {
  const V low = hn::Max(Set(-0.5f), hn::Mul(hn::Sub(ray.begin, along), per_step));
  const V high = hn::Min(Set(0.5f), hn::Mul(hn::Sub(ray.end, along), per_step));
  return hn::Max(hn::Sub(high, low), hn::Zero(D()));
}

// A ray on its lattice, along it (direction 1) or against it (-1).
struct Walk {
  Lattice lattice;
  V per_step, per_voxel;  // of a step's length: planar depth and voxels
  V length;               // of a step, world units
  V start;                // the first sample
  Vec3 to_eye;
  float direction;
  Exit exit;

  HWY_INLINE Walk(const MediumArgs& args, const Ray& ray, float from, float way)
      : lattice(LatticeOf(args, ray)), direction(way), exit(args.field, ray, way) {
    per_step = hn::Div(Set(1), lattice.step);
    per_voxel = hn::Div(Set(1), hn::Mul(lattice.step, ray.length));
    length = hn::Mul(lattice.step, ray.world);
    to_eye = ToEye(args.rays, ray);
    start = hn::Max(lattice.first, hn::Floor(hn::Mul(hn::Sub(Set(from), lattice.base), per_step)));
  }
  HWY_INLINE V First() const { return direction < 0 ? hn::Sub(lattice.count, Set(1)) : start; }
  HWY_INLINE M Holds(V i) const { return hn::And(hn::Ge(i, start), hn::Lt(i, lattice.count)); }
  HWY_INLINE V Along(V i) const { return hn::MulAdd(i, lattice.step, lattice.base); }
  // The shares of K samples from i. Those between the first and the last have exactly 1.
  template <int K>
  HWY_INLINE void Shares(const Ray& ray, V i, V (&share)[K]) const {
    const V one = Set(1);
    for (int k = 0; k < K; ++k) share[k] = one;
    const M inside =
        hn::And(hn::Gt(i, lattice.first), hn::Lt(hn::Add(i, Set(static_cast<float>(K))), lattice.count));
    if (hn::AllTrue(D(), inside)) return;
    for (int k = 0; k < K; ++k) {
      const V at = hn::Add(i, Set(static_cast<float>(k)));
      const M between = hn::And(hn::Gt(at, lattice.first), hn::Lt(hn::Add(at, one), lattice.count));
      share[k] = hn::IfThenElse(between, one, ShareOf(ray, Along(at), per_step));
    }
  }
  // How many samples from one at this distance to the next that may be seen; 0 where it may be seen itself.
  HWY_INLINE V Free(const MediumArgs& args, V distance) const {
    constexpr float kMargin = 0.01f;  // voxels
    const V free = hn::MulSub(hn::Sub(distance, Set(args.far)), Set(args.pace), Set(kMargin));
    const V steps = hn::Add(hn::Floor(hn::Mul(free, per_voxel)), Set(1));
    return hn::IfThenElseZero(hn::Gt(free, hn::Zero(D())), steps);
  }
  // Leaps until all rays that go on are where something may be; false: none goes on. Rays that have ended
  // leap too: the next place then waits for no sum.
  HWY_INLINE bool Leap(const Field& field, const Ray& ray, V& i, M& active) const {
    const D d;
    while (field.leaps) {
      const V along = Along(i);
      const Block block = BlockOf(field, At(ray, along));
      const V room = RoomOf(LeapOf(field.leap, block.index));
      const M empty = hn::Ge(room, hn::Zero(d));
      if (hn::AllFalse(d, hn::And(active, empty))) break;
      const V steps = StepsOf(field, exit, block.at, room, along, per_voxel, per_step);
      i = hn::IfThenElse(empty, hn::MulAdd(Set(direction), steps, i), i);
      active = hn::And(active, Holds(i));
      if (hn::AllFalse(d, active)) return false;
    }
    return !hn::AllFalse(d, active);
  }
};

// The sums along rays.
struct Sums {
  V r, g, b, a;  // colour, alpha (or the sum, or the maximum)
  V depth;       // where alpha passes 1/2
  M deep;
};
// A sample behind those that are summed.
HWY_INLINE void Under(const s::Pixels& c, V alpha, V along, Sums& sums) {
  const V weight = hn::NegMulAdd(sums.a, alpha, alpha);
  sums.r = hn::MulAdd(c.r, weight, sums.r);
  sums.g = hn::MulAdd(c.g, weight, sums.g);
  sums.b = hn::MulAdd(c.b, weight, sums.b);
  sums.a = hn::Add(sums.a, weight);
  const M passes = hn::AndNot(sums.deep, hn::Ge(sums.a, Set(0.5f)));
  sums.depth = hn::IfThenElse(passes, along, sums.depth);
  sums.deep = hn::Or(sums.deep, passes);
}
// Their pixels.
HWY_INLINE void Store(const Sums& sums, float middle_depth, int part, Packet& packet) {
  const D d;
  hn::Store(sums.r, d, packet.v[0] + part);
  hn::Store(sums.g, d, packet.v[1] + part);
  hn::Store(sums.b, d, packet.v[2] + part);
  hn::Store(sums.a, d, packet.v[3] + part);
  const V depth = hn::Add(sums.depth, Set(middle_depth));
  hn::Store(hn::IfThenElse(sums.deep, depth, Set(std::numeric_limits<float>::infinity())), d,
            packet.v[4] + part);
}
// 1 - exp(-x) of x >= 0, relative error 2^-23: -x = n log 2 + r, exp(r) - 1 by a polynomial.
HWY_INLINE V Opacity(V extinction, V length, V share) {
  const D d;
  const DI di;
  const V one = Set(1), whole = Set(0x1.8p23f);  // numbers of this size are whole
  const V x = hn::Min(hn::Mul(hn::Mul(extinction, length), share), Set(80));
  const V shifted = hn::NegMulAdd(x, Set(1.44269504f), whole);
  const V r = hn::NegMulSub(hn::Sub(shifted, whole), Set(0.693147181f), x);
  const V power = hn::BitCast(d, hn::Add(hn::ShiftLeft<23>(hn::BitCast(di, shifted)), hn::BitCast(di, one)));
  V rest = hn::MulAdd(r, Set(0.0013926184f), Set(0.00836317893f));
  rest = hn::MulAdd(rest, r, Set(0.0416665561f));
  rest = hn::MulAdd(rest, r, Set(0.166665763f));
  rest = hn::MulAdd(rest, r, Set(0.5f));
  const V grown = hn::MulAdd(hn::Mul(r, r), rest, r);
  return hn::NegMulAdd(power, grown, hn::Sub(one, power));
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
