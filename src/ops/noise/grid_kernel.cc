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

// How a noise value enters a sum.
template <NoiseSum kSum>
HWY_INLINE V Shaped(V n) {
  const s::D d;
  if constexpr (kSum == NoiseSum::kFbm) return n;
  const V size = hn::Abs(n);
  if constexpr (kSum == NoiseSum::kTurbulence) return size;
  if constexpr (kSum == NoiseSum::kBillow) return hn::MulSub(hn::Set(d, 2.0f), size, hn::Set(d, 1.0f));
  const V rest = hn::Sub(hn::Set(d, 1.0f), size);
  return hn::Mul(rest, rest);
}

struct Coefficients {
  V c0, c1, c2, c3;
};

// c[0] .. c[3] of every column of the row.
HWY_INLINE void Collapse(const GridRow& a, float* const* c) {
  const s::D d;
  const int lanes = static_cast<int>(hn::Lanes(d)), count = a.columns.count;
  const V fy = hn::Set(d, a.fraction), fy1 = hn::Set(d, a.fraction - 1), v = hn::Set(d, a.fade);
  const V scale = hn::Set(d, a.scale);
  for (int i = 0; i < count; i += lanes) {
    const V low = hn::MulAdd(hn::LoadU(d, a.lower.gy + i), fy, hn::LoadU(d, a.lower.rest + i));
    const V high = hn::MulAdd(hn::LoadU(d, a.upper.gy + i), fy1, hn::LoadU(d, a.upper.rest + i));
    hn::StoreU(hn::Mul(Lerp(low, high, v), scale), d, c[0] + i);
    hn::StoreU(hn::Mul(Lerp(hn::LoadU(d, a.lower.gx + i), hn::LoadU(d, a.upper.gx + i), v), scale), d,
               c[1] + i);
  }
  for (int i = 0; i < count; i += lanes) {  // the entry after the last column is never used
    const V a1 = hn::LoadU(d, c[0] + i + 1), b1 = hn::LoadU(d, c[1] + i + 1);
    hn::StoreU(hn::Sub(hn::Sub(a1, b1), hn::LoadU(d, c[0] + i)), d, c[2] + i);
    hn::StoreU(hn::Sub(b1, hn::LoadU(d, c[1] + i)), d, c[3] + i);
  }
}

template <NoiseSum kSum>
void RowOf(const GridRow& a) {
  const s::D d;
  const s::DI di;
  const int lanes = static_cast<int>(hn::Lanes(d));
  float* c[4];
  for (int k = 0; k < 4; ++k) c[k] = a.scratch + k * (a.columns.count + 2 * kNoisePadding);
  Collapse(a, c);
  const V weight = hn::Set(d, a.weight), bias = hn::Set(d, a.bias);
  const int32_t* const left = a.columns.left;
  const int first = a.columns.first;
  const auto value = [&](const Coefficients& k, int x) HWY_ATTR {
    const V f = hn::LoadU(d, a.columns.fraction + x), u = hn::LoadU(d, a.columns.fade + x);
    return Shaped<kSum>(hn::MulAdd(u, hn::MulAdd(k.c3, f, k.c2), hn::MulAdd(k.c1, f, k.c0)));
  };
  const auto coefficients = [&](int x) HWY_ATTR {
    const int base = left[x] - first, span = left[x + lanes - 1] - left[x];
    Coefficients k;
    if (span == 0) {
      k = {hn::Set(d, c[0][base]), hn::Set(d, c[1][base]), hn::Set(d, c[2][base]), hn::Set(d, c[3][base])};
    } else if (span < lanes) {
      const auto index = hn::IndicesFromVec(d, hn::Sub(hn::LoadU(di, left + x), hn::Set(di, left[x])));
      const auto pick = [&](const float* p)
                            HWY_ATTR { return hn::TableLookupLanes(hn::LoadU(d, p + base), index); };
      k = {pick(c[0]), pick(c[1]), pick(c[2]), pick(c[3])};
    } else {
      const auto index = hn::Sub(hn::LoadU(di, left + x), hn::Set(di, first));
      const auto pick = [&](const float* p) HWY_ATTR { return hn::GatherIndex(d, p, index); };
      k = {pick(c[0]), pick(c[1]), pick(c[2]), pick(c[3])};
    }
    return k;
  };
  int x = 0;
  for (; x + lanes <= a.count; x += lanes) {
    const V n = value(coefficients(x), x);
    const V sum = a.add ? hn::MulAdd(n, weight, hn::LoadU(d, a.out + x)) : hn::MulAdd(n, weight, bias);
    s::StoreOrStream(sum, d, a.out + x, a.stream);
  }
  if (x < a.count) {  // tables are padded, the output is not
    HWY_ALIGN float tail[kNoisePadding];
    const V n = value(coefficients(x), x);
    for (int i = x; i < a.count; ++i) tail[i - x] = a.add ? a.out[i] : a.bias;
    hn::StoreU(hn::MulAdd(n, weight, hn::LoadU(d, tail)), d, tail);
    for (int i = x; i < a.count; ++i) a.out[i] = tail[i - x];
  }
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

template <NoiseSum kSum>
void AccumulateOf(const AccumulateBatch& a) {
  const s::D d;
  const V weight = hn::Set(d, a.weight);
  for (int i = 0; i < a.count; i += static_cast<int>(hn::Lanes(d))) {
    const V n = Shaped<kSum>(hn::LoadU(d, a.value + i));
    hn::StoreU(hn::MulAdd(n, weight, hn::LoadU(d, a.out + i)), d, a.out + i);
  }
}
void Accumulate(const AccumulateBatch& a) {
  switch (a.sum) {
    case NoiseSum::kFbm:
      return AccumulateOf<NoiseSum::kFbm>(a);
    case NoiseSum::kTurbulence:
      return AccumulateOf<NoiseSum::kTurbulence>(a);
    case NoiseSum::kBillow:
      return AccumulateOf<NoiseSum::kBillow>(a);
    case NoiseSum::kRidged:
      return AccumulateOf<NoiseSum::kRidged>(a);
  }
}

void Clear(const uint32_t* invalid, int count, float* value) {
  const s::D d;
  const s::DU du;
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const auto zero = hn::RebindMask(d, hn::Ne(hn::LoadU(du, invalid + i), hn::Zero(du)));
    hn::StoreU(hn::IfThenZeroElse(zero, hn::LoadU(d, value + i)), d, value + i);
  }
}

// Whole numbers modulo 2^32; beyond 2^31 they are reduced first, exactly.
HWY_INLINE VU CellOf(V whole) {
  const s::D d;
  const auto large = hn::Ge(hn::Abs(whole), hn::Set(d, 0x1p31f));
  if (HWY_UNLIKELY(!hn::AllFalse(d, large))) {
    const V turns = hn::Floor(hn::Mul(whole, hn::Set(d, 0x1p-32f)));
    V rest = hn::NegMulAdd(turns, hn::Set(d, 0x1p32f), whole);
    rest = hn::IfThenElse(hn::Ge(rest, hn::Set(d, 0x1p31f)), hn::Sub(rest, hn::Set(d, 0x1p32f)), rest);
    whole = hn::IfThenElse(large, rest, whole);
  }
  return hn::BitCast(s::DU(), hn::ConvertTo(s::DI(), whole));
}

void Position(const PositionBatch& a) {
  const s::D d;
  const s::DU du;
  const V f0 = hn::Set(d, a.scale.frequency[0]), f1 = hn::Set(d, a.scale.frequency[1]);
  const V offset = hn::Set(d, a.scale.offset), limit = hn::Set(d, 0x1p100f);
  for (int i = 0; i < a.count; i += static_cast<int>(hn::Lanes(d))) {
    V p = hn::LoadU(d, a.high + i);
    V low = a.low != nullptr ? hn::LoadU(d, a.low + i) : hn::Zero(d);
    const auto valid = hn::And(hn::Lt(hn::Abs(p), limit), hn::Lt(hn::Abs(low), limit));  // false for NaN
    p = hn::IfThenElseZero(valid, p);
    low = hn::IfThenElseZero(valid, low);
    // floor of the product, and what is left of the exact product.
    V whole = hn::Floor(hn::Mul(p, f0));
    V rest = hn::MulSub(p, f0, whole);
    rest = hn::MulAdd(p, f1, rest);
    rest = hn::Add(hn::MulAdd(low, f0, rest), offset);
    // Where floats hold every integer the fraction is brought into [0, 1); beyond, it keeps its whole part.
    const V carry = hn::IfThenElseZero(hn::Lt(hn::Abs(whole), hn::Set(d, 0x1p23f)), hn::Floor(rest));
    if (a.scale.period > 0) {
      const V period = hn::Set(d, a.scale.period);
      const auto wrap = [&](V v) HWY_ATTR {
        v = hn::NegMulAdd(hn::Floor(hn::Div(v, period)), period, v);
        v = hn::IfThenElse(hn::Lt(v, hn::Zero(d)), hn::Add(v, period), v);
        return hn::IfThenElse(hn::Ge(v, period), hn::Sub(v, period), v);
      };
      const V all = hn::Floor(rest);
      whole = wrap(hn::Add(wrap(whole), hn::Add(all, hn::Set(d, a.scale.offset_whole))));
      rest = hn::Sub(rest, all);
    } else {
      whole = hn::Add(whole, carry);
      rest = hn::Sub(rest, carry);
    }
    hn::StoreU(whole, d, a.cell + i);
    hn::StoreU(rest, d, a.fraction + i);
    const VU bad = hn::IfThenZeroElse(hn::RebindMask(du, valid), hn::Set(du, 1u));
    hn::StoreU(hn::Or(hn::LoadU(du, a.invalid + i), bad), du, a.invalid + i);
  }
}

void Octave(const OctaveBatch& a) {
  const s::D d;
  const s::DU du;
  const V s0 = hn::Set(d, a.scale[0]), s1 = hn::Set(d, a.scale[1]), shift = hn::Set(d, a.shift);
  const bool scaled = a.scale[0] != 1 || a.scale[1] != 0;
  for (int i = 0; i < a.count; i += static_cast<int>(hn::Lanes(d))) {
    V whole = hn::LoadU(d, a.cell + i), rest = hn::LoadU(d, a.fraction + i);
    if (scaled) {
      const V cell = whole;
      whole = hn::Floor(hn::Mul(cell, s0));
      rest = hn::MulAdd(rest, s0, hn::MulAdd(cell, s1, hn::MulSub(cell, s0, whole)));
    }
    rest = hn::Add(rest, shift);
    const V carry = hn::Floor(rest);
    // Two additions of integers: the sum may exceed what floats can hold.
    VU sum = hn::Add(hn::Add(CellOf(whole), CellOf(carry)), hn::Set(du, a.shift_cell));
    if (a.period != 0) sum = hn::IfThenZeroElse(hn::Eq(sum, hn::Set(du, a.period)), sum);
    hn::StoreU(sum, du, a.out_cell + i);
    hn::StoreU(hn::Sub(rest, carry), d, a.out_fraction + i);
  }
}

void Displace(const DisplaceBatch& a) {
  const s::D d;
  const s::DU du;
  const s::DI di;
  const V scale = hn::Set(d, a.scale), period = hn::Set(d, static_cast<float>(a.period));
  for (int i = 0; i < a.count; i += static_cast<int>(hn::Lanes(d))) {
    const V rest = hn::MulAdd(hn::LoadU(d, a.delta + i), scale, hn::LoadU(d, a.fraction + i));
    const V carry = hn::Floor(rest);
    VU cell = hn::Add(hn::LoadU(du, a.cell + i), CellOf(carry));
    if (a.period != 0) {
      const V whole = hn::ConvertTo(d, hn::BitCast(di, cell));
      V wrapped = hn::NegMulAdd(hn::Floor(hn::Div(whole, period)), period, whole);
      wrapped = hn::IfThenElse(hn::Lt(wrapped, hn::Zero(d)), hn::Add(wrapped, period), wrapped);
      wrapped = hn::IfThenElse(hn::Ge(wrapped, period), hn::Sub(wrapped, period), wrapped);
      cell = CellOf(wrapped);
    }
    hn::StoreU(cell, du, a.cell + i);
    hn::StoreU(hn::Sub(rest, carry), d, a.fraction + i);
  }
}

void Fade(const float* fraction, int count, int kind, float* out) {
  const s::D d;
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    hn::StoreU(s::FadeWeight(hn::LoadU(d, fraction + i), kind), d, out + i);
  }
}

void Interleave(const float* const* planes, int channels, int count, float* out) {
  const s::D d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int x = 0;
  if (channels == 1) {
    for (; x + lanes <= count; x += lanes) hn::StoreU(hn::LoadU(d, planes[0] + x), d, out + x);
  } else if (channels == 3) {
    for (; x + lanes <= count; x += lanes) {
      hn::StoreInterleaved3(hn::LoadU(d, planes[0] + x), hn::LoadU(d, planes[1] + x),
                            hn::LoadU(d, planes[2] + x), d, out + static_cast<ptrdiff_t>(3) * x);
    }
  } else if (channels == 4) {
    for (; x + lanes <= count; x += lanes) {
      hn::StoreInterleaved4(hn::LoadU(d, planes[0] + x), hn::LoadU(d, planes[1] + x),
                            hn::LoadU(d, planes[2] + x), hn::LoadU(d, planes[3] + x), d,
                            out + static_cast<ptrdiff_t>(4) * x);
    }
  }
  for (; x < count; ++x) {
    for (int c = 0; c < channels; ++c) out[static_cast<ptrdiff_t>(x) * channels + c] = planes[c][x];
  }
}

void Separate(const float* from, int channels, int count, float* const* planes) {
  const s::D d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int x = 0;
  if (channels == 3) {
    for (; x + lanes <= count; x += lanes) {
      V a, b, c;
      hn::LoadInterleaved3(d, from + static_cast<ptrdiff_t>(3) * x, a, b, c);
      hn::StoreU(a, d, planes[0] + x), hn::StoreU(b, d, planes[1] + x), hn::StoreU(c, d, planes[2] + x);
    }
  } else if (channels == 4) {
    for (; x + lanes <= count; x += lanes) {
      V a, b, c, e;
      hn::LoadInterleaved4(d, from + static_cast<ptrdiff_t>(4) * x, a, b, c, e);
      hn::StoreU(a, d, planes[0] + x), hn::StoreU(b, d, planes[1] + x);
      hn::StoreU(c, d, planes[2] + x), hn::StoreU(e, d, planes[3] + x);
    }
  }
  for (; x < count; ++x) {
    for (int c = 0; c < channels; ++c) planes[c][x] = from[static_cast<ptrdiff_t>(x) * channels + c];
  }
}

NoiseKernels GridKernels() {
  return {Separate, Position, Octave, Displace, Accumulate, Clear, Fill, Row, Interleave, Fade};
}

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(GridKernels);
static NoiseKernels Best() { return HWY_DYNAMIC_DISPATCH(GridKernels)(); }
}  // namespace noise

NoiseKernels FindNoiseKernels() { return noise::Best(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
