// Where the samples of volumes lie: in memory as they are, or in bricks that the system pages.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/arena.h"
#include "base/half.h"
#include "model/brick_places.h"
#include "model/volume_data.h"

namespace tessera::model {
namespace {

// Where nobody said how much memory a volume may take that is too large for the indices of one in memory.
constexpr size_t kUnstated = size_t{1} << 30;

// NaN of halves and floats set to 0; how many there were.
int64_t DropNan(PixelType type, int count, std::byte* row) {
  int64_t dropped = 0;
  for (int i = 0; i < count; ++i) {
    if (type == PixelType::kHalf) {
      uint16_t v;
      std::memcpy(&v, row + 2 * static_cast<ptrdiff_t>(i), 2);
      if ((v & 0x7FFF) <= 0x7C00) continue;
    } else {
      float v;
      std::memcpy(&v, row + 4 * static_cast<ptrdiff_t>(i), 4);
      if (v == v) continue;
    }
    std::memset(row + i * static_cast<ptrdiff_t>(PixelBytes(type)), 0, PixelBytes(type));
    ++dropped;
  }
  return dropped;
}

}  // namespace

void VolumeData::Allocate() {
  const size_t pixel = PixelBytes(spec.type);
  double count = 1;  // may be beyond 2^64
  for (const int n : spec.size) count *= static_cast<double>(n) + kVolumeBorder;
  const bool large = count > std::numeric_limits<int32_t>::max();
  if (!large &&
      (spec.memory == 0 || count * static_cast<double>(pixel) <= static_cast<double>(spec.memory))) {
    row = spec.size[0] + kVolumeBorder;
    slice = row * (spec.size[1] + kVolumeBorder);
    const size_t bytes = static_cast<size_t>(count) * pixel + 64;
    memory = base::AllocateAligned(bytes);
    std::memset(memory.get(), 0, bytes);
    samples = memory.get() + static_cast<size_t>(kVolumeBefore * (slice + row + 1)) * pixel;
    return;
  }
  row = kBrickRow;
  slice = kBrickSlice;
  std::array<int64_t, 3> along;
  for (size_t a = 0; a < 3; ++a) along[a] = BrickOf(spec.size[a] - 1) + 1;
  bricks = {along[0], along[0] * along[1]};
  const size_t bytes = static_cast<size_t>(bricks[1] * along[2] * kBrickSamples) * pixel;
  pages = std::make_unique<base::PagedMemory>(bytes, spec.memory == 0 ? kUnstated : spec.memory);
  samples = pages->data() + static_cast<size_t>(kVolumeBefore * (slice + row + 1)) * pixel;
}

int64_t VolumeData::IndexOf(int i, int j, int k) const {
  if (pages == nullptr) return k * slice + j * row + i;
  const auto brick = [&](int v, size_t a) { return BrickOf(std::clamp(v, 0, spec.size[a] - 1)); };
  const int bi = brick(i, 0), bj = brick(j, 1), bk = brick(k, 2);
  return (bk * bricks[1] + bj * bricks[0] + bi) * kBrickSamples + (k - bk * kBrickEdge) * slice +
         (j - bj * kBrickEdge) * row + i - bi * kBrickEdge;
}

void VolumeData::SetRow(int j, int k, const std::byte* from) {
  const size_t pixel = PixelBytes(spec.type);
  const auto step = static_cast<ptrdiff_t>(pixel);
  const int n = spec.size[0];
  const bool codes = spec.type == PixelType::kUint8 || spec.type == PixelType::kUint16;
  if (pages == nullptr) {
    std::byte* const to = samples + IndexOf(0, j, k) * step;
    std::memcpy(to, from, static_cast<size_t>(n) * pixel);
    if (!codes) nan_samples += DropNan(spec.type, n, to);
    return;
  }
  std::vector<std::byte> line((static_cast<size_t>(n) + kVolumeBorder) * pixel);
  std::byte* const first = line.data() + kVolumeBefore * step;
  std::memcpy(first, from, static_cast<size_t>(n) * pixel);
  if (!codes) nan_samples += DropNan(spec.type, n, first);
  for (int i = -kVolumeBefore; i < 0; ++i) std::memcpy(first + i * step, first, pixel);
  for (int i = n; i < n + kVolumeBehind; ++i) std::memcpy(first + i * step, first + (n - 1) * step, pixel);
  const BrickPlaces down(j, spec.size[1]), deep(k, spec.size[2]);
  for (const BrickPlace& z : deep) {
    for (const BrickPlace& y : down) {
      std::byte* to = samples + ((z.brick * bricks[1] + y.brick * bricks[0]) * kBrickSamples +
                                 z.local * slice + y.local * row - kVolumeBefore) *
                                    step;
      for (int i = 0; i < n; i += kBrickEdge, to += kBrickSamples * step) {
        const int count = std::min(kBrickRow, n + kVolumeBorder - i);
        std::memcpy(to, line.data() + i * step, static_cast<size_t>(count) * pixel);
      }
    }
  }
  if ((j & (kBrickEdge - 1)) == 0) Trim();
}

void VolumeData::CopyRow(int i0, int i1, int j, int k, std::byte* to) const {
  const size_t pixel = PixelBytes(spec.type);
  while (i0 < i1) {
    // The last of a brick's own voxels; the last brick has the border too.
    const int own = std::clamp(i0, 0, spec.size[0] - 1) | (kBrickEdge - 1);
    const int end = pages == nullptr || own >= spec.size[0] - 1 ? i1 : std::min(i1, own + 1);
    const size_t bytes = static_cast<size_t>(end - i0) * pixel;
    std::memcpy(to, samples + IndexOf(i0, j, k) * static_cast<int64_t>(pixel), bytes);
    to += bytes;
    i0 = end;
  }
}

}  // namespace tessera::model
