// Batches of noise positions and values: from pixels to cells and fractions, octaves, warps, sums, and back
// to channels.
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/batch_kernel.cc"
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
    auto valid = hn::Lt(hn::Abs(p), limit);  // false for NaN
    V low = hn::Zero(d);
    if (a.low != nullptr) {
      low = hn::LoadU(d, a.low + i);
      valid = hn::And(valid, hn::Lt(hn::Abs(low), limit));
    }
    p = hn::IfThenElseZero(valid, p);
    if (a.low != nullptr) {
      // Whatever the two parts are: their sum, and its rounding error (Knuth's two-sum).
      low = hn::IfThenElseZero(valid, low);
      const V sum = hn::Add(p, low), back = hn::Sub(sum, p);
      low = hn::Add(hn::Sub(p, hn::Sub(sum, back)), hn::Sub(low, back));
      p = sum;
    }
    // floor of the product, and what is left of the exact product.
    const auto whole_of = [&](V v) HWY_ATTR { return a.scale.nearest ? hn::Round(v) : hn::Floor(v); };
    V whole = whole_of(hn::Mul(p, f0));
    V rest = s::RestOfProduct(p, f0, whole);
    rest = hn::MulAdd(p, f1, rest);
    rest = hn::Add(hn::MulAdd(low, f0, rest), offset);
    // Where floats hold every integer the fraction is brought into [0, 1); beyond, it keeps its whole part.
    const V carry = hn::IfThenElseZero(hn::Lt(hn::Abs(whole), hn::Set(d, 0x1p23f)), whole_of(rest));
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
      rest = hn::MulAdd(rest, s0, hn::MulAdd(cell, s1, s::RestOfProduct(cell, s0, whole)));
    }
    rest = hn::Add(rest, shift);
    const V carry = a.nearest ? hn::Round(rest) : hn::Floor(rest);
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

void Normal(float* const* slopes, int dims, int count, bool is_signed) {
  const s::D d;
  const V scale = hn::Set(d, is_signed ? 1.0f : 0.5f), bias = hn::Set(d, is_signed ? 0.0f : 0.5f);
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    V square = hn::Zero(d);
    for (int a = 0; a < dims && a < 3; ++a) {
      const V g = hn::LoadU(d, slopes[a] + i);
      square = hn::MulAdd(g, g, square);
    }
    const V length = hn::Sqrt(square);
    const auto none = hn::Eq(length, hn::Zero(d));
    for (int a = 0; a < 3; ++a) {
      const V g = a < dims ? hn::Div(hn::LoadU(d, slopes[a] + i), length) : hn::Zero(d);
      hn::StoreU(hn::MulAdd(hn::IfThenZeroElse(none, g), scale, bias), d, slopes[a] + i);
    }
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

NoiseKernels BatchKernels() {
  return {Separate, Position, Octave, Displace, Accumulate, Clear, Interleave, Fade, Normal};
}

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(BatchKernels);
static NoiseKernels Choose() { return HWY_DYNAMIC_DISPATCH(BatchKernels)(); }
}  // namespace noise

NoiseKernels FindNoiseKernels() { return noise::Choose(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
