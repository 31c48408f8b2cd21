// Sums of codes that run down columns and along rows: whole numbers, so that what leaves the window leaves no
// trace. Eight rows of results go through together: their columns' sums are transposed into vectors of eight
// rows, so that a sum that runs along the row is one addition and one subtraction for any number of channels.
#include "ops/filter/box/codes.h"

#include <algorithm>
#include <vector>

#include "base/prefetch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/box/codes.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/filter/box/transpose-inl.h"
#include "ops/filter/codes/codes-inl.h"
#include "simd/rows-inl.h"

#ifndef TESSERA_OPS_FILTER_BOX_CODES_CC_
#define TESSERA_OPS_FILTER_BOX_CODES_CC_
namespace tessera::ops {

constexpr int kBoxUnit = 16;  // samples of a row, that go through together

// A strip of a tile: results [first, first + count) of every row.
template <class T>
struct BoxCodesStrip {
  BoxTile<T> tile;
  int first = 0, count = 0;
  ColumnSum<T>* sums = nullptr;        // of the columns under the rows to come
  ColumnSum<T>* transposed = nullptr;  // kBoxLines of them per sample
  uint32_t* kept = nullptr;            // sums that run along the rows, kBoxLines per channel

  int seen() const { return count + (tile.width - 1) * tile.channels; }
};

// Sums over `area` codes to means, rounded half to even.
struct BoxArea {
  int area = 1;
  float inverse = 1;
  bool multiplied = false;  // sums times `inverse` give the same results
};

}  // namespace tessera::ops
#endif  // TESSERA_OPS_FILTER_BOX_CODES_CC_

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;

template <class T>
HWY_INLINE hn::Vec<DC<T>> Wide(const T* p) {
  return hn::PromoteTo(DC<T>(), hn::LoadU(hn::Rebind<T, DC<T>>(), p));
}

// The sums of the columns of kBoxLines rows of results from row y on.
template <class T>
void TransposeColumns(const BoxCodesStrip<T>& s, int y) {
  const BoxTile<T>& t = s.tile;
  const DC<T> d;
  constexpr int kStep = static_cast<int>(hn::MaxLanes(DC<T>()));
  const int last = t.rows + t.height - 2;
  const T *leave[kBoxLines], *enter[kBoxLines], *next[kBoxLines];
  for (int r = 0; r < kBoxLines; ++r) {
    // Beyond the last row sums go on as they are, and nobody looks at them.
    const bool moves = y + r + 1 < t.rows;
    leave[r] = t.lines[moves ? y + r : last] + s.first;
    enter[r] = t.lines[moves ? y + r + t.height : last] + s.first;
    next[r] = t.lines[std::min(y + r + t.height + kBoxLines, last)] + s.first;
  }
  const int seen = s.seen();
  for (int i = 0; i < seen; i += kStep) {
    auto sum = hn::Load(d, s.sums + i);
    hn::Vec<DC<T>> rows[kBoxLines];
    HWY_UNROLL(8)
    for (int r = 0; r < kBoxLines; ++r) {
      rows[r] = sum;
      sum = hn::Add(sum, hn::Sub(Wide(enter[r] + i), Wide(leave[r] + i)));
    }
    hn::Store(sum, d, s.sums + i);
    StoreTransposed(rows, s.transposed + ptrdiff_t{i} * kBoxLines);
    if (i % static_cast<int>(64 / sizeof(T)) == 0) {
      for (int r = 0; r < kBoxLines; ++r) base::PrefetchSecond(next[r] + i);
    }
  }
}

// One number for each of kBoxLines rows.
struct Lines {
  V32 v[kVectors32];
};

HWY_INLINE Lines LoadLines(const uint16_t* p) {
  Lines r;
  for (int j = 0; j < kVectors32; ++j)
    r.v[j] = hn::PromoteTo(D32(), hn::LoadU(hn::Rebind<uint16_t, D32>(), p + j * kLanes32));
  return r;
}
HWY_INLINE Lines LoadLines(const uint32_t* p) {
  Lines r;
  for (int j = 0; j < kVectors32; ++j) r.v[j] = hn::LoadU(D32(), p + j * kLanes32);
  return r;
}

// A mean of bytes with the bits of a float from 2^23 on above it: such floats are the whole numbers, and
// their sums are rounded half to even. A quotient of sums below 2^24 is rounded to no tie.
constexpr float kWholes = 0x1p23f;
template <bool kMultiplied>
HWY_INLINE V32 RoundedByte(V32 sum, V32 area) {
  const auto f = hn::ConvertTo(DF32(), hn::BitCast(DI32(), sum));
  const auto by = hn::BitCast(DF32(), area), wholes = hn::Set(DF32(), kWholes);
  return hn::BitCast(D32(), kMultiplied ? hn::MulAdd(f, by, wholes) : hn::Add(hn::Div(f, by), wholes));
}

// A mean of words: nearly, and mended by what is left.
HWY_INLINE V32 RoundedWord(V32 sum, V32 area, float twice_inverse) {
  const DI32 i32;
  const D32 u32;
  const auto f = hn::ConvertTo(DF32(), hn::BitCast(i32, hn::ShiftRight<1>(sum)));
  const auto near = hn::BitCast(
      u32, hn::And(hn::BitCast(i32, hn::MulAdd(f, hn::Set(DF32(), twice_inverse), hn::Set(DF32(), kWholes))),
                   hn::Set(i32, 0x7fffff)));
  const auto left = hn::BitCast(i32, hn::Sub(sum, hn::Mul(near, area))), twice = hn::Add(left, left);
  const auto odd = hn::And(hn::BitCast(i32, near), hn::Set(i32, 1)), whole = hn::BitCast(i32, area);
  const auto up = hn::VecFromMask(i32, hn::Gt(hn::Add(odd, twice), whole));
  const auto down = hn::VecFromMask(i32, hn::Gt(hn::Sub(odd, twice), whole));
  return hn::BitCast(u32, hn::Add(hn::Sub(hn::BitCast(i32, near), up), down));
}

// Whether a product rounds as the quotient of all sums does: both rise with the sum, so that the sums beside
// the middles between two means are all that need be looked at.
bool MayMultiply(int area, float inverse) {
  const V32 by = hn::BitCast(D32(), hn::Set(DF32(), inverse));
  for (uint32_t k = 0; k < 255; ++k) {
    const uint32_t twice = (2 * k + 1) * static_cast<uint32_t>(area), below = twice / 2;
    const auto mean = [&](uint32_t sum)
                          HWY_ATTR { return hn::GetLane(RoundedByte<true>(hn::Set(D32(), sum), by)) & 255; };
    const bool tie = twice % 2 == 0;
    if (mean(tie ? below - 1 : below) != k || mean(below + 1) != k + 1) return false;
    if (tie && mean(below) != k + k % 2) return false;
  }
  return true;
}

// The sums of kBoxLines rows moved on to the next pixel.
template <class T>
HWY_INLINE Lines NextSum(const ColumnSum<T>* transposed, ptrdiff_t window, const Lines& sum) {
  const Lines enters = LoadLines(transposed + window), leaves = LoadLines(transposed);
  Lines next;
  for (int j = 0; j < kVectors32; ++j) next.v[j] = hn::Add(sum.v[j], hn::Sub(enters.v[j], leaves.v[j]));
  return next;
}
HWY_INLINE void StoreLines(const Lines& lines, uint32_t* p) {
  for (int j = 0; j < kVectors32; ++j) hn::StoreU(lines.v[j], D32(), p + j * kLanes32);
}

// kBoxLines rows of results. kChannels: of a pixel, or 0 for any number, whose sums are then in memory.
template <class T, class Out, int kChannels, bool kMultiplied>
void SumAlong(const BoxCodesStrip<T>& s, const BoxArea& area, Out* const* out) {
  constexpr int kOf = static_cast<int>(4 / sizeof(Out));  // results in a dword
  constexpr int kGroup = 4 * kOf;                         // results in 128 bits
  const int channels = s.tile.channels;
  const ptrdiff_t pixel = ptrdiff_t{channels} * kBoxLines, window = s.tile.width * pixel;
  const auto* transposed = s.transposed;
  constexpr int kSums = kChannels == 0 ? 1 : kChannels;
  [[maybe_unused]] Lines sums[kSums];
  for (int c = 0; c < channels; ++c) {
    Lines sum;
    for (V32& v : sum.v) v = hn::Zero(D32());
    const auto* p = transposed + c * kBoxLines;
    for (int x = 0; x < s.tile.width; ++x, p += pixel) {
      const Lines column = LoadLines(p);
      for (int j = 0; j < kVectors32; ++j) sum.v[j] = hn::Add(sum.v[j], column.v[j]);
    }
    if constexpr (kChannels == 0) {
      StoreLines(sum, s.kept + c * kBoxLines);
    } else {
      sums[c] = sum;
    }
  }
  const V32 by = kMultiplied && sizeof(T) == 1 ? hn::BitCast(D32(), hn::Set(DF32(), area.inverse))
                 : sizeof(T) == 1 ? hn::BitCast(D32(), hn::Set(DF32(), static_cast<float>(area.area)))
                                  : hn::Set(D32(), static_cast<uint32_t>(area.area));
  const float twice_inverse = static_cast<float>(2.0 / area.area);
  [[maybe_unused]] int channel = 0;
  for (int i = 0; i < s.count; i += kGroup) {
    Lines dwords[4];
    HWY_UNROLL(4)
    for (int k = 0; k < 4; ++k) {
      HWY_UNROLL(4)
      for (int n = 0; n < kOf; ++n) {
        const int at = k * kOf + n;
        const auto* const from = transposed + ptrdiff_t{i + at} * kBoxLines;
        Lines now;
        if constexpr (kChannels == 0) {
          uint32_t* const kept = s.kept + channel * kBoxLines;
          now = LoadLines(kept);
          StoreLines(NextSum<T>(from, window, now), kept);
          channel = channel + 1 == channels ? 0 : channel + 1;
        } else {
          now = sums[at % kSums];
          sums[at % kSums] = NextSum<T>(from, window, now);
        }
        for (int j = 0; j < kVectors32; ++j) {
          V32 result = now.v[j];
          if constexpr (sizeof(Out) == 1) result = RoundedByte<kMultiplied>(result, by);
          if constexpr (sizeof(Out) == 2) result = RoundedWord(result, by, twice_inverse);
          V32& dword = dwords[k].v[j];
          dword = n == 0   ? result
                  : n == 1 ? hn::Add(dword, hn::ShiftLeft<8 * sizeof(Out) % 32>(result))
                  : n == 2 ? hn::Add(dword, hn::ShiftLeft<16>(result))
                           : hn::Add(dword, hn::ShiftLeft<24>(result));
        }
      }
      // What is left of kWholes is above the first byte.
      if constexpr (sizeof(Out) == 1) {
        const V32 bits = hn::BitCast(D32(), hn::Set(DF32(), kWholes));
        for (V32& v : dwords[k].v) v = hn::Sub(v, bits);
      }
    }
    if constexpr (kGroup % kSums == 1 && kSums == 3) {
      const Lines first = sums[0];
      sums[0] = sums[1], sums[1] = sums[2], sums[2] = first;
    }
    if constexpr (kGroup % kSums == 2 && kSums == 3) {
      const Lines last = sums[2];
      sums[2] = sums[1], sums[1] = sums[0], sums[0] = last;
    }
    const bool whole = i + kGroup <= s.count;
    const auto put = [&](auto part, int row) HWY_ATTR {
      const DQ<uint32_t> q;
      const hn::Repartition<Out, decltype(q)> d;
      if (HWY_LIKELY(whole)) return hn::StoreU(hn::BitCast(d, part), d, out[row] + i);
      HWY_ALIGN Out tail[kGroup];
      hn::Store(hn::BitCast(d, part), d, tail);
      std::copy_n(tail, s.count - i, out[row] + i);
    };
    for (int j = 0; j < kVectors32; ++j) {
      TransposeFour(dwords[0].v[j], dwords[1].v[j], dwords[2].v[j], dwords[3].v[j]);
      for (int k = 0; k < 4; ++k) {
        put(Quarter<0>(D32(), dwords[k].v[j]), j * kLanes32 + k);
        if constexpr (kLanes32 == 8) put(Quarter<1>(D32(), dwords[k].v[j]), 4 + k);
      }
    }
  }
}

template <class T, class Out, bool kMultiplied>
void SumRows(const BoxCodesStrip<T>& s, const BoxArea& area, Out* const* out) {
  switch (s.tile.channels) {
    case 1:
      return SumAlong<T, Out, 1, kMultiplied>(s, area, out);
    case 2:
      return SumAlong<T, Out, 2, kMultiplied>(s, area, out);
    case 3:
      return SumAlong<T, Out, 3, kMultiplied>(s, area, out);
    case 4:
      return SumAlong<T, Out, 4, kMultiplied>(s, area, out);
    default:
      return SumAlong<T, Out, 0, kMultiplied>(s, area, out);
  }
}

template <class T, class Out>
void SumBoxes(const BoxCodesStrip<T>& s, const BoxArea& area, Out* out, ptrdiff_t out_stride) {
  const BoxTile<T>& t = s.tile;
  const DC<T> d;
  constexpr int kStep = static_cast<int>(hn::MaxLanes(DC<T>()));
  for (int i = 0; i < s.seen(); i += kStep) {
    auto sum = hn::Zero(d);
    for (int y = 0; y < t.height; ++y) sum = hn::Add(sum, Wide(t.lines[y] + s.first + i));
    hn::Store(sum, d, s.sums + i);
  }
  // Rows that are not there are written here.
  std::vector<Out> spare(t.rows % kBoxLines == 0 ? 0 : static_cast<size_t>(s.count));
  for (int y = 0; y < t.rows; y += kBoxLines) {
    Out* rows[kBoxLines];
    for (int r = 0; r < kBoxLines; ++r)
      rows[r] = y + r < t.rows ? out + (y + r) * out_stride + s.first : spare.data();
    TransposeColumns(s, y);
    if (sizeof(Out) == 1 && area.multiplied) {
      SumRows<T, Out, /*kMultiplied=*/true>(s, area, rows);
    } else {
      SumRows<T, Out, /*kMultiplied=*/false>(s, area, rows);
    }
  }
}

void ByteBoxes(const BoxCodesStrip<uint8_t>& s, const BoxArea& area, uint8_t* out, ptrdiff_t out_stride) {
  SumBoxes(s, area, out, out_stride);
}
void WordBoxes(const BoxCodesStrip<uint16_t>& s, const BoxArea& area, uint16_t* out, ptrdiff_t out_stride) {
  SumBoxes(s, area, out, out_stride);
}
void ByteBoxSums(const BoxCodesStrip<uint8_t>& s, uint32_t* out, ptrdiff_t out_stride) {
  SumBoxes(s, {}, out, out_stride);
}
void WordBoxSums(const BoxCodesStrip<uint16_t>& s, uint32_t* out, ptrdiff_t out_stride) {
  SumBoxes(s, {}, out, out_stride);
}

// Sums of bytes, and of words, to samples.
void SettleByteSums(int area, const uint32_t* sums, int count, float* out) {
  const DB d;
  const auto over = hn::Set(d, static_cast<float>(area));
  s::StoreRow(d, count, out, [&](int i) HWY_ATTR {
    const auto sum = s::LoadPart(hn::RebindToUnsigned<DB>(), sums + i, count - i);
    return SettledSample(hn::ConvertTo(d, hn::BitCast(hn::RebindToSigned<DB>(), sum)), over);
  });
}
void SettleWordSums(int area, const uint32_t* sums, int count, float* out) {
  const DD d;
  const auto factor = hn::Set(d, 1.0 / area), unit = hn::Set(d, 1.0 / 65535);
  s::StoreRow(DF(), count, out, [&](int i) HWY_ATTR {
    HWY_ALIGN double codes[kDoubles] = {};
    std::copy_n(sums + i, std::min(kDoubles, count - i), codes);
    return ToFloats(d, hn::Mul(Settled(d, hn::Mul(hn::Load(d, codes), factor)), unit));
  });
}

BoxFunctions<uint8_t> ByteBoxesOfTarget() { return {MayMultiply, ByteBoxes, ByteBoxSums, SettleByteSums}; }
BoxFunctions<uint16_t> WordBoxesOfTarget() { return {nullptr, WordBoxes, WordBoxSums, SettleWordSums}; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(ByteBoxesOfTarget);
HWY_EXPORT(WordBoxesOfTarget);

// f(strip) for the strips of a tile, whose transposed sums stay in the nearest caches.
template <class T, class F>
void ForStrips(const BoxTile<T>& tile, base::Arena& scratch, const F& f) {
  constexpr int kLeast = 1024;
  const int halo = (tile.width - 1) * tile.channels;
  const int strip =
      std::max(kLeast, (2 * halo + kBoxUnit) / kBoxUnit * kBoxUnit) / tile.channels * tile.channels;
  // Whole groups of results are made, and vectors of columns read.
  const auto room = static_cast<size_t>(std::min(strip, tile.samples) + halo + tile.channels + 4 * kBoxUnit);
  BoxCodesStrip<T> s{.tile = tile};
  s.sums = scratch.Allocate<ColumnSum<T>>(room);
  s.transposed = scratch.Allocate<ColumnSum<T>>(room * kBoxLines);
  s.kept = scratch.Allocate<uint32_t>(static_cast<size_t>(tile.channels) * kBoxLines);
  std::fill_n(s.transposed, room * kBoxLines, ColumnSum<T>{0});
  for (; s.first < tile.samples; s.first += strip) {
    s.count = std::min(strip, tile.samples - s.first);
    f(s);
  }
}

}  // namespace

BoxFunctions<uint8_t> ChooseByteBoxes() { return HWY_DYNAMIC_DISPATCH(ByteBoxesOfTarget)(); }
BoxFunctions<uint16_t> ChooseWordBoxes() { return HWY_DYNAMIC_DISPATCH(WordBoxesOfTarget)(); }

template <class T>
void BoxMeans(const BoxFunctions<T>& functions, const BoxTile<T>& tile, T* out, ptrdiff_t out_stride,
              base::Arena& scratch) {
  BoxArea area{.area = tile.width * tile.height};
  area.inverse = static_cast<float>(1.0 / area.area);
  if constexpr (sizeof(T) == 1) area.multiplied = functions.may_multiply(area.area, area.inverse);
  ForStrips(tile, scratch, [&](const BoxCodesStrip<T>& s) { functions.means(s, area, out, out_stride); });
}

template <class T>
void BoxMeans(const BoxFunctions<T>& functions, const BoxTile<T>& tile, float* out, ptrdiff_t out_stride,
              base::Arena& scratch) {
  auto* const sums =
      scratch.Allocate<uint32_t>(static_cast<size_t>(tile.samples) * static_cast<size_t>(tile.rows));
  ForStrips(tile, scratch, [&](const BoxCodesStrip<T>& s) { functions.sums(s, sums, tile.samples); });
  for (int y = 0; y < tile.rows; ++y) {
    functions.settle(tile.width * tile.height, sums + ptrdiff_t{y} * tile.samples, tile.samples,
                     out + y * out_stride);
  }
}

template void BoxMeans(const BoxFunctions<uint8_t>&, const BoxTile<uint8_t>&, uint8_t*, ptrdiff_t,
                       base::Arena&);
template void BoxMeans(const BoxFunctions<uint16_t>&, const BoxTile<uint16_t>&, uint16_t*, ptrdiff_t,
                       base::Arena&);
template void BoxMeans(const BoxFunctions<uint8_t>&, const BoxTile<uint8_t>&, float*, ptrdiff_t,
                       base::Arena&);
template void BoxMeans(const BoxFunctions<uint16_t>&, const BoxTile<uint16_t>&, float*, ptrdiff_t,
                       base::Arena&);

}  // namespace tessera::ops
#endif  // HWY_ONCE
