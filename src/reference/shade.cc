// The oracle of places and fog, from the formulas of doc/maths/fog.md, in double.
#include "tessera/ops/shade.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "model/shade_settings.h"
#include "reference/reference.h"
#include "reference/shade_loop.h"
#include "tessera/error.h"

namespace tessera::reference {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

const Roi& FrameOf(const ImageSpec& spec) {
  return spec.display_window.empty() ? spec.data_window : spec.display_window;
}
double RayLength(const DepthParams& p, const Roi& frame, int x, int y) {
  const auto clip = ClipOfPixel(frame, x, y);
  return p.camera.DistancePerDepth(clip[0], clip[1]);
}
double FromWindow(const DepthParams& p, double w) {
  return p.parallel ? p.near + w * (p.far - p.near) : PlanarOfWindow(w, p.near, p.far);
}
double ToWindow(const DepthParams& p, double planar) {
  return p.parallel ? (planar - p.near) / (p.far - p.near) : WindowOfPlanar(planar, p.near, p.far);
}
double ToPlanar(const DepthParams& p, const Roi& frame, double depth, int x, int y) {
  switch (p.from) {
    case DepthKind::kPlanar:
      return depth;
    case DepthKind::kEuclidean:
      return depth / RayLength(p, frame, x, y);
    case DepthKind::kWindow:
      return FromWindow(p, depth);
    default:
      return FromWindow(p, 1 - depth);
  }
}

// The camera with every number some roundings aside, one way or the other: what its rays move by then, a
// matrix that is nearly singular makes of the roundings of any way to invert it. None where those cannot be
// inverted.
std::vector<Camera> CamerasAside(const Camera& camera) {
  const auto aside = [](Matrix4 m, unsigned signs) {
    for (size_t i = 0; i < m.size(); ++i) m[i] *= 1 + ((signs >> i & 1) != 0 ? 0x1p-46 : -0x1p-46);
    return m;
  };
  const Matrix4 &view = camera.world_to_camera(), &clip = camera.world_to_clip();
  const Roi frame{0, 0, 1, 1};
  std::vector<Camera> cameras;
  for (const unsigned signs : {0x9A6Cu, 0x3C57u, 0xE21Bu, 0x58F1u}) {
    try {
      const Camera alone(clip);  // whether the view was given or follows from the projection
      const bool follows = alone.PixelRay(frame, 0, 0).origin == camera.PixelRay(frame, 0, 0).origin;
      cameras.push_back(follows ? Camera(aside(clip, signs))
                                : Camera(aside(view, ~signs), aside(clip, signs)));
    } catch (const Error&) {
      continue;
    }
  }
  return cameras;
}
// Few ways to be aside do not find the farthest.
constexpr double kFarther = 16;

// Rays that are off by so many times the rows' bound: a matrix so near to a singular one that what it may be
// off by is not foretold by steps this small.
constexpr double kUnknown = 10;

// What a pixel's ray leaves of its length, in the rows' bound: as the camera's numbers are off, and as rays
// that are affine from pixel 0, 0 on leave those terms' roundings.
constexpr double kRowBound = 16 * 0x1p-24;
double Longest(const Vector3& v) { return std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])}); }
// The longest direction, or origin, of the rays at the frame's corners: rays are affine between them.
double LongestOfCorners(const Camera& camera, const Roi& frame, int origin) {
  double longest = 0;
  for (const int x : {frame.x0, frame.x1}) {
    for (const int y : {frame.y0, frame.y1}) {
      const Camera::Ray ray = camera.PixelRay(frame, x, y);
      longest = std::max(longest, Longest(origin != 0 ? ray.origin : ray.direction));
    }
  }
  return longest;
}
double RayOff(const DepthParams& p, const Roi& frame, const std::vector<Camera>& asides, int x, int y) {
  const auto clip = ClipOfPixel(frame, x, y);
  const double length = p.camera.DistancePerDepth(clip[0], clip[1]);
  double off = 0;
  for (const Camera& aside : asides)
    off = std::max(off, kFarther * std::fabs(aside.DistancePerDepth(clip[0], clip[1]) - length));
  off += 0x1p-43 * LongestOfCorners(p.camera, frame, 0);
  return off / length / kRowBound;
}

void Depth(const Call& call) {
  const auto& p = *std::any_cast<DepthParams>(&call.parameters);
  const Roi& frame = FrameOf(call.in_specs[0]);
  const bool turns = (p.from == DepthKind::kEuclidean) != (p.to == DepthKind::kEuclidean);
  const std::vector<Camera> asides = turns ? CamerasAside(p.camera) : std::vector<Camera>();
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      for (int c = 0; c < call.out.channels; ++c) {
        const double depth = call.in[0].at(x, y, c), planar = ToPlanar(p, frame, depth, x, y);
        double v = planar;
        if (p.to == DepthKind::kEuclidean) v = planar * RayLength(p, frame, x, y);
        if (p.to == DepthKind::kWindow) v = ToWindow(p, planar);
        if (p.to == DepthKind::kReversedWindow) v = 1 - ToWindow(p, planar);
        call.out.at(x, y, c) = v;
        // Window depths are differences of two terms.
        const bool window = p.to == DepthKind::kWindow || p.to == DepthKind::kReversedWindow;
        const double off = turns ? RayOff(p, frame, asides, x, y) : 0;
        const double size = std::fabs(v) * (1 + off) + (window ? 1 : 0);
        if (call.scale != nullptr) call.scale->at(x, y, c) = std::max(size, 0x1p-126);
        if (off > kUnknown) call.Undecided(x, y, c, std::fabs(v));
      }
    }
  }
}

void Position(const Call& call) {
  const auto& p = *std::any_cast<DepthParams>(&call.parameters);
  const Roi& frame = FrameOf(call.in_specs[0]);
  const std::vector<Camera> asides = CamerasAside(p.camera);
  const double origins = LongestOfCorners(p.camera, frame, 1),
               directions = LongestOfCorners(p.camera, frame, 0);
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    const double depth = ToPlanar(p, frame, call.in[0].at(x, y, 0), x, y);
    const Camera::Ray ray = p.camera.PixelRay(frame, x, y);
    std::vector<Camera::Ray> rays;
    for (const Camera& aside : asides) rays.push_back(aside.PixelRay(frame, x, y));
    for (size_t k = 0; k < 3; ++k) {
      const double along = ray.direction[k] == 0 && !std::isnan(depth) ? 0 : depth * ray.direction[k];
      // Origins and directions are differences of terms in double, from an inverse matrix: where they are
      // nearly 0 the error is theirs.
      const double terms =
          Longest(ray.origin) + (std::isfinite(depth) ? std::fabs(depth) : 0) * Longest(ray.direction);
      // Rays are affine from pixel 0, 0 on, in double: far from there they leave those terms' roundings.
      const double deep = std::isfinite(depth) ? std::fabs(depth) : 0;
      double moved = 0;
      for (const Camera::Ray& aside : rays) {
        moved = std::max(moved, kFarther * (std::fabs(aside.origin[k] - ray.origin[k]) +
                                            deep * std::fabs(aside.direction[k] - ray.direction[k])));
      }
      moved += 0x1p-43 * (origins + deep * directions);
      const double size = std::fabs(ray.origin[k]) + std::fabs(along);
      pixel.Set(k, ray.origin[k] + along, size + 0x1p-19 * terms + moved / kRowBound);
      if (moved / kRowBound > kUnknown * size + 1) call.Undecided(x, y, static_cast<int>(k), size);
      // At infinity the direction's sign decides, or that there is none.
      if (std::isinf(depth) && std::fabs(ray.direction[k]) <= 0x1p-43 * directions)
        call.Undecided(x, y, static_cast<int>(k), kUnknownJump);
    }
  });
}

void TransformedPoints(const Call& call) {
  const auto& p = *std::any_cast<TransformParams>(&call.parameters);
  const Matrix4& m = p.matrix;
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    const double v[4] = {call.in[0].at(x, y, 0), call.in[0].at(x, y, 1), call.in[0].at(x, y, 2), 1};
    double row[4] = {}, size[4] = {};
    for (size_t i = 0; i < 4; ++i) {
      for (size_t j = 0; j < 4; ++j) row[i] += m[4 * i + j] * v[j], size[i] += std::fabs(m[4 * i + j] * v[j]);
    }
    const double w = p.divide ? row[3] : 1;
    for (size_t i = 0; i < 3; ++i)
      pixel.Set(i, w == 0 ? kNaN : row[i] / w, w == 0 ? 0 : size[i] / std::fabs(w));
  });
}

void Masked(const Call& call) {
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      const bool covered = call.in[1].at(x, y, 0) > 0;
      for (int c = 0; c < call.out.channels; ++c) {
        call.out.at(x, y, c) = covered ? call.in[0].at(x, y, c) : kNaN;
        if (call.scale != nullptr) call.scale->at(x, y, c) = 0;
      }
    }
  }
}

// The density at a height, as it is defined: piece k of layers and lines begins at their height k.
double DensityIn(const LayerFogParams& p, size_t pieces, double y) {
  if (p.profile == FogProfile::kConstant) return pieces == 0 ? 0 : p.layers[pieces - 1].density;
  if (pieces == 0) return p.layers.front().density;
  if (pieces == p.layers.size()) return p.layers.back().density;
  const FogLayer &low = p.layers[pieces - 1], &high = p.layers[pieces];
  return low.density + (high.density - low.density) * (y - low.height) / (high.height - low.height);
}

// The mean of exp(-t) from 0 to x by Gauss's eight places in parts of half a unit; nothing is left beyond 80.
double MeanOfDecay(double x) {
  if (x == 0) return 1;
  const double places[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363},
               weights[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
  const double end = std::min(x, 80.0);
  const int parts = static_cast<int>(std::ceil(2 * end));
  const double half = 0.5 * end / parts;
  double sum = 0;
  for (int i = parts - 1; i >= 0; --i) {  // the small ones first
    for (int k = 0; k < 4; ++k) {
      const double middle = (2 * i + 1) * half;
      sum += weights[k] * (std::exp(-(middle - half * places[k])) + std::exp(-(middle + half * places[k])));
    }
  }
  return sum * half / x;
}

// The mean density between two heights: the integral of the density, not the kernel's differences of
// integrals.
double MeanDensity(const LayerFogParams& p, double a, double b) {
  const double low = std::min(a, b), high = std::max(a, b);
  double mean = 0;
  if (p.profile == FogProfile::kExponential) {
    for (const ExponentialLayer& layer : p.exponential) {
      mean += layer.density * std::exp((layer.height - low) / layer.falloff) *
              MeanOfDecay((high - low) / layer.falloff);
    }
    return mean;
  }
  for (size_t pieces = 0; pieces <= p.layers.size(); ++pieces) {
    const double from = pieces == 0 ? low : std::max(low, p.layers[pieces - 1].height),
                 to = pieces == p.layers.size() ? high : std::min(high, p.layers[pieces].height);
    if (low == high) {  // at a layer's own height it is that layer's
      const bool above = pieces == 0 || low >= p.layers[pieces - 1].height;
      const bool below = pieces == p.layers.size() || low < p.layers[pieces].height;
      if (above && below) return DensityIn(p, pieces, low);
    } else if (to > from) {
      // Straight between: its middle is its mean.
      mean += DensityIn(p, pieces, from + 0.5 * (to - from)) * ((to - from) / (high - low));
    }
  }
  return mean;
}

// Optical depth over distance d between the eye and a point at height y.
double OpticalDepth(const ops::FogSettings& s, double d, double y) {
  if (!s.layered) {
    const double x = s.fog.density * d;
    return s.fog.mode == FogMode::kExp2 ? x * x : x;
  }
  const double far = std::clamp(y, -1e60, 1e60);
  const double mean = MeanDensity(s.layers, s.layers.eye[1], far);
  return mean == 0 && !std::isnan(d) ? 0 : d * mean;
}

void Fog(const Call& call) {
  const auto& s = *std::any_cast<ops::FogSettings>(&call.parameters);
  const auto& constant = s.layered ? s.layers.color : s.fog.color;
  const Vector3& eye = s.layered ? s.layers.eye : s.fog.eye;
  const int alpha = call.in_specs[0].alpha;
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    const ImageD& place = call.in[1];
    const double px = place.at(x, y, 0), py = place.at(x, y, 1), pz = place.at(x, y, 2);
    double d = std::sqrt((px - eye[0]) * (px - eye[0]) + (py - eye[1]) * (py - eye[1]) +
                         (pz - eye[2]) * (pz - eye[2]));
    if (!s.layered && (s.fog.distance || s.fog.mode == FogMode::kTransmittance))
      d = std::isnan(px) ? px : std::max(px, 0.0);
    const double factor = s.mask_input < 0 ? 1 : call.in[static_cast<size_t>(s.mask_input)].at(x, y, 0);
    if (std::isnan(d) || !(factor > 0)) return;
    double through, rest;
    if (s.layered || s.fog.mode == FogMode::kExp || s.fog.mode == FogMode::kExp2) {
      double tau;
      if (s.layered || s.fog.mode == FogMode::kExp) {
        tau = OpticalDepth(s, d, py);
        tau = tau == 0 ? 0 : tau * factor;
      } else {
        tau = OpticalDepth(s, d * factor, py);
      }
      through = std::exp(-tau), rest = -std::expm1(-tau);
    } else {
      if (s.fog.mode == FogMode::kTransmittance) {
        rest = 1 - std::clamp(px, 0.0, 1.0);
      } else if (s.fog.start == s.fog.end) {
        rest = d < s.fog.start ? 0 : 1;
      } else {
        rest = std::clamp((d - s.fog.start) / (s.fog.end - s.fog.start), 0.0, 1.0);
      }
      rest = std::min(rest * factor, 1.0), through = 1 - rest;
    }
    if (rest == 0) return;
    const double a = alpha >= 0 ? call.in[0].at(x, y, alpha) : 1;
    for (size_t k = 0; k < 3; ++k) {
      const int c = static_cast<int>(k);
      const double from = call.in[0].at(x, y, c);
      const double fog = s.color_input < 0 ? static_cast<float>(constant[k])
                                           : call.in[static_cast<size_t>(s.color_input)].at(x, y, c);
      const bool hidden = static_cast<float>(through) == 0;
      pixel.Set(k, hidden ? a * fog : through * from + rest * a * fog,
                std::fabs(through * from) + std::fabs(rest * a * fog) +
                    0x1p-126 * (std::fabs(from) + std::fabs(a * fog)));  // what is left may be subnormal
    }
  });
}

void FogAxes(const Call& call) {
  const auto& s = *std::any_cast<ops::FogAxesSettings>(&call.parameters);
  EachShadedPixel(call, [&](int x, int y, ShadedPixel& pixel) {
    double square = 0;
    for (size_t k = 0; k < 3; ++k) {
      const double v = call.in[0].at(x, y, static_cast<int>(k)) - s.eye[k];
      square += v * v;
    }
    const double d = std::sqrt(square) / s.distance, h = (call.in[0].at(x, y, 1) - s.low) / (s.high - s.low);
    pixel.Set(0, d, d);
    pixel.Set(1, h, std::fabs(h));
    const double eye = (s.eye[1] - s.low) / (s.high - s.low);
    pixel.Set(2, eye, std::fabs(eye));
  });
}

}  // namespace

std::vector<Entry> ShadeEntries() {
  return {{"depth", Depth},    {"position", Position}, {"transform", TransformedPoints},
          {"maskaov", Masked}, {"fog", Fog},           {"layerfog", Fog},
          {"fogaxes", FogAxes}};
}

}  // namespace tessera::reference
