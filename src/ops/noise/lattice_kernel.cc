// Lattice noise at any positions: white, hash, value and gradient noise on Tessera's and OSL's lattices.
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/lattice_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/lattice-inl.h"
#include "simd/osl_hash-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VU;

// The next lattice coordinate along an axis.
HWY_INLINE VU Next(VU cell, uint32_t period) {
  const s::DU du;
  const VU next = hn::Add(cell, hn::Set(du, 1u));
  if (period == 0) return next;
  return hn::IfThenZeroElse(hn::Eq(next, hn::Set(du, period)), next);
}

// Where random numbers come from: Axis() prepares a coordinate, Hash() joins them, Gradient(), or a gradient
// times the offset from its point, Projection(), makes noise.
struct TesseraLattice {
  static HWY_INLINE VU Axis(int axis, VU cell) { return hn::Mul(cell, hn::Set(s::DU(), s::kAxis[axis])); }
  template <int kDims>
  static HWY_INLINE VU Hash(const VU* axis, const NoiseBatch& b) {
    VU h = hn::Xor(axis[0], hn::Set(s::DU(), b.seed));
#pragma GCC unroll 16
    for (int a = 1; a < kDims; ++a) h = hn::Xor(h, axis[a]);
    return s::LatticeMix(h);
  }
  template <int kDims>
  static HWY_INLINE void Gradient(VU h, V* g) {
    s::LatticeGradient<kDims>(h, g);
  }
  template <int kDims>
  static HWY_INLINE V Projection(VU h, const V* from) {
    return s::LatticeProjection<kDims>(h, from);
  }
  static HWY_INLINE V White(VU h) { return s::SignedUnit(h); }
};
struct OslLattice {
  static HWY_INLINE VU Axis(int, VU cell) { return cell; }
  template <int kDims>
  static HWY_INLINE VU Hash(const VU* axis, const NoiseBatch& b) {
    VU h = s::OslHash<kDims>(axis);
    // Colour noise takes a byte of the hash for each channel.
    const int channel = b.shape->channel;
    if (channel > 0 && channel % 4 == 1) h = hn::ShiftRight<8>(h);
    if (channel > 0 && channel % 4 == 2) h = hn::ShiftRight<16>(h);
    if (channel > 0 && channel % 4 == 3) h = hn::ShiftRight<24>(h);
    return h;
  }
  template <int kDims>
  static HWY_INLINE void Gradient(VU h, V* g) {
    s::OslGradient<kDims>(h, g);
  }
  template <int kDims>
  static HWY_INLINE V Projection(VU h, const V* from) {
    V g[kDims];
    Gradient<kDims>(h, g);
    return s::Projection<kDims>(g, from);
  }
};

// A value and its derivatives.
template <int kDims, bool kSlopes>
struct Jet {
  V value;
  V slope[kSlopes ? kDims : 1];
};

// Interpolates 2^kDims corners axis by axis; corner c's bit a says which side of axis a it is on.
template <int kDims, bool kSlopes>
HWY_INLINE Jet<kDims, kSlopes> Interpolate(Jet<kDims, kSlopes>* corner, const V* fade, const V* fade_slope) {
#pragma GCC unroll 16
  for (int a = 0; a < kDims; ++a) {
    const int half = 1 << (kDims - 1 - a);
#pragma GCC unroll 16
    for (int i = 0; i < half; ++i) {
      const Jet<kDims, kSlopes> low = corner[2 * i], high = corner[2 * i + 1];
      const V difference = hn::Sub(high.value, low.value);
      corner[i].value = hn::MulAdd(fade[a], difference, low.value);
      if constexpr (kSlopes) {
#pragma GCC unroll 16
        for (int k = 0; k < kDims; ++k) {
          corner[i].slope[k] = hn::MulAdd(fade[a], hn::Sub(high.slope[k], low.slope[k]), low.slope[k]);
        }
        corner[i].slope[a] = hn::MulAdd(fade_slope[a], difference, corner[i].slope[a]);
      }
    }
  }
  return corner[0];
}

template <int kDims, bool kSlopes, bool kGradient, class Lattice>
void Interpolated(const NoiseBatch& b) {
  const s::D d;
  const s::DU du;
  const V scale = hn::Set(d, b.shape->scale), one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  for (int i = 0; i < b.count; i += static_cast<int>(hn::Lanes(d))) {
    V f[kDims], fade[kDims], fade_slope[kDims];
    VU side[kDims][2];
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      f[a] = hn::LoadU(d, b.fraction[a] + i);
      const VU cell = hn::LoadU(du, b.cell[a] + i);
      side[a][0] = Lattice::Axis(a, cell);
      side[a][1] = Lattice::Axis(a, Next(cell, b.period[a]));
      fade[a] = s::FadeWeight(f[a], b.shape->fade);
      if (kSlopes) fade_slope[a] = s::FadeSlope(f[a], b.shape->fade);
    }
    Jet<kDims, kSlopes> corner[1 << kDims];
#pragma GCC unroll 16
    for (int c = 0; c < 1 << kDims; ++c) {
      VU axis[kDims];
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a) axis[a] = side[a][c >> a & 1];
      const VU h = Lattice::template Hash<kDims>(axis, b);
      if constexpr (kGradient) {
        V from[kDims];
#pragma GCC unroll 16
        for (int a = 0; a < kDims; ++a) from[a] = (c >> a & 1) ? hn::Sub(f[a], one) : f[a];
        if constexpr (kSlopes) {
          Lattice::template Gradient<kDims>(h, corner[c].slope);
          corner[c].value = s::Projection<kDims>(corner[c].slope, from);
        } else {
          corner[c].value = Lattice::template Projection<kDims>(h, from);
        }
      } else {
        corner[c].value = s::SignedUnit(h);
        if constexpr (kSlopes) {
          for (int a = 0; a < kDims; ++a) corner[c].slope[a] = zero;
        }
      }
    }
    const Jet<kDims, kSlopes> n = Interpolate<kDims, kSlopes>(corner, fade, fade_slope);
    // Adding 0 turns -0 into 0, so that the order of signs does not show.
    hn::StoreU(hn::MulAdd(n.value, scale, zero), d, b.value + i);
    if constexpr (kSlopes) {
      for (int a = 0; a < kDims; ++a) hn::StoreU(hn::MulAdd(n.slope[a], scale, zero), d, b.slope[a] + i);
    }
  }
}

template <int kDims, bool kOsl>
void White(const NoiseBatch& b) {
  const s::D d;
  const s::DU du;
  for (int i = 0; i < b.count; i += static_cast<int>(hn::Lanes(d))) {
    VU axis[kDims];
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) axis[a] = hn::LoadU(du, b.cell[a] + i);
    if constexpr (kOsl) {
      const V unit = s::OslUnit(b.shape->channel < 0
                                    ? s::OslHash<kDims>(axis)
                                    : s::OslHashWith<kDims>(axis, static_cast<uint32_t>(b.shape->channel)));
      hn::StoreU(hn::MulSub(hn::Set(d, 2.0f), unit, hn::Set(d, 1.0f)), d, b.value + i);
    } else {
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a) axis[a] = TesseraLattice::Axis(a, axis[a]);
      const VU h = s::LatticeNext(TesseraLattice::Hash<kDims>(axis, b), 1);
      hn::StoreU(s::SignedUnit(h), d, b.value + i);
    }
    for (int a = 0; a < kDims && b.slope[a] != nullptr; ++a) hn::StoreU(hn::Zero(d), d, b.slope[a] + i);
  }
}

// The hash of positions: words are the bits of coordinates as floats.
template <int kDims, bool kOsl>
void Positions(const NoiseBatch& b) {
  const s::D d;
  const s::DU du;
  const s::DI di;
  for (int i = 0; i < b.count; i += static_cast<int>(hn::Lanes(d))) {
    VU words[kDims];
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      const V cell = hn::ConvertTo(d, hn::BitCast(di, hn::LoadU(du, b.cell[a] + i)));
      words[a] = hn::BitCast(du, hn::Add(cell, hn::LoadU(d, b.fraction[a] + i)));
    }
    const int channel = b.shape->channel;
    V value;
    if constexpr (kOsl) {
      value = s::OslUnit(channel < 0 ? s::OslHash<kDims>(words)
                                     : s::OslHashWith<kDims>(words, static_cast<uint32_t>(channel)));
      value = hn::MulSub(hn::Set(d, 2.0f), value, hn::Set(d, 1.0f));
    } else {
      value = s::SignedUnit(s::OslHashWith<kDims>(words, b.seed));
    }
    hn::StoreU(value, d, b.value + i);
    for (int a = 0; a < kDims && b.slope[a] != nullptr; ++a) hn::StoreU(hn::Zero(d), d, b.slope[a] + i);
  }
}

template <int kDims>
NoiseEvaluate Find(NoiseKind kind, NoiseLattice lattice, bool slopes) {
  const bool osl = lattice == NoiseLattice::kOsl;
  if (kind == NoiseKind::kHash) return osl ? Positions<kDims, true> : Positions<kDims, false>;
  if (kind == NoiseKind::kWhite) return osl ? White<kDims, true> : White<kDims, false>;
  if (kind == NoiseKind::kValue) {
    return slopes ? Interpolated<kDims, true, false, TesseraLattice>
                  : Interpolated<kDims, false, false, TesseraLattice>;
  }
  if (osl)
    return slopes ? Interpolated<kDims, true, true, OslLattice>
                  : Interpolated<kDims, false, true, OslLattice>;
  return slopes ? Interpolated<kDims, true, true, TesseraLattice>
                : Interpolated<kDims, false, true, TesseraLattice>;
}

NoiseEvaluate FindLatticeNoise(NoiseKind kind, NoiseLattice lattice, int dims, bool slopes) {
  switch (dims) {
    case 1:
      return Find<1>(kind, lattice, slopes);
    case 2:
      return Find<2>(kind, lattice, slopes);
    case 3:
      return Find<3>(kind, lattice, slopes);
    default:
      return Find<4>(kind, lattice, slopes);
  }
}

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(FindLatticeNoise);
static NoiseEvaluate Choose(NoiseKind kind, NoiseLattice lattice, int dims, bool slopes) {
  return HWY_DYNAMIC_DISPATCH(FindLatticeNoise)(kind, lattice, dims, slopes);
}
}  // namespace noise

NoiseEvaluate FindLattice(NoiseKind kind, NoiseLattice lattice, int dims, bool slopes) {
  return noise::Choose(kind, lattice, dims, slopes);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
