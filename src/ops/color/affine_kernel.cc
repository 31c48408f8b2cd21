// The one kernel of every affine operation: blocks of planes, or straight from and to interleaved RGBA
// pixels.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <type_traits>

#include "base/prefetch.h"
#include "base/stage.h"
#include "ops/color/affine.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/color/affine_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/fused-inl.h"
#include "simd/pixels-inl.h"
#include "simd/point-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::Pixels;
using s::V;

// How far limits go. In all forms but the last NaN becomes the lower limit.
enum class LimitForm : uint8_t {
  kNone,
  kUniform,  // the same for all four channels: two constants instead of eight, which leaves registers
  kAll,
  kSome,
};

// Coefficients as the kernel reads them. `unit` is what 1.0 is in the samples it works on: 1, 255 or 65535.
struct Coefficients {
  float m[4][4], bias[4], low[4], high[4], nan[4];

  Coefficients(const double (&matrix)[4][5], const Limits (&limits)[4], double unit) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) m[i][j] = static_cast<float>(matrix[i][j]);
      // -0 is what leaves every sum alone, zeros of either sign included.
      bias[i] = matrix[i][4] == 0 ? -0.0f : static_cast<float>(matrix[i][4] * unit);
      low[i] = static_cast<float>(limits[i].low * unit);
      high[i] = static_cast<float>(limits[i].high * unit);
      nan[i] = static_cast<float>(limits[i].nan * unit);
    }
  }

  // How large results for samples in [0, max] can be before limits.
  float Bound(float max) const {
    float bound = 0;
    for (int i = 0; i < 4; ++i) {
      float sum = std::fabs(bias[i]);
      for (const float v : m[i]) sum += std::fabs(v) * max;
      bound = std::max(bound, sum);
    }
    return bound;
  }

  // Storing codes limits them too; one pair of limits does for both. What NaN becomes stays.
  void LimitToCodes(float max) {
    for (int i = 0; i < 4; ++i)
      low[i] = std::clamp(low[i], 0.0f, max), high[i] = std::clamp(high[i], 0.0f, max);
  }
};

// kSparse: a weight of 0 is none, so that infinities and NaN pass only where there is a weight.
template <AffineClass kClass, bool kSparse = false>
class Affine {
 public:
  HWY_INLINE Affine(const Coefficients& c, LimitForm form) : c_(c), form_(form) {
    for (int i = 0; kSparse && i < 4; ++i) {
      for (int j = 0; j < 4; ++j) kept_[i][j] = std::bit_cast<float>(c.m[i][j] == 0 ? 0u : ~0u);
    }
  }

  // This for every sample, where it treats those of the first channels alike.
  std::optional<Affine> OfSamples(int channels) const {
    Coefficients c = c_;
    const auto spread = [channels](float(&v)[4]) {
      bool alike = true;
      for (int i = 1; i < 4; ++i) {
        if (i < channels) alike = alike && std::bit_cast<uint32_t>(v[i]) == std::bit_cast<uint32_t>(v[0]);
        v[i] = v[0];
      }
      return alike;
    };
    float scale[4] = {c.m[0][0], c.m[1][1], c.m[2][2], c.m[3][3]};
    const bool alike[] = {spread(scale), spread(c.bias), spread(c.low), spread(c.high), spread(c.nan)};
    if (kClass != AffineClass::kDiagonal || !std::all_of(std::begin(alike), std::end(alike), std::identity()))
      return std::nullopt;
    for (int i = 0; i < 4; ++i) c.m[i][i] = scale[i];
    const bool limits = std::isfinite(c.low[0]) || std::isfinite(c.high[0]);
    return Affine(c, !limits                ? LimitForm::kNone
                     : c.nan[0] == c.low[0] ? LimitForm::kUniform
                                            : LimitForm::kSome);
  }

  LimitForm form() const { return form_; }
  float Bound(float max) const { return c_.Bound(max); }
  // For samples that are codes and are stored as such.
  void LimitToCodes(float max) { c_.LimitToCodes(max); }

  HWY_INLINE Pixels operator()(const Pixels& p) const {
    if (form_ == LimitForm::kNone) return Unlimited(p);
    if (form_ != LimitForm::kSome) return Limited(p);
    const Pixels q = Unlimited(p);
    return {LimitNaN<0>(q.r), LimitNaN<1>(q.g), LimitNaN<2>(q.b), LimitNaN<3>(q.a)};
  }
  // Limits on every channel, all alike unless the form is kAll; not for kSome.
  HWY_INLINE Pixels Limited(const Pixels& p) const {
    if (form_ != LimitForm::kAll) return Uniform(p);
    const Pixels q = Unlimited(p);
    return {Limit<0>(q.r), Limit<1>(q.g), Limit<2>(q.b), Limit<3>(q.a)};
  }
  HWY_INLINE Pixels Uniform(const Pixels& p) const {
    const Pixels q = Unlimited(p);
    return {Limit<0>(q.r), Limit<0>(q.g), Limit<0>(q.b), Limit<0>(q.a)};
  }

  HWY_INLINE Pixels Unlimited(const Pixels& p) const {
    return {Row<0>(p, p.r), Row<1>(p, p.g), Row<2>(p, p.b), Alpha(p)};
  }

 private:
  static HWY_INLINE V Set(float v) { return hn::Set(s::D(), v); }

  template <int i>
  HWY_INLINE V Row(const Pixels& p, V own) const {
    if constexpr (kClass == AffineClass::kDiagonal) {
      return hn::MulAdd(own, Set(c_.m[i][i]), Set(c_.bias[i]));
    } else {
      V v = hn::MulAdd(Kept<i, 0>(p.r), Set(c_.m[i][0]), Set(c_.bias[i]));
      v = hn::MulAdd(Kept<i, 1>(p.g), Set(c_.m[i][1]), v);
      v = hn::MulAdd(Kept<i, 2>(p.b), Set(c_.m[i][2]), v);
      if constexpr (kClass == AffineClass::kFull) v = hn::MulAdd(Kept<i, 3>(p.a), Set(c_.m[i][3]), v);
      return v;
    }
  }
  // 0 in place of what has no weight.
  template <int i, int j>
  HWY_INLINE V Kept(V v) const {
    if constexpr (kSparse) {
      return hn::And(v, Set(kept_[i][j]));
    } else {
      return v;
    }
  }
  HWY_INLINE V Alpha(const Pixels& p) const {
    if constexpr (kClass == AffineClass::kFull) {
      return Row<3>(p, p.a);
    } else {
      return hn::MulAdd(p.a, Set(c_.m[3][3]), Set(c_.bias[3]));
    }
  }
  template <int i>
  HWY_INLINE V Limit(V v) const {
    return s::ClampHigh(s::ClampLow(v, Set(c_.low[i])), Set(c_.high[i]));
  }
  template <int i>
  HWY_INLINE V LimitNaN(V v) const {
    return hn::IfThenElse(hn::IsNaN(v), Set(c_.nan[i]), Limit<i>(v));
  }

  Coefficients c_;
  LimitForm form_;
  float kept_[kSparse ? 4 : 1][4];
};

// One after the other in registers: uniform limits after the first, after the second uniform ones or none.
template <AffineClass kClass>
class Pair {
 public:
  using One = Affine<kClass>;
  static bool Serves(const One& first, const One& second) {
    return first.form() == LimitForm::kUniform &&
           (second.form() == LimitForm::kUniform || second.form() == LimitForm::kNone);
  }
  HWY_INLINE Pair(const One& first, const One& second) : first_(first), second_(second) {}

  LimitForm form() const { return second_.form(); }
  float Bound(float) const { return std::numeric_limits<float>::infinity(); }
  void LimitToCodes(float max) { second_.LimitToCodes(max); }
  HWY_INLINE Pixels operator()(const Pixels& p) const {
    return form() == LimitForm::kNone ? Unlimited(p) : Limited(p);
  }
  HWY_INLINE Pixels Limited(const Pixels& p) const { return second_.Uniform(first_.Uniform(p)); }
  HWY_INLINE Pixels Unlimited(const Pixels& p) const { return second_.Unlimited(first_.Uniform(p)); }

 private:
  One first_, second_;
};

// Results that lie in planes, to pixels [first, first + count); one for all kernels.
void StoreResults(const graph::PointArgs& args, int first, int count, float* const planes[4]) {
  s::StoreChunk(args, first, count, [planes](int i) HWY_ATTR { return s::LoadPlanes(planes, i); });
}

// Kernel: Affine or Pair on values, CodesKernel the same on codes of 8 and 16 bits, which are all finite.
template <class Kernel, class CodesKernel = Kernel>
class AffineStage final : public graph::PointStage {
 public:
  AffineStage(const Kernel& values, const CodesKernel& codes8, const CodesKernel& codes16)
      : values_(values), codes8_(codes8), codes16_(codes16), stored8_(codes8), stored16_(codes16) {
    bounded8_ = codes8.Bound(255) < 32000;
    stored8_.LimitToCodes(255);
    stored16_.LimitToCodes(65535);
  }

  bool CanFuse(bool, PixelType) const override { return true; }
  bool AnyLength() const override { return true; }
  bool UsesCodes() const override { return true; }

  std::unique_ptr<graph::PointStage> Then(const graph::PointStage& next) const override {
    // Colour matrices meet most often; a pair of each two classes would be compiled for every target.
    if constexpr (std::is_same_v<Kernel, Affine<AffineClass::kRgb>>) {
      const auto* const other = dynamic_cast<const AffineStage*>(&next);
      using Both = Pair<AffineClass::kRgb>;
      if (other != nullptr && Both::Serves(values_, other->values_)) {
        return std::make_unique<AffineStage<Both>>(
            Both(values_, other->values_), Both(codes8_, other->codes8_), Both(codes16_, other->codes16_));
      }
    }
    return nullptr;
  }

  std::unique_ptr<graph::PointStage> OfSamples(int channels) const override {
    if constexpr (std::is_same_v<Kernel, Affine<AffineClass::kDiagonal>>) {
      const auto values = values_.OfSamples(channels), codes8 = codes8_.OfSamples(channels),
                 codes16 = codes16_.OfSamples(channels);
      if (values && codes8 && codes16) return std::make_unique<AffineStage>(*values, *codes8, *codes16);
    }
    return nullptr;
  }

  void Run(const graph::PointArgs& args) const override {
    const std::byte* const read = args.source.read;
    std::byte* const write = args.sink.write;
    if (read == nullptr && write == nullptr) {
      s::RunPoint<1>(args, Kernel(values_));
    } else if (read != nullptr) {
      switch (args.source.type) {
        case PixelType::kUint8:
          return RunFrom<PixelType::kUint8>(args, stored8_);
        case PixelType::kUint16:
          return RunFrom<PixelType::kUint16>(args, stored16_);
        case PixelType::kHalf:
          return RunFrom<PixelType::kHalf>(args, values_);
        case PixelType::kFloat:
          return RunFrom<PixelType::kFloat>(args, values_);
      }
    } else {
      s::StoreChunk(args, 0, args.count, [in = args.in[0], f = Kernel(values_)](int i) HWY_ATTR {
        return f(s::LoadPlanes(in, i));
      });
    }
  }

 private:
  // From pixels: to pixels of the same type, on codes where that is allowed, else on values.
  template <PixelType type>
  void RunFrom(const graph::PointArgs& args, const auto& stored) const {
    using T = typename s::Samples<type>::T;
    const T* const from = reinterpret_cast<const T*>(args.source.read);
    const int count = args.count;
    const auto ahead = [from](int i) HWY_ATTR { base::PrefetchAhead(from + 4 * i, 4 * s::kLanes); };
    const Kernel on_values(values_);
    constexpr bool kInteger = type == PixelType::kUint8 || type == PixelType::kUint16;
    if (args.sink.write != nullptr && args.sink.type == type && (!kInteger || args.codes)) {
      const std::decay_t<decltype(stored)> on_codes(stored);
      T* const to = reinterpret_cast<T*>(args.sink.write);
      const bool stream = args.sink.stream && s::CanStream(to);
      if constexpr (type == PixelType::kUint8) {
        if (on_codes.form() == LimitForm::kNone && bounded8_) {
          const auto unlimited = [&on_codes](const Pixels& p) HWY_ATTR { return on_codes.Unlimited(p); };
          for (int i = 0; i < count; i += s::kLanes) {
            ahead(i);
            s::MapBoundedRgba8(from + 4 * i, to + 4 * i, stream, unlimited);
          }
          return;
        }
        if (on_codes.form() != LimitForm::kSome) {
          const auto limited = [&on_codes](const Pixels& p) HWY_ATTR { return on_codes.Limited(p); };
          for (int i = 0; i < count; i += s::kLanes) {
            ahead(i);
            s::MapRgba8(from + 4 * i, to + 4 * i, stream, limited);
          }
          return;
        }
      }
      for (int i = 0; i < count; i += s::kLanes) {
        ahead(i);
        s::StoreRgba<type, false>(on_codes(s::LoadRgbaCodes<type>(from + 4 * i)), to + 4 * i, stream);
      }
      return;
    }
    const auto result = [&](int i) HWY_ATTR {
      ahead(i);
      return on_values(s::ValuesOf<type>(s::LoadRgbaCodes<type>(from + 4 * i)));
    };
    if (args.sink.write == nullptr) {
      for (int i = 0; i < count; i += s::kLanes) s::StorePlanes(result(i), args.out, i);
      return;
    }
    // Of another type, in chunks of the stack's: the row may be longer than a plane.
    constexpr int kChunk = 64;
    alignas(64) float samples[4 * kChunk];
    float* const planes[4] = {samples, samples + kChunk, samples + 2 * kChunk, samples + 3 * kChunk};
    for (int first = 0; first < count; first += kChunk) {
      const int n = std::min(kChunk, count - first);
      for (int i = 0; i < n; i += s::kLanes) s::StorePlanes(result(first + i), planes, i);
      StoreResults(args, first, n, planes);
    }
  }

  Kernel values_;
  CodesKernel codes8_, codes16_;
  CodesKernel stored8_, stored16_;  // limited to the codes there are
  bool bounded8_ = false;           // results for 8-bit samples fit in 16 bits with a sign
};

template <AffineClass kClass, bool kSparse = false>
std::unique_ptr<graph::PointStage> NewStage(const double (&matrix)[4][5], const Limits (&limits)[4]) {
  bool some = false, all = true, uniform = true;
  for (const Limits& l : limits) {
    some |= l.any();
    all &= l.any() && l.nan == l.low;
    uniform &= l == limits[0];
  }
  const LimitForm form = !some     ? LimitForm::kNone
                         : !all    ? LimitForm::kSome
                         : uniform ? LimitForm::kUniform
                                   : LimitForm::kAll;
  using Values = Affine<kClass, kSparse>;
  using Codes = Affine<kClass>;
  const auto codes = [&](double unit) { return Codes(Coefficients(matrix, limits, unit), form); };
  return std::make_unique<AffineStage<Values, Codes>>(Values(Coefficients(matrix, limits, 1), form),
                                                      codes(255), codes(65535));
}

std::unique_ptr<graph::PointStage> NewAffineStage(AffineClass structure, const double (&matrix)[4][5],
                                                  const Limits (&limits)[4]) {
  const int rows = structure == AffineClass::kFull ? 4 : 3;
  bool zeros = false, diagonal = true;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < rows; ++j) {
      const bool zero = static_cast<float>(matrix[i][j]) == 0;
      zeros |= zero;
      diagonal &= zero == (i != j);
    }
  }
  if (structure == AffineClass::kDiagonal || diagonal)
    return NewStage<AffineClass::kDiagonal>(matrix, limits);
  if (structure == AffineClass::kRgb) {
    return zeros ? NewStage<AffineClass::kRgb, true>(matrix, limits)
                 : NewStage<AffineClass::kRgb>(matrix, limits);
  }
  return zeros ? NewStage<AffineClass::kFull, true>(matrix, limits)
               : NewStage<AffineClass::kFull>(matrix, limits);
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(NewAffineStage);

std::unique_ptr<graph::PointStage> MakeAffineStage(AffineClass structure, const double (&matrix)[4][5],
                                                   const Limits (&limits)[4]) {
  return HWY_DYNAMIC_DISPATCH(NewAffineStage)(structure, matrix, limits);
}

}  // namespace tessera::ops
#endif
