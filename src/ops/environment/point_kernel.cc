// Normals and lighting, pixel by pixel, in double: directions of any length, powers of any size.
#include <algorithm>
#include <cmath>
#include <limits>

#include "ops/environment/point_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/environment/point_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/environment/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace {

struct Normals {
  NormalsSetup setup;
  HWY_INLINE s::Pixels operator()(const s::Pixels& p) const {
    VD x[kParts], y[kParts], z[kParts];
    EachPart([&]<int k>() HWY_ATTR {
      const Three in = PartOf<k>(p);
      const VD scale = SetD(setup.in_scale), bias = SetD(setup.in_bias);
      Three n = {hn::MulAdd(in.x, scale, bias), hn::MulAdd(in.y, scale, bias), hn::MulAdd(in.z, scale, bias)};
      if (setup.turned) {
        const double* const m = setup.matrix;
        n = {DotOf(n, Constant(m)), DotOf(n, Constant(m + 3)), DotOf(n, Constant(m + 6))};
      }
      if (setup.reflected) {
        const Three v = Constant(setup.view);
        const VD nn = DotOf(n, n), twice = hn::Mul(SetD(2.0), DotOf(n, v));
        n = Minus(Times(n, twice), Times(v, nn));
      }
      if (setup.normalize) {
        const VD nn = DotOf(n, n);
        n = Times(n, hn::IfThenElse(Positive(nn), hn::Div(SetD(1.0), hn::Sqrt(nn)), SetD(1.0)));
      }
      const VD out = SetD(setup.out_scale), base = SetD(setup.out_bias);
      x[k] = hn::MulAdd(n.x, out, base), y[k] = hn::MulAdd(n.y, out, base), z[k] = hn::MulAdd(n.z, out, base);
    });
    return {Clean(Join(x)), Clean(Join(y)), Clean(Join(z)), p.a};
  }
};

// x^e of cosines in [0, 1]: 0 at 0, whatever e.
HWY_INLINE VD PowerOf(VD x, double e) {
  const DD d;
  const auto seen = hn::Gt(x, SetD(1e-300));
  const VD t = hn::Mul(s::Log2OfDouble<s::Precision::kDouble>(hn::IfThenElse(seen, x, SetD(1.0))), SetD(e));
  const auto counts = hn::And(seen, hn::Gt(t, SetD(-900.0)));
  (void)d;
  return hn::IfThenElseZero(counts, s::Exp2OfDouble<s::Precision::kDouble>(hn::IfThenElseZero(counts, t)));
}

struct Lighting {
  PhongSetup setup;

  // Codes of a framebuffer, for numbers in [0, 1].
  HWY_INLINE VD Coded(VD v) const {
    if (setup.params.bits == 0) return v;
    const double codes = std::ldexp(1.0, setup.params.bits) - 1;
    return hn::Div(hn::Round(hn::Mul(v, SetD(codes))), SetD(codes));
  }
  HWY_INLINE VD Power(VD base) const {
    const DD d;
    base = hn::Min(hn::Max(base, hn::Zero(d)), SetD(1.0));
    if (setup.table.empty()) return PowerOf(base, setup.params.exponent);
    const VD coded = Coded(base);
    const double last = static_cast<double>(setup.table.size() - 1);
    const VD at = hn::Mul(coded, SetD(last));
    const VD cell = hn::Min(hn::Floor(at), SetD(last - 1));
    const hn::RebindToSigned<DD> di;
    const auto index = hn::ConvertTo(di, cell);
    const VD low = hn::GatherIndex(d, setup.table.data(), index);
    const VD high = hn::GatherIndex(d, setup.table.data() + 1, index);
    return Coded(hn::MulAdd(hn::Sub(at, cell), hn::Sub(high, low), low));
  }

  template <int kPart>
  HWY_INLINE void Run(const s::Pixels& normal, const s::Pixels* position, VD* r, VD* g, VD* b) const {
    const DD d;
    const PhongParams& p = setup.params;
    const VD zero = hn::Zero(d), one = SetD(1.0);
    const Three raw = PartOf<kPart>(normal);
    const VD nn = DotOf(raw, raw);
    auto valid = Positive(nn);
    const Three n = Times(raw, hn::Div(one, hn::Sqrt(hn::IfThenElse(valid, nn, one))));
    // Of any length: what is exactly at right angles stays so.
    Three to_light = Constant(setup.light);
    Three l = Constant(p.light.data()), v = Constant(p.view.data()), s = Constant(setup.halfway);
    VD weight = one;
    if (position != nullptr) {
      const Three at = PartOf<kPart>(*position);
      const auto unit = [&](const Three& t, VD* length) HWY_ATTR {
        const VD square = DotOf(t, t);
        *length = hn::Sqrt(square);
        return Times(t, hn::IfThenElseZero(hn::Gt(square, zero), hn::Div(one, *length)));
      };
      valid = hn::And(valid, hn::Lt(DotOf(at, at), hn::Inf(d)));
      VD distance;
      if (p.eye) v = unit(Minus(Constant(p.eye->data()), at), &distance);
      if (p.point) {
        to_light = Minus(Constant(p.light.data()), at);
        l = unit(to_light, &distance);
        const VD fall = hn::MulAdd(hn::MulAdd(SetD(p.attenuation[2]), distance, SetD(p.attenuation[1])),
                                   distance, SetD(p.attenuation[0]));
        weight = hn::Div(one, hn::Max(fall, SetD(1e-20)));
        if (setup.spot_cosine > -2) {
          const VD c = hn::Neg(DotOf(l, Constant(p.spot_direction.data())));
          const VD inside = PowerOf(hn::Min(hn::Max(c, zero), one), p.spot_exponent);
          const VD cone = p.spot_exponent == 0 ? one : inside;
          weight = hn::IfThenElseZero(hn::Ge(c, SetD(setup.spot_cosine)), hn::Mul(weight, cone));
        }
      }
      if (p.highlight == Highlight::kHalfway) {
        VD length;
        s = unit({hn::Add(l.x, v.x), hn::Add(l.y, v.y), hn::Add(l.z, v.z)}, &length);
      }
    }
    const VD ln = DotOf(l, n);
    VD base;
    if (p.highlight == Highlight::kHalfway) {
      base = DotOf(s, n);
    } else {
      const VD vn = DotOf(v, n);
      base = DotOf(Minus(Times(n, hn::Add(vn, vn)), v), l);
    }
    const bool shiny = p.specular[0] != 0 || p.specular[1] != 0 || p.specular[2] != 0;
    const VD high = shiny ? hn::IfThenElseZero(hn::Gt(DotOf(to_light, raw), zero), Power(base)) : zero;
    const VD diffuse = hn::Max(ln, zero);
    const auto channel = [&](size_t c) HWY_ATTR {
      VD sum = hn::MulAdd(diffuse, SetD(p.diffuse[c]), SetD(p.ambient[c]));
      sum = hn::MulAdd(high, SetD(p.specular[c]), sum);
      return hn::IfThenElseZero(valid, hn::MulAdd(sum, weight, SetD(p.emission[c])));
    };
    *r = channel(0), *g = channel(1), *b = channel(2);
  }
  HWY_INLINE s::Pixels All(const s::Pixels& normal, const s::Pixels* position) const {
    VD r[kParts], g[kParts], b[kParts];
    EachPart([&]<int k>() HWY_ATTR { Run<k>(normal, position, &r[k], &g[k], &b[k]); });
    return {Join(r), Join(g), Join(b), normal.a};
  }
  HWY_INLINE s::Pixels operator()(const s::Pixels& normal) const { return All(normal, nullptr); }
  HWY_INLINE s::Pixels operator()(const s::Pixels& normal, const s::Pixels& position) const {
    return All(normal, &position);
  }
};

}  // namespace

std::unique_ptr<graph::PointStage> NormalsOfTarget(const NormalsSetup& setup) {
  return s::MakeStage<1>(Normals{setup});
}
std::unique_ptr<graph::PointStage> PhongOfTarget(const PhongSetup& setup) {
  if (setup.positions) return s::MakeStage<2>(Lighting{setup});
  return s::MakeStage<1>(Lighting{setup});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NormalsOfTarget);
HWY_EXPORT(PhongOfTarget);

std::unique_ptr<graph::PointStage> MakeNormalsStage(const NormalsSetup& setup) {
  return HWY_DYNAMIC_DISPATCH(NormalsOfTarget)(setup);
}
std::unique_ptr<graph::PointStage> MakePhongStage(const PhongSetup& setup) {
  return HWY_DYNAMIC_DISPATCH(PhongOfTarget)(setup);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
