// The benchmarks' own instruments: the copy, the error measure, the probe for affine operations, the loop.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <numeric>
#include <vector>

#include "contestant.h"
#include "copy.h"
#include "harness.h"
#include "oracle.h"
#include "task.h"
#include "tessera/error.h"
#include "workers.h"

namespace tessera::bench {
namespace {

TEST(CopyTest, MovesEveryByteAndNoOther) {
  for (const auto copy : {CopyPlain, CopyStreaming}) {
    for (size_t bytes : {0, 1, 63, 64, 65, 200, 4099}) {
      for (size_t offset : {0, 1, 17}) {
        std::vector<std::byte> from(bytes + 64), to(bytes + 128, std::byte{0xee});
        for (size_t i = 0; i < from.size(); ++i) from[i] = static_cast<std::byte>(i * 7 + 1);
        copy(from.data(), to.data() + offset, bytes);
        ASSERT_EQ(0, std::memcmp(from.data(), to.data() + offset, bytes)) << bytes << " at " << offset;
        for (size_t i = 0; i < offset; ++i) ASSERT_EQ(to[i], std::byte{0xee});
        for (size_t i = offset + bytes; i < to.size(); ++i) ASSERT_EQ(to[i], std::byte{0xee});
      }
    }
  }
}

TEST(WorkersTest, EachIndexRunsOncePerRun) {
  Workers workers(3);
  std::atomic<int> calls[3] = {};
  for (int k = 0; k < 50; ++k) workers.Run([&](int i) { ++calls[i]; });
  for (const auto& c : calls) EXPECT_EQ(c, 50);
}

TEST(OracleTest, CountsAndMeasuresWhatWasChanged) {
  const Image exact = MakeInput(40, 8, PixelType::kUint8, 1);
  Image found = MakeInput(40, 8, PixelType::kUint8, 1);
  const Oracle oracle(FromImage(exact), 2, 4);
  EXPECT_EQ(oracle.Compare(found.view()).wrong_codes, 0);
  EXPECT_EQ(oracle.Compare(found.view()).max, 0);
  EXPECT_EQ(oracle.Compare(found.view()).values, 40 * 8 * 4);
  uint8_t& sample = found.at<uint8_t>(39, 7, 2);
  sample = static_cast<uint8_t>(sample < 128 ? sample + 3 : sample - 3);
  const Errors errors = oracle.Compare(found.view());
  EXPECT_EQ(errors.wrong_codes, 1);
  EXPECT_EQ(errors.max_code_error, 3);
  EXPECT_NEAR(errors.max, 3 / 255.0, 1e-12);
  EXPECT_NEAR(errors.rms, 3 / 255.0 / std::sqrt(40.0 * 8 * 4), 1e-12);
}

TEST(OracleTest, NotANumberOnOneSideIsCounted) {
  const Image exact = MakeInput(8, 4, PixelType::kFloat, 1);
  const Image found = MakeInput(8, 4, PixelType::kFloat, 1);
  found.at<float>(3, 2, 1) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(Oracle(FromImage(exact)).Compare(found.view()).not_finite, 1);
}

TEST(TaskTest, ProbesAffineOperations) {
  const Task gain = MakeTask("gain", {{"mulc", "2,3,4,1"}});
  ASSERT_TRUE(gain.steps[0].affine);
  EXPECT_TRUE(gain.steps[0].affine->diagonal());
  EXPECT_EQ(gain.steps[0].affine->m[1][1], 3);
  const Task bias = MakeTask("bias", {{"addc", "0.5"}});
  ASSERT_TRUE(bias.steps[0].affine);
  EXPECT_TRUE(bias.steps[0].affine->has_bias());
  EXPECT_FALSE(MakeTask("clamp", {{"clamp", "min=0 max=1"}}).steps[0].affine);
  EXPECT_FALSE(MakeTask("premult", {{"premult", ""}}).steps[0].affine);
  EXPECT_THROW(MakeTask("x", {{"no such operation", ""}}), Error);
}

// Writes one value everywhere and notes its turns.
class Writer final : public Contestant {
 public:
  Writer(std::string name, const Frame& frame, int value, std::vector<std::string>* log)
      : name_(std::move(name)), frame_(frame), value_(value), log_(log) {}
  std::string Name() const override { return name_; }
  void Prepare() override { log_->push_back(name_); }
  void Run() override {
    const ImageView out = frame_.output.view();
    if (value_ >= 0) std::memset(out.data, value_, static_cast<size_t>(out.row_stride) * out.roi.height());
  }

 private:
  std::string name_;
  const Frame& frame_;
  int value_;
  std::vector<std::string>* log_;
};

TEST(MeasureTest, JudgesEachByItsOwnPixelsAndInterleaves) {
  Frame frame{8, 8, PixelType::kUint8, {}, Image(ImageSpec(8, 8, 4, PixelType::kUint8))};
  const Image exact(ImageSpec(8, 8, 4, PixelType::kUint8));
  std::memset(exact.view().data, 7, 8 * 8 * 4);
  std::vector<std::string> log;
  std::vector<std::unique_ptr<Contestant>> contestants;
  contestants.push_back(std::make_unique<Writer>("right", frame, 7, &log));
  contestants.push_back(std::make_unique<Writer>("idle", frame, -1, &log));
  contestants.push_back(std::make_unique<Writer>("wrong", frame, 9, &log));
  const Oracle oracle(FromImage(exact));
  const auto results = Measure(std::move(contestants), frame, &oracle, 15);
  ASSERT_EQ(results.size(), 3u);
  EXPECT_EQ(results[0].errors.wrong_codes, 0);
  EXPECT_EQ(results[1].errors.wrong_codes, 8 * 8 * 4);
  EXPECT_EQ(results[2].errors.max_code_error, 2);
  for (const Measured& m : results) EXPECT_EQ(m.seconds.size(), 15u);
  // Rounds are permutations, and not always the same one.
  const std::vector<std::string> rounds(log.end() - 45, log.end());
  bool differ = false;
  for (size_t k = 0; k < rounds.size(); k += 3) {
    std::vector<std::string> round(rounds.begin() + k, rounds.begin() + k + 3);
    differ |= !std::equal(round.begin(), round.end(), rounds.begin());
    std::sort(round.begin(), round.end());
    EXPECT_EQ(round, (std::vector<std::string>{"idle", "right", "wrong"}));
  }
  EXPECT_TRUE(differ);
}

TEST(MeasureTest, Median) {
  EXPECT_EQ(Median({3, 1, 2}), 2);
  EXPECT_EQ(Median({4, 1, 2, 3}), 2.5);
}

// Every peer that takes part in a pipeline really computes it. The gains are at most 1, so that peers that
// keep uint8 between their calls do not clip there; what is left to them is one rounding per call.
TEST(PeersTest, AgreeWithTheOracle) {
  const Task task = MakeTask("chain", {{"mulc", "0.95,0.9,1,1"},
                                       {"ccmatrix", ".8,.1,.1,0,.1,.8,.1,0,.1,.2,.7,0,0,0,0,1"},
                                       {"saturate", "1.2"},
                                       {"clamp", "min=0 max=1"}});
  for (PixelType type : {PixelType::kFloat, PixelType::kHalf, PixelType::kUint8}) {
    Frame frame{64, 32, type, {MakeInput(64, 32, type, 1)}, Image(ImageSpec(64, 32, 4, type))};
    const Oracle oracle(task.Build({FromImage(frame.inputs[0])}, frame.output.spec()));
    for (int threads : {1, 2}) {
      const Setting setting{task, frame, threads};
      int peers = 0;
      for (const auto make : {MakeOiio, MakeOcio, MakeOpenCv}) {
        const std::unique_ptr<Contestant> peer = make(setting);
        if (!peer) continue;
        ++peers;
        peer->Prepare();
        peer->Run();
        const Errors errors = oracle.Compare(frame.output.view());
        EXPECT_LT(errors.max, type == PixelType::kUint8  ? 4 / 255.0
                              : type == PixelType::kHalf ? 4e-3
                                                         : 1e-5)
            << peer->Name() << ' ' << PixelTypeName(type);
      }
      EXPECT_GE(peers, 2);
    }
  }
}

}  // namespace
}  // namespace tessera::bench
