// A progress callback of one's own, and an evaluation that is stopped half-way.
#include <algorithm>
#include <cstdio>
#include <string>

#include "tessera/tessera.h"

namespace {

// Draws a bar on the terminal's line; returning false would cancel.
bool DrawBar(double done) {
  static int drawn = -1;
  const int cells = static_cast<int>(40 * std::clamp(done, 0.0, 1.0));
  if (cells == drawn) return true;
  drawn = cells;
  std::fprintf(stderr, "\r[%s%s]", std::string(cells, '=').c_str(), std::string(40 - cells, ' ').c_str());
  return true;
}

}  // namespace

int main() {
  try {
    const tessera::Node picture = tessera::Saturate(tessera::Ramp(tessera::ImageSpec(4096, 4096, 4)), 1.5);

    // The callback may come from any worker, one call at a time; the share only grows.
    double last = 0;
    bool grew = true;
    tessera::RenderOptions options;
    options.progress = [&](double done) {
      grew = grew && done >= last;
      last = done;
      return DrawBar(done);
    };
    tessera::Render(picture, tessera::PixelType::kHalf, options);
    std::fprintf(stderr, "\n");
    if (!grew || last != 1) {
      std::printf("progress ended at %g\n", last);
      return 1;
    }

    // Stops at the first report: the evaluation throws, nothing is left behind.
    options.progress = [](double) { return false; };
    try {
      tessera::Render(picture, tessera::PixelType::kHalf, options);
    } catch (const tessera::Cancelled& cancelled) {
      std::printf("stopped: %s\n", cancelled.what());
      return 0;
    }
    std::printf("the evaluation was not stopped\n");
  } catch (const tessera::Error& error) {
    std::printf("%s\n", error.what());
  }
  return 1;
}
