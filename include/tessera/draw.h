/// What OpenImageIO does to whole images in memory: drawing, Fourier transforms, comparison by eye. @file
#ifndef TESSERA_DRAW_H_
#define TESSERA_DRAW_H_

#include <cstdint>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"

TESSERA_API_BEGIN
namespace tessera {

/// Draws a box with corners (x1, y1) and (x2, y2), both in it, its edge alone or filled. Colours have a value
/// a channel, 1 where there are fewer; where the image has alpha, or the colour one value more than the image
/// has channels, it is laid over by it.
void DrawBox(const Image& image, int x1, int y1, int x2, int y2, const std::vector<float>& color, bool fill);
/// Draws lines from point to point: x, y, x, y, ...
void DrawLines(const Image& image, const std::vector<int>& points, const std::vector<float>& color);
/// Draws points: x, y, x, y, ...
void DrawPoints(const Image& image, const std::vector<int>& points, const std::vector<float>& color);

/// Where and how a text is drawn.
struct TextStyle {
  int x = 0;                     ///< where it is
  int y = 0;                     ///< where it is
  int size = 16;                 ///< height of the letters
  std::string font{};            ///< name or file; empty: OpenImageIO's choice
  std::string x_align = "left";  ///< left, center or right of x
  std::string y_align = "base";  ///< base, top, bottom or center at y
  int shadow = 0;                ///< width of a dark rim
  std::vector<float> color{};    ///< as of a box
};
/// Draws a text, several lines where it holds line ends. Throws Error where there is no such font.
void DrawText(const Image& image, const std::string& text, const TextStyle& style);

/// The Fourier transform of the first channel as two channels, real and imaginary.
Image FourierTransform(const Image& image);
/// The image, of one channel, that has this transform.
Image InverseFourierTransform(const Image& image);
/// Amplitude and phase, from 0 to 2 pi, of complex pixels of two channels.
Image ToPolar(const Image& image);
/// Complex pixels of amplitude and phase.
Image FromPolar(const Image& image);

/// The number of pixels that Yee's model of the eye tells apart (100 candela a square metre, 45 degrees).
int64_t PerceptualDifferences(const Image& a, const Image& b);

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_DRAW_H_
