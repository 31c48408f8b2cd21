/// Pixels in memory: what an image is (ImageSpec), somebody's pixels (ImageView), owned pixels (Image). @file
#ifndef TESSERA_IMAGE_H_
#define TESSERA_IMAGE_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/roi.h"

TESSERA_API_BEGIN
namespace tessera {

class Context;

/// How a sample is stored. Integers are unsigned normalised: code / (2^bits - 1). kHalf is IEEE binary16.
enum class PixelType : uint8_t { kUint8, kUint16, kHalf, kFloat };

/// Bytes of a sample.
constexpr size_t PixelBytes(PixelType t) {
  return t == PixelType::kUint8 ? 1 : t == PixelType::kFloat ? 4 : 2;
}
/// "uint8", "uint16", "half", "float".
constexpr const char* PixelTypeName(PixelType t) {
  constexpr const char* kNames[] = {"uint8", "uint16", "half", "float"};
  return kNames[static_cast<int>(t)];
}

/// One metadata item, kept bit for bit. `type` is an OpenImageIO type name ("float", "int[2]", "matrix",
/// "string"); `bytes` holds the value; strings are held in `strings` instead.
struct Attribute {
  std::string name;                  ///< as in the file
  std::string type;                  ///< OpenImageIO's name
  std::vector<std::byte> bytes;      ///< the value
  std::vector<std::string> strings;  ///< the value of strings
};

/// What an image is, without its pixels. Value type; cheap to copy (metadata is shared).
struct ImageSpec {
  Roi data_window;                     ///< the pixels that exist
  Roi display_window;                  ///< the frame that is shown; equal to the data window when default
  std::vector<std::string> channels;   ///< names in storage order; its size is the channel count
  int alpha = -1;                      ///< index of the alpha channel, -1 for none
  PixelType type = PixelType::kFloat;  ///< storage type of a source, suggested type of a result
  std::shared_ptr<const std::vector<Attribute>> metadata;  ///< may be null

  ImageSpec() = default;
  /// A width x height image at the origin with `channel_count` channels named R,G,B,A then channel4, ...
  /// (Y for one channel; Y,A for two). Throws Error when a size is negative or the channel count is below 1.
  ImageSpec(int width, int height, int channel_count, PixelType type = PixelType::kFloat);

  /// Number of channels.
  int channel_count() const { return static_cast<int>(channels.size()); }
  /// Of the data window.
  int width() const { return data_window.width(); }
  /// Of the data window.
  int height() const { return data_window.height(); }
  /// Index of the channel of that name, -1 when absent.
  int ChannelIndex(const std::string& name) const;
};

/// The default channel names for a count, and the alpha index they imply.
std::vector<std::string> DefaultChannelNames(int count);

/// Somebody's pixels, writable (std::byte) or not (const std::byte): any type, any byte strides (interleaved,
/// planar, sub-rectangle, flipped through a negative row stride). Owns nothing; the pixels must outlive it.
template <typename Byte>
struct BasicImageView {
  Byte* data = nullptr;                ///< first channel of pixel (roi.x0, roi.y0)
  Roi roi;                             ///< image coordinates covered
  int channels = 0;                    ///< number of channels
  PixelType type = PixelType::kFloat;  ///< of the samples
  ptrdiff_t channel_stride = 0;        ///< bytes from channel to channel
  ptrdiff_t pixel_stride = 0;          ///< bytes from pixel to pixel
  ptrdiff_t row_stride = 0;            ///< bytes from row to row; may be negative

  BasicImageView() = default;
  /// Any strides, in bytes.
  BasicImageView(Byte* d, const Roi& r, int nchannels, PixelType t, ptrdiff_t cs, ptrdiff_t ps, ptrdiff_t rs)
      : data(d), roi(r), channels(nchannels), type(t), channel_stride(cs), pixel_stride(ps), row_stride(rs) {}
  /// Interleaved and contiguous.
  BasicImageView(Byte* d, const Roi& r, int nchannels, PixelType t)
      : BasicImageView(d, r, nchannels, t, static_cast<ptrdiff_t>(PixelBytes(t)),
                       static_cast<ptrdiff_t>(PixelBytes(t)) * nchannels,
                       static_cast<ptrdiff_t>(PixelBytes(t)) * nchannels * r.width()) {}
  /// A writable view is a readable one.
  operator BasicImageView<const std::byte>() const {
    return {data, roi, channels, type, channel_stride, pixel_stride, row_stride};
  }
  /// Address of a sample; (x, y) in image coordinates inside roi.
  Byte* At(int x, int y, int channel = 0) const {
    return data + (y - roi.y0) * row_stride + (x - roi.x0) * pixel_stride + channel * channel_stride;
  }
  /// The part inside r (clipped to roi).
  BasicImageView Sub(const Roi& r) const {
    const Roi c = Intersection(r, roi);
    BasicImageView v = *this;
    v.roi = c;
    if (!c.empty()) v.data = At(c.x0, c.y0);
    return v;
  }
};
/// Writable pixels.
using ImageView = BasicImageView<std::byte>;
/// Readable pixels.
using ConstImageView = BasicImageView<const std::byte>;

/// Owned pixels: interleaved, 64-byte aligned, zero at first. Copies share the pixels (like a shared_ptr).
class Image {
 public:
  Image() = default;
  /// Allocates spec.data_window x spec.channels of spec.type. Throws Error when memory is refused.
  explicit Image(ImageSpec spec);
  /// The same with pixels of any value, for those who write every one: zeros would cost as much as a copy.
  static Image Uninitialized(ImageSpec spec);
  /// In memory of that context, which the image may outlive.
  static Image Uninitialized(ImageSpec spec, Context& context);

  /// What the image is.
  const ImageSpec& spec() const { return spec_; }
  /// Its pixels, writable.
  ImageView view() const { return view_; }
  /// Typed access to a sample, for samples and tests; T must match the pixel type's size.
  template <typename T>
  T& at(int x, int y, int channel = 0) const {
    return *reinterpret_cast<T*>(view_.At(x, y, channel));
  }

 private:
  ImageSpec spec_;
  std::shared_ptr<std::byte> pixels_;
  ImageView view_;
};

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_IMAGE_H_
