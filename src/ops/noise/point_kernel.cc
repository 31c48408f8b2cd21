// Gradient noise on Tessera's lattice straight from rows of positions.
//
// Per corner: the axes' products are shared by the corners, one exclusive or of three and the mix make the
// hash, its upper bits choose a gradient, and the offset is projected on it.
//
// A vector is more instructions in a chain than a processor looks ahead, so that it waits for most of them:
// short blocks go through one step after the other, of which 32 registers need fewer than 16.
#include <algorithm>
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/point_kernel.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/noise/place-inl.h"
#include "ops/noise/shaped-inl.h"
#include "simd/edges-inl.h"
#include "simd/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VU;

// Whole numbers are made integers by adding 1.5 * 2^23: their bits are kIntegerBits + the number, as long as
// it is within 2^22.
constexpr uint32_t kIntegerBits = 0x4b400000u;

// Corners, x fastest, by the weights of the upper ones.
template <int kDims>
HWY_INLINE V Blended(const V* fade, V* corner) {
#pragma GCC unroll 16
  for (int k = 0; k < kDims; ++k) {
#pragma GCC unroll 16
    for (int i = 0; i < 1 << (kDims - 1 - k); ++i) {
      corner[i] = hn::MulAdd(fade[k], hn::Sub(corner[2 * i + 1], corner[2 * i]), corner[2 * i]);
    }
  }
  return corner[0];
}

// The axes' products of a corner, before the mix.
template <int kDims>
HWY_INLINE VU Joined(const VU* axis) {
  if constexpr (kDims == 2) return hn::Xor(axis[0], axis[1]);
  // One instruction with AVX-512; without it pairs are shared by two corners.
  return HWY_TARGET <= HWY_AVX3 ? hn::Xor3(axis[0], axis[1], axis[2])
                                : hn::Xor(hn::Xor(axis[1], axis[2]), axis[0]);
}

template <int kDims, bool kPlain>
HWY_INLINE V NoiseOf(const PointRow& a, const PointOctave& o, const Place<kDims>& place, VU& wrong) {
  const s::D d;
  const s::DU du;
  const V one = hn::Set(d, 1.0f);
  VU side[kDims][2];
  V offset[kDims][2], fade[kDims];
#pragma GCC unroll 16
  for (int k = 0; k < kDims; ++k) {
    const VU bits = hn::BitCast(du, hn::Add(place.whole[k], hn::Set(d, 12582912.0f)));
    wrong = hn::Or(wrong, hn::Xor(bits, hn::Set(du, 0x4b000000u)));
    side[k][0] = hn::Add(hn::Mul(bits, hn::Set(du, s::kAxis[k])),
                         hn::Set(du, (o.cell[k] - kIntegerBits) * s::kAxis[k]));
    side[k][1] = hn::Add(side[k][0], hn::Set(du, s::kAxis[k]));
    offset[k][0] = place.fraction[k];
    offset[k][1] = hn::Sub(place.fraction[k], one);
    fade[k] = s::FadeWeight(place.fraction[k], kPlain ? 0 : a.fade);
  }
  const VU seed = hn::Set(du, o.seed);
  for (VU& x : side[0]) x = hn::Xor(x, seed);
  V corner[1 << kDims];
#pragma GCC unroll 16
  for (int c = 0; c < 1 << kDims; ++c) {
    V from[kDims];
#pragma GCC unroll 16
    for (int k = 0; k < kDims; ++k) from[k] = offset[k][c >> k & 1];
    VU axis[kDims];
#pragma GCC unroll 16
    for (int k = 0; k < kDims; ++k) axis[k] = side[k][c >> k & 1];
    corner[c] = s::LatticeProjection<kDims>(s::LatticeMix(Joined<kDims>(axis)), from);
  }
  return hn::MulAdd(Blended<kDims>(fade, corner), hn::Set(d, a.scale), hn::Zero(d));
}

HWY_INLINE V ShapedBy(NoiseSum sum, V n) {
  if (sum == NoiseSum::kFbm) return n;
  if (sum == NoiseSum::kTurbulence) return Shaped<NoiseSum::kTurbulence>(n);
  if (sum == NoiseSum::kBillow) return Shaped<NoiseSum::kBillow>(n);
  return Shaped<NoiseSum::kRidged>(n);
}

// Vectors of a block, all of which stays in L1, and how few are not worth one.
constexpr int kBlockVectors = 24, kFewVectors = 4;

template <int kDims>
struct Block {
  static constexpr int kLanes = HWY_MAX_BYTES / sizeof(float);
  // Per vector: the lower sides' products, what is left of positions, and hashes or edges of corners.
  HWY_ALIGN uint32_t side[kBlockVectors][kDims][kLanes];
  HWY_ALIGN float fraction[kBlockVectors][kDims][kLanes];
  HWY_ALIGN uint32_t corner[kBlockVectors][1 << kDims][kLanes];
  // Corners blended along x, where there are too few registers for all in one step.
  HWY_ALIGN float pair[s::kManyRegisters ? 1 : kBlockVectors][1 << (kDims - 1)][kLanes];
  // Positions of the first octave, where more than one octave reads them.
  HWY_ALIGN float base_whole[kBlockVectors][kDims][kLanes], base_fraction[kBlockVectors][kDims][kLanes];
};

// Floats that will be read next, some of them asked for at a time.
struct Ahead {
  const float* from = nullptr;
  int floats = 0, step = 16;
  HWY_INLINE void Prefetch(int i) const {
    for (int k = i * step; k < std::min(floats, (i + 1) * step); k += 16) hwy::Prefetch(from + k);
  }
};

// The first step: places, as place_at(vector) tells them. Returns what NoiseOf() calls wrong.
template <int kDims, class PlaceAt>
HWY_INLINE VU BlockPlaces(const PointOctave& o, int vectors, Block<kDims>& b, const PlaceAt& place_at) {
  const s::D d;
  const s::DU du;
  VU wrong = hn::Zero(du), origin[kDims];
  for (int k = 0; k < kDims; ++k) origin[k] = hn::Set(du, (o.cell[k] - kIntegerBits) * s::kAxis[k]);
  for (int i = 0; i < vectors; ++i) {
    const Place<kDims> place = place_at(i);
#pragma GCC unroll 16
    for (int k = 0; k < kDims; ++k) {
      const VU bits = hn::BitCast(du, hn::Add(place.whole[k], hn::Set(d, 12582912.0f)));
      wrong = hn::Or(wrong, hn::Xor(bits, hn::Set(du, 0x4b000000u)));
      hn::Store(hn::Add(hn::Mul(bits, hn::Set(du, s::kAxis[k])), origin[k]), du, b.side[i][k]);
      hn::Store(place.fraction[k], d, b.fraction[i][k]);
    }
  }
  return wrong;
}

// The second: hashes of corners, in three dimensions their edges.
template <int kDims>
HWY_INLINE void BlockCorners(const PointOctave& o, int vectors, const Ahead& next, Block<kDims>& b) {
  const s::DU du;
  const VU seed = hn::Set(du, o.seed);
  for (int i = 0; i < vectors; ++i) {
    next.Prefetch(i);
    VU side[kDims][2];
#pragma GCC unroll 16
    for (int k = 0; k < kDims; ++k) {
      side[k][0] = hn::Load(du, b.side[i][k]);
      side[k][1] = hn::Add(side[k][0], hn::Set(du, s::kAxis[k]));
    }
    for (VU& x : side[0]) x = hn::Xor(x, seed);
#pragma GCC unroll 16
    for (int c = 0; c < 1 << kDims; ++c) {
      VU axis[kDims];
#pragma GCC unroll 16
      for (int k = 0; k < kDims; ++k) axis[k] = side[k][c >> k & 1];
      VU h = s::LatticeMix(Joined<kDims>(axis));
      if constexpr (kDims == 3) h = s::TopEdge(h);
      hn::Store(h, du, b.corner[i][c]);
    }
  }
}

// What the first octave adds to, and the others.
HWY_INLINE V SumBefore(const PointRow& a, bool first, const float* out) {
  const s::D d;
  return first ? hn::Set(d, a.bias) : hn::LoadU(d, out);
}

// The third, of 16 registers: gradients times offsets, blended along x.
template <int kDims>
HWY_INLINE void BlockPairs(int fade, int vectors, Block<kDims>& b) {
  const s::D d;
  const s::DU du;
  const V one = hn::Set(d, 1.0f);
  for (int i = 0; i < vectors; ++i) {
    V offset[kDims][2];
#pragma GCC unroll 16
    for (int k = 0; k < kDims; ++k) {
      offset[k][0] = hn::Load(d, b.fraction[i][k]);
      offset[k][1] = hn::Sub(offset[k][0], one);
    }
    const V x = s::FadeWeight(offset[0][0], fade);
#pragma GCC unroll 16
    for (int c = 0; c < 1 << kDims; c += 2) {
      V n[2];
#pragma GCC unroll 16
      for (int j = 0; j < 2; ++j) {
        V from[kDims];
        from[0] = offset[0][j];
#pragma GCC unroll 16
        for (int k = 1; k < kDims; ++k) from[k] = offset[k][c >> k & 1];
        const VU h = hn::Load(du, b.corner[i][c + j]);
        if constexpr (kDims == 3) {
          n[j] = s::EdgeProjection(h, from);
        } else {
          n[j] = s::LatticeProjection<kDims>(h, from);
        }
      }
      hn::Store(hn::MulAdd(x, hn::Sub(n[1], n[0]), n[0]), d, b.pair[i][c / 2]);
    }
  }
}

// The fourth: the other axes' blends, and the sum of octaves, which `out` holds but for the first one.
template <int kDims, bool kPlain>
HWY_INLINE void BlockSums(const PointRow& a, const PointOctave& o, bool first, int vectors,
                          const Block<kDims>& b, float* out) {
  const s::D d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int i = 0; i < vectors; ++i) {
    V n[1 << (kDims - 1)];
#pragma GCC unroll 16
    for (int c = 0; c < 1 << (kDims - 1); ++c) n[c] = hn::Load(d, b.pair[i][c]);
#pragma GCC unroll 16
    for (int k = 1; k < kDims; ++k) {
      const V fade = s::FadeWeight(hn::Load(d, b.fraction[i][k]), kPlain ? 0 : a.fade);
#pragma GCC unroll 16
      for (int j = 0; j < 1 << (kDims - 1 - k); ++j) {
        n[j] = hn::MulAdd(fade, hn::Sub(n[2 * j + 1], n[2 * j]), n[2 * j]);
      }
    }
    const V value = hn::MulAdd(n[0], hn::Set(d, a.scale), hn::Zero(d));
    const V sum = SumBefore(a, first, out + i * lanes);
    hn::StoreU(hn::MulAdd(kPlain ? value : ShapedBy(a.sum, value), hn::Set(d, o.weight), sum), d,
               out + i * lanes);
  }
}
// Or both in one, of 32 registers.
template <int kDims, bool kPlain>
HWY_INLINE void BlockValues(const PointRow& a, const PointOctave& o, bool first, int vectors,
                            const Block<kDims>& b, float* HWY_RESTRICT out) {
  const s::D d;
  const s::DU du;
  const int lanes = static_cast<int>(hn::Lanes(d)), kind = kPlain ? 0 : a.fade;
  const V one = hn::Set(d, 1.0f), scale = hn::Set(d, a.scale), weight = hn::Set(d, o.weight);
  for (int i = 0; i < vectors; ++i) {
    V offset[kDims][2], fade[kDims], corner[1 << kDims];
#pragma GCC unroll 16
    for (int k = 0; k < kDims; ++k) {
      offset[k][0] = hn::Load(d, b.fraction[i][k]);
      offset[k][1] = hn::Sub(offset[k][0], one);
    }
#pragma GCC unroll 16
    for (int c = 0; c < 1 << kDims; ++c) {
      V from[kDims];
#pragma GCC unroll 16
      for (int k = 0; k < kDims; ++k) from[k] = offset[k][c >> k & 1];
      const VU h = hn::Load(du, b.corner[i][c]);
      if constexpr (kDims == 3) {
        corner[c] = s::EdgeProjection(h, from);
      } else {
        corner[c] = s::LatticeProjection<kDims>(h, from);
      }
      // As Blended(), but neighbours as soon as both are there: sums then alternate with gradients' look-ups,
      // which other units do.
#pragma GCC unroll 16
      for (int k = 0; k < kDims; ++k) {
        const int size = 2 << k, low = c + 1 - size;
        if ((c + 1) % size != 0) break;
        if (low == 0) fade[k] = s::FadeWeight(offset[k][0], kind);
        corner[low] = hn::MulAdd(fade[k], hn::Sub(corner[low + size / 2], corner[low]), corner[low]);
      }
    }
    const V value = hn::MulAdd(corner[0], scale, hn::Zero(d));
    const V sum = SumBefore(a, first, out + i * lanes);
    hn::StoreU(hn::MulAdd(kPlain ? value : ShapedBy(a.sum, value), weight, sum), d, out + i * lanes);
  }
}

// Whether all cells of a block were in range; else `out` is of no use. The row has `ahead` more positions.
template <int kDims, bool kPlain>
HWY_INLINE bool BlockOf(const PointRow& a, const float* in, int vectors, int ahead, Block<kDims>& b,
                        float* out) {
  const s::D d;
  const s::DU du;
  const int lanes = static_cast<int>(hn::Lanes(d));
  // By value: no store into the block can change them.
  const auto first_place = [row = a, in, lanes](int i) HWY_ATTR {
    V p[kDims];
    for (V& coordinate : p) coordinate = hn::Zero(s::D());
    LoadCoordinates<kDims>(in + static_cast<ptrdiff_t>(i) * lanes * row.channels, row.channels, p);
    return PlaceOf<kDims, kPlain>(row, p);
  };
  // The next block's positions come nearer meanwhile, a few lines after every vector.
  const Ahead next = {in + static_cast<ptrdiff_t>(vectors) * lanes * a.channels,
                      std::min(ahead, vectors * lanes) * a.channels, lanes * a.channels};
  VU wrong = hn::Zero(du);
  const auto places_of = [&](const PointOctave& o, const auto& place_at)
                             HWY_ATTR { wrong = hn::Or(wrong, BlockPlaces<kDims>(o, vectors, b, place_at)); };
  const auto sum_of = [&](const PointOctave& o, bool first) HWY_ATTR {
    BlockCorners<kDims>(o, vectors, first ? next : Ahead{}, b);
    if constexpr (s::kManyRegisters) {
      BlockValues<kDims, kPlain>(a, o, first, vectors, b, out);
    } else {
      BlockPairs<kDims>(kPlain ? 0 : a.fade, vectors, b);
      BlockSums<kDims, kPlain>(a, o, first, vectors, b, out);
    }
  };
  if constexpr (kPlain) {
    if (a.channels == kDims && AreCells<kDims>(a)) {
      places_of(a.octaves[0], [in, lanes](int i) HWY_ATTR {
        V p[kDims];
        LoadCoordinates<kDims>(in + static_cast<ptrdiff_t>(i) * lanes * kDims, kDims, p);
        return PlaceOfCells<kDims>(p);
      });
    } else {
      places_of(a.octaves[0], first_place);
    }
    sum_of(a.octaves[0], true);
  } else {
    for (int i = 0; i < vectors; ++i) {
      const Place<kDims> place = first_place(i);
      for (int k = 0; k < kDims; ++k) {
        hn::Store(place.whole[k], d, b.base_whole[i][k]);
        hn::Store(place.fraction[k], d, b.base_fraction[i][k]);
      }
    }
    for (int k = 0; k < a.octave_count; ++k) {
      const PointOctave& o = a.octaves[k];
      places_of(o, [&](int i) HWY_ATTR {
        Place<kDims> place;
        for (int j = 0; j < kDims; ++j) {
          place.whole[j] = hn::Load(d, b.base_whole[i][j]);
          place.fraction[j] = hn::Load(d, b.base_fraction[i][j]);
        }
        return o.scaled ? InOctave<kDims>(o, place) : place;
      });
      sum_of(o, k == 0);
    }
  }
  return hn::AllTrue(du, hn::Eq(hn::And(wrong, hn::Set(du, 0xff800000u)), hn::Zero(du)));
}

// One vector of positions; bits above the 22nd of the result's lanes are set where cells are out of range.
template <int kDims, bool kPlain>
HWY_INLINE VU Vector(const PointRow& a, const float* in, float* out) {
  const s::D d;
  V p[kDims];
  for (V& coordinate : p) coordinate = hn::Zero(d);
  LoadCoordinates<kDims>(in, a.channels, p);
  const Place<kDims> base = PlaceOf<kDims, kPlain>(a, p);
  V sum = hn::Set(d, a.bias);
  VU wrong = hn::Zero(s::DU());
  if constexpr (kPlain) {
    const V n = NoiseOf<kDims, true>(a, a.octaves[0], base, wrong);
    sum = hn::MulAdd(n, hn::Set(d, a.octaves[0].weight), sum);
  }
  for (int k = 0; k < a.octave_count && !kPlain; ++k) {
    const PointOctave& o = a.octaves[k];
    const V n = NoiseOf<kDims, false>(a, o, o.scaled ? InOctave<kDims>(o, base) : base, wrong);
    sum = hn::MulAdd(ShapedBy(a.sum, n), hn::Set(d, o.weight), sum);
  }
  hn::StoreU(sum, d, out);
  return hn::And(wrong, hn::Set(s::DU(), 0xff800000u));
}

template <int kDims, bool kPlain>
HWY_INLINE bool Rows(const PointRow& row) {
  // Copies that no store can change: what they hold stays in registers.
  PointRow a = row;
  PointOctave first = kPlain ? row.octaves[0] : PointOctave{};
  if (kPlain) a.octaves = &first;
  const s::D d;
  const s::DU du;
  const int lanes = static_cast<int>(hn::Lanes(d));
  bool complete = true;
  const auto note = [&](VU wrong, int x, int count) HWY_ATTR {
    if (HWY_LIKELY(hn::AllTrue(du, hn::Eq(wrong, hn::Zero(du))))) return;
    HWY_ALIGN uint32_t lane[kNoisePadding];
    hn::StoreU(wrong, du, lane);
    for (int i = 0; i < count; ++i) a.wrong[x + i] = lane[i];
    complete = false;
  };
  int x = 0;
  Block<kDims> block;
  while (a.octave_count > 0) {
    const int vectors = std::min((a.count - x) / lanes, kBlockVectors), pixels = vectors * lanes;
    if (vectors < kFewVectors) break;
    const float* const in = a.in + static_cast<ptrdiff_t>(x) * a.channels;
    const bool good = BlockOf<kDims, kPlain>(a, in, vectors, a.count - x - pixels, block, a.out + x);
    // Otherwise anew, a vector at a time, which tells what is out of range.
    for (int i = 0; i < pixels && !good; i += lanes) {
      const VU wrong = Vector<kDims, kPlain>(a, in + static_cast<ptrdiff_t>(i) * a.channels, a.out + x + i);
      note(wrong, x + i, lanes);
    }
    x += pixels;
  }
  for (; x + lanes <= a.count; x += lanes) {
    note(Vector<kDims, kPlain>(a, a.in + static_cast<ptrdiff_t>(x) * a.channels, a.out + x), x, lanes);
  }
  if (x < a.count) {  // neither side is padded
    HWY_ALIGN float in[4 * kNoisePadding] = {}, out[kNoisePadding];
    for (int i = 0; i < (a.count - x) * a.channels; ++i)
      in[i] = a.in[static_cast<ptrdiff_t>(x) * a.channels + i];
    note(Vector<kDims, kPlain>(a, in, out), x, a.count - x);
    for (int i = x; i < a.count; ++i) a.out[i] = out[i - x];
  }
  return complete;
}

template <int kDims>
bool Points(const PointRow& a) {
  const bool plain =
      a.plain && a.octave_count == 1 && !a.octaves[0].scaled && a.fade == 0 && a.sum == NoiseSum::kFbm;
  return plain ? Rows<kDims, true>(a) : Rows<kDims, false>(a);
}

NoisePoints FindPoints(int dims) { return dims == 2 ? Points<2> : Points<3>; }

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(FindPoints);
static NoisePoints Choose(int dims) { return HWY_DYNAMIC_DISPATCH(FindPoints)(dims); }
}  // namespace noise

NoisePoints FindNoisePoints(int dims) { return noise::Choose(dims); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
