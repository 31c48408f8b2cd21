// Environment lookups and relief: frames per second of a 4K frame, composed blocks against direct kernels,
// tables against the exact form, OpenCV's remap with maps computed beforehand and OpenImageIO's
// environment().
#include <Imath/ImathVec.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/texture.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <random>

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
#include <opencv2/imgproc.hpp>
#endif

#include "contest.h"
#include "tessera/error.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/bump.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/environment.h"
#include "tessera/ops/lookup.h"
#include "tessera/render.h"

namespace tessera::bench {
namespace {

// The first way is the truth.
void Register(const std::string& task, PixelType type, const Options& options, int threads, int width,
              int height, const std::vector<std::string>& ways, const std::vector<std::string>& peers,
              std::function<Contest()> make) {
  RegisterContest({"environment", task, PixelTypeName(type), width, height, threads, ways, peers}, options,
                  std::move(make));
}

// Unit normals of spheres on a wavy floor, facing the viewer.
Image Normals(int width, int height, PixelType type) {
  const Image image(ImageSpec(width, height, 3));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = std::fmod(x / 540.0, 1) * 2 - 1, v = 1 - std::fmod(y / 540.0, 1) * 2,
                   square = u * u + v * v;
      Vector3 n = {0.1 * std::sin(x * 0.05), 0.1 * std::cos(y * 0.04), 1};
      if (square < 0.9) n = {u, v, std::sqrt(1 - square)};
      n = Normalized(n);
      for (int c = 0; c < 3; ++c) image.at<float>(x, y, c) = static_cast<float>(n[static_cast<size_t>(c)]);
    }
  }
  return type == PixelType::kFloat ? image : Render(FromImage(image), type);
}
// A sky with a sun over a chequered floor, and grain.
Image Sky(EnvironmentMap map, int width, int height, PixelType type) {
  const Image image(ImageSpec(width, height, 4));
  std::mt19937 random(4);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Vector3 d = {0, 0, -1};
      DirectionOf(map, width, height, x + 0.5, y + 0.5, &d);
      const double grain = static_cast<double>(random() >> 8) * 0x1p-28;
      const double sun = 50 * std::pow(std::max(0.0, Dot(d, Normalized({1, 1, 1}))), 300);
      const bool dark =
          (static_cast<int>(std::floor(2 * d[0] / (d[1] - 1e-3)) + std::floor(2 * d[2] / (d[1] - 1e-3))) &
           1) != 0;
      for (int c = 0; c < 3; ++c) {
        const double sky = 0.3 + 0.2 * c + 0.4 * d[1] + sun, floor = dark ? 0.1 : 0.6;
        image.at<float>(x, y, c) = static_cast<float>((d[1] > 0 ? sky : floor) + grain);
      }
      image.at<float>(x, y, 3) = 1;
    }
  }
  return type == PixelType::kFloat ? image : Render(FromImage(image), type);
}

EnvironmentParams With(EnvironmentMap map) {
  EnvironmentParams p;
  p.map = map;
  return p;
}

#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
// The places computed beforehand, as its users do: what is timed is the gathering alone.
std::function<void()> OpenCvRemap(const Image& normals, const Image& map, const Image& out, int threads) {
  const auto wrap = [](const Image& image) {
    return cv::Mat(image.spec().height(), image.spec().width(),
                   CV_MAKETYPE(CV_32F, image.spec().channel_count()), image.view().data);
  };
  cv::Mat places(out.spec().height(), out.spec().width(), CV_32FC2);
  for (int y = 0; y < places.rows; ++y) {
    for (int x = 0; x < places.cols; ++x) {
      const Vector3 n = {normals.at<float>(x, y, 0), normals.at<float>(x, y, 1), normals.at<float>(x, y, 2)};
      double u = 0, v = 0;
      PlaceOf(EnvironmentMap::kLatLong, map.spec().width(), map.spec().height(),
              {2 * n[2] * n[0], 2 * n[2] * n[1], 2 * n[2] * n[2] - Dot(n, n)}, &u, &v);
      places.at<cv::Vec2f>(y, x) = {static_cast<float>(u - 0.5), static_cast<float>(v - 0.5)};
    }
  }
  return [=, from = wrap(map), to = wrap(out), map = map, out = out]() mutable {
    cv::setNumThreads(threads);
    cv::remap(from, to, places, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  };
}
#endif

// A texture system's lookups, pixel by pixel, in the directions of reflection; without derivatives, so at
// level 0.
std::function<void()> OiioEnvironment(const Image& normals, const Image& map, const Image& out) {
  const auto file = std::filesystem::temp_directory_path() / "tessera_bench_environment.exr";
  OIIO::ImageBuf buffer(OIIO::ImageSpec(map.spec().width(), map.spec().height(), 4, OIIO::TypeFloat),
                        map.view().data);
  OIIO::ImageSpec config;
  if (!OIIO::ImageBufAlgo::make_texture(OIIO::ImageBufAlgo::MakeTxEnvLatl, buffer, file.string(), config)) {
    throw Error("OpenImageIO", OIIO::geterror());
  }
  const std::shared_ptr<OIIO::TextureSystem> system(
      OIIO::TextureSystem::create(false), [](OIIO::TextureSystem* s) { OIIO::TextureSystem::destroy(s); });
  system->attribute("max_memory_MB", 1000.0f);
  return [=, name = OIIO::ustring(file.string())] {
    OIIO::TextureSystem::Perthread* const thread = system->get_perthread_info();
    OIIO::TextureSystem::TextureHandle* const handle = system->get_texture_handle(name, thread);
    const Imath::V3f zero(0, 0, 0);
    for (int y = 0; y < out.spec().height(); ++y) {
      for (int x = 0; x < out.spec().width(); ++x) {
        const float* const n = &normals.at<float>(x, y);
        const Imath::V3f r(2 * n[2] * n[0], 2 * n[2] * n[1], n[2] * n[2] - n[0] * n[0] - n[1] * n[1]);
        OIIO::TextureOpt options;
        options.interpmode = OIIO::TextureOpt::InterpBilinear;
        options.mipmode = OIIO::TextureOpt::MipModeNoMIP;
        system->environment(handle, thread, options, r, zero, zero, 4, &out.at<float>(x, y));
      }
    }
  };
}

void RegisterMirrors(const Options& options, int width, int height) {
  struct Kind {
    const char* name;
    EnvironmentMap map;
    int width, height;
  };
  for (const Kind& k : {Kind{"mirror latlong 2048x1024", EnvironmentMap::kLatLong, 2048, 1024},
                        Kind{"mirror sphere 1024", EnvironmentMap::kSphere, 1024, 1024},
                        Kind{"mirror dualparabolic 2048x1024", EnvironmentMap::kDualParabolic, 2048, 1024},
                        Kind{"mirror cube 512", EnvironmentMap::kCube, 3072, 512}}) {
    for (const PixelType type : options.types) {
      if (type == PixelType::kUint8 || type == PixelType::kUint16) continue;
      for (const int threads : options.threads) {
        const bool sphere = k.map == EnvironmentMap::kSphere,
                   peers = k.map == EnvironmentMap::kLatLong && type == PixelType::kFloat;
        std::vector<std::string> ways = {"", "8 bits", "12 bits", "filtered"}, others;
        if (sphere) ways.push_back("composed");
        if (peers) others.push_back("OpenCV remap");
        if (peers && threads == 1) others.push_back("OpenImageIO environment");
        Register(k.name, type, options, threads, width, height, ways, others, [=] {
          Contest c;
          c.output = Image(ImageSpec(width, height, 4, type));
          const Image normals = Normals(width, height, type), map = Sky(k.map, k.width, k.height, type);
          const EnvironmentTexture texture(map, k.map);
          for (const int bits : {0, 8, 12}) {
            EnvironmentParams p = With(k.map);
            p.bits = bits;
            c.ways.push_back({bits == 0 ? "" : std::to_string(bits) + " bits",
                              Environment(FromImage(normals), texture, p)});
          }
          const EnvironmentTexture filtered(map, k.map, 0, 0, EnvironmentFilter::kMip);
          c.ways.push_back({"filtered", Environment(FromImage(normals), filtered)});
          if (sphere) {
            // Unit normals and an orthographic viewer: s = n_x/2 + 1/2, t = 1/2 - n_y/2 by existing blocks.
            const Node st =
                ColorMatrix(FromImage(normals), {.values = {0.5, 0, 0, 0, -0.5, 0, 0, 0, 1, 0.5, 0.5, 0}});
            c.ways.push_back({"composed", Lookup(st, FromImage(map), {.dims = 2})});
          }
#if defined(TESSERA_BENCH_OPENCV_IMGPROC)
          if (peers) c.peers.push_back({"OpenCV remap", OpenCvRemap(normals, map, c.output, threads)});
#endif
          if (peers && threads == 1)
            c.peers.push_back({"OpenImageIO environment", OiioEnvironment(normals, map, c.output)});
          return c;
        });
      }
    }
  }
}

// Speed against error of the tabulated forms, on smaller pictures.
void RegisterTables(const Options& options) {
  constexpr int kWidth = 480, kHeight = 270;
  Options best = options;
  best.targets.resize(1);
  for (const double exponent : {1.0, 10.0, 100.0}) {
    std::vector<std::string> ways = {"exact"};
    for (const int n : {8, 16, 32, 64, 128}) ways.push_back("table " + std::to_string(n));
    Register("gloss " + std::to_string(static_cast<int>(exponent)), PixelType::kFloat, best, 1, kWidth,
             kHeight, ways, {}, [=] {
               Contest c;
               c.output = Image(ImageSpec(kWidth, kHeight, 4));
               const Image normals = Normals(kWidth, kHeight, PixelType::kFloat);
               const Image map = Sky(EnvironmentMap::kLatLong, 128, 64, PixelType::kFloat);
               for (const std::string& way : ways) {
                 const int table = way == "exact" ? -1 : std::stoi(way.substr(6));
                 const EnvironmentTexture texture(map, EnvironmentMap::kLatLong, exponent, table);
                 c.ways.push_back({way, Environment(FromImage(normals), texture)});
               }
               return c;
             });
  }
  for (const double exponent : {10.0, 50.0, 200.0}) {
    std::vector<std::string> ways = {"formula"};
    for (const char* bits : {"", " 8 bits", " 12 bits"}) {
      for (const int n : {256, 1024, 4096}) ways.push_back("table " + std::to_string(n) + bits);
    }
    for (const int n : {64, 256, 1024}) ways.push_back("sphere map " + std::to_string(n));
    for (const int n : {32, 64, 128}) ways.push_back("3-D table " + std::to_string(n));
    Register("phong " + std::to_string(static_cast<int>(exponent)), PixelType::kFloat, best, 1, 1920, 1080,
             ways, {}, [=] {
               Contest c;
               c.output = Image(ImageSpec(1920, 1080, 3));
               const Image normals = Normals(1920, 1080, PixelType::kFloat);
               PhongParams p;
               p.light = {1, 1, 2}, p.exponent = exponent, p.diffuse = {0, 0, 0}, p.specular = {1, 1, 1};
               p.highlight = Highlight::kReflection;
               for (const std::string& way : ways) {
                 if (way.rfind("sphere", 0) == 0) {
                   const int n = std::stoi(way.substr(11));
                   const Image one = PhongMap(EnvironmentMap::kSphere, n, n, p.light, exponent);
                   Image three(ImageSpec(n, n, 3));
                   for (int64_t i = 0; i < int64_t{n} * n * 3; ++i) {
                     reinterpret_cast<float*>(three.view().data)[i] =
                         reinterpret_cast<const float*>(one.view().data)[i / 3];
                   }
                   c.ways.push_back({way, Environment(FromImage(normals),
                                                      EnvironmentTexture(three, EnvironmentMap::kSphere))});
                   continue;
                 }
                 if (way.rfind("3-D", 0) == 0) {
                   const FunctionTable table = PhongTable(std::stoi(way.substr(10)), p.light, exponent);
                   const Node vectors = TransformNormals(
                       FromImage(normals),
                       {.matrix = {}, .reflect = Vector3{0, 0, 1}, .normalize = false, .pack = true});
                   c.ways.push_back({way, SelectChannels(Lookup(vectors, table.table),
                                                         {{0, 0, "R"}, {0, 0, "G"}, {0, 0, "B"}})});
                   continue;
                 }
                 p.table = way == "formula" ? 0 : std::stoi(way.substr(6));
                 p.bits = way.find(" 8 bits") != std::string::npos    ? 8
                          : way.find(" 12 bits") != std::string::npos ? 12
                                                                      : 0;
                 c.ways.push_back({way, Phong(FromImage(normals), p)});
               }
               return c;
             });
  }
}

void RegisterRelief(const Options& options, int width, int height) {
  for (const int threads : options.threads) {
    const std::vector<std::string> ways = {"slopes",       "shift",         "forward",
                                           "shift 8 bits", "shift 12 bits", "normal map + light"};
    Register("bump", PixelType::kHalf, options, threads, width, height, ways, {}, [=] {
      Contest c;
      c.output = Image(ImageSpec(width, height, 1, PixelType::kHalf));
      const Image heights(ImageSpec(width, height, 1));
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          heights.at<float>(x, y) = static_cast<float>(0.5 + 0.25 * std::sin(x * 0.11) * std::sin(y * 0.07));
        }
      }
      const Node h = FromImage(Render(FromImage(heights), PixelType::kHalf));
      BumpParams p;
      p.scale = 10;
      c.ways.push_back({"slopes", Bump(h, p)});
      p.method = BumpMethod::kForward;
      const Node forward = Bump(h, p);
      p.method = BumpMethod::kShift;
      c.ways.push_back({"shift", Bump(h, p)});
      c.ways.push_back({"forward", forward});
      for (const int bits : {8, 12}) {
        p.bits = bits;
        c.ways.push_back({"shift " + std::to_string(bits) + " bits", Bump(h, p)});
      }
      // Composed: normals, then Phong's diffuse term; its red channel.
      PhongParams light;
      light.light = p.light;
      c.ways.push_back(
          {"normal map + light", SelectChannels(Phong(HeightToNormals(h, {.scale = 10}), light), "R")});
      return c;
    });
  }
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera::bench;
  return RunSuite(argc, argv, [](const Options& options) {
    for (const Options::Size& size : options.sizes) {
      const int width = size.width > 0 ? size.width : 3840, height = size.height > 0 ? size.height : 2160;
      RegisterMirrors(options, width, height);
      RegisterRelief(options, width, height);
    }
    RegisterTables(options);
  });
}
