// Reference of outlines, halos, brush masks and sprites.
#include "tessera/ops/outline.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

Roi OneAround(const std::any&, int, const Roi& out) { return Inflate(out, 1, 1); }

double Reciprocal(double z) { return z == 0 || std::isnan(z) ? 0 : 1 / z; }

void EvaluateEdges(const Call& call) {
  const auto& [inputs, params] = std::any_cast<const std::pair<EdgeInputs, EdgeParams>&>(call.parameters);
  const double tolerance = params.depth_tolerance,
               cosine = std::cos(params.normal_degrees * std::numbers::pi / 180);
  const Roi window = call.out_spec.data_window;
  ForEachSample(call, [&](int x, int y, int) {
    const auto bends = [&](const ImageD& z, int dx, int dy) {
      if (!window.Contains({x - dx, y - dy, x + dx + 1, y + dy + 1})) return false;
      const double a = Reciprocal(z.at(x - dx, y - dy, 0)), b = Reciprocal(z.at(x, y, 0));
      const double c = Reciprocal(z.at(x + dx, y + dy, 0));
      return std::fabs(a - 2 * b + c) > tolerance * std::max({std::fabs(a), std::fabs(b), std::fabs(c)});
    };
    const auto turns = [&](const ImageD& n, int dx, int dy) {
      double dot = 0, here = 0, there = 0;
      for (int c = 0; c < 3; ++c) {
        const double a = n.at(x, y, c), b = n.at(x + dx, y + dy, c);
        dot += a * b, here += a * a, there += b * b;
      }
      return !(here > 0 && there > 0 && std::fabs(dot) >= cosine * std::sqrt(here * there));
    };
    const auto differs = [&](const ImageD& id, int dx, int dy) {
      for (int c = 0; c < id.channels; ++c) {
        if (id.at(x, y, c) != id.at(x + dx, y + dy, c)) return true;
      }
      return false;
    };
    bool edge = false;
    size_t k = 0;
    if (inputs.depth) edge = bends(call.in[0], 1, 0) || bends(call.in[0], 0, 1), k = 1;
    for (bool normal = static_cast<bool>(inputs.normal); k < call.in.size(); ++k, normal = false) {
      for (const auto& [dx, dy] : {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
        if (!window.Contains({x + dx, y + dy, x + dx + 1, y + dy + 1})) continue;
        edge = edge || (normal ? turns(call.in[k], dx, dy) : differs(call.in[k], dx, dy));
      }
    }
    return Rounded(edge ? 1 : 0);
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

}  // namespace

std::vector<Entry> OutlineEntries() {
  return {{"edges", EvaluateEdges, OneAround},
          {"outline", EvaluateOutline, OneAround},
          {"halo", EvaluateHalo, HaloRoi},
          {"airbrush", EvaluateAirbrush},
          {"puffs", EvaluateSprites}};
}

}  // namespace tessera::reference
