// Prepares a light's depths: every texel with its bias, so that a test is one comparison.
#include "ops/shade/shadow_map.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <memory>
#include <vector>

#include "ops/shade/shadow_surface.h"

namespace tessera::ops {
namespace {

// Some rows of a map and the surfaces that they show, with as much around them as biases are made of.
class Band {
 public:
  // So many rows at a time, of which those within `around` texels are looked at.
  Band(const ConstImageView& map, int rows, int around, double reach)
      : map_(map),
        kernel_(MakeSurfaceKernel()),
        around_(around),
        reach_(reach),
        width_(map.roi.width()),
        stride_(width_ + 2 * margin() + kSlack),
        depths_(Count(stride_, rows + 2 * margin()), 1.0f),
        planes_(Count(PlanesOfRow(), rows + 2 * around)),
        scratch_(Count(stride_ + kSlack, 1)),
        deeper_(Count(width_ + kSlack, 1)) {}

  // Rows y0 to y1; nothing is hit beside the map.
  void Load(int y0, int y1, bool with_surfaces) {
    y0_ = y0;
    for (int y = y0 - margin(); y < y1 + margin(); ++y) {
      float* const row = &depths_[Count(stride_, y - y0 + margin())] + margin();
      const bool inside = y >= 0 && y < map_.roi.height();
      for (int x = 0; x < width_; ++x) row[x] = inside ? Depth(x, y) : 1.0f;
    }
    if (!with_surfaces) return;
    for (int y = y0 - around_; y < y1 + around_; ++y)
      kernel_->Surfaces(Row(y), stride_, width_, SurfacesOf(y));
  }
  const float* Row(int y) const { return &depths_[Count(stride_, y - y0_ + margin())] + margin(); }

  const double* Deeper(int y) {
    kernel_->Deeper(Row(y), stride_, width_, SurfacesOf(y), PlanesOfRow(), reach_, around_, scratch_.data(),
                    deeper_.data());
    return deeper_.data();
  }

 private:
  static constexpr int kSlack = 16;  // what vectors read and write beyond the last texel

  static size_t Count(int a, int b) { return static_cast<size_t>(a) * static_cast<size_t>(b); }
  int margin() const { return around_ + 2; }
  float Depth(int x, int y) const {
    return *reinterpret_cast<const float*>(map_.At(map_.roi.x0 + x, map_.roi.y0 + y));
  }
  int PlanesOfRow() const { return SurfaceRow::kPlanes * stride_; }
  SurfaceRow SurfacesOf(int y) {
    SurfaceRow row{};
    double* p = &planes_[Count(PlanesOfRow(), y - y0_ + around_)] + margin();
    for (double*& plane : row.plane) plane = p, p += stride_;
    return row;
  }

  const ConstImageView& map_;
  std::unique_ptr<const SurfaceKernel> kernel_;
  int around_;
  double reach_;
  int width_, stride_, y0_ = 0;
  std::vector<float> depths_;
  std::vector<double> planes_;
  std::vector<float> scratch_;
  std::vector<double> deeper_;
};

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
  const auto fill = [&](int y, int x0, int x1) { std::fill(texel(x0, y), texel(x1, y), beside); };
  for (int y = -margin_; y < height_ + margin_; ++y) {
    const bool inside = y >= 0 && y < height_ && width_ > 0;
    fill(y, -margin_, inside ? 0 : width_ + margin_ + kReadBeyond);
    if (inside) fill(y, width_, width_ + margin_ + kReadBeyond);
  }
  if (width_ == 0 || height_ == 0) return;
  const bool automatic = p.bias < 0;
  const int around = automatic ? std::min(static_cast<int>(std::ceil(reach)), kShadowSearch) : 0;
  constexpr int kRows = 32;
  std::vector<std::unique_ptr<Band>> bands(static_cast<size_t>(workers.count()));
  workers.For((height_ + kRows - 1) / kRows, [&](int64_t index, int worker) {
    std::unique_ptr<Band>& band = bands[static_cast<size_t>(worker)];
    if (!band) band = std::make_unique<Band>(depths, kRows, around, reach);
    const int y0 = static_cast<int>(index) * kRows, y1 = std::min(y0 + kRows, height_);
    band->Load(y0, y1, automatic);
    for (int y = y0; y < y1; ++y) {
      const double* const deeper = automatic ? band->Deeper(y) : nullptr;
      const float* const from = band->Row(y);
      float* const to = texel(0, y);
      for (int x = 0; x < width_; ++x) {
        // Where nothing is hit, or NaN, all is lit.
        const double m = double{from[x]}, bias = deeper != nullptr ? deeper[x] + steps : p.bias;
        to[x] = m < 1 ? static_cast<float>(m + bias) : FLT_MAX;
      }
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
