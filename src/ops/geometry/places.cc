// Copies of pixels to other places: rows as they are or backwards, and turned in blocks that stay in L1.
#include "ops/geometry/places.h"

#include <algorithm>
#include <climits>
#include <cstring>
#include <string>

#include "ops/geometry/separable.h"
#include "tessera/error_kind.h"

namespace tessera::ops {
namespace {

// Bytes of a pixel: known when compiled, or not.
template <size_t kBytes>
struct Known {
  explicit Known(size_t) {}
  static constexpr size_t value() { return kBytes; }
};
struct Unknown {
  size_t bytes;
  size_t value() const { return bytes; }
};

// What a tile is copied by.
struct Copy {
  ConstImageView in;
  ImageView out;
  const Places& places;
  base::Arena& scratch;

  const std::byte* Source(int64_t x, int64_t y) const {
    return in.At(static_cast<int>(x), static_cast<int>(y));
  }
};

template <typename Size>
void CopyRows(const Copy& copy, Size size) {
  const Roi& roi = copy.out.roi;
  const size_t bytes = size.value();
  const auto count = static_cast<size_t>(roi.width());
  for (int y = roi.y0; y < roi.y1; ++y) {
    const std::byte* from = copy.Source(copy.places.x.At(roi.x0), copy.places.y.At(y));
    std::byte* const to = copy.out.At(roi.x0, y);
    if (!copy.places.x.backwards) {
      std::memcpy(to, from, bytes * count);
      continue;
    }
    for (size_t i = 0; i < count; ++i, from -= bytes) std::memcpy(to + bytes * i, from, bytes);
  }
}

// A block is turned into scratch memory, which has no two rows in one place of the cache, and goes from there
// to the result in whole rows: each side of it is read or written in runs, whatever the strides are.
template <typename Size>
void CopyTurned(const Copy& copy, Size size) {
  const Roi& roi = copy.out.roi;
  const size_t bytes = size.value();
  const int side = bytes <= 4 ? 64 : bytes <= 8 ? 32 : 16;
  const size_t stride = bytes * static_cast<size_t>(side);
  auto* const block = copy.scratch.Allocate<std::byte>(stride * static_cast<size_t>(side));
  const Places& p = copy.places;
  for (int y = roi.y0; y < roi.y1; y += side) {
    const int height = std::min(side, roi.y1 - y);
    const ptrdiff_t step = p.x.backwards ? -static_cast<ptrdiff_t>(bytes) : static_cast<ptrdiff_t>(bytes);
    for (int x = roi.x0; x < roi.x1; x += side) {
      const int width = std::min(side, roi.x1 - x);
      for (int i = 0; i < width; ++i) {  // a row of the image is a column of the result
        const std::byte* from = copy.Source(p.x.At(y), p.y.At(x + i));
        std::byte* to = block + bytes * static_cast<size_t>(i);
        for (int j = 0; j < height; ++j, from += step, to += stride) std::memcpy(to, from, bytes);
      }
      for (int j = 0; j < height; ++j) {
        std::memcpy(copy.out.At(x, y + j), block + stride * static_cast<size_t>(j),
                    bytes * static_cast<size_t>(width));
      }
    }
  }
}

template <typename Size>
void CopyBy(const Copy& copy, Size size) {
  copy.places.turn ? CopyTurned(copy, size) : CopyRows(copy, size);
}

class PlacesStage final : public graph::TileStage {
 public:
  explicit PlacesStage(const Places& places) : places_(places) {}
  Roi InputRoi(int, const Roi& out) const override { return SourceOfPlaces(places_, out); }
  Wrap InputBorder(int) const override { return Wrap::kRepeat; }
  // Runs of some hundred bytes on both sides where it turns, whole rows elsewhere.
  graph::TileSize Preferred() const override {
    return places_.turn ? graph::TileSize{128, 128} : graph::TileSize{4096, 32};
  }
  bool Accepts(PixelType) const override { return true; }
  void Run(const graph::TileArgs& args) const override {
    const ConstImageView in = args.out.type == PixelType::kFloat ? InputChannels(args, 0) : args.in[0];
    const Copy copy{in, args.out, places_, args.scratch};
    const auto bytes = static_cast<size_t>(args.out.pixel_stride);
    switch (bytes) {
      case 1:
        return CopyBy(copy, Known<1>(bytes));
      case 2:
        return CopyBy(copy, Known<2>(bytes));
      case 3:
        return CopyBy(copy, Known<3>(bytes));
      case 4:
        return CopyBy(copy, Known<4>(bytes));
      case 6:
        return CopyBy(copy, Known<6>(bytes));
      case 8:
        return CopyBy(copy, Known<8>(bytes));
      case 12:
        return CopyBy(copy, Known<12>(bytes));
      case 16:
        return CopyBy(copy, Known<16>(bytes));
      default:
        return CopyBy(copy, Unknown{bytes});
    }
  }

 private:
  Places places_;
};

// The half-open range of an axis that [i0, i1) comes from; the same formula takes it back.
struct Range {
  int64_t begin, end;
};
Range Across(const Places::Axis& axis, int64_t i0, int64_t i1) {
  return axis.backwards ? Range{axis.At(i1 - 1), axis.At(i0) + 1} : Range{axis.At(i0), axis.At(i1 - 1) + 1};
}

}  // namespace

Roi SourceOfPlaces(const Places& p, const Roi& out) {
  if (out.empty()) return {};
  const Range columns{out.x0, out.x1}, rows{out.y0, out.y1};
  const Range& along = p.turn ? rows : columns;
  const Range& down = p.turn ? columns : rows;
  const auto [x0, x1] = Across(p.x, along.begin, along.end);
  const auto [y0, y1] = Across(p.y, down.begin, down.end);
  return {static_cast<int>(x0), static_cast<int>(y0), static_cast<int>(x1), static_cast<int>(y1)};
}

Roi ResultOfPlaces(const Places& p, const Roi& in, const char* what) {
  if (in.empty()) return {};
  const auto back = [](const Places::Axis& axis) {  // forwards i = at - origin, backwards i = origin - at
    return Places::Axis{axis.backwards, axis.backwards ? axis.origin : -axis.origin};
  };
  const Range from_x = Across(back(p.x), in.x0, in.x1), from_y = Across(back(p.y), in.y0, in.y1);
  const Range &columns = p.turn ? from_y : from_x, &rows = p.turn ? from_x : from_y;
  for (const int64_t v : {columns.begin, columns.end, rows.begin, rows.end}) {
    if (v <= INT_MIN || v >= INT_MAX)
      throw DataError(what, "found windows that lead beyond 2^31, expected a result between -2^31 and 2^31");
  }
  return {static_cast<int>(columns.begin), static_cast<int>(rows.begin), static_cast<int>(columns.end),
          static_cast<int>(rows.end)};
}

std::unique_ptr<graph::TileStage> MakePlacesStage(const Places& places) {
  return std::make_unique<PlacesStage>(places);
}

}  // namespace tessera::ops
