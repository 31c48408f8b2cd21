// Pixels of any type to exact doubles, in plain C++ of their own: the reference does not trust the fast path.
#ifndef TESSERA_VERIFY_PIXELS_H_
#define TESSERA_VERIFY_PIXELS_H_

#include <cstdint>

#include "graph/source.h"
#include "reference/reference.h"

namespace tessera::verify {

// The value of an IEEE binary16.
double HalfToDouble(uint16_t bits);

// Fills `out` (region inside the source's data window, all channels) from memory or by reading the file.
void ReadExact(const graph::PixelSource& source, reference::ImageD& out);

// A sample of any type as an exact double: codes as parts of the largest.
double SampleOf(const ConstImageView& view, int x, int y, int c);

// The nearest half of a value, ties to even, and the distance between halves there.
double NearestHalf(double value);
double HalfStep(double value);

// The code of a value in a type of 255 or 65535 codes: round half to even of the exact product, saturating,
// NaN 0.
int CodeOf(double value, int max_code);

}  // namespace tessera::verify

#endif  // TESSERA_VERIFY_PIXELS_H_
