// Reference of outlines, halos, brush masks, sprites and brushes of any picture.
#include "tessera/ops/outline.h"

#include <algorithm>
#include <any>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "reference/border.h"
#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

Roi OneAround(const std::any&, int, const Roi& out) { return Inflate(out, 1, 1); }
Roi EdgesRoi(const std::any& parameters, int, const Roi& out) {
  const int reach = std::any_cast<const std::pair<EdgeInputs, EdgeParams>&>(parameters).second.smooth ? 3 : 1;
  return Inflate(out, reach, reach);
}

double Reciprocal(double z) { return z == 0 || std::isnan(z) ? 0 : 1 / z; }

void EvaluateEdges(const Call& call) {
  const auto& [inputs, params] = std::any_cast<const std::pair<EdgeInputs, EdgeParams>&>(call.parameters);
  const double tolerance = params.depth_tolerance,
               cosine = std::cos(params.normal_degrees * std::numbers::pi / 180);
  const Roi window = call.out_spec.data_window;
  const ImageD* const depth = inputs.depth ? &call.in[0] : nullptr;
  const ImageD* const normal = inputs.normal ? &call.in[inputs.depth ? 1 : 0] : nullptr;
  const ImageD* const id = inputs.id ? &call.in.back() : nullptr;
  const auto inside = [&](int x, int y) { return window.Contains({x, y, x + 1, y + 1}); };
  // NaN where a component is.
  const auto squared = [&](int x, int y) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += normal->at(x, y, c) * normal->at(x, y, c);
    return sum;
  };
  const auto background = [&](int x, int y) {
    return (depth != nullptr && Reciprocal(depth->at(x, y, 0)) == 0) ||
           (normal != nullptr && !(squared(x, y) > 0));
  };
  // -1, 0 or 1: which way 1/z bends.
  const auto bends = [&](int x, int y, int dx, int dy) {
    if (depth == nullptr || !inside(x - dx, y - dy) || !inside(x + dx, y + dy)) return 0;
    const double a = Reciprocal(depth->at(x - dx, y - dy, 0)), b = Reciprocal(depth->at(x, y, 0));
    const double c = Reciprocal(depth->at(x + dx, y + dy, 0)), bend = a - 2 * b + c;
    if (!(std::fabs(bend) > tolerance * std::max({std::fabs(a), std::fabs(b), std::fabs(c)}))) return 0;
    return bend > 0 ? 1 : -1;
  };
  bool at_limit = false;
  const auto differ = [&](int x, int y, int dx, int dy) {
    bool result = false;
    if (normal != nullptr) {
      double dot = 0, here = 0, there = 0;
      for (int c = 0; c < 3; ++c) {
        const double a = normal->at(x, y, c), b = normal->at(x + dx, y + dy, c);
        dot += a * b, here += a * a, there += b * b;
      }
      const double limit = cosine * std::sqrt(here * there);
      result = !(here > 0 && there > 0 && std::fabs(dot) >= limit);
      // Parallel normals at an angle of 0, say: the last bits of the products decide.
      at_limit = at_limit || std::fabs(std::fabs(dot) - limit) <= 0x1p-46 * std::sqrt(here * there);
    }
    for (int c = 0; id != nullptr && c < id->channels; ++c) {
      const double a = id->at(x, y, c), b = id->at(x + dx, y + dy, c);
      result = result || a != b;
      const int k = static_cast<int>(call.in.size()) - 1;
      const double off = call.Tolerance(k, x, y, c) + call.Tolerance(k, x + dx, y + dy, c);
      at_limit = at_limit || (off > 0 && std::fabs(a - b) <= off);  // computed ids are equal by chance
    }
    return result;
  };
  const auto between = [&](int x, int y, int dx, int dy) {
    if (!inside(x, y) || !inside(x + dx, y + dy)) return false;
    if (background(x, y) || background(x + dx, y + dy)) return background(x, y) != background(x + dx, y + dy);
    return bends(x, y, dx, dy) * bends(x + dx, y + dy, dx, dy) < 0 || differ(x, y, dx, dy);
  };
  const std::pair<int, int> steps[] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  const auto line = [&](int x, int y) {
    if (background(x, y)) return 0.0;
    bool edge = bends(x, y, 1, 0) != 0 || bends(x, y, 0, 1) != 0;
    for (const auto& [dx, dy] : steps) edge = edge || (inside(x + dx, y + dy) && differ(x, y, dx, dy));
    return edge ? 1.0 : 0.0;
  };
  const auto smooth = [&](int x, int y) {
    // The pixels around, one after the other, that no line parts from those found before.
    double share = 0;
    const double weights[] = {1.0 / 16, 4.0 / 16, 6.0 / 16, 4.0 / 16, 1.0 / 16};
    std::vector<std::pair<int, int>> found = {{x, y}};
    for (size_t k = 0; k < found.size(); ++k) {
      const auto [px, py] = found[k];
      share += weights[px - x + 2] * weights[py - y + 2];
      for (const auto& [dx, dy] : steps) {
        const std::pair next(px + dx, py + dy);
        if (std::abs(next.first - x) > 2 || std::abs(next.second - y) > 2) continue;
        const bool parted = between(std::min(px, px + dx), std::min(py, py + dy), std::abs(dx), std::abs(dy));
        if (!parted && std::find(found.begin(), found.end(), next) == found.end()) found.push_back(next);
      }
    }
    // How far the boundary is: the quantile of a Gaussian, as a series, within the pixel that matters.
    double at = 0;
    if (share > 0.5) {
      const double v = std::sqrt(2 * std::numbers::pi) * (share - 0.5);
      at = share * 256 < 216 ? v + std::pow(v, 3) / 6 + 7 * std::pow(v, 5) / 120 + 127 * std::pow(v, 7) / 5040
                             : 1;
    }
    double value = std::max(1 - at, 0.0);
    const auto crease = [&](int dx, int dy) {
      return bends(x, y, dx, dy) != 0 && !between(x, y, dx, dy) && !between(x - dx, y - dy, dx, dy);
    };
    if (!background(x, y) && (crease(1, 0) || crease(0, 1))) value = 1;
    return value;
  };
  ForEachSample(call, [&](int x, int y, int) {
    at_limit = false;
    const double value = params.smooth ? smooth(x, y) : line(x, y);
    if (at_limit) call.Undecided(x, y, 1);
    return std::pair(value, 1.0);
  });
}

void EvaluateOutline(const Call& call) {
  const auto& p = std::any_cast<const OutlineParams&>(call.parameters);
  const Roi window = call.in_specs[0].data_window;
  ForEachSample(call, [&](int x, int y, int) {
    const auto inside = [&](int px, int py) {
      if (p.clamp)
        px = std::clamp(px, window.x0, window.x1 - 1), py = std::clamp(py, window.y0, window.y1 - 1);
      return window.Contains({px, py, px + 1, py + 1}) && call.in[0].at(px, py, 0) > 0.5 ? 1 : 0;
    };
    const int k = inside(x - 1, y) + inside(x + 1, y) + inside(x, y - 1) + inside(x, y + 1);
    const bool in = inside(x, y) != 0;
    if (p.kind == OutlineKind::kCount) return Rounded(k / 4.0);
    const bool inner = in && k < 4 && p.kind != OutlineKind::kOuter,
               outer = !in && k > 0 && p.kind != OutlineKind::kInner;
    return Rounded(inner || outer ? 1 : 0);
  });
}

Roi HaloRoi(const std::any& parameters, int, const Roi& out) {
  const int radius = std::any_cast<const HaloParams&>(parameters).radius;
  return Inflate(out, radius, radius);
}

// The smallest depth of a line on the disc first, then the comparison.
void EvaluateHalo(const Call& call) {
  const auto& p = std::any_cast<const HaloParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int) {
    const double line = call.in[0].at(x, y, 0), z = call.in[1].at(x, y, 0);
    if (!(line > 0) || std::isnan(z)) return Rounded(0);
    double nearest = z;
    for (int dy = -p.radius; dy <= p.radius; ++dy) {
      for (int dx = -p.radius; dx <= p.radius; ++dx) {
        if (dx * dx + dy * dy > p.radius * p.radius ||
            !call.in[0].roi.Contains({x + dx, y + dy, x + dx + 1, y + dy + 1})) {
          continue;
        }
        if (call.in[0].at(x + dx, y + dy, 0) > 0)
          nearest = std::fmin(nearest, call.in[1].at(x + dx, y + dy, 0));
      }
    }
    return Rounded(z > nearest + p.epsilon ? 0 : line);
  });
}

double DabAt(double distance, double hardness) {
  if (distance >= 1) return 0;
  if (distance <= hardness) return 1;
  const double t = (distance - hardness) / (1 - hardness);
  return 1 - (3 * t * t - 2 * t * t * t);
}

void EvaluateAirbrush(const Call& call) {
  const auto& dabs = std::any_cast<const std::vector<Dab>&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int) {
    double through = 1;
    for (const Dab& d : dabs) {
      through *= 1 - d.opacity * DabAt(std::hypot(x + 0.5 - d.x, y + 0.5 - d.y) / d.radius, d.hardness);
    }
    return std::pair(1 - through, 1.0);
  });
}

// Front to back: what each sprite adds through those before it.
void EvaluateSprites(const Call& call) {
  const auto& sprites = std::any_cast<const std::vector<Sprite>&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    double sum = 0, through = 1, size = 1;
    for (size_t k = sprites.size(); k-- > 0;) {
      const Sprite& s = sprites[k];
      const double alpha = s.alpha * DabAt(std::hypot(x + 0.5 - s.x, y + 0.5 - s.y) / s.radius, 0);
      const double color = c == 0 ? s.red : c == 1 ? s.green : c == 2 ? s.blue : 1;
      sum += through * alpha * color;
      through *= 1 - alpha;
      size = std::max(size, std::fabs(color));
    }
    return std::pair(sum, size);
  });
}

// A brush's means of 2^l x 2^l pixels, each summed from the pixels themselves.
class Means {
 public:
  Means(const ImageD& brush, const ImageSpec& spec) : brush_(brush), roi_(spec.data_window) {}
  // Channel c, or the share of the block that lies on the brush for c = -1, at a place in brush pixels.
  double At(int level, double u, double v, int c) {
    const double side = std::ldexp(1.0, level), s = u / side - 0.5, t = v / side - 0.5;
    double sum = 0;
    for (const double j : {std::floor(t), std::floor(t) + 1}) {
      for (const double i : {std::floor(s), std::floor(s) + 1}) {
        const double weight = (1 - std::fabs(s - i)) * (1 - std::fabs(t - j));
        if (i < 0 || j < 0 || i * side >= roi_.width() || j * side >= roi_.height() || weight == 0) continue;
        sum += weight * Block(level, static_cast<int>(i), static_cast<int>(j), c);
      }
    }
    return sum;
  }

 private:
  double Block(int level, int i, int j, int c) {
    const auto [found, fresh] = known_.try_emplace({level, i, j, c}, 0.0);
    if (!fresh) return found->second;
    const int side = 1 << level;
    double sum = 0;
    for (int y = j * side; y < std::min((j + 1) * side, roi_.height()); ++y)
      for (int x = i * side; x < std::min((i + 1) * side, roi_.width()); ++x)
        sum += c < 0 ? 1.0 : brush_.at(roi_.x0 + x, roi_.y0 + y, c);
    return found->second = sum / side / side;
  }
  const ImageD& brush_;
  Roi roi_;
  std::map<std::array<int, 4>, double> known_;
};

Roi PaintInput(const std::any&, int input, const Roi& out) { return input == 1 ? kEverywhere : out; }

// Front to back, the base last.
void EvaluatePaint(const Call& call) {
  using Parameters = std::pair<std::vector<Stamp>, std::vector<double>>;
  const auto& [stamps, color] = std::any_cast<const Parameters&>(call.parameters);
  const ImageSpec &base = call.in_specs[0], &brush = call.in_specs[1];
  const double wide = brush.data_window.width(), high = brush.data_window.height();
  const int base_colors = base.channel_count() - (base.alpha >= 0 ? 1 : 0);
  const bool mask = brush.channel_count() == 1 && (brush.alpha < 0 || base_colors > 0);
  const int cover = mask ? 0 : brush.alpha;
  int top = 0;
  while (std::ldexp(1.0, top) < std::max(wide, high)) ++top;
  Means means(call.in[1], brush);
  ForEachSample(call, [&](int x, int y, int c) {
    // The channel's place among those beside alpha, and the brush's channel of that place.
    const int place = c - (base.alpha >= 0 && c > base.alpha ? 1 : 0);
    int from = place + (brush.alpha >= 0 && place >= brush.alpha ? 1 : 0);
    double factor = 1;
    if (c == base.alpha || mask) from = cover;
    if (c != base.alpha && mask) factor = color.size() == 1 ? color[0] : color[static_cast<size_t>(place)];
    double sum = 0, size = 0, through = 1;
    for (size_t k = stamps.size(); k-- > 0;) {
      const Stamp& s = stamps[k];
      const double shown = std::max(s.size, 1.0), zoom = std::max(wide, high) / shown;
      const double turn = std::fmod(s.angle, 360.0) / 180 * std::numbers::pi, dx = x + 0.5 - s.x,
                   dy = y + 0.5 - s.y;
      if (std::hypot(dx, dy) > 2 * shown + 4) continue;
      const double u = wide / 2 + zoom * (dx * std::cos(turn) - dy * std::sin(turn));
      const double v = high / 2 + zoom * (dx * std::sin(turn) + dy * std::cos(turn));
      const double level = std::clamp(std::log2(zoom), 0.0, double(top)), part = level - std::floor(level);
      const double opacity = s.size < 1 ? s.opacity * s.size * s.size : s.opacity;
      const auto at = [&](int channel) {
        const int l = static_cast<int>(level);
        const double low = means.At(l, u, v, channel);
        return opacity * (part > 0 ? (1 - part) * low + part * means.At(l + 1, u, v, channel) : low);
      };
      const double paint = factor * at(from), alpha = at(cover);
      sum += through * paint, size += std::fabs(through * paint);
      through *= 1 - alpha;
    }
    const double behind = through * call.in[0].at(x, y, c);
    return std::pair(sum + behind, size + std::fabs(behind));
  });
}

}  // namespace

std::vector<Entry> OutlineEntries() {
  return {{"edges", EvaluateEdges, EdgesRoi}, {"outline", EvaluateOutline, OneAround},
          {"halo", EvaluateHalo, HaloRoi},    {"airbrush", EvaluateAirbrush},
          {"puffs", EvaluateSprites},         {"paint", EvaluatePaint, PaintInput}};
}

}  // namespace tessera::reference
