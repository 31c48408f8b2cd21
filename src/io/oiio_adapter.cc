// OpenImageIO's in-memory images as ours and back, sharing the pixels.
#include "tessera/oiio_adapter.h"

#include <OpenImageIO/imagebuf.h>

#include <memory>
#include <string>

#include "io/spec.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera {

ConstImageView ViewOf(const OIIO::ImageBuf& buffer) {
  const std::string name = buffer.name().empty() ? "ImageBuf" : std::string(buffer.name());
  if (!buffer.initialized()) throw DataError(name, "found an ImageBuf without an image");
  if (buffer.deep()) throw DataError(name, "found deep pixels, expected flat ones");
  const OIIO::ImageSpec& spec = buffer.spec();
  if (spec.depth > 1) {
    throw DataError(name, "found a volume " + std::to_string(spec.depth) + " deep, expected a flat image");
  }
  const auto* pixels = static_cast<const std::byte*>(buffer.localpixels());
  if (!pixels)
    throw DataError(name, "found pixels in an image cache, expected local pixels (ImageBuf::make_writable)");
  const auto type = io::PixelTypeOf(buffer.pixeltype());
  if (!type) {
    throw DataError(name, "found pixels of type " + std::string(buffer.pixeltype().c_str()) +
                              ", expected uint8, uint16, half or float");
  }
  return {pixels,
          {spec.x, spec.y, spec.x + spec.width, spec.y + spec.height},
          spec.nchannels,
          *type,
          static_cast<ptrdiff_t>(PixelBytes(*type)),
          static_cast<ptrdiff_t>(buffer.pixel_stride()),
          static_cast<ptrdiff_t>(buffer.scanline_stride())};
}

Node FromImageBuf(const OIIO::ImageBuf& buffer) {
  const ConstImageView view = ViewOf(buffer);
  ImageSpec spec = io::SpecFrom(buffer.spec());
  spec.type = view.type;
  return FromView(view, spec);
}

std::shared_ptr<OIIO::ImageBuf> ToImageBuf(const Image& image) {
  const ImageView view = image.view();
  if (view.roi.empty())
    throw DataError("ToImageBuf", "found an image without pixels, expected at least 1 x 1");
  // The deleter holds the image, and with it the pixels.
  return {
      new OIIO::ImageBuf(io::SpecTo(image.spec(), view.type), view.data, view.pixel_stride, view.row_stride),
      [image](OIIO::ImageBuf* buffer) { delete buffer; }};
}

}  // namespace tessera
