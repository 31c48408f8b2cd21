// THE point-block loop: runs a functor on the four planes of a block, vector by vector, for every point
// operation.
//
// How an operation uses it (src/ops/<family>/x.cc):
//
//   #undef HWY_TARGET_INCLUDE
//   #define HWY_TARGET_INCLUDE "ops/arithmetic/x.cc"
//   #include <hwy/foreach_target.h>   // compiles this file once per target
//   #include <hwy/highway.h>
//   #include "simd/point-inl.h"
//   HWY_BEFORE_NAMESPACE();
//   namespace tessera::ops::HWY_NAMESPACE {
//   namespace s = simd::HWY_NAMESPACE;
//   struct Add {                       // parameters are plain floats; Set() them per call, it costs nothing
//     HWY_INLINE s::Pixels operator()(const s::Pixels& a, const s::Pixels& b) const {
//       return {hn::Add(a.r, b.r), hn::Add(a.g, b.g), hn::Add(a.b, b.b), hn::Add(a.a, b.a)};
//     }                                // or: return s::Map(a, b, [](s::V x, s::V y) HWY_ATTR { return
//     hn::Add(x, y); });
//   };
//   std::unique_ptr<graph::PointStage> MakeAdd() { return s::MakeStage<2>(Add{}); }
//   }  // namespace tessera::ops::HWY_NAMESPACE
//   HWY_AFTER_NAMESPACE();
//   #if HWY_ONCE
//   namespace tessera::ops {
//   HWY_EXPORT(MakeAdd);
//   ... HWY_DYNAMIC_DISPATCH(MakeAdd)() in Op::MakePointStage ...
//   }
//   #endif
//
// Ordinary headers (<memory>, "graph/op.h", ...) are included above foreach_target.h. A functor that needs to
// know where it is takes a Position as its last argument; with kInputs = 0 it takes only that. The four
// planes are just four channels for a kChannel operation, R, G, B, A for a kColor one. Padding lanes may hold
// anything.
//
// Of up to three images and without a position, MakeFusedStage (simd/fused-inl.h) is the faster one: it reads
// and writes interleaved RGBA of any type itself.
#if defined(TESSERA_SIMD_POINT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_SIMD_POINT_INL_H_
#undef TESSERA_SIMD_POINT_INL_H_
#else
#define TESSERA_SIMD_POINT_INL_H_
#endif

#include <hwy/highway.h>

#include <memory>
#include <type_traits>
#include <utility>

#include "base/stage.h"

#if HWY_TARGET == HWY_SCALAR
#error \
    "Kernels need four lanes: compile for x86-64-v2 or Neon, or with a compiler for which Highway has EMU128"
#endif

HWY_BEFORE_NAMESPACE();
namespace tessera::simd::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The vector of every point kernel: at most kGroupPixels lanes, so that blocks are whole vectors.
using D = hn::CappedTag<float, kGroupPixels>;
using V = hn::Vec<D>;
using DI = hn::RebindToSigned<D>;
using DU = hn::RebindToUnsigned<D>;
using VI = hn::Vec<DI>;
using VU = hn::Vec<DU>;

constexpr int kLanes = static_cast<int>(hn::MaxLanes(D()));
static_assert(kLanes >= 4);

// One vector of pixels: four planes in registers.
struct Pixels {
  V r, g, b, a;
};

// f on each of the four planes.
template <class F>
HWY_INLINE Pixels Map(const Pixels& p, const F& f) {
  return {f(p.r), f(p.g), f(p.b), f(p.a)};
}
template <class F>
HWY_INLINE Pixels Map(const Pixels& p, const Pixels& q, const F& f) {
  return {f(p.r, q.r), f(p.g, q.g), f(p.b, q.b), f(p.a, q.a)};
}
template <class F>
HWY_INLINE Pixels Map(const Pixels& p, const Pixels& q, const Pixels& o, const F& f) {
  return {f(p.r, q.r, o.r), f(p.g, q.g, o.g), f(p.b, q.b, o.b), f(p.a, q.a, o.a)};
}

// The larger (smaller) of x and a bound that is a number; the bound when x is NaN. When x equals the bound
// the result is the bound (it decides the sign of zero), on every target.
HWY_INLINE V ClampLow(V x, V bound) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_EMU128
  return hn::Max(x, bound);
#else
  return hn::IfThenElse(hn::Gt(x, bound), x, bound);
#endif
}
HWY_INLINE V ClampHigh(V x, V bound) {
#if HWY_ARCH_X86 && HWY_TARGET != HWY_EMU128
  return hn::Min(x, bound);
#else
  return hn::IfThenElse(hn::Lt(x, bound), x, bound);
#endif
}
// min and max of two values in which the number wins over NaN; NaN only when both are. Equal values give b.
HWY_INLINE V MaxNumber(V a, V b) { return hn::IfThenElse(hn::IsNaN(b), a, ClampLow(a, b)); }
HWY_INLINE V MinNumber(V a, V b) { return hn::IfThenElse(hn::IsNaN(b), a, ClampHigh(a, b)); }

// Where the pixels of a vector are.
class Position {
 public:
  HWY_INLINE Position(const graph::PointArgs& args, int i) : args_(args), i_(i) {}
  // Image column of each lane, through the block's pixel order.
  HWY_INLINE VI X() const {
    const DI di;
    return hn::Add(hn::Set(di, args_.x), hn::LoadU(di, args_.order + i_));
  }
  // The same in float: exact within +-2^24.
  HWY_INLINE V XFloat() const { return hn::ConvertTo(D(), X()); }
  // Image row, the same for all lanes.
  HWY_INLINE int y() const { return args_.y; }
  // Index of the vector's first pixel in the block's planes.
  HWY_INLINE int index() const { return i_; }

 private:
  const graph::PointArgs& args_;
  int i_;
};

HWY_INLINE Pixels LoadPlanes(const float* const plane[4], int i) {
  const D d;
  return {hn::LoadU(d, plane[0] + i), hn::LoadU(d, plane[1] + i), hn::LoadU(d, plane[2] + i),
          hn::LoadU(d, plane[3] + i)};
}
HWY_INLINE void StorePlanes(const Pixels& p, float* const plane[4], int i) {
  const D d;
  hn::StoreU(p.r, d, plane[0] + i);
  hn::StoreU(p.g, d, plane[1] + i);
  hn::StoreU(p.b, d, plane[2] + i);
  hn::StoreU(p.a, d, plane[3] + i);
}

namespace detail {
template <class F, size_t... k>
HWY_INLINE Pixels Apply(const graph::PointArgs& args, const F& f, int i, std::index_sequence<k...>) {
  if constexpr (std::is_invocable_v<const F&, decltype((void)k, std::declval<const Pixels&>())...,
                                    Position>) {
    return f(LoadPlanes(args.in[k], i)..., Position(args, i));
  } else {
    return f(LoadPlanes(args.in[k], i)...);
  }
}
}  // namespace detail

// Runs f(in0, ..., in[kInputs - 1][, Position]) -> Pixels over the block.
template <int kInputs, class F>
HWY_INLINE void RunPoint(const graph::PointArgs& args, const F& f) {
  const int step = static_cast<int>(hn::Lanes(D())), count = args.count;
  float* const out[4] = {args.out[0], args.out[1], args.out[2], args.out[3]};
  for (int i = 0; i < count; i += step) {
    StorePlanes(detail::Apply(args, f, i, std::make_index_sequence<kInputs>()), out, i);
  }
}

// A stage that runs a functor.
template <int kInputs, class F>
class FunctorStage final : public graph::PointStage {
 public:
  explicit FunctorStage(F f) : f_(std::move(f)) {}
  void Run(const graph::PointArgs& args) const override { RunPoint<kInputs>(args, f_); }

 private:
  F f_;
};

template <int kInputs, class F>
std::unique_ptr<graph::PointStage> MakeStage(F f) {
  return std::make_unique<FunctorStage<kInputs, F>>(std::move(f));
}

}  // namespace tessera::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
