// Shear-warp (Lacroute and Levoy 1994): every slice is shifted, for perspective cameras scaled too, and not
// resampled along the rays; blocks of voxels that are transparent and pixels that are opaque are skipped; one
// warp brings the sheared picture to the screen.
#include "ops/volume/shear_warp.h"

#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

// The axes of the sheared picture: `deep` along which slices are stacked, `right` and `down` within them. Its
// pixels are the voxels of the slice at `base`, which is 0 for parallel cameras and the nearest one for
// others: farther ones shrink.
struct Sheared {
  int deep = 2, right = 0, down = 1;
  bool perspective = false;
  double shear_right = 0, shear_down = 0;  // parallel: voxels a slice
  double eye[3] = {0, 0, 0}, base = 0;     // perspective: voxels
  int right0 = 0, down0 = 0, width = 0, height = 0;
  bool backward = false;  // the first slice is the last one
  double length = 0;      // parallel: world units of a ray within a slice

  // A ray through (right, down) of the picture meets slice k at offset + scale * place.
  struct Slice {
    double right, down, scale;
  };
  Slice At(int k) const {
    if (!perspective) return {shear_right * k, shear_down * k, 1};
    const double scale = (k - eye[deep]) / (base - eye[deep]);
    return {eye[right] * (1 - scale), eye[down] * (1 - scale), scale};
  }
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
    s.perspective = rays.perspective;
    const int slices = size[static_cast<size_t>(s.deep)];
    const double along = rays.direction[s.deep][0];
    s.backward = along < 0;
    s.shear_right = rays.direction[s.right][0] / along;
    s.shear_down = rays.direction[s.down][0] / along;
    for (int a = 0; a < 3; ++a) {
      s.eye[a] = rays.origin[a][0] - static_cast<double>(rays.middle_depth) * rays.direction[a][0];
    }
    s.base = s.perspective && s.backward ? slices - 1 : 0;
    s.length = LengthOf({rays.direction[0][0], rays.direction[1][0], rays.direction[2][0]});
    // Every voxel, one beyond the outermost ones, of the first and the last slice is in the picture.
    const auto extent = [&](int axis, int& first) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const int k : {0, slices - 1}) {
        const Sheared::Slice slice = s.At(k);
        const double offset = axis == s.right ? slice.right : slice.down;
        low = std::min(low, (-1 - offset) / slice.scale);
        high = std::max(high, (size[static_cast<size_t>(axis)] - offset) / slice.scale);
      }
      first = static_cast<int>(std::floor(low));
      return static_cast<int>(std::ceil(high)) + 2 - first;
    };
    s.width = extent(s.right, s.right0);
    s.height = extent(s.down, s.down0);
  }

  void Run(std::span<const ConstImageView>, const ImageView& out,
           const graph::Workers& workers) const override {
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
    workers.For(out.roi.height(),
                [&](int64_t y, int) { WarpRow(picture, out, out.roi.y0 + static_cast<int>(y)); });
  }

 private:
  // World units of a way along a direction in voxels, from one slice to the next.
  double LengthOf(const std::array<double, 3>& direction) const {
    double square = 0;
    for (size_t a = 0; a < 3; ++a) {
      const double d = direction[a] * static_cast<double>(prepared_.medium.rays.spacing[a]);
      square += d * d;
    }
    return std::sqrt(square) / std::fabs(direction[static_cast<size_t>(sheared_.deep)]);
  }

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
    // Rays of a perspective camera are longer the farther aside they go.
    std::vector<float> lengths(static_cast<size_t>(s.width), static_cast<float>(s.length));
    for (int x = 0; s.perspective && x < s.width; ++x) {
      std::array<double, 3> direction;
      direction[static_cast<size_t>(s.deep)] = s.base - s.eye[s.deep];
      direction[static_cast<size_t>(s.right)] = s.right0 + x - s.eye[s.right];
      direction[static_cast<size_t>(s.down)] = s.down0 + row - s.eye[s.down];
      lengths[static_cast<size_t>(x)] = static_cast<float>(LengthOf(direction));
    }
    for (int n = 0; n < slices; ++n) {
      const int k = s.backward ? slices - 1 - n : n;
      const Sheared::Slice slice = s.At(k);
      const double place_down = slice.down + slice.scale * (s.down0 + row);
      const double place = slice.right + slice.scale * s.right0;  // of pixel 0
      const double whole_down = std::floor(place_down);
      const int j = static_cast<int>(whole_down);
      // Half a voxel beyond the outermost centres belongs to the volume.
      if (place_down < -0.5 || place_down > size[static_cast<size_t>(s.down)] - 0.5) continue;
      const auto fy = static_cast<float>(place_down - whole_down);
      const T* const rows = static_cast<const T*>(field.samples) + k * strides[s.deep] + j * down;
      const int inner_j = std::clamp(j, 0, size[static_cast<size_t>(s.down)] - 1);
      const int row_block = (k >> field.shift) * blocks[s.deep] + (inner_j >> field.shift) * blocks[s.down];
      const auto pixel_of = [&](double voxel) { return (voxel - place) / slice.scale; };
      const int from = std::max(0, static_cast<int>(std::ceil(pixel_of(-0.5))));
      const int to = std::min(s.width, static_cast<int>(std::floor(pixel_of(columns - 0.5))) + 1);
      for (int x = from; x < to;) {
        const auto i = static_cast<int>(std::floor(place + slice.scale * x));
        const int block = std::clamp(i, 0, columns - 1) >> field.shift;
        const int stop = std::clamp(static_cast<int>(std::ceil(pixel_of((block + 1) * edge))), x + 1, to);
        if ((field.leap[row_block + block * blocks[s.right]] & 255) != 0) {
          x = stop;
          continue;
        }
        for (; x < stop; ++x) {
          Pixel& pixel = line[x];
          if (pixel.alpha >= m.opaque) continue;
          const double at = place + slice.scale * x;
          const int whole =
              static_cast<int>(at + 1) - 1;  // the floor, for at >= -0.5: a call in baseline x86
          const auto fx = static_cast<float>(at - whole);
          const T* const p = rows + ptrdiff_t{whole} * right;
          const float a = Code(p), b = Code(p + right), c = Code(p + down), d = Code(p + down + right);
          const float low = a + fx * (b - a), high = c + fx * (d - c);
          Composite((low + fy * (high - low)) * field.scale + field.bias, lengths[static_cast<size_t>(x)],
                    pixel);
        }
      }
    }
  }

  void Composite(float value, float length, Pixel& pixel) const {
    const ColorTable& t = prepared_.medium.transfer;
    const float u = std::clamp(value * t.times + t.plus, 0.0f, static_cast<float>(t.size - 1));
    const int entry = static_cast<int>(u);
    const float f = u - static_cast<float>(entry);
    const float* const e = t.entries + ptrdiff_t{4} * entry;
    const float extinction = e[3] + f * (e[7] - e[3]);
    if (!(extinction > 0)) return;
    const float weight = (1 - pixel.alpha) * -std::expm1(-extinction * length);
    for (int c = 0; c < 3; ++c) pixel.color[c] += weight * (e[c] + f * (e[c + 4] - e[c]));
    pixel.alpha += weight;
  }

  void WarpRow(const std::vector<Pixel>& picture, const ImageView& out, int y) const {
    const Sheared& s = sheared_;
    const RaySet& rays = prepared_.medium.rays;
    auto* to = reinterpret_cast<float*>(out.At(out.roi.x0, y));
    for (int x = out.roi.x0; x < out.roi.x1; ++x, to += out.channels) {
      const double px = x - static_cast<double>(rays.middle_x), py = y - static_cast<double>(rays.middle_y);
      // The ray's point in the slice at `base`.
      const auto affine = [&](const float* c) { return c[0] + px * c[1] + py * c[2]; };
      const double to_base = (s.base - affine(rays.origin[s.deep])) / affine(rays.direction[s.deep]);
      const auto place = [&](int a) { return affine(rays.origin[a]) + to_base * affine(rays.direction[a]); };
      const double u = place(s.right) - s.right0, v = place(s.down) - s.down0;
      const bool ahead = !s.perspective || to_base > -static_cast<double>(rays.middle_depth);
      float result[5] = {0, 0, 0, 0, std::numeric_limits<float>::infinity()};
      if (ahead && u >= 0 && v >= 0 && u < s.width - 1 && v < s.height - 1) {
        const int i = static_cast<int>(u), j = static_cast<int>(v);
        const auto fu = static_cast<float>(u - i), fv = static_cast<float>(v - j);
        const Pixel* const p = &picture[static_cast<size_t>(j) * (s.width + 1) + static_cast<size_t>(i)];
        const Pixel* const q = p + s.width + 1;
        const auto blend = [&](float a, float b, float c, float d) {
          const float low = a + fu * (b - a), high = c + fu * (d - c);
          return low + fv * (high - low);
        };
        for (int c = 0; c < 3; ++c)
          result[c] = blend(p[0].color[c], p[1].color[c], q[0].color[c], q[1].color[c]);
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

std::unique_ptr<graph::WholeStage> MakeShearWarp(base::VolumeDrawPointer draw,
                                                 const graph::StageContext& context) {
  return std::make_unique<ShearWarpStage>(std::move(draw), context.workers);
}

}  // namespace tessera::ops::volume
