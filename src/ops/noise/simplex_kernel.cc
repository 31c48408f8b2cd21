// Simplex noise at any positions: on Tessera's lattice, wrapped around periods of any length, and as Open
// Shading Language has it.
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/simplex_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/doubles-inl.h"
#include "simd/lattice-inl.h"
#include "simd/osl_hash-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VI;
using s::VU;

// Hash and gradient of a simplex' corner.
struct TesseraCorner {
  template <int kDims>
  static HWY_INLINE VU Hash(const VU* corner, const NoiseBatch& b) {
    const s::DU du;
    VU h = hn::Set(du, b.seed);
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) h = hn::Xor(h, hn::Mul(corner[a], hn::Set(du, s::kAxis[a])));
    return s::LatticeMix(h);
  }
  template <int kDims>
  static HWY_INLINE void Gradient(VU h, V* g) {
    s::LatticeGradient<kDims>(h, g);
  }
};
struct OslCorner {
  template <int kDims>
  static HWY_INLINE VU Hash(const VU* corner, const NoiseBatch& b) {
    const int channel = b.shape->channel;  // the seed of colour noise
    return s::OslSimplexHash<kDims>(corner, static_cast<uint32_t>(channel < 0 ? 0 : channel));
  }
  template <int kDims>
  static HWY_INLINE void Gradient(VU h, V* g) {
    s::OslSimplexGradient<kDims>(h, g);
  }
};

// Skew F = (sqrt(D + 1) - 1) / D and its inverse G = (1 - 1 / sqrt(D + 1)) / D; a line needs neither.
constexpr float kSkew[5] = {0, 0, 0.36602540378f, 1.0f / 3, 0.30901699437f};
constexpr float kUnskew[5] = {0, 0, 0.21132486541f, 1.0f / 6, 0.13819660113f};
// Fractions of 64 bits of F.
constexpr uint64_t kLongSkew[5] = {0, 0, 0x5db3d742c265539dull, 0x5555555555555555ull, 0x4f1bbcdcbfa53e0aull};

template <int kDims, bool kSlopes>
struct Sum {
  V value;
  V slope[kSlopes ? kDims : 1];
};

// Noise at offset `x` from the simplex' first corner; hash_of(step) hashes the corner at first corner + step.
template <class Corner, int kDims, bool kSlopes, class HashOf>
HWY_INLINE Sum<kDims, kSlopes> SumOfCorners(const V* x, const HashOf& hash_of) {
  const s::D d;
  const V one = hn::Set(d, 1.0f), zero = hn::Zero(d);
  // Kernels (reach - r^2)^4 vanish at the far side of every simplex.
  const V reach = hn::Set(d, kDims == 1 ? 1.0f : 0.5f);
  // Ranks: how many coordinates each one is not below; ties go to the later axis.
  V rank[kDims];
#pragma GCC unroll 16
  for (int a = 0; a < kDims; ++a) rank[a] = zero;
#pragma GCC unroll 16
  for (int a = 0; a < kDims; ++a) {
#pragma GCC unroll 16
    for (int c = a + 1; c < kDims; ++c) {
      const auto greater = hn::Gt(x[a], x[c]);
      rank[a] = hn::Add(rank[a], hn::IfThenElseZero(greater, one));
      rank[c] = hn::Add(rank[c], hn::IfThenZeroElse(greater, one));
    }
  }
  Sum<kDims, kSlopes> sum;
  sum.value = zero;
  for (V& slope : sum.slope) slope = zero;
#pragma GCC unroll 16
  for (int k = 0; k <= kDims; ++k) {  // corner k steps along the k greatest coordinates
    const V threshold = hn::Set(d, static_cast<float>(kDims - k)),
            back = hn::Set(d, kUnskew[kDims] * static_cast<float>(k));
    V r[kDims], step[kDims], square = zero;
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      step[a] = hn::IfThenElseZero(hn::Ge(rank[a], threshold), one);
      r[a] = hn::Add(hn::Sub(x[a], step[a]), back);
      square = hn::MulAdd(r[a], r[a], square);
    }
    V g[kDims];
    Corner::template Gradient<kDims>(hash_of(step), g);
    V dot = hn::Mul(g[0], r[0]);
#pragma GCC unroll 16
    for (int a = 1; a < kDims; ++a) dot = hn::MulAdd(g[a], r[a], dot);
    const V t = hn::Max(hn::Sub(reach, square), zero), t2 = hn::Mul(t, t), t4 = hn::Mul(t2, t2);
    sum.value = hn::MulAdd(t4, dot, sum.value);
    if constexpr (kSlopes) {
      const V factor = hn::Mul(hn::Mul(hn::Set(d, -8.0f), hn::Mul(t2, t)), dot);
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a)
        sum.slope[a] = hn::MulAdd(factor, r[a], hn::MulAdd(t4, g[a], sum.slope[a]));
    }
  }
  return sum;
}

// Adding 0 turns -0 into 0.
HWY_INLINE void StoreScaled(V v, float scale, float* to) {
  const s::D d;
  hn::StoreU(hn::MulAdd(v, hn::Set(d, scale), hn::Zero(d)), d, to);
}

// The upper 32 bits of a 64-bit product.
HWY_INLINE VU MulUpper(VU a, VU b) {
  const s::DU du;
  const auto even = hn::BitCast(du, hn::MulEven(a, b));
  const auto odd = hn::BitCast(du, hn::MulEven(hn::DupOdd(a), hn::DupOdd(b)));
  return hn::OddEven(odd, hn::DupOdd(even));
}
// All ones where a > b.
HWY_INLINE VU Greater(VU a, VU b) {
  const s::DI di;
  const VU top = hn::Set(s::DU(), 0x80000000u);
  const auto greater = hn::Gt(hn::BitCast(di, hn::Xor(a, top)), hn::BitCast(di, hn::Xor(b, top)));
  return hn::BitCast(s::DU(), hn::VecFromMask(di, greater));
}

// The skew of whole coordinates: their sum, a signed number modulo 2^32, times F, as whole part and fraction.
template <int kDims>
HWY_INLINE V SkewOfCells(VU cell_sum, VU* whole_part) {
  const s::DU du;
  const s::DI di;
  // With F in 0.64 fixed point the bits below the point are low(sum * F_high) plus the upper half of
  // sum * F_low.
  const VU f_high = hn::Set(du, static_cast<uint32_t>(kLongSkew[kDims] >> 32));
  const VU f_low = hn::Set(du, static_cast<uint32_t>(kLongSkew[kDims]));
  const VU part = MulUpper(cell_sum, f_low), low = hn::Mul(cell_sum, f_high), fixed = hn::Add(low, part);
  const VU whole = hn::Sub(MulUpper(cell_sum, f_high), Greater(low, fixed));
  // Negative sums: subtract F * 2^32, whose fraction is F_low.
  const VU fixed_n = hn::Sub(fixed, f_low);
  const VU whole_n = hn::Add(hn::Sub(whole, f_high), Greater(fixed_n, fixed));
  const auto negative = hn::RebindMask(du, hn::Gt(hn::Zero(di), hn::BitCast(di, cell_sum)));
  *whole_part = hn::IfThenElse(negative, whole_n, whole);
  return s::Unit(hn::IfThenElse(negative, fixed_n, fixed));
}

template <class Corner, int kDims, bool kSlopes>
void Endless(const NoiseBatch& b) {
  const s::D d;
  const s::DU du;
  const s::DI di;
  constexpr float kShrink = 1 / (1 + kDims * kSkew[kDims]);
  for (int i = 0; i < b.count; i += static_cast<int>(hn::Lanes(d))) {
    V x[kDims], fraction_sum = hn::Zero(d);
    VU corner[kDims], cell_sum = hn::Zero(du);
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      x[a] = hn::LoadU(d, b.fraction[a] + i);
      corner[a] = hn::LoadU(du, b.cell[a] + i);
      cell_sum = hn::Add(cell_sum, corner[a]);
      fraction_sum = hn::Add(fraction_sum, x[a]);
    }
    if constexpr (kDims > 1) {
      // The simplex' first corner: cell + whole + floor(f + skew), and the offset from it in unskewed space.
      VU whole;
      const V of_cells = SkewOfCells<kDims>(cell_sum, &whole);
      const V skew = hn::MulAdd(fraction_sum, hn::Set(d, kSkew[kDims]), of_cells);
      V floors[kDims], floor_sum = hn::Zero(d);
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a) {
        floors[a] = hn::Floor(hn::Add(x[a], skew));
        floor_sum = hn::Add(floor_sum, floors[a]);
        corner[a] = hn::Add(hn::Add(corner[a], whole), hn::BitCast(du, hn::ConvertTo(di, floors[a])));
      }
      const V unskew = hn::MulAdd(skew, hn::Set(d, kShrink),
                                  hn::Mul(hn::Sub(floor_sum, fraction_sum), hn::Set(d, kUnskew[kDims])));
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a) x[a] = hn::Add(hn::Sub(x[a], floors[a]), unskew);
    }
    const auto hash_of = [&](const V* step) HWY_ATTR {
      VU c[kDims];
      for (int a = 0; a < kDims; ++a) c[a] = hn::Add(corner[a], hn::BitCast(du, hn::ConvertTo(di, step[a])));
      return Corner::template Hash<kDims>(c, b);
    };
    const auto sum = SumOfCorners<Corner, kDims, kSlopes>(x, hash_of);
    StoreScaled(sum.value, b.shape->scale, b.value + i);
    for (int a = 0; a < kDims && kSlopes; ++a) StoreScaled(sum.slope[a], b.shape->scale, b.slope[a] + i);
  }
}

// Around periods: positions are sheared onto a lattice of whole coordinates by a triangular matrix whose
// products with the periods are whole (SimplexShear), so that corners are brought into the period axis by
// axis.
template <int kDims, bool kSlopes>
void Periodic(const NoiseBatch& b) {
  const s::D d;
  const s::DU du;
  const s::DI di;
  const SimplexShear shear(kDims, b.period);
  for (int i = 0; i < b.count; i += static_cast<int>(hn::Lanes(d))) {
    V x[kDims], corner[kDims], sum_of_x = hn::Zero(d);
    V cells[kDims], fractions[kDims];
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      // Axes without a period repeat with the longest one there is, a power of two.
      const VU cell = hn::And(hn::LoadU(du, b.cell[a] + i), hn::Set(du, kLongestSimplexPeriod - 1));
      cells[a] = hn::ConvertTo(d, hn::BitCast(di, b.period[a] == 0 ? cell : hn::LoadU(du, b.cell[a] + i)));
      fractions[a] = hn::LoadU(d, b.fraction[a] + i);
    }
#pragma GCC unroll 16
    for (int row = 0; row < kDims; ++row) {
      s::VD whole[s::kParts], rest[s::kParts];
      s::EachPart([&]<int kPart>() HWY_ATTR {
        s::VD q = hn::Zero(s::DD());
        for (int a = row; a < kDims; ++a) {
          const s::VD p = hn::Add(s::Part<kPart>(cells[a]), s::Part<kPart>(fractions[a]));
          q = hn::MulAdd(s::SetD(shear.factor[row][a]), p, q);
        }
        whole[kPart] = hn::Floor(q);
        rest[kPart] = hn::Sub(q, whole[kPart]);
      });
      corner[row] = s::Join(whole);
      x[row] = s::Join(rest);
      sum_of_x = hn::Add(sum_of_x, x[row]);
    }
    const V unskew = hn::Mul(sum_of_x, hn::Set(d, kUnskew[kDims]));
    for (int a = 0; a < kDims; ++a) x[a] = hn::Sub(x[a], unskew);
    const auto hash_of = [&](const V* step) HWY_ATTR {
      V c[kDims];
      for (int a = 0; a < kDims; ++a) c[a] = hn::Add(corner[a], step[a]);
      VU hashed[kDims];
      for (int a = kDims - 1; a >= 0; --a) {  // whole numbers below 2^23: floats hold them exactly
        const V turns = hn::Floor(hn::Div(c[a], hn::Set(d, shear.steps[a][a])));
        for (int row = 0; row <= a; ++row)
          c[row] = hn::NegMulAdd(turns, hn::Set(d, shear.steps[row][a]), c[row]);
        hashed[a] = hn::BitCast(du, hn::ConvertTo(di, c[a]));
      }
      return TesseraCorner::Hash<kDims>(hashed, b);
    };
    const auto sum = SumOfCorners<TesseraCorner, kDims, kSlopes>(x, hash_of);
    StoreScaled(sum.value, b.shape->scale, b.value + i);
    if constexpr (kSlopes) {  // back through the unskewing and the shear
      V total = hn::Zero(d);
      for (int a = 0; a < kDims; ++a) total = hn::Add(total, sum.slope[a]);
      const V common = hn::Mul(total, hn::Set(d, kUnskew[kDims]));
      for (int a = 0; a < kDims; ++a) {
        V slope = hn::Zero(d);
        for (int row = 0; row <= a; ++row) {
          slope = hn::MulAdd(hn::Set(d, static_cast<float>(shear.factor[row][a])),
                             hn::Sub(sum.slope[row], common), slope);
        }
        StoreScaled(slope, b.shape->scale, b.slope[a] + i);
      }
    }
  }
}

template <int kDims, bool kSlopes>
void OnTessera(const NoiseBatch& b) {
  uint32_t any = 0;
  for (int a = 0; a < kDims; ++a) any |= b.period[a];
  if (any != 0) {
    Periodic<kDims, kSlopes>(b);
  } else {
    Endless<TesseraCorner, kDims, kSlopes>(b);
  }
}

template <int kDims>
NoiseEvaluate Find(bool osl, bool slopes) {
  if (osl) return slopes ? Endless<OslCorner, kDims, true> : Endless<OslCorner, kDims, false>;
  return slopes ? OnTessera<kDims, true> : OnTessera<kDims, false>;
}

NoiseEvaluate FindSimplexNoise(bool osl, int dims, bool slopes) {
  switch (dims) {
    case 1:
      return Find<1>(osl, slopes);
    case 2:
      return Find<2>(osl, slopes);
    case 3:
      return Find<3>(osl, slopes);
    default:
      return Find<4>(osl, slopes);
  }
}

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(FindSimplexNoise);
static NoiseEvaluate Choose(bool osl, int dims, bool slopes) {
  return HWY_DYNAMIC_DISPATCH(FindSimplexNoise)(osl, dims, slopes);
}
}  // namespace noise

NoiseEvaluate FindSimplex(NoiseLattice lattice, int dims, bool slopes) {
  return noise::Choose(lattice == NoiseLattice::kOsl, dims, slopes);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
