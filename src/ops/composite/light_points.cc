// Small lights: discs and Gaussians whose size and opacity follow their distance.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/number_lines.h"
#include "base/number_text.h"
#include "ops/composite/composite_ops.h"
#include "ops/composite/paint_rows.h"
#include "ops/generate/generators.h"
#include "ops/modifiers.h"
#include "ops/shade/shade_ops.h"
#include "tessera/error_kind.h"
#include "tessera/ops/outline.h"

namespace tessera {
namespace ops {
namespace {

constexpr char kName[] = "lightpoints";
constexpr double kFar = 1e9, kLargest = 1e4;
constexpr size_t kNumbers = 7, kMostLights = 100000;

// The integral of sqrt(r^2 - x^2) from 0 to x, |x| <= r.
double UnderArc(double x, double r) {
  return 0.5 *
         (x * std::sqrt(std::max(r * r - x * x, 0.0)) + r * r * std::asin(std::clamp(x / r, -1.0, 1.0)));
}

// The area of the disc of radius r about 0 that lies between x0 and x1 and above y, for y >= 0: where the arc
// is above y.
double Above(double x0, double x1, double y, double r) {
  if (y >= r) return 0;
  const double half = std::sqrt(r * r - y * y);
  x0 = std::max(x0, -half), x1 = std::min(x1, half);
  return x1 > x0 ? UnderArc(x1, r) - UnderArc(x0, r) - y * (x1 - x0) : 0;
}
// Of that disc in a rectangle.
double DiscInBox(double x0, double x1, double y0, double y1, double r) {
  if (y1 <= 0) return DiscInBox(x0, x1, -y1, -y0, r);
  if (y0 >= 0) return Above(x0, x1, y0, r) - Above(x0, x1, y1, r);
  return DiscInBox(x0, x1, 0, y1, r) + DiscInBox(x0, x1, 0, -y0, r);
}

// How much of pixels is covered.
class Coverage {
 public:
  Coverage(const ShownLight& light, LightShape shape)
      : light_(light), gaussian_(shape == LightShape::kGaussian) {
    radius_ = 0.5 * light.size;
    // A Gaussian has a disc's area.
    deviation_ = light.size / std::sqrt(8.0);
    reach_ = gaussian_ ? 5 * deviation_ : radius_;
  }
  double reach() const { return reach_; }
  // Of the pixel whose middle is (dx, dy) from the light's.
  double At(double dx, double dy) const {
    if (!gaussian_) return DiscInBox(dx - 0.5, dx + 0.5, dy - 0.5, dy + 0.5, radius_);
    return Along(dx) * Along(dy);
  }

 private:
  // The integral of exp(-x^2 / 2 s^2) over a pixel.
  double Along(double d) const {
    const double scale = 1 / (deviation_ * std::numbers::sqrt2);
    const double a = std::fabs(d) - 0.5, b = std::fabs(d) + 0.5;
    // Far out both are nearly 1: what is left beyond each has their digits.
    const double share =
        a > 0 ? std::erfc(a * scale) - std::erfc(b * scale) : std::erf(b * scale) - std::erf(a * scale);
    return deviation_ * std::sqrt(std::numbers::pi / 2) * share;
  }

  ShownLight light_;
  bool gaussian_;
  double radius_ = 0, deviation_ = 0, reach_ = 0;
};

void Require(const std::string& what, double v, double low, double high) {
  if (v >= low && v <= high) return;
  throw Error(kName, "found " + what + " " + base::NumberText(v) + ", expected " + base::NumberText(low) +
                         " to " + base::NumberText(high));
}

std::vector<LightSource> Lights(const std::vector<double>& n, const std::string& from) {
  if (n.empty() || n.size() % kNumbers != 0 || n.size() / kNumbers > kMostLights) {
    throw Error(kName, "found " + std::to_string(n.size()) + " numbers in " + from +
                           ", expected 7 for each of at most 100000 points: x,y,z,r,g,b,size");
  }
  std::vector<LightSource> lights;
  for (size_t i = 0; i < n.size(); i += kNumbers)
    lights.push_back({{n[i], n[i + 1], n[i + 2]}, {n[i + 3], n[i + 4], n[i + 5]}, n[i + 6]});
  return lights;
}

// The lights of a file, a line for each.
std::vector<LightSource> LightsOf(const std::string& file) {
  std::vector<double> numbers;
  base::ReadNumberLines(
      file, "lines of x y z r g b size", {"x y z r g b size", kNumbers, kNumbers},
      [&](std::span<const double> line, int) { numbers.insert(numbers.end(), line.begin(), line.end()); });
  return Lights(numbers, file);
}

}  // namespace

OpInfo LightPointsInfo() {
  OpInfo info = GeneratorRow(kName, "Small lights whose size and opacity follow their distance");
  info.family = "composite";
  info.help =
      "Premultiplied R,G,B,A: one light for every seven numbers x,y,z,r,g,b,size of points=, or every line of "
      "file= (parted by blanks or commas; # begins a remark): x, y in pixels and z the distance, or with camera= "
      "a point of the world, of which what lies behind the camera is left out. A light is seen size sqrt(a) "
      "pixels wide, a = 1 / (k0 + k1 z + k2 z^2) by attenuation=k0,k1,k2, at most 10000; where that is below "
      "fade= it stays as wide and its opacity falls as the area would, so that its light stays a times what it "
      "was. shape=disc is antialiased by exact areas within pixels; gaussian is a soft one of the same area, "
      "exact means over pixels: neither flickers as it moves. blend=over paints near ones over far ones, add "
      "sums colours. Lay it --over a picture, or --add its colours. Source: McReynolds et al. 1997, 11.6; "
      "OpenGL 2.1 2006, 3.3.";
  info.bound = "4 u of the sum of the colours' magnitudes, at least 4 u";
  info.bound_u = 4;
  ParamInfo camera = CameraModifier("camera", "world to clip, or world to camera and to clip");
  info.modifiers = {OnlyWith("!file", ListModifier("points", "8,8,1,1,1,1,8", 65536, -kFar, kFar,
                                                   "x,y,z,r,g,b,size of each")),
                    TextModifier("file", "a file of them, a line for each"),
                    ListModifier("attenuation", "1,0,0", 3, 0, 1e9, "k0,k1,k2"),
                    NumberModifier("fade", "1", 1e-3, kLargest, "smallest size, pixels; smaller ones fade"),
                    ChoiceModifier("shape", {"disc", "gaussian"}, "what a light looks like"),
                    ChoiceModifier("blend", {"over", "add"}, "of lights with each other"),
                    camera};
  info.make = [](std::span<const Node>, const Arguments& a, const ImageSpec* output) {
    LightPointsParams p;
    p.lights = a.Given("file") ? LightsOf(a.Text("file")) : Lights(a.Numbers("points"), "points=");
    const std::vector<double>& k = a.Numbers("attenuation");
    for (size_t i = 0; i < 3; ++i) p.attenuation[i] = i < k.size() ? k[i] : 0;
    p.fade = a.Number("fade");
    p.shape = a.Text("shape") == "disc" ? LightShape::kDisc : LightShape::kGaussian;
    p.adds = a.Text("blend") == "add";
    if (a.Given("camera")) p.camera = Camera::FromNumbers(a.Numbers("camera"), kName);
    return LightPoints(*output, p);
  };
  info.examples = {"points=20,12,2,1,0.8,0.4,9,30.3,18.6,5,0.2,0.5,1,6 attenuation=0.5,0.2,0.01",
                   "points=20,12,2,1,0.8,0.4,9,22.3,14.6,5,0.2,0.5,1,6 shape=gaussian blend=add",
                   "points=0.1,0.2,-1,1,1,0.4,6,-0.5,0.25,0.5,0.2,0.5,1,3 fade=2 "
                   "camera=1.5,0,0,0,0,2,0.25,0,0,0,-1,-2,0,0,-1,4"};
  return info;
}

}  // namespace ops

std::vector<ShownLight> ShownLights(const ImageSpec& output, const LightPointsParams& p) {
  const std::array<double, 3>& k = p.attenuation;
  for (const double v : k) ops::Require("attenuation", v, 0, ops::kFar);
  if (!(k[0] + k[1] + k[2] > 0))
    throw Error(ops::kName, "found attenuation 0,0,0, expected a number above 0");
  ops::Require("fade", p.fade, 1e-3, ops::kLargest);
  const Roi& window = output.display_window.empty() ? output.data_window : output.display_window;
  std::vector<ShownLight> shown;
  for (const LightSource& light : p.lights) {
    for (const double v : light.place) ops::Require("a coordinate", v, -ops::kFar, ops::kFar);
    for (const double v : light.color) ops::Require("a colour", v, -ops::kFar, ops::kFar);
    ops::Require("size", light.size, 0, ops::kLargest);
    ShownLight s;
    s.color = light.color;
    s.x = light.place[0], s.y = light.place[1], s.distance = light.place[2];
    if (p.camera) {
      const auto clip = Transform(p.camera->world_to_clip(), light.place);
      if (!(clip[3] > 0)) continue;
      s.x = window.x0 + 0.5 * window.width() * (clip[0] / clip[3] + 1);
      s.y = window.y0 + 0.5 * window.height() * (1 - clip[1] / clip[3]);
      s.distance = p.camera->Distance(light.place);
    }
    if (!(s.distance >= 0)) continue;
    const LightPoint seen = AttenuatedLight(light.size, s.distance, k[0], k[1], k[2], p.fade);
    s.size = std::min(seen.size, ops::kLargest), s.alpha = seen.alpha;
    if (s.alpha > 0 && std::fabs(s.x) < 2 * ops::kFar && std::fabs(s.y) < 2 * ops::kFar) shown.push_back(s);
  }
  std::ranges::stable_sort(shown,
                           [](const ShownLight& a, const ShownLight& b) { return a.distance > b.distance; });
  return shown;
}

Node LightPoints(const ImageSpec& output, const LightPointsParams& p) {
  struct Drawn {
    ShownLight light;
    ops::Coverage coverage;
  };
  std::vector<Drawn> drawn;
  for (const ShownLight& s : ShownLights(output, p)) drawn.push_back({s, ops::Coverage(s, p.shape)});
  const auto paint = [drawn, adds = p.adds](int y, int x0, int x1, double* row) {
    for (const auto& [light, coverage] : drawn) {
      const double dy = y + 0.5 - light.y, reach = coverage.reach() + 0.5;
      if (std::fabs(dy) >= reach) continue;
      const double low = std::clamp(std::floor(light.x - reach), double(x0), double(x1)),
                   high = std::clamp(std::ceil(light.x + reach), low, double(x1));
      for (int x = static_cast<int>(low); x < static_cast<int>(high); ++x) {
        const double dx = x + 0.5 - light.x;
        if (std::fabs(dx) >= reach) continue;
        const double alpha = light.alpha * coverage.At(dx, dy);
        double* const to = row + 4 * static_cast<size_t>(x - x0);
        const double kept = adds ? 1 : 1 - alpha;
        for (size_t c = 0; c < 3; ++c) to[c] = alpha * light.color[c] + kept * to[c];
        to[3] += alpha * (1 - to[3]);
      }
    }
  };
  LightPointsParams known = p;
  return graph::MakeNode(
      std::make_shared<const ops::PaintOp>(ops::kName, std::pair(ShownLights(output, p), std::move(known)),
                                           ops::SpecWith(output, {"R", "G", "B", "A"}), paint),
      {});
}

}  // namespace tessera
