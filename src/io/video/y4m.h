// YUV4MPEG2 (Y4M), the stream of uncompressed frames that mjpegtools began and FFmpeg speaks: its headers.
#ifndef TESSERA_IO_VIDEO_Y4M_H_
#define TESSERA_IO_VIDEO_Y4M_H_

#include <optional>
#include <string>
#include <vector>

#include "io/video/chroma.h"
#include "io/video/pixel_format.h"
#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::io {

inline constexpr char kY4mMagic[] = "YUV4MPEG2";
inline constexpr char kY4mFrame[] = "FRAME";

// What the words of a header say; `pixels` is one of PixelFormats.
struct Y4mHeader {
  const PixelFormat* pixels = nullptr;
  Siting siting = Siting::kCentre;
  int width = 0, height = 0;
  std::string rate = "25:1", interlacing = "p", aspect = "0:0";  // as written
  std::optional<bool> full;                                      // XCOLORRANGE
};

// Of a line without its end. Throws DataError about `subject` for what is none, a size that is missing or
// absurd, and a colour space that is not known.
Y4mHeader ParseY4mHeader(const std::string& subject, const std::string& line);
// The line with its end.
std::string Y4mLine(const Y4mHeader& header);

// Takes what stands behind C in a header: 420mpeg2, 444p10, mono. False for what is not known.
bool SetY4mColors(const std::string& word, Y4mHeader& header);
// All that are.
std::vector<std::string> Y4mColorWords();

}  // namespace tessera::io
TESSERA_API_END

#endif  // TESSERA_IO_VIDEO_Y4M_H_
