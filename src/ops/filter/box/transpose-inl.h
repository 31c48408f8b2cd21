// Sums of rows transposed into vectors of kBoxLines rows, and results transposed back.
#if defined(TESSERA_OPS_FILTER_BOX_TRANSPOSE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_BOX_TRANSPOSE_INL_H_
#undef TESSERA_OPS_FILTER_BOX_TRANSPOSE_INL_H_
#else
#define TESSERA_OPS_FILTER_BOX_TRANSPOSE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "ops/filter/box/codes.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D32 = hn::CappedTag<uint32_t, kBoxLines>;
using DI32 = hn::RebindToSigned<D32>;
using DF32 = hn::Rebind<float, D32>;
using V32 = hn::Vec<D32>;
constexpr int kLanes32 = static_cast<int>(hn::MaxLanes(D32()));
constexpr int kVectors32 = kBoxLines / kLanes32;
// Sums of as many columns as a vector holds, and 128 bits of them.
template <class T>
using DC = hn::CappedTag<ColumnSum<T>, 32 / sizeof(ColumnSum<T>)>;
template <class T>
using DQ = hn::Full128<T>;

// The 128 bits b of a vector.
template <int b, class D>
HWY_INLINE hn::Vec<DQ<hn::TFromD<D>>> Quarter(D d, hn::Vec<D> v) {
  if constexpr (sizeof(hn::TFromD<D>) * hn::MaxLanes(D()) == 16) {
    return v;
  } else {
    const hn::Half<D> half;
    (void)d;
    if constexpr (b == 0) return hn::LowerHalf(half, v);
    if constexpr (b == 1) return hn::UpperHalf(half, v);
  }
}

// Four vectors a to d of dwords: within every 128 bits the dword k of each to vector k.
template <class V>
HWY_INLINE void TransposeFour(V& a, V& b, V& c, V& d) {
  const hn::Repartition<uint64_t, D32> d64;
  const D32 d32;
  const auto wide = [&](V v) HWY_ATTR { return hn::BitCast(d64, v); };
  const auto ab0 = wide(hn::InterleaveLower(d32, a, b)), ab1 = wide(hn::InterleaveUpper(d32, a, b));
  const auto cd0 = wide(hn::InterleaveLower(d32, c, d)), cd1 = wide(hn::InterleaveUpper(d32, c, d));
  a = hn::BitCast(d32, hn::InterleaveLower(d64, ab0, cd0));
  b = hn::BitCast(d32, hn::InterleaveUpper(d64, ab0, cd0));
  c = hn::BitCast(d32, hn::InterleaveLower(d64, ab1, cd1));
  d = hn::BitCast(d32, hn::InterleaveUpper(d64, ab1, cd1));
}

// Vectors of kBoxLines rows to `to`, kBoxLines sums of every column.
HWY_INLINE void StoreTransposed(hn::Vec<DC<uint8_t>> (&rows)[kBoxLines], uint16_t* HWY_RESTRICT to) {
  const DC<uint8_t> d;
  const hn::Repartition<uint32_t, decltype(d)> d32;
  const hn::Repartition<uint64_t, decltype(d)> d64;
  hn::Vec<decltype(d32)> pairs[8];
  for (int i = 0; i < 4; ++i) {
    pairs[i] = hn::BitCast(d32, hn::InterleaveLower(d, rows[2 * i], rows[2 * i + 1]));
    pairs[i + 4] = hn::BitCast(d32, hn::InterleaveUpper(d, rows[2 * i], rows[2 * i + 1]));
  }
  for (int h = 0; h < 2; ++h) {
    const auto* const p = pairs + 4 * h;
    const auto a0 = hn::BitCast(d64, hn::InterleaveLower(d32, p[0], p[1])),
               a1 = hn::BitCast(d64, hn::InterleaveUpper(d32, p[0], p[1])),
               b0 = hn::BitCast(d64, hn::InterleaveLower(d32, p[2], p[3])),
               b1 = hn::BitCast(d64, hn::InterleaveUpper(d32, p[2], p[3]));
    const hn::Vec<decltype(d)> columns[4] = {
        hn::BitCast(d, hn::InterleaveLower(d64, a0, b0)), hn::BitCast(d, hn::InterleaveUpper(d64, a0, b0)),
        hn::BitCast(d, hn::InterleaveLower(d64, a1, b1)), hn::BitCast(d, hn::InterleaveUpper(d64, a1, b1))};
    for (int k = 0; k < 4; ++k) {
      uint16_t* const at = to + (4 * h + k) * kBoxLines;
      hn::StoreU(Quarter<0>(d, columns[k]), DQ<uint16_t>(), at);
      if constexpr (hn::MaxLanes(d) == 16)
        hn::StoreU(Quarter<1>(d, columns[k]), DQ<uint16_t>(), at + 8 * kBoxLines);
    }
  }
}
HWY_INLINE void StoreTransposed(hn::Vec<DC<uint16_t>> (&rows)[kBoxLines], uint32_t* HWY_RESTRICT to) {
  const DC<uint16_t> d;
  for (int h = 0; h < 2; ++h) {
    auto* const v = rows + 4 * h;
    TransposeFour(v[0], v[1], v[2], v[3]);
    for (int k = 0; k < 4; ++k) {
      uint32_t* const at = to + k * kBoxLines + 4 * h;
      hn::StoreU(Quarter<0>(d, v[k]), DQ<uint32_t>(), at);
      if constexpr (hn::MaxLanes(d) == 8) hn::StoreU(Quarter<1>(d, v[k]), DQ<uint32_t>(), at + 4 * kBoxLines);
    }
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
