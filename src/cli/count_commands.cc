// Reports on the top image's pixels, in one streamed pass: --colorcount, --rangecheck.
#include <OpenImageIO/strutil.h>

#include <charconv>
#include <cmath>
#include <iostream>

#include "cli/json_report.h"
#include "cli/session.h"
#include "graph/render.h"

namespace tessera::cli {
namespace {

using OIIO::Strutil::sprintf;
using ops::ParamInfo;
using ops::ParamType;

// Comma-separated numbers over `values`, which keep theirs where there are fewer; one alone is for all.
void TakeNumbers(const std::string& subject, const std::string& text, std::vector<float>& values) {
  size_t k = 0;
  for (size_t begin = 0; begin <= text.size(); ++k) {
    const size_t end = std::min(text.find(',', begin), text.size());
    float value = 0;
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, value);
    if (error != std::errc() || stop != text.data() + end)
      throw UsageError(subject, "found \"" + text + "\", expected comma-separated numbers, one a channel");
    if (k < values.size()) values[k] = value;
    begin = end + 1;
  }
  if (k == 1) values.assign(values.size(), values.empty() ? 0 : values[0]);
}

struct Color {
  std::string text;
  std::vector<float> values;
  int64_t count = 0;
};

class ColorSink final : public graph::RowSink {
 public:
  ColorSink(std::vector<Color> colors, std::vector<float> eps)
      : colors(std::move(colors)), eps_(std::move(eps)) {}

  void Write(const ConstImageView& rows) override {
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      const auto* pixel = reinterpret_cast<const float*>(rows.At(rows.roi.x0, y));
      for (int x = 0; x < rows.roi.width(); ++x, pixel += rows.channels) {
        for (Color& color : colors) color.count += Is(color, pixel) ? 1 : 0;
      }
    }
  }

  std::vector<Color> colors;

 private:
  bool Is(const Color& color, const float* pixel) const {
    for (size_t c = 0; c < eps_.size(); ++c) {
      if (!(std::fabs(pixel[c] - color.values[c]) <= eps_[c])) return false;
    }
    return true;
  }

  std::vector<float> eps_;
};

class RangeSink final : public graph::RowSink {
 public:
  RangeSink(std::vector<float> low, std::vector<float> high) : low_(std::move(low)), high_(std::move(high)) {}

  void Write(const ConstImageView& rows) override {
    for (int y = rows.roi.y0; y < rows.roi.y1; ++y) {
      const auto* pixel = reinterpret_cast<const float*>(rows.At(rows.roi.x0, y));
      for (int x = 0; x < rows.roi.width(); ++x, pixel += rows.channels) Count(pixel);
    }
  }

  int64_t below = 0, above = 0, within = 0;

 private:
  void Count(const float* pixel) {
    bool is_below = false, is_above = false;
    for (size_t c = 0; c < low_.size(); ++c) {
      is_below = is_below || pixel[c] < low_[c];
      is_above = is_above || pixel[c] > high_[c];
    }
    below += is_below ? 1 : 0;
    above += is_above ? 1 : 0;
    within += is_below || is_above ? 0 : 1;
  }

  std::vector<float> low_, high_;
};

void CountColors(const Step& step, Session& session) {
  const Entry entry = session.Top();
  const auto channels = static_cast<size_t>(entry.node.spec().channel_count());
  const std::string& list = step.arguments.Text("COLORS");
  const char separator = list.find(':') != std::string::npos ? ':' : ';';
  std::vector<Color> colors;
  for (size_t begin = 0; begin <= list.size();) {
    const size_t end = std::min(list.find(separator, begin), list.size());
    Color color{list.substr(begin, end - begin), std::vector<float>(channels, 0.0F)};
    TakeNumbers(step.written, color.text, color.values);
    colors.push_back(std::move(color));
    begin = end + 1;
  }
  std::vector<float> eps(channels, 0.001F);
  if (step.arguments.Given("eps")) TakeNumbers(step.written, step.arguments.Text("eps"), eps);
  RequireSize(entry);
  if (session.options().explain || session.options().dry_run) return;
  session.Later([entry, colors, eps, &session] {
    ColorSink sink(colors, eps);
    graph::RenderToSink(entry.node, PixelType::kFloat, sink, session.options().render);
    if (session.options().json) {
      Json report = Report("colorcount");
      report["image"] = entry.name;
      for (const Color& color : sink.colors)
        report["colors"].push_back({{"color", color.values}, {"pixels", color.count}});
      PrintJson(report);
      return;
    }
    for (const Color& color : sink.colors)
      std::cout << sprintf("%8d  %s\n", static_cast<long long>(color.count), color.text);
    std::cout.flush();
  });
}

void CheckRange(const Step& step, Session& session) {
  const Entry entry = session.Top();
  const auto channels = static_cast<size_t>(entry.node.spec().channel_count());
  const std::string &min = step.arguments.Text("MIN"), &max = step.arguments.Text("MAX");
  std::vector<float> low(channels, 0.0F), high(channels, 1.0F);
  TakeNumbers(step.written, min, low);
  TakeNumbers(step.written, max, high);
  RequireSize(entry);
  if (session.options().explain || session.options().dry_run) return;
  session.Later([entry, low, high, min, max, &session] {
    RangeSink sink(low, high);
    graph::RenderToSink(entry.node, PixelType::kFloat, sink, session.options().render);
    if (session.options().json) {
      Json report = Report("rangecheck");
      report["image"] = entry.name;
      report["below"] = sink.below;
      report["above"] = sink.above;
      report["within"] = sink.within;
      PrintJson(report);
      return;
    }
    std::cout << sprintf("%8d  < %s\n", static_cast<long long>(sink.below), min)
              << sprintf("%8d  > %s\n", static_cast<long long>(sink.above), max)
              << sprintf("%8d  within range\n", static_cast<long long>(sink.within)) << std::flush;
  });
}

Command Row(const std::string& name, const std::string& summary, std::vector<ParamInfo> arguments,
            void (*run)(const Step&, Session&), const std::string& line) {
  Command c = RowOf("Reports", Effect::kUse, name, 1, summary, std::move(arguments));
  c.run = run;
  c.lines = {line};
  return c;
}

ParamInfo Text(const std::string& name, const std::string& help) {
  return {.name = name, .type = ParamType::kText, .default_value = "", .help = help};
}

}  // namespace

std::vector<Command> CountCommands() {
  std::vector<Command> rows;
  rows.push_back(Row("colorcount", "Counts the pixels of the top image that have the given colours.",
                     {Text("COLORS", "colours with : or ; between them, channels with commas")}, CountColors,
                     "in.exr --colorcount '0,0,0:1,1,1'"));
  rows.back().info.modifiers = {
      Text("eps", "how far a channel may be off: one number a channel; 0.001 where left out")};
  rows.back().info.help =
      "One number is for all channels; else channels that a colour does not name are 0 in it. Integers are counted as [0, 1]. As oiiotool --colorcount.";
  rows.push_back(Row("rangecheck", "Counts the pixels of the top image below and above a range.",
                     {Text("MIN", "the least value, one number a channel; 0 where left out"),
                      Text("MAX", "the largest value, one number a channel; 1 where left out")},
                     CheckRange, "in.exr --rangecheck 0,0,0 1,1,1"));
  rows.back().info.help =
      "A pixel is below where one of its channels is, and may be above as well. As oiiotool --rangecheck.";
  return rows;
}

}  // namespace tessera::cli
