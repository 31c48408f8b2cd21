// Operations and sources that exist for tests of the engine: written in plain C++, easy to believe.
#ifndef TESSERA_TESTS_SUPPORT_TEST_OPS_H_
#define TESSERA_TESTS_SUPPORT_TEST_OPS_H_

#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include "graph/op.h"
#include "graph/source.h"

namespace tessera::testing {

// A float image of random values in [-1, 2], data window wherever wanted.
inline Image RandomImage(const Roi& window, int channels, uint32_t seed) {
  ImageSpec spec(window.width(), window.height(), channels);
  spec.data_window = spec.display_window = window;
  const Image image(spec);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(-1.0f, 2.0f);
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      for (int c = 0; c < channels; ++c) image.at<float>(x, y, c) = value(random);
    }
  }
  return image;
}

// Bit equality of two images of the same spec.
inline void ExpectSameBits(const Image& a, const Image& b) {
  ASSERT_EQ(a.spec().data_window, b.spec().data_window);
  ASSERT_EQ(a.spec().channel_count(), b.spec().channel_count());
  ASSERT_EQ(a.spec().type, b.spec().type);
  const size_t bytes = static_cast<size_t>(a.spec().data_window.pixels()) * a.spec().channels.size() *
                       PixelBytes(a.spec().type);
  EXPECT_EQ(std::memcmp(a.view().data, b.view().data, bytes), 0);
}

// Gives every NaN of a float or half image the same bits. Of two NaN operands x86 passes one on, by an order
// that is the compiler's choice: between targets a NaN's sign and payload mean nothing.
inline void UnifyNans(const Image& image) {
  const auto unify = [&](auto infinity) {
    using Bits = decltype(infinity);
    const auto magnitudes = static_cast<Bits>(~Bits{0}) >> 1;
    Bits* const samples = reinterpret_cast<Bits*>(image.view().data);
    const size_t count =
        static_cast<size_t>(image.spec().data_window.pixels()) * image.spec().channels.size();
    for (size_t i = 0; i < count; ++i) {
      if ((samples[i] & magnitudes) > infinity) samples[i] = static_cast<Bits>(magnitudes);
    }
  };
  if (image.spec().type == PixelType::kFloat) unify(uint32_t{0x7f800000});
  if (image.spec().type == PixelType::kHalf) unify(uint16_t{0x7c00});
}

// v -> factor * v + offset on every channel, one rounding each; counts the pixels that were computed.
struct SlowAffine {
  float factor = 1, offset = 0;
  std::atomic<int64_t>* pixels = nullptr;
};
class SlowAffineOp final : public graph::OpWith<SlowAffine> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-affine"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    class Stage final : public graph::PointStage {
     public:
      explicit Stage(const SlowAffine& p) : p_(p) {}
      void Run(const graph::PointArgs& a) const override {
        for (int i = 0; i < a.count; ++i) {
          float r[4];
          for (int c = 0; c < 4; ++c) r[c] = p_.factor * a.in[0][c][i] + p_.offset;
          for (int c = 0; c < 4; ++c) a.out[c][i] = r[c];
        }
        if (p_.pixels != nullptr) *p_.pixels += a.count;
      }

     private:
      SlowAffine p_;
    };
    return std::make_unique<Stage>(params());
  }
};
inline Node SlowAffineOf(const Node& in, const SlowAffine& p) {
  return graph::MakeNode(std::make_shared<const SlowAffineOp>(p), {in});
}

// Sum of the (2 rx + 1) x (2 ry + 1) neighbours, in a fixed order.
struct BoxSum {
  int rx = 1, ry = 1;
  Wrap wrap = Wrap::kClamp;
};
class BoxSumOp final : public graph::OpWith<BoxSum> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-box"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::vector<bool> NeededChannels(int, const std::vector<bool>& result, const ImageSpec&) const override {
    return result;
  }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext&) const override {
    class Stage final : public graph::TileStage {
     public:
      explicit Stage(const BoxSum& p) : p_(p) {}
      Roi InputRoi(int, const Roi& out) const override { return Inflate(out, p_.rx, p_.ry); }
      Wrap InputBorder(int) const override { return p_.wrap; }
      void Run(const graph::TileArgs& args) const override {
        const Roi& o = args.out.roi;
        const auto at = [](const auto& view, int x, int y, int c) {
          return reinterpret_cast<const float*>(view.At(x, y, c));
        };
        EXPECT_TRUE(graph::IsDenseFloat(args.in[0]) && graph::IsDenseFloat(args.out));
        for (int y = o.y0; y < o.y1; ++y) {
          for (int x = o.x0; x < o.x1; ++x) {
            for (int c = 0; c < args.out.channels; ++c) {
              float sum = 0;
              for (int dy = -p_.ry; dy <= p_.ry; ++dy) {
                for (int dx = -p_.rx; dx <= p_.rx; ++dx) sum += *at(args.in[0], x + dx, y + dy, c);
              }
              *const_cast<float*>(at(args.out, x, y, c)) = sum;
            }
          }
        }
      }

     private:
      BoxSum p_;
    };
    return std::make_unique<Stage>(params());
  }
};
inline Node BoxSumOf(const Node& in, const BoxSum& p) {
  return graph::MakeNode(std::make_shared<const BoxSumOp>(p), {in});
}

// a - b, sample by sample.
struct Difference {};
class DifferenceOp final : public graph::OpWith<Difference> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-difference"; }
  graph::OpKind Kind() const override { return graph::OpKind::kChannel; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override {
    graph::RequireSameWindow(Name(), in);
    return in[0];
  }
  std::unique_ptr<graph::PointStage> MakePointStage(const graph::StageContext&) const override {
    class Stage final : public graph::PointStage {
     public:
      void Run(const graph::PointArgs& a) const override {
        for (int i = 0; i < a.count; ++i) {
          float r[4];
          for (int c = 0; c < 4; ++c) r[c] = a.in[0][c][i] - a.in[1][c][i];
          for (int c = 0; c < 4; ++c) a.out[c][i] = r[c];
        }
      }
    };
    return std::make_unique<Stage>();
  }
};
inline Node DifferenceOf(const Node& a, const Node& b) {
  return graph::MakeNode(std::make_shared<const DifferenceOp>(Difference{}), {a, b});
}

// The picture upside down: asks for its rows in the wrong order.
struct FlipRows {};
class FlipRowsOp final : public graph::OpWith<FlipRows> {
 public:
  using OpWith::OpWith;
  std::string Name() const override { return "test-flip"; }
  graph::OpKind Kind() const override { return graph::OpKind::kTile; }
  ImageSpec OutputSpec(std::span<const ImageSpec> in) const override { return in[0]; }
  std::unique_ptr<graph::TileStage> MakeTileStage(const graph::StageContext& context) const override {
    class Stage final : public graph::TileStage {
     public:
      explicit Stage(const Roi& w) : sum_(w.y0 + w.y1) {}
      Roi InputRoi(int, const Roi& o) const override { return {o.x0, sum_ - o.y1, o.x1, sum_ - o.y0}; }
      void Run(const graph::TileArgs& args) const override {
        const Roi& o = args.out.roi;
        for (int y = o.y0; y < o.y1; ++y) {
          std::memcpy(args.out.At(o.x0, y), args.in[0].At(o.x0, sum_ - 1 - y),
                      static_cast<size_t>(args.out.pixel_stride) * static_cast<size_t>(o.width()));
        }
      }

     private:
      int sum_;
    };
    return std::make_unique<Stage>(context.output.data_window);
  }
};
inline Node FlipRowsOf(const Node& in) {
  return graph::MakeNode(std::make_shared<const FlipRowsOp>(FlipRows{}), {in});
}

// A "file": an image that must be read in rows, ascending, never twice; records what was asked.
class FakeFile final : public graph::PixelSource {
 public:
  explicit FakeFile(Image image) : image_(std::move(image)) {}
  const ImageSpec& spec() const override { return image_.spec(); }
  std::string Describe() const override { return "fake file"; }
  std::unique_ptr<graph::RowReader> Open(int first, int last) const override {
    class Reader final : public graph::RowReader {
     public:
      Reader(const FakeFile& file, int first, int last) : file_(file), first_(first), last_(last) {}
      void Read(const ImageView& out) override {
        const Roi& r = out.roi;
        EXPECT_GE(r.y0, next_) << "rows read twice or backwards";
        EXPECT_TRUE(file_.spec().data_window.Contains(r));
        EXPECT_EQ(out.channels, last_ - first_);
        next_ = r.y1;
        file_.rows_read += r.height();
        file_.largest_read = std::max<int64_t>(file_.largest_read, r.height());
        for (int y = r.y0; y < r.y1; ++y) {
          for (int x = r.x0; x < r.x1; ++x) {
            std::memcpy(out.At(x, y), file_.image_.view().At(x, y, first_),
                        static_cast<size_t>(last_ - first_) * PixelBytes(out.type));
          }
        }
      }

     private:
      const FakeFile& file_;
      int first_, last_, next_ = INT32_MIN;
    };
    first_channel = first;
    last_channel = last;
    return std::make_unique<Reader>(*this, first, last);
  }

  mutable std::atomic<int64_t> rows_read{0}, largest_read{0};
  mutable std::atomic<int> first_channel{-1}, last_channel{-1};

 private:
  Image image_;
};

}  // namespace tessera::testing

#endif  // TESSERA_TESTS_SUPPORT_TEST_OPS_H_
