// Weighted sums, resizing, mip chains and warps, each beside the peers that have them. Times are per source
// pixel.
#include <algorithm>
#include <cmath>
#include <string>

#include "harness.h"

namespace {

using tessera::Image;
using tessera::ImageSpec;
using tessera::PixelType;

// A perspective that enlarges everywhere, so that nobody has to filter more than its kernel: matrices from
// results to sources would be its inverse.
constexpr char kAffine[] = "1.05,0.11,0,-0.11,1.05,0,100,-150,1";
constexpr char kProjective[] = "1.2,0.1,0.00001,-0.1,1.2,0.00002,-200,-150,1";
// One that makes the picture smaller: OpenCV leaves pixels out, which its error shows.
constexpr char kReducing[] = "0.8,0.09,0,-0.09,0.8,0,300,300,1";
// A floor towards the horizon.
constexpr char kFloor[] = "1,0,0,1.92,0.2,0.001,-1344,648,0.3";

// Input 0 as ever; input 1 holds smooth coordinates: a swirl about the middle, in [0, 1].
Image SwirlInput(int width, int height, PixelType type, size_t index) {
  if (index == 0) return tessera::bench::MakeInput(width, height, type, 1);
  const Image image{ImageSpec(width, height, 4, PixelType::kFloat)};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = (x + 0.5) / width - 0.5, v = (y + 0.5) / height - 0.5;
      const double angle = 0.6 * std::exp(-6 * (u * u + v * v)), c = 0.95 * std::cos(angle),
                   s = 0.95 * std::sin(angle);
      image.at<float>(x, y, 0) = static_cast<float>(0.5 + c * u - s * v);
      image.at<float>(x, y, 1) = static_cast<float>(0.5 + s * u + c * v);
    }
  }
  return image;
}

std::string Weights(int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += (i > 0 ? "," : "") + std::to_string(1.0 / count);
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace tessera::bench;
  return RunSuite(argc, argv, [](Options options) {
    // Peers differ in what they do with other types; the comparison is of float pixels.
    options.types = {PixelType::kFloat};
    const auto add = [&](const std::string& name, const std::string& op, const std::string& example) {
      Task task = MakeTask(name, {{op, example}});
      if (op == "st_warp") task.make_input = SwirlInput;
      RegisterTask("resample", task, options, /*with_unfolded=*/false);
    };
    add("accumulate 16", "accum", Weights(16));
    add("accumulate 16 in 12 bits", "accum", Weights(16) + " bits=12");
    add("half box", "resize", "50% filter=box");
    add("half mitchell", "resize", "50% filter=mitchell");
    add("half lanczos3", "resize", "50% filter=lanczos3");
    add("two thirds lanczos3", "resize", "66.7% filter=lanczos3");
    add("mip chain box", "mip", "filter=box");
    add("mip chain lanczos3", "mip", "filter=lanczos3");
    add("warp affine linear", "warp", std::string(kAffine) + " filter=triangle");
    add("warp projective linear", "warp", std::string(kProjective) + " filter=triangle");
    add("warp projective cubic", "warp", std::string(kProjective) + " filter=simon");
    add("warp projective lanczos3", "warp", std::string(kProjective) + " filter=lanczos3");
    add("warp reducing linear", "warp", std::string(kReducing) + " filter=triangle");
    add("warp reducing lanczos3", "warp", std::string(kReducing) + " filter=lanczos3");
    for (const char* const filter :
         {"triangle", "trilinear aniso=1", "trilinear aniso=8", "trilinear aniso=16", "ewa"}) {
      add(std::string("warp floor ") + filter, "warp", std::string(kFloor) + " wrap=repeat filter=" + filter);
    }
    add("st_warp linear", "st_warp", "filter=triangle");
    add("st_warp cubic", "st_warp", "filter=simon");
    add("shift lanczos3", "shift", "0.25,-0.4");
  });
}
