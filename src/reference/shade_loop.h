// The reference's loop over pixels whose first three channels an operation replaces.
#ifndef TESSERA_REFERENCE_SHADE_LOOP_H_
#define TESSERA_REFERENCE_SHADE_LOOP_H_

#include <algorithm>
#include <cmath>

#include "reference/reference.h"

namespace tessera::reference {

// One pixel of the result: starts as input 0's; Set replaces a channel that exists.
class ShadedPixel {
 public:
  ShadedPixel(const Call& call, int x, int y) : call_(call), x_(x), y_(y) {}
  void Set(size_t channel, double value, double scale) {
    const int c = static_cast<int>(channel);
    if (c >= call_.out.channels) return;
    call_.out.at(x_, y_, c) = value;
    if (call_.scale != nullptr) call_.scale->at(x_, y_, c) = std::max(scale, 0x1p-126);
  }

 private:
  const Call& call_;
  int x_, y_;
};

template <class F>
void EachShadedPixel(const Call& call, const F& f) {
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int c = 0; c < call.out.channels; ++c) {
        call.out.at(x, y, c) = c < call.in[0].channels ? call.in[0].at(x, y, c) : 0;
        if (call.scale != nullptr) call.scale->at(x, y, c) = 0;
      }
      ShadedPixel pixel(call, x, y);
      f(x, y, pixel);
    }
  }
}

}  // namespace tessera::reference

#endif  // TESSERA_REFERENCE_SHADE_LOOP_H_
