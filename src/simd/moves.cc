// Bytes moved between rows of pixels. Bound by memory: one shuffle of 16 bytes moves as many pixels as fit,
// if they do not fill them through a buffer in the first cache.
#include <algorithm>
#include <cstdint>
#include <cstring>

#include "base/prefetch.h"
#include "simd/pixels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/moves.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {

void CopyAround(const std::byte* from, size_t bytes, std::byte* to) {
  const hn::ScalableTag<uint8_t> d;
  constexpr size_t kBytes = hn::MaxLanes(d);
  size_t i = std::min(bytes, -reinterpret_cast<uintptr_t>(to) % kBytes);
  std::memcpy(to, from, i);
  for (; i + kBytes <= bytes; i += kBytes) {
    hn::Stream(hn::LoadU(d, reinterpret_cast<const uint8_t*>(from + i)), d,
               reinterpret_cast<uint8_t*>(to + i));
  }
  std::memcpy(to + i, from + i, bytes - i);
}
void Copy(const std::byte* from, size_t bytes, std::byte* to, bool around) {
  if (around) return CopyAround(from, bytes, to);
  std::memcpy(to, from, bytes);
}

// Pixels [first, last) one by one, each read before it is written.
HWY_INLINE void MoveSlowly(const Moves& m, const std::byte* const* from, int first, int last,
                           std::byte* result) {
  for (int i = first; i < last; ++i, result += m.result_bytes) {
    std::byte pixel[kMostMovedBytes];
    for (int b = 0; b < m.result_bytes; ++b) {
      const Moves::Byte& byte = m.result[b];
      pixel[b] = byte.input < 0 ? byte.constant
                                : from[byte.input][ptrdiff_t{i} * m.input_bytes[byte.input] + byte.place];
    }
    std::memcpy(result, pixel, static_cast<size_t>(m.result_bytes));
  }
}

// How many pixels 16 bytes of every input, and of the result, hold.
int StepOf(const Moves& m) {
  int step = kMostMovedBytes / m.result_bytes;
  for (int k = 0; k < m.inputs; ++k) step = std::min(step, kMostMovedBytes / m.input_bytes[k]);
  return step;
}

// Pixels [first, last) of rows of `count` to `result`, which has room for 16 bytes more, or is written in
// whole 16 bytes. `around`: around the cache; then it is aligned to them.
template <int kInputs>
HWY_INLINE void MoveChunk(const Moves& m, const std::byte* const* from, int first, int last, int count,
                          std::byte* result, bool around) {
  int i = first;
  const hn::FixedTag<uint8_t, 16> d;
  const int step = StepOf(m);
  int end = last;  // pixels from here on may be too near the end of a row to load 16 bytes
  for (int k = 0; k < kInputs; ++k) end = std::min(end, count - (kMostMovedBytes - 1) / m.input_bytes[k]);
  alignas(16) uint8_t picks[kInputs][16], constants[16] = {};
  std::memset(picks, 128, sizeof(picks));
  for (int s = 0; s < step; ++s) {
    for (int b = 0; b < m.result_bytes; ++b) {
      const Moves::Byte& byte = m.result[b];
      const int at = s * m.result_bytes + b;
      if (byte.input < 0) {
        constants[at] = static_cast<uint8_t>(byte.constant);
      } else {
        picks[byte.input][at] = static_cast<uint8_t>(s * m.input_bytes[byte.input] + byte.place);
      }
    }
  }
  const auto pick = [&](int k) HWY_ATTR { return hn::Load(d, picks[k]); };
  const auto constant = hn::Load(d, constants), pick0 = pick(0), pick1 = pick(kInputs > 1 ? 1 : 0),
             pick2 = pick(kInputs > 2 ? 2 : 0), pick3 = pick(kInputs > 3 ? 3 : 0);
  const auto taken = [&](int k, auto places) HWY_ATTR {
    const std::byte* const p = from[k] + ptrdiff_t{i} * m.input_bytes[k];
    base::PrefetchAhead(p, 1);
    return hn::TableLookupBytesOr0(hn::LoadU(d, reinterpret_cast<const uint8_t*>(p)), places);
  };
  const auto run = [&](const auto& store) HWY_ATTR {
    for (; i + step <= end; i += step) {
      auto v = hn::Or(constant, taken(0, pick0));
      if constexpr (kInputs > 1) v = hn::Or(v, taken(1, pick1));
      if constexpr (kInputs > 2) v = hn::Or(v, taken(2, pick2));
      if constexpr (kInputs > 3) v = hn::Or(v, taken(3, pick3));
      store(v, reinterpret_cast<uint8_t*>(result));
      result += ptrdiff_t{step} * m.result_bytes;
    }
  };
  if (around) {
    run([d](auto v, uint8_t* to) HWY_ATTR { hn::Stream(v, d, to); });
  } else {
    run([d](auto v, uint8_t* to) HWY_ATTR { hn::StoreU(v, d, to); });
  }
  (void)count, (void)around;
  MoveSlowly(m, from, i, last, result);
}

template <int kInputs>
void MoveRow(const Moves& m, const std::byte* const* from, int count, std::byte* to, bool around) {
  // Whole 16 bytes need no buffer.
  const bool whole = StepOf(m) * m.result_bytes == kMostMovedBytes;
  if (whole && (!around || reinterpret_cast<uintptr_t>(to) % kMostMovedBytes == 0)) {
    return MoveChunk<kInputs>(m, from, 0, count, count, to, around);
  }
  constexpr int kChunk = 512;
  alignas(64) std::byte buffer[kChunk * kMostMovedBytes + kMostMovedBytes];
  for (int first = 0; first < count; first += kChunk) {
    const int last = std::min(count, first + kChunk);
    MoveChunk<kInputs>(m, from, first, last, count, buffer, false);
    std::byte* const at = to + ptrdiff_t{first} * m.result_bytes;
    const auto bytes = static_cast<size_t>(last - first) * static_cast<size_t>(m.result_bytes);
    if (around) {
      CopyAround(buffer, bytes, at);
    } else {
      std::memcpy(at, buffer, bytes);
    }
  }
}

void MoveAll(const Moves& m, const std::byte* const* from, int count, std::byte* to, bool around) {
  switch (m.inputs) {
    case 1:
      return MoveRow<1>(m, from, count, to, around);
    case 2:
      return MoveRow<2>(m, from, count, to, around);
    case 3:
      return MoveRow<3>(m, from, count, to, around);
    default:
      return MoveRow<4>(m, from, count, to, around);
  }
}

MoveFunctions Functions() { return {MoveAll, Copy}; }

}  // namespace
}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::simd {

HWY_EXPORT(Functions);

MoveFunctions CurrentMoveFunctions() { return HWY_DYNAMIC_DISPATCH(Functions)(); }

}  // namespace tessera::simd
#endif
