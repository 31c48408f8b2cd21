// AOVs by renderers' names, cameras from metadata and numbers, depths of all kinds, positions from depths.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "../samples/ray_caster.h"
#include "support/apply.h"
#include "support/noise_values.h"
#include "tessera/camera.h"
#include "tessera/error.h"
#include "tessera/ops/shade.h"
#include "tessera/targets.h"

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::Values;

ImageSpec Named(std::vector<std::string> channels) {
  ImageSpec spec(2, 2, static_cast<int>(channels.size()));
  spec.channels = std::move(channels);
  return spec;
}

TEST(Aov, BlenderNames) {
  const ImageSpec spec =
      Named({"Composite.Combined.R", "ViewLayer.Combined.A", "ViewLayer.Combined.B", "ViewLayer.Combined.G",
             "ViewLayer.Combined.R", "ViewLayer.Depth.Z", "ViewLayer.Mist.Z", "ViewLayer.Normal.X",
             "ViewLayer.Normal.Y", "ViewLayer.Normal.Z", "ViewLayer.Position.X", "ViewLayer.Position.Y",
             "ViewLayer.Position.Z", "ViewLayer.Vector.W", "ViewLayer.Vector.X", "ViewLayer.Vector.Y",
             "ViewLayer.Vector.Z", "ViewLayer.IndexOB.X"});
  EXPECT_THAT(FindAov(spec, Aov::kColor, "ViewLayer"), ElementsAre(4, 3, 2, 1));
  EXPECT_THAT(FindAov(spec, Aov::kPosition), ElementsAre(10, 11, 12));
  EXPECT_THAT(FindAov(spec, Aov::kNormal), ElementsAre(7, 8, 9));
  EXPECT_THAT(FindAov(spec, Aov::kDepth), ElementsAre(5));
  EXPECT_THAT(FindAov(spec, Aov::kMist), ElementsAre(6));
  EXPECT_THAT(FindAov(spec, Aov::kMotion), ElementsAre(14, 15, 16, 13));
  EXPECT_THAT(FindAov(spec, Aov::kId), ElementsAre(17));
  EXPECT_THAT(FindAov(spec, Aov::kRest), IsEmpty());
}

TEST(Aov, OtherRenderersNames) {
  // Arnold and Karma.
  const ImageSpec arnold = Named(
      {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "Pref.R", "Pref.G", "Pref.B"});
  EXPECT_THAT(FindAov(arnold, Aov::kColor), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(FindAov(arnold, Aov::kDepth), ElementsAre(4));
  EXPECT_THAT(FindAov(arnold, Aov::kPosition), ElementsAre(8, 9, 10));
  EXPECT_THAT(FindAov(arnold, Aov::kRest), ElementsAre(11, 12, 13));
  // RenderMan, lower case components.
  const ImageSpec prman = Named({"Ci.r", "Ci.g", "Ci.b", "a", "__Pworld.r", "__Pworld.g", "__Pworld.b",
                                 "__Nworld.r", "__Nworld.g", "__Nworld.b", "z"});
  EXPECT_THAT(FindAov(prman, Aov::kColor), ElementsAre(0, 1, 2));
  EXPECT_THAT(FindAov(prman, Aov::kPosition), ElementsAre(4, 5, 6));
  EXPECT_THAT(FindAov(prman, Aov::kNormal), ElementsAre(7, 8, 9));
  EXPECT_THAT(FindAov(prman, Aov::kDepth), ElementsAre(10));
  // V-Ray.
  const ImageSpec vray = Named({"R", "G", "B", "zDepth.R", "normals.X", "normals.Y", "normals.Z",
                                "worldPosition.R", "worldPosition.G", "worldPosition.B", "objectID"});
  EXPECT_THAT(FindAov(vray, Aov::kPosition), ElementsAre(7, 8, 9));
  EXPECT_THAT(FindAov(vray, Aov::kDepth), ElementsAre(3));
  EXPECT_THAT(FindAov(vray, Aov::kId), ElementsAre(10));
  // A position image's own Z is no depth.
  EXPECT_THAT(FindAov(Named({"X", "Y", "Z"}), Aov::kDepth), IsEmpty());
  EXPECT_THAT(FindAov(Named({"X", "Y", "Z"}), Aov::kPosition), ElementsAre(0, 1, 2));
  try {
    SelectAov(FromImage(Image(ImageSpec(1, 1, 3))), Aov::kNormal);
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("R,G,B"));
  }
}

// Lists that files were found to have, with where they were published.
TEST(Aov, ChannelListsOfFilesInTheWild) {
  // V-Ray for 3ds Max, a file's header at arbredor.be, "vue aerienne nuit" (shortened by reflection and
  // refraction).
  const ImageSpec vray = Named({"A",
                                "B",
                                "G",
                                "R",
                                "VRayMtlID.A",
                                "VRayMtlID.B",
                                "VRayMtlID.G",
                                "VRayMtlID.R",
                                "VRaySpecular.A",
                                "VRaySpecular.B",
                                "VRaySpecular.G",
                                "VRaySpecular.R",
                                "VRayWireColor.A",
                                "VRayWireColor.B",
                                "VRayWireColor.G",
                                "VRayWireColor.R",
                                "VRayZDepth.A",
                                "VRayZDepth.B",
                                "VRayZDepth.G",
                                "VRayZDepth.R"});
  EXPECT_THAT(FindAov(vray, Aov::kColor), ElementsAre(3, 2, 1, 0));
  EXPECT_THAT(FindAov(vray, Aov::kDepth), ElementsAre(19));
  EXPECT_THAT(FindAov(vray, Aov::kId), ElementsAre(7));
  EXPECT_THAT(FindAov(vray, Aov::kNormal), IsEmpty());
  // RenderMan, exrinfo in RenderManForBlender's issue 468.
  const ImageSpec renderman = Named({"Ci.b", "Ci.g", "Ci.r", "Ci.~w", "a", "a.~w"});
  EXPECT_THAT(FindAov(renderman, Aov::kColor), ElementsAre(2, 1, 0));
  EXPECT_THAT(FindAov(renderman, Aov::kDepth), IsEmpty());
  // Arnold through USD's raster product, oiiotool in arnold-usd's issue 2115; its own product and Karma write
  // R,G,B,A.
  EXPECT_THAT(FindAov(Named({"RGBA.R", "RGBA.G", "RGBA.B", "RGBA.A"}), Aov::kColor), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(FindAov(Named({"R", "G", "B", "A"}), Aov::kColor), ElementsAre(0, 1, 2, 3));
  // Houdini's Mantra, a file of normals: oiiotool's output in ayon-houdini's issue 76.
  const ImageSpec mantra = Named({"N.x", "N.y", "N.z"});
  EXPECT_THAT(FindAov(mantra, Aov::kNormal), ElementsAre(0, 1, 2));
  EXPECT_THAT(FindAov(mantra, Aov::kDepth), IsEmpty());
  // A deep file of Houdini's, ayon-core's issue 1520.
  EXPECT_THAT(FindAov(Named({"A", "RA", "GA", "BA", "Z", "ZBack"}), Aov::kDepth), ElementsAre(4));
}

TEST(Aov, MaskTurnsBackgroundIntoNaN) {
  const Image image(ImageSpec(3, 1, 3)), mask(ImageSpec(3, 1, 1));
  for (int x = 0; x < 3; ++x) image.at<float>(x, 0, 1) = 5, mask.at<float>(x, 0) = static_cast<float>(x - 1);
  const std::vector<float> v = Values(MaskAov(FromImage(image), FromImage(mask)));
  EXPECT_TRUE(std::isnan(v[0]) && std::isnan(v[3]));
  EXPECT_EQ(v[7], 5);
}

void ExpectSameCamera(const Camera& a, const Camera& b, double tolerance) {
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(a.eye()[k], b.eye()[k], tolerance);
    EXPECT_NEAR(a.forward()[k], b.forward()[k], tolerance);
  }
  for (const double x : {-0.7, 0.4}) {
    const Camera::Ray one = a.RayAt(x, 0.3), other = b.RayAt(x, 0.3);
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(one.origin[k], other.origin[k], tolerance);
      EXPECT_NEAR(one.direction[k], other.direction[k], tolerance);
    }
  }
}

TEST(CameraTest, MatricesAreTakenApartAndPutTogether) {
  const Camera p = Camera::Perspective({3, 4, 5}, {-1, 0.5, 2}, {0, 1, 0}, 50, 1.5);
  const Camera o = Camera::Parallel({3, 4, 5}, {-1, 0.5, 2}, {0, 1, 0}, 8, 1.5);
  for (const Camera& c : {p, o}) {
    EXPECT_NEAR(c.eye()[0], 3, 1e-12);
    EXPECT_NEAR(c.eye()[2], 5, 1e-12);
    // A point on a ray projects to where the ray was asked for, at its depth.
    const Vector3 at = c.PointAt(0.25, -0.6, 7);
    const auto clip = Transform(c.world_to_clip(), at);
    EXPECT_NEAR(clip[0] / clip[3], 0.25, 1e-12);
    EXPECT_NEAR(clip[1] / clip[3], -0.6, 1e-12);
    EXPECT_NEAR(c.PlanarDepth(at), 7, 1e-12);
    const Camera again(c.world_to_camera(), c.world_to_clip());
    ExpectSameCamera(c, again, 1e-12);
    // Through a file's float attributes.
    ImageSpec spec(4, 3, 1);
    c.ToMetadata(spec);
    ExpectSameCamera(c, *Camera::FromMetadata(spec), 1e-5);
  }
  ExpectSameCamera(p, Camera(p.world_to_clip()), 1e-12);
  EXPECT_TRUE(p.perspective());
  EXPECT_FALSE(o.perspective());
  // Some renderers leave depth out of worldToNDC.
  Matrix4 flat = p.world_to_clip();
  for (size_t k = 8; k < 12; ++k) flat[k] = 0;
  ExpectSameCamera(p, Camera(flat), 1e-12);
  EXPECT_FALSE(Camera::FromMetadata(ImageSpec(1, 1, 1)).has_value());
  EXPECT_THROW(Camera(Matrix4{}), Error);
  EXPECT_THROW(Camera::FromNumbers(std::vector<double>(15)), Error);
  EXPECT_THROW(Camera::Perspective({0, 0, 0}, {0, 1, 0}, {0, 1, 0}, 50, 1), Error);
  EXPECT_THROW(Inverse(Matrix4{1, 2, 3, 4, 2, 4, 6, 8}), Error);
}

TEST(CameraTest, MatricesTellTheirPlanes) {
  const Vector3 eye = {3, 4, 5}, target = {-1, 0.5, 2}, up = {0, 1, 0};
  const auto from_file = [](const Camera& camera) {
    ImageSpec spec(4, 3, 1);
    camera.ToMetadata(spec);
    return Camera::FromMetadata(spec)->ClipPlanes();
  };
  for (const Camera& c : {Camera::Perspective(eye, target, up, 50, 1.5, 0.25, 90),
                          Camera::Parallel(eye, target, up, 8, 1.5, 0.25, 90)}) {
    ASSERT_TRUE(c.ClipPlanes().has_value());
    EXPECT_NEAR(c.ClipPlanes()->near, 0.25, 1e-10);
    EXPECT_NEAR(c.ClipPlanes()->far, 90, 1e-8);
    EXPECT_NEAR(from_file(c)->near, 0.25, 2e-5);
    EXPECT_NEAR(from_file(c)->far, 90, 5e-3);
  }
  // A parallel camera may see what is behind its own plane; the matrix alone counts from the near plane.
  const Camera behind = Camera::Parallel(eye, target, up, 8, 1.5, -7, 9);
  EXPECT_NEAR(behind.ClipPlanes()->near, -7, 1e-10);
  EXPECT_NEAR(Camera(behind.world_to_clip()).ClipPlanes()->far, 16, 1e-10);
  // Endless: clip z = w - 2 near.
  const Camera p = Camera::Perspective(eye, target, up, 50, 1.5, 0.25, 90);
  Matrix4 m = p.world_to_clip();
  for (size_t k = 0; k < 4; ++k) m[8 + k] = m[12 + k] - (k == 3 ? 0.5 : 0);
  EXPECT_NEAR(Camera(m).ClipPlanes()->near, 0.25, 1e-10);
  EXPECT_EQ(Camera(m).ClipPlanes()->far, std::numeric_limits<double>::infinity());
  // Without depths, with the planes exchanged, with planes that lie askew.
  for (size_t k = 0; k < 4; ++k) m[8 + k] = 0;
  EXPECT_FALSE(Camera(m).ClipPlanes().has_value());
  for (size_t k = 0; k < 4; ++k) m[8 + k] = -p.world_to_clip()[8 + k];
  EXPECT_FALSE(Camera(m).ClipPlanes().has_value());
  m = p.world_to_clip();
  m[8] += 0.3;
  EXPECT_FALSE(Camera(m).ClipPlanes().has_value());
}

class PlaceTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { SetSimdTarget(GetParam()); }
  void TearDown() override { SetSimdTarget("auto"); }
};
INSTANTIATE_TEST_SUITE_P(EveryTarget, PlaceTest, ::testing::ValuesIn(SimdTargets()),
                         [](const auto& info) { return info.param; });

// Positions cast by the sample's ray caster come back from depths of every kind.
TEST_P(PlaceTest, PositionsComeBackFromDepths) {
  const auto scene = ray_caster::Scene::Default();
  constexpr int kWidth = 40, kHeight = 30;
  constexpr double kNear = 0.5, kFar = 60;
  for (const Camera& camera :
       {Camera::Perspective({0.5, 2.6, 11}, {0, 1, 0}, {0, 1, 0}, 50, 4.0 / 3, kNear, kFar),
        Camera::Parallel({8, 12, 11}, {0, 1, 0}, {0, 1, 0}, 9, 4.0 / 3, kNear, kFar)}) {
    const Image planar(ImageSpec(kWidth, kHeight, 1));
    std::vector<Vector3> places;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Camera::Ray ray = camera.PixelRay(planar.spec().data_window, x, y);
        const ray_caster::Hit hit = scene.Cast(ray.origin, ray.direction, 0.01, kFar);
        planar.at<float>(x, y) = static_cast<float>(hit.t);
        places.push_back(ray_caster::Plus(ray.origin, ray.direction, hit.t));
      }
    }
    for (const DepthKind kind :
         {DepthKind::kPlanar, DepthKind::kEuclidean, DepthKind::kWindow, DepthKind::kReversedWindow}) {
      DepthParams to{DepthKind::kPlanar, kind, camera, kNear, kFar, !camera.perspective()}, from = to;
      std::swap(from.from, from.to);
      const std::vector<float> v = Values(PositionFromDepth(ConvertDepth(FromImage(planar), to), from));
      // A window depth keeps few digits of what is far away.
      const double tolerance = kind == DepthKind::kWindow ? 6e-3 : 1e-4;
      int hits = 0;
      for (size_t i = 0; i < places.size(); ++i) {
        if (!std::isfinite(places[i][0])) continue;
        ++hits;
        for (size_t k = 0; k < 3; ++k)
          EXPECT_NEAR(v[3 * i + k], places[i][k], tolerance) << static_cast<int>(kind);
      }
      EXPECT_GT(hits, 300);
    }
  }
}

TEST_P(PlaceTest, WindowDepthsEndWhereTheyShould) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  EXPECT_DOUBLE_EQ(PlanarOfWindow(0, 0.5, 20), 0.5);
  EXPECT_DOUBLE_EQ(PlanarOfWindow(1, 0.5, 20), 20);
  EXPECT_EQ(PlanarOfWindow(1, 0.5, kInf), kInf);
  EXPECT_DOUBLE_EQ(PlanarOfWindow(WindowOfPlanar(3.7, 0.5, 20), 0.5, 20), 3.7);
  const Image depth(ImageSpec(2, 1, 1));
  depth.at<float>(0, 0) = 1, depth.at<float>(1, 0) = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> v =
      Values(ConvertDepth(FromImage(depth), {DepthKind::kWindow, DepthKind::kPlanar, {}, 0.5, kInf}));
  EXPECT_EQ(v[0], std::numeric_limits<float>::infinity());
  EXPECT_TRUE(std::isnan(v[1]));
}

// Window depths are clip z of the camera's own matrix, halved: planes and perspective come from it.
TEST_P(PlaceTest, WindowDepthsAreTheCameras) {
  for (const Camera& camera : {Camera::Perspective({1, 2, 9}, {0, 1, 0}, {0, 1, 0}, 40, 1, 0.5, 60),
                               Camera::Parallel({1, 2, 9}, {0, 1, 0}, {0, 1, 0}, 9, 1, -3, 40)}) {
    ImageSpec spec(16, 16, 1);
    camera.ToMetadata(spec);
    const Image planar(spec);
    std::vector<double> window;
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        const double depth = 0.6 + 0.2 * (16 * y + x);
        planar.at<float>(x, y) = static_cast<float>(depth);
        const auto clip = ClipOfPixel(spec.data_window, x, y);
        const auto p = Transform(camera.world_to_clip(), camera.PointAt(clip[0], clip[1], depth));
        window.push_back(0.5 * (p[2] / p[3] + 1));
      }
    }
    for (const bool reversed : {false, true}) {
      const std::string kind = reversed ? "reversed" : "window";
      const Node there = testing::Apply({"depth", "to=" + kind}, {FromImage(planar)});
      const Node back = testing::Apply({"depth", "to=planar from=" + kind}, {there});
      const std::vector<float> v = Values(there), d = Values(back);
      for (size_t i = 0; i < v.size(); ++i) {
        EXPECT_NEAR(v[i], reversed ? 1 - window[i] : window[i], 2e-6);
        EXPECT_NEAR(d[i], Values(FromImage(planar))[i], 2e-3);
      }
    }
    // Said on the line they win.
    const std::vector<float> said =
        Values(testing::Apply({"depth", "to=window near=1 far=11"}, {FromImage(planar)}));
    const double depth = 0.6 + 0.2 * 100;
    EXPECT_NEAR(said[100], camera.perspective() ? 1.1 - 1.1 / depth : (depth - 1) / 10, 2e-6);
  }
}

// What takes positions, normals or depths gives from a file of AOVs, where they are not the first channels,
// the bits that it gives from the AOV alone.
TEST(Aov, OperationsFindTheirsByName) {
  ImageSpec spec(12, 9, 11);
  spec.channels = {"R", "G", "B", "A", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "Z"};
  spec.alpha = 3;
  const Image image(spec);
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 12; ++x) {
      const auto t = static_cast<float>(12 * y + x);
      for (int c = 0; c < 4; ++c) image.at<float>(x, y, c) = 0.1f + 0.003f * t + 0.1f * static_cast<float>(c);
      const float normal[] = {std::sin(0.2f * t), std::cos(0.3f * t), 1};
      const float place[] = {0.37f * static_cast<float>(x), -0.21f * static_cast<float>(y), -2 - 0.01f * t};
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, 4 + c) = normal[c];
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, 7 + c) = place[c];
      image.at<float>(x, y, 10) = 2 + 0.01f * t;
    }
  }
  const Node all = FromImage(image), colour = SelectAov(all, Aov::kColor);
  const Node normal = SelectAov(all, Aov::kNormal), position = SelectAov(all, Aov::kPosition),
             depth = SelectAov(all, Aov::kDepth);
  const std::string camera = "camera=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,0";
  struct Case {
    testing::Words words;
    std::vector<Node> alone, files;
  };
  for (const Case& c : std::vector<Case>{
           {{"noiseat", "dims=3 freq=3"}, {position}, {all}},
           {{"noiseat", "dims=2 freq=3"}, {position}, {all}},
           {{"shapedspots", ""}, {position}, {all}},
           {{"solid", "procedure=noise freq=3"}, {colour, position}, {colour, all}},
           {{"transform", "1,0.5,0,2,0,1,-0.25,1,0.125,0,2,-1,0,0,0,1"}, {position}, {all}},
           {{"normals", "flip=1"}, {normal}, {all}},
           {{"phong", "light=1,1,1"}, {normal}, {all}},
           {{"phong", "position=1 point=1 light=3,4,5 eye=1,2,3"}, {normal, position}, {all, all}},
           {{"envmap", ""}, {normal, colour}, {all, colour}},
           {{"envmap", "position=1 eye=1,2,3"}, {normal, position, colour}, {all, all, colour}},
           {{"combinenormals", "2"}, {normal, normal}, {all, all}},
           {{"depth", "from=window to=planar near=0.5 far=20"}, {depth}, {all}},
           {{"position", camera}, {depth}, {all}},
           {{"halo", ""}, {colour, depth}, {colour, all}}}) {
    if (ops::FindOp(c.words.op) == nullptr) {
      ADD_FAILURE() << c.words.op;
      continue;
    }
    EXPECT_EQ(Values(testing::Apply(c.words, c.files)), Values(testing::Apply(c.words, c.alone)))
        << c.words.op << ' ' << c.words.arguments;
  }
}

// Six channels are no positions in two parts unless they are said to be.
TEST(Aov, NoiseReadsLowPartsOnRequestAlone) {
  const Image image(ImageSpec(8, 1, 6));
  for (int x = 0; x < 8; ++x) {
    for (int c = 0; c < 6; ++c) image.at<float>(x, 0, c) = 0.37f * static_cast<float>(x) + 0.21f * c;
  }
  const Node six = FromImage(image), three = PositionsOf(six);
  EXPECT_EQ(Values(testing::Apply({"noiseat", "dims=3"}, {six})),
            Values(testing::Apply({"noiseat", "dims=3"}, {three})));
  EXPECT_NE(Values(testing::Apply({"noiseat", "dims=3 low=1"}, {six})),
            Values(testing::Apply({"noiseat", "dims=3"}, {three})));
}

}  // namespace
}  // namespace tessera
