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
#include "ops/volume/places-inl.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {
HWY_INLINE V Set(float v) { return hn::Set(D(), v); }
// a + f (b - a).
HWY_INLINE V Lerp(V a, V b, V f) { return hn::MulAdd(f, hn::Sub(b, a), a); }
HWY_INLINE V Clamp01(V v) { return hn::Min(hn::Max(v, hn::Zero(D())), Set(1)); }

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

// Whole numbers from 0 to below 2^23 as integers: conversion would look for those that are too large.
HWY_INLINE VI WholeOf(V v) {
  const DI di;
  return hn::And(hn::BitCast(di, hn::Add(v, Set(0x1p23f))), hn::Set(di, 0x7FFFFF));
}

// A cell and the place in it.
struct Cell {
  VI i, j, k;
  Vec3 f;
};
HWY_INLINE Cell Locate(const Field& field, const Vec3& p) {
  const auto axis = [&](V v, float last, VI& whole) __attribute__((always_inline)) {
    v = hn::Min(hn::Max(v, hn::Zero(D())), Set(last));
    const V floor = hn::Floor(v);
    whole = WholeOf(floor);
    return hn::Sub(v, floor);
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
// A block of cells of the leap grid.
struct Block {
  Vec3 at;  // whole
  VI index;
};
HWY_INLINE Block BlockOf(const Field& field, const Vec3& p) {
  const auto axis = [&](V v, float last) HWY_ATTR {
    return hn::Floor(hn::Mul(hn::Min(hn::Max(v, hn::Zero(D())), Set(last)), Set(field.per_edge)));
  };
  Block b;
  b.at = {axis(p.x, field.last[0]), axis(p.y, field.last[1]), axis(p.z, field.last[2])};
  // Floats count the blocks of a row; those of a large slice only integers do.
  const VI line = hn::Add(hn::Mul(WholeOf(b.at.y), hn::Set(DI(), field.blocks[0])), WholeOf(b.at.x));
  b.index = hn::Add(hn::Mul(WholeOf(b.at.z), hn::Set(DI(), field.blocks[1])), line);
  return b;
}
// The entry of a block; the lower byte alone is the room.
HWY_INLINE VI LeapOf(const uint16_t* leaps, VI block) {
  return s::GatherWords<1>(leaps, hn::Add(block, block));
}
// The block that a cell lies in.
HWY_INLINE VI BlockIndexOf(const Field& field, const Cell& c) {
  const DI di;
  const auto block = [&](VI cell) HWY_ATTR { return hn::ShiftRightSame(cell, field.shift); };
  const VI line = hn::Add(hn::Mul(block(c.j), hn::Set(di, field.blocks[0])), block(c.i));
  return hn::Add(hn::Mul(block(c.k), hn::Set(di, field.blocks[1])), line);
}

// --- Samples. ---
// Of cells in bricks.
HWY_INLINE void PlaceInBricks(const Field& field, const VI& i, const VI& j, const VI& k, FarPlaces& to) {
  using hn::And;
  const DI di;
  const VI own = hn::Set(di, model::kBrickEdge - 1);
  const auto brick = [](VI v) HWY_ATTR { return hn::ShiftRight<model::kBrickShift>(v); };
  const VI line = hn::Add(hn::Mul(brick(j), hn::Set(di, field.bricks[0])), brick(i));
  const VI bricks = hn::Add(hn::Mul(brick(k), hn::Set(di, field.bricks[1])), line);
  const VI local = hn::Add(hn::Mul(And(k, own), hn::Set(di, field.slice)),
                           hn::Add(hn::Mul(And(j, own), hn::Set(di, field.row)), And(i, own)));
  const auto whole = [](auto brick64, auto local64) HWY_ATTR {
    const hn::Repartition<int32_t, D64> words;
    const auto samples = hn::Set(words, static_cast<int32_t>(model::kBrickSamples));
    return hn::Add(hn::MulEven(hn::BitCast(words, brick64), samples), local64);
  };
  hn::Store(whole(FarPlaces::Low(bricks), FarPlaces::Low(local)), D64(), to.at);
  hn::Store(whole(FarPlaces::High(bricks), FarPlaces::High(local)), D64(), to.at + kLanes / 2);
}
HWY_INLINE FarPlaces FarPlacesOf(const Field& field, const Cell& c) {
  FarPlaces r;
  PlaceInBricks(field, c.i, c.j, c.k, r);
  return r;
}
HWY_INLINE Places NearPlacesOf(const Field& field, const Cell& c) {
  return Places(IndexOf(c, field.row, field.slice));
}
HWY_INLINE V LowCode(VI v) { return hn::ConvertTo(D(), hn::And(v, hn::Set(DI(), 0xFFFF))); }
HWY_INLINE V HighCode(VI v) {
  return hn::ConvertTo(D(), hn::BitCast(DI(), hn::ShiftRight<16>(hn::BitCast(s::DU(), v))));
}
// The codes of a word.
HWY_INLINE void Split(VI v, uint16_t, V& a, V& b) {
  a = LowCode(v);
  b = HighCode(v);
}
HWY_INLINE void Split(VI v, hwy::float16_t, V& a, V& b) {
  const hn::Rebind<hwy::float16_t, D> half;
  const hn::Rebind<uint16_t, D> bits;
  const auto promote = [&](VI code) HWY_ATTR {
    return hn::PromoteTo(D(), hn::BitCast(half, hn::DemoteTo(bits, code)));
  };
  a = promote(hn::And(v, hn::Set(DI(), 0xFFFF)));
  b = promote(hn::BitCast(DI(), hn::ShiftRight<16>(hn::BitCast(s::DU(), v))));
}
// The samples at base + offset + places and the next one along x. Lanes of any valid index are read; 4 bytes
// before may be.
template <typename T, class P>
HWY_INLINE void PairAt(const T* base, ptrdiff_t offset, const P& places, V& a, V& b) {
  if constexpr (sizeof(T) == 4) {
    const WordPair pair = WordPairAt(base + offset, places, sizeof(T));
    a = pair.a, b = pair.b;
  } else if constexpr (sizeof(T) == 2) {
    Split(WordAt(base + offset, places, sizeof(T)), T(), a, b);  // plain loads cost a third of a gather
  } else {
    const DI di;
    const VI v = BytesAt(base + offset, places);
    a = hn::ConvertTo(D(), hn::And(v, hn::Set(di, 0xFF)));
    b = hn::ConvertTo(D(), hn::And(hn::ShiftRight<8>(v), hn::Set(di, 0xFF)));
  }
}
// Nothing before is read.
template <typename T>
HWY_INLINE void PairFrom(const T* base, ptrdiff_t offset, const Places& places, V& a, V& b) {
  if constexpr (sizeof(T) == 2) {
    Split(hn::BitCast(DI(), WordPairAt(base + offset, places, sizeof(T)).a), T(), a, b);
  } else {
    PairAt(base, offset, places, a, b);
  }
}

// Four neighbours along x.
struct FourCodes {
  V v[4];
};
template <typename T, class P>
HWY_INLINE FourCodes FourAt(const T* base, ptrdiff_t offset, const P& places) {
  FourCodes r;
  if constexpr (sizeof(T) == 4) {
    const Words w = WordsAt(base + offset, places, sizeof(T));
    r = {{w.a, w.b, w.c, w.e}};
  } else if constexpr (sizeof(T) == 2) {
    const WordPair w = WordPairAt(base + offset, places, sizeof(T));
    Split(hn::BitCast(DI(), w.a), T(), r.v[0], r.v[1]);
    Split(hn::BitCast(DI(), w.b), T(), r.v[2], r.v[3]);
  } else {
    const D d;
    const DI di;
    const VI v = BytesAt(base + offset, places), byte = hn::Set(di, 0xFF);
    r = {{hn::ConvertTo(d, hn::And(v, byte)), hn::ConvertTo(d, hn::And(hn::ShiftRight<8>(v), byte)),
          hn::ConvertTo(d, hn::And(hn::ShiftRight<16>(v), byte)),
          hn::ConvertTo(d, hn::And(hn::ShiftRight<24>(v), byte))}};
  }
  return r;
}

// Interpolation along x.
template <typename T, class P>
struct Lines {
  const T* base;
  const P& places;
  V f;
  HWY_INLINE V operator()(ptrdiff_t offset) const {
    V a, b;
    PairAt(base, offset, places, a, b);
    return Lerp(a, b, f);
  }
};

// Trilinear interpolation of codes.
template <typename T, class P>
HWY_INLINE V Trilinear(const T* base, int32_t row, int32_t slice, const P& places, const Vec3& f) {
  const Lines<T, P> line = {base, places, f.x};
  const ptrdiff_t up = row, deep = slice;
  return Lerp(Lerp(line(0), line(up), f.y), Lerp(line(deep), line(deep + up), f.y), f.z);
}

struct ValueAndGradient {
  V value;
  Vec3 gradient;  // trilinear central differences, codes per voxel
};
// In two parts: the first reads what the value needs, the second the rest.
template <typename T>
class GradientLines {
 public:
  template <class P>
  HWY_INLINE void Read(const T* base, int32_t row, int32_t slice, const P& places, const Vec3& f) {
    for (int k = 0; k < 4; ++k) {
      const FourCodes c = FourAt(base, (k & 1) * ptrdiff_t{row} + (k >> 1) * ptrdiff_t{slice} - 1, places);
      value_[k] = Lerp(c.v[1], c.v[2], f.x);
      along_[k] = Lerp(hn::Sub(c.v[2], c.v[0]), hn::Sub(c.v[3], c.v[1]), f.x);
    }
  }
  // As Trilinear finds it.
  HWY_INLINE V Value(const Vec3& f) const {
    return Lerp(Lerp(value_[0], value_[1], f.y), Lerp(value_[2], value_[3], f.y), f.z);
  }
  template <class P>
  HWY_INLINE ValueAndGradient Gradient(const T* base, int32_t row, int32_t slice, const P& places,
                                       const Vec3& f) const {
    const ptrdiff_t up = row, deep = slice;
    const Lines<T, P> line = {base, places, f.x};
    ValueAndGradient r;
    const V half = Set(0.5f);
    const V low = Lerp(value_[0], value_[2], f.z), high = Lerp(value_[1], value_[3], f.z);
    r.value = Lerp(low, high, f.y);
    r.gradient.x = hn::Mul(half, Lerp(Lerp(along_[0], along_[1], f.y), Lerp(along_[2], along_[3], f.y), f.z));
    const V below = Lerp(line(-up), line(deep - up), f.z),
            above = Lerp(line(2 * up), line(2 * up + deep), f.z);
    r.gradient.y = hn::Mul(half, Lerp(hn::Sub(high, below), hn::Sub(above, low), f.y));
    const V near = Lerp(value_[0], value_[1], f.y), far = Lerp(value_[2], value_[3], f.y);
    const V front = Lerp(line(-deep), line(up - deep), f.y),
            back = Lerp(line(2 * deep), line(2 * deep + up), f.y);
    r.gradient.z = hn::Mul(half, Lerp(hn::Sub(far, front), hn::Sub(back, near), f.z));
    return r;
  }

 private:
  V value_[4], along_[4];
};
template <typename T, class P>
HWY_INLINE ValueAndGradient TrilinearGradient(const T* base, int32_t row, int32_t slice, const P& places,
                                              const Vec3& f) {
  GradientLines<T> lines;
  lines.Read(base, row, slice, places, f);
  return lines.Gradient(base, row, slice, places, f);
}

// --- Samples of a field, in memory of their own or in bricks. ---
// What bricks need is out of line, and gets a copy of the cell: all others keep theirs in registers and their
// addresses at half the width. Not so a mere value: loops of little else took 7 % longer for saving their
// registers around the call.
template <typename T>
HWY_INLINE V TrilinearAt(const Field& field, const T* samples, const Cell& c) {
  if (field.pages == nullptr) return Trilinear(samples, field.row, field.slice, NearPlacesOf(field, c), c.f);
  return Trilinear(samples, field.row, field.slice, FarPlacesOf(field, c), c.f);
}
template <typename T>
HWY_NOINLINE void ReadInBricks(const Field& field, const T* samples, const Cell& c, GradientLines<T>& to) {
  to.Read(samples, field.row, field.slice, FarPlacesOf(field, c), c.f);
}
template <typename T>
HWY_INLINE GradientLines<T> GradientLinesAt(const Field& field, const T* samples, const Cell& c) {
  GradientLines<T> lines;
  if (field.pages == nullptr) {
    lines.Read(samples, field.row, field.slice, NearPlacesOf(field, c), c.f);
  } else {
    const Cell copy = c;
    GradientLines<T> far;
    ReadInBricks(field, samples, copy, far);
    lines = far;
  }
  return lines;
}
template <typename T>
HWY_NOINLINE ValueAndGradient GradientInBricks(const Field& field, const T* samples, const Cell& c,
                                               const GradientLines<T>& lines) {
  return lines.Gradient(samples, field.row, field.slice, FarPlacesOf(field, c), c.f);
}
template <typename T>
HWY_INLINE ValueAndGradient GradientAt(const Field& field, const T* samples, const Cell& c,
                                       const GradientLines<T>& lines) {
  if (field.pages == nullptr)
    return lines.Gradient(samples, field.row, field.slice, NearPlacesOf(field, c), c.f);
  const Cell copy = c;
  const GradientLines<T> far = lines;
  return GradientInBricks(field, samples, copy, far);
}
template <typename T>
HWY_NOINLINE ValueAndGradient TrilinearGradientInBricks(const Field& field, const T* samples, const Cell& c) {
  return TrilinearGradient(samples, field.row, field.slice, FarPlacesOf(field, c), c.f);
}
template <typename T>
HWY_INLINE ValueAndGradient TrilinearGradientAt(const Field& field, const T* samples, const Cell& c) {
  if (field.pages == nullptr)
    return TrilinearGradient(samples, field.row, field.slice, NearPlacesOf(field, c), c.f);
  const Cell copy = c;
  return TrilinearGradientInBricks(field, samples, copy);
}
// The codes at a cell's corners, x fastest.
struct Corners {
  V at[8];
};
template <typename T, class P>
HWY_INLINE void ReadCorners(const Field& field, const T* samples, const P& places, Corners& to) {
  for (int line = 0; line < 4; ++line) {
    PairAt(samples, ptrdiff_t{line & 1} * field.row + ptrdiff_t{line >> 1} * field.slice, places,
           to.at[2 * line], to.at[2 * line + 1]);
  }
}
template <typename T>
HWY_NOINLINE void ReadCornersInBricks(const Field& field, const T* samples, const Cell& c, Corners& to) {
  ReadCorners(field, samples, FarPlacesOf(field, c), to);
}

// --- Noise blocks. ---
struct NoisePlace {
  VI index;
  Vec3 f;
};
HWY_INLINE V NoiseAxis(const NoiseView& n, int a, V v, float octave, float shift, VI& whole) {
  V u = hn::MulAdd(v, Set(n.times[a] * octave), Set(n.plus[a] * octave + shift - n.half));
  u = hn::Sub(u, hn::Floor(u));
  u = hn::IfThenElseZero(hn::Lt(u, Set(1)), u);  // rounded up to the next block; lanes that are nowhere
  u = hn::Mul(u, Set(static_cast<float>(n.size)));
  const V floor = hn::Floor(u);
  whole = WholeOf(floor);
  return hn::Sub(u, floor);
}
inline constexpr float kUnshifted[3] = {0, 0, 0};
// Where position p (voxels) times `octave`, shifted, lies in the block.
HWY_INLINE NoisePlace LocateNoise(const NoiseView& n, const Vec3& p, float octave = 1,
                                  const float (&shift)[3] = kUnshifted) {
  const DI di;
  NoisePlace r;
  VI i, j, k;
  r.f.x = NoiseAxis(n, 0, p.x, octave, shift[0], i);
  r.f.y = NoiseAxis(n, 1, p.y, octave, shift[1], j);
  r.f.z = NoiseAxis(n, 2, p.z, octave, shift[2], k);
  r.index = hn::Add(hn::Add(hn::Mul(k, hn::Set(di, n.slice)), hn::Mul(j, hn::Set(di, n.row))), i);
  return r;
}
HWY_INLINE void PrefetchNoise(const NoiseView& n, const NoisePlace& at) {
  PrefetchPlaces(n.cells, Places(at.index), 8);
}
HWY_INLINE V NoiseAt(const NoiseView& n, const NoisePlace& at) {
  const DI di;
  const Words w = WordsAt(n.cells, Places(at.index), 8);
  const auto line = [&](V word) __attribute__((always_inline)) {
    const VI v = hn::BitCast(di, word);
    return Lerp(LowCode(v), HighCode(v), at.f.y);
  };
  const V x0 = Lerp(line(w.a), line(w.b), at.f.z), x1 = Lerp(line(w.c), line(w.e), at.f.z);
  return hn::MulAdd(Lerp(x0, x1, at.f.x), Set(n.scale), Set(n.bias));
}
HWY_INLINE V NoiseValue(const NoiseView& n, const Vec3& p, float octave = 1) {
  return NoiseAt(n, LocateNoise(n, p, octave));
}
// Value and gradient per voxel of p.
HWY_INLINE ValueAndGradient NoiseGradient(const NoiseView& n, const Vec3& p) {
  const NoisePlace at = LocateNoise(n, p);
  ValueAndGradient r = TrilinearGradient(n.samples, n.row, n.slice, Places(at.index), at.f);
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
