// Twelve edges of the cube as gradients, in two steps: which edge, and what it makes of an offset. 256-bit
// vectors choose one of four floats by a lane's lower two bits: fewer instructions than simd/lattice-inl.h
// has for every target, and the same values.
#if defined(TESSERA_OPS_NOISE_EDGE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_NOISE_EDGE_INL_H_
#undef TESSERA_OPS_NOISE_EDGE_INL_H_
#else
#define TESSERA_OPS_NOISE_EDGE_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "simd/lattice-inl.h"
#include "simd/shuffle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_AVX2
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
  return hn::MulAdd(b, s::OneOfFour(hn::Load(d, kB), signs),
                    hn::Xor(a, s::OneOfFour(hn::Load(d, kA), signs)));
}

// Twice the gradients: of 2, 0 and -2 only the upper bytes differ, so a look-up of bytes makes a coordinate.
constexpr float kEdgeUnit = 2;
// A lattice point's edge in the upper byte; the others look up zeros.
HWY_INLINE s::VU EdgeBytes(s::VU h) {
  const s::DU du;
  const hn::Repartition<uint16_t, s::DU> du16;
  const s::VU edge =
      hn::BitCast(du, hn::MulHigh(hn::BitCast(du16, h), hn::BitCast(du16, hn::Set(du, 12u << 24))));
  return hn::Or(edge, hn::Set(du, 0x00808080u));
}
// Coordinate `axis` of kEdgeUnit times the gradient.
template <int axis>
HWY_INLINE s::V EdgeCoordinate(s::VU edge_bytes) {
  const s::D d;
  const hn::Repartition<uint8_t, s::D> du8;
  constexpr uint8_t kPlus = 0x40, kMinus = 0xc0;  // of 2 and -2
  HWY_ALIGN static constexpr uint8_t kUpper[3][16] = {
      {0, 0, 0, 0, kPlus, kMinus, kPlus, kMinus, kPlus, kMinus, kPlus, kMinus},
      {kPlus, kMinus, kPlus, kMinus, 0, 0, 0, 0, kPlus, kPlus, kMinus, kMinus},
      {kPlus, kPlus, kMinus, kMinus, kPlus, kPlus, kMinus, kMinus}};
  const auto table = hn::LoadDup128(du8, kUpper[axis]);
  return hn::BitCast(d, hn::TableLookupBytesOr0(table, hn::BitCast(du8, edge_bytes)));
}
#elif HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
// The same steps where gradients are looked up whole: the edge is in the upper sixteen bits.
HWY_INLINE s::VU TopEdge(s::VU h) { return s::UpperLatticeEdge(h); }
HWY_INLINE s::V EdgeProjection(s::VU edge, const s::V* from) {
  s::V g[3];
  s::EdgeGradient(edge, g);
  return s::Projection<3>(g, from);
}
#endif

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
