// The engine on small graphs: tiles, threads, halos, borders, shared nodes, crops, streaming, cancellation.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>

#include "graph/render.h"
#include "support/sanitized.h"
#include "support/test_ops.h"
#include "tessera/render.h"

namespace tessera {
namespace {

using testing::BoxSum;
using testing::BoxSumOf;
using testing::DifferenceOf;
using testing::ExpectSameBits;
using testing::FakeFile;
using testing::FlipRowsOf;
using testing::RandomImage;
using testing::SlowAffine;
using testing::SlowAffineOf;

RenderOptions Tiles(int width, int height, int threads) {
  RenderOptions o;
  o.tile_width = width;
  o.tile_height = height;
  o.threads = threads;
  return o;
}

struct Crop {
  Roi window;
};
class CropTestOp final : public graph::OpWith<Crop> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-crop"; }
  graph::OpKind Kind() const override { return graph::OpKind::kCrop; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    ImageSpec s = in[0];
    s.data_window = params().window;
    return s;
  }
};
Node CropOf(const Node& in, const Roi& window) {
  return graph::MakeNode(std::make_shared<const CropTestOp>(Crop{window}), {in});
}

// What a pixel's neighbourhood sum is, by the definition of the border.
float BoxSumAt(const Image& in, const BoxSum& p, int x, int y, int c) {
  const Roi& w = in.spec().data_window;
  const auto fold = [&](int v, int lo, int hi) {
    const int n = hi - lo;
    if (p.wrap == Wrap::kClamp) return std::clamp(v, lo, hi - 1);
    int k = v - lo;
    if (p.wrap == Wrap::kRepeat) {
      while (k < 0) k += n;
      return lo + k % n;
    }
    if (p.wrap == Wrap::kMirror101) {
      while (n > 1 && (k < 0 || k >= n)) k = k < 0 ? -k : 2 * n - 2 - k;
      return n > 1 ? lo + k : lo;
    }
    while (k < 0 || k >= n) k = k < 0 ? -1 - k : 2 * n - 1 - k;
    return lo + k;
  };
  float sum = 0;
  for (int dy = -p.ry; dy <= p.ry; ++dy) {
    for (int dx = -p.rx; dx <= p.rx; ++dx) {
      const int px = x + dx, py = y + dy;
      if (p.wrap == Wrap::kBlack && !w.Contains({px, py, px + 1, py + 1})) {
        sum += 0;
      } else {
        sum += in.at<float>(fold(px, w.x0, w.x1), fold(py, w.y0, w.y1), c);
      }
    }
  }
  return sum;
}

TEST(Engine, BordersFollowTheirDefinitionEvenBeyondTheImage) {
  for (const Roi window : {Roi{0, 0, 19, 11}, Roi{-7, 5, -4, 7}, Roi{3, 3, 4, 4}, Roi{0, 0, 1, 9}}) {
    const Image in = RandomImage(window, 2, 1);
    for (const auto wrap : {Wrap::kBlack, Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror, Wrap::kMirror101}) {
      for (const BoxSum p : {BoxSum{1, 1, wrap}, BoxSum{5, 12, wrap}}) {
        const Image out = Render(BoxSumOf(FromImage(in), p), PixelType::kFloat, Tiles(5, 3, 1));
        for (int y = window.y0; y < window.y1; ++y) {
          for (int x = window.x0; x < window.x1; ++x) {
            ASSERT_EQ(out.at<float>(x, y, 1), BoxSumAt(in, p, x, y, 1)) << x << "," << y;
          }
        }
      }
    }
  }
}

// point -> box -> point -> box, and a difference with the first: two windows, a shared node, a diamond.
Node Diamond(const Node& source) {
  const Node a = SlowAffineOf(source, {1.5f, 0.25f});
  const Node b = BoxSumOf(a, {2, 1, Wrap::kMirror});
  const Node c = SlowAffineOf(b, {0.1f, -1.0f});
  return DifferenceOf(BoxSumOf(c, {1, 3, Wrap::kBlack}), a);
}

TEST(Engine, BitsDoNotDependOnTilesOrThreads) {
  const Image in = RandomImage({-3, 2, 134, 99}, 5, 2);
  const Node node = Diamond(FromImage(in));
  const Image whole = Render(node, PixelType::kFloat, Tiles(1000, 1000, 1));
  for (const int threads : {1, 2, 3, 8}) {
    for (const auto& [w, h] : {std::pair{1, 1}, std::pair{17, 13}, std::pair{4096, 1}, std::pair{0, 0}}) {
      ExpectSameBits(Render(node, PixelType::kFloat, Tiles(w, h, threads)), whole);
    }
  }
  RenderOptions shuffled = Tiles(16, 16, 1);
  shuffled.shuffle_tiles = true;
  ExpectSameBits(Render(node, PixelType::kFloat, shuffled), whole);
}

TEST(Engine, LazyEqualsEager) {
  const Image in = RandomImage({0, 0, 70, 41}, 4, 3);
  const Node lazy = Diamond(FromImage(in));
  const auto eager = [](const Node& n) { return FromImage(Render(n)); };
  const Node a = eager(SlowAffineOf(FromImage(in), {1.5f, 0.25f}));
  const Node b = eager(BoxSumOf(a, {2, 1, Wrap::kMirror}));
  const Node c = eager(SlowAffineOf(b, {0.1f, -1.0f}));
  ExpectSameBits(Render(lazy), Render(DifferenceOf(BoxSumOf(c, {1, 3, Wrap::kBlack}), a)));
}

TEST(Engine, StreamingGivesTheSameBitsInBoundedReads) {
  const Image in = RandomImage({4, -9, 90, 300}, 4, 4);
  const Image whole = Render(Diamond(FromImage(in)));
  for (const int rows : {1, 7, 64}) {
    const auto file = std::make_shared<const FakeFile>(in);
    ExpectSameBits(Render(Diamond(graph::MakeSource(file)), PixelType::kFloat, Tiles(0, rows, 3)), whole);
    EXPECT_EQ(file->rows_read, in.spec().height());
    EXPECT_LE(file->largest_read, rows + 4);  // the halos of both windows
  }
}

TEST(Engine, RowsAskedInReverseAreReadFromTheFileOnce) {
  const Image in = RandomImage({0, 0, 33, 50}, 3, 5);
  const auto file = std::make_shared<const FakeFile>(in);
  ExpectSameBits(Render(FlipRowsOf(graph::MakeSource(file)), PixelType::kFloat, Tiles(0, 8, 2)),
                 Render(FlipRowsOf(FromImage(in))));
  EXPECT_EQ(file->rows_read, 50);
}

TEST(Engine, SharedNodeIsComputedOncePerTile) {
  const Image in = RandomImage({0, 0, 128, 64}, 4, 6);
  std::atomic<int64_t> pixels{0};
  const Node shared = SlowAffineOf(FromImage(in), {2.0f, 0.0f, &pixels});
  // Used by a window and by a point operation: still one evaluation of every pixel.
  Render(DifferenceOf(BoxSumOf(shared, {0, 0}), shared), PixelType::kFloat, Tiles(128, 64, 1));
  EXPECT_EQ(pixels, 128 * 64);
  pixels = 0;  // two point consumers
  Render(DifferenceOf(SlowAffineOf(shared, {3.0f}), shared), PixelType::kFloat, Tiles(128, 64, 1));
  EXPECT_EQ(pixels, 128 * 64);
}

TEST(Engine, CropsInsideAndBeyond) {
  const Image in = RandomImage({0, 0, 40, 30}, 3, 7);
  const Node doubled = SlowAffineOf(FromImage(in), {2.0f, 1.0f});
  const Roi inside{5, 6, 20, 29}, beyond{-4, -2, 50, 12};
  const Image small = Render(CropOf(doubled, inside));
  const Image large =
      Render(SlowAffineOf(CropOf(doubled, beyond), {1.0f, 0.5f}), PixelType::kFloat, Tiles(7, 5, 2));
  for (int y = -2; y < 29; ++y) {
    for (int x = -4; x < 50; ++x) {
      const Roi pixel{x, y, x + 1, y + 1};
      const bool exists = in.spec().data_window.Contains(pixel);
      const float value = exists ? 2.0f * in.at<float>(x, y, 1) + 1.0f : 0.0f;
      if (inside.Contains(pixel)) {
        ASSERT_EQ(small.at<float>(x, y, 1), value);
      }
      if (beyond.Contains(pixel)) {
        ASSERT_EQ(large.at<float>(x, y, 1), value + 0.5f) << x << "," << y;
      }
    }
  }
}

TEST(Engine, OnlyUsedChannelsAreRead) {
  const Image in = RandomImage({0, 0, 16, 16}, 7, 8);
  class Pick final : public graph::OpWith<int> {
   public:
    using OpWith::OpWith;
    std::string Name() const override { return "test-pick"; }
    graph::OpKind Kind() const override { return graph::OpKind::kShuffle; }
    ImageSpec OutputSpec(std::span<const ImageSpec> s) const override {
      ImageSpec r = s[0];
      r.channels = {"x", "y"};
      return r;
    }
    std::vector<graph::ChannelRef> ChannelMap(std::span<const ImageSpec>) const override {
      return {{0, 5, 0}, {-1, 0, 0.75f}};
    }
  };
  const auto file = std::make_shared<const FakeFile>(in);
  const Node node =
      graph::MakeNode(std::make_shared<const Pick>(0), {SlowAffineOf(graph::MakeSource(file), {3.0f})});
  const Image out = Render(node);
  EXPECT_EQ(file->first_channel, 5);
  EXPECT_EQ(file->last_channel, 6);
  EXPECT_EQ(out.at<float>(3, 4, 0), 3.0f * in.at<float>(3, 4, 5));
  EXPECT_EQ(out.at<float>(3, 4, 1), 0.75f);
}

TEST(Engine, EmptyImagesAndSingleRegions) {
  const Image empty = RandomImage({0, 0, 0, 5}, 3, 9);
  EXPECT_TRUE(Render(Diamond(FromImage(empty))).spec().data_window.empty());
  const Image in = RandomImage({0, 0, 40, 40}, 3, 9);
  const Node node = Diamond(FromImage(in));
  const Image whole = Render(node);
  ImageSpec spec = in.spec();
  spec.data_window = {7, 9, 8, 10};
  const Image one{spec};
  RenderInto(node, one.view());
  for (int c = 0; c < 3; ++c) EXPECT_EQ(one.at<float>(7, 9, c), whole.at<float>(7, 9, c));
  spec.data_window = {30, 30, 41, 40};
  EXPECT_THROW(RenderInto(node, Image(spec).view()), Error);
  EXPECT_THROW(RenderInto(node, ImageView(nullptr, {7, 9, 8, 10}, 3, PixelType::kFloat)), Error);
  EXPECT_THROW(Explain(Node()), Error);
}

TEST(Engine, ProgressGrowsAndCancels) {
  const Image in = RandomImage({0, 0, 64, 64}, 3, 10);
  for (const int threads : {1, 3}) {
    RenderOptions options = Tiles(16, 16, threads);
    double last = 0;
    options.progress = [&](double share) {
      EXPECT_GE(share, last);
      last = share;
      return true;
    };
    Render(Diamond(FromImage(in)), PixelType::kFloat, options);
    EXPECT_EQ(last, 1.0);
    int calls = 0;
    options.progress = [&](double) { return ++calls < 3; };
    EXPECT_THROW(Render(Diamond(FromImage(in)), PixelType::kFloat, options), Cancelled);
  }
}

TEST(Engine, PlanarFlippedAndStridedOutputs) {
  const Image in = RandomImage({0, 0, 45, 20}, 4, 11);
  const Node node = SlowAffineOf(FromImage(in), {1.25f, 0.5f});
  const Image whole = Render(node);
  std::vector<float> memory(45 * 20 * 4 + 45 * 20);
  const Roi w = in.spec().data_window;
  const ImageView planar(reinterpret_cast<std::byte*>(memory.data()), w, 4, PixelType::kFloat, 45 * 20 * 4, 4,
                         45 * 4);
  RenderInto(node, planar);
  const auto check = [&](const ImageView& v) {
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < 45; ++x) {
        for (int c = 0; c < 4; ++c)
          ASSERT_EQ(*reinterpret_cast<float*>(v.At(x, y, c)), whole.at<float>(x, y, c));
      }
    }
  };
  check(planar);
  const ImageView flipped(reinterpret_cast<std::byte*>(memory.data() + 45 * 19 * 4), w, 4, PixelType::kFloat,
                          4, 16, -45 * 16);
  RenderInto(node, flipped);
  check(flipped);
  const ImageView padded(reinterpret_cast<std::byte*>(memory.data()), w, 4, PixelType::kFloat, 4, 20,
                         45 * 20);
  RenderInto(node, padded);
  check(padded);
}

// Pixels that no operation touches keep their bits, those of NaN too, whatever the rows' strides are.
TEST(Engine, UntouchedPixelsKeepTheirBits) {
  const Roi all{-3, 2, 1498, 1411}, part{4, 3, 1490, 1400};
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    for (const int channels : {1, 3, 4, 5}) {
      const auto pixel = static_cast<ptrdiff_t>(PixelBytes(type)) * channels;
      const ptrdiff_t row = pixel * all.width() + 8, rows = all.height();
      std::vector<std::byte> from(static_cast<size_t>(row * rows)), to(from.size());
      uint32_t state = 7;
      for (std::byte& b : from) b = static_cast<std::byte>((state = state * 1664525u + 1013904223u) >> 24);
      ImageSpec spec(all.width(), all.height(), channels, type);
      spec.data_window = all;
      const auto bytes = static_cast<ptrdiff_t>(PixelBytes(type));
      const ConstImageView source(from.data(), all, channels, type, bytes, pixel, row);
      const ImageView sink(to.data(), all, channels, type, bytes, pixel, row);
      for (const Roi& roi : {all, part}) {
        std::fill(to.begin(), to.end(), std::byte{1});
        RenderInto(CropOf(FromView(source, spec), roi), sink.Sub(roi), Tiles(0, 0, 2));
        std::vector<std::byte> wanted(to.size(), std::byte{1});
        for (int y = roi.y0; y < roi.y1; ++y) {
          const ptrdiff_t at = source.At(roi.x0, y) - from.data();
          std::copy_n(from.begin() + at, pixel * roi.width(), wanted.begin() + at);
        }
        EXPECT_TRUE(to == wanted) << channels << " channels";
      }
    }
  }
}

TEST(Engine, LongChainsNeitherRecurseNorSlowDown) {
  const Image in = RandomImage({0, 0, 4, 4}, 4, 12);
  Node node = FromImage(in);
  constexpr int kSteps = testing::kThreadSanitized ? 5000 : 50000;
  for (int i = 0; i < kSteps; ++i) node = SlowAffineOf(node, {1.0f, 1.0f});
  EXPECT_NEAR(Render(node).at<float>(1, 1, 1), kSteps, 3.0f);
}

// The memory of large pictures is kept for the next ones, which are black all the same.
TEST(Engine, PicturesInKeptMemoryAreBlack) {
  for (int round = 0; round < 20; ++round) {
    const Image images[] = {Image(ImageSpec(1024, 1024 + round / 4, 1)), Image(ImageSpec(1024, 1024, 1)),
                            Image(ImageSpec(1024, 1024, 1))};
    const size_t address = reinterpret_cast<size_t>(images[0].view().data);
    EXPECT_EQ(address % 64, 0u);
    for (const Image& image : images) {
      auto* const first = reinterpret_cast<float*>(image.view().data);
      float* const last = first + image.spec().data_window.pixels();
      ASSERT_EQ(std::count(first, last, 0.0f), last - first) << round;
      std::fill(first, last, 7.0f);
    }
  }
}

// No more of it than pictures of 4096x2160 need.
TEST(Engine, LittleMemoryIsKept) {
  if (testing::kSanitized) GTEST_SKIP() << "what is freed is kept for a while";
  const auto resident = [] {
    long pages = 0;
    std::ifstream("/proc/self/statm") >> pages >> pages;
    return static_cast<double>(pages) * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
  };
  const double before = resident();
  for (int mib = 5; mib < 80; ++mib) {
    const Image image(ImageSpec(1024, 256 * mib, 1));
    ASSERT_EQ(image.at<float>(1023, 256 * mib - 1, 0), 0);
  }
  EXPECT_LT(resident(), before + 340);
}

}  // namespace
}  // namespace tessera
