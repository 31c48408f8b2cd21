// Where a run's time goes: phases add up to the threads' time, and who keeps the others waiting is found.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "files.h"
#include "graph/render.h"
#include "sched/phase_clock.h"
#include "sched/scheduler.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/color.h"

namespace tessera {
namespace {

using namespace testing_io;
using std::chrono::milliseconds;

void Sleep(int ms) { std::this_thread::sleep_for(milliseconds(ms)); }

// Rows that take their time.
class SlowFile final : public graph::PixelSource {
 public:
  explicit SlowFile(int ms) : ms_(ms), spec_(64, 256, 3, PixelType::kFloat) {}
  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return "slow file"; }
  std::unique_ptr<graph::RowReader> Open(int, int) const override {
    class Reader final : public graph::RowReader {
     public:
      explicit Reader(int ms) : ms_(ms) {}
      void Read(const ImageView& out) override {
        Sleep(ms_);
        std::fill_n(out.data, static_cast<size_t>(out.roi.height() * out.row_stride), std::byte{0});
      }

     private:
      const int ms_;
    };
    return std::make_unique<Reader>(ms_);
  }

 private:
  const int ms_;
  ImageSpec spec_;
};

class SlowSink final : public graph::RowSink {
 public:
  explicit SlowSink(int ms) : ms_(ms) {}
  void Write(const ConstImageView&) override { Sleep(ms_); }

 private:
  const int ms_;
};

// Of what threads did.
double Sum(const RunPhases& p) {
  double sum = p.prepare + p.compute + p.encode + p.wait;
  for (const auto& d : p.decode) sum += d.busy;
  return sum;
}

RunPhases Took(int read_ms, int write_ms, int threads) {
  RunStats stats;
  RenderOptions options;
  options.threads = threads;
  options.tile_height = 16;
  SlowSink sink(write_ms);
  graph::RenderToSink(graph::MakeSource(std::make_shared<SlowFile>(read_ms)), PixelType::kFloat, sink,
                      options, &stats);
  return stats.phases;
}

TEST(PhasesTest, SleepIsOfTheStepThatSleeps) {
  for (const int threads : {1, 2, 5}) {
    const RunPhases read = Took(4, 0, threads), written = Took(0, 4, threads);
    ASSERT_EQ(read.decode.size(), 1u);
    EXPECT_EQ(read.decode[0].file, "slow file");
    EXPECT_GE(read.decode[0].busy, 16 * .004) << threads;
    EXPECT_GE(read.decode[0].elapsed, 16 * .004) << threads;
    EXPECT_GE(written.encode, 16 * .004) << threads;
    for (const RunPhases& p : {read, written}) {
      EXPECT_NEAR(Sum(p), threads * p.seconds, 1e-6 * threads);
      EXPECT_GE(p.wait, (threads - 1) * 16 * .002) << threads;
    }
    EXPECT_GT(read.decode[0].elapsed, read.encode_elapsed);
    EXPECT_GT(written.encode_elapsed, written.decode[0].elapsed);
  }
}

TEST(PhasesTest, HelpersCountAndTheirCallerWaits) {
  for (const int threads : {1, 2, 4}) {
    sched::PhaseClock clock(2);
    bool read = false;
    sched::PipelineSteps steps;
    steps.read = [&]() -> std::shared_ptr<void> {
      if (read) return nullptr;
      read = true;
      return std::make_shared<int>();
    };
    steps.work = [](void*, int) {};
    steps.write = [&](void*) {
      const sched::InPhase outer(&clock, 0);
      Sleep(5);
      {
        const sched::InPhase inner(&clock, 1);
        sched::InnerFor(8, threads, [](int64_t, int) { Sleep(5); });
      }
      Sleep(5);
    };
    sched::Pipeline(threads, 4, steps);
    EXPECT_GE(clock.Busy(0), .010);
    EXPECT_GE(clock.Busy(1), .040) << "each of the eight, whoever slept";
    EXPECT_GE(clock.Elapsed(1), .040 / threads - .001);
    EXPECT_GE(clock.Elapsed(0), clock.Elapsed(1) + .010);
    EXPECT_LE(clock.Busy(1), threads * clock.Elapsed(1) + .001);
  }
}

TEST(PhasesTest, NobodyAsksNobodyLooks) {
  const sched::InPhase none(nullptr, 7);
  const sched::PhaseHelpers helpers;
  EXPECT_FALSE(helpers.any());
}

using PhasesOfFilesTest = FileTest;

TEST_F(PhasesOfFilesTest, AddUpToTheThreadsTime) {
  Write(FromImage(Pattern(ImageSpec(700, 500, 3, PixelType::kHalf))), Path("in.exr"));
  for (const char* const name : {"out.exr", "out.tif", "out.png", "out.jpg", "out.tga"}) {
    RunStats stats;
    WriteOptions options;
    options.stats = &stats;
    options.render.threads = 2;
    double before = 0;
    for (int again = 0; again < 2; ++again) {  // what is asked for twice is added
      const auto start = std::chrono::steady_clock::now();
      Write(MulConstant(Read(Path("in.exr")), {.5}), Path(name), options);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      const RunPhases& p = stats.phases;
      EXPECT_EQ(p.threads, 2);
      EXPECT_LE(p.seconds - before, took.count() + 1e-4) << name;
      EXPECT_NEAR(Sum(p), 2 * p.seconds, 1e-6) << name;
      for (const double part : {p.prepare, p.compute, p.encode}) EXPECT_GT(part, 0) << name;
      EXPECT_GE(p.wait, -1e-3) << name;
      ASSERT_EQ(p.decode.size(), 1u) << name;
      EXPECT_EQ(p.decode[0].file, Path("in.exr"));
      before = p.seconds;
    }
    EXPECT_EQ(stats.files.size(), 3u) << name;  // decoded once, encoded twice
  }
}

// A statistic reads the file once more; it is told as one pass.
TEST_F(PhasesOfFilesTest, HaveWhatPassesBeforehandTook) {
  Write(FromImage(Pattern(ImageSpec(300, 200, 3, PixelType::kHalf))), Path("in.exr"));
  RunStats stats;
  WriteOptions options;
  options.stats = &stats;
  Write(Contrast(Read(Path("in.exr")), 2), Path("out.exr"), options);
  EXPECT_NEAR(Sum(stats.phases), stats.phases.threads * stats.phases.seconds, 1e-6);
  EXPECT_EQ(stats.phases.decode.size(), 1u);
}

TEST(PhasesTest, TheLimitIsWhatTheClockWaitsFor) {
  RunPhases p;
  p.threads = 4;
  p.compute = 4, p.encode = 7, p.encode_elapsed = 2, p.decode = {{"a.exr", 1, 0.5}, {"b.exr", 3, 2.5}};
  EXPECT_EQ(p.Limit(), "decode b.exr");
  p.compute = 12;
  EXPECT_EQ(p.Limit(), "compute");
  p.encode_elapsed = 3.5;
  EXPECT_EQ(p.Limit(), "encode");
  p.prepare = 9;
  EXPECT_EQ(p.Limit(), "prepare");
}

}  // namespace
}  // namespace tessera
