// How the samples of a raw frame lie: pixel formats, by the names that FFmpeg has for them.
#ifndef TESSERA_IO_VIDEO_PIXEL_FORMAT_H_
#define TESSERA_IO_VIDEO_PIXEL_FORMAT_H_

#include <cstddef>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"

TESSERA_API_BEGIN
namespace tessera::io {

// What the samples are.
enum class Samples : uint8_t { kRgb, kGrey, kYcc };

// Samples of less than 16 bits in two bytes are those of the lower end, and all are of the little end first.
struct PixelFormat {
  std::string name;  // yuv420p10le
  Samples samples = Samples::kRgb;
  std::string order;  // R, G, B, A, Y, and b and r for Cb and Cr, as they are stored: BGRA, Ybr
  PixelType type = PixelType::kUint8;
  int bits = 8;                                  // that count
  bool planar = false;                           // each channel apart
  bool half_width = false, half_height = false;  // of the chroma

  bool IsFloat() const { return type == PixelType::kHalf || type == PixelType::kFloat; }
  bool HasAlpha() const { return order.find('A') != std::string::npos; }
  bool IsSubsampled() const { return half_width || half_height; }
  // The largest code that is stored.
  int Top() const { return (1 << bits) - 1; }
};

// All of them.
const std::vector<PixelFormat>& PixelFormats();
// Null where there is none of that name.
const PixelFormat* FindPixelFormat(const std::string& name);

// The size of a plane of chroma; that of a frame in bytes.
int ChromaWidth(const PixelFormat& format, int width);
int ChromaHeight(const PixelFormat& format, int height);
size_t FrameBytes(const PixelFormat& format, int width, int height);

// The names of the channels as they are stored, for ImageSpec::channels.
std::vector<std::string> ChannelNames(const PixelFormat& format);
// The samples of a frame as an image, of a format that is not subsampled.
ImageView FrameView(const PixelFormat& format, int width, int height, std::byte* bytes);

}  // namespace tessera::io
TESSERA_API_END

#endif  // TESSERA_IO_VIDEO_PIXEL_FORMAT_H_
