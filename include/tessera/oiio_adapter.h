/// Images in OpenImageIO's hands. Not part of tessera.h, as it needs OpenImageIO's headers. @file
#ifndef TESSERA_OIIO_ADAPTER_H_
#define TESSERA_OIIO_ADAPTER_H_

#include <OpenImageIO/imagebuf.h>

#include <memory>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// A lazy image of the buffer's local pixels, without a copy: they must outlive the graph's use. Throws Error
/// where the ImageBuf is backed by an image cache, is deep, or has pixels of a type that is none of ours.
Node FromImageBuf(const OIIO::ImageBuf& buffer);
/// The image's pixels as OpenImageIO's, without a copy; they live as long as the returned pointer.
std::shared_ptr<OIIO::ImageBuf> ToImageBuf(const Image& image);
/// The buffer's local pixels as a view; Error as FromImageBuf.
ConstImageView ViewOf(const OIIO::ImageBuf& buffer);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OIIO_ADAPTER_H_
