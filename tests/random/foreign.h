// Files as other programs write them: in tiles, several parts, rows of all the display window.
#ifndef TESSERA_TESTS_RANDOM_FOREIGN_H_
#define TESSERA_TESTS_RANDOM_FOREIGN_H_

#include <optional>
#include <string>

#include "random/generate.h"
#include "random/tally.h"

namespace tessera::random {

// What is wrong with the pixels that are read from such a file (`base`: an OpenEXR or TIFF file's name
// without its extension) of the case's result, by the codecs and by OpenImageIO, all of them or one channel
// alone, in bands of the case's tile height.
std::optional<std::string> WrongFromForeign(const Case& c, const Image& result, const std::string& base,
                                            Tally& tally);

// What is wrong with one channel of a file where nothing else is asked of it.
std::optional<std::string> WrongAlone(const Case& c, const Node& read, int channel,
                                      const ConstImageView& want);

// Whether a format keeps all samples of such an image.
bool CanHold(const std::string& format, const ImageSpec& spec, PixelType type);

// What is wrong with the result's samples as a picture without windows, where the case's format can hold
// that: read by the library's codec and by OpenImageIO, all channels and each alone.
std::optional<std::string> WrongAtOrigin(const Case& c, const Image& result, const std::string& file,
                                         Tally& tally);

// What is wrong with a file whose format pads the data window to the display window; `file` will be that.
std::optional<std::string> WrongPadding(const Case& c, const Node& result, const std::string& file,
                                        Tally& tally);

}  // namespace tessera::random

#endif  // TESSERA_TESTS_RANDOM_FOREIGN_H_
