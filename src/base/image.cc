// Image specs and owned pixels.
#include "tessera/image.h"

#include <cstring>
#include <limits>

#include "base/paged_memory.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera {

std::vector<std::string> DefaultChannelNames(int count) {
  if (count == 1) return {"Y"};
  if (count == 2) return {"Y", "A"};
  std::vector<std::string> names = {"R", "G", "B", "A"};
  names.resize(static_cast<size_t>(count));
  for (int c = 4; c < count; ++c) names[static_cast<size_t>(c)] = "channel" + std::to_string(c);
  return names;
}

ImageSpec::ImageSpec(int width, int height, int channel_count, PixelType pixel_type)
    : data_window{0, 0, width, height}, display_window(data_window), type(pixel_type) {
  if (width < 0 || height < 0) {
    throw Error("image", "size " + std::to_string(width) + "x" + std::to_string(height) + " is negative");
  }
  if (channel_count < 1) {
    throw Error("image", "found " + std::to_string(channel_count) + " channels, expected at least 1");
  }
  channels = DefaultChannelNames(channel_count);
  alpha = channel_count == 2 ? 1 : channel_count >= 4 ? 3 : -1;
}

int ImageSpec::ChannelIndex(const std::string& name) const {
  for (int c = 0; c < channel_count(); ++c) {
    if (channels[static_cast<size_t>(c)] == name) return c;
  }
  return -1;
}

namespace {

size_t BytesOf(const ImageSpec& spec) {
  const size_t pixel = PixelBytes(spec.type) * spec.channels.size();
  const auto count = static_cast<size_t>(spec.data_window.pixels());
  if (pixel != 0 && count > std::numeric_limits<size_t>::max() / 2 / pixel) {
    throw SystemError("memory", "an image of " + std::to_string(spec.width()) + "x" +
                                    std::to_string(spec.height()) + " pixels does not fit");
  }
  return count * pixel;
}

}  // namespace

Image Image::Uninitialized(ImageSpec spec) { return Uninitialized(std::move(spec), Context::Default()); }

Image Image::Uninitialized(ImageSpec spec, Context& context) {
  Image image;
  image.pixels_ = base::AllocateWhole(context, BytesOf(spec));
#ifdef __SANITIZE_ADDRESS__
  std::memset(image.pixels_.get(), 0xff, BytesOf(spec));  // NaN: what nobody writes shows
#endif
  image.view_ = ImageView(image.pixels_.get(), spec.data_window, spec.channel_count(), spec.type);
  image.spec_ = std::move(spec);
  return image;
}

Image::Image(ImageSpec spec)
    : spec_(std::move(spec)),
      pixels_(base::AllocateZeros(Context::Default(), BytesOf(spec_))),
      view_(pixels_.get(), spec_.data_window, spec_.channel_count(), spec_.type) {}

}  // namespace tessera
