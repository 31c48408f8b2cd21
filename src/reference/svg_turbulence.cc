// Reference of SVG's feTurbulence: the specification's text, pixel by pixel.
#include <any>
#include <array>
#include <cmath>
#include <vector>

#include "reference/point_loop.h"
#include "reference/reference.h"
#include "tessera/ops/noise.h"

namespace tessera::reference {
namespace {

class Tables {
 public:
  explicit Tables(double seed_number)
      : lattice_(514), gradient_(4, std::vector<std::vector<double>>(514, {0, 0})) {
    seed_ = static_cast<long long>(std::trunc(seed_number));
    if (seed_ <= 0) seed_ = -(seed_ % 2147483646) + 1;
    if (seed_ > 2147483646) seed_ = 2147483646;
    for (auto& channel : gradient_) {
      for (int i = 0; i < 256; ++i) {
        lattice_.at(static_cast<size_t>(i)) = i;
        std::vector<double>& g = channel.at(static_cast<size_t>(i));
        for (double& v : g) v = static_cast<double>(Random() % 512 - 256) / 256;
        const double length = std::hypot(g[0], g[1]);
        g[0] /= length;
        g[1] /= length;
      }
    }
    for (int i = 255; i >= 1; --i) {
      const int kept = lattice_.at(static_cast<size_t>(i));
      const auto j = static_cast<size_t>(Random() % 256);
      lattice_.at(static_cast<size_t>(i)) = lattice_.at(j);
      lattice_.at(j) = kept;
    }
    for (size_t i = 0; i < 258; ++i) {
      lattice_.at(256 + i) = lattice_.at(i);
      for (auto& channel : gradient_) channel.at(256 + i) = channel.at(i);
    }
  }

  struct Stitch {
    double width = 0, height = 0, wrap_x = 0, wrap_y = 0;
  };
  double Noise(int channel, double x, double y, const Stitch* stitch) const {
    const double tx = x + 4096, ty = y + 4096;
    double cell[4] = {std::trunc(tx), std::trunc(tx) + 1, std::trunc(ty), std::trunc(ty) + 1};
    const double rx0 = tx - cell[0], rx1 = rx0 - 1, ry0 = ty - cell[2], ry1 = ry0 - 1;
    if (stitch != nullptr) {
      for (int i = 0; i < 2; ++i) {
        if (stitch->width > 0 && cell[i] >= stitch->wrap_x) cell[i] -= stitch->width;
        if (stitch->height > 0 && cell[2 + i] >= stitch->wrap_y) cell[2 + i] -= stitch->height;
      }
    }
    size_t b[4];
    for (int i = 0; i < 4; ++i) b[i] = static_cast<size_t>(cell[i] - 256 * std::floor(cell[i] / 256));
    const auto i = static_cast<size_t>(lattice_.at(b[0])), j = static_cast<size_t>(lattice_.at(b[1]));
    const double sx = rx0 * rx0 * (3 - 2 * rx0), sy = ry0 * ry0 * (3 - 2 * ry0);
    const auto dot = [&](size_t at, double px, double py) {
      const std::vector<double>& g =
          gradient_.at(static_cast<size_t>(channel)).at(static_cast<size_t>(lattice_.at(at)));
      return px * g[0] + py * g[1];
    };
    const double a = dot(i + b[2], rx0, ry0) + sx * (dot(j + b[2], rx1, ry0) - dot(i + b[2], rx0, ry0));
    const double c = dot(i + b[3], rx0, ry1) + sx * (dot(j + b[3], rx1, ry1) - dot(i + b[3], rx0, ry1));
    return a + sy * (c - a);
  }

 private:
  long long Random() {
    seed_ = 16807 * (seed_ % 127773) - 2836 * (seed_ / 127773);
    if (seed_ <= 0) seed_ += 2147483647;
    return seed_;
  }
  long long seed_ = 1;
  std::vector<int> lattice_;
  std::vector<std::vector<std::vector<double>>> gradient_;
};

// `position(x, y)`: the point of user space of a pixel; not finite where there is none.
template <class Position>
void Evaluate(const Call& call, Position position) {
  const auto& p = std::any_cast<const SvgTurbulenceParams&>(call.parameters);
  const Tables tables(p.seed);
  double frequency[2] = {p.base_frequency[0], p.base_frequency[1]};
  const int size[2] = {p.frame.width(), p.frame.height()}, origin[2] = {p.frame.x0, p.frame.y0};
  Tables::Stitch first;
  if (p.stitch) {
    for (int a = 0; a < 2; ++a) {
      if (frequency[a] == 0) continue;
      const double low = std::floor(size[a] * frequency[a]) / size[a],
                   high = std::ceil(size[a] * frequency[a]) / size[a];
      frequency[a] = frequency[a] / low < high / frequency[a] ? low : high;
    }
    first.width = std::floor(size[0] * frequency[0] + 0.5);
    first.height = std::floor(size[1] * frequency[1] + 0.5);
    first.wrap_x = std::trunc(origin[0] * frequency[0] + 4096 + first.width);
    first.wrap_y = std::trunc(origin[1] * frequency[1] + 4096 + first.height);
  }
  ForEachSample(call, [&](int px, int py, int c) -> std::pair<double, double> {
    if (c >= 4) return {0.0, 1.0};
    const std::array<double, 2> point = position(px, py);
    if (!std::isfinite(point[0]) || !std::isfinite(point[1])) return {p.fractal_noise ? 0.5 : 0.0, 1.0};
    double x = point[0] * frequency[0], y = point[1] * frequency[1], sum = 0, ratio = 1;
    Tables::Stitch stitch = first;
    for (int k = 0; k < p.octaves; ++k) {
      const double n = tables.Noise(c, x, y, p.stitch ? &stitch : nullptr);
      sum += (p.fractal_noise ? n : std::fabs(n)) / ratio;
      x *= 2;
      y *= 2;
      ratio *= 2;
      stitch.width *= 2;
      stitch.wrap_x = 2 * stitch.wrap_x - 4096;
      stitch.height *= 2;
      stitch.wrap_y = 2 * stitch.wrap_y - 4096;
    }
    if (p.fractal_noise) sum = (sum + 1) / 2;
    return {std::fmin(std::fmax(sum, 0), 1), 1.0};
  });
}

}  // namespace

std::vector<Entry> SvgTurbulenceEntries() {
  const auto on_grid = [](const Call& call) {
    Evaluate(call, [](int x, int y) {
      return std::array<double, 2>{static_cast<double>(x), static_cast<double>(y)};
    });
  };
  const auto at = [](const Call& call) {
    const ImageD& in = call.in[0];
    Evaluate(call, [&](int x, int y) { return std::array<double, 2>{in.at(x, y, 0), in.at(x, y, 1)}; });
  };
  return {{"turbulence", on_grid}, {"fractalnoise", on_grid}, {"turbulenceat", at}};
}

}  // namespace tessera::reference
