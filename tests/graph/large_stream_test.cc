// Pictures of 100,000 x 100,000 pixels, made row by row as they are asked for, through chains into a sink:
// what comes out is right at places all over, and memory is the budget's.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "graph/render.h"
#include "graph/source.h"
#include "ops/registry.h"
#include "support/sanitized.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::kSanitized;

constexpr int kWidth = 100000;

// Rows of one row of noise, each moved by as much as its number says.
class Rows {
 public:
  static constexpr int kPeriod = 4093;
  Rows() : noise_(kWidth + kPeriod) {
    std::mt19937 random(7);
    for (uint8_t& n : noise_) n = static_cast<uint8_t>(random());
  }
  const uint8_t* Row(int y) const { return noise_.data() + int64_t{y} * 1237 % kPeriod; }

 private:
  std::vector<uint8_t> noise_;
};

class MadeSource final : public graph::PixelSource {
 public:
  explicit MadeSource(int height) : spec_(kWidth, height, 1, PixelType::kUint8) {}
  const ImageSpec& spec() const override { return spec_; }
  std::string Describe() const override { return "made"; }
  std::unique_ptr<graph::RowReader> Open(int, int) const override {
    class Reader final : public graph::RowReader {
     public:
      explicit Reader(const Rows& rows) : rows_(rows) {}
      void Read(const ImageView& out) override {
        for (int y = out.roi.y0; y < out.roi.y1; ++y) std::memcpy(out.At(0, y), rows_.Row(y), kWidth);
      }

     private:
      const Rows& rows_;
    };
    return std::make_unique<Reader>(rows_);
  }
  // A part of it in memory, in the same frame.
  Image Part(const Roi& window) const {
    ImageSpec spec = spec_;
    spec.data_window = window;
    const Image part(spec);
    for (int y = window.y0; y < window.y1; ++y)
      std::memcpy(part.view().At(window.x0, y), rows_.Row(y) + window.x0,
                  static_cast<size_t>(window.width()));
    return part;
  }

 private:
  ImageSpec spec_;
  Rows rows_;
};

// Keeps what it was told to look at, and how much there was.
class Places final : public graph::RowSink {
 public:
  Places(std::vector<Roi> places, int width) : width_(width) {
    for (const Roi& p : places) {
      ImageSpec spec(p.width(), p.height(), 1, PixelType::kUint8);
      spec.data_window = p;
      parts.emplace_back(spec);
    }
  }
  void Write(const ConstImageView& rows) override {
    ASSERT_EQ(rows.roi, (Roi{0, next, width_, rows.roi.y1}));
    next = rows.roi.y1;
    for (const Image& part : parts) {
      const Roi both = Intersection(part.spec().data_window, rows.roi);
      for (int y = both.y0; y < both.y1; ++y)
        std::memcpy(part.view().At(both.x0, y), rows.At(both.x0, y), static_cast<size_t>(both.width()));
    }
  }

  std::vector<Image> parts;
  int next = 0;

 private:
  int width_;
};

Node Chain(Node node, std::initializer_list<std::pair<const char*, const char*>> steps) {
  for (const auto& [name, line] : steps) {
    const ops::OpInfo& op = *ops::FindOp(name);
    node = op.make({&node, 1}, ops::ParseExample(op, line), nullptr);
  }
  return node;
}

// Of this process, in MB.
void ExpectPeakBelow(long most) {
  rusage usage;
  ::getrusage(RUSAGE_SELF, &usage);
  const long peak = usage.ru_maxrss / 1024;
  std::printf("peak memory %ld MB\n", peak);
  if (!kSanitized) {
    EXPECT_LT(peak, most);
  }
}

std::vector<uint8_t> Bytes(const Image& image) {
  const auto* const bytes = reinterpret_cast<const uint8_t*>(image.view().data);
  return {bytes, bytes + image.spec().data_window.pixels()};
}

// 400 MB at a hundredth of the size: a row of the result is made of hundreds, a pixel of hundreds of
// thousands.
TEST(LargeStreamTest, MuchSmallerPicturesTakeNoMoreThanTheBudget) {
  constexpr Roi kResult{0, 0, 1000, 40};
  const Node node = Chain(graph::MakeSource(std::make_shared<MadeSource>(4000)),
                          {{"mulc", "0.7"}, {"blur", "3x3"}, {"resize", "1000x40"}});
  Places small({kResult}, kResult.x1), large({kResult}, kResult.x1);
  graph::RenderToSink(node, PixelType::kUint8, small, {.memory_budget = size_t{64} << 20});
  ExpectPeakBelow(512);
  graph::RenderToSink(node, PixelType::kUint8, large, {});
  ExpectPeakBelow(1024);
  EXPECT_EQ(small.next, 40);
  EXPECT_EQ(Bytes(small.parts[0]), Bytes(large.parts[0]));
}

TEST(LargeStreamTest, TenThousandMillionPixelsThroughAChain) {
  if (kSanitized) GTEST_SKIP() << "takes ten times as long with sanitizers";
  constexpr int kHeight = 100000, kReach = 8;
  const auto source = std::make_shared<MadeSource>(kHeight);
  const auto chain = [](const Node& of) {
    return Chain(of, {{"mulc", "0.7"}, {"blur", "3x3"}, {"addc", "0.1"}});
  };
  std::vector<Roi> places;
  for (const int x : {0, 44449, 65530, kWidth - 67}) {
    for (const int y : {0, 21474, 42949, 85899, kHeight - 31}) places.push_back({x, y, x + 67, y + 31});
  }
  Places sink(places, kWidth);
  graph::RenderToSink(chain(graph::MakeSource(source)), PixelType::kUint8, sink, {});
  EXPECT_EQ(sink.next, kHeight);
  ExpectPeakBelow(1024);
  for (size_t i = 0; i < places.size(); ++i) {
    const Roi& p = places[i];
    const Roi around = Intersection({p.x0 - kReach, p.y0 - kReach, p.x1 + kReach, p.y1 + kReach},
                                    source->spec().data_window);
    ImageSpec spec(p.width(), p.height(), 1, PixelType::kUint8);
    spec.data_window = p;
    const Image want(spec);
    RenderInto(chain(FromImage(source->Part(around))), want.view());
    EXPECT_EQ(Bytes(sink.parts[i]), Bytes(want)) << "at " << p.x0 << "," << p.y0;
  }
}

}  // namespace
}  // namespace tessera
