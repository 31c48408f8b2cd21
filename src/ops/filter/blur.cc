// Gaussian and box blurs of any size: the operation, its choice of method, and --blur.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>

#include "base/number_text.h"
#include "base/worker_arenas.h"
#include "graph/op.h"
#include "ops/codes.h"
#include "ops/filter/box/codes.h"
#include "ops/filter/box/running_sum.h"
#include "ops/filter/box/strips.h"
#include "ops/filter/codes/code_sums.h"
#include "ops/filter/codes/integer_sums.h"
#include "ops/filter/filter_ops.h"
#include "ops/filter/frame.h"
#include "ops/filter/gauss/decimated.h"
#include "ops/filter/gauss/recursive.h"
#include "ops/filter/window/methods.h"
#include "ops/filter/window/stage.h"
#include "ops/modifiers.h"
#include "ops/wrap.h"
#include "tessera/error.h"
#include "tessera/ops/accumulate.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/filter.h"

namespace tessera::ops {
namespace {

constexpr double kLargestSigma = 10000;
constexpr int kLargestBox = 65535;
// Boxes of integer pixels up to this side are rounded as exact sums are.
constexpr int kLargestExactBox = 255;

// The normalised samples of a Gaussian out to where the rest is below 4e-7 of the sum; its middle is the
// anchor.
std::vector<double> GaussianRow(double sigma) {
  const int radius = sigma == 0 ? 0 : static_cast<int>(std::ceil(5.1 * sigma));
  std::vector<double> row;
  double sum = 0;
  for (int n = -radius; n <= radius; ++n) {
    const double t = sigma == 0 ? 0 : n / sigma;
    row.push_back(std::exp(-t * t / 2));
    sum += row.back();
  }
  for (double& w : row) w /= sum;
  // Weights that a float cannot hold apart from 0 have no influence.
  while (row.size() > 1 && row.back() < 1e-30) row.erase(row.begin()), row.pop_back();
  return row;
}

std::shared_ptr<const Window> GaussianWindow(const GaussianParams& p) {
  const std::vector<double> row = GaussianRow(p.sigma_x), column = GaussianRow(p.sigma_y);
  return std::make_shared<const Window>(row, static_cast<int>(row.size() / 2), column,
                                        static_cast<int>(column.size() / 2),
                                        WindowOptions{FilterMethod::kSeparable, p.wrap, p.border_value});
}

std::shared_ptr<const Window> BoxWindow(const BoxParams& p) {
  const std::vector<double> row(static_cast<size_t>(p.width), 1.0 / p.width);
  const std::vector<double> column(static_cast<size_t>(p.height), 1.0 / p.height);
  return std::make_shared<const Window>(row, (p.width - 1) / 2, column, (p.height - 1) / 2,
                                        WindowOptions{FilterMethod::kSeparable, p.wrap, p.border_value});
}

bool Finite(const ConstImageView& v, int x, int y) {
  const auto* p = reinterpret_cast<const float*>(v.At(x, y));
  return std::all_of(p, p + v.channels, [](float f) { return std::isfinite(f); });
}

// Recursive or decimated.
class GaussianStage final : public graph::WholeStage {
 public:
  GaussianStage(const GaussianParams& p, bool decimated) : params_(p), decimated_(decimated) {}
  void Run(std::span<const ConstImageView> in, const ImageView& out,
           const graph::Workers& workers) const override {
    if (out.roi.empty()) return;
    Blur(in[0], out, workers);
    // A NaN or infinity fills every line that it is in. Then each sample gets the sum over its own
    // neighbours.
    bool finite = true;
    for (int i = out.roi.x0; i < out.roi.x1; ++i) finite = finite && Finite(out, i, out.roi.y0);
    for (int j = out.roi.y0; j < out.roi.y1; ++j) finite = finite && Finite(out, out.roi.x0, j);
    if (!finite) WindowRun(GaussianWindow(params_), PixelType::kFloat).RunWhole(in[0], out, workers);
  }

 private:
  void Blur(const ConstImageView& in, const ImageView& out, const graph::Workers& workers) const {
    if (decimated_) {
      return RunDecimated(functions_, params_.sigma_x, params_.sigma_y, in, out, params_.wrap,
                          params_.border_value, workers);
    }
    const bool rows = params_.sigma_x > 0, columns = params_.sigma_y > 0;
    const RecursiveGaussian x = rows ? MakeRecursiveGaussian(params_.sigma_x) : RecursiveGaussian{};
    const RecursiveGaussian y = columns ? MakeRecursiveGaussian(params_.sigma_y) : RecursiveGaussian{};
    RunRecursive(functions_.tracks, rows ? &x : nullptr, columns ? &y : nullptr, in, out, params_.wrap,
                 params_.border_value, workers);
  }

  GaussianParams params_;
  bool decimated_;
  DecimatedFunctions functions_ = ChooseDecimated();
};

class BoxStage final : public graph::WholeStage {
 public:
  BoxStage(const BoxParams& p, PixelType type) : params_(p), type_(type) {
    if (!IntegerSums::Applies(type) || p.width > kLargestExactBox || p.height > kLargestExactBox) return;
    const Kernel kernel{p.width,
                        p.height,
                        (p.width - 1) / 2,
                        (p.height - 1) / 2,
                        1,
                        std::vector<double>(static_cast<size_t>(p.width) * static_cast<size_t>(p.height),
                                            1.0 / (double{1} * p.width * p.height))};
    // Samples, rows and columns are rounded once each.
    const double error = 0x1p-22 * std::max(1.0, std::fabs(p.border_value));
    integers_.emplace(type, kernel, WindowOptions{FilterMethod::kRecursive, p.wrap, p.border_value}, error);
  }
  void Run(std::span<const ConstImageView> in, const ImageView& out,
           const graph::Workers& workers) const override {
    const BoxParams& p = params_;
    const int largest = integers_ && SeesCodes(in[0], workers) ? IntegerSums::Largest(type_) : 0;
    if (std::max(p.width, p.height) <= kLargestStripBox) {
      RunBoxStrips(strip_, p.width, p.height, in[0], out, p.wrap, p.border_value, largest, workers);
    } else {
      RunBox(tracks_, p.width, p.height, in[0], out, p.wrap, p.border_value, workers);
    }
    if (!integers_ || largest != 0) return;
    std::vector<int> channels(static_cast<size_t>(out.channels));
    std::iota(channels.begin(), channels.end(), 0);
    const Roi& r = out.roi;
    base::WorkerArenas arenas(workers);
    workers.For(r.height(), [&](int64_t i, int worker) {
      base::Arena& arena = arenas[worker];
      arena.Reset();
      const int y = r.y0 + static_cast<int>(i);
      integers_->Settle(in[0], channels, out.Sub({r.x0, y, r.x1, y + 1}), channels, in[0].roi, arena);
    });
  }

 private:
  // Whether all that boxes see are codes: what an operation before has made of them need not be.
  bool SeesCodes(const ConstImageView& in, const graph::Workers& workers) const {
    const auto value = static_cast<float>(params_.border_value);
    std::atomic<bool> all = params_.wrap != Wrap::kBlack || are_codes_(&value, 1);
    workers.For(in.roi.height(), [&](int64_t i, int) {
      const auto* const row =
          reinterpret_cast<const float*>(in.At(in.roi.x0, in.roi.y0 + static_cast<int>(i)));
      if (!are_codes_(row, in.roi.width() * in.channels)) all = false;
    });
    return all;
  }

  BoxParams params_;
  PixelType type_;
  std::optional<IntegerSums> integers_;  // of integer pixels
  BoxStripFunction strip_ = ChooseBoxStrip();
  BoxTracksFunction tracks_ = ChooseBoxTracks();
  CodesTest are_codes_{type_};
};

// kValid: the larger result is cropped to the pixels whose kernel lies inside.
template <class P>
P WithoutValid(P params) {
  if (params.wrap == Wrap::kValid) params.wrap = Wrap::kClamp;
  return params;
}

class GaussianOp final : public graph::OpWith<GaussianParams>, public graph::LittleMemory {
 public:
  GaussianOp(const GaussianParams& p, PixelType codes) : OpWith(p), codes_(codes), method_(p.method) {
    const auto [least, largest] = std::minmax(p.sigma_x, p.sigma_y);
    const WindowShape shape{.of = WindowShape::kGaussian,
                            .sigma = largest,
                            .least_sigma = least > 0 ? least : largest,
                            .both_axes = least > 0,
                            .renormalizes = p.wrap == Wrap::kRenormalize};
    if (method_ == FilterMethod::kAuto) method_ = CheapestMethod(shape);
    if (method_ == FilterMethod::kDirect) method_ = FilterMethod::kSeparable;
    if (!MethodOf(method_).suits(shape)) {
      throw Error("blur", method_ == FilterMethod::kRecursive
                              ? "found method=recursive with a sigma below 2, expected method=auto or direct"
                              : "found method=decimated with a sigma below 16 or wrap=renormalize, expected "
                                "method=auto");
    }
    if (method_ == FilterMethod::kSeparable) window_ = GaussianWindow(p);
  }
  std::string Name() const override { return "blur"; }
  graph::OpKind Kind() const override { return window_ ? graph::OpKind::kTile : graph::OpKind::kWhole; }
  bool IsIdentity() const override { return params().sigma_x == 0 && params().sigma_y == 0; }
  std::string Describe() const override {
    char text[128];
    std::snprintf(text, sizeof text, "Gaussian, sigma %g x %g, %s, L1 error below %s", params().sigma_x,
                  params().sigma_y, MethodOf(method_).words, MethodOf(method_).gaussian_error);
    return text;
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    return std::make_unique<WindowStage>(window_, context.inputs[0], codes_);
  }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext&) const override {
    return std::make_unique<GaussianStage>(params(), method_ == FilterMethod::kDecimated);
  }
  std::unique_ptr<graph::RowsStage> MakeRowsStage(const ImageSpec& input, Context& context) const override {
    if (method_ != FilterMethod::kDecimated) return nullptr;
    const GaussianParams& p = params();
    return MakeDecimatedRows(p.sigma_x, p.sigma_y, input, p.wrap, p.border_value, context);
  }
  // Large Gaussians take rows but for borders made of rows elsewhere; the others are summed.
  std::shared_ptr<const graph::Op> InLittleMemory() const override {
    const Wrap wrap = params().wrap;
    const bool rows = method_ == FilterMethod::kDecimated && wrap != Wrap::kRepeat && wrap != Wrap::kMirror &&
                      wrap != Wrap::kMirror101;
    if (params().method != FilterMethod::kAuto || window_ || rows) return nullptr;
    GaussianParams p = params();
    p.method = FilterMethod::kSeparable;
    return std::make_shared<const GaussianOp>(p, codes_);
  }
  std::string InParts() const override { return "method=direct"; }

 private:
  const PixelType codes_;
  FilterMethod method_;
  std::shared_ptr<const Window> window_;
};

class BoxOp final : public graph::OpWith<BoxParams>, public graph::LittleMemory {
 public:
  // `codes`: CodesOf the image. The operation keeps it: its stage may be given the same samples as floats.
  BoxOp(const BoxParams& p, PixelType codes) : OpWith(p), codes_(codes) {
    const bool summed = p.method == FilterMethod::kSeparable || p.method == FilterMethod::kDirect;
    in_codes_ = !summed && SumsBoxOfCodes(p, codes);
    const WindowShape shape{.of = WindowShape::kBox, .width = p.width, .height = p.height};
    if (summed || (p.method == FilterMethod::kAuto && CheapestMethod(shape) == FilterMethod::kSeparable))
      window_ = BoxWindow(p);
  }
  std::string Name() const override { return "blur"; }
  graph::OpKind Kind() const override {
    return window_ || in_codes_ ? graph::OpKind::kTile : graph::OpKind::kWhole;
  }
  bool IsIdentity() const override { return params().width == 1 && params().height == 1; }
  std::string Describe() const override {
    return "box " + std::to_string(params().width) + "x" + std::to_string(params().height) +
           (window_ && !in_codes_ ? ", summed" : ", running sums");
  }
  ImageSpec OutputSpec(std::span<const ImageSpec> inputs) const override { return inputs[0]; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    if (in_codes_) return MakeBoxOfCodesStage(params(), codes_, context.inputs[0]);
    return std::make_unique<WindowStage>(window_, context.inputs[0], codes_);
  }
  std::unique_ptr<graph::WholeStage> MakeWholeStage(const graph::StageContext&) const override {
    return std::make_unique<BoxStage>(params(), codes_);
  }
  std::shared_ptr<const graph::Op> InLittleMemory() const override {
    if (params().method != FilterMethod::kAuto || Kind() != graph::OpKind::kWhole) return nullptr;
    BoxParams p = params();
    p.method = FilterMethod::kSeparable;
    return std::make_shared<const BoxOp>(p, codes_);
  }
  std::string InParts() const override { return "method=direct"; }

 private:
  std::shared_ptr<const Window> window_;
  const PixelType codes_;
  bool in_codes_ = false;  // running sums of codes
};

// Rows, then columns, through an accumulation buffer of fixed point.
Node Buffered(const Node& image, const GaussianParams& p) {
  const auto refuse = [&](const std::string& what) {
    throw Error("blur", "found bits=" + std::to_string(p.bits) + " with " + what);
  };
  if (p.method != FilterMethod::kAuto && p.method != FilterMethod::kDirect)
    refuse("another method than direct, expected method=auto or direct");
  if (p.wrap == Wrap::kRenormalize || (p.wrap == Wrap::kBlack && p.border_value != 0)) {
    refuse("wrap=renormalize or a border value, expected black, clamp, repeat, mirror or mirror101");
  }
  Node result = image;
  for (const bool along_row : {true, false}) {
    const std::vector<double> row = GaussianRow(along_row ? p.sigma_x : p.sigma_y);
    const int taps = static_cast<int>(row.size());
    if (taps > kLargestExactBox)
      refuse("a Gaussian of " + std::to_string(taps) + " weights, expected at most 255 (sigma 24.9)");
    if (taps == 1) continue;
    ShiftAccumulateParams s{.taps = row, .width = along_row ? taps : 1, .height = along_row ? 1 : taps};
    s.bits = p.bits, s.wrap = p.wrap;
    result = MadeOf("blur", [&] { return ShiftAccumulate(result, s); });
  }
  return result;
}

// The whole result, or with kValid the part of it that needed nothing beyond the image.
Node Cropped(const Node& node, const Kernel& shape, Wrap wrap) {
  if (wrap != Wrap::kValid) return node;
  return Crop(node, OutputWindow(node.spec().data_window, shape, wrap));
}

}  // namespace

OpInfo BlurInfo() {
  OpInfo info;
  info.name = "blur";
  info.family = "filter";
  info.summary = "Blurs with a Gaussian, a box or any named kernel";
  info.help =
      "--blur WxH convolves with a kernel of that size, as oiiotool: its gaussian has sigma W/4 and ends at "
      "W/2 (--blur with kernel=box, triangle, disk, ... for others). --blur:sigma=S is a whole Gaussian of "
      "standard deviation S pixels, up to 10000; sigma=X,Y for two. method=direct or separable sums all "
      "weights (error 1e-6 of the largest sample, cost grows with sigma); recursive costs the same for "
      "every sigma from 2 on (2e-5), decimated a third of that from sigma 16 on (1e-4); auto takes the "
      "cheapest. A box larger than 9 pixels is computed by running sums at a cost that does not depend on "
      "its size (method=recursive). Methods recursive and decimated, which auto takes, hold the image and the result in "
      "memory whole, but for boxes of 8- and 16-bit images as they come from a file; where --max-memory does not allow "
      "that, auto takes the rows of a Gaussian from sigma 16 on as they come, with the same bits but for images with "
      "NaN or infinities, and sums the weights of the others. Borders are as exact as the middle. bits= models an "
      "accumulation buffer, as --convolve:bits=; with sigma= rows and columns go through it one after the "
      "other.";
  info.bound =
      "the named error times the largest sample nearby; boxes (3 + W + H) u * sum of |weight * sample|, running "
      "sums (2 + log2(W H)) u; other kernels as --convolve";
  info.bound_u = 1;
  info.arguments = {OnlyWith("!sigma", TextModifier("SIZE", "WxH in pixels", "3x3"))};
  ParamInfo sigma =
      OnlyWith("kernel=gaussian", ListModifier("sigma", "0", 2, 0, kLargestSigma,
                                               "standard deviation in pixels, or one for x and one for y"));
  info.modifiers = {
      TextModifier("kernel", "the kernel's name", "gaussian"),
      sigma,
      FilterWrapModifier(),
      BorderValueModifier(),
      MethodModifier({"auto", "direct", "separable", "lowrank", "fft", "recursive", "decimated"}),
      BufferBitsModifier()};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    const Wrap wrap = WrapNamed(a.Text("wrap"));
    const FilterMethod method = MethodNamed(a.Text("method"));
    const double value = a.Number("bordervalue");
    if (a.Given("sigma")) {
      const std::vector<double>& s = a.Numbers("sigma");
      return GaussianBlur(in[0], {s.front(), s.back(), wrap, value, method, a.Integer("bits")});
    }
    const auto [width, height] = ParseSize("blur", a.Text("SIZE"));
    if (a.Text("kernel") == "box" && a.Integer("bits") == 0) {
      const auto odd = [](double size) { return static_cast<int>(std::ceil(size)) | 1; };
      return BoxBlur(in[0], {odd(width), odd(height), wrap, value, method});
    }
    ConvolveParams p;
    p.wrap = wrap, p.border_value = value, p.method = method, p.bits = a.Integer("bits");
    return MadeOf("blur", [&] { return Convolve(in[0], NamedKernel(a.Text("kernel"), width, height), p); });
  };
  info.examples = {"9x9",
                   "sigma=20",
                   "5x3 kernel=triangle wrap=mirror",
                   "21x15 kernel=box",
                   "11x13 kernel=box wrap=repeat",
                   "13x12 kernel=box wrap=renormalize",
                   "25x31 kernel=box wrap=black bordervalue=0.5",
                   "sigma=1.5 wrap=repeat",
                   "sigma=2,5 wrap=mirror method=recursive",
                   "sigma=3 wrap=black method=recursive",
                   "sigma=4,0 wrap=renormalize method=recursive",
                   "sigma=6 wrap=mirror101 method=recursive",
                   "sigma=2 wrap=renormalize",
                   "sigma=16 wrap=mirror",
                   "sigma=17,30 wrap=black bordervalue=0.5",
                   "sigma=20 method=recursive",
                   "sigma=1.5 bits=16"};
  info.identity = "sigma=0";
  return info;
}

}  // namespace tessera::ops

namespace tessera {

Node GaussianBlur(const Node& image, const GaussianParams& p) {
  for (const double sigma : {p.sigma_x, p.sigma_y}) {
    if (!(sigma >= 0 && sigma <= ops::kLargestSigma)) {
      throw Error("blur", "found a sigma of " + base::NumberText(sigma) + ", expected 0 to 10000 pixels");
    }
  }
  if (p.method == FilterMethod::kLowRank || p.method == FilterMethod::kFft) {
    throw Error("blur",
                "found method=lowrank or fft with a Gaussian, expected auto, direct, separable or recursive");
  }
  ops::RequireFilterWrap("blur", p.wrap);
  const GaussianParams whole = ops::WithoutValid(p);
  const Node node =
      p.bits != 0 ? ops::Buffered(image, whole)
                  : ops::InDisplayWindow(image, p.wrap, [&](const Node& framed) {
                      return graph::MakeNode(
                          std::make_shared<const ops::GaussianOp>(whole, ops::CodesOf(framed)), {framed});
                    });
  const auto radius = [](double sigma) { return static_cast<int>(std::ceil(5.1 * sigma)); };
  return ops::Cropped(
      node,
      {2 * radius(p.sigma_x) + 1, 2 * radius(p.sigma_y) + 1, radius(p.sigma_x), radius(p.sigma_y), 1, {}},
      p.wrap);
}

Node GaussianBlur(const Node& image, double sigma) {
  return GaussianBlur(image, GaussianParams{sigma, sigma});
}

Node BoxBlur(const Node& image, const BoxParams& p) {
  if (p.width < 1 || p.height < 1 || p.width > ops::kLargestBox || p.height > ops::kLargestBox) {
    throw Error("blur", "found a box of " + std::to_string(p.width) + "x" + std::to_string(p.height) +
                            ", expected 1x1 to 65535x65535");
  }
  if (p.method == FilterMethod::kLowRank || p.method == FilterMethod::kFft ||
      p.method == FilterMethod::kDecimated) {
    throw Error(
        "blur",
        "found method=lowrank, fft or decimated with a box, expected auto, direct, separable or recursive");
  }
  ops::RequireFilterWrap("blur", p.wrap);
  const BoxParams whole = ops::WithoutValid(p);
  const Node node = ops::InDisplayWindow(image, p.wrap, [&](const Node& framed) {
    return graph::MakeNode(std::make_shared<const ops::BoxOp>(whole, ops::CodesOf(framed)), {framed});
  });
  return ops::Cropped(node, {p.width, p.height, (p.width - 1) / 2, (p.height - 1) / 2, 1, {}}, p.wrap);
}

}  // namespace tessera
