// Prepares a light's depths: every texel with its bias, so that a test is one comparison.
#include "ops/shade/shadow_map.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

namespace tessera::ops {
namespace {

// Slope per texel between the neighbours a and b of m: the smaller difference, enlarged by how the surface
// bends; a neighbour on another surface differs much more and does not count.
double Slope(double a, double m, double b) {
  const auto hit = [](double depth) { return depth < 1; };
  const double before = std::fabs(m - a), after = std::fabs(b - m);
  if (!hit(a)) return hit(b) ? after : 0;
  if (!hit(b)) return before;
  return std::min(std::max(before, after), 2 * std::min(before, after));
}

}  // namespace

ShadowMap::ShadowMap(const ConstImageView& depths, const ops::ShadowSettings& settings,
                     const graph::Workers& workers)
    : width_(depths.roi.width()), height_(depths.roi.height()), margin_(settings.shadow.size + 1) {
  constexpr int kReadBeyond = 4;
  stride_ = width_ + 2 * margin_ + kReadBeyond;
  const size_t count = static_cast<size_t>(stride_) * static_cast<size_t>(height_ + 2 * margin_);
  memory_ = std::make_unique_for_overwrite<float[]>(count);
  origin_ = memory_.get() + static_cast<ptrdiff_t>(margin_) * stride_ + margin_;
  const ShadowParams& p = settings.shadow;
  const float beside = p.dark_outside ? -FLT_MAX : FLT_MAX;
  // Half the width of the taps, in texels; positions of low precision may fall a texel further.
  const double reach = (p.filter == ShadowFilter::kBilinear ? 1.0 : 0.5 * p.size) +
                       (settings.position_step > 1e-6 ? 1.0 : 0.0);
  const double steps = settings.map_step * (1 + 2 * reach);
  const Roi& roi = depths.roi;
  workers.For(height_ + 2 * margin_, [&](int64_t index, int) {
    const int y = static_cast<int>(index) - margin_;
    float* const row = origin_ + static_cast<ptrdiff_t>(y) * stride_;
    if (y < 0 || y >= height_ || width_ == 0) {
      std::fill(row - margin_, row + width_ + margin_ + kReadBeyond, beside);
      return;
    }
    std::fill(row - margin_, row, beside);
    std::fill(row + width_, row + width_ + margin_ + kReadBeyond, beside);
    // Beyond the map's edge there is no neighbour: nothing hit.
    const ptrdiff_t step = depths.pixel_stride, line = depths.row_stride;
    const std::byte* const first = depths.At(roi.x0, roi.y0 + y);
    const auto at = [](const std::byte* texel) { return double{*reinterpret_cast<const float*>(texel)}; };
    for (int x = 0; x < width_; ++x) {
      const std::byte* const texel = first + x * step;
      const double m = at(texel);
      if (!(m < 1)) {  // nothing hit, or NaN
        row[x] = FLT_MAX;
        continue;
      }
      double bias = p.bias;
      if (bias < 0) {
        const double left = x > 0 ? at(texel - step) : 1, right = x + 1 < width_ ? at(texel + step) : 1;
        const double above = y > 0 ? at(texel - line) : 1, below = y + 1 < height_ ? at(texel + line) : 1;
        bias = reach * (Slope(left, m, right) + Slope(above, m, below)) + steps;
      }
      row[x] = static_cast<float>(m + bias);
    }
  });
}

ShadowPlan MakeShadowPlan(const ops::ShadowSettings& settings, int width, int height) {
  const Matrix4& m = settings.shadow.light;
  ShadowPlan plan;
  for (size_t k = 0; k < 4; ++k) {
    const double x = m[k], y = m[4 + k], z = m[8 + k], w = m[12 + k];
    plan.u[k] = 0.5 * width * (x + w);
    plan.v[k] = 0.5 * height * (w - y);
    plan.r[k] = 0.5 * (z + w);
    plan.w[k] = w;
  }
  const bool automatic = settings.shadow.bias < 0;
  for (size_t k = 0; k < 3; ++k) {
    plan.receiver[k] = automatic ? settings.position_step * (std::fabs(plan.r[k]) + std::fabs(plan.w[k])) : 0;
  }
  plan.size = settings.shadow.size;
  plan.bilinear = settings.shadow.filter == ShadowFilter::kBilinear;
  return plan;
}

}  // namespace tessera::ops
