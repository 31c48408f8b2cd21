// Light of black bodies: colours and luminances by their temperature.
#ifndef TESSERA_MODEL_BLACK_BODY_H_
#define TESSERA_MODEL_BLACK_BODY_H_

#include <array>

namespace tessera::model {

// Between 1,000 and 15,000 kelvin.
inline constexpr double kColdestBody = 1000, kHottestBody = 15000;

// Coordinates u, v of the CIE's 1960 diagram after Krystek 1985; in x and y within 4e-4 of Planck's law
// through the CIE's 1931 observer.
std::array<double, 2> BlackBodyUv(double kelvin);
// Planck's law through the CIE's luminous efficiency (Wyman et al. 2013, 2.2), up to a constant; against the
// CIE's own table within 0.8 % at 1,000 K, relative to 2,856 K, and 0.2 % from 1,900 K on.
double BlackBodyLuminance(double kelvin);
// Linear Rec.709 of luminance 1; below some 1,900 K, and negative in blue, outside of it: that is 0.
std::array<double, 3> BlackBodyColor(double kelvin);

}  // namespace tessera::model

#endif  // TESSERA_MODEL_BLACK_BODY_H_
