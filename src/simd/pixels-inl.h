// Vectors of pixels from and to memory, in the permuted order that makes RGBA transposes cheap.
//
// Plane order: with N lanes, four loads hold pixels j*N/4 .. (j+1)*N/4 - 1 each (j = 0..3), interleaved. A
// transpose within 128-bit lanes leaves pixel j*N/4 + k in lane 4*k + j of each plane, which saves the
// shuffles across lanes.
#if defined(TESSERA_SIMD_PIXELS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_PIXELS_INL_H_
#undef TESSERA_SIMD_PIXELS_INL_H_
#else
#define TESSERA_SIMD_PIXELS_INL_H_
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "simd/convert-inl.h"
#include "simd/point-inl.h"
#include "tessera/image.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

constexpr int kQuarter = kLanes >= 4 ? kLanes / 4 : 1;

// The pixel in lane i, and the lane of pixel i.
constexpr int PixelOfLane(int i) { return (i % 4) * kQuarter + i / 4; }
constexpr int LaneOfPixel(int i) { return (i % kQuarter) * 4 + i / kQuarter; }

struct LaneTables {
  int32_t pixel[kLanes], lane[kLanes];
};
constexpr LaneTables MakeLaneTables() {
  LaneTables t{};
  for (int i = 0; i < kLanes; ++i) t.pixel[i] = PixelOfLane(i), t.lane[i] = LaneOfPixel(i);
  return t;
}
inline constexpr LaneTables kTables = MakeLaneTables();

// Contiguous pixels to plane order and back.
template <class Vec>
HWY_INLINE Vec ToPlaneOrder(Vec v) {
  if constexpr (kLanes <= 4) {
    return v;
  } else {
    return hn::TableLookupLanes(v, hn::SetTableIndices(hn::DFromV<Vec>(), kTables.pixel));
  }
}
template <class Vec>
HWY_INLINE Vec ToPixelOrder(Vec v) {
  if constexpr (kLanes <= 4) {
    return v;
  } else {
    return hn::TableLookupLanes(v, hn::SetTableIndices(hn::DFromV<Vec>(), kTables.lane));
  }
}

// The 4x4 transpose within 128-bit lanes; its own inverse.
HWY_INLINE void Transpose4(V& a, V& b, V& c, V& d) {
  const D df;
  const hn::Repartition<double, D> dd;
  const auto ab_lo = hn::BitCast(dd, hn::InterleaveLower(df, a, b));
  const auto ab_hi = hn::BitCast(dd, hn::InterleaveUpper(df, a, b));
  const auto cd_lo = hn::BitCast(dd, hn::InterleaveLower(df, c, d));
  const auto cd_hi = hn::BitCast(dd, hn::InterleaveUpper(df, c, d));
  a = hn::BitCast(df, hn::InterleaveLower(dd, ab_lo, cd_lo));
  b = hn::BitCast(df, hn::InterleaveUpper(dd, ab_lo, cd_lo));
  c = hn::BitCast(df, hn::InterleaveLower(dd, ab_hi, cd_hi));
  d = hn::BitCast(df, hn::InterleaveUpper(dd, ab_hi, cd_hi));
}

// Stores a vector, around the cache when asked (the address is then aligned to the vector). Vectors shorter
// than 128 bits cannot go around it.
template <class DT, class VT>
HWY_INLINE void StoreOrStream(VT v, DT d, hn::TFromD<DT>* to, bool stream) {
  if constexpr (sizeof(hn::TFromD<DT>) * hn::MaxLanes(DT()) >= 16) {
    if (stream) return hn::Stream(v, d, to);
  }
  hn::StoreU(v, d, to);
}

// How samples of a type become float vectors. Codes are what lies in the pixel, as floats (0..255, 0..65535),
// for kernels that fold the scale into their coefficients; values are codes / max. For half and float both
// are the value.
template <PixelType type>
struct Samples;

template <>
struct Samples<PixelType::kFloat> {
  using T = float;
  static constexpr float kMax = 1;
  static HWY_INLINE V LoadCodes(const T* p) { return hn::LoadU(D(), p); }
  static HWY_INLINE void StoreCodes(V v, T* p, bool stream) { StoreOrStream(v, D(), p, stream); }
  static HWY_INLINE void StoreValues(V v, T* p, bool stream) { StoreOrStream(v, D(), p, stream); }
  static HWY_INLINE V Value(V code) { return code; }
};
template <>
struct Samples<PixelType::kHalf> {
  using T = uint16_t;
  static constexpr float kMax = 1;
  static HWY_INLINE V LoadCodes(const T* p) { return FloatFromHalf(hn::LoadU(DU16(), p)); }
  static HWY_INLINE void StoreCodes(V v, T* p, bool stream) {
    StoreOrStream(HalfFromFloat(v), DU16(), p, stream);
  }
  static HWY_INLINE void StoreValues(V v, T* p, bool stream) { StoreCodes(v, p, stream); }
  static HWY_INLINE V Value(V code) { return code; }
};
template <>
struct Samples<PixelType::kUint16> {
  using T = uint16_t;
  static constexpr float kMax = 65535;
  static HWY_INLINE V LoadCodes(const T* p) {
    return hn::ConvertTo(D(), hn::PromoteTo(DI(), hn::LoadU(DU16(), p)));
  }
  static HWY_INLINE void StoreCodes(V v, T* p, bool stream) {
    StoreOrStream(hn::DemoteTo(DU16(), ToCode(v, kMax)), DU16(), p, stream);
  }
  static HWY_INLINE void StoreValues(V v, T* p, bool stream) {
    StoreOrStream(hn::DemoteTo(DU16(), ToUnorm<65536>(v)), DU16(), p, stream);
  }
  static HWY_INLINE V Value(V code) { return FromUnorm16(code); }
};
template <>
struct Samples<PixelType::kUint8> {
  using T = uint8_t;
  static constexpr float kMax = 255;
  static HWY_INLINE V LoadCodes(const T* p) {
    return hn::ConvertTo(D(), hn::PromoteTo(DI(), hn::LoadU(DU8(), p)));
  }
  static HWY_INLINE void StoreCodes(V v, T* p, bool stream) {
    StoreOrStream(hn::DemoteTo(DU8(), ToCode(v, kMax)), DU8(), p, stream);
  }
  static HWY_INLINE void StoreValues(V v, T* p, bool stream) {
    StoreOrStream(hn::DemoteTo(DU8(), ToUnorm<256>(v)), DU8(), p, stream);
  }
  static HWY_INLINE V Value(V code) { return FromUnorm8(code); }
};

// One 8-bit RGBA pixel a lane to four planes of codes and back, lane by lane.
HWY_INLINE Pixels UnpackRgba8(VU v) {
  const hn::Repartition<uint8_t, D> d8;
  // Byte c of every lane, the other bytes zero.
  alignas(16) static constexpr uint8_t kPick[4][16] = {
      {0, 128, 128, 128, 4, 128, 128, 128, 8, 128, 128, 128, 12, 128, 128, 128},
      {1, 128, 128, 128, 5, 128, 128, 128, 9, 128, 128, 128, 13, 128, 128, 128},
      {2, 128, 128, 128, 6, 128, 128, 128, 10, 128, 128, 128, 14, 128, 128, 128},
      {3, 128, 128, 128, 7, 128, 128, 128, 11, 128, 128, 128, 15, 128, 128, 128}};
  const auto bytes = hn::BitCast(d8, v);
  const auto plane = [&](int c) HWY_ATTR {
    return hn::ConvertTo(D(),
                         hn::BitCast(DI(), hn::TableLookupBytesOr0(bytes, hn::LoadDup128(d8, kPick[c]))));
  };
  return {plane(0), plane(1), plane(2), plane(3)};
}
// The planes are NearestCodeBits of numbers up to 255; shifts push the upper bits out of all but the first.
HWY_INLINE VU PackRgba8(VU r, VU g, VU b, VU a) {
  const VU rg = hn::Xor3(r, hn::Set(DU(), kCodeBits), hn::ShiftLeft<8>(g));
  return hn::Xor3(rg, hn::ShiftLeft<16>(b), hn::ShiftLeft<24>(a));
}

// kLanes interleaved RGBA pixels as codes, in plane order.
template <PixelType type>
HWY_INLINE Pixels LoadRgbaCodes(const typename Samples<type>::T* p) {
  if constexpr (type == PixelType::kUint8) {
    return UnpackRgba8(ToPlaneOrder(hn::LoadU(DU(), reinterpret_cast<const uint32_t*>(p))));
  } else {
    Pixels q{Samples<type>::LoadCodes(p), Samples<type>::LoadCodes(p + kLanes),
             Samples<type>::LoadCodes(p + 2 * kLanes), Samples<type>::LoadCodes(p + 3 * kLanes)};
    Transpose4(q.r, q.g, q.b, q.a);
    return q;
  }
}
template <PixelType type>
HWY_INLINE Pixels ValuesOf(const Pixels& codes) {
  return Map(codes, [](V v) HWY_ATTR { return Samples<type>::Value(v); });
}

// The way back: kValues packs values exactly, otherwise codes (already scaled) are rounded.
template <PixelType type, bool kValues>
HWY_INLINE void StoreRgba(const Pixels& q, typename Samples<type>::T* p, bool stream) {
  using S = Samples<type>;
  if constexpr (type == PixelType::kUint8) {
    const auto code = [](V v) HWY_ATTR { return kValues ? ToUnormBits<256>(v) : ToCodeBits(v, S::kMax); };
    const VU packed = PackRgba8(code(q.r), code(q.g), code(q.b), code(q.a));
    StoreOrStream(ToPixelOrder(packed), DU(), reinterpret_cast<uint32_t*>(p), stream);
  } else {
    V a = q.r, b = q.g, c = q.b, d = q.a;
    Transpose4(a, b, c, d);
    if constexpr (kValues) {
      S::StoreValues(a, p, stream), S::StoreValues(b, p + kLanes, stream);
      S::StoreValues(c, p + 2 * kLanes, stream), S::StoreValues(d, p + 3 * kLanes, stream);
    } else {
      S::StoreCodes(a, p, stream), S::StoreCodes(b, p + kLanes, stream);
      S::StoreCodes(c, p + 2 * kLanes, stream), S::StoreCodes(d, p + 3 * kLanes, stream);
    }
  }
}

// 8-bit codes to 8-bit codes in the order of the pixels, which a stage that touches no plane may use: it
// saves two permutations. f gives codes within [0, 255], to be rounded.
template <class F>
HWY_INLINE void MapRgba8(const uint8_t* from, uint8_t* to, bool stream, const F& f) {
  const Pixels q = f(UnpackRgba8(hn::LoadU(DU(), reinterpret_cast<const uint32_t*>(from))));
  StoreOrStream(
      PackRgba8(NearestCodeBits(q.r), NearestCodeBits(q.g), NearestCodeBits(q.b), NearestCodeBits(q.a)), DU(),
      reinterpret_cast<uint32_t*>(to), stream);
}

// The same where f gives numbers of any sign below 2^15, unrounded and without NaN: limits cost half as much
// on 16-bit integers, and on other execution units than the multiply-adds.
template <class F>
HWY_INLINE void MapBoundedRgba8(const uint8_t* from, uint8_t* to, bool stream, const F& f) {
  const DU du;
  const hn::Repartition<int16_t, D> d16;
  const hn::Repartition<uint8_t, D> d8;
  const Pixels q = f(UnpackRgba8(hn::LoadU(du, reinterpret_cast<const uint32_t*>(from))));
  // Adding 1.5 * 2^23 leaves the nearest integer, negative ones too, in the low half of each lane.
  const auto half = [](V v) HWY_ATTR { return hn::BitCast(DU(), hn::Add(v, hn::Set(D(), 0x1.8p23f))); };
  const auto pair = [&](V low, V high) HWY_ATTR {
    const auto both =
        hn::OddEven(hn::BitCast(d16, hn::ShiftLeft<16>(half(high))), hn::BitCast(d16, half(low)));
    return hn::Min(hn::Max(both, hn::Zero(d16)), hn::Set(d16, 255));
  };
  const auto bytes = hn::Or(pair(q.r, q.g), hn::ShiftLeft<8>(pair(q.b, q.a)));  // r b g a
  alignas(16) static constexpr uint8_t kOrder[16] = {0, 2, 1, 3, 4, 6, 5, 7, 8, 10, 9, 11, 12, 14, 13, 15};
  const auto ordered = hn::TableLookupBytes(hn::BitCast(d8, bytes), hn::LoadDup128(d8, kOrder));
  StoreOrStream(hn::BitCast(du, ordered), du, reinterpret_cast<uint32_t*>(to), stream);
}

// Whether pixels at this address may be written with StoreRgba's streaming form.
HWY_INLINE bool CanStream(const void* p) { return reinterpret_cast<uintptr_t>(p) % 64 == 0; }

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
