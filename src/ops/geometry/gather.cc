// Preparation of look-ups: pixels as RGBA, tables of weights.
#include "ops/geometry/gather.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tessera::ops {
namespace {

int PixelsPerRow(const std::vector<ConstImageView>& groups, int height) {
  constexpr ptrdiff_t kPixel = 4 * sizeof(float), kMost = 1 << 30;
  if (groups.empty()) return 0;
  const ptrdiff_t stride = groups[0].row_stride;
  const bool counts = stride > 0 && stride % kPixel == 0 && stride / kPixel * height < kMost;
  const bool same = std::all_of(groups.begin(), groups.end(),
                                [&](const ConstImageView& g) { return g.row_stride == stride; });
  return counts && same ? static_cast<int>(stride / kPixel) : 0;
}

}  // namespace

GatherSource::GatherSource(const ConstImageView& whole, const FilterKernel& kernel, Wrap x, Wrap y,
                           bool renormalized, const graph::Workers& workers)
    : window(whole.roi), filter(&kernel), wrap_x(x), wrap_y(y), renormalize(renormalized) {
  if (whole.channels == 4) {
    groups = {whole};
  } else {
    for (int c = 0; c < whole.channels; c += 4) {
      ImageSpec spec(window.width(), window.height(), 4);
      spec.data_window = spec.display_window = window;
      packed_.push_back(Image::Uninitialized(std::move(spec), workers.context()));
      const ImageView to = packed_.back().view();
      const int n = std::min(4, whole.channels - c);
      workers.For(window.height(), [&](int64_t row, int) {
        const int at_y = window.y0 + static_cast<int>(row);
        const auto* from = reinterpret_cast<const float*>(whole.At(window.x0, at_y, c));
        auto* p = reinterpret_cast<float*>(to.At(window.x0, at_y));
        for (int i = 0; i < window.width(); ++i, from += whole.channels, p += 4)
          std::fill(std::copy_n(from, n, p), p + 4, 0.0f);
      });
      groups.emplace_back(to);
    }
  }

  taps = static_cast<int>(std::ceil(filter->width));
  linear = taps == 2 && filter->value(0.25) == 0.75;
  pixels_per_row = PixelsPerRow(groups, window.height());
  const int lead = (taps - 1) / 2;  // taps left of the pixel that the phase counts from
  // Of an odd number the middle one is the nearest pixel, of an even number the phase counts from the pixel
  // before.
  const double origin = taps % 2 == 1 ? 0.5 : 0;
  phase_weights.reserve(static_cast<size_t>(kPhases + 1) * taps);
  for (int p = 0; p <= kPhases; ++p) {
    const double phase = static_cast<double>(p) / kPhases - origin;
    std::vector<double> w;
    double sum = 0;
    for (int k = 0; k < taps; ++k) w.push_back(filter->InsideValue(k - lead - phase)), sum += w.back();
    for (double v : w) phase_weights.push_back(static_cast<float>(sum != 0 ? v / sum : 0));
  }
  reach = filter->Reach();
  // One more for who interpolates at the edge.
  const int end = static_cast<int>(filter->width / 2 * kPhases);
  for (int i = 0; i <= end + 1; ++i) {
    fine.push_back(filter->InsideValue(static_cast<double>(std::min(i, end)) / kPhases));
  }
}

}  // namespace tessera::ops
