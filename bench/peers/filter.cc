// Peers of the filters: OpenCV, OpenImageIO, and this library's other ways to blur, all judged by the same
// oracle.
#include "tessera/ops/filter.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "contestant.h"
#include "tessera/error.h"
#include "tessera/render.h"

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "peers/opencv_rows.h"
#endif

namespace tessera::bench {
namespace {

class Filter final : public Contestant {
 public:
  Filter(std::string name, std::function<void()> prepare, std::function<void()> run)
      : name_(std::move(name)), prepare_(std::move(prepare)), run_(std::move(run)) {}
  std::string Name() const override { return name_; }
  void Prepare() override { prepare_(); }
  void Run() override { run_(); }

 private:
  std::string name_;
  std::function<void()> prepare_, run_;
};

// What a step of ours is to others: a kernel, a box, a Gaussian; nothing when its border is not the clamped
// edge.
struct Meaning {
  std::optional<Kernel> kernel;
  bool separable = false;
  int box_width = 0, box_height = 0;
  double sigma = 0;
};
std::optional<Meaning> MeaningOf(const Setting& setting) {
  if (setting.task.steps.size() != 1 || setting.frame.type != PixelType::kFloat || !setting.frame.plain())
    return {};
  const Step& step = setting.task.steps[0];
  Meaning m;
  const auto size = [](const std::string& text) {
    const size_t x = text.find('x');
    return std::pair{std::stod(text), std::stod(x == std::string::npos ? text : text.substr(x + 1))};
  };
  if (step.op() == "convolve" && !step.arguments.Text("kernel").empty()) {
    const auto [w, h] = size(step.arguments.Text("size"));
    m.kernel = NamedKernel(step.arguments.Text("kernel"), w, h);
    return m;
  }
  if (step.op() != "blur") return {};
  if (step.arguments.Given("sigma")) {
    m.sigma = step.Numbers("sigma").front();
    return m;
  }
  const auto [w, h] = size(step.arguments.Text("SIZE"));
  const std::string& name = step.arguments.Text("kernel");
  if (name == "box") {
    m.box_width = static_cast<int>(w), m.box_height = static_cast<int>(h);
  } else {
    m.kernel = NamedKernel(name, w, h);
    m.separable = name == "gaussian" || name == "triangle";
  }
  return m;
}

// This library with other nodes for the same picture.
std::unique_ptr<Contestant> Ours(const Setting& setting, const std::string& name, const Node& node) {
  RenderOptions options;
  options.threads = setting.threads;
  return std::make_unique<Filter>(
      name, [] {}, [node, options, out = setting.frame.output] { RenderInto(node, out.view(), options); });
}

}  // namespace

std::unique_ptr<Contestant> MakeOpenCvFilter([[maybe_unused]] const Setting& setting) {
#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
  const std::optional<Meaning> m = MeaningOf(setting);
  if (!m) return nullptr;
  const auto wrap = [](const Image& image) {
    const ImageView v = image.view();
    return cv::Mat(v.roi.height(), v.roi.width(), CV_32FC4, v.data, static_cast<size_t>(v.row_stride));
  };
  const cv::Mat in = wrap(setting.frame.inputs[0]), out = wrap(setting.frame.output);
  const auto make = [&](const char* name, std::function<void(const cv::Mat&, cv::Mat&)> call) {
    const OpenCvRows rows(setting.threads, [call](const auto& bands, cv::Mat& to) { call(bands[0], to); });
    return std::make_unique<Filter>(
        name, [] { cv::setNumThreads(1); }, [rows, in, out] { rows({in}, out); });
  };
  constexpr int kBorder = cv::BORDER_REPLICATE;
  if (m->sigma > 0) {
    return make("OpenCV GaussianBlur", [s = m->sigma](const cv::Mat& from, cv::Mat& to) {
      cv::GaussianBlur(from, to, cv::Size(), s, s, kBorder);
    });
  }
  if (m->box_width > 0) {
    return make("OpenCV blur",
                [size = cv::Size(m->box_width, m->box_height)](const cv::Mat& from, cv::Mat& to) {
                  cv::blur(from, to, size, cv::Point(-1, -1), kBorder);
                });
  }
  const Kernel& k = *m->kernel;
  if (m->separable) {
    cv::Mat row(1, k.width, CV_32F), column(k.height, 1, CV_32F);
    double middle = 0;
    for (int x = 0; x < k.width; ++x) middle += k.at(x, k.height / 2);
    for (int x = 0; x < k.width; ++x)
      row.at<float>(0, x) = static_cast<float>(k.at(x, k.height / 2) / middle);
    for (int y = 0; y < k.height; ++y) {
      double sum = 0;
      for (int x = 0; x < k.width; ++x) sum += k.at(x, y);
      column.at<float>(y, 0) = static_cast<float>(sum);
    }
    return make("OpenCV sepFilter2D", [row, column](const cv::Mat& from, cv::Mat& to) {
      cv::sepFilter2D(from, to, -1, row, column, cv::Point(-1, -1), 0, kBorder);
    });
  }
  cv::Mat kernel(k.height, k.width, CV_32F);
  // filter2D correlates.
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x)
      kernel.at<float>(y, x) = static_cast<float>(k.at(k.width - 1 - x, k.height - 1 - y));
  }
  return make("OpenCV filter2D", [kernel](const cv::Mat& from, cv::Mat& to) {
    cv::filter2D(from, to, -1, kernel, cv::Point(-1, -1), 0, kBorder);
  });
#else
  return nullptr;
#endif
}

// Larger kernels take OpenImageIO minutes.
std::unique_ptr<Contestant> MakeOiioFilter(const Setting& setting) {
  const std::optional<Meaning> m = MeaningOf(setting);
  constexpr int kLargest = 25;
  if (!m || !m->kernel || m->kernel->width * m->kernel->height > kLargest) return nullptr;
  const auto wrap = [](const Image& image) {
    return OIIO::ImageBuf(OIIO::ImageSpec(image.spec().width(), image.spec().height(), 4, OIIO::TypeFloat),
                          image.view().data);
  };
  const Kernel& k = *m->kernel;
  OIIO::ImageSpec spec(k.width, k.height, 1, OIIO::TypeFloat);
  spec.x = -k.anchor_x, spec.y = -k.anchor_y;
  const auto kernel = std::make_shared<OIIO::ImageBuf>(spec);
  for (int y = 0; y < k.height; ++y) {
    for (int x = 0; x < k.width; ++x) {
      const float w = static_cast<float>(k.at(k.width - 1 - x, k.height - 1 - y));
      kernel->setpixel(x + spec.x, y + spec.y, &w, 1);
    }
  }
  const auto in = std::make_shared<OIIO::ImageBuf>(wrap(setting.frame.inputs[0]));
  const auto out = std::make_shared<OIIO::ImageBuf>(wrap(setting.frame.output));
  return std::make_unique<Filter>(
      "OpenImageIO convolve", [] {},
      [in, out, kernel, threads = setting.threads] {
        if (!OIIO::ImageBufAlgo::convolve(*out, *in, *kernel, false, {}, threads))
          throw Error("OpenImageIO", out->geterror());
      });
}

std::unique_ptr<Contestant> MakeRecursiveBlur(const Setting& setting) {
  const std::optional<Meaning> m = MeaningOf(setting);
  if (!m || m->sigma < 2) return nullptr;
  const GaussianParams p{.sigma_x = m->sigma, .sigma_y = m->sigma, .method = FilterMethod::kRecursive};
  return Ours(setting, "tessera recursive", GaussianBlur(FromImage(setting.frame.inputs[0]), p));
}

std::unique_ptr<Contestant> MakeDecimatedBlur(const Setting& setting) {
  const std::optional<Meaning> m = MeaningOf(setting);
  if (!m || m->sigma < 16) return nullptr;
  const GaussianParams p{.sigma_x = m->sigma, .sigma_y = m->sigma, .method = FilterMethod::kDecimated};
  return Ours(setting, "tessera decimated", GaussianBlur(FromImage(setting.frame.inputs[0]), p));
}

namespace {

// Sums that end before 5.1 sigma.
std::unique_ptr<Contestant> Ending(const Setting& setting, int sigmas) {
  const std::optional<Meaning> m = MeaningOf(setting);
  if (!m || m->sigma <= 0 || std::ceil(sigmas * m->sigma) > 127) return nullptr;
  const int radius = static_cast<int>(std::ceil(sigmas * m->sigma));
  Kernel k{2 * radius + 1, 2 * radius + 1, radius, radius, 1, {}};
  double sum = 0;
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) {
      k.weights.push_back(std::exp(-0.5 * (x * x + y * y) / (m->sigma * m->sigma)));
      sum += k.weights.back();
    }
  }
  for (double& w : k.weights) w /= sum;
  return Ours(setting, "tessera summed to " + std::to_string(sigmas) + " sigma",
              Convolve(FromImage(setting.frame.inputs[0]), k));
}

}  // namespace

std::unique_ptr<Contestant> MakeShortBlur(const Setting& setting) { return Ending(setting, 2); }
// Where others end.
std::unique_ptr<Contestant> MakeMiddleBlur(const Setting& setting) { return Ending(setting, 3); }
std::unique_ptr<Contestant> MakeLongBlur(const Setting& setting) { return Ending(setting, 4); }

// Three boxes of the odd width whose variances come nearest.
std::unique_ptr<Contestant> MakeBoxesBlur(const Setting& setting) {
  const std::optional<Meaning> m = MeaningOf(setting);
  if (!m || m->sigma < 1) return nullptr;
  const int width = 2 * static_cast<int>(std::lround((std::sqrt(4 * m->sigma * m->sigma + 1) - 1) / 2)) + 1;
  Node node = FromImage(setting.frame.inputs[0]);
  for (int i = 0; i < 3; ++i) node = BoxBlur(node, {.width = width, .height = width});
  return Ours(setting, "tessera three boxes", node);
}

}  // namespace tessera::bench
