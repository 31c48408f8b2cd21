// Noise from points in cells: cell noise (Worley), sparse convolution (Lewis), spot noise (van Wijk); and
// simplex noise.
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/feature_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VU;

// A cell's neighbour at -1, 0 or 1 along an axis, hashed.
HWY_INLINE VU Neighbour(VU cell, int step, uint32_t period, int axis) {
  const s::DU du;
  VU c = hn::Add(cell, hn::Set(du, static_cast<uint32_t>(step)));
  if (period != 0 && step < 0) c = hn::IfThenElse(hn::Eq(cell, hn::Zero(du)), hn::Set(du, period - 1), c);
  if (period != 0 && step > 0) c = hn::IfThenZeroElse(hn::Eq(c, hn::Set(du, period)), c);
  return hn::Mul(c, hn::Set(du, s::kAxis[axis]));
}

constexpr int Power3(int n) { return n == 0 ? 1 : 3 * Power3(n - 1); }

// Calls visit(hash, offset) for each of the 3^kDims cells around a position; offset: the cell's corner from
// the position.
template <int kDims, class Visit>
HWY_INLINE void ForNeighbours(const NoiseBatch& b, int i, const Visit& visit) {
  const s::D d;
  const s::DU du;
  VU side[kDims][3];
  V corner[kDims][3];
#pragma GCC unroll 16
  for (int a = 0; a < kDims; ++a) {
    const VU cell = hn::LoadU(du, b.cell[a] + i);
    const V f = hn::LoadU(d, b.fraction[a] + i);
    for (int k = 0; k < 3; ++k) {
      side[a][k] = Neighbour(cell, k - 1, b.period[a], a);
      corner[a][k] = hn::Sub(hn::Set(d, static_cast<float>(k - 1)), f);
    }
  }
  for (int n = 0; n < Power3(kDims); ++n) {
    VU h = hn::Set(du, b.seed);
    V offset[kDims];
    for (int a = 0, rest = n; a < kDims; ++a, rest /= 3) {
      h = hn::Xor(h, side[a][rest % 3]);
      offset[a] = corner[a][rest % 3];
    }
    visit(s::LatticeMix(h), offset);
  }
}

template <int kDims, bool kSlopes>
void Cells(const NoiseBatch& b) {
  const s::D d;
  const V jitter = hn::Set(d, b.shape->jitter), centre = hn::Set(d, 0.5f * (1 - b.shape->jitter));
  for (int i = 0; i < b.count; i += static_cast<int>(hn::Lanes(d))) {
    V first = hn::Set(d, 1e30f), second = first;
    V near1[kDims], near2[kDims];  // offsets of the nearest two
    for (int a = 0; a < kDims; ++a) near1[a] = near2[a] = hn::Zero(d);
    ForNeighbours<kDims>(b, i, [&](VU h, const V* offset) HWY_ATTR {
      V r[kDims], square = hn::Zero(d);
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a) {
        r[a] = hn::Add(offset[a], hn::MulAdd(s::Unit(s::LatticeNext(h, a + 1)), jitter, centre));
        square = hn::MulAdd(r[a], r[a], square);
      }
      if constexpr (kSlopes) {
        const auto nearest = hn::Lt(square, first), near = hn::Lt(square, second);
#pragma GCC unroll 16
        for (int a = 0; a < kDims; ++a) {
          near2[a] = hn::IfThenElse(nearest, near1[a], hn::IfThenElse(near, r[a], near2[a]));
          near1[a] = hn::IfThenElse(nearest, r[a], near1[a]);
        }
      }
      second = hn::Min(second, hn::Max(first, square));
      first = hn::Min(first, square);
    });
    const V f1 = hn::Sqrt(first), f2 = hn::Sqrt(second);
    const CellDistance which = b.shape->distance;
    const V value = which == CellDistance::kF1 ? f1 : which == CellDistance::kF2 ? f2 : hn::Sub(f2, f1);
    hn::StoreU(value, d, b.value + i);
    if constexpr (kSlopes) {
      const V tiny = hn::Set(d, 1e-20f);
      const V i1 = hn::Div(hn::Set(d, 1.0f), hn::Max(f1, tiny)),
              i2 = hn::Div(hn::Set(d, 1.0f), hn::Max(f2, tiny));
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a) {
        const V s1 = hn::Mul(near1[a], i1), s2 = hn::Mul(near2[a], i2);  // minus the slopes
        const V slope = which == CellDistance::kF1   ? hn::Neg(s1)
                        : which == CellDistance::kF2 ? hn::Neg(s2)
                                                     : hn::Sub(s1, s2);
        hn::StoreU(slope, d, b.slope[a] + i);
      }
    }
  }
}

// Impulses: kernel (1 - r^2)^3 and heights uniform in [-1,1] for sparse convolution; (1 - |M r|^2)^2 and +-1
// for spots.
template <int kDims, bool kSpot, bool kSlopes>
void Impulses(const NoiseBatch& b) {
  const s::D d;
  const s::DU du;
  const s::DI di;
  const V one = hn::Set(d, 1.0f), zero = hn::Zero(d), scale = hn::Set(d, b.shape->scale);
  const NoiseShape& shape = *b.shape;
  for (int i = 0; i < b.count; i += static_cast<int>(hn::Lanes(d))) {
    V sum = zero, slope[kDims];
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) slope[a] = zero;
    ForNeighbours<kDims>(b, i, [&](VU h, const V* offset) HWY_ATTR {
      // Biased by 2^31, unsigned order is signed order.
      const VU top = hn::Set(du, 0x80000000u);
      const auto number = hn::BitCast(di, hn::Xor(s::LatticeNext(h, 1), top));
      VU state = h;
      for (int m = 0; m < kMaxImpulses; ++m) {
        const auto none = hn::Gt(hn::BitCast(di, hn::Xor(hn::Set(du, shape.poisson[m]), top)), number);
        const auto present = hn::Not(hn::RebindMask(d, none));
        if (hn::AllFalse(d, present)) break;
        V r[kDims];
#pragma GCC unroll 16
        for (int a = 0; a < kDims; ++a) {
          state = s::LatticeNext(state, a + 2);
          r[a] = hn::Add(offset[a], s::Unit(state));
        }
        state = s::LatticeNext(state, kDims + 2);
        V height = kSpot ? s::SignOfBit<31>(state) : s::SignedUnit(state);
        V mr[kDims];  // M r; the norm's gradient is 2 M^T M r
#pragma GCC unroll 16
        for (int a = 0; a < kDims; ++a) mr[a] = r[a];
        if constexpr (kSpot && kDims >= 2) {
          const V xx = hn::Set(d, shape.spot[0]), xy = hn::Set(d, shape.spot[1]),
                  yy = hn::Set(d, shape.spot[2]);
          mr[0] = hn::MulAdd(xx, r[0], hn::Mul(xy, r[1]));
          mr[1] = hn::MulAdd(xy, r[0], hn::Mul(yy, r[1]));
        }
        V square = hn::Mul(mr[0], mr[0]);
#pragma GCC unroll 16
        for (int a = 1; a < kDims; ++a) square = hn::MulAdd(mr[a], mr[a], square);
        height = hn::IfThenElseZero(present, height);
        const V k = hn::Max(hn::Sub(one, square), zero), k2 = hn::Mul(k, k);
        sum = hn::MulAdd(height, kSpot ? k2 : hn::Mul(k2, k), sum);
        if constexpr (kSlopes) {  // r decreases with the position: d(-square) = +2 M^T M r
          const V factor =
              hn::Mul(height, kSpot ? hn::Mul(hn::Set(d, 4.0f), k) : hn::Mul(hn::Set(d, 6.0f), k2));
          V mm[kDims];
          for (int a = 0; a < kDims; ++a) mm[a] = mr[a];
          if constexpr (kSpot && kDims >= 2) {
            const V xx = hn::Set(d, shape.spot[0]), xy = hn::Set(d, shape.spot[1]),
                    yy = hn::Set(d, shape.spot[2]);
            mm[0] = hn::MulAdd(xx, mr[0], hn::Mul(xy, mr[1]));
            mm[1] = hn::MulAdd(xy, mr[0], hn::Mul(yy, mr[1]));
          }
#pragma GCC unroll 16
          for (int a = 0; a < kDims; ++a) slope[a] = hn::MulAdd(factor, mm[a], slope[a]);
        }
      }
    });
    hn::StoreU(hn::MulAdd(sum, scale, zero), d, b.value + i);
    if constexpr (kSlopes) {
      for (int a = 0; a < kDims; ++a) hn::StoreU(hn::MulAdd(slope[a], scale, zero), d, b.slope[a] + i);
    }
  }
}

// The upper 32 bits of a 64-bit product.
HWY_INLINE VU MulUpper(VU a, VU b) {
  const s::DU du;
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(du, static_cast<uint32_t>((uint64_t{hn::GetLane(a)} * hn::GetLane(b)) >> 32));
#else
  const auto even = hn::BitCast(du, hn::MulEven(a, b));
  const auto odd = hn::BitCast(du, hn::MulEven(hn::DupOdd(a), hn::DupOdd(b)));
  return hn::OddEven(odd, hn::DupOdd(even));
#endif
}

// The skew F = (sqrt(D + 1) - 1) / D as a fixed-point number of 64 bits below the point.
constexpr uint64_t kSkew[5] = {0, 0, 0x5db3d742c265539dull, 0x5555555555555555ull, 0x4f1bbcdcbfa53e0aull};

template <int kDims, bool kSlopes>
void Simplex(const NoiseBatch& b) {
  const s::D d;
  const s::DU du;
  const s::DI di;
  constexpr float kF = kDims == 2 ? 0.36602540378f : kDims == 3 ? 1.0f / 3 : 0.30901699437f;
  constexpr float kG = kDims == 2 ? 0.21132486541f : kDims == 3 ? 1.0f / 6 : 0.13819660113f;
  constexpr float kShrink = 1 / (1 + kDims * kF);
  const V one = hn::Set(d, 1.0f), zero = hn::Zero(d), scale = hn::Set(d, b.shape->scale);
  for (int i = 0; i < b.count; i += static_cast<int>(hn::Lanes(d))) {
    V f[kDims], fraction_sum = zero;
    VU cell[kDims], cell_sum = hn::Zero(du);
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      f[a] = hn::LoadU(d, b.fraction[a] + i);
      cell[a] = hn::LoadU(du, b.cell[a] + i);
      cell_sum = hn::Add(cell_sum, cell[a]);
      fraction_sum = hn::Add(fraction_sum, f[a]);
    }
    // The sum of cells is a signed number, modulo 2^32: its skew is the product with F, whole part and
    // fraction. cell_sum * F with F in 0.64 fixed point: the bits below the point are low(cell_sum * F_high)
    // plus the upper half of cell_sum * F_low.
    const VU f_high = hn::Set(du, static_cast<uint32_t>(kSkew[kDims] >> 32));
    const VU f_low = hn::Set(du, static_cast<uint32_t>(kSkew[kDims]));
    const VU part = MulUpper(cell_sum, f_low), low = hn::Mul(cell_sum, f_high);
    const VU fixed = hn::Add(low, part);
    const VU carry = hn::BitCast(
        du, hn::VecFromMask(di, hn::Gt(hn::BitCast(di, hn::Xor(low, hn::Set(du, 0x80000000u))),
                                       hn::BitCast(di, hn::Xor(fixed, hn::Set(du, 0x80000000u))))));
    VU whole = hn::Sub(MulUpper(cell_sum, f_high), carry);
    // Negative sums: subtract F * 2^32, whose fraction is F_low.
    const auto negative = hn::Gt(hn::Zero(di), hn::BitCast(di, cell_sum));
    const VU fixed_n = hn::Sub(fixed, f_low);
    const VU borrow = hn::BitCast(
        du, hn::VecFromMask(di, hn::Gt(hn::BitCast(di, hn::Xor(fixed_n, hn::Set(du, 0x80000000u))),
                                       hn::BitCast(di, hn::Xor(fixed, hn::Set(du, 0x80000000u))))));
    const VU whole_n = hn::Add(hn::Sub(whole, f_high), borrow);
    const auto negative_u = hn::RebindMask(du, negative);
    whole = hn::IfThenElse(negative_u, whole_n, whole);
    const V skew =
        hn::MulAdd(fraction_sum, hn::Set(d, kF), s::Unit(hn::IfThenElse(negative_u, fixed_n, fixed)));

    // The simplex' first corner: cell + whole + floor(f + skew), and the offset from it in unskewed space.
    V x[kDims], floor_sum = zero;
    VU corner[kDims];
    V skewed_floor[kDims];
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      skewed_floor[a] = hn::Floor(hn::Add(f[a], skew));
      floor_sum = hn::Add(floor_sum, skewed_floor[a]);
      corner[a] = hn::Add(hn::Add(cell[a], whole), hn::BitCast(du, hn::ConvertTo(di, skewed_floor[a])));
    }
    const V unskew =
        hn::MulAdd(skew, hn::Set(d, kShrink), hn::Mul(hn::Sub(floor_sum, fraction_sum), hn::Set(d, kG)));
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) x[a] = hn::Add(hn::Sub(f[a], skewed_floor[a]), unskew);
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
    V sum = zero, slope[kDims];
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) slope[a] = zero;
#pragma GCC unroll 16
    for (int k = 0; k <= kDims; ++k) {  // corner k steps along the k greatest coordinates
      V r[kDims], square = zero;
      VU h = hn::Set(du, b.seed);
      const V threshold = hn::Set(d, static_cast<float>(kDims - k)),
              back = hn::Set(d, kG * static_cast<float>(k));
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a) {
        const V step = hn::IfThenElseZero(hn::Ge(rank[a], threshold), one);
        r[a] = hn::Add(hn::Sub(x[a], step), back);
        square = hn::MulAdd(r[a], r[a], square);
        const VU c = hn::Add(corner[a], hn::BitCast(du, hn::ConvertTo(di, step)));
        h = hn::Xor(h, hn::Mul(c, hn::Set(du, s::kAxis[a])));
      }
      V g[kDims];
      s::LatticeGradient<kDims>(s::LatticeMix(h), g);
      V dot = hn::Mul(g[0], r[0]);
#pragma GCC unroll 16
      for (int a = 1; a < kDims; ++a) dot = hn::MulAdd(g[a], r[a], dot);
      const V t = hn::Max(hn::Sub(hn::Set(d, 0.5f), square), zero), t2 = hn::Mul(t, t), t4 = hn::Mul(t2, t2);
      sum = hn::MulAdd(t4, dot, sum);
      if constexpr (kSlopes) {
        const V factor = hn::Mul(hn::Mul(hn::Set(d, -8.0f), hn::Mul(t2, t)), dot);
#pragma GCC unroll 16
        for (int a = 0; a < kDims; ++a) slope[a] = hn::MulAdd(factor, r[a], hn::MulAdd(t4, g[a], slope[a]));
      }
    }
    hn::StoreU(hn::MulAdd(sum, scale, zero), d, b.value + i);
    if constexpr (kSlopes) {
      for (int a = 0; a < kDims; ++a) hn::StoreU(hn::MulAdd(slope[a], scale, zero), d, b.slope[a] + i);
    }
  }
}

template <int kDims>
NoiseEvaluate Find(NoiseKind kind, bool slopes) {
  switch (kind) {
    case NoiseKind::kSimplex:
      if constexpr (kDims >= 2) return slopes ? Simplex<kDims, true> : Simplex<kDims, false>;
      return nullptr;
    case NoiseKind::kCell:
      return slopes ? Cells<kDims, true> : Cells<kDims, false>;
    case NoiseKind::kSparse:
      return slopes ? Impulses<kDims, false, true> : Impulses<kDims, false, false>;
    default:
      return slopes ? Impulses<kDims, true, true> : Impulses<kDims, true, false>;
  }
}

NoiseEvaluate FindFeatureNoise(NoiseKind kind, int dims, bool slopes) {
  switch (dims) {
    case 1:
      return Find<1>(kind, slopes);
    case 2:
      return Find<2>(kind, slopes);
    case 3:
      return Find<3>(kind, slopes);
    default:
      return Find<4>(kind, slopes);
  }
}

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(FindFeatureNoise);
static NoiseEvaluate Best(NoiseKind kind, int dims, bool slopes) {
  return HWY_DYNAMIC_DISPATCH(FindFeatureNoise)(kind, dims, slopes);
}
}  // namespace noise

NoiseEvaluate FindFeature(NoiseKind kind, int dims, bool slopes) { return noise::Best(kind, dims, slopes); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
