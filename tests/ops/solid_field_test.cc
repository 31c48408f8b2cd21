// Distance fields of solids: every voxel as the whole solid says, whatever was cut away for its block.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "base/half.h"
#include "model/volume_data.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

// Solids of a few parts, most of them near one another, joined and changed in every way.
class RandomSolid {
 public:
  explicit RandomSolid(uint32_t seed) : random_(seed) {}

  Solid Make(int depth) {
    if (depth == 0) return Shape();
    const Solid a = Make(depth - 1);
    switch (Pick(9)) {
      case 0:
        return Union(a, Make(depth - 1));
      case 1:
        return Intersection(a, Make(depth - 1));
      case 2:
        return Difference(a, Make(depth - 1));
      case 3:
        return SmoothUnion(a, Make(depth - 1), Size());
      case 4:
        return SmoothIntersection(a, Make(depth - 1), Size());
      case 5:
        return a.Translated(Place());
      case 6:
        return a.Rotated(Place(), Real(-200, 200));
      case 7:
        return a.Scaled(Real(0.3, 2));
      default:
        return Pick(2) == 0 ? a.Grown(Real(-0.2, 0.2)) : a.Shell(Size());
    }
  }
  int Pick(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
  double Real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

 private:
  double Size() { return Real(0.01, 0.5); }
  Vector3 Place() { return {Real(-1, 1), Real(-1, 1), Real(-1, 1)}; }
  Solid Shape() {
    switch (Pick(9)) {
      case 0:
        return Solid::Sphere(Place(), Size());
      case 1:
        return Solid::Ellipsoid(Place(), {Size(), Size(), Size()});
      case 2:
        return Solid::Box(Place(), {Size() + 0.1, Size() + 0.1, Size() + 0.1}, Real(0, 0.1));
      case 3:
        return Solid::Torus(Place(), Size(), Size());
      case 4:
        return Solid::Capsule(Place(), Place(), Size());
      case 5:
        return Solid::Cone(Place(), Place(), Size(), Size());
      case 6:
        return Solid::Plane(Place(), Real(-1, 1));
      case 7:
        return Solid::Parse("body");
      default: {
        const double slope = Real(-1, 1);
        return Solid::Function([=](const Vector3& p) { return slope * std::sin(p[0]) - 0.1; });
      }
    }
  }

  std::mt19937 random_;
};

double Stored(const model::VolumeData& data, double distance) {
  const double code = (distance - data.code_bias) / data.code_scale;
  switch (data.spec.type) {
    case PixelType::kUint8:
      return std::nearbyint(std::clamp(code, 0.0, 255.0));
    case PixelType::kUint16:
      return std::nearbyint(std::clamp(code, 0.0, 65535.0));
    case PixelType::kHalf:
      return base::FloatFromHalf(base::HalfFromFloat(static_cast<float>(code)));
    default:
      return static_cast<float>(code);
  }
}

TEST(SolidField, IsTheSolidAtEveryVoxel) {
  constexpr PixelType kTypes[] = {PixelType::kUint8, PixelType::kUint16, PixelType::kHalf, PixelType::kFloat};
  for (uint32_t seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomSolid random(seed);
    const Solid solid = random.Make(1 + random.Pick(5));
    VolumeSpec spec = VolumeSpec::Centred({1 + random.Pick(40), 1 + random.Pick(30), 1 + random.Pick(20)},
                                          kTypes[random.Pick(4)], {1, random.Real(0.5, 2), 1});
    if (random.Pick(4) == 0) spec.memory = 1;
    const Volume field = DistanceField(solid, spec, random.Pick(2) == 0 ? 0 : random.Real(0.01, 1));
    const model::VolumeData& data = *field.data();
    int wrong = 0;
    for (int k = 0; k < spec.size[2]; ++k) {
      for (int j = 0; j < spec.size[1]; ++j) {
        for (int i = 0; i < spec.size[0]; ++i) {
          wrong += data.Code(i, j, k) != Stored(data, solid.Distance(spec.Position(i, j, k)));
        }
      }
    }
    ASSERT_EQ(wrong, 0) << "of " << spec.size[0] << "x" << spec.size[1] << "x" << spec.size[2];
  }
}

void ExpectEveryVoxel(const Solid& solid, const VolumeSpec& spec) {
  const Volume field = DistanceField(solid, spec);
  int wrong = 0;
  for (int k = 0; k < spec.size[2]; ++k) {
    for (int j = 0; j < spec.size[1]; ++j) {
      for (int i = 0; i < spec.size[0]; ++i) {
        wrong += field.At(i, j, k) != static_cast<float>(solid.Distance(spec.Position(i, j, k)));
      }
    }
  }
  EXPECT_EQ(wrong, 0);
}

TEST(SolidField, OfPartsFarFromZero) {
  VolumeSpec spec = VolumeSpec::Centred({64, 32, 32}, PixelType::kFloat);
  spec.origin[0] += 1e6;
  ExpectEveryVoxel(SmoothUnion(Solid::Sphere({1e6, 0, 0}, 0.5), Solid::Sphere({1e6 + 3, 0, 0}, 1), 0.5),
                   spec);
}

// Within an ellipsoid the value towards its centre is between its radii, whichever way one comes.
TEST(SolidField, WithinLongEllipsoids) {
  const VolumeSpec spec = VolumeSpec::Centred({51, 51, 51}, PixelType::kFloat);
  const Solid rod = Solid::Ellipsoid({0, 0, 0}, {2, 0.1, 0.1}), ball = Solid::Sphere({0, 0, 0}, 0.5);
  ExpectEveryVoxel(Union(rod, ball), spec);
  ExpectEveryVoxel(Intersection(rod, ball), spec);
  ExpectEveryVoxel(Difference(ball, rod), spec);
  ExpectEveryVoxel(Union(rod.Shell(0.4), ball), spec);
}

TEST(SolidField, FunctionsThatAreNoNumberLeaveZeros) {
  const Solid solid =
      Union(Solid::Function([](const Vector3&) { return std::nan(""); }), Solid::Sphere({0, 0, 0}, 0.1));
  const Volume field = DistanceField(solid, VolumeSpec::Centred({9, 9, 9}, PixelType::kUint8), 0.5);
  EXPECT_EQ(field.data()->nan_samples, 9 * 9 * 9);
}

}  // namespace
}  // namespace tessera
