// Samples as integers in their order, which is what medians compare.
#if defined(TESSERA_OPS_FILTER_RANK_KEYS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_FILTER_RANK_KEYS_INL_H_
#undef TESSERA_OPS_FILTER_RANK_KEYS_INL_H_
#else
#define TESSERA_OPS_FILTER_RANK_KEYS_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "ops/filter/rank/rank-inl.h"
#include "simd/pixels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
using s::DI;
using s::VI;

constexpr int32_t kLast = std::numeric_limits<int32_t>::max();  // key of NaN

// Numbers without a sign are in the order of their bits: rows are read where they are.
struct Bits {
  using Sample = float;
  using T = int32_t;
  static constexpr int kBits = 32;
  static constexpr bool kInPlace = true;
};

// Signed integers in the order of the floats.
struct FloatKeys {
  using Sample = float;
  using T = int32_t;
  static constexpr int kBits = 32;
  static constexpr bool kInPlace = false;
  // False where a sample has no key.
  static HWY_INLINE hn::Mask<D> Store(V v, T* to) {
    const DI di;
    const VI bits = hn::BitCast(di, v);
    const VI flipped = hn::Xor(bits, hn::And(hn::BroadcastSignBit(bits), hn::Set(di, kLast)));
    const auto number = hn::Eq(v, v);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(di, number), flipped, hn::Set(di, kLast)), di, to);
    return hn::Eq(hn::Zero(D()), hn::Zero(D()));
  }
  static HWY_INLINE V Load(const T* from) {
    const DI di;
    const VI key = hn::LoadU(di, from);
    const V v = hn::BitCast(D(), hn::Xor(key, hn::And(hn::BroadcastSignBit(key), hn::Set(di, kLast))));
    return hn::IfThenElse(hn::RebindMask(D(), hn::Eq(key, hn::Set(di, kLast))), hn::NaN(D()), v);
  }
};

// The codes of 8 or 16 bits less half their range: compares are of signed numbers. Wider than its codes, TT
// has room for counts.
template <PixelType type, class TT>
struct CodeKeys {
  using Sample = float;
  using T = TT;
  using Samples = s::Samples<type>;
  static constexpr int kBits = type == PixelType::kUint8 ? 8 : 16;
  static constexpr bool kInPlace = false;
  static constexpr int32_t kHalf = 1 << (kBits - 1);
  static HWY_INLINE hn::Mask<D> Store(V v, T* to) {
    const DI di;
    const VI code = s::ToUnorm<1 << kBits>(v);
    const V back = Samples::Value(hn::ConvertTo(D(), code));
    hn::StoreU(hn::DemoteTo(hn::Rebind<T, D>(), hn::Sub(code, hn::Set(di, kHalf))), hn::Rebind<T, D>(), to);
    // Minus zero is no code.
    return hn::RebindMask(D(), hn::Eq(hn::BitCast(di, v), hn::BitCast(di, back)));
  }
  static HWY_INLINE V Load(const T* from) {
    const DI di;
    const VI key = hn::PromoteTo(di, hn::LoadU(hn::Rebind<T, D>(), from));
    return Samples::Value(hn::ConvertTo(D(), hn::Add(key, hn::Set(di, kHalf))));
  }
};

// The same of the codes themselves.
template <class S, class TT>
struct StoredKeys {
  using Sample = S;
  using T = TT;
  static constexpr int kBits = 8 * sizeof(S);
  static constexpr bool kInPlace = false;
  using DS = hn::Rebind<S, DK<T>>;
  using DU = hn::RebindToUnsigned<DK<T>>;
  static HWY_INLINE hn::Vec<DU> WithSignFlipped(hn::Vec<DU> v) {
    return hn::Xor(v, hn::Set(DU(), static_cast<hn::TFromD<DU>>(1u << (kBits - 1))));
  }
  static HWY_INLINE void Store(const S* from, T* to) {
    if constexpr (sizeof(S) == sizeof(T)) {
      hn::StoreU(hn::BitCast(DK<T>(), WithSignFlipped(hn::LoadU(DU(), from))), DK<T>(), to);
    } else {
      const auto code = hn::PromoteTo(DK<T>(), hn::LoadU(DS(), from));
      hn::StoreU(hn::Sub(code, hn::Set(DK<T>(), T{1} << (kBits - 1))), DK<T>(), to);
    }
  }
  static HWY_INLINE hn::Vec<DS> Value(VK<T> key) {
    if constexpr (sizeof(S) == sizeof(T)) {
      return WithSignFlipped(hn::BitCast(DU(), key));
    } else {
      return hn::DemoteTo(DS(), hn::Add(key, hn::Set(DK<T>(), T{1} << (kBits - 1))));
    }
  }
};
template <class K>
constexpr bool kOfCodes = !std::is_same_v<typename K::Sample, float>;

// False when some sample has no key.
template <class K>
bool FloatsToKeys(const float* in, int count, const float* ahead, typename K::T* out) {
  auto all = hn::Eq(hn::Zero(D()), hn::Zero(D()));
  int i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    PrefetchLine(ahead, i);
    all = hn::And(all, K::Store(hn::LoadU(D(), in + i), out + i));
  }
  if (i < count) {
    HWY_ALIGN float lanes[kLanes] = {};
    std::copy_n(in + i, count - i, lanes);
    all = hn::And(all, K::Store(hn::Load(D(), lanes), out + i));
  }
  return hn::AllTrue(D(), all);
}

template <class K>
bool ToKeys(const typename K::Sample* in, int count, const typename K::Sample* ahead, typename K::T* out) {
  if constexpr (kOfCodes<K>) {
    // A vector beyond the last sample may be read, and keys have room for it.
    for (int i = 0; i < count; i += kKeyLanes<typename K::T>) {
      PrefetchLine(ahead, i);
      K::Store(in + i, out + i);
    }
    return true;
  } else {
    return FloatsToKeys<K>(in, count, ahead, out);
  }
}

// Whether all are numbers without a sign.
bool AreUnsigned(const float* in, int count, const float* ahead) {
  const s::DU du;
  constexpr uint32_t kInfinity = 0x7F800000u;
  auto most = hn::Zero(du);
  int i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    PrefetchLine(ahead, i);
    most = hn::Max(most, hn::LoadU(du, reinterpret_cast<const uint32_t*>(in + i)));
  }
  HWY_ALIGN uint32_t lanes[kLanes];
  hn::Store(most, du, lanes);
  uint32_t largest = *std::max_element(lanes, lanes + kLanes);
  for (; i < count; ++i) {
    uint32_t bits = 0;
    std::memcpy(&bits, in + i, sizeof bits);
    largest = std::max(largest, bits);
  }
  return largest <= kInfinity;
}

// Keys as samples, n results.
template <class K>
HWY_INLINE void StoreValues(const typename K::T* keys, typename K::Sample* out, int n, bool stream) {
  using T = typename K::T;
  if constexpr (!kOfCodes<K>) {
    StoreRow([&](int i) HWY_ATTR { return K::Load(keys + i); }, out, n, stream);
  } else if constexpr (sizeof(T) == sizeof(*out)) {
    StoreRow([&](int i) HWY_ATTR { return K::Value(hn::LoadU(DK<T>(), keys + i)); }, out, n, stream);
  } else {
    int i = 0;
    for (; i + kKeyLanes<T> <= n; i += kKeyLanes<T>) {
      hn::StoreU(K::Value(hn::LoadU(DK<T>(), keys + i)), typename K::DS(), out + i);
    }
    HWY_ALIGN typename K::Sample lanes[kKeyLanes<T>];
    if (i < n) hn::Store(K::Value(hn::LoadU(DK<T>(), keys + i)), typename K::DS(), lanes);
    std::copy_n(lanes, n - i, out + i);
  }
}

// A row of results: f(i) is a vector of keys. `line` has room for them.
template <class K, class F>
HWY_INLINE void StoreKeys(const F& f, typename K::T* line, typename K::Sample* out, int count, bool stream) {
  using T = typename K::T;
  if constexpr (K::kInPlace) {
    (void)line;
    StoreRow([&](int i) HWY_ATTR { return hn::BitCast(D(), f(i)); }, out, count, stream);
  } else if constexpr (kOfCodes<K> && sizeof(T) == sizeof(*out)) {
    (void)line;
    StoreRow([&](int i) HWY_ATTR { return K::Value(f(i)); }, out, count, stream);
  } else {
    for (int i = 0; i < count; i += kKeyLanes<T>) hn::StoreU(f(i), DK<T>(), line + i);
    StoreValues<K>(line, out, count, stream);
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
