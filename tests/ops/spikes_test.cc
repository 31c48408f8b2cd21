// Windows over pictures with a few samples that are far larger than all others: what passed through a sum
// must leave no trace where it has no weight.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/pictures.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::Content;
using testing::Picture;

// Off the origin, wider than any example's window and than the vectors of every target.
Image WithSpikes(uint32_t seed, float size) {
  const Image image = Picture({-5, 3, 620, 40}, 4, PixelType::kFloat, seed, Content::kOrdinary);
  image.at<float>(20, 10, 0) = size;
  image.at<float>(21, 30, 1) = -size;
  image.at<float>(290, 20, 2) = size;
  image.at<float>(-5, 3, 3) = 0.25f * size;
  return image;
}

class Spikes : public ::testing::TestWithParam<float> {};
INSTANTIATE_TEST_SUITE_P(Sizes, Spikes, ::testing::Values(60000.0f, 1e12f));

TEST_P(Spikes, LeaveNoTraceBesideTheirWindows) {
  for (const ops::OpInfo& op : ops::Registry()) {
    if (op.family != "filter") continue;
    std::vector<std::string> lines = op.examples;
    if (op.name == "blur") {
      // Boxes wider than 255 have running sums of their own.
      lines.insert(lines.end(),
                   {"9x7 kernel=box method=recursive", "41x41 kernel=box", "15x15 kernel=box border=black",
                    "257x3 kernel=box", "3x301 kernel=box border=mirror", "259x259 kernel=box border=black"});
    }
    for (const std::string& line : lines) {
      // A transform spreads its error over a block of up to 512 pixels, beyond what the reference looks at.
      if (line.find("method=fft") != std::string::npos) continue;
      const ops::Arguments arguments = ops::ParseExample(op, line);
      std::vector<Node> inputs;
      for (int k = 0; k < op.Operands(arguments); ++k)
        inputs.push_back(FromImage(WithSpikes(static_cast<uint32_t>(k) + 1, k == 0 ? GetParam() : 1)));
      const VerifyReport report =
          Verify(op.make(inputs, arguments, nullptr), PixelType::kFloat, {.seconds = 0.15});
      EXPECT_TRUE(report.within_bound) << op.name << " " << line << ": " << report.Summary();
      EXPECT_GT(report.samples, 0);
    }
  }
}

}  // namespace
}  // namespace tessera
