// Prepares a light's depths: every texel with its bias, so that a test is one comparison.
#include "ops/shade/shadow_map.h"

#include <algorithm>
#include <cfloat>
#include <cmath>

namespace tessera::ops {
namespace {

bool Hit(double depth) { return depth < 1; }

// Of estimates of one thing: the largest magnitude, but at most twice the smallest; 0 where their signs
// differ, as they do beside an edge. Of a smooth surface all are much alike.
class Agreed {
 public:
  void Add(double estimate) {
    const double size = std::fabs(estimate);
    least_ = std::min(least_, size), most_ = std::max(most_, size);
    up_ = up_ || estimate > 0, down_ = down_ || estimate < 0;
  }
  double size() const { return up_ && down_ ? 0 : std::min(most_, 2 * least_); }

 private:
  double least_ = DBL_MAX, most_ = 0;
  bool up_ = false, down_ = false;
};

// A map's depths by column and row; beyond its edge nothing is hit.
class Depths {
 public:
  explicit Depths(const ConstImageView& view) : view_(view) {}
  double operator()(int x, int y) const {
    if (x < 0 || y < 0 || x >= view_.roi.width() || y >= view_.roi.height()) return 1;
    return double{*reinterpret_cast<const float*>(view_.At(view_.roi.x0 + x, view_.roi.y0 + y))};
  }

 private:
  const ConstImageView& view_;
};

// What a surface does along a line of five texels around the middle one: its slope per texel, and how it
// bends. A neighbour on another surface differs much more and does not count.
struct Course {
  double slope = 0, bend = 0;
  explicit Course(const double (&m)[5]) {
    const double before = m[2] - m[1], after = m[3] - m[2];
    if (Hit(m[1]) && Hit(m[3])) {
      const double one = std::fabs(before), other = std::fabs(after), least = std::min(one, other);
      // Where it turns, the mean; the bend says the rest.
      const double most = before * after < 0 ? 0.5 * std::fabs(m[3] - m[1]) : std::max(one, other);
      slope = std::min(most, 2 * least);
    } else {
      slope = Hit(m[1]) ? std::fabs(before) : Hit(m[3]) ? std::fabs(after) : 0;
    }
    Agreed bends;
    for (int k = 0; k < 3; ++k) {
      if (Hit(m[k]) && Hit(m[k + 1]) && Hit(m[k + 2])) bends.Add(m[k] - 2 * m[k + 1] + m[k + 2]);
    }
    bend = bends.size();
  }
};

// The surface around a texel, as its nearest neighbours show it.
class Surface {
 public:
  Surface(const Depths& at, int x, int y)
      : across_({at(x - 2, y), at(x - 1, y), at(x, y), at(x + 1, y), at(x + 2, y)}),
        down_({at(x, y - 2), at(x, y - 1), at(x, y), at(x, y + 1), at(x, y + 2)}) {
    Agreed twists;
    for (const int dy : {-1, 1}) {
      for (const int dx : {-1, 1}) {
        const double corner = at(x + dx, y + dy), beside = at(x + dx, y), below = at(x, y + dy);
        if (Hit(corner) && Hit(beside) && Hit(below))
          twists.Add(dx * dy * (corner - beside - below + at(x, y)));
      }
    }
    twist_ = twists.size();
  }
  // How much deeper it may be so many texels away.
  double Deeper(double dx, double dy) const {
    return across_.slope * dx + down_.slope * dy + 0.5 * (across_.bend * dx * dx + down_.bend * dy * dy) +
           twist_ * dx * dy;
  }

 private:
  Course across_, down_;
  double twist_ = 0;
};

// How much deeper than a texel of depth m its own surface is within `reach` texels each way: as its
// neighbours foretell, or as the map has it where both ends foretell a part of that at least. So neither
// curved nor rough surfaces shadow themselves, and the depths behind an edge are not taken for its own.
double SurfaceDepth(const Depths& at, int x, int y, double reach) {
  const double m = at(x, y);
  const Surface here(at, x, y);
  double deeper = here.Deeper(reach, reach);
  const int around = std::min(static_cast<int>(std::ceil(reach)), kShadowSearch);
  for (int dy = -around; dy <= around; ++dy) {
    for (int dx = -around; dx <= around; ++dx) {
      const double there = at(x + dx, y + dy), difference = there - m;
      if (!Hit(there) || !(difference > deeper)) continue;
      const double right = std::abs(dx), down = std::abs(dy);
      if (difference > kShadowSurprise * here.Deeper(right, down)) continue;
      if (difference > kShadowSurprise * Surface(at, x + dx, y + dy).Deeper(right, down)) continue;
      deeper = difference;
    }
  }
  return deeper;
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
  const Depths at(depths);
  workers.For(height_ + 2 * margin_, [&](int64_t index, int) {
    const int y = static_cast<int>(index) - margin_;
    float* const row = origin_ + static_cast<ptrdiff_t>(y) * stride_;
    if (y < 0 || y >= height_ || width_ == 0) {
      std::fill(row - margin_, row + width_ + margin_ + kReadBeyond, beside);
      return;
    }
    std::fill(row - margin_, row, beside);
    std::fill(row + width_, row + width_ + margin_ + kReadBeyond, beside);
    for (int x = 0; x < width_; ++x) {
      const double m = at(x, y);
      if (!(m < 1)) {  // nothing hit, or NaN
        row[x] = FLT_MAX;
        continue;
      }
      const double bias = p.bias < 0 ? SurfaceDepth(at, x, y, reach) + steps : p.bias;
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
