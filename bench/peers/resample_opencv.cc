// OpenCV as a peer of resampling: scaleAdd per image, INTER_AREA, remap with maps computed beforehand.
#include "contestant.h"

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)

#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "peers/opencv_rows.h"

namespace tessera::bench {
namespace {

cv::Mat Wrap(const Image& image) {
  const ImageView v = image.view();
  return cv::Mat(v.roi.height(), v.roi.width(), CV_MAKETYPE(CV_32F, v.channels), v.data,
                 static_cast<size_t>(v.row_stride));
}

class OpenCvResample final : public Contestant {
 public:
  OpenCvResample(std::string name, int threads, std::function<void()> run)
      : name_(std::move(name)), threads_(threads), run_(std::move(run)) {}
  std::string Name() const override { return name_; }
  void Prepare() override { cv::setNumThreads(threads_); }
  void Run() override { run_(); }

 private:
  std::string name_;
  int threads_;
  std::function<void()> run_;
};

// The interpolation that equals a filter of ours; -1 for none.
int Interpolation(const Step& step) {
  const std::string& filter = step.arguments.Text("filter");
  return filter == "triangle" ? cv::INTER_LINEAR : filter == "simon" ? cv::INTER_CUBIC : -1;
}

// Source positions (indices) of a warp's result pixels, computed as OpenCV's users do, in double.
cv::Mat MapOfMatrix(const std::vector<double>& m, cv::Size size) {
  const cv::Matx33d forward(m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]);
  const cv::Matx33d inverse = forward.inv();
  cv::Mat map(size, CV_32FC2);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const cv::Vec3d p = inverse * cv::Vec3d(x + 0.5, y + 0.5, 1);
      map.at<cv::Vec2f>(y, x) =
          cv::Vec2f(static_cast<float>(p[0] / p[2] - 0.5), static_cast<float>(p[1] / p[2] - 0.5));
    }
  }
  return map;
}

cv::Mat MapOfCoordinates(const Image& st, cv::Size source) {
  const Roi& w = st.spec().data_window;
  cv::Mat map(w.height(), w.width(), CV_32FC2);
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      map.at<cv::Vec2f>(y, x) =
          cv::Vec2f(static_cast<float>(st.at<float>(x, y, 0) * static_cast<double>(source.width) - 0.5),
                    static_cast<float>(st.at<float>(x, y, 1) * static_cast<double>(source.height) - 0.5));
    }
  }
  return map;
}

}  // namespace

std::unique_ptr<Contestant> MakeOpenCvResample(const Setting& setting) {
  if (setting.frame.type != PixelType::kFloat || setting.task.steps.size() != 1) return nullptr;
  const Step& step = setting.task.steps[0];
  const auto make = [&](const char* name, std::function<void()> run) {
    return std::make_unique<OpenCvResample>(name, setting.threads, std::move(run));
  };
  const cv::Mat out = Wrap(setting.frame.output);
  std::vector<cv::Mat> in;
  for (const Image& image : setting.frame.inputs) in.push_back(Wrap(image));
  if (step.op() == "accum" && step.Numbers("bits") == std::vector<double>{0}) {
    const OpenCvRows rows(setting.threads, [weights = step.Positional(0)](const auto& from, cv::Mat& to) {
      from[0].convertTo(to, -1, weights[0]);
      for (size_t k = 1; k < from.size(); ++k) cv::scaleAdd(from[k], weights[k], to, to);
    });
    return make("OpenCV scaleAdd", [rows, in, out] { rows(in, out); });
  }
  if (step.op() == "resize" && step.arguments.Text("filter") == "box") {
    return make("OpenCV INTER_AREA",
                [in, out]() mutable { cv::resize(in[0], out, out.size(), 0, 0, cv::INTER_AREA); });
  }
  if (step.op() == "warp" || step.op() == "st_warp") {
    const int how = Interpolation(step);
    if (how < 0) return nullptr;
    const cv::Mat map = step.op() == "warp" ? MapOfMatrix(step.Positional(0), out.size())
                                            : MapOfCoordinates(setting.frame.inputs[1], in[0].size());
    return make("OpenCV remap", [in, out, map, how]() mutable {
      cv::remap(in[0], out, map, cv::noArray(), how, cv::BORDER_CONSTANT);
    });
  }
  return nullptr;
}

}  // namespace tessera::bench

#else

namespace tessera::bench {
std::unique_ptr<Contestant> MakeOpenCvResample(const Setting&) { return nullptr; }
}  // namespace tessera::bench

#endif
