// The kernel of curves by formula: each plane of a block by a loop made for its formula.
#include "ops/curve/curve_kernel.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>

#include "base/block.h"
#include "ops/curve/curve_constants.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/curve/curve_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/curve/curve_pieces-inl.h"
#include "ops/curve/fast_curve-inl.h"
#include "simd/fused-inl.h"
#include "simd/gather-inl.h"
#include "simd/math-inl.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::Precision;
using s::V;
using s::VD;
using Kind = CurveFormula::Kind;

HWY_INLINE VD Set(double v) { return hn::Set(s::DD(), v); }

// v^e of v >= 0 and e > 0, to the precision of a double where asked.
template <Precision kPrecision = Precision::kFloat>
HWY_INLINE VD PowerOf(VD v, double e) {
  const VD t = hn::Mul(s::Log2OfDouble<kPrecision>(v), Set(e));
  return hn::IfThenElseZero(hn::Gt(v, Set(0.0)), s::Exp2OfDouble<kPrecision>(s::ClampExponent(t)));
}

HWY_INLINE VD PqOfLight(VD x) {
  // Errors of u grow 30 times at most: 2^-29 of the result. Light of 0 counts as 2^-1000.
  const VD u = s::Exp2OfDouble(hn::Mul(s::Log2OfDouble(hn::Max(x, Set(0x1p-1000))), Set(kPqM1)));
  const VD ratio = hn::Div(hn::MulAdd(u, Set(kPqC2), Set(kPqC1)), hn::MulAdd(u, Set(kPqC3), Set(1.0)));
  return s::Exp2OfDouble(hn::Mul(s::Log2OfDouble(ratio), Set(kPqM2)));
}
HWY_INLINE VD LightOfPq(VD x) {
  const VD u = PowerOf<Precision::kDouble>(hn::Max(x, Set(0.0)), 1 / kPqM2);
  const VD above = hn::Max(hn::Sub(u, Set(kPqC1)), Set(0.0));
  const VD below = hn::NegMulAdd(u, Set(kPqC3), Set(kPqC2));
  // Beyond the formula's pole, at a signal near 2, light is infinite.
  return hn::IfThenElse(hn::Gt(below, Set(0.0)), PowerOf(hn::Div(above, below), 1 / kPqM1),
                        Set(std::numeric_limits<double>::infinity()));
}

HWY_INLINE VD HlgOfLight(VD x) {
  const VD root = hn::Sqrt(hn::Mul(hn::Max(x, Set(0.0)), Set(3.0)));
  const VD inside = hn::Max(hn::MulAdd(x, Set(12.0), Set(-kHlgB)), Set(0.1));
  const VD log = hn::MulAdd(s::Log2OfDouble(inside), Set(kHlgA * kLn2), Set(kHlgC));
  return hn::IfThenElse(hn::Lt(x, Set(1.0 / 12)), root, log);
}
HWY_INLINE VD LightOfHlg(VD x) {
  const VD square = hn::Mul(hn::Mul(x, x), Set(1.0 / 3));
  const VD t = hn::Mul(hn::Sub(x, Set(kHlgC)), Set(1 / (kHlgA * kLn2)));
  const VD above = hn::Mul(hn::Add(s::Exp2OfDouble(s::ClampExponent(t)), Set(kHlgB)), Set(1.0 / 12));
  return hn::IfThenElse(hn::Lt(x, Set(0.5)), square, above);
}

// The formula from its join on, of doubles that stand for finite floats.
template <Kind kKind>
HWY_INLINE VD Evaluate(VD x, const CurveFormula& f) {
  if constexpr (kKind == Kind::kPq) return PqOfLight(x);
  if constexpr (kKind == Kind::kPqInverse) return LightOfPq(x);
  if constexpr (kKind == Kind::kHlg) return HlgOfLight(x);
  if constexpr (kKind == Kind::kHlgInverse) return LightOfHlg(x);
  if constexpr (kKind == Kind::kLinear) return hn::MulAdd(x, Set(f.slope), Set(f.offset));
  const VD v = hn::MulAdd(x, Set(f.in_scale), Set(f.in_offset));
  VD w = v;
  const bool sum = f.out_offset != 0;  // it may cancel
  if constexpr (kKind == Kind::kPower) {
    w = sum ? PowerOf<Precision::kDouble>(v, f.exponent) : PowerOf(v, f.exponent);
  } else if constexpr (kKind == Kind::kLog) {
    const VD positive = hn::Max(v, Set(std::max(f.floor, DBL_MIN)));
    w = sum ? s::Log2OfDouble<Precision::kDouble>(positive) : s::Log2OfDouble(positive);
    if (f.floor <= 0)
      w = hn::IfThenElse(hn::Gt(v, Set(0.0)), w, Set(-std::numeric_limits<double>::infinity()));
  } else if constexpr (kKind == Kind::kExp) {
    const VD t = s::ClampExponent(v);
    w = sum ? s::Exp2OfDouble<Precision::kDouble>(t) : s::Exp2OfDouble(t);
  }
  return hn::MulAdd(w, Set(f.out_scale), Set(f.out_offset));
}

// The least float that is not below the join.
float JoinOf(const CurveFormula& f) {
  const auto nearest = static_cast<float>(f.join);
  return nearest < f.join ? std::nextafter(nearest, std::numeric_limits<float>::infinity()) : nearest;
}

// How a loop that has no tables of pieces evaluates its formula: all in double, or most in double-float, with
// and without inner and outer scales.
enum class Way : uint8_t { kDouble, kFast, kFastInner, kFastOuter, kFastBoth };

// A plane's curve and the loop that was made for it.
struct CurveWork {
  using Loop = void (*)(const CurveWork&, const float*, float*, int);
  PlaneCurve curve;
  Loop loop = nullptr;
#if TESSERA_DOUBLE_FLOAT
  FastCurve fast;
  CurvePieces pieces;
#endif
  bool active() const { return curve.active; }
  bool quick() const { return curve.formula.kind == Kind::kLinear; }  // quicker than to look it up
  void operator()(const float* in, float* out, int count) const { loop(*this, in, out, count); }
};

// A vector in which some samples may be anything: below the join, negative, 0, infinite, NaN. `able` marks
// the samples whose formula has been computed: their results are in `y`.
template <Kind kKind>
HWY_NOINLINE V AnyValue(V x, V v, V y, hn::Mask<s::D> able, const PlaneCurve& curve) {
  const s::D d;
  const CurveFormula& f = curve.formula;
  const V zero = hn::Zero(d), infinity = hn::Set(d, std::numeric_limits<float>::infinity());
  const auto below = hn::AndNot(able, hn::Lt(v, hn::Set(d, JoinOf(f))));
  const auto finite = hn::Lt(hn::Abs(x), infinity), at_zero = hn::AndNot(able, hn::Eq(v, zero));
  y = hn::IfThenElse(at_zero, hn::Set(d, curve.at_zero), y);
  const auto done = hn::Or(hn::Or(able, at_zero), hn::Or(below, hn::Not(finite)));
  if (!hn::AllTrue(d, done)) {
    const auto formula = [&f](VD w) HWY_ATTR { return Evaluate<kKind>(w, f); };
    y = hn::IfThenElse(done, y, s::InDouble(formula, v));
  }
  if (!hn::AllFalse(d, below)) {
    const auto line = [&f](VD w) HWY_ATTR { return hn::MulAdd(w, Set(f.slope), Set(f.offset)); };
    y = hn::IfThenElse(below, s::InDouble(line, v), y);
  }
  if (f.negatives == Negatives::kMirror) y = hn::Xor(y, hn::And(x, hn::Set(d, -0.0f)));
  if (f.negatives == Negatives::kKeep) y = hn::IfThenElse(hn::Lt(x, zero), x, y);
  if (!hn::AllTrue(d, finite)) {
    const V top = hn::Set(d, curve.at_infinity), bottom = hn::Set(d, curve.at_minus_infinity);
    y = hn::IfThenElse(finite, y, hn::IfThenElse(hn::Eq(x, infinity), top, bottom));
    y = hn::IfThenElse(hn::IsNaN(x), x, y);
  }
  return y;
}

// The formula of nearly all samples; `able` marks them.
template <Kind kKind, Way kWay>
HWY_INLINE V ValueOf(V v, const CurveWork& work, hn::Mask<s::D>& able) {
#if TESSERA_DOUBLE_FLOAT
  if constexpr (kWay != Way::kDouble) {
    constexpr bool kInner = kWay == Way::kFastInner || kWay == Way::kFastBoth;
    constexpr bool kOuter = kWay == Way::kFastOuter || kWay == Way::kFastBoth;
    return FastValue<kKind, kInner, kOuter>(v, work.fast, able);
  }
#endif
  const s::D d;
  able =
      hn::And(hn::Ne(v, hn::Zero(d)), hn::Lt(hn::Abs(v), hn::Set(d, std::numeric_limits<float>::infinity())));
  return s::InDouble([&work](VD x) HWY_ATTR { return Evaluate<kKind>(x, work.curve.formula); }, v);
}

// Whether a formula takes negative samples, of the sign that is left to it, as 0.
bool TakesNegativesAsZero(const CurveFormula& f) {
  return f.negatives == Negatives::kClamp || f.kind == Kind::kPq || f.kind == Kind::kPqInverse ||
         f.kind == Kind::kHlg;
}

// One plane; `in` and `out` may be the same.
template <Kind kKind, Way kWay>
void RunPlane(const CurveWork& work, const float* in, float* out, int count) {
  const s::D d;
  const CurveFormula& f = work.curve.formula;
  const bool keep = f.negatives == Negatives::kKeep, limit = TakesNegativesAsZero(f);
  const V zero = hn::Zero(d), sign = hn::Set(d, f.negatives == Negatives::kMirror ? -0.0f : 0.0f);
  const V join = hn::Set(d, keep ? std::max(JoinOf(f), 0.0f) : JoinOf(f));
  const V lowest = hn::Set(d, keep ? 0.0f : -std::numeric_limits<float>::max());
  const auto line = [&f](VD w) HWY_ATTR { return hn::MulAdd(w, Set(f.slope), Set(f.offset)); };
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const V x = hn::LoadU(d, in + i);
    V v = hn::AndNot(sign, x);
    if (limit) v = hn::IfThenElse(hn::Lt(v, zero), zero, v);
    hn::Mask<s::D> able;
    V y = ValueOf<kKind, kWay>(v, work, able);
    const auto below = hn::And(hn::Lt(v, join), hn::Ge(v, lowest));
    able = hn::And(able, hn::Ge(v, join));
    if (HWY_LIKELY(hn::AllTrue(d, hn::Or(able, below)))) {
      if (!hn::AllFalse(d, below)) y = hn::IfThenElse(below, s::InDouble(line, v), y);
      y = hn::Xor(y, hn::And(x, sign));
    } else {
      y = AnyValue<kKind>(x, v, y, able, work.curve);
    }
    hn::StoreU(y, d, out + i);
  }
}

#if TESSERA_DOUBLE_FLOAT
// One plane by tables of pieces, which have the join and the linear part in them.
template <Kind kKind>
void RunPieces(const CurveWork& work, const float* in, float* out, int count) {
  const s::D d;
  const CurveFormula& f = work.curve.formula;
  const bool keep = f.negatives == Negatives::kKeep, limit = TakesNegativesAsZero(f);
  const V zero = hn::Zero(d), sign = hn::Set(d, f.negatives == Negatives::kMirror ? -0.0f : 0.0f);
  const Pieces pieces(work.pieces);
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const V x = hn::LoadU(d, in + i);
    V v = hn::AndNot(sign, x);
    if (limit) v = hn::IfThenElse(hn::Lt(v, zero), zero, v);
    hn::Mask<s::D> able;
    V y = pieces.At<kKind == Kind::kPqInverse>(v, able);
    if (keep) able = hn::And(able, hn::Ge(v, zero));
    if (HWY_LIKELY(hn::AllTrue(d, able))) {
      y = hn::Xor(y, hn::And(x, sign));
    } else {
      y = AnyValue<kKind>(x, v, y, able, work.curve);
    }
    hn::StoreU(y, d, out + i);
  }
}

template <Kind kKind>
CurveWork::Loop LoopOfKind(const CurveWork& work) {
  const FastCurve& fast = work.fast;
  if constexpr (kKind != Kind::kHlgInverse) {
    if (work.pieces.able) return RunPieces<kKind>;
  }
  if constexpr (kKind == Kind::kExp) {
    if (fast.able && fast.inner && fast.outer) return RunPlane<kKind, Way::kFastBoth>;
    if (fast.able && fast.inner) return RunPlane<kKind, Way::kFastInner>;
  }
  if constexpr (kKind == Kind::kLog || kKind == Kind::kExp) {
    if (fast.able && fast.outer) return RunPlane<kKind, Way::kFastOuter>;
  }
  if constexpr (kKind != Kind::kPq && kKind != Kind::kPqInverse && kKind != Kind::kHlg) {
    if (fast.able) return RunPlane<kKind, Way::kFast>;
  }
  return RunPlane<kKind, Way::kDouble>;
}
#else
template <Kind kKind>
CurveWork::Loop LoopOfKind(const CurveWork&) {
  return RunPlane<kKind, Way::kDouble>;
}
#endif

CurveWork WorkOf(const PlaneCurve& curve) {
  CurveWork work;
  work.curve = curve;
#if TESSERA_DOUBLE_FLOAT
  work.pieces = PiecesOf(curve.formula);
  work.fast = FastCurveOf(curve.formula);
#endif
  switch (curve.formula.kind) {
    case Kind::kPower:
      work.loop = LoopOfKind<Kind::kPower>(work);
      break;
    case Kind::kLog:
      work.loop = LoopOfKind<Kind::kLog>(work);
      break;
    case Kind::kExp:
      work.loop = LoopOfKind<Kind::kExp>(work);
      break;
    case Kind::kPq:
      work.loop = LoopOfKind<Kind::kPq>(work);
      break;
    case Kind::kPqInverse:
      work.loop = LoopOfKind<Kind::kPqInverse>(work);
      break;
    case Kind::kHlg:
      work.loop = LoopOfKind<Kind::kHlg>(work);
      break;
    case Kind::kHlgInverse:
      work.loop = LoopOfKind<Kind::kHlgInverse>(work);
      break;
    case Kind::kLinear:
      work.loop = RunPlane<Kind::kLinear, Way::kDouble>;
      break;
  }
  return work;
}

// |x|^e in double.
V MagnitudeInDouble(V x, double e) {
  const auto magnitude = [e](VD v) HWY_ATTR {
    return s::Exp2OfDouble(s::ClampExponent(hn::Mul(s::Log2OfDouble<Precision::kPower>(v), Set(e))));
  };
  return s::InDouble(magnitude, hn::Abs(x));
}

// A plane's power by C's rules.
struct PowerWork {
  PlanePower power;
#if TESSERA_DOUBLE_FLOAT
  FastCurve fast;
#endif
  bool active() const { return power.active; }
  bool quick() const { return power.exponent == 2; }

  // |x|^e where x is neither 0 nor infinite nor NaN.
  HWY_INLINE V Magnitude(V x) const {
#if TESSERA_DOUBLE_FLOAT
    if (fast.able) {
      const s::D d;
      const V size = hn::Abs(x);
      hn::Mask<s::D> able;
      const V y = FastValue<Kind::kPower, false, false>(size, fast, able);
      const auto special = hn::Not(
          hn::And(hn::Gt(size, hn::Zero(d)), hn::Lt(size, s::SetF(std::numeric_limits<float>::infinity()))));
      const auto done = hn::Or(able, special);
      if (HWY_LIKELY(hn::AllTrue(d, done))) return y;
      return hn::IfThenElse(done, y, MagnitudeInDouble(x, power.exponent));
    }
#endif
    return MagnitudeInDouble(x, power.exponent);
  }

  void operator()(const float* in, float* out, int count) const {
    const s::D d;
    const double e = power.exponent;
    if (e == 2) {
      for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
        const V x = hn::LoadU(d, in + i);
        hn::StoreU(hn::Mul(x, x), d, out + i);
      }
      return;
    }
    // What the rules of C ask of the exponent, as a float: its sign, and whether it is whole, even or odd.
    const bool whole = std::trunc(e) == e, even = std::trunc(e / 2) == e / 2;
    const double kind = e == 0 ? 0 : !whole ? 0.5 : even ? 2 : 1;
    const V y = hn::Set(d, static_cast<float>(std::copysign(kind, e)));
    const V infinity = hn::Set(d, std::numeric_limits<float>::infinity());
    for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
      const V x = hn::LoadU(d, in + i);
      V r = Magnitude(x);
      const auto ordinary = hn::And(hn::Gt(x, hn::Zero(d)), hn::Lt(x, infinity));
      if (HWY_UNLIKELY(!hn::AllTrue(d, ordinary)) || kind == 0) r = s::PowSpecial(x, y, r);
      hn::StoreU(r, d, out + i);
    }
  }
};

PowerWork WorkOf(const PlanePower& power) {
  PowerWork work;
  work.power = power;
#if TESSERA_DOUBLE_FLOAT
  work.fast.able = IsModerateExponent(power.exponent);
  work.fast.exponent = s::SplitDouble(power.exponent);
#endif
  return work;
}

// What work makes of the samples of 8-bit pixels.
class ByteTable {
 public:
  template <class Work>
  explicit ByteTable(const Work& work) {
    for (int c = 0; c < kCodes; ++c) results_[c] = static_cast<float>(c) / (kCodes - 1);
    work(results_, results_, kCodes);
  }
  // work(samples, samples, count), looked up where a whole vector's samples are code / 255.
  template <class Work>
  void Run(const Work& work, float* samples, int count) const {
    const s::D d;
    const s::DI di;
    for (int i = 0; i < count; i += s::kLanes) {
      const V v = hn::Load(d, samples + i);
      const s::VI code =
          hn::And(hn::NearestInt(hn::Mul(v, hn::Set(d, kCodes - 1.0f))), hn::Set(di, kCodes - 1));
      const V sample = s::FromUnorm8(hn::ConvertTo(d, code));
      // Bit by bit: minus zero is none.
      if (HWY_LIKELY(hn::AllTrue(di, hn::Eq(hn::BitCast(di, sample), hn::BitCast(di, v))))) {
        hn::Store(s::GatherFloats(results_, code), d, samples + i);
      } else {
        work(samples + i, samples + i, s::kLanes);
      }
    }
  }

 private:
  static constexpr int kCodes = 256;
  alignas(64) float results_[kCodes];
};

// Runs each active plane's work(in, out, count), from and to planes or interleaved pixels.
template <class Work>
class PlaneStage final : public graph::PointStage {
 public:
  template <class Plane>
  PlaneStage(const Plane (&planes)[4], bool bytes) {
    for (int p = 0; p < 4; ++p) {
      alike_[p] = p > 0 && planes[p] == planes[p - 1];
      work_[p] = alike_[p] ? work_[p - 1] : WorkOf(planes[p]);
      const bool looks_up = bytes && work_[p].active() && !work_[p].quick();
      if (looks_up && !alike_[p]) tables_[p] = std::make_shared<ByteTable>(work_[p]);
    }
  }
  bool CanFuse(bool, PixelType) const override { return true; }
  std::unique_ptr<graph::PointStage> OfSamples(int channels) const override {
    if (!work_[0].active() || !std::all_of(alike_ + 1, alike_ + channels, std::identity())) return nullptr;
    auto stage = std::make_unique<PlaneStage>(*this);
    for (int p = 1; p < 4; ++p) {
      stage->work_[p] = work_[0];
      stage->alike_[p] = true;
      stage->tables_[p] = nullptr;
    }
    return stage;
  }
  void Run(const graph::PointArgs& args) const override {
    // Results may lie where other planes' samples do, so that all are read before any is written.
    // Short chunks: reading and writing memory goes on beside the arithmetic.
    constexpr int kChunk = 64;
    static_assert(kBlockPixels % kChunk == 0);
    alignas(64) float samples[4 * kChunk];
    const s::D d;
    for (int first = 0; first < args.count; first += kChunk) {
      const int count = std::min(kChunk, args.count - first);
      float* const planes[4] = {samples, samples + count, samples + 2 * count, samples + 3 * count};
      s::LoadChunk(args, first, count, planes);
      // Planes with the same curve are one run: its tables are loaded once.
      for (int p = 0, next = 1; p < 4; p = next) {
        for (next = p + 1; next < 4 && alike_[next]; ++next) continue;
        if (tables_[p]) {
          tables_[p]->Run(work_[p], planes[p], (next - p) * count);
        } else if (work_[p].active()) {
          work_[p](planes[p], planes[p], (next - p) * count);
        }
      }
      s::StoreChunk(args, first, count, [&](int i) HWY_ATTR {
        return s::Pixels{hn::Load(d, planes[0] + i), hn::Load(d, planes[1] + i), hn::Load(d, planes[2] + i),
                         hn::Load(d, planes[3] + i)};
      });
    }
  }

 private:
  Work work_[4];
  bool alike_[4];  // the plane before has the same
  std::shared_ptr<const ByteTable> tables_[4];
};

std::unique_ptr<graph::PointStage> NewCurveStage(const PlaneCurve (&planes)[4], bool bytes) {
  return std::make_unique<PlaneStage<CurveWork>>(planes, bytes);
}
std::unique_ptr<graph::PointStage> NewPowerStage(const PlanePower (&planes)[4], bool bytes) {
  return std::make_unique<PlaneStage<PowerWork>>(planes, bytes);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewCurveStage);
HWY_EXPORT(NewPowerStage);

std::unique_ptr<graph::PointStage> MakeCurveStage(const PlaneCurve (&planes)[4], bool bytes) {
  return HWY_DYNAMIC_DISPATCH(NewCurveStage)(planes, bytes);
}
std::unique_ptr<graph::PointStage> MakePowerStage(const PlanePower (&planes)[4], bool bytes) {
  return HWY_DYNAMIC_DISPATCH(NewPowerStage)(planes, bytes);
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
