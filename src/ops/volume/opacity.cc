// Opacity volumes: their memory, and who fills them.
#include <array>
#include <cstring>

#include "base/arena.h"
#include "ops/volume/prepare.h"

namespace tessera::ops::volume {
namespace {

constexpr int kBehind = 1;  // repeated nodes: what a look-up at the last one reads

// One light's, in memory of its own.
OpacityView OpacityOf(const MediumArgs& plain, const VolumeDraw& draw, const graph::Workers& workers,
                      Prepared& out) {
  OpacityView o;
  const std::array<int, 3>& size = draw.nodes;
  for (size_t a = 0; a < 3; ++a) {
    o.size[a] = size[a];
    o.last[a] = static_cast<float>(size[a] - 1);
    o.times[a] = o.last[a] / (plain.rays.high[a] - plain.rays.low[a]);
    o.plus[a] = -plain.rays.low[a] * o.times[a];
  }
  o.row = size[0] + kBehind;
  o.slice = o.row * (size[1] + kBehind);
  const size_t bytes = static_cast<size_t>(o.slice) * static_cast<size_t>(size[2] + kBehind) * sizeof(float);
  out.opacity.push_back(base::AllocateAligned(workers.context(), bytes, base::Access::kScattered));
  auto* const nodes = reinterpret_cast<float*>(out.opacity.back().get());
  const FillOpacity fill = FindOpacity(draw.volume.spec().type);
  workers.For(int64_t{size[1]} * size[2], [&](int64_t row, int) {
    float* const to = nodes + row / size[1] * o.slice + row % size[1] * o.row;
    fill(plain, o, row, to);
    to[size[0]] = to[size[0] - 1];
  });
  const size_t line = static_cast<size_t>(o.row) * sizeof(float);
  for (int z = 0; z < size[2]; ++z) {
    float* const last = nodes + ptrdiff_t{z} * o.slice + ptrdiff_t{size[1] - 1} * o.row;
    std::memcpy(last + o.row, last, line);
  }
  float* const end = nodes + ptrdiff_t{size[2]} * o.slice;
  std::memcpy(end, end - o.slice, static_cast<size_t>(o.slice) * sizeof(float));
  o.nodes = nodes;
  return o;
}

}  // namespace

void PrepareOpacity(const VolumeDraw& draw, const graph::Workers& workers, Prepared& out) {
  MediumArgs& m = out.medium;
  m.shadow = static_cast<float>(draw.params.scatter.shadow);
  // The march to the light sees extinctions alone.
  MediumArgs plain = m;
  plain.look = Look::kPlain;
  plain.method = VolumeMethod::kRays;
  plain.step = static_cast<float>(draw.params.scatter.step);
  plain.emission = {};
  plain.towards = m.light;
  m.opacity = OpacityOf(plain, draw, workers, out);
  for (FurtherLight& further : m.further) {
    plain.towards = further.light;
    further.opacity = OpacityOf(plain, draw, workers, out);
  }
}

}  // namespace tessera::ops::volume
