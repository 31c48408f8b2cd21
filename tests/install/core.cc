// An outside program with tessera::core alone: operations on its own pixels, without files and colour
// management.
#include <tessera/image.h>
#include <tessera/ops/color.h>
#include <tessera/render.h>
#include <tessera/version.h>

#include <cmath>
#include <cstdio>

#if TESSERA_VERSION < 100
#error "tessera/version.h: expected at least 0.1.0"
#endif

int main() {
  const tessera::Image in(tessera::ImageSpec(40, 30, 3));
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      in.at<float>(x, y, 0) = 1, in.at<float>(x, y, 1) = 0.5f, in.at<float>(x, y, 2) = 0;
    }
  }
  const tessera::Image out = tessera::Render(tessera::Saturate(tessera::FromImage(in), 0));
  const double expected = 0.2126 + 0.7152 / 2;
  const float found = out.at<float>(39, 29, 2);
  if (!(std::abs(found - expected) < 1e-6)) {
    std::printf("found %g, expected %g\n", found, expected);
    return 1;
  }
  return 0;
}
