// Directions to places on a map; then texels, in a pass of their own.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "ops/environment/lookup.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/environment/lookup_kernel.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/environment/bilinear-inl.h"
#include "simd/doubles-inl.h"
#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::DD;
using s::VD;
using DF = hn::Rebind<float, DD>;
using DI = hn::Rebind<int32_t, DD>;

constexpr double kPi = std::numbers::pi;

HWY_INLINE VD Set(double v) { return hn::Set(DD(), v); }

using s::V;
using s::VI;

// The four quadrants' arctangent as eighths of a turn and the rest: octant pi/4 + angle, |angle| <= pi/8
// within 6e-8. 0 where both are 0. Floats suffice because what is large is counted. kRight: x is not
// negative.
template <bool kRight>
HWY_INLINE void Octants(V y, V x, V& octant, V& angle) {
  const s::D d;
  const V ax = kRight ? x : hn::Abs(x), ay = hn::Abs(y), high = hn::Max(ax, ay), low = hn::Min(ax, ay);
  // Above tan(pi/8) the quotient is turned back by pi/4.
  const auto turn = hn::Gt(low, hn::Mul(high, hn::Set(d, 0.41421356f)));
  const V numerator = hn::IfThenElse(turn, hn::Sub(low, high), low);
  const V denominator = hn::IfThenElse(turn, hn::Add(low, high), high);
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0f), sign = hn::Set(d, -0.0f);
  const V q = hn::Div(numerator, hn::IfThenElse(hn::Eq(denominator, zero), one, denominator));
  const V z = hn::Mul(q, q);
  constexpr float kC[] = {0.9999999999783987f,   -0.33333332097608703f, 0.19999883856498613f,
                          -0.14281588771188738f, 0.1104048920900191f,   -0.08456192783522785f,
                          0.04707347923475079f};
  V p = hn::Set(d, kC[6]);
  for (int i = 5; i >= 1; --i) p = hn::MulAdd(p, z, hn::Set(d, kC[i]));
  const V a = hn::MulAdd(hn::Mul(p, z), q, q);
  // Reflections at the diagonal and at both axes; on an axis the angle is 0, whatever the sign of that.
  const auto steep = hn::Gt(ay, ax);
  V b = hn::IfThenElseZero(turn, one);
  b = hn::IfThenElse(steep, hn::Sub(hn::Set(d, 2.0f), b), b);
  if constexpr (kRight) {
    octant = hn::Or(b, hn::And(y, sign));
    angle = hn::Xor(a, hn::And(y, sign));
  } else {
    b = hn::IfThenElse(hn::Lt(x, zero), hn::Sub(hn::Set(d, 4.0f), b), b);
    octant = hn::IfThenElse(hn::Lt(y, zero), hn::Neg(b), b);
    angle = hn::Xor(a, hn::And(hn::Xor(x, y), sign));
  }
  angle = hn::IfThenElse(steep, hn::Xor(angle, sign), angle);
}

// Padded coordinates (texel i's centre is i) to a texel and fractions.
HWY_INLINE void StorePlace(const EnvironmentAtlas& atlas, VD face, VD u, VD v, int32_t* first, float* fx,
                           float* fy) {
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
  const auto store = [&](VD face, VD u, VD v)
                         HWY_ATTR { StorePlace(atlas, face, u, v, p.first + at, p.fx + at, p.fy + at); };
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
    store(face, hn::MulAdd(hn::Mul(s_value, over), half_n, centre),
          hn::MulAdd(hn::Mul(t_value, over), half_n, centre));
    return zero;
  } else if constexpr (map == EnvironmentMap::kOctahedral) {
    const auto with_sign = [&](VD v, VD sign)
                               HWY_ATTR { return hn::IfThenElse(hn::Lt(sign, zero), hn::Neg(v), v); };
    const VD over = hn::Div(one, hn::Add(hn::Add(hn::Abs(x), hn::Abs(y)), hn::Abs(z)));
    const VD p_front = hn::Mul(x, over), q_front = hn::Mul(y, over);
    const auto behind = hn::Lt(z, zero);
    const VD px = hn::IfThenElse(behind, with_sign(hn::Sub(one, hn::Abs(q_front)), x), p_front);
    const VD qy = hn::IfThenElse(behind, with_sign(hn::Sub(one, hn::Abs(p_front)), y), q_front);
    store(zero, hn::MulAdd(px, Set(0.5 * l.width), Set(0.5 * l.width + 0.5)),
          hn::NegMulAdd(qy, Set(0.5 * l.height), Set(0.5 * l.height + 0.5)));
    return zero;
  } else {
    const VD planar = hn::MulAdd(x, x, hn::Mul(y, y));
    const VD length = hn::Sqrt(hn::MulAdd(z, z, planar));
    const double radius = 0.5 * std::min(l.width, l.height);
    const VD centre_u = Set(0.5 * l.width + 0.5), centre_v = Set(0.5 * l.height + 0.5);
    const VD half_w = Set(0.5 * l.width), half_h = Set(0.5 * l.height);
    if constexpr (map == EnvironmentMap::kSphere) {
      // |e + r|^2 = 2 length (length + z), where behind length + z = planar / (length - z), without
      // cancellation: of 1/|e + r| numerator and denominator change places.
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
        // Half a texel on either side of the seam both faces are mixed; there the other face's divisor is not
        // small.
        const VD t = hn::Div(hn::Abs(z), length);
        const VD mix = hn::Max(hn::NegMulAdd(t, Set(radius), half), zero);
        const VD other = hn::Sub(length, hn::Abs(z));
        const VD turned = hn::Div(one, hn::IfThenElse(hn::Gt(mix, zero), other, length));
        const VD far_u = hn::MulAdd(hn::Mul(x, turned), half_w, centre_u);
        const VD far_v = hn::NegMulAdd(hn::Mul(y, turned), half_h, centre_v);
        StorePlace(atlas, hn::IfThenElseZero(hn::Not(back), one),
                   hn::Min(hn::Max(far_u, zero), Set(l.width + 1.0)),
                   hn::Min(hn::Max(far_v, zero), Set(l.height + 1.0)), p.other + at, p.other_fx + at,
                   p.other_fy + at);
        hn::StoreU(hn::DemoteTo(DF(), mix), DF(), p.mix + at);
        return mix;
      }
    }
  }
}

// A whole part and a rest of up to some thousand texels, in padded coordinates from 0 to size + 1, to a texel
// and a fraction. Whole numbers below 2^24 are exact in floats.
HWY_INLINE V WholeTexel(V whole, V rest, V size, V& fraction) {
  const V texel = hn::Max(hn::Min(hn::Add(whole, hn::Floor(rest)), size), hn::Zero(s::D()));
  fraction = hn::Sub(rest, hn::Sub(texel, whole));
  return texel;
}

// Sixteen directions, or as many as a vector has floats, rounded to floats; those of any length by the power
// of two below their largest component, so that floats hold them.
HWY_INLINE void RoundDirections(const Directions& at, int i, V& x, V& y, V& z) {
  const DD d;
  VD a[s::kParts], b[s::kParts], c[s::kParts];
  for (int k = 0; k < s::kParts; ++k) {
    const int from = i + k * static_cast<int>(hn::Lanes(d));
    a[k] = hn::Load(d, at.x + from), b[k] = hn::Load(d, at.y + from), c[k] = hn::Load(d, at.z + from);
    if (!at.moderate) {
      const hn::RebindToUnsigned<DD> du;
      const VD largest = hn::Max(hn::Abs(a[k]), hn::Max(hn::Abs(b[k]), hn::Abs(c[k])));
      const auto exponent = hn::And(hn::BitCast(du, largest), hn::Set(du, uint64_t{0x7ff0000000000000}));
      const VD scale = hn::BitCast(d, hn::Sub(hn::Set(du, uint64_t{0x7fe0000000000000}), exponent));
      a[k] = hn::Mul(a[k], scale), b[k] = hn::Mul(b[k], scale), c[k] = hn::Mul(c[k], scale);
    }
  }
  x = s::Join(a), y = s::Join(b), z = s::Join(c);
}

// In two loops: the chain of one angle is as long as processors look ahead.
void LocateLatLong(const EnvironmentAtlas& atlas, const Directions& at, int count, Places& p) {
  const s::D d;
  const s::DI di;
  const float w = static_cast<float>(atlas.layout().width), h = static_cast<float>(atlas.layout().height);
  const V half = hn::Set(d, 0.5f), zero = hn::Zero(d), width = hn::Set(d, w), height = hn::Set(d, h);
  const V eighth = hn::Set(d, w / 8), quarter = hn::Set(d, h / 4);
  const V across = hn::Set(d, static_cast<float>(w / (2 * kPi))),
          down = hn::Set(d, static_cast<float>(h / kPi));
  alignas(64) float up[kDirectionRun], planar[kDirectionRun], column[kDirectionRun];
  for (int i = 0; i < count; i += s::kLanes) {
    V x, y, z, octant, angle, fraction;
    RoundDirections(at, i, x, y, z);
    hn::Store(y, d, up + i);
    hn::Store(hn::MulAdd(x, x, hn::Mul(z, z)), d, planar + i);
    Octants<false>(x, z, octant, angle);
    // u = w/2 - octant w/8 - angle w/(2 pi): the first two exactly, as a whole number and eighths.
    const V place = hn::Mul(hn::Sub(hn::Set(d, 4.0f), octant), eighth), whole = hn::Floor(place);
    const V rest = hn::NegMulAdd(angle, across, hn::Add(hn::Sub(place, whole), half));
    hn::Store(WholeTexel(whole, rest, width, fraction), d, column + i);
    hn::Store(fraction, d, p.fx + i);
  }
  for (int i = 0; i < count; i += s::kLanes) {
    V octant, angle, fraction;
    Octants<true>(hn::Load(d, up + i), hn::Sqrt(hn::Load(d, planar + i)), octant, angle);
    const V place = hn::Mul(hn::Sub(hn::Set(d, 2.0f), octant), quarter), whole = hn::Floor(place);
    V rest = hn::NegMulAdd(angle, down, hn::Sub(place, whole));
    const V above = hn::Add(whole, rest);
    if (HWY_LIKELY(hn::AllTrue(d, hn::And(hn::Gt(above, half), hn::Lt(above, hn::Set(d, h - 1)))))) {
      rest = hn::Add(rest, half);
    } else {
      // The half texel next to a pole is a whole one: the padded row stands at the pole itself.
      const V below = hn::Sub(hn::Sub(height, whole), rest);
      rest = hn::Sub(hn::Add(rest, half), hn::Max(hn::Sub(half, hn::Max(above, zero)), zero));
      rest = hn::Add(rest, hn::Max(hn::Sub(half, hn::Max(below, zero)), zero));
      rest = hn::Max(rest, hn::Neg(whole));
      p.polar = true;
    }
    const V row = WholeTexel(whole, rest, height, fraction);
    hn::Store(hn::Min(fraction, hn::Set(d, 1.0f)), d, p.fy + i);
    // Adding 2^23 leaves a whole number in the lower bits.
    const auto integer = [&](V v) HWY_ATTR {
      const VI bits = hn::BitCast(di, hn::Add(v, hn::Set(d, 0x1p23f)));
      return hn::And(bits, hn::Set(di, 0x7FFFFF));
    };
    hn::Store(hn::Add(hn::Mul(integer(row), hn::Set(di, atlas.stride())), integer(hn::Load(d, column + i))),
              di, p.first + i);
  }
}

// Two by two texels of half floats, as Bilinear.
HWY_INLINE s::Pair LoadHalves(const uint16_t* p) {
  s::Pair pair;
  constexpr int kStep = s::Pair::kLanesOf;
  const hn::Rebind<hwy::float16_t, s::Pair::Tag> dh;
  const hn::RebindToUnsigned<decltype(dh)> du;
  for (int k = 0; k < s::Pair::kVectors; ++k) {
    pair.v[k] = hn::PromoteTo(s::Pair::Tag(), hn::BitCast(dh, hn::LoadU(du, p + k * kStep)));
  }
  return pair;
}
HWY_INLINE s::Quad BilinearOfHalves(const uint16_t* p, ptrdiff_t stride, float fx, float fy) {
  const s::Pair rows = s::Lerp(LoadHalves(p), LoadHalves(p + stride), s::Pair::Set(fy));
  return s::Lerp(s::Lower(rows), s::Upper(rows), s::Quad::Set(fx));
}
void LookUpHalves(const EnvironmentAtlas& atlas, const Places& p, int count, float* rgba) {
  const uint16_t* const pixels = atlas.halves();
  const ptrdiff_t stride = ptrdiff_t{4} * atlas.stride();
  for (int i = 0; i < count; ++i) {
    BilinearOfHalves(pixels + ptrdiff_t{4} * p.first[i], stride, p.fx[i], p.fy[i]).Store(rgba + 4 * i);
  }
  if (!p.polar) return;
  for (int i = 0; i < count; ++i) {
    const int row = p.first[i] / atlas.stride(), column = p.first[i] % atlas.stride();
    if (row != 0 && row != atlas.layout().height) continue;
    Bilinear(atlas.pole(row != 0) + ptrdiff_t{4} * column, stride, p.fx[i], p.fy[i]).Store(rgba + 4 * i);
  }
}
bool ToHalf(const float* from, int count, uint16_t* to) {
  const s::D d;
  alignas(64) float rest[s::kLanes] = {};
  alignas(64) uint16_t rounded[s::kLanes];
  bool same = true;
  for (int i = 0; i < count; i += s::kLanes) {
    const int left = std::min(s::kLanes, count - i);
    std::copy_n(from + i, left, rest);
    const V v = hn::Load(d, rest);
    const auto half = s::HalfFromFloat(v);
    same = same && hn::AllTrue(d, hn::Eq(s::FloatFromHalf(half), v));
    hn::Store(half, s::DU16(), rounded);
    std::copy_n(rounded, left, to + i);
  }
  return same;
}

// Of maps that second-level caches do not hold, the lines that will be read. Inlined in any case: g++ takes a
// function that only asks for memory for one without effects, and drops its calls.
HWY_INLINE void PrefetchTexels(const EnvironmentAtlas& atlas, const Places& p, int count) {
  constexpr size_t kCached = size_t{1} << 19;
  const bool halves = atlas.halves() != nullptr;
  const size_t texel = halves ? 8 : 16;
  const size_t row = texel * static_cast<size_t>(atlas.stride());
  if (row * static_cast<size_t>(atlas.rows()) * atlas.layout().faces.size() <= kCached) return;
  const char* const base =
      halves ? reinterpret_cast<const char*>(atlas.halves()) : reinterpret_cast<const char*>(atlas.pixels());
  for (int i = 0; i < count; ++i) {
    const char* const at = base + texel * static_cast<size_t>(p.first[i]);
    hwy::Prefetch(at);
    hwy::Prefetch(at + row);
  }
}

// Pictures of lenses, in the plainest way: what they are asked for is a conversion, or few pixels.
void LocateOnLens(const EnvironmentAtlas& atlas, const Directions& at, int count, Places& p) {
  const MapLayout& l = atlas.layout();
  p.mixed = false;
  for (int i = 0; i < count; ++i) {
    Place place;
    const bool seen = PlaceOnFace(l, {at.x[i], at.y[i], at.z[i]}, &place) && IsInside(l, place);
    const double u = seen ? std::clamp<double>(place.u, 0, l.width) + 0.5 : 0,
                 v = seen ? std::clamp<double>(place.v, 0, l.height) + 0.5 : 0;
    const double column = std::min(std::floor(u), double{1} * l.width),
                 row = std::min(std::floor(v), double{1} * l.height);
    p.first[i] = static_cast<int32_t>(row) * atlas.stride() + static_cast<int32_t>(column);
    p.fx[i] = static_cast<float>(u - column), p.fy[i] = static_cast<float>(v - row);
    p.mix[i] = seen ? 0.0f : 1.0f;
    p.mixed = p.mixed || !seen;
  }
}

template <EnvironmentMap map>
HWY_INLINE void LocateOn(const EnvironmentAtlas& atlas, const Directions& at, int count, Places& p) {
  const DD d;
  p.polar = false;
  if constexpr (IsLens(map)) {
    LocateOnLens(atlas, at, count, p);
    PrefetchTexels(atlas, p, count);
    return;
  }
  VD mixed = hn::Zero(d);
  if constexpr (map == EnvironmentMap::kLatLong) {
    LocateLatLong(atlas, at, count, p);
  } else if constexpr (!IsLens(map)) {
    for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
      mixed = hn::Max(mixed, Locate<map>(atlas, hn::Load(d, at.x + i), hn::Load(d, at.y + i),
                                         hn::Load(d, at.z + i), p, i));
    }
  }
  p.mixed = !hn::AllTrue(d, hn::Eq(mixed, hn::Zero(d)));
  PrefetchTexels(atlas, p, count);
}

template <EnvironmentMap map>
HWY_INLINE void GatherOn(const EnvironmentAtlas& atlas, const Places& p, int count, float* rgba) {
  const float* const pixels = atlas.pixels();
  const ptrdiff_t stride = ptrdiff_t{4} * atlas.stride();
  if (map == EnvironmentMap::kLatLong && atlas.halves() != nullptr) {
    LookUpHalves(atlas, p, count, rgba);
  } else if (HWY_UNLIKELY(!atlas.finite())) {
    for (int i = 0; i < count; ++i) {
      BilinearWhereWeighted(pixels + ptrdiff_t{4} * p.first[i], stride, p.fx[i], p.fy[i], rgba + 4 * i);
    }
  } else {
    for (int i = 0; i < count; ++i) {
      Bilinear(pixels + ptrdiff_t{4} * p.first[i], stride, p.fx[i], p.fy[i]).Store(rgba + 4 * i);
    }
  }
  if (!p.mixed) return;
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

// f.template operator()<map>() of a map that is known when it runs.
template <class F>
HWY_INLINE void WithMap(EnvironmentMap map, const F& f) {
  switch (map) {
    case EnvironmentMap::kSphere:
      return f.template operator()<EnvironmentMap::kSphere>();
    case EnvironmentMap::kParabolic:
      return f.template operator()<EnvironmentMap::kParabolic>();
    case EnvironmentMap::kDualParabolic:
      return f.template operator()<EnvironmentMap::kDualParabolic>();
    case EnvironmentMap::kLatLong:
      return f.template operator()<EnvironmentMap::kLatLong>();
    case EnvironmentMap::kCube:
      return f.template operator()<EnvironmentMap::kCube>();
    case EnvironmentMap::kOctahedral:
      return f.template operator()<EnvironmentMap::kOctahedral>();
    default:  // any lens: its layout knows which
      return f.template operator()<EnvironmentMap::kPerspective>();
  }
}
void LocateRun(const EnvironmentAtlas& atlas, const Directions& at, int count, Places& p) {
  WithMap(atlas.layout().map, [&]<EnvironmentMap map>() HWY_ATTR { LocateOn<map>(atlas, at, count, p); });
}
void GatherRun(const EnvironmentAtlas& atlas, const Places& p, int count, float* rgba) {
  WithMap(atlas.layout().map, [&]<EnvironmentMap map>() HWY_ATTR { GatherOn<map>(atlas, p, count, rgba); });
}
void Lookup(const EnvironmentAtlas& atlas, const Directions& at, int count, float* rgba) {
  Places p;
  LocateRun(atlas, at, count, p);
  GatherRun(atlas, p, count, rgba);
}

void Natural(const float* const (&planes)[4], int first, int count, float (*plane)[kDirectionRun]) {
  const s::D d;
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < count; i += s::kLanes) {
      hn::Store(s::ToPixelOrder(hn::LoadU(d, planes[c] + first + i)), d, plane[c] + i);
    }
  }
}
void Store(const graph::PointArgs& args, int first, int count, const float* rgba) {
  if (args.sink.write == nullptr) {
    for (int i = 0; i < count; i += s::kLanes) {
      s::StorePlanes(s::LoadRgbaCodes<PixelType::kFloat>(rgba + 4 * i), args.out, first + i);
    }
    return;
  }
  s::WithType(args.sink.type, [&](auto tag) HWY_ATTR {
    using Samples = s::Samples<decltype(tag)::value>;
    auto* const to = reinterpret_cast<typename Samples::T*>(args.sink.write) + 4 * first;
    const bool stream = args.sink.stream && s::CanStream(to);
    for (int i = 0; i < 4 * count; i += s::kLanes) {
      Samples::StoreValues(hn::Load(s::D(), rgba + i), to + i, stream);
    }
  });
}

}  // namespace

EnvironmentKernels KernelsOfTarget() { return {&Natural, &Store, &LocateRun, &GatherRun, &Lookup, &ToHalf}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(KernelsOfTarget);

EnvironmentKernels ChooseEnvironmentKernels() { return HWY_DYNAMIC_DISPATCH(KernelsOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
