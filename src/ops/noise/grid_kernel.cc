// Lattice noise on grids: a row of pixels crosses each lattice column once, so a column collapses to two
// numbers.
//
// On a row, n(x) = lerp(A[i] + B[i] f, A[i+1] + B[i+1] (f - 1), u(f)) with A and B per lattice column, the
// gradients blended over the other axes. That is c0 + c1 f + u (c2 + c3 f): three multiply-adds per pixel
// with four numbers per cell. The blend over the third and fourth axis is kept as long as rows stay between
// the same two lattice rows.
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/grid_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/noise/shaped-inl.h"
#include "simd/lattice-inl.h"
#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VU;

HWY_INLINE V Lerp(V a, V b, V t) { return hn::MulAdd(t, hn::Sub(b, a), a); }

// gx, gy and rest of lattice points, before blending.
struct Corner {
  V gx, gy, rest;
};
HWY_INLINE Corner Blend(const Corner& a, const Corner& b, float t) {
  const V weight = hn::Set(s::D(), t);
  return {Lerp(a.gx, b.gx, weight), Lerp(a.gy, b.gy, weight), Lerp(a.rest, b.rest, weight)};
}

template <int kDims, bool kGradient>
HWY_INLINE Corner At(VU hash, float fz, float fw) {
  const s::D d;
  const VU h = s::LatticeMix(hash);
  if constexpr (!kGradient) {
    return {hn::Zero(d), hn::Zero(d), s::SignedUnit(h)};
  } else {
    V g[kDims];
    s::LatticeGradient<kDims>(h, g);
    V rest = hn::Zero(d);
    if constexpr (kDims == 4) rest = hn::Mul(g[3], hn::Set(d, fw));
    if constexpr (kDims >= 3) rest = hn::MulAdd(g[2], hn::Set(d, fz), rest);
    return {g[0], g[1], rest};
  }
}

template <int kDims, bool kGradient>
void FillRow(const GridFill& a) {
  const s::D d;
  const s::DU du;
  for (int i = 0; i < a.count; i += static_cast<int>(hn::Lanes(d))) {
    const VU column = hn::Xor(hn::LoadU(du, a.column_hash + i), hn::Set(du, a.row_hash));
    const auto over_z = [&](uint32_t hash, float fw) HWY_ATTR {
      if constexpr (kDims < 3) {
        return At<kDims, kGradient>(column, 0, 0);
      } else {
        const float f = a.z.fraction;
        return Blend(At<kDims, kGradient>(hn::Xor(column, hn::Set(du, hash ^ a.z.hash[0])), f, fw),
                     At<kDims, kGradient>(hn::Xor(column, hn::Set(du, hash ^ a.z.hash[1])), f - 1, fw),
                     a.z.fade);
      }
    };
    Corner c = over_z(a.w.hash[0], a.w.fraction);
    if constexpr (kDims == 4) c = Blend(c, over_z(a.w.hash[1], a.w.fraction - 1), a.w.fade);
    hn::StoreU(c.gx, d, a.out.gx + i);
    hn::StoreU(c.gy, d, a.out.gy + i);
    hn::StoreU(c.rest, d, a.out.rest + i);
  }
}

void Fill(const GridFill& a) {
  switch (2 * a.dims + (a.gradient ? 1 : 0)) {
    case 4:
      return FillRow<2, false>(a);
    case 5:
      return FillRow<2, true>(a);
    case 6:
      return FillRow<3, false>(a);
    case 7:
      return FillRow<3, true>(a);
    case 8:
      return FillRow<4, false>(a);
    default:
      return FillRow<4, true>(a);
  }
}

struct Coefficients {
  V c0, c1, c2, c3;
};

// Calls store(i, coefficients) for the row's columns, a vector at a time. What a column needs of its
// neighbour is moved between registers: a load so soon after the stores would wait for them.
template <class Store>
HWY_INLINE void Collapse(const GridRow& a, const Store& store) {
  const s::D d;
  const s::DI di;
  const int lanes = static_cast<int>(hn::Lanes(d)), count = a.columns.count;
  const V fy = hn::Set(d, a.fraction), fy1 = hn::Set(d, a.fraction - 1), v = hn::Set(d, a.fade);
  const V scale = hn::Set(d, a.scale);
  const auto inner = hn::FirstN(d, static_cast<size_t>(lanes) - 1);
  const auto turn = hn::IndicesFromVec(
      d, hn::IfThenElse(hn::FirstN(di, static_cast<size_t>(lanes) - 1), hn::Iota(di, 1), hn::Zero(di)));
  struct Column {
    V constant, slope, turned_constant, turned_slope;
  };
  const auto column = [&](int i) HWY_ATTR {
    const V low = hn::MulAdd(hn::LoadU(d, a.lower.gy + i), fy, hn::LoadU(d, a.lower.rest + i));
    const V high = hn::MulAdd(hn::LoadU(d, a.upper.gy + i), fy1, hn::LoadU(d, a.upper.rest + i));
    Column c;
    c.constant = hn::Mul(Lerp(low, high, v), scale);
    c.slope = hn::Mul(Lerp(hn::LoadU(d, a.lower.gx + i), hn::LoadU(d, a.upper.gx + i), v), scale);
    c.turned_constant = hn::TableLookupLanes(c.constant, turn);
    c.turned_slope = hn::TableLookupLanes(c.slope, turn);
    return c;
  };
  Column here = column(0);
  for (int i = 0; i < count; i += lanes) {  // the entry after the last column is never used
    const Column next = i + lanes < count ? column(i + lanes) : here;
    const V right = hn::IfThenElse(inner, here.turned_constant, next.turned_constant);
    const V right_slope = hn::IfThenElse(inner, here.turned_slope, next.turned_slope);
    store(i, Coefficients{here.constant, here.slope, hn::Sub(hn::Sub(right, right_slope), here.constant),
                          hn::Sub(right_slope, here.slope)});
    here = next;
  }
}

// The first lanes of a vector: half as many bytes, for tables of few entries.
HWY_INLINE V LoadHalf(const float* p) {
  const s::D d;
#if HWY_TARGET == HWY_SCALAR
  return hn::LoadU(d, p);
#else
  return hn::ZeroExtendVector(d, hn::LoadU(hn::Half<s::D>(), p));
#endif
}

template <NoiseSum kSum>
void RowOf(const GridRow& a) {
  const s::D d;
  const s::DI di;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const V weight = hn::Set(d, a.weight), bias = hn::Set(d, a.bias);
  const int32_t* const left = a.columns.left;
  const int first = a.columns.first;
  const auto pixels = [&](const auto& coefficients) HWY_ATTR {
    const auto value = [&](int x) HWY_ATTR {
      const Coefficients k = coefficients(x);
      const V f = hn::LoadU(d, a.columns.fraction + x), u = hn::LoadU(d, a.columns.fade + x);
      return Shaped<kSum>(hn::MulAdd(u, hn::MulAdd(k.c3, f, k.c2), hn::MulAdd(k.c1, f, k.c0)));
    };
    int x = 0;
    for (; x + lanes <= a.count; x += lanes) {
      const V n = value(x);
      const V sum = a.add ? hn::MulAdd(n, weight, hn::LoadU(d, a.out + x)) : hn::MulAdd(n, weight, bias);
      s::StoreOrStream(sum, d, a.out + x, a.stream);
    }
    if (x < a.count) {  // tables are padded, the output is not
      HWY_ALIGN float tail[kNoisePadding];
      const V n = value(x);
      for (int i = x; i < a.count; ++i) tail[i - x] = a.add ? a.out[i] : a.bias;
      hn::StoreU(hn::MulAdd(n, weight, hn::LoadU(d, tail)), d, tail);
      for (int i = x; i < a.count; ++i) a.out[i] = tail[i - x];
    }
  };
  if (a.columns.count <= lanes) {  // all columns in registers
    Coefficients all{};
    Collapse(a, [&](int, const Coefficients& k) HWY_ATTR { all = k; });
    pixels([&](int x) HWY_ATTR {
      const auto index = hn::IndicesFromVec(d, hn::Sub(hn::LoadU(di, left + x), hn::Set(di, first)));
      const auto pick = [&](V table) HWY_ATTR { return hn::TableLookupLanes(table, index); };
      return Coefficients{pick(all.c0), pick(all.c1), pick(all.c2), pick(all.c3)};
    });
    return;
  }
  float* c[4];
  for (int k = 0; k < 4; ++k) c[k] = a.scratch + k * (a.columns.count + 2 * kNoisePadding);
  Collapse(a, [&](int i, const Coefficients& k) HWY_ATTR {
    hn::StoreU(k.c0, d, c[0] + i), hn::StoreU(k.c1, d, c[1] + i);
    hn::StoreU(k.c2, d, c[2] + i), hn::StoreU(k.c3, d, c[3] + i);
  });
  pixels([&](int x) HWY_ATTR {
    const int base = left[x] - first, span = left[x + lanes - 1] - left[x];
    if (span == 0) {
      return Coefficients{hn::Set(d, c[0][base]), hn::Set(d, c[1][base]), hn::Set(d, c[2][base]),
                          hn::Set(d, c[3][base])};
    }
    if (span >= lanes) {
      const auto index = hn::Sub(hn::LoadU(di, left + x), hn::Set(di, first));
      const auto pick = [&](const float* p) HWY_ATTR { return hn::GatherIndex(d, p, index); };
      return Coefficients{pick(c[0]), pick(c[1]), pick(c[2]), pick(c[3])};
    }
    const auto index = hn::IndicesFromVec(d, hn::Sub(hn::LoadU(di, left + x), hn::Set(di, left[x])));
    if (2 * span < lanes) {
      const auto pick = [&](const float* p)
                            HWY_ATTR { return hn::TableLookupLanes(LoadHalf(p + base), index); };
      return Coefficients{pick(c[0]), pick(c[1]), pick(c[2]), pick(c[3])};
    }
    const auto pick = [&](const float* p)
                          HWY_ATTR { return hn::TableLookupLanes(hn::LoadU(d, p + base), index); };
    return Coefficients{pick(c[0]), pick(c[1]), pick(c[2]), pick(c[3])};
  });
}

void Row(const GridRow& a) {
  switch (a.sum) {
    case NoiseSum::kFbm:
      return RowOf<NoiseSum::kFbm>(a);
    case NoiseSum::kTurbulence:
      return RowOf<NoiseSum::kTurbulence>(a);
    case NoiseSum::kBillow:
      return RowOf<NoiseSum::kBillow>(a);
    case NoiseSum::kRidged:
      return RowOf<NoiseSum::kRidged>(a);
  }
}

// Stamps one lattice column's block of a row: out += low * window + gx * (x window).
void Stamp(const GridStamp& a) {
  const s::D d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const V rest = hn::Set(d, a.rest), gx = hn::Set(d, a.gx);
  for (int t = 0; t < a.taps; t += lanes) {
    V v = hn::LoadU(d, a.out + t);
    v = hn::MulAdd(rest, hn::LoadU(d, a.window + t), v);
    if (a.gx != 0) v = hn::MulAdd(gx, hn::LoadU(d, a.ramp + t), v);
    hn::StoreU(v, d, a.out + t);
  }
}

GridKernels MakeGridKernels() { return {Fill, Row, Stamp}; }

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(MakeGridKernels);
static GridKernels Best() { return HWY_DYNAMIC_DISPATCH(MakeGridKernels)(); }
}  // namespace noise

GridKernels FindGridKernels() { return noise::Best(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
