// --printstats, and an image's extremes for expressions: minimum, maximum, mean, deviation and counts per
// channel, in one streamed pass in double.
#include "cli/statistics.h"

#include <OpenImageIO/strutil.h>

#include <cmath>
#include <iostream>
#include <limits>
#include <vector>

#include "cli/json_report.h"
#include "graph/render.h"

namespace tessera::cli {
namespace {

using OIIO::Strutil::sprintf;

// Sums of one channel. Rows are merged by their means (Chan, Golub, LeVeque), so that the deviation of a
// nearly constant image does not drown in the squares of its mean; sums are compensated (Neumaier).
struct ChannelStatistics {
  double min = std::numeric_limits<double>::infinity(), max = -min;
  int64_t nan = 0, inf = 0, finite = 0;
  double sum = 0, compensation = 0, squares = 0;  // squares: of deviations from the mean

  double Mean() const { return finite == 0 ? 0 : (sum + compensation) / static_cast<double>(finite); }
  double Deviation() const { return finite == 0 ? 0 : std::sqrt(squares / static_cast<double>(finite)); }

  void AddRow(const float* samples, int count, int stride) {
    double row_sum = 0, row_squares = 0;
    int64_t row_count = 0;
    for (int x = 0; x < count; ++x) {
      const double v = samples[int64_t{x} * stride];
      if (std::isnan(v)) {
        ++nan;
      } else if (std::isinf(v)) {
        ++inf;
      } else {
        ++row_count;
        row_sum += v;
        min = std::min(min, v);
        max = std::max(max, v);
      }
    }
    if (row_count == 0) return;
    const double row_mean = row_sum / static_cast<double>(row_count);
    for (int x = 0; x < count; ++x) {
      const double v = samples[int64_t{x} * stride];
      if (std::isfinite(v)) row_squares += (v - row_mean) * (v - row_mean);
    }
    const double n = static_cast<double>(finite), m = static_cast<double>(row_count),
                 delta = row_mean - Mean();
    squares += row_squares + delta * delta * n * m / (n + m);
    finite += row_count;
    const double next = sum + row_sum;
    compensation += std::abs(sum) >= std::abs(row_sum) ? (sum - next) + row_sum : (row_sum - next) + sum;
    sum = next;
  }
};

class StatisticsSink final : public graph::RowSink {
 public:
  explicit StatisticsSink(int channels) : channels(static_cast<size_t>(channels)) {}

  void Write(const ConstImageView& rows) override {
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      const float* row = reinterpret_cast<const float*>(rows.At(rows.roi.x0, y));
      for (int c = 0; c < rows.channels; ++c)
        channels[static_cast<size_t>(c)].AddRow(row + c, rows.roi.width(), rows.channels);
      if (!constant && !monochrome) continue;
      for (int x = 0; x < rows.roi.width(); ++x) CheckPixel(row + int64_t{x} * rows.channels, rows.channels);
    }
  }

  std::vector<ChannelStatistics> channels;
  std::vector<float> first;  // the first pixel
  bool constant = true, monochrome = true;

 private:
  void CheckPixel(const float* pixel, int count) {
    if (first.empty()) first.assign(pixel, pixel + count);
    for (int c = 0; c < count; ++c) {
      if (pixel[c] != first[static_cast<size_t>(c)]) constant = false;
      if (pixel[c] != pixel[0]) monochrome = false;
    }
  }
};

// One line of values per channel in the units of the storage type, as oiiotool prints them.
template <typename Get>
void PrintRow(const char* label, const StatisticsSink& sink, PixelType type, bool whole, Get get) {
  const double scale = type == PixelType::kUint8 ? 255 : type == PixelType::kUint16 ? 65535 : 1;
  std::cout << "    " << label << ":";
  for (size_t c = 0; c < sink.channels.size(); ++c) {
    const double value = get(c) * scale;
    std::cout << (scale == 1 ? sprintf(" %f", value)
                  : whole    ? sprintf(" %.0f", value)
                             : sprintf(" %.2f", value));
  }
  std::cout << (scale == 1 ? std::string(" (float)\n") : sprintf(" (of %.0f)\n", scale));
}

template <typename Get>
void PrintCounts(const char* label, const StatisticsSink& sink, Get get) {
  std::cout << "    " << label << ":";
  for (const ChannelStatistics& c : sink.channels) std::cout << ' ' << get(c);
  std::cout << " \n";
}

void PrintForPrograms(const Entry& entry, const StatisticsSink& sink) {
  const ImageSpec& spec = entry.node.spec();
  Json report = Report("printstats");
  report["image"] = entry.name;
  report["width"] = spec.width();
  report["height"] = spec.height();
  report["type"] = PixelTypeName(spec.type);
  report["channels"] = Json::array();
  for (size_t c = 0; c < sink.channels.size(); ++c) {
    const ChannelStatistics& s = sink.channels[c];
    const bool any = s.finite > 0;
    report["channels"].push_back({{"name", spec.channels[c]},
                                  {"min", any ? Json(s.min) : Json()},
                                  {"max", any ? Json(s.max) : Json()},
                                  {"mean", any ? Json(s.Mean()) : Json()},
                                  {"deviation", any ? Json(s.Deviation()) : Json()},
                                  {"nan", s.nan},
                                  {"infinite", s.inf},
                                  {"finite", s.finite}});
  }
  report["constant"] = sink.constant;
  report["monochrome"] = sink.monochrome;
  PrintJson(report);
}

void Print(const Entry& entry, const RenderOptions& render, bool json) {
  const ImageSpec& spec = entry.node.spec();
  StatisticsSink sink(spec.channel_count());
  graph::RenderToSink(entry.node, PixelType::kFloat, sink, render);
  if (json) {
    PrintForPrograms(entry, sink);
    return;
  }

  const auto& stats = sink.channels;
  // An empty or wholly non-finite channel has no extremes.
  const auto shown = [](const ChannelStatistics& c, double v) { return c.finite == 0 ? 0.0 : v; };
  std::cout << sprintf("%s: %4d x %4d, %d channel, %s\n", entry.name, spec.width(), spec.height(),
                       spec.channel_count(), PixelTypeName(spec.type));
  PrintRow("Stats Min", sink, spec.type, true, [&](size_t c) { return shown(stats[c], stats[c].min); });
  PrintRow("Stats Max", sink, spec.type, true, [&](size_t c) { return shown(stats[c], stats[c].max); });
  PrintRow("Stats Avg", sink, spec.type, false, [&](size_t c) { return stats[c].Mean(); });
  PrintRow("Stats StdDev", sink, spec.type, false, [&](size_t c) { return stats[c].Deviation(); });
  PrintCounts("Stats NanCount", sink, [](const ChannelStatistics& c) { return c.nan; });
  PrintCounts("Stats InfCount", sink, [](const ChannelStatistics& c) { return c.inf; });
  PrintCounts("Stats FiniteCount", sink, [](const ChannelStatistics& c) { return c.finite; });
  std::cout << "    Constant: " << (sink.constant ? "Yes" : "No") << "\n";
  if (sink.constant && !sink.first.empty()) {
    PrintRow("Constant Color", sink, spec.type, true, [&](size_t c) { return sink.first[c]; });
  }
  std::cout << "    Monochrome: " << (sink.monochrome ? "Yes" : "No") << std::endl;
}

}  // namespace

ColorExtremes ExtremesOf(const Entry& entry, const RenderOptions& render) {
  StatisticsSink sink(entry.node.spec().channel_count());
  graph::RenderToSink(entry.node, PixelType::kFloat, sink, render);
  ColorExtremes result;
  for (const ChannelStatistics& c : sink.channels) {
    result.min.push_back(c.finite == 0 ? 0 : c.min);
    result.max.push_back(c.finite == 0 ? 0 : c.max);
    result.mean.push_back(c.Mean());
  }
  return result;
}

void PrintStatistics(const Step&, Session& session) {
  const Options& options = session.options();
  std::vector<Entry> all(1, session.Top());
  if (options.all_parts) {
    for (Entry& part : TakeParts(all[0], options)) all.push_back(std::move(part));
  }
  for (const Entry& entry : all) RequireSize(entry);
  if (options.explain || options.dry_run) return;
  for (const Entry& entry : all)
    session.Later([entry, &options] { Print(entry, options.render, options.json); });
}

}  // namespace tessera::cli
