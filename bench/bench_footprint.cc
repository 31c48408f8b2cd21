// Filters over what a pixel covers: cost beside the error against the mean of 64 x 64 linear look-ups in each
// pixel, on a floor towards the horizon (a picture at coordinates, a solid block) and on a mirroring ball;
// OpenImageIO's texture() and environment() with the same derivatives.
#include <Imath/ImathVec.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/texture.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "contest.h"
#include "tessera/error.h"
#include "tessera/ops/environment.h"
#include "tessera/ops/lookup.h"
#include "tessera/ops/shade.h"
#include "tessera/render.h"

namespace tessera::bench {
namespace {

constexpr int kFine = 64;     // places along a pixel's side
constexpr int kRowStep = 29;  // of the rows that are judged

// Against f(x, y) at places of the picture, from 0 to 1 across its width and as far down.
using Truth = std::function<double(double x, double y)>;
Errors Judge(const Truth& f, const Image& output) {
  Errors errors;
  double sum = 0;
  const int width = output.spec().width(), height = output.spec().height();
  for (int y = kRowStep / 2; y < height; y += kRowStep) {
    for (int x = 0; x < width; x += 7) {
      double want = 0;
      for (int k = 0; k < kFine * kFine; ++k)
        want += f((x + (k % kFine + 0.5) / kFine) / width, (y + (k / kFine + 0.5) / kFine) / width);
      if (std::isnan(want)) continue;  // beside what is shown
      const double error = std::fabs(output.at<float>(x, y, 0) - want / (kFine * kFine));
      errors.max = std::max(errors.max, error);
      sum += error * error, ++errors.values;
    }
  }
  errors.rms = std::sqrt(sum / static_cast<double>(errors.values));
  return errors;
}

// A floor turned by 30 degrees, its horizon a little above the picture, in blocks of its pattern.
void OnFloor(double x, double y, double* s, double* t) {
  const double across = 4 * (x - 0.5) / (y + 0.01), along = 4 * 0.55 / (y + 0.01);
  const double c = std::sqrt(0.75);
  *s = 0.3 * (c * across - 0.5 * along) + 0.53, *t = 0.3 * (0.5 * across + c * along) + 0.17;
}
double Checker(double s, double t) {
  const auto cell = [](double at) { return static_cast<int64_t>(std::floor(at * 16)); };
  return (cell(s) + cell(t)) % 2 == 0 ? 0.9 : 0.05;
}
// The pattern as a table of so many entries along a side shows it, between them linearly.
double CheckerTable(int size, double s, double t) {
  const double u = s * size - 0.5, v = t * size - 0.5, i = std::floor(u), j = std::floor(v);
  const auto entry = [&](double x, double y) { return Checker((x + 0.5) / size, (y + 0.5) / size); };
  const double upper = (i + 1 - u) * entry(i, j) + (u - i) * entry(i + 1, j),
               lower = (i + 1 - u) * entry(i, j + 1) + (u - i) * entry(i + 1, j + 1);
  return (j + 1 - v) * upper + (v - j) * lower;
}
Image FloorCoordinates(int width, int height, int channels, double third) {
  const Image image(ImageSpec(width, height, channels));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double at[3] = {0, 0, third};
      OnFloor((x + 0.5) / width, (y + 0.5) / width, &at[0], &at[1]);
      for (int c = 0; c < channels; ++c) image.at<float>(x, y, c) = static_cast<float>(at[c]);
    }
  }
  return image;
}

struct Way {
  const char* name;
  TableFilter filter;
  int anisotropy;
};
constexpr Way kWays[] = {
    {"nearest", TableFilter::kNearest, 1},         {"linear", TableFilter::kLinear, 1},
    {"mipmap", TableFilter::kMipmap, 1},           {"trilinear 1", TableFilter::kTrilinear, 1},
    {"trilinear 4", TableFilter::kTrilinear, 4},   {"trilinear 8", TableFilter::kTrilinear, 8},
    {"trilinear 16", TableFilter::kTrilinear, 16}, {"ewa 16", TableFilter::kEwa, 16}};
std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const Way& way : kWays) names.emplace_back(way.name);
  return names;
}

// A texture system of its own over a file made from an image.
struct Textures {
  std::shared_ptr<OIIO::TextureSystem> system;
  OIIO::ustring file;
  Textures(const Image& image, OIIO::ImageBufAlgo::MakeTextureMode mode, const char* name)
      : system(OIIO::TextureSystem::create(false),
               [](OIIO::TextureSystem* s) { OIIO::TextureSystem::destroy(s); }) {
    const auto path =
        std::filesystem::temp_directory_path() / (std::string("tessera_bench_") + name + ".exr");
    const int channels = image.spec().channel_count();
    OIIO::ImageBuf buffer(
        OIIO::ImageSpec(image.spec().width(), image.spec().height(), channels, OIIO::TypeFloat),
        image.view().data);
    if (!OIIO::ImageBufAlgo::make_texture(mode, buffer, path.string(), OIIO::ImageSpec()))
      throw Error("OpenImageIO", OIIO::geterror());
    system->attribute("max_memory_MB", 1000.0f);
    file = OIIO::ustring(path.string());
  }
};
OIIO::TextureOpt Anisotropic(int anisotropy) {
  OIIO::TextureOpt options;
  options.interpmode = OIIO::TextureOpt::InterpBilinear;
  options.mipmode = OIIO::TextureOpt::MipModeAniso;
  options.anisotropic = anisotropy;
  options.swrap = options.twrap = OIIO::TextureOpt::WrapPeriodic;
  return options;
}

// Derivatives as renderers give them, by the picture's own map.
std::function<void()> OiioFloor(const Image& pattern, const Image& out, int anisotropy) {
  return [textures = Textures(pattern, OIIO::ImageBufAlgo::MakeTxTexture, "floor"), out, anisotropy] {
    auto* const thread = textures.system->get_perthread_info();
    auto* const handle = textures.system->get_texture_handle(textures.file, thread);
    const int width = out.spec().width(), channels = out.spec().channel_count();
    for (int y = 0; y < out.spec().height(); ++y) {
      for (int x = 0; x < width; ++x) {
        const double u = (x + 0.5) / width, v = (y + 0.5) / width, h = 0.5 / width;
        double s[5], t[5];
        OnFloor(u, v, &s[0], &t[0]);
        OnFloor(u - h, v, &s[1], &t[1]), OnFloor(u + h, v, &s[2], &t[2]);
        OnFloor(u, v - h, &s[3], &t[3]), OnFloor(u, v + h, &s[4], &t[4]);
        OIIO::TextureOpt options = Anisotropic(anisotropy);
        textures.system->texture(handle, thread, options, static_cast<float>(s[0]), static_cast<float>(t[0]),
                                 static_cast<float>(s[2] - s[1]), static_cast<float>(t[2] - t[1]),
                                 static_cast<float>(s[4] - s[3]), static_cast<float>(t[4] - t[3]), channels,
                                 &out.at<float>(x, y));
      }
    }
  };
}

void RegisterFloors(const Options& options, int width, int height) {
  for (const int threads : options.threads) {
    std::vector<std::string> peers;
    if (threads == 1) peers = {"OpenImageIO texture 8", "OpenImageIO texture 16"};
    RegisterContest({"footprint", "floor", "float", width, height, threads, Names(), peers}, options, [=] {
      const Image pattern(ImageSpec(512, 512, 3));
      for (int i = 0; i < 512 * 512; ++i) {
        for (int c = 0; c < 3; ++c)
          pattern.at<float>(i % 512, i / 512, c) =
              static_cast<float>(Checker((i % 512 + 0.5) / 512, (i / 512 + 0.5) / 512));
      }
      Contest c;
      c.output = Image(ImageSpec(width, height, 3));
      c.judge = [output = c.output] {
        return Judge(
            [](double x, double y) {
              double s, t;
              OnFloor(x, y, &s, &t);
              return CheckerTable(512, s, t);
            },
            output);
      };
      const Node coords = FromImage(FloorCoordinates(width, height, 2, 0));
      const Table table = TableFromImage(pattern.view());
      for (const Way& way : kWays) {
        LookupParams p{.filter = way.filter, .wrap = {Wrap::kRepeat}};
        p.anisotropy = way.anisotropy;
        c.ways.push_back({way.name, Lookup(coords, table, p)});
      }
      for (const int n : {8, 16}) {
        if (threads == 1)
          c.peers.push_back({"OpenImageIO texture " + std::to_string(n), OiioFloor(pattern, c.output, n)});
      }
      return c;
    });
    RegisterContest({"footprint", "solid", "float", width, height, threads, Names(), {}}, options, [=] {
      // Cubes of 8 samples; the floor cuts them half way up.
      const Image block(ImageSpec(128, 128 * 128, 1));
      for (int i = 0; i < 128 * 128 * 128; ++i) {
        const int parity = (i % 128 / 8 + i / 128 % 128 / 8 + i / 16384 / 8) % 2;
        block.at<float>(i % 128, i / 128, 0) = parity == 0 ? 0.9f : 0.05f;
      }
      Contest c;
      c.output = Image(ImageSpec(width, height, 3));
      c.judge = [output = c.output] {
        return Judge(
            [](double x, double y) {
              double s, t;
              OnFloor(x, y, &s, &t);
              return CheckerTable(128, s, t);
            },
            output);
      };
      const Node positions = FromImage(FloorCoordinates(width, height, 3, 4.5 / 128));
      const Node color = FromImage(Image(ImageSpec(width, height, 3)));
      for (const Way& way : kWays) {
        SolidParams p;
        p.blend = SolidBlend::kReplace;
        p.level_of_detail = way.filter == TableFilter::kMipmap;
        p.lookup.filter = p.level_of_detail ? TableFilter::kLinear : way.filter;
        p.lookup.wrap = {Wrap::kRepeat}, p.lookup.anisotropy = way.anisotropy;
        const TableLayout layout{.dims = 3, .slices = {128}};
        c.ways.push_back({way.name, SolidTexture(color, positions, FromImage(block), layout, p)});
      }
      return c;
    });
  }
}

// A ball as high as the picture is wide, mirroring a checkered sky; what is seen at a place, or false.
bool Reflection(double x, double y, Vector3* normal, Vector3* direction) {
  const double u = (x - 0.5) / 0.55, v = (0.28 - y) / 0.55, q = u * u + v * v;
  if (q >= 0.998) return false;
  *normal = {u, v, std::sqrt(1 - q)};
  const double z = (*normal)[2];
  *direction = {2 * z * u, 2 * z * v, 2 * z * z - 1};
  return true;
}
double SkyChecker(const Vector3& d) {
  const double longitude = std::atan2(d[0], d[2]) / std::numbers::pi * 48,
               latitude = std::asin(std::clamp(d[1], -1.0, 1.0)) / std::numbers::pi * 48;
  return (static_cast<int>(std::floor(longitude)) + static_cast<int>(std::floor(latitude)) + 200) % 2 == 0
             ? 0.9
             : 0.05;
}
std::function<void()> OiioMirror(const Image& map, const Image& out, int anisotropy) {
  return [textures = Textures(map, OIIO::ImageBufAlgo::MakeTxEnvLatl, "mirror"), out, anisotropy] {
    auto* const thread = textures.system->get_perthread_info();
    auto* const handle = textures.system->get_texture_handle(textures.file, thread);
    const int width = out.spec().width();
    const auto turned = [](const Vector3& d) {
      return Imath::V3f(static_cast<float>(d[0]), static_cast<float>(d[1]), static_cast<float>(d[2]));
    };
    for (int y = 0; y < out.spec().height(); ++y) {
      for (int x = 0; x < width; ++x) {
        Vector3 n, d, e = {}, f = {};
        const double u = (x + 0.5) / width, v = (y + 0.5) / width;
        float* const to = &out.at<float>(x, y);
        if (!Reflection(u, v, &n, &d)) {
          std::fill_n(to, 4, 0.0f);
          continue;
        }
        if (!Reflection(u + 1.0 / width, v, &n, &e)) e = d;
        if (!Reflection(u, v + 1.0 / width, &n, &f)) f = d;
        OIIO::TextureOpt options = Anisotropic(anisotropy);
        const Imath::V3f at = turned(d);
        textures.system->environment(handle, thread, options, at, turned(e) - at, turned(f) - at, 4, to);
      }
    }
  };
}
void RegisterMirrors(const Options& options, int width, int height) {
  const std::vector<std::string> ways = {"bilinear",    "mip",          "trilinear 4",
                                         "trilinear 8", "trilinear 16", "ewa 16"};
  for (const int threads : options.threads) {
    std::vector<std::string> peers;
    if (threads == 1) peers = {"OpenImageIO environment 8", "OpenImageIO environment 16"};
    RegisterContest({"footprint", "mirror", "float", width, height, threads, ways, peers}, options, [=] {
      const Image map(ImageSpec(2048, 1024, 4)), normals(ImageSpec(width, height, 3));
      for (int i = 0; i < 2048 * 1024; ++i) {
        Vector3 d = {0, 0, 1};
        DirectionOf(EnvironmentMap::kLatLong, 2048, 1024, i % 2048 + 0.5, i / 2048 + 0.5, &d);
        for (int k = 0; k < 4; ++k) map.at<float>(i % 2048, i / 2048, k) = static_cast<float>(SkyChecker(d));
      }
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          Vector3 n = {}, d;
          if (!Reflection((x + 0.5) / width, (y + 0.5) / width, &n, &d)) n = {};
          for (int k = 0; k < 3; ++k)
            normals.at<float>(x, y, k) = static_cast<float>(n[static_cast<size_t>(k)]);
        }
      }
      Contest c;
      c.output = Image(ImageSpec(width, height, 4));
      c.judge = [output = c.output, map] {
        return Judge(
            [&map](double x, double y) {
              Vector3 n, d;
              if (!Reflection(x, y, &n, &d)) return std::nan("");
              double u = 0, v = 0;
              PlaceOf(EnvironmentMap::kLatLong, 2048, 1024, d, &u, &v);
              const double i = std::floor(u - 0.5), j = std::floor(v - 0.5), fx = u - 0.5 - i,
                           fy = v - 0.5 - j;
              const auto texel = [&](double a, double b) {
                const int row = std::clamp(static_cast<int>(b), 0, 1023);
                return double{map.at<float>((static_cast<int>(a) + 2048) % 2048, row, 0)};
              };
              return (1 - fy) * ((1 - fx) * texel(i, j) + fx * texel(i + 1, j)) +
                     fy * ((1 - fx) * texel(i, j + 1) + fx * texel(i + 1, j + 1));
            },
            output);
      };
      for (const std::string& way : ways) {
        const EnvironmentFilter filter = way == "bilinear" ? EnvironmentFilter::kBilinear
                                         : way == "mip"    ? EnvironmentFilter::kMip
                                         : way == "ewa 16" ? EnvironmentFilter::kEwa
                                                           : EnvironmentFilter::kTrilinear;
        EnvironmentParams p;
        if (filter == EnvironmentFilter::kTrilinear) p.anisotropy = std::stoi(way.substr(10));
        const EnvironmentTexture texture(map, EnvironmentMap::kLatLong, 0, 0, filter);
        c.ways.push_back({way, Environment(FromImage(normals), texture, p)});
      }
      for (const int n : {8, 16}) {
        if (threads == 1)
          c.peers.push_back({"OpenImageIO environment " + std::to_string(n), OiioMirror(map, c.output, n)});
      }
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
      const int width = size.width > 0 ? size.width : 1920, height = size.height > 0 ? size.height : 1080;
      RegisterFloors(options, width, height);
      RegisterMirrors(options, width, height);
    }
  });
}
