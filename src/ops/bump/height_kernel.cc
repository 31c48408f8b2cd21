// Slopes, normals and relief from heights: differences first, in double.
#include <algorithm>
#include <cmath>

#include "ops/bump/height.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/bump/height_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::DD;
using s::VD;
using DF = hn::Rebind<float, DD>;

struct Height {
  VD x, y, e;
};

HWY_INLINE VD Framebuffer(VD v, int bits) {
  const DD d;
  if (bits == 0) return v;
  const double codes = std::ldexp(1.0, bits) - 1;
  const VD limited = hn::Min(hn::Max(v, hn::Zero(d)), hn::Set(d, 1.0));
  return hn::IfThenElse(hn::Eq(v, v),
                        hn::Div(hn::Round(hn::Mul(limited, hn::Set(d, codes))), hn::Set(d, codes)), v);
}

HWY_INLINE Height Measure(const HeightSetup& setup, const float* at, ptrdiff_t stride) {
  const DD d;
  const DF df;
  const VD centre = Framebuffer(hn::PromoteTo(d, hn::LoadU(df, at)), setup.bits);
  Height h = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  for (const HeightTap& tap : setup.taps) {
    const VD there = Framebuffer(hn::PromoteTo(d, hn::LoadU(df, at + tap.dy * stride + tap.dx)), setup.bits);
    const VD difference = hn::Sub(there, centre);
    if (tap.x != 0) h.x = hn::MulAdd(difference, hn::Set(d, tap.x), h.x);
    if (tap.y != 0) h.y = hn::MulAdd(difference, hn::Set(d, tap.y), h.y);
    if (tap.e != 0) h.e = hn::MulAdd(difference, hn::Set(d, tap.e), h.e);
  }
  const VD scale = hn::Set(d, setup.scale);
  return {hn::Mul(h.x, scale), hn::Mul(h.y, scale), hn::Mul(h.e, scale)};
}
// 1 / sqrt(1 + f_x^2 + f_y^2).
HWY_INLINE VD Over(const Height& h) {
  const DD d;
  const VD one = hn::Set(d, 1.0);
  return hn::Div(one, hn::Sqrt(hn::MulAdd(h.x, h.x, hn::MulAdd(h.y, h.y, one))));
}
// One NaN for all.
HWY_INLINE void Store(VD v, float* to) {
  const DD d;
  const VD clean = hn::IfThenElse(hn::IsNaN(v), hn::NaN(d), v);
  hn::StoreU(hn::DemoteTo(DF(), clean), DF(), to);
}

void HeightNormals(const HeightSetup& setup, const float* row, ptrdiff_t stride, int count, float* x,
                   float* y, float* z) {
  const DD d;
  const VD factor = hn::Set(d, setup.pack ? 0.5 : 1.0), base = hn::Set(d, setup.pack ? 0.5 : 0.0);
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const Height h = Measure(setup, row + i, stride);
    const VD over = Over(h);
    Store(hn::NegMulAdd(hn::Mul(h.x, over), factor, base), x + i);
    Store(hn::NegMulAdd(hn::Mul(h.y, over), factor, base), y + i);
    Store(hn::MulAdd(over, factor, base), z + i);
  }
}

void HeightShade(const HeightSetup& setup, const float* row, ptrdiff_t stride, int count, float* out) {
  const DD d;
  const VD dx = hn::Set(d, setup.direction[0]), dy = hn::Set(d, setup.direction[1]),
           dz = hn::Set(d, setup.direction[2]);
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const Height h = Measure(setup, row + i, stride);
    // E / s.
    const VD e = setup.slopes_only ? hn::Neg(hn::MulAdd(dx, h.x, hn::Mul(dy, h.y)))
                                   : hn::Mul(h.e, hn::Set(d, 1 / setup.shift));
    VD v;
    if (setup.output == BumpOutput::kEmboss) {
      v = hn::MulAdd(e, hn::Set(d, setup.shift), hn::Set(d, 0.5));
    } else {
      v = hn::Add(e, dz);
      if (setup.length) v = hn::Mul(v, Over(h));
      const auto number = hn::Eq(v, v);
      const VD shown = hn::Max(v, hn::Zero(d));
      v = hn::IfThenElse(number, shown, v);
      if (setup.output == BumpOutput::kSpecular) {
        const auto seen = hn::And(hn::Gt(v, hn::Set(d, 1e-300)), hn::Lt(v, hn::Inf(d)));
        const VD log = s::Log2OfDouble<s::Precision::kDouble>(hn::IfThenElse(seen, v, hn::Set(d, 1.0)));
        const VD t = hn::Min(hn::Mul(log, hn::Set(d, setup.exponent)), hn::Set(d, 900.0));
        const auto counts = hn::And(seen, hn::Gt(t, hn::Set(d, -900.0)));
        const VD power = s::Exp2OfDouble<s::Precision::kDouble>(hn::IfThenElseZero(counts, t));
        v = hn::IfThenElse(counts, power, hn::IfThenElse(number, hn::Zero(d), v));
      }
    }
    Store(Framebuffer(v, setup.bits), out + i);
  }
}

}  // namespace

HeightKernels HeightKernelsOfTarget() { return {&HeightNormals, &HeightShade}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(HeightKernelsOfTarget);

HeightKernels ChooseHeightKernels() { return HWY_DYNAMIC_DISPATCH(HeightKernelsOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
