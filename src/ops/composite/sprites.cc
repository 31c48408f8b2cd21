// Masks of brush strokes, soft sprites, puffs of smoke.
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "base/number_text.h"
#include "ops/composite/composite_ops.h"
#include "ops/composite/paint_rows.h"
#include "ops/generate/generators.h"
#include "ops/modifiers.h"
#include "tessera/ops/outline.h"

namespace tessera {
namespace ops {
namespace {

// From 1 within the hard core to 0 at the radius; `squared` is the distance from the middle, squared.
double FallOff(double squared, double radius, double hardness) {
  if (squared >= radius * radius) return 0;
  const double distance = std::sqrt(squared) / radius;
  if (distance <= hardness) return 1;
  const double t = (distance - hardness) / (1 - hardness);
  return 1 - t * t * (3 - 2 * t);
}

// f(pixel from x0, fall-off) of the pixels of a row that a disc covers.
template <class F>
void ForDisc(double cx, double cy, double radius, double hardness, int y, int x0, int x1, const F& f) {
  const double dy = y + 0.5 - cy, half = radius * radius - dy * dy;
  if (!(half > 0)) return;
  const double reach = std::sqrt(half);
  const double low = std::clamp(cx - reach - 1, double(x0), double(x1)),
               high = std::clamp(cx + reach + 1, low, double(x1));
  for (int x = static_cast<int>(low); x < static_cast<int>(std::ceil(high)); ++x) {
    const double dx = x + 0.5 - cx;
    f(static_cast<size_t>(x - x0), FallOff(dx * dx + dy * dy, radius, hardness));
  }
}

void RequireRound(const char* op, double radius, double opacity) {
  if (radius > 0 && radius < 1e9 && opacity >= 0 && opacity <= 1) return;
  throw Error(op, "found radius " + base::NumberText(radius) + " and opacity " + base::NumberText(opacity) +
                      ", expected a radius above 0 and an opacity in [0, 1]");
}

}  // namespace

OpInfo AirbrushInfo() {
  OpInfo info = GeneratorRow("airbrush", "Coverage of round dabs of paint along a line");
  info.family = "composite";
  info.help =
      "One channel A: 1 - product of (1 - opacity) over round dabs laid every spacing= pixels along the line "
      "through the points stroke=x0,y0,x1,y1,..., pixel centres at half-integers; one point is one dab. A "
      "dab is full within hardness= times its radius= and falls smoothly to 0 at the radius. n dabs on one "
      "place give 1 - (1-a)^n. Use it as the mask of --reveal.";
  info.bound = "2 u";
  info.bound_u = 2;
  info.modifiers = {ListModifier("stroke", "0,0", 65536, -1e9, 1e9, "points x0,y0,x1,y1,... in pixels"),
                    NumberModifier("radius", "8", 1e-3, 1e9, "of a dab, pixels"),
                    NumberModifier("opacity", "0.25", 0, 1, "of a dab"),
                    NumberModifier("hardness", "0", 0, 1, "share of the radius that is full"),
                    NumberModifier("spacing", "2", 1e-3, 1e9, "between dabs, pixels")};
  info.make = [](std::span<const Node>, const Arguments& a, const ImageSpec* output) {
    const std::vector<double>& n = a.Numbers("stroke");
    if (n.size() % 2 != 0) throw Error("airbrush", "found an odd number of coordinates, expected pairs x,y");
    std::vector<std::array<double, 2>> points;
    for (size_t i = 0; i < n.size(); i += 2) points.push_back({n[i], n[i + 1]});
    const Dab brush{0, 0, a.Number("radius"), a.Number("opacity"), a.Number("hardness")};
    return AirbrushMask(*output, Stroke(points, a.Number("spacing"), brush));
  };
  info.examples = {"stroke=2,4,40,20,30,5", "stroke=20,10 radius=30 hardness=0.5 opacity=1",
                   "stroke=0,0,50,20 radius=3 hardness=1 spacing=1"};
  return info;
}

OpInfo PuffsInfo() {
  OpInfo info = GeneratorRow("puffs", "Soft puffs of smoke or vapour that rise and fade");
  info.family = "composite";
  info.help =
      "Premultiplied R,G,B,A: round sprites born every interval= at (x, y), each living life= time units, "
      "carried by its own velocity (velocity= x,y with a random part up to spread=, pixels per unit; up is "
      "negative y), growing from radius= by growth= per unit and fading as alpha= (1 - age/life)^2; those "
      "below 1/512 are dropped, younger ones lie in front. Everything follows from seed= and time=. Lay it "
      "--over a picture. Source: McReynolds et al. 1997, 11.1 and 11.2.";
  info.bound = "4 u";
  info.bound_u = 4;
  info.modifiers = {NumberModifier("x", "0", -1e9, 1e9, "of the source, pixels"),
                    NumberModifier("y", "0", -1e9, 1e9, "of the source"),
                    NumberModifier("time", "1", 0, 1e9, "time units since the first puff"),
                    NumberModifier("interval", "0.02", 1e-6, 1e9, "between births"),
                    NumberModifier("life", "1", 1e-6, 1e9, "of a puff"),
                    ListModifier("velocity", "0,-100", 2, -1e9, 1e9, "x,y in pixels per time unit"),
                    NumberModifier("spread", "25", 0, 1e9, "largest random velocity, pixels per time unit"),
                    NumberModifier("radius", "6", 1e-3, 1e9, "at birth, pixels"),
                    NumberModifier("growth", "20", 0, 1e9, "of the radius, pixels per time unit"),
                    NumberModifier("alpha", "0.35", 0, 1, "at birth"),
                    ListModifier("color", "0.8,0.8,0.8", 3, 0, 1e9, "r,g,b, not premultiplied"),
                    NumberModifier("seed", "0", 0, 4294967295.0, "whole number")};
  info.make = [](std::span<const Node>, const Arguments& a, const ImageSpec* output) {
    const auto at = [&](const char* name, size_t i) {
      const std::vector<double>& n = a.Numbers(name);
      return n[std::min(i, n.size() - 1)];
    };
    PuffParams p;
    p.x = a.Number("x"), p.y = a.Number("y"), p.time = a.Number("time"), p.interval = a.Number("interval");
    p.life = a.Number("life"), p.velocity_x = at("velocity", 0), p.velocity_y = at("velocity", 1);
    p.spread = a.Number("spread"), p.radius = a.Number("radius"), p.growth = a.Number("growth");
    p.alpha = a.Number("alpha"), p.seed = static_cast<uint32_t>(a.Number("seed"));
    for (size_t i = 0; i < 3; ++i) p.color[i] = at("color", i);
    return Sprites(*output, Puffs(p));
  };
  info.examples = {"x=20 y=18 radius=4 velocity=3,-20",
                   "x=20 y=10 alpha=1 color=1,0.5,0.2 seed=7 interval=0.1"};
  return info;
}

}  // namespace ops

Node AirbrushMask(const ImageSpec& output, const std::vector<Dab>& dabs) {
  for (const Dab& d : dabs) ops::RequireRound("airbrush", d.radius, d.opacity);
  const auto paint = [dabs](int y, int x0, int x1, double* row) {
    for (const Dab& d : dabs) {
      ops::ForDisc(d.x, d.y, d.radius, d.hardness, y, x0, x1,
                   [&](size_t i, double fall) { row[i] += (1 - row[i]) * d.opacity * fall; });
    }
  };
  return graph::MakeNode(
      std::make_shared<const ops::PaintOp>("airbrush", dabs, ops::SpecWith(output, {"A"}), paint), {});
}

std::vector<Dab> Stroke(const std::vector<std::array<double, 2>>& points, double spacing, const Dab& brush) {
  if (!(spacing > 0))
    throw Error("stroke", "found spacing " + base::NumberText(spacing) + ", expected a number above 0");
  std::vector<Dab> dabs;
  const auto add = [&](double x, double y) {
    dabs.push_back(brush);
    dabs.back().x = x, dabs.back().y = y;
  };
  if (!points.empty()) add(points[0][0], points[0][1]);
  double left = spacing;  // until the next dab
  for (size_t k = 1; k < points.size(); ++k) {
    const auto [ax, ay] = points[k - 1];
    const auto [bx, by] = points[k];
    const double length = std::hypot(bx - ax, by - ay);
    double at = left;
    for (; at <= length; at += spacing) add(ax + (bx - ax) * at / length, ay + (by - ay) * at / length);
    left = at - length;
  }
  return dabs;
}

Node Sprites(const ImageSpec& output, const std::vector<Sprite>& sprites, double threshold) {
  std::vector<Sprite> shown;
  for (const Sprite& s : sprites) {
    ops::RequireRound("sprites", s.radius, s.alpha);
    if (s.alpha >= threshold) shown.push_back(s);
  }
  std::ranges::stable_sort(shown, [](const Sprite& a, const Sprite& b) { return a.depth > b.depth; });
  const auto paint = [shown](int y, int x0, int x1, double* row) {
    for (const Sprite& s : shown) {
      ops::ForDisc(s.x, s.y, s.radius, 0, y, x0, x1, [&](size_t i, double fall) {
        const double alpha = s.alpha * fall, color[4] = {s.red, s.green, s.blue, 1};
        for (size_t c = 0; c < 4; ++c) row[4 * i + c] = alpha * color[c] + (1 - alpha) * row[4 * i + c];
      });
    }
  };
  ImageSpec spec = ops::SpecWith(output, {"R", "G", "B", "A"});
  return graph::MakeNode(std::make_shared<const ops::PaintOp>("puffs", shown, std::move(spec), paint), {});
}

std::vector<Sprite> Puffs(const PuffParams& p) {
  std::vector<Sprite> puffs;
  if (!(p.interval > 0 && p.life > 0))
    throw Error("puffs", "found an interval or life of 0, expected numbers above 0");
  constexpr double kMostPuffs = 100000;
  if (const double alive = std::min(p.time, p.life) / p.interval; alive > kMostPuffs) {
    throw Error("puffs", "found " + std::to_string(static_cast<int64_t>(std::min(alive, 1e18))) +
                             " puffs alive at once, expected at most 100000: a longer interval or a "
                             "shorter life");
  }
  const auto first = static_cast<int64_t>(std::floor(std::max(0.0, p.time - p.life) / p.interval));
  const auto last = static_cast<int64_t>(std::floor(p.time / p.interval));
  for (int64_t k = std::max<int64_t>(0, first); k <= last; ++k) {
    const double age = p.time - static_cast<double>(k) * p.interval;
    if (age < 0 || age >= p.life) continue;
    // Every puff has its own numbers, whatever the others are.
    const uint64_t key =
        (uint64_t{p.seed} << 32 | static_cast<uint64_t>(k & 0xFFFFFFFF)) * 0x9E3779B97F4A7C15u;
    std::minstd_rand random(static_cast<uint32_t>((key >> 33) % 2147483646u + 1));
    random.discard(3);
    const auto number = [&] { return 2.0 * static_cast<double>(random() - 1) / 2147483645.0 - 1; };
    const double vx = p.velocity_x + p.spread * number(), vy = p.velocity_y + p.spread * number();
    const double rest = 1 - age / p.life;
    puffs.push_back({p.x + vx * age, p.y + vy * age, p.radius + p.growth * age, p.alpha * rest * rest,
                     p.color[0], p.color[1], p.color[2], age});
  }
  return puffs;
}

LightPoint AttenuatedLight(double size, double distance, double kc, double kl, double kq, double threshold) {
  const double attenuation = 1 / (kc + kl * distance + kq * distance * distance);
  const double seen = size * std::sqrt(attenuation);
  if (seen >= threshold) return {seen, 1};
  return {threshold, (seen / threshold) * (seen / threshold)};
}

}  // namespace tessera
