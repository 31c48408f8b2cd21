// The numbers of the broadcast standards' curves.
#ifndef TESSERA_OPS_CURVE_CURVE_CONSTANTS_H_
#define TESSERA_OPS_CURVE_CURVE_CONSTANTS_H_

namespace tessera::ops {

// SMPTE ST 2084.
inline constexpr double kPqM1 = 2610.0 / 16384, kPqM2 = 2523.0 / 4096 * 128, kPqC1 = 3424.0 / 4096,
                        kPqC2 = 2413.0 / 4096 * 32, kPqC3 = 2392.0 / 4096 * 32;
// ARIB STD-B67; c is 1/2 - a ln(4 a).
inline constexpr double kHlgA = 0.17883277, kHlgB = 1 - 4 * kHlgA, kHlgC = 0.55991072952956202016;
inline constexpr double kLn2 = 0.69314718055994530942;

}  // namespace tessera::ops

#endif  // TESSERA_OPS_CURVE_CURVE_CONSTANTS_H_
