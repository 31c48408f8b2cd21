// A plug-in as a host application loads it: Tessera inside, one function of C outside.
#include <algorithm>
#include <cmath>

#include "tessera/tessera.h"

// Saturates RGBA floats in place, with whatever colour management and files are linked in; 0 where all went
// well.
extern "C" __attribute__((visibility("default"))) int saturate_pixels(float* pixels, int width, int height,
                                                                      double factor) {
  try {
    tessera::ImageSpec spec(width, height, 4);
    const tessera::Image in(spec);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 4; ++c)
          in.at<float>(x, y, c) = pixels[(static_cast<int64_t>(y) * width + x) * 4 + c];
      }
    }
    const tessera::Image out = tessera::Render(tessera::Saturate(tessera::FromImage(in), factor));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 4; ++c)
          pixels[(static_cast<int64_t>(y) * width + x) * 4 + c] = out.at<float>(x, y, c);
      }
    }
    return 0;
  } catch (const std::exception&) {
    return 1;
  }
}
