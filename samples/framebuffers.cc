// The papers' procedures as they ran on framebuffers of 8 and 12 bits, beside floats: shadows from one RGBA
// picture subtracted from another, layered fog from 2-D and 3-D tables, and a mirror whose normals went
// through the framebuffer.
//   framebuffers [OUT.png]     prints how far each is from the exact form; fails when the float forms are not
//   near it.
// Columns of the picture (samples/pictures/framebuffers.jpg): 8 bits, 12 bits, float, exact. Its second row
// shows the errors of the 2-D table twenty times as large, about grey.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "ray_caster.h"
#include "tessera/ops/framebuffer.h"
#include "tessera/tessera.h"

namespace {

using tessera::Camera;
using tessera::Dot;
using tessera::Image;
using tessera::ImageSpec;
using tessera::Inverse;
using tessera::Matrix4;
using tessera::Node;
using tessera::Product;
using tessera::Vector3;

constexpr int kWidth = 320, kHeight = 200, kLightSize = 512;

// Window coordinates (x right, y down, depth; all 0 to 1) from clip coordinates.
constexpr Matrix4 kWindow = {0.5, 0, 0, 0.5, 0, -0.5, 0, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0, 1};

struct Seen {
  Image position = Image(ImageSpec(kWidth, kHeight, 3)), normal = Image(ImageSpec(kWidth, kHeight, 3));
  Image direct = Image(ImageSpec(kWidth, kHeight, 3)), ambient = Image(ImageSpec(kWidth, kHeight, 3));
  Image window = Image(ImageSpec(kWidth, kHeight, 4));        // (Xs, Ys, Zv, Zv)
  Image light = Image(ImageSpec(kLightSize, kLightSize, 4));  // (1, 1, 1, Zl)
  Image depth = Image(ImageSpec(kLightSize, kLightSize, 1));  // Zl
};

void Set(const Image& image, int x, int y, const Vector3& v) {
  for (int c = 0; c < 3; ++c) image.at<float>(x, y, c) = static_cast<float>(v[static_cast<size_t>(c)]);
}
double WindowDepth(const Camera& camera, const Vector3& p) {
  return tessera::Transform(Product(kWindow, camera.world_to_clip()), p)[2];
}

// What both cameras see. Without a division pixel textures could only serve parallel projections.
Seen Cast(const ray_caster::Scene& scene, const Camera& view, const Camera& light, double near, double far) {
  Seen s;
  const Vector3 sun = {-light.forward()[0], -light.forward()[1], -light.forward()[2]};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Camera::Ray ray = view.PixelRay(s.position.spec().data_window, x, y);
      const ray_caster::Hit hit = scene.Cast(ray.origin, ray.direction, near, far);
      const bool sky = hit.id == 0;
      const Vector3 p = ray_caster::Plus(ray.origin, ray.direction, sky ? far : hit.t);
      const double cosine = sky ? 0 : std::max(Dot(hit.normal, sun), 0.0);
      Set(s.position, x, y, p), Set(s.normal, x, y, hit.normal);
      Set(s.direct, x, y,
          {2.2 * cosine * hit.albedo[0], 2 * cosine * hit.albedo[1], 1.7 * cosine * hit.albedo[2]});
      Set(s.ambient, x, y,
          sky ? Vector3{0.45, 0.6, 0.8}
              : Vector3{0.3 * hit.albedo[0], 0.35 * hit.albedo[1], 0.45 * hit.albedo[2]});
      const double z = WindowDepth(view, p);
      Set(s.window, x, y, {(x + 0.5) / kWidth, (y + 0.5) / kHeight, z});
      s.window.at<float>(x, y, 3) = static_cast<float>(z);
    }
  }
  for (int y = 0; y < kLightSize; ++y) {
    for (int x = 0; x < kLightSize; ++x) {
      const Camera::Ray ray = light.PixelRay(s.depth.spec().data_window, x, y);
      const ray_caster::Hit hit = scene.Cast(ray.origin, ray.direction, near, far);
      const double z =
          hit.id == 0 ? 1 : WindowDepth(light, ray_caster::Plus(ray.origin, ray.direction, hit.t));
      Set(s.light, x, y, {1, 1, 1});
      s.depth.at<float>(x, y) = s.light.at<float>(x, y, 3) = static_cast<float>(z);
    }
  }
  return s;
}

// Written to a framebuffer and read again: limited to [0, 1], and rounded where it has bits.
Node Stored(const Node& node, int bits) {
  return bits == 0 ? Clamp(node, {.min = {0}, .max = {1}}) : Quantize(node, {.bits = bits});
}

// Section 4 of the pixel texture paper, step by step: white where the light reaches. `bias` is ours: the
// paper has none.
Image ShadowMask(const Seen& s, const Camera& view, const Camera& light, int bits, double bias) {
  const Matrix4 m =
      Product(Product(kWindow, light.world_to_clip()), Inverse(Product(kWindow, view.world_to_clip())));
  // The picture holds no 1 that could be multiplied by a translation: it goes into the bias after the matrix.
  const Node seen = ColorMatrix(
      Stored(FromImage(s.window), bits),
      {.values = {m[0], m[1], m[2],  0, m[4], m[5], m[6],         0,           m[8], m[9], m[10], 0,  //
                  m[8], m[9], m[10], 0, m[3], m[7], m[11] - bias, m[11] - bias},
       .transpose = true});
  // Looked up at (X', Y') and subtracted as a blend: (0, 0, 0, Z' - Zl), limited to 0 where the light's depth
  // is larger.
  const Node stored = Stored(seen, bits);
  const Node map = Lookup(stored, Stored(FromImage(s.light), bits), {.dims = 2},
                          {.filter = tessera::TableFilter::kNearest});
  const Node difference = Stored(Sub(stored, map), bits);
  tessera::Framebuffer framebuffer(s.window.spec().data_window);
  tessera::DrawState state;
  state.alpha_test = {tessera::Comparison::kEqual, 0};
  framebuffer.Draw({.color = AddConstant(difference, {1, 1, 1, 0})}, state);
  return Render(SelectChannels(FromImage(framebuffer.color()), "R"));
}

// Mean absolute difference of the first channels.
double Difference(const Image& a, const Image& b) {
  double sum = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) sum += std::fabs(a.at<float>(x, y) - b.at<float>(x, y));
  }
  return sum / (kWidth * kHeight);
}

void Paste(const Node& node, const Image& sheet, int column, int row) {
  const Image image = Render(node);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        const float v = std::max(image.at<float>(x, y, c), 0.0f);
        sheet.at<float>(column * (kWidth + 4) + x, row * (kHeight + 4) + y, c) =
            std::pow(1 - std::exp(-1.3f * v), 1 / 2.2f);
      }
    }
  }
}

Image Sky() {
  constexpr int kSkyWidth = 512, kSkyHeight = 256;
  const Image map(ImageSpec(kSkyWidth, kSkyHeight, 3));
  for (int y = 0; y < kSkyHeight; ++y) {
    for (int x = 0; x < kSkyWidth; ++x) {
      Vector3 d = {};
      DirectionOf(tessera::EnvironmentMap::kLatLong, kSkyWidth, kSkyHeight, x + 0.5, y + 0.5, &d);
      const bool line = std::fmod(std::fabs(d[1]) * 8, 1) < 0.12 || std::fmod(x, 32.0) < 3;
      const double sun = 6 * std::pow(std::max(0.0, Dot(d, tessera::Normalized({0.6, 0.7, 0.4}))), 200);
      Set(map, x, y,
          line ? Vector3{0.1, 0.1, 0.15}
               : Vector3{0.5 + 0.4 * d[0] + sun, 0.5 + 0.4 * d[1] + sun, 0.7 + sun});
    }
  }
  return map;
}
// A lens: its curvature is so weak that neighbouring normals differ by less than a code of 8 bits.
Image Lens() {
  const Image normals(ImageSpec(kWidth, kHeight, 3));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double u = 0.4 * (2 * x + 1 - kWidth) / kHeight, v = 0.4 * (kHeight - 2 * y - 1) / kHeight;
      Set(normals, x, y, tessera::Normalized({u, v, 1}));
    }
  }
  return normals;
}

int Run(const std::string& out) {
  constexpr double kNear = 5, kFar = 60;
  const double aspect = double{kWidth} / kHeight;
  const Camera view = Camera::Parallel({3, 14, 24}, {0, 0.6, -2}, {0, 1, 0}, 13, aspect, kNear, kFar);
  const Camera light = Camera::Parallel({24.8, 22, 16.8}, {0, 0, -1}, {0, 1, 0}, 26, 1, kNear, kFar);
  const Seen s = Cast(ray_caster::Scene::Default(), view, light, kNear, kFar);
  const Node direct = FromImage(s.direct), ambient = FromImage(s.ambient), position = FromImage(s.position);
  const Node lit = Add(direct, ambient);

  const Image sheet(ImageSpec(4 * (kWidth + 4) - 4, 4 * (kHeight + 4) - 4, 3));
  bool good = true;
  // `near`: how far the float form may be from the exact one.
  const auto row = [&](int index, const std::string& name, double near, const Image& exact,
                       const std::function<Image(int bits)>& coarse,
                       const std::function<Node(const Image&)>& shown) {
    double differences[3];
    for (int k = 0; k < 3; ++k) {
      const Image image = coarse(k == 0 ? 8 : k == 1 ? 12 : 0);
      differences[k] = Difference(image, exact);
      Paste(shown(image), sheet, k, index);
    }
    Paste(shown(exact), sheet, 3, index);
    std::printf("%-28s mean difference from the exact form: 8 bits %.4f, 12 bits %.4f, float %.5f\n",
                name.c_str(), differences[0], differences[1], differences[2]);
    good = good && differences[2] <= near;
  };
  const auto itself = [](const Image& image) { return FromImage(image); };
  // Errors twenty times as large, about grey; of the exact form nothing is off: it shows itself.
  const auto errors = [](const Image& exact) {
    return [&exact](const Image& image) {
      if (image.view().data == exact.view().data) return FromImage(image);
      return AddConstant(MulConstant(Sub(FromImage(image), FromImage(exact)), {20}), {0.5});
    };
  };

  const Image visible = Render(Shadow(position, FromImage(s.depth), {.light = light.world_to_clip()}));
  const auto shaded = [&](const Image& mask) { return Add(Mul(direct, FromImage(mask)), ambient); };
  // As printed: half of what is lit shades itself in floats; the steps of 8 bits hide it in larger blotches.
  // A bias, as large as the depths change within a texel on slopes, mends it.
  row(
      0, "shadow, RGBA as printed", 0.6, visible,
      [&](int bits) { return ShadowMask(s, view, light, bits, 0); }, shaded);
  const double mended = Difference(ShadowMask(s, view, light, 0, 0.015), visible);
  std::printf("%-28s mean difference from the exact form: float %.4f\n", "the same with a bias", mended);
  good = good && mended < 0.1;

  tessera::LayerFogParams fog;
  fog.layers = {{-4, 0.3}, {-0.5, 0.14}, {0.8, 0.05}, {2.2, 0.004}};
  fog.eye = {3, 14, 24};
  fog.color = {0.62, 0.7, 0.78};
  const Image fogged = Render(LayerFog(lit, position, fog));
  const auto by_table = [&](tessera::FogTable form, int size) {
    return [&, form, size](int bits) {
      return Render(
          LayerFogByTable(lit, position, fog,
                          {.form = form, .size = size, .distance = 64, .low = -4, .high = 15, .bits = bits}));
    };
  };
  row(1, "layered fog, 2-D table", 0.03, fogged, by_table(tessera::FogTable::kDistanceHeight, 256),
      errors(fogged));
  row(2, "layered fog, 3-D table", 0.06, fogged, by_table(tessera::FogTable::kDistanceHeightHeight, 64),
      itself);

  const tessera::EnvironmentTexture sky(Sky(), tessera::EnvironmentMap::kLatLong);
  const Node lens = FromImage(Lens());
  const auto mirror = [&](int bits) {
    tessera::EnvironmentParams p;
    p.bits = bits;
    return Render(Environment(lens, sky, p));
  };
  row(3, "mirror, normals in codes", 0, mirror(0), mirror, itself);

  Write(FromImage(sheet), out, {.type = tessera::PixelType::kUint8});
  return good ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Run(argc > 1 ? argv[1] : "framebuffers.png");
  } catch (const tessera::Error& error) {
    std::fprintf(stderr, "framebuffers: %s\n", error.what());
    return 1;
  }
}
