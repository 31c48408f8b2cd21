// Line integral convolution as an operation: its images, its stages, what happens to the sums.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/flow/lines.h"
#include "ops/flow/prepare.h"
#include "ops/wrap.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/flow.h"

namespace tessera::ops::flow {
namespace {

constexpr char kName[] = "lic";
constexpr int kSharedFrom = 64;  // steps each way from which kAuto shares lines

// From dark blue over green to yellow: dark to bright, so that it reads without colours too.
std::array<float, 3> ColorOf(float t) {
  static constexpr float kStops[5][3] = {{0.16f, 0.20f, 0.55f},
                                         {0.12f, 0.46f, 0.66f},
                                         {0.20f, 0.70f, 0.50f},
                                         {0.70f, 0.85f, 0.30f},
                                         {1.0f, 0.93f, 0.45f}};
  const float at = 4 * std::clamp(t, 0.0f, 1.0f);
  const int i = std::min(3, static_cast<int>(at));
  const float f = at - static_cast<float>(i);
  std::array<float, 3> c{};
  for (size_t k = 0; k < 3; ++k) c[k] = kStops[i][k] + f * (kStops[i + 1][k] - kStops[i][k]);
  return c;
}

// The picture's lines, and how sums become samples.
class Picture {
 public:
  Picture(const LicParams& p, const graph::StageContext& context)
      : p_(p), window_(context.output.data_window) {
    const size_t field = p.with_image ? 1 : 0;
    const ConstImageView image = p.with_image ? context.whole[0] : ConstImageView();
    // Two channels are a vector, whatever they are called.
    const int alpha = context.inputs[field].alpha >= 2 ? context.inputs[field].alpha : -1;
    prepared_ = Prepare(p, context.whole[field], alpha, image, window_, context.workers);
    if (p.contrast == LicContrast::kRescale) {
      rescales_ = true;
      for (const int level : {0, 1, 2, 3}) {
        if (level == 0 || p.magnitude == LicMagnitude::kNoise)
          contrasts_.push_back(ContrastsOf(p, p.with_image ? 1 : p.spot << level));
      }
    }
    mean_ = static_cast<float>(prepared_.mean);
  }

  const Lines& lines() const { return prepared_.lines; }
  // Channels that the lines give: the image's, or 1.
  int channels() const { return prepared_.lines.channels; }
  // Region of the picture counted from its first pixel.
  Roi Local(const Roi& r) const {
    return {r.x0 - window_.x0, r.y0 - window_.y0, r.x1 - window_.x0, r.y1 - window_.y0};
  }

  // Lines for channels `first` and up to three more, for an image of many.
  Lines Group(int first, int most) const {
    Lines l = prepared_.lines;
    l.texture = l.texture == nullptr ? nullptr : l.texture + first;
    l.channels = std::min(most, l.channels - first);
    return l;
  }

  // Whether the convolution of a region is the result's, as it stands.
  bool IsResult(const ImageView& out, std::span<const int> listed) const {
    return !rescales_ && IsSingle(out, listed);
  }
  // From the convolution of a region, channels() floats a pixel, to the result's channels listed.
  void Finish(const Roi& local, const float* sums, const ImageView& out, std::span<const int> listed) const {
    const Lines& l = lines();
    const int width = local.width();
    for (int y = local.y0; y < local.y1; ++y) {
      auto* to = reinterpret_cast<float*>(out.At(out.roi.x0, out.roi.y0 + y - local.y0));
      const float* from = sums + ptrdiff_t{y - local.y0} * width * channels();
      for (int x = local.x0; x < local.x1; ++x, from += channels(), to += out.channels) {
        const bool masked = l.mask != nullptr && l.mask[ptrdiff_t{y} * l.width + x] != 0;
        std::array<float, 3> color{};
        if (p_.magnitude == LicMagnitude::kColor) color = ColorOf(prepared_.SizeAt(x, y));
        const float contrast = masked || !rescales_ ? 1.0f : ContrastAt(x, y);
        for (int i = 0; i < out.channels; ++i) {
          const int c = listed.empty() ? i : listed[static_cast<size_t>(i)];
          to[i] = masked ? 0 : Sample(from, c, color, contrast);
        }
      }
    }
  }

 private:
  // One channel of the lines to one of the result.
  bool IsSingle(const ImageView& out, std::span<const int> listed) const {
    const bool first = listed.empty() || (listed.size() == 1 && listed[0] == 0);
    return channels() == 1 && out.channels == 1 && first && p_.magnitude != LicMagnitude::kColor &&
           lines().mask == nullptr;
  }
  // What deviations from the mean are multiplied by at a pixel.
  float ContrastAt(int x, int y) const {
    if (prepared_.IsStill(x, y)) return 1;
    const Lines& l = lines();
    const bool grows = p_.magnitude == LicMagnitude::kNoise;
    const auto level = static_cast<size_t>(grows ? prepared_.SpotLevelAt(x, y) : 0);
    const std::vector<float>& by_taps = contrasts_[level];
    if (l.reach == nullptr) return by_taps.back();
    return by_taps[static_cast<size_t>(
        std::min(static_cast<float>(l.taps), l.reach[ptrdiff_t{y} * l.width + x]))];
  }
  float Sample(const float* sums, int channel, const std::array<float, 3>& color, float contrast) const {
    const auto shown = [&](float v) { return contrast == 1 ? v : mean_ + contrast * (v - mean_); };
    if (p_.with_image) return shown(sums[channel]);
    const bool colored = p_.magnitude == LicMagnitude::kColor;
    if (channel == (colored ? 3 : 1)) return 1;  // alpha
    const float v = shown(sums[0]);
    return colored ? color[static_cast<size_t>(channel)] * (0.25f + 1.5f * v) : v;
  }

  const LicParams p_;
  Roi window_;
  Prepared prepared_;
  bool rescales_ = false;
  std::vector<std::vector<float>> contrasts_;  // by octaves of the noise's spots, then by taps
  float mean_ = 0.5f;
};

// Lines of one channel that go to an image of one.
LineOutput OutputTo(const Roi& local, const ImageView& out) {
  return {local, reinterpret_cast<float*>(out.data), out.row_stride / 4, 1};
}

class DirectStage final : public graph::TileStage {
 public:
  DirectStage(const LicParams& p, const graph::StageContext& context)
      : picture_(p, context),
        follow_(p.integrator == LicIntegrator::kCell ? FindCellLines() : FindDirectLines()) {
    for (int c = 0; c < picture_.channels(); c += kMostChannels)
      groups_.push_back(picture_.Group(c, kMostChannels));
  }
  Roi InputRoi(int, const Roi&) const override { return {}; }
  // Small enough for threads to end together.
  graph::TileSize Preferred() const override { return {128, 64}; }
  void Run(const graph::TileArgs& args) const override {
    const Roi local = picture_.Local(args.out.roi);
    if (picture_.IsResult(args.out, args.channels))
      return follow_(picture_.lines(), OutputTo(local, args.out));
    const int channels = picture_.channels();
    float* const sums =
        args.scratch.Allocate<float>(static_cast<size_t>(local.pixels()) * static_cast<size_t>(channels));
    for (size_t k = 0; k < groups_.size(); ++k) {
      follow_(groups_[k], {local, sums + k * kMostChannels, ptrdiff_t{local.width()} * channels, channels});
    }
    picture_.Finish(local, sums, args.out, args.channels);
  }

 private:
  Picture picture_;
  FollowLines follow_;
  std::vector<Lines> groups_;  // of an image of many channels
};

class SharedStage final : public graph::WholeStage {
 public:
  SharedStage(const LicParams& p, const graph::StageContext& context)
      : picture_(p, context), share_(FindSharedLines()) {}
  void Run(std::span<const ConstImageView>, const ImageView& out,
           const graph::Workers& workers) const override {
    const Roi all = picture_.Local(out.roi);
    const int side = SharedPartSide(all.width(), all.height());
    const int across = (all.width() + side - 1) / side, down = (all.height() + side - 1) / side;
    struct Memory {
      SharedScratch scratch;
      std::vector<float> sums;
    };
    std::vector<Memory> memory(static_cast<size_t>(workers.count()));
    workers.For(int64_t{across} * down, [&](int64_t i, int worker) {
      const int x = static_cast<int>(i % across) * side, y = static_cast<int>(i / across) * side;
      const Roi part = Intersection({x, y, x + side, y + side}, all);
      const ImageView to =
          out.Sub({part.x0 + out.roi.x0, part.y0 + out.roi.y0, part.x1 + out.roi.x0, part.y1 + out.roi.y0});
      Memory& m = memory[static_cast<size_t>(worker)];
      if (picture_.IsResult(to, {})) return share_(picture_.lines(), OutputTo(part, to), m.scratch);
      const int channels = picture_.channels();
      m.sums.resize(static_cast<size_t>(part.pixels()) * static_cast<size_t>(channels));
      for (int c = 0; c < channels; ++c) {
        share_(picture_.Group(c, 1), {part, m.sums.data() + c, ptrdiff_t{part.width()} * channels, channels},
               m.scratch);
      }
      picture_.Finish(part, m.sums.data(), to, {});
    });
  }

 private:
  Picture picture_;
  ShareLines share_;
};

class LicOp final : public graph::OpWith<LicParams> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return kName; }
  graph::OpKind Kind() const override {
    return params().method == LicMethod::kShared ? graph::OpKind::kWhole : graph::OpKind::kTile;
  }
  bool NeedsWhole(int) const override { return true; }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    const LicParams& p = params();
    const ImageSpec& field = inputs[p.with_image ? 1 : 0];
    if (field.channel_count() < 2) {
      throw DataError(kName, "the field has " + std::to_string(field.channel_count()) +
                                 " channel, expected two: the vector's components");
    }
    if (p.with_image) return inputs[0];
    const bool colored = p.magnitude == LicMagnitude::kColor;
    ImageSpec spec = field;
    spec.channels = DefaultChannelNames((colored ? 3 : 1) + (p.alpha ? 1 : 0));
    spec.alpha = p.alpha ? spec.channel_count() - 1 : -1;
    if (p.width > 0 || p.height > 0) {
      const Roi& w = field.data_window;
      const int width = p.width > 0 ? p.width : w.width(), height = p.height > 0 ? p.height : w.height();
      spec.data_window = spec.display_window = {0, 0, width, height};
    }
    return spec;
  }
  std::string Describe() const override {
    return std::string(kName) + " L=" + std::to_string(TapsOf(params()));
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<DirectStage>(params(), context);
  }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext& context) const override {
    return std::make_unique<SharedStage>(params(), context);
  }
};

void RequireRange(const char* what, double v, double low, double high) {
  if (v >= low && v <= high) return;
  const auto text = [](double n) {
    std::string s = std::to_string(n);
    return s.substr(0, s.find_last_not_of('0') + 1);
  };
  throw Error(kName,
              std::string("found ") + what + " " + text(v) + ", expected " + text(low) + " to " + text(high));
}

// The method that is used, or Error for parameters that make no picture.
LicMethod Check(const LicParams& p) {
  RequireRange("a length of", p.length, 0, 100000);
  RequireRange("a step of", p.step, 1.0 / 16, 16);
  RequireRange("a gain of", p.gain, 0, 100);
  RequireRange("a phase of", p.phase, -1e6, 1e6);
  RequireRange("waves", p.waves, 0, 1000);
  RequireRange("a noise spot of", p.spot, 1, 64);
  RequireRange("a smallest vector of", p.smallest, 0, 1);
  RequireRange("a width of", p.width, 0, 1 << 20);
  RequireRange("a height of", p.height, 0, 1 << 20);
  RequireWrap(kName, p.wrap, {Wrap::kRenormalize, Wrap::kClamp, Wrap::kRepeat});
  if (!std::isfinite(p.scale_x) || !std::isfinite(p.scale_y))
    throw Error(kName, "found a scale that is not finite");
  if (p.kernel == LicKernel::kUser) {
    if (p.weights.size() % 2 == 0) {
      throw Error(kName, "found " + std::to_string(p.weights.size()) + " weights, expected an odd number");
    }
    for (const double w : p.weights) RequireRange("a weight of", w, 0, 1e30);
    if (!(std::accumulate(p.weights.begin(), p.weights.end(), 0.0) > 0)) {
      throw Error(kName, "found weights that sum to 0, expected a positive sum");
    }
  }
  const bool shares =
      p.integrator != LicIntegrator::kCell && p.magnitude != LicMagnitude::kLength && !p.speed;
  if (p.method == LicMethod::kShared && !shares) {
    throw Error(kName,
                "shared lines were asked for, expected neither integrator cell, magnitude length nor speed");
  }
  if (p.method != LicMethod::kAuto) return p.method;
  // Weights of one's own may be meant to the tap.
  const bool is_long = std::lround(p.length / p.step) >= kSharedFrom;
  return shares && p.kernel != LicKernel::kUser && is_long ? LicMethod::kShared : LicMethod::kDirect;
}

// Lines of an image with the channel "A" of a mask, made steeper across lines: ten times themselves, less
// nine times the mean of the 3 x 3 pixels around that are not masked.
Node Sharpened(const Node& lines) {
  const Node mean = Unpremultiply(Convolve(lines, NamedKernel("box", 3, 3)));
  const Node sharp = WeightedSum({lines, mean}, {.weights = {10, -9}});
  std::vector<ChannelChoice> choices;
  const int last = lines.spec().channel_count() - 1;
  for (int c = 0; c < last; ++c) choices.push_back({c, 0, ""});
  return AppendChannels(SelectChannels(sharp, choices), SelectChannels(lines, {{last, 0, "A"}}));
}

Node Make(LicParams params, std::vector<Node> inputs);

// Two passes over the same lines (Okada and Kao 1997).
Node MakeTwice(LicParams params, const std::vector<Node>& inputs) {
  const bool with_image = inputs.size() == 2;
  if (params.magnitude == LicMagnitude::kColor || params.magnitude == LicMagnitude::kNoise) {
    throw Error(kName, "found magnitude color or noise with two passes, expected none or length");
  }
  if (params.contrast == LicContrast::kRescale)
    throw Error(kName, "found contrast rescale with two passes, expected none or equalize");
  if (params.contrast == LicContrast::kAuto) params.contrast = LicContrast::kEqualize;
  params.passes = 1;
  LicParams first = params;
  first.contrast = LicContrast::kNone;
  // Waves move along lines that stay.
  if (first.kernel == LicKernel::kRipple || first.kernel == LicKernel::kRamp) first.kernel = LicKernel::kBox;
  LicParams mask;
  mask.length = 0, mask.alpha = true, mask.wrap = params.wrap, mask.units = params.units;
  const Node& field = inputs.back();
  first.alpha = !with_image;
  Node lines = Make(first, inputs);
  if (with_image && lines.spec().alpha >= 0)
    throw Error(kName, "found two passes and an image with alpha, expected one without: --ch takes channels");
  if (with_image) {
    const Roi& window = lines.spec().data_window;
    if (window.width() != field.spec().data_window.width() ||
        window.height() != field.spec().data_window.height())
      throw DataError(kName,
                      "found a field of another size than the image, expected equal sizes for two passes");
    lines = AppendChannels(lines, SelectChannels(Make(mask, {field}), {{1, 0, "A"}}));
  }
  const bool alpha = params.alpha && !with_image;
  const Node lined = Make(params, {Sharpened(lines), field});
  if (alpha) return lined;
  std::vector<ChannelChoice> choices;
  for (int c = 0; c + 1 < lined.spec().channel_count(); ++c) choices.push_back({c, 0, ""});
  return SelectChannels(lined, choices);
}

Node Make(LicParams params, std::vector<Node> inputs) {
  RequireRange("a number of passes of", params.passes, 1, 2);
  if (params.passes == 2) return MakeTwice(params, inputs);
  params.method = Check(params);
  params.with_image = inputs.size() == 2;
  if (params.with_image && params.magnitude == LicMagnitude::kColor) {
    throw Error(kName, "found magnitude color with an image, expected the library's own noise");
  }
  if (params.contrast == LicContrast::kAuto) {
    const bool plain = params.with_image || params.speed;
    params.contrast = plain ? LicContrast::kNone : LicContrast::kRescale;
  }
  if (params.contrast != LicContrast::kEqualize) {
    return graph::MakeNode(std::make_shared<const LicOp>(params), std::move(inputs));
  }
  // Masked pixels must not count: alpha tells them, whether it is wanted or not.
  const bool hidden = !params.with_image && !params.alpha;
  if (hidden) params.alpha = true;
  const Node equal = Equalize(graph::MakeNode(std::make_shared<const LicOp>(params), std::move(inputs)));
  if (!hidden) return equal;
  return SelectChannels(equal, params.magnitude == LicMagnitude::kColor ? "0,1,2" : "0");
}

}  // namespace
}  // namespace tessera::ops::flow

namespace tessera {

Node Lic(const Node& field, const LicParams& params) { return ops::flow::Make(params, {field}); }

Node Lic(const Node& image, const Node& field, const LicParams& params) {
  return ops::flow::Make(params, {image, field});
}

LicParams LicFrame(LicParams params, int frame, int frames) {
  if (frames < 1 || frame < 1 || frame > frames) {
    throw Error(ops::flow::kName, "found frame " + std::to_string(frame) + " of " + std::to_string(frames) +
                                      ", expected 1 to the number of frames");
  }
  params.kernel = LicKernel::kRipple;
  params.phase += static_cast<double>(frame - 1) / frames;
  return params;
}

}  // namespace tessera
