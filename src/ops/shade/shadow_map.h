// A light's depths as the shadow kernels read them: biased, with a margin, nothing hit as the largest float.
#ifndef TESSERA_OPS_SHADE_SHADOW_MAP_H_
#define TESSERA_OPS_SHADE_SHADOW_MAP_H_

#include <cstdint>
#include <memory>

#include "base/stage.h"
#include "model/shade_settings.h"

namespace tessera::ops {

// How far around a texel its own surface is looked for, and how many times deeper than its neighbours
// foretell it may be there.
inline constexpr int kShadowSearch = 8;
inline constexpr double kShadowSurprise = 6;

class ShadowMap {
 public:
  // `depths`: the first channel of a whole float image.
  ShadowMap(const ConstImageView& depths, const ops::ShadowSettings& settings, const graph::Workers& workers);

  int width() const { return width_; }
  int height() const { return height_; }
  // Texels around the map on every side; three more may be read at the end of a row.
  int margin() const { return margin_; }
  int stride() const { return stride_; }
  const float* texel(int x, int y) const { return origin_ + static_cast<ptrdiff_t>(y) * stride_ + x; }

 private:
  float* texel(int x, int y) { return origin_ + static_cast<ptrdiff_t>(y) * stride_ + x; }

  int width_ = 0, height_ = 0, margin_ = 0, stride_ = 0;
  std::unique_ptr<float[]> memory_;
  float* origin_ = nullptr;
};

// Which positions are where in the map: rows of a matrix to texels (u, v), depth r and w.
struct ShadowPlan {
  double u[4], v[4], r[4], w[4];
  double
      receiver[3];  // what an error of the positions' stored precision adds to r w, per unit of |x|, |y|, |z|
  int size = 1;
  bool bilinear = false;
};
ShadowPlan MakeShadowPlan(const ops::ShadowSettings& settings, int width, int height);
std::unique_ptr<graph::PointStage> MakeShadowStage(const ShadowPlan& plan,
                                                   std::shared_ptr<const ShadowMap> map);

}  // namespace tessera::ops

#endif  // TESSERA_OPS_SHADE_SHADOW_MAP_H_
