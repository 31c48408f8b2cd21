// Where a run's time goes: phases add up to the threads' time, and who keeps the others waiting is found.
#include "graph/phases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "files.h"
#include "sched/phase_clock.h"
#include "sched/scheduler.h"
#include "tessera/ops/arithmetic.h"

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

double Sum(const graph::Phases& p) {
  double sum = p.prepare + p.compute + p.encode + p.wait;
  for (const auto& d : p.decode) sum += d.busy;
  return sum;
}

graph::Phases Took(int read_ms, int write_ms, int threads) {
  graph::Phases phases;
  RenderOptions options;
  options.threads = threads;
  options.tile_height = 16;
  SlowSink sink(write_ms);
  graph::RenderToSink(graph::MakeSource(std::make_shared<SlowFile>(read_ms)), PixelType::kFloat, sink,
                      options, nullptr, &phases);
  return phases;
}

TEST(PhasesTest, SleepIsOfTheStepThatSleeps) {
  for (const int threads : {1, 2, 5}) {
    const graph::Phases read = Took(4, 0, threads), written = Took(0, 4, threads);
    ASSERT_EQ(read.decode.size(), 1u);
    EXPECT_EQ(read.decode[0].file, "slow file");
    EXPECT_GE(read.decode[0].busy, 16 * .004) << threads;
    EXPECT_GE(read.decode[0].elapsed, 16 * .004) << threads;
    EXPECT_GE(written.encode, 16 * .004) << threads;
    for (const graph::Phases& p : {read, written}) {
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

TEST_F(PhasesOfFilesTest, AreToldInLines) {
  Write(FromImage(Pattern(ImageSpec(700, 500, 3, PixelType::kHalf))), Path("in.exr"));
  for (const char* const name : {"out.exr", "out.tif", "out.png", "out.jpg", "out.tga"}) {
    RunStats stats;
    WriteOptions options;
    options.stats = &stats;
    options.render.threads = 2;
    const auto start = std::chrono::steady_clock::now();
    Write(MulConstant(Read(Path("in.exr")), {.5}), Path(name), options);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    // Two threads for so long, prepare, decode, compute, encode, wait, the limit; who decoded and encoded.
    ASSERT_EQ(stats.files.size(), 9u) << name;
    double seconds = 0;
    ASSERT_EQ(std::sscanf(stats.files[0].c_str(), "2 threads for %lf s:", &seconds), 1) << stats.files[0];
    EXPECT_LE(seconds, took.count() + 1e-4) << name;
    double sum = 0;
    for (size_t i = 1; i <= 5; ++i) {
      double own = 0;
      ASSERT_EQ(std::sscanf(stats.files[i].c_str(), " %*s %lf s", &own), 1) << stats.files[i];
      EXPECT_GE(own, i == 5 ? -1e-3 : 0) << name << stats.files[i];
      sum += own;
    }
    EXPECT_NEAR(sum, 2 * seconds, 1e-3) << name;
    EXPECT_TRUE(stats.files[2].ends_with("  " + Path("in.exr"))) << stats.files[2];
    EXPECT_TRUE(stats.files[4].ends_with("  " + Path(name))) << stats.files[4];
    EXPECT_TRUE(stats.files[6].starts_with("  limit: ")) << stats.files[6];
  }
}

}  // namespace
}  // namespace tessera
