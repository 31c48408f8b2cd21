// Steps that compute nothing: for every byte of a result's pixel the byte that it is a copy of, or a
// constant.
#include <algorithm>
#include <array>
#include <iterator>
#include <optional>

#include "graph/rules.h"

namespace tessera::graph {
namespace {

// A channel of the result: one of a load's pixels, or a constant.
struct Origin {
  BufferId from = -1;
  int channel = 0;
  float value = 0;
};

std::optional<Origin> OriginOf(const Points& points, PlaneId plane) {
  if (plane == kZeroPlane) return Origin{-1, 0, 0.0f};
  if (plane == kOnePlane) return Origin{-1, 0, 1.0f};
  for (const ConstantPlane& constant : points.constants) {
    if (constant.plane == plane) return Origin{-1, 0, constant.value};
  }
  for (const BlockOp& op : points.ops) {
    const auto& load = std::get<LoadOp>(op);
    for (size_t p = 0; p < 4; ++p) {
      if (load.channel[p] >= 0 && load.plane[p] == plane) return Origin{load.from, load.channel[p], 0};
    }
  }
  return std::nullopt;
}

// A constant as a sample of the type.
std::array<std::byte, 4> SampleOf(float value, PixelType type) {
  std::array<std::byte, 4> sample{};
  std::array<float, kGroupPixels> plane;
  plane.fill(value);
  simd::StoreArgs args;
  args.type = type;
  args.pixels = sample.data();
  args.pixel_stride = static_cast<ptrdiff_t>(PixelBytes(type));
  args.channel[0] = 0;
  args.count = 1;
  args.plane[0] = plane.data();
  simd::CurrentPixelFunctions().store(args);
  return sample;
}

// Whether some input has a channel that is not taken.
bool TakesParts(const Program& program, const ByteMoves& moves, size_t bytes) {
  for (size_t k = 0; k < moves.in.size(); ++k) {
    for (int c = 0; c < program.layout(moves.in[k]).channels; ++c) {
      const bool taken = std::any_of(
          std::begin(moves.moves.result), std::end(moves.moves.result), [&](const simd::Moves::Byte& b) {
            return b.input == static_cast<int>(k) && b.place / static_cast<int>(bytes) == c;
          });
      if (!taken) return true;
    }
  }
  return false;
}

}  // namespace

bool MoveBytes(Program& program, size_t step) {
  const auto* const points = std::get_if<Points>(&program.steps[step].how);
  const Layout& result = program.layout(program.steps[step].to);
  if (points == nullptr || !result.IsDense(result.type) ||
      std::any_of(points->ops.begin(), points->ops.end(),
                  [](const BlockOp& op) { return !std::holds_alternative<LoadOp>(op); })) {
    return false;
  }
  const size_t bytes = PixelBytes(result.type);
  ByteMoves found;
  found.same = true;
  for (size_t c = 0; c < points->result.size(); ++c) {
    const std::optional<Origin> origin = OriginOf(*points, points->result[c]);
    if (!origin) return false;
    std::array<std::byte, 4> constant{};
    int input = -1;
    if (origin->from < 0) {
      constant = SampleOf(origin->value, result.type);
      found.same = false;
    } else {
      const Layout& layout = program.layout(origin->from);
      if (!layout.IsDense(result.type)) return false;
      const auto it = std::find(found.in.begin(), found.in.end(), origin->from);
      input = static_cast<int>(it - found.in.begin());
      if (it == found.in.end()) found.in.push_back(origin->from);
      found.same = found.same && input == 0 && origin->channel == static_cast<int>(c) &&
                   layout.channels == result.channels;
    }
    for (size_t b = 0; b < bytes && c * bytes + b < simd::kMostMovedBytes; ++b) {
      found.moves.result[c * bytes + b] = {
          input, static_cast<int>(static_cast<size_t>(origin->channel) * bytes + b), constant[b]};
    }
  }
  if (found.in.empty()) return false;
  if (!found.same) {
    // Floats have nothing to convert: planes are as fast, but where parts of wider pixels are taken.
    if (result.pixel_stride > simd::kMostMovedBytes || found.in.size() > simd::kMostMovedInputs ||
        (result.type == PixelType::kFloat && !TakesParts(program, found, bytes))) {
      return false;
    }
    found.moves.result_bytes = static_cast<int>(result.pixel_stride);
    for (const BufferId from : found.in) {
      const ptrdiff_t pixel = program.layout(from).pixel_stride;
      if (pixel > simd::kMostMovedBytes) return false;
      found.moves.input_bytes[found.moves.inputs++] = static_cast<int>(pixel);
    }
  }
  program.steps[step].how = std::move(found);
  return true;
}

}  // namespace tessera::graph
