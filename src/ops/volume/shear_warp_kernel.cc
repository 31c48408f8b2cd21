// Shear-warp's loops: a row of the sheared picture through all slices, and the warp of a row of the result.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "ops/volume/shear_warp.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/volume/shear_warp_kernel.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "ops/volume/rays-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::volume::HWY_NAMESPACE {

HWY_INLINE V Codes(const float* p) { return hn::LoadU(D(), p); }
HWY_INLINE V Codes(const hwy::float16_t* p) {
  return hn::PromoteTo(D(), hn::LoadU(hn::Rebind<hwy::float16_t, D>(), p));
}
template <typename T>
HWY_INLINE V Codes(const T* p) {
  return hn::ConvertTo(D(), hn::PromoteTo(DI(), hn::LoadU(hn::Rebind<T, D>(), p)));
}

// The largest integer not above x, for x >= -1: std::floor is a call in baseline x86.
inline int Floor(double x) { return static_cast<int>(x + 1) - 1; }

// Two rows of a slice of a paged volume, one behind the other, along any axis, as `Sheared` has them.
template <typename T>
class CopiedRows {
 public:
  CopiedRows(const Sheared& s, const Field& field)
      : s_(s), data_(field.volume), columns_(s.size[static_cast<size_t>(s.right)]) {
    if (data_->pages != nullptr) rows_.resize(2 * static_cast<size_t>(Stride()) + kReadBehind);
  }
  // Of column 0; those before and behind it that are read are there too.
  const T* At(int j, int k) {
    for (int r = 0; r < 2; ++r) {
      T* const row = rows_.data() + static_cast<size_t>(r * Stride() + model::kVolumeBefore);
      int at[3];
      at[s_.deep] = k, at[s_.down] = j + r;
      if (s_.right == 0) {
        data_->CopyRow(-model::kVolumeBefore, columns_ + model::kVolumeBehind, at[1], at[2],
                       reinterpret_cast<std::byte*>(row - model::kVolumeBefore));
        continue;
      }
      for (int i = -model::kVolumeBefore; i < columns_ + model::kVolumeBehind; ++i) {
        at[s_.right] = i;
        row[i] = reinterpret_cast<const T*>(data_->samples)[data_->IndexOf(at[0], at[1], at[2])];
      }
    }
    data_->Trim();
    return rows_.data() + model::kVolumeBefore;
  }
  int Stride() const { return columns_ + model::kVolumeBorder; }

 private:
  static constexpr size_t kReadBehind = 64;

  const Sheared& s_;
  const model::VolumeData* data_;
  const int columns_;
  std::vector<T> rows_;
};

template <typename T>
void CompositeRow(const Sheared& s, int row, float* line) {
  const D d;
  const DI di;
  const MediumArgs& m = *s.medium;
  const Field& field = m.field;
  const auto size_of = [&](int axis) { return s.size[static_cast<size_t>(axis)]; };
  const int strides[3] = {1, field.row, field.slice};
  int right = strides[s.right], down = strides[s.down];
  const int blocks[3] = {1, field.blocks[0], field.blocks[1]};
  const int slices = size_of(s.deep), columns = size_of(s.right);
  const auto stride = static_cast<size_t>(s.stride);
  // Colour, alpha, and the length of a ray within a slice, plane by plane.
  std::vector<float> memory(5 * stride);
  float* planes[5];
  for (size_t c = 0; c < 5; ++c) planes[c] = memory.data() + c * stride;
  std::fill_n(planes[4], stride, static_cast<float>(s.length));
  // Rays of a perspective camera are longer the farther aside they go.
  for (int x = 0; s.perspective && x < s.width; ++x) {
    std::array<double, 3> direction;
    direction[static_cast<size_t>(s.deep)] = s.base - s.eye[s.deep];
    direction[static_cast<size_t>(s.right)] = s.right0 + x - s.eye[s.right];
    direction[static_cast<size_t>(s.down)] = s.down0 + row - s.eye[s.down];
    planes[4][x] = static_cast<float>(s.LengthOf(direction));
  }
  const bool dense = s.right == 0 && !s.perspective;
  const bool paged = field.pages != nullptr;
  CopiedRows<T> copied(s, field);
  if (paged) right = 1, down = copied.Stride();
  const V lane = hn::ConvertTo(d, hn::Iota(di, 0)), opaque = Set(m.opaque);
  for (int n = 0; n < slices; ++n) {
    const int k = s.backward ? slices - 1 - n : n;
    const Sheared::Slice slice = s.At(k);
    const double place_down = slice.down + slice.scale * (s.down0 + row);
    const double place = slice.right + slice.scale * s.right0;  // of pixel 0
    // Half a voxel beyond the outermost centres belongs to the volume.
    if (place_down < -0.5 || place_down > size_of(s.down) - 0.5) continue;
    const int j = Floor(place_down);
    const V fy = Set(static_cast<float>(place_down - j));
    const T* const rows =
        paged ? copied.At(j, k)
              : static_cast<const T*>(field.samples) + ptrdiff_t{k} * strides[s.deep] + ptrdiff_t{j} * down;
    const int inner_j = std::clamp(j, 0, size_of(s.down) - 1);
    const uint16_t* const leaps =
        field.leap + (k >> field.shift) * blocks[s.deep] + (inner_j >> field.shift) * blocks[s.down];
    const auto empty = [&](int first, int last) {
      first = std::clamp(first, 0, columns - 1) >> field.shift;
      last = std::clamp(last, 0, columns - 1) >> field.shift;
      while (first <= last && (leaps[first * blocks[s.right]] & 255) != 0) ++first;
      return first > last;
    };
    const auto pixel_of = [&](double voxel) { return (voxel - place) / slice.scale; };
    const int from = std::max(0, static_cast<int>(std::ceil(pixel_of(-0.5))));
    const int to = std::min(s.width, static_cast<int>(std::floor(pixel_of(columns - 0.5))) + 1);
    for (int x = from; x < to; x += kLanes) {
      const int count = std::min(kLanes, to - x);
      // Places are counted from every sixteenth pixel, whatever a vector holds, so that all have the same.
      const int block = from + (x - from) / 16 * 16, into = x - block;
      const double at = place + slice.scale * block;
      const int whole = Floor(at);
      if (empty(Floor(at + slice.scale * into), Floor(at + slice.scale * (into + count - 1)))) continue;
      const V alpha = hn::LoadU(d, planes[3] + x);
      const M active = hn::And(hn::Lt(alpha, opaque), hn::Lt(lane, Set(static_cast<float>(count))));
      if (hn::AllFalse(d, active)) continue;
      V a, b, c, e, fx = Set(static_cast<float>(at - whole));
      if (dense) {
        const T* const p = rows + whole + into;
        a = Codes(p), b = Codes(p + 1), c = Codes(p + down), e = Codes(p + down + 1);
      } else {
        const V pixel = hn::Add(lane, Set(static_cast<float>(into)));
        const V places = hn::MulAdd(pixel, Set(static_cast<float>(slice.scale)), fx);
        const V floor = hn::Floor(places);
        fx = hn::Sub(places, floor);
        // Lanes beyond the last pixel stay with it.
        const V limit = Set(static_cast<float>(columns - 1 - whole));
        const Places index(hn::Mul(hn::Add(hn::ConvertTo(di, hn::Min(floor, limit)), hn::Set(di, whole)),
                                   hn::Set(di, right)));
        if (right == 1) {
          PairFrom(rows, 0, index, a, b);
          PairFrom(rows, down, index, c, e);
        } else {
          V unused;
          PairFrom(rows, 0, index, a, unused);
          PairFrom(rows, right, index, b, unused);
          PairFrom(rows, down, index, c, unused);
          PairFrom(rows, ptrdiff_t{down} + right, index, e, unused);
        }
      }
      const V code = Lerp(Lerp(a, b, fx), Lerp(c, e, fx), fy);
      const s::Pixels color = ColorOf(m.transfer, hn::MulAdd(code, Set(field.scale), Set(field.bias)));
      const V optical = hn::Mul(color.a, hn::LoadU(d, planes[4] + x));
      const V opacity = hn::Neg(hn::Expm1(d, hn::Neg(optical)));
      const V weight = hn::IfThenElseZero(active, hn::NegMulAdd(alpha, opacity, opacity));
      const auto add = [&](int plane, V v) HWY_ATTR {
        hn::StoreU(hn::MulAdd(v, weight, hn::LoadU(d, planes[plane] + x)), d, planes[plane] + x);
      };
      add(0, color.r);
      add(1, color.g);
      add(2, color.b);
      hn::StoreU(hn::Add(alpha, weight), d, planes[3] + x);
    }
  }
  for (int x = 0; x < s.width; ++x) {
    for (size_t c = 0; c < 4; ++c) line[static_cast<size_t>(x) * 4 + c] = planes[c][x];
  }
}

void WarpRow(const Sheared& s, const float* picture, const ImageView& out, int y) {
  const D d;
  const DI di;
  const RaySet& rays = s.medium->rays;
  const float py = static_cast<float>(y) - rays.middle_y;
  const V infinity = Set(std::numeric_limits<float>::infinity()), zero = hn::Zero(d);
  auto* to = reinterpret_cast<float*>(out.At(out.roi.x0, y));
  HWY_ALIGN float result[5][kLanes];
  for (int x = out.roi.x0; x < out.roi.x1; x += kLanes) {
    const V px = hn::Sub(hn::ConvertTo(d, hn::Iota(di, x)), Set(rays.middle_x));
    // The ray's point in the slice at `base`.
    const auto affine = [&](const float* c) HWY_ATTR {
      return hn::MulAdd(px, Set(c[1]), Set(static_cast<float>(c[0] + static_cast<double>(py) * c[2])));
    };
    const V to_base = hn::Div(hn::Sub(Set(static_cast<float>(s.base)), affine(rays.origin[s.deep])),
                              affine(rays.direction[s.deep]));
    const auto place = [&](int axis, int first) HWY_ATTR {
      return hn::Sub(hn::MulAdd(to_base, affine(rays.direction[axis]), affine(rays.origin[axis])),
                     Set(static_cast<float>(first)));
    };
    V u = place(s.right, s.right0), v = place(s.down, s.down0);
    M seen = hn::And(hn::Ge(u, zero), hn::Ge(v, zero));
    seen = hn::And(seen, hn::And(hn::Lt(u, Set(static_cast<float>(s.width - 1))),
                                 hn::Lt(v, Set(static_cast<float>(s.height - 1)))));
    if (s.perspective) seen = hn::And(seen, hn::Gt(to_base, Set(-rays.middle_depth)));
    u = hn::IfThenElseZero(seen, u);
    v = hn::IfThenElseZero(seen, v);
    const VI i = hn::ConvertTo(di, u), j = hn::ConvertTo(di, v);
    const V fu = hn::Sub(u, hn::ConvertTo(d, i)), fv = hn::Sub(v, hn::ConvertTo(d, j));
    const Places index(hn::Add(hn::Mul(j, hn::Set(di, s.stride)), i));
    const s::Pixels near = Mixed(EntryAt(picture, index), EntryAt(picture, index, 1), fu);
    const s::Pixels far = Mixed(EntryAt(picture, index, s.stride), EntryAt(picture, index, s.stride + 1), fu);
    const s::Pixels pixel = Mixed(near, far, fv);
    hn::Store(hn::IfThenElseZero(seen, pixel.r), d, result[0]);
    hn::Store(hn::IfThenElseZero(seen, pixel.g), d, result[1]);
    hn::Store(hn::IfThenElseZero(seen, pixel.b), d, result[2]);
    hn::Store(hn::IfThenElseZero(seen, pixel.a), d, result[3]);
    hn::Store(infinity, d, result[4]);
    const int count = std::min(kLanes, out.roi.x1 - x);
    for (int l = 0; l < count; ++l, to += out.channels) {
      for (int c = 0; c < out.channels; ++c) to[c] = result[c][l];
    }
  }
}

CompositeSheared FindCompositeHere(PixelType type) {
  return ForSampleType(type, [](auto sample) -> CompositeSheared { return CompositeRow<decltype(sample)>; });
}
WarpSheared FindWarpHere() { return WarpRow; }

}  // namespace tessera::ops::volume::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops::volume {

HWY_EXPORT(FindCompositeHere);
HWY_EXPORT(FindWarpHere);

CompositeSheared FindCompositeSheared(PixelType type) {
  return HWY_DYNAMIC_DISPATCH(FindCompositeHere)(type);
}
WarpSheared FindWarpSheared() { return HWY_DYNAMIC_DISPATCH(FindWarpHere)(); }

}  // namespace tessera::ops::volume
#endif  // HWY_ONCE
