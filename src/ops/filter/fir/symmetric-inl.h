// Sums under weights that read the same from both ends: the two samples that share a weight are added first,
// which halves the multiplications, and additions have units of their own. Groups and their order are the
// same on every target. Two samples beyond half of the largest float add to infinity.
#if defined(TESSERA_OPS_FILTER_FIR_SYMMETRIC_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_FIR_SYMMETRIC_INL_H_
#undef TESSERA_OPS_FILTER_FIR_SYMMETRIC_INL_H_
#else
#define TESSERA_OPS_FILTER_FIR_SYMMETRIC_INL_H_
#endif

#include <hwy/cache_control.h>

#include <array>
#include <utility>
#include <vector>

#include "ops/filter/fir/fir-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {

constexpr int kShortRow = 31;  // up to here a row's samples and their shifts lie in registers

inline bool IsSymmetric(const std::vector<float>& weights) {
  if (weights.size() % 2 == 0 || weights.size() < 3) return false;
  for (size_t i = 0; i < weights.size() / 2; ++i) {
    if (weights[i] != weights[weights.size() - 1 - i]) return false;
  }
  return true;
}

// kR rows of column sums of one vector: the samples that all rows read above and below their middle move
// through registers.
template <int kR>
HWY_INLINE void SymmetricColumn(const float* HWY_RESTRICT weights, int taps, const float* in,
                                ptrdiff_t stride, float* out, ptrdiff_t out_stride) {
  const int half = taps / 2;
  V above[kR], below[kR], acc[kR];
  HWY_UNROLL(8)
  for (int r = 0; r < kR; ++r) {
    above[r] = Load(in + r * stride);
    below[r] = Load(in + (taps - 1 + r) * stride);
    acc[r] = Nothing();
    hwy::Prefetch(in + (taps - 1 + kR + r) * stride);
  }
  const float* next_above = in + kR * stride;
  const float* next_below = in + (taps - 2) * stride;
  for (int t = 0; t < half; ++t, next_above += stride, next_below -= stride) {
    const V w = hn::Set(D(), weights[t]);
    HWY_UNROLL(8)
    for (int r = 0; r < kR; ++r) acc[r] = hn::MulAdd(hn::Add(above[r], below[r]), w, acc[r]);
    HWY_UNROLL(8)
    for (int r = 0; r + 1 < kR; ++r) above[r] = above[r + 1];
    HWY_UNROLL(8)
    for (int r = kR - 1; r > 0; --r) below[r] = below[r - 1];
    above[kR - 1] = Load(next_above);
    below[0] = Load(next_below);
  }
  const V w = hn::Set(D(), weights[half]);
  HWY_UNROLL(8)
  for (int r = 0; r < kR; ++r) hn::StoreU(hn::MulAdd(above[r], w, acc[r]), D(), out + r * out_stride);
}

// Vectors side by side, which share their weights and do not wait for each other.
constexpr int kAbreast = 4;

// acc += weight * (sample, plus its mirror image where that is another one), for taps k of a row.
template <int kJ>
HWY_INLINE void AddMirrored(const float* HWY_RESTRICT weights, int taps, const float* in, int channels, int k,
                            V (&acc)[kJ]) {
  const V weight = hn::Set(D(), weights[k]);
  const float* const low = in + k * channels;
  const float* const high = in + (taps - 1 - k) * channels;
  if (low == high) {
    for (int j = 0; j < kJ; ++j) acc[j] = hn::MulAdd(Load(low + j * kLanes), weight, acc[j]);
    return;
  }
  for (int j = 0; j < kJ; ++j) {
    acc[j] = hn::MulAdd(hn::Add(Load(low + j * kLanes), Load(high + j * kLanes)), weight, acc[j]);
  }
}

// acc += the taps of a group, k = first, first + 4, ... below `end`, none of which is the middle one. Where
// vectors hold two RGBA pixels, two of four abreast stay from one tap to the next, and two of their mirror
// images.
template <int kJ>
HWY_INLINE void AddGroup(const float* HWY_RESTRICT weights, int taps, const float* in, int channels,
                         int first, int end, V (&acc)[kJ]) {
  if constexpr (kLanes == 8 && kJ == kAbreast) {
    if (channels == 4 && first < end) {
      const float* low = in + 4 * first;
      const float* high = in + 4 * (taps - 1 - first);
      V l[kJ], h[kJ];
      for (int j = 0; j < kJ; ++j) l[j] = Load(low + j * kLanes), h[j] = Load(high + j * kLanes);
#pragma GCC unroll 8
      for (int k = first; k < end; k += 4) {
        const V weight = hn::Set(D(), weights[k]);
        for (int j = 0; j < kJ; ++j) acc[j] = hn::MulAdd(hn::Add(l[j], h[j]), weight, acc[j]);
        if (k + 4 >= end) return;
        low += 16, high -= 16;
        l[0] = l[2], l[1] = l[3], h[2] = h[0], h[3] = h[1];
        for (int j = 0; j < 2; ++j) l[j + 2] = Load(low + (j + 2) * kLanes), h[j] = Load(high + j * kLanes);
      }
    }
  }
#pragma GCC unroll 8
  for (int k = first; k < end; k += 4) AddMirrored(weights, taps, in, channels, k, acc);
}

// Taps k, k + 4, ... are a group, as without symmetry; a group whose mirror image is another one contains it.
template <int kJ>
HWY_INLINE void ShortRowSum(const float* HWY_RESTRICT weights, int taps, const float* in, int channels,
                            V (&total)[kJ]) {
  for (V& v : total) v = Nothing();
#pragma GCC unroll 4
  for (int g = 0; g < 4; ++g) {
    const int mirrored = (taps - 1 - g) & 3;
    if (mirrored < g) continue;
    V acc[kJ];
    for (V& v : acc) v = Nothing();
    const int half = taps / 2;
    AddGroup(weights, taps, in, channels, g, mirrored > g ? taps : half, acc);
    if (mirrored == g && half % 4 == g) AddMirrored(weights, taps, in, channels, half, acc);
    for (int j = 0; j < kJ; ++j) total[j] = hn::Add(total[j], acc[j]);
  }
}

// Longer rows: every group holds its taps of the first half, each with its mirror image.
template <int kJ>
HWY_INLINE void LongRowSum(const float* HWY_RESTRICT weights, int taps, const float* in, int channels,
                           V (&total)[kJ]) {
  const int half = taps / 2;
  for (V& v : total) v = Nothing();
  for (int g = 0; g < 4; ++g) {
    V acc[kJ];
    for (V& v : acc) v = Nothing();
    AddGroup(weights, taps, in, channels, g, half, acc);
    if (half % 4 == g) AddMirrored(weights, taps, in, channels, half, acc);
    for (int j = 0; j < kJ; ++j) total[j] = hn::Add(total[j], acc[j]);
  }
}

// The samples under a row of kTaps in aligned registers, and the same two pixels on: a group that contains
// its mirror image needs no other shift than its sum's.
template <int kTaps>
struct SymmetricRow {
  static constexpr int kLast = (kTaps - 1) / 4;  // register of the last tap
  // The first group that has a mirror image of its own: 0 and 2, or 1 and 3, share their weights.
  static constexpr int kPaired = kTaps % 4 == 3 ? 0 : 1;
  V v[kLast + 2], ahead[kLast + 1];

  HWY_INLINE explicit SymmetricRow(const float* in) {
    HWY_UNROLL(16)
    for (int i = 0; i <= kLast + 1; ++i) v[i] = Load(in + i * kLanes);
    HWY_UNROLL(16)
    for (int i = 0; i <= kLast; ++i) ahead[i] = s::ShiftBlocks<2>(v[i], v[i + 1]);
  }
  HWY_INLINE void Move(const float* in) {
    HWY_UNROLL(16)
    for (int i = 0; i <= kLast; ++i) v[i] = v[i + 1];
    HWY_UNROLL(16)
    for (int i = 0; i < kLast; ++i) ahead[i] = ahead[i + 1];
    v[kLast + 1] = Load(in + (kLast + 1) * kLanes);
    ahead[kLast] = s::ShiftBlocks<2>(v[kLast], v[kLast + 1]);
  }
  template <int kGroup>
  HWY_INLINE V Sum(const float* HWY_RESTRICT weights) const {
    V acc = Nothing();
    HWY_UNROLL(16)
    for (int k = kGroup; kGroup == kPaired ? k < kTaps : 2 * k <= kTaps - 1; k += 4) {
      const int mirror = kTaps - 1 - k;
      V sample = v[k / 4];
      if (k != mirror) sample = hn::Add(sample, kGroup == kPaired ? ahead[mirror / 4] : v[mirror / 4]);
      acc = hn::MulAdd(sample, hn::Set(D(), weights[k]), acc);
    }
    return acc;
  }
};

// `in` is padded by two registers beyond its last tap.
template <int kTaps>
HWY_INLINE void ShortRowOfFours(const float* HWY_RESTRICT weights, const float* in, const float* soon,
                                int floats, float* out, bool stream) {
  using Samples = SymmetricRow<kTaps>;
  constexpr int kThird = Samples::kPaired == 0 ? 3 : 2;
  Samples samples(in);
  V group0 = samples.template Sum<0>(weights), group1 = samples.template Sum<1>(weights),
    third = samples.template Sum<kThird>(weights);
  for (int x = 0; x < floats; x += kLanes) {
    hwy::Prefetch(soon + x);
    samples.Move(in + x + kLanes);
    const V next0 = samples.template Sum<0>(weights), next1 = samples.template Sum<1>(weights),
            next_third = samples.template Sum<kThird>(weights);
    V sum = hn::Add(group0, s::ShiftBlocks<1>(group1, next1));
    if (kTaps > kThird) sum = hn::Add(sum, s::ShiftBlocks<kThird>(third, next_third));
    StorePart(sum, out + x, floats - x, stream);
    group0 = next0, group1 = next1, third = next_third;
  }
}

// The group sums of one register of a longer row. The mirror images of two groups lie in whole registers,
// counted from the last tap, those of the other two half a register off; each step needs one more of both
// kinds. Where there are 4 n + 1 taps, group 0 is among the first two.
template <bool kWholeFirst>
HWY_INLINE void LongGroups(const float* HWY_RESTRICT weights, int taps, const float* in, V (&acc)[4]) {
  const int half = taps / 2;
  const float* mirror = in + (taps - 1) / 4 * kLanes;
  V whole = Load(mirror), before = Load(mirror - kLanes);
  V off = kWholeFirst ? s::ShiftBlocks<2>(before, whole) : s::ShiftBlocks<2>(whole, Load(mirror + kLanes));
  for (V& a : acc) a = Nothing();
  const auto add = [&](int g, int k, V low, V high) HWY_ATTR {
    acc[g] = hn::MulAdd(hn::Add(low, high), hn::Set(D(), weights[k + g]), acc[g]);
  };
  int k = 0;
  for (; k + 4 <= half; k += 4, in += kLanes) {
    const V low = Load(in);
    mirror -= kLanes;
    const V next = Load(mirror - kLanes),
            next_off = s::ShiftBlocks<2>(kWholeFirst ? next : before, kWholeFirst ? before : whole);
    add(0, k, low, kWholeFirst ? whole : off);
    add(1, k, low, kWholeFirst ? off : whole);
    add(2, k, low, kWholeFirst ? before : next_off);
    add(3, k, low, kWholeFirst ? next_off : before);
    whole = before, before = next, off = next_off;
  }
  const V low = Load(in);
  const int rest = half - k;
  if (rest > 0) add(0, k, low, kWholeFirst ? whole : off);
  if (rest > 1) add(1, k, low, kWholeFirst ? off : whole);
  if (rest > 2) add(2, k, low, kWholeFirst ? before : s::ShiftBlocks<2>(before, whole));
  acc[rest] = hn::MulAdd(low, hn::Set(D(), weights[half]), acc[rest]);
}

template <bool kWholeFirst>
void LongRowRgba(const std::vector<float>& row, const float* in, const float* soon, int floats, float* out,
                 bool stream) {
  const int taps = static_cast<int>(row.size());
  V now[4], next[4];
  LongGroups<kWholeFirst>(row.data(), taps, in, now);
  for (int x = 0; x < floats; x += kLanes) {
    hwy::Prefetch(soon + x);
    LongGroups<kWholeFirst>(row.data(), taps, in + x + kLanes, next);
    V sum = hn::Add(now[0], s::ShiftBlocks<1>(now[1], next[1]));
    sum = hn::Add(sum, s::ShiftBlocks<2>(now[2], next[2]));
    sum = hn::Add(sum, s::ShiftBlocks<3>(now[3], next[3]));
    StorePart(sum, out + x, floats - x, stream);
    for (int g = 0; g < 4; ++g) now[g] = next[g];
  }
}

// RGBA under a short row of kTaps, loops without ends.
template <int kTaps>
void SymmetricRowRgba(const float* HWY_RESTRICT weights, const float* in, const float* soon, int floats,
                      float* out, bool stream) {
  if constexpr (kFourPixels) return ShortRowOfFours<kTaps>(weights, in, soon, floats, out, stream);
  int x = 0;
  for (; x + kAbreast * kLanes <= floats; x += kAbreast * kLanes) {
    for (int j = 0; j < kAbreast; j += 2) hwy::Prefetch(soon + x + j * kLanes);
    V sum[kAbreast];
    ShortRowSum(weights, kTaps, in + x, 4, sum);
    for (int j = 0; j < kAbreast; ++j) Store(sum[j], out + x + j * kLanes, stream);
  }
  for (; x < floats; x += kLanes) {
    V sum[1];
    ShortRowSum(weights, kTaps, in + x, 4, sum);
    StorePart(sum[0], out + x, floats - x, stream);
  }
}

using SymmetricRowFunction = void (*)(const float*, const float*, const float*, int, float*, bool);
template <int... kHalves>
constexpr std::array<SymmetricRowFunction, sizeof...(kHalves)> SymmetricRows(
    std::integer_sequence<int, kHalves...>) {
  return {SymmetricRowRgba<2 * kHalves + 3>...};
}

// One row of sums of `floats` samples under a symmetric row; as many samples at `soon`, which the next block
// of rows begins with, are fetched meanwhile.
inline void RunSymmetricRow(const std::vector<float>& row, const float* in, const float* soon, int floats,
                            int channels, float* out, bool stream) {
  const int taps = static_cast<int>(row.size());
  static constexpr auto kRows = SymmetricRows(std::make_integer_sequence<int, (kShortRow - 1) / 2>());
  if (channels == 4 && taps <= kShortRow) {
    return kRows[static_cast<size_t>(taps - 3) / 2](row.data(), in, soon, floats, out, stream);
  }
  if constexpr (kFourPixels) {
    if (channels == 4) {
      return taps % 4 == 1 ? LongRowRgba<true>(row, in, soon, floats, out, stream)
                           : LongRowRgba<false>(row, in, soon, floats, out, stream);
    }
  }
  const auto run = [&]<int kJ>(int x) HWY_ATTR {
    for (int j = 0; j < kJ; ++j) hwy::Prefetch(soon + x + j * kLanes);
    V sum[kJ];
    taps <= kShortRow ? ShortRowSum(row.data(), taps, in + x, channels, sum)
                      : LongRowSum(row.data(), taps, in + x, channels, sum);
    for (int j = 0; j < kJ; ++j) {
      StorePart(sum[j], out + x + j * kLanes, floats - x - j * kLanes, stream);
    }
  };
  int x = 0;
  for (; x + kAbreast * kLanes <= floats; x += kAbreast * kLanes) run.template operator()<kAbreast>(x);
  for (; x < floats; x += kLanes) run.template operator()<1>(x);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
