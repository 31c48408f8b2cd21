// Commands that are OpenImageIO's own functions on the image in memory: --box, --line, --point, --text,
// --fft, --pdiff.
#include <charconv>
#include <cmath>
#include <functional>
#include <iostream>

#include "cli/json_report.h"
#include "cli/session.h"
#include "tessera/context.h"
#include "tessera/draw.h"
#include "tessera/error_kind.h"

namespace tessera::cli {
namespace {

using ops::Arguments;
using ops::ParamInfo;
using ops::ParamType;

template <typename T>
std::vector<T> Numbers(const Step& step, const std::string& text, const char* expected) {
  std::vector<T> values;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    T value{};
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, value);
    if (error != std::errc() || stop != text.data() + end)
      throw UsageError(step.written, "found \"" + text + "\", expected " + expected);
    values.push_back(value);
    begin = end + 1;
  }
  return values;
}

std::vector<float> ColorOf(const Step& step) {
  const std::string& text = step.arguments.Text("color");
  if (text.empty()) return {};
  std::vector<float> color = Numbers<float>(step, text, "comma-separated numbers, one a channel");
  constexpr size_t kMost = 1025;  // channels and one
  if (color.size() == 1) color.resize(kMost, color[0]);
  return color;
}

std::vector<int> PointsOf(const Step& step, const std::string& text, size_t least) {
  std::vector<int> points = Numbers<int>(step, text, "X1,Y1,X2,Y2,... in whole pixels");
  if (points.size() < least || points.size() % 2 != 0)
    throw UsageError(step.written, "found " + std::to_string(points.size()) +
                                       " coordinates, expected pairs, at least " + std::to_string(least / 2) +
                                       " of them");
  return points;
}

// Computes the image and has it changed: what follows sees the pixels in memory.
void Change(const Step& step, Session& session, const std::function<Image(const Image&)>& change) {
  RequireSize(session.Top());
  if (session.options().dry_run) return;
  session.ForParts([&](Entry& entry) {
    const PixelType type = entry.SuggestedType();
    try {
      entry.node = FromImage(change(Render(entry.node, PixelType::kFloat, session.options().render)));
    } catch (const Error& e) {
      ThrowAbout(step.written, e);
    }
    entry.suggested = type;
  });
}

template <typename Draw>
void Paint(const Step& step, Session& session, const Draw& draw) {
  Change(step, session, [&](const Image& image) {
    draw(image);
    return image;
  });
}

void PaintBox(const Step& step, Session& session) {
  const std::vector<int> at = PointsOf(step, step.arguments.Text("CORNERS"), 4);
  if (at.size() != 4) throw UsageError(step.written, "found more than two corners, expected X1,Y1,X2,Y2");
  const std::vector<float> color = ColorOf(step);
  Paint(step, session, [&](const Image& image) {
    DrawBox(image, at[0], at[1], at[2], at[3], color, step.arguments.Flag("fill"));
  });
}

void PaintText(const Step& step, Session& session) {
  const Arguments& a = step.arguments;
  // A font is a file too, and one that a stranger names is read by no process of its own.
  if (a.Given("font") && Context::Default().policy().listed_formats)
    throw UsageError(step.written, "found font= under --safe, expected the font that there is");
  TextStyle style;
  style.size = a.Integer("size"), style.shadow = a.Integer("shadow");
  style.font = a.Text("font"), style.x_align = a.Text("xalign"), style.y_align = a.Text("yalign");
  style.color = ColorOf(step);
  Paint(step, session, [&](const Image& image) {
    const Roi& window = image.spec().data_window;
    style.x = a.Given("x") ? a.Integer("x") : window.x0 + window.width() / 2;
    style.y = a.Given("y") ? a.Integer("y") : window.y0 + window.height() / 2;
    DrawText(image, a.Text("TEXT"), style);
  });
}

template <Image (*kFunction)(const Image&)>
void Transform(const Step& step, Session& session) {
  Change(step, session, kFunction);
}

void ComparePerception(const Step&, Session& session) {
  const Options& options = session.options();
  const Entry a = session.Top(1), b = session.Top(0);
  if (a.node.spec().data_window != b.node.spec().data_window ||
      a.node.spec().channel_count() != b.node.spec().channel_count())
    throw DataError("--pdiff", "found images of different windows or channels, expected the same of both");
  RequireSize(a), RequireSize(b);
  if (options.explain || options.dry_run) return;
  session.Later([a, b, limits = session.diff, &session] {
    const Options& options = session.options();
    const Image x = Render(a.node, PixelType::kFloat, options.render),
                y = Render(b.node, PixelType::kFloat, options.render);
    const auto pixels = static_cast<double>(x.spec().width()) * x.spec().height();
    const auto differ = static_cast<double>(PerceptualDifferences(x, y));
    const bool failed = differ > limits.fail_percent / 100 * pixels;
    if (failed) session.exit_code = 1;
    if (options.json) {
      Json report = Report("pdiff");
      report["a"] = a.name;
      report["b"] = b.name;
      report["verdict"] = failed ? "failure" : "pass";
      report["pixels"] = static_cast<int64_t>(pixels);
      report["over_fail"] = static_cast<int64_t>(differ);
      PrintJson(report);
    }
    if (options.quiet || options.json) return;
    std::cout << "Computing perceptual diff of \"" << a.name << "\" vs \"" << b.name << "\"\n";
    if (options.verbose || failed)
      std::cout << "  " << differ << " pixels (" << 100 * differ / pixels
                << "%) failed the perceptual test\n";
    std::cout << (failed ? "FAILURE" : "PASS") << std::endl;
  });
}

Command Row(const std::string& name, const std::string& summary, std::vector<ParamInfo> arguments,
            std::vector<ParamInfo> modifiers, void (*run)(const Step&, Session&), const std::string& line) {
  Command c = RowOf("By OpenImageIO, in memory", Effect::kApply, name, 1, summary, std::move(arguments),
                    std::move(modifiers));
  c.run = run;
  c.lines = {line};
  return c;
}

ParamInfo Text(const std::string& name, const std::string& help, const std::string& value = "") {
  return {.name = name, .type = ParamType::kText, .default_value = value, .help = help};
}

ParamInfo Color() {
  return Text("color", "one number a channel, or one for all; 1 where left out; alpha lays it over");
}

ParamInfo Whole(const std::string& name, const std::string& help, int min, int max,
                const std::string& value = "") {
  return {.name = name,
          .type = ParamType::kInteger,
          .default_value = value,
          .help = help,
          .min = static_cast<double>(min),
          .max = static_cast<double>(max)};
}

constexpr int kFar = 1 << 24;
constexpr char kWhole[] =
    "OpenImageIO does it, on the whole image in memory: what stands before is computed as the command is reached, "
    "and --verify looks at what comes after it.";

}  // namespace

std::vector<Command> DrawCommands() {
  std::vector<Command> rows;
  rows.push_back(Row("box", "Draws a box.", {Text("CORNERS", "X1,Y1,X2,Y2 in pixels, both corners in it")},
                     {Color(),
                      {.name = "fill",
                       .type = ParamType::kFlag,
                       .default_value = "0",
                       .help = "filled, not its edge alone"}},
                     PaintBox, "in.exr --box:color=1,0,0:fill=1 10,10,40,30 -o out.exr"));
  rows.push_back(Row(
      "line", "Draws lines from point to point.", {Text("POINTS", "X1,Y1,X2,Y2,... in pixels")}, {Color()},
      [](const Step& step, Session& session) {
        const std::vector<int> points = PointsOf(step, step.arguments.Text("POINTS"), 4);
        Paint(step, session, [&](const Image& image) { DrawLines(image, points, ColorOf(step)); });
      },
      "in.exr --line:color=1,1,0 5,5,60,40,5,40,5,5 -o out.exr"));
  rows.push_back(Row(
      "point", "Draws points.", {Text("POINTS", "X1,Y1,X2,Y2,... in pixels")}, {Color()},
      [](const Step& step, Session& session) {
        const std::vector<int> points = PointsOf(step, step.arguments.Text("POINTS"), 2);
        Paint(step, session, [&](const Image& image) { DrawPoints(image, points, ColorOf(step)); });
      },
      "in.exr --point:color=0,1,0 20,20,22,20 -o out.exr"));
  rows.push_back(Row("text", "Draws a text.", {Text("TEXT", "the text")},
                     {Whole("x", "where it begins; the middle where left out", -kFar, kFar),
                      Whole("y", "its base line; the middle where left out", -kFar, kFar),
                      Whole("size", "height of the letters, pixels", 1, 4096, "16"),
                      Text("font", "name or file of a font"),
                      Color(),
                      {.name = "xalign",
                       .type = ParamType::kChoice,
                       .default_value = "left",
                       .help = "what lies at x",
                       .choices = {"left", "center", "right"}},
                      {.name = "yalign",
                       .type = ParamType::kChoice,
                       .default_value = "base",
                       .help = "what lies at y",
                       .choices = {"base", "top", "bottom", "center"}},
                      Whole("shadow", "width of a dark rim, pixels", 0, 256, "0")},
                     PaintText, "in.exr --text:x=20:y=40:size=24:color=1,1,1 Harbour -o out.exr"));
  rows.back().any_text = true;
  rows.push_back(Row("fft", "The Fourier transform of the first channel: real and imaginary.", {}, {},
                     Transform<FourierTransform>, "in.exr --fft -d float -o out.exr"));
  rows.push_back(Row("ifft", "The image that has this Fourier transform.", {}, {},
                     Transform<InverseFourierTransform>, "in.exr --fft --ifft -d float -o out.exr"));
  rows.push_back(Row("polar", "Amplitude and phase of complex pixels, two channels.", {}, {},
                     Transform<ToPolar>, "in.exr --fft --polar -d float -o out.exr"));
  rows.push_back(Row("unpolar", "Complex pixels of amplitude and phase, two channels.", {}, {},
                     Transform<FromPolar>, "in.exr --fft --polar --unpolar -d float -o out.exr"));
  rows.push_back(Row("pdiff",
                     "Says whether the two top images, which stay, look different; exit code 1 for FAILURE.",
                     {}, {}, ComparePerception, "a.exr b.exr --pdiff"));
  rows.back().info.inputs = 2;
  rows.back().effect = Effect::kUse;
  for (Command& row : rows) row.info.help = kWhole;
  rows.back().info.help =
      "FAILURE when more than --failpercent of the pixels are told apart by Yee's model of the eye (ImageBufAlgo's "
      "compare_Yee: 100 candela a square metre, 45 degrees of the field of view), where a --diff would count codes. As "
      "oiiotool --pdiff.";
  return rows;
}

}  // namespace tessera::cli
