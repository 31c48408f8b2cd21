// OpenCV as a peer: its array functions and cv::transform. A chain runs in blocks of rows that stay in cache,
// from one buffer to another (in place cv::transform copies its source first), a gain with an offset is one
// transform, and the threads share the blocks, for these functions are serial.
#include "contestant.h"

#if defined(TESSERA_BENCH_OPENCV)

#include <algorithm>
#include <array>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "peers/peers.h"
#include "workers.h"

namespace tessera::bench {
namespace {

// One call: reads `in` (in[0] is the chain's value so far), writes `dst`, which may be in[0].
using Call = std::function<void(const std::vector<cv::Mat>& in, cv::Mat& dst)>;

// The range of a pixel type in OpenCV's arithmetic, which works on codes.
double WhiteOf(PixelType type) {
  return type == PixelType::kUint8 ? 255 : type == PixelType::kUint16 ? 65535 : 1;
}

cv::Scalar ScalarOf(const std::vector<double>& v, double factor) {
  return {v[0] * factor, v[1] * factor, v[2] * factor, v[3] * factor};
}

std::vector<Call> CallsOf(const Step& step, PixelType type) {
  const double white = WhiteOf(type);
  const std::string& op = step.op();
  if (step.affine) {
    const Step::Affine& a = *step.affine;
    bool scales = false;
    cv::Scalar scale, bias;
    cv::Mat_<float> matrix(4, a.has_bias() ? 5 : 4);
    for (int r = 0; r < 4; ++r) {
      scales |= a.m[r][r] != 1;
      scale[r] = a.m[r][r], bias[r] = a.m[r][4] * white;
      for (int c = 0; c < matrix.cols; ++c)
        matrix(r, c) = static_cast<float>(c == 4 ? a.m[r][c] * white : a.m[r][c]);
    }
    if (a.diagonal() && !scales) return {[=](const auto& in, cv::Mat& d) { cv::add(in[0], bias, d); }};
    if (a.diagonal() && !a.has_bias())
      return {[=](const auto& in, cv::Mat& d) { cv::multiply(in[0], scale, d); }};
    return {[=](const auto& in, cv::Mat& d) { cv::transform(in[0], d, matrix); }};
  }
  if (op == "add") return {[](const auto& in, cv::Mat& d) { cv::add(in[0], in[1], d); }};
  if (op == "sub") return {[](const auto& in, cv::Mat& d) { cv::subtract(in[0], in[1], d); }};
  if (op == "mul") return {[white](const auto& in, cv::Mat& d) { cv::multiply(in[0], in[1], d, 1 / white); }};
  if (op == "min") return {[](const auto& in, cv::Mat& d) { cv::min(in[0], in[1], d); }};
  if (op == "max") return {[](const auto& in, cv::Mat& d) { cv::max(in[0], in[1], d); }};
  if (op == "absdiff") return {[](const auto& in, cv::Mat& d) { cv::absdiff(in[0], in[1], d); }};
  if (op == "abs") return {[](const auto& in, cv::Mat& d) { cv::absdiff(in[0], cv::Scalar::all(0), d); }};
  if (op == "interp") {
    const double x = step.Positional(0).at(0);
    return {[x](const auto& in, cv::Mat& d) { cv::addWeighted(in[0], 1 - x, in[1], x, 0, d); }};
  }
  if (op == "clamp") {
    if (const auto range = ClampRange(step)) {
      const cv::Scalar lo = ScalarOf(range->first, white), hi = ScalarOf(range->second, white);
      return {[lo](const auto& in, cv::Mat& d) { cv::max(in[0], lo, d); },
              [hi](const auto& in, cv::Mat& d) { cv::min(in[0], hi, d); }};
    }
  }
  if (op == "powc" && type == PixelType::kFloat && step.Positional(0).size() == 1) {
    const double exponent = step.Positional(0)[0];
    return {[exponent](const auto& in, cv::Mat& d) { cv::pow(in[0], exponent, d); }};
  }
  return {};
}

cv::Mat Wrap(const Image& image) {
  const ImageView view = image.view();
  const int depth = view.type == PixelType::kUint8    ? CV_8U
                    : view.type == PixelType::kUint16 ? CV_16U
                                                      : CV_32F;
  return cv::Mat(view.roi.height(), view.roi.width(), CV_MAKETYPE(depth, 4), view.data,
                 static_cast<size_t>(view.row_stride));
}

// Bytes of a block's rows: two buffers of it, and what an operation reads beside, stay in a second-level
// cache.
constexpr size_t kBlock = size_t{128} << 10;

class OpenCv final : public Contestant {
 public:
  OpenCv(const Setting& setting, std::vector<Call> calls)
      : calls_(std::move(calls)), output_(Wrap(setting.frame.output)), workers_(setting.threads) {
    for (const Image& image : setting.frame.inputs) inputs_.push_back(Wrap(image));
    rows_ = static_cast<int>(std::max<size_t>(1, kBlock / output_.step[0]));
    // One call gains nothing by blocks.
    if (calls_.size() == 1) rows_ = (output_.rows + setting.threads - 1) / setting.threads;
    scratch_.resize(static_cast<size_t>(setting.threads));
    for (auto& buffers : scratch_) {
      for (cv::Mat& buffer : buffers) buffer.create(rows_, output_.cols, output_.type());
    }
  }
  std::string Name() const override { return "OpenCV"; }
  void Prepare() override { cv::setNumThreads(1); }
  void Run() override {
    workers_.Run([this](int thread) {
      const int blocks = (output_.rows + rows_ - 1) / rows_, count = workers_.count();
      for (int block = blocks * thread / count; block < blocks * (thread + 1) / count; ++block) {
        Block(cv::Range(block * rows_, std::min(output_.rows, (block + 1) * rows_)),
              scratch_[static_cast<size_t>(thread)]);
      }
    });
  }

 private:
  void Block(const cv::Range& rows, const std::array<cv::Mat, 2>& buffers) const {
    std::vector<cv::Mat> in;
    for (const cv::Mat& input : inputs_) in.push_back(input.rowRange(rows));
    for (size_t k = 0; k < calls_.size(); ++k) {
      cv::Mat to = k + 1 == calls_.size() ? output_.rowRange(rows) : buffers[k % 2].rowRange(0, rows.size());
      calls_[k](in, to);
      in = {to};
    }
  }

  std::vector<Call> calls_;
  std::vector<cv::Mat> inputs_;
  cv::Mat output_;
  int rows_ = 0;
  std::vector<std::array<cv::Mat, 2>> scratch_;
  Workers workers_;
};

// Neighbouring steps that scale or shift channels, as one.
std::vector<Step> Joined(const std::vector<Step>& steps) {
  std::vector<Step> joined;
  for (const Step& step : steps) {
    Step* const last = joined.empty() ? nullptr : &joined.back();
    if (last != nullptr && last->affine && step.affine && last->affine->diagonal() &&
        step.affine->diagonal()) {
      for (int c = 0; c < 4; ++c) {
        const double gain = step.affine->m[c][c];
        last->affine->m[c][c] *= gain;
        last->affine->m[c][4] = last->affine->m[c][4] * gain + step.affine->m[c][4];
      }
    } else {
      joined.push_back(step);
    }
  }
  return joined;
}

}  // namespace

// OpenCV has no arithmetic on half pixels.
std::unique_ptr<Contestant> MakeOpenCv(const Setting& setting) {
  if (!setting.frame.plain() || setting.frame.type == PixelType::kHalf || setting.frame.inputs.empty())
    return nullptr;
  std::vector<Call> calls;
  for (const Step& step : Joined(setting.task.steps)) {
    const std::vector<Call> more = CallsOf(step, setting.frame.type);
    if (more.empty()) return nullptr;
    calls.insert(calls.end(), more.begin(), more.end());
  }
  return std::make_unique<OpenCv>(setting, std::move(calls));
}

}  // namespace tessera::bench

#else

namespace tessera::bench {
std::unique_ptr<Contestant> MakeOpenCv(const Setting&) { return nullptr; }
}  // namespace tessera::bench

#endif
