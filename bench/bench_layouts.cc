// What pictures look like outside of film: one, three and four channels, bytes and 16-bit integers beside
// floats, through point operations, filters and resizing, beside OpenCV.
#include <algorithm>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "contest.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/curve.h"
#include "tessera/ops/filter.h"
#include "tessera/ops/geometry.h"
#include "tessera/render.h"

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "peers/opencv_rows.h"
#endif

namespace tessera::bench {
namespace {

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
using Mat = cv::Mat;
Mat Wrap(const Image& image) {
  const ImageView v = image.view();
  const int depth = v.type == PixelType::kUint8    ? CV_8U
                    : v.type == PixelType::kUint16 ? CV_16U
                    : v.type == PixelType::kHalf   ? CV_16S  // as convertFp16 takes them
                                                   : CV_32F;
  return Mat(v.roi.height(), v.roi.width(), CV_MAKETYPE(depth, v.channels), v.data,
             static_cast<size_t>(v.row_stride));
}
#else
struct Mat {};
#endif

// The code of white.
[[maybe_unused]] double WhiteOf(PixelType type) {
  return type == PixelType::kUint8 ? 255 : type == PixelType::kUint16 ? 65535 : 1;
}

// White noise; floats in [0, 1].
Image Noise(int width, int height, int channels, PixelType type, uint32_t seed) {
  const Image image(ImageSpec(width, height, channels, type));
  std::mt19937 random(seed);
  const size_t samples = static_cast<size_t>(width) * height * channels;
  std::byte* to = image.view().data;
  for (size_t i = 0; i < samples; ++i, to += PixelBytes(type)) {
    const uint32_t bits = random();
    const float value = static_cast<float>(bits >> 8) * 0x1p-24f;
    if (type == PixelType::kFloat) {
      std::memcpy(to, &value, sizeof value);
    } else {
      std::memcpy(to, &bits, PixelBytes(type));
    }
  }
  return image;
}

struct Operation {
  const char* name;
  int divisor;  // of the sides of the result
  std::function<Node(const Node&, const Node&)> ours;
  std::function<void(const Mat&, const Mat&, Mat&)> theirs;  // of two images; null: there is none
  bool theirs_of_bytes = false;                              // and of no other type
  // Whether the call shares its rows among threads by itself; where not, they are shared out here, with so
  // many rows more as it does not look for in the picture that it is given a part of.
  enum class Shares { kNot, kAlways, kBytes } shares = Shares::kNot;
  int margin = 0;

  bool HasPeer(PixelType type) const { return theirs && (type == PixelType::kUint8 || !theirs_of_bytes); }
};

Node Half(const Node& image, const char* filter) {
  const ImageSpec& s = image.spec();
  return Resize(image, {.width = s.width() / 2, .height = s.height() / 2, .filter = filter});
}

Node Swapped(const Node& image) {
  const int count = image.spec().channel_count();
  std::vector<ChannelChoice> choices;
  for (int c = 0; c < count; ++c) choices.push_back({count >= 3 && c < 3 ? 2 - c : c, 0, ""});
  return SelectChannels(image, choices);
}

std::vector<Operation> Operations() {
  std::vector<Operation> all = {
      {"scaled by 1.1", 1, [](auto& a, auto&) { return MulConstant(a, {1.1}); }, nullptr},
      {"sum of two", 1, [](auto& a, auto& b) { return Add(a, b); }, nullptr},
      {"R and B swapped", 1, [](auto& a, auto&) { return Swapped(a); }, nullptr},
      {"mean of two", 1, [](auto& a, auto& b) { return Interpolate(a, b, 0.5); }, nullptr},
      {"sRGB", 1, [](auto& a, auto&) { return Encode(a, TransferFunction::kSrgb); }, nullptr},
      {"3x3 binomial", 1, [](auto& a, auto&) { return Convolve(a, NamedKernel("smooth3")); }, nullptr},
      {"3x3 zero sum", 1,
       [](auto& a, auto&) {
         return Convolve(a, {3, 3, 1, 1, 1, {0, -1, 0, -1, 4, -1, 0, -1, 0}});
       },
       nullptr},
      {"5x5 Gaussian", 1, [](auto& a, auto&) { return Convolve(a, NamedKernel("gaussian", 5, 5)); }, nullptr},
      {"7x7 Gaussian", 1, [](auto& a, auto&) { return Convolve(a, NamedKernel("gaussian", 7, 7)); }, nullptr},
      {"15x15 Gaussian", 1, [](auto& a, auto&) { return Convolve(a, NamedKernel("gaussian", 15, 15)); },
       nullptr},
      {"box 21x21", 1, [](auto& a, auto&) { return BoxBlur(a, {.width = 21, .height = 21}); }, nullptr},
      {"median 3x3", 1,
       [](auto& a, auto&) {
         return Median(a, {3, 3});
       },
       nullptr},
      {"median 5x5", 1,
       [](auto& a, auto&) {
         return Median(a, {5, 5});
       },
       nullptr},
      {"median 31x31", 1,
       [](auto& a, auto&) {
         return Median(a, {31, 31});
       },
       nullptr, true},
      {"dilate 5x5", 1,
       [](auto& a, auto&) {
         return Dilate(a, {5, 5});
       },
       nullptr},
      {"dilate 41x41", 1,
       [](auto& a, auto&) {
         return Dilate(a, {41, 41});
       },
       nullptr},
      {"half box", 2, [](auto& a, auto&) { return Half(a, "box"); }, nullptr},
      {"half lanczos3", 2, [](auto& a, auto&) { return Half(a, "lanczos3"); }, nullptr}};
#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
  constexpr int kBorder = cv::BORDER_REPLICATE;
  using Shares = Operation::Shares;
  const auto set = [&](const std::string& name, std::function<void(const Mat&, const Mat&, Mat&)> call,
                       Shares shares = Shares::kNot, int margin = 0) {
    Operation& found =
        *std::find_if(all.begin(), all.end(), [&](const Operation& o) { return o.name == name; });
    found.theirs = std::move(call), found.shares = shares, found.margin = margin;
  };
  set("scaled by 1.1", [](auto& a, auto&, Mat& d) { a.convertTo(d, -1, 1.1); });
  set("sum of two", [](auto& a, auto& b, Mat& d) { cv::add(a, b, d); });
  set(
      "R and B swapped",
      [](auto& a, auto&, Mat& d) {
        if (a.channels() == 1) return a.copyTo(d);
        cv::cvtColor(a, d, a.channels() == 3 ? cv::COLOR_RGB2BGR : cv::COLOR_RGBA2BGRA);
      },
      Shares::kAlways);
  set("mean of two", [](auto& a, auto& b, Mat& d) { cv::addWeighted(a, 0.5, b, 0.5, 0, d); });
  set(
      "3x3 binomial",
      [](auto& a, auto&, Mat& d) {
        cv::GaussianBlur(a, d, {3, 3}, 0, 0, kBorder);
      },
      Shares::kBytes);
  set("3x3 zero sum", [](auto& a, auto&, Mat& d) {
    cv::filter2D(a, d, -1, Mat(cv::Matx33f(0, -1, 0, -1, 4, -1, 0, -1, 0)), {-1, -1}, 0, kBorder);
  });
  for (const int side : {5, 7, 15}) {
    set(
        std::to_string(side) + "x" + std::to_string(side) + " Gaussian",
        [side](auto& a, auto&, Mat& d) {
          cv::GaussianBlur(a, d, {side, side}, side / 4.0, side / 4.0, kBorder);
        },
        Shares::kBytes);
  }
  set("box 21x21", [](auto& a, auto&, Mat& d) { cv::blur(a, d, {21, 21}, {-1, -1}, kBorder); });
  set(
      "median 3x3", [](auto& a, auto&, Mat& d) { cv::medianBlur(a, d, 3); }, Shares::kNot, 1);
  set(
      "median 5x5", [](auto& a, auto&, Mat& d) { cv::medianBlur(a, d, 5); }, Shares::kNot, 2);
  set(
      "median 31x31", [](auto& a, auto&, Mat& d) { cv::medianBlur(a, d, 31); }, Shares::kNot, 15);
  set("dilate 5x5", [](auto& a, auto&, Mat& d) { cv::dilate(a, d, Mat::ones(5, 5, CV_8U)); });
  set("dilate 41x41", [](auto& a, auto&, Mat& d) { cv::dilate(a, d, Mat::ones(41, 41, CV_8U)); });
  set(
      "half box", [](auto& a, auto&, Mat& d) { cv::resize(a, d, d.size(), 0, 0, cv::INTER_AREA); },
      Shares::kAlways);
  // Of eight taps, also where the picture becomes smaller.
  set(
      "half lanczos3", [](auto& a, auto&, Mat& d) { cv::resize(a, d, d.size(), 0, 0, cv::INTER_LANCZOS4); },
      Shares::kAlways);
#endif
  return all;
}

Contest Make(const Operation& operation, int width, int height, int channels, PixelType type,
             [[maybe_unused]] int threads) {
  Contest c;
  const Image a = Noise(width, height, channels, type, 1), b = Noise(width, height, channels, type, 2);
  c.output = Image(ImageSpec(width / operation.divisor, height / operation.divisor, channels, type));
  c.ways = {{"", operation.ours(FromImage(a), FromImage(b))}};
  c.oracle_rows = 1;
#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
  if (operation.HasPeer(type)) {
    using Shares = Operation::Shares;
    const bool itself = operation.shares == Shares::kAlways ||
                        (operation.shares == Shares::kBytes && type == PixelType::kUint8);
    const OpenCvRows rows(
        itself ? 1 : threads,
        [call = operation.theirs](const auto& in, Mat& out) { call(in[0], in[1], out); }, operation.margin);
    c.peers = {{"OpenCV", [=, d = Wrap(c.output)]() mutable {
                  cv::setNumThreads(itself ? threads : 1);
                  rows({Wrap(a), Wrap(b)}, d);
                }}};
  }
#endif
  return c;
}

// From one type to another: what every file costs on its way in and out.
Contest Conversion(int width, int height, PixelType from, PixelType to, [[maybe_unused]] int threads) {
  Contest c;
  Image a = Noise(width, height, 4, from == PixelType::kHalf ? PixelType::kFloat : from, 1);
  if (from == PixelType::kHalf) a = Render(FromImage(a), from);
  c.output = Image(ImageSpec(width, height, 4, to));
  c.ways = {{"", FromImage(a)}};
  c.bytes_moved = 4.0 * width * height * static_cast<double>(PixelBytes(from) + PixelBytes(to));
  c.oracle_rows = 1;
#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
  const double white_from = WhiteOf(from), white_to = WhiteOf(to);
  const OpenCvRows rows(threads, [=](const auto& in, Mat& out) {
    if (from == PixelType::kHalf || to == PixelType::kHalf) return cv::convertFp16(in[0], out);
    in[0].convertTo(out, out.depth(), white_to / white_from);
  });
  c.peers = {{"OpenCV", [=, d = Wrap(c.output)]() mutable {
                cv::setNumThreads(1);
                rows({Wrap(a)}, d);
              }}};
#endif
  return c;
}

void RegisterConversions(const Options& options, int width, int height) {
  using enum PixelType;
  for (const auto& [from, to] : {std::pair{kUint8, kFloat},
                                 {kFloat, kUint8},
                                 {kUint16, kFloat},
                                 {kFloat, kUint16},
                                 {kHalf, kFloat},
                                 {kFloat, kHalf}}) {
    for (const int threads : options.threads) {
      ContestNames names{"layouts",
                         "to " + std::string(PixelTypeName(to)),
                         std::string(PixelTypeName(from)) + " x4",
                         width,
                         height,
                         threads,
                         {""},
                         {}};
#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
      names.peers = {"OpenCV"};
#endif
      RegisterContest(names, options,
                      [=, from = from, to = to] { return Conversion(width, height, from, to, threads); });
    }
  }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera::bench;
  using tessera::PixelType;
  return RunSuite(argc, argv, [](const Options& options) {
    for (const Options::Size& size : options.sizes) {
      RegisterConversions(options, size.width > 0 ? size.width : 3840, size.width > 0 ? size.height : 2160);
    }
    for (const Operation& operation : Operations()) {
      for (const PixelType type : options.types) {
        if (type == PixelType::kHalf) continue;  // OpenCV has no arithmetic on it
        for (const int channels : {1, 3, 4}) {
          for (const Options::Size& size : options.sizes) {
            for (const int threads : options.threads) {
              const int width = size.width > 0 ? size.width : 3840,
                        height = size.height > 0 ? size.height : 2160;
              ContestNames names{"layouts",
                                 operation.name,
                                 std::string(PixelTypeName(type)) + " x" + std::to_string(channels),
                                 width,
                                 height,
                                 threads,
                                 {""},
                                 {}};
#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
              if (operation.HasPeer(type)) names.peers = {"OpenCV"};
#endif
              RegisterContest(names, options,
                              [=] { return Make(operation, width, height, channels, type, threads); });
            }
          }
        }
      }
    }
  });
}
