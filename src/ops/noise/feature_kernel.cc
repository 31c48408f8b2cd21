// Noise from points in cells: cell noise (Worley), sparse convolution (Lewis), spot noise (van Wijk).
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/feature_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/noise/neighbour-inl.h"
#include "simd/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VU;

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

template <int kDims>
NoiseEvaluate Find(NoiseKind kind, bool slopes) {
  switch (kind) {
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
static NoiseEvaluate Choose(NoiseKind kind, int dims, bool slopes) {
  return HWY_DYNAMIC_DISPATCH(FindFeatureNoise)(kind, dims, slopes);
}
}  // namespace noise

NoiseEvaluate FindFeature(NoiseKind kind, int dims, bool slopes) { return noise::Choose(kind, dims, slopes); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
