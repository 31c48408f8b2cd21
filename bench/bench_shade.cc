// Fog, shadows and solid textures on AOVs of a cast scene: half floats in memory to half floats in memory, as
// direct kernels and as compositions of blocks; the papers' fog tables by form, size and depth against the
// exact form.

#include <cmath>
#include <functional>

#include "../samples/ray_caster.h"
#include "contest.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/color.h"
#include "tessera/ops/lookup.h"
#include "tessera/ops/shade.h"
#include "tessera/render.h"

namespace tessera::bench {
namespace {

// The scene of the samples: colour with alpha and positions of one type, and the sun's depths.
struct Scene {
  Image color, position, light_depth;
  Matrix4 light;
  Vector3 eye = {0.5, 2.6, 11};

  Scene(int width, int height, PixelType type) {
    // Cast at a quarter of the resolution and repeated: the values matter here, not the edges.
    const auto scene = ray_caster::Scene::Default();
    const int w = std::max(1, width / 4), h = std::max(1, height / 4);
    const Camera camera =
        Camera::Perspective(eye, {0, 1.4, -2}, {0, 1, 0}, 42, double(width) / height, 0.1, 400);
    const Image c(ImageSpec(width, height, 4)), p(ImageSpec(width, height, 3));
    std::vector<Vector3> places, colors;
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const Camera::Ray ray = camera.PixelRay({0, 0, w, h}, x, y);
        const ray_caster::Hit hit = scene.Cast(ray.origin, ray.direction, 0.01, 300);
        places.push_back(ray_caster::Plus(ray.origin, ray.direction, std::min(hit.t, 300.0)));
        colors.push_back(hit.id == 0 ? Vector3{0.3, 0.5, 0.8} : hit.albedo);
      }
    }
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto from = static_cast<size_t>(std::min(y / 4, h - 1) * w + std::min(x / 4, w - 1));
        for (int k = 0; k < 3; ++k) {
          c.at<float>(x, y, k) = static_cast<float>(colors[from][static_cast<size_t>(k)]);
          p.at<float>(x, y, k) = static_cast<float>(places[from][static_cast<size_t>(k)]);
        }
        c.at<float>(x, y, 3) = 1;
      }
    }
    color = Render(FromImage(c), type), position = Render(FromImage(p), type);
    constexpr int kMap = 1024;
    const Camera sun = Camera::Perspective({24.8, 22, 16.8}, {0, 0, 0}, {0, 1, 0}, 40, 1, 1, 80);
    light = sun.world_to_clip();
    light_depth = Image(ImageSpec(kMap, kMap, 1));
    for (int y = 0; y < kMap; ++y) {
      for (int x = 0; x < kMap; ++x) {
        const Camera::Ray ray = sun.PixelRay({0, 0, kMap, kMap}, x, y);
        const ray_caster::Hit hit = scene.Cast(ray.origin, ray.direction, 1, 80);
        double depth = 1;
        if (hit.id != 0) {
          const auto clip = Transform(light, ray_caster::Plus(ray.origin, ray.direction, hit.t));
          depth = 0.5 * (clip[2] / clip[3] + 1);
        }
        light_depth.at<float>(x, y) = static_cast<float>(depth);
      }
    }
  }
};

// The first of the nodes is the truth.
void Register(const std::string& task, int width, int height, const Options& options, PixelType type,
              const std::vector<std::string>& names,
              const std::function<std::vector<Contest::Way>(const Scene&)>& nodes) {
  for (const int threads : options.threads) {
    RegisterContest({"shade", task, PixelTypeName(type), width, height, threads, names, {}}, options, [=] {
      Contest c;
      c.ways = nodes(Scene(width, height, type));
      ImageSpec spec = c.ways[0].node.spec();
      spec.type = type;
      c.output = Image(spec);
      // Colour and position are read, a colour is written.
      c.bytes_moved = static_cast<double>(spec.data_window.pixels()) * static_cast<double>(PixelBytes(type)) *
                      (4 + 3 + 4);
      return c;
    });
  }
}

FogParams HazeOf(const Scene& s) {
  FogParams p;
  p.density = 0.03, p.color = {0.6, 0.68, 0.78}, p.eye = s.eye;
  return p;
}
LayerFogParams LayersOf(const Scene& s) {
  LayerFogParams p;
  p.layers = {{-4, 0.12}, {-0.5, 0.05}, {0.8, 0.02}, {2.2, 0.004}};
  p.color = {0.6, 0.68, 0.78}, p.eye = s.eye;
  return p;
}

// The colour times a visibility.
Node Lit(const Scene& s, const Node& visibility) {
  return Mul(FromImage(s.color),
             SelectChannels(visibility, {{0, 0, "R"}, {0, 0, "G"}, {0, 0, "B"}, {-1, 1, "A"}}));
}

// Euclidean fog by the blocks of the papers: differences, squares, a matrix row that sums them, a table of
// exp(-sigma sqrt), the blend.
Node FogByBlocks(const Scene& s) {
  const FogParams p = HazeOf(s);
  constexpr double kReach = 330;
  const Node away =
      MulConstant(SubConstant(FromImage(s.position), {s.eye[0], s.eye[1], s.eye[2]}), {1 / kReach});
  ColorMatrixParams sum;
  sum.values = {1, 1, 1, 1, 1, 1, 1, 1, 1};
  FunctionTableParams shape;
  shape.sizes = {1 << 16};
  shape.probes = 1;
  const Table table =
      TableFromFunction(
          [&](const double* c, double* r) { r[0] = std::exp(-p.density * kReach * std::sqrt(c[0])); }, shape)
          .table;
  FogParams mix = p;
  mix.mode = FogMode::kTransmittance;
  return Fog(FromImage(s.color), ApplyTables1D(ColorMatrix(Mul(away, away), sum), {{table, table, table}}),
             mix);
}

// A nearest shadow test by blocks: projection, look-up of the map, difference, a step.
Node ShadowByBlocks(const Scene& s, double bias) {
  TransformParams place{kIdentity4, true};
  for (size_t k = 0; k < 4; ++k) {
    place.matrix[k] = 0.5 * (s.light[k] + s.light[12 + k]);
    place.matrix[4 + k] = 0.5 * (s.light[12 + k] - s.light[4 + k]);
    place.matrix[8 + k] = 0.5 * (s.light[8 + k] + s.light[12 + k]);
    place.matrix[12 + k] = s.light[12 + k];
  }
  const Node str = TransformPoints(FromImage(s.position), place);
  TableLayout layout;
  layout.dims = 2;
  LookupParams nearest;
  nearest.filter = TableFilter::kNearest;
  nearest.wrap = {Wrap::kBlack};
  nearest.border = {1};
  const Node depth = Lookup(str, FromImage(s.light_depth), layout, nearest);
  const Node margin = Sub(AddConstant(depth, {bias}), MinConstant(SelectChannels(str, {{2, 0, "V"}}), {1}));
  const Node step = Clamp(AddConstant(MulConstant(margin, {0x1p100}), {1}), {.min = {0}, .max = {1}});
  return Lit(s, step);
}

SolidParams MarbleOf() {
  SolidParams p;
  p.low = {-330, -330, -330}, p.high = {330, 330, 330};  // the sky too, so that tables reach everywhere
  p.uniform = true;
  return p;
}

Node BlockOfMarble(int n) {
  // The procedure itself at the texels' centres, as a table.
  const Image p(ImageSpec(n, n * n, 3)), white(ImageSpec(n, n * n, 3));
  for (int y = 0; y < n * n; ++y) {
    for (int x = 0; x < n; ++x) {
      p.at<float>(x, y, 0) = (x + 0.5f) / n, p.at<float>(x, y, 1) = (y % n + 0.5f) / n,
                        p.at<float>(x, y, 2) = (y / n + 0.5f) / n;
      for (int c = 0; c < 3; ++c) white.at<float>(x, y, c) = 1;
    }
  }
  return FromImage(Render(SolidTexture(FromImage(white), FromImage(p), SolidParams{})));
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera;
  using namespace tessera::bench;
  using Nodes = std::vector<Contest::Way>;
  return RunSuite(argc, argv, [](Options options) {
    const PixelType half = PixelType::kHalf;
    for (const auto& size : options.sizes) {
      const int w = size.width > 0 ? size.width : 7680, h = size.height > 0 ? size.height : 4320;
      Register("fog", w, h, options, half, {"direct", "blocks"}, [](const Scene& s) {
        return Nodes{{"direct", Fog(FromImage(s.color), FromImage(s.position), HazeOf(s))},
                     {"blocks", FogByBlocks(s)}};
      });
      Register("layered fog 4", w, h, options, half, {"direct", "table 1-D 256"}, [](const Scene& s) {
        return Nodes{{"direct", LayerFog(FromImage(s.color), FromImage(s.position), LayersOf(s))},
                     {"table 1-D 256", LayerFogByTable(FromImage(s.color), FromImage(s.position), LayersOf(s),
                                                       {FogTable::kMeanOfHeight, 256, 330, -40, 130, 0})}};
      });
      Register("shadow 3x3", w, h, options, half, {"direct"}, [](const Scene& s) {
        ShadowParams p;
        p.light = s.light, p.size = 3;
        return Nodes{{"direct", Lit(s, Shadow(FromImage(s.position), FromImage(s.light_depth), p))}};
      });
      Register("shadow nearest", w, h, options, half, {"direct", "blocks"}, [](const Scene& s) {
        ShadowParams p;
        p.light = s.light, p.bias = 0.002;
        return Nodes{{"direct", Lit(s, Shadow(FromImage(s.position), FromImage(s.light_depth), p))},
                     {"blocks", ShadowByBlocks(s, 0.002)}};
      });
      Register("marble 4", w, h, options, half, {"procedure", "table 64^3", "table 128^3"},
               [](const Scene& s) {
                 const Node color = FromImage(s.color), position = FromImage(s.position);
                 Nodes nodes = {{"procedure", SolidTexture(color, position, MarbleOf())}};
                 for (const int n : {64, 128}) {
                   TableLayout layout;
                   layout.slices = {n};
                   nodes.push_back({"table " + std::to_string(n) + "^3",
                                    SolidTexture(color, position, BlockOfMarble(n), layout, MarbleOf())});
                 }
                 return nodes;
               });
    }
    // The paper's picture: 640 x 480, 15 frames/s for fog and 12 for layers on an Octane MXI.
    Register("fog", 640, 480, options, half, {"direct"}, [](const Scene& s) {
      return Nodes{{"direct", Fog(FromImage(s.color), FromImage(s.position), HazeOf(s))}};
    });
    Register("layered fog 4", 640, 480, options, half, {"direct"}, [](const Scene& s) {
      return Nodes{{"direct", LayerFog(FromImage(s.color), FromImage(s.position), LayersOf(s))}};
    });
    // Tables by form, size and bits, in float so that their own error shows.
    struct Form {
      const char* name;
      FogTable form;
      int size, bits;
    };
    const std::vector<Form> forms = {{"1-D 64", FogTable::kMeanOfHeight, 64, 0},
                                     {"1-D 256", FogTable::kMeanOfHeight, 256, 0},
                                     {"1-D 1024", FogTable::kMeanOfHeight, 1024, 0},
                                     {"2-D 64", FogTable::kDistanceHeight, 64, 0},
                                     {"2-D 256", FogTable::kDistanceHeight, 256, 0},
                                     {"2-D 1024", FogTable::kDistanceHeight, 1024, 0},
                                     {"3-D 32", FogTable::kDistanceHeightHeight, 32, 0},
                                     {"3-D 64", FogTable::kDistanceHeightHeight, 64, 0},
                                     {"3-D 128", FogTable::kDistanceHeightHeight, 128, 0},
                                     {"2-D 256, 8 bits", FogTable::kDistanceHeight, 256, 8},
                                     {"2-D 256, 12 bits", FogTable::kDistanceHeight, 256, 12},
                                     {"2-D 256, 16 bits", FogTable::kDistanceHeight, 256, 16}};
    std::vector<std::string> names = {"exact"};
    for (const Form& f : forms) names.push_back(f.name);
    Register("fog tables", 1920, 1080, options, PixelType::kFloat, names, [forms](const Scene& s) {
      const Node color = FromImage(s.color), position = FromImage(s.position);
      Nodes nodes = {{"exact", LayerFog(color, position, LayersOf(s))}};
      for (const Form& f : forms) {
        nodes.push_back(
            {f.name, LayerFogByTable(color, position, LayersOf(s), {f.form, f.size, 330, -40, 130, f.bits})});
      }
      return nodes;
    });
  });
}
