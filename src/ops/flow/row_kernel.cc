// Rows of fields and noise brought to the form in which lines are followed.
#include "ops/flow/row_kernel.h"

#include <algorithm>
#include <cmath>

#include "ops/flow/lines.h"
#include "ops/flow/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/flow/row_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::flow::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using simd::HWY_NAMESPACE::D;
using simd::HWY_NAMESPACE::DI;
using simd::HWY_NAMESPACE::DU;
using simd::HWY_NAMESPACE::kLanes;
using simd::HWY_NAMESPACE::V;
using simd::HWY_NAMESPACE::VI;
using simd::HWY_NAMESPACE::VU;

// Which of the vectors are finite.
HWY_INLINE hn::Mask<D> Known(V u, V v) {
  const D d;
  const V most = hn::Set(d, hwy::HighestValue<float>());
  // False for NaN too.
  return hn::And(hn::Le(hn::Abs(u), most), hn::Le(hn::Abs(v), most));
}

template <bool kCopy>
RowFound LookAt(const float* from, int width, float* to) {
  const D d;
  V largest = hn::Zero(d), longest = hn::Zero(d);
  auto all_known = hn::Eq(largest, largest);
  const auto take = [&](const float* p, float* out) HWY_ATTR {
    V u, v;
    hn::LoadInterleaved2(d, p, u, v);
    const auto known = Known(u, v);
    all_known = hn::And(all_known, known);
    u = hn::IfThenElseZero(known, u), v = hn::IfThenElseZero(known, v);
    largest = hn::Max(largest, hn::Max(hn::Abs(u), hn::Abs(v)));
    longest = hn::Max(longest, hn::MulAdd(u, u, hn::Mul(v, v)));
    if constexpr (kCopy) hn::StoreInterleaved2(u, v, d, out);
    (void)out;
  };
  int x = 0;
  for (; x + kLanes <= width; x += kLanes) take(from + 2 * x, to + (kCopy ? 2 * x : 0));
  if (x < width) {
    float rest[2 * kLanes] = {};
    std::copy(from + 2 * x, from + 2 * width, rest);
    take(rest, rest);
    if constexpr (kCopy) std::copy(rest, rest + 2 * (width - x), to + 2 * x);
  }
  RowFound found;
  found.masked = !hn::AllTrue(d, all_known);
  found.largest = hn::GetLane(hn::MaxOfLanes(d, largest));
  found.squared = hn::GetLane(hn::MaxOfLanes(d, longest));
  return found;
}
RowFound CopyVectors(const float* from, int width, float* to) {
  return to != nullptr ? LookAt<true>(from, width, to) : LookAt<false>(from, width, to);
}

HWY_INLINE VU Scramble(VU h) {
  const DU du;
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<16>(h)), hn::Set(du, kMixFirst));
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<15>(h)), hn::Set(du, kMixSecond));
  return hn::Xor(h, hn::ShiftRight<16>(h));
}

void WhiteCodes(uint32_t row_key, int width, uint32_t* to) {
  const DU du;
  const VU step = hn::Set(du, kMixPlace * static_cast<uint32_t>(kLanes));
  VU place = hn::Mul(hn::Iota(du, 0), hn::Set(du, kMixPlace));
  for (int x = 0; x < width; x += kLanes, place = hn::Add(place, step)) {
    hn::StoreU(hn::ShiftRight<24>(Scramble(hn::Xor(place, hn::Set(du, row_key)))), du, to + x);
  }
}

void CellCodes(const float* uv, const uint32_t* noise, int width, float smallest, uint32_t* to) {
  const D d;
  const DI di;
  const DU du;
  const V half = hn::Set(d, 0.5f), one = hn::Set(d, 1.0f);
  const auto code_of = [&](const float* p, VU texel) HWY_ATTR {
    V u, v;
    hn::LoadInterleaved2(d, p, u, v);
    const auto known = Known(u, v);
    u = hn::IfThenElseZero(known, u), v = hn::IfThenElseZero(known, v);
    const auto still = hn::Lt(hn::MulAdd(u, u, hn::Mul(v, v)), hn::Set(d, smallest * smallest));
    // Halves: the sum is finite.
    const V size_u = hn::IfThenElse(still, one, hn::Mul(hn::Abs(u), half));
    const V size_v = hn::IfThenElse(still, one, hn::Mul(hn::Abs(v), half));
    const V share = hn::Div(hn::Mul(size_u, hn::Set(d, kCellWhole)), hn::Add(size_u, size_v));
    const VI rounded = hn::NearestInt(hn::Min(share, hn::Set(d, static_cast<float>(kCellShareMost))));
    const VU left = hn::ShiftRight<31>(hn::BitCast(du, u)), up = hn::ShiftRight<31>(hn::BitCast(du, v));
    VU code = hn::Or(left, hn::ShiftLeft<kCellUpShift>(up));
    const VI stays = hn::Set(di, static_cast<int>(kCellStill));
    code = hn::IfThenElse(hn::RebindMask(du, still), hn::BitCast(du, stays), code);
    code = hn::Or(code, hn::ShiftLeft<kCellShareShift>(hn::BitCast(du, rounded)));
    return hn::Or(code, hn::ShiftLeft<kCellNoiseShift>(texel));
  };
  int x = 0;
  for (; x + kLanes <= width; x += kLanes) {
    hn::StoreU(code_of(uv + 2 * x, hn::LoadU(du, noise + x)), du, to + x);
  }
  if (x < width) {
    float rest[2 * kLanes] = {};
    std::copy(uv + 2 * x, uv + 2 * width, rest);
    hn::StoreU(code_of(rest, hn::LoadU(du, noise + x)), du, to + x);
  }
}

RowKernels RowKernelsHere() { return {CopyVectors, WhiteCodes, CellCodes}; }

}  // namespace tessera::ops::flow::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::flow {

static_assert(kCellLeft == 1 && kCellUp == 1u << kCellUpShift);
HWY_EXPORT(RowKernelsHere);

RowKernels FindRowKernels() { return HWY_DYNAMIC_DISPATCH(RowKernelsHere)(); }

}  // namespace tessera::ops::flow
#endif  // HWY_ONCE
