// Samples of volumes and noise blocks for sixteen rays at once.
//
// Everything is read for all lanes, wanted or not: a place that is nowhere counts as one of the volume.
// A lane's neighbours along x lie together and are loaded whole (8 or 16 bytes), put together and transposed
// in registers; noise and tables are laid out so that all of a lane's samples are 16 bytes in a row.
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
#include "simd/gather-inl.h"
#include "simd/lattice-inl.h"
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

HWY_INLINE V Set(float v) { return hn::Set(D(), v); }
// a + f (b - a).
HWY_INLINE V Lerp(V a, V b, V f) { return hn::MulAdd(f, hn::Sub(b, a), a); }
HWY_INLINE V Clamp01(V v) { return hn::Min(hn::Max(v, hn::Zero(D())), Set(1)); }

#if HWY_TARGET != HWY_SCALAR
using D4 = hn::FixedTag<float, 4>;
#endif

// f(T()) for the type of a volume's samples.
template <class F>
auto ForSampleType(PixelType type, const F& f) {
  switch (type) {
    case PixelType::kUint8:
      return f(uint8_t());
    case PixelType::kUint16:
      return f(uint16_t());
    case PixelType::kHalf:
      return f(hwy::float16_t());
    default:
      return f(float());
  }
}

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
  const auto axis = [&](V v, float last, VI& whole) __attribute__((always_inline)) {
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
  const VI both = s::GatherWords<1>(leaps, hn::Add(block, block));
  return hn::And(both, hn::Set(di, 0xFFFF));
}

// --- 16 bytes for every lane, as four vectors of words. ---
struct Words {
  V a, b, c, e;
};
struct WordPair {
  V a, b;
};
// Indices in memory, as addresses need them.
struct Places {
  HWY_ALIGN int32_t at[kLanes];
  HWY_INLINE explicit Places(VI index) { hn::Store(index, DI(), at); }
};
// At base + stride * index bytes.
#if HWY_TARGET == HWY_SCALAR
template <int n>
HWY_INLINE void CopyWords(const void* base, ptrdiff_t offset, float (&words)[n]) {
  std::memcpy(words, static_cast<const char*>(base) + offset, sizeof words);  // codes lie at any even address
}
HWY_INLINE Words WordsAt(const void* base, const Places& places, ptrdiff_t stride = 16) {
  float w[4];
  CopyWords(base, stride * places.at[0], w);
  return {Set(w[0]), Set(w[1]), Set(w[2]), Set(w[3])};
}
HWY_INLINE WordPair WordPairAt(const void* base, const Places& places, ptrdiff_t stride) {
  float w[2];
  CopyWords(base, stride * places.at[0], w);
  return {Set(w[0]), Set(w[1])};
}
#else
// Put together in registers: through memory the wide load would wait for the narrow stores.
HWY_INLINE V RowOfWords(const char* base, ptrdiff_t stride, const int32_t* at) {
  const auto one = [&](int lane) __attribute__((always_inline)) {
    return hn::LoadU(D4(), reinterpret_cast<const float*>(base + stride * at[lane]));
  };
#if HWY_MAX_BYTES == 64
  const hn::Half<D> half;
  return hn::Combine(D(), hn::Combine(half, one(3), one(2)), hn::Combine(half, one(1), one(0)));
#elif HWY_MAX_BYTES == 32
  return hn::Combine(D(), one(1), one(0));
#else
  return one(0);
#endif
}
// 8 bytes for every lane.
HWY_INLINE V RowOfWordPairs(const char* base, ptrdiff_t stride, const int32_t* at) {
  const auto two = [&](int lane) __attribute__((always_inline)) {
    const hn::FixedTag<float, 2> d2;
    const auto one = [&](int l) __attribute__((always_inline)) {
      return hn::LoadU(d2, reinterpret_cast<const float*>(base + stride * at[l]));
    };
    return hn::Combine(D4(), one(lane + 1), one(lane));
  };
#if HWY_MAX_BYTES == 64
  const hn::Half<D> half;
  return hn::Combine(D(), hn::Combine(half, two(6), two(4)), hn::Combine(half, two(2), two(0)));
#elif HWY_MAX_BYTES == 32
  return hn::Combine(D(), two(2), two(0));
#else
  return two(0);
#endif
}
HWY_INLINE WordPair WordPairAt(const void* base, const Places& places, ptrdiff_t stride) {
  const D d;
  const int32_t* const at = places.at;
  const auto* const p = static_cast<const char*>(base);
  const V r0 = RowOfWordPairs(p, stride, at), r1 = RowOfWordPairs(p, stride, at + kLanes / 2);
  return {hn::ConcatEven(d, r1, r0), hn::ConcatOdd(d, r1, r0)};
}
HWY_INLINE Words WordsAt(const void* base, const Places& places, ptrdiff_t stride = 16) {
  const D d;
  const int32_t* const at = places.at;
  const auto* const p = static_cast<const char*>(base);
  constexpr int kPart = kLanes / 4;
  const V r0 = RowOfWords(p, stride, at), r1 = RowOfWords(p, stride, at + kPart);
  const V r2 = RowOfWords(p, stride, at + 2 * kPart), r3 = RowOfWords(p, stride, at + 3 * kPart);
  const V even0 = hn::ConcatEven(d, r1, r0), even1 = hn::ConcatEven(d, r3, r2);
  const V odd0 = hn::ConcatOdd(d, r1, r0), odd1 = hn::ConcatOdd(d, r3, r2);
  return {hn::ConcatEven(d, even1, even0), hn::ConcatEven(d, odd1, odd0), hn::ConcatOdd(d, even1, even0),
          hn::ConcatOdd(d, odd1, odd0)};
}
#endif

// The samples at base + offset + index and the next one along x. Lanes of any valid index are read.
HWY_INLINE void PairAt(const float* base, ptrdiff_t offset, VI index, V& a, V& b) {
  const WordPair pair = WordPairAt(base + offset, Places(index), sizeof(float));
  a = pair.a, b = pair.b;
}
// Two codes as a word: plain loads of 8 bytes cost a third of a gather.
HWY_INLINE VI BothAt(const uint16_t* base, ptrdiff_t offset, VI index) {
  return hn::BitCast(DI(), WordPairAt(base + offset, Places(index), sizeof(uint16_t)).a);
}
HWY_INLINE V LowCode(VI v) { return hn::ConvertTo(D(), hn::And(v, hn::Set(DI(), 0xFFFF))); }
HWY_INLINE V HighCode(VI v) {
  return hn::ConvertTo(D(), hn::BitCast(DI(), hn::ShiftRight<16>(hn::BitCast(s::DU(), v))));
}
HWY_INLINE void PairAt(const uint16_t* base, ptrdiff_t offset, VI index, V& a, V& b) {
  const VI v = BothAt(base, offset, index);
  a = LowCode(v);
  b = HighCode(v);
}
HWY_INLINE void PairAt(const uint8_t* base, ptrdiff_t offset, VI index, V& a, V& b) {
  const DI di;
  const VI v = s::GatherWords<1>(base + offset, index);
  a = hn::ConvertTo(D(), hn::And(v, hn::Set(di, 0xFF)));
  b = hn::ConvertTo(D(), hn::And(hn::ShiftRight<8>(v), hn::Set(di, 0xFF)));
}
HWY_INLINE void PairAt(const hwy::float16_t* base, ptrdiff_t offset, VI index, V& a, V& b) {
  const VI v = BothAt(reinterpret_cast<const uint16_t*>(base), offset, index);
  const hn::Rebind<hwy::float16_t, D> half;
  const hn::Rebind<uint16_t, D> bits;
  const auto promote = [&](VI code) HWY_ATTR {
    return hn::PromoteTo(D(), hn::BitCast(half, hn::DemoteTo(bits, code)));
  };
  a = promote(hn::And(v, hn::Set(DI(), 0xFFFF)));
  b = promote(hn::BitCast(DI(), hn::ShiftRight<16>(hn::BitCast(s::DU(), v))));
}

// Four neighbours along x.
struct FourCodes {
  V v[4];
};
HWY_INLINE FourCodes FourAt(const float* base, ptrdiff_t offset, VI index) {
  const Words w = WordsAt(base + offset, Places(index), sizeof(float));
  return {{w.a, w.b, w.c, w.e}};
}
HWY_INLINE FourCodes FourAt(const uint8_t* base, ptrdiff_t offset, VI index) {
  const DI di;
  const VI v = s::GatherWords<1>(base + offset, index), byte = hn::Set(di, 0xFF);
  const D d;
  return {{hn::ConvertTo(d, hn::And(v, byte)), hn::ConvertTo(d, hn::And(hn::ShiftRight<8>(v), byte)),
           hn::ConvertTo(d, hn::And(hn::ShiftRight<16>(v), byte)),
           hn::ConvertTo(d, hn::And(hn::ShiftRight<24>(v), byte))}};
}
HWY_INLINE FourCodes FourAt(const uint16_t* base, ptrdiff_t offset, VI index) {
  const DI di;
  const WordPair w = WordPairAt(base + offset, Places(index), sizeof(uint16_t));
  const VI a = hn::BitCast(di, w.a), b = hn::BitCast(di, w.b);
  return {{LowCode(a), HighCode(a), LowCode(b), HighCode(b)}};
}
HWY_INLINE FourCodes FourAt(const hwy::float16_t* base, ptrdiff_t offset, VI index) {
  FourCodes r;
  PairAt(base, offset, index, r.v[0], r.v[1]);
  PairAt(base, offset + 2, index, r.v[2], r.v[3]);
  return r;
}

// Interpolation along x.
template <typename T>
struct Lines {
  const T* base;
  VI index;
  V f;
  HWY_INLINE V operator()(ptrdiff_t offset) const {
    V a, b;
    PairAt(base, offset, index, a, b);
    return Lerp(a, b, f);
  }
};

// Trilinear interpolation of codes.
template <typename T>
HWY_INLINE V Trilinear(const T* base, int32_t row, int32_t slice, VI index, const Vec3& f) {
  const Lines<T> line = {base, index, f.x};
  const ptrdiff_t up = row, deep = slice;
  return Lerp(Lerp(line(0), line(up), f.y), Lerp(line(deep), line(deep + up), f.y), f.z);
}

struct ValueAndGradient {
  V value;
  Vec3 gradient;  // trilinear central differences, codes per voxel
};
template <typename T>
HWY_INLINE ValueAndGradient TrilinearGradient(const T* base, int32_t row, int32_t slice, VI index,
                                              const Vec3& f) {
  const ptrdiff_t up = row, deep = slice;
  const Lines<T> line = {base, index, f.x};
  V value[4], along[4];
  for (int k = 0; k < 4; ++k) {
    const FourCodes c = FourAt(base, (k & 1) * up + (k >> 1) * deep - 1, index);
    value[k] = Lerp(c.v[1], c.v[2], f.x);
    along[k] = Lerp(hn::Sub(c.v[2], c.v[0]), hn::Sub(c.v[3], c.v[1]), f.x);
  }
  ValueAndGradient r;
  const V half = Set(0.5f);
  const V low = Lerp(value[0], value[2], f.z), high = Lerp(value[1], value[3], f.z);
  r.value = Lerp(low, high, f.y);
  r.gradient.x = hn::Mul(half, Lerp(Lerp(along[0], along[1], f.y), Lerp(along[2], along[3], f.y), f.z));
  const V below = Lerp(line(-up), line(deep - up), f.z), above = Lerp(line(2 * up), line(2 * up + deep), f.z);
  r.gradient.y = hn::Mul(half, Lerp(hn::Sub(high, below), hn::Sub(above, low), f.y));
  const V near = Lerp(value[0], value[1], f.y), far = Lerp(value[2], value[3], f.y);
  const V front = Lerp(line(-deep), line(up - deep), f.y),
          back = Lerp(line(2 * deep), line(2 * deep + up), f.y);
  r.gradient.z = hn::Mul(half, Lerp(hn::Sub(far, front), hn::Sub(back, near), f.z));
  return r;
}

// --- Noise blocks. ---
struct NoisePlace {
  VI index;
  Vec3 f;
};
HWY_INLINE V NoiseAxis(const NoiseView& n, int a, V v, float octave, VI& whole) {
  const DI di;
  V u = hn::MulAdd(v, Set(n.times[a] * octave), Set(n.plus[a] * octave));
  u = hn::Sub(u, hn::Floor(u));
  u = hn::MulAdd(u, Set(static_cast<float>(n.size)), Set(-0.5f));
  u = hn::IfThenElseZero(hn::Lt(u, Set(static_cast<float>(n.size))), u);  // lanes that are nowhere
  const V floor = hn::Floor(u);
  whole = hn::ConvertTo(di, floor);
  // One sample before the first is the last one: rows may then be read from one before to two behind.
  whole = hn::Add(whole, hn::And(hn::BroadcastSignBit(whole), hn::Set(di, n.size)));
  return hn::Sub(u, floor);
}
// Where position p (voxels) times `octave` lies in the block.
HWY_INLINE NoisePlace LocateNoise(const NoiseView& n, const Vec3& p, float octave = 1) {
  const DI di;
  NoisePlace r;
  VI i, j, k;
  r.f.x = NoiseAxis(n, 0, p.x, octave, i);
  r.f.y = NoiseAxis(n, 1, p.y, octave, j);
  r.f.z = NoiseAxis(n, 2, p.z, octave, k);
  r.index = hn::Add(hn::Add(hn::Mul(k, hn::Set(di, n.slice)), hn::Mul(j, hn::Set(di, n.row))), i);
  return r;
}
HWY_INLINE V NoiseValue(const NoiseView& n, const Vec3& p, float octave = 1) {
  const DI di;
  const NoisePlace at = LocateNoise(n, p, octave);
  const Words w = WordsAt(n.cells, Places(at.index), 8);
  const auto line = [&](V word) __attribute__((always_inline)) {
    const VI v = hn::BitCast(di, word);
    return Lerp(LowCode(v), HighCode(v), at.f.y);
  };
  const V x0 = Lerp(line(w.a), line(w.b), at.f.z), x1 = Lerp(line(w.c), line(w.e), at.f.z);
  return hn::MulAdd(Lerp(x0, x1, at.f.x), Set(n.scale), Set(n.bias));
}
// Value and gradient per voxel of p.
HWY_INLINE ValueAndGradient NoiseGradient(const NoiseView& n, const Vec3& p) {
  const NoisePlace at = LocateNoise(n, p);
  ValueAndGradient r = TrilinearGradient(n.samples, n.row, n.slice, at.index, at.f);
  r.value = hn::MulAdd(r.value, Set(n.scale), Set(n.bias));
  const float size = static_cast<float>(n.size) * n.scale;
  r.gradient.x = hn::Mul(r.gradient.x, Set(size * n.times[0]));
  r.gradient.y = hn::Mul(r.gradient.y, Set(size * n.times[1]));
  r.gradient.z = hn::Mul(r.gradient.z, Set(size * n.times[2]));
  return r;
}
// The four channels of a block that has four.
HWY_INLINE void NoiseChannels(const NoiseView& n, const Vec3& p, V* channels) {
  const DI di;
  const NoisePlace at = LocateNoise(n, p);
  const Places places(at.index);
  const auto line = [&](ptrdiff_t texels, V * c) __attribute__((always_inline)) {
    const Words w = WordsAt(n.samples + 4 * texels, places, 8);
    const VI a = hn::BitCast(di, w.a), b = hn::BitCast(di, w.b), x1a = hn::BitCast(di, w.c),
             x1b = hn::BitCast(di, w.e);
    c[0] = Lerp(LowCode(a), LowCode(x1a), at.f.x);
    c[1] = Lerp(HighCode(a), HighCode(x1a), at.f.x);
    c[2] = Lerp(LowCode(b), LowCode(x1b), at.f.x);
    c[3] = Lerp(HighCode(b), HighCode(x1b), at.f.x);
  };
  V near[4], near_up[4], far[4], far_up[4];
  line(0, near);
  line(n.row, near_up);
  line(n.slice, far);
  line(ptrdiff_t{n.slice} + n.row, far_up);
  for (int c = 0; c < 4; ++c) {
    const V v = Lerp(Lerp(near[c], near_up[c], at.f.y), Lerp(far[c], far_up[c], at.f.y), at.f.z);
    channels[c] = hn::MulAdd(v, Set(n.scale), Set(n.bias));
  }
}

// --- Noise itself. ---
// Gradient noise at position p of the block, each coordinate in [0, 1]; repeats after a block.
HWY_INLINE V ExactNoise(const ExactOctave& octave, const Vec3& p) {
  const DI di;
  const s::DU du;
  const V one = Set(1);
  const VI period = hn::Set(di, static_cast<int32_t>(octave.cells));
  s::VU side[3][2];
  V offset[3][2], fade[3];
  const V coordinates[3] = {p.x, p.y, p.z};
#pragma GCC unroll 3
  for (int a = 0; a < 3; ++a) {
    const V u = hn::MulAdd(coordinates[a], Set(octave.cells), Set(octave.shift[a]));
    const V floor = hn::Floor(u);
    offset[a][0] = hn::Sub(u, floor);
    offset[a][1] = hn::Sub(offset[a][0], one);
    fade[a] = s::FadeWeight(offset[a][0], 0);
    VI cell = hn::ConvertTo(di, floor);
    for (int c = 0; c < 2; ++c) {
      cell = hn::Sub(cell, hn::IfThenElseZero(hn::Not(hn::Gt(period, cell)), period));
      side[a][c] = hn::Mul(hn::BitCast(du, cell), hn::Set(du, s::kAxis[a]));
      cell = hn::Add(cell, hn::Set(di, 1));
    }
  }
  for (s::VU& x : side[0]) x = hn::Xor(x, hn::Set(du, octave.seed));
  V corner[8];
#pragma GCC unroll 8
  for (int c = 0; c < 8; ++c) {
    const s::VU h = hn::Xor(hn::Xor(side[0][c & 1], side[1][c >> 1 & 1]), side[2][c >> 2]);
    const V from[3] = {offset[0][c & 1], offset[1][c >> 1 & 1], offset[2][c >> 2]};
    corner[c] = s::LatticeProjection<3>(s::LatticeMix(h), from);
  }
  const V near = Lerp(Lerp(corner[0], corner[1], fade[0]), Lerp(corner[2], corner[3], fade[0]), fade[1]);
  const V far = Lerp(Lerp(corner[4], corner[5], fade[0]), Lerp(corner[6], corner[7], fade[0]), fade[1]);
  return Lerp(near, far, fade[2]);
}
// The sum of the octaves' absolute values at position p (voxels).
template <size_t kOctaves>
HWY_INLINE V ExactTurbulence(const NoiseView& n, const ExactOctave (&octaves)[kOctaves], const Vec3& p) {
  const auto axis = [&](int a, V v) HWY_ATTR {
    const V u = hn::MulAdd(v, Set(n.times[a]), Set(n.plus[a]));
    const V inside = hn::Sub(u, hn::Floor(u));
    return hn::IfThenElseZero(hn::Lt(inside, Set(2)), inside);  // lanes that are nowhere
  };
  const Vec3 place = {axis(0, p.x), axis(1, p.y), axis(2, p.z)};
  V sum = hn::Zero(D());
  for (const ExactOctave& o : octaves) {
    sum = hn::MulAdd(hn::Abs(ExactNoise(o, place)), Set(o.weight), sum);
  }
  return sum;
}

// --- Tables of four floats. ---
HWY_INLINE s::Pixels Mixed(const s::Pixels& a, const s::Pixels& b, V f) {
  return {Lerp(a.r, b.r, f), Lerp(a.g, b.g, f), Lerp(a.b, b.b, f), Lerp(a.a, b.a, f)};
}
// Entry `index` + `further`.
HWY_INLINE s::Pixels EntryAt(const float* entries, const Places& index, ptrdiff_t further = 0) {
  const Words w = WordsAt(entries + 4 * further, index);
  return {w.a, w.b, w.c, w.e};
}
HWY_INLINE s::Pixels ColorOf(const ColorTable& table, V value) {
  const D d;
  V u = hn::MulAdd(value, Set(table.times), Set(table.plus));
  u = hn::Min(hn::Max(u, hn::Zero(d)), Set(static_cast<float>(table.size - 1)));
  const VI whole = hn::ConvertTo(DI(), u);
  const Places places(whole);
  return Mixed(EntryAt(table.entries, places), EntryAt(table.entries, places, 1),
               hn::Sub(u, hn::ConvertTo(d, whole)));
}

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
