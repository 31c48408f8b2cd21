// Pictures of more than 2^32 samples: every operation that streams, at places far beyond, against the double
// reference.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "graph/op.h"
#include "ops/registry.h"
#include "support/pictures.h"
#include "support/sanitized.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/render.h"
#include "verify/evaluate.h"

namespace tessera {
namespace {

constexpr int kSide = 70000, kChannels = 4;
constexpr int kFilled = 300;  // pixels around each place that are not zero
constexpr char kReferenceTakesAll[] = "its reference takes everything";
constexpr Roi kAll{0, 0, kSide, kSide};

// 19.6 GB of which only the pages that are looked at take memory.
class Sparse {
 public:
  static constexpr size_t kBytes = size_t{kSide} * kSide * kChannels;

  Sparse() {
    data_ = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (data_ == MAP_FAILED) data_ = nullptr;  // a system that promises no more than it has
  }
  ~Sparse() {
    if (data_ != nullptr) munmap(data_, kBytes);
  }
  Sparse(const Sparse&) = delete;
  Sparse& operator=(const Sparse&) = delete;

  std::byte* data() const { return static_cast<std::byte*>(data_); }
  ImageView view() const {
    return {data(), kAll, kChannels, PixelType::kUint8, 1, kChannels, ptrdiff_t{kChannels} * kSide};
  }
  void Fill(const Roi& roi, unsigned seed) const {
    std::mt19937 random(seed);
    const ImageView all = view();
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; ++x) {
        for (int c = 0; c < kChannels; ++c)
          *reinterpret_cast<uint8_t*>(all.At(x, y, c)) = static_cast<uint8_t>(random());
      }
    }
  }

 private:
  void* data_;
};

// No allocation of a whole picture, which other machines would grant and never have.
class MemoryLimit {
 public:
  MemoryLimit() {
    getrlimit(RLIMIT_AS, &before_);
    rlimit limit = before_;
    limit.rlim_cur = std::min<rlim_t>(before_.rlim_cur, Sparse::kBytes + (size_t{6} << 30));
    setrlimit(RLIMIT_AS, &limit);
  }
  ~MemoryLimit() { setrlimit(RLIMIT_AS, &before_); }

 private:
  rlimit before_;
};

double BoundOf(const std::string& name) {
  const ops::OpInfo* const op = ops::FindOp(name);
  return op != nullptr ? op->bound_u : 2.0;
}

class SizesTest : public ::testing::Test {
 protected:
  static constexpr double kSeconds = 2;  // of one place: longer is a pass over whole lines or columns

  void SetUp() override {
    if (sparse_.data() == nullptr) GTEST_SKIP() << "the system refuses 19.6 GB of addresses";
    for (const Roi& place : kPlaces) {
      sparse_.Fill(
          Intersection({place.x0 - kFilled, place.y0 - kFilled, place.x1 + kFilled, place.y1 + kFilled},
                       kAll),
          static_cast<unsigned>(place.x0) + 1);
    }
    spec_ = ImageSpec(kSide, kSide, kChannels, PixelType::kUint8);
  }

  // Why a node is not for this test, or nothing.
  static std::string Beyond(const Node& node) {
    const graph::Op& op = *node.data()->op;
    if (op.Kind() == graph::OpKind::kWhole) return "of whole images";
    for (size_t k = 0; k < node.data()->inputs.size(); ++k) {
      const Node& input = node.data()->inputs[k];
      if (op.NeedsWhole(static_cast<int>(k)) && input.spec().width() == kSide) return "of a whole input";
      const std::string why = Beyond(input);
      if (!why.empty()) return why;
    }
    return "";
  }

  // What is wrong at a place, nothing where all is well, or why it was not looked at in `skipped`.
  std::string Wrong(const Node& node, const Roi& place, std::string& skipped) const {
    const Roi roi = Intersection(place, node.spec().data_window);
    if (roi.empty()) return skipped = "another size", "";
    if (verify::ReferenceEngine::Work(node, roi) > 4e6) return skipped = kReferenceTakesAll, "";
    const int channels = node.spec().channel_count();
    ImageSpec part(roi.width(), roi.height(), channels);
    part.data_window = roi;
    const Image got(part);
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(int(1000 * kSeconds));
    try {
      RenderInto(node, got.view(), {.memory_budget = size_t{1} << 28, .progress = [end](double) {
                                      return std::chrono::steady_clock::now() < end;
                                    }});
    } catch (const Cancelled&) {
      return skipped = "takes long", "";
    }
    verify::ReferenceEngine engine(BoundOf);
    engine.SetDeadline(std::chrono::steady_clock::now() + std::chrono::seconds(10));
    verify::Evaluated want;
    try {
      want = engine.Evaluate(node, roi);
    } catch (const verify::ReferenceEngine::OutOfTime&) {
      return skipped = "its reference takes long", "";
    }
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; ++x) {
        for (int c = 0; c < channels; ++c) {
          if (want.Undecided(x, y, c)) continue;
          const double reference = want.value.at(x, y, c), value = got.at<float>(x, y, c);
          if (std::fabs(value - reference) <= want.tolerance.at(x, y, c) * (1 + 1e-6) + 0x1p-149) continue;
          if (value == reference || (std::isnan(value) && std::isnan(reference))) continue;
          return "at " + std::to_string(x) + "," + std::to_string(y) + " channel " + std::to_string(c) +
                 ": " + std::to_string(value) + ", expected " + std::to_string(reference);
        }
      }
    }
    return "";
  }

  // The inputs' last corner as an image of its own, in the same frame.
  Image Corner() const {
    ImageSpec spec = spec_;
    spec.data_window = {kSide - 3 * kFilled, kSide - 3 * kFilled, kSide, kSide};
    const Image corner(spec);
    RenderInto(FromView(sparse_.view(), spec_), corner.view());
    return corner;
  }
  // How the result's last corner differs from that of the inputs' corner alone.
  std::string WrongCorner(const Node& node, const Node& of_corner, std::string& skipped) const {
    const Roi &all = node.spec().data_window, &window = of_corner.spec().data_window;
    if (all.x1 != window.x1 || all.y1 != window.y1) return skipped = "its corner is another one", "";
    const Roi roi = Intersection({all.x1 - 37, all.y1 - 23, all.x1, all.y1}, window);
    ImageSpec part(roi.width(), roi.height(), node.spec().channel_count());
    part.data_window = roi;
    const Image got(part), want(part);
    try {
      RenderInto(node, got.view(), {.memory_budget = size_t{1} << 28});
    } catch (const Error& e) {  // a corner of what repeats is of all four
      if (KindOf(e) != ErrorKind::kSystem) throw;
      return skipped = "more memory than is allowed", "";
    }
    RenderInto(of_corner, want.view());
    for (int y = roi.y0; y < roi.y1; ++y) {
      for (int x = roi.x0; x < roi.x1; ++x) {
        for (int c = 0; c < part.channel_count(); ++c) {
          const float v = got.at<float>(x, y, c), w = want.at<float>(x, y, c);
          // Transforms have other blocks.
          if (!(std::fabs(v - w) <= 1e-6f * std::max(1.0f, std::fabs(w))) &&
              !(std::isnan(v) && std::isnan(w))) {
            return "at " + std::to_string(x) + "," + std::to_string(y) + ": " + std::to_string(v) +
                   ", of the corner alone " + std::to_string(w);
          }
        }
      }
    }
    return "";
  }

  static constexpr Roi kPlaces[] = {{kSide - 37, kSide - 23, kSide, kSide},
                                    {33331, 61001, 33331 + 37, 61001 + 23}};
  Sparse sparse_;
  ImageSpec spec_;
};

TEST_F(SizesTest, EveryOperationThatStreamsIsRightBeyondTwoToThe32) {
  if (testing::kSanitized) GTEST_SKIP() << "sanitizers keep maps larger than the limit";
  const MemoryLimit limit;
  std::map<std::string, int> skipped;
  int referenced = 0, cornered = 0;
  for (const ops::OpInfo& op : ops::Registry()) {
    for (const std::string& example : op.examples) {
      SCOPED_TRACE(op.name + " " + example);
      const ops::Arguments arguments = ops::ParseExample(op, example);
      std::vector<Node> inputs(static_cast<size_t>(op.Operands(arguments)), FromView(sparse_.view(), spec_));
      const auto build = [&] { return op.make(inputs, arguments, op.generator ? &spec_ : nullptr); };
      Node node = build();
      // Where the first is needed whole, too, the example is none of those that stream.
      for (size_t k = 1; k < inputs.size(); ++k) {
        if (node.data()->op->NeedsWhole(static_cast<int>(k)) && !node.data()->op->NeedsWhole(0))
          inputs[k] = FromImage(testing::Picture({0, 0, 61, 37}, kChannels, PixelType::kFloat, 3));
      }
      node = build();
      std::string why = Beyond(node);
      for (const Roi& place : kPlaces) {
        if (!why.empty()) break;
        EXPECT_EQ(Wrong(node, place, why), "");
        referenced += why.empty();
      }
      // What a picture's corner is made of may lie in its middle.
      if (why == kReferenceTakesAll && op.name == "tileable") why = "its corner is another one";
      if (why == kReferenceTakesAll) {
        const Image corner = Corner();
        for (Node& input : inputs) {
          if (input.spec().width() == kSide) input = FromImage(corner);
        }
        why = "";
        EXPECT_EQ(WrongCorner(node, build(), why), "");
        cornered += why.empty();
      }
      if (!why.empty()) ++skipped[why];
    }
  }
  for (const auto& [why, count] : skipped) std::printf("%4d examples left out: %s\n", count, why.c_str());
  std::printf("%4d places held against the reference, %d corners against pictures of the corner\n",
              referenced, cornered);
  EXPECT_GT(referenced, 500);
  EXPECT_GT(cornered, 20);
}

// Rows 3.2 GB apart, downwards and upwards, in and out.
TEST_F(SizesTest, StridesBeyondTwoToThe31) {
  constexpr ptrdiff_t kApart = 3200000000;
  const Roi window{0, 0, 61, 5};
  const Image dense = testing::Picture(window, kChannels, PixelType::kFloat, 9);
  for (const bool upwards : {false, true}) {
    const ImageView far{sparse_.data() + (upwards ? 4 * kApart : 0),
                        window,
                        kChannels,
                        PixelType::kFloat,
                        4,
                        4 * kChannels,
                        upwards ? -kApart : kApart};
    RenderInto(FromImage(dense), far);
    for (const char* const line : {"blur 5x3 kernel=triangle wrap=mirror", "mulc 0.5", "resize 40x11",
                                   "median 3x3", "hue 30", "warp 0.9,0.3,0,-0.3,0.9,0,2,-4,1"}) {
      const std::string words = line;
      const ops::OpInfo* const op = ops::FindOp(words.substr(0, words.find(' ')));
      const ops::Arguments arguments = ops::ParseExample(*op, words.substr(words.find(' ') + 1));
      const auto of = [&](const Node& input) { return op->make({&input, 1}, arguments, nullptr); };
      ImageSpec spec = dense.spec();
      const Node strided = of(FromView(far, spec)), plain = of(FromImage(dense));
      const Image want = Render(plain);
      ImageView out = far;  // behind the rows, in the same gaps
      out.data += 65536, out.roi = want.spec().data_window;
      if (out.roi.height() > 5) out.roi.y1 = out.roi.y0 + 5;
      RenderInto(strided, out);
      for (int y = out.roi.y0; y < out.roi.y1; ++y) {
        for (int x = out.roi.x0; x < out.roi.x1; ++x) {
          ASSERT_EQ(std::memcmp(out.At(x, y), want.view().At(x, y), 4 * kChannels), 0)
              << line << " at " << x << "," << y;
        }
      }
    }
  }
}

}  // namespace
}  // namespace tessera
