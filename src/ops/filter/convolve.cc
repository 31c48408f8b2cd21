// Convolution with a named kernel or a kernel image, and the operations that are one named kernel each.
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "graph/op.h"
#include "ops/codes.h"
#include "ops/filter/box/codes.h"
#include "ops/filter/filter_ops.h"
#include "ops/filter/frame.h"
#include "ops/filter/window/stage.h"
#include "ops/filter/window/window.h"
#include "ops/modifiers.h"
#include "ops/wrap.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {
namespace {

// As a correlation, divided.
Kernel Prepared(Kernel kernel, const ConvolveParams& params) {
  if (params.divisor != 0) {
    for (double& w : kernel.weights) w /= params.divisor;
  }
  return params.correlate ? kernel : Reversed(kernel);
}

class ConvolveOp final : public graph::OpWith<Convolution> {
 public:
  // `codes`: CodesOf the image.
  ConvolveOp(const Convolution& c, int alpha, PixelType codes)
      : ConvolveOp(c, alpha, codes, c.kernel_image ? nullptr : MakeWindow(c.kernel, c.params, alpha)) {}
  std::string Name() const override { return "convolve"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  std::string Describe() const override {
    const Kernel& k = params().kernel;
    return window_ ? window_->Describe()
                   : std::to_string(k.width) + "x" + std::to_string(k.height) + " image";
  }
  bool IsIdentity() const override {
    const Kernel& k = params().kernel;
    const double divisor = params().params.divisor;
    return window_ && k.planes == 1 && k.width == 1 && k.height == 1 &&
           k.weights[0] == (divisor == 0 ? 1 : divisor) && params().params.bias == 0;
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override {
    ImageSpec out = inputs[0];
    const int planes = params().kernel_image ? inputs[1].channel_count() : params().kernel.planes;
    if (planes != 1 && planes != out.channel_count()) {
      throw DataError("convolve", "found a kernel of " + std::to_string(planes) + " planes for an image of " +
                                      std::to_string(out.channel_count()) +
                                      " channels, expected 1 or as many");
    }
    const Kernel& k = params().kernel;
    out.data_window =
        OutputWindow(out.data_window, params().params.correlate ? k : Mirrored(k), params().params.wrap);
    return out;
  }
  bool NeedsWhole(int k) const override { return k == 1; }
  std::vector<bool> NeededChannels(int input, const std::vector<bool>& result,
                                   const ImageSpec& in) const override {
    if (input == 1) return std::vector<bool>(in.channels.size(), true);
    std::vector<bool> needed = result;
    if (params().params.bias != 0 && alpha_ >= 0) needed[static_cast<size_t>(alpha_)] = true;
    return needed;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    const std::shared_ptr<const Window> window =
        window_ ? window_ : MakeWindow(FromPixels(context.whole[1]), params().params, alpha_);
    return std::make_unique<WindowStage>(window, context.inputs[0], codes_);
  }

 private:
  ConvolveOp(const Convolution& c, int alpha, PixelType codes, std::shared_ptr<const Window> window)
      : OpWith(WithMethod(c, window.get())), alpha_(alpha), codes_(codes), window_(std::move(window)) {}
  // The method that was chosen, by which the error is bounded, where the kernel is known.
  static Convolution WithMethod(Convolution c, const Window* window) {
    if (window != nullptr) c.params.method = window->method();
    return c;
  }
  // Only the anchor turned: what OutputWindow needs.
  static Kernel Mirrored(const Kernel& k) {
    return {k.width, k.height, k.width - 1 - k.anchor_x, k.height - 1 - k.anchor_y, 1, {}};
  }
  static std::shared_ptr<const Window> MakeWindow(const Kernel& kernel, const ConvolveParams& p, int alpha) {
    RequireKernel("convolve", kernel);
    return std::make_shared<const Window>("convolve", Prepared(kernel, p),
                                          WindowOptions{p.method, p.wrap, p.border_value, p.bias, alpha});
  }
  Kernel FromPixels(const ConstImageView& pixels) const {
    Kernel kernel = params().kernel;
    kernel.planes = pixels.channels;
    kernel.weights.clear();
    for (int c = 0; c < pixels.channels; ++c) {
      double sum = 0;
      const size_t first = kernel.weights.size();
      for (int y = pixels.roi.y0; y < pixels.roi.y1; ++y) {
        for (int x = pixels.roi.x0; x < pixels.roi.x1; ++x) {
          kernel.weights.push_back(*reinterpret_cast<const float*>(pixels.At(x, y, c)));
          sum += kernel.weights.back();
        }
      }
      if (!params().normalize || sum == 0) continue;
      for (size_t i = first; i < kernel.weights.size(); ++i) kernel.weights[i] /= sum;
    }
    return kernel;
  }

  int alpha_;
  PixelType codes_;
  std::shared_ptr<const Window> window_;  // null until the kernel image is there
};

// Colours divided by alpha, `filter` on them alone, multiplied again.
template <class F>
Node OnColorsOnly(const Node& image, F filter) {
  const ImageSpec& spec = image.spec();
  if (spec.alpha < 0) return filter(image);
  std::vector<ChannelChoice> colors, order;
  for (int c = 0; c < spec.channel_count(); ++c) {
    if (c != spec.alpha) colors.push_back({c, 0, spec.channels[static_cast<size_t>(c)]});
  }
  if (colors.empty()) return image;
  const Node filtered = filter(SelectChannels(Unpremultiply(image), colors));
  const Roi& window = filtered.spec().data_window;
  const Node alpha = SelectChannels(window == spec.data_window ? image : Crop(image, window),
                                    std::vector<ChannelChoice>{{spec.alpha, 0, ""}});
  const Node all = AppendChannels(filtered, alpha);
  for (int c = 0, color = 0; c < spec.channel_count(); ++c) {
    order.push_back(
        {c == spec.alpha ? spec.channel_count() - 1 : color++, 0, spec.channels[static_cast<size_t>(c)]});
  }
  return Premultiply(SelectChannels(all, order));
}

// Through an accumulation buffer of fixed point.
Node Buffered(const Node& image, const Kernel& kernel, const ConvolveParams& p) {
  const auto refuse = [&](const char* what) {
    throw Error(
        "convolve",
        "found bits=" + std::to_string(p.bits) + " with " + what +
            ", expected one kernel by name and wrap=black, clamp, repeat, mirror, mirror101 or valid");
  };
  if (kernel.planes != 1) refuse("a kernel per channel");
  if (p.bias != 0 || p.preserve_alpha) refuse("a bias or preserved alpha");
  if (p.wrap == Wrap::kRenormalize || (p.wrap == Wrap::kBlack && p.border_value != 0)) {
    refuse("wrap=renormalize or a border value");
  }
  if (p.method != FilterMethod::kAuto && p.method != FilterMethod::kDirect)
    refuse("another method than direct");
  const Kernel k = Prepared(kernel, p);
  ShiftAccumulateParams s{k.weights, k.width, k.height, k.anchor_x, k.anchor_y, p.bits};
  s.wrap = p.wrap == Wrap::kValid ? Wrap::kClamp : p.wrap;
  const Node result = MadeOf("convolve", [&] { return ShiftAccumulate(image, s); });
  return p.wrap == Wrap::kValid ? Crop(result, OutputWindow(image.spec().data_window, k, p.wrap)) : result;
}

Node Apply(const Node& image, const Node& kernel_image, Convolution convolution) {
  const ConvolveParams& p = convolution.params;
  if (!std::isfinite(p.divisor) || !std::isfinite(p.bias) || !std::isfinite(p.border_value)) {
    throw Error("convolve", "found a divisor, bias or border value that is not finite, expected numbers");
  }
  if (convolution.params.bits != 0) {
    if (kernel_image) throw Error("convolve", "found bits= with a kernel image, expected a kernel by name");
    return Buffered(image, convolution.kernel, convolution.params);
  }
  const bool colors_only = std::exchange(convolution.params.preserve_alpha, false);
  const int alpha = colors_only ? -1 : image.spec().alpha;
  const auto convolved = [&](const Node& framed) {
    std::vector<Node> inputs = {framed};
    if (kernel_image) inputs.push_back(kernel_image);
    return graph::MakeNode(std::make_shared<const ConvolveOp>(convolution, alpha, CodesOf(framed)), inputs);
  };
  const auto filter = [&](const Node& samples) { return InDisplayWindow(samples, p.wrap, convolved); };
  return colors_only ? OnColorsOnly(image, filter) : filter(image);
}

// Modifiers of every operation with a fixed kernel.
std::vector<ParamInfo> CommonModifiers() {
  return {FilterWrapModifier(), BorderValueModifier(), MethodModifier(),
          FlagModifier("preservealpha", "filter the colours, divided by alpha, and leave alpha alone"),
          BufferBitsModifier()};
}
ConvolveParams CommonParams(const Arguments& a) {
  ConvolveParams p;
  p.wrap = WrapNamed(a.Text("wrap"));
  p.border_value = a.Number("bordervalue");
  p.method = MethodNamed(a.Text("method"));
  p.preserve_alpha = a.Flag("preservealpha");
  p.bits = a.Integer("bits");
  return p;
}

constexpr char kBound[] =
    "(6 + a) u * S, S the sum of |weight * sample|, a the additions in a row by the method that is chosen "
    "(--explain): direct H * ceil(W / 4), separable 3 + H + ceil(W / 4), lowrank 12 + 2 (H + ceil(W / 4)) + "
    "min(W, H); fft: see help. Kernels up to 5x5 of sum 0 are summed as differences, exactly 0 on flat images: "
    "S has the largest sample times the sum of |weight| more";
constexpr char kSource[] = "Source: McReynolds et al. 1997, 12.3 (kernels, with its mistakes mended).";

// Weights on the line, row by row: a square of them, or as many as `size` says.
Kernel WeightsOf(const std::string& text, const std::string& size) {
  Kernel kernel;
  kernel.weights.clear();
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    const char *const last = word.data() + word.size(), *const first = word.data() + word.starts_with('+');
    double weight = 0;
    const auto [rest, error] = std::from_chars(first, last, weight);
    if (error != std::errc() || rest != last || word.starts_with("+-")) {
      throw Error("convolve",
                  "found '" + word + "' among the weights of kernel=, expected numbers with commas between");
    }
    kernel.weights.push_back(weight);
    begin = end + 1;
  }
  const size_t count = kernel.weights.size();
  double width = std::round(std::sqrt(static_cast<double>(count))), height = width;
  if (!size.empty()) std::tie(width, height) = ParseSize("convolve", size);
  if (width * height != static_cast<double>(count) || width != std::floor(width)) {
    throw Error("convolve",
                "found " + std::to_string(count) + " weights in kernel=, expected " +
                    (size.empty() ? "a square of them (4, 9, 16, 25, ...), or size=WIDTHxHEIGHT with it"
                                  : "as many as size=" + size + " has"));
  }
  kernel.width = static_cast<int>(width), kernel.height = static_cast<int>(height);
  kernel.anchor_x = kernel.width / 2, kernel.anchor_y = kernel.height / 2;
  return kernel;
}
// What kernel= says: a name, or weights.
Kernel KernelOf(const Arguments& a) {
  const std::string& text = a.Text("kernel");
  const bool weights = std::string_view("+-.0123456789").find(text[0]) != std::string_view::npos;
  Kernel kernel =
      weights ? WeightsOf(text, a.Given("size") ? a.Text("size") : "") : NamedKernel(text, a.Text("size"));
  if (a.Given("anchor")) {
    kernel.anchor_x = static_cast<int>(a.Numbers("anchor")[0]);
    kernel.anchor_y = static_cast<int>(a.Numbers("anchor")[1]);
  }
  return kernel;
}

OpInfo FixedRow(const char* name, const char* summary) {
  OpInfo info;
  info.name = name;
  info.family = "filter";
  info.summary = summary;
  info.help += " A kernel image is held in memory whole.";
  info.bound = kBound;
  info.bound_u = 1;
  info.modifiers = CommonModifiers();
  return info;
}

}  // namespace

OpInfo ConvolveInfo() {
  OpInfo info = FixedRow("convolve", "Convolves an image with a kernel");
  info.inputs = 2;
  info.operands = [](const Arguments& a) { return a.Text("kernel").empty() ? 2 : 1; };
  info.help =
      "IMAGE KERNEL --convolve takes the kernel from an image, one channel for all or one per channel, whose "
      "pixel (0, 0) lies over the pixel computed; --convolve:kernel=NAME takes one image and a kernel by "
      "name, of size= where the name has no size of its own (--help kernel lists the names); "
      "--convolve:kernel=1,2,1,2,4,2,1,2,1:divisor=16 takes its weights, row by row, a square of them or "
      "size=WxH, whose middle (column W/2, row H/2, rounded down), or anchor=, lies over the pixel computed. "
      "The result is the sum over the kernel of weight(i, j) * image(x - i, y - j), divided by divisor, plus bias times "
      "the pixel's alpha, as SVG's feConvolveMatrix; correlate=1 adds i and j instead, which is what "
      "oiiotool does and differs for unsymmetric kernels. A kernel image is divided by its sum (normalize=0 "
      "leaves it, and so does a sum of 0). Kernels are up to 255x255; a tap that is 0 has no influence, not "
      "even on NaN. Methods: direct sums every tap; separable needs a product of a column and a row, found "
      "by factorisation; lowrank sums several products (NaN then spreads over the whole rectangle), and "
      "--explain prints the bound of what is cut off; fft works in blocks, whose error is up to 16 u times "
      "the root of the sum of squared weights times that of the block's squared deviations from its mean, and "
      "where lights are above 16 times the mean it works in double. "
      "auto takes the cheapest within the bound. Results of 8- and 16-bit images are exact sums of integers, "
      "rounded once. bits= models an accumulation buffer: shifted images are added in fixed point, "
      "as --shiftaccum says. " +
      std::string(kSource);
  std::vector<ParamInfo> own = {
      TextModifier("kernel", "a kernel's name, or its weights with commas between, instead of an image"),
      OnlyWith(
          "kernel",
          TextModifier("size", "WxH of a named kernel, in pixels, or of weights that are no square", "3x3")),
      FlagModifier("correlate", "do not turn the kernel round"),
      NumberModifier("divisor", "0", "the sum is divided by it; 0: by 1"),
      NumberModifier("bias", "0", "added, times alpha"),
      OnlyWith("kernel", NumbersModifier("anchor", "", 2, 0, 254,
                                         "column and row of the kernel that lie over the pixel, from 0")),
      OnlyWith("!kernel", FlagModifier("normalize", "divide a kernel image by its sum", "1"))};
  info.modifiers.insert(info.modifiers.begin(), own.begin(), own.end());
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    ConvolveParams p = CommonParams(a);
    p.correlate = a.Flag("correlate");
    p.divisor = a.Number("divisor");
    p.bias = a.Number("bias");
    if (a.Text("kernel").empty()) return Convolve(in[0], in[1], p, a.Flag("normalize"));
    return Convolve(in[0], KernelOf(a), p);
  };
  info.identity = "kernel=box size=1x1";
  info.examples = {"kernel=disk size=7x5",
                   "kernel=smooth3",
                   "kernel=emboss_ne wrap=mirror divisor=2 bias=0.5",
                   "kernel=lanczos3 size=15x15 wrap=repeat",
                   "kernel=gaussian size=9x7 wrap=renormalize anchor=1,5",
                   "kernel=highpass5 wrap=mirror101 preservealpha=1 correlate=1",
                   "kernel=disk size=9x9 method=lowrank wrap=valid",
                   "kernel=triangle size=5x5 wrap=black bordervalue=0.25 method=direct",
                   "kernel=disk size=23x19 wrap=mirror",
                   "kernel=1,2,1,2,4,2,1,2,1 divisor=16",
                   "kernel=-1,.5,2.5e-1,3,0,-2 size=2x3 anchor=0,2 wrap=repeat"};
  return info;
}

OpInfo EmbossInfo() {
  OpInfo info = FixedRow("emboss", "Relief: differences along one of eight directions");
  info.help =
      "Convolves with the emboss kernel named by the direction from dark to light; sums are 0, so a flat "
      "image "
      "gives exactly 0. " +
      std::string(kSource);
  info.arguments = {ChoiceArgument("DIRECTION", {"N", "S", "E", "W", "NE", "NW", "SE", "SW"},
                                   "a point of the compass, N up")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    std::string name = "emboss_";
    for (const char c : a.Text("DIRECTION"))
      name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return MadeOf("emboss", [&] { return Convolve(in[0], NamedKernel(name), CommonParams(a)); });
  };
  info.examples = {"N", "SW wrap=repeat", "E preservealpha=1"};
  return info;
}

OpInfo LaplacianInfo() {
  OpInfo info = FixedRow("laplacian", "Sum of second differences: 0 1 0 / 1 -4 1 / 0 1 0");
  info.help =
      "As oiiotool's --laplacian. Differences from the centre are summed, so flat images give exactly 0. The "
      "course's kernels of that name are its negative: --convolve:kernel=laplacian3, laplacian5.";
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return MadeOf("laplacian", [&] { return Convolve(in[0], NamedKernel("laplacian"), CommonParams(a)); });
  };
  info.examples = {"", "wrap=mirror101"};
  return info;
}

OpInfo HighPassInfo() {
  OpInfo info = FixedRow("highpass", "Sharpens with the 3x3 or 5x5 high-pass kernel");
  info.help =
      "Sums are 1, so flat images stay. The 5x5 is the course's with the signs of its edge midpoints mended; "
      "as printed it sums to -7 (--convolve:kernel=highpass5_course).";
  info.arguments = {ChoiceArgument("SIZE", {"3", "5"}, "3 or 5")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    return MadeOf("highpass",
                  [&] { return Convolve(in[0], NamedKernel("highpass" + a.Text("SIZE")), CommonParams(a)); });
  };
  info.examples = {"3", "5 wrap=black"};
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node Convolve(const Node& image, const Kernel& kernel, const ConvolveParams& params) {
  ops::RequireFilterWrap("convolve", params.wrap);
  ops::RequireKernel("convolve", kernel);
  return ops::Apply(image, {}, {kernel, params, false, false});
}

Node Convolve(const Node& image, const Node& kernel, const ConvolveParams& params, bool normalize) {
  const Roi& window = kernel.spec().data_window;
  // The kernel's pixels are not there yet: only its shape is checked.
  Kernel shape{window.width(), window.height(), -window.x0, -window.y0, 1, {}};
  shape.weights.assign(static_cast<size_t>(std::max<int64_t>(0, std::min<int64_t>(window.pixels(), 65025))),
                       0);
  ops::RequireFilterWrap("convolve", params.wrap);
  ops::RequireKernel("convolve", shape);
  shape.weights.clear();
  return ops::Apply(image, kernel, {shape, params, true, normalize});
}

Node KernelImage(const Kernel& kernel) {
  ops::RequireKernel("kernel", kernel);
  ImageSpec spec(kernel.width, kernel.height, kernel.planes);
  spec.data_window = spec.display_window = {-kernel.anchor_x, -kernel.anchor_y,
                                            kernel.width - kernel.anchor_x, kernel.height - kernel.anchor_y};
  const Image image(spec);
  for (int c = 0; c < kernel.planes; ++c) {
    for (int y = 0; y < kernel.height; ++y) {
      for (int x = 0; x < kernel.width; ++x) {
        image.at<float>(x - kernel.anchor_x, y - kernel.anchor_y, c) = static_cast<float>(kernel.at(x, y, c));
      }
    }
  }
  return FromImage(image);
}

}  // namespace tessera
