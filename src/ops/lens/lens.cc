// Distortion of lenses by Brown's polynomial and by the division, taken away and applied: coordinates that
// are made of other operations, read by st_warp.
#include <algorithm>
#include <cmath>

#include "base/number_text.h"
#include "ops/geometry/modifiers.h"
#include "ops/lens/lens_ops.h"
#include "ops/modifiers.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/ops/arithmetic.h"
#include "tessera/ops/channels.h"
#include "tessera/ops/generate.h"
#include "tessera/ops/geometry.h"
#include "tessera/ops/lookup.h"

namespace tessera {
namespace ops {
namespace {

constexpr int kEntries = 4097;
constexpr double kFarthest = 16;  // radii that are looked at

bool IsIdentity(const LensParams& p) {
  return p.k == std::array<double, 3>{} && p.p == std::array<double, 2>{};
}

// s / r of Brown's lens, and r / s of the division.
double Direct(const LensParams& p, double radius) {
  const double q = radius * radius;
  return p.model == LensModel::kDivision ? 1 / (1 + p.k[0] * q)
                                         : 1 + q * (p.k[0] + q * (p.k[1] + q * p.k[2]));
}
// d (radius Direct) / d radius.
double Slope(const LensParams& p, double radius) {
  const double q = radius * radius;
  if (p.model == LensModel::kDivision) {
    const double d = 1 + p.k[0] * q;
    return (1 - p.k[0] * q) / (d * d);
  }
  return 1 + q * (3 * p.k[0] + q * (5 * p.k[1] + q * 7 * p.k[2]));
}

// Whether the formula as it stands is the one that is asked for.
bool IsDirect(const LensParams& p) { return (p.model == LensModel::kBrown) != p.apply; }

[[noreturn]] void RefuseFold(double radius) {
  throw DataError("lens", "found a distortion that turns back at a radius of " + base::NumberText(radius) +
                              ", which the picture reaches, expected one that grows over the picture");
}

// The radius whose distorted one is `target`; the first from the centre. `from`: one that is known to lie
// below. 0 where there is none because the lens turns back at `farthest` or beyond.
double Inverse(const LensParams& p, double target, double from, double farthest) {
  constexpr double kStep = 1.0 / 64;
  double low = from, high = from;
  while (high * Direct(p, high) < target) {
    low = high, high += kStep;
    if (high <= kFarthest && Slope(p, high) > 0) continue;
    if (high < farthest) RefuseFold(high);
    return 0;
  }
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (middle * Direct(p, middle) < target ? low : high) = middle;
  }
  return (low + high) / 2;
}

// Factors over squares of radii up to `farthest`.
Table Factors(const LensParams& p, double farthest) {
  std::vector<float> samples = {1};
  double radius = 0;
  bool beyond = false;
  for (int i = 1; i < kEntries; ++i) {
    const double place = std::sqrt(static_cast<double>(i) / (kEntries - 1)) * farthest;
    if (IsDirect(p)) {
      if (!(Slope(p, place) > 0)) RefuseFold(place);
      samples.push_back(static_cast<float>(Direct(p, place)));
      continue;
    }
    const double found = beyond ? 0 : Inverse(p, place, radius, farthest);
    beyond = found == 0;
    // What no point of the picture comes to is read from well beyond it.
    samples.push_back(static_cast<float>((beyond ? 4 * farthest : found) / place));
    radius = found;
  }
  return Table({kEntries}, 1, samples, TableAlign::kEnds);
}

double FarthestOf(const Roi& window, const LensFrame& frame) {
  const double x = std::max(std::fabs(window.x0 - frame.x), std::fabs(window.x1 - frame.x)),
               y = std::max(std::fabs(window.y0 - frame.y), std::fabs(window.y1 - frame.y));
  return std::hypot(x, y) / frame.unit;
}

Node Scaled(const Node& places, const Table& factors, double farthest) {
  const Node at = MulConstant(SquaresOf(places), {1 / (farthest * farthest)});
  return Mul(places, ApplyTables1D(at, {.tables = {factors}}));
}

// What Brown's lens adds off centre: (2 p1 x y + p2 (q + 2 x^2), p1 (q + 2 y^2) + 2 p2 x y).
Node OffCentre(const Node& places, const std::array<double, 2>& p) {
  const Node x = SelectChannels(places, std::vector<ChannelChoice>{{0, 0, ""}, {0, 0, ""}}),
             y = SelectChannels(places, std::vector<ChannelChoice>{{1, 0, ""}, {1, 0, ""}});
  const Node squares = Mul(places, places);  // x^2, y^2
  const Node q = ChannelSum(squares);
  const Node mixed = MulConstant(Mul(x, y), {2 * p[0], 2 * p[1]});
  const Node own = MulConstant(Add(MulConstant(squares, {2, 2}), q), {p[1], p[0]});
  return Add(mixed, own);
}

void RequireFinite(const LensParams& p) {
  for (const double v : {p.k[0], p.k[1], p.k[2], p.p[0], p.p[1]}) {
    if (!(std::fabs(v) <= 100))
      throw Error("lens", "found " + base::NumberText(v) + ", expected coefficients from -100 to 100");
  }
  if (p.model == LensModel::kDivision && (p.k[1] != 0 || p.k[2] != 0 || p.p != std::array<double, 2>{}))
    throw Error("lens", "found several coefficients, expected one for model=division");
}

}  // namespace

LensFrame FrameOf(const ImageSpec& image, const std::array<double, 2>& centre) {
  LensFrame frame;
  frame.window = image.display_window.empty() ? image.data_window : image.display_window;
  frame.x = frame.window.x0 + centre[0] * frame.window.width();
  frame.y = frame.window.y0 + centre[1] * frame.window.height();
  frame.unit = std::max(std::hypot(frame.window.width(), frame.window.height()) / 2, 0.5);
  return frame;
}

Node PlacesOf(const ImageSpec& image, const LensFrame& frame) {
  ImageSpec spec = image;
  spec.channels = {"s", "t"};
  spec.alpha = -1;
  spec.type = PixelType::kFloat;
  const double w = frame.window.width(), h = frame.window.height();
  return AddConstant(MulConstant(Ramp(spec), {w / frame.unit, h / frame.unit}),
                     {(frame.window.x0 - frame.x) / frame.unit, (frame.window.y0 - frame.y) / frame.unit});
}

Node SquaresOf(const Node& places) { return ChannelSum(Mul(places, places)); }

ParamInfo CentreModifier() {
  return NumbersModifier("center", "0.5,0.5", 2, -10, 10,
                         "the centre, in widths and heights of the display window");
}
std::array<double, 2> CentreOf(const Arguments& arguments) {
  const std::vector<double>& v = arguments.Numbers("center");
  return {v[0], v[1]};
}

OpInfo LensInfo() {
  OpInfo info;
  info.name = "lens";
  info.family = "lens";
  info.summary = "Take a lens's distortion away, or apply it";
  info.help =
      "K is k1, k1,k2 or k1,k2,k3 of model=brown: a point at radius r without distortion lies at r (1 + k1 r^2 + k2 r^4 + "
      "k3 r^6) with it, and p=p1,p2 says what the lens adds off centre; or the one number of model=division, r = s / (1 + "
      "k1 s^2). A radius of 1 is half the display window's diagonal. Positive k1 is a pincushion, negative a barrel, in both. Distortion is taken away; apply=1 puts it on, and both after "
      "each other give the picture back, softened by two filters. Windows stay, what lies beyond the picture is black. Where the "
      "lens turns back within the picture it is refused. The image is held in memory whole. Sources: Brown 1966; "
      "Fitzgibbon 2001.";
  info.bound = "what the operations that it is made of make together";
  ParamInfo k = ListModifier("K", "", 3, -100, 100, "radial coefficients");
  info.arguments = {k};
  info.modifiers = {
      ChoiceModifier("model", {"brown", "division"}, "the lens's formula"),
      OnlyWith("model=brown", NumbersModifier("p", "0,0", 2, -100, 100, "p1,p2 of what lies off centre")),
      FlagModifier("apply", "1: distorts"), CentreModifier(), WarpFilterModifier("lanczos3")};
  info.make = [](std::span<const Node> in, const Arguments& a, const ImageSpec*) {
    LensParams params;
    params.model = a.Text("model") == "division" ? LensModel::kDivision : LensModel::kBrown;
    const std::vector<double>& k = a.Numbers("K");
    std::copy(k.begin(), k.end(), params.k.begin());
    params.p = {a.Numbers("p")[0], a.Numbers("p")[1]};
    params.apply = a.Flag("apply");
    params.centre = CentreOf(a);
    params.filter = a.Text("filter");
    return Lens(in[0], params);
  };
  info.examples = {"0.08,0.005",
                   "0.05 apply=1",
                   "-0.05 model=division",
                   "-0.05 model=division apply=1",
                   "0.05,0.01 p=0.01,-0.005 filter=triangle",
                   "0.05 p=0.01,-0.005 apply=1 center=0.45,0.55"};
  info.identity = "0";
  return info;
}

}  // namespace ops

double LensFactor(const LensParams& p, double radius) {
  if (radius == 0) return 1;
  return ops::IsDirect(p) ? ops::Direct(p, radius) : ops::Inverse(p, radius, 0, ops::kFarthest) / radius;
}

Node Lens(const Node& image, const LensParams& p) {
  ops::RequireFinite(p);
  if (ops::IsIdentity(p) || image.spec().data_window.empty()) return image;
  const ops::LensFrame frame = ops::FrameOf(image.spec(), p.centre);
  const double farthest = ops::FarthestOf(image.spec().data_window, frame);
  // What lies off centre moves a place beyond the picture's farthest a little.
  const double reach = farthest + 3 * (std::fabs(p.p[0]) + std::fabs(p.p[1])) * farthest * farthest;
  const Table factors = ops::Factors(p, reach);
  const Node places = ops::PlacesOf(image.spec(), frame);
  Node found = ops::Scaled(places, factors, reach);
  if (p.p != std::array<double, 2>{}) {
    if (!p.apply) {
      found = Add(found, ops::OffCentre(places, p.p));
    } else {
      constexpr int kSteps = 3;
      for (int i = 0; i < kSteps; ++i)
        found = ops::Scaled(Sub(places, ops::OffCentre(found, p.p)), factors, reach);
    }
  }
  const double w = frame.window.width(), h = frame.window.height();
  const Node coordinates = AddConstant(MulConstant(found, {frame.unit / w, frame.unit / h}),
                                       {(frame.x - frame.window.x0) / w, (frame.y - frame.window.y0) / h});
  StWarpParams warp;
  warp.filter = p.filter;
  return StWarp(image, coordinates, warp);
}

}  // namespace tessera
