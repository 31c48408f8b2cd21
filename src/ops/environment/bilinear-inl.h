// Two by two RGBA texels of an environment map made one.
#if defined(TESSERA_OPS_ENVIRONMENT_BILINEAR_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TESSERA_OPS_ENVIRONMENT_BILINEAR_INL_H_
#undef TESSERA_OPS_ENVIRONMENT_BILINEAR_INL_H_
#else
#define TESSERA_OPS_ENVIRONMENT_BILINEAR_INL_H_
#endif

#include <hwy/highway.h>

#include <cmath>
#include <limits>

#include "simd/texels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;

// Two by two texels: along y, then along x.
HWY_INLINE s::Quad Bilinear(const float* p, ptrdiff_t stride, float fx, float fy) {
  const s::Pair rows = s::Lerp(s::Pair::Load(p), s::Pair::Load(p + stride), s::Pair::Set(fy));
  return s::Lerp(s::Lower(rows), s::Upper(rows), s::Quad::Set(fx));
}
// The same for texels that may be NaN or infinite: those without weight do not count. One NaN for all.
inline HWY_NOINLINE void BilinearWhereWeighted(const float* p, ptrdiff_t stride, float fx, float fy,
                                               float* out) {
  const float w[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  const float* const texel[4] = {p, p + 4, p + stride, p + stride + 4};
  for (int c = 0; c < 4; ++c) {
    float sum = 0;
    for (int k = 0; k < 4; ++k) {
      if (w[k] != 0) sum += w[k] * texel[k][c];
    }
    out[c] = std::isnan(sum) ? std::numeric_limits<float>::quiet_NaN() : sum;
  }
}

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
