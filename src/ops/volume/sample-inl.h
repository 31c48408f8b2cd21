// Samples of volumes and noise blocks for sixteen rays at once.
//
// Rows are read by plain loads, lane by lane, four values a time, and interpolated along y and z there; the result is
// transposed and interpolated along x in vectors. A gather of the eight corners costs several times as much on the
// machines measured, and lanes that are not wanted cost nothing this way.
#if defined(TESSERA_OPS_VOLUME_SAMPLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_VOLUME_SAMPLE_INL_H_
#undef TESSERA_OPS_VOLUME_SAMPLE_INL_H_
#else
#define TESSERA_OPS_VOLUME_SAMPLE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

#include "ops/volume/march.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::D;
using s::DI;
using s::V;
using s::VI;
using M = hn::Mask<D>;

inline constexpr int kLanes = static_cast<int>(hn::MaxLanes(D()));
inline constexpr uint32_t kAllLanes = static_cast<uint32_t>((uint64_t{1} << kLanes) - 1);

HWY_INLINE V Set(float v) { return hn::Set(D(), v); }
// a + f (b - a).
HWY_INLINE V Lerp(V a, V b, V f) { return hn::MulAdd(f, hn::Sub(b, a), a); }
HWY_INLINE V Clamp01(V v) { return hn::Min(hn::Max(v, hn::Zero(D())), Set(1)); }
HWY_INLINE uint32_t Bits(M m) {
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(D(), m, bytes);
  uint32_t bits;
  std::memcpy(&bits, bytes, 4);
  return bits & kAllLanes;
}

// --- Four floats. ---
#if HWY_TARGET == HWY_SCALAR
struct V4 {
  float v[4];
};
template <typename T>
HWY_INLINE V4 Four(const T* p) {
  return {{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), static_cast<float>(p[3])}};
}
HWY_INLINE V4 Four(const hwy::float16_t* p) {
  const auto one = [](const hwy::float16_t* q) {
    return hn::GetLane(hn::PromoteTo(hn::Sisd<float>(), hn::Load(hn::Sisd<hwy::float16_t>(), q)));
  };
  return {{one(p), one(p + 1), one(p + 2), one(p + 3)}};
}
template <typename T>
HWY_INLINE V4 Pairs(const T* p, const T* q) {
  const V4 a = Four(p), b = Four(q);
  return {{a.v[0], a.v[1], b.v[0], b.v[1]}};
}
HWY_INLINE V4 Lerp4(const V4& a, const V4& b, float f) {
  V4 r;
  for (int i = 0; i < 4; ++i) r.v[i] = f * (b.v[i] - a.v[i]) + a.v[i];
  return r;
}
HWY_INLINE V4 Sub4(const V4& a, const V4& b) {
  return {{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2], a.v[3] - b.v[3]}};
}
HWY_INLINE void Store4(const V4& a, float* p) { std::memcpy(p, a.v, 16); }
#else
using D4 = hn::FixedTag<float, 4>;
using V4 = hn::Vec<D4>;
HWY_INLINE V4 Four(const float* p) { return hn::LoadU(D4(), p); }
HWY_INLINE V4 Four(const uint16_t* p) {
  const hn::FixedTag<int32_t, 4> di;
  return hn::ConvertTo(D4(), hn::PromoteTo(di, hn::LoadU(hn::FixedTag<uint16_t, 4>(), p)));
}
HWY_INLINE V4 Four(const uint8_t* p) {
  const hn::FixedTag<int32_t, 4> di;
  return hn::ConvertTo(D4(), hn::PromoteTo(di, hn::LoadU(hn::FixedTag<uint8_t, 4>(), p)));
}
HWY_INLINE V4 Four(const hwy::float16_t* p) {
  return hn::PromoteTo(D4(), hn::LoadU(hn::FixedTag<hwy::float16_t, 4>(), p));
}
// p[0], p[1], q[0], q[1].
HWY_INLINE V4 Pairs(const float* p, const float* q) {
  const hn::FixedTag<float, 2> half;
  return hn::Combine(D4(), hn::LoadU(half, q), hn::LoadU(half, p));
}
// Two loads put together as one integer: through memory the second would wait for the first.
HWY_INLINE V4 Pairs(const uint16_t* p, const uint16_t* q) {
  uint32_t a, b;
  std::memcpy(&a, p, 4);
  std::memcpy(&b, q, 4);
  const hn::FixedTag<uint64_t, 1> one;
  const hn::FixedTag<uint16_t, 4> codes;
  const auto v = hn::BitCast(codes, hn::Set(one, uint64_t{b} << 32 | a));
  return hn::ConvertTo(D4(), hn::PromoteTo(hn::FixedTag<int32_t, 4>(), v));
}
HWY_INLINE V4 Pairs(const hwy::float16_t* p, const hwy::float16_t* q) {
  uint32_t a, b;
  std::memcpy(&a, p, 4);
  std::memcpy(&b, q, 4);
  const hn::FixedTag<uint64_t, 1> one;
  return hn::PromoteTo(D4(), hn::BitCast(hn::FixedTag<hwy::float16_t, 4>(), hn::Set(one, uint64_t{b} << 32 | a)));
}
HWY_INLINE V4 Pairs(const uint8_t* p, const uint8_t* q) {
  uint16_t a, b;
  std::memcpy(&a, p, 2);
  std::memcpy(&b, q, 2);
  const hn::FixedTag<uint32_t, 1> one;
  const auto v = hn::BitCast(hn::FixedTag<uint8_t, 4>(), hn::Set(one, uint32_t{b} << 16 | a));
  return hn::ConvertTo(D4(), hn::PromoteTo(hn::FixedTag<int32_t, 4>(), v));
}
HWY_INLINE V4 Lerp4(V4 a, V4 b, V4 f) { return hn::MulAdd(f, hn::Sub(b, a), a); }
HWY_INLINE V4 Lerp4(V4 a, V4 b, float f) { return Lerp4(a, b, hn::Set(D4(), f)); }
HWY_INLINE V4 Sub4(V4 a, V4 b) { return hn::Sub(a, b); }
HWY_INLINE void Store4(V4 a, float* p) { hn::Store(a, D4(), p); }
#endif

// --- Places. ---
struct Vec3 {
  V x, y, z;
};
HWY_INLINE V Dot(const Vec3& a, const Vec3& b) {
  return hn::MulAdd(a.z, b.z, hn::MulAdd(a.y, b.y, hn::Mul(a.x, b.x)));
}
HWY_INLINE Vec3 Scaled(const Vec3& a, V f) { return {hn::Mul(a.x, f), hn::Mul(a.y, f), hn::Mul(a.z, f)}; }
HWY_INLINE Vec3 AddScaled(const Vec3& a, const Vec3& b, V f) {
  return {hn::MulAdd(b.x, f, a.x), hn::MulAdd(b.y, f, a.y), hn::MulAdd(b.z, f, a.z)};
}
// Unit length; zero stays zero.
HWY_INLINE Vec3 Unit(const Vec3& a) {
  const V square = Dot(a, a);
  const V r = hn::Div(Set(1), hn::Sqrt(hn::Max(square, Set(1e-36f))));
  return Scaled(a, hn::IfThenElseZero(hn::Gt(square, Set(1e-36f)), r));
}

// A cell and the place in it.
struct Cell {
  VI i, j, k;
  Vec3 f;
};
HWY_INLINE Cell Locate(const Field& field, const Vec3& p) {
  const D d;
  const DI di;
  const auto axis = [&](V v, float last, VI& whole) HWY_ATTR {
    v = hn::Min(hn::Max(v, hn::Zero(d)), Set(last));
    whole = hn::ConvertTo(di, v);
    return hn::Sub(v, hn::ConvertTo(d, whole));
  };
  Cell c;
  c.f.x = axis(p.x, field.last[0], c.i);
  c.f.y = axis(p.y, field.last[1], c.j);
  c.f.z = axis(p.z, field.last[2], c.k);
  return c;
}
HWY_INLINE VI IndexOf(const Cell& c, int32_t row, int32_t slice) {
  const DI di;
  return hn::Add(hn::Add(hn::Mul(c.k, hn::Set(di, slice)), hn::Mul(c.j, hn::Set(di, row))), c.i);
}
// The leap grid's entry of a cell.
HWY_INLINE VI LeapOf(const Field& field, const uint16_t* leaps, const Cell& c) {
  const DI di;
  const int sh = field.shift;
  const VI block = hn::Add(hn::Add(hn::Mul(hn::ShiftRightSame(c.k, sh), hn::Set(di, field.blocks[1])),
                                   hn::Mul(hn::ShiftRightSame(c.j, sh), hn::Set(di, field.blocks[0]))),
                           hn::ShiftRightSame(c.i, sh));
  const VI both = hn::GatherOffset(di, reinterpret_cast<const int32_t*>(leaps), hn::Add(block, block));
  return hn::And(both, hn::Set(di, 0xFFFF));
}

// Rows of four floats for every lane, transposed on reading.
struct Rows {
  HWY_ALIGN float v[4 * kLanes] = {};
  HWY_INLINE void Read(V& a, V& b, V& c, V& e) const {
#if HWY_TARGET == HWY_SCALAR
    const D d;
    a = hn::Load(d, v), b = hn::Load(d, v + 1), c = hn::Load(d, v + 2), e = hn::Load(d, v + 3);
#else
    hn::LoadInterleaved4(D(), v, a, b, c, e);
#endif
  }
};

// Trilinear interpolation of codes; lanes outside `lanes` hold anything finite.
template <typename T>
HWY_INLINE V Trilinear(const T* base, int32_t row, int32_t slice, VI index, const Vec3& f, uint32_t lanes) {
  const DI di;
  HWY_ALIGN int32_t at[kLanes];
  HWY_ALIGN float fz[kLanes];
  hn::Store(index, di, at);
  hn::Store(f.z, D(), fz);
  Rows rows;
  for (uint32_t rest = lanes; rest != 0; rest &= rest - 1) {
    const int l = __builtin_ctz(rest);
    const T* const p = base + at[l];
    Store4(Lerp4(Pairs(p, p + row), Pairs(p + slice, p + slice + row), fz[l]), rows.v + 4 * l);
  }
  V a, b, c, e;
  rows.Read(a, b, c, e);
  return Lerp(Lerp(a, b, f.x), Lerp(c, e, f.x), f.y);
}

struct ValueAndGradient {
  V value;
  Vec3 gradient;  // trilinear central differences, codes per voxel
};
template <typename T>
HWY_INLINE ValueAndGradient TrilinearGradient(const T* base, int32_t row, int32_t slice, VI index, const Vec3& f,
                                              uint32_t lanes) {
  const D d;
  HWY_ALIGN int32_t at[kLanes];
  HWY_ALIGN float fy[kLanes], fz[kLanes];
  hn::Store(index, DI(), at);
  hn::Store(f.y, d, fy);
  hn::Store(f.z, d, fz);
  Rows along, up, deep;
  for (uint32_t rest = lanes; rest != 0; rest &= rest - 1) {
    const int l = __builtin_ctz(rest);
    const T* const p = base + at[l] - 1;
    const V4 c00 = Four(p), c10 = Four(p + row), c01 = Four(p + slice), c11 = Four(p + slice + row);
    const V4 a0 = Lerp4(c00, c01, fz[l]), a1 = Lerp4(c10, c11, fz[l]);
    Store4(Lerp4(a0, a1, fy[l]), along.v + 4 * l);
    const V4 below = Lerp4(Four(p - row), Four(p - row + slice), fz[l]);
    const V4 above = Lerp4(Four(p + 2 * row), Four(p + 2 * row + slice), fz[l]);
    Store4(Lerp4(Sub4(a1, below), Sub4(above, a0), fy[l]), up.v + 4 * l);
    const V4 b0 = Lerp4(c00, c10, fy[l]), b1 = Lerp4(c01, c11, fy[l]);
    const V4 front = Lerp4(Four(p - slice), Four(p - slice + row), fy[l]);
    const V4 back = Lerp4(Four(p + 2 * slice), Four(p + 2 * slice + row), fy[l]);
    Store4(Lerp4(Sub4(b1, front), Sub4(back, b0), fz[l]), deep.v + 4 * l);
  }
  ValueAndGradient r;
  V a, b, c, e;
  along.Read(a, b, c, e);
  r.value = Lerp(b, c, f.x);
  const V half = Set(0.5f);
  r.gradient.x = hn::Mul(half, Lerp(hn::Sub(c, a), hn::Sub(e, b), f.x));
  up.Read(a, b, c, e);
  r.gradient.y = hn::Mul(half, Lerp(b, c, f.x));
  deep.Read(a, b, c, e);
  r.gradient.z = hn::Mul(half, Lerp(b, c, f.x));
  return r;
}

// --- Noise blocks. ---
struct NoisePlace {
  VI index;
  Vec3 f;
};
// Where position p (voxels) times `octave` lies in the block.
HWY_INLINE NoisePlace LocateNoise(const NoiseView& n, const Vec3& p, float octave = 1) {
  const DI di;
  const auto axis = [&](V v, int a, VI& whole) HWY_ATTR {
    V u = hn::MulAdd(v, Set(n.times[a] * octave), Set(n.plus[a] * octave));
    u = hn::Sub(u, hn::Floor(u));
    u = hn::MulAdd(u, Set(static_cast<float>(n.size)), Set(-0.5f));
    const V floor = hn::Floor(u);
    whole = hn::ConvertTo(di, floor);
    // One sample before the first is the last one: rows may then be read from one before to two behind.
    whole = hn::Add(whole, hn::And(hn::BroadcastSignBit(whole), hn::Set(di, n.size)));
    return hn::Sub(u, floor);
  };
  NoisePlace r;
  VI i, j, k;
  r.f.x = axis(p.x, 0, i);
  r.f.y = axis(p.y, 1, j);
  r.f.z = axis(p.z, 2, k);
  r.index = hn::Add(hn::Add(hn::Mul(k, hn::Set(di, n.slice)), hn::Mul(j, hn::Set(di, n.row))), i);
  return r;
}
HWY_INLINE V NoiseValue(const NoiseView& n, const Vec3& p, uint32_t lanes, float octave = 1) {
  const NoisePlace at = LocateNoise(n, p, octave);
  return hn::MulAdd(Trilinear(n.samples, n.row, n.slice, at.index, at.f, lanes), Set(n.scale), Set(n.bias));
}
// Value and gradient per voxel of p.
HWY_INLINE ValueAndGradient NoiseGradient(const NoiseView& n, const Vec3& p, uint32_t lanes) {
  const NoisePlace at = LocateNoise(n, p);
  ValueAndGradient r = TrilinearGradient(n.samples, n.row, n.slice, at.index, at.f, lanes);
  r.value = hn::MulAdd(r.value, Set(n.scale), Set(n.bias));
  const float size = static_cast<float>(n.size) * n.scale;
  r.gradient.x = hn::Mul(r.gradient.x, Set(size * n.times[0]));
  r.gradient.y = hn::Mul(r.gradient.y, Set(size * n.times[1]));
  r.gradient.z = hn::Mul(r.gradient.z, Set(size * n.times[2]));
  return r;
}
// The four channels of a block that has four.
HWY_INLINE void NoiseChannels(const NoiseView& n, const Vec3& p, uint32_t lanes, V* channels) {
  const D d;
  const NoisePlace at = LocateNoise(n, p);
  HWY_ALIGN int32_t index[kLanes];
  HWY_ALIGN float fx[kLanes], fy[kLanes], fz[kLanes];
  hn::Store(at.index, DI(), index);
  hn::Store(at.f.x, d, fx);
  hn::Store(at.f.y, d, fy);
  hn::Store(at.f.z, d, fz);
  Rows rows;
  const ptrdiff_t row = ptrdiff_t{4} * n.row, slice = ptrdiff_t{4} * n.slice;
  for (uint32_t rest = lanes; rest != 0; rest &= rest - 1) {
    const int l = __builtin_ctz(rest);
    const uint16_t* const t = n.samples + ptrdiff_t{4} * index[l];
    const auto line = [&](const uint16_t* q) HWY_ATTR { return Lerp4(Four(q), Four(q + 4), fx[l]); };
    const V4 low = Lerp4(line(t), line(t + row), fy[l]);
    const V4 high = Lerp4(line(t + slice), line(t + slice + row), fy[l]);
    Store4(Lerp4(low, high, fz[l]), rows.v + 4 * l);
  }
  rows.Read(channels[0], channels[1], channels[2], channels[3]);
  for (int c = 0; c < 4; ++c) channels[c] = hn::MulAdd(channels[c], Set(n.scale), Set(n.bias));
}

// --- Tables of four floats. ---
HWY_INLINE s::Pixels ColorOf(const ColorTable& table, V value, uint32_t lanes) {
  const D d;
  V u = hn::MulAdd(value, Set(table.times), Set(table.plus));
  u = hn::Min(hn::Max(u, hn::Zero(d)), Set(static_cast<float>(table.size - 1)));
  const VI whole = hn::ConvertTo(DI(), u);
  HWY_ALIGN int32_t at[kLanes];
  HWY_ALIGN float f[kLanes];
  hn::Store(whole, DI(), at);
  hn::Store(hn::Sub(u, hn::ConvertTo(d, whole)), d, f);
  Rows rows;
  for (uint32_t rest = lanes; rest != 0; rest &= rest - 1) {
    const int l = __builtin_ctz(rest);
    const float* const entry = table.entries + ptrdiff_t{4} * at[l];
    Store4(Lerp4(Four(entry), Four(entry + 4), f[l]), rows.v + 4 * l);
  }
  s::Pixels c;
  rows.Read(c.r, c.g, c.b, c.a);
  return c;
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
