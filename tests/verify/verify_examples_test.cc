// Every example of the registry with Verify: right results pass, and bounds are near what is measured.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "ops/registry.h"
#include "support/pictures.h"
#include "support/sanitized.h"
#include "tessera/render.h"
#include "tessera/verify.h"

namespace tessera {
namespace {

using testing::Picture;

const Roi kWindow{-5, 3, 91, 67};  // 96 x 64, off the origin

// A bound is at most that many times the largest error.
constexpr double kLimit = 100;
// What is looked at: the same on a machine that is busy, but for rows whose reference takes very long.
constexpr int kTiles = 8, kTileSize = 16;
constexpr double kSeconds = testing::kSanitized ? 1000 : 10, kFirstSeconds = testing::kSanitized ? 1000 : 60;

// Rows with another limit, and why. A name stands for all of an operation's examples.
struct OtherLimit {
  const char* row;  // the name, or the name and the example's beginning
  double limit;
  const char* why;
};
constexpr OtherLimit kOtherLimits[] = {
    {"lic", 1000, "more than a hundred steps in a row along a line"},
    {"lic length=8 noise=sparse", 1e7, "the bound is of taps that may read the next pixel; here none does"},
    {"lic method=fast length=12", 1e7, "the bound is of lines half a pixel beside, of which few are judged"},
    {"volume", 1000, "more than a hundred steps in a row along a ray"},
    {"volume solid=sphere(0,0,0,.5) dims=16 size=18x16 mode=hyper", 5000,
     "steps in a row that get shorter towards the surface: the bound is of all of them in one direction"},
    {"equalize", 10000,
     "the bound is the share of a value's class and its neighbours; none here is at an edge"},
    {"dof", 500, "the bound is of all parts of discs that add up in one direction"},
    {"smoke", 500, "the bound is of where curls stretch most"},
    {"gardner", 3000, "the bound grows with the square of the terms of two sums of sines"},
    {"envmap gloss=20", 1000,
     "the bound is of an edge between texels, of all texels of a lobe in one direction"},
    {"envconvert latlong", 500, "the bound is of an edge between texels"},
    {"spot", 500, "the bound is 1e-6 times the stretch of the spots, wherever they meet"},
    {"shapedspots", 500, "the bound is 1e-6 times the stretch of the spots, wherever they meet"},
    {"sparse", 500, "the bound is 1e-6, wherever impulses meet"},
    {"blur sigma=17,30", 500, "noise is kind to a decimated Gaussian: the bound is of an edge"},
    {"blur sigma=1.5 bits=16", 500,
     "two steps of the modelled buffer that change together look like a slope"},
    {"sobel output=xy method=fft", 500,
     "a transform's errors by chance: the bound is five of their deviations"},
    {"solid procedure=halftone", 500, "one bound for the colours of any procedure: this one has two"},
    {"solid procedure=contours", 500, "one bound for the colours of any procedure: this one has two"},
    {"bump output=specular exponent=12", 500,
     "the bound is of the flank of the lobe: 1 + exponent roundings"},
    {"transfer table1=0,0.25,1", 500, "the bound is of each stage by itself; these entries are exact"},
    {"mosaic 2x2 fit", 1000, "what the pictures may be off by is added, though each pixel is of one of them"},
    {"layerfog layers=0,0.9,0.5,0 table=64", 500, "the bound is of the table's steepest entry"},
};

struct Row {
  std::string name;
  VerifyReport report;
  double ratio = 0, limit = kLimit, seconds = 0, run = 0;
};

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// `computed`: the inputs are results themselves, which may be off by a rounding.
Row Examine(const ops::OpInfo& op, const std::string& example, bool computed) {
  const ops::Arguments arguments = ops::ParseExample(op, example);
  std::vector<Node> inputs;
  for (int k = 0; k < op.Operands(arguments); ++k) {
    inputs.push_back(FromImage(Picture(kWindow, 4, PixelType::kFloat, 7u * static_cast<uint32_t>(k) + 1)));
  }
  const ImageSpec spec = Picture(kWindow, 4, PixelType::kFloat, 0).spec();
  if (computed) {
    const ops::OpInfo* const before = ops::FindOp("mulc");
    for (Node& input : inputs) input = before->make({&input, 1}, ops::ParseExample(*before, "0.9"), nullptr);
  }
  const Node node = op.make(inputs, arguments, op.generator ? &spec : nullptr);
  Row row;
  row.name = op.name + " " + example;
  const double start = Now();
  const Image result = Render(node);
  row.run = Now() - start;
  row.report = VerifyStored(
      node, result.view(),
      {.samples = kTiles, .tile_size = kTileSize, .seconds = kSeconds, .first_seconds = kFirstSeconds});
  row.seconds = Now() - start - row.run;
  // How many times its error the bound is where it comes closest. A result cannot be checked more sharply
  // than its own last bit.
  double largest = 0;
  const Roi& w = result.spec().data_window;
  for (int y = w.y0; y < w.y1; ++y) {
    for (int x = w.x0; x < w.x1; ++x) {
      for (int c = 0; c < result.spec().channel_count(); ++c) {
        const double v = std::fabs(double{result.at<float>(x, y, c)});
        if (std::isfinite(v)) largest = std::max(largest, v);
      }
    }
  }
  row.ratio = row.report.max_error > 0x1p-25 * largest
                  ? 1 / row.report.closest
                  : row.report.largest_bound / (0x1p-24 * largest + 0x1p-126);
  for (const OtherLimit& other : kOtherLimits) {
    const std::string key(other.row);
    if (key == op.name || (key.find(' ') != std::string::npos && row.name.rfind(key, 0) == 0))
      row.limit = other.limit;
  }
  return row;
}

class VerifyExamples : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Inputs, VerifyExamples, ::testing::Values(false, true),
                         [](const auto& info) { return info.param ? "Computed" : "Exact"; });

TEST_P(VerifyExamples, PassWithBoundsThatMeanSomething) {
  std::vector<Row> rows;
  for (const ops::OpInfo& op : ops::Registry()) {
    for (const std::string& example : op.examples) {
      if (GetParam() && op.Operands(ops::ParseExample(op, example)) == 0) continue;
      SCOPED_TRACE(op.name + " " + example);
      rows.push_back(Examine(op, example, GetParam()));
      const Row& row = rows.back();
      EXPECT_TRUE(row.report.within_bound) << row.report.Summary();
      EXPECT_LE(row.ratio, row.limit) << row.report.Summary();
      EXPECT_GT(row.report.samples, 0);
    }
  }
  std::sort(rows.begin(), rows.end(),
            [](const Row& a, const Row& b) { return a.ratio / a.limit > b.ratio / b.limit; });
  std::printf("%-60s %5s %10s %10s %9s %8s %8s %8s %7s\n", "example", "pass", "max error", "bound", "ratio",
              "median", "undec %", "share %", "time");
  for (const Row& row : rows) {
    const VerifyReport& r = row.report;
    std::printf(
        "%-60.60s %5s %10.3g %10.3g %9.3g %8.3g %8.3g %8.3g %6.2fs %6.0fx\n", row.name.c_str(),
        r.within_bound ? "yes" : "NO", r.max_error, r.largest_bound, row.ratio, r.median_ratio,
        100.0 * static_cast<double>(r.undecided) / static_cast<double>(std::max<int64_t>(1, r.samples)),
        100 * r.share, row.seconds, row.seconds / std::max(row.run, 1e-6));
  }
}

}  // namespace
}  // namespace tessera
