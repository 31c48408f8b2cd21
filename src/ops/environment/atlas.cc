// Faces of environment maps with borders from across their seams.
#include "ops/environment/atlas.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "base/arena.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::ops {
namespace {

// A mean of texels, in double.
struct Mean {
  double sum[4] = {}, weight = 0;
  void Add(const float* texel, double w = 1) {
    for (int c = 0; c < 4; ++c) sum[c] += w * texel[c];
    weight += w;
  }
  void Store(float* texel) const {
    for (int c = 0; c < 4; ++c) texel[c] = weight > 0 ? static_cast<float>(sum[c] / weight) : 0.0f;
  }
};

// Squared distance of a texel's centre from the disc's, in radii.
double DiscSquare(const MapLayout& l, int i, int j) {
  const double s = (2 * i + 1.0) / l.width - 1, t = (2 * j + 1.0) / l.height - 1;
  return s * s + t * t;
}

}  // namespace

EnvironmentAtlas::EnvironmentAtlas(const ConstImageView& picture, int first, const MapLayout& layout,
                                   const graph::Workers& workers)
    : layout_(layout) {
  const int64_t texels = static_cast<int64_t>(layout_.faces.size()) * rows() * stride();
  if (texels > INT32_MAX) {
    throw DataError("environment map",
                    "found " + std::to_string(texels) + " texels, expected fewer than 2^31");
  }
  memory_ = base::AllocateAligned(workers.context(), static_cast<size_t>(texels) * 16 + 64,
                                  base::Access::kScattered);
  if (texels == 0) return;
  const int channels = std::min(4, picture.channels - first);
  const int64_t lines = static_cast<int64_t>(layout_.faces.size()) * layout_.height;
  std::atomic<bool> finite = true;
  workers.For(lines, [&](int64_t line, int) {
    const int face = static_cast<int>(line / layout_.height), j = static_cast<int>(line % layout_.height);
    float* const to = Texel(face, 0, j);
    int x, y;
    PictureTexel(layout_, face, 0, j, &x, &y);
    const auto* from =
        reinterpret_cast<const float*>(picture.At(picture.roi.x0 + x, picture.roi.y0 + y, first));
    const bool turned = layout_.faces[static_cast<size_t>(face)].turned;
    const ptrdiff_t step = turned ? -picture.channels : picture.channels;
    const int width = layout_.width;
    if (step == 4) {
      std::copy_n(from, ptrdiff_t{4} * width, to);
    } else {
      for (int i = 0; i < width; ++i, from += step) {
        for (int c = 0; c < 4; ++c) to[4 * i + c] = c < channels ? from[c] : 0;
      }
    }
    // 0 times a number is 0; eight sums, so that they can be taken together.
    float sums[8] = {};
    for (int i = 0; i + 8 <= 4 * width; i += 8) {
      for (int k = 0; k < 8; ++k) sums[k] += 0 * to[i + k];
    }
    float sum = 0;
    for (int k = 0; k < 8; ++k) sum += sums[k];
    for (int i = 4 * width / 8 * 8; i < 4 * width; ++i) sum += 0 * to[i];
    if (!(sum == 0)) finite = false;
  });
  finite_ = finite;
  switch (layout_.map) {
    case EnvironmentMap::kLatLong:
      FillLatLong();
      break;
    case EnvironmentMap::kSphere:
      FillSphere();
      break;
    case EnvironmentMap::kParabolic:
    case EnvironmentMap::kDualParabolic:
      FillParabolic();
      break;
    case EnvironmentMap::kCube:
      FillCube();
      break;
    case EnvironmentMap::kOctahedral:
      FillOctahedral();
      break;
    default:
      FillLens();
      break;
  }
}

void EnvironmentAtlas::HoldHalves(ToHalf convert, const graph::Workers& workers) {
  if (layout_.map != EnvironmentMap::kLatLong || !finite_ || layout_.faces.empty()) return;
  const ptrdiff_t row = ptrdiff_t{4} * stride();
  const std::shared_ptr<std::byte> halves = base::AllocateAligned(
      workers.context(), static_cast<size_t>(row) * static_cast<size_t>(rows()) * 2 + 64,
      base::Access::kScattered);
  std::atomic<bool> exact = true;
  workers.For(layout_.height, [&](int64_t j, int) {
    auto* const to = reinterpret_cast<uint16_t*>(halves.get()) + (j + 1) * row;
    if (exact && !convert(pixels() + (j + 1) * row, static_cast<int>(row), to)) exact = false;
  });
  if (!exact) return;
  // What is looked up between the padded rows and the face is read from the floats.
  std::fill_n(reinterpret_cast<uint16_t*>(halves.get()), row, uint16_t{0});
  std::fill_n(reinterpret_cast<uint16_t*>(halves.get()) + (rows() - 1) * row, row, uint16_t{0});
  poles_.assign(pixels(), pixels() + 2 * row);
  poles_.insert(poles_.end(), pixels() + (rows() - 2) * row, pixels() + rows() * row);
  halves_ = halves;
  memory_.reset();
}

void EnvironmentAtlas::ExtendEdges(int face) {
  const int w = layout_.width, h = layout_.height;
  for (int j = 0; j < h; ++j) {
    std::copy_n(Texel(face, 0, j), 4, Texel(face, -1, j));
    std::copy_n(Texel(face, w - 1, j), 4, Texel(face, w, j));
  }
  std::copy_n(Texel(face, -1, 0), 4 * stride(), Texel(face, -1, -1));
  std::copy_n(Texel(face, -1, h - 1), 4 * stride(), Texel(face, -1, h));
}

void EnvironmentAtlas::JoinEnds() {
  const int w = layout_.width;
  for (int j = 0; j < layout_.height; ++j) {
    std::copy_n(Texel(0, w - 1, j), 4, Texel(0, -1, j));
    std::copy_n(Texel(0, 0, j), 4, Texel(0, w, j));
  }
}

void EnvironmentAtlas::FillLens() {
  ExtendEdges(0);
  if (!layout_.whole_turn) return;
  JoinEnds();
  std::copy_n(Texel(0, -1, 0), 4 * stride(), Texel(0, -1, -1));
  std::copy_n(Texel(0, -1, layout_.height - 1), 4 * stride(), Texel(0, -1, layout_.height));
}

// An edge of the square is folded in its middle: what lies beyond is its other half.
void EnvironmentAtlas::FillOctahedral() {
  const int w = layout_.width, h = layout_.height;
  for (int j = 0; j < h; ++j) {
    std::copy_n(Texel(0, 0, h - 1 - j), 4, Texel(0, -1, j));
    std::copy_n(Texel(0, w - 1, h - 1 - j), 4, Texel(0, w, j));
  }
  for (int i = -1; i <= w; ++i) {
    std::copy_n(Texel(0, w - 1 - i, 0), 4, Texel(0, i, -1));
    std::copy_n(Texel(0, w - 1 - i, h - 1), 4, Texel(0, i, h));
  }
}

void EnvironmentAtlas::FillLatLong() {
  const int w = layout_.width, h = layout_.height;
  JoinEnds();
  for (const auto& [from, to] : {std::pair{0, -1}, std::pair{h - 1, h}}) {
    Mean mean;
    for (int i = 0; i < w; ++i) mean.Add(Texel(0, i, from));
    for (int i = -1; i <= w; ++i) mean.Store(Texel(0, i, to));
  }
}

void EnvironmentAtlas::FillSphere() {
  const int w = layout_.width, h = layout_.height;
  const double band = std::max(0.0, 1 - std::sqrt(2.0) / (0.5 * std::min(w, h)));
  Mean mean;
  for (int j = 0; j < h; ++j) {
    for (int i = 0; i < w; ++i) {
      const double square = DiscSquare(layout_, i, j);
      if (square <= 1 && square >= band * band) mean.Add(Texel(0, i, j));
    }
  }
  mean.Store(rim_);
  for (int j = -1; j <= h; ++j) {
    for (int i = -1; i <= w; ++i) {
      if (i < 0 || j < 0 || i == w || j == h || DiscSquare(layout_, i, j) > 1) {
        std::copy_n(rim_, 4, Texel(0, i, j));
      }
    }
  }
}

void EnvironmentAtlas::FillParabolic() {
  const int w = layout_.width, h = layout_.height;
  for (size_t f = 0; f < layout_.faces.size(); ++f) ExtendEdges(static_cast<int>(f));
  if (layout_.faces.size() == 1) return;
  // Texels of the other half space: from the other face, whose place is the inverse in the unit circle. Both
  // faces are filled from what lies inside of the circle, so that neither depends on the other's filling.
  struct Filled {
    int face, i, j;
    float texel[4];
  };
  std::vector<Filled> filled;
  for (int face = 0; face < 2; ++face) {
    for (int j = -1; j <= h; ++j) {
      for (int i = -1; i <= w; ++i) {
        const double square = DiscSquare(layout_, i, j);
        if (square <= 1) continue;
        const double s = ((2 * i + 1.0) / w - 1) / square, t = ((2 * j + 1.0) / h - 1) / square;
        const double u = w * (s + 1) / 2 - 0.5, v = h * (t + 1) / 2 - 0.5;
        const double ci = std::floor(u), cj = std::floor(v);
        Mean mean;
        for (int k = 0; k < 4; ++k) {
          const int x = static_cast<int>(ci) + k % 2, y = static_cast<int>(cj) + k / 2;
          if (x < 0 || y < 0 || x >= w || y >= h || DiscSquare(layout_, x, y) > 1) continue;
          const double weight = (k % 2 ? u - ci : 1 - (u - ci)) * (k / 2 ? v - cj : 1 - (v - cj));
          if (weight > 0) mean.Add(Texel(1 - face, x, y), weight);
        }
        if (!(mean.weight > 0)) continue;
        filled.push_back({face, i, j, {}});
        mean.Store(filled.back().texel);
      }
    }
  }
  for (const Filled& f : filled) std::copy_n(f.texel, 4, Texel(f.face, f.i, f.j));
}

void EnvironmentAtlas::FillCube() {
  const int n = layout_.width;
  for (int face = 0; face < 6; ++face) {
    for (int k = 0; k < n; ++k) {
      for (int edge = 0; edge < 4; ++edge) {
        const int i = edge == 0 ? -1 : edge == 1 ? n : k, j = edge == 2 ? -1 : edge == 3 ? n : k;
        // A hair beyond the edge lies the neighbour's texel.
        constexpr double kHair = 1e-9;
        const double u = i < 0 ? -kHair * n : i == n ? n * (1 + kHair) : i + 0.5;
        const double v = j < 0 ? -kHair * n : j == n ? n * (1 + kHair) : j + 0.5;
        Place across;
        PlaceOnFace(layout_, DirectionAt(layout_, {face, u, v}), &across);
        const auto index = [n](double at) { return std::clamp(static_cast<int>(at), 0, n - 1); };
        std::copy_n(Texel(across.face, index(across.u), index(across.v)), 4, Texel(face, i, j));
      }
    }
  }
  // Where three faces meet there is no fourth texel: the mean of the three makes all of them agree at the
  // corner.
  for (int face = 0; face < 6; ++face) {
    for (int corner = 0; corner < 4; ++corner) {
      const int i = corner % 2 ? n : -1, j = corner / 2 ? n : -1, ci = i < 0 ? 0 : n - 1,
                cj = j < 0 ? 0 : n - 1;
      Mean mean;
      mean.Add(Texel(face, ci, cj)), mean.Add(Texel(face, i, cj)), mean.Add(Texel(face, ci, j));
      mean.Store(Texel(face, i, j));
    }
  }
}

}  // namespace tessera::ops
