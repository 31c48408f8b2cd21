// Volumes larger than the memory they may take: every sample and every picture is that of the whole, what is
// resident stays within the budget, and nothing is left behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "model/volume_data.h"
#include "support/sanitized.h"
#include "support/test_ops.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/io.h"
#include "tessera/ops/volume.h"
#include "tessera/render.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;
using testing::ExpectSameBits;
using ::testing::HasSubstr;

constexpr PixelType kTypes[] = {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat};
constexpr size_t kNone = 1;  // bytes: everything is given back as soon as it has been read

// A ball with waves, smooth enough for surfaces and with something everywhere.
double Wavy(const Vector3& p) {
  return 0.9 - Dot(p, p) * 0.6 + 0.1 * std::sin(9 * p[0] + 5 * p[2]) * std::cos(8 * p[1]);
}
struct Pair {
  Volume whole, paged;
};
template <typename F>
Pair PairOf(const std::array<int, 3>& size, PixelType type, const F& f) {
  VolumeSpec spec = VolumeSpec::Centred(size, type, {1, 1.25, 0.75});
  Pair pair;
  pair.whole = Volume(spec, f);
  spec.memory = kNone;
  pair.paged = Volume(spec, f);
  EXPECT_EQ(pair.whole.data()->pages, nullptr);
  EXPECT_NE(pair.paged.data()->pages, nullptr);
  return pair;
}

TEST(PagedVolume, EverySampleOfEveryBrickIsTheVolumes) {
  std::mt19937 random(5);
  for (const PixelType type : kTypes) {
    for (const std::array<int, 3>& n : {std::array<int, 3>{70, 33, 65},
                                        {1, 1, 1},
                                        {32, 32, 32},
                                        {33, 31, 1},
                                        {2, 64, 34},
                                        {100, 3, 3},
                                        {63, 2, 96}}) {
      SCOPED_TRACE(std::to_string(n[0]) + "x" + std::to_string(n[1]) + "x" + std::to_string(n[2]));
      std::vector<double> values(static_cast<size_t>(n[0]) * n[1] * n[2]);
      for (double& v : values) v = std::uniform_real_distribution<double>(0, 1)(random);
      size_t at = 0;
      const Pair v = PairOf(n, type, [&](const Vector3&) { return values[at++ % values.size()]; });
      const model::VolumeData &whole = *v.whole.data(), &paged = *v.paged.data();
      for (int k = -1; k < n[2] + 2; ++k) {
        for (int j = -1; j < n[1] + 2; ++j) {
          for (int i = -1; i < n[0] + 2; ++i) ASSERT_EQ(whole.Code(i, j, k), paged.Code(i, j, k));
        }
      }
      // What a kernel reads that knows bricks alone: all of each, in the borders what the neighbours hold.
      std::vector<std::byte> row(static_cast<size_t>(n[0] + 3) * PixelBytes(type));
      const auto pixel = static_cast<int64_t>(PixelBytes(type));
      const auto inside = [&](int u, size_t a) { return std::clamp(u, 0, n[a] - 1); };
      for (int bk = 0; bk * 32 < n[2]; ++bk) {
        for (int bj = 0; bj * 32 < n[1]; ++bj) {
          for (int bi = 0; bi * 32 < n[0]; ++bi) {
            const int64_t brick = (bk * paged.bricks[1] + bj * paged.bricks[0] + bi) * model::kBrickSamples;
            for (int k = -1; k < std::min(34, n[2] + 2 - bk * 32); ++k) {
              for (int j = -1; j < std::min(34, n[1] + 2 - bj * 32); ++j) {
                for (int i = -1; i < std::min(34, n[0] + 2 - bi * 32); ++i) {
                  const std::byte* const p =
                      paged.samples + (brick + k * paged.slice + j * paged.row + i) * pixel;
                  const int64_t from =
                      whole.IndexOf(inside(bi * 32 + i, 0), inside(bj * 32 + j, 1), inside(bk * 32 + k, 2));
                  ASSERT_EQ(std::memcmp(p, whole.samples + from * pixel, static_cast<size_t>(pixel)), 0)
                      << bi << " " << bj << " " << bk << ": " << i << " " << j << " " << k;
                }
              }
            }
          }
        }
      }
      EXPECT_EQ(v.whole.Range(), v.paged.Range());
      EXPECT_EQ(v.whole.Sample(n[0] * 0.4, n[1] * 0.7, n[2] * 0.9),
                v.paged.Sample(n[0] * 0.4, n[1] * 0.7, n[2] * 0.9));
      EXPECT_EQ(v.whole.Gradient(n[0] * 0.4, n[1] - 1, n[2] * 0.5),
                v.paged.Gradient(n[0] * 0.4, n[1] - 1, n[2] * 0.5));
    }
  }
}

VolumeParams Seen(const Volume& v, VolumeMode mode) {
  VolumeParams p;
  p.mode = mode;
  p.camera = OrbitCamera(v, 33, 21, 35, 1.2, 1.4);
  p.iso = 0.5;
  p.inside_above = true;
  p.transfer = {{{0.2, {0.2, 0.4, 1}, 0}, {0.5, {1, 0.6, 0.2}, 0.3}, {1, {1, 1, 1}, 0.8}}, 0.2};
  return p;
}
void ExpectSamePictures(const Pair& v, const VolumeParams& p) {
  const ImageSpec size(41, 33, 4);
  const Image whole = Render(RenderVolume(size, v.whole, p));
  ExpectSameBits(whole, Render(RenderVolume(size, v.paged, p)));
  double most = 0;  // something is to be seen
  for (int y = 0; y < 33; ++y) {
    for (int x = 0; x < 41; ++x) most = std::max<double>(most, whole.at<float>(x, y, 3));
  }
  EXPECT_GT(most, 0.01);
}

TEST(PagedVolume, PicturesAreTheWholesBits) {
  for (const PixelType type : kTypes) {
    const Pair v = PairOf({70, 45, 66}, type, Wavy);
    for (const VolumeMode mode : {VolumeMode::kIso, VolumeMode::kBump, VolumeMode::kOver, VolumeMode::kUnder,
                                  VolumeMode::kXray, VolumeMode::kMip, VolumeMode::kAttenuate}) {
      SCOPED_TRACE(static_cast<int>(mode));
      VolumeParams p = Seen(v.whole, mode);
      ExpectSamePictures(v, p);
      p.aovs = mode <= VolumeMode::kBump || mode == VolumeMode::kUnder;
      p.leap = false;
      ExpectSamePictures(v, p);
    }
    VolumeParams p = Seen(v.whole, VolumeMode::kUnder);
    for (const Classification c : {Classification::kPre, Classification::kPreIntegrated}) {
      p.classification = c;
      ExpectSamePictures(v, p);
    }
    p.classification = Classification::kPost;
    p.shade = true;
    p.scatter.shadow = 0.8;
    ExpectSamePictures(v, p);
  }
}

TEST(PagedVolume, EveryMethodReadsBricks) {
  for (const PixelType type : kTypes) {
    const Pair v = PairOf({38, 34, 37}, type, Wavy);
    for (const VolumeMethod method :
         {VolumeMethod::kSlices, VolumeMethod::kShells, VolumeMethod::kStacks, VolumeMethod::kShearWarp}) {
      for (const double fov : {0.0, 30.0}) {
        // Along each axis, either way.
        for (const auto& [azimuth, elevation] :
             {std::array<double, 2>{20, 10}, {110, 10}, {200, 10}, {20, 80}}) {
          VolumeParams p = Seen(v.whole, VolumeMode::kOver);
          p.method = method;
          p.camera = OrbitCamera(v.whole, azimuth, elevation, fov, 1.2, 1);
          ExpectSamePictures(v, p);
        }
      }
    }
  }
}

TEST(PagedVolume, HypertexturesAndScenesReadBricks) {
  VolumeSpec spec = VolumeSpec::Centred({66, 66, 66}, PixelType::kUint16);
  const Solid solid = Solid::Parse("knot");
  Pair v;
  v.whole = DistanceField(solid, spec);
  spec.memory = kNone;
  v.paged = DistanceField(solid, spec);
  ASSERT_NE(v.paged.data()->pages, nullptr);
  for (const VolumeMode mode : {VolumeMode::kMelt, VolumeMode::kFur, VolumeMode::kFire, VolumeMode::kSolid}) {
    VolumeParams p;
    p.mode = mode;
    p.camera = OrbitCamera(v.whole, 33, 21, 35, 1.2, 1.4);
    ExpectSamePictures(v, p);
  }
  // A medium around a surface; both media in one march.
  const Pair cloud = PairOf({50, 40, 34}, PixelType::kUint8, Wavy);
  const auto scene = [](const Volume& a, const Volume& b, VolumeMode mode) {
    std::vector<PlacedVolume> placed(2);
    placed[0].volume = a;
    placed[0].params = Seen(a, VolumeMode::kUnder);
    placed[1].volume = b;
    placed[1].params.mode = mode;
    placed[1].params.camera = placed[0].params.camera;
    return Render(RenderVolumes(ImageSpec(41, 33, 4), placed));
  };
  for (const VolumeMode mode : {VolumeMode::kIso, VolumeMode::kFur})
    ExpectSameBits(scene(cloud.whole, v.whole, mode), scene(cloud.paged, v.paged, mode));
}

TEST(PagedVolume, DistancesToALevelAreTheWholes) {
  const Pair v = PairOf({35, 33, 36}, PixelType::kUint8, Wavy);
  DistanceFieldParams params;
  params.type = PixelType::kUint16;
  const Volume whole = DistanceField(v.whole, params), paged = DistanceField(v.paged, params);
  EXPECT_NE(paged.data()->pages, nullptr);
  for (int k = 0; k < 36; ++k) {
    for (int j = 0; j < 33; ++j) {
      for (int i = 0; i < 35; ++i) ASSERT_EQ(whole.At(i, j, k), paged.At(i, j, k));
    }
  }
}

// A folder of its own, where temporary files go too.
class PagedFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("paged_" + std::to_string(::getpid()));
    fs::create_directories(folder_ / "temporary");
    const char* const before = std::getenv("TMPDIR");
    if (before != nullptr) before_ = before;
    ::setenv("TMPDIR", (folder_ / "temporary").c_str(), 1);
  }
  void TearDown() override {
    EXPECT_TRUE(fs::is_empty(folder_ / "temporary"));
    before_.empty() ? ::unsetenv("TMPDIR") : ::setenv("TMPDIR", before_.c_str(), 1);
    fs::remove_all(folder_);
  }
  std::string Name(const char* name) const { return (folder_ / name).string(); }
  static std::string Bytes(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  fs::path folder_;
  std::string before_;
};

TEST_F(PagedFiles, RawSamplesOfEveryKind) {
  std::mt19937 random(9);
  const std::array<int, 3> size = {67, 34, 35};
  std::string bytes(static_cast<size_t>(67) * 34 * 35 * 4 + 7, '\0');
  for (char& c : bytes) c = static_cast<char>(random());
  std::ofstream(Name("a.raw"), std::ios::binary) << bytes;
  for (const PixelType type : kTypes) {
    for (const bool other : {false, true}) {
      VolumeFileParams params;
      params.raw = {size, type, 7, other, other && type == PixelType::kUint16};
      const Volume whole = ReadVolume(Name("a.raw"), params);
      params.memory = kNone;
      const Volume paged = ReadVolume(Name("a.raw"), params);
      ASSERT_NE(paged.data()->pages, nullptr);
      EXPECT_EQ(whole.nan_samples(), paged.nan_samples());
      WriteRawVolume(whole, Name("whole"));
      WriteRawVolume(paged, Name("paged"));
      EXPECT_EQ(Bytes(Name("whole")), Bytes(Name("paged")));
    }
  }
}

TEST_F(PagedFiles, SlicesOfTheirOwnAndOneAboveTheOther) {
  std::mt19937 random(2);
  const auto picture = [&](int width, int height, const std::string& name) {
    Image image(ImageSpec(width, height, 1, PixelType::kUint16));
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) image.at<uint16_t>(x, y, 0) = static_cast<uint16_t>(random());
    }
    Write(FromImage(image), name);
  };
  for (int k = 0; k < 5; ++k) picture(40, 37, Name(("s" + std::to_string(k) + ".png").c_str()));
  picture(36, 33 * 4, Name("stack.tif"));
  for (const bool stack : {false, true}) {
    VolumeFileParams params;
    params.slices = stack ? 4 : 0;
    const std::string name = Name(stack ? "stack.tif" : "s#.png");
    const Volume whole = ReadVolume(name, params);
    params.memory = kNone;
    const Volume paged = ReadVolume(name, params);
    ASSERT_NE(paged.data()->pages, nullptr);
    WriteRawVolume(whole, Name("whole"));
    WriteRawVolume(paged, Name("paged"));
    EXPECT_EQ(Bytes(Name("whole")), Bytes(Name("paged")));
  }
}

TEST_F(PagedFiles, WhatIsTooShortOrHasNoRoomIsRefused) {
  std::ofstream(Name("a.raw"), std::ios::binary) << std::string(1000, 'a');
  VolumeFileParams params;
  params.raw.size = {40, 40, 40};
  params.memory = kNone;
  const auto message = [&]() -> std::string {
    try {
      ReadVolume(Name("a.raw"), params);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message(), HasSubstr("found 1000 bytes, expected 64000"));
  fs::resize_file(Name("a.raw"), 64000);
  EXPECT_EQ(message(), "");
  const std::string folder = Name("temporary");
  ::setenv("TMPDIR", Name("nowhere").c_str(), 1);
  EXPECT_THAT(message(), HasSubstr(Name("nowhere") + ": cannot hold a temporary file of"));
  EXPECT_THROW(ReadVolume(Name("a.raw"), params), SystemError);
  ::setenv("TMPDIR", folder.c_str(), 1);
  // More than any disk has: refused before anything is written.
  VolumeSpec spec = VolumeSpec::Centred({1 << 13, 1 << 13, 1 << 11}, PixelType::kFloat);
  EXPECT_THROW(Volume{spec}, Error);
  spec.size = {1 << 13, 1 << 13, 1 << 12};
  EXPECT_THROW(Volume{spec}, Error);
}

// 134 MB of samples within 16 MB: what the process takes at most grows by that, bounds of blocks, and what a
// few rays read.
TEST_F(PagedFiles, WhatIsResidentStaysWithinTheBudget) {
  if (testing::kSanitized) GTEST_SKIP() << "sanitizers' shadows are resident too";
  constexpr int kSide = 512;
  {
    std::ofstream stream(Name("a.raw"), std::ios::binary);
    std::string row(static_cast<size_t>(kSide), '\0');
    for (int n = 0; n < kSide * kSide; ++n) {
      const int j = n % kSide - kSide / 2, k = n / kSide - kSide / 2;
      for (int i = 0; i < kSide; ++i) {
        const int x = i - kSide / 2;
        row[static_cast<size_t>(i)] = static_cast<char>(std::max(0, 250 - (x * x + j * j + k * k) / 400));
      }
      stream << row;
    }
  }
  const auto most = [] {
    rusage use;
    getrusage(RUSAGE_SELF, &use);
    return use.ru_maxrss / 1024;  // MB
  };
  VolumeFileParams params;
  params.raw.size = {kSide, kSide, kSide};
  params.memory = size_t{16} << 20;
  // Threads, tables and code are there before.
  const Volume small(VolumeSpec::Centred({64, 64, 64}), Wavy);
  Render(RenderVolume(ImageSpec(160, 120, 4), small, Seen(small, VolumeMode::kUnder)));
  const auto before = most();
  const Volume paged = ReadVolume(Name("a.raw"), params);
  const auto read = most();
  VolumeParams p = Seen(paged, VolumeMode::kUnder);
  const Image picture = Render(RenderVolume(ImageSpec(400, 300, 4), paged, p));
  const auto rendered = most();
  RecordProperty("read", static_cast<int>(read - before));
  RecordProperty("rendered", static_cast<int>(rendered - before));
  EXPECT_LT(read - before, 32);
  // Rays of eight by four pixels, a few voxels apart, cross many bricks, and the system maps 64 KB at a time.
  EXPECT_LT(rendered - before, 100) << read - before;
  params.memory = 0;
  ExpectSameBits(picture, Render(RenderVolume(ImageSpec(400, 300, 4), ReadVolume(Name("a.raw"), params), p)));
  EXPECT_GT(most() - before, 120) << "the whole takes no more either: the test measures nothing";
}

}  // namespace
}  // namespace tessera
