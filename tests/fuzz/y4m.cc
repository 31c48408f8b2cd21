// Headers of Y4M streams, and frames of subsampled codes of any size.
#include "io/video/y4m.h"

#include "fuzz/fuzz.h"
#include "tessera/error.h"

using namespace tessera;

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  return {"YUV4MPEG2 W7 H5 F25:1 Ip A1:1 C420mpeg2 XYSCSS=420MPEG2 XCOLORRANGE=FULL\n0123456789",
          "YUV4MPEG2 W1 H1 C422p10\nabcd", "YUV4MPEG2 W16 H9 F30000:1001 Cmono16\n",
          "YUV4MPEG2 W3 H9 C444\n"};
}
std::vector<std::string> Words() {
  std::vector<std::string> words = {"YUV4MPEG2 ", " W", " H", " F", " I", " A", " C", " XCOLORRANGE="};
  for (const std::string& word : io::Y4mColorWords()) words.push_back(" C" + word);
  return words;
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view all(reinterpret_cast<const char*>(data), size);
  const std::string line(all.substr(0, all.find('\n')));
  const std::string_view rest = all.substr(std::min(size, line.size() + 1));
  fuzz::Try([&] {
    const io::Y4mHeader header = io::ParseY4mHeader("header", line);
    const std::string written = io::Y4mLine(header);
    const io::Y4mHeader again = io::ParseY4mHeader("header", written.substr(0, written.size() - 1));
    fuzz::Require(again.pixels == header.pixels && again.siting == header.siting,
                  "colours that do not come back");
    fuzz::Require(again.width == header.width && again.height == header.height,
                  "a size that does not come back");
    const io::PixelFormat& f = *header.pixels;
    if (!f.IsSubsampled() || header.width > 64 || header.height > 64) return;
    std::vector<std::byte> frame(io::FrameBytes(f, header.width, header.height)), back(frame.size());
    for (size_t i = 0; i < frame.size(); i += PixelBytes(f.type))
      frame[i] = static_cast<std::byte>(rest.empty() ? 0 : rest[i % rest.size()]);
    std::vector<float> planes(3 * static_cast<size_t>(header.width) * static_cast<size_t>(header.height));
    io::PlanesOfFrame(f, header.siting, header.width, header.height, frame.data(), planes.data());
    io::FrameOfPlanes(f, header.siting, header.width, header.height, planes.data(), back.data());
    fuzz::Require(back == frame, "chroma that has changed");
  });
  return 0;
}
