// Finds, for every byte of a result's pixels, the byte that it is a copy of.
#include "graph/run_moves.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <optional>
#include <vector>

namespace tessera::graph {
namespace {

// The inputs of a run, each once, and the byte of one of them, or a constant, for every byte of a pixel.
struct Found {
  std::vector<ConstImageView> inputs;
  simd::Moves moves;
  bool same = true;  // pixel by pixel what the one input has
};

// A constant as a sample of the type.
std::array<std::byte, 4> SampleOf(float value, PixelType type, const simd::PixelFunctions& pixels) {
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
  pixels.store(args);
  return sample;
}

std::optional<Found> Find(const PointRun& run, std::span<const SourceView> sources,
                          std::span<const ConstImageView> tiles, const ImageView& out,
                          const simd::PixelFunctions& pixels) {
  const size_t bytes = PixelBytes(out.type);
  if (run.moved.size() != static_cast<size_t>(out.channels) || !IsDense(out, out.type)) return std::nullopt;
  Found found;
  std::vector<const PlaneLoad*> loads;
  const auto input_of = [&](const PlaneLoad& load) {
    for (size_t k = 0; k < loads.size(); ++k) {
      if (loads[k]->from_tile == load.from_tile && loads[k]->index == load.index) return k;
    }
    loads.push_back(&load);
    const auto i = static_cast<size_t>(load.index);
    found.inputs.push_back(load.from_tile ? tiles[i] : sources[i].view);
    return loads.size() - 1;
  };
  for (size_t c = 0; c < run.moved.size(); ++c) {
    const MovedChannel& moved = run.moved[c];
    std::array<std::byte, 4> constant{};
    size_t input = 0, first = 0;
    if (moved.load < 0) {
      constant = SampleOf(moved.value, out.type, pixels);
      found.same = false;
    } else {
      const PlaneLoad& load = run.loads[static_cast<size_t>(moved.load)];
      input = input_of(load);
      const int held = load.from_tile ? 0 : sources[static_cast<size_t>(load.index)].first;
      const auto channel = static_cast<size_t>(moved.channel - held);
      if (!IsDense(found.inputs[input], out.type)) return std::nullopt;
      found.same = found.same && input == 0 && channel == c && found.inputs[0].channels == out.channels;
      first = channel * bytes;
    }
    for (size_t b = 0; b < bytes && c * bytes + b < simd::kMostMovedBytes; ++b) {
      simd::Moves::Byte& byte = found.moves.result[c * bytes + b];
      byte.input = moved.load < 0 ? -1 : static_cast<int>(input);
      byte.place = static_cast<int>(first + b);
      byte.constant = constant[b];
    }
  }
  if (found.same) return found;
  // Floats have nothing to convert: planes are as fast, but where parts of wider pixels are taken.
  const auto taken = [&](size_t input, int channel) {
    return std::any_of(
        std::begin(found.moves.result), std::end(found.moves.result), [&](const simd::Moves::Byte& b) {
          return b.input == static_cast<int>(input) && b.place / static_cast<int>(bytes) == channel;
        });
  };
  bool parts = false;
  for (size_t k = 0; k < found.inputs.size(); ++k) {
    for (int c = 0; c < found.inputs[k].channels; ++c) parts = parts || !taken(k, c);
  }
  if (out.type == PixelType::kFloat && !parts) return std::nullopt;
  if (out.pixel_stride > simd::kMostMovedBytes || found.inputs.size() > simd::kMostMovedInputs ||
      found.inputs.empty()) {
    return std::nullopt;
  }
  found.moves.result_bytes = static_cast<int>(out.pixel_stride);
  for (const ConstImageView& v : found.inputs) {
    if (v.pixel_stride > simd::kMostMovedBytes) return std::nullopt;
    found.moves.input_bytes[found.moves.inputs++] = static_cast<int>(v.pixel_stride);
  }
  return found;
}

}  // namespace

bool RunMoves(const PointRun& run, std::span<const SourceView> sources, std::span<const ConstImageView> tiles,
              const ImageView& out, bool stream, const simd::PixelFunctions& pixels) {
  if (run.moved.empty()) return false;
  const std::optional<Found> found = Find(run, sources, tiles, out, pixels);
  if (!found) return false;
  const int width = out.roi.width();
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    std::byte* const to = out.At(out.roi.x0, y);
    const std::byte* from[simd::kMostMovedInputs] = {};
    for (size_t k = 0; k < found->inputs.size() && k < simd::kMostMovedInputs; ++k) {
      from[k] = found->inputs[k].At(out.roi.x0, y);
    }
    if (!found->same) {
      simd::MovePixels(found->moves, from, width, to, stream);
    } else if (from[0] != to) {  // else in place
      simd::CopyBytes(from[0], static_cast<size_t>(width) * static_cast<size_t>(out.pixel_stride), to,
                      stream);
    }
  }
  return true;
}

}  // namespace tessera::graph
