// Gradients of three-dimensional lattice noise in two steps: which of the cube's twelve edges a lattice point
// has, and what that makes of an offset or, of two planes, of the fraction between them. The values are those
// of LatticeGradient<3>(); each target has the form that takes it the fewest instructions.
#if defined(TESSERA_SIMD_EDGES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_EDGES_INL_H_
#undef TESSERA_SIMD_EDGES_INL_H_
#else
#define TESSERA_SIMD_EDGES_INL_H_
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "simd/lattice-inl.h"
#include "simd/shuffle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {

// 32 vector registers, not 16: enough for all corners of a cell.
constexpr bool kManyRegisters = HWY_ARCH_ARM_A64 || (HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3);

// A lattice point's gradient where its third and fourth axis have met their offsets, `rest`.
struct LatticeCorner {
  V gx, gy, rest;
};
HWY_INLINE LatticeCorner BlendCorners(const LatticeCorner& a, const LatticeCorner& b, float fade) {
  const V weight = hn::Set(D(), fade);
  const auto lerp = [&](V p, V q) HWY_ATTR { return hn::MulAdd(weight, hn::Sub(q, p), p); };
  return {lerp(a.gx, b.gx), lerp(a.gy, b.gy), lerp(a.rest, b.rest)};
}

// Below: TopEdge() is a lattice point's edge in whatever form EdgeProjection() wants it, which is as
// LatticeProjection<3>. BlendedEdges make corners of mixed hashes of the same point in two lattice planes,
// blended from one to the other by `fade`, times kEdgeUnit; `fraction` and `fraction` - 1 are the offsets.

#if HWY_TARGET == HWY_AVX2
// 256-bit vectors choose one of four floats by a lane's lower two bits. The edge, 0 to 11, is in the upper
// four bits; below is what is left of the product.
HWY_INLINE VU TopEdge(VU h) {
  const DU du;
  const hn::Repartition<uint16_t, DU> du16;
  return hn::BitCast(du, hn::MulHigh(hn::BitCast(du16, h), hn::BitCast(du16, hn::Set(du, 12u << 28))));
}
// Negative for edges from 4; TopEdge() itself is for edges from 8.
HWY_INLINE V NotFirstEdges(VU top_edge) {
  return hn::BitCast(D(), hn::Add(top_edge, hn::Set(DU(), 4u << 28)));
}
HWY_INLINE V EdgeProjection(VU top_edge, const V* from) {
  const D d;
  HWY_ALIGN static constexpr float kA[8] = {0.0f, -0.0f, 0.0f, -0.0f, 0.0f, -0.0f, 0.0f, -0.0f};
  HWY_ALIGN static constexpr float kB[8] = {1, 1, -1, -1, 1, 1, -1, -1};
  const V a = hn::IfNegativeThenElse(NotFirstEdges(top_edge), from[0], from[1]);
  const V b = hn::IfNegativeThenElse(hn::BitCast(d, top_edge), from[1], from[2]);
  const VU signs = hn::ShiftRight<28>(top_edge);
  return hn::MulAdd(b, OneOfFour(hn::Load(d, kB), signs), hn::Xor(a, OneOfFour(hn::Load(d, kA), signs)));
}

// Of 2, 0 and -2 only the upper bytes differ, so a look-up of bytes makes a coordinate.
inline constexpr float kEdgeUnit = 2;
// The edge in the upper byte; the others look up zeros.
HWY_INLINE VU EdgeBytes(VU h) {
  const DU du;
  const hn::Repartition<uint16_t, DU> du16;
  const VU edge =
      hn::BitCast(du, hn::MulHigh(hn::BitCast(du16, h), hn::BitCast(du16, hn::Set(du, 12u << 24))));
  return hn::Or(edge, hn::Set(du, 0x00808080u));
}
HWY_INLINE void ScaledEdge(VU h, V* g) {
  const D d;
  const hn::Repartition<uint8_t, D> du8;
  constexpr uint8_t kPlus = 0x40, kMinus = 0xc0;  // of 2 and -2
  HWY_ALIGN static constexpr uint8_t kUpper[3][16] = {
      {0, 0, 0, 0, kPlus, kMinus, kPlus, kMinus, kPlus, kMinus, kPlus, kMinus},
      {kPlus, kMinus, kPlus, kMinus, 0, 0, 0, 0, kPlus, kPlus, kMinus, kMinus},
      {kPlus, kPlus, kMinus, kMinus, kPlus, kPlus, kMinus, kMinus}};
  const auto edge = hn::BitCast(du8, EdgeBytes(h));
#pragma GCC unroll 3
  for (int axis = 0; axis < 3; ++axis)
    g[axis] = hn::BitCast(d, hn::TableLookupBytesOr0(hn::LoadDup128(du8, kUpper[axis]), edge));
}
#elif HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
// Gradients are looked up whole: the edge is in the upper sixteen bits.
HWY_INLINE VU TopEdge(VU h) { return UpperLatticeEdge(h); }
HWY_INLINE V EdgeProjection(VU edge, const V* from) {
  V g[3];
  EdgeGradient(edge, g);
  return Projection<3>(g, from);
}

inline constexpr float kEdgeUnit = 1;
// By table: of each coordinate there are three a plane, so nine pairs.
class BlendedEdges {
 public:
  HWY_INLINE BlendedEdges(float fraction, float fade) {
    alignas(64) static constexpr float kLower[16] = {0, 1, -1, 0, 1, -1, 0, 1, -1};
    alignas(64) static constexpr float kUpper[16] = {0, 0, 0, 1, 1, 1, -1, -1, -1};
    const D d;
    const V lower = hn::Load(d, kLower), upper = hn::Load(d, kUpper), zero = hn::Zero(d);
    const LatticeCorner low = {lower, lower, hn::MulAdd(lower, hn::Set(d, fraction), zero)};
    const LatticeCorner high = {upper, upper, hn::MulAdd(upper, hn::Set(d, fraction - 1), zero)};
    const LatticeCorner pair = BlendCorners(low, high, fade);
    across_ = pair.gx;
    along_ = pair.rest;
  }
  HWY_INLINE LatticeCorner operator()(VU lower, VU upper) const {
    // Which of 0, 1, -1 (as 0, 1, 2) the coordinates of the 12 edges are, four bits each; thrice that. They
    // are looked up by the edges where these are, in the upper words.
    alignas(64) static constexpr uint16_t kLower[32] = {0x110, 0x120, 0x210, 0x220, 0x101, 0x102,
                                                        0x201, 0x202, 0x011, 0x012, 0x021, 0x022};
    alignas(64) static constexpr uint16_t kUpper[32] = {0x330, 0x360, 0x630, 0x660, 0x303, 0x306,
                                                        0x603, 0x606, 0x033, 0x036, 0x063, 0x066};
    const auto code = [](const uint16_t* table, VU h)
                          HWY_ATTR { return LookUpWords(table, UpperLatticeEdge(h)); };
    const VU pair = hn::Add(code(kLower, lower), code(kUpper, upper));
    return {OneOfLanes(across_, hn::ShiftRight<16>(pair)), OneOfLanes(across_, hn::ShiftRight<20>(pair)),
            OneOfLanes(along_, hn::ShiftRight<24>(pair))};
  }

 private:
  V across_, along_;
};
#else
// What chooses is the lattice point's number itself.
HWY_INLINE VU TopEdge(VU h) { return h; }
HWY_INLINE V EdgeProjection(VU h, const V* from) { return LatticeProjection<3>(h, from); }

inline constexpr float kEdgeUnit = 1;
HWY_INLINE void ScaledEdge(VU h, V* g) { LatticeGradient<3>(h, g); }
#endif

#if HWY_TARGET > HWY_AVX3 || !HWY_ARCH_X86
// From ScaledEdge(), kEdgeUnit times the gradient, of both planes.
class BlendedEdges {
 public:
  HWY_INLINE BlendedEdges(float fraction, float fade) : fraction_(fraction), fade_(fade) {}
  HWY_INLINE LatticeCorner operator()(VU lower, VU upper) const {
    return BlendCorners(At(lower, fraction_), At(upper, fraction_ - 1), fade_);
  }

 private:
  static HWY_INLINE LatticeCorner At(VU h, float fz) {
    const D d;
    V g[3];
    ScaledEdge(h, g);
    return {g[0], g[1], hn::MulAdd(g[2], hn::Set(d, fz), hn::Zero(d))};
  }
  const float fraction_, fade_;
};
#endif

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
