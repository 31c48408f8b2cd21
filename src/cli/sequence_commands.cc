// Commands that read several frames at once: --motionblur.
#include <cmath>
#include <numbers>
#include <numeric>

#include "cli/frames.h"
#include "cli/limits.h"
#include "cli/messages.h"
#include "cli/session.h"
#include "tessera/io.h"
#include "tessera/ops/accumulate.h"

namespace tessera::cli {
namespace {

using ops::ParamInfo;
using ops::ParamType;

constexpr size_t kMostFrames = 1000;  // files that are open at once

// Which frames of the sequence a step reads: its own list, a window about the current frame, or those in the
// name.
std::vector<int> FramesOf(const Step& step, const Session& session) {
  const ops::Arguments& a = step.arguments;
  if (a.Given("frames")) return ParseFrameRange("--motionblur:frames", a.Text("frames"));
  std::vector<int> frames;
  if (a.Given("window")) {
    const std::vector<double>& window = a.Numbers("window");
    if (window[0] > window[1]) {
      throw UsageError("--motionblur:window",
                       "found a first frame after the last, expected FIRST,LAST with FIRST <= LAST");
    }
    const double centre = a.Number("step") * session.frame;
    for (double f = std::ceil(centre + window[0] - 1e-9); f <= centre + window[1] + 1e-9; ++f) {
      if (f < 0) continue;  // before the sequence
      frames.push_back(static_cast<int>(f));
    }
  }
  return frames;
}

// Weights of n frames that sum to 1, by the shape of the shutter.
std::vector<double> ShutterWeights(const std::string& shape, size_t n) {
  std::vector<double> weights;
  for (size_t i = 0; i < n; ++i) {
    const double t = 2 * (static_cast<double>(i) + 0.5) / static_cast<double>(n) - 1;
    weights.push_back(shape == "tent"   ? 1 - std::fabs(t)
                      : shape == "hann" ? 0.5 + 0.5 * std::cos(std::numbers::pi * t)
                                        : 1.0);
  }
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& w : weights) w /= sum;
  return weights;
}

void BlurMotion(const Step& step, Session& session) {
  const ops::Arguments& a = step.arguments;
  const std::string& name = a.Text("SEQUENCE");
  const std::vector<std::string> files =
      SequenceFiles(name, FramesOf(step, session), session.options().frame_padding);
  if (files.empty() || files.size() > kMostFrames) {
    throw UsageError(name, "found " + std::to_string(files.size()) + " frames, expected 1 to " +
                               std::to_string(kMostFrames));
  }
  RequireFrames(session.options(), name, files.size());
  std::vector<double> weights =
      a.Given("weights") ? a.Numbers("weights") : ShutterWeights(a.Text("shutter"), files.size());
  if (weights.size() != files.size()) {
    throw UsageError("--motionblur:weights", "found " + std::to_string(weights.size()) +
                                                 " weights, expected " + std::to_string(files.size()) +
                                                 ", one per frame");
  }
  std::vector<Node> frames;
  for (const std::string& file : files) {
    if (session.options().verbose) std::fprintf(Messages(), "tessera: reading %s\n", file.c_str());
    frames.push_back(Read(file, {.codec = session.options().codec, .formats = session.options().formats}));
  }
  session.Push({WeightedSum(frames, {std::move(weights), a.Integer("bits")}), name, {}});
}

}  // namespace

std::vector<Command> SequenceCommands() {
  Command c;
  c.info.name = "motionblur";
  c.info.inputs = 0;
  c.info.summary = "Pushes the weighted mean of several frames of a sequence.";
  c.info.help =
      "SEQUENCE is a file name with # or %04d for the frame number. frames= lists the frames, as --frames "
      "does; or window=FIRST,LAST takes those from step * F + FIRST to step * F + LAST for every frame F of "
      "the line (--frames), so that sub-frames rendered 8 per frame are blurred by window=0,7:step=8; or the "
      "name brings a range, shot.1-8#.exr. shutter= shapes the weights, which sum to 1; weights= gives them, "
      "one per frame, and they are kept as asked: the papers' trail, half a still background and half spread "
      "over ten frames, is weights=0.5,0.05,0.05,... All frames are added in one pass, in double, rounded "
      "once; bits= models a fixed-point accumulation buffer.";
  c.info.bound = "1 u * |result| + 2^-29 u * (sum of |weight * value|): 1 ULP";
  c.info.arguments = {
      {.name = "SEQUENCE", .type = ParamType::kText, .default_value = "", .help = "a file name with #"}};
  c.info.modifiers = {{.name = "frames",
                       .type = ParamType::kText,
                       .default_value = "",
                       .help = "frames such as 1-8 or 1-15x2",
                       .only_with = "!window"},
                      {.name = "window",
                       .type = ParamType::kNumbers,
                       .default_value = "",
                       .help = "first and last frame, counted from the current one",
                       .min = -1e6,
                       .max = 1e6,
                       .min_count = 2,
                       .max_count = 2},
                      {.name = "step",
                       .default_value = "1",
                       .help = "frames of the sequence per frame of the line",
                       .min = 1e-3,
                       .max = 1e6,
                       .only_with = "window"},
                      {.name = "shutter",
                       .type = ParamType::kChoice,
                       .default_value = "box",
                       .help = "how the weights run over the frames",
                       .choices = {"box", "tent", "hann"},
                       .only_with = "!weights"},
                      {.name = "weights",
                       .type = ParamType::kNumbers,
                       .default_value = "",
                       .help = "one weight per frame",
                       .min_count = 1,
                       .max_count = static_cast<int>(kMostFrames)},
                      {.name = "bits",
                       .type = ParamType::kInteger,
                       .default_value = "0",
                       .help = "binary places of the accumulation buffer, 8 to 32; 0 is exact",
                       .min = 0,
                       .max = 32}};
  c.group = "Images";
  c.effect = Effect::kPush;
  c.run = BlurMotion;
  return {c};
}

}  // namespace tessera::cli
