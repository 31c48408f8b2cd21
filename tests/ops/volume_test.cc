// Volumes and distance fields: samples, bounds, exactness of the transform, words, files.
#include "tessera/volume.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "model/distance_transform.h"
#include "model/volume_data.h"
#include "model/volume_settings.h"
#include "tessera/error.h"
#include "tessera/io.h"
#include "tessera/mesh.h"
#include "tessera/ops/hypertexture.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const model::ForEach kInOrder = [](int64_t count, const std::function<void(int64_t)>& task) {
  for (int64_t i = 0; i < count; ++i) task(i);
};

double Length(const Vector3& v) { return std::sqrt(Dot(v, v)); }

Volume Random(const std::array<int, 3>& size, PixelType type, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(0, 1);
  return Volume(VolumeSpec::Centred(size, type), [&](const Vector3&) { return value(random); });
}

TEST(Volume, TrilinearInterpolationIsExactAtVoxelsAndOnLinearFields) {
  const auto linear = [](const Vector3& p) { return 0.3 + 0.2 * p[0] - 0.1 * p[1] + 0.25 * p[2]; };
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    const Volume v(VolumeSpec::Centred({9, 7, 5}, type), linear);
    const double rounding = type == PixelType::kUint8 ? 0.002 : type == PixelType::kHalf ? 3e-4 : 1e-5;
    EXPECT_NEAR(v.Sample(3.25, 2.5, 1.75), linear(v.spec().Position(3.25, 2.5, 1.75)), rounding);
    EXPECT_EQ(v.Sample(3, 2, 1), v.At(3, 2, 1));
    EXPECT_EQ(v.Sample(-5, 2, 1), v.At(0, 2, 1));
    EXPECT_EQ(v.Sample(1e9, 2, 1), v.At(8, 2, 1));
    const Vector3 g = v.Gradient(4, 3, 2);
    EXPECT_NEAR(g[0] / v.spec().spacing[0], 0.2, 40 * rounding);
    EXPECT_NEAR(g[2] / v.spec().spacing[2], 0.25, 40 * rounding);
  }
}

TEST(Volume, NullSamplesAndFunctionsAreRefused) {
  const VolumeSpec spec = VolumeSpec::Centred({4, 4, 4});
  EXPECT_THROW(Volume(spec, nullptr, PixelType::kFloat), Error);
  EXPECT_THROW(Volume(spec, std::function<double(const Vector3&)>()), Error);
}

TEST(Volume, WordsOfChainsAreThoseOfTheGrammar) {
  const std::vector<Dmf> chain = ParseDmf(" bias(.3), noise( .4 , 6 ),lift(.2,1,.5),threshold(-.3,.1),gain");
  ASSERT_EQ(chain.size(), 5u);
  EXPECT_EQ(chain[0].amount, 0.3);
  EXPECT_EQ(chain[1].frequency, 6);
  EXPECT_EQ(chain[2].drift[1], -0.5);
  EXPECT_EQ(chain[3].softness, 0.1);
  EXPECT_EQ(chain[4].amount, 0.5);
  const auto message = [](const char* words) -> std::string {
    try {
      ParseDmf(words);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  struct Case {
    const char *words, *found, *expected;
  };
  for (const Case& c : std::initializer_list<Case>{{"", "an empty step", "bias(.3)"},
                                                   {"bias(.3),,gain(.7)", "an empty step", "bias(.3)"},
                                                   {"bias(.3),", "an empty step", "bias(.3)"},
                                                   {"blur(3)", "\"blur\"", "name(numbers)"},
                                                   {"bias:.3", "\"bias:.3\"", "name(numbers)"},
                                                   {"bias(x)", "\"x\"", "a finite number"},
                                                   {"noise()", "\"\"", "a finite number"},
                                                   {"noise(nan)", "\"nan\"", "a finite number"},
                                                   {"bias(2)", "found 2 in \"bias(2)\"", "between 0 and 1"},
                                                   {"gain(0)", "found 0", "between 0 and 1"},
                                                   {"bias(.3,1)", "2 numbers", "at most 1"},
                                                   {"noise(.3,-1)", "found -1", "from 0 to 1e6"},
                                                   {"threshold(.3,-1)", "found -1", "from 0 to 1e6"},
                                                   {"noise(.3,1,2,3,4)", "5 numbers", "at most 4"},
                                                   {"bias(.3", "parentheses", "name(numbers)"},
                                                   {"bias(.3))", "parentheses", "name(numbers)"},
                                                   {"bias(.3)gain(.7)", "parentheses", "name(numbers)"}}) {
    EXPECT_THAT(message(c.words), HasSubstr(c.found)) << c.words;
    EXPECT_THAT(message(c.words), HasSubstr(c.expected)) << c.words;
  }
}

TEST(Volume, NoiseBlocksHoldOctavesOfOneNoiseOrSamplesOfTheCaller) {
  // Samples of the coarser block lie at twice the positions of the finer one's, shifted by whole samples of
  // it.
  const NoiseBlock noise(NoiseContent::kNoise, 4, 1, 7, 16), octaves(NoiseContent::kFourOctaves, 4, 1, 7, 32);
  const NoiseBlock sum(NoiseContent::kTurbulence, 4, 4, 7, 32);
  const auto& shift = ops::volume::kOctaveShifts[1];
  for (int i = 0; i < 32; ++i) {
    const Vector3 p = {(i + 0.5) / 32, 5.5 / 32, (31.5 - i) / 32};
    double one, four[4];
    noise.Sample({2 * p[0] + shift[0], 2 * p[1] + shift[1], 2 * p[2] + shift[2]}, &one);
    octaves.Sample(p, four);
    EXPECT_NEAR(four[1], one, 1e-4);
    // Turbulence is their sum.
    sum.Sample(p, &one);
    double all = 0;
    for (int k = 0; k < 4; ++k) all += std::fabs(four[k]) / (1 << k);
    EXPECT_NEAR(all, one, 2e-4);
  }
  std::vector<float> samples(64);
  for (size_t i = 0; i < 64; ++i) samples[i] = static_cast<float>(i);
  double value;
  NoiseBlock(samples, 4, 1).Sample({2.5 / 4, 1.5 / 4, 3.5 / 4}, &value);
  EXPECT_NEAR(value, 2 + 4 * 1 + 16 * 3, 1e-3);
  EXPECT_THROW(NoiseBlock(samples, 4, 4), Error);
  EXPECT_THROW(NoiseBlock(samples, 4, 2), Error);
  samples[5] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(NoiseBlock(samples, 4, 1), Error);
}

TEST(Volume, OneVoxelAxesAndNaNAreLegal) {
  const Volume thin(VolumeSpec::Centred({8, 1, 1}), [](const Vector3& p) { return p[0]; });
  EXPECT_EQ(thin.Sample(3, 0.4, -0.3), thin.At(3, 0, 0));
  const Volume holes(VolumeSpec::Centred({4, 4, 4}),
                     [](const Vector3& p) { return p[0] < 0 ? std::nan("") : 2.0; });
  EXPECT_EQ(holes.nan_samples(), 32);
  EXPECT_EQ(holes.At(0, 0, 0), 0);
  EXPECT_EQ(holes.Range()[1], 2);
}

TEST(Volume, RefusesWhatIsNone) {
  EXPECT_THROW(Volume(VolumeSpec{}), Error);
  EXPECT_THROW(Volume().spec(), Error);
  VolumeSpec s = VolumeSpec::Centred({4, 4, 4});
  s.spacing[1] = 0;
  EXPECT_THROW(Volume{s}, Error);
  EXPECT_THROW(Volume(VolumeSpec::Centred({7000, 7000, 7000}, PixelType::kUint8)), Error);
  VolumeSpec endless = s;
  endless.spacing[1] = 1;
  endless.size = {65533, 65533, 2147483645};
  EXPECT_THROW(Volume{endless}, Error);
  VolumeSpec nowhere = VolumeSpec::Centred({4, 4, 4});
  nowhere.origin[1] = std::nan("");
  EXPECT_THROW(Volume{nowhere}, Error);
  const Image stack(ImageSpec(4, 9, 1));
  EXPECT_THROW(Volume::FromImage(stack.view(), 4), Error);
}

TEST(Volume, SlicesOfAnImageStandUpright) {
  const Image stack(ImageSpec(2, 6, 1));
  for (int y = 0; y < 6; ++y) stack.at<float>(0, y) = static_cast<float>(y);
  const Volume v = Volume::FromImage(stack.view(), 2);
  EXPECT_EQ(v.At(0, 2, 0), 0);  // the first slice's upper row
  EXPECT_EQ(v.At(0, 0, 0), 2);
  EXPECT_EQ(v.At(0, 0, 1), 5);
}

TEST(Volume, DistanceTransformEqualsBruteForce) {
  std::mt19937 random(4);
  const std::array<int, 3> size = {13, 9, 11};
  const std::array<double, 3> spacing = {1, 1.7, 0.6};
  std::vector<uint8_t> set(13 * 9 * 11);
  for (auto& s : set) s = random() % 60 == 0;
  std::vector<int32_t> nearest;
  const std::vector<float> squared = model::SquaredDistances(size, set, spacing, &nearest);
  const auto place = [&](size_t i) {
    return Vector3{static_cast<double>(i % 13) * spacing[0], static_cast<double>(i / 13 % 9) * spacing[1],
                   static_cast<double>(i / 117) * spacing[2]};
  };
  for (size_t i = 0; i < set.size(); ++i) {
    double best = std::numeric_limits<double>::infinity();
    const Vector3 p = place(i);
    const auto to = [&](size_t j) {
      const Vector3 q = place(j);
      return Dot({p[0] - q[0], p[1] - q[1], p[2] - q[2]}, {p[0] - q[0], p[1] - q[1], p[2] - q[2]});
    };
    for (size_t j = 0; j < set.size(); ++j) {
      if (set[j]) best = std::min(best, to(j));
    }
    ASSERT_NEAR(squared[i], best, 1e-4) << i;
    ASSERT_NEAR(to(static_cast<size_t>(nearest[i])), best, 1e-4);
  }
  const std::vector<float> none = model::SquaredDistances(size, std::vector<uint8_t>(set.size()), spacing);
  EXPECT_TRUE(std::isinf(none[5]));
}

// From any point of a block a leap of its length meets no cell whose corners reach into the range.
TEST(Volume, LeapsNeverPassABlockThatMatters) {
  const Volume v = Random({37, 22, 29}, PixelType::kUint8, 9);
  const model::VolumeData& data = *v.data();
  const auto grid = data.Leaps(254.5, 1e9, kInOrder);
  std::mt19937 random(2);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const auto leap_at = [&](const Vector3& p) {
    int block = 0;
    const int strides[3] = {1, grid->size[0], grid->size[0] * grid->size[1]};
    for (size_t a = 0; a < 3; ++a) {
      block += (static_cast<int>(std::clamp(p[a], 0.0, v.spec().size[a] - 1.0)) >> grid->shift) * strides[a];
    }
    return grid->leap[static_cast<size_t>(block)] & 255;
  };
  int leaps = 0;
  for (int n = 0; n < 20000; ++n) {
    const Vector3 p = {uniform(0, 36), uniform(0, 21), uniform(0, 28)};
    const int leap = leap_at(p);
    if (leap == 0) continue;
    Vector3 d = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    d = Normalized(d);
    const double far = uniform(0, leap - 1);
    leaps += leap > 1;
    const double code = v.Sample(p[0] + far * d[0], p[1] + far * d[1], p[2] + far * d[2]) * 255;
    ASSERT_LT(code, 254.5);
  }
  EXPECT_GT(leaps, 200);
}

// The pace of a block: by how much the field may change on the way.
TEST(Volume, PaceBoundsTheSlope) {
  const Volume v = DistanceField(Solid::Parse("knot"), VolumeSpec::Centred({40, 40, 40}));
  const auto grid = v.data()->Leaps(-1e9, 0, kInOrder);
  std::mt19937 random(7);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  double largest = 0;
  for (int n = 0; n < 20000; ++n) {
    const Vector3 p = {uniform(0, 39), uniform(0, 39), uniform(0, 39)};
    const auto block = (static_cast<size_t>(p[2]) >> 2) * grid->size[0] * grid->size[1] +
                       (static_cast<size_t>(p[1]) >> 2) * grid->size[0] + (static_cast<size_t>(p[0]) >> 2);
    const float pace = static_cast<float>(grid->leap[block] >> 8) * grid->pace;
    const Vector3 d = Normalized({uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
    const double way = uniform(0, 4);
    const double change = std::fabs(v.Sample(p[0] + way * d[0], p[1] + way * d[1], p[2] + way * d[2]) -
                                    v.Sample(p[0], p[1], p[2]));
    ASSERT_LE(change * pace, way * 1.0001);
    largest = std::max(largest, change * pace / way);
  }
  EXPECT_GT(largest, 0.7) << "the bound is of no use";
}

TEST(DistanceField, OfSolidsHoldsTheirDistances) {
  const Solid torus = Solid::Torus({0, 0, 0}, 0.5, 0.2);
  const Volume v = DistanceField(torus, VolumeSpec::Centred({33, 33, 33}));
  for (int i = 0; i < 33; i += 4) {
    EXPECT_NEAR(v.At(i, 16, 12), torus.Distance(v.spec().Position(i, 16, 12)), 1e-6);
  }
  const Volume coded = DistanceField(torus, VolumeSpec::Centred({33, 33, 33}, PixelType::kUint16), 0.2);
  for (int k = 0; k < 33; ++k) {
    for (int i = 0; i < 33; ++i) {
      const double d = std::clamp(torus.Distance(coded.spec().Position(i, 16, k)), -0.2, 0.2);
      ASSERT_NEAR(coded.At(i, 16, k), d, 0.4 / 65535);
    }
  }
}

// From samples of a smooth function whose level is a sphere, spacing unequal: sub-voxel everywhere, unit
// gradient.
TEST(DistanceField, OfVolumesIsSubVoxel) {
  VolumeSpec spec = VolumeSpec::Centred({44, 36, 30}, PixelType::kFloat, {1, 1.25, 1.4});
  const auto rho = [](const Vector3& p) { return 1 - Length(p); };
  const double radius = 0.55, level = 1 - radius;
  const Volume v(spec, rho);
  const Volume d = DistanceField(v, {.iso = level});
  const double voxel = spec.spacing[2];
  double near = 0, far = 0, inside = 0;
  for (int k = 0; k < 30; ++k) {
    for (int j = 0; j < 36; ++j) {
      for (int i = 0; i < 44; ++i) {
        const double exact = Length(spec.Position(i, j, k)) - radius,
                     error = std::fabs(d.At(i, j, k) - exact) / voxel;
        (std::fabs(exact) < 2 * voxel ? near
         : exact > 0                  ? far
                                      : inside) = std::max(std::fabs(exact) < 2 * voxel ? near
                                          : exact > 0                  ? far
                                                                       : inside,
                                          error);
      }
    }
  }
  EXPECT_LT(near, 0.1);
  EXPECT_LT(far, 0.5);
  EXPECT_LT(inside, 0.5);
  const Volume other = DistanceField(v, {.iso = level, .inside_below = true});
  EXPECT_EQ(other.At(5, 6, 7), -d.At(5, 6, 7));
  const Volume empty = DistanceField(v, {.iso = 5});
  EXPECT_GT(empty.At(3, 3, 3), 1);
}

class VolumeFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("tessera_volume_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  fs::path folder_;
};

TEST_F(VolumeFiles, RawSamplesComeBack) {
  for (const PixelType type : {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat}) {
    const Volume v = Random({5, 4, 3}, type, 1);
    WriteRawVolume(v, Path("a.raw"));
    VolumeFileParams p;
    p.raw.size = {5, 4, 3};
    p.raw.type = type;
    const Volume back = ReadVolume(Path("a.raw"), p);
    for (int i = 0; i < 60; ++i) EXPECT_EQ(back.At(i % 5, i / 5 % 4, i / 20), v.At(i % 5, i / 5 % 4, i / 20));
    p.raw.header = 1;
    EXPECT_THROW(ReadVolume(Path("a.raw"), p), Error);  // too short now
  }
  std::ofstream(Path("be.raw"), std::ios::binary).write("xx\x01\x00\x80\x00", 6);
  VolumeFileParams p;
  p.raw = {.size = {2, 1, 1}, .type = PixelType::kUint16, .header = 2, .big_endian = true};
  EXPECT_NEAR(ReadVolume(Path("be.raw"), p).At(0, 0, 0) * 65535, 256, 1e-6);
  p.raw.is_signed = true;
  EXPECT_NEAR(ReadVolume(Path("be.raw"), p).At(0, 0, 0) * 65535, 32768 + 256, 1e-6);
  EXPECT_NEAR(ReadVolume(Path("be.raw"), p).At(1, 0, 0) * 65535, 0, 1e-6);
  EXPECT_THROW(ReadVolume(Path("none.raw"), p), Error);
}

TEST_F(VolumeFiles, NumberedSlicesAndStacks) {
  for (int k = 0; k < 3; ++k) {
    const Image slice(ImageSpec(4, 2, 1, PixelType::kUint8));
    slice.at<uint8_t>(1, 0) = static_cast<uint8_t>(10 + k);
    Write(FromImage(slice), Path("s." + std::to_string(7 + k) + ".png"));
  }
  const Volume v = ReadVolume(Path("s.#.png"));
  EXPECT_EQ(v.spec().size, (std::array<int, 3>{4, 2, 3}));
  EXPECT_NEAR(v.At(1, 1, 2) * 255, 12, 1e-9);
  EXPECT_THROW(ReadVolume(Path("t.%d.png")), Error);
  EXPECT_THROW(ReadVolume(Path("missing.vdb")), Error);
}

// The product of the last sides is 0 in 64 bits, the header's limit is int64_t's.
TEST_F(VolumeFiles, RawShapesBeyondEveryFileAreRefused) {
  std::ofstream(Path("v.raw")) << "12345678";
  const auto refusal = [&](std::array<int, 3> size, int64_t header) -> std::string {
    VolumeFileParams params;
    params.raw = {.size = size, .type = PixelType::kFloat, .header = header};
    try {
      ReadVolume(Path("v.raw"), params);
    } catch (const Error& e) {
      return e.reason();
    }
    return "";
  };
  constexpr int kLeast = std::numeric_limits<int>::min();
  EXPECT_EQ(refusal({2, 1, 1}, 0), "");
  EXPECT_THAT(refusal({kLeast, 1, 1}, 0), HasSubstr("expected sides of at least 1"));
  EXPECT_THAT(refusal({2, 1, 1}, -1), HasSubstr("a header that is not negative"));
  EXPECT_THAT(refusal({1 << 30, 1 << 30, 4}, 0), HasSubstr("found 8 bytes, expected"));
  EXPECT_THAT(refusal({1, 1, 1}, std::numeric_limits<int64_t>::max()), HasSubstr("found 8 bytes, expected"));
}

// A box turned off the axes, with corners counted both ways and polygons of four.
constexpr char kBox[] =
    "# a comment\no box\n"
    "v -1 -2 -3\nv 1 -2 -3\nv 1 2 -3\nv -1 2 -3\nv -1 -2 3\nv 1 -2 3\nv 1 2 3\nv -1 2 3\nvt 0 0\nvn 0 0 1\n"
    "f 4//1 3//1 2//1 1//1\nf 5 6 7 8\nf 1/1 2/1 6/1 5/1\nf -5 -6 -2 -1\nf 1 5 8 4\nf 2 3 7 6  # the last\n";

TEST_F(VolumeFiles, MeshesAreReadAndFitted) {
  std::ofstream(Path("box.obj")) << kBox;
  Mesh mesh = ReadMesh(Path("box.obj"));
  EXPECT_EQ(mesh.points.size(), 8u);
  EXPECT_EQ(mesh.triangles.size(), 12u);
  EXPECT_EQ(mesh.triangles[6], (std::array<int, 3>{3, 2, 6}));  // counted from the end
  FitMesh(mesh, 1.5);
  EXPECT_NEAR(mesh.points[6][2], 0.75, 1e-12);
  EXPECT_NEAR(mesh.points[6][0], 0.25, 1e-12);
  const auto message = [&](const char* text) {
    std::ofstream(Path("bad.obj")) << text;
    try {
      ReadMesh(Path("bad.obj"));
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(message("v 0 0\n"), HasSubstr("line 1"));
  EXPECT_THAT(message("v 0 0 nan\n"), HasSubstr("finite"));
  EXPECT_THAT(message("v 0 0 0\nf 1 1 2\n"), HasSubstr("point 2"));
  EXPECT_THAT(message("v 0 0 0\nf 1 1\n"), HasSubstr("2 corners"));
  EXPECT_THAT(message("hello\n"), HasSubstr("no faces"));
  EXPECT_THROW(ReadMesh(Path("none.obj")), Error);
  Mesh flat = {{{1, 1, 1}}, {{0, 0, 0}}};
  EXPECT_THROW(FitMesh(flat, 1), Error);
}

TEST_F(VolumeFiles, DistanceFieldOfAMeshIsThatOfItsSolid) {
  std::ofstream(Path("box.obj")) << kBox;
  Mesh mesh = ReadMesh(Path("box.obj"));
  FitMesh(mesh, 1.5);
  const VolumeSpec spec = VolumeSpec::Centred({40, 40, 40});
  if (!HasMeshConverter()) {
    EXPECT_THROW(DistanceField(mesh, spec), Error);
    return;
  }
  const Solid box = Solid::Box({0, 0, 0}, {0.25, 0.5, 0.75});
  const Volume v = DistanceField(mesh, spec);
  const double voxel = spec.spacing[0];
  double near = 0, far = 0;
  for (int k = 0; k < 40; ++k) {
    for (int j = 0; j < 40; ++j) {
      for (int i = 0; i < 40; ++i) {
        const double exact = box.Distance(spec.Position(i, j, k)), error = std::fabs(v.At(i, j, k) - exact);
        (std::fabs(exact) < 2 * voxel ? near : far) =
            std::max(std::fabs(exact) < 2 * voxel ? near : far, error);
      }
    }
  }
  EXPECT_LT(near, 1e-6);
  EXPECT_LT(far, 0.5 * voxel);
  const Volume coded = DistanceField(mesh, VolumeSpec::Centred({40, 40, 40}, PixelType::kUint16), 0.2);
  EXPECT_NEAR(coded.At(20, 20, 20), std::max(box.Distance(spec.Position(20, 20, 20)), -0.2), 0.5 * voxel);
  EXPECT_THROW(DistanceField(mesh, VolumeSpec::Centred({40, 40, 20}, PixelType::kFloat, {1, 1, 1.5})), Error);
  // A side is missing, and a point is there twice.
  Mesh open = mesh;
  open.points.push_back(open.points[0]);
  open.triangles[0][0] = open.triangles[0][0] == 0 ? 8 : open.triangles[0][0];
  EXPECT_EQ(OpenEdges(open), 0u);
  open.triangles.resize(10);
  EXPECT_EQ(OpenEdges(open), 4u);
  try {
    DistanceField(open, spec);
    ADD_FAILURE() << "nothing is inside";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("holes (4 edges"));
  }
  mesh.triangles.push_back({0, 1, 8});
  EXPECT_THROW(DistanceField(mesh, spec), Error);
}

}  // namespace
}  // namespace tessera
