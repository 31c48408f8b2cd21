// Whether random pipelines find what is wrong: operations with a fault each, found by the comparison that
// ought to and shrunk to a few words; and that what is drawn is as declared.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <thread>

#include "random/faults.h"
#include "random/samples.h"
#include "random/shrink.h"
#include "random/workers.h"
#include "support/every_target.h"
#include "support/pictures.h"
#include "support/sanitized.h"

namespace tessera::random {
namespace {

class RandomPipelines : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // A few plain rows and one more.
  static std::vector<const ops::OpInfo*> RowsWith(const ops::OpInfo& op) {
    std::vector<const ops::OpInfo*> rows = {&op};
    for (const char* name : {"addc", "abs", "add", "blur", "median", "crop", "ch"})
      rows.push_back(ops::FindOp(name));
    return rows;
  }

  const std::string folder_ = ::testing::TempDir() + "random_pipelines_test." + std::to_string(getpid());
  Tally tally_;
};

// Workers are forks, and go before every test that starts threads in this process.
TEST_F(RandomPipelines, WorkersReportAndCount) {
  random::Run run;
  run.seed = 5, run.count = 12, run.workers = 2, run.rows = RowsWith(Faultless()), run.only = &Faultless();
  const Report report = RunCases(run);
  EXPECT_EQ(report.cases, 12);
  EXPECT_TRUE(report.failures.empty());
  EXPECT_EQ(report.slowest.size(), 10u);
  EXPECT_EQ(report.tally.Of(kCompared, "faultless"), 12);
}

// A worker that dies is a finding with its case, and the others go on.
TEST_F(RandomPipelines, ACrashIsAFinding) {
  if (testing::kThreadSanitized) GTEST_SKIP() << "what crashes there is this process";
  ops::OpInfo crash = Faultless();
  crash.name = "crash";
  crash.make = [](std::span<const Node> in, const ops::Arguments&, const ImageSpec*) -> Node {
    if (in[0].spec().width() > 100) raise(SIGSEGV);
    return in[0];
  };
  random::Run run;
  run.seed = 5, run.count = 40, run.workers = 2, run.failures = 1, run.rows = RowsWith(crash),
  run.only = &crash;
  ::testing::internal::CaptureStdout();
  const Report report = RunCases(run);
  ::testing::internal::GetCapturedStdout();
  ASSERT_FALSE(report.failures.empty());
  EXPECT_NE(report.failures[0].find("crash"), std::string::npos) << report.failures[0];
}

class FaultIs : public RandomPipelines, public ::testing::WithParamInterface<size_t> {};
INSTANTIATE_TEST_SUITE_P(RandomPipelines, FaultIs, ::testing::Range(size_t{0}, Faults().size()),
                         [](const ::testing::TestParamInfo<size_t>& info) {
                           std::string name = Faults()[info.param].op.name;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST_P(FaultIs, FoundAndShrunk) {
  const Fault& fault = Faults()[GetParam()];
  // Bits of AVX2 and AVX-512 are compared; that fault is in the former alone.
  if (fault.op.name == "target" && !testing::HasBothFusedTargets())
    GTEST_SKIP() << "there are not both AVX2 and AVX-512";
  if (fault.op.name == "threads" && std::thread::hardware_concurrency() < 2)
    GTEST_SKIP() << "there is one processor, and all work is one thread's";
  Generator generator(RowsWith(fault.op), folder_, tally_);
  Comparer comparer(folder_, tally_);
  constexpr int kMostCases = 2000;
  for (int i = 0; i < kMostCases; ++i) {
    const Case c = generator.Make(11, static_cast<uint64_t>(i), &fault.op);
    const std::optional<Finding> finding = comparer.Run(c);
    if (!finding) continue;
    EXPECT_NE(std::find(fault.found_by.begin(), fault.found_by.end(), finding->check), fault.found_by.end())
        << CheckName(finding->check) << ": " << finding->what;
    const Case shortest = ShrunkOf(c, *finding, comparer, 60);
    EXPECT_NE(CommandLine(shortest).find("--" + fault.op.name), std::string::npos) << CommandLine(shortest);
    // Which thread gets which part of the work is chance: shrinking may stop early, and what is left may
    // pass.
    if (fault.op.name == "threads") return;
    // Who reads what nobody wrote, or when others write, may not do so twice.
    if (finding->check != Check::kThreads && fault.op.name != "tile-halo") {
      bool again = false;
      for (int k = 0; k < 50 && !again; ++k) again = comparer.Run(shortest).has_value();
      EXPECT_TRUE(again) << InWords(shortest);
    }
    EXPECT_LE(shortest.steps.size(), 3u) << InWords(shortest);
    EXPECT_LE(shortest.pictures.size(), 1u) << InWords(shortest);
    return;
  }
  ADD_FAILURE() << fault.op.name << " was not found in " << kMostCases << " cases";
}

TEST_F(RandomPipelines, WithoutAFaultNothingIsFound) {
  Generator generator(RowsWith(Faultless()), folder_, tally_);
  Comparer comparer(folder_, tally_);
  for (uint64_t i = 0; i < 300; ++i) {
    const Case c = generator.Make(11, i, &Faultless());
    const std::optional<Finding> finding = comparer.Run(c);
    EXPECT_FALSE(finding) << CheckName(finding->check) << ": " << finding->what << "\n" << InWords(c);
  }
  for (int k = 0; k < static_cast<int>(Check::kCount); ++k)
    EXPECT_GT(tally_.Of(kChecked, CheckName(static_cast<Check>(k))), 0) << CheckName(static_cast<Check>(k));
}

TEST_F(RandomPipelines, CasesFollowFromSeedAndIndexAlone) {
  Generator one(RegistryRows(), folder_, tally_), other(RegistryRows(), folder_, tally_);
  std::set<std::string> lines;
  for (const uint64_t i : {5, 77, 1234567}) {
    const std::string words = InWords(one.Make(3, i));
    other.Make(4, i + 1);
    EXPECT_EQ(words, InWords(other.Make(3, i)));
    lines.insert(words);
    lines.insert(InWords(other.Make(4, i)));
  }
  EXPECT_EQ(lines.size(), 6u);
}

// Every kind of image and layout comes up.
TEST_F(RandomPipelines, ImagesAreOfEveryKind) {
  Draw draw(1, 2);
  std::set<std::string> seen;
  for (int i = 0; i < 2000; ++i) {
    const Roi window = DrawWindow(draw);
    const Picture p = DrawPicture(draw, window);
    seen.insert(ContentName(p.content));
    seen.insert(PixelTypeName(p.type));
    seen.insert(std::to_string(p.channels) + " channels");
    if (window.pixels() == 1) seen.insert("1x1");
    if (window.width() > 1024) seen.insert("wider than four blocks");
    if (window.x0 < 0 || window.y0 < 0) seen.insert("off the origin");
    if (p.layout.rows_up) seen.insert("rows up");
    if (p.layout.planar) seen.insert("planar");
    if (p.layout.pixel_gap % 2 == 1) seen.insert("odd strides");
    if (p.layout.pixels_left) seen.insert("pixels leftwards");
  }
  EXPECT_EQ(seen.size(), static_cast<size_t>(Content::kCount) + 4 + 6 + 7);
}

TEST_F(RandomPipelines, PixelsOfAnyLayoutHoldTheSameSamples) {
  Draw draw(6, 6);
  for (int i = 0; i < 200; ++i) {
    Picture p = DrawPicture(draw, {-3, 2, 9, 7});
    const Pixels pixels = Paint(p);
    EXPECT_TRUE(pixels.GapsAreWhole()) << p.Words();
    p.layout = {};
    EXPECT_FALSE(Differ(pixels.view(), Paint(p).view())) << p.Words();
  }
  Layout gaps;
  gaps.row_gap = 3;
  const Pixels pixels({0, 0, 2, 2}, 1, PixelType::kUint8, gaps);
  pixels.Scribble();
  EXPECT_TRUE(pixels.GapsAreWhole());
  pixels.view().data[2] = std::byte{0};
  EXPECT_FALSE(pixels.GapsAreWhole());
}

TEST_F(RandomPipelines, DifferencesAreOfBitsButForNan) {
  const Pixels a({0, 0, 2, 1}, 1, PixelType::kFloat, {}), b({0, 0, 2, 1}, 1, PixelType::kFloat, {});
  const auto set = [](const Pixels& p, int x, float v) { testing::StoreSample(p.view(), x, 0, 0, v); };
  for (const Pixels& p : {a, b}) set(p, 0, 0.5f), set(p, 1, NAN);
  set(b, 1, -NAN);
  EXPECT_FALSE(Differ(a.view(), b.view()));
  set(b, 0, std::nextafter(0.5f, 1.0f));
  ASSERT_TRUE(Differ(a.view(), b.view()));
  EXPECT_NE(Differ(a.view(), b.view())->find("x=0 y=0 channel 0"), std::string::npos);
  set(b, 0, 0.5f), set(a, 1, 0.0f), set(b, 1, -0.0f);
  EXPECT_TRUE(Differ(a.view(), b.view()));
}

// One code either way only next to a tie.
TEST_F(RandomPipelines, RoundedCodesMayDifferAtATieAlone) {
  const Pixels codes({0, 0, 1, 1}, 1, PixelType::kUint8, {}), floats({0, 0, 1, 1}, 1, PixelType::kFloat, {});
  const auto differs = [&](int code, double value, bool near_ties) {
    *codes.view().data = static_cast<std::byte>(code);
    testing::StoreSample(floats.view(), 0, 0, 0, static_cast<float>(value));
    return DifferRounded(codes.view(), floats.view(), near_ties).has_value();
  };
  EXPECT_FALSE(differs(128, 128.0 / 255, false));
  EXPECT_TRUE(differs(129, 128.49 / 255, true));
  EXPECT_FALSE(differs(129, 128.4999 / 255, true));
  EXPECT_TRUE(differs(129, 128.4999 / 255, false));
  EXPECT_TRUE(differs(130, 128.5 / 255, true));
}

}  // namespace
}  // namespace tessera::random
