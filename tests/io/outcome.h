// What reading a file comes to: its pixels, or the reason that it was refused.
#ifndef TESSERA_TESTS_IO_OUTCOME_H_
#define TESSERA_TESTS_IO_OUTCOME_H_

#include <string>

#include "tessera/error.h"
#include "tessera/io.h"
#include "tessera/render.h"

namespace tessera::testing_io {

// The pixels' bytes, the message of the Error, or "large" for more than 100,000 pixels, which are not read.
inline std::string OutcomeOf(const std::string& file, Codec codec, int threads = 2) {
  try {
    const Node node = Read(file, {.codec = codec});
    if (node.spec().data_window.pixels() > 100000) return "large";
    const Image image = Render(node, node.spec().type, {.threads = threads});
    const auto* pixels = reinterpret_cast<const char*>(image.view().data);
    const ImageSpec& s = image.spec();
    return std::string(pixels,
                       static_cast<size_t>(s.data_window.pixels() * s.channel_count()) * PixelBytes(s.type));
  } catch (const Error& e) {
    return e.what();
  }
}

// Whether it is a refusal that names the file.
inline bool IsRefusal(const std::string& outcome, const std::string& file) {
  return outcome.rfind(file + ": ", 0) == 0;
}

}  // namespace tessera::testing_io

#endif  // TESSERA_TESTS_IO_OUTCOME_H_
