// A frame of --stream on its way.
#ifndef TESSERA_CLI_STREAM_FRAME_H_
#define TESSERA_CLI_STREAM_FRAME_H_

#include <cstddef>
#include <memory>
#include <vector>

namespace tessera::cli {

class FrameStream;

// The bytes of a frame that was read, or is to be written.
struct StreamFrame {
  int width = 0, height = 0;
  std::shared_ptr<std::vector<std::byte>> bytes;
  std::vector<float> planes = {};  // of what is subsampled, once it is an image
};

}  // namespace tessera::cli

#endif  // TESSERA_CLI_STREAM_FRAME_H_
