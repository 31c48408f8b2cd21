// Look-ups over footprints: where a result pixel comes from and what it covers, in double, one by one; then
// look-ups along its longer axis, or the sum under an ellipse, row by row.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ops/geometry/footprint.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/geometry/footprint_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "simd/floats-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace s = simd::HWY_NAMESPACE;
namespace hn = hwy::HWY_NAMESPACE;

namespace footprint {

using F4 = s::Floats<4>;

// A place in indices of the picture and the ellipse that is the image of a result pixel's unit circle:
// squares of its axes, and the square matrix u u^T of its longer one's direction.
struct Footprint {
  double x = 0, y = 0;
  double longer = 0, shorter = 0;
  double uxx = 1, uxy = 0;

  // False where nothing is seen.
  bool Find(const double (&m)[9], double at_x, double at_y) {
    const double over = 1 / (at_x * m[2] + at_y * m[5] + m[8]);
    x = (at_x * m[0] + at_y * m[3] + m[6]) * over, y = (at_x * m[1] + at_y * m[4] + m[7]) * over;
    // Further out is nowhere, as everywhere in warps; NaN too.
    constexpr double kFarthest = 0x1p40;
    if (!(over > 0 && std::fabs(x) < kFarthest && std::fabs(y) < kFarthest)) return false;
    const double ax = (m[0] - x * m[2]) * over, ay = (m[1] - y * m[2]) * over, bx = (m[3] - x * m[5]) * over,
                 by = (m[4] - y * m[5]) * over;
    const double p = ax * ax + bx * bx, r = ay * ay + by * by, h = ax * ay + bx * by,
                 area = ax * by - ay * bx;
    const double d = std::sqrt((p - r) * (p - r) / 4 + h * h);
    longer = (p + r) / 2 + d;
    if (!(longer < 0x1p300)) return false;
    shorter = longer > 0 ? area / longer * area : 0;
    uxx = d > 0 ? 0.5 + (p - r) / (4 * d) : 1;
    uxy = d > 0 ? h / (2 * d) : 0;
    return true;
  }
};

// exp(-2 t) - exp(-2), t in [0, 1], divided by exp(-1): Taylor's series about the middle.
template <class D>
HWY_INLINE hn::Vec<D> Bell(D d, hn::Vec<D> t) {
  const hn::Vec<D> x = hn::NegMulAdd(t, hn::Set(d, 2.0f), hn::Set(d, 1.0f));
  hn::Vec<D> sum = hn::Set(d, 1.0f / 3628800);
  for (const float c :
       {1.0f / 362880, 1.0f / 40320, 1.0f / 5040, 1.0f / 720, 1.0f / 120, 1.0f / 24, 1.0f / 6, 0.5f, 1.0f})
    sum = hn::MulAdd(sum, x, hn::Set(d, c));
  // 1 - exp(-1), so that it is 0 at the end.
  sum = hn::MulAdd(sum, x, hn::Set(d, 0.63212055882855767f));
  return hn::IfThenElseZero(hn::Lt(t, hn::Set(d, 1.0f)), hn::Max(sum, hn::Zero(d)));
}

class Gatherer {
 public:
  explicit Gatherer(const FootprintJob& job)
      : job_(job), levels_(job.source.levels), widest_(4 * levels_.back().cell()) {}

  void Run() const {
    const Roi& roi = job_.out.roi;
    const int n = job_.out.channels;
    for (int y = roi.y0; y < roi.y1; ++y) {
      auto* out = reinterpret_cast<float*>(job_.out.At(roi.x0, y));
      for (int x = roi.x0; x < roi.x1; ++x, out += n) {
        Footprint f;
        if (job_.source.picture.window.empty() || !f.Find(job_.map, x + 0.5, y + 0.5)) {
          std::fill_n(out, n, 0.0f);
          continue;
        }
        f.x = Near(f.x, levels_[0].width), f.y = Near(f.y, levels_[0].height);
        if (job_.filter == FootprintFilter::kEwa) {
          f.longer *= kRadius * kRadius, f.shorter *= kRadius * kRadius;
          Ellipse(f, out);
        } else {
          Trilinear(f, out);
        }
      }
    }
  }

 private:
  // Brought back into a picture that repeats; kept where integers reach.
  double Near(double at, int size) const {
    const Wrap wrap = job_.source.wrap;
    constexpr double kReach = 0x1p27;
    if (wrap != Wrap::kRepeat && wrap != Wrap::kMirror) return std::clamp(at, -kReach, kReach);
    const double period = wrap == Wrap::kMirror ? 2.0 * size : size;
    return at >= 0 && at < period ? at : at - period * std::floor(at / period);
  }

  // The level whose pixels are at most as large as `width`, and how much of the next one.
  size_t Level(double width, float* next) const {
    size_t k = 0;
    while (k + 1 < levels_.size() && levels_[k + 1].cell() <= width) ++k;
    *next = k + 1 < levels_.size()
                ? static_cast<float>(std::max(
                      0.0, (width - levels_[k].cell()) / (levels_[k + 1].cell() - levels_[k].cell())))
                : 0.0f;
    return k;
  }

  // value(level, group of channels) of one or two levels.
  template <class F>
  HWY_INLINE void Mix(size_t k, float next, float* out, const F& value) const {
    const size_t groups = levels_[0].groups.size();
    for (size_t g = 0; g < groups; ++g) {
      F4 mixed = value(levels_[k], g);
      if (next > 0) {
        mixed = mixed * (1 - next);
        mixed.AddScaled(value(levels_[k + 1], g), next);
      }
      float pixel[4];
      mixed.OneNaN().Store(pixel);
      for (size_t c = 0; c < job_.channels.size(); ++c) {
        const auto channel = static_cast<size_t>(job_.channels[c]);
        if (channel / 4 == g) out[c] = pixel[channel % 4];
      }
    }
  }

  void Trilinear(const Footprint& f, float* out) const {
    const FootprintAxes axes(f.longer, f.shorter, 1, widest_, job_.anisotropy);
    const double length = std::sqrt(axes.longer);
    const int count = ProbeCount(length, std::sqrt(axes.shorter), job_.anisotropy);
    float next;
    const size_t k = Level(length / count, &next);
    const bool flat = f.uxx >= 0.5;
    const double u = std::sqrt(flat ? f.uxx : 1 - f.uxx);
    const double step_x = length / count * (flat ? u : f.uxy / u),
                 step_y = length / count * (flat ? f.uxy / u : u);
    Mix(k, next, out, [&](const FootprintLevel& level, size_t g) HWY_ATTR {
      const double over_x = 1 / level.cell_x, over_y = 1 / level.cell_y;
      const auto probe = [&](int i) HWY_ATTR {
        const double from = 0.5 * (2 * i + 1 - count);
        return Bilinear(level, g, (f.x + from * step_x + 0.5) * over_x - 0.5,
                        (f.y + from * step_y + 0.5) * over_y - 0.5);
      };
      F4 sum = probe(0);
      if (count == 1) return sum;
      for (int i = 1; i < count; ++i) sum = sum + probe(i);
      return sum * (1.0f / static_cast<float>(count));
    });
  }

  // Pixels without weight are not looked at: they may be NaN.
  HWY_INLINE F4 Bilinear(const FootprintLevel& level, size_t g, double x, double y) const {
    const ConstImageView& group = level.groups[g];
    const double left = std::floor(x), top = std::floor(y);
    const auto fx = static_cast<float>(x - left), fy = static_cast<float>(y - top);
    const auto ix = static_cast<int64_t>(left), iy = static_cast<int64_t>(top);
    const bool inside = ix >= 0 && iy >= 0 && ix + 1 < level.width && iy + 1 < level.height;
    if (HWY_LIKELY(inside && fx > 0 && fx < 1 && fy > 0 && fy < 1)) {
      const auto* const p = Pixel(group, static_cast<int>(ix), static_cast<int>(iy));
      const auto* const q = p + group.row_stride / 4;
      F4 upper = F4::Scaled(p, 1 - fx), lower = F4::Scaled(q, 1 - fx);
      upper.AddScaled(p + 4, fx), lower.AddScaled(q + 4, fx);
      F4 sum = upper * (1 - fy);
      sum.AddScaled(lower, fy);
      return sum;
    }
    F4 sum = F4::Zero();
    bool first = true;
    for (int j = 0; j < 2; ++j) {
      const float wy = j == 0 ? 1 - fy : fy;
      const int row = WrappedIndex(iy + j, level.height, job_.source.wrap);
      if (wy == 0 || row < 0) continue;
      for (int i = 0; i < 2; ++i) {
        const float wx = i == 0 ? 1 - fx : fx;
        const int column = WrappedIndex(ix + i, level.width, job_.source.wrap);
        if (wx == 0 || column < 0) continue;
        const float* const p = Pixel(group, column, row);
        if (first) {
          sum = F4::Scaled(p, wx * wy);  // the pixel's own bits, -0 too
        } else {
          sum.AddScaled(p, wx * wy);
        }
        first = false;
      }
    }
    return sum;
  }

  void Ellipse(const Footprint& f, float* out) const {
    const FootprintAxes axes(f.longer, f.shorter, 1, widest_, job_.anisotropy);
    float next;
    // On the finer level the shorter axis is two to four pixels.
    const size_t k = Level(std::sqrt(axes.shorter) / 2, &next);
    Mix(k, next, out,
        [&](const FootprintLevel& level, size_t g) HWY_ATTR { return UnderEllipse(f, level, g); });
  }

  HWY_INLINE F4 UnderEllipse(const Footprint& f, const FootprintLevel& level, size_t g) const {
    const ConstImageView& group = level.groups[g];
    const FootprintAxes axes(f.longer, f.shorter, level.cell(), widest_, job_.anisotropy);
    const double over_x = 1 / level.cell_x, over_y = 1 / level.cell_y, apart = axes.longer - axes.shorter;
    // The ellipse (x, y) V^-1 (x, y)^T = 1 in the level's pixels. Along a row r^2 = r0 + (x - middle)^2 /
    // square, which has no differences of large numbers, however long and oblique the ellipse is.
    const double vxx = (axes.shorter + apart * f.uxx) * over_x * over_x,
                 vyy = (axes.shorter + apart * (1 - f.uxx)) * over_y * over_y,
                 vxy = apart * f.uxy * over_x * over_y;
    const double root = std::sqrt(axes.longer * axes.shorter) * over_x * over_y;
    const double square = root * root / vyy;
    const double x = (f.x + 0.5) * over_x - 0.5, y = (f.y + 0.5) * over_y - 0.5;
    const Wrap wrap = job_.source.wrap;
    const double high = std::sqrt(vyy), wide = std::sqrt(vxx);
    if (wrap == Wrap::kBlack &&
        (x + wide < 0 || y + high < 0 || x - wide > level.width - 1 || y - high > level.height - 1))
      return F4::Zero();
    // A circle of one pixel about a pixel holds no other: that one keeps its bits.
    constexpr double kThere = 0x1p-26;
    const double near_x = std::round(x), near_y = std::round(y);
    if (std::fabs(x - near_x) < kThere && std::fabs(y - near_y) < kThere && vxx < 1 + kThere &&
        vyy < 1 + kThere) {
      const int column = WrappedIndex(static_cast<int64_t>(near_x), level.width, wrap),
                row = WrappedIndex(static_cast<int64_t>(near_y), level.height, wrap);
      return column >= 0 && row >= 0 ? F4::Load(Pixel(group, column, row)) : F4::Zero();
    }
    // About 1 / (sum of weights), so that sums of large values stay finite.
    const auto share = static_cast<float>(0.4 / root);
    double weights = 0;
    F4 total = F4::Zero();
    const auto last = static_cast<int64_t>(std::floor(y + high));
    for (auto j = static_cast<int64_t>(std::ceil(y - high)); j <= last; ++j) {
      const double v = static_cast<double>(j) - y, r0 = v * v / vyy;
      if (!(r0 < 1)) continue;
      const double middle = x + v * vxy / vyy, half = std::sqrt((1 - r0) * square);
      const auto first = static_cast<int64_t>(std::ceil(middle - half));
      const int count =
          std::min(kMostTaps, static_cast<int>(static_cast<int64_t>(std::floor(middle + half)) - first) + 1);
      if (count <= 0) continue;
      alignas(64) float weight[kMostTaps + 16];
      Weigh(static_cast<float>(static_cast<double>(first) - middle), static_cast<float>(1 / square),
            static_cast<float>(r0), share, count, weight);
      for (int i = 0; i < count; ++i) weights += weight[i];
      const int row = WrappedIndex(j, level.height, wrap);
      if (row >= 0) total = total + Row(group, level.width, row, first, count, weight);
    }
    return total * static_cast<float>(1 / weights);
  }

  HWY_INLINE static void Weigh(float from, float over_square, float r0, float share, int count,
                               float* weight) {
    const hn::CappedTag<float, 16> d;
    const int step = static_cast<int>(hn::Lanes(d));
    for (int i = 0; i < count; i += step) {
      const auto x = hn::Add(hn::Iota(d, static_cast<float>(i)), hn::Set(d, from));
      const auto t = hn::MulAdd(hn::Mul(x, hn::Set(d, over_square)), x, hn::Set(d, r0));
      hn::Store(hn::Mul(Bell(d, t), hn::Set(d, share)), d, weight + i);
    }
  }

  HWY_INLINE F4 Row(const ConstImageView& group, int width, int row, int64_t first, int count,
                    const float* weight) const {
    F4 sum[4] = {F4::Zero(), F4::Zero(), F4::Zero(), F4::Zero()};
    const bool inside = first >= 0 && first + count <= width;
    int i = 0;
    if (inside) {
      const float* p = Pixel(group, static_cast<int>(first), row);
      // A weight of 0 is at the very edge: only ends can have it.
      const int begin = weight[0] == 0 ? 1 : 0, end = weight[count - 1] == 0 ? count - 1 : count;
      for (i = begin; i + 4 <= end; i += 4) {
        for (int k = 0; k < 4; ++k) sum[k].AddScaled(p + ptrdiff_t{4} * (i + k), weight[i + k]);
      }
      for (; i < end; ++i) sum[i % 4].AddScaled(p + ptrdiff_t{4} * i, weight[i]);
    } else {
      for (; i < count; ++i) {
        const int column = WrappedIndex(first + i, width, job_.source.wrap);
        if (column < 0 || weight[i] == 0) continue;
        sum[i % 4].AddScaled(Pixel(group, column, row), weight[i]);
      }
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }

  static HWY_INLINE const float* Pixel(const ConstImageView& group, int column, int row) {
    return reinterpret_cast<const float*>(group.data + group.row_stride * row) + ptrdiff_t{4} * column;
  }

  // Of the circle whose image the ellipse is, in result pixels: its bell spreads as much as a pixel's square.
  static constexpr double kRadius = 0.75;
  static constexpr int kMostTaps = 48 * kMostAnisotropy;

  const FootprintJob& job_;
  const std::vector<FootprintLevel>& levels_;
  double widest_;
};

void Gather(const FootprintJob& job) { Gatherer(job).Run(); }

}  // namespace footprint

FootprintFunction FootprintOfTarget() { return &footprint::Gather; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {

HWY_EXPORT(FootprintOfTarget);

FootprintFunction ChooseFootprint() { return HWY_DYNAMIC_DISPATCH(FootprintOfTarget)(); }

}  // namespace tessera::ops
#endif  // HWY_ONCE
