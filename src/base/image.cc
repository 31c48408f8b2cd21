// Image specs and owned pixels.
#include "tessera/image.h"

#include <cstring>
#include <limits>

#include "base/arena.h"
#include "tessera/error.h"

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

Image::Image(ImageSpec spec) : spec_(std::move(spec)) {
  const size_t pixel = PixelBytes(spec_.type) * spec_.channels.size();
  const auto count = static_cast<size_t>(spec_.data_window.pixels());
  if (pixel != 0 && count > std::numeric_limits<size_t>::max() / 2 / pixel) {
    throw Error("memory", "an image of " + std::to_string(spec_.width()) + "x" +
                              std::to_string(spec_.height()) + " pixels does not fit");
  }
  pixels_ = base::AllocateAligned(count * pixel);
  std::memset(pixels_.get(), 0, count * pixel);
  view_ = ImageView(pixels_.get(), spec_.data_window, spec_.channel_count(), spec_.type);
}

}  // namespace tessera
