// How different two colours look: CIEDE2000.
#ifndef TESSERA_OCIO_COLOR_DIFFERENCE_H_
#define TESSERA_OCIO_COLOR_DIFFERENCE_H_

#include <array>

namespace tessera::ocio {

// L*, a*, b* for the D65 white of an sRGB colour, each value limited to [0,1] (NaN to 0).
std::array<double, 3> LabOfSrgb(const float* rgb);
// CIEDE2000 with all weights 1. Source: Sharma, Wu, Dalal, "The CIEDE2000 color-difference formula", 2005.
double Ciede2000(const std::array<double, 3>& lab1, const std::array<double, 3>& lab2);

}  // namespace tessera::ocio

#endif  // TESSERA_OCIO_COLOR_DIFFERENCE_H_
