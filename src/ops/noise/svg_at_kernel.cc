// SVG's feTurbulence at positions: places on the lattice in double, values as the rows of a picture have
// them.
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/svg.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/svg_at_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/noise/shaped-inl.h"
#include "simd/doubles-inl.h"
#include "simd/gather-inl.h"
#include "simd/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VD;
using s::VI;

// A coordinate's two lattice lines, modulo 256, and its place between them: SvgAxis::At() in lanes.
struct SvgPlace {
  VI low, high;
  V fraction;
};
HWY_INLINE SvgPlace PlaceOf(const SvgAxis& axis, V coordinate, double scale) {
  const VD origin = s::SetD(kSvgOrigin), size = s::SetD(kSvgSize), inverse = s::SetD(1.0 / kSvgSize);
  const VD width = s::SetD(axis.width * scale);
  const VD wrap = s::SetD((axis.wrap - kSvgOrigin) * scale + kSvgOrigin);
  const auto line = [&](VD c) HWY_ATTR {
    if (axis.width > 0) c = hn::IfThenElse(hn::Ge(c, wrap), hn::Sub(c, width), c);
    return hn::Sub(c, hn::Mul(hn::Floor(hn::Mul(c, inverse)), size));  // exact
  };
  VD low[s::kParts], high[s::kParts], fraction[s::kParts];
  s::EachPart([&]<int kPart>() HWY_ATTR {
    const VD scaled = hn::Mul(hn::Mul(s::Part<kPart>(coordinate), s::SetD(axis.frequency)), s::SetD(scale));
    const VD t = hn::Add(scaled, origin), whole = hn::Trunc(t);
    low[kPart] = line(whole);
    high[kPart] = line(hn::Add(whole, s::SetD(1)));
    fraction[kPart] = hn::Sub(t, whole);
  });
  return {s::JoinIntegers(low), s::JoinIntegers(high), s::Join(fraction)};
}

HWY_INLINE V LerpOf(V a, V b, V t) { return hn::MulAdd(t, hn::Sub(b, a), a); }

// The operations of grid_kernel.cc in their order, so that whole coordinates have a picture's bits.
template <NoiseSum kSum>
void PointsOf(const SvgPoints& a) {
  const s::D d;
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const V bias = hn::Set(d, a.fractal_noise ? 0.5f : 0.0f);
  const int32_t* const selector = a.lattice->selector.data();
  for (int i = 0; i < a.count; i += s::kLanes) {
    const V x = hn::LoadU(d, a.x + i), y = hn::LoadU(d, a.y + i);
    const auto valid = hn::And(hn::IsFinite(x), hn::IsFinite(y));
    const V at_x = hn::IfThenElseZero(valid, x), at_y = hn::IfThenElseZero(valid, y);
    V sum[4] = {bias, bias, bias, bias};
    double scale = 1;
    float weight = a.fractal_noise ? 0.5f : 1.0f;
    for (int k = 0; k < a.octaves; ++k, scale *= 2, weight *= 0.5f) {
      const SvgPlace px = PlaceOf(a.axis[0], at_x, scale), py = PlaceOf(a.axis[1], at_y, scale);
      const V fx = px.fraction, fy = py.fraction, fy1 = hn::Sub(fy, one);
      const V u = s::FadeWeight(fx, static_cast<int>(NoiseFade::kCubic));
      const V v = hn::Mul(hn::Mul(fy, fy), hn::Sub(hn::Set(d, 3.0f), hn::Mul(hn::Set(d, 2.0f), fy)));
      VI point[2][2];  // of the left and right line, low and high
      for (int side = 0; side < 2; ++side) {
        const VI column = s::GatherWords<4>(selector, side == 0 ? px.low : px.high);
        for (int row = 0; row < 2; ++row) {
          const VI at = hn::Add(column, row == 0 ? py.low : py.high);
          point[side][row] = hn::ShiftLeft<1>(s::GatherWords<4>(selector, at));
        }
      }
      for (int c = 0; c < a.channels; ++c) {
        if (a.out[c] == nullptr) continue;
        const float* const gradient = a.lattice->gradient[static_cast<size_t>(c)][0].data();
        V constant[2], slope[2];
        for (int side = 0; side < 2; ++side) {
          const VI low = point[side][0], high = point[side][1];
          const V below = hn::MulAdd(s::GatherFloats(gradient + 1, low), fy, zero);
          const V above = hn::MulAdd(s::GatherFloats(gradient + 1, high), fy1, zero);
          constant[side] = LerpOf(below, above, v);
          slope[side] = LerpOf(s::GatherFloats(gradient, low), s::GatherFloats(gradient, high), v);
        }
        const V c2 = hn::Sub(hn::Sub(constant[1], slope[1]), constant[0]), c3 = hn::Sub(slope[1], slope[0]);
        const V n = hn::MulAdd(u, hn::MulAdd(c3, fx, c2), hn::MulAdd(slope[0], fx, constant[0]));
        sum[c] = hn::MulAdd(Shaped<kSum>(n), hn::Set(d, weight), sum[c]);
      }
    }
    for (int c = 0; c < a.channels; ++c) {
      if (a.out[c] == nullptr) continue;
      const V clamped = hn::Min(hn::Max(sum[c], zero), one);
      hn::StoreU(hn::IfThenElse(valid, clamped, bias), d, a.out[c] + i);
    }
  }
}

void Points(const SvgPoints& a) {
  if (a.fractal_noise) return PointsOf<NoiseSum::kFbm>(a);
  PointsOf<NoiseSum::kTurbulence>(a);
}

SvgEvaluate FindPoints() { return Points; }

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(FindPoints);
static SvgEvaluate Choose() { return HWY_DYNAMIC_DISPATCH(FindPoints)(); }
}  // namespace noise

SvgEvaluate FindSvgPoints() { return noise::Choose(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
