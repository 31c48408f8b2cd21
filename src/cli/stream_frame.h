// A frame of --stream on its way.
#ifndef TESSERA_CLI_STREAM_FRAME_H_
#define TESSERA_CLI_STREAM_FRAME_H_

#include <cstddef>

#include "tessera/image.h"

namespace tessera::cli {

class FrameStream;

// Memory of the default context, which has it for the next frame once nobody does: the system would have to
// clear it for each. Copies share it.
class FrameMemory {
 public:
  FrameMemory() = default;
  explicit FrameMemory(size_t bytes) : size_(bytes) {
    constexpr size_t kRow = size_t{1} << 16;
    pixels_ = Image::Uninitialized(
        ImageSpec(static_cast<int>(kRow), static_cast<int>((bytes + kRow - 1) / kRow), 1, PixelType::kUint8));
  }
  std::byte* data() const { return pixels_.view().data; }
  size_t size() const { return size_; }

 private:
  Image pixels_;
  size_t size_ = 0;
};

// The bytes of a frame that was read, or is to be written.
struct StreamFrame {
  int width = 0, height = 0;
  FrameMemory bytes;
  FrameMemory planes = {};  // of what is subsampled, once it is an image
};

}  // namespace tessera::cli

#endif  // TESSERA_CLI_STREAM_FRAME_H_
