// Lattice noise on grids: a row of pixels crosses each lattice column once, so a column collapses to two
// numbers.
//
// On a row, n(x) = lerp(A[i] + B[i] f, A[i+1] + B[i+1] (f - 1), u(f)) with A and B per lattice column, the
// gradients blended over the other axes. That is c0 + c1 f + u (c2 + c3 f): three multiply-adds per pixel
// with four numbers per cell. The blend over the third and fourth axis is kept as long as rows stay between
// the same two lattice rows.
#include <algorithm>
#include <cstdint>

#include "graph/op.h"
#include "ops/noise/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/noise/grid_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/noise/shaped-inl.h"
#include "simd/edges-inl.h"
#include "simd/lattice-inl.h"
#include "simd/pixels-inl.h"
#include "simd/shuffle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::noise::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;
using s::V;
using s::VI;
using s::VU;

HWY_INLINE V Lerp(V a, V b, V t) { return hn::MulAdd(t, hn::Sub(b, a), a); }

using s::BlendCorners;
using s::LatticeCorner;

template <int kDims, bool kGradient>
HWY_INLINE LatticeCorner At(VU hash, float fz, float fw) {
  const s::D d;
  const VU h = s::LatticeMix(hash);
  if constexpr (!kGradient) {
    return {hn::Zero(d), hn::Zero(d), s::SignedUnit(h)};
  } else {
    V g[kDims];
    s::LatticeGradient<kDims>(h, g);
    V rest = hn::Zero(d);
    if constexpr (kDims == 4) rest = hn::Mul(g[3], hn::Set(d, fw));
    if constexpr (kDims >= 3) rest = hn::MulAdd(g[2], hn::Set(d, fz), rest);
    return {g[0], g[1], rest};
  }
}

// Three dimensions, by edges: times kEdgeUnit.
void FillSlice(const GridFill& a) {
  const s::D d;
  const s::DU du;
  const s::BlendedEdges blended(a.z.fraction, a.z.fade);
  const VU lower = hn::Set(du, a.row_hash ^ a.z.hash[0]), upper = hn::Set(du, a.row_hash ^ a.z.hash[1]);
  const uint32_t* const column_hash = a.column_hash;
  const GridLatticeRow out = a.out;
  const int count = a.count;
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const VU column = hn::LoadU(du, column_hash + i);
    const LatticeCorner c =
        blended(s::LatticeMix(hn::Xor(column, lower)), s::LatticeMix(hn::Xor(column, upper)));
    hn::StoreU(c.gx, d, out.gx + i);
    hn::StoreU(c.gy, d, out.gy + i);
    hn::StoreU(c.rest, d, out.rest + i);
  }
}

template <int kDims, bool kGradient>
void FillRow(const GridFill& fill) {
  const GridFill a = fill;  // a copy, which no store can change
  const s::D d;
  const s::DU du;
  for (int i = 0; i < a.count; i += static_cast<int>(hn::Lanes(d))) {
    const VU column = hn::LoadU(du, a.column_hash + i);
    const auto over_z = [&](uint32_t hash, float fw) HWY_ATTR {
      if constexpr (kDims < 3) {
        return At<kDims, kGradient>(hn::Xor(column, hn::Set(du, hash)), 0, 0);
      } else {
        const float f = a.z.fraction;
        return BlendCorners(At<kDims, kGradient>(hn::Xor(column, hn::Set(du, hash ^ a.z.hash[0])), f, fw),
                            At<kDims, kGradient>(hn::Xor(column, hn::Set(du, hash ^ a.z.hash[1])), f - 1, fw),
                            a.z.fade);
      }
    };
    LatticeCorner c = over_z(a.row_hash ^ a.w.hash[0], a.w.fraction);
    if constexpr (kDims == 4)
      c = BlendCorners(c, over_z(a.row_hash ^ a.w.hash[1], a.w.fraction - 1), a.w.fade);
    hn::StoreU(c.gx, d, a.out.gx + i);
    hn::StoreU(c.gy, d, a.out.gy + i);
    hn::StoreU(c.rest, d, a.out.rest + i);
  }
}

void Fill(const GridFill& a) {
  switch (2 * a.dims + (a.gradient ? 1 : 0)) {
    case 4:
      return FillRow<2, false>(a);
    case 5:
      return FillRow<2, true>(a);
    case 6:
      return FillRow<3, false>(a);
    case 7:
      return FillSlice(a);
    case 8:
      return FillRow<4, false>(a);
    default:
      return FillRow<4, true>(a);
  }
}

float FillUnit(int dims, bool gradient) { return dims == 3 && gradient ? s::kEdgeUnit : 1; }

struct Coefficients {
  V c0, c1, c2, c3;
};

// Calls store(i, coefficients) for the row's first `used` columns, a vector at a time, and last() for a part
// of one. Neighbours are moved between registers: a load so soon after the stores would wait for them.
template <class Store, class Last>
HWY_INLINE void Collapse(const GridRow& a, int used, const Store& store, const Last& last) {
  const s::D d;
  const int lanes = static_cast<int>(hn::Lanes(d)), count = a.columns.count;
  const V fy = hn::Set(d, a.fraction), fy1 = hn::Set(d, a.fraction - 1), v = hn::Set(d, a.fade);
  const V scale = hn::Set(d, a.scale);
  struct Column {
    V constant, slope;
  };
  // Copies, which no store can change.
  const GridLatticeRow lower = a.lower, upper = a.upper;
  const auto column = [&](int i) HWY_ATTR {
    const V low = hn::MulAdd(hn::LoadU(d, lower.gy + i), fy, hn::LoadU(d, lower.rest + i));
    const V high = hn::MulAdd(hn::LoadU(d, upper.gy + i), fy1, hn::LoadU(d, upper.rest + i));
    const V slope = Lerp(hn::LoadU(d, lower.gx + i), hn::LoadU(d, upper.gx + i), v);
    return Column{hn::Mul(Lerp(low, high, v), scale), hn::Mul(slope, scale)};
  };
  const auto between = [&](const Column& here, const Column& next) HWY_ATTR {
    const V right = s::OneOn(here.constant, next.constant), right_slope = s::OneOn(here.slope, next.slope);
    return Coefficients{here.constant, here.slope, hn::Sub(hn::Sub(right, right_slope), here.constant),
                        hn::Sub(right_slope, here.slope)};
  };
  Column here = column(0);
  int i = 0;
  for (const int whole = std::min(used, count - 1) / lanes * lanes; i < whole; i += lanes) {
    const Column next = column(i + lanes);
    store(i, between(here, next));
    here = next;
  }
  if (i < used) last(i, between(here, here));  // the entry after the last column is never used
}
template <class Store>
HWY_INLINE void Collapse(const GridRow& a, const Store& store) {
  Collapse(a, a.columns.count, store, store);
}

// One of half as many entries as a vector has lanes.
HWY_INLINE V PickOfHalf(const float* p, VI index) {
  const s::D d;
  if constexpr (s::kLanes == 8) return s::OneOfFour(hn::LoadDup128(d, p), hn::BitCast(s::DU(), index));
  const V table = hn::ZeroExtendVector(d, hn::LoadU(hn::Half<s::D>(), p));
  return hn::TableLookupLanes(table, hn::IndicesFromVec(d, index));
}

// So few vectors between the same two columns are permuted as their neighbours are.
constexpr int kFew = 4;

// Sorts the vectors of a tile's rows by what they need of the columns.
void Arrange(const int32_t* left, int count, GridLayout& layout) {
  const int lanes = static_cast<int>(hn::Lanes(s::D())), first = left[0];
  layout.run_count = 0;
  layout.consecutive = true;
  for (int x = 0; x < count; x += lanes) {
    const int base = left[x], span = left[x + lanes - 1] - base;
    const GridReach reach = span == 0          ? GridReach::kOne
                            : span >= lanes    ? GridReach::kScattered
                            : 2 * span < lanes ? GridReach::kHalf
                                               : GridReach::kWhole;
    layout.base[x / lanes] = base - first;
    for (int i = x; i < x + lanes; ++i) {
      layout.index[i] = left[i] - (reach == GridReach::kScattered ? first : base);
      layout.consecutive &= i >= count || left[i] - first == i;
    }
    GridRun* last = layout.run_count > 0 ? &layout.runs[layout.run_count - 1] : nullptr;
    if (reach == GridReach::kHalf && last != nullptr && last->reach == GridReach::kOne &&
        last->end - last->begin < kFew) {
      last->reach = GridReach::kHalf;
      if (layout.run_count > 1 && last[-1].reach == GridReach::kHalf) {
        last[-1].end = last->end;
        --last, --layout.run_count;
      }
    }
    if (last != nullptr && last->reach == reach) {
      ++last->end;
    } else {
      layout.runs[layout.run_count++] = {reach, x / lanes, x / lanes + 1};
    }
  }
}

// A row's coefficients where they fit a vector each.
struct InRegisters {
  Coefficients all;

  HWY_INLINE Coefficients At(VI column) const {
    const auto index = hn::IndicesFromVec(s::D(), column);
    const auto pick = [&](V table) HWY_ATTR { return hn::TableLookupLanes(table, index); };
    return {pick(all.c0), pick(all.c1), pick(all.c2), pick(all.c3)};
  }
  HWY_INLINE Coefficients One(int base) const { return At(hn::Set(s::DI(), base)); }
  HWY_INLINE Coefficients Half(int base, VI index) const { return Whole(base, index); }
  HWY_INLINE Coefficients Whole(int base, VI index) const {
    return At(hn::Add(index, hn::Set(s::DI(), base)));
  }
  HWY_INLINE Coefficients Scattered(VI index) const { return At(index); }
};
// The same where they are stored.
struct InMemory {
  const float* c[4];

  template <class Pick>
  HWY_INLINE Coefficients Each(const Pick& pick) const {
    return {pick(c[0]), pick(c[1]), pick(c[2]), pick(c[3])};
  }
  HWY_INLINE Coefficients One(int base) const {
    return Each([&](const float* p) HWY_ATTR { return hn::Set(s::D(), p[base]); });
  }
  HWY_INLINE Coefficients Half(int base, VI index) const {
    return Each([&](const float* p) HWY_ATTR { return PickOfHalf(p + base, index); });
  }
  HWY_INLINE Coefficients Whole(int base, VI index) const {
    const auto lane = hn::IndicesFromVec(s::D(), index);
    return Each([&](const float* p)
                    HWY_ATTR { return hn::TableLookupLanes(hn::LoadU(s::D(), p + base), lane); });
  }
  HWY_INLINE Coefficients Scattered(VI index) const {
    return Each([&](const float* p) HWY_ATTR { return hn::GatherIndex(s::D(), p, index); });
  }
};

// Calls write(x, coefficients) for every vector of pixels.
template <class Source, class Write>
HWY_INLINE void ForPixels(const GridLayout& layout, const Source& source, const Write& write) {
  const s::DI di;
  const int lanes = static_cast<int>(hn::Lanes(di));
  const int32_t *const base = layout.base, *const index = layout.index;
  for (const GridRun *run = layout.runs, *end = run + layout.run_count; run != end; ++run) {
    const int last = run->end;
    int v = run->begin;
    switch (run->reach) {
      case GridReach::kOne:
        while (v < last) {
          const int column = base[v];
          const Coefficients k = source.One(column);
          for (; v < last && base[v] == column; ++v) write(v * lanes, k);
        }
        break;
      case GridReach::kHalf:
        for (; v < last; ++v) write(v * lanes, source.Half(base[v], hn::LoadU(di, index + v * lanes)));
        break;
      case GridReach::kWhole:
        for (; v < last; ++v) write(v * lanes, source.Whole(base[v], hn::LoadU(di, index + v * lanes)));
        break;
      case GridReach::kScattered:
        for (; v < last; ++v) write(v * lanes, source.Scattered(hn::LoadU(di, index + v * lanes)));
        break;
    }
  }
}

// The last vector of a row: tables are padded, the output is not.
HWY_NOINLINE void WriteTail(const GridRow& a, int x, V n) {
  const s::D d;
  HWY_ALIGN float tail[kNoisePadding];
  for (int i = x; i < a.count; ++i) tail[i - x] = a.add ? a.out[i] : a.bias;
  hn::StoreU(hn::MulAdd(n, hn::Set(d, a.weight), hn::LoadU(d, tail)), d, tail);
  for (int i = x; i < a.count; ++i) a.out[i] = tail[i - x];
}

// Makes pixels from coefficients. Copies of what the row says, which no store can change.
template <NoiseSum kSum>
class Writer {
 public:
  explicit HWY_INLINE Writer(const GridRow& row)
      : row_(row),
        fraction_(row.columns.fraction),
        fade_(row.columns.fade),
        out_(row.out),
        count_(row.count),
        add_(row.add),
        stream_(row.stream),
        weight_(hn::Set(s::D(), row.weight)),
        bias_(hn::Set(s::D(), row.bias)) {}
  HWY_INLINE void operator()(int x, const Coefficients& k) const {
    const V n = Noise(x, k);
    if (HWY_UNLIKELY(x + static_cast<int>(hn::Lanes(s::D())) > count_)) return WriteTail(row_, x, n);
    Write(x, n);
  }
  // Where all of the vector is of the row.
  HWY_INLINE void Whole(int x, const Coefficients& k) const { Write(x, Noise(x, k)); }

 private:
  HWY_INLINE V Noise(int x, const Coefficients& k) const {
    const s::D d;
    const V f = hn::LoadU(d, fraction_ + x), u = hn::LoadU(d, fade_ + x);
    return Shaped<kSum>(hn::MulAdd(u, hn::MulAdd(k.c3, f, k.c2), hn::MulAdd(k.c1, f, k.c0)));
  }
  HWY_INLINE void Write(int x, V n) const {
    const s::D d;
    s::StoreOrStream(hn::MulAdd(n, weight_, add_ ? hn::LoadU(d, out_ + x) : bias_), d, out_ + x, stream_);
  }

  const GridRow& row_;
  const float *const fraction_, *const fade_;
  float* const out_;
  const int count_;
  const bool add_, stream_;
  const V weight_, bias_;
};

// By itself: narrow rows, as those of blocks, would notice what the other kinds prepare.
template <NoiseSum kSum>
HWY_NOINLINE void ConsecutiveRow(const GridRow& a) {
  const Writer<kSum> write(a);
  Collapse(
      a, a.count, [&](int x, const Coefficients& k) HWY_ATTR { write.Whole(x, k); }, write);
}

template <NoiseSum kSum>
HWY_NOINLINE void SpreadRow(const GridRow& a) {
  const s::D d;
  const Writer<kSum> write(a);
  const int spans = a.columns.count - 1;  // between columns; only they are looked up
  if (spans <= static_cast<int>(hn::Lanes(d))) {
    InRegisters source{};
    const auto keep = [&](int, const Coefficients& k) HWY_ATTR { source.all = k; };
    Collapse(a, spans, keep, keep);
    ForPixels(a.columns.layout, source, write);
  } else {
    float* c[4];
    for (int k = 0; k < 4; ++k) c[k] = a.scratch + k * (a.columns.count + 2 * kNoisePadding);
    Collapse(a, [&](int i, const Coefficients& k) HWY_ATTR {
      hn::StoreU(k.c0, d, c[0] + i), hn::StoreU(k.c1, d, c[1] + i);
      hn::StoreU(k.c2, d, c[2] + i), hn::StoreU(k.c3, d, c[3] + i);
    });
    ForPixels(a.columns.layout, InMemory{{c[0], c[1], c[2], c[3]}}, write);
  }
}

template <NoiseSum kSum>
void RowOf(const GridRow& a) {
  if (a.columns.layout.consecutive) return ConsecutiveRow<kSum>(a);
  SpreadRow<kSum>(a);
}

void Row(const GridRow& a) {
  switch (a.sum) {
    case NoiseSum::kFbm:
      return RowOf<NoiseSum::kFbm>(a);
    case NoiseSum::kTurbulence:
      return RowOf<NoiseSum::kTurbulence>(a);
    case NoiseSum::kBillow:
      return RowOf<NoiseSum::kBillow>(a);
    case NoiseSum::kRidged:
      return RowOf<NoiseSum::kRidged>(a);
  }
}

// Stamps one lattice column's block of a row: out += low * window + gx * (x window).
void Stamp(const GridStamp& a) {
  const s::D d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const V rest = hn::Set(d, a.rest), gx = hn::Set(d, a.gx);
  for (int t = 0; t < a.taps; t += lanes) {
    V v = hn::LoadU(d, a.out + t);
    v = hn::MulAdd(rest, hn::LoadU(d, a.window + t), v);
    if (a.gx != 0) v = hn::MulAdd(gx, hn::LoadU(d, a.ramp + t), v);
    hn::StoreU(v, d, a.out + t);
  }
}

GridKernels MakeGridKernels() { return {Arrange, FillUnit, Fill, Row, Stamp}; }

}  // namespace tessera::ops::noise::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace noise {
HWY_EXPORT(MakeGridKernels);
static GridKernels Choose() { return HWY_DYNAMIC_DISPATCH(MakeGridKernels)(); }
}  // namespace noise

GridKernels FindGridKernels() { return noise::Choose(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
