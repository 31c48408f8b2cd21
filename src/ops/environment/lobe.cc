// Samples of environment maps in blocks, and tables of their averages.
#include "ops/environment/lobe.h"

#include <algorithm>
#include <cmath>

#include "tessera/error.h"

namespace tessera::ops {
namespace {

constexpr int kMostCells = 1024, kLargestTable = 512;

struct Item {
  double direction[3] = {}, weight = 0, color[4] = {};
};

double Cosine(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
void Normalize(double* v) {
  const double length = std::sqrt(Cosine(v, v));
  for (int k = 0; k < 3 && length > 0; ++k) v[k] /= length;
}

// Every texel that has a solid angle and is finite, in the order of the picture.
template <class F>
void ForEachTexel(const ConstImageView& picture, int first, const MapLayout& layout, const F& f) {
  const int channels = std::min(4, picture.channels - first);
  for (size_t face = 0; face < layout.faces.size(); ++face) {
    for (int j = 0; j < layout.height; ++j) {
      for (int i = 0; i < layout.width; ++i) {
        Item item;
        item.weight = TexelSolidAngle(layout, i, j);
        if (!(item.weight > 0)) continue;
        const Vector3 d = Normalized(DirectionAt(layout, {static_cast<int>(face), i + 0.5, j + 0.5}));
        std::copy_n(d.begin(), 3, item.direction);
        int x, y;
        PictureTexel(layout, static_cast<int>(face), i, j, &x, &y);
        const auto* texel =
            reinterpret_cast<const float*>(picture.At(picture.roi.x0 + x, picture.roi.y0 + y, first));
        bool finite = true;
        for (int c = 0; c < channels; ++c) {
          item.color[c] = item.weight * texel[c];
          finite = finite && std::isfinite(texel[c]);
        }
        if (finite) f(item);
      }
    }
  }
}

// The cell of a cube map in which a direction lies, counted so that cells of a tile follow each other.
int64_t CellOf(const MapLayout& cube, const double* direction, int tile) {
  Place p;
  PlaceOnFace(cube, {direction[0], direction[1], direction[2]}, &p);
  const int n = cube.width, tiles = (n + tile - 1) / tile;
  const int i = std::min(static_cast<int>(p.u), n - 1), j = std::min(static_cast<int>(p.v), n - 1);
  const int64_t block = (int64_t{p.face} * tiles + j / tile) * tiles + i / tile;
  return (block * tile + j % tile) * tile + i % tile;
}

}  // namespace

LobeSamples::LobeSamples(const ConstImageView& picture, int first, const MapLayout& layout, int cells) {
  constexpr int kTile = 8;
  const int64_t texels = static_cast<int64_t>(layout.faces.size()) * layout.width * layout.height;
  const bool gather = cells > 0 && texels > int64_t{6} * cells * cells;
  // Blocks hold about 64 items.
  const int edge =
      gather ? cells
             : std::clamp(static_cast<int>(std::sqrt(static_cast<double>(texels) / 6)), 1, kMostCells);
  const MapLayout cube = LayoutOf("environment", EnvironmentMap::kCube, 6 * edge, edge);
  const int tiles = (edge + kTile - 1) / kTile;
  std::vector<Item> items;
  std::vector<int64_t> start(static_cast<size_t>(int64_t{6} * tiles * tiles) + 1);
  if (gather) {
    items.resize(static_cast<size_t>(int64_t{6} * tiles * tiles * kTile * kTile));
    ForEachTexel(picture, first, layout, [&](const Item& t) {
      Item& cell = items[static_cast<size_t>(CellOf(cube, t.direction, kTile))];
      for (int k = 0; k < 3; ++k) cell.direction[k] += t.weight * t.direction[k];
      for (int c = 0; c < 4; ++c) cell.color[c] += t.color[c];
      cell.weight += t.weight;
    });
    for (Item& item : items) Normalize(item.direction);
    for (size_t b = 0; b < start.size(); ++b) start[b] = static_cast<int64_t>(b) * kTile * kTile;
  } else {
    std::vector<std::pair<int64_t, Item>> keyed;
    ForEachTexel(picture, first, layout, [&](const Item& t) {
      keyed.emplace_back(CellOf(cube, t.direction, kTile) / (kTile * kTile), t);
    });
    for (const auto& [key, item] : keyed) ++start[static_cast<size_t>(key) + 1];
    for (size_t b = 1; b < start.size(); ++b) start[b] += start[b - 1];
    items.resize(keyed.size());
    std::vector<int64_t> next(start);
    for (const auto& [key, item] : keyed) items[static_cast<size_t>(next[static_cast<size_t>(key)]++)] = item;
  }
  for (size_t b = 0; b + 1 < start.size(); ++b) {
    Block block = {{0, 0, 0}, 1, 0, {0, 0, 0}, static_cast<int64_t>(x.size()), 0};
    for (int64_t i = start[b]; i < start[b + 1]; ++i) {
      const Item& item = items[static_cast<size_t>(i)];
      if (!(item.weight > 0)) continue;
      for (int k = 0; k < 3; ++k) block.axis[k] += item.weight * item.direction[k];
    }
    Normalize(block.axis);
    double closest = -2;
    for (int64_t i = start[b]; i < start[b + 1]; ++i) {
      const Item& item = items[static_cast<size_t>(i)];
      if (!(item.weight > 0)) continue;
      const double cosine = Cosine(block.axis, item.direction);
      block.cos_radius = std::min(block.cos_radius, cosine);
      if (cosine > closest) closest = cosine, std::copy_n(item.direction, 3, block.nearest);
      x.push_back(item.direction[0]), y.push_back(item.direction[1]), z.push_back(item.direction[2]);
      weight.push_back(static_cast<float>(item.weight));
      for (int c = 0; c < 4; ++c) color[c].push_back(static_cast<float>(item.color[c]));
    }
    if (closest == -2) continue;
    // Padding points where the block does, without weight.
    while (x.size() % kLobeGroup != 0) {
      x.push_back(block.nearest[0]), y.push_back(block.nearest[1]), z.push_back(block.nearest[2]),
          weight.push_back(0);
      for (int c = 0; c < 4; ++c) color[c].push_back(0);
    }
    block.sin_radius = std::sqrt(std::max(0.0, 1 - block.cos_radius * block.cos_radius));
    block.count = static_cast<int64_t>(x.size()) - block.first;
    blocks.push_back(block);
  }
}

int LobeTableSize(double exponent) {
  return std::clamp(static_cast<int>(std::ceil(16 * std::sqrt(exponent))), 16, kLargestTable);
}

std::shared_ptr<const EnvironmentAtlas> MakeLobeTable(const ConstImageView& picture, int first,
                                                      const MapLayout& layout, double exponent, int size,
                                                      const graph::Workers& workers) {
  const int n = size > 0 ? size : LobeTableSize(exponent);
  if (layout.faces.empty()) return std::make_shared<const EnvironmentAtlas>(picture, first, layout, workers);
  const int cells = std::clamp(static_cast<int>(std::ceil(24 * std::sqrt(exponent))), 24, kMostCells);
  const LobeSamples samples(picture, first, layout, cells);
  const MapLayout cube = LayoutOf("environment", EnvironmentMap::kCube, 6 * n, n);
  const Image table = Image::Uninitialized(ImageSpec(6 * n, n, 4), workers.context());
  const LobeFunction lobe = ChooseLobe();
  workers.For(int64_t{6} * n, [&](int64_t line, int) {
    const int face = static_cast<int>(line / n), j = static_cast<int>(line % n);
    std::vector<double> d[3];
    for (int i = 0; i < n; ++i) {
      const Vector3 at = DirectionAt(cube, {face, i + 0.5, j + 0.5});
      for (size_t k = 0; k < 3; ++k) d[k].push_back(at[k]);
    }
    lobe(samples, exponent, true, d[0].data(), d[1].data(), d[2].data(), n,
         reinterpret_cast<float*>(table.view().At(face * n, j)));
  });
  return std::make_shared<const EnvironmentAtlas>(table.view(), 0, cube, workers);
}

}  // namespace tessera::ops
