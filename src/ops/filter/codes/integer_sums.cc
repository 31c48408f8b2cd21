// Finds results near the middle between two codes and sums them anew.
#include "ops/filter/codes/integer_sums.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ops/filter/codes/codes.h"
#include "ops/filter/lines/extend.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "ops/filter/codes/integer_sums.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tessera::ops::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Appends the samples of a row that lie within `band` codes of a half code.
void FindHalves(const float* row, int count, float largest, float band, Found& found) {
  const hn::ScalableTag<float> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto near = [&](auto tag, int i) HWY_ATTR {
    const auto code = hn::Mul(hn::LoadU(tag, row + i), hn::Set(tag, largest));
    // Half a code from the nearest whole one; NaN is near nothing.
    const auto away = hn::Abs(hn::Sub(code, hn::Round(code)));
    return hn::Ge(away, hn::Set(tag, 0.5f - band));
  };
  int i = 0;
  for (; i + lanes <= count; i += lanes) {
    if (hn::AllFalse(d, near(d, i))) continue;
    const hn::CappedTag<float, 1> one;
    for (int k = i; k < i + lanes; ++k) {
      if (!hn::AllFalse(one, near(one, k))) found.Add(k);
    }
  }
  const hn::CappedTag<float, 1> one;
  for (; i < count; ++i) {
    if (!hn::AllFalse(one, near(one, i))) found.Add(i);
  }
}
auto FindHalvesOfTarget() { return FindHalves; }

}  // namespace tessera::ops::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::ops {
namespace {

HWY_EXPORT(FindHalvesOfTarget);

constexpr int kSmall =
    1024;  // weights whose sum in double is far more exact than the nearest results to a tie

}  // namespace

IntegerSums::FindHalves IntegerSums::ChooseFindHalves() { return HWY_DYNAMIC_DISPATCH(FindHalvesOfTarget)(); }

IntegerSums::IntegerSums(PixelType type, const Kernel& correlation, const WindowOptions& options,
                         double error)
    : kernel_(correlation), options_(options), largest_(Largest(type)) {
  const auto area = static_cast<ptrdiff_t>(kernel_.width) * kernel_.height;
  for (int p = 0; p < kernel_.planes; ++p) {
    double total = 0;
    for (ptrdiff_t i = 0; i < area; ++i) total += kernel_.weights[static_cast<size_t>(p * area + i)];
    totals_.push_back(total);
  }
  // Results and the sink's product round in their last bit.
  const double own = 0x1p-22 + std::fabs(options_.bias) * 0x1p-23;
  band_ = static_cast<float>(std::min(0.5, (error + own) * largest_));
}

double IntegerSums::Exact(const ConstImageView& in, std::span<const int> in_channels, const Roi& window,
                          int x, int y, int channel, std::span<int> shown) const {
  const auto place = [&](int c) {
    return std::find(in_channels.begin(), in_channels.end(), c) - in_channels.begin();
  };
  const auto plane = static_cast<size_t>(kernel_.planes == 1 ? 0 : channel);
  constexpr double kWhole = 0.005;  // more than a code's error as a float
  const double* weight =
      &kernel_.weights[plane * static_cast<size_t>(kernel_.width) * static_cast<size_t>(kernel_.height)];
  const Roi footprint{x - kernel_.anchor_x, y - kernel_.anchor_y, x - kernel_.anchor_x + kernel_.width,
                      y - kernel_.anchor_y + kernel_.height};
  long double sum = 0;
  double inside = 0;
  if (kernel_.width * kernel_.height <= kSmall && window.Contains(footprint)) {
    constexpr double kRound = 0x1.8p52;  // added and taken away: the nearest integer
    double small_sum = 0, farthest = 0;
    for (int j = 0; j < kernel_.height; ++j) {
      const auto* p = reinterpret_cast<const float*>(in.At(footprint.x0, footprint.y0 + j)) + place(channel);
      for (int i = 0; i < kernel_.width; ++i, p += in.channels) {
        const double code = static_cast<double>(*p) * largest_, nearest = (code + kRound) - kRound;
        farthest = std::max(farthest, std::fabs(code - nearest));
        small_sum += *weight++ * nearest;
      }
    }
    if (!(farthest < kWhole) || !std::isfinite(small_sum)) return std::nan("");
    sum = small_sum;
  } else {
    const std::span<int> columns = shown.first(static_cast<size_t>(kernel_.width));
    const std::span<int> rows = shown.last(static_cast<size_t>(kernel_.height));
    // The samples of a row and of a column that the window shows, -1 where the border's value is.
    const AxisBorder across(options_.wrap, options_.border_value, window.width());
    const AxisBorder down(options_.wrap, options_.border_value, window.height());
    for (int i = 0; i < kernel_.width; ++i)
      columns[static_cast<size_t>(i)] = across.Shown(footprint.x0 - window.x0 + i);
    for (int j = 0; j < kernel_.height; ++j)
      rows[static_cast<size_t>(j)] = down.Shown(footprint.y0 - window.y0 + j);
    const double beyond = options_.wrap == Wrap::kBlack ? options_.border_value * largest_ : 0;
    for (const int row : rows) {
      const float* const line =
          row < 0 ? nullptr
                  : reinterpret_cast<const float*>(in.At(in.roi.x0, window.y0 + row)) + place(channel);
      for (const int column : columns) {
        const double w = *weight++;
        if (w == 0) continue;
        if (line == nullptr || column < 0) {
          sum += w * beyond;
          continue;
        }
        const ptrdiff_t at = static_cast<ptrdiff_t>(window.x0 + column - in.roi.x0) * in.channels;
        const double code = static_cast<double>(line[at]) * largest_, nearest = std::nearbyint(code);
        if (!(std::fabs(code - nearest) < kWhole)) return std::nan("");  // an earlier operation's float
        sum += static_cast<long double>(w) * nearest;
        inside += w;
      }
    }
  }
  if (options_.wrap == Wrap::kRenormalize && inside != 0) sum *= totals_[plane] / inside;
  if (options_.bias != 0) {
    const auto alpha = static_cast<size_t>(place(options_.alpha));
    const bool has_alpha = options_.alpha >= 0 && alpha < in_channels.size();
    sum += options_.bias *
           (has_alpha ? std::nearbyint(reinterpret_cast<const float*>(in.At(x, y))[alpha] * largest_)
                      : largest_);
  }
  return static_cast<double>(sum);
}

void IntegerSums::Settle(const ConstImageView& in, std::span<const int> in_channels, const ImageView& out,
                         std::span<const int> out_channels, const Roi& window, base::Arena& scratch) const {
  const int samples = out.roi.width() * out.channels;
  Found near(scratch, samples), edge(scratch, samples);
  const auto taps = static_cast<size_t>(kernel_.width) + static_cast<size_t>(kernel_.height);
  const std::span<int> shown(scratch.Allocate<int>(taps), taps);
  for (int y = out.roi.y0; y < out.roi.y1; ++y) {
    auto* const row = reinterpret_cast<float*>(out.At(out.roi.x0, y));
    near.Clear(), edge.Clear();
    find_halves_(row, samples, static_cast<float>(largest_), band_, near);
    // At edges with fewer weights the error is larger: all of them are summed.
    if (options_.wrap == Wrap::kRenormalize) {
      const bool outside =
          y - kernel_.anchor_y < window.y0 || y - kernel_.anchor_y + kernel_.height > window.y1;
      const auto is_edge = [&](int i) {
        const int x = out.roi.x0 + i / out.channels - kernel_.anchor_x;
        return outside || x < window.x0 || x + kernel_.width > window.x1;
      };
      for (const int i : near) {
        if (!is_edge(i)) edge.Add(i);
      }
      for (int i = 0; i < samples; ++i) {
        if (is_edge(i)) edge.Add(i);
      }
    }
    for (const int i : options_.wrap == Wrap::kRenormalize ? edge : near) {
      if (!(row[i] > -1 && row[i] < 2)) continue;  // the sink limits it
      const double exact = Exact(in, in_channels, window, out.roi.x0 + i / out.channels, y,
                                 out_channels[static_cast<size_t>(i % out.channels)], shown);
      if (std::isnan(exact)) continue;
      row[i] = SettledSample(exact, largest_);
    }
  }
}

}  // namespace tessera::ops
#endif  // HWY_ONCE
