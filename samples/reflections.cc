// Spheres on a wavy floor, given by their normals alone, shown by an environment map: mirror, gloss, diffuse
// light, Fresnel reflection over Phong's lighting, relief from a height image, and what the papers' 8-bit
// framebuffers made of it. Also the environment in every projection.   reflections   Writes
// reflections_*.png, and fails when two projections show different pictures.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "tessera/tessera.h"

namespace {

using tessera::EnvironmentMap;
using tessera::EnvironmentParams;
using tessera::EnvironmentTexture;
using tessera::Image;
using tessera::ImageSpec;
using tessera::Node;
using tessera::Vector3;

constexpr int kWidth = 480, kHeight = 360;

// Radiance of a direction: a sky with a sun and clouds above a chequered floor.
Vector3 Radiance(const Vector3& d) {
  const double sun = std::pow(std::max(0.0, tessera::Dot(d, tessera::Normalized({-1, 1.2, 1.5}))), 900);
  if (d[1] > 0) {
    const double cloud =
        0.25 * std::pow(std::sin(5 * d[0] / (d[1] + 0.3)) * std::sin(4 * d[2] / (d[1] + 0.3)), 2);
    return {0.25 + 0.35 * (1 - d[1]) + cloud + 40 * sun, 0.4 + 0.3 * (1 - d[1]) + cloud + 38 * sun,
            0.8 + 0.1 * (1 - d[1]) + cloud + 32 * sun};
  }
  const double x = d[0] / (0.05 - d[1]), z = d[2] / (0.05 - d[1]);
  // Far away the chequers average out.
  const double sharp = std::exp(-0.02 * (x * x + z * z));
  const double check = (static_cast<int>(std::floor(x) + std::floor(z)) & 1) != 0 ? 1 : -1;
  return {0.3 + 0.22 * check * sharp, 0.22 + 0.15 * check * sharp, 0.15 + 0.08 * check * sharp};
}

Image Sky(int width, int height) {
  const Image map(ImageSpec(width, height, 3));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Vector3 d;
      if (!DirectionOf(EnvironmentMap::kLatLong, width, height, x + 0.5, y + 0.5, &d)) continue;
      const Vector3 color = Radiance(d);
      for (int c = 0; c < 3; ++c) map.at<float>(x, y, c) = static_cast<float>(color[static_cast<size_t>(c)]);
    }
  }
  return map;
}

// Two spheres and a torus in front of nothing: where nothing is, normals are 0. Four rays a pixel would
// smooth the edges; one is enough to see the shading.
Image Normals() {
  const Image image(ImageSpec(kWidth, kHeight, 3));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double u = (x + 0.5 - kWidth / 2.0) / kHeight * 2, v = 1 - (y + 0.5) / kHeight * 2;
      Vector3 n = {0, 0, 0};
      double front = -10;
      const auto sphere = [&](double cx, double cy, double cz, double r) {
        const double dx = (u - cx) / r, dy = (v - cy) / r, square = dx * dx + dy * dy;
        if (square >= 1) return;
        const double dz = std::sqrt(1 - square);
        if (cz + r * dz > front) front = cz + r * dz, n = {dx, dy, dz};
      };
      sphere(-0.35, 0.05, 0, 0.72);
      sphere(0.82, -0.45, 0.3, 0.4);
      const double tx = u - 0.75, ty = v - 0.45, radius = std::hypot(tx, ty), off = (radius - 0.32) / 0.13;
      if (std::fabs(off) < 1 && radius > 0) {
        const double dz = std::sqrt(1 - off * off);
        if (0.13 * dz > front) n = {off * tx / radius, off * ty / radius, dz};
      }
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, c) = static_cast<float>(n[static_cast<size_t>(c)]);
    }
  }
  return image;
}

// Linear light to a screen's codes, brightness above 1 rolled off.
void Save(const Node& node, const std::string& name) {
  const Image image = Render(node);
  const int channels = image.spec().channel_count();
  for (int64_t i = 0; i < image.spec().data_window.pixels() * channels; ++i) {
    float& v = reinterpret_cast<float*>(image.view().data)[i];
    v = std::pow(1 - std::exp(-1.4f * std::max(v, 0.0f)), 1 / 2.2f);
  }
  Write(FromImage(image), "reflections_" + name + ".png", {.type = tessera::PixelType::kUint8});
}

double Difference(const Image& a, const Image& b) {
  double sum = 0;
  const auto count = static_cast<size_t>(a.spec().data_window.pixels() * a.spec().channel_count());
  for (size_t i = 0; i < count; ++i) {
    const auto at = [i](const Image& image) {
      return std::min(reinterpret_cast<const float*>(image.view().data)[i], 1.0f);
    };
    sum += std::fabs(at(a) - at(b));
  }
  return sum / static_cast<double>(count);
}

int Run() {
  const Image sky = Sky(2048, 1024), normals = Normals();
  const Node n = FromImage(normals);
  const EnvironmentTexture latlong(sky, EnvironmentMap::kLatLong);
  const Image mirror = Render(Environment(n, latlong));
  Save(FromImage(mirror), "mirror");

  // The same from every projection.
  struct Projection {
    const char* name;
    EnvironmentMap map;
    int width, height;
  };
  for (const Projection& p : {Projection{"sphere", EnvironmentMap::kSphere, 1024, 1024},
                              Projection{"dualparabolic", EnvironmentMap::kDualParabolic, 2048, 1024},
                              Projection{"cube", EnvironmentMap::kCube, 2048, 1536}}) {
    const Image map =
        Render(ConvertEnvironment(FromImage(sky), {.to = p.map, .width = p.width, .height = p.height}));
    Save(Resize(FromImage(map), {.width = p.width / 4, .height = p.height / 4}),
         std::string("map_") + p.name);
    const double difference = Difference(mirror, Render(Environment(n, EnvironmentTexture(map, p.map))));
    std::printf("%-14s mean difference of the mirror picture %.4f\n", p.name, difference);
    if (difference > 0.012) return 1;
  }
  Save(Resize(FromImage(sky), {.width = 512, .height = 256}), "map_latlong");

  for (const double lobe : {10.0, 60.0}) {
    Save(Environment(n, EnvironmentTexture(sky, EnvironmentMap::kLatLong, lobe)),
         "gloss" + std::to_string(static_cast<int>(lobe)));
  }
  EnvironmentParams along;
  along.direction = tessera::EnvironmentDirection::kNormal;
  const Node diffuse = Environment(n, EnvironmentTexture(sky, EnvironmentMap::kLatLong, 1), along);
  Save(diffuse, "diffuse");
  // A varnish: diffuse light of the sky on a red surface, the sky mirrored by Fresnel's law, and a lamp.
  EnvironmentParams fresnel;
  fresnel.fresnel = 0.04;
  tessera::PhongParams lamp;
  lamp.light = {1, 1, 1}, lamp.exponent = 80, lamp.diffuse = {0.25, 0.03, 0.02},
  lamp.specular = {0.8, 0.8, 0.8};
  const Node varnish =
      Add(Add(MulConstant(diffuse, {0.8, 0.12, 0.08}), Environment(n, latlong, fresnel)), Phong(n, lamp));
  Save(varnish, "varnish");

  // The papers' framebuffers: normals in 8 bits.
  EnvironmentParams coarse;
  coarse.bits = 8;
  Save(Environment(n, latlong, coarse), "mirror_8bit");

  // Relief: a hammered surface on the spheres, tangent along x.
  const Image heights(ImageSpec(kWidth, kHeight, 1)), tangent(ImageSpec(kWidth, kHeight, 3));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      heights.at<float>(x, y) =
          static_cast<float>(3 * std::sin(x * 0.16) * std::sin(y * 0.15) + std::sin(x * 0.07 + y * 0.11));
      tangent.at<float>(x, y, 0) = 1;
    }
  }
  const Node h = FromImage(heights);
  Save(tessera::Bump(h, {.light = {-1, 1, 1}, .scale = 2}), "relief");
  Save(tessera::Bump(h, {.light = {-1, 1, 1},
                         .method = tessera::BumpMethod::kShift,
                         .output = tessera::BumpOutput::kEmboss}),
       "emboss");
  const Node bumped =
      TangentNormals(HeightToNormals(h, {.scale = 0.2}), n, FromImage(tangent), {.packed = false});
  Save(Environment(bumped, latlong), "hammered");
  return 0;
}

}  // namespace

int main() {
  try {
    return Run();
  } catch (const tessera::Error& error) {
    std::fprintf(stderr, "reflections: %s\n", error.what());
    return 1;
  }
}
