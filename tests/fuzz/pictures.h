// Files that mutation of pictures begins with, made by this library.
#ifndef TESSERA_TESTS_FUZZ_PICTURES_H_
#define TESSERA_TESTS_FUZZ_PICTURES_H_

#include <string>
#include <vector>

#include "fuzz/fuzz.h"
#include "tessera/error.h"
#include "tessera/io.h"

namespace tessera::fuzz {

// A picture's file, or nothing where this machine writes no such file. `compression`: as OpenImageIO has it.
inline std::string PictureFile(const std::string& extension, const std::string& compression, PixelType type,
                               int channels, int width = 13, int height = 19,
                               const std::vector<Attribute>& more = {}) {
  const std::string file = Folder() + "/seed" + extension;
  const Image image(ImageSpec(width, height, channels, type));
  auto* const bytes = reinterpret_cast<unsigned char*>(image.view().data);
  const size_t size = static_cast<size_t>(width) * static_cast<size_t>(height) *
                      static_cast<size_t>(channels) * PixelBytes(type);
  // Flat, a slope, noise; exponents of halves and floats stay ordinary.
  for (size_t i = 0; i < size; ++i)
    bytes[i] = static_cast<unsigned char>(i < size / 3   ? 40
                                          : i < size / 2 ? i / 7 % 60
                                                         : i * 2654435761u >> 9 & 0x3B);
  WriteOptions options;
  options.render.threads = 1;
  options.attributes = more;
  if (!compression.empty()) options.attributes.push_back({"compression", "string", {}, {compression}});
  try {
    Write(FromImage(image), file, options);
    return Contents(file);
  } catch (const Error&) {
    return "";
  }
}

}  // namespace tessera::fuzz

#endif  // TESSERA_TESTS_FUZZ_PICTURES_H_
