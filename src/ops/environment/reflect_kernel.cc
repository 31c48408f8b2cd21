// Normals, and positions, to the directions that are looked up, in double.
#include <algorithm>
#include <cmath>

#include "ops/environment/lookup.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/environment/reflect_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace {
namespace hn = hwy::HWY_NAMESPACE;
using DD = hn::CappedTag<double, 8>;
using DF = hn::Rebind<float, DD>;
using VD = hn::Vec<DD>;

HWY_INLINE VD Set(double v) { return hn::Set(DD(), v); }

void Planes(const float* pixels, int channels, const int* at, int count, float (*plane)[kDirectionRun]) {
  int i = 0;
  if (channels == 3 && at[0] == 0 && at[1] == 1 && at[2] == 2) {
    const hn::CappedTag<float, 16> d;
    const int step = static_cast<int>(hn::Lanes(d));
    for (; i + step <= count; i += step) {
      hn::Vec<hn::CappedTag<float, 16>> a, b, c;
      hn::LoadInterleaved3(d, pixels + 3 * i, a, b, c);
      hn::Store(a, d, plane[0] + i), hn::Store(b, d, plane[1] + i), hn::Store(c, d, plane[2] + i);
    }
  }
  for (; i < count; ++i) {
    for (int c = 0; c < 3; ++c) plane[c][i] = pixels[ptrdiff_t{channels} * i + at[c]];
  }
  for (; i % 8 != 0; ++i) {
    for (int c = 0; c < 3; ++c) plane[c][i] = 1;
  }
}

struct V3 {
  VD x, y, z;
};
HWY_INLINE VD Dot(const V3& a, const V3& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}
HWY_INLINE V3 Load(const float (*plane)[kDirectionRun], int i) {
  const DF df;
  const auto at = [&](int c) HWY_ATTR { return hn::PromoteTo(DD(), hn::Load(df, plane[c] + i)); };
  return {at(0), at(1), at(2)};
}

// kFixed: the same viewer for all pixels, at a usual distance; kAhead: along +z, one unit away.
template <bool kFixed, bool kAhead = false>
void ReflectRun(const ReflectionSetup& setup, int x, int y, int count, ReflectionRun& run) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const double* const m = setup.matrix;
  const VD zero = hn::Zero(d), one = Set(1.0), infinity = hn::Inf(d);
  const auto row = [&](int c) { return setup.base[c] + setup.row[c] * (y + 0.5); };
  const double b[3] = {row(0), row(1), row(2)};
  const bool positions = setup.use_position != 0;
  const VD low = Set(0x1p-10), high = Set(0x1p10);
  const bool turned = !(m[0] == 1 && m[1] == 0 && m[2] == 0 && m[3] == 0 && m[4] == 1 && m[5] == 0 &&
                        m[6] == 0 && m[7] == 0 && m[8] == 1);
  auto all = hn::FirstN(d, hn::Lanes(d)), moderate = all;
  for (int i = 0; i < count; i += step) {
    V3 n = Load(run.normal, i);
    VD nn = Dot(n, n);
    auto valid = hn::And(hn::Gt(nn, zero), hn::Lt(nn, infinity));
    auto usual = hn::And(hn::Gt(nn, low), hn::Lt(nn, high));
    if (setup.codes > 0) {
      const VD over = hn::Div(one, hn::Sqrt(hn::IfThenElse(valid, nn, one)));
      const auto stored = [&](VD c) HWY_ATTR {
        const VD code =
            hn::Round(hn::Mul(hn::MulAdd(hn::Mul(c, over), Set(0.5), Set(0.5)), Set(setup.codes)));
        return hn::MulAdd(code, Set(2 / setup.codes), Set(-1.0));
      };
      n = {stored(n.x), stored(n.y), stored(n.z)};
      nn = Dot(n, n);
    }
    V3 r = n;
    if (setup.direction == EnvironmentDirection::kReflection || setup.fresnel) {
      V3 u = {Set(b[0]), Set(b[1]), Set(b[2])};
      if constexpr (!kFixed) {
        const VD px = hn::Add(hn::Iota(d, 0), Set(x + i + 0.5));
        u = {hn::MulAdd(px, Set(setup.column[0]), u.x), hn::MulAdd(px, Set(setup.column[1]), u.y),
             hn::MulAdd(px, Set(setup.column[2]), u.z)};
        if (positions) {
          const V3 p = Load(run.position, i);
          u = {hn::Add(u.x, p.x), hn::Add(u.y, p.y), hn::Add(u.z, p.z)};
        }
      }
      const VD uu = kAhead ? one : Dot(u, u), un = kAhead ? hn::Neg(n.z) : Dot(u, n);
      if constexpr (!kFixed) {
        valid = hn::And(valid, hn::And(hn::Gt(uu, zero), hn::Lt(uu, infinity)));
        usual = hn::And(usual, hn::And(hn::Gt(uu, Set(0x1p-20)), hn::Lt(uu, Set(0x1p20))));
      }
      if (setup.direction == EnvironmentDirection::kReflection) {
        const VD twice = hn::Add(un, un);
        if constexpr (kAhead) {
          const VD minus = hn::Neg(twice);
          r = {hn::Mul(minus, n.x), hn::Mul(minus, n.y), hn::MulSub(minus, n.z, nn)};
        } else {
          r = {hn::NegMulAdd(twice, n.x, hn::Mul(u.x, nn)), hn::NegMulAdd(twice, n.y, hn::Mul(u.y, nn)),
               hn::NegMulAdd(twice, n.z, hn::Mul(u.z, nn))};
        }
      }
      if (setup.fresnel) {
        const VD safe = hn::IfThenElse(valid, hn::Sqrt(hn::Mul(uu, nn)), one);
        const VD c = hn::Min(hn::Div(hn::Abs(un), safe), one);
        const VD g = hn::Sub(one, c), g2 = hn::Mul(g, g);
        const VD f =
            hn::MulAdd(Set(1 - setup.reflectance), hn::Mul(hn::Mul(g2, g2), g), Set(setup.reflectance));
        hn::Store(hn::DemoteTo(DF(), hn::IfThenElse(valid, f, zero)), DF(), run.fresnel + i);
      }
    }
    if (turned) {
      const auto line = [&](int k) HWY_ATTR {
        return hn::MulAdd(r.x, Set(m[k]), hn::MulAdd(r.y, Set(m[k + 1]), hn::Mul(r.z, Set(m[k + 2]))));
      };
      r = {line(0), line(3), line(6)};
    }
    hn::Store(hn::IfThenElse(valid, r.x, zero), d, run.directions.x + i);
    hn::Store(hn::IfThenElse(valid, r.y, zero), d, run.directions.y + i);
    hn::Store(hn::IfThenElse(valid, r.z, one), d, run.directions.z + i);
    hn::Store(hn::DemoteTo(DF(), hn::IfThenElseZero(valid, one)), DF(), run.valid + i);
    all = hn::And(all, valid);
    moderate = hn::And(moderate, hn::Or(usual, hn::Not(valid)));
  }
  run.all_valid = hn::AllTrue(d, all);
  run.directions.moderate = setup.rigid && hn::AllTrue(d, moderate);
}
void Reflect(const ReflectionSetup& setup, int x, int y, int count, ReflectionRun& run) {
  const auto square = [](const double* v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; };
  const bool still = setup.use_position == 0 && square(setup.column) == 0 && square(setup.row) == 0;
  const bool fixed = still && square(setup.base) > 0x1p-20 && square(setup.base) < 0x1p20;
  const bool ahead = fixed && setup.base[0] == 0 && setup.base[1] == 0 && setup.base[2] == -1;
  if (ahead) return ReflectRun<true, true>(setup, x, y, count, run);
  return fixed ? ReflectRun<true>(setup, x, y, count, run) : ReflectRun<false>(setup, x, y, count, run);
}

}  // namespace

ReflectKernels ReflectKernelsOfTarget() { return {&Planes, &Reflect}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(ReflectKernelsOfTarget);

ReflectKernels ChooseReflectKernels() { return HWY_DYNAMIC_DISPATCH(ReflectKernelsOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
