// Gradient noise on Tessera's lattice straight from rows of positions: nothing but the result leaves
// registers.
//
// Per corner: the axes' products are shared by the corners, one exclusive or of three and the mix make the
// hash, its upper bits choose a gradient, and the offset is projected on it.
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/point_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/noise/shaped-inl.h"
#include "simd/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VU;

// A position in cells.
template <int kDims>
struct Place {
  V whole[kDims], fraction[kDims];
};

template <int kDims>
HWY_INLINE void LoadCoordinates(const float* in, int channels, V* p) {
  const s::D d;
  V rest;
  if (channels == 3) {
    if constexpr (kDims == 3) {
      hn::LoadInterleaved3(d, in, p[0], p[1], p[2]);
    } else {
      hn::LoadInterleaved3(d, in, p[0], p[1], rest);
    }
  } else if (channels == 4) {
    V third;
    hn::LoadInterleaved4(d, in, p[0], p[1], third, rest);
    if constexpr (kDims == 3) p[2] = third;
  } else if constexpr (kDims == 2) {
    hn::LoadInterleaved2(d, in, p[0], p[1]);
  }
}

// Quintic noise of one octave at positions that are cells already is what most rows are: kPlain.
template <int kDims, bool kPlain>
HWY_INLINE Place<kDims> PlaceOf(const PointRow& a, const V* p) {
  const s::D d;
  Place<kDims> place;
#pragma GCC unroll 16
  for (int k = 0; k < kDims; ++k) {
    const V frequency = hn::Set(d, a.frequency[k][0]);
    place.whole[k] = hn::Floor(hn::Mul(p[k], frequency));
    place.fraction[k] = hn::MulSub(p[k], frequency, place.whole[k]);
    if (kPlain) continue;
    const V rest =
        hn::Add(hn::MulAdd(p[k], hn::Set(d, a.frequency[k][1]), place.fraction[k]), hn::Set(d, a.offset[k]));
    const V carry = hn::Floor(rest);
    place.whole[k] = hn::Add(place.whole[k], carry);
    place.fraction[k] = hn::Sub(rest, carry);
  }
  return place;
}
template <int kDims>
HWY_INLINE Place<kDims> InOctave(const PointOctave& o, const Place<kDims>& base) {
  const s::D d;
  const V s0 = hn::Set(d, o.scale[0]), s1 = hn::Set(d, o.scale[1]);
  Place<kDims> place;
#pragma GCC unroll 16
  for (int k = 0; k < kDims; ++k) {
    const V whole = hn::Floor(hn::Mul(base.whole[k], s0));
    V rest = hn::MulAdd(base.whole[k], s1, hn::MulSub(base.whole[k], s0, whole));
    rest = hn::Add(hn::MulAdd(base.fraction[k], s0, rest), hn::Set(d, o.shift[k]));
    const V carry = hn::Floor(rest);
    place.whole[k] = hn::Add(whole, carry);
    place.fraction[k] = hn::Sub(rest, carry);
  }
  return place;
}

// Whole numbers are made integers by adding 1.5 * 2^23: their bits are kIntegerBits + the number, as long as
// it is within 2^22.
constexpr uint32_t kIntegerBits = 0x4b400000u;

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
    VU h = side[0][c & 1];
    V from[kDims];
    from[0] = offset[0][c & 1];
#pragma GCC unroll 16
    for (int k = 1; k < kDims; ++k) h = hn::Xor(h, side[k][c >> k & 1]), from[k] = offset[k][c >> k & 1];
    corner[c] = s::LatticeProjection<kDims>(s::LatticeMix(h), from);
  }
#pragma GCC unroll 16
  for (int k = 0; k < kDims; ++k) {
#pragma GCC unroll 16
    for (int i = 0; i < 1 << (kDims - 1 - k); ++i) {
      corner[i] = hn::MulAdd(fade[k], hn::Sub(corner[2 * i + 1], corner[2 * i]), corner[2 * i]);
    }
  }
  return hn::MulAdd(corner[0], hn::Set(d, a.scale), hn::Zero(d));
}

HWY_INLINE V ShapedBy(NoiseSum sum, V n) {
  if (sum == NoiseSum::kFbm) return n;
  if (sum == NoiseSum::kTurbulence) return Shaped<NoiseSum::kTurbulence>(n);
  if (sum == NoiseSum::kBillow) return Shaped<NoiseSum::kBillow>(n);
  return Shaped<NoiseSum::kRidged>(n);
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
static NoisePoints Best(int dims) { return HWY_DYNAMIC_DISPATCH(FindPoints)(dims); }
}  // namespace noise

NoisePoints FindNoisePoints(int dims) { return noise::Best(dims); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
