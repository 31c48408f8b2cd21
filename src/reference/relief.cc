// Reference of ambient occlusion and curvature of heights.
#include <algorithm>
#include <cmath>
#include <vector>

#include "model/horizon.h"
#include "reference/border.h"
#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/ops/bump.h"

namespace tessera::reference {
namespace {

double HeightAt(const Call& call, int x, int y, Wrap wrap) {
  const Roi& window = call.in_specs[0].data_window;
  const bool shown = Shown(x, window.x0, window.x1, wrap) && Shown(y, window.y0, window.y1, wrap);
  return shown ? call.in[0].at(x, y, 0) : 0;
}

void EvaluateOcclusion(const Call& call) {
  const auto& p = std::any_cast<const HeightOcclusionParams&>(call.parameters);
  std::vector<std::vector<model::HorizonPlace>> rays;
  for (int k = 0; k < p.directions; ++k) rays.push_back(model::HorizonRay(k, p.directions, p.radius));
  ForEachSample(call, [&](int x, int y, int) {
    const double here = HeightAt(call, x, y, p.wrap);
    double sum = 0;
    for (const std::vector<model::HorizonPlace>& ray : rays) {
      double horizon = 0;  // an angle
      for (const model::HorizonPlace& place : ray) {
        const double rise = p.scale * (HeightAt(call, x + place.dx, y + place.dy, p.wrap) - here);
        const double angle = std::atan2(rise, place.distance);
        if (angle > horizon) horizon = angle;
      }
      const double c = std::cos(horizon);
      sum += c * c;
    }
    return std::pair{sum / p.directions, 2 + p.directions / 8.0};
  });
}
Roi OcclusionInput(const std::any& parameters, int, const Roi& out) {
  const auto& p = std::any_cast<const HeightOcclusionParams&>(parameters);
  return Around(out, p.radius, p.radius, p.radius, p.radius, p.wrap);
}

void EvaluateCurvature(const Call& call) {
  const auto& p = std::any_cast<const HeightCurvatureParams&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int) {
    const double here = HeightAt(call, x, y, p.wrap);
    double largest = 0;
    const auto f = [&](int dx, int dy) {  // y up
      const double h = HeightAt(call, x + dx, y - dy, p.wrap);
      if (std::isfinite(h)) largest = std::max(largest, std::fabs(h - here));
      return p.scale * (h - here);
    };
    const double fx = (f(1, 0) - f(-1, 0)) / 2, fy = (f(0, 1) - f(0, -1)) / 2;
    const double fxx = f(1, 0) - 2 * f(0, 0) + f(-1, 0), fyy = f(0, 1) - 2 * f(0, 0) + f(0, -1);
    const double fxy = (f(1, 1) - f(-1, 1) - f(1, -1) + f(-1, -1)) / 4;
    const double q = 1 + fx * fx + fy * fy;
    const double c =
        p.output == CurvatureOutput::kGaussian
            ? (fxx * fyy - fxy * fxy) / (q * q)
            : -((1 + fy * fy) * fxx - 2 * fx * fy * fxy + (1 + fx * fx) * fyy) / (2 * std::pow(q, 1.5));
    const double v = p.pack ? 0.5 + p.gain * c / 2 : p.gain * c;
    // What doubles leave where second differences cancel: 2^-50 of the terms, in units of 2^-24.
    const double steep = std::fabs(p.scale) * largest,
                 terms = p.output == CurvatureOutput::kGaussian
                             ? 8 * steep * steep / (q * q)
                             : 8 * steep * (1 + steep * steep) / std::pow(q, 1.5);
    return std::pair{v, std::fabs(v) + 0x1p-26 * std::fabs(p.gain) * terms + kSmallestScale};
  });
}
Roi CurvatureInput(const std::any& parameters, int, const Roi& out) {
  const auto& p = std::any_cast<const HeightCurvatureParams&>(parameters);
  return Around(out, 1, 1, 1, 1, p.wrap);
}

}  // namespace

std::vector<Entry> ReliefEntries() {
  return {{"heighttoao", EvaluateOcclusion, OcclusionInput},
          {"curvature", EvaluateCurvature, CurvatureInput}};
}

}  // namespace tessera::reference
