// Lookups in two passes over a few dozen pixels: first where and with what weights, into L1, then the
// entries. In one loop the chain from index through memory to load would keep neighbouring pixels from
// overlapping.
#if defined(TESSERA_OPS_LOOKUP_GATHER_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_LOOKUP_GATHER_INL_H_
#undef TESSERA_OPS_LOOKUP_GATHER_INL_H_
#else
#define TESSERA_OPS_LOOKUP_GATHER_INL_H_
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <cmath>

#include "ops/lookup/locate-inl.h"
#include "simd/texels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::V;
using s::VI;

// --- Second passes. Each writes chunk.result. kPermuted: coordinates are in plane order, texels of four
// results are written in the pixels' own order, so that vectors of them are pixels as they lie in memory. ---

template <bool kPermuted>
HWY_INLINE float* ResultOf(Chunk& chunk, int i) {
  constexpr int kMask = s::kLanes - 1;
  return chunk.result + 4 * (kPermuted ? (i & ~kMask) + s::kTables.pixel[i & kMask] : i);
}

template <int kTexel, bool kPermuted>
HWY_INLINE void GatherNearest(const Grid& grid, Chunk& chunk, int count) {
  const float* const data = grid.data();
  for (int i = 0; i < count; ++i) {
    const float* const p = data + static_cast<ptrdiff_t>(chunk.base[i]) * kTexel;
    if constexpr (kTexel == 4) {
      s::Quad::Load(p).Store(ResultOf<kPermuted>(chunk, i));
    } else {
      chunk.result[i] = *p;
    }
  }
}

// Linear, texels of four: pairs along axis 0, reduced over the higher axes, then along axis 0.
template <int axis>
HWY_INLINE s::Pair LerpAbove(const float* p, const ptrdiff_t* stride, const s::Pair* f) {
  if constexpr (axis == 0) {
    return s::Pair::Load(p);
  } else {
    const s::Pair a = LerpAbove<axis - 1>(p, stride, f);
    return s::LerpFromNearer(a, LerpAbove<axis - 1>(p + stride[axis], stride, f), f[axis]);
  }
}
template <int kDims, bool kPermuted>
HWY_INLINE void GatherLinear4(const Grid& grid, Chunk& chunk, int count) {
  const float* const data = grid.data();
  ptrdiff_t stride[4] = {};
  for (int a = 0; a < kDims; ++a) stride[a] = static_cast<ptrdiff_t>(grid.axis(a).stride) * 4;
  for (int i = 0; i < count; ++i) {
    const float* const p = data + static_cast<ptrdiff_t>(chunk.base[i]) * 4;
    s::Pair f[4];
    for (int a = 1; a < kDims; ++a) f[a] = s::Pair::Set(chunk.weight[a][i]);
    const s::Pair pair = LerpAbove<kDims - 1>(p, stride, f);
    s::LerpFromNearer(s::Lower(pair), s::Upper(pair), s::Quad::Set(chunk.weight[0][i]))
        .Store(ResultOf<kPermuted>(chunk, i));
  }
}

// Linear, single samples: planes of a vector's pixels.
template <int axis>
HWY_INLINE V LerpPlanes(const float* data, const int32_t* base, const ptrdiff_t* stride, const V* f) {
  if constexpr (axis == 0) {
    V a, b;
    s::LoadPairs([&](int k) HWY_ATTR { return data + base[k]; }, a, b);
    return s::LerpFromNearer(a, b, f[0]);
  } else {
    const V a = LerpPlanes<axis - 1>(data, base, stride, f);
    return s::LerpFromNearer(a, LerpPlanes<axis - 1>(data + stride[axis], base, stride, f), f[axis]);
  }
}
// The same for two axes, rows of entries below `high` and `low` of them: along y first, two pixels in 128
// bits.
HWY_INLINE V LerpSquares(const float* low, const float* high, const int32_t* base, V x, V y) {
  const auto pairs = [&](const float* row, int first) HWY_ATTR {
    return s::VectorOfQuads([&](int k) HWY_ATTR { return s::JoinPairs(row + base[k], row + base[k + 2]); },
                            first);
  };
  const V even = s::LerpFromNearer(pairs(low, 0), pairs(high, 0), hn::DupEven(y));
  const V odd = s::LerpFromNearer(pairs(low, 1), pairs(high, 1), hn::DupOdd(y));
  return s::LerpFromNearer(hn::OddEven(hn::DupEven(odd), even), hn::OddEven(odd, hn::DupOdd(even)), x);
}
template <int kDims>
HWY_INLINE void GatherLinear1(const Grid& grid, Chunk& chunk, int count) {
  const s::D d;
  ptrdiff_t stride[4] = {};
  for (int a = 0; a < kDims; ++a) stride[a] = grid.axis(a).stride;
  for (int i = 0; i < count; i += s::kLanes) {
    V f[4];
    for (int a = 0; a < kDims; ++a) f[a] = hn::Load(d, chunk.weight[a] + i);
    if constexpr (kDims == 2 && s::kLanes >= 4) {
      const V v = LerpSquares(grid.data(), grid.data() + stride[1], chunk.base + i, f[0], f[1]);
      hn::Store(v, d, chunk.result + i);
      continue;
    }
    hn::Store(LerpPlanes<kDims - 1>(grid.data(), chunk.base + i, stride, f), d, chunk.result + i);
  }
}

// Simplex: the fractions in falling order are the axes along which the path from the first corner to the last
// one goes; the weights are their differences. weight[0] is the first corner's less 1, which would round.
template <int kDims>
HWY_INLINE void SortSimplex(const Grid& grid, Chunk& chunk, int count) {
  const s::D d;
  const s::DI di;
  for (int i = 0; i < count; i += s::kLanes) {
    V f[4];
    VI step[4];
    for (int a = 0; a < kDims; ++a) {
      f[a] = hn::Load(d, chunk.weight[a] + i);
      step[a] = hn::Set(di, grid.axis(a).stride);
    }
    const auto order = [&](int a, int b) HWY_ATTR {
      const auto keep = hn::Ge(f[a], f[b]);
      const auto keep_step = hn::RebindMask(di, keep);
      const V high = hn::Max(f[a], f[b]), low = hn::Min(f[a], f[b]);
      const VI first = hn::IfThenElse(keep_step, step[a], step[b]);
      step[b] = hn::IfThenElse(keep_step, step[b], step[a]);
      step[a] = first, f[a] = high, f[b] = low;
    };
    if constexpr (kDims == 2) {
      order(0, 1);
    } else if constexpr (kDims == 3) {
      order(0, 1), order(1, 2), order(0, 1);
    } else {
      order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
    }
    hn::Store(hn::Neg(f[0]), d, chunk.weight[0] + i);
    for (int a = 1; a < kDims; ++a) hn::Store(hn::Sub(f[a - 1], f[a]), d, chunk.weight[a] + i);
    hn::Store(f[kDims - 1], d, chunk.weight[kDims] + i);
    VI at = step[0];
    hn::Store(at, di, chunk.step[0] + i);
    for (int a = 1; a < kDims - 1; ++a) {
      at = hn::Add(at, step[a]);
      hn::Store(at, di, chunk.step[a] + i);
    }
  }
}
// The sum of a simplex' entries in two halves, from both ends, so that fewer roundings are of large sums:
// entry(k) for k in 0..kDims, weight(k) as SortSimplex leaves them.
template <int kDims, class Entry, class Weight>
HWY_INLINE auto SimplexSum(const Entry& entry, const Weight& weight) {
  using hn::Add, hn::Mul, s::Add, s::Mul;
  const auto first = entry(0);
  const auto lower = s::Fused(weight(1), entry(1), s::Fused(weight(0), first, first));
  auto upper = Mul(weight(kDims), entry(kDims));
  for (int k = kDims - 1; k >= 2; --k) upper = s::Fused(weight(k), entry(k), upper);
  return Add(lower, upper);
}
template <int kDims, bool kPermuted>
HWY_INLINE void GatherSimplex4(const Grid& grid, Chunk& chunk, int count) {
  ptrdiff_t last = 0;
  for (int a = 0; a < kDims; ++a) last += static_cast<ptrdiff_t>(grid.axis(a).stride) * 4;
  for (int i = 0; i < count; ++i) {
    const float* const p = grid.data() + static_cast<ptrdiff_t>(chunk.base[i]) * 4;
    const auto entry = [&](int k) HWY_ATTR {
      const ptrdiff_t step = k == 0       ? 0
                             : k == kDims ? last
                                          : static_cast<ptrdiff_t>(chunk.step[k - 1][i]) * 4;
      return s::Quad::Load(p + step);
    };
    SimplexSum<kDims>(entry, [&](int k) HWY_ATTR {
      return s::Quad::Set(chunk.weight[k][i]);
    }).Store(ResultOf<kPermuted>(chunk, i));
  }
}
template <int kDims>
HWY_INLINE void GatherSimplex1(const Grid& grid, Chunk& chunk, int count) {
  ptrdiff_t last = 0;
  for (int a = 0; a < kDims; ++a) last += grid.axis(a).stride;
  const s::D d;
  for (int i = 0; i < count; i += s::kLanes) {
    const auto entry = [&](int k) HWY_ATTR {
      alignas(64) float entries[s::kLanes];
      for (int lane = 0; lane < s::kLanes; ++lane) {
        const ptrdiff_t step = k == 0 ? 0 : k == kDims ? last : ptrdiff_t{chunk.step[k - 1][i + lane]};
        entries[lane] = grid.data()[chunk.base[i + lane] + step];
      }
      return hn::Load(d, entries);
    };
    const V sum = SimplexSum<kDims>(entry, [&](int k) HWY_ATTR { return hn::Load(d, chunk.weight[k] + i); });
    hn::Store(sum, d, chunk.result + i);
  }
}

// The error of a cubic lookup, for entries up to 1, by adding up what every operation may round, over all
// fractions f: the four weights are off by 4.1 u together (Horner's steps; the fraction's own rounding, u / 2
// times the weights' slopes; 1 - f), their sum rounds partial sums of at most |w0|, |w0| + |w1|, ..., 3.4 u.
// Where both together are worst that is 7.5 u for catmull-rom (f = 0.29), 7.1 u for mitchell, 6.1 u for
// b-spline; 10.2, 9.6 and 7.9 u where products are rounded too. An axis above multiplies the errors below it
// by the sum L of its weights' magnitudes, 1.25, 1.14 and 1 at most, and adds its own for values up to L for
// each axis below. So D axes stay within 8 u D L^(D-1).

// Cubic weights of the fraction in weight[a], into weight[4a .. 4a + 3]; from the last axis to the first, as
// they take the fractions' places. k0..k3: polynomials in f, lowest power first, so that 0 and 1 have exact
// weights.
struct CubicPolynomials {
  float c[2][4];
  explicit CubicPolynomials(CubicKernel kernel) {
    const double b = kernel == CubicKernel::kBSpline ? 1 : kernel == CubicKernel::kMitchell ? 1.0 / 3 : 0;
    const double k = kernel == CubicKernel::kBSpline ? 0 : kernel == CubicKernel::kMitchell ? 1.0 / 3 : 0.5;
    // Of the near and the far piece at distance x: outer(f) = far(1 + f), inner(f) = near(f).
    const double outer[4] = {b / 6, -b / 2 - k, b / 2 + 2 * k, -b / 6 - k};
    const double inner[4] = {1 - b / 3, 0, -3 + 2 * b + k, 2 - 1.5 * b - k};
    for (int p = 0; p < 4; ++p)
      c[0][p] = static_cast<float>(outer[p]), c[1][p] = static_cast<float>(inner[p]);
  }

  HWY_INLINE void Weights(V f, V* w) const {
    const s::D d;
    const V one = hn::Set(d, 1.0f), g = hn::Sub(one, f);
    const auto value = [&](const float* p, V at) HWY_ATTR {
      V sum = hn::MulAdd(hn::Set(d, p[3]), at, hn::Set(d, p[2]));
      sum = hn::MulAdd(sum, at, hn::Set(d, p[1]));
      return hn::MulAdd(sum, at, hn::Set(d, p[0]));
    };
    const auto zero_at_end = [&](V v, V distance)
                                 HWY_ATTR { return hn::IfThenZeroElse(hn::Eq(distance, one), v); };
    w[0] = zero_at_end(value(c[0], f), f), w[1] = value(c[1], f);
    w[2] = value(c[1], g), w[3] = zero_at_end(value(c[0], g), g);
  }
};
HWY_NOINLINE inline void CubicWeights(const CubicPolynomials& kernel, int dims, Chunk& chunk, int count) {
  const s::D d;
  for (int a = dims - 1; a >= 0; --a) {
    for (int i = 0; i < count; i += s::kLanes) {
      V w[4];
      kernel.Weights(hn::Load(d, chunk.weight[a] + i), w);
      for (int k = 0; k < 4; ++k) hn::Store(w[k], d, chunk.weight[4 * a + k] + i);
    }
  }
}
template <int n, int axis>
HWY_INLINE s::Floats<n> CubicAbove(const float* p, const ptrdiff_t* stride, const Chunk& chunk, int i) {
  if constexpr (axis == 0) {
    return s::Floats<n>::Load(p);
  } else {
    using F = s::Floats<n>;
    F sum = s::Mul(CubicAbove<n, axis - 1>(p - stride[axis], stride, chunk, i),
                   F::Set(chunk.weight[4 * axis][i]));
    for (int k = 1; k < 4; ++k) {
      sum = s::MulAdd(CubicAbove<n, axis - 1>(p + (k - 1) * stride[axis], stride, chunk, i),
                      F::Set(chunk.weight[4 * axis + k][i]), sum);
    }
    return sum;
  }
}
template <int kDims, bool kPermuted>
HWY_INLINE void GatherCubic4(const Grid& grid, Chunk& chunk, int count) {
  ptrdiff_t stride[4] = {};
  for (int a = 0; a < kDims; ++a) stride[a] = static_cast<ptrdiff_t>(grid.axis(a).stride) * 4;
  for (int i = 0; i < count; ++i) {
    const float* const p = grid.data() + static_cast<ptrdiff_t>(chunk.base[i]) * 4 - 4;
    const s::Row row = CubicAbove<16, kDims - 1>(p, stride, chunk, i);
    const s::Pair low = s::Lower(row), high = s::Upper(row);
    const auto weight = [&](int k) HWY_ATTR { return s::Quad::Set(chunk.weight[k][i]); };
    s::Quad sum = s::Mul(s::Lower(low), weight(0));
    sum = s::MulAdd(s::Upper(low), weight(1), sum);
    sum = s::MulAdd(s::Lower(high), weight(2), sum);
    s::MulAdd(s::Upper(high), weight(3), sum).Store(ResultOf<kPermuted>(chunk, i));
  }
}
template <int kDims>
HWY_INLINE void GatherCubic1(const Grid& grid, Chunk& chunk, int count) {
  const s::D d;
  ptrdiff_t stride[4] = {};
  for (int a = 0; a < kDims; ++a) stride[a] = grid.axis(a).stride;
  alignas(64) float quads[4 * kChunk];
  for (int i = 0; i < count; ++i) {
    CubicAbove<4, kDims - 1>(grid.data() + chunk.base[i] - 1, stride, chunk, i).Store(quads + 4 * i);
  }
  for (int i = 0; i < count; i += s::kLanes) {
    V q[4];
    for (int j = 0; j < 4; ++j) {
      q[j] = s::LoadQuads([&](int k) HWY_ATTR { return quads + 4 * (i + k); }, j);
    }
    s::Transpose4(q[0], q[1], q[2], q[3]);
    V sum = hn::Mul(q[0], hn::Load(d, chunk.weight[0] + i));
    for (int k = 1; k < 4; ++k) sum = hn::MulAdd(q[k], hn::Load(d, chunk.weight[k] + i), sum);
    hn::Store(sum, d, chunk.result + i);
  }
}

// Both passes of a method over the chunk's first `count` pixels; true when some are flagged.
using LookupFunction = bool (*)(const Grid&, Chunk&, int count);

template <int kTexel, int kDims, bool kUnit>
bool LookupNearest(const Grid& grid, Chunk& chunk, int count) {
  const bool flagged = Locate<kDims, Want::kEntry, kUnit>(grid, chunk, count, 0, 0);
  GatherNearest<kTexel, kUnit>(grid, chunk, count);
  return flagged;
}
// Asks for the rows of a chunk's cells in a picture that no near cache holds: more misses are under way than
// the second pass alone could have.
template <int kDims>
HWY_INLINE void PrefetchCells(const Grid& grid, const Chunk& chunk, int count) {
  constexpr int64_t kNear = int64_t{1} << 22;
  if (kDims != 2 || grid.bytes() < kNear) return;
  const ptrdiff_t up = static_cast<ptrdiff_t>(grid.axis(1).stride) * 4;
  for (int i = 0; i < count; ++i) {
    const float* const p = grid.data() + static_cast<ptrdiff_t>(chunk.base[i]) * 4;
    hwy::Prefetch(p);
    hwy::Prefetch(p + up);
  }
}
template <int kTexel, int kDims, bool kUnit>
bool LookupLinear(const Grid& grid, Chunk& chunk, int count) {
  const bool flagged = Locate<kDims, Want::kNearer, kUnit>(grid, chunk, count, 0, 1);
  if constexpr (kTexel == 4) {
    if constexpr (!kUnit) PrefetchCells<kDims>(grid, chunk, count);
    GatherLinear4<kDims, kUnit>(grid, chunk, count);
  } else {
    GatherLinear1<kDims>(grid, chunk, count);
  }
  return flagged;
}
template <int kTexel, int kDims, bool kUnit>
bool LookupSimplex(const Grid& grid, Chunk& chunk, int count) {
  if constexpr (kDims == 1) {
    return LookupLinear<kTexel, kDims, kUnit>(grid, chunk, count);
  } else {
    const bool flagged = Locate<kDims, Want::kFraction, kUnit>(grid, chunk, count, 0, 1);
    SortSimplex<kDims>(grid, chunk, count);
    if constexpr (kTexel == 4) {
      GatherSimplex4<kDims, kUnit>(grid, chunk, count);
    } else {
      GatherSimplex1<kDims>(grid, chunk, count);
    }
    return flagged;
  }
}
template <int kTexel, int kDims, bool kUnit>
bool LookupCubic(const Grid& grid, Chunk& chunk, int count) {
  const bool flagged = Locate<kDims, Want::kFraction, kUnit>(grid, chunk, count, -1, 2);
  CubicWeights(CubicPolynomials(grid.params().cubic), kDims, chunk, count);
  if constexpr (kTexel == 4) {
    GatherCubic4<kDims, kUnit>(grid, chunk, count);
  } else {
    GatherCubic1<kDims>(grid, chunk, count);
  }
  return flagged;
}

// kUnit: coordinates are clamped to [0,1], NaN to 0, and the grid is whole.
template <int kTexel, int kDims, bool kUnit>
LookupFunction MethodOf(TableFilter filter) {
  switch (filter) {
    case TableFilter::kNearest:
      return LookupNearest<kTexel, kDims, kUnit>;
    case TableFilter::kTetrahedral:
      return LookupSimplex<kTexel, kDims, kUnit>;
    case TableFilter::kCubic:
      return LookupCubic<kTexel, kDims, kUnit>;
    case TableFilter::kLinear:
    case TableFilter::kMipmap:
    case TableFilter::kTrilinear:
    case TableFilter::kEwa:
      break;
  }
  return LookupLinear<kTexel, kDims, kUnit>;
}

// Whether some of `count` floats (64-byte aligned) is NaN or infinite.
HWY_INLINE bool AnyNotFinite(const float* v, int count) {
  const s::D d;
  V sum = hn::Zero(d);
  int i = 0;
  for (; i + s::kLanes <= count; i += s::kLanes) {
    const V x = hn::Load(d, v + i);
    sum = hn::Add(sum, hn::Sub(x, x));
  }
  bool any = !hn::AllTrue(d, hn::Eq(sum, hn::Zero(d)));
  for (; i < count; ++i) any |= !std::isfinite(v[i]);
  return any;
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
