// Reference of the environment family: mirrors, mip levels by their definition, lobes as sums over every
// texel.
#include "tessera/ops/environment.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "model/environment_settings.h"
#include "reference/environment_lobe.h"
#include "reference/environment_map.h"
#include "reference/point_loop.h"
#include "reference/probes.h"
#include "reference/reference.h"

namespace tessera::reference {
namespace {

ImageD Doubles(const Image& image) {
  ImageD d(image.spec().data_window, image.spec().channel_count());
  const auto* const samples = reinterpret_cast<const float*>(image.view().data);
  for (size_t i = 0; i < d.samples.size(); ++i) d.samples[i] = samples[i];
  return d;
}
bool Usable(double square) { return square > 0 && square < std::numeric_limits<double>::infinity(); }

// As many as the whole sphere would have; of a lens, of the size of the one in its middle.
double TexelsOf(const Map& map) {
  const double face = double{1} * map.w() * map.h();
  switch (map.kind()) {
    case EnvironmentMap::kCube:
      return 6 * face;
    case EnvironmentMap::kSphere:
      return kPi / 4 * face;
    case EnvironmentMap::kParabolic:
    case EnvironmentMap::kDualParabolic:
      return kPi / 2 * face;
    case EnvironmentMap::kLatLong:
    case EnvironmentMap::kOctahedral:
      return face;
    default:
      return 4 * kPi * map.focal() * map.focal();
  }
}

// Coarser and coarser cubes of a map, and the lookup between two of them by an angle.
class Mips {
 public:
  explicit Mips(const Map& map) : map_(map) {
    const double texels = TexelsOf(map);
    angle_ = std::sqrt(4 * kPi / texels);
    int n = 1;
    while (2 * n * std::sqrt(2.0) <= std::sqrt(texels / 6)) n *= 2;
    const int samples = std::clamp(static_cast<int>(std::ceil(2 / (n * angle_))), 1, 16);
    while (true) {
      pictures_.emplace_back(Roi{0, 0, 6 * n, n}, map.channels());
      ImageD& picture = pictures_.back();
      const Map cube(picture, EnvironmentMap::kCube);
      for (int face = 0; face < 6; ++face) {
        for (int j = 0; j < n; ++j) {
          for (int i = 0; i < n; ++i) {
            const Sample mean =
                pictures_.size() == 1 ? FromMap(cube, face, i, j, samples) : FromFiner(face, i, j);
            for (int c = 0; c < map.channels(); ++c)
              picture.at(face * n + i, j, c) = mean.value[static_cast<size_t>(c)];
          }
        }
      }
      if (n == 1) break;
      n /= 2;
    }
    for (const ImageD& picture : pictures_) cubes_.emplace_back(picture, EnvironmentMap::kCube);
    for (int face = 0; face < map.faces(); ++face) {
      for (int j = 0; j < map.h(); ++j) {
        for (int i = 0; i < map.w(); ++i) {
          const double v = map.Texel(face, i, j).largest;
          if (std::isfinite(v)) largest_ = std::max(largest_, v);
        }
      }
    }
  }

  double angle() const { return angle_; }  // of the map's texels
  Sample LookUp(const Vec& d, double angle) const {
    const auto texel = [](const Map& cube) { return std::sqrt(4 * kPi / 6) / cube.w(); };
    const double first = texel(cubes_[0]), last = texel(cubes_.back());
    if (!(angle > angle_)) return map_.LookUp(d);
    Sample sum(map_.channels());
    if (angle < first) {
      const double f = std::log(angle / angle_) / std::log(first / angle_);
      sum.Add(map_.LookUp(d), 1 - f), sum.Add(cubes_[0].LookUp(d), f);
    } else {
      const double level = std::log2(std::min(angle, last) / first), below = std::floor(level);
      sum.Add(cubes_[static_cast<size_t>(below)].LookUp(d), 1 - (level - below));
      if (level > below) sum.Add(cubes_[static_cast<size_t>(below) + 1].LookUp(d), level - below);
    }
    // Means may cancel, their errors do not; as much again for what is rounded from cube to cube.
    sum.largest = 2 * largest_;
    return sum;
  }

 private:
  Sample FromMap(const Map& cube, int face, int i, int j, int samples) const {
    Sample sum(map_.channels());
    for (int b = 0; b < samples; ++b) {
      for (int a = 0; a < samples; ++a) {
        const double s = 2 * (i + (a + 0.5) / samples) / cube.w() - 1,
                     t = 1 - 2 * (j + (b + 0.5) / samples) / cube.h();
        sum.Add(map_.LookUp(cube.Direction(face, s, t)), 1.0 / samples / samples);
      }
    }
    return sum;
  }
  // By solid angle from the level before the last one, which is being made.
  Sample FromFiner(int face, int i, int j) const {
    const ImageD& picture = pictures_[pictures_.size() - 2];
    const Map finer(picture, EnvironmentMap::kCube);
    Sample sum(map_.channels());
    double weight = 0;
    for (int k = 0; k < 4; ++k) {
      const double w = SolidAngle(finer, 2 * i + k % 2, 2 * j + k / 2);
      sum.Add(finer.Texel(face, 2 * i + k % 2, 2 * j + k / 2), w), weight += w;
    }
    for (double& v : sum.value) v /= weight;
    return sum;
  }

  const Map& map_;
  double angle_ = 0, largest_ = 0;
  std::deque<ImageD> pictures_;  // maps refer to them
  std::vector<Map> cubes_;
};

// Normals, positions and a viewer made the unit direction that is looked up, in the map's space.
class Mirror {
 public:
  Mirror(const Call& call, const EnvironmentParams& p, bool positions)
      : call_(call), p_(p), positions_(positions) {}

  struct Pixel {
    bool valid = false;
    Vec direction;
    double fresnel = 1;
  };
  Pixel At(int x, int y) const {
    Pixel pixel;
    const ImageD& normals = call_.in[0];
    if (!normals.roi.Contains({x, y, x + 1, y + 1})) return pixel;
    const auto vector = [&](const ImageD& image) {
      return Vec{image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
    };
    Vec n = vector(normals);
    if (p_.bits > 0 && Usable(Dot(n, n))) {
      const double length = Norm(n), codes = std::ldexp(1.0, p_.bits) - 1;
      for (double& v : n) v = 2 * (std::nearbyint((v / length + 1) / 2 * codes) / codes) - 1;
    }
    Vec u = {-p_.view[0], -p_.view[1], -p_.view[2]};
    if (positions_ && (!p_.camera || p_.camera->perspective())) {
      const Vec at = vector(call_.in[1]), eye = p_.eye ? *p_.eye : p_.camera->eye();
      u = {at[0] - eye[0], at[1] - eye[1], at[2] - eye[2]};
    } else if (p_.camera) {
      u = p_.camera->PixelRay(call_.out_spec.display_window, x, y).direction;
    }
    const bool along = p_.direction == EnvironmentDirection::kNormal;
    const double nn = Dot(n, n), uu = Dot(u, u), un = Dot(u, n);
    pixel.valid = Usable(nn) && ((along && !p_.fresnel) || Usable(uu));
    if (p_.fresnel) {
      const double g = 1 - std::min(1.0, std::fabs(un) / std::sqrt(uu * nn));
      pixel.fresnel = *p_.fresnel + (1 - *p_.fresnel) * std::pow(g, 5);
    }
    if (!pixel.valid) return pixel;
    Vec d = n;
    if (!along) d = {u[0] * nn - 2 * un * n[0], u[1] * nn - 2 * un * n[1], u[2] * nn - 2 * un * n[2]};
    const double length = Norm(d);
    for (double& v : d) v /= length;
    for (size_t k = 0; k < 3; ++k) {
      pixel.direction[k] =
          p_.matrix[4 * k] * d[0] + p_.matrix[4 * k + 1] * d[1] + p_.matrix[4 * k + 2] * d[2];
    }
    return pixel;
  }
  // Whether the normal may be off by all that it is.
  bool MayBeNothing(int x, int y) const {
    const ImageD& normals = call_.in[0];
    if (!normals.roi.Contains({x, y, x + 1, y + 1})) return false;
    double off = 0;
    for (int c = 0; c < 3; ++c) {
      const double each = call_.Tolerance(0, x, y, c);
      if (std::fabs(normals.at(x, y, c)) > 2 * each) return false;
      off += each;
    }
    return off > 0;
  }
  Ellipse Covered(int x, int y, const Vec& d) const {
    const auto step = [&](int by_x, int by_y) -> std::optional<Vec> {
      const Pixel there = At(x + by_x, y + by_y);
      if (!there.valid) return std::nullopt;
      Vec e = Normalized(there.direction);
      for (size_t k = 0; k < 3; ++k) e[k] = (by_x + by_y) * (e[k] - d[k]);
      return e;
    };
    return EllipseOf(MeanStep(step(-1, 0), step(1, 0)), MeanStep(step(0, -1), step(0, 1)));
  }
  // The larger, of across and down, of the smaller distances to the two neighbours that count.
  double Footprint(int x, int y, const Vec& direction) const {
    const auto distance = [&](int i, int j) {
      const Pixel there = At(i, j);
      if (!there.valid) return std::numeric_limits<double>::infinity();
      const Vec a = Normalized(direction), b = Normalized(there.direction);
      return Norm({a[0] - b[0], a[1] - b[1], a[2] - b[2]});
    };
    const double across = std::min(distance(x - 1, y), distance(x + 1, y));
    const double down = std::min(distance(x, y - 1), distance(x, y + 1));
    return std::max(std::isinf(across) ? 0 : across, std::isinf(down) ? 0 : down);
  }

 private:
  const Call& call_;
  const EnvironmentParams& p_;
  bool positions_;
};

// The mean of lookups over the ellipse that a pixel's reflection covers.
Sample Covered(const Call& call, const Mips& mips, const EnvironmentParams& p, const Mirror& mirror, int x,
               int y, const Vec& direction) {
  const Vec d = Normalized(direction);
  Ellipse ellipse = mirror.Covered(x, y, d);
  if (!(ellipse.longer > mips.angle())) return mips.LookUp(d, 0);
  if (ellipse.longer > 1) {
    for (double& v : ellipse.major) v /= ellipse.longer;
    ellipse.longer = 1;
  }
  const auto mean = [&](const Probes& probes) {
    Sample sum(call.out.channels);
    for (const Probe& probe : probes.all) {
      const Vec at = {d[0] + probe.off[0], d[1] + probe.off[1], d[2] + probe.off[2]};
      sum.Add(mips.LookUp(at, probes.width), probe.weight);
    }
    return sum;
  };
  const auto probes = [&](int more) {
    return ProbesOver(ellipse, p.filter == EnvironmentFilter::kEwa, p.anisotropy, mips.angle(), 1, more);
  };
  const Sample sum = mean(probes(0));
  for (const int more : {-1, 1}) {
    if (!probes(0).doubtful) break;
    const Sample other = mean(probes(more));
    for (size_t c = 0; c < sum.value.size(); ++c)
      call.Undecided(x, y, static_cast<int>(c), std::fabs(other.value[c] - sum.value[c]));
  }
  return sum;
}

void EvaluateEnvironment(const Call& call) {
  const auto& settings = std::any_cast<const ops::EnvironmentSettings&>(call.parameters);
  const EnvironmentParams& p = settings.params;
  const bool positions = call.in.size() == (settings.FromInput() ? 3 : 2);
  const ImageD kept = settings.FromInput() ? ImageD() : Doubles(settings.picture);
  const ImageD& picture = settings.FromInput() ? call.in.back() : kept;
  const Map map(picture, p.map, p.field_of_view);
  std::optional<Mips> mips;
  if (p.filter != EnvironmentFilter::kBilinear && !map.empty()) mips.emplace(map);
  std::optional<Lobe> lobe;
  if (p.lobe > 0 && !map.empty()) lobe.emplace(map, p.lobe, p.table);
  const Mirror mirror(call, p, positions);
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      const Mirror::Pixel pixel = mirror.At(x, y);
      if (mirror.MayBeNothing(x, y) || (pixel.valid && map.MayBeMissed(pixel.direction)))
        call.Undecided(x, y);
      Sample sample(call.out.channels);
      if (!map.empty() && pixel.valid) {
        if (mips && p.filter != EnvironmentFilter::kMip) {
          sample = Covered(call, *mips, p, mirror, x, y, pixel.direction);
        } else if (mips) {
          sample = mips->LookUp(pixel.direction, mirror.Footprint(x, y, pixel.direction));
        } else {
          sample = lobe ? lobe->Mean(pixel.direction) : map.LookUp(pixel.direction);
        }
      }
      for (int c = 0; c < call.out.channels; ++c) {
        const double v = sample.value[static_cast<size_t>(c)];
        call.out.at(x, y, c) = v == 0 || c == call.out_spec.alpha ? v : v * pixel.fresnel;
        // A lat-long place is exact to half an ULP of an eighth of a turn: texels times that.
        const double texels = map.kind() == EnvironmentMap::kLatLong ? map.w() / 8.0 + map.h() / 3.0 : 0;
        if (call.scale != nullptr)
          call.scale->at(x, y, c) = std::max(sample.largest * (1 + texels), kSmallestScale);
      }
    }
  }
}

// Along an edge of a pixel: the texels of `from` along the chord between its ends, by the mapping's
// derivative in its middle; where a seam runs through that, on one side of it.
struct Footprint {
  double texels = 0;
  bool edge = false, nowhere = false;  // no derivative; nor any place
  int Lookups() const { return edge ? 8 : static_cast<int>(std::clamp(std::ceil(texels - 0.01), 1.0, 64.0)); }
};
Footprint FootprintAlong(const Map& from, const Vec& a, const Vec& b) {
  if (Norm(a) == 0 || Norm(b) == 0) return {0, true, false};
  const auto at = [&](double part) {
    Vec d;
    for (size_t k = 0; k < 3; ++k) d[k] = (0.5 - part) * a[k] / Norm(a) + (0.5 + part) * b[k] / Norm(b);
    return d;
  };
  if (Norm(at(0)) < 1e-10 || Norm(at(-0.005)) < 1e-10 || Norm(at(0.005)) < 1e-10) return {64, false, false};
  double most = -1;
  for (const auto& [low, high] : {std::pair{-0.005, 0.005}, std::pair{-0.005, 0.0}, std::pair{0.0, 0.005}}) {
    const double texels = from.TexelsBetween(at(low), at(high));
    if (texels < 0) continue;
    most = std::max(most, texels / (high - low));
    if (low + high == 0) break;
  }
  if (most >= 0) return {most, false, false};
  return {0, true, !from.Has(a) && !from.Has(at(0)) && !from.Has(b)};
}

// The view's axes in the space that it is turned in: right, up and forward of a view along +z with -x to the
// right, by the three turns' definition.
Vec InSpace(const YawPitchRoll& degrees, const Vec& d) {
  const auto angle = [&](size_t k) { return std::fmod(degrees[k], 360.0) * kPi / 180; };
  const double yaw = angle(0), pitch = angle(1), roll = angle(2);
  const Vec forward = {-std::sin(yaw) * std::cos(pitch), std::sin(pitch), std::cos(yaw) * std::cos(pitch)};
  const Vec level = {-std::cos(yaw), 0, -std::sin(yaw)};  // to the right before the roll
  const Vec above = Cross(level, forward);
  Vec v;
  for (size_t k = 0; k < 3; ++k) {
    const double right = std::cos(roll) * level[k] - std::sin(roll) * above[k];
    const double up = std::sin(roll) * level[k] + std::cos(roll) * above[k];
    v[k] = -d[0] * right + d[1] * up + d[2] * forward[k];
  }
  return v;
}
Vec OfView(const YawPitchRoll& degrees, const Vec& v) {
  return {Dot(v, InSpace(degrees, {1, 0, 0})), Dot(v, InSpace(degrees, {0, 1, 0})),
          Dot(v, InSpace(degrees, {0, 0, 1}))};
}

void EvaluateConvert(const Call& call) {
  const auto& p = std::any_cast<const EnvironmentConvertParams&>(call.parameters);
  const Map from(call.in[0], p.from, p.from_field_of_view);
  const Roi& window = call.out_spec.data_window;
  const ImageD none;
  const Map to(none, p.to, window.width(), window.height(), p.to_field_of_view);
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      Sample sum(call.out.channels);
      for (int face = 0; face < to.faces() && !from.empty(); ++face) {
        // The face's texel that is this pixel, if it has it.
        const auto [i, j] = to.TexelAt(face, x - window.x0, y - window.y0);
        if (i < 0 || j < 0 || i >= to.w() || j >= to.h()) continue;
        const auto direction = [&](double du, double dv) {
          const Vec d = InSpace(p.rotation, to.Direction(face, 2 * (i + 0.5 + du) / to.w() - 1,
                                                         1 - 2 * (j + 0.5 + dv) / to.h()));
          Vec turned;
          for (size_t k = 0; k < 3; ++k)
            turned[k] = p.matrix[4 * k] * d[0] + p.matrix[4 * k + 1] * d[1] + p.matrix[4 * k + 2] * d[2];
          return OfView(p.from_rotation, turned);
        };
        const Footprint across = FootprintAlong(from, direction(-0.5, 0), direction(0.5, 0));
        const Footprint down = FootprintAlong(from, direction(0, -0.5), direction(0, 0.5));
        if (p.samples == 0 && across.nowhere && down.nowhere) break;
        const int nx = p.samples > 0 ? p.samples : across.Lookups();
        const int ny = p.samples > 0 ? p.samples : down.Lookups();
        for (int b = 0; b < ny; ++b) {
          for (int a = 0; a < nx; ++a) {
            const Vec d = direction((a + 0.5) / nx - 0.5, (b + 0.5) / ny - 0.5);
            if (Norm(d) > 0) sum.Add(from.LookUp(d), 1.0 / nx / ny);
            if (from.MayBeMissed(d)) call.Undecided(x, y);
          }
        }
        break;
      }
      for (int c = 0; c < call.out.channels; ++c) {
        call.out.at(x, y, c) = sum.value[static_cast<size_t>(c)];
        const double texels = from.kind() == EnvironmentMap::kLatLong ? from.w() / 8.0 + from.h() / 3.0 : 0;
        if (call.scale != nullptr)
          call.scale->at(x, y, c) = std::max(sum.largest * (1 + texels), kSmallestScale);
      }
    }
  }
}

constexpr Roi kEverything{INT32_MIN / 2, INT32_MIN / 2, INT32_MAX / 2, INT32_MAX / 2};
// The first, with a footprint's neighbours.
Roi AllButTheFirst(const std::any& parameters, int input, const Roi& out) {
  const auto& p = std::any_cast<const ops::EnvironmentSettings&>(parameters).params;
  const int reach = p.filter == EnvironmentFilter::kBilinear ? 0 : 1;
  return input == 0 ? Roi{out.x0 - reach, out.y0 - reach, out.x1 + reach, out.y1 + reach} : kEverything;
}
Roi All(const std::any&, int, const Roi&) { return kEverything; }

}  // namespace

std::vector<Entry> EnvironmentEntries() {
  return {{"envmap", EvaluateEnvironment, AllButTheFirst}, {"envconvert", EvaluateConvert, All}};
}

}  // namespace tessera::reference
