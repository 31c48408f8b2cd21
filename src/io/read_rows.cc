// A few thousand rows or tiles per call.
#include "io/read_rows.h"

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

// Rows, or tiles of a row of them. Where OpenImageIO 2.4 inflates several strips or tiles of a TIFF file at
// once it overlooks those that it could not.
int64_t AtOnce(const OIIO::ImageInput& input) {
  const OIIO::ImageSpec& spec = input.spec();
  const bool overlooks = std::string_view(input.format_name()) == "tiff" &&
                         spec.get_string_attribute("compression") == "zip" &&
                         (spec.format == OIIO::TypeDesc::UINT8 || spec.format == OIIO::TypeDesc::UINT16);
  return overlooks ? 1 : 4096;
}

bool ReadScanlines(OIIO::ImageInput& input, int subimage, const Roi& rows, int z, const RowsOut& out) {
  const int64_t some = AtOnce(input);
  for (int64_t y = rows.y0; y < rows.y1; y += some) {
    const auto end = static_cast<int>(std::min<int64_t>(y + some, rows.y1));
    if (!input.read_scanlines(subimage, 0, static_cast<int>(y), end, z, out.first, out.last, out.type,
                              out.data + (y - rows.y0) * out.row, out.pixel, out.row) ||
        input.has_error())
      return false;
  }
  return true;
}

// Slices [z0, z1), a row of tiles at a time.
bool ReadTiles(OIIO::ImageInput& input, int subimage, const Roi& rows, int z0, int z1, ptrdiff_t plane,
               const RowsOut& out) {
  const int height = input.spec().tile_height;
  const int64_t width = AtOnce(input) * input.spec().tile_width;
  for (int64_t y = rows.y0; y < rows.y1; y += height) {
    for (int64_t x = rows.x0; x < rows.x1; x += width) {
      const auto left = static_cast<int>(x), right = static_cast<int>(std::min<int64_t>(x + width, rows.x1)),
                 top = static_cast<int>(y), bottom = static_cast<int>(std::min<int64_t>(y + height, rows.y1));
      std::byte* const to = out.data + (y - rows.y0) * out.row + (x - rows.x0) * out.pixel;
      if (!input.read_tiles(subimage, 0, left, right, top, bottom, z0, z1, out.first, out.last, out.type, to,
                            out.pixel, out.row, plane) ||
          input.has_error())
        return false;
    }
  }
  return true;
}

}  // namespace

bool ReadRows(OIIO::ImageInput& input, int subimage, const Roi& rows, const RowsOut& out) {
  const OIIO::ImageSpec& spec = input.spec();
  return spec.tile_height > 0 ? ReadTiles(input, subimage, rows, spec.z, spec.z + 1, OIIO::AutoStride, out)
                              : ReadScanlines(input, subimage, rows, spec.z, out);
}

void CheckStrips(const std::string& file, const OIIO::ImageSpec& spec) {
  constexpr double kMost = 1 << 30;
  const int rows = spec.get_int_attribute("tiff:RowsPerStrip", 0);
  if (rows > spec.height && rows * static_cast<double>(spec.scanline_bytes(true)) > kMost) {
    throw DataError(file, "found " + std::to_string(rows) + " rows a strip in an image of " +
                              std::to_string(spec.height) + ", expected strips of at most 1 GiB");
  }
}

bool ReadSlices(OIIO::ImageInput& input, int subimage, int z0, int z1, int first, int last,
                OIIO::TypeDesc type, std::byte* data) {
  const OIIO::ImageSpec spec = input.spec();
  const Roi rows{spec.x, spec.y, spec.x + spec.width, spec.y + spec.height};
  const auto pixel = static_cast<ptrdiff_t>(type.size()) * (last - first);
  const ptrdiff_t row = pixel * spec.width, plane = row * spec.height;
  const bool tiled = spec.tile_height > 0;
  const int slices = tiled ? std::max(spec.tile_depth, 1) : 1;
  for (int64_t z = z0; z < z1; z += slices) {
    const auto slice = static_cast<int>(spec.z + z),
               behind = static_cast<int>(spec.z + std::min<int64_t>(z + slices, z1));
    const RowsOut out{first, last, type, data + (z - z0) * plane, pixel, row};
    const bool read = tiled ? ReadTiles(input, subimage, rows, slice, behind, plane, out)
                            : ReadScanlines(input, subimage, rows, slice, out);
    if (!read) return false;
  }
  return true;
}

}  // namespace tessera::io
