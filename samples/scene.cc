// Casts an analytic scene into an OpenEXR file: a view with its AOVs, or a light's depths.
//   scene view OUT.exr [size=1280x720] [eye=x,y,z] [target=x,y,z] [fov=degrees] [sun=x,y,z]
//   scene light OUT.exr [size=1024x1024] [eye=…] [target=…] [fov=degrees | height=units] [near=] [far=]
// view: R,G,B,A without shadows; direct and ambient, whose sum they are; P and N in world space; Z, the
// planar depth; id. light: Z, the clip depth mapped to [0,1], 1 where nothing is hit. Both carry
// worldToCamera and worldToNDC.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <thread>

#include "ray_caster.h"
#include "tessera/camera.h"
#include "tessera/error.h"
#include "tessera/io.h"
#include "tessera/node.h"

namespace {

using ray_caster::Hit;
using ray_caster::Plus;
using ray_caster::Scene;
using tessera::Camera;
using tessera::Vector3;

constexpr double kSkyRadius = 400;  // the sky is a surface this far from the eye

// key=value words; the program's defaults for what is not given.
class Settings {
 public:
  Settings(int count, char** words) {
    for (int i = 0; i < count; ++i) {
      const char* const equals = std::strchr(words[i], '=');
      if (equals == nullptr) throw tessera::Error(words[i], "expected key=value");
      values_[std::string(words[i], static_cast<size_t>(equals - words[i]))] = equals + 1;
    }
  }
  bool Given(const std::string& key) const { return values_.count(key) != 0; }
  double Number(const std::string& key, double otherwise) const {
    return Given(key) ? std::strtod(values_.at(key).c_str(), nullptr) : otherwise;
  }
  Vector3 Vector(const std::string& key, Vector3 otherwise) const {
    if (!Given(key)) return otherwise;
    if (std::sscanf(values_.at(key).c_str(), "%lf,%lf,%lf", &otherwise[0], &otherwise[1], &otherwise[2]) !=
        3) {
      throw tessera::Error(key, "found \"" + values_.at(key) + "\", expected x,y,z");
    }
    return otherwise;
  }
  void Size(int* width, int* height) const {
    if (!Given("size")) return;
    if (std::sscanf(values_.at("size").c_str(), "%dx%d", width, height) != 2 || *width < 1 || *height < 1) {
      throw tessera::Error("size", "found \"" + values_.at("size") + "\", expected WIDTHxHEIGHT");
    }
  }

 private:
  std::map<std::string, std::string> values_;
};

tessera::Image NewImage(int width, int height, std::vector<std::string> channels, const Camera& camera) {
  tessera::ImageSpec spec(width, height, static_cast<int>(channels.size()));
  spec.channels = std::move(channels);
  spec.alpha = spec.ChannelIndex("A");
  camera.ToMetadata(spec);
  return tessera::Image(spec);
}

// pixel(x, y) for every pixel, rows shared among the processor's threads.
template <class F>
void EachPixel(const tessera::Image& image, const F& pixel) {
  const int width = image.spec().width(), height = image.spec().height();
  const int count = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<std::thread> threads;
  for (int k = 0; k < count; ++k) {
    threads.emplace_back([&, k] {
      for (int y = k; y < height; y += count) {
        for (int x = 0; x < width; ++x) pixel(x, y);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

Vector3 Sky(const Vector3& direction, const Vector3& sun) {
  const Vector3 d = tessera::Normalized(direction);
  const double up = std::clamp(d[1], 0.0, 1.0), glow = std::pow(std::max(tessera::Dot(d, sun), 0.0), 24.0);
  const double fade = std::pow(1 - up, 3);
  return {0.17 + 0.40 * fade + 0.35 * glow, 0.33 + 0.30 * fade + 0.28 * glow,
          0.62 + 0.14 * fade + 0.12 * glow};
}

tessera::Image View(const Scene& scene, const Settings& settings) {
  int width = 1280, height = 720;
  settings.Size(&width, &height);
  const Camera camera =
      Camera::Perspective(settings.Vector("eye", {0.5, 2.6, 11}), settings.Vector("target", {0, 1.4, -2}),
                          {0, 1, 0}, settings.Number("fov", 42), double(width) / height, 0.1, kSkyRadius);
  const Vector3 sun = tessera::Normalized(settings.Vector("sun", {0.62, 0.55, 0.42}));
  const tessera::Image image =
      NewImage(width, height,
               {"R", "G", "B", "A", "direct.R", "direct.G", "direct.B", "ambient.R", "ambient.G", "ambient.B",
                "P.X", "P.Y", "P.Z", "N.X", "N.Y", "N.Z", "Z", "id"},
               camera);
  const tessera::Roi window = image.spec().data_window;
  EachPixel(image, [&](int x, int y) {
    const Camera::Ray ray = camera.PixelRay(window, x, y);
    const double length = std::sqrt(tessera::Dot(ray.direction, ray.direction));
    const Hit hit = scene.Cast(ray.origin, ray.direction, 0.01, kSkyRadius);
    const double depth = hit.id == 0 ? kSkyRadius / length : hit.t;
    const Vector3 p = Plus(ray.origin, ray.direction, depth);
    Vector3 direct = {0, 0, 0}, ambient = Sky(ray.direction, sun);
    if (hit.id != 0) {
      const double cosine = std::max(tessera::Dot(hit.normal, sun), 0.0), up = 0.6 + 0.4 * hit.normal[1];
      const double light[] = {2.3, 2.05, 1.7}, sky[] = {0.22, 0.29, 0.40};
      for (size_t k = 0; k < 3; ++k) {
        direct[k] = hit.albedo[k] * light[k] * cosine, ambient[k] = hit.albedo[k] * sky[k] * up;
      }
    }
    const double values[] = {direct[0] + ambient[0],
                             direct[1] + ambient[1],
                             direct[2] + ambient[2],
                             1,
                             direct[0],
                             direct[1],
                             direct[2],
                             ambient[0],
                             ambient[1],
                             ambient[2],
                             p[0],
                             p[1],
                             p[2],
                             hit.normal[0],
                             hit.normal[1],
                             hit.normal[2],
                             depth,
                             double(hit.id)};
    for (int c = 0; c < image.spec().channel_count(); ++c)
      image.at<float>(x, y, c) = static_cast<float>(values[c]);
  });
  return image;
}

tessera::Image Light(const Scene& scene, const Settings& settings) {
  int width = 1024, height = 1024;
  settings.Size(&width, &height);
  const Vector3 eye = settings.Vector("eye", {24.8, 22, 16.8}), target = settings.Vector("target", {0, 0, 0});
  const double near = settings.Number("near", 1), far = settings.Number("far", 80),
               aspect = double(width) / height;
  const Camera light =
      settings.Given("fov")
          ? Camera::Perspective(eye, target, {0, 1, 0}, settings.Number("fov", 40), aspect, near, far)
          : Camera::Parallel(eye, target, {0, 1, 0}, settings.Number("height", 30), aspect, near, far);
  const tessera::Image image = NewImage(width, height, {"Z"}, light);
  const tessera::Roi window = image.spec().data_window;
  EachPixel(image, [&](int x, int y) {
    const Camera::Ray ray = light.PixelRay(window, x, y);
    const Hit hit = scene.Cast(ray.origin, ray.direction, near, far);
    float depth = 1;
    if (hit.id != 0) {
      const auto clip = tessera::Transform(light.world_to_clip(), Plus(ray.origin, ray.direction, hit.t));
      depth = static_cast<float>(0.5 * (clip[2] / clip[3] + 1));
    }
    image.at<float>(x, y) = depth;
  });
  return image;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || (std::strcmp(argv[1], "view") != 0 && std::strcmp(argv[1], "light") != 0)) {
    std::fprintf(stderr, "usage: scene view|light OUT.exr [key=value…]\n");
    return 2;
  }
  try {
    const Settings settings(argc - 3, argv + 3);
    const Scene scene = Scene::Default();
    const tessera::Image image =
        std::strcmp(argv[1], "view") == 0 ? View(scene, settings) : Light(scene, settings);
    tessera::Write(tessera::FromImage(image), argv[2]);
    std::printf("%s: %d x %d, %d channels\n", argv[2], image.spec().width(), image.spec().height(),
                image.spec().channel_count());
  } catch (const tessera::Error& error) {
    std::fprintf(stderr, "scene: %s\n", error.what());
    return 1;
  }
  return 0;
}
