// Shadow tests on blocks of pixels: first where and how deep, in double, then the map's texels.
#include <cfloat>
#include <cstring>
#include <limits>
#include <memory>
#include <utility>

#include "ops/shade/shadow_map.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/shade/shadow_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/doubles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace s = simd::HWY_NAMESPACE;
using s::DD;
using s::EachPart;
using s::Join;
using s::JoinIntegers;
using s::kParts;
using s::NumberOr;
using s::Part;
using s::RowTimes;
using s::SetD;
using s::V;
using s::VD;
namespace {

// One block: texel offset of the first tap, depth, and with bilinear weights the fractions.
struct ShadowBlock {
  alignas(64) int32_t offset[kBlockPixels];
  alignas(64) float depth[kBlockPixels];
  alignas(64) float fx[kBlockPixels], fy[kBlockPixels];
  alignas(64) float taps[4 * kBlockPixels];
};

class ShadowStage final : public graph::PointStage {
 public:
  ShadowStage(const ShadowPlan& plan, std::shared_ptr<const ShadowMap> map)
      : plan_(plan), map_(std::move(map)) {}

  void Run(const graph::PointArgs& args) const override {
    ShadowBlock block;
    const int step = static_cast<int>(hn::Lanes(s::D()));
    for (int i = 0; i < args.count; i += step) Locate(s::LoadPlanes(args.in[0], i), i, block);
    float* const out = args.out[0];
    if (plan_.bilinear) {
      Bilinear(block, args.count, out);
    } else if (plan_.size == 1) {
      Nearest(block, args.count, out);
    } else if (plan_.size <= 4) {
      Box<true>(block, args.count, out);
    } else {
      Box<false>(block, args.count, out);
    }
  }

 private:
  HWY_INLINE void Locate(const s::Pixels& p, int i, ShadowBlock& block) const {
    const double lit = -std::numeric_limits<double>::infinity(), dark = -lit;
    const double back = plan_.bilinear ? 0.5 : 0.5 * (plan_.size - 1);
    const double first = -map_->margin();
    VD column[kParts], row[kParts], depth[kParts], fx[kParts], fy[kParts];
    EachPart([&]<int kPart>() HWY_ATTR {
      const VD x = Part<kPart>(p.r), y = Part<kPart>(p.g), z = Part<kPart>(p.b), one = SetD(1);
      const VD w = RowTimes(plan_.w, x, y, z);
      const VD scale = hn::Div(one, w);
      const VD u = hn::Sub(hn::Mul(RowTimes(plan_.u, x, y, z), scale), SetD(back));
      const VD v = hn::Sub(hn::Mul(RowTimes(plan_.v, x, y, z), scale), SetD(back));
      VD r = RowTimes(plan_.r, x, y, z);
      const VD lost = hn::MulAdd(
          SetD(plan_.receiver[2]), hn::Abs(z),
          hn::MulAdd(SetD(plan_.receiver[1]), hn::Abs(y), hn::Mul(SetD(plan_.receiver[0]), hn::Abs(x))));
      const VD beyond = hn::Mul(r, scale);
      r = hn::Mul(hn::Sub(r, lost), scale);
      // Beyond the far plane and where nothing is known: lit. Behind the light: dark.
      const auto known = hn::And(hn::Eq(u, u), hn::And(hn::Eq(v, v), hn::Le(beyond, one)));
      r = hn::IfThenElse(known, r, SetD(lit));
      r = hn::IfThenElse(hn::Lt(w, SetD(1e-20)), SetD(dark), r);
      const VD left = hn::Floor(NumberOr(u, SetD(first))), top = hn::Floor(NumberOr(v, SetD(first)));
      column[kPart] = hn::Min(hn::Max(left, SetD(first)), SetD(map_->width()));
      row[kPart] = hn::Min(hn::Max(top, SetD(first)), SetD(map_->height()));
      depth[kPart] = r;
      if (plan_.bilinear) {
        // Where the place was limited all taps are the margin's and weights do not matter.
        fx[kPart] = Fraction(hn::Sub(u, left));
        fy[kPart] = Fraction(hn::Sub(v, top));
      }
    });
    const s::DI di;
    const s::VI offset =
        hn::Add(hn::Mul(JoinIntegers(row), hn::Set(di, map_->stride())), JoinIntegers(column));
    hn::Store(offset, di, block.offset + i);
    const s::D d;
    hn::Store(Join(depth), d, block.depth + i);
    if (plan_.bilinear) {
      hn::Store(Join(fx), d, block.fx + i);
      hn::Store(Join(fy), d, block.fy + i);
    }
  }

  static HWY_INLINE VD Fraction(VD f) {
    const VD zero = hn::Zero(DD());
    return hn::Min(hn::Max(NumberOr(f, zero), zero), SetD(1));
  }

  HWY_INLINE void Nearest(ShadowBlock& block, int count, float* out) const {
    const s::D d;
    const float* const map = map_->texel(0, 0);
    for (int i = 0; i < count; ++i) block.taps[i] = map[block.offset[i]];
    for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
      const auto lit = hn::Le(hn::Load(d, block.depth + i), hn::Load(d, block.taps + i));
      hn::StoreU(hn::IfThenElseZero(lit, hn::Set(d, 1.0f)), d, out + i);
    }
  }

  HWY_INLINE void Bilinear(ShadowBlock& block, int count, float* out) const {
    const s::D d;
    const float* const map = map_->texel(0, 0);
    float *const upper = block.taps, *const lower = block.taps + 2 * kBlockPixels;
    for (int i = 0; i < count; ++i) {
      const float* const p = map + block.offset[i];
      std::memcpy(upper + 2 * i, p, 8);
      std::memcpy(lower + 2 * i, p + map_->stride(), 8);
    }
    const V one = hn::Set(d, 1.0f);
    for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
      const V r = hn::Load(d, block.depth + i), x = hn::Load(d, block.fx + i), y = hn::Load(d, block.fy + i);
      const auto lit = [&](V m) HWY_ATTR { return hn::IfThenElseZero(hn::Le(r, m), one); };
      V a, b, c, e;
      hn::LoadInterleaved2(d, upper + 2 * i, a, b);
      hn::LoadInterleaved2(d, lower + 2 * i, c, e);
      a = lit(a), b = lit(b), c = lit(c), e = lit(e);
      const V high = hn::MulAdd(x, hn::Sub(b, a), a), low = hn::MulAdd(x, hn::Sub(e, c), c);
      hn::StoreU(hn::MulAdd(y, hn::Sub(low, high), high), d, out + i);
    }
  }

  // Counts lit taps in four columns at a time; kOneQuad: a row of taps is no wider.
  template <bool kOneQuad>
  HWY_INLINE void Box(ShadowBlock& block, int count, float* out) const {
    const hn::CappedTag<float, 4> d4;
    constexpr int kQuad = static_cast<int>(hn::MaxLanes(d4));
    const float* const map = map_->texel(0, 0);
    const int size = plan_.size, stride = map_->stride();
    if constexpr (kQuad == 4) {
      const auto one = hn::Set(d4, 1.0f);
      // Of the last quad of a row, the columns that are taps.
      const auto rest = hn::IfThenElseZero(hn::FirstN(d4, static_cast<size_t>((size - 1) % 4 + 1)), one);
      for (int i = 0; i < count; ++i) {
        const float* p = map + block.offset[i];
        const auto r = hn::Set(d4, block.depth[i]);
        auto lit = hn::Zero(d4);
        for (int y = 0; y < size; ++y, p += stride) {
          int x = 0;
          if constexpr (!kOneQuad) {
            for (; x + 4 < size; x += 4) {
              lit = hn::Add(lit, hn::IfThenElseZero(hn::Le(r, hn::LoadU(d4, p + x)), one));
            }
          }
          lit = hn::Add(lit, hn::IfThenElseZero(hn::Le(r, hn::LoadU(d4, p + x)), rest));
        }
        hn::Store(lit, d4, block.taps + 4 * i);
      }
      const s::D d;
      const V all = hn::Set(d, static_cast<float>(size * size));
      for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
        V a, b, c, e;
        hn::LoadInterleaved4(d, block.taps + 4 * i, a, b, c, e);
        hn::StoreU(hn::Div(hn::Add(hn::Add(a, b), hn::Add(c, e)), all), d, out + i);
      }
    } else {
      for (int i = 0; i < count; ++i) {
        const float* p = map + block.offset[i];
        int lit = 0;
        for (int y = 0; y < size; ++y, p += stride) {
          for (int x = 0; x < size; ++x) lit += block.depth[i] <= p[x] ? 1 : 0;
        }
        out[i] = static_cast<float>(lit) / static_cast<float>(size * size);
      }
    }
  }

  ShadowPlan plan_;
  std::shared_ptr<const ShadowMap> map_;
};

std::unique_ptr<graph::PointStage> MakeShadow(const ShadowPlan& plan, std::shared_ptr<const ShadowMap> map) {
  return std::make_unique<ShadowStage>(plan, std::move(map));
}

}  // namespace
}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(MakeShadow);
std::unique_ptr<graph::PointStage> MakeShadowStage(const ShadowPlan& plan,
                                                   std::shared_ptr<const ShadowMap> map) {
  return HWY_DYNAMIC_DISPATCH(MakeShadow)(plan, std::move(map));
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
