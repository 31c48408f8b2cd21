// Distance fields of solids and of volumes.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "base/number_text.h"
#include "model/distance_transform.h"
#include "model/solid_node.h"
#include "model/volume_data.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"
#include "tessera/volume.h"

namespace tessera {
namespace {

bool IsInteger(PixelType type) { return type == PixelType::kUint8 || type == PixelType::kUint16; }

// The spec whose codes hold distances within +-range.
VolumeSpec DistanceSpec(VolumeSpec spec, double range) {
  if (!(range >= 0) || !std::isfinite(range)) {
    throw Error("distance field",
                "found a range of " + base::NumberText(range) + ", expected a positive number");
  }
  spec.scale = 1;
  spec.bias = 0;
  if (IsInteger(spec.type)) {
    double longest = 0;
    for (size_t a = 0; a < 3; ++a) longest = std::max(longest, spec.size[a] * spec.spacing[a]);
    if (range == 0) range = longest / 8;
    spec.scale = 2 * range;
    spec.bias = -range;
  }
  return spec;
}

// What is known about the surface near one voxel: the nearest point of the plane through it, a disc of it.
struct Feature {
  float point[3] = {}, normal[3] = {};
};

// Discs a little wider than half the diagonal between neighbours leave no holes between them.
constexpr double kDisc = 0.75;  // times the largest spacing

double DistanceToDisc(const Feature& f, const Vector3& p, double radius) {
  double along = 0, square = 0;
  for (size_t a = 0; a < 3; ++a) {
    const double d = p[a] - f.point[a];
    along += d * f.normal[a];
    square += d * d;
  }
  const double lateral = std::sqrt(std::max(square - along * along, 0.0)) - radius;
  return lateral <= 0 ? std::fabs(along) : std::hypot(along, lateral);
}

}  // namespace

namespace {

// The distances of a solid in a box of voxels: its halves are given what of the solid matters there, down to
// blocks whose voxels are measured.
class SolidField {
 public:
  explicit SolidField(model::VolumeData& data) : data_(data), spec_(data.spec) {
    if (IsInteger(spec_.type)) range_ = -spec_.bias;
  }
  void Fill(const model::SolidNode& solid) {
    int edge = kLeast;
    while (edge < std::max({spec_.size[0], spec_.size[1], spec_.size[2]})) edge *= 2;
    Fill(solid, {0, 0, 0}, edge);
  }

 private:
  static constexpr int kLeast = model::kSolidRow;

  void Fill(const model::SolidNode& solid, const std::array<int, 3>& from, int edge) {
    std::array<int, 3> to;
    for (size_t a = 0; a < 3; ++a) to[a] = std::min(from[a] + edge, spec_.size[a]);
    const model::SolidWithin within = solid.Within(BallAround(from, to));
    const model::SolidNode& part = within.part != nullptr ? *within.part : solid;
    if (within.low > range_ || within.high < -range_) {
      FillWith(within.low > 0 ? range_ : -range_, from, to);
    } else if (edge == kLeast) {
      Measure(part, from, to);
    } else {
      const int half = edge / 2;
      for (int k = from[2]; k < to[2]; k += half) {
        for (int j = from[1]; j < to[1]; j += half) {
          for (int i = from[0]; i < to[0]; i += half) Fill(part, {i, j, k}, half);
        }
      }
    }
    if (edge == model::kBrickEdge) data_.Trim();
  }

  model::Ball BallAround(const std::array<int, 3>& from, const std::array<int, 3>& to) const {
    double middle[3], square = 0;
    for (size_t a = 0; a < 3; ++a) {
      middle[a] = 0.5 * (from[a] + to[a] - 1);
      const double half = 0.5 * (to[a] - 1 - from[a]) * spec_.spacing[a];
      square += half * half;
    }
    return {spec_.Position(middle[0], middle[1], middle[2]), std::sqrt(square)};
  }

  double CodeOf(double distance) const { return (distance - data_.code_bias) / data_.code_scale; }

  void Measure(const model::SolidNode& solid, const std::array<int, 3>& from, const std::array<int, 3>& to) {
    model::SolidRow row;
    row.count = to[0] - from[0];
    for (int i = 0; i < row.count; ++i) row.x[i] = spec_.Position(from[0] + i, 0, 0)[0];
    for (int k = from[2]; k < to[2]; ++k) {
      for (int j = from[1]; j < to[1]; ++j) {
        const Vector3 p = spec_.Position(0, j, k);
        std::fill_n(row.y, kLeast, p[1]);
        std::fill_n(row.z, kLeast, p[2]);
        double codes[kLeast];
        solid.Measure(row, codes);
        for (int i = 0; i < row.count; ++i) codes[i] = CodeOf(codes[i]);
        data_.SetCodes(from[0], row.count, j, k, codes);
      }
    }
  }

  void FillWith(double distance, const std::array<int, 3>& from, const std::array<int, 3>& to) {
    const std::vector<double> codes(static_cast<size_t>(to[0] - from[0]), CodeOf(distance));
    for (int k = from[2]; k < to[2]; ++k) {
      for (int j = from[1]; j < to[1]; ++j) data_.SetCodes(from[0], to[0] - from[0], j, k, codes.data());
    }
  }

  model::VolumeData& data_;
  const VolumeSpec& spec_;
  double range_ = std::numeric_limits<double>::infinity();  // that codes can hold
};

}  // namespace

Volume DistanceField(const Solid& solid, const VolumeSpec& wanted, double range) {
  Volume volume(DistanceSpec(wanted, range));
  model::VolumeData& data = *volume.data();
  SolidField(data).Fill(*solid.node_);
  data.FillBorder();
  return volume;
}

namespace {

// A volume's surface: the piece of it that each voxel beside it knows.
class Surface {
 public:
  // Where `volume` passes `iso`; inside is below it or above.
  Surface(const Volume& volume, double iso, bool inside_below)
      : volume_(volume),
        spec_(volume.spec()),
        iso_(iso),
        sign_(inside_below ? 1 : -1),
        set_(static_cast<size_t>(spec_.size[0]) * spec_.size[1] * spec_.size[2]),
        inside_(set_.size()),
        feature_of_(set_.size(), -1) {
    ForVoxels([&](int i, int j, int k, size_t at) { inside_[at] = Level(i, j, k) <= 0; });
    ForVoxels([&](int i, int j, int k, size_t at) {
      const std::optional<Feature> f = Find(i, j, k);
      if (!f) return;
      set_[at] = 1;
      feature_of_[at] = static_cast<int32_t>(features_.size());
      features_.push_back(*f);
    });
  }

  // Calls f(i, j, k, index) for every voxel.
  template <typename F>
  void ForVoxels(const F& f) const {
    size_t at = 0;
    for (int k = 0; k < spec_.size[2]; ++k) {
      for (int j = 0; j < spec_.size[1]; ++j) {
        for (int i = 0; i < spec_.size[0]; ++i, ++at) f(i, j, k, at);
        volume_.data()->Trim();
      }
    }
  }

  // Voxels that know a piece of it.
  const std::vector<uint8_t>& set() const { return set_; }
  bool IsInside(size_t at) const { return inside_[at] != 0; }

  // From the place of a voxel to the piece that voxel `known` knows, or, where `around`, to the nearest of
  // its and its neighbours'. Pieces are discs of that radius.
  double Distance(const Vector3& p, int32_t known, bool around, double radius) const {
    double distance = ToPiece(static_cast<size_t>(known), p, radius);
    if (!around) return distance;
    const auto& n = spec_.size;
    const int u = known % n[0], v = known / n[0] % n[1], w = known / n[0] / n[1];
    for (int c = std::max(w - 1, 0); c <= std::min(w + 1, n[2] - 1); ++c) {
      for (int b = std::max(v - 1, 0); b <= std::min(v + 1, n[1] - 1); ++b) {
        for (int a = std::max(u - 1, 0); a <= std::min(u + 1, n[0] - 1); ++a) {
          const size_t at = (static_cast<size_t>(c) * n[1] + b) * n[0] + a;
          if (feature_of_[at] >= 0) distance = std::min(distance, ToPiece(at, p, radius));
        }
      }
    }
    return distance;
  }

 private:
  // Negative inside, whatever side that is.
  double Level(int i, int j, int k) const { return sign_ * (volume_.At(i, j, k) - iso_); }
  double ToPiece(size_t at, const Vector3& p, double radius) const {
    return DistanceToDisc(features_[static_cast<size_t>(feature_of_[at])], p, radius);
  }

  // Of a voxel with a neighbour on the other side.
  std::optional<Feature> Find(int i, int j, int k) const {
    const auto& n = spec_.size;
    const double here = Level(i, j, k);
    const int at[3] = {i, j, k};
    double slope[3] = {0, 0, 0}, cut = std::numeric_limits<double>::infinity();
    double cut_offset = 0;
    size_t cut_axis = 0;
    bool crossed = false;
    for (size_t a = 0; a < 3; ++a) {
      double side[2] = {here, here};
      for (int way = 0; way < 2; ++way) {
        int p[3] = {i, j, k};
        p[a] += way == 0 ? -1 : 1;
        if (p[a] < 0 || p[a] >= n[a]) continue;
        side[way] = Level(p[0], p[1], p[2]);
        if ((side[way] <= 0) == (here <= 0)) continue;
        crossed = true;
        const double t = here / (here - side[way]) * spec_.spacing[a];
        if (t < cut) cut = t, cut_axis = a, cut_offset = way == 0 ? -t : t;
      }
      // The steeper one-sided difference across the surface keeps thin parts in place.
      const bool both = at[a] > 0 && at[a] + 1 < n[a];
      slope[a] = (side[1] - side[0]) / ((both ? 2 : 1) * spec_.spacing[a]);
    }
    if (!crossed) return std::nullopt;
    Feature f;
    const double square = slope[0] * slope[0] + slope[1] * slope[1] + slope[2] * slope[2];
    const Vector3 p = spec_.Position(i, j, k);
    // To the plane of the gradient, but no further than the nearest crossing of an axis.
    const double length = std::sqrt(square), along = square > 0 ? here / length : cut + 1;
    if (square > 0 && std::fabs(along) <= cut) {
      for (size_t a = 0; a < 3; ++a) {
        f.normal[a] = static_cast<float>(slope[a] / length);
        f.point[a] = static_cast<float>(p[a] - along * slope[a] / length);
      }
    } else {
      for (size_t a = 0; a < 3; ++a) f.point[a] = static_cast<float>(p[a] + (a == cut_axis ? cut_offset : 0));
      f.normal[cut_axis] = 1;
    }
    return f;
  }

  const Volume& volume_;
  const VolumeSpec& spec_;
  const double iso_, sign_;
  std::vector<uint8_t> set_, inside_;
  std::vector<Feature> features_;
  std::vector<int32_t> feature_of_;  // by voxel, -1 for none
};

}  // namespace

Volume DistanceField(const Volume& volume, const DistanceFieldParams& params) {
  VolumeSpec wanted = volume.spec();
  wanted.type = params.type;
  const VolumeSpec spec = DistanceSpec(wanted, params.range);
  const auto& n = spec.size;
  if (static_cast<double>(n[0]) * n[1] * n[2] > std::numeric_limits<int32_t>::max()) {
    throw DataError("volume", "found " + std::to_string(n[0]) + "x" + std::to_string(n[1]) + "x" +
                                  std::to_string(n[2]) +
                                  " voxels, expected fewer than 2^31 of which distances are computed");
  }
  const Surface surface(volume, params.iso, params.inside_below);

  Volume result(spec);
  model::VolumeData& data = *result.data();
  std::vector<int32_t> nearest;
  const std::vector<float> squared = model::SquaredDistances(n, surface.set(), spec.spacing, &nearest);
  const double widest = std::max({spec.spacing[0], spec.spacing[1], spec.spacing[2]});
  const double none = widest * (n[0] + n[1] + n[2]);  // no surface at all
  surface.ForVoxels([&](int i, int j, int k, size_t at) {
    double distance = none;
    if (nearest[at] >= 0) {
      // Near the surface a neighbour of the nearest voxel may hold the nearest piece.
      const bool around = squared[at] < 16 * widest * widest;
      distance = surface.Distance(spec.Position(i, j, k), nearest[at], around, kDisc * widest);
    }
    const double d = surface.IsInside(at) ? -distance : distance;
    if (i == 0) data.Trim();
    data.SetCode(i, j, k, (d - data.code_bias) / data.code_scale);
  });
  data.FillBorder();
  return result;
}

}  // namespace tessera
