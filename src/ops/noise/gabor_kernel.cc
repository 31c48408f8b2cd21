// Gabor noise (Lagae et al. 2009): impulses in cells, each a Gaussian times a wave of random phase.
#include <algorithm>
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/gabor_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/noise/neighbour-inl.h"
#include "simd/lattice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VU;
using Mask = hn::Mask<s::D>;

constexpr int kSlots = 32;         // 3^dims cells, in whole vectors
constexpr int kListed = 16;        // impulses of a cell that are looked at together
constexpr int kDistinctCells = 4;  // lanes in more cells than that have lists of their own

// What is random about an impulse: its place in the cell, cycles per wave along the axes, and phase.
template <int kDims>
struct Impulse {
  V place[kDims], frequency[kDims], phase;
};
template <int kDims>
HWY_INLINE Impulse<kDims> NextImpulse(VU& state, const GaborShape& shape) {
  const s::D d;
  Impulse<kDims> impulse;
#pragma GCC unroll 16
  for (int a = 0; a < kDims; ++a) {
    state = s::LatticeNext(state, a + 2);
    impulse.place[a] = s::Unit(state);
  }
  state = s::LatticeNext(state, kDims + 2);
  impulse.phase = s::Unit(state);
  if (kDims == 1 || shape.orientation == GaborOrientation::kAnisotropic) {
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) impulse.frequency[a] = hn::Set(d, shape.direction[a]);
    return impulse;
  }
  V circle[2];
  state = s::LatticeNext(state, kDims + 3);
  s::LatticeGradient<2>(state, circle);
  if constexpr (kDims == 2) {
    impulse.frequency[0] = circle[0];
    impulse.frequency[1] = circle[1];
  } else if constexpr (kDims == 3) {
    if (shape.orientation == GaborOrientation::kHybrid) {
#pragma GCC unroll 16
      for (int a = 0; a < 3; ++a) {
        impulse.frequency[a] = hn::MulAdd(circle[0], hn::Set(d, shape.basis[0][a]),
                                          hn::Mul(circle[1], hn::Set(d, shape.basis[1][a])));
      }
      return impulse;
    }
    // Heights on a sphere are uniform (Archimedes).
    state = s::LatticeNext(state, kDims + 4);
    const V z = s::SignedUnit(state);
    const V rho = hn::Sqrt(hn::Max(hn::NegMulAdd(z, z, hn::Set(d, 1.0f)), hn::Zero(d)));
    impulse.frequency[0] = hn::Mul(rho, circle[0]);
    impulse.frequency[1] = hn::Mul(rho, circle[1]);
    impulse.frequency[2] = z;
  }
  return impulse;
}

// exp(-5 t) (1 - t^8)^2 of a square of a distance in radii, 0 from 1; with its slope. The exponential is the
// fourth power of a polynomial that is off by 1e-8.
struct Envelope {
  V value, slope;
};
template <bool kSlopes>
HWY_INLINE Envelope EnvelopeAt(V square) {
  const s::D d;
  const V one = hn::Set(d, 1.0f), t = hn::Min(square, one);
  V e = hn::MulAdd(t, hn::Set(d, -0.0005126292235217988f), hn::Set(d, 0.004669925197958946f));
  e = hn::MulAdd(t, e, hn::Set(d, -0.024929707869887352f));
  e = hn::MulAdd(t, e, hn::Set(d, 0.10149817913770676f));
  e = hn::MulAdd(t, e, hn::Set(d, -0.3254643380641937f));
  e = hn::MulAdd(t, e, hn::Set(d, 0.7812430262565613f));
  e = hn::MulAdd(t, e, hn::Set(d, -1.2499996423721313f));
  e = hn::MulAdd(t, e, one);
  e = hn::Mul(e, e);
  e = hn::Mul(e, e);
  const V t2 = hn::Mul(t, t), t4 = hn::Mul(t2, t2), end = hn::NegMulAdd(t4, t4, one);
  const V fall = hn::Mul(e, end);
  Envelope envelope;
  envelope.value = hn::Mul(fall, end);
  if constexpr (kSlopes) {
    const V t7 = hn::Mul(t4, hn::Mul(t2, t));
    const V steep = hn::MulAdd(hn::Set(d, 5.0f), end, hn::Mul(hn::Set(d, 16.0f), t7));
    envelope.slope = hn::Neg(hn::Mul(fall, steep));
  }
  return envelope;
}

// sin(2 pi y) of quarter turns, |y| <= 1/4, within 4e-8.
HWY_INLINE V SineOfQuarter(V y) {
  const s::D d;
  const V z = hn::Mul(y, y);
  V p = hn::MulAdd(z, hn::Set(d, 39.76072311401367f), hn::Set(d, -76.58128356933594f));
  p = hn::MulAdd(z, p, hn::Set(d, 81.60247802734375f));
  p = hn::MulAdd(z, p, hn::Set(d, -41.34168243408203f));
  p = hn::MulAdd(z, p, hn::Set(d, 6.2831854820251465f));
  return hn::Mul(y, p);
}

// Sums of a batch between two parts of a long list.
template <int kDims, bool kSlopes>
struct SumsSoFar {
  HWY_ALIGN float value[kNoiseBatch], slope[kSlopes ? kDims : 1][kSlopes ? kNoiseBatch : 1];
};

// Adds impulses at positions: a sum, and its slopes per wave.
template <int kDims, bool kSlopes>
class Sum {
 public:
  explicit HWY_INLINE Sum(const GaborShape& shape) : radius_(hn::Set(s::D(), shape.radius)) {
    const s::D d;
    value_ = hn::Zero(d);
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      slope_[a] = hn::Zero(d);
      across_[a] = hn::Set(d, shape.across[a]);
    }
  }
  HWY_INLINE void Load(const SumsSoFar<kDims, kSlopes>& from, int i) {
    const s::D d;
    value_ = hn::Load(d, from.value + i);
    for (int a = 0; a < kDims && kSlopes; ++a) slope_[a] = hn::Load(d, from.slope[a] + i);
  }
  HWY_INLINE void Keep(SumsSoFar<kDims, kSlopes>& in, int i) const {
    const s::D d;
    hn::Store(value_, d, in.value + i);
    for (int a = 0; a < kDims && kSlopes; ++a) hn::Store(slope_[a], d, in.slope[a] + i);
  }
  // From the position to the impulse, in radii; the square of its length.
  HWY_INLINE V Away(const V* corner, const V* place, V* q) const {
    V square = hn::Zero(s::D());
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      q[a] = hn::Mul(hn::Add(corner[a], place[a]), across_[a]);
      square = a == 0 ? hn::Mul(q[a], q[a]) : hn::MulAdd(q[a], q[a], square);
    }
    return square;
  }
  // None is at such distances.
  static HWY_INLINE bool IsBeyond(V square) {
    return hn::AllTrue(s::D(), hn::Ge(square, hn::Set(s::D(), 1.0f)));
  }
  HWY_INLINE void Add(V square, const V* q, const V* frequency, V phase) {
    const s::D d;
    const Envelope envelope = EnvelopeAt<kSlopes>(square);
    // Turns, in [-1/2, 1/2].
    const V turns = hn::MulAdd(s::Projection<kDims>(frequency, q), radius_, phase);
    const V turn = hn::Sub(turns, hn::Round(turns)), quarter = hn::Set(d, 0.25f);
    const V cosine = SineOfQuarter(hn::Sub(quarter, hn::Abs(turn)));
    value_ = hn::MulAdd(envelope.value, cosine, value_);
    if constexpr (kSlopes) {
      const V folded = hn::Sub(hn::CopySign(hn::Set(d, 0.5f), turn), turn);
      const V sine = SineOfQuarter(hn::IfThenElse(hn::Gt(hn::Abs(turn), quarter), folded, turn));
      // The position moves against q: by 1 / radius, and by a frequency's turns.
      const V out = hn::Mul(hn::Mul(hn::Set(d, -2.0f), envelope.slope), hn::Div(cosine, radius_));
      const V along = hn::Mul(hn::Mul(hn::Set(d, 6.2831853f), envelope.value), sine);
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a)
        slope_[a] = hn::MulAdd(out, q[a], hn::MulAdd(along, frequency[a], slope_[a]));
    }
  }
  // Stores the lanes of a mask.
  HWY_INLINE void Store(const NoiseBatch& b, int i, Mask lanes) const {
    const s::D d;
    const V scale = hn::Set(d, b.shape->scale), zero = hn::Zero(d);
    hn::BlendedStore(hn::MulAdd(value_, scale, zero), lanes, d, b.value + i);
    if constexpr (kSlopes) {
#pragma GCC unroll 16
      for (int a = 0; a < kDims; ++a)
        hn::BlendedStore(hn::MulAdd(slope_[a], scale, zero), lanes, d, b.slope[a] + i);
    }
  }

 private:
  V radius_, value_, across_[kDims], slope_[kDims];
};

// Corners of the three cells along each axis from positions in the middle one.
template <int kDims>
struct Corners {
  V of[kDims][3];

  HWY_INLINE Corners(const NoiseBatch& b, int i) {
    const s::D d;
#pragma GCC unroll 16
    for (int a = 0; a < kDims; ++a) {
      const V f = hn::LoadU(d, b.fraction[a] + i);
      for (int k = 0; k < 3; ++k) of[a][k] = hn::Sub(hn::Set(d, static_cast<float>(k - 1)), f);
    }
  }
  HWY_INLINE void At(int cell, V* corner) const {
    for (int a = 0; a < kDims; ++a, cell /= 3) corner[a] = of[a][cell % 3];
  }
};

// Impulses around one cell: what all positions in it share. `first` of a cell's impulses, and so many more.
template <int kDims>
class List {
 public:
  HWY_INLINE List(const NoiseBatch& b, const uint32_t* cell) : shape_(b.shape->gabor) {
    uint32_t side[kDims][3];
    for (int a = 0; a < kDims; ++a) {
      for (int k = 0; k < 3; ++k) {
        uint32_t c = cell[a] + static_cast<uint32_t>(k - 1);
        const uint32_t period = b.period[a];
        if (period != 0 && k == 0 && cell[a] == 0) c = period - 1;
        if (period != 0 && k == 2 && c == period) c = 0;
        side[a][k] = c * s::kAxis[a];
      }
    }
    for (int n = 0; n < kSlots; ++n) {
      uint32_t h = b.seed;
      for (int a = 0, rest = n; a < kDims; ++a, rest /= 3) h ^= side[a][rest % 3];
      state_[n] = h;
    }
    const s::DU du;
    for (int n = 0; n < Power3(kDims); n += s::kLanes)
      hn::Store(s::LatticeMix(hn::Load(du, state_ + n)), du, state_ + n);
  }
  // The next `count` of every cell, at most kListed.
  HWY_INLINE void Fill(int count) {
    const s::D d;
    const s::DU du;
    for (int n = 0; n < Power3(kDims); n += s::kLanes) {
      VU state = hn::Load(du, state_ + n);
      for (int m = 0; m < count; ++m) {
        const Impulse<kDims> impulse = NextImpulse<kDims>(state, shape_);
        for (int a = 0; a < kDims; ++a) {
          hn::Store(impulse.place[a], d, place_[a][m] + n);
          hn::Store(impulse.frequency[a], d, frequency_[a][m] + n);
        }
        hn::Store(impulse.phase, d, phase_[m] + n);
      }
      hn::Store(state, du, state_ + n);
    }
  }
  template <bool kSlopes>
  HWY_INLINE void AddTo(Sum<kDims, kSlopes>& sum, const Corners<kDims>& corners, int count) const {
    const s::D d;
    for (int m = 0; m < count; ++m) {
      for (int n = 0; n < Power3(kDims); ++n) {
        V corner[kDims], place[kDims], q[kDims];
        corners.At(n, corner);
#pragma GCC unroll 16
        for (int a = 0; a < kDims; ++a) place[a] = hn::Set(d, place_[a][m][n]);
        const V square = sum.Away(corner, place, q);
        if (sum.IsBeyond(square)) continue;
        V frequency[kDims];
#pragma GCC unroll 16
        for (int a = 0; a < kDims; ++a) frequency[a] = hn::Set(d, frequency_[a][m][n]);
        sum.Add(square, q, frequency, hn::Set(d, phase_[m][n]));
      }
    }
  }

 private:
  const GaborShape& shape_;
  HWY_ALIGN uint32_t state_[kSlots];
  HWY_ALIGN float place_[kDims][kListed][kSlots], frequency_[kDims][kListed][kSlots], phase_[kListed][kSlots];
};

// Positions of one cell: vectors from `begin`, whose lanes of `lanes` alone are stored.
template <int kDims, bool kSlopes>
HWY_NOINLINE void OneCell(const NoiseBatch& b, const uint32_t* cell, int begin, int end, Mask lanes) {
  const GaborShape& shape = b.shape->gabor;
  List<kDims> list(b, cell);
  SumsSoFar<kDims, kSlopes> sums;
  for (int m = 0; m < shape.impulses; m += kListed) {
    const int count = std::min(kListed, shape.impulses - m);
    list.Fill(count);
    for (int i = begin; i < end; i += s::kLanes) {
      Sum<kDims, kSlopes> sum(shape);
      if (m > 0) sum.Load(sums, i);
      list.AddTo(sum, Corners<kDims>(b, i), count);
      if (m + count < shape.impulses) {
        sum.Keep(sums, i);
      } else {
        sum.Store(b, i, lanes);
      }
    }
  }
}

// Positions anywhere: every lane has cells of its own.
template <int kDims, bool kSlopes>
HWY_NOINLINE void ManyCells(const NoiseBatch& b, int i) {
  const GaborShape& shape = b.shape->gabor;
  const Corners<kDims> corners(b, i);
  VU state[Power3(kDims)];
  int n = 0;
  ForNeighbours<kDims>(b, i, [&](VU h, const V*) HWY_ATTR { state[n++] = h; });
  Sum<kDims, kSlopes> sum(shape);
  for (int m = 0; m < shape.impulses; ++m) {
    for (n = 0; n < Power3(kDims); ++n) {
      const Impulse<kDims> impulse = NextImpulse<kDims>(state[n], shape);
      V corner[kDims], q[kDims];
      corners.At(n, corner);
      const V square = sum.Away(corner, impulse.place, q);
      if (!sum.IsBeyond(square)) sum.Add(square, q, impulse.frequency, impulse.phase);
    }
  }
  sum.Store(b, i, hn::FirstN(s::D(), s::kLanes));
}

// Lanes that are in the cell of lane `k`, which is returned.
template <int kDims>
HWY_INLINE Mask SameCell(const NoiseBatch& b, int i, int k, uint32_t* cell) {
  const s::D d;
  const s::DU du;
  auto same = hn::FirstN(du, s::kLanes);
#pragma GCC unroll 16
  for (int a = 0; a < kDims; ++a) {
    cell[a] = b.cell[a][i + k];
    same = hn::And(same, hn::Eq(hn::LoadU(du, b.cell[a] + i), hn::Set(du, cell[a])));
  }
  return hn::RebindMask(d, same);
}

// The same sums in the same order whichever way a vector goes.
template <int kDims, bool kSlopes>
void Gabor(const NoiseBatch& b) {
  const s::D d;
  constexpr int kLanes = s::kLanes;
  for (int i = 0; i < b.count;) {
    // Lanes beyond the last position are not looked at.
    const Mask present = hn::FirstN(d, static_cast<size_t>(std::min(kLanes, b.count - i)));
    uint32_t cell[kDims], other[kDims];
    const Mask same = SameCell<kDims>(b, i, 0, cell);
    if (hn::AllTrue(d, hn::Or(same, hn::Not(present)))) {
      int end = i + kLanes;
      while (end + kLanes <= b.count && hn::AllTrue(d, SameCell<kDims>(b, end, 0, other)) &&
             std::equal(cell, cell + kDims, other)) {
        end += kLanes;
      }
      OneCell<kDims, kSlopes>(b, cell, i, end, present);
      i = end;
      continue;
    }
    int first[kDistinctCells];  // lane of a cell that none before has
    int cells = 0;
    Mask rest = present;
    for (; cells < kDistinctCells && !hn::AllFalse(d, rest); ++cells) {
      first[cells] = static_cast<int>(hn::FindKnownFirstTrue(d, rest));
      rest = hn::AndNot(SameCell<kDims>(b, i, first[cells], other), rest);
    }
    if (hn::AllFalse(d, rest)) {
      for (int k = 0; k < cells; ++k) {
        const Mask lanes = SameCell<kDims>(b, i, first[k], cell);
        OneCell<kDims, kSlopes>(b, cell, i, i + kLanes, lanes);
      }
    } else {
      ManyCells<kDims, kSlopes>(b, i);
    }
    i += kLanes;
  }
}

NoiseEvaluate FindGaborNoise(int dims, bool slopes) {
  switch (dims) {
    case 1:
      return slopes ? Gabor<1, true> : Gabor<1, false>;
    case 2:
      return slopes ? Gabor<2, true> : Gabor<2, false>;
    default:
      return slopes ? Gabor<3, true> : Gabor<3, false>;
  }
}

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(FindGaborNoise);
static NoiseEvaluate Choose(int dims, bool slopes) {
  return HWY_DYNAMIC_DISPATCH(FindGaborNoise)(dims, slopes);
}
}  // namespace noise

NoiseEvaluate FindGabor(int dims, bool slopes) { return noise::Choose(dims, slopes); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
