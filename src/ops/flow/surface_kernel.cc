// Vectors on a surface to vectors on the picture, in double: products of floats are exact there, and so are
// differences of positions.
#include <limits>

#include "ops/flow/surface_field.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/flow/surface_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/environment/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace {

using flow::SurfaceRow;
using flow::SurfaceSetup;
using DF = hn::Rebind<float, DD>;
using Mask = hn::Mask<DD>;

HWY_INLINE Three Load(const float* const (&planes)[3], ptrdiff_t at) {
  const auto one = [at](const float* plane)
                       HWY_ATTR { return hn::PromoteTo(DD(), hn::LoadU(DF(), plane + at)); };
  return {one(planes[0]), one(planes[1]), one(planes[2])};
}
HWY_INLINE VD Square(const Three& v) { return DotOf(v, v); }
HWY_INLINE Three Given(Mask mask, const Three& v) {
  return {hn::IfThenElseZero(mask, v.x), hn::IfThenElseZero(mask, v.y), hn::IfThenElseZero(mask, v.z)};
}
HWY_INLINE Mask IsNumber(VD v) { return hn::Lt(hn::Abs(v), hn::Inf(DD())); }

// From one pixel to the next: how far the positions are apart, and whether a surface joins them.
struct Pair {
  Three step;
  Mask is_known, is_cut;
};
HWY_INLINE Pair Measure(const SurfaceSetup& setup, const float* const (&planes)[3], ptrdiff_t at,
                        ptrdiff_t by) {
  const Three from = Load(planes, at), to = Load(planes, at + by);
  Pair pair;
  pair.step = Minus(to, from);
  const VD apart = Square(pair.step);
  pair.is_known = IsNumber(apart);
  pair.is_cut = hn::MaskFromVec(hn::Zero(DD()));
  if (setup.edge > 0) {
    const VD before = Square(Minus(from, Load(planes, at - by))),
             after = Square(Minus(Load(planes, at + 2 * by), to));
    const VD beside =
        hn::Max(hn::IfThenElseZero(IsNumber(before), before), hn::IfThenElseZero(IsNumber(after), after));
    // Beside steps of 0 nothing can be said.
    pair.is_cut = hn::And(hn::And(pair.is_known, hn::Gt(beside, hn::Zero(DD()))),
                          hn::Gt(apart, hn::Mul(beside, SetD(setup.edge))));
  }
  return pair;
}

// The derivative along an axis from the pairs of both sides, those that a surface joins.
HWY_INLINE Three Derivative(const Pair& before, const Pair& after, Mask& is_known) {
  const Mask one = hn::AndNot(before.is_cut, before.is_known),
             other = hn::AndNot(after.is_cut, after.is_known);
  is_known = hn::Or(one, other);
  const VD factor = hn::IfThenElse(hn::And(one, other), SetD(0.5), SetD(1));
  return Times(Plus(Given(one, before.step), Given(other, after.step)), factor);
}

struct Flat {
  VD x, y;
};

// V = x P_x + y P_y + what is across the surface: by the reciprocal basis.
HWY_INLINE Flat ByDifferences(const Three& vector, const Three& px, const Three& py, Mask& is_known) {
  const Three across = CrossOf(px, py);
  const VD area = Square(across), lengths = hn::Mul(Square(px), Square(py));
  is_known = hn::And(is_known, hn::And(Positive(lengths), hn::Gt(area, hn::Mul(lengths, SetD(1e-20)))));
  return {hn::Div(DotOf(vector, CrossOf(py, across)), area),
          hn::Div(DotOf(vector, CrossOf(across, px)), area)};
}

// How far the picture of a point moves with the part of the vector that is along the surface.
HWY_INLINE Flat ByCamera(const SurfaceSetup& setup, const Three& vector, const Three& normal, const Three& p,
                         Mask& is_known) {
  const VD length = Square(normal);
  is_known = hn::And(is_known, Positive(length));
  const Three along = Minus(vector, Times(normal, hn::Div(DotOf(vector, normal), length)));
  const double* const m = setup.matrix;
  const auto moves = [&](const double* row) HWY_ATTR {
    return hn::MulAdd(SetD(row[2]), along.z,
                      hn::MulAdd(SetD(row[1]), along.y, hn::Mul(SetD(row[0]), along.x)));
  };
  const VD w = RowTimes(m + 12, p.x, p.y, p.z), w_moves = moves(m + 12), square = hn::Mul(w, w);
  is_known = hn::And(is_known, Positive(square));
  const auto part = [&](const double* row, double pixels) HWY_ATTR {
    const VD at = RowTimes(row, p.x, p.y, p.z);
    return hn::Mul(SetD(pixels), hn::Div(hn::NegMulAdd(at, w_moves, hn::Mul(moves(row), w)), square));
  };
  return {part(m, setup.across), part(m + 4, -setup.down)};
}

void RunRow(const SurfaceSetup& setup, const SurfaceRow& row) {
  const auto lanes = static_cast<ptrdiff_t>(hn::Lanes(DD()));
  const ptrdiff_t down = row.stride;
  for (ptrdiff_t i = 0; i < row.count; i += lanes) {
    const auto pair = [&](ptrdiff_t at, ptrdiff_t by)
                          HWY_ATTR { return Measure(setup, row.position, i + at, by); };
    const Pair right = pair(0, 1), below = pair(0, down);
    const Three vector = Load(row.vector, i);
    Mask is_known = IsNumber(Square(vector));
    Flat flat;
    if (setup.by_camera) {
      flat = ByCamera(setup, vector, Load(row.normal, i), Load(row.position, i), is_known);
    } else {
      Mask x_known, y_known;
      const Three px = Derivative(pair(-1, 1), right, x_known),
                  py = Derivative(pair(-down, down), below, y_known);
      is_known = hn::And(is_known, hn::And(x_known, y_known));
      flat = ByDifferences(vector, px, py, is_known);
    }
    if (setup.edge > 0) {
      // Of two neighbours that no surface joins the one to the left or above is left out: whoever goes from
      // the one to the other, by a side or a corner, comes by such a pixel.
      const Mask cut = hn::Or(hn::Or(right.is_cut, below.is_cut),
                              hn::Or(pair(0, down + 1).is_cut, pair(0, down - 1).is_cut));
      is_known = hn::AndNot(cut, is_known);
    }
    const VD most = SetD(std::numeric_limits<float>::max());
    is_known = hn::And(is_known, hn::And(hn::Le(hn::Abs(flat.x), most), hn::Le(hn::Abs(flat.y), most)));
    const auto store = [&](VD v, float* to) HWY_ATTR {
      hn::StoreU(hn::DemoteTo(DF(), hn::IfThenElseZero(is_known, v)), DF(), to + i);
    };
    store(flat.x, row.x), store(flat.y, row.y), store(SetD(1), row.known);
  }
}

}  // namespace

flow::SurfaceFunction SurfaceFunctionOfTarget() { return &RunRow; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(SurfaceFunctionOfTarget);

namespace flow {
SurfaceFunction ChooseSurfaceFunction() { return HWY_DYNAMIC_DISPATCH(SurfaceFunctionOfTarget)(); }
}  // namespace flow

}  // namespace tessera::ops
#endif  // HWY_ONCE
