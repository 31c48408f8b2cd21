// Tangent frames and combined normals, pixel by pixel, in double.
#include "ops/bump/frame.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/bump/frame_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/environment/vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace {

// f(part of every image) -> Three, joined to floats beside the first image's alpha.
template <class F>
HWY_INLINE s::Pixels EachPixel(V alpha, const F& f) {
  VD x[kParts], y[kParts], z[kParts];
  EachPart([&]<int k>() HWY_ATTR {
    const Three r = f.template operator()<k>();
    x[k] = r.x, y[k] = r.y, z[k] = r.z;
  });
  return {Clean(Join(x)), Clean(Join(y)), Clean(Join(z)), alpha};
}

// Codes in [0, 1] to [-1, 1].
HWY_INLINE Three Unpack(const Three& codes) {
  const auto unpack = [](VD c) HWY_ATTR { return hn::MulAdd(c, SetD(2.0), SetD(-1.0)); };
  return {unpack(codes.x), unpack(codes.y), unpack(codes.z)};
}

struct Tangent {
  TangentNormalsParams params;
  HWY_INLINE s::Pixels operator()(const s::Pixels& map, const s::Pixels& normal,
                                  const s::Pixels& tangent) const {
    return EachPixel(map.a, [&]<int k>() HWY_ATTR {
      Three a = PartOf<k>(map);
      if (params.packed) a = Unpack(a);
      const Three raw = PartOf<k>(normal), along = PartOf<k>(tangent), n = UnitOf(raw);
      // Products of floats are exact in double: this keeps its digits however near the tangent is to the
      // normal.
      const Three across = CrossOf(raw, along);
      const VD lengths = hn::Mul(DotOf(raw, raw), DotOf(along, along));
      // A tangent along the normal has no direction across it.
      const auto framed =
          hn::And(Positive(lengths), hn::Gt(DotOf(across, across), hn::Mul(lengths, SetD(1e-24))));
      const Three zero = {SetD(0.0), SetD(0.0), SetD(0.0)};
      Three b = Choose(framed, UnitOf(across), zero);
      const Three t = CrossOf(b, n);
      if (params.left_handed) b = Minus(zero, b);
      if (params.inverse) return Three{DotOf(a, t), DotOf(a, b), DotOf(a, n)};
      const Three sum = Plus(Plus(Times(t, a.x), Times(b, a.y)), Times(n, a.z));
      const auto turned = hn::And(framed, Positive(DotOf(sum, sum)));
      return Choose(turned, UnitOf(sum), n);
    });
  }
};

struct Surface {
  SurfaceBumpParams params;
  HWY_INLINE s::Pixels operator()(const s::Pixels& map, const s::Pixels& normal, const s::Pixels& pu,
                                  const s::Pixels& pv) const {
    return EachPixel(map.a, [&]<int k>() HWY_ATTR {
      Three a = PartOf<k>(map);
      if (params.packed) a = Unpack(a);
      // Products of floats are exact in double, so all cross products are of the pixels as they are.
      const Three raw = PartOf<k>(normal), n = UnitOf(raw), u = PartOf<k>(pu), v = PartOf<k>(pv);
      const Three area = CrossOf(u, v);
      const VD long_n = hn::Sqrt(DotOf(raw, raw));
      const VD square = DotOf(area, area), lengths = hn::Mul(DotOf(u, u), DotOf(v, v));
      // Parallel derivatives leave nothing but rounding.
      const auto framed = hn::And(Positive(lengths), hn::Gt(square, hn::Mul(lengths, SetD(1e-24))));
      // A normal in the surface itself is on neither side.
      const auto against = hn::Lt(DotOf(area, n), hn::Mul(hn::Sqrt(square), SetD(-1e-12)));
      const VD turned = hn::IfThenElse(against, SetD(-params.scale), SetD(params.scale));
      const Three bend = Plus(Times(CrossOf(v, raw), a.x), Times(CrossOf(raw, u), a.y));
      const Three sum = Plus(Times(n, hn::Mul(a.z, hn::Sqrt(square))), Times(bend, hn::Div(turned, long_n)));
      const auto usable = hn::And(hn::And(framed, Positive(DotOf(n, n))), Positive(DotOf(sum, sum)));
      return Choose(usable, UnitOf(sum), n);
    });
  }
};

struct Combine {
  CombineNormalsParams params;
  HWY_INLINE s::Pixels operator()(const s::Pixels& normal, const s::Pixels& bump) const {
    return EachPixel(normal.a, [&]<int k>() HWY_ATTR {
      const Three own = PartOf<k>(normal), v = UnitOf(own), raw = PartOf<k>(bump);
      Three sum;
      if (params.method == CombineMethod::kSum) {
        const Three b = UnitOf(raw);
        sum = Plus(Times(v, SetD(params.k)), b);
      } else {
        // What of the gradient is perpendicular: (V x B) x V, exact products of floats again.
        const Three across = Times(CrossOf(own, raw), hn::Div(SetD(params.k), hn::Sqrt(DotOf(own, own))));
        sum = Minus(v, CrossOf(across, v));
      }
      const VD square = DotOf(sum, sum);
      const auto usable =
          hn::And(Positive(square), hn::And(hn::Ge(square, SetD(1e-12)), Positive(DotOf(v, v))));
      return Choose(usable, UnitOf(sum), v);
    });
  }
};

}  // namespace

std::unique_ptr<graph::PointStage> TangentOfTarget(const TangentNormalsParams& p) {
  return s::MakeStage<3>(Tangent{p});
}
std::unique_ptr<graph::PointStage> SurfaceOfTarget(const SurfaceBumpParams& p) {
  return s::MakeStage<4>(Surface{p});
}
std::unique_ptr<graph::PointStage> CombineOfTarget(const CombineNormalsParams& p) {
  return s::MakeStage<2>(Combine{p});
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(TangentOfTarget);
HWY_EXPORT(SurfaceOfTarget);
HWY_EXPORT(CombineOfTarget);

std::unique_ptr<graph::PointStage> MakeTangentStage(const TangentNormalsParams& p) {
  return HWY_DYNAMIC_DISPATCH(TangentOfTarget)(p);
}
std::unique_ptr<graph::PointStage> MakeSurfaceStage(const SurfaceBumpParams& p) {
  return HWY_DYNAMIC_DISPATCH(SurfaceOfTarget)(p);
}
std::unique_ptr<graph::PointStage> MakeCombineStage(const CombineNormalsParams& p) {
  return HWY_DYNAMIC_DISPATCH(CombineOfTarget)(p);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
