// Reference of filling holes: push and pull, pixel by pixel, in double.
#include <algorithm>
#include <cmath>
#include <vector>

#include "reference/border.h"
#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/ops/composite.h"

namespace tessera::reference {
namespace {

// The mean under a triangle whose half width is one pixel of the coarser picture; the edge goes on.
ImageD Resized(const ImageD& in, int width, int height) {
  ImageD out({0, 0, width, height}, in.channels);
  const double step[2] = {static_cast<double>(in.roi.width()) / width,
                          static_cast<double>(in.roi.height()) / height};
  const double reach[2] = {std::max(1.0, step[0]), std::max(1.0, step[1])};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double at[2] = {(x + 0.5) * step[0], (y + 0.5) * step[1]};
      double total = 0;
      std::vector<double> sum(static_cast<size_t>(in.channels));
      for (int j = static_cast<int>(at[1] - reach[1]) - 1; j <= at[1] + reach[1]; ++j) {
        for (int i = static_cast<int>(at[0] - reach[0]) - 1; i <= at[0] + reach[0]; ++i) {
          const double w = std::max(0.0, 1 - std::fabs(i + 0.5 - at[0]) / reach[0]) *
                           std::max(0.0, 1 - std::fabs(j + 0.5 - at[1]) / reach[1]);
          if (w < 1e-12) continue;
          const int si = in.roi.x0 + std::clamp(i, 0, in.roi.width() - 1),
                    sj = in.roi.y0 + std::clamp(j, 0, in.roi.height() - 1);
          for (int c = 0; c < in.channels; ++c) sum[static_cast<size_t>(c)] += w * in.at(si, sj, c);
          total += w;
        }
      }
      for (int c = 0; c < in.channels; ++c) out.at(x, y, c) = sum[static_cast<size_t>(c)] / total;
    }
  }
  return out;
}

ImageD Filled(const ImageD& image, int alpha) {
  const int w = image.roi.width(), h = image.roi.height();
  if (w <= 1 && h <= 1) return image;
  ImageD small = Resized(image, std::max(1, w / 2), std::max(1, h / 2));
  for (size_t i = 0; i < small.samples.size(); i += static_cast<size_t>(small.channels)) {
    const double a = small.samples[i + static_cast<size_t>(alpha)];
    for (size_t c = i; c < i + static_cast<size_t>(small.channels) && a != 0; ++c) small.samples[c] /= a;
  }
  const ImageD behind = Resized(Filled(small, alpha), w, h);
  ImageD out = image;
  for (size_t i = 0; i < out.samples.size(); i += static_cast<size_t>(out.channels)) {
    const double open = 1 - std::clamp(image.samples[i + static_cast<size_t>(alpha)], 0.0, 1.0);
    for (size_t c = i; c < i + static_cast<size_t>(out.channels) && open != 0; ++c)
      out.samples[c] += open * behind.samples[c];
  }
  return out;
}

void EvaluateFillHoles(const Call& call) {
  const ImageD& in = call.in[0];
  if (call.out.roi.empty()) return;
  const int alpha = call.in_specs[0].alpha;
  const ImageD filled = Filled(in, alpha);
  // An alpha that may be 0 within its own error decides what its colours are divided by.
  bool decided = true;
  for (int y = in.roi.y0; y < in.roi.y1; ++y) {
    for (int x = in.roi.x0; x < in.roi.x1; ++x) {
      const double reach = call.Tolerance(0, x, y, alpha);
      decided = decided && (reach == 0 || std::fabs(in.at(x, y, alpha)) > reach);
    }
  }
  ForEachSample(call, [&](int x, int y, int c) {
    if (!decided) call.Undecided(x, y, c, kUnknownJump);
    return Rounded(filled.at(x, y, c));
  });
}

Roi Everything(const std::any&, int, const Roi&) { return kEverywhere; }

}  // namespace

std::vector<Entry> FillHolesEntries() { return {{"fillholes", EvaluateFillHoles, Everything}}; }

}  // namespace tessera::reference
