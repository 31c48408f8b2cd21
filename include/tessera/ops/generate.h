/// Images made from nothing: constant colour, checkerboard, coordinate ramp; rectangles filled. @file
#ifndef TESSERA_OPS_GENERATE_H_
#define TESSERA_OPS_GENERATE_H_

#include <cstdint>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera {

/// Generators take windows, channel names and alpha of the result from a spec; nothing is stored, pixels are
/// computed where they are used. Error when a spec has no channels. @file

/// One colour everywhere: values per channel; one value serves every channel, channels beyond the list get 1
/// (as oiiotool). Values must be finite.
struct ConstantParams {
  std::vector<double> color = {1};  ///< per channel
};
/// One colour everywhere, as ConstantParams says.
Node Constant(const ImageSpec& spec, const ConstantParams& params = {});
/// Black everywhere, alpha included.
Node Create(const ImageSpec& spec);

/// Rectangles of width x height pixels in two colours; the one that holds pixel (0, 0) of the image
/// coordinates has color1. Colours are read like ConstantParams::color, channels beyond a list get 0 in
/// color1 and 1 in color2. Left of and above the origin the pattern goes on without a seam. Error unless
/// width and height are at least 1.
struct CheckerParams {
  std::vector<double> color1 = {0};  ///< of the rectangle at the origin
  std::vector<double> color2 = {1};  ///< of its neighbours
  int width = 16;                    ///< of a rectangle, pixels
  int height = 16;                   ///< of a rectangle, pixels
};
/// A checkerboard, as CheckerParams says.
Node Checker(const ImageSpec& spec, const CheckerParams& params = {});

/// The coloured quad that starts a pixel-texture algorithm: channel 0 is s = (x + 1/2) / width, channel 1
/// t = (y + 1/2) / height, channel 2 is 0, channel 3 and all further ones 1. x and y count from the display
/// window's corner and width and height are the display window's (the data window's where that is empty), so
/// crops of a ramp agree. Each value is the exact quotient rounded once, up to 2^23 pixels across.
struct RampParams {
  Roi frame;  ///< (0, 0) to (1, 1) of s and t
};
/// Coordinates as colours, as RampParams says.
Node Ramp(const ImageSpec& spec);

/// A rectangle of an image and the colours of its corners, read like ConstantParams::color. What lies beyond
/// the image's data window is cut off first. |error| <= 4 u times the largest corner, one colour 1 rounding.
struct FillParams {
  Roi box;                                 ///< what is filled
  std::vector<double> top_left = {1};      ///< of that corner's pixel
  std::vector<double> top_right = {1};     ///< of that corner's pixel
  std::vector<double> bottom_left = {1};   ///< of that corner's pixel
  std::vector<double> bottom_right = {1};  ///< of that corner's pixel
};
/// The rectangle becomes a bilinear mix of its corners; other pixels keep their bits.
Node Fill(const Node& image, const FillParams& params);

/// Distributions of AddNoise.
enum class AddedNoise : uint8_t {
  kGaussian,  ///< normal, added
  kUniform,   ///< even from min up to max, added
  kSalt,      ///< `value` in place of a portion of samples
};
/// oiiotool's noise, number for number: Jenkins' lookup3 of column, row, channel and seed, 20 bits of it. The
/// numbers depend on nothing else. |error| <= 3 u (|sample| + |noise|), uniform 3 u (|sample| + |min| +
/// |max|). Numbers must be finite, `channels` not negative, else Error.
struct AddNoiseParams {
  AddedNoise type = AddedNoise::kGaussian;  ///< the distribution
  double mean = 0;                          ///< of kGaussian
  double stddev = 0.1;                      ///< of kGaussian
  double min = 0;                           ///< of kUniform
  double max = 0.1;                         ///< of kUniform
  double value = 0;                         ///< of kSalt
  double portion = 0.01;                    ///< of kSalt: 1 for all samples
  uint32_t seed = 0;                        ///< other numbers
  bool mono = false;                        ///< every channel has those of the first
  int channels = 10000;                     ///< how many are changed, from the first
};
/// The image with noise, as AddNoiseParams says; alpha is a channel like the others.
Node AddNoise(const Node& image, const AddNoiseParams& params = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_OPS_GENERATE_H_
