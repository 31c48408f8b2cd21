// What the references of compositing share: limits, and the channel of depth.
#ifndef TESSERA_REFERENCE_COMPOSITE_PIXELS_H_
#define TESSERA_REFERENCE_COMPOSITE_PIXELS_H_

#include <cctype>
#include <cmath>
#include <string>
#include <utility>

#include "tessera/image.h"

namespace tessera::reference {

using Sample = std::pair<double, double>;  // value, scale of its bound

inline double Limited(double v, double low, double high) { return std::fmin(std::fmax(v, low), high); }

// The channel of depth: the first whose name, or what follows its last dot, is z or depth in any case.
inline int DepthOf(const ImageSpec& spec) {
  const auto lower = [](std::string name) {
    for (char& letter : name) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    return name;
  };
  for (int c = 0; c < spec.channel_count(); ++c) {
    const std::string name = lower(spec.channels[static_cast<size_t>(c)]);
    const std::string layer = name.substr(0, name.find_last_of('.') + 1), last = name.substr(layer.size());
    bool vector = false;  // the z of x, y, z is no depth
    for (const std::string& other : spec.channels) vector = vector || lower(other) == layer + "x";
    if (last == "depth" || (last == "z" && !vector)) return c;
  }
  return -1;
}

inline double FrontDepth(double a, double b, double alpha_a) { return alpha_a <= 0 ? b : a; }

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_COMPOSITE_PIXELS_H_
