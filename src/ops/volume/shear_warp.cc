// Shear-warp for parallel cameras (Lacroute and Levoy 1994): every slice is shifted, not resampled along the rays, so
// that its weights are the same for all voxels; blocks of voxels that are transparent and pixels that are opaque are
// skipped; one warp brings the sheared picture to the screen.
#include "ops/volume/shear_warp.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "ops/volume/prepare.h"

namespace tessera::ops::volume {
namespace {

struct Pixel {
  float color[3] = {0, 0, 0}, alpha = 0;
};

float Code(const uint8_t* p) { return *p; }
float Code(const uint16_t* p) { return *p; }
float Code(const Imath::half* p) { return *p; }
float Code(const float* p) { return *p; }

// The axes of the sheared picture: `deep` along which slices are stacked, `right` and `down` within them.
struct Sheared {
  int deep = 2, right = 0, down = 1;
  double shear_right = 0, shear_down = 0;  // voxels a slice
  int right0 = 0, down0 = 0, width = 0, height = 0;
  bool backward = false;                   // the first slice is the last one
  float length = 0;                        // world units of a ray within a slice
};

class ShearWarpStage final : public graph::WholeStage {
 public:
  ShearWarpStage(base::VolumeDrawPointer draw, const graph::Workers& workers) : draw_(std::move(draw)) {
    Prepare(*draw_, workers, prepared_);
    const RaySet& rays = prepared_.medium.rays;
    const auto& size = draw_->volume.spec().size;
    Sheared& s = sheared_;
    s.deep = prepared_.medium.axis;
    s.right = s.deep == 0 ? 1 : 0;
    s.down = s.deep == 2 ? 1 : 2;
    const double along = rays.direction[s.deep][0];
    s.shear_right = rays.direction[s.right][0] / along;
    s.shear_down = rays.direction[s.down][0] / along;
    s.backward = along < 0;
    double world = 0;
    for (int a = 0; a < 3; ++a) {
      const double d = rays.direction[a][0] * static_cast<double>(rays.spacing[a]);
      world += d * d;
    }
    s.length = static_cast<float>(std::sqrt(world) / std::fabs(along));
    // A ray meets slice k at (right + shear k, down + shear k); its place in the picture is that of k = 0.
    const auto extent = [&](int axis, double shear, int& first) {
      const double last = shear * (size[static_cast<size_t>(s.deep)] - 1);
      first = static_cast<int>(std::floor(std::min(0.0, -last))) - 1;
      const double end = size[static_cast<size_t>(axis)] - 1 + std::max(0.0, -last);
      return static_cast<int>(std::ceil(end)) + 2 - first;
    };
    s.width = extent(s.right, s.shear_right, s.right0);
    s.height = extent(s.down, s.shear_down, s.down0);
  }

  void Run(std::span<const ConstImageView>, const ImageView& out, const graph::Workers& workers) const override {
    std::vector<Pixel> picture(static_cast<size_t>(sheared_.width + 1) * (sheared_.height + 1));
    workers.For(sheared_.height, [&](int64_t row, int) {
      Pixel* const line = &picture[static_cast<size_t>(row) * (sheared_.width + 1)];
      switch (draw_->volume.spec().type) {
        case PixelType::kUint8:
          return CompositeRow<uint8_t>(static_cast<int>(row), line);
        case PixelType::kUint16:
          return CompositeRow<uint16_t>(static_cast<int>(row), line);
        case PixelType::kHalf:
          return CompositeRow<Imath::half>(static_cast<int>(row), line);
        default:
          return CompositeRow<float>(static_cast<int>(row), line);
      }
    });
    workers.For(out.roi.height(), [&](int64_t y, int) { WarpRow(picture, out, out.roi.y0 + static_cast<int>(y)); });
  }

 private:
  // One row of the sheared picture through all slices, front to back.
  template <typename T>
  void CompositeRow(int row, Pixel* line) const {
    const Sheared& s = sheared_;
    const MediumArgs& m = prepared_.medium;
    const Field& field = m.field;
    const auto& size = draw_->volume.spec().size;
    const int64_t strides[3] = {1, field.row, field.slice};
    const int64_t right = strides[s.right], down = strides[s.down];
    const int blocks[3] = {1, field.blocks[0], field.blocks[1]};
    const int slices = size[static_cast<size_t>(s.deep)], columns = size[static_cast<size_t>(s.right)];
    const int edge = 1 << field.shift;
    for (int n = 0; n < slices; ++n) {
      const int k = s.backward ? slices - 1 - n : n;
      const double place_down = s.down0 + row + s.shear_down * k, place = s.right0 + s.shear_right * k;
      const double whole_down = std::floor(place_down), whole = std::floor(place);
      const int j = static_cast<int>(whole_down);
      // Half a voxel beyond the outermost centres belongs to the volume.
      if (place_down < -0.5 || place_down > size[static_cast<size_t>(s.down)] - 0.5) continue;
      const auto fy = static_cast<float>(place_down - whole_down), fx = static_cast<float>(place - whole);
      const T* const rows = static_cast<const T*>(field.samples) + k * strides[s.deep] + j * down;
      const int inner_j = std::clamp(j, 0, size[static_cast<size_t>(s.down)] - 1);
      const int row_block = (k >> field.shift) * blocks[s.deep] + (inner_j >> field.shift) * blocks[s.down];
      const int shift = static_cast<int>(whole);  // voxel of pixel 0
      const int from = std::max(0, -shift - (fx >= 0.5f ? 1 : 0)), to = std::min(s.width, columns - shift - (fx > 0.5f ? 1 : 0));
      for (int x = from; x < to;) {
        const int i = x + shift, inner = std::clamp(i, 0, columns - 1);
        const int stop = std::max(x + 1, std::min(to, ((inner >> field.shift) + 1) * edge - shift));
        if ((field.leap[row_block + (inner >> field.shift) * blocks[s.right]] & 255) != 0) {
          x = stop;
          continue;
        }
        for (; x < stop; ++x) {
          Pixel& pixel = line[x];
          if (pixel.alpha >= m.opaque) continue;
          const T* const p = rows + (x + shift) * right;
          const float a = Code(p), b = Code(p + right), c = Code(p + down), d = Code(p + down + right);
          const float low = a + fx * (b - a), high = c + fx * (d - c);
          Composite((low + fy * (high - low)) * field.scale + field.bias, pixel);
        }
      }
    }
  }

  void Composite(float value, Pixel& pixel) const {
    const ColorTable& t = prepared_.medium.transfer;
    const float u = std::clamp(value * t.times + t.plus, 0.0f, static_cast<float>(t.size - 1));
    const int entry = static_cast<int>(u);
    const float f = u - static_cast<float>(entry);
    const float* const e = t.entries + ptrdiff_t{4} * entry;
    const float extinction = e[3] + f * (e[7] - e[3]);
    if (!(extinction > 0)) return;
    const float weight = (1 - pixel.alpha) * -std::expm1(-extinction * sheared_.length);
    for (int c = 0; c < 3; ++c) pixel.color[c] += weight * (e[c] + f * (e[c + 4] - e[c]));
    pixel.alpha += weight;
  }

  void WarpRow(const std::vector<Pixel>& picture, const ImageView& out, int y) const {
    const Sheared& s = sheared_;
    const RaySet& rays = prepared_.medium.rays;
    auto* to = reinterpret_cast<float*>(out.At(out.roi.x0, y));
    for (int x = out.roi.x0; x < out.roi.x1; ++x, to += out.channels) {
      const double px = x - static_cast<double>(rays.middle_x), py = y - static_cast<double>(rays.middle_y);
      const auto origin = [&](int a) {
        return rays.origin[a][0] + px * rays.origin[a][1] + py * rays.origin[a][2];
      };
      const double deep = origin(s.deep);
      const double u = origin(s.right) - s.shear_right * deep - s.right0;
      const double v = origin(s.down) - s.shear_down * deep - s.down0;
      float result[5] = {0, 0, 0, 0, std::numeric_limits<float>::infinity()};
      if (u >= 0 && v >= 0 && u < s.width - 1 && v < s.height - 1) {
        const int i = static_cast<int>(u), j = static_cast<int>(v);
        const auto fu = static_cast<float>(u - i), fv = static_cast<float>(v - j);
        const Pixel* const p = &picture[static_cast<size_t>(j) * (s.width + 1) + static_cast<size_t>(i)];
        const Pixel* const q = p + s.width + 1;
        const auto blend = [&](float a, float b, float c, float d) {
          const float low = a + fu * (b - a), high = c + fu * (d - c);
          return low + fv * (high - low);
        };
        for (int c = 0; c < 3; ++c) result[c] = blend(p[0].color[c], p[1].color[c], q[0].color[c], q[1].color[c]);
        result[3] = blend(p[0].alpha, p[1].alpha, q[0].alpha, q[1].alpha);
      }
      std::copy_n(result, out.channels, to);
    }
  }

  base::VolumeDrawPointer draw_;
  Prepared prepared_;
  Sheared sheared_;
};

}  // namespace

std::unique_ptr<graph::WholeStage> MakeShearWarp(base::VolumeDrawPointer draw, const graph::StageContext& context) {
  return std::make_unique<ShearWarpStage>(std::move(draw), context.workers);
}

}  // namespace tessera::ops::volume
