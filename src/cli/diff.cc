// --diff: compares the two top images in one streamed pass, with the thresholds, report and verdict of
// oiiotool.
#include <OpenImageIO/strutil.h>

#include <cmath>
#include <iostream>

#include "cli/json_report.h"
#include "cli/session.h"
#include "graph/render.h"
#include "tessera/ops/channels.h"

namespace tessera::cli {
namespace {

using OIIO::Strutil::sprintf;

// The distance of two samples: equal infinities and two NaNs are no difference, one of them alone is an
// infinite one.
double Distance(float a, float b) {
  if (a == b || (std::isnan(a) && std::isnan(b))) return 0;
  const double d = std::abs(double{a} - double{b});
  return std::isfinite(d) ? d : std::numeric_limits<double>::infinity();
}

// Rows hold the channels of the first image, then those of the second.
class DiffSink final : public graph::RowSink {
 public:
  DiffSink(int first, int second, const DiffLimits& limits)
      : first_(first), second_(second), limits_(limits) {}

  void Write(const ConstImageView& rows) override {
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      for (int x = rows.roi.x0; x < rows.roi.x1; ++x) {
        Compare(x, y, reinterpret_cast<const float*>(rows.At(x, y)));
      }
    }
  }

  int channels() const { return std::max(first_, second_); }

  double sum = 0, squares = 0, largest = 1, max_error = 0;
  int64_t pixels = 0, warnings = 0, failures = 0;
  int max_x = 0, max_y = 0, max_channel = 0;
  std::vector<float> worst_a, worst_b;  // the pixels that differ most

 private:
  void Compare(int x, int y, const float* a) {
    const float* b = a + first_;
    double worst = 0;
    for (int c = 0; c < channels(); ++c) {
      const float va = c < first_ ? a[c] : 0, vb = c < second_ ? b[c] : 0;
      const double d = Distance(va, vb);
      sum += d;
      squares += d * d;
      largest = std::max({largest, std::abs(double{va}), std::abs(double{vb})});
      worst = std::max(worst, d);
      if (d > max_error) {
        max_error = d;
        max_x = x, max_y = y, max_channel = c;
        worst_a.assign(a, a + first_);
        worst_b.assign(b, b + second_);
      }
    }
    ++pixels;
    if (worst > limits_.warn) ++warnings;
    if (worst > limits_.fail) ++failures;
  }

  int first_, second_;
  DiffLimits limits_;
};

std::string Values(const std::vector<float>& pixel) {
  std::string text;
  for (float v : pixel) text += (text.empty() ? "" : ", ") + sprintf("%g", v);
  return text;
}

void PrintReport(const DiffSink& d, const DiffLimits& limits, const ImageSpec& a, const ImageSpec& b) {
  const double samples = std::max<double>(1, static_cast<double>(d.pixels) * d.channels());
  const double rms = std::sqrt(d.squares / samples),
               percent = 100.0 / std::max<double>(1, static_cast<double>(d.pixels));
  std::cout << sprintf("  Mean error = %g\n  RMS error = %g\n  Peak SNR = %g\n  Max error  = %g",
                       d.sum / samples, rms, 20 * std::log10(d.largest / rms), d.max_error);
  if (d.max_error > 0) {
    const auto& names = d.max_channel < a.channel_count() ? a.channels : b.channels;
    std::cout << sprintf(" @ (%d, %d, %s)  values are %s vs %s", d.max_x, d.max_y,
                         names[static_cast<size_t>(d.max_channel)], Values(d.worst_a), Values(d.worst_b));
  }
  std::cout << sprintf("\n  %d pixels (%.3g%%) over %g\n", d.warnings,
                       percent * static_cast<double>(d.warnings), limits.warn)
            << sprintf("  %d pixels (%.3g%%) over %g\n", d.failures,
                       percent * static_cast<double>(d.failures), limits.fail);
}

Json JsonOf(const DiffSink& d, const Entry& a, const Entry& b, const std::string& verdict,
            const DiffLimits& limits) {
  const double samples = std::max<double>(1, static_cast<double>(d.pixels) * d.channels());
  const double rms = std::sqrt(d.squares / samples);
  Json report = Report("diff");
  report["a"] = a.name;
  report["b"] = b.name;
  report["verdict"] = verdict;
  report["mean_error"] = d.sum / samples;
  report["rms_error"] = rms;
  report["psnr"] = 20 * std::log10(d.largest / rms);
  report["max_error"] = d.max_error;
  report["pixels"] = d.pixels;
  report["over_fail"] = d.failures;
  report["over_warn"] = d.warnings;
  report["fail"] = limits.fail;
  report["warn"] = limits.warn;
  if (d.max_error > 0)
    report["worst"] = {
        {"x", d.max_x}, {"y", d.max_y}, {"channel", d.max_channel}, {"a", d.worst_a}, {"b", d.worst_b}};
  return report;
}

Command Threshold(const std::string& name, const std::string& summary, double max, const std::string& unit,
                  void (*run)(const Step&, Session&)) {
  Command c;
  c.info.name = name;
  c.info.inputs = 0;
  c.info.summary = summary;
  c.info.arguments = {{.name = "X",
                       .type = ops::ParamType::kNumber,
                       .default_value = "",
                       .help = unit,
                       .min = 0,
                       .max = max}};
  c.group = "Reports";
  c.effect = Effect::kSetting;
  c.applies_to = "diff";
  c.run = run;
  return c;
}

// `pair` holds the channels of both.
void Compare(const Entry& a, const Entry& b, const Node& pair, const DiffLimits& limits, Session& session) {
  const Options& options = session.options();
  const ImageSpec &sa = a.node.spec(), &sb = b.node.spec();
  DiffSink sink(sa.channel_count(), sb.channel_count(), limits);
  graph::RenderToSink(pair, PixelType::kFloat, sink, options.render);

  const auto pixels = static_cast<double>(sink.pixels);
  const bool failed = static_cast<double>(sink.failures) > limits.fail_percent / 100 * pixels ||
                      sink.max_error > limits.hard_fail;
  const bool warned = static_cast<double>(sink.warnings) > limits.warn_percent / 100 * pixels ||
                      sink.max_error > limits.hard_warn;
  if (failed) session.exit_code = 1;
  if (options.json) PrintJson(JsonOf(sink, a, b, failed ? "failure" : warned ? "warning" : "pass", limits));
  if (options.quiet || options.json) return;
  std::cout << "Computing diff of \"" << a.name << "\" vs \"" << b.name << "\"\n";
  if (options.verbose || failed || warned) PrintReport(sink, limits, sa, sb);
  std::cout << (failed ? "FAILURE" : warned ? "WARNING" : "PASS") << std::endl;
}

}  // namespace

namespace {

void DiffPair(const Entry& a, const Entry& b, Session& session) {
  const Options& options = session.options();
  const ImageSpec &sa = a.node.spec(), &sb = b.node.spec();
  if (sa.display_window != sb.display_window) {
    throw Error("--diff", sprintf("found images of different sizes: %s is %d x %d, %s is %d x %d", a.name,
                                  sa.display_window.width(), sa.display_window.height(), b.name,
                                  sb.display_window.width(), sb.display_window.height()));
  }
  const Roi window = Union(sa.data_window, sb.data_window);
  const Node pair = AppendChannels(Crop(a.node, window), Crop(b.node, window));
  RequireSize(a), RequireSize(b);
  if (options.explain || options.dry_run) return;
  session.Later([a, b, pair, limits = session.diff, &session] { Compare(a, b, pair, limits, session); });
}

}  // namespace

void DiffImages(const Step& step, Session& session) {
  const Options& options = session.options();
  Entry a = session.Top(1), b = session.Top(0);
  std::vector<Entry> more_a, more_b;
  if (options.all_parts) {
    more_a = TakeParts(a, options), more_b = TakeParts(b, options);
  } else {
    LeaveParts(a, step.written, options);
    LeaveParts(b, step.written, options);
  }
  DiffPair(a, b, session);
  for (size_t k = 0; k < std::min(more_a.size(), more_b.size()); ++k) DiffPair(more_a[k], more_b[k], session);
  if (more_a.size() == more_b.size()) return;
  session.Later([a, b, x = more_a.size() + 1, y = more_b.size() + 1, &session] {
    session.exit_code = 1;
    if (session.options().quiet) return;
    if (session.options().json) {
      Json report = Report("parts");
      report["a"] = a.name, report["b"] = b.name;
      report["verdict"] = "failure";
      report["images_in_a"] = x, report["images_in_b"] = y;
      PrintJson(report);
      return;
    }
    std::cout << "Images had differing numbers of subimages (" << x << " vs " << y << ")\nFAILURE"
              << std::endl;
  });
}

std::vector<Command> ReportCommands() {
  std::vector<Command> rows;
  Command diff;
  diff.info.name = "diff";
  diff.info.inputs = 2;
  diff.info.summary = "Reports the difference of the two top images, which stay; exit code 1 for FAILURE.";
  diff.info.help =
      "FAILURE when more than --failpercent of the pixels differ by more than --fail in some channel, or any "
      "by more than --hardfail; WARNING (exit code 0) likewise. Data windows may differ, what one image "
      "lacks is black; display windows may not. A NaN equals a NaN. With -a every image of two files is compared, each with "
      "a report of its own; another number of them is a FAILURE. Outputs of the line are written whatever "
      "the verdict.";
  diff.group = "Reports";
  diff.effect = Effect::kUse;
  diff.run = DiffImages;
  Command stats;
  stats.info.name = "printstats";
  stats.info.inputs = 1;
  stats.info.summary =
      "Prints minimum, maximum, mean, deviation and counts per channel of the top image, which stays.";
  stats.group = "Reports";
  stats.effect = Effect::kUse;
  stats.aliases = {"stats"};
  stats.run = PrintStatistics;
  rows = {diff, stats};

  constexpr double kAny = 1e38;
  rows.push_back(Threshold("fail", "Difference above which a pixel fails (1e-6).", kAny,
                           "absolute difference",
                           [](const Step& s, Session& t) { t.diff.fail = s.arguments.Number("X"); }));
  rows.push_back(Threshold("failpercent", "Share of failing pixels that is allowed (0).", 100, "percent",
                           [](const Step& s, Session& t) { t.diff.fail_percent = s.arguments.Number("X"); }));
  rows.push_back(Threshold("hardfail", "Difference that no pixel may exceed (infinity).", kAny,
                           "absolute difference",
                           [](const Step& s, Session& t) { t.diff.hard_fail = s.arguments.Number("X"); }));
  rows.push_back(Threshold("warn", "Difference above which a pixel warns (1e-6).", kAny,
                           "absolute difference",
                           [](const Step& s, Session& t) { t.diff.warn = s.arguments.Number("X"); }));
  rows.push_back(Threshold("warnpercent", "Share of warning pixels that is allowed (0).", 100, "percent",
                           [](const Step& s, Session& t) { t.diff.warn_percent = s.arguments.Number("X"); }));
  rows.push_back(Threshold("hardwarn", "Difference above which any pixel warns (infinity).", kAny,
                           "absolute difference",
                           [](const Step& s, Session& t) { t.diff.hard_warn = s.arguments.Number("X"); }));
  return rows;
}

}  // namespace tessera::cli
