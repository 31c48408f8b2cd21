// Directions in double: from normals, to places on a map; then texels, in a pass of their own.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "ops/environment/lookup.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/environment/lookup_kernel.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/texels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using DD = hn::CappedTag<double, 8>;
using DF = hn::Rebind<float, DD>;
using DI = hn::Rebind<int32_t, DD>;
using VD = hn::Vec<DD>;

constexpr double kPi = std::numbers::pi;

HWY_INLINE VD Set(double v) { return hn::Set(DD(), v); }

using s::V;
using s::VI;

// The four quadrants' arctangent as eighths of a turn and the rest: octant pi/4 + angle, |angle| <= pi/8 within 6e-8.
// 0 where both are 0. Floats suffice because what is large is counted.
HWY_INLINE void Octants(V y, V x, VI& octant, V& angle) {
  const s::D d;
  const s::DI di;
  const V ax = hn::Abs(x), ay = hn::Abs(y), high = hn::Max(ax, ay), low = hn::Min(ax, ay);
  // Above tan(pi/8) the quotient is turned back by pi/4.
  const auto turn = hn::Gt(low, hn::Mul(high, hn::Set(d, 0.41421356f)));
  const V numerator = hn::IfThenElse(turn, hn::Sub(low, high), low);
  const V denominator = hn::IfThenElse(turn, hn::Add(low, high), high);
  const V one = hn::Set(d, 1.0f);
  const V q = hn::Div(numerator, hn::IfThenElse(hn::Eq(denominator, hn::Zero(d)), one, denominator));
  const V z = hn::Mul(q, q);
  constexpr float kC[] = {0.9999999999783987f, -0.33333332097608703f, 0.19999883856498613f, -0.14281588771188738f,
                          0.1104048920900191f, -0.08456192783522785f, 0.04707347923475079f};
  V p = hn::Set(d, kC[6]);
  for (int i = 5; i >= 1; --i) p = hn::MulAdd(p, z, hn::Set(d, kC[i]));
  const V a = hn::MulAdd(hn::Mul(p, z), q, q);
  // Reflections at the diagonal and at both axes.
  const auto steep = hn::Gt(ay, ax), left = hn::Lt(x, hn::Zero(d)), down = hn::Lt(y, hn::Zero(d));
  V b = hn::IfThenElseZero(turn, one);
  b = hn::IfThenElse(steep, hn::Sub(hn::Set(d, 2.0f), b), b);
  b = hn::IfThenElse(left, hn::Sub(hn::Set(d, 4.0f), b), b);
  const auto flipped = hn::Xor(hn::Xor(hn::VecFromMask(d, steep), hn::VecFromMask(d, left)), hn::VecFromMask(d, down));
  angle = hn::IfThenElse(hn::MaskFromVec(flipped), hn::Neg(a), a);
  octant = hn::ConvertTo(di, hn::IfThenElse(down, hn::Neg(b), b));
}

// First texels and fractions of a run, and how much of something else is to be mixed in.
struct Places {
  alignas(64) int32_t first[kDirectionRun], other[kDirectionRun];
  alignas(64) float fx[kDirectionRun], fy[kDirectionRun], other_fx[kDirectionRun], other_fy[kDirectionRun];
  alignas(64) float mix[kDirectionRun];
};

// Padded coordinates (texel i's centre is i) to a texel and fractions.
HWY_INLINE void StorePlace(const EnvironmentAtlas& atlas, VD face, VD u, VD v, int32_t* first, float* fx, float* fy) {
  const DD d;
  const VD i = hn::Floor(hn::Min(hn::Max(u, hn::Zero(d)), Set(atlas.layout().width)));
  const VD j = hn::Floor(hn::Min(hn::Max(v, hn::Zero(d)), Set(atlas.layout().height)));
  const VD row = hn::MulAdd(face, Set(atlas.rows()), j);
  hn::StoreU(hn::DemoteTo(DI(), hn::MulAdd(row, Set(atlas.stride()), i)), DI(), first);
  hn::StoreU(hn::DemoteTo(DF(), hn::Sub(u, i)), DF(), fx);
  hn::StoreU(hn::DemoteTo(DF(), hn::Sub(v, j)), DF(), fy);
}

template <EnvironmentMap map>
HWY_INLINE VD Locate(const EnvironmentAtlas& atlas, VD x, VD y, VD z, Places& p, int at) {
  const DD d;
  const MapLayout& l = atlas.layout();
  const VD zero = hn::Zero(d), half = Set(0.5), one = Set(1.0);
  const auto store = [&](VD face, VD u, VD v) HWY_ATTR {
    StorePlace(atlas, face, u, v, p.first + at, p.fx + at, p.fy + at);
  };
  if constexpr (map == EnvironmentMap::kCube) {
    const VD ax = hn::Abs(x), ay = hn::Abs(y), az = hn::Abs(z);
    const auto on_x = hn::And(hn::Ge(ax, ay), hn::Ge(ax, az));
    const auto on_y = hn::Ge(ay, az);  // where not on x
    const VD major = hn::IfThenElse(on_x, x, hn::IfThenElse(on_y, y, z));
    const auto negative = hn::Lt(major, zero);
    const VD over = hn::Div(one, hn::Abs(major));
    // s: -z z, x x, x -x; t: -y -y, z -z, -y -y for the positive and the negative face.
    const VD s_axis = hn::IfThenElse(on_x, hn::Neg(z), x);
    const auto keep = hn::AndNot(on_x, on_y);
    const VD s_value = hn::IfThenElse(hn::AndNot(keep, negative), hn::Neg(s_axis), s_axis);
    const VD t_value = hn::IfThenElse(keep, hn::IfThenElse(negative, hn::Neg(z), z), hn::Neg(y));
    const VD axis = hn::IfThenElse(on_x, zero, hn::IfThenElse(on_y, Set(2.0), Set(4.0)));
    const VD face = hn::Add(axis, hn::IfThenElseZero(negative, one));
    const VD half_n = Set(0.5 * l.width), centre = Set(0.5 * l.width + 0.5);
    store(face, hn::MulAdd(hn::Mul(s_value, over), half_n, centre), hn::MulAdd(hn::Mul(t_value, over), half_n, centre));
    return zero;
  } else {
    const VD planar = hn::MulAdd(x, x, hn::Mul(y, y));
    const VD length = hn::Sqrt(hn::MulAdd(z, z, planar));
    const double radius = 0.5 * std::min(l.width, l.height);
    const VD centre_u = Set(0.5 * l.width + 0.5), centre_v = Set(0.5 * l.height + 0.5);
    const VD half_w = Set(0.5 * l.width), half_h = Set(0.5 * l.height);
    if constexpr (map == EnvironmentMap::kSphere) {
      // |e + r|^2 = 2 length (length + z), where behind length + z = planar / (length - z), without cancellation: of
      // 1/|e + r| numerator and denominator change places.
      const auto behind = hn::Lt(z, zero);
      const VD sum = hn::Add(length, hn::Abs(z)), twice = hn::Add(length, length);
      const VD numerator = hn::IfThenElse(behind, sum, one);
      const VD square = hn::Mul(twice, hn::IfThenElse(behind, planar, sum));
      const auto pole = hn::Eq(planar, zero);
      const auto rear = hn::And(pole, behind);
      const VD over = hn::Sqrt(hn::Div(numerator, hn::IfThenElse(rear, one, square)));
      const VD u = hn::IfThenElse(rear, one, hn::Mul(x, over)), v = hn::Mul(y, over);
      store(zero, hn::MulAdd(u, half_w, centre_u), hn::NegMulAdd(v, half_h, centre_v));
      // The last texel inside the rim runs towards the rim's colour.
      const VD rho = hn::Sqrt(hn::MulAdd(u, u, hn::Mul(v, v)));
      const VD mix = hn::Min(hn::Max(hn::NegMulAdd(hn::Sub(one, rho), Set(radius), one), zero), one);
      hn::StoreU(hn::DemoteTo(DF(), mix), DF(), p.mix + at);
      return mix;
    } else {
      const auto back = hn::Lt(z, zero);
      const VD over = hn::Div(one, hn::Add(length, hn::Abs(z)));
      const VD u = hn::MulAdd(hn::Mul(x, over), half_w, centre_u);
      const VD v = hn::NegMulAdd(hn::Mul(y, over), half_h, centre_v);
      if constexpr (map == EnvironmentMap::kParabolic) {
        store(zero, u, v);
        const VD mix = hn::IfThenElseZero(back, one);
        hn::StoreU(hn::DemoteTo(DF(), mix), DF(), p.mix + at);
        return mix;
      } else {
        store(hn::IfThenElseZero(back, one), u, v);
        // Half a texel on either side of the seam both faces are mixed; there the other face's divisor is not small.
        const VD t = hn::Div(hn::Abs(z), length);
        const VD mix = hn::Max(hn::NegMulAdd(t, Set(radius), half), zero);
        const VD other = hn::Sub(length, hn::Abs(z));
        const VD turned = hn::Div(one, hn::IfThenElse(hn::Gt(mix, zero), other, length));
        const VD far_u = hn::MulAdd(hn::Mul(x, turned), half_w, centre_u);
        const VD far_v = hn::NegMulAdd(hn::Mul(y, turned), half_h, centre_v);
        StorePlace(atlas, hn::IfThenElseZero(hn::Not(back), one), hn::Min(hn::Max(far_u, zero), Set(l.width + 1.0)),
                   hn::Min(hn::Max(far_v, zero), Set(l.height + 1.0)), p.other + at, p.other_fx + at, p.other_fy + at);
        hn::StoreU(hn::DemoteTo(DF(), mix), DF(), p.mix + at);
        return mix;
      }
    }
  }
}

// A whole part and a rest of up to some thousand texels, in padded coordinates from 0 to size + 1, to a texel and a
// fraction.
HWY_INLINE VI WholeTexel(VI whole, V rest, int size, V& fraction) {
  const s::D d;
  const s::DI di;
  const V floor = hn::Floor(rest);
  const VI texel = hn::Max(hn::Min(hn::Add(whole, hn::ConvertTo(di, floor)), hn::Set(di, size)), hn::Zero(di));
  fraction = hn::Sub(rest, hn::ConvertTo(d, hn::Sub(texel, whole)));
  return texel;
}

void LocateLatLong(const EnvironmentAtlas& atlas, const Directions& at, int count, Places& p) {
  const DD dd;
  const s::D d;
  const s::DI di;
  alignas(64) float plane[3][kDirectionRun];
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(dd))) {
    // By the power of two below the largest component, so that floats hold it; nothing else is lost.
    const hn::RebindToUnsigned<DD> du;
    const VD x = hn::Load(dd, at.x + i), y = hn::Load(dd, at.y + i), z = hn::Load(dd, at.z + i);
    const VD largest = hn::Max(hn::Abs(x), hn::Max(hn::Abs(y), hn::Abs(z)));
    const auto exponent = hn::And(hn::BitCast(du, largest), hn::Set(du, uint64_t{0x7ff0000000000000}));
    const VD scale = hn::BitCast(dd, hn::Sub(hn::Set(du, uint64_t{0x7fe0000000000000}), exponent));
    hn::Store(hn::DemoteTo(DF(), hn::Mul(x, scale)), DF(), plane[0] + i);
    hn::Store(hn::DemoteTo(DF(), hn::Mul(y, scale)), DF(), plane[1] + i);
    hn::Store(hn::DemoteTo(DF(), hn::Mul(z, scale)), DF(), plane[2] + i);
  }
  const int w = atlas.layout().width, h = atlas.layout().height;
  const V half = hn::Set(d, 0.5f), zero = hn::Zero(d);
  const V across = hn::Set(d, static_cast<float>(w / (2 * kPi))), down = hn::Set(d, static_cast<float>(h / kPi));
  for (int i = 0; i < count; i += s::kLanes) {
    const V x = hn::Load(d, plane[0] + i), y = hn::Load(d, plane[1] + i), z = hn::Load(d, plane[2] + i);
    VI octant;
    V angle;
    Octants(x, z, octant, angle);
    // u = w/2 - octant w/8 - angle w/(2 pi): the first two exactly, as a whole number and eighths.
    VI eighths = hn::Mul(hn::Sub(hn::Set(di, 4), octant), hn::Set(di, w));
    VI whole = hn::ShiftRight<3>(eighths);
    V rest = hn::MulAdd(hn::ConvertTo(d, hn::And(eighths, hn::Set(di, 7))), hn::Set(d, 0.125f), half);
    V fraction;
    const VI column = WholeTexel(whole, hn::NegMulAdd(angle, across, rest), w, fraction);
    hn::Store(fraction, d, p.fx + i);
    Octants(y, hn::Sqrt(hn::MulAdd(x, x, hn::Mul(z, z))), octant, angle);
    VI quarters = hn::Mul(hn::Sub(hn::Set(di, 2), octant), hn::Set(di, h));
    whole = hn::ShiftRight<2>(quarters);
    rest = hn::Mul(hn::ConvertTo(d, hn::And(quarters, hn::Set(di, 3))), hn::Set(d, 0.25f));
    rest = hn::NegMulAdd(angle, down, rest);
    // The half texel next to a pole is a whole one: the padded row stands at the pole itself.
    const V above = hn::Add(hn::ConvertTo(d, whole), rest);
    const V below = hn::Sub(hn::ConvertTo(d, hn::Sub(hn::Set(di, h), whole)), rest);
    rest = hn::Sub(hn::Add(rest, half), hn::Max(hn::Sub(half, hn::Max(above, zero)), zero));
    rest = hn::Add(rest, hn::Max(hn::Sub(half, hn::Max(below, zero)), zero));
    rest = hn::Max(rest, hn::Neg(hn::ConvertTo(d, whole)));
    const VI row = WholeTexel(whole, rest, h, fraction);
    hn::Store(hn::Min(fraction, hn::Set(d, 1.0f)), d, p.fy + i);
    hn::Store(hn::Add(hn::Mul(row, hn::Set(di, atlas.stride())), column), di, p.first + i);
  }
}

// Two by two texels: along y, then along x.
HWY_INLINE s::Quad Bilinear(const float* p, ptrdiff_t stride, float fx, float fy) {
  const s::Pair rows = s::Lerp(s::Pair::Load(p), s::Pair::Load(p + stride), s::Pair::Set(fy));
  return s::Lerp(s::Lower(rows), s::Upper(rows), s::Quad::Set(fx));
}
// The same for texels that may be NaN or infinite: those without weight do not count. One NaN for all.
HWY_NOINLINE void BilinearWhereWeighted(const float* p, ptrdiff_t stride, float fx, float fy, float* out) {
  const float w[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  const float* const texel[4] = {p, p + 4, p + stride, p + stride + 4};
  for (int c = 0; c < 4; ++c) {
    float sum = 0;
    for (int k = 0; k < 4; ++k) {
      if (w[k] != 0) sum += w[k] * texel[k][c];
    }
    out[c] = std::isnan(sum) ? std::numeric_limits<float>::quiet_NaN() : sum;
  }
}

template <EnvironmentMap map>
void LookupOn(const EnvironmentAtlas& atlas, const Directions& at, int count, float* rgba) {
  const DD d;
  Places p;
  const float* const pixels = atlas.pixels();
  const ptrdiff_t stride = ptrdiff_t{4} * atlas.stride();
  const int step = static_cast<int>(hn::Lanes(d));
  VD mixed = hn::Zero(d);
  if constexpr (map == EnvironmentMap::kLatLong) {
    LocateLatLong(atlas, at, count, p);
  } else {
    for (int i = 0; i < count; i += step) {
      mixed = hn::Max(mixed, Locate<map>(atlas, hn::Load(d, at.x + i), hn::Load(d, at.y + i), hn::Load(d, at.z + i), p, i));
    }
  }
  if (HWY_UNLIKELY(!atlas.finite())) {
    for (int i = 0; i < count; ++i) {
      BilinearWhereWeighted(pixels + ptrdiff_t{4} * p.first[i], stride, p.fx[i], p.fy[i], rgba + 4 * i);
    }
  } else {
    for (int i = 0; i < count; ++i) {
      Bilinear(pixels + ptrdiff_t{4} * p.first[i], stride, p.fx[i], p.fy[i]).Store(rgba + 4 * i);
    }
  }
  if constexpr (map == EnvironmentMap::kLatLong || map == EnvironmentMap::kCube) return;
  if (hn::AllTrue(d, hn::Eq(mixed, hn::Zero(d)))) return;
  for (int i = 0; i < count; ++i) {
    const float mix = p.mix[i];
    if (mix == 0) continue;
    float other[4] = {};
    if constexpr (map == EnvironmentMap::kSphere) std::copy_n(atlas.rim(), 4, other);
    if constexpr (map == EnvironmentMap::kDualParabolic) {
      BilinearWhereWeighted(pixels + ptrdiff_t{4} * p.other[i], stride, p.other_fx[i], p.other_fy[i], other);
    }
    for (int c = 0; c < 4; ++c) {
      float& v = rgba[4 * i + c];
      v = mix == 1 ? other[c] : (1 - mix) * v + mix * other[c];
      if (std::isnan(v)) v = std::numeric_limits<float>::quiet_NaN();
    }
  }
}

void Lookup(const EnvironmentAtlas& atlas, const Directions& at, int count, float* rgba) {
  switch (atlas.layout().map) {
    case EnvironmentMap::kSphere:
      return LookupOn<EnvironmentMap::kSphere>(atlas, at, count, rgba);
    case EnvironmentMap::kParabolic:
      return LookupOn<EnvironmentMap::kParabolic>(atlas, at, count, rgba);
    case EnvironmentMap::kDualParabolic:
      return LookupOn<EnvironmentMap::kDualParabolic>(atlas, at, count, rgba);
    case EnvironmentMap::kLatLong:
      return LookupOn<EnvironmentMap::kLatLong>(atlas, at, count, rgba);
    case EnvironmentMap::kCube:
      return LookupOn<EnvironmentMap::kCube>(atlas, at, count, rgba);
  }
}

void Planes(const float* pixels, int channels, const int* at, int count, float (*plane)[kDirectionRun]) {
  int i = 0;
#if HWY_TARGET != HWY_SCALAR
  if (channels == 3 && at[0] == 0 && at[1] == 1 && at[2] == 2) {
    const hn::CappedTag<float, 16> d;
    const int step = static_cast<int>(hn::Lanes(d));
    for (; i + step <= count; i += step) {
      hn::Vec<hn::CappedTag<float, 16>> a, b, c;
      hn::LoadInterleaved3(d, pixels + 3 * i, a, b, c);
      hn::Store(a, d, plane[0] + i), hn::Store(b, d, plane[1] + i), hn::Store(c, d, plane[2] + i);
    }
  }
#endif
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

void Reflect(const ReflectionSetup& setup, int x, int y, int count, ReflectionRun& run) {
  const DD d;
  const int step = static_cast<int>(hn::Lanes(d));
  const double* const m = setup.matrix;
  const VD zero = hn::Zero(d), one = Set(1.0), infinity = hn::Inf(d);
  const auto row = [&](int c) { return setup.base[c] + setup.row[c] * (y + 0.5); };
  const double b[3] = {row(0), row(1), row(2)};
  const bool positions = setup.use_position != 0;
  const bool turned = !(m[0] == 1 && m[1] == 0 && m[2] == 0 && m[3] == 0 && m[4] == 1 && m[5] == 0 && m[6] == 0 &&
                        m[7] == 0 && m[8] == 1);
  auto all = hn::FirstN(d, hn::Lanes(d));
  for (int i = 0; i < count; i += step) {
    V3 n = Load(run.normal, i);
    VD nn = Dot(n, n);
    auto valid = hn::And(hn::Gt(nn, zero), hn::Lt(nn, infinity));
    if (setup.codes > 0) {
      const VD over = hn::Div(one, hn::Sqrt(hn::IfThenElse(valid, nn, one)));
      const auto stored = [&](VD c) HWY_ATTR {
        const VD code = hn::Round(hn::Mul(hn::MulAdd(hn::Mul(c, over), Set(0.5), Set(0.5)), Set(setup.codes)));
        return hn::MulAdd(code, Set(2 / setup.codes), Set(-1.0));
      };
      n = {stored(n.x), stored(n.y), stored(n.z)};
      nn = Dot(n, n);
    }
    V3 r = n;
    if (setup.direction == EnvironmentDirection::kReflection || setup.fresnel) {
      const VD px = hn::Add(hn::Iota(d, 0), Set(x + i + 0.5));
      V3 u = {hn::MulAdd(px, Set(setup.column[0]), Set(b[0])), hn::MulAdd(px, Set(setup.column[1]), Set(b[1])),
              hn::MulAdd(px, Set(setup.column[2]), Set(b[2]))};
      if (positions) {
        const V3 p = Load(run.position, i);
        u = {hn::Add(u.x, p.x), hn::Add(u.y, p.y), hn::Add(u.z, p.z)};
      }
      const VD uu = Dot(u, u), un = Dot(u, n);
      valid = hn::And(valid, hn::And(hn::Gt(uu, zero), hn::Lt(uu, infinity)));
      if (setup.direction == EnvironmentDirection::kReflection) {
        const VD twice = hn::Add(un, un);
        r = {hn::NegMulAdd(twice, n.x, hn::Mul(u.x, nn)), hn::NegMulAdd(twice, n.y, hn::Mul(u.y, nn)),
             hn::NegMulAdd(twice, n.z, hn::Mul(u.z, nn))};
      }
      if (setup.fresnel) {
        const VD safe = hn::IfThenElse(valid, hn::Sqrt(hn::Mul(uu, nn)), one);
        const VD c = hn::Min(hn::Div(hn::Abs(un), safe), one);
        const VD g = hn::Sub(one, c), g2 = hn::Mul(g, g);
        const VD f = hn::MulAdd(Set(1 - setup.reflectance), hn::Mul(hn::Mul(g2, g2), g), Set(setup.reflectance));
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
  }
  run.all_valid = hn::AllTrue(d, all);
}

}  // namespace

EnvironmentKernels KernelsOfTarget() { return {&Planes, &Reflect, &Lookup}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(KernelsOfTarget);

EnvironmentKernels ChooseEnvironmentKernels() { return HWY_DYNAMIC_DISPATCH(KernelsOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
