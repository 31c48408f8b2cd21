// Bounds of blocks of cells, and the exact Euclidean distance between blocks that rays leap by.
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/arena.h"
#include "base/half.h"
#include "model/distance_transform.h"
#include "model/volume_data.h"

namespace tessera::model {
namespace {

constexpr int kSmallSide = 320;  // volumes up to here have blocks of 4 cells, larger ones of 8
constexpr size_t kMostGrids = 8;

struct HalfBits {
  uint16_t bits;
};
float AsFloat(uint8_t v) { return v; }
float AsFloat(uint16_t v) { return v; }
float AsFloat(HalfBits v) { return base::FloatFromHalf(v.bits); }
float AsFloat(float v) { return v; }

// Bounds over a row of blocks: columns first, then each block's share of the columns.
struct Columns {
  std::vector<float> low, high, square;  // square: of the largest gradient in cells
  std::vector<float> rows[4];            // the voxels at the corners of a row of cells

  explicit Columns(size_t n) : low(n), high(n), square(n) {
    for (auto& r : rows) r.resize(n + 1);
  }
};

// The gradient of trilinear interpolation is, along each axis, between the differences along the cell's four
// edges.
void AddSlopes(int count, Columns& c) {
  const float *a = c.rows[0].data(), *b = c.rows[1].data(), *d = c.rows[2].data(), *e = c.rows[3].data();
  float* const square = c.square.data();
  const auto most = [](float p, float q) { return p > q ? p : q; };
  for (int i = 0; i < count; ++i) {
    const float x = most(most(std::fabs(a[i + 1] - a[i]), std::fabs(b[i + 1] - b[i])),
                         most(std::fabs(d[i + 1] - d[i]), std::fabs(e[i + 1] - e[i])));
    const float y = most(most(std::fabs(b[i] - a[i]), std::fabs(b[i + 1] - a[i + 1])),
                         most(std::fabs(e[i] - d[i]), std::fabs(e[i + 1] - d[i + 1])));
    const float z = most(most(std::fabs(d[i] - a[i]), std::fabs(d[i + 1] - a[i + 1])),
                         most(std::fabs(e[i] - b[i]), std::fabs(e[i + 1] - b[i + 1])));
    square[i] = most(square[i], x * x + y * y + z * z);
  }
}

template <typename T>
void AddRows(const VolumeData& v, int j0, int k0, int edge, Columns& c) {
  std::fill(c.low.begin(), c.low.end(), std::numeric_limits<float>::infinity());
  std::fill(c.high.begin(), c.high.end(), -std::numeric_limits<float>::infinity());
  std::fill(c.square.begin(), c.square.end(), 0.0f);
  const int count = v.spec.size[0] + 1;
  std::vector<T> copied(v.pages == nullptr ? 0 : static_cast<size_t>(count) + 1);
  const auto load = [&](int j, int k, std::vector<float>& to) {
    const T* row = reinterpret_cast<const T*>(v.samples) + v.IndexOf(0, j, k);
    if (v.pages != nullptr) {
      v.CopyRow(0, count + 1, j, k, reinterpret_cast<std::byte*>(copied.data()));
      row = copied.data();
    }
    for (int i = 0; i <= count; ++i) to[i] = AsFloat(row[i]);
  };
  const int j1 = std::min(j0 + edge, v.spec.size[1]), k1 = std::min(k0 + edge, v.spec.size[2]);
  for (int k = k0; k <= k1; ++k) {
    load(j0, k, c.rows[1]);
    load(j0, k + 1, c.rows[3]);
    for (int j = j0; j <= j1; ++j) {
      std::swap(c.rows[0], c.rows[1]);
      std::swap(c.rows[2], c.rows[3]);
      const float* const row = c.rows[0].data();
      for (int i = 0; i < count; ++i) {
        c.low[i] = std::min(c.low[i], row[i]);
        c.high[i] = std::max(c.high[i], row[i]);
      }
      load(j + 1, k, c.rows[1]);
      load(j + 1, k + 1, c.rows[3]);
      if (j < j1 && k < k1) AddSlopes(count - 1, c);
    }
  }
}

constexpr float kPaceSteps = 64;  // resolution of the pace of an ordinary slope

// The largest value in the 3x3x3 blocks around each.
std::vector<float> WidestAround(std::vector<float> v, const std::array<int, 3>& size) {
  const std::array<int64_t, 3> stride = {1, size[0], int64_t{size[0]} * size[1]};
  for (size_t a = 0; a < 3; ++a) {
    std::vector<float> w = v;
    int64_t at = 0;
    for (int k = 0; k < size[2]; ++k) {
      for (int j = 0; j < size[1]; ++j) {
        for (int i = 0; i < size[0]; ++i, ++at) {
          const int place = a == 0 ? i : a == 1 ? j : k;
          if (place > 0) w[at] = std::max(w[at], v[at - stride[a]]);
          if (place + 1 < size[a]) w[at] = std::max(w[at], v[at + stride[a]]);
        }
      }
    }
    v = std::move(w);
  }
  return v;
}

// Marks the blocks from which a displacement may lead into a marked one.
void Widen(const Displacement& reach, int shift, const std::array<int, 3>& size,
           std::vector<uint8_t>& marked) {
  const std::array<int64_t, 3> stride = {1, size[0], int64_t{size[0]} * size[1]};
  const double edge = 1 << shift;
  for (size_t a = 0; a < 3; ++a) {
    const auto blocks = [&](double v) {
      return static_cast<int>(std::clamp(v, -1.0 * size[a], 1.0 * size[a]));
    };
    const int from = blocks(std::floor(reach.low[a] / edge)),
              to = blocks(std::ceil((edge + reach.high[a]) / edge) - 1);
    if (from == 0 && to == 0) continue;
    std::vector<uint8_t> wide(marked.size());
    int64_t at = 0;
    for (int k = 0; k < size[2]; ++k) {
      for (int j = 0; j < size[1]; ++j) {
        for (int i = 0; i < size[0]; ++i, ++at) {
          const int place = a == 0 ? i : a == 1 ? j : k;
          // Beyond the volume the outermost samples are read.
          const int first = std::clamp(place + from, 0, size[a] - 1),
                    last = std::clamp(place + to, 0, size[a] - 1);
          for (int n = first; n <= last && wide[at] == 0; ++n)
            wide[at] = marked[at + (n - place) * stride[a]];
        }
      }
    }
    marked = std::move(wide);
  }
}

}  // namespace

const VolumeData::Blocks& VolumeData::BlocksOf(const ForEach& for_each) const {
  const std::lock_guard lock(mutex_);
  if (blocks_ != nullptr) return *blocks_;
  auto made = std::make_unique<Blocks>();
  Blocks& b = *made;
  b.shift = *std::max_element(spec.size.begin(), spec.size.end()) <= kSmallSide ? 2 : 3;
  const int edge = 1 << b.shift;
  // Cells: one less than voxels, and the one beyond the last voxel, where positions are clamped to.
  for (size_t a = 0; a < 3; ++a) b.size[a] = (spec.size[a] + edge - 1) >> b.shift;
  const size_t count = static_cast<size_t>(b.size[0]) * b.size[1] * b.size[2];
  b.low.resize(count);
  b.high.resize(count);
  b.slope.resize(count);
  for_each(int64_t{b.size[1]} * b.size[2], [&](int64_t n) {
    const int bj = static_cast<int>(n % b.size[1]), bk = static_cast<int>(n / b.size[1]);
    Columns c(static_cast<size_t>(spec.size[0]) + 1);
    const int j0 = bj << b.shift, k0 = bk << b.shift;
    switch (spec.type) {
      case PixelType::kUint8:
        AddRows<uint8_t>(*this, j0, k0, edge, c);
        break;
      case PixelType::kUint16:
        AddRows<uint16_t>(*this, j0, k0, edge, c);
        break;
      case PixelType::kHalf:
        AddRows<HalfBits>(*this, j0, k0, edge, c);
        break;
      default:
        AddRows<float>(*this, j0, k0, edge, c);
    }
    for (int bi = 0; bi < b.size[0]; ++bi) {
      const size_t at = (static_cast<size_t>(bk) * b.size[1] + bj) * b.size[0] + bi;
      const int i0 = bi << b.shift, i1 = std::min(i0 + edge, spec.size[0]);
      b.low[at] = *std::min_element(c.low.begin() + i0, c.low.begin() + i1 + 1);
      b.high[at] = *std::max_element(c.high.begin() + i0, c.high.begin() + i1 + 1);
      b.slope[at] = std::sqrt(*std::max_element(c.square.begin() + i0, c.square.begin() + i1));
    }
    Trim();
  });
  blocks_ = std::move(made);
  return *blocks_;
}

std::array<float, 2> VolumeData::CodeRange(const ForEach& for_each) const {
  const Blocks& b = BlocksOf(for_each);
  return {*std::min_element(b.low.begin(), b.low.end()), *std::max_element(b.high.begin(), b.high.end())};
}

std::shared_ptr<const LeapGrid> VolumeData::Leaps(double low, double high, const ForEach& for_each,
                                                  const Displacement& reach) const {
  const Blocks& b = BlocksOf(for_each);
  const std::lock_guard lock(mutex_);
  for (const Cached& c : grids_) {
    if (c.low == low && c.high == high && c.reach == reach) return c.grid;
  }
  auto grid = std::make_shared<LeapGrid>();
  grid->size = b.size;
  grid->shift = b.shift;
  const size_t count = b.low.size();
  std::vector<uint8_t> matters(count + 1);
  for (size_t i = 0; i < count; ++i) {
    matters[i] = b.low[i] <= high && b.high[i] >= low;
    grid->any |= matters[i] != 0;
  }
  Widen(reach, b.shift, b.size, matters);
  const int nx = b.size[0], ny = b.size[1], nz = b.size[2];
  // Beside blocks that matter: their own box of 3x3x3. The distance of centres to these is that between
  // boxes.
  std::vector<uint8_t> beside = matters;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        if (!matters[(static_cast<size_t>(k) * ny + j) * nx + i]) continue;
        for (int w = std::max(k - 1, 0); w <= std::min(k + 1, nz - 1); ++w) {
          for (int v = std::max(j - 1, 0); v <= std::min(j + 1, ny - 1); ++v) {
            for (int u = std::max(i - 1, 0); u <= std::min(i + 1, nx - 1); ++u) {
              beside[(static_cast<size_t>(w) * ny + v) * nx + u] = 1;
            }
          }
        }
      }
    }
  }
  const std::shared_ptr<std::byte> memory =
      base::AllocateAligned((count + 32) * sizeof(uint16_t), base::Access::kScattered);
  grid->leap = {memory, reinterpret_cast<uint16_t*>(memory.get())};
  std::fill_n(grid->leap.get(), count + 32, uint16_t{255});
  if (grid->any) {
    const std::vector<float> slope = WidestAround(b.slope, b.size);
    float steepest = 0;
    for (size_t i = 0; i < count; ++i) steepest = std::max(steepest, matters[i] ? slope[i] : 0);
    const float unit = std::max(steepest, 1e-30f) / (2 * kPaceSteps);
    grid->pace = 1 / (unit * kPaceSteps * kPaceSteps);
    const float most = *std::max_element(slope.begin(), slope.end());
    grid->least_pace = most < 1e30f ? 1 / (1.0001f * std::max(most, 1e-30f)) : 0;
    const std::vector<float> squared = SquaredDistances({nx, ny, nz}, beside);
    for (size_t i = 0; i < count; ++i) {
      const double voxels = std::floor(std::sqrt(static_cast<double>(squared[i])) * (1 << b.shift));
      const int leap = matters[i] ? 0 : static_cast<int>(std::min(255.0, 1 + voxels));
      const float pace = std::floor(kPaceSteps * kPaceSteps * unit / std::max(slope[i], 1e-30f));
      grid->leap[i] = static_cast<uint16_t>(leap | static_cast<int>(std::min(pace, 255.0f)) << 8);
    }
  }
  if (grids_.size() == kMostGrids) grids_.erase(grids_.begin());
  grids_.push_back({low, high, reach, grid});
  return grid;
}

size_t VolumeData::extra_bytes() const {
  const std::lock_guard lock(mutex_);
  size_t bytes = 0;
  if (blocks_ != nullptr) {
    bytes += blocks_->low.size() * (3 * sizeof(float) + grids_.size() * sizeof(uint16_t));
  }
  return bytes;
}

}  // namespace tessera::model
