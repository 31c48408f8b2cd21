// Reference of the lookups: coordinate images through tables, colours through a 3-D table, channels through
// 1-D tables.
#include "tessera/ops/lookup.h"

#include <algorithm>
#include <any>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "model/lookup_settings.h"
#include "reference/point_loop.h"
#include "reference/probes.h"
#include "reference/reference.h"
#include "reference/table_lookup.h"

namespace tessera::reference {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class LookupEvaluation {
 public:
  LookupEvaluation(const Call& call, const model::LookupSettings& settings)
      : call_(call), p_(settings.lookup) {
    if (settings.table.empty() && call.in[1].roi.empty()) return;
    levels_.push_back(settings.table.empty() ? SourceOf(call.in[1], settings.layout)
                                             : SourceOf(settings.table));
    if (p_.filter == TableFilter::kMipmap || Covers()) BuildLevels();
    axes_ = p_.axes;
    const size_t needed = levels_[0].sizes.size() + (p_.projective ? 1 : 0);
    for (int a = 0; axes_.size() < needed; ++a) axes_.push_back(a);
  }

  void Run() const {
    ImageD& out = call_.out;
    if (levels_.empty()) return;
    for (int y = out.roi.y0; y < out.roi.y1; ++y) {
      for (int x = out.roi.x0; x < out.roi.x1; ++x) Pixel(x, y);
    }
  }

 private:
  void BuildLevels() {
    // Channel by channel: an image has as many as it likes, a table at most four.
    const Source first = levels_[0];
    int64_t entries = 1;
    for (const int n : first.sizes) entries *= n;
    for (int c = 0; c < first.channels; ++c) {
      std::vector<float> samples;
      for (int64_t i = 0; i < entries; ++i) samples.push_back(static_cast<float>(first.read(i, c)));
      const auto k = static_cast<size_t>(c);
      const std::vector<double> border =
          k < p_.border.size() ? std::vector{p_.border[k]} : std::vector<double>();
      const Table table(first.sizes, 1, samples, first.ends ? TableAlign::kEnds : TableAlign::kCentres);
      chains_.push_back(MipChain(table, MipFilter::kBox, p_.wrap, border));
    }
    for (int64_t i = 0; i < entries; ++i) {
      for (int c = 0; c < first.channels; ++c) finite_ = finite_ && std::isfinite(first.read(i, c));
    }
    levels_.clear();
    for (size_t level = 0; level < chains_[0].size(); ++level) {
      Source source = SourceOf(chains_[0][level]);
      source.channels = first.channels;
      source.read = [this, level](int64_t entry, int c) {
        return double{chains_[static_cast<size_t>(c)][level].At(entry, 0)};
      };
      levels_.push_back(source);
    }
  }

  bool Covers() const { return p_.filter == TableFilter::kTrilinear || p_.filter == TableFilter::kEwa; }

  double Raw(int x, int y, int channel) const { return call_.in[0].at(x, y, channel); }
  std::vector<double> Coordinates(int x, int y) const {
    std::vector<double> coords;
    const size_t dims = levels_[0].sizes.size();
    for (size_t a = 0; a < dims; ++a) coords.push_back(Raw(x, y, axes_[a]));
    if (p_.projective) {
      const auto q = static_cast<float>(Raw(x, y, axes_[dims]));
      for (double& s : coords) {
        s = q >= std::numeric_limits<float>::min() ? static_cast<float>(s) / q : kNaN;
      }
    }
    return coords;
  }

  // log2 of the longer of the steps along x and y, each the shorter one of both sides.
  double Level(int x, int y) const {
    const std::vector<double> here = Coordinates(x, y);
    const Roi& window = call_.in_specs[0].data_window;
    const Source& table = levels_[0];
    double longest = 0;
    for (const bool along_x : {true, false}) {
      std::optional<double> step;
      for (const int side : {-1, 1}) {
        const int nx = along_x ? x + side : x, ny = along_x ? y : y + side;
        if (!window.Contains({nx, ny, nx + 1, ny + 1})) continue;
        const std::vector<double> there = Coordinates(nx, ny);
        double squares = 0;
        for (size_t a = 0; a < here.size(); ++a) {
          const double d = (there[a] - here[a]) * (table.ends ? table.sizes[a] - 1 : table.sizes[a]);
          squares += d * d;
        }
        if (std::isfinite(squares)) step = std::min(step.value_or(squares), squares);
      }
      longest = std::max(longest, step.value_or(0));
    }
    return longest > 1 ? std::min(0.5 * std::log2(longest), static_cast<double>(levels_.size() - 1)) : 0;
  }

  // Entries of level 0 for a unit of the coordinate, 0 where there is one entry for all.
  double Entries(size_t a) const {
    const int n = levels_[0].sizes[a];
    const Wrap wrap = WrapOf(p_, a);
    if (n == 1 && wrap != Wrap::kGlClamp && wrap != Wrap::kBlack) return 0;
    return levels_[0].ends ? n - 1 : n;
  }
  double Cell(size_t level) const {
    double widest = 1;
    for (size_t a = 0; a < levels_[0].sizes.size(); ++a) {
      const int n = levels_[level].sizes[a];
      if (Entries(a) == 0) continue;
      const double own = levels_[0].ends ? n - 1 : n;
      widest = std::max(widest, own > 0 ? Entries(a) / own : levels_[0].sizes[a]);
    }
    return widest;
  }
  // To a neighbour, in entries of level 0, along the axis of the picture.
  std::optional<Vector3> Step(int x, int y, int by_x, int by_y) const {
    const int nx = x + by_x, ny = y + by_y;
    if (!call_.in_specs[0].data_window.Contains({nx, ny, nx + 1, ny + 1})) return std::nullopt;
    if (p_.mask >= 0 && (Raw(nx, ny, p_.mask) == 0 || std::isnan(Raw(nx, ny, p_.mask)))) return std::nullopt;
    const std::vector<double> here = Coordinates(x, y), there = Coordinates(nx, ny);
    Vector3 step = {};
    for (size_t a = 0; a < here.size(); ++a) {
      if (Entries(a) > 0) step[a] = (by_x + by_y) * (there[a] - here[a]) * Entries(a);
    }
    return step;
  }
  Found UnderPixel(int x, int y) const {
    const Ellipse ellipse = EllipseOf(MeanStep(Step(x, y, -1, 0), Step(x, y, 1, 0)),
                                      MeanStep(Step(x, y, 0, -1), Step(x, y, 0, 1)));
    std::vector<double> at = Coordinates(x, y);
    bool lost = false;
    for (size_t a = 0; a < at.size(); ++a) {
      const Wrap wrap = WrapOf(p_, a);
      const auto s = static_cast<float>(at[a]);
      // Steps go on into what a mirror shows.
      if (wrap == Wrap::kRepeat) at[a] = s - std::floor(s);
      if (wrap == Wrap::kMirror) at[a] = s - 2 * std::floor(s / 2);
      lost = lost || std::isnan(at[a]);
    }
    if (lost || !(ellipse.longer > 1)) return LookUp(levels_[0], p_, Coordinates(x, y));
    const Probes probes = ProbesOf(ellipse, 0);
    Found found = Mean(x, y, at, probes, true);
    for (const int more : {-1, 1}) {
      if (!probes.doubtful) break;
      const Found other = Mean(x, y, at, ProbesOf(ellipse, more), false);
      for (size_t c = 0; c < found.value.size(); ++c)
        call_.Undecided(x, y, static_cast<int>(c), std::fabs(other.value[c] - found.value[c]));
    }
    return found;
  }
  Probes ProbesOf(const Ellipse& ellipse, int more) const {
    return ProbesOver(ellipse, p_.filter == TableFilter::kEwa, p_.anisotropy, 1, 4 * Cell(levels_.size() - 1),
                      more);
  }
  Found Mean(int x, int y, const std::vector<double>& at, const Probes& probes, bool judge) const {
    size_t k = 0;
    while (k + 1 < levels_.size() && Cell(k + 1) <= probes.width) ++k;
    const double next =
        k + 1 < levels_.size() ? std::max(0.0, (probes.width - Cell(k)) / (Cell(k + 1) - Cell(k))) : 0;
    Found sum;
    sum.value.assign(static_cast<size_t>(levels_[0].channels), 0);
    sum.largest = sum.difference = sum.value;
    for (const auto& [level, share] : {std::pair(k, 1 - next), std::pair(k + 1, next)}) {
      if (share == 0) continue;
      for (const Probe& probe : probes.all) {
        std::vector<double> place = at;
        double off = 0;
        for (size_t a = 0; a < at.size(); ++a) {
          if (Entries(a) > 0) place[a] += probe.off[a] / Entries(a);
          // A float's rounding, twice as it may be on either side.
          off += 2 * levels_[level].sizes[a] * std::clamp(std::fabs(place[a]), 1.0, 5.0);
        }
        const Found one = LookUp(levels_[level], p_, place);
        for (size_t c = 0; c < sum.value.size(); ++c) {
          sum.value[c] += share * probe.weight * one.value[c];
          sum.largest[c] = std::max(sum.largest[c], one.largest[c]);
          sum.difference[c] = std::max(sum.difference[c], one.difference[c]);
        }
        sum.units = one.units + 1;
        sum.position_units = std::max(sum.position_units, one.position_units + off);
        if (judge && !finite_) Doubt(x, y, levels_[level], place, one);
      }
    }
    return sum;
  }
  // Entries that are no numbers may have weight or not within the rounding of a place.
  void Doubt(int x, int y, const Source& level, const std::vector<double>& place, const Found& found) const {
    for (size_t corner = 0; corner < size_t{1} << place.size(); ++corner) {
      std::vector<double> aside = place;
      for (size_t a = 0; a < place.size(); ++a) aside[a] += ((corner >> a) % 2 != 0 ? 1 : -1) * 0x1p-20;
      const Found other = LookUp(level, p_, aside);
      for (size_t c = 0; c < found.value.size(); ++c) {
        if (std::isfinite(found.value[c]) != std::isfinite(other.value[c]))
          call_.Undecided(x, y, static_cast<int>(c), kEndlessJump);
      }
    }
  }

  void Pixel(int x, int y) const {
    ImageD& out = call_.out;
    Found found;
    const double mask = p_.mask >= 0 ? Raw(x, y, p_.mask) : 1;
    if (mask == 0 || std::isnan(mask)) {
      for (int c = 0; c < out.channels; ++c) {
        found.value.push_back(c < call_.in[0].channels ? Raw(x, y, c) : 0);
        found.largest.push_back(0);
        found.difference.push_back(0);
      }
    } else if (p_.filter == TableFilter::kMipmap) {
      const double level = Level(x, y), lower = std::floor(level), t = level - lower;
      const auto l = static_cast<size_t>(lower);
      found = LookUp(levels_[l], p_, Coordinates(x, y));
      if (t > 0) {
        const Found upper = LookUp(levels_[l + 1], p_, Coordinates(x, y));
        for (size_t c = 0; c < found.value.size(); ++c) {
          found.value[c] = (1 - t) * found.value[c] + t * upper.value[c];
          found.largest[c] = std::max(found.largest[c], upper.largest[c]);
        }
      }
      // The level itself is a float.
      for (double& v : found.largest) v *= 32;
    } else {
      found = Covers() ? UnderPixel(x, y) : LookUp(levels_[0], p_, Coordinates(x, y));
    }
    // A mask of exactly 0 is found by moving it; one that could have been 0 is not.
    const bool doubtful = p_.mask >= 0 && mask != 0 && std::fabs(mask) <= call_.Tolerance(0, x, y, p_.mask);
    for (int c = 0; c < out.channels; ++c) {
      const double value = found.value[static_cast<size_t>(c)];
      out.at(x, y, c) = value;
      if (doubtful) {
        const double jump = std::fabs(value - (c < call_.in[0].channels ? Raw(x, y, c) : 0));
        call_.Undecided(x, y, c, std::isfinite(jump) ? jump : kEndlessJump);
      }
      if (call_.scale != nullptr) call_.scale->at(x, y, c) = found.Scale(static_cast<size_t>(c));
    }
  }

  const Call& call_;
  const LookupParams& p_;
  std::vector<Source> levels_;
  std::vector<std::vector<Table>> chains_;  // by channel, then level
  bool finite_ = true;                      // all entries
  std::vector<int> axes_;
};

void EvaluateLookup(const Call& call) {
  LookupEvaluation(call, std::any_cast<const model::LookupSettings&>(call.parameters)).Run();
}
Roi LookupInput(const std::any& parameters, int input, const Roi& out) {
  if (input == 1) return {-(1 << 30), -(1 << 30), 1 << 30, 1 << 30};
  const auto& settings = std::any_cast<const model::LookupSettings&>(parameters);
  const TableFilter filter = settings.lookup.filter;
  const bool neighbours =
      filter == TableFilter::kMipmap || filter == TableFilter::kTrilinear || filter == TableFilter::kEwa;
  return neighbours ? Inflate(out, 1, 1) : out;
}

// Into [0,1], NaN to 0.
double Unit(double v) { return v > 0 ? std::min(v, 1.0) : 0.0; }

void EvaluateTable3D(const Call& call) {
  const auto& settings = std::any_cast<const model::Table3DSettings&>(call.parameters);
  const Source table = SourceOf(settings.table);
  const Roi& r = call.out.roi;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      const ImageD& in = call.in[0];
      const Found found =
          LookUp(table, settings.lookup, {Unit(in.at(x, y, 0)), Unit(in.at(x, y, 1)), Unit(in.at(x, y, 2))});
      for (int c = 0; c < call.out.channels; ++c) {
        const auto k = static_cast<size_t>(c);
        call.out.at(x, y, c) = c < 3 ? found.value[k] : in.at(x, y, c);
        // Scales are stated for a bound of 4 u, and an operation without a row has one of 2 u.
        if (call.scale != nullptr) call.scale->at(x, y, c) = c < 3 ? 2 * found.Scale(k) : 0;
      }
    }
  }
}

void EvaluateTables1D(const Call& call) {
  const auto& settings = std::any_cast<const model::Tables1DSettings&>(call.parameters);
  ForEachSample(call, [&](int x, int y, int c) {
    const double v = call.in[0].at(x, y, c);
    const auto k = static_cast<size_t>(c);
    if (k >= settings.tables.size() || settings.tables[k].empty()) return std::pair(v, 0.0);
    const Found found = LookUp(SourceOf(settings.tables[k]), settings.lookup, {Unit(v)});
    return std::pair(found.value[0],
                     (settings.lookup.filter == TableFilter::kCubic ? 4 : 1) * found.largest[0]);
  });
}

}  // namespace

std::vector<Entry> LookupEntries() {
  return {{"lookup", EvaluateLookup, LookupInput}, {"table3d", EvaluateTable3D}, {"table", EvaluateTables1D}};
}

}  // namespace tessera::reference
