// The stage of point operations on two images: blocks of planes, or straight from both images' interleaved
// RGBA pixels to the result's, which is as fast as memory.
//
// F is called in one of these ways:
//   V operator()(V a, V b, V alpha_a, V alpha_b, Mask<D> is_alpha)   channel by channel; lanes are samples of
//   any Pixels operator()(const Pixels& a, const Pixels& b)
// and may have, for 8-bit pixels, `static Bytes Codes(Bytes a, Bytes b)` on interleaved RGBA, which has to
// give what the float form and correct rounding give, or, where its operator is costly and simple for alphas,
// `V Alpha(V alpha_a, V alpha_b)`, which has to give what the operator gives of alphas that are codes;
// and `static constexpr bool kSamplesAlike = true` where alpha is a channel like the others.
#if defined(TESSERA_SIMD_PAIR_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_PAIR_INL_H_
#undef TESSERA_SIMD_PAIR_INL_H_
#else
#define TESSERA_SIMD_PAIR_INL_H_
#endif

#include <hwy/highway.h>

#include "base/prefetch.h"
#include "simd/fused-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// kLanes RGBA pixels of 8 bits, and their samples as 16-bit integers, two vectors of every second one.
using DBytes = hn::Repartition<uint8_t, D>;
using DWords = hn::Repartition<uint16_t, D>;
using Bytes = hn::Vec<DBytes>;
using Words = hn::Vec<DWords>;

HWY_INLINE Words Even(Bytes v) { return hn::And(hn::BitCast(DWords(), v), hn::Set(DWords(), 0x00FF)); }
HWY_INLINE Words Odd(Bytes v) { return hn::ShiftRight<8>(hn::BitCast(DWords(), v)); }
HWY_INLINE Bytes FromEvenOdd(Words even, Words odd) {
  return hn::BitCast(DBytes(), hn::Or(even, hn::ShiftLeft<8>(odd)));
}
// Each pixel's alpha beside all of its samples: serves the even and the odd ones.
HWY_INLINE Words AlphaWords(Bytes v) {
  alignas(16) static constexpr uint8_t kAlpha[16] = {3,  128, 3,  128, 7,  128, 7,  128,
                                                     11, 128, 11, 128, 15, 128, 15, 128};
  return hn::BitCast(DWords(), hn::TableLookupBytesOr0(v, hn::LoadDup128(DBytes(), kAlpha)));
}
HWY_INLINE Words Complement(Words v) { return hn::Xor(v, hn::Set(DWords(), 0x00FF)); }
// v / 255 rounded to the nearest integer, for v up to 255 * 255; no quotient is a tie.
HWY_INLINE Words Div255(Words v) {
  return hn::MulHigh(hn::Add(v, hn::Set(DWords(), 128)), hn::Set(DWords(), 257));
}
// The same of a sum, limited to 255.
HWY_INLINE Words SumDiv255(Words a, Words b) {
  return Div255(hn::Min(hn::SaturatedAdd(a, b), hn::Set(DWords(), 255 * 255)));
}

template <class F>
inline constexpr bool kLaneWise = std::is_invocable_v<const F&, V, V, V, V, hn::Mask<D>>;

template <class F>
HWY_INLINE Pixels ApplyPair(const F& f, const Pixels& a, const Pixels& b) {
  if constexpr (kLaneWise<F>) {
    const auto color = hn::Lt(hn::Zero(D()), hn::Zero(D())), alpha = hn::Not(color);
    return {f(a.r, b.r, a.a, b.a, color), f(a.g, b.g, a.a, b.a, color), f(a.b, b.b, a.a, b.a, color),
            f(a.a, b.a, a.a, b.a, alpha)};
  } else {
    return f(a, b);
  }
}

// Of 8-bit pixels, from and to codes in the order of the pixels, as MapRgba8 has them.
template <class F>
HWY_INLINE void PairRgba8(const F& f, const uint8_t* from_a, const uint8_t* from_b, uint8_t* to,
                          bool stream) {
  const auto values = [](const uint8_t* from) HWY_ATTR {
    return ValuesOf<PixelType::kUint8>(UnpackRgba8(hn::LoadU(DU(), reinterpret_cast<const uint32_t*>(from))));
  };
  const Pixels a = values(from_a), b = values(from_b);
  Pixels q;
  if constexpr (requires { f.Alpha(a.a, b.a); }) {
    const auto color = hn::Lt(hn::Zero(D()), hn::Zero(D()));
    q = {f(a.r, b.r, a.a, b.a, color), f(a.g, b.g, a.a, b.a, color), f(a.b, b.b, a.a, b.a, color),
         f.Alpha(a.a, b.a)};
  } else {
    q = ApplyPair(f, a, b);
  }
  const VU packed =
      PackRgba8(ToUnormBits<256>(q.r), ToUnormBits<256>(q.g), ToUnormBits<256>(q.b), ToUnormBits<256>(q.a));
  StoreOrStream(packed, DU(), reinterpret_cast<uint32_t*>(to), stream);
}

template <class F>
class PairStage final : public graph::PointStage {
 public:
  explicit PairStage(F f) : f_(std::move(f)) {}
  bool CanFuseAll(PixelType) const override { return true; }
  bool AnyLength() const override { return true; }
  std::unique_ptr<graph::PointStage> OfSamples(int) const override {
    if constexpr (requires { F::kSamplesAlike; }) return std::make_unique<PairStage>(f_);
    return nullptr;
  }

  void Run(const graph::PointArgs& args) const override {
    const F f(f_);
    if (args.others[0].read == nullptr) {
      return RunPoint<2>(args,
                         [&f](const Pixels& a, const Pixels& b) HWY_ATTR { return ApplyPair(f, a, b); });
    }
    WithType(args.sink.type, [&](auto tag) HWY_ATTR { Direct<decltype(tag)::value>(args, f); });
  }

 private:
  template <PixelType type>
  static HWY_INLINE void Direct(const graph::PointArgs& args, const F& f) {
    using S = Samples<type>;
    using T = typename S::T;
    const T* const a = reinterpret_cast<const T*>(args.source.read);
    const T* const b = reinterpret_cast<const T*>(args.others[0].read);
    T* const to = reinterpret_cast<T*>(args.sink.write);
    const int count = 4 * args.count;
    // In place the line is in the cache already.
    const bool stream = args.sink.stream && CanStream(to) && to != a && to != b;
    if constexpr (type == PixelType::kUint8 && requires(Bytes v) { F::Codes(v, v); }) {
      const DBytes d;
      for (int i = 0; i < count; i += 4 * kLanes) {
        Ahead(a + i, b + i, 4 * kLanes);
        StoreBytes(F::Codes(hn::LoadU(d, a + i), hn::LoadU(d, b + i)), to + i, stream);
      }
      return;
    }
    if constexpr (type == PixelType::kUint8 && kLaneWise<F>) {
      for (int i = 0; i < count; i += 4 * kLanes) {
        Ahead(a + i, b + i, 4 * kLanes);
        PairRgba8(f, a + i, b + i, to + i, stream);
      }
      return;
    }
    if constexpr (kLaneWise<F>) {
      // Samples stay interleaved: nothing is transposed. Lanes are whole pixels, alpha the last of every
      // four.
      alignas(16) static constexpr uint32_t kAlphaLane[4] = {0, 0, 0, 1};
      const auto is_alpha = hn::RebindMask(D(), hn::Ne(hn::LoadDup128(DU(), kAlphaLane), hn::Zero(DU())));
      for (int i = 0; i < count; i += kLanes) {
        Ahead(a + i, b + i, kLanes);
        const V va = S::Value(S::LoadCodes(a + i)), vb = S::Value(S::LoadCodes(b + i));
        S::StoreValues(f(va, vb, hn::Broadcast<3>(va), hn::Broadcast<3>(vb), is_alpha), to + i, stream);
      }
      return;
    }
    for (int i = 0; i < count; i += 4 * kLanes) {
      Ahead(a + i, b + i, 4 * kLanes);
      const Pixels pa = ValuesOf<type>(LoadRgbaCodes<type>(a + i)),
                   pb = ValuesOf<type>(LoadRgbaCodes<type>(b + i));
      StoreRgba<type, true>(ApplyPair(f, pa, pb), to + i, stream);
    }
  }
  template <class T>
  static HWY_INLINE void Ahead(const T* a, const T* b, int samples) {
    base::PrefetchAhead(a, samples), base::PrefetchAhead(b, samples);
  }
  static HWY_INLINE void StoreBytes(Bytes v, uint8_t* to, bool stream) {
    if (stream) {
      hn::Stream(v, DBytes(), to);
    } else {
      hn::StoreU(v, DBytes(), to);
    }
  }

  F f_;
};

template <class F>
std::unique_ptr<graph::PointStage> MakePairStage(F f) {
  return std::make_unique<PairStage<F>>(std::move(f));
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
