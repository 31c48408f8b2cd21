// Random numbers of lattice points as Open Shading Language has them: Bob Jenkins' lookup3 on whole
// coordinates, and OSL's sets of gradients. Sources: burtleburtle.net/bob/c/lookup3.c (public domain); OSL
// and MaterialX specifications.
#if defined(TESSERA_SIMD_OSL_HASH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_OSL_HASH_INL_H_
#undef TESSERA_SIMD_OSL_HASH_INL_H_
#else
#define TESSERA_SIMD_OSL_HASH_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

template <int kBits>
HWY_INLINE VU RotateLeft(VU v) {
  return hn::Or(hn::ShiftLeft<kBits>(v), hn::ShiftRight<32 - kBits>(v));
}
// One line of lookup3's mix() and of its final().
template <int kBits>
HWY_INLINE void MixStep(VU& a, VU& c, VU b) {
  a = hn::Xor(hn::Sub(a, c), RotateLeft<kBits>(c));
  c = hn::Add(c, b);
}
template <int kBits>
HWY_INLINE void FinalStep(VU& c, VU b) {
  c = hn::Sub(hn::Xor(c, b), RotateLeft<kBits>(b));
}
// lookup3's final().
HWY_INLINE VU JenkinsFinal(VU a, VU b, VU c) {
  FinalStep<14>(c, b), FinalStep<11>(a, c), FinalStep<25>(b, a), FinalStep<16>(c, b);
  FinalStep<4>(a, c), FinalStep<14>(b, a), FinalStep<24>(c, b);
  return c;
}
// lookup3 of up to five words with initial value 13.
HWY_INLINE VU JenkinsHash(const VU* words, int count) {
  const VU start = hn::Set(DU(), 0xdeadbeefu + (static_cast<uint32_t>(count) << 2) + 13u);
  VU a = start, b = start, c = start;
  int first = 0;
  if (count > 3) {
    a = hn::Add(a, words[0]), b = hn::Add(b, words[1]), c = hn::Add(c, words[2]);
    MixStep<4>(a, c, b), MixStep<6>(b, a, c), MixStep<8>(c, b, a);
    MixStep<16>(a, c, b), MixStep<19>(b, a, c), MixStep<4>(c, b, a);
    first = 3;
  }
  a = hn::Add(a, words[first]);
  if (count - first > 1) b = hn::Add(b, words[first + 1]);
  if (count - first > 2) c = hn::Add(c, words[first + 2]);
  return JenkinsFinal(a, b, c);
}
template <int kDims>
HWY_INLINE VU OslHash(const VU* cell) {
  return JenkinsHash(cell, kDims);
}
template <int kDims>
HWY_INLINE VU OslHashWith(const VU* cell, uint32_t last) {
  VU words[kDims + 1];
  for (int a = 0; a < kDims; ++a) words[a] = cell[a];
  words[kDims] = hn::Set(DU(), last);
  return JenkinsHash(words, kDims + 1);
}

// h / (2^32 - 1), as OSL's cellnoise rounds it.
HWY_INLINE V OslUnit(VU h) {
  const D d;
  const DI di;
  // 16 + 16 bits: the sum is rounded once, as a conversion from unsigned would be.
  const V high = hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<16>(h)));
  const V low = hn::ConvertTo(d, hn::BitCast(di, hn::And(h, hn::Set(DU(), 0xffffu))));
  return hn::Mul(hn::Add(hn::Mul(high, hn::Set(d, 65536.0f)), low),
                 hn::Set(d, static_cast<float>(1.0 / 4294967295.0)));
}

// -1 where the bit of `kMask` is set, else 1.
template <uint32_t kMask>
HWY_INLINE V SignedOne(VU h) {
  const D d;
  const DU du;
  const auto set = hn::RebindMask(d, hn::Ne(hn::And(h, hn::Set(du, kMask)), hn::Zero(du)));
  return hn::IfThenElse(set, hn::Set(d, -1.0f), hn::Set(d, 1.0f));
}

template <int kDims>
HWY_INLINE void OslGradient(VU h, V* g) {
  const D d;
  const DU du;
  const DI di;
  const auto bit = [&](uint32_t mask) HWY_ATTR {
    return hn::RebindMask(d, hn::Ne(hn::And(h, hn::Set(du, mask)), hn::Zero(du)));
  };
  const auto below = [&](VU value, int limit) HWY_ATTR {
    return hn::RebindMask(d, hn::Gt(hn::Set(di, limit), hn::BitCast(di, value)));
  };
  const V one = hn::Set(d, 1.0f), minus = hn::Set(d, -1.0f), zero = hn::Zero(d);
  if constexpr (kDims == 1) {
    const V size = hn::Add(one, hn::ConvertTo(d, hn::BitCast(di, hn::And(h, hn::Set(du, 7u)))));
    g[0] = hn::IfThenElse(bit(8), hn::Neg(size), size);
  } else if constexpr (kDims == 2) {
    const auto first = hn::Not(bit(4));
    const V u = hn::IfThenElse(bit(1), minus, one),
            v = hn::IfThenElse(bit(2), hn::Set(d, -2.0f), hn::Set(d, 2.0f));
    g[0] = hn::IfThenElse(first, u, v);
    g[1] = hn::IfThenElse(first, v, u);
  } else if constexpr (kDims == 3) {
    const VU k = hn::And(h, hn::Set(du, 15u));
    const V u = hn::IfThenElse(bit(1), minus, one), v = hn::IfThenElse(bit(2), minus, one);
    const auto u_is_x = below(k, 8), v_is_y = below(k, 4);
    // 12 and 14 pair y with x instead of z.
    const auto v_is_x = hn::RebindMask(d, hn::Eq(hn::And(k, hn::Set(du, 13u)), hn::Set(du, 12u)));
    g[0] = hn::Add(hn::IfThenElseZero(u_is_x, u), hn::IfThenElseZero(v_is_x, v));
    g[1] = hn::Add(hn::IfThenZeroElse(u_is_x, u), hn::IfThenElseZero(v_is_y, v));
    g[2] = hn::IfThenElse(hn::Or(v_is_y, v_is_x), zero, v);
  } else {
    const VU k = hn::And(h, hn::Set(du, 31u));
    const V u = hn::IfThenElse(bit(1), minus, one), v = hn::IfThenElse(bit(2), minus, one),
            w = hn::IfThenElse(bit(4), minus, one);
    const auto u_is_x = below(k, 24), v_is_y = below(k, 16), w_is_z = below(k, 8);
    g[0] = hn::IfThenElseZero(u_is_x, u);
    g[1] = hn::Add(hn::IfThenZeroElse(u_is_x, u), hn::IfThenElseZero(v_is_y, v));
    g[2] = hn::Add(hn::IfThenZeroElse(v_is_y, v), hn::IfThenElseZero(w_is_z, w));
    g[3] = hn::IfThenZeroElse(w_is_z, w);
  }
}

// Hash of a simplex' corner: OSL's simplex noise folds coordinates and seed with final() alone.
template <int kDims>
HWY_INLINE VU OslSimplexHash(const VU* corner, uint32_t seed) {
  const DU du;
  const VU start = hn::Set(du, 0xdeadbeefu), s = hn::Set(du, seed);
  if constexpr (kDims == 1) return JenkinsFinal(corner[0], s, start);
  VU rest = s;
  if constexpr (kDims == 3) rest = JenkinsFinal(corner[2], s, start);
  if constexpr (kDims == 4) rest = JenkinsFinal(corner[2], corner[3], hn::Xor(s, start));
  return JenkinsFinal(corner[0], corner[1 % kDims], hn::Xor(rest, start));
}
// Gradients of OSL's simplex noise, by the low bits of a hash.
template <int kDims>
HWY_INLINE void OslSimplexGradient(VU h, V* g) {
  const D d;
  const DU du;
  if constexpr (kDims == 1) {
    OslGradient<1>(h, g);
  } else if constexpr (kDims == 4) {  // one coordinate 0, the signs of the others from three bits
    const VU zero = hn::ShiftRight<3>(hn::And(h, hn::Set(du, 31u)));
    const V s2 = SignedOne<4>(h), s1 = SignedOne<2>(h), s0 = SignedOne<1>(h);
    const auto at = [&](uint32_t i) HWY_ATTR { return hn::RebindMask(d, hn::Eq(zero, hn::Set(du, i))); };
    const auto low = hn::Or(at(0), at(1));
    g[0] = hn::IfThenZeroElse(at(0), s2);
    g[1] = hn::IfThenElse(at(0), s2, hn::IfThenZeroElse(at(1), s1));
    g[2] = hn::IfThenElse(low, s1, hn::IfThenZeroElse(at(2), s0));
    g[3] = hn::IfThenZeroElse(at(3), s0);
  } else {
    alignas(64) static constexpr float kPlane[2][8] = {{-1, 1, -1, 1, -1, 0, 0, 1},
                                                       {-1, 0, 0, 1, 1, -1, 1, -1}};
    alignas(64) static constexpr float kSpace[3][16] = {
        {1, 0, -1, 0, 1, 0, -1, 0, 1, 1, -1, -1, 1, -1, 0, 0},
        {0, 1, 0, -1, 0, 1, 0, -1, -1, 1, 1, -1, 0, 0, 1, -1},
        {1, 1, 1, 1, -1, -1, -1, -1, 0, 0, 0, 0, 1, 1, -1, -1}};
    const auto index = hn::BitCast(DI(), hn::And(h, hn::Set(du, kDims == 2 ? 7u : 15u)));
    for (int a = 0; a < kDims; ++a) g[a] = hn::GatherIndex(d, kDims == 2 ? kPlane[a % 2] : kSpace[a], index);
  }
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
