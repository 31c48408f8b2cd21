// Twelve edges of the cube as gradients where 256-bit vectors choose one of four floats by a lane's lower two
// bits: fewer instructions than simd/lattice-inl.h has for every target, and the same values.
#if defined(TESSERA_OPS_NOISE_EDGE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_NOISE_EDGE_INL_H_
#undef TESSERA_OPS_NOISE_EDGE_INL_H_
#else
#define TESSERA_OPS_NOISE_EDGE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "simd/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_AVX2
// Of the four floats in either half, the one that the lower two bits of a lane say.
HWY_INLINE s::V OneOfFour(s::V four, hn::Vec<s::DU> bits) {
  return s::V{_mm256_permutevar_ps(four.raw, bits.raw)};
}

// A lattice point's edge, 0 to 11, in the upper four bits; below is what is left of the product.
HWY_INLINE s::VU TopEdge(s::VU h) {
  const s::DU du;
  const hn::Repartition<uint16_t, s::DU> du16;
  return hn::BitCast(du, hn::MulHigh(hn::BitCast(du16, h), hn::BitCast(du16, hn::Set(du, 12u << 28))));
}
// Negative for edges from 4; TopEdge() itself is for edges from 8.
HWY_INLINE s::V NotFirstEdges(s::VU top_edge) {
  return hn::BitCast(s::D(), hn::Add(top_edge, hn::Set(s::DU(), 4u << 28)));
}

// As LatticeProjection<3>.
HWY_INLINE s::V EdgeProjection(s::VU top_edge, const s::V* from) {
  const s::D d;
  HWY_ALIGN static constexpr float kA[8] = {0.0f, -0.0f, 0.0f, -0.0f, 0.0f, -0.0f, 0.0f, -0.0f};
  HWY_ALIGN static constexpr float kB[8] = {1, 1, -1, -1, 1, 1, -1, -1};
  const s::V a = hn::IfNegativeThenElse(NotFirstEdges(top_edge), from[0], from[1]);
  const s::V b = hn::IfNegativeThenElse(hn::BitCast(d, top_edge), from[1], from[2]);
  const s::VU signs = hn::ShiftRight<28>(top_edge);
  return hn::MulAdd(b, OneOfFour(hn::Load(d, kB), signs), hn::Xor(a, OneOfFour(hn::Load(d, kA), signs)));
}

// As LatticeGradient<3>.
HWY_INLINE void EdgeGradient(s::VU top_edge, s::V* g) {
  const s::D d;
  HWY_ALIGN static constexpr float kA[8] = {1, -1, 1, -1, 1, -1, 1, -1};
  HWY_ALIGN static constexpr float kB[8] = {1, 1, -1, -1, 1, 1, -1, -1};
  const s::V zero = hn::Zero(d), not_first = NotFirstEdges(top_edge), last = hn::BitCast(d, top_edge);
  const s::VU signs = hn::ShiftRight<28>(top_edge);
  const s::V a = OneOfFour(hn::Load(d, kA), signs), b = OneOfFour(hn::Load(d, kB), signs);
  g[0] = hn::IfNegativeThenElse(not_first, a, zero);
  g[1] = hn::IfNegativeThenElse(not_first, hn::IfNegativeThenElse(last, b, zero), a);
  g[2] = hn::IfNegativeThenElse(last, zero, b);
}
#endif

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
