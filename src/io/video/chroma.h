// Y'CbCr frames and planes of one size: chroma of half the width or height, and the matrices between codes
// and R'G'B'.
#ifndef TESSERA_IO_VIDEO_CHROMA_H_
#define TESSERA_IO_VIDEO_CHROMA_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "io/video/pixel_format.h"
#include "tessera/export.h"

TESSERA_API_BEGIN
namespace tessera::io {

// Where a sample of chroma lies of which there are half as many: amid the samples that share it, on the left
// ones (half way down where heights are halved too), or on the first of them.
enum class Siting : uint8_t { kCentre, kLeft, kTopLeft };

// The rule, along each axis by itself. Where a sample lies amid two: down, their mean; up, the line through
// it whose slope is its neighbours', c -/+ (next - previous) / 8 (the pair 1, 3 of Cohen, Daubechies and
// Feauveau 1992). Where it lies on the first of two: up, itself and the mean of it and the next; down,
// (-1 2 6 2 -1) / 8 about it (their pair 2, 2, the 5/3 of JPEG 2000). Going down undoes going up exactly, so
// that chroma that nobody changed keeps its codes. Beyond the edges samples are those at them when going up
// and mirrored when going down.

// Codes of a subsampled frame in three planes of width x height floats, Y, Cb, Cr, one behind the other.
// Integer codes of up to 16 bits and what lies between them are exact.
void PlanesOfFrame(const PixelFormat& format, Siting siting, int width, int height, const std::byte* frame,
                   float* planes);
// Back: codes rounded to the nearest, limited to those that there are; 0 for NaN.
void FrameOfPlanes(const PixelFormat& format, Siting siting, int width, int height, const float* planes,
                   std::byte* frame);

// The weights of R' and B' in Y', those of G' are what is left; whether codes use the whole range.
// Source: BT.601 2011, BT.709 2015, BT.2020 2015 (non-constant luminance).
struct YccCoding {
  double red = 0.299, blue = 0.114;
  bool full = false;
  int bits = 8;
};
// 12 numbers for ColorMatrix, from Y', Cb, Cr as codes / top to R', G', B' in [0, 1], and back. Limited
// range: 219 steps of luma above 16 and 224 of chroma about 128, times 2^(bits - 8); full range: 2^bits - 1
// steps of either, chroma about 2^(bits - 1).
std::vector<double> RgbOfYcc(const YccCoding& coding, double top);
std::vector<double> YccOfRgb(const YccCoding& coding, double top);
// Code / top of black, and of how much white is above it: Y' alone.
void GreyCodes(const YccCoding& coding, double top, double& black, double& white);

}  // namespace tessera::io
TESSERA_API_END

#endif  // TESSERA_IO_VIDEO_CHROMA_H_
